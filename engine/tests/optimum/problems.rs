//! What every test of optima poses and asks of an answer.

#![allow(dead_code, reason = "each test binary uses its part")]

use vasos_engine::analyze::{OpenLoop, analyze_loop};
use vasos_engine::model::ProcessModel;
use vasos_engine::tune::optimum::{
    LoopLimits, Objective, Optimum, OptimumError, OptimumProblem, Process, Wanted, optimum,
};

/// No limit.
pub const FREE: f64 = f64::INFINITY;

pub fn rational(num: &[f64], den: &[f64], dead_time_s: f64) -> ProcessModel {
    ProcessModel::rational(num, den, dead_time_s).expect("a model")
}

pub fn solve(
    model: &ProcessModel,
    wanted: Wanted,
    objective: Objective,
    limits: LoopLimits,
) -> Result<Optimum, OptimumError> {
    let processes = [Process::Model(model.clone())];
    optimum(&OptimumProblem { processes: &processes, wanted, objective, limits })
}

/// Gains that keep the limits.
pub fn check_limits(model: &ProcessModel, limits: &LoopLimits, found: &Optimum) {
    let analysis = analyze_loop(&OpenLoop::of_parallel(model, &found.gains));
    assert!(analysis.stable, "{found:?}");
    for (value, limit) in [(analysis.ms, limits.ms), (analysis.mt, limits.mt), (analysis.ju, limits.ju)] {
        assert!(value.expect("finite") <= limit * (1.0 + 1e-8), "{limits:?} {found:?}");
    }
}
