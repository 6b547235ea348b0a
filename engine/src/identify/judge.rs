//! From the numbers of a fit to findings about it.

use super::FitVerdict;
use super::fopdt::{FopdtFit, Interval};
use super::problem::{FitProblem, Stretch};
use super::statistics::{lag_one_correlation, resolution};

/// Findings, objections first; never empty.
pub(super) fn verdicts(fit: &FopdtFit, stretch: &Stretch, problem: &FitProblem) -> Vec<FitVerdict> {
    /// Half width of K's interval, in percent, that passes for known.
    const GAIN_KNOWN_PERCENT: f64 = 20.0;
    const POOR_PERCENT: f64 = 50.0;
    const CORRELATED: f64 = 0.5;
    let half = |i: Interval, value: f64| 100.0 * (i[1] - value) / value.abs();
    let gain_percent = half(fit.interval_95.gain, fit.model.gain);
    let (t, l) = (fit.model.time_constant_s, fit.model.dead_time_s);
    let sample_time_s = stretch.sample_time_s;
    let mut found = Vec::new();
    if fit.fit_percent < POOR_PERCENT {
        found.push(FitVerdict::Poor { fit_percent: fit.fit_percent });
    }
    if t > stretch.span_s() {
        found.push(FitVerdict::TimeConstantLong { time_constant_s: t, span_s: stretch.span_s() });
    } else if gain_percent > GAIN_KNOWN_PERCENT {
        found.push(FitVerdict::GainUncertain { percent: gain_percent, times: gain_percent / 10.0 });
    }
    if t < sample_time_s / 3.0 {
        found.push(FitVerdict::TimeConstantShort { time_constant_s: t, sample_time_s });
    }
    let [lower, upper] = fit.interval_95.dead_time_s;
    if lower <= 0.0 && upper > sample_time_s {
        found.push(FitVerdict::DeadTimeUnknown {
            upper_s: upper,
            times: ((upper - l) / l.max(sample_time_s)).max(1.0),
        });
    }
    let sd = fit.mse.sqrt();
    if let Some(step) = resolution(problem.pv)
        && sd < 0.5 * step
    {
        let (low, high) =
            fit.simulated.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)));
        if high - low < 20.0 * step {
            found.push(FitVerdict::ResolutionLimited { resolution: step, levels: (high - low) / step });
        }
    }
    let correlation = lag_one_correlation(problem.pv.iter().zip(&fit.simulated).map(|(y, s)| y - s));
    if correlation > CORRELATED && fit.fit_percent < 99.9 {
        found.push(FitVerdict::ResidualsCorrelated { correlation });
    }
    if found.is_empty() {
        found.push(FitVerdict::Good {
            fit_percent: fit.fit_percent,
            gain_percent,
            time_constant_percent: half(fit.interval_95.time_constant_s, t),
        });
    }
    if fit.segments > 1 {
        found.push(FitVerdict::Segments { count: fit.segments });
    }
    if !stretch.free {
        found.push(FitVerdict::StartsAtRest { mv_before: stretch.u_before });
    }
    found
}
