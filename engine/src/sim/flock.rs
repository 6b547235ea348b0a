//! Plants in the lanes of a vector: one integrator, a controller and a source of noise each.

use std::sync::Arc;

use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use super::active_loop::LoopTarget;
use super::closed_loop::ClosedLoop;
use super::ensemble::Watch;
use super::scenario_event::ScenarioEvent;
use crate::control::{ControlLoop, LoopInput, check_filter};
use crate::daq::{MISHAPS, convert};
use crate::plant::{
    Measurement, Motion, Network, Number, Pack, Pipe, Reading, ReadingStatus, Transmitter, widest,
};
use crate::session::RigCommand;

/// Plants of a flock.
pub(super) const PLANTS: usize = Lanes::PLANTS;
/// Longest arrays the lanes are made for; larger rigs run one by one.
const LONGEST: usize = 16;

type Lanes = Pack;

/// Whether these loops and commands can be followed in lanes.
pub(super) fn can_flock(closed: &ClosedLoop, events: &[ScenarioEvent]) -> bool {
    let simple = |command: &RigCommand| {
        matches!(
            command,
            RigCommand::Setpoint { .. } | RigCommand::Tuning { .. } | RigCommand::PvFilter { .. }
        )
    };
    let plain = closed
        .loops()
        .iter()
        .all(|l| matches!(l.target, LoopTarget::Pump(_)) && l.control.options().feedforward.is_none());
    plain
        && !closed.loops().is_empty()
        && widest(closed.network()) <= LONGEST
        && closed.network().valves.len() <= LONGEST
        && closed.source().faults().is_empty()
        && events.iter().all(|e| simple(&e.command))
}

/// Runs as many plants as [`PLANTS`] from the state of `start`; `None` when a tank came to its rim or ran empty, or a
/// command was refused.
pub(super) fn run_flock(
    start: &ClosedLoop,
    rigs: &[(Arc<Network>, u64)],
    measurement: Measurement,
    events: &[ScenarioEvent],
    samples: u64,
) -> Option<Vec<Watch>> {
    let network = start.network();
    match (widest(network), network.valves.len()) {
        (0..=8, 0..=1) => Flock::<8, 1>::new(start, rigs, measurement).run(events, samples),
        (0..=8, 2) => Flock::<8, 2>::new(start, rigs, measurement).run(events, samples),
        (0..=8, 3) => Flock::<8, 3>::new(start, rigs, measurement).run(events, samples),
        (0..=8, 4) => Flock::<8, 4>::new(start, rigs, measurement).run(events, samples),
        _ => Flock::<LONGEST, LONGEST>::new(start, rigs, measurement).run(events, samples),
    }
}

struct Member {
    network: Arc<Network>,
    transmitters: Vec<Transmitter>,
    loops: Vec<ControlLoop>,
    readings: Vec<Reading>,
    written: Vec<f64>,
    pieces: Vec<usize>,
    rng: Xoshiro256PlusPlus,
    mishaps: Xoshiro256PlusPlus,
    watch: Watch,
}

/// Plants that share a step.
struct Flock<const N: usize, const S: usize> {
    motion: Motion<N, S, Lanes>,
    members: Vec<Member>,
    /// Sensor and pump of each loop.
    wiring: Vec<(usize, usize)>,
    tags: Vec<String>,
    tank: usize,
    measurement: Measurement,
    dac_step: Option<f64>,
    sample_time_s: f64,
}

impl<const N: usize, const S: usize> Flock<N, S> {
    /// Plants of these rigs and seeds, in the state of `start`.
    fn new(start: &ClosedLoop, rigs: &[(Arc<Network>, u64)], measurement: Measurement) -> Self {
        let network = start.network();
        let angles = start.source().plant().map_or(&[][..], |p| p.angles_deg());
        let levels = start.source().plant().map_or(&[][..], |p| p.levels_cm());
        let inputs = start.source().plant().map_or(&[][..], |p| p.inputs());
        let delays: Vec<f64> = start.source().plant().map(|p| p.delays_s().collect()).unwrap_or_default();
        let lanes = |number: &dyn Fn(&Network) -> f64| Lanes::each_of(|i| number(&rigs[i].0));
        let areas: Vec<Lanes> = (0..network.tanks.len()).map(|t| lanes(&|n| n.tanks[t].area_cm2)).collect();
        let coefficients: Vec<Lanes> =
            (0..network.valves.len()).map(|v| lanes(&|n| n.valves[v].coefficient(angles[v]))).collect();
        let flows: Vec<Lanes> =
            (0..network.pumps.len()).map(|p| lanes(&|n| n.pumps[p].flow_cm3_s(inputs[p]))).collect();
        let pipes = flows.iter().zip(&delays).map(|(&q, &delay_s)| Pipe::filled(delay_s, q)).collect();
        let mut motion = Motion::new(network, &areas, &coefficients, pipes);
        motion.commanded[..flows.len()].copy_from_slice(&flows);
        for (end, &level) in motion.end.iter_mut().zip(levels) {
            *end = Lanes::of(level);
        }
        motion.counts = false;
        motion.restart();
        let spec = &network.spec;
        let loops = start.loops();
        Self {
            motion,
            members: rigs.iter().map(|(n, seed)| Member::new(start, n, *seed, inputs)).collect(),
            tags: loops.iter().map(|l| l.spec.id.clone()).collect(),
            wiring: loops.iter().map(|l| (l.sensor, l.pump)).collect(),
            tank: loops.first().map_or(0, |l| network.sensors[l.sensor].tank),
            dac_step: spec.converters.as_ref().filter(|_| measurement.quantisation).map(|c| c.dac_step_v()),
            measurement,
            sample_time_s: spec.sample_time_s,
        }
    }

