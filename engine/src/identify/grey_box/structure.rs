//! The part of a rig that its outputs depend on, with what of it is free.

use super::target::{Target, angle_deg, delay_s};
use crate::plant::spec::{ValveDrive, ValveLaw};
use crate::plant::{Network, RigSpec};

/// Least δ in cm: a plain root has an infinite slope where a tank runs empty, and no sensitivity there.
const LEAST_DELTA_CM: f64 = 1e-3;

/// A number that is fixed, or `factor` times one of the unknowns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Quantity {
    pub value: f64,
    pub factor: f64,
    pub slot: Option<usize>,
}

impl Quantity {
    #[inline]
    pub fn at(&self, unknowns: &[f64]) -> f64 {
        self.slot.map_or(self.value, |slot| unknowns[slot]) * self.factor
    }
}

#[derive(Debug, Clone)]
pub(super) struct Vessel {
    /// Place in the rig file.
    pub tank: usize,
    pub area: Quantity,
    pub height: Quantity,
    /// Vessel that takes what this one spills, and the share of it.
    pub spills_to: Option<(usize, Quantity)>,
}

/// A valve or a leak.
#[derive(Debug, Clone)]
pub(super) struct Stream {
    pub from: usize,
    /// Vessel whose level works against that of `from`; absent for a free fall.
    pub against: Option<usize>,
    pub to: Option<usize>,
    pub law: ValveLaw,
    pub k: Quantity,
}

#[derive(Debug, Clone)]
pub(super) struct PumpCurve {
    pub scale: Quantity,
    pub offset: Quantity,
    pub points: Vec<(f64, Quantity)>,
}

/// What a pump brings some vessels, or takes out of one.
#[derive(Debug, Clone)]
pub(super) struct Feed {
    pub pump: usize,
    pub delay: Quantity,
    /// Place among the unknowns of the flow that was in the air before the first row.
    pub in_air: Option<usize>,
    pub outlets: Vec<(usize, f64)>,
}

/// A measured vessel.
#[derive(Debug, Clone)]
pub(super) struct Gauge {
    pub vessel: usize,
    pub gain: Quantity,
    pub offset: Quantity,
}

/// What is integrated. The unknowns are the free parameters in their order, then the initial level of every vessel, then
/// the flow in the air of every pump with a delay.
#[derive(Debug, Clone)]
pub(super) struct Structure {
    pub vessels: Vec<Vessel>,
    pub streams: Vec<Stream>,
    pub pumps: Vec<PumpCurve>,
    pub feeds: Vec<Feed>,
    pub gauges: Vec<Gauge>,
    /// How many parameters are free.
    pub parameters: usize,
    pub delta2: f64,
}

/// Gives quantities their place among the unknowns.
struct Slots<'a> {
    spec: &'a RigSpec,
    configuration: usize,
    free: &'a [Target],
}

impl Slots<'_> {
    fn of(&self, target: Target) -> Quantity {
        self.times(target, 1.0)
    }

    fn times(&self, target: Target, factor: f64) -> Quantity {
        let slot = self.free.iter().position(|t| *t == target);
        Quantity { value: target.value(self.spec, self.configuration), factor, slot }
    }
}

impl Structure {
    /// Of a rig in one of its configurations; `outputs` are tanks, each with the sensor that shows it, if any.
    pub fn new(
        network: &Network,
        configuration: usize,
        free: &[Target],
        outputs: &[(usize, Option<usize>)],
    ) -> Self {
        let spec = &network.spec;
        let slots = Slots { spec, configuration, free };
        let needed = needed(network, configuration, free, outputs);
        let vessel = |tank: usize| needed.iter().position(|&t| t == tank);
        let vessels = needed.iter().map(|&tank| {
            let spills_to = network.tanks[tank].spills_to.and_then(vessel);
            Vessel {
                tank,
                area: slots.of(Target::Area(tank)),
                height: slots.of(Target::Height(tank)),
                spills_to: spills_to.map(|to| (to, slots.of(Target::SpillShare(tank)))),
            }
        });
        let one = Quantity { value: 1.0, factor: 1.0, slot: None };
        let none = Quantity { value: 0.0, factor: 1.0, slot: None };
        let gauge = |&(tank, sensor): &(usize, Option<usize>)| Gauge {
            vessel: vessel(tank).unwrap_or(0),
            gain: sensor.map_or(one, |s| slots.of(Target::SensorGain(s))),
            offset: sensor.map_or(none, |s| slots.of(Target::SensorOffset(s))),
        };
        Self {
            vessels: vessels.collect(),
            streams: streams(network, &slots, &vessel),
            pumps: (0..spec.pumps.len()).map(|pump| curve(&slots, pump)).collect(),
            feeds: feeds(network, &slots, &vessel, free.len() + needed.len()),
            gauges: outputs.iter().map(gauge).collect(),
            parameters: free.len(),
            delta2: network.delta_cm.max(LEAST_DELTA_CM).powi(2),
        }
    }

