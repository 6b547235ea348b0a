//! The moving part of the plant: levels, streams in the air and the integrator.

use super::error::RigError;
use super::network::Network;
use super::pipe::Pipe;

/// Longest step of the integrator in seconds. Classical fourth order; with λ ≤ 1.8 s⁻¹ on the
/// reference rig the error over an hour stays below 1e-6 cm.
const LONGEST_STEP_S: f64 = 0.1;
/// Largest λ·h of a step, well inside the stability region of the method (2.78).
const STEP_RATE: f64 = 0.4;
/// Largest change of a head within a step, as a share of √(δ² + head²).
const STEP_CURVATURE: f64 = 0.1;
/// Floor of the step where δ = 0 makes the slope infinite, as a share of the longest.
const SMALLEST_SHARE: f64 = 1.0 / 32.0;

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
    network: std::sync::Arc<Network>,
    levels_cm: Vec<f64>,
    inputs: Vec<f64>,
    angles_deg: Vec<f64>,
    coefficients: Vec<f64>,
    pipes: Vec<Pipe>,
    outside_cm3: f64,
    valve_flows: Vec<f64>,
    pumped_flows: Vec<f64>,
    arriving_flows: Vec<f64>,
    spill_flows: Vec<f64>,
    dry: Vec<bool>,
    steps: u64,
    work: Work,
}

/// Scratch of one step; sized once, so that a step allocates nothing.
#[derive(Debug, Clone)]
struct Work {
    slope: [Vec<f64>; 4],
    stage: Vec<f64>,
    valve_flow: [Vec<f64>; 4],
    valve_volume: Vec<f64>,
    pumped_volume: Vec<f64>,
    arriving_volume: Vec<f64>,
    spill_volume: Vec<f64>,
    after: Vec<f64>,
    span_valves: Vec<f64>,
    span_pumped: Vec<f64>,
    span_arriving: Vec<f64>,
    span_spills: Vec<f64>,
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
            work: Work {
                slope: std::array::from_fn(|_| zeros(tanks)),
                stage: zeros(tanks),
                valve_flow: std::array::from_fn(|_| zeros(valves)),
                valve_volume: zeros(valves),
                pumped_volume: zeros(pumps),
                arriving_volume: zeros(pumps),
                spill_volume: zeros(tanks),
                after: zeros(tanks),
                span_valves: zeros(valves),
                span_pumped: zeros(pumps),
                span_arriving: zeros(pumps),
                span_spills: zeros(tanks),
            },
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
        self.inputs[pump] = input.clamp(p.min, p.max);
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
            self.pour(self.network.pumps[pump].to, homeless_cm3);
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
        let before = (self.levels_cm.clone(), self.inputs.clone(), self.pipes.clone());
        self.levels_cm.copy_from_slice(levels_cm);
        self.inputs.copy_from_slice(inputs);
        for (i, pipe) in self.pipes.iter_mut().enumerate() {
            *pipe = Pipe::filled(pipe.delay_s(), self.network.pumps[i].flow_cm3_s(inputs[i]));
        }
        if let Err(error) = self.fill_reservoir() {
            (self.levels_cm, self.inputs, self.pipes) = before;
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
        for (i, pump) in self.network.pumps.iter().enumerate() {
            self.pumped_flows[i] = pump.flow_cm3_s(self.inputs[i]);
            self.arriving_flows[i] = self.pipes[i].arriving_cm3_s().unwrap_or(self.pumped_flows[i]);
        }
        self.spill_flows.fill(0.0);
    }

