//! Finds the limits of an MV that was logged ahead of them.

use crate::identify::{FitProblem, fit_fopdt};

/// Rows of the copy on which limits are tried.
const ROWS: usize = 700;
/// Quantiles of the MV that are tried as limits, both ends included.
const QUANTILES: usize = 9;
/// The squared residual must fall to this part, or the limits explain nothing.
const FALL: f64 = 0.5;
/// A fit this good leaves limits nothing to explain, in percent.
const GOOD_PERCENT: f64 = 99.0;

/// Limits at which the PV stops following the MV; `None` where it follows throughout.
pub(super) fn limits(problem: &FitProblem) -> Option<[f64; 2]> {
    let mut sorted = problem.mv.to_vec();
    sorted.sort_by(f64::total_cmp);
    let mut levels = sorted.clone();
    levels.dedup();
    // An MV of few levels is a hand's: what it asked for, it got.
    if levels.len() < 30 || problem.pv.len() < 50 || !problem.disturbances.is_empty() {
        return None;
    }
    let factor = problem.pv.len().div_ceil(ROWS);
    let every = |values: &[f64]| values.iter().copied().step_by(factor).collect::<Vec<f64>>();
    let (time_s, pv) = (every(problem.time_s), every(problem.pv));
    // The mean of what the valve got, not of what it was asked for: limits come before thinning out.
    let thinned = |limits: [f64; 2]| -> Vec<f64> {
        let held = |rows: &[f64]| {
            rows.iter().map(|u| u.clamp(limits[0], limits[1])).sum::<f64>() / rows.len() as f64
        };
        problem.mv.chunks(factor).map(held).collect()
    };
    let cost = |limits: [f64; 2]| -> f64 {
        let fit = fit_fopdt(&FitProblem::new(&time_s, &pv, &thinned(limits)));
        fit.map_or(f64::INFINITY, |fit| fit.mse)
    };
    let whole = [sorted[0], sorted[sorted.len() - 1]];
    let plain = fit_fopdt(&FitProblem::new(&time_s, &pv, &thinned(whole))).ok()?;
    if plain.fit_percent > GOOD_PERCENT {
        return None;
    }
    let mut best = (plain.mse, whole);
    // Both together first: with a valve that jumps between its limits neither alone explains anything.
    let mut levels: Vec<f64> = (0..=QUANTILES).map(|i| sorted[(sorted.len() - 1) * i / QUANTILES]).collect();
    // Zero is where many a limit lies.
    levels.push(0.0);
    levels.retain(|v| (whole[0]..=whole[1]).contains(v));
    for &low in &levels {
        for &high in levels.iter().filter(|&&high| high > low) {
            let found = cost([low, high]);
            if found < best.0 {
                best = (found, [low, high]);
            }
        }
    }
    let (found, limits) = refined(best, whole, cost);
    // A limit beyond which next to nothing lies is none.
    let beyond = problem.mv.iter().filter(|u| !(limits[0]..=limits[1]).contains(*u)).count();
    (found < FALL * plain.mse && 100 * beyond > problem.mv.len()).then_some(limits)
}

/// Pattern search: each limit up and down by a step that shrinks where neither helps.
fn refined(best: (f64, [f64; 2]), whole: [f64; 2], cost: impl Fn([f64; 2]) -> f64) -> (f64, [f64; 2]) {
    const ROUNDS: usize = 14;
    let (mut least, mut limits) = best;
    let mut step = 0.2 * (limits[1] - limits[0]);
    for _ in 0..ROUNDS {
        let mut moved = false;
        for side in [1, 0] {
            for way in [step, -step] {
                let mut trial = limits;
                trial[side] = (trial[side] + way).clamp(whole[0], whole[1]);
                if trial[0] < trial[1] && trial != limits {
                    let found = cost(trial);
                    if found < least {
                        (least, limits, moved) = (found, trial, true);
                    }
                }
            }
        }
        if !moved {
            step *= 0.4;
        }
    }
    (least, limits)
}
