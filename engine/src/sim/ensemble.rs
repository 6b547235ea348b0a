//! Many plants at once: a scenario on rigs that differ a little from their file, for Monte-Carlo.
//!
//! Several plants share a step of the integrator, each in a lane of a vector register ([`super::flock`]); each has its own
//! noise, controller and parameters. Where the lanes cannot go on together (a tank at its rim or empty, loops in cascade,
//! commands that only one plant can follow), the plants run one by one, which gives the same figures more slowly.

use std::sync::Arc;

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::{Deserialize, Serialize};

use super::closed_loop::ClosedLoop;
use super::flock::{PLANTS, can_flock, run_flock};
use super::scenario::{Prepared, Scenario, ScenarioError, prepare, run_samples};
use super::watch::{Seen, Watch};
use crate::plant::{Measurement, Network, RigError};
use crate::signal::ChannelKind;

/// How much the rigs of an ensemble differ from their file: relative standard deviations, cut at three of them.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Spread {
    /// Of every valve's k90.
    pub valves: f64,
    /// Of every tank's area.
    pub areas: f64,
    /// Of every pump's flow.
    pub pumps: f64,
}

/// Largest spread; three of it still leave a rig that is one.
const LARGEST_SPREAD: f64 = 0.3;
/// Most plants of an ensemble.
pub const MOST_MEMBERS: usize = 1_000_000;

/// Figures of one loop of one plant over the run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MemberFigures {
    /// ∫|e| dt in cm·s, of the measured PV against the setpoint.
    pub iae_cm_s: f64,
    /// Total variation of the MV, in its unit.
    pub tv: f64,
    /// Lowest and highest true level of the loop's tank in cm.
    pub level_cm: [f64; 2],
    /// Level at the end in cm.
    pub end_cm: f64,
}

/// An ensemble that has run.
#[derive(Debug, Clone, PartialEq)]
pub struct EnsembleRun {
    /// Tag of the loop the figures are of: the first of the configuration.
    pub loop_tag: String,
    /// One entry a plant.
    pub members: Vec<MemberFigures>,
    /// Times of the bands in seconds.
    pub time_s: Vec<f64>,
    /// True level of the loop's tank at each time in cm: 5, 50 and 95 % quantiles over the plants.
    pub bands_cm: Vec<[f64; 3]>,
    /// How many plants ran in lanes; the others ran one by one.
    pub in_lanes: usize,
}

/// A rig that differs from its file by `spread`.
///
/// # Errors
/// [`RigError`] when the result is no rig.
pub fn vary(network: &Network, spread: Spread, rng: &mut Xoshiro256PlusPlus) -> Result<Network, RigError> {
    let mut spec = network.spec.clone();
    let mut factor = |deviation: f64| {
        let draw: f64 = StandardNormal.sample(rng);
        1.0 + deviation * draw.clamp(-3.0, 3.0)
    };
    for valve in &mut spec.valves {
        valve.k90 *= factor(spread.valves);
    }
    for tank in &mut spec.tanks {
        tank.area_cm2 *= factor(spread.areas);
    }
    for pump in &mut spec.pumps {
        let strength = factor(spread.pumps);
        for point in &mut pump.curve {
            point[1] *= strength;
        }
    }
    // All start at the levels of the rig of the file: the water is what these tanks hold then.
    spec.water_cm3 = None;
    Network::new(spec)
}