    /// Lets `duration_s` pass with constant inputs.
    ///
    /// Classical Runge–Kutta in flux form; steps end where a delayed stream changes and shrink where a
    /// head crosses zero. Flows afterwards are the means over `duration_s`.
    pub fn advance(&mut self, duration_s: f64) {
        self.work.span_valves.fill(0.0);
        self.work.span_pumped.fill(0.0);
        self.work.span_arriving.fill(0.0);
        self.work.span_spills.fill(0.0);
        self.dry.fill(false);
        let mut left_s = duration_s;
        while left_s > 1e-10 {
            let change_s = self.pipes.iter().map(Pipe::time_to_change_s).fold(f64::INFINITY, f64::min);
            let until_s = left_s.min(change_s);
            let limit_s = self.step_limit_s();
            let pieces = (until_s / limit_s - 1e-9).ceil().max(1.0);
            let step_s = until_s / pieces;
            self.step(step_s);
            left_s -= step_s;
        }
        for (flow, volume) in self.valve_flows.iter_mut().zip(&self.work.span_valves) {
            *flow = volume / duration_s;
        }
        for (flow, volume) in self.pumped_flows.iter_mut().zip(&self.work.span_pumped) {
            *flow = volume / duration_s;
        }
        for (flow, volume) in self.arriving_flows.iter_mut().zip(&self.work.span_arriving) {
            *flow = volume / duration_s;
        }
        for (flow, volume) in self.spill_flows.iter_mut().zip(&self.work.span_spills) {
            *flow = volume / duration_s;
        }
    }

    /// First evaluation of a step; gives the longest step that resolves every valve.
    fn step_limit_s(&mut self) -> f64 {
        self.evaluate(0);
        let delta = self.network.delta_cm;
        let (slope, flow) = (&self.work.slope[0], &self.work.valve_flow[0]);
        let mut limit_s = LONGEST_STEP_S;
        for (i, valve) in self.network.valves.iter().enumerate() {
            if self.coefficients[i] == 0.0 {
                continue;
            }
            let head = valve.head_cm(&self.levels_cm);
            let mut head_rate = slope[valve.from];
            let mut conductance = 1.0 / self.network.tanks[valve.from].area_cm2;
            if let Some(to) = valve.to
                && valve.drive == super::spec::ValveDrive::Between
            {
                head_rate -= slope[to];
                conductance += 1.0 / self.network.tanks[to].area_cm2;
            }
            if head == 0.0 && head_rate <= 0.0 && flow[i] == 0.0 && delta == 0.0 {
                continue;
            }
            let scale = (head * head + delta * delta).sqrt();
            let rate = valve.law.slope_cm2_s(self.coefficients[i], head, delta) * conductance;
            limit_s = limit_s.min(STEP_RATE / rate).min(STEP_CURVATURE * scale / head_rate.abs());
        }
        limit_s.max(LONGEST_STEP_S * SMALLEST_SHARE)
    }

    /// Right-hand side at stage `k`, from the stage's levels.
    fn evaluate(&mut self, k: usize) {
        let network = &*self.network;
        let work = &mut self.work;
        let levels: &[f64] = if k == 0 { &self.levels_cm } else { &work.stage };
        let slope = &mut work.slope[k];
        slope.fill(0.0);
        for (i, pump) in network.pumps.iter().enumerate() {
            let pumped = pump.flow_cm3_s(self.inputs[i]);
            if let Some(from) = pump.from {
                slope[from] -= pumped;
            }
            slope[pump.to] += self.pipes[i].arriving_cm3_s().unwrap_or(pumped);
        }
        for (i, valve) in network.valves.iter().enumerate() {
            let flow = valve.law.flow_cm3_s(self.coefficients[i], valve.head_cm(levels), network.delta_cm);
            work.valve_flow[k][i] = flow;
            slope[valve.from] -= flow;
            if let Some(to) = valve.to {
                slope[to] += flow;
            }
        }
        for (i, tank) in network.tanks.iter().enumerate() {
            slope[i] /= tank.area_cm2;
            // A tank at its rim stays there while more comes in than leaves.
            if levels[i] >= tank.height_cm && slope[i] > 0.0 {
                slope[i] = 0.0;
            }
        }
    }

    fn step(&mut self, h: f64) {
        for (k, share) in [(1, 0.5), (2, 0.5), (3, 1.0)] {
            for i in 0..self.levels_cm.len() {
                self.work.stage[i] = self.levels_cm[i] + share * h * self.work.slope[k - 1][i];
            }
            self.evaluate(k);
        }
        for i in 0..self.coefficients.len() {
            let f = &self.work.valve_flow;
            self.work.valve_volume[i] = h / 6.0 * (f[0][i] + 2.0 * f[1][i] + 2.0 * f[2][i] + f[3][i]);
        }
        for (i, pump) in self.network.pumps.iter().enumerate() {
            let pumped = pump.flow_cm3_s(self.inputs[i]);
            self.work.pumped_volume[i] = h * pumped;
            self.work.arriving_volume[i] = h * self.pipes[i].arriving_cm3_s().unwrap_or(pumped);
        }
        self.settle();
        self.book(h);
    }

