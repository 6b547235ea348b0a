//! The integrator: classical Runge–Kutta in flux form.
//!
//! A step sums the volume of every stream and moves exactly that volume, so that what leaves one tank arrives in
//! the other to the last bit; rims and empty tanks are mended in volumes too.

use super::pipe::Pipe;
use super::spec::ValveDrive;
use super::state::Plant;

/// Longest step of the integrator in seconds. Classical fourth order; with λ ≤ 1.8 s⁻¹ on the
/// reference rig the error over an hour stays below 1e-6 cm.
const LONGEST_STEP_S: f64 = 0.1;
/// Largest λ·h of a step, well inside the stability region of the method (2.78).
const STEP_RATE: f64 = 0.4;
/// Largest change of a head within a step, as a share of √(δ² + head²).
const STEP_CURVATURE: f64 = 0.1;
/// Floor of the step where δ = 0 makes the slope infinite, as a share of the longest.
const SMALLEST_SHARE: f64 = 1.0 / 32.0;

/// Scratch of one step; sized once, so that a step allocates nothing.
#[derive(Debug, Clone)]
pub(super) struct Work {
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

impl Work {
    pub fn new(tanks: usize, pumps: usize, valves: usize) -> Self {
        let zeros = |n: usize| vec![0.0; n];
        Self {
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
        }
    }
}

impl Plant {
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
                && valve.drive == ValveDrive::Between
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
            let pumped = self.commanded[i];
            if let Some(from) = pump.from {
                slope[from] -= pumped;
            }
            let arriving = self.pipes[i].arriving_cm3_s().unwrap_or(pumped);
            for &(to, share) in &pump.outlets {
                slope[to] += share * arriving;
            }
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
        for (i, &pumped) in self.commanded.iter().enumerate() {
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
            for &(to, share) in &pump.outlets {
                work.after[to] += share * work.arriving_volume[i];
            }
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
