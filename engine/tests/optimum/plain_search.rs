//! A search for the best PI that asks nothing but the exact analysis.

use vasos_engine::analyze::{OpenLoop, analyze_loop};
use vasos_engine::control::ParallelGains;
use vasos_engine::model::ProcessModel;
use vasos_engine::tune::optimum::LoopLimits;

/// The best of a plain search over Kp and Ki: a grid, then finer grids about its best.
///
/// Independent of the optimum: it asks nothing but the exact analysis at every gain.
pub fn plain_search(model: &ProcessModel, limits: &LoopLimits, kp: (f64, f64), ki: (f64, f64)) -> f64 {
    let value = |kp: f64, ki: f64| -> f64 {
        let open = OpenLoop::of_parallel(model, &ParallelGains { kp, ki, kd: 0.0, tf_s: 0.0 });
        let a = analyze_loop(&open);
        let met = a.stable
            && a.ms.is_some_and(|v| v <= limits.ms)
            && a.mt.is_some_and(|v| v <= limits.mt)
            && a.ju.is_some_and(|v| v <= limits.ju);
        if met { a.jv.unwrap_or(f64::INFINITY) } else { f64::INFINITY }
    };
    let (mut kp, mut ki) = (kp, ki);
    let mut best = (f64::INFINITY, 0.0, 0.0);
    const STEPS: u32 = 40;
    for _ in 0..14 {
        for i in 0..=STEPS {
            for j in 0..=STEPS {
                let at = |range: (f64, f64), k: u32| {
                    range.0 + (range.1 - range.0) * f64::from(k) / f64::from(STEPS)
                };
                let (p, i) = (at(kp, i), at(ki, j));
                let v = value(p, i);
                if v < best.0 {
                    best = (v, p, i);
                }
            }
        }
        let around = |centre: f64, range: (f64, f64)| {
            let half = 0.3 * (range.1 - range.0);
            ((centre - half).max(0.0), centre + half)
        };
        (kp, ki) = (around(best.1, kp), around(best.2, ki));
    }
    best.0
}
