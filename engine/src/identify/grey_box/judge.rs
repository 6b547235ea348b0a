//! From numbers to words: what a fit of a rig is worth.

use super::super::residual_tests::ResidualTests;
use super::GreyBoxVerdict;
use super::fit::{Knowledge, RecordFit, RigParameter};
use super::problem::FreeParameter;

/// Fit in percent below which a rig does not follow the record.
const POOR: f64 = 50.0;
/// How many times the error of the fitted record another one may have.
const WORSE: f64 = 2.0;
/// Rows per independent one from which correlation is worth a word.
const CORRELATED: f64 = 2.0;
/// Fit in percent from which what is left over is the integrator's, not the record's.
const EXACT: f64 = 99.99;
/// Share of the bounds' width that an interval has to leave out.
const TELLS: f64 = 0.9;

/// Findings, the gravest first; at least one.
pub(super) fn verdicts(
    free: &[FreeParameter],
    parameters: &[RigParameter],
    knowledge: &Knowledge,
    train: &RecordFit,
    validate: Option<&RecordFit>,
    tests: &[ResidualTests],
) -> Vec<GreyBoxVerdict> {
    let fit_percent = train.fit_percent;
    let mut found = Vec::new();
    if fit_percent < POOR {
        found.push(GreyBoxVerdict::Poor { fit_percent });
    }
    let name = |i: usize| parameters.get(i).map(|p| p.name.clone());
    found.extend(knowledge.idle.iter().filter_map(|&i| Some(GreyBoxVerdict::NoEffect { name: name(i)? })));
    for group in &knowledge.mixed {
        let names: Vec<String> = group.iter().filter_map(|&i| name(i)).collect();
        match names.as_slice() {
            [] => {}
            [name] => found.push(unknown(parameters, name)),
            _ => found.push(GreyBoxVerdict::MakeUp { names: names.join(", ") }),
        }
    }
    for (i, p) in parameters.iter().enumerate() {
        let told = knowledge.idle.contains(&i) || knowledge.mixed.iter().any(|g| g.contains(&i));
        let [low, high] = p.bounds;
        if !told && p.interval_95[1] - p.interval_95[0] > TELLS * (high - low) {
            found.push(unknown(parameters, &p.name));
        } else if !told
            && let Some(bound) = p.bounds.into_iter().find(|b| *b == p.value && !natural(&free[i], *b))
        {
            found.push(GreyBoxVerdict::AtBound { name: p.name.clone(), bound });
        }
    }
    for (output, tests) in train.outputs.iter().zip(tests) {
        if tests.rows_per_independent > CORRELATED && output.fit_percent < EXACT {
            let rows = tests.rows_per_independent;
            found.push(GreyBoxVerdict::Correlated { output: output.signal.clone(), rows });
        }
    }
    if let Some(other) = validate.filter(|v| v.rmse > WORSE * train.rmse) {
        found.push(GreyBoxVerdict::WorseElsewhere { train: train.rmse, validate: other.rmse });
    }
    if found.is_empty() {
        found.push(GreyBoxVerdict::Good { fit_percent });
    }
    found
}

/// Whether nothing lies beyond a bound: no valve has a negative k.
fn natural(free: &FreeParameter, bound: f64) -> bool {
    free.target.possible().contains(&bound)
}

fn unknown(parameters: &[RigParameter], name: &str) -> GreyBoxVerdict {
    let bounds = parameters.iter().find(|p| p.name == name).map_or([0.0, 0.0], |p| p.bounds);
    GreyBoxVerdict::Unknown { name: name.to_owned(), low: bounds[0], high: bounds[1] }
}
