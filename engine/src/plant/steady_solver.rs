//! Newton's method on the balance of all tanks, with levels and some pumped flows unknown.

use super::flows::{Flows, closed_reservoir, is_idle};
use super::network::Network;

/// Newton steps before the method is given up.
const MOST_NEWTON: usize = 60;
/// Halvings of a Newton step that does not help.
const MOST_HALVINGS: u32 = 12;
/// Change at which a solution is accepted, relative to 1 + |x|; convergence is quadratic.
const SETTLED: f64 = 1e-11;
/// Net inflow left in a solution, relative to the flows.
const BALANCED: f64 = 1e-9;
/// Longer than any rig takes to settle, in seconds.
const LONGEST_STEP_S: f64 = 1e9;
/// Bound on the steps of the continuation.
const MOST_STEPS: usize = 120;

/// A tank held at a level by a pump.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wanted {
    pub pump: usize,
    pub tank: usize,
}

/// What stands for a tank in the vector of unknowns.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Unknown {
    Level,
    /// The flow of a pump; the level is given.
    Flow(usize),
    /// Nothing: the level is what it is.
    None,
}

pub(super) struct Solver<'a> {
    network: &'a Network,
    coefficients: &'a [f64],
    /// Flows in cm³/s; those of wanted levels are unknowns.
    pub pumped_cm3_s: Vec<f64>,
    unknowns: Vec<Unknown>,
    flows: Flows,
    matrix: Vec<f64>,
    residual: Vec<f64>,
}

impl<'a> Solver<'a> {
    pub fn new(
        network: &'a Network,
        coefficients: &'a [f64],
        pumped_cm3_s: Vec<f64>,
        wanted: &[Wanted],
    ) -> Self {
        let n = network.tanks.len();
        let reservoir = closed_reservoir(network);
        let unknowns = (0..n)
            .map(|i| match wanted.iter().find(|w| w.tank == i) {
                Some(w) => Unknown::Flow(w.pump),
                None if Some(i) == reservoir || is_idle(network, coefficients, i) => Unknown::None,
                None => Unknown::Level,
            })
            .collect();
        Self {
            network,
            coefficients,
            pumped_cm3_s,
            unknowns,
            flows: Flows::new(n),
            matrix: vec![0.0; n * n],
            residual: vec![0.0; n],
        }
    }

    /// Other flows to start from.
    pub fn restart(&mut self, pumped_cm3_s: &[f64]) {
        self.pumped_cm3_s.copy_from_slice(pumped_cm3_s);
    }

    fn evaluate(&mut self, levels: &[f64], delta_cm: f64) {
        self.flows.evaluate(self.network, self.coefficients, &self.pumped_cm3_s, levels, delta_cm);
    }

    /// Largest net inflow of the tanks that are to be at rest.
    fn imbalance(&self) -> f64 {
        let reservoir = closed_reservoir(self.network);
        let nets = self.flows.net_cm3_s.iter().enumerate();
        nets.filter(|(i, _)| Some(*i) != reservoir).map(|(_, net)| net.abs()).fold(0.0, f64::max)
    }

    fn flow_scale(&self) -> f64 {
        1.0 + self.pumped_cm3_s.iter().fold(0.0_f64, |a, q| a.max(q.abs()))
    }

    /// Solves from `levels`; false where it fails, levels and flows are then of no use.
    pub fn newton(&mut self, levels: &mut [f64], delta_cm: f64) -> bool {
        self.evaluate(levels, delta_cm);
        let mut imbalance = self.imbalance();
        for _ in 0..MOST_NEWTON {
            if !self.step_direction(levels, None) {
                return false;
            }
            let (old_levels, old_flows) = (levels.to_vec(), self.pumped_cm3_s.clone());
            let change = std::mem::take(&mut self.residual);
            let mut share = 1.0;
            let mut largest = f64::INFINITY;
            for _ in 0..=MOST_HALVINGS {
                levels.copy_from_slice(&old_levels);
                self.pumped_cm3_s.copy_from_slice(&old_flows);
                largest = self.take(levels, &change, share);
                self.evaluate(levels, delta_cm);
                let now = self.imbalance();
                if now < imbalance || now <= BALANCED * self.flow_scale() {
                    break;
                }
                share *= 0.5;
            }
            self.residual = change;
            imbalance = self.imbalance();
            if largest < SETTLED && share == 1.0 {
                return imbalance <= BALANCED * self.flow_scale();
            }
            if share < 2.0_f64.powi(-(MOST_HALVINGS as i32)) {
                return false;
            }
        }
        false
    }

