//! Times the best PI gains of a few models, for the comparison in `benches/peers`.
//!
//! `optimum RUNS FILE` writes, as JSON, every problem with the gains found and the best time of so many runs.

use std::time::Instant;

use serde_json::{Value, json};
use vasos_engine::model::ProcessModel;
use vasos_engine::tune::optimum::{LoopLimits, Objective, OptimumProblem, Process, Wanted, optimum};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    let [_, runs, path] = arguments.as_slice() else { return Err("usage: optimum RUNS FILE".into()) };
    let runs: usize = runs.parse()?;
    let models: [(&str, &[f64], &[f64], f64); 5] = [
        ("TQ2 of STAD", &[4.9], &[152.0, 1.0], 2.0),
        ("FIC-18", &[0.6335], &[8.0, 1.0], 1.0),
        ("1/(s + 1)³", &[1.0], &[1.0, 3.0, 3.0, 1.0], 0.0),
        ("e^(−s)/(s + 1)", &[1.0], &[1.0, 1.0], 1.0),
        ("resonance", &[9.0], &[1.0, 3.0, 11.0, 9.0], 0.0),
    ];
    let limits = LoopLimits { ms: 1.6, mt: 1.4, ju: f64::INFINITY };
    let mut problems = Vec::new();
    for (name, num, den, dead_time_s) in models {
        let model = ProcessModel::rational(num, den, dead_time_s)?;
        let processes = [Process::Model(model)];
        let problem =
            OptimumProblem { processes: &processes, wanted: Wanted::Pi, objective: Objective::Jv, limits };
        let mut seconds = f64::INFINITY;
        let mut found = None;
        for _ in 0..runs.max(1) {
            let begun = Instant::now();
            found = Some(std::hint::black_box(optimum(std::hint::black_box(&problem))));
            seconds = seconds.min(begun.elapsed().as_secs_f64());
        }
        let found = found.ok_or("no run")?.map_err(|e| e.to_string())?;
        problems.push(json!({
            "name": name, "num": num, "den": den, "L_s": dead_time_s, "seconds": seconds,
            "Kp": found.gains.kp, "Ki": found.gains.ki, "Jv": found.value,
            "Ms": found.certificate.peaks.s.value, "Mt": found.certificate.peaks.t.value,
        }));
    }
    let whole: Value = json!({"version": env!("CARGO_PKG_VERSION"), "limits": {"Ms": limits.ms, "Mt": limits.mt}, "problems": problems});
    std::fs::write(path, whole.to_string())?;
    Ok(())
}
