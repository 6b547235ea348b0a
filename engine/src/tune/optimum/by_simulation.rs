//! The least IAE under the limits: no closed form, so the step responses themselves are searched.
//!
//! Every gain that is tried meets the limits, because Ki is a share of the largest that they allow at its Kp.

use super::certificate::{Certificate, Optimum};
use super::error::OptimumError;
use super::gain_search::Candidate;
use super::lead_search::RATIO_RANGE;
use super::problem::{DerivativeFilter, Objective, Process, Wanted};
use super::simplex::{Simplex, minimise};
use super::slice::Lead;
use super::solve::Solver;
use crate::analyze::{Excitation, OpenLoop, ResponseEnd, ResponseOptions, loop_response};

/// Rounds of exact checks of the result.
const ROUNDS: usize = 20;
/// Share of the largest Ki at which the search starts.
const START_SHARE: f64 = 0.9;
const SIMPLEX: Simplex = Simplex { step: 0.2, last_step: 2e-5, most_evaluations: 160 };

/// Least IAE, from the least Jv on.
pub(super) fn solve(solver: &mut Solver<'_>, objective: Objective) -> Result<Optimum, OptimumError> {
    let start = solver.solve(Objective::Jv)?;
    let sign = solver.family.sign;
    let kp = sign * start.gains.kp;
    // A pure integrator leaves nothing but Ki to choose.
    if kp == 0.0 {
        let value = iae(
            solver,
            objective,
            &Candidate { lead: Lead::NONE, kp, ki: sign * start.gains.ki, value: 0.0 },
        );
        let certificate = Certificate { gap: None, ..start.certificate };
        return Ok(Optimum { value, certificate, ..start });
    }
    let td_s = start.gains.kd / start.gains.kp;
    let mut from = vec![kp.ln(), f64::ln(START_SHARE)];
    let filter = match solver.wanted {
        Wanted::Pid(filter) if td_s > 0.0 => {
            from.push(td_s.ln());
            if filter == DerivativeFilter::Free {
                from.push((td_s / start.gains.tf_s).ln());
            }
            Some(filter)
        }
        _ => None,
    };
    let mut best: Option<Candidate> = None;
    let mut value = |x: &[f64]| {
        let Some(candidate) = candidate_at(solver, filter, x) else { return f64::INFINITY };
        let value = iae(solver, objective, &candidate);
        if value.is_finite() && best.is_none_or(|b| value < b.value) {
            best = Some(Candidate { value, ..candidate });
        }
        value
    };
    minimise(&SIMPLEX, &from, &mut value);
    let found = best.ok_or(OptimumError::NotCertified { excess_percent: f64::NAN })?;
    certified(solver, objective, found)
}

/// ln Kp, ln of the share of the largest Ki, ln Td, ln N.
fn candidate_at(solver: &mut Solver<'_>, filter: Option<DerivativeFilter>, x: &[f64]) -> Option<Candidate> {
    let lead = match filter {
        None => Lead::NONE,
        Some(filter) => {
            let td_s = x[2].exp();
            let n = match filter {
                DerivativeFilter::Ratio(n) => n,
                DerivativeFilter::Free => x[3].exp().clamp(RATIO_RANGE.0, RATIO_RANGE.1),
            };
            Lead { td_s, tf_s: td_s / n }
        }
    };
    let limits = solver.limits;
    let largest = solver.at_gain(Objective::MaxKi, &limits, lead, x[0].exp())?;
    // Past the largest Ki the value stays: a wall would stop the simplex on it.
    Some(Candidate { ki: largest.ki * x[1].exp().min(1.0), ..largest })
}

/// IAE of the worst process; ∞ where a loop is unstable or does not settle.
fn iae(solver: &Solver<'_>, objective: Objective, candidate: &Candidate) -> f64 {
    let excitation = if objective == Objective::IaeLoad { Excitation::Load } else { Excitation::Setpoint };
    let gains = solver.family.gains(candidate.lead, candidate.kp, candidate.ki);
    let of = |process: &Process| -> f64 {
        let Process::Model(model) = process else { return f64::INFINITY };
        let response =
            loop_response(&OpenLoop::of_parallel(model, &gains), excitation, &ResponseOptions::default());
        let settled = response.end == ResponseEnd::Settled;
        response.metrics().ok().filter(|_| settled).map_or(f64::INFINITY, |m| m.iae)
    };
    solver.family.plants.iter().map(|p| of(p.process)).fold(0.0, f64::max)
}

/// The candidate with as much of Ki taken off as the exact analysis wants.
fn certified(
    solver: &mut Solver<'_>,
    objective: Objective,
    found: Candidate,
) -> Result<Optimum, OptimumError> {
    let mut last = found;
    let mut excess = f64::INFINITY;
    for round in 1..=ROUNDS {
        let check = solver.check(objective, &last)?;
        let unstable = !check.unstable.is_empty();
        excess = check.excess;
        if !unstable && excess <= super::certificate::MET {
            return Ok(Optimum {
                gains: solver.family.gains(last.lead, last.kp, last.ki),
                value: iae(solver, objective, &last),
                certificate: Certificate {
                    active: check.active(&solver.limits),
                    peaks: check.peaks,
                    gap: None,
                    excess: excess.max(0.0),
                    rounds: round,
                },
            });
        }
        solver.add(&check);
        let limits = solver.limits;
        let largest = solver.at_gain(Objective::MaxKi, &limits, last.lead, last.kp);
        match largest {
            Some(largest) if !unstable => last.ki = last.ki.min(largest.ki),
            _ => last.kp *= 1.0 - 2.0 * excess.clamp(1e-9, 0.1),
        }
    }
    Err(OptimumError::NotCertified { excess_percent: 100.0 * excess })
}