    /// Number of unknowns.
    pub fn unknowns(&self) -> usize {
        self.parameters + self.vessels.len() + self.feeds.iter().filter(|f| f.in_air.is_some()).count()
    }
}

fn streams(network: &Network, slots: &Slots, vessel: &impl Fn(usize) -> Option<usize>) -> Vec<Stream> {
    let mut streams = Vec::new();
    for (i, valve) in network.valves.iter().enumerate() {
        let Some(from) = vessel(valve.from) else { continue };
        let opening = crate::plant::Valve { k90: 1.0, ..valve.clone() };
        let k = slots
            .times(Target::ValveK90(i), opening.coefficient(angle_deg(slots.spec, slots.configuration, i)));
        if k.factor == 0.0 || (k.slot.is_none() && k.value == 0.0) {
            continue;
        }
        let to = valve.to.and_then(vessel);
        let between = valve.drive == ValveDrive::Between;
        streams.push(Stream { from, against: to.filter(|_| between), to, law: valve.law, k });
    }
    for tank in 0..network.tanks.len() {
        let k = slots.of(Target::Leak(tank));
        if let (Some(from), Some(_)) = (vessel(tank), k.slot) {
            streams.push(Stream { from, against: None, to: None, law: ValveLaw::SquareRoot, k });
        }
    }
    streams
}

fn curve(slots: &Slots, pump: usize) -> PumpCurve {
    let points = slots.spec.pumps[pump].curve.iter().enumerate();
    PumpCurve {
        scale: slots.of(Target::PumpScale(pump)),
        offset: slots.of(Target::PumpOffset(pump)),
        points: points.map(|(i, p)| (p[0], slots.of(Target::PumpPoint(pump, i)))).collect(),
    }
}

fn feeds(
    network: &Network,
    slots: &Slots,
    vessel: &impl Fn(usize) -> Option<usize>,
    mut next_slot: usize,
) -> Vec<Feed> {
    let mut feeds = Vec::new();
    for (pump, spec) in network.pumps.iter().enumerate() {
        let into = |&(tank, share): &(usize, f64)| Some((vessel(tank)?, share));
        let outlets: Vec<(usize, f64)> = spec.outlets.iter().filter_map(into).collect();
        if !outlets.is_empty() {
            let mut delay = slots.of(Target::PumpDelay(pump));
            delay.value = delay_s(slots.spec, slots.configuration, pump);
            let in_air = (delay.slot.is_some() || delay.value > 0.0).then_some(next_slot);
            next_slot += usize::from(in_air.is_some());
            feeds.push(Feed { pump, delay, in_air, outlets });
        }
        if let Some(source) = spec.from.and_then(vessel) {
            // What is drawn leaves at once, whatever the stream takes to arrive.
            let delay = Quantity { value: 0.0, factor: 1.0, slot: None };
            feeds.push(Feed { pump, delay, in_air: None, outlets: vec![(source, -1.0)] });
        }
    }
    feeds
}

/// Tanks that the outputs depend on, in the order of the file.
fn needed(
    network: &Network,
    configuration: usize,
    free: &[Target],
    outputs: &[(usize, Option<usize>)],
) -> Vec<usize> {
    let mut needed = vec![false; network.tanks.len()];
    outputs.iter().for_each(|&(tank, _)| needed[tank] = true);
    loop {
        let before = needed.clone();
        for (i, valve) in network.valves.iter().enumerate() {
            let shut = angle_deg(&network.spec, configuration, i) <= 0.0
                || (valve.k90 == 0.0 && !free.contains(&Target::ValveK90(i)));
            let Some(to) = valve.to.filter(|_| !shut) else { continue };
            needed[valve.from] |= needed[to];
            needed[to] |= needed[valve.from] && valve.drive == ValveDrive::Between;
        }
        for (i, tank) in network.tanks.iter().enumerate() {
            needed[i] |= tank.spills_to.is_some_and(|to| needed[to]);
        }
        if needed == before {
            break;
        }
    }
    (0..needed.len()).filter(|&i| needed[i]).collect()
}
