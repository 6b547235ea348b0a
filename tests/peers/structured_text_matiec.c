/* Reference outputs of the exported function block, compiled by MATIEC (https://github.com/beremiz/matiec).

   1. vasos controller st --gains Kc=1.8,Ti=20,Td=1.5,N=8,b=0.7,c=0.2 --sample-time 0.2 --low 1 --high 3.5
      --start 2 -o pid.st, and behind it a program that calls the block:
        PROGRAM main VAR ctl : PID_I2GL; END_VAR ctl(SP := 10.0, PV := 9.0); END_PROGRAM
        CONFIGURATION config RESOURCE res ON PLC
          TASK tsk(INTERVAL := T#200ms, PRIORITY := 0); PROGRAM inst WITH tsk : main;
        END_RESOURCE END_CONFIGURATION
   2. iec2c -I matiec/lib pid.st
   3. cc -I matiec/lib/C -I . structured_text_matiec.c -lm -o run && ./run > structured_text_matiec.csv

   The inputs are a walk of a linear congruential generator, rounded so that the file holds them exactly. */
#include "iec_std_lib.h"
#include "POUS.h"
#include "POUS.c"
#include <math.h>
#include <stdint.h>
#include <stdio.h>

TIME __CURRENT_TIME;
BOOL __DEBUG;

static uint64_t state = 20101218;

static double uniform(double low, double high) {
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    return low + (high - low) * (double)(state >> 11) / 9007199254740992.0;
}

static double tidy(double value) { return round(value * 1024.0) / 1024.0; }

int main(void) {
    PID_I2GL b;
    PID_I2GL_init__(&b, 0);
    double sp = 10, pv = 10, man = 2, kc = 1.75, ti = 20, td = 1.5, nf = 8, wb = 0.75, wc = 0.25, hi = 3.5;
    int s1 = 0, s2 = 1, clip = 0;
    printf("sp,pv,man,s2,s1,clip_i,kc,ti,td,nf,wb,wc,lo,hi,out,held\n");
    for (int k = 0; k < 1500; k++) {
        if (uniform(0, 1) < 0.02) sp = tidy(uniform(5, 15));
        pv = tidy(sp + uniform(-1.5, 1.5));
        if (uniform(0, 1) < 0.03) {
            switch ((int)uniform(0, 8)) {
            case 0: s2 = !s2; break;
            case 1: s1 = !s1; break;
            case 2: clip = !clip; break;
            case 3: kc = tidy(uniform(-3, 3)); break;
            case 4: td = uniform(0, 1) < 0.3 ? 0.0 : tidy(uniform(0.01, 4)); break;
            case 5: nf = tidy(uniform(2, 25)); ti = tidy(uniform(1, 60)); break;
            case 6: wb = tidy(uniform(0, 2)); wc = tidy(uniform(0, 2)); break;
            default: hi = tidy(uniform(2, 5)); man = tidy(uniform(0, 6)); break;
            }
        }
        double shown = k % 97 == 50 ? NAN : pv;
        b.SP.value = sp; b.PV.value = shown; b.MAN.value = man;
        b.S1.value = s1; b.S2.value = s2; b.CLIP_I.value = clip;
        b.KC.value = kc; b.TI.value = ti; b.TD.value = td; b.NF.value = nf;
        b.WB.value = wb; b.WC.value = wc; b.HI.value = hi;
        PID_I2GL_body__(&b);
        printf("%.15g,%.15g,%.15g,%d,%d,%d,%.15g,%.15g,%.15g,%.15g,%.15g,%.15g,1,%.15g,%.17g,%d\n", sp, shown,
               man, s2, s1, clip, kc, ti, td, nf, wb, wc, hi, b.OUT.value, b.HELD.value);
    }
    return 0;
}
