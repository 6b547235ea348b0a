//! The hour that `benches/peers` gives to other integrators: STAD coupled in closed loop, 18,000 samples with noise and
//! converters, the setpoint at 10 and 12 cm in turn, ten minutes each.
//!
//! ```text
//! cargo run --release --package vasos-engine --example hour -- [RUNS] [OUT.json]
//! ```
//!
//! Prints the best of RUNS runs. OUT.json gets that time, what the hour started from, and of every sample the output
//! and the levels, with which `benches/peers/hour.py` replays the hour through a reference.

use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

use serde_json::json;
use vasos_engine::plant::{Measurement, Network, Plant, RigSpec};
use vasos_engine::session::RigCommand;
use vasos_engine::sim::ClosedLoop;

const RIG: &str = include_str!("../../assets/rigs/stad.toml");
const SAMPLES: usize = 18_000;
/// Samples from one step of the setpoint to the next.
const STEP_SAMPLES: usize = 3000;
const SETPOINTS_CM: [f64; 2] = [10.0, 12.0];
const SEED: u64 = 1;

type Failure = Box<dyn std::error::Error>;

fn start(network: &Arc<Network>) -> Result<ClosedLoop, Failure> {
    Ok(ClosedLoop::simulated(network.clone(), 0, Measurement::DEFAULT, SEED)?)
}

fn plant(closed: &ClosedLoop) -> Result<&Plant, Failure> {
    closed.source().plant().ok_or_else(|| "the rig is not simulated".into())
}

/// `see` gets the loop before each sample is taken and after.
fn an_hour(
    closed: &mut ClosedLoop,
    mut see: impl FnMut(&ClosedLoop, bool) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let tag = closed.loops()[0].spec.id.clone();
    for sample in 0..SAMPLES {
        if sample % STEP_SAMPLES == 0 {
            let level_cm = SETPOINTS_CM[sample / STEP_SAMPLES % 2];
            closed.apply(&RigCommand::Setpoint { tag: tag.clone(), level_cm })?;
        }
        see(closed, false)?;
        black_box(closed.step());
        see(closed, true)?;
    }
    Ok(())
}

fn main() -> Result<(), Failure> {
    let mut arguments = std::env::args().skip(1);
    let runs: u32 = arguments.next().map_or(Ok(20), |runs| runs.parse())?;
    let network = Arc::new(Network::new(toml::from_str::<RigSpec>(RIG)?)?);

    let mut best_s = f64::INFINITY;
    for _ in 0..runs {
        let mut closed = start(&network)?;
        let begun = Instant::now();
        an_hour(&mut closed, |_, _| Ok(()))?;
        best_s = best_s.min(begun.elapsed().as_secs_f64());
    }
    println!(
        "best of {runs}: {:.2} ms, {:.2} million samples/s",
        1e3 * best_s,
        1e-6 * SAMPLES as f64 / best_s
    );

    let Some(path) = arguments.next() else { return Ok(()) };
    let mut closed = start(&network)?;
    let input = plant(&closed)?.inputs()[0];
    let (mut inputs, mut levels_cm) = (vec![], vec![]);
    an_hour(&mut closed, |closed, taken| {
        let plant = plant(closed)?;
        if taken {
            inputs.push(plant.inputs()[0]);
        } else {
            levels_cm.push(plant.levels_cm()[..3].to_vec());
        }
        Ok(())
    })?;
    let hour = json!({
        "version": env!("CARGO_PKG_VERSION"),
        "seconds": best_s,
        "runs": runs,
        "steps": plant(&closed)?.steps(),
        "start": { "levels_cm": levels_cm[0], "input": input },
        "setpoints_cm": SETPOINTS_CM,
        "step_samples": STEP_SAMPLES,
        "samples": SAMPLES,
        "inputs": inputs,
        "levels_cm": levels_cm,
    });
    std::fs::write(path, hour.to_string())?;
    Ok(())
}
