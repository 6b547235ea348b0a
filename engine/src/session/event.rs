//! What a session says.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::command::{CommandError, RigCommand};
use crate::excitation::{ExcitationReport, Progress};

/// A state that an operator should know of. It begins and ends as an event each.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Alarm {
    /// A tank spills over its rim.
    Overflow {
        /// Tank.
        tag: String,
    },
    /// A pump draws from an empty tank.
    PumpDry {
        /// Pump.
        tag: String,
    },
    /// The measured level is below the sensor's range.
    BelowRange {
        /// Sensor.
        tag: String,
    },
    /// The measured level is above the sensor's range.
    AboveRange {
        /// Sensor.
        tag: String,
    },
    /// The sensor's signal says that its wire is broken.
    SensorFault {
        /// Sensor.
        tag: String,
    },
    /// The output of a loop in automatic is at one of its limits.
    OutputAtLimit {
        /// Loop.
        tag: String,
    },
}

impl Alarm {
    /// Key under `alarm.` in the translation files.
    #[must_use]
    pub fn key(&self) -> &'static str {
        match self {
            Self::Overflow { .. } => "overflow",
            Self::PumpDry { .. } => "pump_dry",
            Self::BelowRange { .. } => "below_range",
            Self::AboveRange { .. } => "above_range",
            Self::SensorFault { .. } => "sensor_fault",
            Self::OutputAtLimit { .. } => "output_at_limit",
        }
    }

    /// Tag of the tank, pump, sensor or loop.
    #[must_use]
    pub fn tag(&self) -> &str {
        match self {
            Self::Overflow { tag }
            | Self::PumpDry { tag }
            | Self::BelowRange { tag }
            | Self::AboveRange { tag }
            | Self::SensorFault { tag }
            | Self::OutputAtLimit { tag } => tag,
        }
    }
}

/// Something that happened, with the time of the run.
#[derive(Debug, Clone, PartialEq)]
pub struct Event {
    /// Number of the run.
    pub run: u64,
    /// Time in seconds of the run.
    pub time_s: f64,
    /// What happened.
    pub kind: EventKind,
}

/// What happened.
#[derive(Debug, Clone, PartialEq)]
pub enum EventKind {
    /// A new run began on a rig.
    RigLoaded {
        /// Id of the rig.
        id: String,
    },
    /// Time goes on.
    Running,
    /// Time stands still.
    Paused,
    /// A command was carried out.
    Done(RigCommand),
    /// A command was refused; nothing has changed.
    Refused(CommandError),
    /// An alarm began (`true`) or ended.
    Alarm(Alarm, bool),
    /// A test on a loop came to another phase or cycle; at most one in a few seconds of the run within a phase.
    ExcitationProgress {
        /// Loop.
        tag: String,
        /// How far it is.
        progress: Progress,
    },
    /// A test on a loop ended, with what came of it; the loop is as it was before.
    ExcitationEnded(Arc<ExcitationReport>),
    /// What a recording says happened, in its own words: for kinds that it keeps as words only.
    Recorded {
        /// The words.
        words: String,
        /// Tag of the loop whose test ended with it.
        test_over: Option<String>,
    },
    /// Samples nobody fetched were given up.
    SamplesLost {
        /// How many.
        count: usize,
    },
    /// Events nobody fetched were given up; sinks had them.
    EventsLost {
        /// How many.
        count: usize,
    },
    /// A defect of the program stopped the run; the last state is kept on screen.
    Stopped {
        /// What the program says of it.
        reason: String,
    },
}
