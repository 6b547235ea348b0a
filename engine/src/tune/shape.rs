//! The structure of a model as the rules see it.

use super::{RuleError, RuleWarning};
use crate::model::{Fopdt, Ipdt, ProcessModel, Sopdt};

/// A model in one of the structures that rules are written for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Shape {
    /// K e^(−θs)/(τs + 1).
    FirstOrder(Fopdt),
    /// Kv e^(−θs)/s.
    Integrating(Ipdt),
    /// K e^(−θs)/((τ1 s + 1)(τ2 s + 1)); its zero is 0.
    SecondOrder(Sopdt),
}

impl Shape {
    /// Recognises a model's structure; transfer functions of first and second order are converted exactly.
    ///
    /// A zero in the right half-plane becomes dead time, θ + |Tz| (Skogestad 2003, rule for inverse responses).
    pub(super) fn of(model: &ProcessModel, warnings: &mut Vec<RuleWarning>) -> Result<Self, RuleError> {
        match model {
            ProcessModel::Fopdt(m) => Ok(Self::FirstOrder(*m)),
            ProcessModel::Ipdt(m) => Ok(Self::Integrating(*m)),
            ProcessModel::Sopdt(m) => without_zero(*m, warnings).map(Self::SecondOrder),
            ProcessModel::Rational(tf) => {
                let order = tf.den.len() - 1;
                let delay = tf.dead_time_s;
                match (tf.num.as_slice(), tf.den.as_slice()) {
                    (&[k], &[a, b]) => first_order(k, a, b, delay),
                    (&[k], &[a, b, c]) if c != 0.0 => second_order(k, 0.0, [a, b, c], delay, warnings),
                    (&[lead, k], &[a, b, c]) if c != 0.0 && k != 0.0 => {
                        second_order(k, lead / k, [a, b, c], delay, warnings)
                    }
                    _ => Err(RuleError::Order { order }),
                }
            }
        }
    }

    /// θ/τ with τ the dominant time constant; none for an integrating process.
    pub(super) fn ratio(&self) -> Option<f64> {
        match self {
            Self::FirstOrder(m) => Some(m.dead_time_ratio()),
            Self::Integrating(_) => None,
            Self::SecondOrder(m) => Some(m.dead_time_s / m.time_constant_1_s),
        }
    }

    /// θ in seconds.
    pub(super) fn dead_time_s(&self) -> f64 {
        match self {
            Self::FirstOrder(m) => m.dead_time_s,
            Self::Integrating(m) => m.dead_time_s,
            Self::SecondOrder(m) => m.dead_time_s,
        }
    }

    /// τ, the dominant time constant in seconds; 0 for an integrating process, whose rules know the dead time only.
    pub(super) fn time_constant_s(&self) -> f64 {
        match self {
            Self::FirstOrder(m) => m.time_constant_s,
            Self::Integrating(_) => 0.0,
            Self::SecondOrder(m) => m.time_constant_1_s,
        }
    }
}

/// Skogestad's half rule: τ = τ1 + τ2/2, θ + τ2/2 (J. Process Control 13, 2003, section 2.1).
pub(super) fn half_rule(model: &Sopdt) -> Fopdt {
    let half = 0.5 * model.time_constant_2_s;
    Fopdt {
        gain: model.gain,
        time_constant_s: model.time_constant_1_s + half,
        dead_time_s: model.dead_time_s + half,
    }
}

fn first_order(k: f64, a: f64, b: f64, delay: f64) -> Result<Shape, RuleError> {
    if b == 0.0 {
        return Ok(Shape::Integrating(Ipdt { velocity_gain: k / a, dead_time_s: delay }));
    }
    if a / b < 0.0 {
        return Err(RuleError::UnstableProcess);
    }
    Ok(Shape::FirstOrder(Fopdt { gain: k / b, time_constant_s: a / b, dead_time_s: delay }))
}

/// From a s² + b s + c = c (τ1 s + 1)(τ2 s + 1).
fn second_order(
    k: f64,
    zero_time_constant_s: f64,
    [a, b, c]: [f64; 3],
    dead_time_s: f64,
    warnings: &mut Vec<RuleWarning>,
) -> Result<Shape, RuleError> {
    let (product, sum) = (a / c, b / c);
    if product <= 0.0 || sum <= 0.0 {
        return Err(RuleError::UnstableProcess);
    }
    let discriminant = sum * sum - 4.0 * product;
    if discriminant < 0.0 {
        return Err(RuleError::ComplexPoles);
    }
    let time_constant_1_s = 0.5 * (sum + discriminant.sqrt());
    let model = Sopdt {
        gain: k / c,
        time_constant_1_s,
        time_constant_2_s: product / time_constant_1_s,
        zero_time_constant_s,
        dead_time_s,
    };
    without_zero(model, warnings).map(Shape::SecondOrder)
}

fn without_zero(model: Sopdt, warnings: &mut Vec<RuleWarning>) -> Result<Sopdt, RuleError> {
    let zero = model.zero_time_constant_s;
    if zero > 0.0 {
        return Err(RuleError::LeadZero { zero_time_constant_s: zero });
    }
    let dead_time_s = model.dead_time_s - zero;
    if zero < 0.0 {
        warnings.push(RuleWarning::InverseResponse { dead_time_s });
    }
    Ok(Sopdt { zero_time_constant_s: 0.0, dead_time_s, ..model })
}
