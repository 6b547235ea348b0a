//! What a running rig and its session can be told.

use serde::{Deserialize, Serialize};

use super::exact::ExactTuning;
use crate::control::{GainsError, Law, LoopOptions, Mode, PidTuning};
use crate::excitation::{Excitation, ExcitationError};
use crate::explain::{Explain, number};
use crate::plant::{Fault, FaultKind, Measurement, RigError};

/// A change of the rig or its loops; scenarios and sessions share it. Items are named by their tags.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum RigCommand {
    /// New setpoint of a loop in cm.
    Setpoint {
        /// Loop.
        tag: String,
        /// Setpoint in cm.
        level_cm: f64,
    },
    /// Manual, automatic or cascade.
    Mode {
        /// Loop.
        tag: String,
        /// Who writes the output.
        mode: Mode,
    },
    /// Input of a pump: a loop's in manual, or one without a loop.
    Mv {
        /// Loop or pump.
        tag: String,
        /// Input in the pump's unit.
        value: f64,
    },
    /// New tuning of a loop.
    Tuning {
        /// Loop.
        tag: String,
        /// Gains and weights.
        #[serde(deserialize_with = "ExactTuning::deserialize")]
        tuning: PidTuning,
    },
    /// Another law of a loop, or other settings of its law; the output goes on from where it is.
    Law {
        /// Loop.
        tag: String,
        /// The law with its settings.
        law: Law,
    },
    /// What stands around the law of a loop: limits, setpoint path, deadband, schedule, feed-forward, predictor.
    Options {
        /// Loop.
        tag: String,
        /// All of it; what is left out is off.
        options: Box<LoopOptions>,
    },
    /// New PV filter of a loop.
    PvFilter {
        /// Loop.
        tag: String,
        /// Time constant in seconds; 0 for none.
        time_constant_s: f64,
    },
    /// Turns a valve.
    Valve {
        /// Valve.
        tag: String,
        /// Angle in degrees.
        angle_deg: f64,
    },
    /// Adds water to a tank, or takes it out.
    Bump {
        /// Tank.
        tag: String,
        /// Change of level in cm.
        delta_cm: f64,
    },
    /// Turns the rig to a configuration of its file; levels stay.
    Configuration {
        /// Its id.
        id: String,
    },
    /// Solves for the input that holds a loop's level and puts the plant there.
    SteadyAt {
        /// Loop.
        tag: String,
        /// Level in cm.
        level_cm: f64,
    },
    /// Switches noise, quantisation and resolution.
    Measurement {
        /// What is on.
        measurement: Measurement,
    },
    /// Restarts the noise from a seed.
    Seed {
        /// Seed.
        seed: u64,
    },
    /// Begins a test on a loop, which moves it over its mode and its law until it ends.
    Excite {
        /// Loop.
        tag: String,
        /// What is done, within which limits.
        excitation: Box<Excitation>,
    },
    /// Ends the test on a loop.
    AbortExcitation {
        /// Loop.
        tag: String,
    },
    /// Breaks something.
    #[serde(deserialize_with = "super::exact::fault")]
    Fault {
        /// Sensor, valve, tank, pump, or the rig's id.
        tag: String,
        /// What breaks.
        #[serde(flatten)]
        fault: Fault,
    },
    /// Repairs something.
    Repair {
        /// Sensor, valve, tank, pump, or the rig's id.
        tag: String,
        /// One fault; absent: all of them.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        kind: Option<FaultKind>,
    },
}

impl RigCommand {
    /// The commands as files name them.
    pub const KEYS: [&str; 17] = [
        "setpoint",
        "mode",
        "mv",
        "tuning",
        "law",
        "options",
        "pv_filter",
        "valve",
        "bump",
        "configuration",
        "steady_at",
        "measurement",
        "seed",
        "excite",
        "abort_excitation",
        "fault",
        "repair",
    ];

    /// As files name it, one of [`Self::KEYS`].
    #[must_use]
    pub fn key(&self) -> &'static str {
        match self {
            Self::Setpoint { .. } => "setpoint",
            Self::Mode { .. } => "mode",
            Self::Mv { .. } => "mv",
            Self::Tuning { .. } => "tuning",
            Self::Law { .. } => "law",
            Self::Options { .. } => "options",
            Self::PvFilter { .. } => "pv_filter",
            Self::Valve { .. } => "valve",
            Self::Bump { .. } => "bump",
            Self::Configuration { .. } => "configuration",
            Self::SteadyAt { .. } => "steady_at",
            Self::Measurement { .. } => "measurement",
            Self::Seed { .. } => "seed",
            Self::Excite { .. } => "excite",
            Self::AbortExcitation { .. } => "abort_excitation",
            Self::Fault { .. } => "fault",
            Self::Repair { .. } => "repair",
        }
    }
}

