//! What the limits would have to be: the answer where no controller meets them.

use super::certificate::Limit;
use super::error::OptimumError;
use super::problem::LoopLimits;
use super::relax::Relax;
use super::solve::Solver;

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
        None => beyond(solver, &asked),
    }
}

/// The answer where even the largest Ms that is ever allowed is too strict: a loop that is all but unstable, or none.
fn beyond(solver: &mut Solver<'_>, asked: &LoopLimits) -> OptimumError {
    let controller = solver.controller();
    match solver.least(Relax::beyond()).map(|(floor, _)| floor) {
        Some(floor) if asked.mt.is_infinite() && asked.ju.is_infinite() => {
            OptimumError::Infeasible { controller, limit: Limit::Ms, asked: asked.ms, floor }
        }
        Some(floor) => OptimumError::InfeasibleTogether { controller, limit: Limit::Ms, floor },
        None => OptimumError::NotStabilisable { controller },
    }
}

/// The least value of one limit, the others as given; `None` where relaxing it does not help.
fn least(solver: &mut Solver<'_>, limit: Limit, given: &LoopLimits) -> Option<f64> {
    solver.least(Relax::one(limit, *given)?).map(|(value, _)| value)
}
