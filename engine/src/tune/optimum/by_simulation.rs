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
use crate::analyze::{Excitation, OpenLoop, ResponseEnd, ResponseOptions, loop_response, quick_iae};

/// How much a derivative must gain to be proposed at all, and as much where its filter's phase at the frequency at which the
/// loop comes nearest to −1 passes that many radians.
const WORTH_OF_DERIVATIVE: f64 = 0.002;
const WORTH_OF_DISGUISE: f64 = 0.01;
const SLOW_FILTER_RAD: f64 = 100.0;
/// How far from the least Jv another valley of Td has to lie to be a start of its own, as a logarithm.
const ELSEWHERE: f64 = 0.4;
/// Rounds of exact checks of the result.
const ROUNDS: usize = 20;
/// Shares of the largest Ki at which searches start.
const START_SHARES: [f64; 3] = [0.9, 0.5, 0.2];
/// Grid of the starts away from the least Jv: Td in units of 1/ω, ω where its loop comes nearest to −1, shares of the
/// largest Kp that meets the limits, Ti in units of its Ti; how many of the best are followed, and N where it is free.
const START_TDS: [f64; 5] = [0.1, 0.2, 0.35, 0.6, 1.0];
const START_KPS: [f64; 2] = [0.97, 0.75];
const START_TIS: [f64; 6] = [0.7, 1.0, 1.5, 2.2, 3.3, 5.0];
const MOST_SCATTERED: usize = 1;
const FROM_AFAR: Simplex = Simplex { step: 0.2, last_step: 3e-4, most_evaluations: 100 };
/// The same from a result that lost more than this by being made exact, how often, and where of the largest Kp it starts.
const FROM_NEAR: Simplex = Simplex { step: 0.06, last_step: 3e-4, most_evaluations: 60 };
const LOST: f64 = 1e-3;
const MOST_CONFIRMED: usize = 3;
const SHORT_OF_LARGEST: f64 = 0.02;
const FREE_START_RATIO: f64 = 3.0;
/// Steps in which that largest Kp is sought on each side of the start's, and halvings after them.
const KP_STEPS: i32 = 10;
const KP_STEP: f64 = 1.2;
const KP_HALVINGS: u32 = 12;
/// Processes that are taken in one by one before all are simulated, and the relative difference of IAE that does not count.
const MOST_WORST: usize = 6;
const SAME: f64 = 1e-4;
const SIMPLEX: Simplex = Simplex { step: 0.2, last_step: 2e-5, most_evaluations: 160 };
/// Ki of a pure integrator, and Kp Ki⁻¹ of the start beside it in units of 1/ω.
const OF_KI: Simplex = Simplex { step: 0.2, last_step: 2e-5, most_evaluations: 60 };
const BESIDE_INTEGRATOR: f64 = 0.1;
/// Once more about the best of all, since a simplex can get stuck on an edge that limits make.
const AGAIN: Simplex = Simplex { step: 0.05, last_step: 2e-5, most_evaluations: 100 };

/// Least IAE, from the least Jv on.
pub(super) fn solve(solver: &mut Solver<'_>, objective: Objective) -> Result<Optimum, OptimumError> {
    let wanted = solver.wanted;
    let start = solver.solve(Objective::Jv)?;
    // What Jv is not best in IAE may be.
    let valleys = std::mem::take(&mut solver.valleys);
    let mut best = valued(solver, objective, start.clone());
    let mut without: Option<Optimum> = None;
    let mut take = |found: Option<Optimum>| {
        if let Some(found) = found.filter(|f| f.value < best.value) {
            best = found;
        }
    };
    // Without derivative action first: a PID may do no worse.
    if wanted != Wanted::Pi {
        solver.wanted = Wanted::Pi;
        let simple = solver.solve(Objective::Jv);
        let found = simple.ok().and_then(|simple| searched(solver, objective, &simple));
        solver.wanted = wanted;
        without.clone_from(&found);
        take(found);
    }
    take(searched(solver, objective, &start));
    let from = Lead::of(&start.gains).td_s;
    let elsewhere = |v: &&Candidate| from == 0.0 || (v.lead.td_s / from).ln().abs() > ELSEWHERE;
    for valley in valleys.iter().filter(elsewhere) {
        take(searched_from(solver, objective, valley));
    }
    Ok(match without {
        Some(without) if simpler_does(solver, &best, &without) => without,
        _ => best,
    })
}