    /// Moves by a share of the change; gives the largest relative movement.
    fn take(&mut self, levels: &mut [f64], change: &[f64], share: f64) -> f64 {
        let mut largest = 0.0_f64;
        for (i, tank) in self.network.tanks.iter().enumerate() {
            let moved = match self.unknowns[i] {
                Unknown::None => continue,
                Unknown::Flow(pump) => {
                    let flow = &mut self.pumped_cm3_s[pump];
                    *flow -= share * change[i];
                    share * change[i] / (1.0 + flow.abs())
                }
                Unknown::Level => {
                    let next = (levels[i] - share * change[i]).clamp(0.0, tank.height_cm);
                    let moved = next - levels[i];
                    levels[i] = next;
                    moved / (1.0 + next)
                }
            };
            largest = largest.max(moved.abs());
        }
        largest
    }

    /// Leaves the Newton step in `residual`; `implicit` adds a step of implicit Euler in s from levels in cm.
    fn step_direction(&mut self, levels: &[f64], implicit: Option<(f64, &[f64])>) -> bool {
        let n = levels.len();
        for i in 0..n {
            let held = self.unknowns[i] == Unknown::None || self.flows.spilling[i];
            self.residual[i] = if held { 0.0 } else { self.flows.net_cm3_s[i] };
            for j in 0..n {
                let known = self.unknowns[j] != Unknown::Level;
                self.matrix[i * n + j] = if held || known { 0.0 } else { self.flows.slope_cm2_s[i * n + j] };
            }
            if held {
                self.matrix[i * n + i] = 1.0;
            } else if let Some((step_s, start)) = implicit {
                let capacity = self.network.tanks[i].area_cm2 / step_s;
                self.residual[i] -= capacity * (levels[i] - start[i]);
                self.matrix[i * n + i] -= capacity;
            }
        }
        for j in 0..n {
            if let Unknown::Flow(pump) = self.unknowns[j] {
                let (matrix, unknowns) = (&mut self.matrix, &self.unknowns);
                self.flows.pump_column(self.network, pump, |i, share| {
                    if unknowns[i] != Unknown::None {
                        matrix[i * n + j] += share;
                    }
                });
            }
        }
        solve(&mut self.matrix, &mut self.residual)
    }

    /// Levels at rest by implicit Euler with growing steps (pseudo-transient continuation), inputs as they are.
    pub fn settle(&mut self, guess_cm: &[f64]) -> Vec<f64> {
        // Idle tanks may fill or empty here; only a closed circuit's reservoir takes no part.
        let reservoir = closed_reservoir(self.network);
        for (i, unknown) in self.unknowns.iter_mut().enumerate() {
            *unknown = if Some(i) == reservoir { Unknown::None } else { Unknown::Level };
        }
        let mut levels = guess_cm.to_vec();
        let mut step_s = 1.0;
        for _ in 0..MOST_STEPS {
            match self.implicit_step(&levels, step_s) {
                Some(next) => {
                    levels = next;
                    if step_s >= LONGEST_STEP_S {
                        break;
                    }
                    step_s = (3.0 * step_s).min(LONGEST_STEP_S);
                }
                None => step_s *= 0.2,
            }
        }
        levels
    }

    fn implicit_step(&mut self, start: &[f64], step_s: f64) -> Option<Vec<f64>> {
        let mut levels = start.to_vec();
        for _ in 0..30 {
            self.evaluate(&levels, self.network.delta_cm);
            if !self.step_direction(&levels, Some((step_s, start))) {
                return None;
            }
            let change = std::mem::take(&mut self.residual);
            let largest = self.take(&mut levels, &change, 1.0);
            self.residual = change;
            if largest < 1e-12 {
                return Some(levels);
            }
        }
        None
    }
}

/// Gaussian elimination with partial pivoting; the solution replaces the right-hand side. False when singular.
fn solve(matrix: &mut [f64], rhs: &mut [f64]) -> bool {
    /// Pivots below this share of the largest entry are rounding.
    const SINGULAR: f64 = 1e-14;
    let n = rhs.len();
    let scale = matrix.iter().fold(0.0_f64, |a, v| a.max(v.abs()));
    for k in 0..n {
        let pivot = (k..n).max_by(|&a, &b| matrix[a * n + k].abs().total_cmp(&matrix[b * n + k].abs()));
        let Some(pivot) = pivot.filter(|&p| matrix[p * n + k].abs() > SINGULAR * scale) else { return false };
        if pivot != k {
            for j in 0..n {
                matrix.swap(pivot * n + j, k * n + j);
            }
            rhs.swap(pivot, k);
        }
        for i in k + 1..n {
            let factor = matrix[i * n + k] / matrix[k * n + k];
            if factor == 0.0 {
                continue;
            }
            for j in k..n {
                matrix[i * n + j] -= factor * matrix[k * n + j];
            }
            rhs[i] -= factor * rhs[k];
        }
    }
    for i in (0..n).rev() {
        let known: f64 = (i + 1..n).map(|j| matrix[i * n + j] * rhs[j]).sum();
        rhs[i] = (rhs[i] - known) / matrix[i * n + i];
    }
    rhs.iter().all(|v| v.is_finite())
}
