//! From the numbers of a fit to findings about it.

use super::FitVerdict;
use super::model_fit::{LoadFit, ModelFit};
use super::parameters::Parameter;
use super::problem::{FitProblem, Stretch};
use super::statistics::resolution;

/// Half width of the gain's interval, in percent, that passes for known.
const GAIN_KNOWN_PERCENT: f64 = 20.0;
/// Half width of another parameter's interval, in percent, that passes for known.
const KNOWN_PERCENT: f64 = 50.0;
const POOR_PERCENT: f64 = 50.0;
/// Correlation of neighbouring residuals worth a word.
const CORRELATED: f64 = 0.3;

/// Findings, objections first; never empty.
pub(super) fn of_model(fit: &ModelFit, stretch: &Stretch, problem: &FitProblem) -> Vec<FitVerdict> {
    let mut found = Vec::new();
    if fit.fit_percent < POOR_PERCENT {
        let fit_percent = fit.fit_percent;
        // White residuals leave another structure nothing to explain.
        found.push(if fit.tests.is_white() && half_percent(&fit.parameters[0]) < GAIN_KNOWN_PERCENT {
            FitVerdict::Noisy { fit_percent }
        } else {
            FitVerdict::Poor { fit_percent }
        });
    }
    found.extend(diverges(problem.pv));
    parameters(fit, stretch, &mut found);
    for d in &fit.disturbances {
        let [low, high] = d.parameters[0].interval_95;
        if low.is_nan() || high.is_nan() || low * high <= 0.0 {
            found.push(FitVerdict::DisturbanceUnknown { name: d.name.clone() });
        }
    }
    found.extend(too_coarse(fit, problem));
    residuals(fit, &mut found);
    found.extend(rings(fit));
    if found.is_empty() {
        let gain = &fit.parameters[0];
        found.push(FitVerdict::Good {
            fit_percent: fit.fit_percent,
            gain: gain.name,
            gain_percent: half_percent(gain),
        });
    }
    if let Some((per_second, _)) = fit.drift {
        found.push(FitVerdict::Drift { per_hour: 3600.0 * per_second });
    }
    found.extend(fit.loads.iter().map(|load| {
        let LoadFit { at_s, change, .. } = *load;
        if load.integrates() {
            FitVerdict::LoadRate { at_s, per_hour: 3600.0 * change }
        } else {
            FitVerdict::Load { at_s, change }
        }
    }));
    if fit.segments > 1 {
        found.push(FitVerdict::Segments { count: fit.segments });
    }
    if stretch.at_rest {
        found.push(FitVerdict::StartsAtRest { mv_before: stretch.u_before });
    }
    found
}

/// Half the interval in percent of the value.
fn half_percent(p: &Parameter) -> f64 {
    100.0 * (p.interval_95[1] - p.value) / p.value.abs()
}

fn parameters(fit: &ModelFit, stretch: &Stretch, found: &mut Vec<FitVerdict>) {
    let moved = movement(stretch);
    let gain =
        if moves_nothing(fit, stretch, moved) { f64::INFINITY } else { half_percent(&fit.parameters[0]) };
    let slowest = fit.parameter("T_s").map_or(0.0, |t| t.value);
    if slowest > stretch.span_s() {
        let span_s = stretch.span_s();
        found.push(FitVerdict::TimeConstantLong { time_constant_s: slowest, span_s });
    } else if gain.is_nan() || gain >= 100.0 {
        found.push(FitVerdict::GainUnknown);
    } else if gain > GAIN_KNOWN_PERCENT {
        found.push(FitVerdict::GainUncertain {
            percent: gain,
            mv_move: moved * gain / 10.0,
            mv_moved: moved,
        });
    }
    let sample_time_s = stretch.sample_time_s;
    if fit.structure != super::Structure::Ipdt && slowest < sample_time_s / 3.0 {
        found.push(FitVerdict::TimeConstantShort { time_constant_s: slowest, sample_time_s });
    }
    let others = [("T_s", "T"), ("T2_s", "T2"), ("zeta", "zeta"), ("Tz_s", "Tz")];
    for (name, symbol) in others {
        if let Some(p) = fit.parameter(name)
            && slowest <= stretch.span_s()
            && p.value.abs() > sample_time_s / 3.0
        {
            let percent = half_percent(p);
            if !percent.is_finite() {
                found.push(FitVerdict::ParameterUnknown { name: symbol });
            } else if percent > KNOWN_PERCENT {
                let mv_move = moved * percent / 20.0;
                found.push(FitVerdict::ParameterUncertain { name: symbol, percent, mv_move });
            }
        }
    }
    if let Some(l) = fit.parameter("L_s") {
        let [lower, upper] = l.interval_95;
        if !upper.is_finite() {
            found.push(FitVerdict::ParameterUnknown { name: "L" });
        } else if lower <= 0.0 && upper > sample_time_s {
            let times = ((upper - l.value) / l.value.max(sample_time_s)).max(1.0);
            found.push(FitVerdict::DeadTimeUnknown { upper_s: upper, mv_move: moved * times });
        }
    }
}

