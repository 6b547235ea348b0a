//! What can break at a rig, each fault with a switch of its own.
//!
//! Sensors: stuck, drift, broken wire, spikes. Valves: clogged. Tanks: leak. Pumps: weak, dry, without power.
//! A power cut of the whole rig stops every pump and takes the transmitters' current away.

use serde::{Deserialize, Serialize};

use super::error::RigError;
use super::network::Network;

/// A fault with its size.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Fault {
    /// A sensor goes on giving its last reading.
    Stuck,
    /// A sensor's zero moves.
    Drift {
        /// Speed in cm/s.
        rate_cm_s: f64,
    },
    /// A sensor's wire is broken: 0 mA, which is no level (NAMUR NE 43: below 3.6 mA).
    BrokenWire,
    /// A sensor gives single readings that are off.
    Spikes {
        /// How far off, in cm, to either side.
        height_cm: f64,
        /// Mean time between two, in seconds.
        every_s: f64,
    },
    /// Something in a valve lets only a part of its flow through.
    Clogged {
        /// Share of k that is left, 0 to 1.
        share: f64,
    },
    /// A hole in a tank's floor, `q = k √h` onto the floor of the laboratory.
    Leak {
        /// k of the hole in cm^2.5/s.
        k_cm2_5_s: f64,
    },
    /// A pump delivers only a part of its curve.
    WeakPump {
        /// Share of the flow that is left, 0 to 1.
        share: f64,
    },
    /// A pump has lost its suction and turns in air.
    DryPump,
    /// A pump, or the whole rig, is without power.
    PowerCut,
}

/// A fault without its size.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FaultKind {
    /// See [`Fault::Stuck`].
    Stuck,
    /// See [`Fault::Drift`].
    Drift,
    /// See [`Fault::BrokenWire`].
    BrokenWire,
    /// See [`Fault::Spikes`].
    Spikes,
    /// See [`Fault::Clogged`].
    Clogged,
    /// See [`Fault::Leak`].
    Leak,
    /// See [`Fault::WeakPump`].
    WeakPump,
    /// See [`Fault::DryPump`].
    DryPump,
    /// See [`Fault::PowerCut`].
    PowerCut,
}

impl FaultKind {
    /// All of them, sensors' first.
    pub const ALL: [Self; 9] = [
        Self::Stuck,
        Self::Drift,
        Self::BrokenWire,
        Self::Spikes,
        Self::Clogged,
        Self::Leak,
        Self::WeakPump,
        Self::DryPump,
        Self::PowerCut,
    ];

    /// As files, the command line and the translation files (under `fault.`) write it.
    #[must_use]
    pub fn key(self) -> &'static str {
        match self {
            Self::Stuck => "stuck",
            Self::Drift => "drift",
            Self::BrokenWire => "broken_wire",
            Self::Spikes => "spikes",
            Self::Clogged => "clogged",
            Self::Leak => "leak",
            Self::WeakPump => "weak_pump",
            Self::DryPump => "dry_pump",
            Self::PowerCut => "power_cut",
        }
    }

    /// The fault with the size a view offers first.
    #[must_use]
    pub fn usual(self) -> Fault {
        match self {
            Self::Stuck => Fault::Stuck,
            Self::Drift => Fault::Drift { rate_cm_s: 0.01 },
            Self::BrokenWire => Fault::BrokenWire,
            Self::Spikes => Fault::Spikes { height_cm: 2.0, every_s: 20.0 },
            Self::Clogged => Fault::Clogged { share: 0.7 },
            Self::Leak => Fault::Leak { k_cm2_5_s: 1.0 },
            Self::WeakPump => Fault::WeakPump { share: 0.8 },
            Self::DryPump => Fault::DryPump,
            Self::PowerCut => Fault::PowerCut,
        }
    }
}

