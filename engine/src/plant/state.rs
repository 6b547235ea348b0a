//! The moving part of the plant: levels, streams in the air and the integrator.

use super::error::RigError;
use super::integrator::Work;
use super::network::Network;
use super::pipe::Pipe;

/// Where the water is, in cm³.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Balance {
    /// In the tanks.
    pub tanks_cm3: f64,
    /// In the air between pump and tank.
    pub in_flight_cm3: f64,
    /// Gone to the outside less what came from there, since the start.
    pub outside_cm3: f64,
}

impl Balance {
    /// Tanks, air and outside together: constant.
    #[must_use]
    pub fn total_cm3(&self) -> f64 {
        self.tanks_cm3 + self.in_flight_cm3 + self.outside_cm3
    }
}

/// A rig in motion.
#[derive(Debug, Clone)]
pub struct Plant {
    pub(super) network: std::sync::Arc<Network>,
    pub(super) levels_cm: Vec<f64>,
    pub(super) inputs: Vec<f64>,
    /// Flow of each pump's curve at its input, looked up once for each new input.
    pub(super) commanded: Vec<f64>,
    pub(super) angles_deg: Vec<f64>,
    pub(super) coefficients: Vec<f64>,
    pub(super) pipes: Vec<Pipe>,
    pub(super) outside_cm3: f64,
    pub(super) valve_flows: Vec<f64>,
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
        let mut plant = Self {
            levels_cm: spec.tanks.iter().map(|t| t.initial_cm).collect(),
            inputs: spec.pumps.iter().map(|p| p.initial).collect(),
            commanded: spec.pumps.iter().zip(&network.pumps).map(|(s, p)| p.flow_cm3_s(s.initial)).collect(),
            angles_deg: spec.valves.iter().map(|v| v.angle_deg).collect(),
            coefficients: network
                .valves
                .iter()
                .zip(&spec.valves)
                .map(|(v, s)| v.coefficient(s.angle_deg))
                .collect(),
            pipes: spec
                .pumps
                .iter()
                .zip(&network.pumps)
                .map(|(s, p)| Pipe::filled(s.delay_s, p.flow_cm3_s(s.initial)))
                .collect(),
            outside_cm3: 0.0,
            valve_flows: zeros(valves),
            pumped_flows: zeros(pumps),
            arriving_flows: zeros(pumps),
            spill_flows: zeros(tanks),
            dry: vec![false; pumps],
            steps: 0,
            work: Work::new(tanks, pumps, valves),
            network,
        };
        plant.fill_reservoir()?;
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

    /// k(α) of the valves at their present angles.
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

    /// Pumps whose tank ran empty in the last advance.
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
        Balance {
            tanks_cm3: self.levels_cm.iter().zip(&self.network.tanks).map(|(h, t)| h * t.area_cm2).sum(),
            in_flight_cm3: self.pipes.iter().map(Pipe::volume_cm3).sum(),
            outside_cm3: self.outside_cm3,
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
            self.commanded[pump] = p.flow_cm3_s(input);
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
        self.angles_deg[valve] = angle_deg;
        self.coefficients[valve] = self.network.valves[valve].coefficient(angle_deg);
        Ok(())
    }

    /// Changes a pump's transport delay; the water in the air stays counted.
    pub fn set_delay(&mut self, pump: usize, delay_s: f64) {
        let homeless_cm3 = self.pipes[pump].set_delay(delay_s);
        if homeless_cm3 > 0.0 {
            for outlet in 0..self.network.pumps[pump].outlets.len() {
                let (to, share) = self.network.pumps[pump].outlets[outlet];
                self.pour(to, share * homeless_cm3);
            }
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
            None => self.outside_cm3 -= volume_cm3,
        }
        let change_cm = volume_cm3 / tanks[tank].area_cm2;
        self.levels_cm[tank] = (self.levels_cm[tank] + change_cm).clamp(0.0, tanks[tank].height_cm);
        Ok(change_cm)
    }

    /// Puts the plant into a state: levels in cm and inputs, with the streams in the air in equilibrium.
    /// The reservoir takes what the circuit's water leaves.
    ///
    /// # Errors
    /// [`RigError::Water`] when the water does not fit.
    pub fn set_state(&mut self, levels_cm: &[f64], inputs: &[f64]) -> Result<(), RigError> {
        let before =
            (self.levels_cm.clone(), self.inputs.clone(), self.commanded.clone(), self.pipes.clone());
        self.levels_cm.copy_from_slice(levels_cm);
        self.inputs.copy_from_slice(inputs);
        for (i, pipe) in self.pipes.iter_mut().enumerate() {
            self.commanded[i] = self.network.pumps[i].flow_cm3_s(inputs[i]);
            *pipe = Pipe::filled(pipe.delay_s(), self.commanded[i]);
        }
        if let Err(error) = self.fill_reservoir() {
            (self.levels_cm, self.inputs, self.commanded, self.pipes) = before;
            return Err(error);
        }
        self.refresh_flows();
        Ok(())
    }

    fn fill_reservoir(&mut self) -> Result<(), RigError> {
        let (Some(water_cm3), Some(r)) = (self.network.spec.water_cm3, self.network.reservoir) else {
            return Ok(());
        };
        let balance = self.balance();
        let area = self.network.tanks[r].area_cm2;
        let others = balance.tanks_cm3 - self.levels_cm[r] * area + balance.in_flight_cm3;
        let level_cm = (water_cm3 - others) / area;
        if !(0.0..=self.network.tanks[r].height_cm).contains(&level_cm) {
            return Err(RigError::Water { tank: self.network.spec.tanks[r].id.clone(), level_cm });
        }
        self.levels_cm[r] = level_cm;
        self.outside_cm3 = 0.0;
        Ok(())
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
                    self.outside_cm3 += (filled - o.height_cm).max(0.0) * o.area_cm2;
                }
                None => self.outside_cm3 += excess,
            }
        }
    }

    /// Flows as they are at the present state, for a display before the first step.
    fn refresh_flows(&mut self) {
        for (i, valve) in self.network.valves.iter().enumerate() {
            let head = valve.head_cm(&self.levels_cm);
            self.valve_flows[i] = valve.law.flow_cm3_s(self.coefficients[i], head, self.network.delta_cm);
        }
        for i in 0..self.commanded.len() {
            self.pumped_flows[i] = self.commanded[i];
            self.arriving_flows[i] = self.pipes[i].arriving_cm3_s().unwrap_or(self.pumped_flows[i]);
        }
        self.spill_flows.fill(0.0);
    }
}
