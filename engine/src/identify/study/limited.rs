//! The process behind limits of its MV: known ones, or those that the log speaks for.

use super::clip::{self, Seen};
use super::{RecordFinding, StudyOptions, clip_fit};
use crate::identify::{Choice, FitError, FitProblem, History, InitialState, Structure, choose_from_rest};

/// A limit known to less than this part of the distance of both is none that the log tells.
const UNKNOWN: f64 = 0.25;
/// Logarithm of the likelihood ratio of two pairs of limits up to which the log does not tell them apart.
const UNDECIDED: f64 = 6.0;

/// The squared residual behind limits must fall to this part of the one of the MV as it was logged.
const NEEDED: f64 = 0.8;

/// Models of the process with the MV that it got.
pub(super) struct Limited {
    /// MV within its limits; absent where it is as logged.
    pub mv: Option<Vec<f64>>,
    pub choice: Result<Choice, FitError>,
    pub initial_state: InitialState,
}

/// Chooses a model, behind limits where they are told or found.
pub(super) fn choose(
    problem: &FitProblem,
    structures: &[Structure],
    options: &StudyOptions,
    findings: &mut Vec<RecordFinding>,
) -> Limited {
    let Some(given) = options.mv_limits else {
        let seen = if options.as_is { Seen::Nothing } else { clip::look(problem) };
        return at_seen(problem, seen, structures, findings);
    };
    let rows = beyond(problem.mv, given);
    let (mv, history) = clamped(problem, given);
    let mut kept = FitProblem { mv: &mv, history, ..problem.clone() };
    kept.options.mv_before = kept.options.mv_before.map(|u| u.clamp(given[0], given[1]));
    if rows > 0 {
        findings.push(RecordFinding::MvLimitsGiven { limits: range(&mv), rows });
    }
    // A side of which nothing was said may have its limit in the log.
    let one_sided = given.iter().any(|limit| limit.is_infinite());
    let seen = if one_sided && !options.as_is { clip::look(&kept) } else { Seen::Nothing };
    let out = at_seen(&kept, seen, structures, findings);
    let taken = out.mv.or((rows > 0).then_some(mv));
    Limited { mv: taken, ..out }
}

fn at_seen(
    problem: &FitProblem,
    seen: Seen,
    structures: &[Structure],
    findings: &mut Vec<RecordFinding>,
) -> Limited {
    match seen {
        Seen::Limits(found) => return at_found(problem, &found, structures, findings),
        Seen::Holds(band) => findings.push(RecordFinding::ValveHolds { band }),
        Seen::GainChanges { limits, percent } => {
            findings.push(RecordFinding::GainChanges { limits, percent });
        }
        Seen::Nothing => {}
    }
    as_logged(problem, structures)
}

fn as_logged(problem: &FitProblem, structures: &[Structure]) -> Limited {
    let (choice, initial_state) = choose_from_rest(problem, structures);
    Limited { mv: None, choice, initial_state }
}

fn range(values: &[f64]) -> [f64; 2] {
    values.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(*v), high.max(*v)])
}

/// The MV of a problem, and that of its history, within limits.
fn clamped<'a>(problem: &FitProblem<'a>, [low, high]: [f64; 2]) -> (Vec<f64>, Option<History<'a>>) {
    let mv = problem.mv.iter().map(|u| u.clamp(low, high)).collect();
    (mv, problem.history.as_ref().map(|history| history.within([low, high])))
}

fn within(problem: &FitProblem, [low, high]: [f64; 2], structures: &[Structure]) -> Limited {
    let (mv, history) = clamped(problem, [low, high]);
    let mut kept = FitProblem { mv: &mv, history, ..problem.clone() };
    kept.options.mv_before = kept.options.mv_before.map(|u| u.clamp(low, high));
    let (choice, initial_state) = choose_from_rest(&kept, structures);
    Limited { mv: Some(mv), choice, initial_state }
}

fn beyond(mv: &[f64], limits: [f64; 2]) -> usize {
    mv.iter().filter(|u| !(limits[0]..=limits[1]).contains(*u)).count()
}

/// Limits found with a first order, descended again with the structure that is chosen behind them; their uncertainty
/// goes into the intervals of the process.
fn at_found(
    problem: &FitProblem,
    found: &clip::Limits,
    structures: &[Structure],
    findings: &mut Vec<RecordFinding>,
) -> Limited {
    let mut limits = found.best;
    let mut out = within(problem, limits, structures);
    let logged = |initial_state: InitialState| {
        let mut logged = problem.clone();
        logged.options.initial_state = initial_state;
        logged
    };
    if let Ok(choice) = &out.choice
        && let Some(better) = clip_fit::descend_with(&logged(out.initial_state), limits, choice.chosen())
        && better != limits
    {
        limits = better;
        out = within(problem, limits, structures);
    }
    // What a load explains as well, or a larger process, is no sign of limits.
    let plain = as_logged(problem, structures);
    if let (Ok(without), Ok(behind)) = (&plain.choice, &out.choice)
        && behind.chosen().mse > NEEDED * without.chosen().mse
    {
        return plain;
    }
    findings.push(RecordFinding::MvBeyondLimits { limits, rows: beyond(problem.mv, limits) });
    let Ok(choice) = &mut out.choice else { return out };
    let logged = logged(out.initial_state);
    let errors = choice
        .fits
        .iter_mut()
        .map(|fit| clip_fit::allow_for_limits(&logged, limits, fit))
        .collect::<Vec<_>>()[0];
    let passed = [problem.mv.iter().any(|u| *u < limits[0]), problem.mv.iter().any(|u| *u > limits[1])];
    let known = errors.is_some_and(|errors| {
        (0..2).all(|i| !passed[i] || 2.0 * errors[i] < UNKNOWN * (limits[1] - limits[0]))
    });
    let fit = choice.chosen();
    let rows = fit.rows as f64 / fit.tests.rows_per_independent;
    let rival = found.others.iter().find(|(_, ratio)| rows * ratio.ln() < UNDECIDED).map(|(other, _)| *other);
    if !known || rival.is_some() {
        findings.push(RecordFinding::MvLimitsUnknown { limits });
    }
    out
}
