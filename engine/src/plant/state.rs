//! The moving part of the plant: levels, streams in the air and the integrator.

use super::error::RigError;
use super::faults::Fault;
use super::integrator::Work;
use super::network::Network;
use super::pipe::Pipe;
use super::streams::{Origin, Streams};

/// Where the water is, in cm³.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Balance {
    /// In the tanks.
    pub tanks_cm3: f64,
    /// In the air between pump and tank.
    pub in_flight_cm3: f64,
    /// Gone to the outside less what came from there, since the start.
    pub outside_cm3: f64,
    /// Lost to the floor through leaks, since the start.
    pub leaked_cm3: f64,
}

impl Balance {
    /// Tanks, air, outside and floor together: constant.
    #[must_use]
    pub fn total_cm3(&self) -> f64 {
        self.tanks_cm3 + self.in_flight_cm3 + self.outside_cm3 + self.leaked_cm3
    }
}

/// A rig in motion.
#[derive(Debug, Clone)]
pub struct Plant {
    pub(super) network: std::sync::Arc<Network>,
    pub(super) levels_cm: Vec<f64>,
    pub(super) inputs: Vec<f64>,
    /// Flow of each pump at its input, looked up once for each new input.
    pub(super) commanded: Vec<f64>,
    pub(super) angles_deg: Vec<f64>,
    /// k of each valve as it is, clogged or not.
    pub(super) coefficients: Vec<f64>,
    pub(super) pipes: Vec<Pipe>,
    pub(super) streams: Streams,
    /// Steps may reach beyond the present: all that arrives until then is in the air already.
    pub(super) look_ahead: bool,
    /// Share of k left in each valve, k of each tank's leak, share of its flow left to each pump.
    clogged: Vec<f64>,
    leaks: Vec<f64>,
    strength: Vec<f64>,
    pub(super) airlocked: Vec<bool>,
    /// Without power: each pump, and the rig.
    unpowered: Vec<bool>,
    blackout: bool,
    pub(super) valve_flows: Vec<f64>,
    pub(super) leak_flows: Vec<f64>,
    pub(super) pumped_flows: Vec<f64>,
    pub(super) arriving_flows: Vec<f64>,
    pub(super) spill_flows: Vec<f64>,
    pub(super) dry: Vec<bool>,
    pub(super) steps: u64,
    pub(super) work: Work,
}

impl Plant {
    /// The rig at the levels, inputs and angles of its file.
    ///
    /// # Errors
    /// [`RigError::Water`] when the reservoir cannot hold the rest of the circuit's water.
    pub fn new(network: std::sync::Arc<Network>) -> Result<Self, RigError> {
        let spec = &network.spec;
        let (tanks, pumps, valves) = (spec.tanks.len(), spec.pumps.len(), spec.valves.len());
        let zeros = |n: usize| vec![0.0; n];
        let coefficients: Vec<f64> =
            network.valves.iter().zip(&spec.valves).map(|(v, s)| v.coefficient(s.angle_deg)).collect();
        let commanded: Vec<f64> =
            spec.pumps.iter().zip(&network.pumps).map(|(s, p)| p.flow_cm3_s(s.initial)).collect();
        let streams = Streams::new(&network, &coefficients, &zeros(tanks));
        let nodes = streams.nodes();
        let mut plant = Self {
            levels_cm: spec.tanks.iter().map(|t| t.initial_cm).collect(),
            inputs: spec.pumps.iter().map(|p| p.initial).collect(),
            angles_deg: spec.valves.iter().map(|v| v.angle_deg).collect(),
            pipes: spec.pumps.iter().zip(&commanded).map(|(s, &q)| Pipe::filled(s.delay_s, q)).collect(),
            commanded,
            coefficients,
            streams,
            look_ahead: false,
            clogged: vec![1.0; valves],
            leaks: zeros(tanks),
            strength: vec![1.0; pumps],
            airlocked: vec![false; pumps],
            unpowered: vec![false; pumps],
            blackout: false,
            valve_flows: zeros(valves),
            leak_flows: zeros(tanks),
            pumped_flows: zeros(pumps),
            arriving_flows: zeros(pumps),
            spill_flows: zeros(tanks),
            dry: vec![false; pumps],
            steps: 0,
            work: Work::new(nodes, tanks, pumps, valves + tanks),
            network,
        };
        plant.take_levels();
        plant.fill_reservoir()?;
        plant.restream();
        plant.refresh_flows();
        Ok(plant)
    }

