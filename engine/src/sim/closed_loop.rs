//! The rig with its loops, one sample at a time. Sessions, scenarios and benchmarks all step this.

use std::sync::Arc;

use super::active_loop::{ActiveLoop, LoopTarget, sample};
use super::excite::Excited;
use crate::control::{LoopSpec, Mode, check_filter, check_loop, execution_order, outer_of};
use crate::daq::{RigControls, SimulatedRig, Source};
use crate::excitation::StopReason;
use crate::plant::{
    ActiveFault, FaultKind, Measurement, Network, Reading, ReadingStatus, RigError, RigSpec, SteadyState,
    SteadyTarget, copy_few, steady_at_level, steady_at_levels,
};
use crate::session::{CommandError, RigCommand};
use crate::signal::ChannelSet;

/// A source under control.
pub struct ClosedLoop {
    source: Box<dyn Source>,
    pub(super) network: Arc<Network>,
    channels: Arc<ChannelSet>,
    configuration: usize,
    settings: Vec<Vec<LoopSpec>>,
    pub(super) loops: Vec<ActiveLoop>,
    /// Indices of the loops, outer ones first.
    order: Vec<usize>,
    /// Inputs of the pumps as last written.
    inputs: Vec<f64>,
    pub(super) readings: Vec<Reading>,
    row: Vec<f64>,
    sample_time_s: f64,
    pub(super) samples: u64,
    pub(super) excited: Option<Excited>,
    pub(super) ended: Vec<Excited>,
}

impl ClosedLoop {
    /// A simulated rig in a configuration of its file, at rest if the file asks for it.
    ///
    /// # Errors
    /// [`CommandError`] when the start is not possible.
    pub fn simulated(
        network: Arc<Network>,
        configuration: usize,
        measurement: Measurement,
        seed: u64,
    ) -> Result<Self, CommandError> {
        let mut rig = SimulatedRig::new(network.clone(), measurement, seed)?;
        rig.configure(configuration)?;
        let steady = network.spec.configurations.get(configuration).is_some_and(|c| c.start_steady);
        let mut closed = Self::new(Box::new(rig), configuration);
        if steady {
            closed.settle_all()?;
        }
        Ok(closed)
    }

    /// Another rig of the same structure in the same state: configuration, levels and inputs.
    ///
    /// # Errors
    /// [`CommandError`] when the state does not fit that rig.
    pub(super) fn resembling(
        other: &Self,
        network: Arc<Network>,
        measurement: Measurement,
        seed: u64,
    ) -> Result<Self, CommandError> {
        let mut rig = SimulatedRig::new(network, measurement, seed)?;
        rig.configure(other.configuration)?;
        let mut closed = Self::new(Box::new(rig), other.configuration);
        if let Some(plant) = other.source.plant() {
            closed.restart_at(plant.levels_cm(), plant.inputs())?;
        }
        Ok(closed)
    }

    /// A source in a configuration of its network.
    #[must_use]
    pub fn new(source: Box<dyn Source>, configuration: usize) -> Self {
        let network = source.network().clone();
        let channels = Arc::new(ChannelSet::of(&network));
        let width = channels.len();
        let good = Reading { level_cm: f64::NAN, status: ReadingStatus::Good };
        let mut closed = Self {
            settings: network.spec.configurations.iter().map(|c| c.loops.clone()).collect(),
            readings: vec![good; network.sensors.len()],
            row: vec![f64::NAN; width],
            sample_time_s: network.spec.sample_time_s,
            loops: Vec::new(),
            order: Vec::new(),
            inputs: network.pumps.iter().map(|p| p.min).collect(),
            samples: 0,
            excited: None,
            ended: Vec::new(),
            configuration,
            source,
            network,
            channels,
        };
        closed.make_loops(None);
        closed
    }

    /// Structure of the rig.
    #[must_use]
    pub fn network(&self) -> &Arc<Network> {
        &self.network
    }

    /// The source.
    #[must_use]
    pub fn source(&self) -> &dyn Source {
        &*self.source
    }

    /// Capabilities of a rig, where the source is one.
    pub fn rig(&mut self) -> Option<&mut dyn RigControls> {
        self.source.rig()
    }

    /// Imperfections that are on, where the source is a rig.
    #[must_use]
    pub fn measurement(&self) -> Option<Measurement> {
        self.source.measurement()
    }

