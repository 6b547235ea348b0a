//! The record that `benches/peers` gives to other identification programs: 10,000 rows of a first order with dead time,
//! seven moves of the MV, noise, all of it known.
//!
//! ```text
//! cargo run --release --package vasos-engine --example fit -- [RUNS] [OUT.json]
//! ```
//!
//! Prints the best of RUNS fits with intervals. OUT.json gets that time, the truth, the fit and the record, which
//! `benches/peers/identify.py` fits in other programs.

use std::hint::black_box;
use std::time::Instant;

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use serde_json::json;
use vasos_engine::identify::{FitProblem, fit_fopdt, simulate_fopdt};
use vasos_engine::model::Fopdt;

const ROWS: usize = 10_000;
const SAMPLE_TIME_S: f64 = 0.2;
/// Rows from one move of the MV to the next.
const MOVE_ROWS: usize = 1250;
const MV: [f64; 2] = [3.0, 3.3];
const BIAS_CM: f64 = 0.3;
const NOISE_CM: f64 = 0.05;
const SEED: u64 = 1;

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let mut arguments = std::env::args().skip(1);
    let runs: u32 = arguments.next().map_or(Ok(20), |runs| runs.parse())?;
    // The model published for TQ2 of the STAD rig, its dead time between two rows.
    let truth = Fopdt::new(4.9, 152.0, 2.13)?;
    let time_s: Vec<f64> = (0..ROWS).map(|k| SAMPLE_TIME_S * k as f64).collect();
    let mv: Vec<f64> = (0..ROWS).map(|k| MV[k / MOVE_ROWS % 2]).collect();
    let mut random = Xoshiro256PlusPlus::seed_from_u64(SEED);
    let mut noisy = |y: &f64| {
        let e: f64 = StandardNormal.sample(&mut random);
        y + NOISE_CM * e
    };
    let clean = simulate_fopdt(&truth, &time_s, &mv, MV[0], BIAS_CM, None)?;
    let pv: Vec<f64> = clean.iter().map(&mut noisy).collect();
    let problem = FitProblem::new(&time_s, &pv, &mv);
    let mut fit = fit_fopdt(&problem)?;
    let mut best_s = f64::INFINITY;
    for _ in 0..runs {
        let begun = Instant::now();
        fit = fit_fopdt(black_box(&problem))?;
        best_s = best_s.min(begun.elapsed().as_secs_f64());
    }
    println!("{:.2} ms, {:?}", 1e3 * best_s, fit.model);
    if let Some(path) = arguments.next() {
        let model = |m: &Fopdt| json!({"K": m.gain, "T": m.time_constant_s, "L": m.dead_time_s});
        let e = fit.standard_error;
        let record = json!({
            "version": env!("CARGO_PKG_VERSION"), "seconds": best_s, "sample_time_s": SAMPLE_TIME_S,
            "rest_rows": MOVE_ROWS, "truth": model(&truth), "fit": model(&fit.model),
            "standard_error": {"K": e.gain, "T": e.time_constant_s, "L": e.dead_time_s},
            "time_s": time_s, "mv": mv, "pv": pv,
        });
        std::fs::write(path, record.to_string())?;
    }
    Ok(())
}