/// Whether a PI is to be preferred to a PID that gains next to nothing in an objective that is to be small; more is wanted of
/// one whose filter is so slow that its derivative is proportional action at every frequency that matters, with a Td and a
/// Kp that mean nothing.
fn simpler_does(solver: &Solver<'_>, with: &Optimum, without: &Optimum) -> bool {
    let candidate = candidate_of(solver, with);
    let lead = candidate.lead;
    let disguised = lead.tf_s * solver.nearest_omega(&candidate) > SLOW_FILTER_RAD;
    let worth = if disguised { WORTH_OF_DISGUISE } else { WORTH_OF_DERIVATIVE };
    lead.td_s > 0.0 && without.value <= with.value * (1.0 + worth)
}

/// The gains of an optimum, as a search goes by them.
fn candidate_of(solver: &Solver<'_>, found: &Optimum) -> Candidate {
    let sign = solver.family.sign;
    let lead = Lead::of(&found.gains);
    Candidate { lead, kp: sign * found.gains.kp, ki: sign * found.gains.ki, value: 0.0 }
}

/// An optimum for another objective with its IAE.
fn valued(solver: &Solver<'_>, objective: Objective, found: Optimum) -> Optimum {
    let value = iae(solver, objective, &candidate_of(solver, &found));
    Optimum { value, certificate: Certificate { gap: None, ..found.certificate }, ..found }
}

/// The best Ki of a pure integrator, and the best about a little Kp beside it.
fn from_integrator(solver: &mut Solver<'_>, objective: Objective) -> Option<Optimum> {
    let limits = solver.limits;
    let largest = solver.at_gain(Objective::MaxKi, &limits, Lead::NONE, 0.0)?;
    let everything: Vec<usize> = (0..solver.family.plants.len()).collect();
    let mut best = Candidate { value: f64::INFINITY, ..largest };
    for share in START_SHARES {
        let mut value = |x: &[f64]| {
            let candidate = Candidate { ki: largest.ki * x[0].exp().min(1.0), ..largest };
            let value = worst(solver, objective, &candidate, &everything).1;
            if value < best.value {
                best = Candidate { value, ..candidate };
            }
            value
        };
        minimise(&OF_KI, &[share.ln()], &mut value);
    }
    let alone = best.value.is_finite().then(|| certified(solver, objective, best).ok()).flatten();
    let kp = BESIDE_INTEGRATOR * best.ki / solver.nearest_omega(&best);
    let beside = searched_from(solver, objective, &Candidate { kp, ..best });
    match (alone, beside) {
        // A Kp that gains nothing is none.
        (Some(alone), Some(beside)) if beside.value < alone.value * (1.0 - SAME) => Some(beside),
        (alone, beside) => alone.or(beside),
    }
}

/// The best that simplexes from some shares of the largest Ki come to, certified; `None` where the exact analysis does not
/// confirm it.
fn searched(solver: &mut Solver<'_>, objective: Objective, start: &Optimum) -> Option<Optimum> {
    if start.gains.kp == 0.0 {
        return from_integrator(solver, objective);
    }
    let start = candidate_of(solver, start);
    searched_from(solver, objective, &start)
}

fn searched_from(solver: &mut Solver<'_>, objective: Objective, at_start: &Candidate) -> Option<Optimum> {
    let lead = at_start.lead;
    let filter = match solver.wanted {
        Wanted::Pid(filter) if lead.td_s > 0.0 => Some(filter),
        _ => None,
    };
    // Of many processes a few are ever the worst: only these are simulated, and all for what comes of it.
    let everything: Vec<usize> = (0..solver.family.plants.len()).collect();
    let mut plants = vec![worst(solver, objective, at_start, &everything).0];
    for _ in 0..MOST_WORST {
        let best = searched_among(solver, objective, at_start, filter, &plants)?;
        let (index, value) = worst(solver, objective, &best, &everything);
        if value <= best.value * (1.0 + SAME) || plants.contains(&index) {
            return confirmed(solver, objective, filter, best, &plants);
        }
        plants.push(index);
    }
    let best = searched_among(solver, objective, at_start, filter, &everything)?;
    confirmed(solver, objective, filter, best, &everything)
}

