//! Why there is no optimum, in words that say what to do.

use super::certificate::Limit;
use crate::analyze::FrequencyResponseError;
use crate::explain::{Explain, number, told_apart};

/// Why there are no best gains.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum OptimumError {
    /// A limit on Ms of 1 or less, or not a number.
    #[error("a limit of {} on Ms is not usable: it must be greater than 1", number(*.value))]
    Ms {
        /// Offending value.
        value: f64,
    },
    /// A limit on Mt under 1, or not a number.
    #[error(
        "a limit of {} on Mt is not usable: with integral action |T(0)| = 1, so it must be 1 or more",
        number(*.value)
    )]
    Mt {
        /// Offending value.
        value: f64,
    },
    /// A limit on Ju of 0 or less, or not a number.
    #[error("a limit of {} on Ju is not usable: it must be greater than 0", number(*.value))]
    Ju {
        /// Offending value in MV units per PV unit.
        value: f64,
    },
    /// A filter ratio that is not usable.
    #[error("N = {} is not usable for the filter: it must be greater than 0", number(*.value))]
    Filter {
        /// Offending value.
        value: f64,
    },
    /// No limit holds anything.
    #[error(
        "without any limit the best gains are those on the verge of instability: set one on Ms, Mt or Ju"
    )]
    NoLimit,
    /// No process.
    #[error("there is no process to tune for: give a model or a frequency response")]
    NoProcess,
    /// No controller keeps one limit, the others as they are.
    #[error(
        "no {controller} controller that stabilises this process keeps {} under {}: {} is the least that any reaches, with the other limits as they are",
        .limit,
        asked_and_floor(*.asked, *.floor)[0],
        asked_and_floor(*.asked, *.floor)[1]
    )]
    Infeasible {
        /// `PI` or `PID`.
        controller: &'static str,
        /// Limit to relax.
        limit: Limit,
        /// What was asked.
        asked: f64,
        /// Least value that can be reached.
        floor: f64,
    },
    /// No PID controller of this filter keeps one limit about a double integrator.
    #[error(
        "no PID controller with N = {} in its derivative filter keeps {} under {} on a process that integrates twice: the slower the loop, the nearer it comes to {}, and none goes below; raise N, which lowers that, or the limit",
        number(*.n),
        .limit,
        asked_and_floor(*.asked, *.floor)[0],
        asked_and_floor(*.asked, *.floor)[1]
    )]
    InfeasibleAtFilter {
        /// N of the filter.
        n: f64,
        /// Limit to relax.
        limit: Limit,
        /// What was asked.
        asked: f64,
        /// What slow loops come down to with this N.
        floor: f64,
    },
    /// Relaxing one limit alone does not help.
    #[error(
        "no {controller} controller that stabilises this process keeps these limits together: without the others {} goes down to {}; relax two of them",
        .limit,
        number(*.floor)
    )]
    InfeasibleTogether {
        /// `PI` or `PID`.
        controller: &'static str,
        /// One of the limits.
        limit: Limit,
        /// Least value that it can reach alone.
        floor: f64,
    },
    /// No gain stabilises the process, or not all of the processes.
    #[error(
        "no {controller} controller stabilises this process: check the sign of its gain and its poles, or give it more derivative action"
    )]
    NotStabilisable {
        /// `PI` or `PID`.
        controller: &'static str,
    },
    /// A process whose response overflows or vanishes at every frequency.
    #[error("a process gain of {} is beyond what can be calculated with: check its units", number(*.gain))]
    OutOfRange {
        /// First coefficient of G for s → 0.
        gain: f64,
    },
    /// The objective gets better without end.
    #[error(
        "the limits hold nothing here: the higher the gain, the better; set a limit on Ju, or give the model its dead time"
    )]
    Unbounded,
    /// The objective needs a model that can be simulated.
    #[error(
        "an IAE needs a model that can be simulated, and this is a measured frequency response: choose Jv or Ki"
    )]
    NeedsModel,
    /// The measured response ends too early.
    #[error("{0}")]
    Measured(FrequencyResponseError),
    /// Search and check did not agree.
    #[error(
        "the search did not come to gains that the exact analysis confirms (a limit is passed by {} %): change a limit slightly and report this",
        number(*.excess_percent)
    )]
    NotCertified {
        /// Excess left over a limit in percent.
        excess_percent: f64,
    },
}