impl Fault {
    /// Which fault it is.
    #[must_use]
    pub fn kind(self) -> FaultKind {
        match self {
            Self::Stuck => FaultKind::Stuck,
            Self::Drift { .. } => FaultKind::Drift,
            Self::BrokenWire => FaultKind::BrokenWire,
            Self::Spikes { .. } => FaultKind::Spikes,
            Self::Clogged { .. } => FaultKind::Clogged,
            Self::Leak { .. } => FaultKind::Leak,
            Self::WeakPump { .. } => FaultKind::WeakPump,
            Self::DryPump => FaultKind::DryPump,
            Self::PowerCut => FaultKind::PowerCut,
        }
    }

    fn check(self, tag: &str) -> Result<(), RigError> {
        let within = |field: &'static str, value: f64, low: f64, high: f64| {
            if (low..=high).contains(&value) {
                Ok(())
            } else {
                let expected = format!("{low}…{high}");
                Err(RigError::Value { item: tag.to_owned(), field, value, expected })
            }
        };
        match self {
            Self::Drift { rate_cm_s } => within("rate_cm_s", rate_cm_s, -100.0, 100.0),
            Self::Spikes { height_cm, every_s } => {
                within("height_cm", height_cm, 0.0, 1000.0)?;
                within("every_s", every_s, 1e-3, 1e6)
            }
            Self::Clogged { share } | Self::WeakPump { share } => within("share", share, 0.0, 1.0),
            Self::Leak { k_cm2_5_s } => within("k_cm2_5_s", k_cm2_5_s, 0.0, 1e4),
            Self::Stuck | Self::BrokenWire | Self::DryPump | Self::PowerCut => Ok(()),
        }
    }
}

/// A fault that is on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ActiveFault {
    /// Tag of the sensor, valve, tank or pump; the rig's id for a power cut of everything.
    pub tag: String,
    /// What is wrong with it.
    pub fault: Fault,
}

/// The part of the rig a fault sits in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FaultyPart {
    /// Index of a sensor.
    Sensor(usize),
    /// Index of a valve.
    Valve(usize),
    /// Index of a tank.
    Tank(usize),
    /// Index of a pump.
    Pump(usize),
    /// Everything.
    Rig,
}

impl FaultyPart {
    /// The part of a tag.
    #[must_use]
    pub fn find(network: &Network, tag: &str) -> Option<Self> {
        let sensor = network.sensor(tag).map(Self::Sensor);
        let valve = || network.valve(tag).map(Self::Valve);
        let tank = || network.tank(tag).map(Self::Tank);
        let pump = || network.pump(tag).map(Self::Pump);
        let rig = || (network.spec.id == tag).then_some(Self::Rig);
        sensor.or_else(valve).or_else(tank).or_else(pump).or_else(rig)
    }

    /// The faults such a part can have.
    #[must_use]
    pub fn possible(self) -> &'static [FaultKind] {
        match self {
            Self::Sensor(_) => {
                &[FaultKind::Stuck, FaultKind::Drift, FaultKind::BrokenWire, FaultKind::Spikes]
            }
            Self::Valve(_) => &[FaultKind::Clogged],
            Self::Tank(_) => &[FaultKind::Leak],
            Self::Pump(_) => &[FaultKind::WeakPump, FaultKind::DryPump, FaultKind::PowerCut],
            Self::Rig => &[FaultKind::PowerCut],
        }
    }
}

/// The part that a fault is meant for, with the fault checked against it.
///
/// # Errors
/// [`RigError::Unknown`] for a tag that is not there, [`RigError::Fault`] for one that cannot break that way,
/// [`RigError::Value`] for a size that is not possible.
pub fn check_fault(network: &Network, tag: &str, fault: Fault) -> Result<FaultyPart, RigError> {
    let part = FaultyPart::find(network, tag).ok_or_else(|| RigError::Unknown {
        item: fault.kind().key().to_owned(),
        reference: tag.to_owned(),
    })?;
    if !part.possible().contains(&fault.kind()) {
        return Err(RigError::Fault {
            tag: tag.to_owned(),
            kind: fault.kind().key(),
            possible: part.possible().iter().map(|k| k.key()).collect::<Vec<_>>().join(", "),
        });
    }
    fault.check(tag)?;
    Ok(part)
}
