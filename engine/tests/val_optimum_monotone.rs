//! A looser limit leaves no worse optimum.

#[path = "optimum/problems.rs"]
mod problems;

use problems::{FREE, rational, solve};
use vasos_engine::model::{Fopdt, ProcessModel};
use vasos_engine::tune::optimum::{DerivativeFilter, LoopLimits, Objective, Wanted};

fn value(model: &ProcessModel, n: Option<f64>, objective: Objective, ms: f64) -> f64 {
    let wanted = Wanted::Pid(n.map_or(DerivativeFilter::Free, DerivativeFilter::Ratio));
    let found = solve(model, wanted, objective, LoopLimits { ms, mt: FREE, ju: FREE });
    let value = found.unwrap_or_else(|e| panic!("{model:?} Ms {ms}: {e}")).value;
    if objective == Objective::Jv { 1.0 / value } else { value }
}

/// Crossings were counted between points further apart than a dead time turns, so that unstable gains looked the best and
/// drew the search away: with a dead time of 30 time constants Ki fell from 0.0337 to 0.0250 as Ms rose from 1.70 to 1.75,
/// and 98 of 4,800 such steps on 20 processes made the optimum worse by up to a third; 1 is left (11 %).
#[test]
fn val_a_looser_limit_leaves_no_worse_pid() {
    let dead = |l: f64| ProcessModel::Fopdt(Fopdt::new(1.0, 1.0, l).expect("a model"));
    let lags = rational(&[1.0], &[1.0, 3.0, 3.0, 1.0], 15.0);
    for (model, n, objective, limits) in [
        (dead(30.0), Some(10.0), Objective::MaxKi, [1.70, 1.75]),
        (dead(30.0), None, Objective::MaxKi, [1.65, 1.70]),
        (dead(15.0), Some(20.0), Objective::MaxKi, [1.95, 2.00]),
        (dead(15.0), Some(5.0), Objective::MaxKi, [2.20, 2.25]),
        (dead(10.0), Some(10.0), Objective::Jv, [2.15, 2.20]),
        (dead(6.0), Some(10.0), Objective::Jv, [1.65, 1.70]),
        (lags, Some(10.0), Objective::MaxKi, [1.65, 1.70]),
    ] {
        let [strict, loose] = limits.map(|ms| value(&model, n, objective, ms));
        assert!(loose > 0.999 * strict, "{model:?} N {n:?} {objective:?} {limits:?}: {strict} {loose}");
    }
}