/// Both with the digits that tell them apart, and a limit just over 1 not as 1.
fn asked_and_floor(asked: f64, floor: f64) -> [String; 2] {
    let [short, floor] = told_apart(asked, floor);
    let lost = asked > 1.0 && short == "1";
    [if lost { asked.to_string() } else { short }, floor]
}

impl OptimumError {
    /// Whether this is the answer to a question, rather than a question that cannot be asked.
    #[must_use]
    pub fn is_answer(&self) -> bool {
        matches!(
            self,
            Self::Infeasible { .. }
                | Self::InfeasibleAtFilter { .. }
                | Self::InfeasibleTogether { .. }
                | Self::NotStabilisable { .. }
                | Self::Unbounded
                | Self::NotCertified { .. }
        )
    }

    /// One of each kind, for the test that compares them with the translation files.
    #[must_use]
    pub fn samples() -> Vec<Self> {
        vec![
            Self::Ms { value: 1.0 },
            Self::Mt { value: 0.9 },
            Self::Ju { value: 0.0 },
            Self::Filter { value: 0.0 },
            Self::OutOfRange { gain: 1e300 },
            Self::NoLimit,
            Self::NoProcess,
            Self::Infeasible { controller: "PI", limit: Limit::Ju, asked: 1.0, floor: 1.5 },
            Self::InfeasibleAtFilter { n: 10.0, limit: Limit::Ms, asked: 1.2, floor: 1.2234 },
            Self::InfeasibleTogether { controller: "PID", limit: Limit::Ms, floor: 1.3 },
            Self::NotStabilisable { controller: "PI" },
            Self::Unbounded,
            Self::NeedsModel,
            Self::NotCertified { excess_percent: 0.1 },
        ]
    }
}

impl Explain for OptimumError {
    fn key(&self) -> &'static str {
        match self {
            Self::Ms { .. } => "optimum.ms",
            Self::Mt { .. } => "optimum.mt",
            Self::Ju { .. } => "optimum.ju",
            Self::Filter { .. } => "optimum.filter",
            Self::NoLimit => "optimum.no_limit",
            Self::NoProcess => "optimum.no_process",
            Self::Infeasible { .. } => "optimum.infeasible",
            Self::InfeasibleAtFilter { .. } => "optimum.infeasible_at_filter",
            Self::InfeasibleTogether { .. } => "optimum.infeasible_together",
            Self::NotStabilisable { .. } => "optimum.not_stabilisable",
            Self::OutOfRange { .. } => "optimum.out_of_range",
            Self::Unbounded => "optimum.unbounded",
            Self::NeedsModel => "optimum.needs_model",
            Self::Measured(error) => error.key(),
            Self::NotCertified { .. } => "optimum.not_certified",
        }
    }

    fn args(&self) -> Vec<(&'static str, String)> {
        match self {
            Self::Ms { value } | Self::Mt { value } | Self::Ju { value } | Self::Filter { value } => {
                vec![("value", number(*value))]
            }
            Self::Infeasible { controller, limit, asked, floor } => {
                let [asked, floor] = asked_and_floor(*asked, *floor);
                vec![
                    ("controller", (*controller).to_owned()),
                    ("limit", limit.to_string()),
                    ("asked", asked),
                    ("floor", floor),
                ]
            }
            Self::InfeasibleAtFilter { n, limit, asked, floor } => {
                let [asked, floor] = asked_and_floor(*asked, *floor);
                vec![("n", number(*n)), ("limit", limit.to_string()), ("asked", asked), ("floor", floor)]
            }
            Self::InfeasibleTogether { controller, limit, floor } => vec![
                ("controller", (*controller).to_owned()),
                ("limit", limit.to_string()),
                ("floor", number(*floor)),
            ],
            Self::NotStabilisable { controller } => vec![("controller", (*controller).to_owned())],
            Self::OutOfRange { gain } => vec![("gain", number(*gain))],
            Self::Measured(error) => error.args(),
            Self::NotCertified { excess_percent } => vec![("excess", number(*excess_percent))],
            Self::NoLimit | Self::NoProcess | Self::Unbounded | Self::NeedsModel => vec![],
        }
    }
}