    /// Runs all samples; `None` when a tank came to its rim or ran empty, or a command was refused.
    fn run(mut self, events: &[ScenarioEvent], samples: u64) -> Option<Vec<Watch>> {
        for member in &mut self.members {
            member.watch = Watch::new(samples, self.sample_time_s);
        }
        let tags = std::mem::take(&mut self.tags);
        let mut pending = events.iter().peekable();
        for sample in 0..samples {
            let now_s = sample as f64 * self.sample_time_s;
            while let Some(event) = pending.next_if(|e| e.at_s <= now_s + 1e-9) {
                self.apply(&tags, &event.command)?;
            }
            self.control(sample);
            if self.motion.advance(self.sample_time_s).0 > 0.0 {
                return None;
            }
        }
        Some(self.members.into_iter().map(|m| m.watch).collect())
    }

    /// Measures, controls and writes, plant by plant.
    fn control(&mut self, sample: u64) {
        let levels = self.motion.presents();
        for (plant, member) in self.members.iter_mut().enumerate() {
            for (i, transmitter) in member.transmitters.iter_mut().enumerate() {
                let level_cm = levels[member.network.sensors[i].tank].of_plant(plant);
                let (rng, mishaps) = (&mut member.rng, &mut member.mishaps);
                member.readings[i] = transmitter.measure(level_cm, self.measurement, true, rng, mishaps);
            }
            for (control, &(sensor, pump)) in member.loops.iter_mut().zip(&self.wiring) {
                let pv_cm = member.readings[sensor].level_cm;
                let input = LoopInput { pv_cm, disturbance: f64::NAN, actual: control.mode, blocked: None };
                let mv = control.update(&input).mv;
                let of = &member.network.pumps[pump];
                let last = member.written[pump];
                let (written, converted) = convert(of, self.sample_time_s, self.dac_step, last, mv);
                if written != mv {
                    control.applied(written);
                }
                member.written[pump] = written;
                let flow = of.flow_near(converted.clamp(of.min, of.max), &mut member.pieces[pump]);
                *self.motion.commanded[pump].plant_mut(plant) = flow;
            }
            if let (Some(first), Some(&(sensor, _))) = (member.loops.first(), self.wiring.first()) {
                let pv_cm = member.readings[sensor].level_cm;
                let level_cm = levels[self.tank].of_plant(plant);
                member.watch.see(sample, first.setpoint_cm, pv_cm, first.mv(), level_cm);
            }
        }
    }

    fn apply(&mut self, tags: &[String], command: &RigCommand) -> Option<()> {
        let (RigCommand::Setpoint { tag, .. }
        | RigCommand::Tuning { tag, .. }
        | RigCommand::PvFilter { tag, .. }) = command
        else {
            return None;
        };
        let slot = tags.iter().position(|t| t == tag)?;
        let sensor = self.wiring[slot].0;
        for member in &mut self.members {
            let rim_cm = member.network.tanks[member.network.sensors[sensor].tank].height_cm;
            let control = &mut member.loops[slot];
            match command {
                RigCommand::Setpoint { level_cm, .. } if (0.0..=rim_cm).contains(level_cm) => {
                    control.setpoint_cm = *level_cm;
                }
                RigCommand::Tuning { tuning, .. } if tuning.validated(control.law()).is_ok() => {
                    control.set_tuning(*tuning);
                }
                RigCommand::PvFilter { time_constant_s, .. } => {
                    control.set_pv_filter(check_filter(*time_constant_s).ok()?);
                }
                _ => return None,
            }
        }
        Some(())
    }
}

impl Member {
    fn new(start: &ClosedLoop, network: &Arc<Network>, seed: u64, inputs: &[f64]) -> Self {
        let (spec, good) = (&network.spec, Reading { level_cm: f64::NAN, status: ReadingStatus::Good });
        let transmitter = |s: &crate::plant::Sensor| {
            Transmitter::new(&s.spec, spec.converters.as_ref(), spec.sample_time_s)
        };
        Self {
            transmitters: network.sensors.iter().map(transmitter).collect(),
            loops: start.loops().iter().map(|l| l.control.clone()).collect(),
            readings: vec![good; network.sensors.len()],
            written: inputs.to_vec(),
            pieces: vec![0; inputs.len()],
            rng: Xoshiro256PlusPlus::seed_from_u64(seed),
            mishaps: Xoshiro256PlusPlus::seed_from_u64(seed ^ MISHAPS),
            watch: Watch::new(1, spec.sample_time_s),
            network: network.clone(),
        }
    }
}
