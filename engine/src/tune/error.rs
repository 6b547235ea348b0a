//! Why a rule has no answer.

use super::ControllerKind;
use crate::control::GainsError;
use crate::explain::{Explain, number};
use crate::model::{ProcessModel, ReducedOrder, ZeroPoleGain, half_rule};

/// Why a rule gives no gains for a model.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RuleError {
    /// The formula divides by the dead time and the model has none.
    #[error("the rule {rule} needs a dead time: its gain grows without bound as θ goes to 0")]
    NeedsDeadTime {
        /// Id of the rule.
        rule: &'static str,
    },
    /// Neither a dead time nor a closed-loop time constant.
    #[error("the rule {rule} needs a dead time or a closed-loop time constant τc greater than 0")]
    NeedsDeadTimeOrTauC {
        /// Id of the rule.
        rule: &'static str,
    },
    /// The rule's authors gave no such controller.
    #[error("the rule {rule} has no {controller} controller")]
    NoSuchController {
        /// Id of the rule.
        rule: &'static str,
        /// Kind asked for.
        controller: ControllerKind,
    },
    /// The rule gives this controller for second-order models only.
    #[error(
        "the rule {rule} gives a {controller} controller for a second-order model only: identify T1 and T2, or take its PI controller"
    )]
    NeedsSecondOrder {
        /// Id of the rule.
        rule: &'static str,
        /// Kind asked for.
        controller: ControllerKind,
    },
    /// No variant for integrating processes.
    #[error("the rule {rule} has no variant for an integrating process")]
    NotForIntegrating {
        /// Id of the rule.
        rule: &'static str,
    },
    /// Complex poles.
    #[error(
        "the process has complex poles: rules for reaction curves do not apply to a response that swings"
    )]
    ComplexPoles,
    /// A pole in the right half-plane.
    #[error("the process is unstable in open loop: no tuning rule here is made for that")]
    UnstableProcess,
    /// A zero in the left half-plane.
    #[error("the model has a zero with Tz = {} s: no rule here is made for it, fit a model without zero", number(*.zero_time_constant_s))]
    LeadZero {
        /// Tz in seconds.
        zero_time_constant_s: f64,
    },
    /// Not of first or second order.
    #[error(
        "the transfer function of order {order} is none of the rules' structures: fit a first-order or second-order model with dead time"
    )]
    Order {
        /// Degree of the denominator.
        order: usize,
    },
    /// Not of first or second order, or with a zero, but a reduced model is.
    #[error(
        "no rule here is made for a process of this order or with its zero: Skogestad's half rule makes {model} of it, tune for that model"
    )]
    Reducible {
        /// The reduced model, as it is written on the command line.
        model: String,
    },
    /// Proportional control never reaches the stability limit.
    #[error(
        "the process has no ultimate gain: proportional control alone does not bring it to the stability limit"
    )]
    NoUltimate,
    /// Ultimate gain or period of no use.
    #[error("Ku = {} and Pu = {} s are not usable: Ku must not be 0 and Pu must be greater than 0", number(*.ku), number(*.pu_s))]
    Ultimate {
        /// Ku in MV units per PV unit.
        ku: f64,
        /// Pu in seconds.
        pu_s: f64,
    },
    /// Closed-loop time constant of no use.
    #[error("the closed-loop time constant τc = {} s is not usable: it must be greater than 0", number(*.value))]
    TauC {
        /// Offending value in seconds.
        value: f64,
    },
    /// The formula leaves the positive numbers.
    #[error("at θ/τ = {} the formula of the rule {rule} gives a time that is not positive", number(*.ratio))]
    OutsideFormula {
        /// Id of the rule.
        rule: &'static str,
        /// θ/τ of the model.
        ratio: f64,
    },
    /// The gains are no gains; with a validated model only for a filter ratio N of no use.
    #[error(transparent)]
    Gains(#[from] GainsError),
}

