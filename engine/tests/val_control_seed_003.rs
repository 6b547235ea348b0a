//! The sampled laws on seed 003's process 1/(s² + 10 s + 20), against the figures that seed prints.
//!
//! Another route than the continuous responses of `val_response.rs`: the process exact for a held output, the
//! laws at h = 50 µs with their filter at N = 500, which shortens the fastest rise by under 2 %.

use vasos_engine::analyze::{Excitation, Metrics, metrics};
use vasos_engine::control::{
    AntiWindup, ControlInput, Controller, FormGains, Limits, ParallelGains, Pid2gl, PidI2gl, PidTuning,
};

const H: f64 = 5e-5;

/// 1/((s + p)(s + q)) = (1/(s + p) − 1/(s + q))/(q − p): two lags side by side.
struct Process {
    poles: [f64; 2],
    x: [f64; 2],
}

impl Process {
    fn new() -> Self {
        Self { poles: [5.0 - 5f64.sqrt(), 5.0 + 5f64.sqrt()], x: [0.0; 2] }
    }

    fn y(&self) -> f64 {
        (self.x[0] - self.x[1]) / (self.poles[1] - self.poles[0])
    }

    fn hold(&mut self, u: f64) {
        for (x, pole) in self.x.iter_mut().zip(self.poles) {
            let decay = (-pole * H).exp();
            *x = decay * *x + (1.0 - decay) / pole * u;
        }
    }
}

fn step_response(law: &mut dyn Controller) -> Metrics {
    let mut process = Process::new();
    let limits = Limits { low: -1e9, high: 1e9 };
    let (mut time_s, mut r, mut y, mut u) = (vec![], vec![], vec![], vec![]);
    let mut input = ControlInput { setpoint: 0.0, pv: 0.0, feedforward: 0.0, limits, controlling: true };
    law.step(&input);
    for k in 0..400_000 {
        (input.setpoint, input.pv) = (1.0, process.y());
        let mv = law.step(&input).mv;
        time_s.push(f64::from(k) * H);
        r.push(1.0);
        y.push(input.pv);
        u.push(mv);
        process.hold(mv);
    }
    metrics(&time_s, &r, &y, &u, Excitation::Setpoint).expect("figures")
}

#[test]
fn val_the_sampled_laws_give_the_figures_of_seed_003() {
    for (p, i, d, [end, overshoot, rise, settling]) in [
        (30.0, 0.0, 0.0, [0.6, 4.321, 0.3038, 0.8433]),
        (30.0, 70.0, 0.0, [1.0, 1.261, 0.4079, 0.6180]),
        (300.0, 0.0, 10.0, [0.9375, 15.348, 0.0777, 0.2897]),
        (350.0, 300.0, 50.0, [1.0, 0.0, 0.0548, 0.8308]),
    ] {
        let tf_s = if d > 0.0 { d / p / 500.0 } else { 0.0 };
        let form = FormGains::Parallel(ParallelGains { kp: p, ki: i, kd: d, tf_s });
        let tuning = PidTuning { gains: form.to_ideal().expect("exists"), b: 1.0, c: 1.0 };
        let mut positional = Pid2gl::new(tuning, H, 0.0, Some(0.0), AntiWindup::Clamping);
        let mut laws: Vec<(&str, Metrics)> = vec![("2GL", step_response(&mut positional))];
        if i > 0.0 {
            let mut incremental = PidI2gl::new(tuning, H, -1e9, 1e9, 0.0);
            laws.push(("I2GL", step_response(&mut incremental)));
        }
        for (law, m) in laws {
            assert!((m.final_value - end).abs() < 1e-3, "{law} {p}/{i}/{d}: {m:?}");
            assert!(
                (m.overshoot_percent.expect("some") - overshoot).abs() < 0.05,
                "{law} {p}/{i}/{d}: {m:?}"
            );
            assert!((m.rise_time_s.expect("some") / rise - 1.0).abs() < 0.02, "{law} {p}/{i}/{d}: {m:?}");
            assert!(
                (m.settling_time_s.expect("some") / settling - 1.0).abs() < 0.01,
                "{law} {p}/{i}/{d}: {m:?}"
            );
        }
    }
}
