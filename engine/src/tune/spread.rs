//! What a model's uncertainty makes of a tuning: the same gains on many models.

use crate::analyze::{Excitation, OpenLoop, Response, ResponseOptions, analyze_loop, loop_response};
use crate::control::ParallelGains;
use crate::model::ProcessModel;
use crate::sim::quantile;

/// Quantiles of a measure over the models.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quantiles {
    /// 5 %.
    pub low: f64,
    /// 50 %.
    pub middle: f64,
    /// 95 %; ∞ where more than 5 % of the loops are unstable.
    pub high: f64,
}

impl Quantiles {
    fn of(mut values: Vec<f64>) -> Option<Self> {
        if values.is_empty() {
            return None;
        }
        values.sort_unstable_by(f64::total_cmp);
        let at = |share| {
            let value = quantile(&values, share);
            if value.is_nan() { f64::INFINITY } else { value }
        };
        Some(Self { low: at(0.05), middle: at(0.5), high: at(0.95) })
    }
}

/// One tuning on many models.
#[derive(Debug, Clone, PartialEq)]
pub struct TuningSpread {
    /// Number of models.
    pub models: usize,
    /// How many of their loops are unstable.
    pub unstable: usize,
    /// Ms; that of an unstable loop is ∞.
    pub ms: Quantiles,
    /// Times of the bands in seconds.
    pub time_s: Vec<f64>,
    /// PV after a unit step: 5, 50 and 95 % at each time.
    pub pv: Vec<[f64; 3]>,
    /// MV likewise.
    pub mv: Vec<[f64; 3]>,
}

impl TuningSpread {
    /// Share of unstable loops.
    #[must_use]
    pub fn unstable_share(&self) -> f64 {
        self.unstable as f64 / self.models as f64
    }
}

/// Robustness of one tuning on many models.
#[derive(Debug, Clone, PartialEq)]
pub struct RobustnessSpread {
    /// Number of models.
    pub models: usize,
    /// How many of their loops are unstable.
    pub unstable: usize,
    /// Ms; that of an unstable loop is ∞.
    pub ms: Quantiles,
}

impl RobustnessSpread {
    /// Share of unstable loops.
    #[must_use]
    pub fn unstable_share(&self) -> f64 {
        self.unstable as f64 / self.models as f64
    }
}

/// Ms of the same gains on all models: [`tuning_spread`] without its bands, an analysis a model. `None` without models.
#[must_use]
pub fn robustness_spread(models: &[ProcessModel], gains: &ParallelGains) -> Option<RobustnessSpread> {
    let ms: Vec<Option<f64>> =
        models.iter().map(|model| analyze_loop(&OpenLoop::of_parallel(model, gains))).map(|a| a.ms).collect();
    let unstable = ms.iter().filter(|ms| ms.is_none()).count();
    let ms = ms.into_iter().map(|ms| ms.unwrap_or(f64::INFINITY)).collect();
    Some(RobustnessSpread { models: models.len(), unstable, ms: Quantiles::of(ms)? })
}

/// Times of the bands.
const POINTS: usize = 160;

/// Runs the same gains on all models: Ms of each, and a unit step of setpoint or load over `horizon_s` seconds.
///
/// Costs an analysis and a response per model. `None` without models.
#[must_use]
pub fn tuning_spread(
    models: &[ProcessModel],
    gains: &ParallelGains,
    excitation: Excitation,
    horizon_s: f64,
) -> Option<TuningSpread> {
    let options = ResponseOptions { horizon_s: Some(horizon_s), ..ResponseOptions::default() };
    let time_s: Vec<f64> = (0..POINTS).map(|k| horizon_s * k as f64 / (POINTS - 1) as f64).collect();
    let (mut ms, mut pv, mut mv) = (Vec::new(), Vec::new(), Vec::new());
    let mut unstable = 0;
    for model in models {
        let open = OpenLoop::of_parallel(model, gains);
        let analysis = analyze_loop(&open);
        unstable += usize::from(!analysis.stable);
        ms.push(analysis.ms.unwrap_or(f64::INFINITY));
        let response = loop_response(&open, excitation, &options);
        pv.push(at_times(&response, &response.y, &time_s));
        mv.push(at_times(&response, &response.u, &time_s));
    }
    Some(TuningSpread {
        models: models.len(),
        unstable,
        ms: Quantiles::of(ms)?,
        pv: bands(&pv, POINTS),
        mv: bands(&mv, POINTS),
        time_s,
    })
}

/// Values at other times, straight between the samples; a response that ended early keeps its last value.
fn at_times(response: &Response, values: &[f64], time_s: &[f64]) -> Vec<f64> {
    let own = &response.time_s;
    let mut k = 0;
    time_s
        .iter()
        .map(|&t| {
            while k + 1 < own.len() && own[k + 1] < t {
                k += 1;
            }
            match own.get(k + 1) {
                Some(next) if own[k] <= t => {
                    values[k] + (values[k + 1] - values[k]) * (t - own[k]) / (next - own[k])
                }
                _ => values.last().copied().unwrap_or(f64::NAN),
            }
        })
        .collect()
}

fn bands(curves: &[Vec<f64>], points: usize) -> Vec<[f64; 3]> {
    (0..points)
        .map(|k| {
            let mut column: Vec<f64> = curves.iter().map(|c| c[k]).collect();
            column.sort_unstable_by(f64::total_cmp);
            [0.05, 0.5, 0.95].map(|share| quantile(&column, share))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Fopdt;

    fn models(dead_times_s: &[f64]) -> Vec<ProcessModel> {
        dead_times_s
            .iter()
            .map(|l| ProcessModel::Fopdt(Fopdt::new(2.0, 30.0, *l).expect("a model")))
            .collect()
    }

    #[test]
    fn one_model_is_its_own_band() {
        let gains = ParallelGains { kp: 2.0, ki: 0.1, kd: 0.0, tf_s: 0.0 };
        let found = tuning_spread(&models(&[4.0; 3]), &gains, Excitation::Setpoint, 120.0).expect("models");
        assert_eq!(found.unstable, 0);
        assert!((found.ms.high - found.ms.low).abs() < 1e-12);
        assert!(found.pv.iter().all(|b| (b[2] - b[0]).abs() < 1e-12));
        assert!((found.pv[159][1] - 1.0).abs() < 0.02, "{:?}", found.pv[159]);
    }

    #[test]
    fn loops_that_are_unstable_are_counted() {
        let gains = ParallelGains { kp: 4.0, ki: 0.2, kd: 0.0, tf_s: 0.0 };
        let found =
            tuning_spread(&models(&[2.0, 3.0, 4.0, 20.0]), &gains, Excitation::Load, 200.0).expect("models");
        assert_eq!((found.models, found.unstable), (4, 1));
        assert!((found.unstable_share() - 0.25).abs() < 1e-12);
        assert!(found.ms.high.is_infinite() && found.ms.low < 2.0, "{:?}", found.ms);
        assert_eq!(tuning_spread(&[], &gains, Excitation::Load, 1.0), None);
    }
}