    /// Moves the volumes of a step and mends what no tank can hold or give, until nothing changes.
    fn settle(&mut self) {
        let tanks = self.network.tanks.len();
        self.work.spill_volume.fill(0.0);
        for _ in 0..=2 * tanks {
            self.sum_volumes();
            let mut mended = false;
            for i in 0..tanks {
                let tank = &self.network.tanks[i];
                let (most, volume) = (tank.height_cm * tank.area_cm2, self.work.after[i]);
                if volume < -1e-12 * most {
                    self.scale_outflows(i, volume);
                    mended = true;
                    break;
                }
                if volume > most * (1.0 + 1e-15) {
                    self.work.spill_volume[i] += volume - most;
                    mended = true;
                    break;
                }
            }
            if !mended {
                break;
            }
        }
    }

    fn sum_volumes(&mut self) {
        let work = &mut self.work;
        for (i, tank) in self.network.tanks.iter().enumerate() {
            work.after[i] = self.levels_cm[i] * tank.area_cm2 - work.spill_volume[i];
        }
        for (i, tank) in self.network.tanks.iter().enumerate() {
            if let Some(other) = tank.spills_to {
                work.after[other] += work.spill_volume[i];
            }
        }
        for (i, pump) in self.network.pumps.iter().enumerate() {
            if let Some(from) = pump.from {
                work.after[from] -= work.pumped_volume[i];
            }
            work.after[pump.to] += work.arriving_volume[i];
        }
        for (i, valve) in self.network.valves.iter().enumerate() {
            work.after[valve.from] -= work.valve_volume[i];
            if let Some(to) = valve.to {
                work.after[to] += work.valve_volume[i];
            }
        }
    }

    /// Shrinks everything that leaves an over-drawn tank so that it ends the step empty.
    fn scale_outflows(&mut self, tank: usize, after_cm3: f64) {
        let network = self.network.clone();
        let work = &mut self.work;
        let mut out = work.spill_volume[tank];
        for (i, pump) in network.pumps.iter().enumerate() {
            if pump.from == Some(tank) {
                out += work.pumped_volume[i];
            }
        }
        for (i, valve) in network.valves.iter().enumerate() {
            let v = work.valve_volume[i];
            if (valve.from == tank && v > 0.0) || (valve.to == Some(tank) && v < 0.0) {
                out += v.abs();
            }
        }
        let keep = ((out + after_cm3) / out).max(0.0);
        work.spill_volume[tank] *= keep;
        for (i, pump) in network.pumps.iter().enumerate() {
            if pump.from == Some(tank) {
                work.pumped_volume[i] *= keep;
                self.dry[i] = true;
                if self.pipes[i].arriving_cm3_s().is_none() {
                    work.arriving_volume[i] *= keep;
                }
            }
        }
        for (i, valve) in network.valves.iter().enumerate() {
            let v = work.valve_volume[i];
            if (valve.from == tank && v > 0.0) || (valve.to == Some(tank) && v < 0.0) {
                work.valve_volume[i] *= keep;
            }
        }
    }

    fn book(&mut self, h: f64) {
        let work = &mut self.work;
        for (i, tank) in self.network.tanks.iter().enumerate() {
            self.levels_cm[i] = (work.after[i] / tank.area_cm2).clamp(0.0, tank.height_cm);
            if tank.spills_to.is_none() {
                self.outside_cm3 += work.spill_volume[i];
            }
            work.span_spills[i] += work.spill_volume[i];
        }
        for (i, pump) in self.network.pumps.iter().enumerate() {
            if pump.from.is_none() {
                self.outside_cm3 -= work.pumped_volume[i];
            }
            work.span_pumped[i] += work.pumped_volume[i];
            work.span_arriving[i] += work.arriving_volume[i];
            self.pipes[i].shift(h, work.pumped_volume[i]);
        }
        for (i, valve) in self.network.valves.iter().enumerate() {
            if valve.to.is_none() {
                self.outside_cm3 += work.valve_volume[i];
            }
            work.span_valves[i] += work.valve_volume[i];
        }
        self.steps += 1;
    }
}