/// Whether the model's answer to the MV vanishes in the PV's movement: then rounding alone gave it a gain.
fn moves_nothing(fit: &ModelFit, stretch: &Stretch, moved: f64) -> bool {
    const SHARE: f64 = 1e-6;
    let (low, high) = range(stretch.y.iter());
    let integrating_s = if fit.structure == super::Structure::Ipdt { stretch.span_s() } else { 1.0 };
    fit.parameters[0].value.abs() * moved * integrating_s < SHARE * (high - low)
}

/// From the lowest to the highest MV, in MV units.
fn movement(stretch: &Stretch) -> f64 {
    let (low, high) = range(stretch.u.iter());
    high.max(stretch.u_before) - low.min(stretch.u_before)
}

fn range<'a>(values: impl Iterator<Item = &'a f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)))
}

/// A swing that the MV need not have made: with a process that rings alone, noise would be all that is left.
fn rings(fit: &ModelFit) -> Option<FitVerdict> {
    const ZETA: f64 = 0.3;
    const EXPLAINED_PERCENT: f64 = 95.0;
    let (zeta, tau) = (fit.parameter("zeta")?.value, fit.parameter("T_s")?.value);
    let more_than_noise = fit.fit_percent < EXPLAINED_PERCENT && !fit.tests.is_white();
    (zeta < ZETA && more_than_noise).then(|| FitVerdict::Rings {
        period_s: 2.0 * std::f64::consts::PI * tau / (1.0 - zeta * zeta).sqrt(),
        zeta,
    })
}

/// A PV that moves more than twice as far in each of the last eighths of its rows as in the one before.
fn diverges(pv: &[f64]) -> Option<FitVerdict> {
    const EIGHTHS: usize = 8;
    const GROWTH: f64 = 2.0;
    let rows = pv.len() / EIGHTHS;
    if rows < 4 {
        return None;
    }
    let moved: Vec<f64> = (0..EIGHTHS)
        .map(|i| {
            let (low, high) = range(pv[i * rows..(i + 1) * rows].iter());
            high - low
        })
        .collect();
    let grows = moved[EIGHTHS / 2 - 1..].windows(2).all(|w| w[1] > GROWTH * w[0]);
    (grows && moved[EIGHTHS / 2 - 1] > 0.0)
        .then(|| FitVerdict::Diverges { times: moved[EIGHTHS - 1] / moved[EIGHTHS / 2 - 1] })
}

/// Residuals smaller than a step of a PV that moves by few of them.
fn too_coarse(fit: &ModelFit, problem: &FitProblem) -> Option<FitVerdict> {
    let counts = |k: &usize| problem.keep.as_ref().is_none_or(|keep| keep[*k]);
    let counted: Vec<f64> = (0..problem.pv.len()).filter(counts).map(|k| problem.pv[k]).collect();
    let step = resolution(&counted, 0.1)?;
    let (low, high) = range(fit.simulated.iter());
    let levels = (high - low) / step;
    (fit.mse.sqrt() < 0.5 * step && levels < 20.0)
        .then_some(FitVerdict::ResolutionLimited { resolution: step, levels })
}

fn residuals(fit: &ModelFit, found: &mut Vec<FitVerdict>) {
    // Leftovers this small are rounding, whatever their pattern.
    if fit.fit_percent > 99.9 {
        return;
    }
    let tests = &fit.tests;
    if tests.follows_input() {
        let (lag, correlation) = tests
            .cross_correlation
            .iter()
            .copied()
            .enumerate()
            .skip(1)
            .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
            .unwrap_or((0, 0.0));
        found.push(FitVerdict::ResidualsFollowInput { correlation, lag });
    }
    let neighbours = tests.autocorrelation.first().copied().unwrap_or(0.0);
    if !tests.is_white() && neighbours > CORRELATED {
        let rows = tests.rows_per_independent;
        found.push(FitVerdict::ResidualsCorrelated { correlation: neighbours, rows });
    }
}
