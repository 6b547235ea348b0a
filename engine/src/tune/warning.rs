//! What has to be said beside a rule's gains.

use super::RatioRange;
use crate::explain::{Explain, number};

/// A remark on a tuning. [`RuleWarning::limits_validity`] tells a rule used outside its range from a mere note.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RuleWarning {
    /// θ/τ is outside the range the rule was made for.
    #[error("θ/τ = {} is outside {} to {}, the range this rule was made for", number(*.ratio), number(.range.low), number(.range.high))]
    RatioOutside {
        /// θ/τ of the model.
        ratio: f64,
        /// The rule's range.
        range: RatioRange,
    },
    /// A rule for reaction curves on an integrating process.
    #[error(
        "the process integrates: this rule's quarter decay was made for an S-shaped response, its variant for integrators is used"
    )]
    Integrating,
    /// The literature contradicts itself about Cohen and Coon.
    #[error(
        "here θ/τ = {}; the sources disagree about Cohen–Coon: made for θ/τ above 0.3, reasonable from 0.4 to 4.5, poorly robust or unsuitable below 2",
        number(*.ratio)
    )]
    CohenCoonSources {
        /// θ/τ of the model.
        ratio: f64,
    },
    /// A cancelling rule faster than a third of the dead time.
    #[error("τc = {} s is under θ/3 = {} s: Ms passes 2 and the loop is little robust", number(*.tau_c_s), number(*.least_s))]
    LittleRobust {
        /// Closed-loop time constant in use, in seconds.
        tau_c_s: f64,
        /// θ/3 in seconds.
        least_s: f64,
    },
    /// λ shorter than the authors of IMC allow.
    #[error("λ = {} s is under {} s, the least its authors allow for this process", number(*.tau_c_s), number(*.least_s))]
    LambdaTooShort {
        /// λ in use, in seconds.
        tau_c_s: f64,
        /// Least λ in seconds.
        least_s: f64,
    },
    /// A second-order model was reduced first.
    #[error("the second-order model was reduced by the half rule to T = {} s and L = {} s", number(*.time_constant_s), number(*.dead_time_s))]
    HalfRule {
        /// Time constant the rule was given, in seconds.
        time_constant_s: f64,
        /// Dead time the rule was given, in seconds.
        dead_time_s: f64,
    },
    /// An inverse response was taken for dead time.
    #[error("the inverse response of the model was counted as dead time: L = {} s", number(*.dead_time_s))]
    InverseResponse {
        /// Dead time the rule was given, in seconds.
        dead_time_s: f64,
    },
    /// The rule is stated for the series form.
    #[error("the rule is stated for the series form; the gains are converted to the ideal form")]
    FromSeries,
}

impl RuleWarning {
    /// Whether the rule is used outside the range its authors or its robustness call for.
    #[must_use]
    pub fn limits_validity(&self) -> bool {
        match self {
            Self::RatioOutside { .. }
            | Self::Integrating
            | Self::LittleRobust { .. }
            | Self::LambdaTooShort { .. } => true,
            Self::CohenCoonSources { .. }
            | Self::HalfRule { .. }
            | Self::InverseResponse { .. }
            | Self::FromSeries => false,
        }
    }

    /// One value per variant, for the test that compares the sentences with the translations.
    #[must_use]
    pub fn samples() -> Vec<Self> {
        vec![
            Self::RatioOutside { ratio: 0.0132, range: RatioRange { low: 0.1, high: 0.3 } },
            Self::Integrating,
            Self::CohenCoonSources { ratio: 0.5 },
            Self::LittleRobust { tau_c_s: 0.8, least_s: 1.0 },
            Self::LambdaTooShort { tau_c_s: 1.0, least_s: 1.7 },
            Self::HalfRule { time_constant_s: 12.5, dead_time_s: 3.5 },
            Self::InverseResponse { dead_time_s: 4.0 },
            Self::FromSeries,
        ]
    }
}

impl Explain for RuleWarning {
    fn key(&self) -> &'static str {
        match self {
            Self::RatioOutside { .. } => "rule.ratio_outside",
            Self::Integrating => "rule.integrating",
            Self::CohenCoonSources { .. } => "rule.cohen_coon_sources",
            Self::LittleRobust { .. } => "rule.little_robust",
            Self::LambdaTooShort { .. } => "rule.lambda_too_short",
            Self::HalfRule { .. } => "rule.half_rule",
            Self::InverseResponse { .. } => "rule.inverse_response",
            Self::FromSeries => "rule.from_series",
        }
    }

    fn args(&self) -> Vec<(&'static str, String)> {
        match self {
            Self::RatioOutside { ratio, range } => {
                vec![("ratio", number(*ratio)), ("low", number(range.low)), ("high", number(range.high))]
            }
            Self::Integrating | Self::FromSeries => Vec::new(),
            Self::CohenCoonSources { ratio } => vec![("ratio", number(*ratio))],
            Self::LittleRobust { tau_c_s, least_s } | Self::LambdaTooShort { tau_c_s, least_s } => {
                vec![("tau_c", number(*tau_c_s)), ("least", number(*least_s))]
            }
            Self::HalfRule { time_constant_s, dead_time_s } => {
                vec![("time_constant", number(*time_constant_s)), ("dead_time", number(*dead_time_s))]
            }
            Self::InverseResponse { dead_time_s } => vec![("dead_time", number(*dead_time_s))],
        }
    }
}
