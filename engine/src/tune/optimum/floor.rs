//! What the limits would have to be: the answer where no controller meets them.

use super::certificate::Limit;
use super::error::OptimumError;
use super::problem::LoopLimits;
use super::relax::Relax;
use super::slice::{Lead, Shaped};
use super::slow;
use super::solve::Solver;

/// The limit on Ju that integral action rules out: C S is 1/G for ω → 0. Slow loops of a stable process come as near to
/// that as one likes; what has to be stabilised first may take more.
pub(super) fn of_ju(solver: &mut Solver<'_>) -> Option<OptimumError> {
    let (asked, floor) = (solver.limits.ju, solver.family.least_ju());
    if asked >= floor * (1.0 - 1e-12) {
        return None;
    }
    let shaped = Shaped::new(&solver.family.points, Lead::NONE);
    let by_itself = solver.family.stabilising(&shaped).first().is_some_and(|gains| gains.0 == 0.0);
    let controller = solver.controller();
    Some(if by_itself {
        OptimumError::Infeasible { controller, limit: Limit::Ju, asked, floor }
    } else {
        explain(solver)
    })
}

/// Why a problem has no solution: the limit whose relaxing costs least, and the least value it can have.
pub(super) fn explain(solver: &mut Solver<'_>) -> OptimumError {
    let controller = solver.controller();
    let asked = solver.limits;
    if let Some(refused) = of_slow(solver) {
        return refused;
    }
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
    let (value, _) = solver.least(Relax::one(limit, *given)?)?;
    Some(if limit == Limit::Ju { value.max(solver.family.least_ju()) } else { value })
}

/// A limit on Ms or Mt that rules out loops of every speed about a double integrator: the filter's N decides.
pub(super) fn of_slow(solver: &Solver<'_>) -> Option<OptimumError> {
    let asked = solver.limits;
    let n = slow::filter(solver.wanted)?;
    let alone = LoopLimits { ms: f64::INFINITY, mt: f64::INFINITY, ..asked };
    let of = |limit: Limit, own: f64, given: LoopLimits| {
        let floor = slow::floor(solver, limit, &given)?;
        Some(OptimumError::InfeasibleAtFilter { n, limit, asked: own, floor })
    };
    of(Limit::Ms, asked.ms, LoopLimits { ms: asked.ms, ..alone })
        .or_else(|| of(Limit::Mt, asked.mt, LoopLimits { mt: asked.mt, ..alone }))
        .or_else(|| of(Limit::Ms, asked.ms, asked))
}