    /// Columns of a row.
    #[must_use]
    pub fn channels(&self) -> &Arc<ChannelSet> {
        &self.channels
    }

    /// Index of the present configuration.
    #[must_use]
    pub fn configuration(&self) -> usize {
        self.configuration
    }

    /// Loops of the present configuration.
    #[must_use]
    pub fn loops(&self) -> &[ActiveLoop] {
        &self.loops
    }

    /// The rig's file with everything as it is set now: loops of every configuration, angles, levels.
    #[must_use]
    pub fn as_set(&self) -> RigSpec {
        let mut spec = self.network.spec.clone();
        for (configuration, loops) in spec.configurations.iter_mut().zip(&self.settings) {
            configuration.loops.clone_from(loops);
        }
        if let Some(present) = spec.configurations.get_mut(self.configuration) {
            present.loops = self.loops.iter().map(|l| l.spec.clone()).collect();
        }
        if let Some(plant) = self.source.plant() {
            let present = spec.configurations.get_mut(self.configuration);
            for (valve, &angle_deg) in spec.valves.iter_mut().zip(plant.angles_deg()) {
                valve.angle_deg = angle_deg;
            }
            if let Some(present) = present {
                // What a configuration says goes before what the parts themselves do.
                present.start_steady = false;
                for (id, angle_deg) in &mut present.angles_deg {
                    if let Some(valve) = self.network.valve(id) {
                        *angle_deg = plant.angles_deg()[valve];
                    }
                }
            }
            for (pump, &input) in spec.pumps.iter_mut().zip(plant.inputs()) {
                pump.initial = input;
            }
            for (tank, &level_cm) in spec.tanks.iter_mut().zip(plant.levels_cm()) {
                tank.initial_cm = level_cm;
            }
        }
        spec
    }

    /// Last readings of the sensors.
    #[must_use]
    pub fn readings(&self) -> &[Reading] {
        &self.readings
    }

    /// Time of the next sample in seconds.
    #[must_use]
    pub fn time_s(&self) -> f64 {
        self.samples as f64 * self.sample_time_s
    }

    /// Sample time in seconds.
    #[must_use]
    pub fn sample_time_s(&self) -> f64 {
        self.sample_time_s
    }

    /// Takes one sample: reads, controls, writes, and lets the sample time pass. Gives the row of values
    /// at the sample's time; flows are the means of the sample before it.
    pub fn step(&mut self) -> &[f64] {
        self.source.read(&mut self.readings);
        self.excite_sample();
        for &index in &self.order {
            sample(&mut self.loops, index, &self.readings, &self.inputs);
            let active = &mut self.loops[index];
            if let LoopTarget::Pump(pump) = active.target {
                let mv = active.control.mv();
                if let Ok(written) = self.source.write(pump, mv) {
                    self.inputs[pump] = written;
                    if written != mv {
                        active.control.applied(written);
                    }
                }
            }
        }
        self.record_excitation();
        self.fill_row();
        self.source.advance(self.sample_time_s);
        self.samples += 1;
        &self.row
    }

    /// Fills the row in the order of [`ChannelSet::of`].
    fn fill_row(&mut self) {
        let (loop_cells, plant_cells) = self.row.split_at_mut(3 * self.channels.slots);
        let mut loop_cells = loop_cells.chunks_exact_mut(3);
        for (cells, active) in (&mut loop_cells).zip(&self.loops) {
            let pv_cm = self.readings[active.sensor].level_cm;
            cells.copy_from_slice(&[active.control.setpoint_cm, pv_cm, active.control.mv()]);
        }
        loop_cells.for_each(|cells| cells.fill(f64::NAN));
        let Some(plant) = self.source.plant() else {
            plant_cells.fill(f64::NAN);
            return;
        };
        let (tanks, pumps) = (plant.levels_cm().len(), plant.inputs().len());
        let (levels, rest) = plant_cells.split_at_mut(tanks);
        let (of_pumps, rest) = rest.split_at_mut(2 * pumps);
        let (of_valves, spills) = rest.split_at_mut(2 * plant.angles_deg().len());
        copy_few(levels, plant.levels_cm());
        pair_up(of_pumps, plant.inputs(), plant.arriving_flows_cm3_s());
        pair_up(of_valves, plant.valve_flows_cm3_s(), plant.angles_deg());
        copy_few(spills, plant.spill_flows_cm3_s());
    }