/// Why a command was not carried out. Nothing has changed then.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CommandError {
    /// The rig refuses.
    #[error(transparent)]
    Rig(#[from] RigError),
    /// The gains are not usable.
    #[error(transparent)]
    Gains(#[from] GainsError),
    /// The test cannot begin, or there is none to end.
    #[error(transparent)]
    Excitation(#[from] ExcitationError),
    /// No such loop, pump, valve, tank or configuration now.
    #[error("there is no {tag} in the present configuration")]
    UnknownTag {
        /// Tag.
        tag: String,
    },
    /// A setpoint below the bottom, over the rim, or not a number.
    #[error("{tag}: a setpoint of {} cm is not possible; the tank holds 0 to {} cm", number(*.level_cm), number(*.rim_cm))]
    Setpoint {
        /// Loop.
        tag: String,
        /// Setpoint in cm.
        level_cm: f64,
        /// Rim in cm.
        rim_cm: f64,
    },
    /// An output sent to a loop in automatic.
    #[error("{tag} is in automatic and writes the output itself; switch it to manual first")]
    Automatic {
        /// Loop.
        tag: String,
    },
    /// A state at rest asked of a rig that a fault keeps from it.
    #[error("the rig cannot be put to rest while {tag} has a fault ({kind}); repair it first")]
    Faulty {
        /// Part with the fault.
        tag: String,
        /// The fault.
        kind: &'static str,
    },
    /// A setpoint sent to a loop that takes it from another.
    #[error("{tag} is in cascade and takes its setpoint from another loop; switch it to automatic first")]
    Cascade {
        /// Loop.
        tag: String,
    },
    /// An output sent to an outer loop that follows its inner loop's setpoint.
    #[error("{tag} follows the setpoint of {inner}; switch {inner} to cascade first")]
    Follows {
        /// Outer loop.
        tag: String,
        /// Inner loop.
        inner: String,
    },
    /// A valve, tank or configuration of something that has none.
    #[error("this source has no valves or tanks that can be set from here")]
    NotARig,
    /// A change asked of a recording.
    #[error("a recording cannot be changed; switch the source to the simulated rig first")]
    Replay,
    /// Another time asked of a running rig.
    #[error("a running rig has only its present; open a recording to go back in time")]
    NoReplay,
    /// A speed that is not possible.
    #[error("a speed of {} × is not possible; choose 1 × to 1000 ×", number(*.speed))]
    Speed {
        /// Times real time.
        speed: f64,
    },
}

impl Explain for CommandError {
    fn key(&self) -> &'static str {
        match self {
            Self::Rig(error) => error.key(),
            Self::Gains(error) => error.key(),
            Self::Excitation(error) => error.key(),
            Self::UnknownTag { .. } => "command.unknown_tag",
            Self::Setpoint { .. } => "command.setpoint",
            Self::Automatic { .. } => "command.automatic",
            Self::Faulty { .. } => "command.faulty",
            Self::Cascade { .. } => "command.cascade",
            Self::Follows { .. } => "command.follows",
            Self::NotARig => "command.not_a_rig",
            Self::Replay => "command.replay",
            Self::NoReplay => "command.no_replay",
            Self::Speed { .. } => "command.speed",
        }
    }

    fn args(&self) -> Vec<(&'static str, String)> {
        match self {
            Self::Rig(error) => error.args(),
            Self::Gains(error) => error.args(),
            Self::Excitation(error) => error.args(),
            Self::UnknownTag { tag } | Self::Automatic { tag } | Self::Cascade { tag } => {
                vec![("tag", tag.clone())]
            }
            Self::Follows { tag, inner } => vec![("tag", tag.clone()), ("inner", inner.clone())],
            Self::Setpoint { tag, level_cm, rim_cm } => {
                vec![("tag", tag.clone()), ("level_cm", number(*level_cm)), ("rim_cm", number(*rim_cm))]
            }
            Self::Faulty { tag, kind } => vec![("tag", tag.clone()), ("kind", (*kind).to_owned())],
            Self::NotARig | Self::Replay | Self::NoReplay => vec![],
            Self::Speed { speed } => vec![("speed", number(*speed))],
        }
    }
}

impl CommandError {
    /// One of each kind of its own, for the test that compares them with the translation files.
    #[must_use]
    pub fn samples() -> Vec<Self> {
        let tag = || "LIC-02".to_owned();
        vec![
            Self::UnknownTag { tag: tag() },
            Self::Setpoint { tag: tag(), level_cm: 31.0, rim_cm: 27.0 },
            Self::Automatic { tag: tag() },
            Self::Faulty { tag: "TQ1".to_owned(), kind: "leak" },
            Self::Cascade { tag: tag() },
            Self::Follows { tag: tag(), inner: "LIC-03".to_owned() },
            Self::NotARig,
            Self::Replay,
            Self::NoReplay,
            Self::Speed { speed: -3.0 },
        ]
    }
}