    /// The structure.
    #[must_use]
    pub fn network(&self) -> &std::sync::Arc<Network> {
        &self.network
    }

    /// True levels in cm, in the order of the file.
    #[must_use]
    pub fn levels_cm(&self) -> &[f64] {
        &self.levels_cm
    }

    /// Pump inputs in their own units.
    #[must_use]
    pub fn inputs(&self) -> &[f64] {
        &self.inputs
    }

    /// Valve angles in degrees.
    #[must_use]
    pub fn angles_deg(&self) -> &[f64] {
        &self.angles_deg
    }

    /// k(α) of the valves at their present angles; of a clogged one, what is left.
    #[must_use]
    pub fn coefficients(&self) -> &[f64] {
        &self.coefficients
    }

    /// Flow through each valve in cm³/s, positive from `from` to `to`; mean of the last advance.
    #[must_use]
    pub fn valve_flows_cm3_s(&self) -> &[f64] {
        &self.valve_flows
    }

    /// Flow each pump draws, in cm³/s.
    #[must_use]
    pub fn pumped_flows_cm3_s(&self) -> &[f64] {
        &self.pumped_flows
    }

    /// Flow that arrives at each pump's tank, in cm³/s.
    #[must_use]
    pub fn arriving_flows_cm3_s(&self) -> &[f64] {
        &self.arriving_flows
    }

    /// Spill over each rim, in cm³/s.
    #[must_use]
    pub fn spill_flows_cm3_s(&self) -> &[f64] {
        &self.spill_flows
    }

    /// Flow through each tank's leak, in cm³/s; mean of the last advance.
    #[must_use]
    pub fn leak_flows_cm3_s(&self) -> &[f64] {
        &self.leak_flows
    }

    /// Pumps whose tank ran empty in the last advance, or that have lost their suction.
    #[must_use]
    pub fn dry(&self) -> &[bool] {
        &self.dry
    }

