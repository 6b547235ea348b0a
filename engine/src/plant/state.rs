//! A rig in motion: what can be set and seen of it.

use super::error::RigError;
use super::faults::Fault;
use super::motions::Motions;
use super::network::Network;
use super::pipe::Pipe;
use super::streams::Origin;

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
    network: std::sync::Arc<Network>,
    motion: Motions,
    arch: pulp::Arch,
    levels_cm: Vec<f64>,
    inputs: Vec<f64>,
    /// Piece of each pump's curve where its input lay last.
    pieces: Vec<usize>,
    angles_deg: Vec<f64>,
    /// k of each valve as it is, clogged or not.
    coefficients: Vec<f64>,
    /// Share of k left in each valve, k of each tank's leak, share of its flow left to each pump.
    clogged: Vec<f64>,
    leaks: Vec<f64>,
    strength: Vec<f64>,
    airlocked: Vec<bool>,
    /// Without power: each pump, and the rig.
    unpowered: Vec<bool>,
    blackout: bool,
    valve_flows: Vec<f64>,
    leak_flows: Vec<f64>,
    pumped_flows: Vec<f64>,
    arriving_flows: Vec<f64>,
    spill_flows: Vec<f64>,
    /// Whether the last advance may have spilled.
    spills: bool,
    dry: Vec<bool>,
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
        let flows = spec.pumps.iter().zip(&network.pumps).map(|(s, p)| (s, p.flow_cm3_s(s.initial)));
        let pipes = flows.map(|(s, flow)| Pipe::filled(s.delay_s, flow)).collect();
        let mut plant = Self {
            motion: Motions::new(&network, &coefficients, pipes),
            arch: pulp::Arch::new(),
            levels_cm: spec.tanks.iter().map(|t| t.initial_cm).collect(),
            pieces: vec![0; pumps],
            inputs: spec.pumps.iter().map(|p| p.initial).collect(),
            angles_deg: spec.valves.iter().map(|v| v.angle_deg).collect(),
            coefficients,
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
            spills: false,
            dry: vec![false; pumps],
            network,
        };
        for pump in 0..pumps {
            plant.command(pump);
        }
        plant.fill_reservoir()?;
        plant.refresh_flows();
        Ok(plant)
    }

    /// The same plant, moved in the vector registers of `arch`.
    #[cfg(test)]
    pub(crate) fn in_registers_of(mut self, arch: pulp::Arch) -> Self {
        self.arch = arch;
        self
    }

    /// Lets `duration_s` pass with constant inputs. Flows afterwards are the means over `duration_s`.
    pub fn advance(&mut self, duration_s: f64) {
        for (dry, &airlocked) in self.dry.iter_mut().zip(&self.airlocked) {
            *dry = airlocked;
        }
        let careful =
            self.motion.advance(self.arch, &self.network, duration_s, &mut self.levels_cm, &mut self.dry);
        let span = self.motion.span();
        let per_s = 1.0 / duration_s;
        for (origin, volume) in span.origins.iter().zip(span.streams) {
            match *origin {
                Origin::Valve(valve) => self.valve_flows[valve] = volume * per_s,
                Origin::Leak(tank) => self.leak_flows[tank] = volume * per_s,
            }
        }
        for (i, (pumped, arriving)) in self.pumped_flows.iter_mut().zip(&mut self.arriving_flows).enumerate()
        {
            (*pumped, *arriving) = (span.pumped[i] * per_s, span.arriving[i] * per_s);
        }
        // Only a careful step spills.
        if careful || self.spills {
            for (flow, volume) in self.spill_flows.iter_mut().zip(span.spills) {
                *flow = volume * per_s;
            }
            self.spills = careful;
        }
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
        self.motion.pipes().iter().map(Pipe::delay_s)
    }

    /// Steps of the integrator since the start.
    #[must_use]
    pub fn steps(&self) -> u64 {
        self.motion.steps()
    }

    /// Where the water is.
    #[must_use]
    pub fn balance(&self) -> Balance {
        let tanks_cm3 = self.levels_cm.iter().zip(&self.network.tanks).map(|(h, t)| h * t.area_cm2).sum();
        let (outside_cm3, leaked_cm3) = self.motion.lost_cm3();
        Balance { tanks_cm3, in_flight_cm3: self.motion.in_flight_cm3(), outside_cm3, leaked_cm3 }
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
        let sound = self.network.valves[valve].coefficient(self.angles_deg[valve]);
        self.coefficients[valve] = self.clogged[valve] * sound;
        self.restream();
    }

    /// Flow of a pump at its present input and health.
    fn command(&mut self, pump: usize) {
        let stands = self.blackout || self.unpowered[pump] || self.airlocked[pump];
        let sound = self.network.pumps[pump].flow_near(self.inputs[pump], &mut self.pieces[pump]);
        self.motion.command(pump, if stands { 0.0 } else { self.strength[pump] * sound });
    }

    fn restream(&mut self) {
        self.motion.collect(&self.network, &self.coefficients, &self.leaks);
        self.valve_flows.fill(0.0);
        self.leak_flows.fill(0.0);
    }

    /// Water from `tank` to the floor, `q = k √h`; k in cm^2.5/s, 0 for none.
    pub(crate) fn set_leak(&mut self, tank: usize, k: f64) {
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
        for pump in 0..self.inputs.len() {
            self.command(pump);
        }
    }

    /// Changes a pump's transport delay; the water in the air stays counted.
    pub fn set_delay(&mut self, pump: usize, delay_s: f64) {
        let homeless_cm3 = self.motion.change_pipes(|pipes| pipes[pump].set_delay(delay_s));
        if homeless_cm3 > 0.0 {
            for outlet in 0..self.network.pumps[pump].outlets.len() {
                let (to, share) = self.network.pumps[pump].outlets[outlet];
                self.pour(to, share * homeless_cm3);
            }
            self.motion.set_levels(&self.levels_cm);
        }
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
        let network = self.network.clone();
        let tanks = &network.tanks;
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
            None => self.lose(-volume_cm3),
        }
        let change_cm = volume_cm3 / tanks[tank].area_cm2;
        self.levels_cm[tank] = (self.levels_cm[tank] + change_cm).clamp(0.0, tanks[tank].height_cm);
        self.motion.set_levels(&self.levels_cm);
        Ok(change_cm)
    }

    /// Puts the plant into a state: levels in cm and inputs, with the streams in the air in equilibrium.
    /// The reservoir takes what the circuit's water leaves.
    ///
    /// # Errors
    /// [`RigError::Water`] when the water does not fit.
    pub fn set_state(&mut self, levels_cm: &[f64], inputs: &[f64]) -> Result<(), RigError> {
        let before = (self.levels_cm.clone(), self.inputs.clone(), self.motion.clone());
        self.levels_cm.copy_from_slice(levels_cm);
        self.inputs.copy_from_slice(inputs);
        for pump in 0..inputs.len() {
            self.command(pump);
        }
        let flows = self.motion.commanded().to_vec();
        self.motion.change_pipes(|pipes| {
            for (pipe, flow) in pipes.iter_mut().zip(flows) {
                *pipe = Pipe::filled(pipe.delay_s(), flow);
            }
        });
        if let Err(error) = self.fill_reservoir() {
            (self.levels_cm, self.inputs, self.motion) = before;
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
            self.motion.set_lost_cm3(0.0, 0.0);
        }
        self.motion.set_levels(&self.levels_cm);
        Ok(())
    }

    /// Books water that goes to the outside.
    fn lose(&mut self, volume_cm3: f64) {
        let (outside, floor) = self.motion.lost_cm3();
        self.motion.set_lost_cm3(outside + volume_cm3, floor);
    }

    fn pour(&mut self, tank: usize, volume_cm3: f64) {
        let t = &self.network.tanks[tank];
        let level = self.levels_cm[tank] + volume_cm3 / t.area_cm2;
        self.levels_cm[tank] = level.min(t.height_cm);
        let excess = (level - t.height_cm).max(0.0) * t.area_cm2;
        if excess > 0.0 {
            match t.spills_to {
                Some(other) => {
                    let (o, kept) = (&self.network.tanks[other], excess * t.spill_share);
                    let filled = self.levels_cm[other] + kept / o.area_cm2;
                    self.levels_cm[other] = filled.min(o.height_cm);
                    let over = (filled - o.height_cm).max(0.0) * o.area_cm2;
                    self.lose(excess - kept + over);
                }
                None => self.lose(excess),
            }
        }
    }

    /// Flows as they are at the present state, for a display before the first step.
    fn refresh_flows(&mut self) {
        let (flows, origins) = self.motion.flows();
        for (origin, &flow) in origins.iter().zip(flows) {
            match *origin {
                Origin::Valve(valve) => self.valve_flows[valve] = flow,
                Origin::Leak(tank) => self.leak_flows[tank] = flow,
            }
        }
        for (i, pipe) in self.motion.pipes().iter().enumerate() {
            self.pumped_flows[i] = self.motion.commanded()[i];
            self.arriving_flows[i] = pipe.arriving_cm3_s().unwrap_or(self.pumped_flows[i]);
        }
        self.spill_flows.fill(0.0);
    }
}
