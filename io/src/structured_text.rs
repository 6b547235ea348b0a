//! PID-I2GL as IEC 61131-3 structured text: a function block that does sample by sample what the program does.
//!
//! Only `LREAL` and `BOOL`, `IF`, assignments and the standard functions `ABS`, `LIMIT`, `MAX`, `MIN`: any
//! controller of the norm takes it. The test runs the text and compares it with the law.

use vasos_engine::control::{Clip, Limits, PidTuning, Sends};

/// What the block starts with; every number is an input and can be changed while it runs.
#[derive(Debug, Clone, PartialEq)]
pub struct BlockOptions {
    /// Name of the function block: letters, digits and single underscores, a letter first.
    pub name: String,
    /// Gains and weights.
    pub tuning: PidTuning,
    /// Sample time in seconds: the period of the task that calls the block.
    pub sample_time_s: f64,
    /// Limits of the output in MV units.
    pub limits: Limits,
    /// Output before the first sample in MV units.
    pub start: f64,
    /// What a limit clips.
    pub clip: Clip,
    /// What is sent, switch S1.
    pub sends: Sends,
}

/// The function block as text.
#[must_use]
pub fn structured_text(options: &BlockOptions) -> String {
    let PidTuning { gains, b, c } = options.tuning;
    let truth = |on: bool| if on { "TRUE" } else { "FALSE" };
    let values = [
        ("%NAME%", options.name.clone()),
        ("%KC%", literal(gains.kc)),
        ("%TI%", literal(gains.ti_s)),
        ("%TD%", literal(gains.td_s)),
        ("%NF%", literal(gains.n)),
        ("%WB%", literal(b)),
        ("%WC%", literal(c)),
        ("%H%", literal(options.sample_time_s)),
        ("%LO%", literal(options.limits.low)),
        ("%HI%", literal(options.limits.high)),
        ("%U0%", literal(options.start)),
        ("%CLIP%", truth(options.clip == Clip::Integral).to_owned()),
        ("%S1%", truth(options.sends == Sends::Increment).to_owned()),
    ];
    values.iter().fold(BLOCK.to_owned(), |text, (place, value)| text.replace(place, value))
}

/// Whether a name is possible for a function block.
#[must_use]
pub fn is_block_name(name: &str) -> bool {
    let plain = name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    plain
        && name.starts_with(|c: char| c.is_ascii_alphabetic())
        && !name.contains("__")
        && !name.ends_with('_')
}

/// A number as the norm writes it: always with a point, exponents with a capital E.
fn literal(value: f64) -> String {
    let text = format!("{value:?}");
    match text.split_once('e') {
        Some((mantissa, exponent)) => {
            let point = if mantissa.contains('.') { "" } else { ".0" };
            format!("{mantissa}{point}E{exponent}")
        }
        None => text,
    }
}

const BLOCK: &str = "\
(* PID-I2GL: incremental PID with two degrees of freedom.
   Michel, Braga, Polito-Braga: STAD, Congresso Brasileiro de Automatica 2010, Figure 6, eqs. 8-10.

     dP  = KC*((WB*r - y) - (WB*r1 - y1))            signals, not a stored P: KC and WB change without a jump
     D   = AD*D1 + BD*((WC*r - y) - (WC*r1 - y1))    dD = D - D1
     dI  = KC*H/(2*TI)*(e + e1)
     u   = limit(u1 + dP + dD + dI)                  the limiter is the anti-windup

   Call it every H seconds. S1: TRUE sends the increment, FALSE the output. S2: TRUE is automatic, FALSE is
   manual with the output MAN. CLIP_I: TRUE keeps what P and D give beyond a limit, FALSE loses it.
   A signal that is no number, or beyond 1.0E30, holds the output and sets HELD. *)