/// Runs a scenario on `count` rigs; rig and noise of each follow from the scenario's seed and its number.
///
/// All start in the state the scenario gives the rig of the file.
///
/// # Errors
/// [`ScenarioError`] as for a single run, and for a spread outside 0…0.3 or a count outside 1…10⁶.
pub fn run_ensemble(
    network: &Arc<Network>,
    scenario: &Scenario,
    count: usize,
    spread: Spread,
) -> Result<EnsembleRun, ScenarioError> {
    check(network, count, spread)?;
    let at_start = |error: RigError| ScenarioError::Command { at_s: 0.0, error: error.into() };
    let prepared = prepare(network, scenario)?;
    let loop_tag = prepared.closed.loops().first().map(|l| l.spec.id.clone());
    let loop_tag = loop_tag.ok_or_else(|| at_start(unknown_loop(network)))?;
    let member = |index: usize| -> Result<(Arc<Network>, u64), ScenarioError> {
        let seed = scenario.seed.wrapping_add(index as u64);
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed ^ 0x0e15_e3b1);
        Ok((Arc::new(vary(network, spread, &mut rng).map_err(at_start)?), seed))
    };
    let lanes = can_flock(&prepared.closed, &scenario.events);
    let (mut watches, mut in_lanes) = (Vec::with_capacity(count), 0);
    while watches.len() < count {
        let first = watches.len();
        let group = (first..count.min(first + PLANTS)).map(member).collect::<Result<Vec<_>, _>>()?;
        let together = if lanes && group.len() == PLANTS {
            run_flock(&prepared.closed, &group, scenario.measurement, &prepared.events, prepared.samples)
        } else {
            None
        };
        if let Some(seen) = together {
            in_lanes += seen.len();
            watches.extend(seen);
            continue;
        }
        for (network, seed) in &group {
            watches.push(alone(network, *seed, &prepared, scenario.measurement)?);
        }
    }
    let stride = watches.first().map_or(1, |w: &Seen| w.stride);
    let rows = watches.first().map_or(0, |w| w.levels_cm.len());
    let h = network.spec.sample_time_s;
    Ok(EnsembleRun {
        loop_tag,
        time_s: (0..rows).map(|row| (row as u64 * stride) as f64 * h).collect(),
        bands_cm: (0..rows)
            .map(|row| quantiles(watches.iter().map(|w| w.levels_cm[row]).collect()))
            .collect(),
        members: watches.into_iter().map(|w| w.figures).collect(),
        in_lanes,
    })
}

fn unknown_loop(network: &Network) -> RigError {
    RigError::Unknown { item: network.spec.id.clone(), reference: "loop".to_owned() }
}

fn check(network: &Network, count: usize, spread: Spread) -> Result<(), ScenarioError> {
    let refuse = |field: &'static str, value: f64, expected: &str| {
        let (item, expected) = (network.spec.id.clone(), expected.to_owned());
        Err(ScenarioError::Command {
            at_s: 0.0,
            error: RigError::Value { item, field, value, expected }.into(),
        })
    };
    if !(1..=MOST_MEMBERS).contains(&count) {
        return refuse("runs", count as f64, "1…1000000");
    }
    for (field, value) in [
        ("spread of valves", spread.valves),
        ("spread of areas", spread.areas),
        ("spread of pumps", spread.pumps),
    ] {
        if !(0.0..=LARGEST_SPREAD).contains(&value) {
            return refuse(field, value, "0…0.3");
        }
    }
    Ok(())
}

/// One plant by itself, from the state the others start in.
fn alone(
    network: &Arc<Network>,
    seed: u64,
    prepared: &Prepared,
    measurement: Measurement,
) -> Result<Seen, ScenarioError> {
    let start = &prepared.closed;
    let mut closed = ClosedLoop::resembling(start, network.clone(), measurement, seed)
        .map_err(|error| ScenarioError::Command { at_s: 0.0, error })?;
    let channels = closed.channels().clone();
    let column = |kind| channels.column(kind).unwrap_or(0);
    let tank = start.loops().first().map_or(0, |l| network.sensors[l.sensor].tank);
    let [sp, pv, mv, level] =
        [ChannelKind::Setpoint(0), ChannelKind::Pv(0), ChannelKind::Mv(0), ChannelKind::Level(tank)]
            .map(column);
    let mut watch = Watch::new(prepared.samples, network.spec.sample_time_s);
    run_samples(&mut closed, &prepared.events, prepared.samples, |sample, _, row| {
        watch.see(sample, row[sp], row[pv], row[mv], row[level]);
    })?;
    Ok(watch.of_plant(0))
}

/// 5, 50 and 95 % quantiles.
fn quantiles(mut values: Vec<f64>) -> [f64; 3] {
    values.sort_by(f64::total_cmp);
    [0.05, 0.5, 0.95].map(|share| quantile(&values, share))
}

/// The quantile of a share, 0 to 1, of values in rising order, linear between the order statistics; NaN of none.
#[must_use]
pub fn quantile(sorted: &[f64], share: f64) -> f64 {
    let place = share * sorted.len().saturating_sub(1) as f64;
    let (low, high) = (place.floor() as usize, place.ceil() as usize);
    let at = |i: usize| sorted.get(i).copied().unwrap_or(f64::NAN);
    at(low) + (at(high) - at(low)) * (place - low as f64)
}
