//! The sampled PIDs against python-control's, which come from the transfer function by Tustin's rule.

use vasos_engine::control::{
    AntiWindup, ControlInput, Controller, Limits, Pid2gl, PidGains, PidI2gl, PidTuning,
};

/// assets/golden/pid_python_control.csv; 1e-9 of the largest output, since python-control's state space of an
/// integrator and a filter carries rounding of its own.
#[test]
fn val_the_sampled_laws_agree_with_python_control() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../assets/golden/pid_python_control.csv");
    let text = std::fs::read_to_string(path).expect("the file");
    let rows: Vec<Vec<f64>> = text
        .lines()
        .skip(1)
        .map(|line| line.split(',').map(|cell| cell.parse().expect("a number")).collect())
        .collect();
    let limits = Limits { low: -1e9, high: 1e9 };
    for case in rows.chunk_by(|a, b| a[0] == b[0]) {
        let [_, kc, ti_s, td_s, n, h, ..] = case[0][..] else { panic!("eight columns") };
        let tuning = PidTuning { gains: PidGains { kc, ti_s, td_s, n }, b: 1.0, c: 1.0 };
        let mut laws: Vec<Box<dyn Controller>> =
            vec![Box::new(Pid2gl::new(tuning, h, 0.0, Some(0.0), AntiWindup::Clamping))];
        if ti_s.is_finite() {
            laws.push(Box::new(PidI2gl::new(tuning, h, -1e9, 1e9, 0.0)));
        }
        let largest = case.iter().fold(0.0_f64, |most, row| most.max(row[7].abs()));
        for (which, law) in laws.iter_mut().enumerate() {
            for (k, row) in case.iter().enumerate() {
                // The error as a setpoint on a PV at rest.
                let input =
                    ControlInput { setpoint: row[6], pv: 0.0, feedforward: 0.0, limits, controlling: true };
                let mv = law.step(&input).mv;
                let expected = row[7];
                assert!(
                    (mv - expected).abs() < 1e-9 * largest,
                    "{tuning:?}, law {which}, sample {k}: {mv} {expected}"
                );
            }
        }
    }
    assert_eq!(rows.len(), 1200);
}