    /// Transport delays in seconds.
    pub fn delays_s(&self) -> impl Iterator<Item = f64> + '_ {
        self.pipes.iter().map(Pipe::delay_s)
    }

    /// Steps of the integrator since the start.
    #[must_use]
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Where the water is.
    #[must_use]
    pub fn balance(&self) -> Balance {
        let tanks_cm3 = self.levels_cm.iter().zip(&self.network.tanks).map(|(h, t)| h * t.area_cm2).sum();
        let ahead_s = self.work.length_s - self.work.passed_s;
        let delayed = self.pipes.iter().zip(&self.work.arriving).filter(|(pipe, _)| pipe.delay_s() > 0.0);
        // What the present step has taken out of the air beyond the present is still there.
        let in_flight_cm3 =
            delayed.map(|(pipe, arriving)| pipe.volume_cm3() + ahead_s * arriving).sum::<f64>();
        Balance {
            tanks_cm3,
            in_flight_cm3,
            outside_cm3: self.work.present(self.streams.outside()),
            leaked_cm3: self.work.present(self.streams.floor()),
        }
    }

    /// Sets a pump's input, clamped to its range.
    ///
    /// # Errors
    /// [`RigError::Value`] when it is not a finite number.
    pub fn set_input(&mut self, pump: usize, input: f64) -> Result<(), RigError> {
        if !input.is_finite() {
            let item = self.network.spec.pumps[pump].id.clone();
            return Err(RigError::Value {
                item,
                field: "input",
                value: input,
                expected: "finite".to_owned(),
            });
        }
        let p = &self.network.pumps[pump];
        let input = input.clamp(p.min, p.max);
        if input != self.inputs[pump] {
            self.inputs[pump] = input;
            self.command(pump);
        }
        Ok(())
    }

    /// Turns a valve to an angle in degrees.
    ///
    /// # Errors
    /// [`RigError::Value`] outside 0…90°.
    pub fn set_angle(&mut self, valve: usize, angle_deg: f64) -> Result<(), RigError> {
        if !(0.0..=90.0).contains(&angle_deg) {
            let item = self.network.spec.valves[valve].id.clone();
            let expected = "0…90".to_owned();
            return Err(RigError::Value { item, field: "angle_deg", value: angle_deg, expected });
        }
        if angle_deg != self.angles_deg[valve] {
            self.angles_deg[valve] = angle_deg;
            self.turn(valve);
        }
        Ok(())
    }

    fn turn(&mut self, valve: usize) {
        self.cut();
        let sound = self.network.valves[valve].coefficient(self.angles_deg[valve]);
        self.coefficients[valve] = self.clogged[valve] * sound;
        self.restream();
    }

    /// Flow of a pump at its present input and health.
    fn command(&mut self, pump: usize) {
        let stands = self.blackout || self.unpowered[pump] || self.airlocked[pump];
        let sound = self.network.pumps[pump].flow_cm3_s(self.inputs[pump]);
        let flow = if stands { 0.0 } else { self.strength[pump] * sound };
        if flow != self.commanded[pump] && !self.look_ahead {
            self.cut();
        }
        self.commanded[pump] = flow;
    }

    /// Makes the list of open streams anew, at the present.
    fn restream(&mut self) {
        self.streams.collect(&self.network, &self.coefficients, &self.leaks);
        self.valve_flows.fill(0.0);
        self.leak_flows.fill(0.0);
        let drives = |tank: usize| (0..self.streams.len()).any(|i| self.streams.is_driven_by(i, tank));
        let early = |pump: &super::network::Pump| pump.from.is_none_or(|tank| !drives(tank));
        self.look_ahead =
            self.network.pumps.iter().all(early) && self.pipes.iter().all(|p| p.delay_s() > 0.0);
        self.evaluate_end();
    }

    /// Water from `tank` to the floor, `q = k √h`; k in cm^2.5/s, 0 for none.
    pub(crate) fn set_leak(&mut self, tank: usize, k: f64) {
        self.cut();
        self.leaks[tank] = k;
        self.restream();
    }

    /// Lets only a share of k be left in a valve.
    pub(crate) fn set_clogged(&mut self, valve: usize, share: f64) {
        self.clogged[valve] = share;
        self.turn(valve);
    }

    /// Switches a fault of a pump.
    pub(crate) fn set_pump_fault(&mut self, pump: usize, fault: Fault, on: bool) {
        match fault {
            Fault::WeakPump { share } => self.strength[pump] = if on { share } else { 1.0 },
            Fault::DryPump => self.airlocked[pump] = on,
            Fault::PowerCut => self.unpowered[pump] = on,
            _ => {}
        }
        self.command(pump);
    }

    /// Takes the power from everything, or gives it back.
    pub(crate) fn set_blackout(&mut self, on: bool) {
        self.blackout = on;
        for pump in 0..self.commanded.len() {
            self.command(pump);
        }
    }

    /// Changes a pump's transport delay; the water in the air stays counted.
    pub fn set_delay(&mut self, pump: usize, delay_s: f64) {
        self.cut();
        let homeless_cm3 = self.pipes[pump].set_delay(delay_s);
        if homeless_cm3 > 0.0 {
            for outlet in 0..self.network.pumps[pump].outlets.len() {
                let (to, share) = self.network.pumps[pump].outlets[outlet];
                self.pour(to, share * homeless_cm3);
            }
        }
        self.take_levels();
        self.restream();
    }

    /// Adds `delta_cm` to a tank's level, taking the water from the reservoir (or the outside); what
    /// neither rim nor reservoir allows is left out. Returns the change in cm.
    ///
    /// # Errors
    /// [`RigError::Value`] when it is not a finite number.
    pub fn bump(&mut self, tank: usize, delta_cm: f64) -> Result<f64, RigError> {
        if !delta_cm.is_finite() {
            let item = self.network.spec.tanks[tank].id.clone();
            return Err(RigError::Value {
                item,
                field: "bump_cm",
                value: delta_cm,
                expected: "finite".to_owned(),
            });
        }
        self.cut();
        let tanks = &self.network.tanks;
        let wanted = (self.levels_cm[tank] + delta_cm).clamp(0.0, tanks[tank].height_cm);
        let mut volume_cm3 = (wanted - self.levels_cm[tank]) * tanks[tank].area_cm2;
        match self.network.reservoir.filter(|&r| r != tank) {
            Some(r) => {
                let held = self.levels_cm[r] * tanks[r].area_cm2;
                let room = tanks[r].height_cm * tanks[r].area_cm2 - held;
                volume_cm3 = volume_cm3.clamp(-room, held);
                let left_cm = self.levels_cm[r] - volume_cm3 / tanks[r].area_cm2;
                self.levels_cm[r] = left_cm.clamp(0.0, tanks[r].height_cm);
            }
            None => self.work.end[self.streams.outside()] -= volume_cm3,
        }
        let change_cm = volume_cm3 / tanks[tank].area_cm2;
        self.levels_cm[tank] = (self.levels_cm[tank] + change_cm).clamp(0.0, tanks[tank].height_cm);
        self.take_levels();
        Ok(change_cm)
    }

    /// Puts the plant into a state: levels in cm and inputs, with the streams in the air in equilibrium.
    /// The reservoir takes what the circuit's water leaves.
    ///
    /// # Errors
    /// [`RigError::Water`] when the water does not fit.
    pub fn set_state(&mut self, levels_cm: &[f64], inputs: &[f64]) -> Result<(), RigError> {
        self.cut();
        let before = (
            (self.levels_cm.clone(), self.inputs.clone(), self.commanded.clone()),
            (self.pipes.clone(), self.work.end.clone()),
        );
        self.levels_cm.copy_from_slice(levels_cm);
        self.inputs.copy_from_slice(inputs);
        for i in 0..self.pipes.len() {
            self.command(i);
            self.pipes[i] = Pipe::filled(self.pipes[i].delay_s(), self.commanded[i]);
        }
        if let Err(error) = self.fill_reservoir() {
            ((self.levels_cm, self.inputs, self.commanded), (self.pipes, self.work.end)) = before;
            return Err(error);
        }
        self.refresh_flows();
        Ok(())
    }

    fn fill_reservoir(&mut self) -> Result<(), RigError> {
        if let (Some(water_cm3), Some(r)) = (self.network.spec.water_cm3, self.network.reservoir) {
            let balance = self.balance();
            let area = self.network.tanks[r].area_cm2;
            let others = balance.tanks_cm3 - self.levels_cm[r] * area + balance.in_flight_cm3;
            let level_cm = (water_cm3 - others) / area;
            if !(0.0..=self.network.tanks[r].height_cm).contains(&level_cm) {
                return Err(RigError::Water { tank: self.network.spec.tanks[r].id.clone(), level_cm });
            }
            self.levels_cm[r] = level_cm;
            let (outside, floor) = (self.streams.outside(), self.streams.floor());
            self.work.end[outside] = 0.0;
            self.work.end[floor] = 0.0;
        }
        self.take_levels();
        Ok(())
    }

    /// The integrator goes on from the levels as they are now.
    fn take_levels(&mut self) {
        self.work.end[..self.levels_cm.len()].copy_from_slice(&self.levels_cm);
        self.evaluate_end();
    }

    fn pour(&mut self, tank: usize, volume_cm3: f64) {
        let t = &self.network.tanks[tank];
        let level = self.levels_cm[tank] + volume_cm3 / t.area_cm2;
        self.levels_cm[tank] = level.min(t.height_cm);
        let excess = (level - t.height_cm).max(0.0) * t.area_cm2;
        if excess > 0.0 {
            match t.spills_to {
                Some(other) => {
                    let o = &self.network.tanks[other];
                    let filled = self.levels_cm[other] + excess / o.area_cm2;
                    self.levels_cm[other] = filled.min(o.height_cm);
                    self.work.end[self.streams.outside()] += (filled - o.height_cm).max(0.0) * o.area_cm2;
                }
                None => self.work.end[self.streams.outside()] += excess,
            }
        }
    }

    /// Flows as they are at the present state, for a display before the first step.
    fn refresh_flows(&mut self) {
        for (i, origin) in self.streams.origins.iter().enumerate() {
            match *origin {
                Origin::Valve(valve) => self.valve_flows[valve] = self.work.end_flow[i],
                Origin::Leak(tank) => self.leak_flows[tank] = self.work.end_flow[i],
            }
        }
        for i in 0..self.commanded.len() {
            self.pumped_flows[i] = self.commanded[i];
            self.arriving_flows[i] = self.pipes[i].arriving_cm3_s().unwrap_or(self.pumped_flows[i]);
        }
        self.spill_flows.fill(0.0);
    }
}
