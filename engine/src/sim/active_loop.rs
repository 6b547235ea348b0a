//! A loop with its place in the rig, and the loops of a configuration among each other.

use crate::control::{
    Bound, ControlLoop, LoopInput, LoopSpec, Mode, OutputRange, final_pump, outer_of, output_range,
};
use crate::plant::{Network, Reading};

/// What takes a loop's output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LoopTarget {
    /// A pump, by its index in the network.
    Pump(usize),
    /// The setpoint of a loop, by its index in the configuration.
    Loop(usize),
}

/// Where a feed-forward takes its disturbance from; indices into the network.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Disturbance {
    Sensor(usize),
    Pump(usize),
}

/// What a test has a loop do, over its mode and its law, which stay as they are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Forced {
    /// Give this output, in MV units.
    Output(f64),
    /// Control to this setpoint in cm.
    Setpoint(f64),
}

/// A loop of the present configuration with its place in the rig.
#[derive(Debug, Clone)]
pub struct ActiveLoop {
    /// Its description, kept up to date with what the operator set.
    pub spec: LoopSpec,
    /// Sensor that gives the PV.
    pub sensor: usize,
    /// Pump that the MV moves, through inner loops where there are some.
    pub pump: usize,
    /// What takes the MV.
    pub target: LoopTarget,
    /// Loop that writes the setpoint in cascade.
    pub outer: Option<usize>,
    /// Range of what takes the MV.
    pub range: OutputRange,
    /// Controller, setpoint and mode.
    pub control: ControlLoop,
    /// The last output was held because the input was not a number.
    pub held: bool,
    /// Output that it was put to since the last sample, by hand or at the end of a test.
    pub(super) put: Option<f64>,
    /// What a test has it do.
    pub(super) forced: Option<Forced>,
    disturbance: Option<Disturbance>,
}

impl ActiveLoop {
    /// The loop `index` of a configuration; `mv` gives the output that a pump or an inner loop has now.
    pub(super) fn new(
        network: &Network,
        specs: &[LoopSpec],
        index: usize,
        sample_time_s: f64,
        input: impl Fn(usize) -> f64,
    ) -> Option<Self> {
        let spec = specs[index].clone();
        let (target, mv) = match &spec.cascade_to {
            Some(inner) => {
                let inner = specs.iter().position(|l| l.id == *inner)?;
                (LoopTarget::Loop(inner), specs[inner].setpoint_cm)
            }
            None => {
                let pump = network.pump(spec.pump.as_deref()?)?;
                (LoopTarget::Pump(pump), input(pump))
            }
        };
        let range = output_range(network, specs, &spec)?;
        let mut active = Self {
            sensor: network.sensor(&spec.sensor)?,
            pump: final_pump(network, specs, &spec)?,
            outer: outer_of(specs, &spec.id),
            control: ControlLoop::new(&spec, sample_time_s, range, mv),
            held: false,
            put: None,
            forced: None,
            disturbance: None,
            target,
            range,
            spec,
        };
        active.find_disturbance(network);
        Some(active)
    }

    /// Puts the output to a value from which the next sample goes on.
    pub(super) fn put_to(&mut self, mv: f64) {
        self.control.set_mv(mv);
        self.put = Some(self.control.mv());
    }

    /// Looks up where the feed-forward takes its disturbance from, after a change of the options.
    pub(super) fn find_disturbance(&mut self, network: &Network) {
        self.disturbance = self.spec.options.feedforward.as_ref().and_then(|path| {
            let sensor = network.sensor(&path.from).map(Disturbance::Sensor);
            sensor.or_else(|| network.pump(&path.from).map(Disturbance::Pump))
        });
    }

    /// Starts anew at rest at the output `mv`.
    pub(super) fn rest(&mut self, sample_time_s: f64, mv: f64) {
        self.control = ControlLoop::new(&self.spec, sample_time_s, self.range, mv).taking_over();
    }

    /// Whether it takes its setpoint from its outer loop.
    #[must_use]
    pub fn listens(&self) -> bool {
        self.control.mode == Mode::Cascade && self.forced.is_none()
    }

    fn disturbance(&self, readings: &[Reading], inputs: &[f64]) -> f64 {
        match self.disturbance {
            Some(Disturbance::Sensor(sensor)) => readings[sensor].level_cm,
            Some(Disturbance::Pump(pump)) => inputs[pump],
            None => f64::NAN,
        }
    }
}

/// Lets the loop `index` take a sample. An outer loop whose inner loop is not in cascade follows its setpoint;
/// an inner loop in cascade takes the outer's output, unless a test has it do something else. `inputs` are the pumps'
/// inputs as last written.
pub(super) fn sample(loops: &mut [ActiveLoop], index: usize, readings: &[Reading], inputs: &[f64]) {
    let put = loops[index].put.take();
    let mut follows = None;
    let mut blocked: Option<Bound> = None;
    match loops[index].target {
        LoopTarget::Loop(inner) if !loops[inner].listens() => {
            follows = Some(loops[inner].control.setpoint_cm);
        }
        LoopTarget::Loop(inner) => blocked = blocked_by(loops, inner),
        LoopTarget::Pump(pump) => {
            if loops[index].control.sends_increments() {
                follows = Some(put.unwrap_or(inputs[pump]));
            }
        }
    }
    let remote = loops[index].outer.map(|outer| loops[outer].control.mv());
    let active = &mut loops[index];
    let mut actual = active.control.mode;
    if let Some(mv) = follows {
        active.control.set_mv(mv);
        if matches!(active.target, LoopTarget::Loop(_)) {
            actual = Mode::Manual;
        }
    }
    match active.forced {
        Some(Forced::Output(mv)) => {
            active.control.set_mv(mv);
            actual = Mode::Manual;
        }
        Some(Forced::Setpoint(setpoint_cm)) => {
            active.control.setpoint_cm = setpoint_cm;
            actual = Mode::Automatic;
        }
        None => {}
    }
    if let (Mode::Cascade, Some(setpoint_cm)) = (actual, remote) {
        active.control.setpoint_cm = setpoint_cm;
    }
    let input = LoopInput {
        pv_cm: readings[active.sensor].level_cm,
        disturbance: active.disturbance(readings, inputs),
        actual,
        blocked,
    };
    active.held = active.control.update(&input).held;
}

/// The side to which the setpoint of the loop `inner` must not go further, as of the last sample.
fn blocked_by(loops: &[ActiveLoop], inner: usize) -> Option<Bound> {
    let deeper = match loops[inner].target {
        LoopTarget::Loop(next) if loops[next].listens() => blocked_by(loops, next),
        _ => None,
    };
    loops[inner].control.blocks_outer(deeper)
}
