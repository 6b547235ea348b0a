//! What every control law takes, gives and can be asked.

use serde::{Deserialize, Serialize};

use super::tuning::PidTuning;

/// Who decides the output of a loop, and from where its setpoint comes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// The operator writes the output.
    Manual,
    /// The controller writes the output; the operator gives the setpoint.
    Automatic,
    /// The controller writes the output; another loop gives the setpoint.
    Cascade,
}

impl Mode {
    /// As a plant's log writes it.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Manual => "MAN",
            Self::Automatic => "AUTO",
            Self::Cascade => "CAS",
        }
    }

    /// Whether the controller writes the output.
    #[must_use]
    pub fn is_controlling(self) -> bool {
        self != Self::Manual
    }
}

/// The end of a range at which an output stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Bound {
    /// The lower end.
    Low,
    /// The upper end.
    High,
}

/// Range of an output in MV units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Lower end.
    pub low: f64,
    /// Upper end; not below `low`.
    pub high: f64,
}

impl Limits {
    /// The limit at which a value stands, or past which it is.
    #[must_use]
    pub fn reached(self, value: f64) -> Option<Bound> {
        if value >= self.high {
            Some(Bound::High)
        } else if value <= self.low {
            Some(Bound::Low)
        } else {
            None
        }
    }

    /// The nearest value within.
    #[must_use]
    pub fn clamp(self, value: f64) -> f64 {
        value.clamp(self.low, self.high)
    }

    /// The end that cuts a value off, if one does.
    #[must_use]
    pub fn cuts(self, value: f64) -> Option<Bound> {
        if value > self.high {
            Some(Bound::High)
        } else if value < self.low {
            Some(Bound::Low)
        } else {
            None
        }
    }
}

/// One sample for a law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ControlInput {
    /// r in PV units.
    pub setpoint: f64,
    /// y in PV units.
    pub pv: f64,
    /// What a feed-forward adds to the output, in MV units.
    pub feedforward: f64,
    /// Range of this sample: the output's limits, narrowed by its largest rate.
    pub limits: Limits,
    /// Whether the law writes the output; otherwise it keeps its memory up to date.
    pub controlling: bool,
}

/// Terms of a sample, for a diagram of the law: increments of PID-I2GL, values of the positional PID.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Parts {
    /// Proportional part in MV units.
    pub p: f64,
    /// Integral part in MV units.
    pub i: f64,
    /// Derivative part in MV units.
    pub d: f64,
    /// Feed-forward part in MV units.
    pub feedforward: f64,
    /// Bias u0 in MV units; 0 for a law without one.
    pub bias: f64,
}

/// What one sample of a controller came to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ControlOutput {
    /// Output within its limits, in MV units.
    pub mv: f64,
    /// The change of output the law asked for before the limiter, in MV units.
    pub wanted_increment: f64,
    /// The input was not finite and the output is held.
    pub held: bool,
    /// The limit that cut off what the law asked for.
    pub cut: Option<Bound>,
    /// Terms of the law.
    pub parts: Parts,
}

impl ControlOutput {
    /// The last output, held for want of a finite input.
    #[must_use]
    pub fn held(mv: f64) -> Self {
        Self { mv, wanted_increment: 0.0, held: true, cut: None, parts: Parts::default() }
    }
}

/// A control law with its memory.
pub trait Controller {
    /// One sample. Allocates nothing; an input that is not finite holds the last output.
    fn step(&mut self, input: &ControlInput) -> ControlOutput;

    /// The present output in MV units.
    fn mv(&self) -> f64;

    /// Puts the output to a value from which the law goes on; a value that is not finite is ignored.
    fn set_mv(&mut self, mv: f64);

    /// Learns what the final element took instead of the last output, for example behind its own rate limit.
    fn applied(&mut self, mv: f64) {
        self.set_mv(mv);
    }

    /// Makes the next sample go on from the present output, whatever its signals are by then.
    fn rebase(&mut self);

    /// Takes new gains and weights.
    fn set_tuning(&mut self, tuning: PidTuning);
}
