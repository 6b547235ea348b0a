//! The rig with its loops, one sample at a time. Sessions, scenarios and benchmarks all step this.

use std::sync::Arc;

use crate::control::{ControlLoop, LoopSpec, Mode, check_filter};
use crate::daq::{RigControls, SimulatedRig, Source};
use crate::plant::{
    ActiveFault, FaultKind, Measurement, Network, Reading, ReadingStatus, RigError, SteadyState,
    steady_at_level,
};
use crate::session::{CommandError, RigCommand};
use crate::signal::{ChannelKind, ChannelSet};

/// A loop of the present configuration with its place in the rig.
#[derive(Debug, Clone)]
pub struct ActiveLoop {
    /// Its description, kept up to date with what the operator set.
    pub spec: LoopSpec,
    /// Sensor that gives the PV.
    pub sensor: usize,
    /// Pump that takes the MV.
    pub pump: usize,
    /// Controller, setpoint and mode.
    pub control: ControlLoop,
    /// The last output was held because the input was not a number.
    pub held: bool,
}

/// A source under control.
pub struct ClosedLoop {
    source: Box<dyn Source>,
    network: Arc<Network>,
    channels: Arc<ChannelSet>,
    configuration: usize,
    settings: Vec<Vec<LoopSpec>>,
    loops: Vec<ActiveLoop>,
    readings: Vec<Reading>,
    row: Vec<f64>,
    sample_time_s: f64,
    samples: u64,
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
            samples: 0,
            configuration,
            source,
            network,
            channels,
        };
        closed.loops = closed.make_loops(configuration, &[]);
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
        for active in &mut self.loops {
            let output = active.control.update(self.readings[active.sensor].level_cm);
            active.held = output.held;
            if let Ok(written) = self.source.write(active.pump, output.mv)
                && written != output.mv
            {
                active.control.set_mv(written);
            }
        }
        self.fill_row();
        self.source.advance(self.sample_time_s);
        self.samples += 1;
        &self.row
    }

    fn fill_row(&mut self) {
        let plant = self.source.plant();
        let of =
            |values: Option<&[f64]>, i: usize| values.and_then(|v| v.get(i)).copied().unwrap_or(f64::NAN);
        let (levels, inputs) = (plant.map(|p| p.levels_cm()), plant.map(|p| p.inputs()));
        let (through, angles) = (plant.map(|p| p.valve_flows_cm3_s()), plant.map(|p| p.angles_deg()));
        let (arriving, spills) =
            (plant.map(|p| p.arriving_flows_cm3_s()), plant.map(|p| p.spill_flows_cm3_s()));
        for (value, channel) in self.row.iter_mut().zip(&self.channels.channels) {
            *value = match channel.kind {
                ChannelKind::Level(i) => of(levels, i),
                ChannelKind::Input(i) => of(inputs, i),
                ChannelKind::Arriving(i) => of(arriving, i),
                ChannelKind::ValveFlow(i) => of(through, i),
                ChannelKind::Angle(i) => of(angles, i),
                ChannelKind::Spill(i) => of(spills, i),
                ChannelKind::Setpoint(i) => self.loops.get(i).map_or(f64::NAN, |l| l.control.setpoint_cm),
                ChannelKind::Pv(i) => {
                    self.loops.get(i).map_or(f64::NAN, |l| self.readings[l.sensor].level_cm)
                }
                ChannelKind::Mv(i) => self.loops.get(i).map_or(f64::NAN, |l| l.control.mv()),
            };
        }
    }

    /// Loops of a configuration at the present outputs; `modes`, slot by slot, go before those of the settings.
    fn make_loops(&self, configuration: usize, modes: &[Mode]) -> Vec<ActiveLoop> {
        let Some(settings) = self.settings.get(configuration) else { return Vec::new() };
        settings
            .iter()
            .enumerate()
            .filter_map(|(slot, spec)| {
                let (sensor, pump) = (self.network.sensor(&spec.sensor)?, self.network.pump(&spec.pump)?);
                let p = &self.network.pumps[pump];
                let mv = self.source.plant().map_or(p.min, |plant| plant.inputs()[pump]);
                let mut spec = spec.clone();
                spec.mode = modes.get(slot).copied().unwrap_or(spec.mode);
                let control = ControlLoop::new(&spec, self.sample_time_s, p.min, p.max, mv);
                Some(ActiveLoop { spec, sensor, pump, control, held: false })
            })
            .collect()
    }

    fn find(&mut self, tag: &str) -> Result<&mut ActiveLoop, CommandError> {
        let unknown = || CommandError::UnknownTag { tag: tag.to_owned() };
        self.loops.iter_mut().find(|l| l.spec.id == tag).ok_or_else(unknown)
    }

    /// Carries out a command between two samples.
    ///
    /// # Errors
    /// [`CommandError`]; nothing has changed then.
    pub fn apply(&mut self, command: &RigCommand) -> Result<(), CommandError> {
        let unknown = |tag: &str| CommandError::UnknownTag { tag: tag.to_owned() };
        match command {
            RigCommand::Setpoint { tag, level_cm } => self.set_setpoint(tag, *level_cm)?,
            RigCommand::Mode { tag, mode } => {
                let active = self.find(tag)?;
                active.control.mode = *mode;
                active.spec.mode = *mode;
            }
            RigCommand::Mv { tag, value } => self.set_mv(tag, *value)?,
            RigCommand::Tuning { tag, tuning } => {
                let tuning = tuning.validated()?;
                let active = self.find(tag)?;
                active.control.set_tuning(tuning);
                let g = tuning.gains;
                let spec = &mut active.spec;
                (spec.kc, spec.ti_s, spec.td_s, spec.n) = (g.kc, g.ti_s, g.td_s, g.n);
                (spec.b, spec.c) = (tuning.b, tuning.c);
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
            RigCommand::Seed { seed } => self.source.rig().ok_or(CommandError::NotARig)?.set_seed(*seed),
        }
        Ok(())
    }

    fn set_setpoint(&mut self, tag: &str, level_cm: f64) -> Result<(), CommandError> {
        let network = self.network.clone();
        let active = self.find(tag)?;
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
        let pump = self.network.pump(tag);
        if let Some(active) = self.loops.iter_mut().find(|l| l.spec.id == tag || Some(l.pump) == pump) {
            if active.control.mode == Mode::Automatic {
                return Err(CommandError::Automatic { tag: active.spec.id.clone() });
            }
            active.control.set_mv(value);
            return Ok(());
        }
        let pump = pump.ok_or_else(|| CommandError::UnknownTag { tag: tag.to_owned() })?;
        self.source.write(pump, value)?;
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
        self.loops = self.make_loops(configuration, &modes);
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
        self.rest(&SteadyState { levels_cm: levels_cm.to_vec(), inputs: inputs.to_vec() })
    }

    fn rest(&mut self, state: &SteadyState) -> Result<(), CommandError> {
        self.source.rig().ok_or(CommandError::NotARig)?.set_state(&state.levels_cm, &state.inputs)?;
        for active in &mut self.loops {
            let (p, mv) = (&self.network.pumps[active.pump], state.inputs[active.pump]);
            active.control = ControlLoop::new(&active.spec, self.sample_time_s, p.min, p.max, mv);
        }
        Ok(())
    }

    /// Solves for the state in which every loop's PV is at its setpoint, and puts the plant there.
    fn settle_all(&mut self) -> Result<(), CommandError> {
        // Interacting loops are solved in turn; each sweep brings the others' effect in.
        let sweeps = if self.loops.len() > 1 { 40 } else { 1 };
        for _ in 0..sweeps {
            for i in 0..self.loops.len() {
                let l = &self.loops[i];
                let state = self.steady(l.pump, l.sensor, l.control.setpoint_cm)?;
                self.rest(&state)?;
            }
        }
        Ok(())
    }
}