/// A result made exact; once more from there where that costs it much, because the frequencies that were missing are among
/// the points only now, or where a simplex ended short of every limit.
fn confirmed(
    solver: &mut Solver<'_>,
    objective: Objective,
    filter: Option<DerivativeFilter>,
    seen: Candidate,
    plants: &[usize],
) -> Option<Optimum> {
    let mut best = certified(solver, objective, seen).ok();
    let mut seen = seen;
    for _ in 0..MOST_CONFIRMED {
        let Some(filter) = filter else { break };
        let done = best.as_ref().is_some_and(|b| {
            let kept = b.value <= seen.value * (1.0 + LOST);
            if objective == Objective::IaeSetpoint { kept } else { !b.certificate.active.is_empty() }
        });
        if done {
            break;
        }
        let from = place(Some(filter), seen.lead, -SHORT_OF_LARGEST, (seen.ki / seen.kp).ln());
        let mut again: Option<Candidate> = None;
        let mut value = |x: &[f64]| {
            let Some(candidate) = held_at(solver, filter, x, seen.kp) else { return f64::INFINITY };
            let value = worst(solver, objective, &candidate, plants).1;
            if value.is_finite() && again.is_none_or(|b| value < b.value) {
                again = Some(Candidate { value, ..candidate });
            }
            value
        };
        minimise(&FROM_NEAR, &from, &mut value);
        let Some(found) = again else { break };
        seen = found;
        let sure = certified(solver, objective, found).ok();
        best = match (best, sure) {
            (Some(old), Some(new)) if new.value >= old.value => Some(old),
            (old, new) => new.or(old),
        };
    }
    best
}

/// The best that simplexes come to where only some processes are simulated.
fn searched_among(
    solver: &mut Solver<'_>,
    objective: Objective,
    start: &Candidate,
    filter: Option<DerivativeFilter>,
    plants: &[usize],
) -> Option<Candidate> {
    let Candidate { lead, kp, .. } = *start;
    let mut best: Option<Candidate> = None;
    let go = |best: &mut Option<Candidate>, solver: &mut Solver<'_>, simplex: &Simplex, from: &[f64]| {
        let mut value = |x: &[f64]| {
            let Some(candidate) = candidate_at(solver, filter, x) else { return f64::INFINITY };
            let value = worst(solver, objective, &candidate, plants).1;
            if value.is_finite() && best.is_none_or(|b| value < b.value) {
                *best = Some(Candidate { value, ..candidate });
            }
            value
        };
        minimise(simplex, from, &mut value);
    };
    for share in START_SHARES {
        go(&mut best, solver, &SIMPLEX, &place(filter, lead, kp.ln(), share.ln()));
    }
    if let Some(filter) = filter
        && objective == Objective::IaeSetpoint
    {
        for from in scattered(solver, objective, filter, start, plants) {
            let mut value = |x: &[f64]| {
                let Some(candidate) = held_at(solver, filter, x, kp) else { return f64::INFINITY };
                let value = worst(solver, objective, &candidate, plants).1;
                if value.is_finite() && best.is_none_or(|b| value < b.value) {
                    best = Some(Candidate { value, ..candidate });
                }
                value
            };
            minimise(&FROM_AFAR, &from, &mut value);
        }
    }
    let (found, limits) = (best?, solver.limits);
    if filter.is_some()
        && let Some(largest) = solver.at_gain(Objective::MaxKi, &limits, found.lead, found.kp)
    {
        let share = (found.ki / largest.ki).min(1.0);
        go(&mut best, solver, &AGAIN, &place(filter, found.lead, found.kp.ln(), share.ln()));
    }
    best
}

/// Coordinates of a place, the last two as far as they are free.
fn place(filter: Option<DerivativeFilter>, lead: Lead, first: f64, second: f64) -> Vec<f64> {
    let mut x = vec![first, second];
    if filter.is_some() {
        x.push(lead.td_s.ln());
    }
    if filter == Some(DerivativeFilter::Free) {
        x.push((lead.td_s / lead.tf_s).ln());
    }
    x
}

/// Starts far from the least Jv: what is best for a setpoint wants more Kp, a Ti near the process's own time and a small
/// Td, so a coarse grid is simulated and the best of some Td are taken. Coordinates as [`held_at`] reads them.
fn scattered(
    solver: &mut Solver<'_>,
    objective: Objective,
    filter: DerivativeFilter,
    start: &Candidate,
    plants: &[usize],
) -> Vec<Vec<f64>> {
    let omega = solver.nearest_omega(start);
    let n = match filter {
        DerivativeFilter::Ratio(n) => n,
        DerivativeFilter::Free => FREE_START_RATIO,
    };
    let mut best: Vec<(f64, Vec<f64>)> = Vec::new();
    for td in START_TDS {
        let td_s = td / omega;
        let lead = Lead { td_s, tf_s: td_s / n };
        let mut of_td: Option<(f64, Vec<f64>)> = None;
        for share in START_KPS {
            for times in START_TIS {
                let x = place(Some(filter), lead, f64::ln(share), (start.ki / (start.kp * times)).ln());
                let Some(candidate) = held_at(solver, filter, &x, start.kp) else { continue };
                let value = worst(solver, objective, &candidate, plants).1;
                if value.is_finite() && of_td.as_ref().is_none_or(|b| value < b.0) {
                    of_td = Some((value, x));
                }
            }
        }
        best.extend(of_td);
    }
    best.sort_by(|a, b| a.0.total_cmp(&b.0));
    best.into_iter().take(MOST_SCATTERED).map(|b| b.1).collect()
}

