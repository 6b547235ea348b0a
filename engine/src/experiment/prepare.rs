//! From what a file says to an experiment that can run.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::error::{ExperimentError, Place};
use super::spec::{EXPERIMENT_SCHEMA, ExperimentSpec, RunSpec};
use crate::plant::Network;

/// An experiment with the rigs it runs on.
#[derive(Debug, Clone)]
pub struct Experiment {
    /// What the file says, sweeps unrolled.
    pub spec: ExperimentSpec,
    /// Rigs by the name the runs give them.
    pub rigs: BTreeMap<String, Arc<Network>>,
    /// For each run its number in the file: the runs of a sweep share one.
    pub(super) written: Vec<usize>,
}

/// Most samples of a run on a linear process.
const MOST_SAMPLES: f64 = 1e7;

impl Experiment {
    /// Checks all that does not need a run: ids, kinds, lengths, references, expectations.
    ///
    /// `spec` has its sweeps unrolled: each run of one carries its [`super::Member`].
    ///
    /// # Errors
    /// [`ExperimentError`] with its place.
    pub fn new(spec: ExperimentSpec, rigs: BTreeMap<String, Arc<Network>>) -> Result<Self, ExperimentError> {
        if spec.schema != EXPERIMENT_SCHEMA {
            return Err(ExperimentError::Schema { found: spec.schema, known: EXPERIMENT_SCHEMA });
        }
        if spec.runs.is_empty() || spec.checks.is_empty() {
            return Err(ExperimentError::Empty);
        }
        let written = places(&spec.runs);
        check_ids(&spec, &written)?;
        for (run, &number) in spec.runs.iter().zip(&written) {
            check_run(run, &rigs, Place::Run(number))?;
        }
        check_references(&spec)?;
        Ok(Self { spec, rigs, written })
    }
}

/// Number of each run in the file.
fn places(runs: &[RunSpec]) -> Vec<usize> {
    let mut number = 0;
    let mut last: Option<&str> = None;
    let mut place = |(index, run): (usize, &RunSpec)| {
        let sweep = runs[index].member.as_ref().map(|m| m.sweep.as_str());
        if index > 0 && (sweep.is_none() || sweep != last) {
            number += 1;
        }
        last = run.member.as_ref().and(sweep);
        number
    };
    runs.iter().enumerate().map(&mut place).collect()
}

fn check_ids(spec: &ExperimentSpec, written: &[usize]) -> Result<(), ExperimentError> {
    let mut seen = BTreeSet::new();
    let runs = spec.runs.iter().zip(written).map(|(run, number)| (&run.id, Place::Run(*number)));
    let tables = spec.tables.iter().enumerate().map(|(i, table)| (&table.id, Place::Table(i)));
    for (id, place) in std::iter::once((&spec.id, Place::Whole)).chain(runs.chain(tables)) {
        let plain = |c: char| c.is_alphanumeric() || "_-.".contains(c);
        let first = place == Place::Whole || seen.insert(id);
        if id.is_empty() || !id.chars().all(plain) || !first {
            return Err(ExperimentError::Id { id: id.clone(), place });
        }
    }
    Ok(())
}

fn check_run(
    run: &RunSpec,
    rigs: &BTreeMap<String, Arc<Network>>,
    place: Place,
) -> Result<(), ExperimentError> {
    let kinds = [
        run.scenario.is_some(),
        run.scenario_file.is_some(),
        run.closed_loop.is_some(),
        run.step.is_some(),
        run.analysis.is_some(),
        run.optimum.is_some(),
        run.models.is_some(),
    ];
    let count = kinds.iter().filter(|kind| **kind).count();
    if count != 1 || run.scenario_file.is_some() {
        return Err(ExperimentError::Kind { run: run.id.clone(), count, place });
    }
    if let Some(sweep) = &run.sweep {
        let (run, parameter) = (run.id.clone(), sweep.parameter.clone());
        return Err(ExperimentError::Sweep { run, parameter, place });
    }
    let rig = run.scenario.as_ref().map(|s| &s.rig).or(run.models.as_ref().map(|m| &m.rig));
    if let Some(rig) = rig.filter(|rig| !rigs.contains_key(*rig)) {
        let presets = rigs.keys().cloned().collect::<Vec<_>>().join(", ");
        return Err(ExperimentError::UnknownRig { rig: rig.clone(), presets, place });
    }
    let demand = |field, value: f64, ok: bool, expected| {
        if ok { Ok(()) } else { Err(ExperimentError::Value { field, value, expected, place }) }
    };
    if let Some(run) = &run.closed_loop {
        let (h, length) = (run.sample_time_s, run.duration_s);
        demand("sample_time_s", h, h > 0.0 && h.is_finite(), "> 0")?;
        demand("duration_s", length, length >= 0.0 && length / h <= MOST_SAMPLES, "0 to 10⁷ samples")?;
        let dead_time_s = run.process.dead_time_s();
        demand("dead_time_s", dead_time_s, dead_time_s / h <= MOST_SAMPLES, "0 to 10⁷ samples")?;
        let starts = run.setpoint.is_finite() && run.mv.is_finite();
        demand("setpoint", run.setpoint, starts, "finite, and mv too")?;
        for event in &run.events {
            let numbers = [Some(event.at_s), event.setpoint, event.load, event.mv];
            let finite = numbers.into_iter().flatten().all(f64::is_finite);
            demand("at_s", event.at_s, finite, "finite, with finite values")?;
        }
    }
    if let Some(step) = &run.step {
        let horizon_s = step.horizon_s.unwrap_or(f64::NAN);
        let ok = horizon_s > 0.0 && horizon_s.is_finite() || step.horizon_s.is_none() && step.gains.is_some();
        demand("horizon_s", horizon_s, ok, "> 0; only a controlled process may go without")?;
    }
    if let Some(models) = &run.models {
        let ok = models.hold_s > 0.0 && models.hold_s * (models.moves.len() as f64) < MOST_SAMPLES;
        demand("hold_s", models.hold_s, ok && !models.moves.is_empty(), "> 0, with at least one move")?;
    }
    Ok(())
}

fn check_references(spec: &ExperimentSpec) -> Result<(), ExperimentError> {
    let ids: Vec<&str> =
        spec.runs.iter().map(|r| r.id.as_str()).chain(spec.tables.iter().map(|t| t.id.as_str())).collect();
    let sweeps: BTreeSet<&str> =
        spec.runs.iter().filter_map(|r| r.member.as_ref()).map(|m| m.sweep.as_str()).collect();
    let missing = |run: &str, known: Vec<&str>, place| {
        Err(ExperimentError::UnknownRun { run: run.to_owned(), runs: known.join(", "), place })
    };
    for (index, table) in spec.tables.iter().enumerate() {
        if !sweeps.contains(table.sweep.as_str()) {
            return missing(&table.sweep, sweeps.into_iter().collect(), Place::Table(index));
        }
    }
    for (index, check) in spec.checks.iter().enumerate() {
        let place = Place::Check(index);
        if !check.is_whole() {
            return Err(ExperimentError::Expectation { place });
        }
        for run in check.measures().flat_map(|m| m.runs()) {
            if !ids.contains(&run) {
                return missing(run, ids, place);
            }
        }
    }
    Ok(())
}
