//! What the pane of linear models shows: the rig at an operating point, linearised. No widget in here.

use std::sync::Arc;

use vasos_engine::model::{
    ProcessModel, ReducedOrder, StateSpace, TransferFunction, ZeroPoleGain, half_rule,
};
use vasos_engine::plant::{LinearOptions, Linearisation, Network, OperatingPoint, SteadyTarget, linearise};
use vasos_engine::session::Snapshot;
use vasos_engine::sim::LoopTarget;

use crate::i18n;

/// Where the rig is looked at.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum At {
    /// At rest with every loop's PV at its setpoint.
    #[default]
    Setpoints,
    /// At rest with the present inputs.
    Inputs,
    /// As it is now, at rest or not.
    Now,
}

impl At {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Setpoints, Self::Inputs, Self::Now];

    /// End of the key of its explanation.
    #[must_use]
    pub fn key(self) -> &'static str {
        match self {
            Self::Setpoints => "setpoints",
            Self::Inputs => "inputs",
            Self::Now => "now",
        }
    }
}

/// From one input to one output.
#[derive(Debug, Clone)]
pub struct Channel {
    /// Tag of the output's tank.
    pub output: String,
    /// Tag of the input's pump.
    pub input: String,
    /// Unit of the output per unit of the input.
    pub input_unit: String,
    /// Numerator, denominator, dead time.
    pub transfer: TransferFunction,
    /// Zeros, poles, gain.
    pub roots: ZeroPoleGain,
    /// First order by the half rule, or why not.
    pub first: Result<ProcessModel, String>,
}

/// The rig linearised.
#[derive(Debug, Clone)]
pub struct Card {
    /// State space and what belongs to it.
    pub linear: Linearisation,
    /// Every input to every output.
    pub channels: Vec<Channel>,
}

/// What a card was made from; another one is made when it changes.
#[derive(Debug, Clone, PartialEq)]
pub struct Key {
    rig: usize,
    configuration: usize,
    at: At,
    point: OperatingPoint,
    targets: Vec<(usize, usize, u64)>,
}

impl Key {
    /// The key of the present.
    #[must_use]
    pub fn of(snapshot: &Snapshot, at: At) -> Self {
        let network = &snapshot.network;
        let mut point = OperatingPoint::of_configuration(network, snapshot.configuration);
        point.angles_deg = snapshot.valves.iter().map(|v| v.angle_deg).collect();
        if at != At::Setpoints {
            point.inputs = snapshot.pumps.iter().map(|p| p.input).collect();
        }
        if at == At::Now {
            point.levels_cm = snapshot.tanks.iter().map(|t| t.level_cm).collect();
        }
        let mut targets = vec![];
        if at == At::Setpoints {
            for now in snapshot.loops.iter().filter(|l| matches!(l.target, LoopTarget::Pump(_))) {
                targets.push((now.pump, network.sensors[now.sensor].tank, now.setpoint_cm.to_bits()));
            }
        }
        Self { rig: Arc::as_ptr(network) as usize, configuration: snapshot.configuration, at, point, targets }
    }

    /// Solves for the point and linearises there.
    ///
    /// # Errors
    /// The reason in the window's language.
    pub fn card(&self, network: &Network) -> Result<Card, String> {
        let targets: Vec<SteadyTarget> = self
            .targets
            .iter()
            .map(|&(pump, tank, bits)| SteadyTarget { pump, tank, level_cm: f64::from_bits(bits) })
            .collect();
        let point = match self.at {
            At::Now => self.point.clone(),
            At::Setpoints | At::Inputs => {
                self.point.at_levels(network, &targets).map_err(|e| i18n::say(&e))?
            }
        };
        let linear = linearise(network, &point, &LinearOptions::default()).map_err(|e| i18n::say(&e))?;
        let channels = channels(network, &linear);
        Ok(Card { linear, channels })
    }
}

fn channels(network: &Network, linear: &Linearisation) -> Vec<Channel> {
    let model: &StateSpace = &linear.model;
    let (outputs, inputs) = model.d().shape();
    let mut made = vec![];
    for output in 0..outputs {
        for input in 0..inputs {
            let roots = model.zero_pole_gain(output, input);
            made.push(Channel {
                output: network.spec.tanks[linear.outputs[output]].id.clone(),
                input: network.spec.pumps[input].id.clone(),
                input_unit: network.spec.pumps[input].unit.symbol().to_owned(),
                transfer: model.transfer_function(output, input),
                first: half_rule(&roots, ReducedOrder::First).map_err(|e| i18n::say(&e)),
                roots,
            });
        }
    }
    made
}