impl RuleError {
    /// The same, with the reduced model where the half rule makes one of a model that is not of the rules' structures.
    pub(super) fn with_way_on(self, model: &ProcessModel) -> Self {
        if !matches!(self, Self::Order { .. } | Self::LeadZero { .. }) {
            return self;
        }
        let process = ZeroPoleGain::of(&model.transfer_function()).minimal();
        let words = match half_rule(&process, ReducedOrder::First) {
            Ok(ProcessModel::Fopdt(m)) => {
                format!("K={},T={},L={}", plain(m.gain), plain(m.time_constant_s), plain(m.dead_time_s))
            }
            Ok(ProcessModel::Ipdt(m)) => format!("Kv={},L={}", plain(m.velocity_gain), plain(m.dead_time_s)),
            _ => return self,
        };
        Self::Reducible { model: words }
    }

    /// One value per variant, for the test that compares the sentences with the translations.
    #[must_use]
    pub fn samples() -> Vec<Self> {
        vec![
            Self::NeedsDeadTime { rule: "amigo" },
            Self::NeedsDeadTimeOrTauC { rule: "simc" },
            Self::NoSuchController { rule: "amigo", controller: ControllerKind::Pd },
            Self::NeedsSecondOrder { rule: "simc", controller: ControllerKind::Pid },
            Self::NotForIntegrating { rule: "imc" },
            Self::ComplexPoles,
            Self::UnstableProcess,
            Self::LeadZero { zero_time_constant_s: 3.5 },
            Self::Order { order: 4 },
            Self::Reducible { model: "K=1,T=1.5,L=1.5".to_owned() },
            Self::NoUltimate,
            Self::Ultimate { ku: 0.0, pu_s: 8.0 },
            Self::TauC { value: -1.0 },
            Self::OutsideFormula { rule: "itae_setpoint", ratio: 7.0 },
            Self::Gains(GainsError::N { value: 0.0 }),
        ]
    }
}

/// A number as the command line takes it, to six digits.
fn plain(value: f64) -> String {
    format!("{value:.5e}").parse::<f64>().unwrap_or(value).to_string()
}

impl Explain for RuleError {
    fn key(&self) -> &'static str {
        match self {
            Self::NeedsDeadTime { .. } => "rule.needs_dead_time",
            Self::NeedsDeadTimeOrTauC { .. } => "rule.needs_dead_time_or_tau_c",
            Self::NoSuchController { .. } => "rule.no_such_controller",
            Self::NeedsSecondOrder { .. } => "rule.needs_second_order",
            Self::NotForIntegrating { .. } => "rule.not_for_integrating",
            Self::ComplexPoles => "rule.complex_poles",
            Self::UnstableProcess => "rule.unstable_process",
            Self::LeadZero { .. } => "rule.lead_zero",
            Self::Order { .. } => "rule.order",
            Self::Reducible { .. } => "rule.reducible",
            Self::NoUltimate => "rule.no_ultimate",
            Self::Ultimate { .. } => "rule.ultimate",
            Self::TauC { .. } => "rule.tau_c",
            Self::OutsideFormula { .. } => "rule.outside_formula",
            Self::Gains(error) => error.key(),
        }
    }

    fn args(&self) -> Vec<(&'static str, String)> {
        match self {
            Self::NeedsDeadTime { rule }
            | Self::NeedsDeadTimeOrTauC { rule }
            | Self::NotForIntegrating { rule } => {
                vec![("rule", (*rule).to_owned())]
            }
            Self::NoSuchController { rule, controller } | Self::NeedsSecondOrder { rule, controller } => {
                vec![("rule", (*rule).to_owned()), ("controller", controller.to_string())]
            }
            Self::ComplexPoles | Self::UnstableProcess | Self::NoUltimate => Vec::new(),
            Self::LeadZero { zero_time_constant_s } => vec![("zero", number(*zero_time_constant_s))],
            Self::Reducible { model } => vec![("model", model.clone())],
            Self::Order { order } => vec![("order", order.to_string())],
            Self::Ultimate { ku, pu_s } => vec![("ku", number(*ku)), ("pu", number(*pu_s))],
            Self::TauC { value } => vec![("value", number(*value))],
            Self::OutsideFormula { rule, ratio } => {
                vec![("rule", (*rule).to_owned()), ("ratio", number(*ratio))]
            }
            Self::Gains(error) => error.args(),
        }
    }
}
