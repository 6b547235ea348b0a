//! What a test is: plain data, as files and commands give it.

use serde::{Deserialize, Serialize};

/// A test on a loop: its signal, and what it must keep to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Excitation {
    /// How the loop is moved.
    pub signal: Signal,
    /// Values it must not leave.
    #[serde(default)]
    pub limits: ExcitationLimits,
    /// Longest time it may take in seconds, listening included.
    #[serde(default = "Excitation::default_budget_s")]
    pub budget_s: f64,
    /// How long the loop is listened to as it is, in seconds: noise, PV and MV at rest are measured then.
    #[serde(default = "Excitation::default_listen_s")]
    pub listen_s: f64,
    /// Whether the loop has to be at rest when it is moved.
    #[serde(default)]
    pub at_rest: AtRest,
}

impl Excitation {
    /// A test with defaults around its signal.
    #[must_use]
    pub fn new(signal: Signal) -> Self {
        Self {
            signal,
            limits: ExcitationLimits::default(),
            budget_s: Self::default_budget_s(),
            listen_s: Self::default_listen_s(),
            at_rest: AtRest::default(),
        }
    }

    fn default_budget_s() -> f64 {
        3600.0
    }

    fn default_listen_s() -> f64 {
        30.0
    }
}

/// Values that a test must not leave; what is left out is that of the loop and its sensor.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ExcitationLimits {
    /// Lowest PV in PV units; absent: that of the sensor's range.
    pub pv_low: Option<f64>,
    /// Highest PV in PV units; absent: that of the sensor's range.
    pub pv_high: Option<f64>,
    /// Lowest output in MV units; absent: the loop's limit.
    pub mv_low: Option<f64>,
    /// Highest output in MV units; absent: the loop's limit.
    pub mv_high: Option<f64>,
}

/// Whether a loop has to be at rest before it is moved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AtRest {
    /// A PV that drifts while it is listened to ends the test before anything was moved.
    #[default]
    Required,
    /// It begins wherever the loop is.
    NotNeeded,
}

/// What is left at the end of a step that came to its rest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StepEnd {
    /// The value before the step.
    #[default]
    Back,
    /// The value after it.
    Stay,
}

/// How a loop is moved.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Signal {
    /// The MV goes up by a size and stays until the PV has come to rest: the reaction curve.
    Step {
        /// Change of the MV in MV units, ≠ 0.
        size: f64,
        /// Share of the response that the PV may still move by at rest.
        #[serde(default = "default_rest_share")]
        rest_share: f64,
        /// What is left at its end.
        #[serde(default)]
        end: StepEnd,
    },
    /// The setpoint goes up by a size, the controller in charge, until the PV has come to rest.
    SetpointStep {
        /// Change of the setpoint in PV units, ≠ 0.
        size: f64,
        /// Share of the response that the PV may still move by at rest.
        #[serde(default = "default_rest_share")]
        rest_share: f64,
        /// What is left at its end.
        #[serde(default)]
        end: StepEnd,
    },
    /// The MV switches with the sign of the error, until the oscillation repeats itself.
    Relay(Relay),
    /// The MV goes up, down and back, and the PV is watched until it has come to rest.
    Doublet {
        /// Size of each move in MV units, ≠ 0.
        amplitude: f64,
        /// Length of each half in seconds.
        hold_s: f64,
    },
    /// The MV follows a pseudo-random binary sequence of maximum length.
    Prbs {
        /// Half the distance of the two values in MV units, > 0.
        amplitude: f64,
        /// Length of a bit in seconds, at least the sample time.
        clock_s: f64,
        /// Length n of the shift register, 2 to 11: the sequence has 2ⁿ − 1 bits.
        #[serde(default = "default_register")]
        register: u32,
        /// Times the sequence is sent.
        #[serde(default = "default_periods")]
        periods: u32,
    },
    /// The MV follows one sine after the other: the frequency response, point by point.
    SteppedSine(SteppedSine),
    /// Proportional control alone, the gain raised until the oscillation holds.
    UltimateGain(UltimateGain),
}

fn default_rest_share() -> f64 {
    0.02
}

fn default_register() -> u32 {
    6
}

fn default_periods() -> u32 {
    1
}

/// Where the width of a relay's hysteresis comes from.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Hysteresis {
    /// ε in PV units, ≥ 0; 0 for none.
    Given(f64),
    /// ε = factor · sd(δ), δ = y − ȳ while listening, ȳ the mean of the last four samples.
    Noise(f64),
}

