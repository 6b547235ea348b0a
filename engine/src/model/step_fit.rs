//! Low-order models by least squares on the step response.

use nalgebra::{Matrix4, Vector4};

use super::half_rule::{ReducedOrder, half_rule};
use super::reduce_error::ReduceError;
use super::simulate::{SampledInput, simulate_process};
use super::{Fopdt, ProcessModel, Sopdt, ZeroPoleGain};
use crate::identify::{FitOptions, FitProblem, InitialState, fit_fopdt};

/// Samples of the step response that is fitted.
const SAMPLES: usize = 1200;
/// Length of that response in sums of all time constants.
const LENGTHS: f64 = 6.0;
/// Gauss–Newton passes of the second-order fit.
const PASSES: usize = 200;

/// A model fitted to a step response.
#[derive(Debug, Clone, PartialEq)]
pub struct StepFit {
    /// The model.
    pub model: ProcessModel,
    /// 100 (1 − ‖y − ŷ‖/‖y − ȳ‖) on the step response.
    pub fit_percent: f64,
    /// Mean squared difference of the unit step responses, in PV units squared per MV unit squared.
    pub mse: f64,
}

/// The FOPDT or SOPDT whose unit step response is nearest to that of a stable process, in the mean square over six
/// times the sum of its time constants.
///
/// First order by output error with a free offset, as a step test is fitted ([`fit_fopdt`]); second order (overdamped,
/// no zero) by Gauss–Newton on K, T1, T2 and L from the half rule's model, without offset.
///
/// # Errors
/// [`ReduceError`] for a process that is unstable or integrates, has no gain, or cannot be fitted; for second order also
/// one that the half rule cannot start.
pub fn fit_step_response(process: &ZeroPoleGain, order: ReducedOrder) -> Result<StepFit, ReduceError> {
    if let Some(pole) = process.poles.iter().find(|p| p.re > 0.0) {
        return Err(ReduceError::Unstable { pole: pole.re });
    }
    let integrators = process.poles.iter().filter(|p| p.re == 0.0).count();
    if integrators > 0 {
        return Err(ReduceError::Integrators { integrators });
    }
    if process.static_gain() == 0.0 {
        return Err(ReduceError::NoGain);
    }
    let slow_s: f64 = process.poles.iter().map(|p| -1.0 / p.re).sum();
    if slow_s == 0.0 {
        return Err(ReduceError::NoLag);
    }
    let length_s = LENGTHS * slow_s + 2.0 * process.dead_time_s;
    let time_s: Vec<f64> = (0..SAMPLES).map(|k| k as f64 * length_s / (SAMPLES - 1) as f64).collect();
    let u = vec![1.0; SAMPLES];
    let exact = ProcessModel::Rational(process.transfer_function());
    let Ok(y) = simulate_process(&exact, &SampledInput::single(&time_s, &u)) else {
        return Err(ReduceError::NoGain);
    };
    match order {
        ReducedOrder::First => {
            let options = FitOptions {
                mv_before: Some(0.0),
                initial_state: InitialState::Rest,
                ..FitOptions::default()
            };
            let fit = fit_fopdt(&FitProblem { options, ..FitProblem::new(&time_s, &y, &u) })?;
            let model = ProcessModel::Fopdt(fit.model);
            Ok(StepFit { model, fit_percent: fit.fit_percent, mse: fit.mse })
        }
        ReducedOrder::Second => second_order(process, &time_s, &y),
    }
}

/// Unit step response of K e^(−Ls)/((T1 s + 1)(T2 s + 1)) for p = (K, ln T1, ln T2, ln L).
fn sopdt_step(p: &Vector4<f64>, t: f64) -> f64 {
    let (t1, t2, since) = (p[1].exp(), p[2].exp(), t - p[3].exp());
    if since <= 0.0 {
        return 0.0;
    }
    let rest = if (t1 - t2).abs() < 1e-5 * t1 {
        let mean = 0.5 * (t1 + t2);
        (1.0 + since / mean) * (-since / mean).exp()
    } else {
        (t1 * (-since / t1).exp() - t2 * (-since / t2).exp()) / (t1 - t2)
    };
    p[0] * (1.0 - rest)
}