FUNCTION_BLOCK %NAME%
VAR_INPUT
    SP : LREAL;              (* setpoint, PV units *)
    PV : LREAL;              (* process variable, PV units *)
    MAN : LREAL := %U0%;     (* output in manual, MV units *)
    S2 : BOOL := TRUE;       (* automatic *)
    S1 : BOOL := %S1%;      (* send increments *)
    CLIP_I : BOOL := %CLIP%;  (* clip the integral only *)
    KC : LREAL := %KC%;      (* gain, MV units per PV unit *)
    TI : LREAL := %TI%;      (* integral time, s *)
    TD : LREAL := %TD%;      (* derivative time, s *)
    NF : LREAL := %NF%;      (* TD over the time constant of its filter *)
    WB : LREAL := %WB%;      (* weight of the setpoint in P *)
    WC : LREAL := %WC%;      (* weight of the setpoint in D *)
    LO : LREAL := %LO%;      (* lower limit, MV units *)
    HI : LREAL := %HI%;      (* upper limit, MV units *)
    H : LREAL := %H%;        (* sample time, s *)
END_VAR
VAR_OUTPUT
    OUT : LREAL;             (* output or, with S1, its increment *)
    HELD : BOOL;             (* a signal was no number *)
END_VAR
VAR
    U : LREAL := %U0%;       (* output *)
    V : LREAL := %U0%;       (* sum of the increments, where only the integral is clipped *)
    U1 : LREAL;
    R1 : LREAL;
    Y1 : LREAL;
    D : LREAL;
    DNEW : LREAL;
    TD1 : LREAL := %TD%;
    NF1 : LREAL := %NF%;
    CLIPPED : BOOL := %CLIP%;
    SEEN : BOOL := FALSE;    (* R1 and Y1 hold a sample *)
    NH : LREAL;
    AD : LREAL;
    BD : LREAL;
    DP : LREAL;
    DI : LREAL;
    DD : LREAL;
    DU : LREAL;
    W : LREAL;
END_VAR

U1 := U;

(* Another derivative filter starts from rest; another choice of clipping starts from the output. *)
IF TD <> TD1 OR NF <> NF1 THEN
    D := 0.0;
    TD1 := TD;
    NF1 := NF;
END_IF;
IF CLIP_I <> CLIPPED THEN
    V := U;
    CLIPPED := CLIP_I;
END_IF;
IF NOT S2 THEN
    U := LIMIT(LO, MAN, HI);
    V := U;
END_IF;

(* No comparison with what is no number is true. *)
HELD := NOT (ABS(SP) <= 1.0E30 AND ABS(PV) <= 1.0E30);
IF NOT HELD THEN
    IF NOT SEEN THEN
        R1 := SP;
        Y1 := PV;
        SEEN := TRUE;
    END_IF;

    (* Filtered derivative: Tustin, or backward difference where Tustin would ring. *)
    NH := NF * H;
    IF TD = 0.0 THEN
        AD := 0.0;
        BD := 0.0;
    ELSIF 2.0 * TD < NH THEN
        AD := TD / (TD + NH);
        BD := KC * NF * TD / (TD + NH);
    ELSE
        AD := (2.0 * TD - NH) / (2.0 * TD + NH);
        BD := 2.0 * KC * NF * TD / (2.0 * TD + NH);
    END_IF;
    DNEW := AD * D + BD * ((WC * SP - PV) - (WC * R1 - Y1));
    DD := DNEW - D;
    D := DNEW;
    DP := KC * ((WB * SP - PV) - (WB * R1 - Y1));
    DI := KC * H / (2.0 * TI) * ((SP - PV) + (R1 - Y1));
    R1 := SP;
    Y1 := PV;

    IF S2 THEN
        IF CLIP_I THEN
            W := V + (DP + DD);
            V := W + DI;
            IF DI > 0.0 AND V > HI THEN
                V := MAX(W, HI);
            ELSIF DI < 0.0 AND V < LO THEN
                V := MIN(W, LO);
            END_IF;
            U := LIMIT(LO, V, HI);
        ELSE
            U := LIMIT(LO, U + (DP + DD + DI), HI);
        END_IF;
    END_IF;
END_IF;

DU := U - U1;
IF S1 THEN
    OUT := DU;
ELSE
    OUT := U;
END_IF;
END_FUNCTION_BLOCK
";
