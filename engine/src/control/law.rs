//! Which law a loop follows, with the settings that only this law has.

use serde::{Deserialize, Serialize};

use super::controller::{ControlInput, ControlOutput, Controller};
use super::on_off::OnOff;
use super::pid_2gl::Pid2gl;
use super::pid_i2gl::PidI2gl;
use super::tuning::PidTuning;

/// What PID-I2GL clips at a limit of its output.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Clip {
    /// The whole output, as in the paper: increments that do not fit are lost.
    #[default]
    Output,
    /// The integral alone: what P and D gave beyond the limit is given back as they return.
    Integral,
}

/// What PID-I2GL sends, switch S1 of its diagram.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Sends {
    /// u.
    #[default]
    Position,
    /// Δu, for an actuator that adds up itself: each sample goes on from where the actuator stands.
    Increment,
}

/// How the positional PID keeps its integral from winding up at a limit.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum AntiWindup {
    /// Conditional integration: of an integral step, what leads over the limit is left out.
    #[default]
    Clamping,
    /// The integral is drawn back with the time constant Tt.
    BackCalculation {
        /// Tt in seconds; absent: √(Ti·Td), or Ti without derivative action.
        tracking_s: Option<f64>,
    },
}

/// Direction of an on/off controller; a PID has it in the sign of Kc.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Action {
    /// A PV under the setpoint asks for more output; Kc > 0.
    #[default]
    Reverse,
    /// A PV over the setpoint asks for more output; Kc < 0.
    Direct,
}

impl Action {
    /// +1 for reverse, −1 for direct action.
    #[must_use]
    pub fn sign(self) -> f64 {
        match self {
            Self::Reverse => 1.0,
            Self::Direct => -1.0,
        }
    }
}

/// A control law.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", deny_unknown_fields)]
pub enum Law {
    /// The incremental PID with two degrees of freedom of the STAD paper.
    #[serde(rename = "pid_i2gl")]
    PidI2gl {
        /// What a limit clips.
        #[serde(default)]
        clip: Clip,
        /// What is sent (S1).
        #[serde(default)]
        sends: Sends,
    },
    /// The positional PID with two degrees of freedom; P, PI and PD as well.
    #[serde(rename = "pid_2gl")]
    Pid2gl {
        /// u0 in MV units, where the output starts at zero error; absent: where the output is at the takeover.
        #[serde(default)]
        bias: Option<f64>,
        /// What happens to the integral at a limit.
        #[serde(default)]
        anti_windup: AntiWindup,
    },
    /// Two outputs: the ends of the output's range.
    #[serde(rename = "on_off")]
    OnOff {
        /// Width of the differential gap in cm.
        #[serde(default)]
        gap_cm: f64,
        /// Direction.
        #[serde(default)]
        action: Action,
    },
}

impl Default for Law {
    fn default() -> Self {
        Self::PidI2gl { clip: Clip::Output, sends: Sends::Position }
    }
}

impl Law {
    /// The positional PID with clamping and without a bias.
    pub const PID_2GL: Self = Self::Pid2gl { bias: None, anti_windup: AntiWindup::Clamping };

    /// Name in files and columns.
    #[must_use]
    pub fn id(&self) -> &'static str {
        match self {
            Self::PidI2gl { .. } => "pid_i2gl",
            Self::Pid2gl { .. } => "pid_2gl",
            Self::OnOff { .. } => "on_off",
        }
    }

    /// Whether this is one of the PIDs.
    #[must_use]
    pub fn is_pid(&self) -> bool {
        !matches!(self, Self::OnOff { .. })
    }

    /// Direction of the loop with a tuning.
    #[must_use]
    pub fn action(&self, tuning: &PidTuning) -> Action {
        match self {
            Self::OnOff { action, .. } => *action,
            _ if tuning.gains.kc < 0.0 => Action::Direct,
            _ => Action::Reverse,
        }
    }
}

/// A law in operation.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Running {
    I2gl(PidI2gl),
    Positional(Pid2gl),
    OnOff(OnOff),
}

impl Running {
    /// A law that goes on from the output `mv`.
    pub fn new(law: &Law, tuning: PidTuning, sample_time_s: f64, mv: f64) -> Self {
        match *law {
            Law::PidI2gl { clip, .. } => Self::I2gl(PidI2gl::at(tuning, sample_time_s, mv).clipping(clip)),
            Law::Pid2gl { bias, anti_windup } => {
                Self::Positional(Pid2gl::new(tuning, sample_time_s, mv, bias, anti_windup))
            }
            Law::OnOff { gap_cm, action } => Self::OnOff(OnOff::new(gap_cm, action, mv)),
        }
    }

    /// Takes the settings of a law of the same kind; false when it is another kind.
    pub fn reconfigure(&mut self, law: &Law) -> bool {
        match (self, *law) {
            (Self::I2gl(pid), Law::PidI2gl { clip, .. }) => pid.set_clip(clip),
            (Self::Positional(pid), Law::Pid2gl { bias, anti_windup }) => pid.configure(bias, anti_windup),
            (Self::OnOff(on_off), Law::OnOff { gap_cm, action }) => on_off.configure(gap_cm, action),
            _ => return false,
        }
        true
    }
}

macro_rules! each {
    ($self:expr, $law:ident => $call:expr) => {
        match $self {
            Running::I2gl($law) => $call,
            Running::Positional($law) => $call,
            Running::OnOff($law) => $call,
        }
    };
}

impl Controller for Running {
    #[inline(always)]
    fn step(&mut self, input: &ControlInput) -> ControlOutput {
        each!(self, law => law.step(input))
    }

    #[inline]
    fn mv(&self) -> f64 {
        each!(self, law => Controller::mv(law))
    }

    fn set_mv(&mut self, mv: f64) {
        each!(self, law => Controller::set_mv(law, mv));
    }

    fn applied(&mut self, mv: f64) {
        each!(self, law => law.applied(mv));
    }

    fn rebase(&mut self) {
        each!(self, law => law.rebase());
    }

    fn set_tuning(&mut self, tuning: PidTuning) {
        each!(self, law => Controller::set_tuning(law, tuning));
    }
}
