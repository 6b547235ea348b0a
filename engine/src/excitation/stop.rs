//! Why a test ended before it was finished.

use super::error::ExcitationError;
use crate::explain::{Explain, number};

/// What ended a test early. The loop is as it was before.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StopReason {
    /// The operator asked for it.
    #[error("ended by the operator")]
    Operator,
    /// The operator did something else with the loop, which goes before.
    #[error("ended by the command {command} to its loop")]
    Overruled {
        /// The command, as files name it.
        command: &'static str,
    },
    /// The PV came to a limit.
    #[error("ended at a limit: the PV is {} and must stay between {} and {}", number(*.pv), number(*.low), number(*.high))]
    PvLimit {
        /// PV in PV units.
        pv: f64,
        /// Lowest PV.
        low: f64,
        /// Highest PV.
        high: f64,
    },
    /// The sensor gives no valid PV any more.
    #[error("ended because the PV is lost")]
    PvLost,
    /// The time is used up.
    #[error("ended after {} s, the longest it may take: give it more time, or a larger move", number(*.budget_s))]
    Budget {
        /// The time in seconds.
        budget_s: f64,
    },
    /// A gain so high that noise alone fills the output's range, or far from where it began, and nothing swings.
    #[error(
        "ended at the gain {}: no oscillation stands out of the noise, nor could one at a higher gain within the output's limits; use a relay", number(*.gain)
    )]
    NoOscillation {
        /// The last gain in MV units per PV unit.
        gain: f64,
    },
    /// The loop was not at rest; nothing was moved.
    #[error(
        "not begun: in {} s the PV moved by {}, and at rest it would move by {} at most",
        number(*.listen_s), number(*.moved), number(*.band)
    )]
    NotAtRest {
        /// How long the loop was listened to, in seconds.
        listen_s: f64,
        /// Change of the PV over that time in PV units.
        moved: f64,
        /// Change that noise alone, or a drift too small to matter, would explain.
        band: f64,
    },
    /// About the values at rest there is no room for the signal; nothing was moved.
    #[error("not begun: {0}")]
    NoRoom(ExcitationError),
    /// The inner loop no longer takes this loop's output.
    #[error("ended because its inner loop left cascade")]
    Unlinked,
    /// The rig was turned to another configuration.
    #[error("ended by a change of the configuration")]
    Configuration,
    /// The rig was put to another state.
    #[error("ended because the rig was put to another state")]
    Restarted,
    /// A new run began.
    #[error("ended by a new run")]
    NewRun,
    /// A defect of the program stopped the run.
    #[error("ended because the run stopped")]
    Defect,
}

impl Explain for StopReason {
    fn key(&self) -> &'static str {
        match self {
            Self::Operator => "excitation_stop.operator",
            Self::Overruled { .. } => "excitation_stop.overruled",
            Self::PvLimit { .. } => "excitation_stop.pv_limit",
            Self::PvLost => "excitation_stop.pv_lost",
            Self::Budget { .. } => "excitation_stop.budget",
            Self::NoOscillation { .. } => "excitation_stop.no_oscillation",
            Self::NotAtRest { .. } => "excitation_stop.not_at_rest",
            Self::NoRoom(_) => "excitation_stop.no_room",
            Self::Unlinked => "excitation_stop.unlinked",
            Self::Configuration => "excitation_stop.configuration",
            Self::Restarted => "excitation_stop.restarted",
            Self::NewRun => "excitation_stop.new_run",
            Self::Defect => "excitation_stop.defect",
        }
    }

    fn args(&self) -> Vec<(&'static str, String)> {
        match self {
            Self::Overruled { command } => vec![("command", (*command).to_owned())],
            Self::PvLimit { pv, low, high } => {
                vec![("pv", number(*pv)), ("low", number(*low)), ("high", number(*high))]
            }
            Self::Budget { budget_s } => vec![("budget_s", number(*budget_s))],
            Self::NoOscillation { gain } => vec![("gain", number(*gain))],
            Self::NotAtRest { listen_s, moved, band } => {
                vec![("listen_s", number(*listen_s)), ("moved", number(*moved)), ("band", number(*band))]
            }
            Self::NoRoom(error) => vec![("error", error.to_string())],
            _ => vec![],
        }
    }

    fn cause(&self) -> Option<&dyn Explain> {
        match self {
            Self::NoRoom(error) => Some(error),
            _ => None,
        }
    }
}

impl StopReason {
    /// One of each kind, for the test that compares them with the translation files.
    #[must_use]
    pub fn samples() -> Vec<Self> {
        let room =
            ExcitationError::Margin { tag: "LIC-02".to_owned(), from: 0.8, to: 1.6, low: 1.0, high: 3.5 };
        vec![
            Self::Operator,
            Self::Overruled { command: "mode" },
            Self::PvLimit { pv: 21.0, low: 10.0, high: 20.0 },
            Self::PvLost,
            Self::Budget { budget_s: 3600.0 },
            Self::NoOscillation { gain: 42.0 },
            Self::NotAtRest { listen_s: 30.0, moved: 0.4, band: 0.05 },
            Self::NoRoom(room),
            Self::Unlinked,
            Self::Configuration,
            Self::Restarted,
            Self::NewRun,
            Self::Defect,
        ]
    }
}
