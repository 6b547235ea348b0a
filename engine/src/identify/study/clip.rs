//! Finds the limits of an MV that was logged ahead of them.

use crate::identify::{FitProblem, fit_fopdt};

/// Rows of the copy on which limits are tried.
const ROWS: usize = 1500;
/// The squared residual must fall to this part, or the limits explain nothing.
const FALL: f64 = 0.5;
/// A fit this good leaves limits nothing to explain, in percent.
const GOOD_PERCENT: f64 = 95.0;

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
    let (time_s, pv, mv) = (every(problem.time_s), every(problem.pv), every(problem.mv));
    let cost = |limits: [f64; 2]| -> f64 {
        let clipped: Vec<f64> = mv.iter().map(|u| u.clamp(limits[0], limits[1])).collect();
        let fit = fit_fopdt(&FitProblem::new(&time_s, &pv, &clipped));
        fit.map_or(f64::INFINITY, |fit| fit.mse)
    };
    let whole = [sorted[0], sorted[sorted.len() - 1]];
    let plain = fit_fopdt(&FitProblem::new(&time_s, &pv, &mv)).ok()?;
    if plain.fit_percent > GOOD_PERCENT {
        return None;
    }
    let mut best = (plain.mse, whole);
    for _ in 0..2 {
        for side in [1, 0] {
            let mut steps: Vec<f64> = (1..20)
                .map(|i| sorted[(sorted.len() - 1) * i / 20])
                .filter(|v| *v > whole[0] && *v < whole[1])
                .collect();
            // Round numbers are what limits are set to.
            steps.push(0.0);
            for value in steps.into_iter().filter(|v| *v > whole[0] && *v < whole[1]) {
                let mut trial = best.1;
                trial[side] = value;
                if trial[0] < trial[1] {
                    let found = cost(trial);
                    if found < best.0 {
                        best = (found, trial);
                    }
                }
            }
        }
    }
    if best.0 > FALL * plain.mse {
        return None;
    }
    Some(refined(best.1, whole, cost))
}

/// Golden section of each limit that lies inside the range.
fn refined(found: [f64; 2], whole: [f64; 2], cost: impl Fn([f64; 2]) -> f64) -> [f64; 2] {
    const RATIO: f64 = 0.618_033_988_75;
    let mut limits = found;
    for side in [1, 0] {
        if limits[side] == whole[side] || limits[side] == 0.0 {
            continue;
        }
        let width = 0.08 * (whole[1] - whole[0]);
        let (mut a, mut b) = (limits[side] - width, limits[side] + width);
        let at = |value: f64| {
            let mut trial = limits;
            trial[side] = value;
            if trial[0] < trial[1] { cost(trial) } else { f64::INFINITY }
        };
        let (mut c, mut d) = (b - RATIO * (b - a), a + RATIO * (b - a));
        let (mut at_c, mut at_d) = (at(c), at(d));
        for _ in 0..14 {
            if at_c < at_d {
                (b, d, at_d) = (d, c, at_c);
                c = b - RATIO * (b - a);
                at_c = at(c);
            } else {
                (a, c, at_c) = (c, d, at_d);
                d = a + RATIO * (b - a);
                at_d = at(d);
            }
        }
        limits[side] = 0.5 * (a + b);
    }
    limits
}