fn second_order(process: &ZeroPoleGain, time_s: &[f64], y: &[f64]) -> Result<StepFit, ReduceError> {
    let start = match half_rule(process, ReducedOrder::Second)? {
        ProcessModel::Sopdt(m) => m,
        ProcessModel::Fopdt(Fopdt { gain, time_constant_s: t, dead_time_s }) => Sopdt {
            gain,
            time_constant_1_s: t,
            time_constant_2_s: 0.1 * t,
            zero_time_constant_s: 0.0,
            dead_time_s,
        },
        _ => return Err(ReduceError::NoLag),
    };
    // Logarithms keep times positive; a dead time of 0 starts a hair above.
    let least_s = 1e-4 * start.time_constant_1_s;
    let mut p = Vector4::new(
        start.gain,
        start.time_constant_1_s.ln(),
        start.time_constant_2_s.max(least_s).ln(),
        start.dead_time_s.max(least_s).ln(),
    );
    let cost = |p: &Vector4<f64>| -> f64 {
        time_s.iter().zip(y).map(|(t, y)| (sopdt_step(p, *t) - y).powi(2)).sum()
    };
    let (mut now, mut damping) = (cost(&p), 1e-3);
    for _ in 0..PASSES {
        let (mut normal, mut gradient) = (Matrix4::zeros(), Vector4::zeros());
        for (t, y) in time_s.iter().zip(y) {
            let slope = Vector4::from_fn(|i, _| {
                let h = 1e-6 * (1.0 + p[i].abs());
                let (mut up, mut down) = (p, p);
                up[i] += h;
                down[i] -= h;
                (sopdt_step(&up, *t) - sopdt_step(&down, *t)) / (2.0 * h)
            });
            normal += slope * slope.transpose();
            gradient += slope * (sopdt_step(&p, *t) - y);
        }
        let damped = normal + Matrix4::from_diagonal(&normal.diagonal()) * damping;
        let Some(step) = damped.lu().solve(&gradient) else { break };
        let tried = p - step;
        let then = cost(&tried);
        if then < now {
            let settled = now - then <= 1e-13 * now;
            (p, now, damping) = (tried, then, (0.2 * damping).max(1e-12));
            if settled {
                break;
            }
        } else if damping > 1e8 {
            break;
        } else {
            damping *= 5.0;
        }
    }
    let (t1, t2) = (p[1].exp(), p[2].exp());
    let mean = y.iter().sum::<f64>() / y.len() as f64;
    let movement: f64 = y.iter().map(|y| (y - mean).powi(2)).sum();
    let model = ProcessModel::Sopdt(Sopdt {
        gain: p[0],
        time_constant_1_s: t1.max(t2),
        time_constant_2_s: t1.min(t2),
        zero_time_constant_s: 0.0,
        dead_time_s: p[3].exp(),
    });
    Ok(StepFit { model, fit_percent: 100.0 * (1.0 - (now / movement).sqrt()), mse: now / y.len() as f64 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::TransferFunction;

    #[test]
    fn a_model_of_the_right_order_comes_back() {
        let tf = TransferFunction { num: vec![4.986], den: vec![153.4, 1.0], dead_time_s: 2.21 };
        let fit = fit_step_response(&ZeroPoleGain::of(&tf), ReducedOrder::First).expect("a fit");
        let ProcessModel::Fopdt(m) = fit.model else { panic!("{fit:?}") };
        assert!((m.gain - 4.986).abs() < 1e-6 && (m.time_constant_s - 153.4).abs() < 1e-4, "{m:?}");
        assert!((m.dead_time_s - 2.21).abs() < 1e-4 && fit.fit_percent > 99.999, "{fit:?}");
        let tf = TransferFunction { num: vec![2.0], den: vec![30.0, 13.0, 1.0], dead_time_s: 1.5 };
        let fit = fit_step_response(&ZeroPoleGain::of(&tf), ReducedOrder::Second).expect("a fit");
        let ProcessModel::Sopdt(m) = fit.model else { panic!("{fit:?}") };
        assert!(
            (m.time_constant_1_s - 10.0).abs() < 1e-3 && (m.time_constant_2_s - 3.0).abs() < 1e-3,
            "{m:?}"
        );
        assert!((m.dead_time_s - 1.5).abs() < 1e-3 && (m.gain - 2.0).abs() < 1e-6, "{m:?}");
    }

    #[test]
    fn two_lags_fit_three_better_than_one_does() {
        let tf = TransferFunction { num: vec![1.0], den: vec![8.0, 12.0, 6.0, 1.0], dead_time_s: 0.5 };
        let process = ZeroPoleGain::of(&tf);
        let fit = fit_step_response(&process, ReducedOrder::Second).expect("a fit");
        let coarse = fit_step_response(&process, ReducedOrder::First).expect("a fit");
        assert!(fit.mse < 0.2 * coarse.mse && fit.fit_percent > 98.0, "{fit:?} {coarse:?}");
    }
}