/// A relay about the MV at rest.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Relay {
    /// d, height of the upper value over the MV at rest, in MV units, > 0.
    pub amplitude: f64,
    /// Depth of the lower value under it, in MV units, > 0; absent: `amplitude`. Another one gives the static gain.
    #[serde(default)]
    pub amplitude_down: Option<f64>,
    /// ε; absent: three times sd(δ).
    #[serde(default = "Relay::default_hysteresis")]
    pub hysteresis: Hysteresis,
    /// Cycles that have to agree, and are averaged; 2 to 12.
    #[serde(default = "default_cycles")]
    pub cycles: u32,
    /// Difference of period and amplitude at which two cycles agree, as a share of them.
    #[serde(default = "Relay::default_agreement")]
    pub agreement: f64,
}

fn default_cycles() -> u32 {
    3
}

impl Relay {
    /// A symmetric relay with hysteresis from the noise.
    #[must_use]
    pub fn new(amplitude: f64) -> Self {
        Self {
            amplitude,
            amplitude_down: None,
            hysteresis: Self::default_hysteresis(),
            cycles: default_cycles(),
            agreement: Self::default_agreement(),
        }
    }

    // The factor is open in Silva et al., CBA 2014: three standard deviations keep all but a few samples apart.
    fn default_hysteresis() -> Hysteresis {
        Hysteresis::Noise(3.0)
    }

    fn default_agreement() -> f64 {
        0.05
    }

    /// Depth of the lower value under the MV at rest, in MV units.
    #[must_use]
    pub fn down(&self) -> f64 {
        self.amplitude_down.unwrap_or(self.amplitude)
    }
}

/// Sines one after the other.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SteppedSine {
    /// Amplitude in MV units, > 0.
    pub amplitude: f64,
    /// Angular frequencies in rad/s, each > 0 and under a quarter of the sampling frequency, in the order they are sent.
    pub frequencies_rad_s: Vec<f64>,
    /// Cycles that are measured, after those in which the answer settled; 1 to 100.
    #[serde(default = "default_cycles")]
    pub cycles: u32,
    /// Difference between two cycles at which the answer has settled, as a share of it.
    #[serde(default = "SteppedSine::default_agreement")]
    pub agreement: f64,
}

impl SteppedSine {
    fn default_agreement() -> f64 {
        0.005
    }

    /// Sines of one amplitude.
    #[must_use]
    pub fn new(amplitude: f64, frequencies_rad_s: Vec<f64>) -> Self {
        let agreement = Self::default_agreement();
        Self { amplitude, frequencies_rad_s, cycles: default_cycles(), agreement }
    }
}

/// Proportional control with a gain that is raised.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct UltimateGain {
    /// Size of the gain at the start in MV units per PV unit, > 0; the first kick finds its sign.
    pub start_gain: f64,
    /// Change of the MV that sets the loop going, in MV units, ≠ 0.
    pub kick: f64,
    /// Factor from gain to gain, > 1.
    #[serde(default = "UltimateGain::default_factor")]
    pub factor: f64,
    /// Cycles over which the oscillation is judged at each gain; 2 to 8.
    #[serde(default = "default_cycles")]
    pub cycles: u32,
    /// Change of the amplitude per cycle at which the oscillation holds, as a share of it.
    #[serde(default = "UltimateGain::default_agreement")]
    pub agreement: f64,
}

impl UltimateGain {
    fn default_factor() -> f64 {
        1.3
    }

    fn default_agreement() -> f64 {
        0.03
    }

    /// A search with defaults around its gain and kick.
    #[must_use]
    pub fn new(start_gain: f64, kick: f64) -> Self {
        Self {
            start_gain,
            kick,
            factor: Self::default_factor(),
            cycles: default_cycles(),
            agreement: Self::default_agreement(),
        }
    }
}

impl Signal {
    /// As files name it.
    #[must_use]
    pub fn key(&self) -> &'static str {
        match self {
            Self::Step { .. } => "step",
            Self::SetpointStep { .. } => "setpoint_step",
            Self::Relay(_) => "relay",
            Self::Doublet { .. } => "doublet",
            Self::Prbs { .. } => "prbs",
            Self::SteppedSine(_) => "stepped_sine",
            Self::UltimateGain(_) => "ultimate_gain",
        }
    }

    /// Whether the loop's controller goes on to write its output.
    #[must_use]
    pub fn keeps_loop(&self) -> bool {
        matches!(self, Self::SetpointStep { .. } | Self::UltimateGain(_))
    }

    /// Farthest deviations of the output from its value at rest that the signal asks for, in MV units.
    #[must_use]
    pub fn reach(&self) -> [f64; 2] {
        match *self {
            Self::Step { size: by, .. } | Self::UltimateGain(UltimateGain { kick: by, .. }) => {
                [by.min(0.0), by.max(0.0)]
            }
            Self::SetpointStep { .. } => [0.0, 0.0],
            Self::Relay(relay) => [-relay.down(), relay.amplitude],
            Self::Doublet { amplitude, .. } | Self::Prbs { amplitude, .. } => {
                [-amplitude.abs(), amplitude.abs()]
            }
            Self::SteppedSine(ref sine) => [-sine.amplitude, sine.amplitude],
        }
    }
}
