//! The present state of a session, complete and immutable: the latest replaces the one before.

use std::sync::Arc;

use super::event::Alarm;
use crate::control::{Action, Bound, ControlOutput, Law, Limits, Mode, PidTuning};
use crate::plant::{ActiveFault, Balance, Measurement, Network, ReadingStatus};
use crate::sim::{ExcitationNow, LoopTarget};

/// A tank now.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TankNow {
    /// True level in cm.
    pub level_cm: f64,
    /// Spill over the rim in cm³/s.
    pub spill_cm3_s: f64,
    /// Leak to the floor in cm³/s.
    pub leak_cm3_s: f64,
}

/// A pump now.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PumpNow {
    /// Input in its unit.
    pub input: f64,
    /// Flow it draws, in cm³/s.
    pub pumped_cm3_s: f64,
    /// Flow that arrives, in cm³/s.
    pub arriving_cm3_s: f64,
    /// It draws from an empty tank.
    pub dry: bool,
}

/// A valve now.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ValveNow {
    /// Angle in degrees.
    pub angle_deg: f64,
    /// Flow in cm³/s, positive from its `from` to its `to`.
    pub flow_cm3_s: f64,
}

/// A loop now.
#[derive(Debug, Clone, PartialEq)]
pub struct LoopNow {
    /// Tag.
    pub tag: String,
    /// Sensor's index in the network.
    pub sensor: usize,
    /// Index in the network of the pump that it moves, through inner loops where there are some.
    pub pump: usize,
    /// What takes the output.
    pub target: LoopTarget,
    /// Index of the loop that gives the setpoint in cascade.
    pub outer: Option<usize>,
    /// Measured PV in cm; NaN before the first sample.
    pub pv_cm: f64,
    /// What the reading is worth.
    pub status: ReadingStatus,
    /// Setpoint in cm.
    pub setpoint_cm: f64,
    /// Setpoint as the law sees it, after ramp and filter, in cm.
    pub working_setpoint_cm: f64,
    /// Output in the pump's unit; in cm where it is another loop's setpoint.
    pub mv: f64,
    /// Range of what takes the output.
    pub range: Limits,
    /// Limits of the output.
    pub limits: Limits,
    /// Limit at which the output stands.
    pub at_limit: Option<Bound>,
    /// Mode that was asked for.
    pub mode: Mode,
    /// Mode of the last sample: an outer loop waits in manual until its inner loop is in cascade.
    pub actual: Mode,
    /// The law with its settings.
    pub law: Law,
    /// Direction of the loop.
    pub action: Action,
    /// Gains and weights as set.
    pub tuning: PidTuning,
    /// Gains and weights at the present level, schedule included.
    pub tuning_now: PidTuning,
    /// Time constant of the PV filter in seconds.
    pub pv_filter_s: f64,
    /// What the last sample came to: terms of the law, increment asked for, limit that cut it, output held.
    pub last: ControlOutput,
}

/// Everything a view needs of the present.
#[derive(Debug, Clone, PartialEq)]
pub struct Snapshot {
    /// Number of the run; grows when a rig is loaded or restarted.
    pub run: u64,
    /// Time of the run in seconds.
    pub time_s: f64,
    /// Samples taken in the run.
    pub samples: u64,
    /// Time goes on.
    pub running: bool,
    /// Wanted times real time.
    pub speed: f64,
    /// Reached times real time, over the last second; NaN while paused.
    pub achieved_speed: f64,
    /// Structure of the rig.
    pub network: Arc<Network>,
    /// Index of the present configuration.
    pub configuration: usize,
    /// Imperfections that are on.
    pub measurement: Measurement,
    /// Tanks in the order of the network.
    pub tanks: Vec<TankNow>,
    /// Pumps in the order of the network.
    pub pumps: Vec<PumpNow>,
    /// Valves in the order of the network.
    pub valves: Vec<ValveNow>,
    /// Loops of the configuration.
    pub loops: Vec<LoopNow>,
    /// Where the water is.
    pub balance: Balance,
    /// Water gained or lost by computation since the start, in cm³: 0 but for rounding.
    pub balance_error_cm3: f64,
    /// Alarms that are on.
    pub alarms: Vec<Alarm>,
    /// Faults that have been switched on.
    pub faults: Vec<ActiveFault>,
    /// The test that runs on a loop.
    pub excitation: Option<ExcitationNow>,
    /// First and last time in seconds of the recording that is played; `None` for a running rig.
    pub span_s: Option<[f64; 2]>,
}

impl Snapshot {
    /// A rig of which nothing is known yet.
    #[must_use]
    pub fn empty(network: Arc<Network>) -> Self {
        Self {
            run: 0,
            time_s: 0.0,
            samples: 0,
            running: false,
            speed: 1.0,
            achieved_speed: f64::NAN,
            network,
            configuration: 0,
            measurement: Measurement::DEFAULT,
            tanks: vec![],
            pumps: vec![],
            valves: vec![],
            loops: vec![],
            balance: Balance::default(),
            balance_error_cm3: 0.0,
            alarms: vec![],
            faults: vec![],
            excitation: None,
            span_s: None,
        }
    }
}
