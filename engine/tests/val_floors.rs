//! Limits that no controller meets: the floor that is named instead.

#[path = "optimum/problems.rs"]
mod problems;

use problems::{FREE, check_limits, rational, solve};
use vasos_engine::model::ProcessModel;
use vasos_engine::tune::optimum::{DerivativeFilter, Limit, LoopLimits, Objective, OptimumError, Wanted};

/// A PID was said not to stabilise k/s² at all where a limit is too strict for its filter. A filter of N lifts the phase by
/// asin(N/(N + 2)) at most, so neither Ms nor Mt falls below 1 + 2/N: 1.2 for N = 10, 1.02 for N = 100.
#[test]
fn a_double_integrator_under_strict_limits_is_answered_with_the_floor_of_its_filter() {
    let [lag, delayed, bare] =
        [(vec![0.2, 1.0, 0.0, 0.0], 0.0), (vec![1.0, 0.0, 0.0], 0.1), (vec![1.0, 0.0, 0.0], 0.0)]
            .map(|(den, l)| rational(&[1.0], &den, l));
    let free = LoopLimits { ms: FREE, mt: FREE, ju: FREE };
    let pid = |n| Wanted::Pid(DerivativeFilter::Ratio(n));
    let refused = |model: &ProcessModel, n: f64, limits: LoopLimits, of: Limit| {
        let found = solve(model, pid(n), Objective::Jv, limits);
        let Err(OptimumError::InfeasibleAtFilter { limit, floor, .. }) = found else {
            panic!("{limits:?}: {found:?}")
        };
        assert!(limit == of && (floor - (1.0 + 2.0 / n)).abs() < 1e-6, "{limits:?}: {limit} {floor}");
    };
    for model in [&lag, &delayed, &bare] {
        // At the floor itself rounding decides.
        for ms in [1.05, 1.1, 1.19] {
            refused(model, 10.0, LoopLimits { ms, ..free }, Limit::Ms);
        }
        refused(model, 10.0, LoopLimits { mt: 1.05, ..free }, Limit::Mt);
        refused(model, 100.0, LoopLimits { mt: 1.015, ..free }, Limit::Mt);
    }
    // Just above the floor loops are slow, and found.
    for (model, ms) in [(&lag, 1.21), (&delayed, 1.21), (&delayed, 1.2236), (&delayed, 1.3)] {
        let limits = LoopLimits { ms, ..free };
        check_limits(model, &limits, &solve(model, pid(10.0), Objective::Jv, limits).expect("an optimum"));
    }
    let limits = LoopLimits { mt: 1.05, ..free };
    let found = solve(&lag, Wanted::Pid(DerivativeFilter::Free), Objective::Jv, limits);
    check_limits(&lag, &limits, &found.expect("an optimum"));
    // Without dead time every speed is as robust, and the fastest the best.
    let found = solve(&bare, pid(10.0), Objective::Jv, LoopLimits { ms: 1.3, ..free });
    assert_eq!(found, Err(OptimumError::Unbounded));
}

/// 1/|G(0)| = 1 was named as the least Ju of a PI for e^(−s)/(4 s − 1), which takes 2.77 to be stabilised. By proportional
/// action alone, the limit for Ki → 0, the least is 2.7646 at Kp = 1.574 (dense grid of Kp and ω).
#[test]
fn the_least_ju_of_an_unstable_process_is_that_of_loops_that_are_stable() {
    let model = rational(&[1.0], &[4.0, -1.0], 1.0);
    for ju in [0.5, 1.0, 2.7] {
        let limits = LoopLimits { ms: 4.0, mt: FREE, ju };
        let refused = solve(&model, Wanted::Pi, Objective::Jv, limits);
        let Err(OptimumError::Infeasible { limit: Limit::Ju, floor, .. }) = refused else {
            panic!("{ju}: {refused:?}")
        };
        assert!((floor - 2.7646).abs() < 2e-3, "{ju}: {floor}");
    }
    let limits = LoopLimits { ms: 4.0, mt: FREE, ju: 2.77 };
    check_limits(&model, &limits, &solve(&model, Wanted::Pi, Objective::Jv, limits).expect("an optimum"));
}
