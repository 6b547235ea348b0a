//! Carries an experiment out.

use std::sync::atomic::{AtomicBool, Ordering};

use super::error::{ExperimentError, Place, RunError};
use super::measure::Measure;
use super::outcome::{ExperimentEnd, ExperimentRun, Progress, RunColumn, RunResult};
use super::prepare::Experiment;
use super::spec::{RunSpec, TableSpec};
use crate::explain::number;
use crate::plant::Text;

/// Runs everything, draws the tables and holds the expectations against them.
///
/// `progress` is told how far it is; raising `cancel` ends it within a few thousand samples.
///
/// # Errors
/// [`ExperimentError`] for a run that is not possible, and for a measure of a column that a run does not have. An
/// expectation that is not met is no error.
pub fn run_experiment(
    experiment: &Experiment,
    cancel: &AtomicBool,
    progress: &mut dyn FnMut(Progress),
) -> Result<ExperimentEnd, ExperimentError> {
    let spec = &experiment.spec;
    let mut runs = Vec::with_capacity(spec.runs.len() + spec.tables.len());
    for (done, run) in spec.runs.iter().enumerate() {
        let mut go_on = |share: f64| {
            progress(Progress { done, of: spec.runs.len(), share });
            !cancel.load(Ordering::Relaxed)
        };
        if !go_on(0.0) {
            return Ok(ExperimentEnd::Cancelled);
        }
        let place = Place::Run(experiment.written[done]);
        let failed =
            |error: RunError| ExperimentError::Run { run: run.id.clone(), error: Box::new(error), place };
        match carry_out(experiment, run, &mut go_on).map_err(failed)? {
            Some(result) => runs.push(result),
            None => return Ok(ExperimentEnd::Cancelled),
        }
    }
    progress(Progress { done: spec.runs.len(), of: spec.runs.len(), share: 0.0 });
    for (index, table) in spec.tables.iter().enumerate() {
        let drawn = draw(table, &spec.runs, &runs, Place::Table(index))?;
        runs.push(drawn);
    }
    for (index, check) in spec.checks.iter().enumerate() {
        check.measures().try_for_each(|m| look_up(m, &runs, Place::Check(index)))?;
    }
    let checks = spec.checks.iter().map(|check| check.outcome(|m| take(m, &runs))).collect();
    Ok(ExperimentEnd::Finished(ExperimentRun { runs, checks }))
}

/// One run; `None` when `go_on` says no.
fn carry_out(
    experiment: &Experiment,
    run: &RunSpec,
    go_on: &mut dyn FnMut(f64) -> bool,
) -> Result<Option<RunResult>, RunError> {
    let rig = |name: &str| experiment.rigs.get(name);
    let mut final_value = None;
    let done = if let Some((scenario, network)) = run.scenario.as_ref().and_then(|s| Some((s, rig(&s.rig)?)))
    {
        scenario.run(network, go_on)?
    } else if let Some(closed_loop) = &run.closed_loop {
        closed_loop.run(go_on)?
    } else if let Some(step) = &run.step {
        let (time_s, columns, rest) = step.run()?;
        final_value = rest;
        Some((time_s, columns))
    } else if let Some(analysis) = &run.analysis {
        Some(analysis.run()?)
    } else if let Some(optimum) = &run.optimum {
        Some(optimum.run()?)
    } else if let Some((models, network)) = run.models.as_ref().and_then(|m| Some((m, rig(&m.rig)?))) {
        Some(models.run(network)?)
    } else {
        // A checked experiment has a kind and a rig for every run.
        None
    };
    Ok(done.map(|(x, columns)| RunResult {
        id: run.id.clone(),
        label: label(run),
        x_name: "time_s".to_owned(),
        x_unit: "s".to_owned(),
        x,
        columns,
        final_value,
    }))
}

fn label(run: &RunSpec) -> Text {
    let Some(title) = &run.title else { return Text::One(run.id.clone()) };
    let value = run.member.as_ref().map_or_else(String::new, |m| number(m.value));
    let filled = |text: &String| text.replace("{value}", &value);
    match title {
        Text::One(text) => Text::One(filled(text)),
        Text::ByLanguage(texts) => {
            Text::ByLanguage(texts.iter().map(|(tag, text)| (tag.clone(), filled(text))).collect())
        }
    }
}

/// A table of a sweep, a row for each of its runs.
fn draw(
    table: &TableSpec,
    specs: &[RunSpec],
    runs: &[RunResult],
    place: Place,
) -> Result<RunResult, ExperimentError> {
    let members: Vec<(f64, &RunResult)> = specs
        .iter()
        .zip(runs)
        .filter_map(|(spec, run)| Some((spec.member.as_ref().filter(|m| m.sweep == table.sweep)?.value, run)))
        .collect();
    let mut columns = Vec::with_capacity(table.columns.len());
    for column in &table.columns {
        let mut values = vec![0.0; members.len()];
        for term in &column.sum {
            for (value, (_, run)) in values.iter_mut().zip(&members) {
                for (_, column) in term.measure.columns() {
                    look_in(run, column, place)?;
                }
                *value += term.factor * term.measure.of(run, None).unwrap_or(f64::NAN);
            }
        }
        columns.push(RunColumn { name: column.name.clone(), unit: column.unit.clone(), values });
    }
    Ok(RunResult {
        id: table.id.clone(),
        label: table.title.clone().unwrap_or_else(|| Text::One(table.id.clone())),
        x_name: table.x.clone(),
        x_unit: table.x_unit.clone(),
        x: members.iter().map(|(value, _)| *value).collect(),
        columns,
        final_value: None,
    })
}

fn find<'a>(id: &str, runs: &'a [RunResult]) -> Option<&'a RunResult> {
    runs.iter().find(|r| r.id == id)
}

/// Refuses a measure of a column that is not there.
fn look_up(measure: &Measure, runs: &[RunResult], place: Place) -> Result<(), ExperimentError> {
    let columns = measure.columns().into_iter().filter_map(|(id, column)| Some((find(id, runs)?, column)));
    columns.into_iter().try_for_each(|(run, column)| look_in(run, column, place))
}

fn look_in(run: &RunResult, column: String, place: Place) -> Result<(), ExperimentError> {
    if run.column(&column).is_some() {
        return Ok(());
    }
    let columns = run.columns.iter().map(|c| c.name.as_str()).collect::<Vec<_>>().join(", ");
    Err(ExperimentError::UnknownColumn { run: run.id.clone(), column, columns, place })
}

/// The number of a measure.
fn take(measure: &Measure, runs: &[RunResult]) -> Option<f64> {
    let ids = measure.runs();
    let other = ids.get(1).and_then(|id| find(id, runs));
    measure.of(find(ids[0], runs)?, other)
}