    /// Makes the loops of the present configuration at the present outputs. `modes` are those of a configuration
    /// before, slot by slot: they go before those of the settings, and the loops take over without a jump.
    fn make_loops(&mut self, modes: Option<&[Mode]>) {
        if let Some(plant) = self.source.plant() {
            self.inputs.copy_from_slice(plant.inputs());
        }
        let mut specs = self.settings.get(self.configuration).cloned().unwrap_or_default();
        for slot in 0..specs.len() {
            if let Some(&mode) = modes.and_then(|m| m.get(slot)) {
                specs[slot].mode = mode_in(&specs, slot, mode);
            }
        }
        let (h, inputs) = (self.sample_time_s, &self.inputs);
        let made =
            (0..specs.len()).map(|i| ActiveLoop::new(&self.network, &specs, i, h, |pump| inputs[pump]));
        // A checked network has all its loops; without one of them, the indices of the others mean nothing.
        self.loops = made.collect::<Option<_>>().unwrap_or_default();
        if modes.is_some() {
            for active in &mut self.loops {
                active.control = active.control.clone().taking_over();
            }
        }
        self.order = execution_order(&specs);
        self.order.truncate(self.loops.len());
    }

    pub(super) fn find(&mut self, tag: &str) -> Result<&mut ActiveLoop, CommandError> {
        let unknown = || CommandError::UnknownTag { tag: tag.to_owned() };
        self.loops.iter_mut().find(|l| l.spec.id == tag).ok_or_else(unknown)
    }

    /// Carries out a command between two samples.
    ///
    /// # Errors
    /// [`CommandError`]; nothing has changed then.
    pub fn apply(&mut self, command: &RigCommand) -> Result<(), CommandError> {
        match self.overrules(command) {
            Some(reason) => self.apply_overruling(command, reason),
            None => self.carry_out(command),
        }
    }

    pub(super) fn carry_out(&mut self, command: &RigCommand) -> Result<(), CommandError> {
        let unknown = |tag: &str| CommandError::UnknownTag { tag: tag.to_owned() };
        match command {
            RigCommand::Setpoint { tag, level_cm } => self.set_setpoint(tag, *level_cm)?,
            RigCommand::Mode { tag, mode } => self.set_mode(tag, *mode)?,
            RigCommand::Mv { tag, value } => self.set_mv(tag, *value)?,
            RigCommand::Tuning { tag, tuning } => {
                tuning.validated(&self.find(tag)?.spec.law)?;
                let active = self.change(tag, |spec| spec.set_tuning(*tuning))?;
                active.control.set_tuning(*tuning);
            }
            RigCommand::Law { tag, law } => {
                let active = self.change(tag, |spec| spec.law = *law)?;
                active.control.set_law(*law);
            }
            RigCommand::Options { tag, options } => {
                let network = self.network.clone();
                let active = self.change(tag, |spec| spec.options.clone_from(options))?;
                active.control.set_options((**options).clone());
                active.find_disturbance(&network);
            }
            RigCommand::PvFilter { tag, time_constant_s } => {
                let filter_s = check_filter(*time_constant_s)?;
                let active = self.find(tag)?;
                active.control.set_pv_filter(filter_s);
                active.spec.pv_filter_s = filter_s;
            }
            RigCommand::Valve { tag, angle_deg } => {
                let valve = self.network.valve(tag).ok_or_else(|| unknown(tag))?;
                self.source.rig().ok_or(CommandError::NotARig)?.set_angle(valve, *angle_deg)?;
            }
            RigCommand::Bump { tag, delta_cm } => {
                let tank = self.network.tank(tag).ok_or_else(|| unknown(tag))?;
                self.source.rig().ok_or(CommandError::NotARig)?.bump(tank, *delta_cm)?;
            }
            RigCommand::Configuration { id } => {
                let index = self.network.spec.configurations.iter().position(|c| c.id == *id);
                self.configure(index.ok_or_else(|| unknown(id))?)?;
            }
            RigCommand::SteadyAt { tag, level_cm } => self.settle_at(tag, *level_cm)?,
            RigCommand::Measurement { measurement } => {
                self.source.rig().ok_or(CommandError::NotARig)?.set_measurement(*measurement);
            }
            RigCommand::Fault { tag, fault } => {
                self.source.rig().ok_or(CommandError::NotARig)?.set_fault(tag, *fault)?;
            }
            RigCommand::Repair { tag, kind } => {
                self.source.rig().ok_or(CommandError::NotARig)?.repair(tag, *kind)?;
            }
            RigCommand::Excite { tag, excitation } => self.excite(tag, excitation)?,
            RigCommand::AbortExcitation { tag } => self.abort_excitation(tag)?,
            RigCommand::Seed { seed } => self.source.rig().ok_or(CommandError::NotARig)?.set_seed(*seed),
        }
        Ok(())
    }

