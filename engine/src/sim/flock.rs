//! Plants in the lanes of a vector: one integrator and one loop for all, with a source of noise each.

use std::sync::Arc;

use super::active_loop::{ActiveLoop, LoopTarget};
use super::closed_loop::ClosedLoop;
use super::flock_loop::FlockLoop;
use super::scenario_event::ScenarioEvent;
use super::watch::{Seen, Watch};
use crate::plant::{Measurement, Motion, Network, Number, Pack, Pipe, widest};
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
) -> Option<Vec<Seen>> {
    run_flock_in(pulp::Arch::new(), start, rigs, measurement, events, samples)
}

/// As [`run_flock`], in the vector registers of `arch`.
fn run_flock_in(
    arch: pulp::Arch,
    start: &ClosedLoop,
    rigs: &[(Arc<Network>, u64)],
    measurement: Measurement,
    events: &[ScenarioEvent],
    samples: u64,
) -> Option<Vec<Seen>> {
    let network = start.network();
    match (widest(network), network.valves.len()) {
        (0..=8, 0..=1) => Flock::<8, 1>::new(start, rigs, measurement).run(arch, events, samples),
        (0..=8, 2) => Flock::<8, 2>::new(start, rigs, measurement).run(arch, events, samples),
        (0..=8, 3) => Flock::<8, 3>::new(start, rigs, measurement).run(arch, events, samples),
        (0..=8, 4) => Flock::<8, 4>::new(start, rigs, measurement).run(arch, events, samples),
        _ => Flock::<LONGEST, LONGEST>::new(start, rigs, measurement).run(arch, events, samples),
    }
}

/// Plants that share a step.
struct Flock<'a, const N: usize, const S: usize> {
    rigs: &'a [(Arc<Network>, u64)],
    motion: Motion<N, S, Lanes>,
    loops: Vec<FlockLoop>,
    measurement: Measurement,
    sample_time_s: f64,
}

/// A run in the widest vector registers there are; the results are the same in all of them.
struct AllSamples<'a, const N: usize, const S: usize> {
    flock: Flock<'a, N, S>,
    events: &'a [ScenarioEvent],
    samples: u64,
}

impl<const N: usize, const S: usize> pulp::NullaryFnOnce for AllSamples<'_, N, S> {
    type Output = Option<Vec<Seen>>;

    #[inline(always)]
    fn call(self) -> Self::Output {
        self.flock.all_samples(self.events, self.samples)
    }
}

impl<'a, const N: usize, const S: usize> Flock<'a, N, S> {
    /// Plants of these rigs and seeds, in the state of `start`.
    fn new(start: &ClosedLoop, rigs: &'a [(Arc<Network>, u64)], measurement: Measurement) -> Self {
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
        let of_loop = |l: &ActiveLoop| FlockLoop::new(l, rigs, inputs[l.pump], measurement);
        Self {
            rigs,
            motion,
            loops: start.loops().iter().map(of_loop).collect(),
            measurement,
            sample_time_s: network.spec.sample_time_s,
        }
    }

    /// Runs all samples; `None` when a tank came to its rim or ran empty, or a command was refused.
    fn run(self, arch: pulp::Arch, events: &'a [ScenarioEvent], samples: u64) -> Option<Vec<Seen>> {
        arch.dispatch(AllSamples { flock: self, events, samples })
    }

    #[inline(always)]
    fn all_samples(mut self, events: &[ScenarioEvent], samples: u64) -> Option<Vec<Seen>> {
        let mut watch = Watch::new(samples, self.sample_time_s);
        let mut pending = events.iter().peekable();
        for sample in 0..samples {
            let now_s = sample as f64 * self.sample_time_s;
            while let Some(event) = pending.next_if(|e| e.at_s <= now_s + 1e-9) {
                self.apply(&event.command)?;
            }
            for of_loop in &mut self.loops {
                let level_cm = self.motion.now[of_loop.tank];
                let flow = of_loop.sample(self.rigs, level_cm, self.measurement);
                self.motion.commanded[of_loop.pump] = flow;
            }
            if let Some(first) = self.loops.first() {
                watch.see(sample, first.setpoint_cm(), first.pv_cm, first.mv, self.motion.now[first.tank]);
            }
            if self.motion.advance(self.sample_time_s).0 > 0.0 {
                return None;
            }
        }
        Some((0..PLANTS).map(|plant| watch.of_plant(plant)).collect())
    }

    fn apply(&mut self, command: &RigCommand) -> Option<()> {
        let (RigCommand::Setpoint { tag, .. }
        | RigCommand::Tuning { tag, .. }
        | RigCommand::PvFilter { tag, .. }) = command
        else {
            return None;
        };
        let of_loop = self.loops.iter_mut().find(|l| l.tag == *tag)?;
        let rim_cm = self.rigs[0].0.tanks[of_loop.tank].height_cm;
        of_loop.apply(command, rim_cm)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::{PidGains, PidTuning};
    use crate::plant::RigSpec;

    const STAD: &str = include_str!("../../../assets/rigs/stad.toml");

    /// Ten minutes of a pump that noise throws about, so that the levels of TQ1 and TQ2 cross and steps are cut.
    fn lively() -> (Arc<Network>, ClosedLoop) {
        let spec = toml::from_str::<RigSpec>(STAD).expect("a rig");
        let network = Arc::new(Network::new(spec).expect("a rig"));
        let mut closed = ClosedLoop::simulated(network.clone(), 0, Measurement::DEFAULT, 1).expect("starts");
        let tuning = PidTuning::new(PidGains::pid(7.0, 15.0, 1.0));
        closed.apply(&RigCommand::Tuning { tag: "LIC-02".to_owned(), tuning }).expect("a tuning");
        (network, closed)
    }

    #[test]
    fn lanes_give_the_same_bytes_in_the_widest_registers_and_in_the_narrowest() {
        let (network, closed) = lively();
        let rigs: Vec<_> = (0..PLANTS as u64).map(|seed| (network.clone(), seed)).collect();
        let run = |arch| run_flock_in(arch, &closed, &rigs, Measurement::DEFAULT, &[], 3000).expect("runs");
        // Written out, numbers differ where their bytes do.
        let [wide, narrow] = [pulp::Arch::new(), pulp::Arch::Scalar].map(|arch| format!("{:?}", run(arch)));
        assert_eq!(wide, narrow);
    }

    #[test]
    fn one_plant_gives_the_same_bytes_in_the_widest_registers_and_in_the_narrowest() {
        let (_, closed) = lively();
        let mut wide = closed.source().plant().expect("a plant").clone();
        let mut narrow = wide.clone().in_registers_of(pulp::Arch::Scalar);
        for sample in 0..3000_u32 {
            let input = 2.2 + 0.9 * (f64::from(sample) * 0.9).sin();
            for plant in [&mut wide, &mut narrow] {
                plant.set_input(0, input).expect("a number");
                plant.advance(0.2);
            }
            let bits = |plant: &crate::plant::Plant| {
                plant.levels_cm().iter().map(|l| l.to_bits()).collect::<Vec<_>>()
            };
            assert_eq!(bits(&wide), bits(&narrow), "sample {sample}");
        }
    }
}