/// ln of the share of the largest Kp, −ln Ti, ln Td, ln N: without walls, for what a limit holds stays at the limit.
fn held_at(solver: &mut Solver<'_>, filter: DerivativeFilter, x: &[f64], about: f64) -> Option<Candidate> {
    let td_s = x[2].exp();
    let n = match filter {
        DerivativeFilter::Ratio(n) => n,
        DerivativeFilter::Free => x[3].exp().clamp(RATIO_RANGE.0, RATIO_RANGE.1),
    };
    let lead = Lead { td_s, tf_s: td_s / n };
    let limits = solver.limits;
    let mut meets = |kp: f64| solver.at_gain(Objective::MaxKi, &limits, lead, kp).is_some();
    // From below: past the gains that stabilise a loop may keep its distance from −1 as well.
    let mut low = (0..KP_STEPS).map(|k| about / KP_STEP.powi(k)).find(|kp| meets(*kp))?;
    while low < about * KP_STEP.powi(KP_STEPS) && meets(low * KP_STEP) {
        low *= KP_STEP;
    }
    let mut high = low * KP_STEP;
    for _ in 0..KP_HALVINGS {
        let middle = 0.5 * (low + high);
        if meets(middle) { low = middle } else { high = middle }
    }
    let kp = low * x[0].exp().min(1.0);
    let largest = solver.at_gain(Objective::MaxKi, &limits, lead, kp)?;
    Some(Candidate { ki: largest.ki.min(kp * x[1].exp()), ..largest })
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

/// IAE of the worst process, as a response gives it; ∞ where a loop is unstable or does not settle.
fn iae(solver: &Solver<'_>, objective: Objective, candidate: &Candidate) -> f64 {
    let all: Vec<usize> = (0..solver.family.plants.len()).collect();
    let exactly = |open: &OpenLoop, excitation| {
        let response = loop_response(open, excitation, &ResponseOptions::default());
        let settled = response.end == ResponseEnd::Settled;
        response.metrics().ok().filter(|_| settled).map(|m| m.iae)
    };
    worst_by(solver, objective, candidate, &all, &exactly).1
}

/// Which of some processes is the worst, with its IAE as a search sees it.
fn worst(solver: &Solver<'_>, objective: Objective, candidate: &Candidate, plants: &[usize]) -> (usize, f64) {
    worst_by(solver, objective, candidate, plants, &quick_iae)
}

fn worst_by(
    solver: &Solver<'_>,
    objective: Objective,
    candidate: &Candidate,
    plants: &[usize],
    iae: &dyn Fn(&OpenLoop, Excitation) -> Option<f64>,
) -> (usize, f64) {
    let excitation = if objective == Objective::IaeLoad { Excitation::Load } else { Excitation::Setpoint };
    let gains = solver.family.gains(candidate.lead, candidate.kp, candidate.ki);
    let of = |process: &Process| -> f64 {
        let Process::Model(model) = process else { return f64::INFINITY };
        iae(&OpenLoop::of_parallel(model, &gains), excitation).unwrap_or(f64::INFINITY)
    };
    let each = plants.iter().map(|&i| (i, of(solver.family.plants[i].process)));
    each.fold((0, 0.0), |worst, one| if one.1 > worst.1 { one } else { worst })
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
        let less = largest.map_or(0.0, |largest| last.ki.min(largest.ki));
        // Where it is not Ki that the limit bears on, Kp goes down.
        if !unstable && less > 0.0 && less < last.ki * (1.0 - 0.1 * excess) {
            last.ki = less;
        } else {
            let share = 1.0 - 2.0 * excess.clamp(1e-9, 0.1);
            (last.kp, last.ki) = (last.kp * share, last.ki * share);
        }
    }
    Err(OptimumError::NotCertified { excess_percent: 100.0 * excess })
}