    /// Changes the description of a loop when the rig allows it.
    fn change(
        &mut self,
        tag: &str,
        change: impl FnOnce(&mut LoopSpec),
    ) -> Result<&mut ActiveLoop, CommandError> {
        let mut changed = self.find(tag)?.spec.clone();
        change(&mut changed);
        let specs: Vec<LoopSpec> = self.loops.iter().map(|l| l.spec.clone()).collect();
        check_loop(&self.network, &specs, &changed)?;
        let active = self.find(tag)?;
        active.spec = changed;
        Ok(active)
    }

    fn set_mode(&mut self, tag: &str, mode: Mode) -> Result<(), CommandError> {
        let setpoint_cm = self.find(tag)?.control.setpoint_cm;
        let active = self.change(tag, |spec| (spec.mode, spec.setpoint_cm) = (mode, setpoint_cm))?;
        active.control.mode = mode;
        Ok(())
    }

    fn set_setpoint(&mut self, tag: &str, level_cm: f64) -> Result<(), CommandError> {
        let network = self.network.clone();
        let active = self.find(tag)?;
        if active.control.mode == Mode::Cascade {
            return Err(CommandError::Cascade { tag: tag.to_owned() });
        }
        let rim_cm = network.tanks[network.sensors[active.sensor].tank].height_cm;
        if !(0.0..=rim_cm).contains(&level_cm) {
            return Err(CommandError::Setpoint { tag: tag.to_owned(), level_cm, rim_cm });
        }
        active.control.setpoint_cm = level_cm;
        active.spec.setpoint_cm = level_cm;
        Ok(())
    }

    fn set_mv(&mut self, tag: &str, value: f64) -> Result<(), CommandError> {
        let finite = |item: &str| {
            let expected = "finite".to_owned();
            RigError::Value { item: item.to_owned(), field: "input", value, expected }
        };
        if !value.is_finite() {
            return Err(finite(tag).into());
        }
        let pump = self.network.pump(tag).map(LoopTarget::Pump);
        if let Some(index) = self.loops.iter().position(|l| l.spec.id == tag || Some(l.target) == pump) {
            let active = &self.loops[index];
            if active.control.mode.is_controlling() {
                return Err(CommandError::Automatic { tag: active.spec.id.clone() });
            }
            if let LoopTarget::Loop(inner) = active.target
                && self.loops[inner].control.mode != Mode::Cascade
            {
                let inner = self.loops[inner].spec.id.clone();
                return Err(CommandError::Follows { tag: tag.to_owned(), inner });
            }
            self.loops[index].put_to(value);
            return Ok(());
        }
        let Some(LoopTarget::Pump(pump)) = pump else {
            return Err(CommandError::UnknownTag { tag: tag.to_owned() });
        };
        self.inputs[pump] = self.source.write(pump, value)?;
        Ok(())
    }

    /// Turns to another configuration: valves and delays move, the loops of that configuration take over
    /// at the present output, each in the mode the operator had chosen for its slot.
    fn configure(&mut self, configuration: usize) -> Result<(), CommandError> {
        self.source.rig().ok_or(CommandError::NotARig)?.configure(configuration)?;
        if configuration == self.configuration {
            return Ok(());
        }
        let modes: Vec<Mode> = self.loops.iter().map(|l| l.control.mode).collect();
        if let Some(kept) = self.settings.get_mut(self.configuration) {
            *kept = self.loops.iter().map(|l| l.spec.clone()).collect();
        }
        self.configuration = configuration;
        self.make_loops(Some(&modes));
        Ok(())
    }

    fn settle_at(&mut self, tag: &str, level_cm: f64) -> Result<(), CommandError> {
        let keeps_from_rest = |f: &&ActiveFault| {
            matches!(
                f.fault.kind(),
                FaultKind::Leak | FaultKind::WeakPump | FaultKind::DryPump | FaultKind::PowerCut
            )
        };
        if let Some(found) = self.source.faults().iter().find(keeps_from_rest) {
            return Err(CommandError::Faulty { tag: found.tag.clone(), kind: found.fault.kind().key() });
        }
        let before = self.find(tag)?.control.setpoint_cm;
        self.set_setpoint(tag, level_cm)?;
        if let Err(error) = self.settle_loop(tag, level_cm) {
            self.set_setpoint(tag, before)?;
            return Err(error);
        }
        Ok(())
    }

