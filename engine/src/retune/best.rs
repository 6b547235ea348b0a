//! The best tunings within the limits: for the model alone, and where that is not safe for the worst of others as likely.

use super::advice::Advice;
use super::candidate::{Candidate, CandidateRule};
use super::family::family;
use super::options::RetuneOptions;
use super::retuning::Retuning;
use crate::control::ParallelGains;
use crate::model::ProcessModel;
use crate::tune::ControllerKind;
use crate::tune::optimum::{Objective, OptimumError, OptimumProblem, Process, Wanted, optimum};

/// Share of unstable loops and 95 % quantile of Ms from which the optimum of the model alone is not to be used.
const MOST_UNSTABLE: f64 = 0.01;
const MOST_MS: f64 = 2.0;

/// Whether a tuning is safe with all the models that fit the log as well.
pub(super) fn is_robust(candidate: &Candidate, limit_ms: f64) -> bool {
    // A user who asks for Ms over 2 does not mind an Ms over 2.
    let most = MOST_MS.max(1.2 * if limit_ms.is_finite() { limit_ms } else { 1.0 });
    candidate.spread.as_ref().is_none_or(|s| s.unstable_share() <= MOST_UNSTABLE && s.ms.high <= most)
}

/// Adds the optima; which of them to use, or why there is none.
pub(super) fn best(
    model: &ProcessModel,
    options: &RetuneOptions,
    out: &mut Retuning,
) -> Result<Result<usize, Advice>, OptimumError> {
    let pid = options.controller == ControllerKind::Pid;
    let mut kinds = vec![ControllerKind::Pi];
    if pid {
        kinds.insert(0, ControllerKind::Pid);
    }
    let mut answer = None;
    for kind in kinds {
        let found = best_of(model, kind, options, out)?;
        // The controller that was asked for first; the other only where there is none.
        if answer.as_ref().is_none_or(Result::is_err) {
            answer = Some(found);
        }
    }
    Ok(answer.unwrap_or(Err(Advice::TooUncertain)))
}

fn best_of(
    model: &ProcessModel,
    kind: ControllerKind,
    options: &RetuneOptions,
    out: &mut Retuning,
) -> Result<Result<usize, Advice>, OptimumError> {
    let nominal = match solve(&[Process::Model(model.clone())], kind, options) {
        Ok(gains) => gains,
        Err(error) if error.is_answer() => return Ok(Err(Advice::NoOptimum(error))),
        Err(error) => return Err(error),
    };
    let candidate = Candidate::new(CandidateRule::Optimal, kind, nominal, model, &out.draws);
    let robust = is_robust(&candidate, options.limits.ms);
    let spread = candidate.spread.clone();
    out.candidates.push(candidate);
    if robust {
        return Ok(Ok(out.candidates.len() - 1));
    }
    let (unstable_percent, ms) =
        spread.map_or((0.0, f64::INFINITY), |s| (100.0 * s.unstable_share(), s.ms.high));
    out.advice.push(if unstable_percent > 0.0 {
        Advice::Uncertain { controller: kind, unstable_percent, ms }
    } else {
        Advice::Sensitive { controller: kind, ms }
    });
    let family = family(model, &out.draws, &nominal);
    let Ok(gains) = solve(&family, kind, options) else { return Ok(Err(Advice::TooUncertain)) };
    let candidate = Candidate::new(CandidateRule::OptimalFamily, kind, gains, model, &out.draws);
    let robust = is_robust(&candidate, options.limits.ms);
    out.candidates.push(candidate);
    Ok(if robust { Ok(out.candidates.len() - 1) } else { Err(Advice::TooUncertain) })
}

fn solve(
    processes: &[Process],
    kind: ControllerKind,
    options: &RetuneOptions,
) -> Result<ParallelGains, OptimumError> {
    let wanted = if kind == ControllerKind::Pid { Wanted::pid(&options.limits) } else { Wanted::Pi };
    let problem = OptimumProblem { processes, wanted, objective: Objective::Jv, limits: options.limits };
    optimum(&problem).map(|found| found.gains)
}
