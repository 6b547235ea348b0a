//! What the limits would have to be: the answer where no controller meets them.

use super::certificate::Limit;
use super::error::OptimumError;
use super::problem::{LoopLimits, Objective};
use super::solve::{LARGEST_MS, Solver};

/// Halvings of the logarithm of a limit's excess over 1.
const HALVINGS: usize = 12;
/// Largest values of limits that are tried.
const MOST_JU: f64 = 1e6;

/// The limit on Ju that integral action rules out: C S is 1/G for ω → 0.
pub(super) fn of_ju(solver: &Solver<'_>) -> Option<OptimumError> {
    let (asked, floor) = (solver.limits.ju, solver.family.least_ju());
    let controller = solver.controller();
    (asked < floor * (1.0 - 1e-12)).then_some(OptimumError::Infeasible {
        controller,
        limit: Limit::Ju,
        asked,
        floor,
    })
}

/// Why a problem has no solution: the limit whose relaxing costs least, and the least value it can have.
pub(super) fn explain(solver: &mut Solver<'_>) -> OptimumError {
    let controller = solver.controller();
    let asked = solver.limits;
    let mut best: Option<(f64, Limit, f64, f64)> = None;
    for (limit, own) in [(Limit::Ms, asked.ms), (Limit::Mt, asked.mt), (Limit::Ju, asked.ju)] {
        if !own.is_finite() {
            continue;
        }
        if let Some(floor) = least(solver, limit, &asked) {
            let stretch = floor / own;
            if best.is_none_or(|b| stretch < b.0) {
                best = Some((stretch, limit, own, floor));
            }
        }
    }
    if let Some((_, limit, asked, floor)) = best {
        return OptimumError::Infeasible { controller, limit, asked, floor };
    }
    let free = LoopLimits { ms: f64::INFINITY, mt: f64::INFINITY, ju: f64::INFINITY };
    let (limit, own) = if asked.ms.is_finite() {
        (Limit::Ms, LoopLimits { ms: asked.ms, ..free })
    } else {
        (Limit::Mt, LoopLimits { mt: asked.mt, ..free })
    };
    match least(solver, limit, &own) {
        Some(floor) if own == asked => OptimumError::Infeasible { controller, limit, asked: asked.ms, floor },
        Some(floor) => OptimumError::InfeasibleTogether { controller, limit, floor },
        None => OptimumError::NotStabilisable { controller },
    }
}

/// The least value of one limit, the others as given; `None` where relaxing it does not help.
fn least(solver: &mut Solver<'_>, limit: Limit, given: &LoopLimits) -> Option<f64> {
    let with = |value: f64| match limit {
        Limit::Ms => LoopLimits { ms: value, ..*given },
        Limit::Mt => LoopLimits { mt: value, ..*given },
        Limit::Ju => LoopLimits { ju: value, ..*given },
    };
    let kept = solver.limits;
    let mut met = |value: f64| {
        solver.limits = with(value);
        let found = solver.within_limits(Objective::MaxKi);
        solver.limits = kept;
        matches!(found, Ok(Some(_)) | Err(OptimumError::Unbounded))
    };
    let (mut low, most, base) = match limit {
        Limit::Ms | Limit::Mt if given.ms.min(given.mt) >= LARGEST_MS => return None,
        Limit::Ms => (given.ms - 1.0, LARGEST_MS - 1.0, 1.0),
        Limit::Mt => (given.mt - 1.0, LARGEST_MS - 1.0, 1.0),
        Limit::Ju => (given.ju, MOST_JU * given.ju, 0.0),
    };
    // Upwards first, so that the laxest limits, which need the closest points, are asked only where it must be.
    low = low.max(1e-6);
    let mut high = (2.0 * low).min(most);
    while !met(base + high) {
        if high >= most {
            return None;
        }
        (low, high) = (high, (2.0 * high).min(most));
    }
    for _ in 0..HALVINGS {
        let middle = (low * high).sqrt();
        if met(base + middle) { high = middle } else { low = middle }
    }
    Some(base + high)
}