    fn settle_loop(&mut self, tag: &str, level_cm: f64) -> Result<(), CommandError> {
        let active = self.find(tag)?;
        let (pump, sensor) = (active.pump, active.sensor);
        let state = self.steady(pump, sensor, level_cm)?;
        self.rest(&state)
    }

    fn steady(&self, pump: usize, sensor: usize, level_cm: f64) -> Result<SteadyState, CommandError> {
        let plant = self.source.plant().ok_or(CommandError::NotARig)?;
        let tank = self.network.sensors[sensor].tank;
        let (k, inputs, levels) = (plant.coefficients(), plant.inputs(), plant.levels_cm());
        Ok(steady_at_level(&self.network, k, inputs, levels, pump, tank, level_cm)?)
    }

    /// Puts levels in cm and inputs to a state, with the streams in the air in equilibrium and the
    /// controllers at rest there.
    ///
    /// # Errors
    /// [`CommandError`] when the source is no rig or the water does not fit.
    pub fn restart_at(&mut self, levels_cm: &[f64], inputs: &[f64]) -> Result<(), CommandError> {
        self.stop_excitation(StopReason::Restarted);
        self.rest(&SteadyState { levels_cm: levels_cm.to_vec(), inputs: inputs.to_vec() })
    }

    fn rest(&mut self, state: &SteadyState) -> Result<(), CommandError> {
        self.source.rig().ok_or(CommandError::NotARig)?.set_state(&state.levels_cm, &state.inputs)?;
        self.inputs.copy_from_slice(&state.inputs);
        for index in 0..self.loops.len() {
            let level_cm = |l: &ActiveLoop| state.levels_cm[self.network.sensors[l.sensor].tank];
            let mv = match self.loops[index].target {
                LoopTarget::Pump(pump) => state.inputs[pump],
                LoopTarget::Loop(inner) => level_cm(&self.loops[inner]),
            };
            let own_cm = level_cm(&self.loops[index]);
            let active = &mut self.loops[index];
            active.rest(self.sample_time_s, mv);
            if active.control.mode == Mode::Cascade {
                active.control.setpoint_cm = own_cm;
            }
        }
        Ok(())
    }

    /// Solves for the state in which every loop's PV is at its setpoint, and puts the plant there.
    fn settle_all(&mut self) -> Result<(), CommandError> {
        let plant = self.source.plant().ok_or(CommandError::NotARig)?;
        let deciding = (0..self.loops.len()).filter(|&i| self.decides(i)).map(|i| &self.loops[i]);
        let targets: Vec<SteadyTarget> = deciding
            .map(|l| SteadyTarget {
                pump: l.pump,
                tank: self.network.sensors[l.sensor].tank,
                level_cm: l.control.setpoint_cm,
            })
            .collect();
        if targets.is_empty() {
            return Ok(());
        }
        let (k, inputs, levels) = (plant.coefficients(), plant.inputs(), plant.levels_cm());
        let state = steady_at_levels(&self.network, k, inputs, levels, &targets)?;
        self.rest(&state)
    }

    /// Whether the setpoint of a loop decides where its pump comes to rest: it is its own, and every loop between
    /// it and the pump takes its setpoint from outside.
    fn decides(&self, index: usize) -> bool {
        let mut target = self.loops[index].target;
        while let LoopTarget::Loop(inner) = target {
            if self.loops[inner].control.mode != Mode::Cascade {
                return false;
            }
            target = self.loops[inner].target;
        }
        self.loops[index].control.mode != Mode::Cascade
    }
}

/// A mode as it is possible in a slot: cascade needs a loop that gives the setpoint.
fn mode_in(specs: &[LoopSpec], slot: usize, mode: Mode) -> Mode {
    if mode == Mode::Cascade && outer_of(specs, &specs[slot].id).is_none() { Mode::Automatic } else { mode }
}

/// Two series side by side.
fn pair_up(cells: &mut [f64], first: &[f64], second: &[f64]) {
    for (cells, (first, second)) in cells.chunks_exact_mut(2).zip(first.iter().zip(second)) {
        cells.copy_from_slice(&[*first, *second]);
    }
}
