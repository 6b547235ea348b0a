//! Net inflow of every tank and its exact derivatives, for steady states and linearisation.
//!
//! Streams are as in the integrator; a tank at its rim passes on what it cannot hold.

use super::network::Network;
use super::spec::ValveDrive;

/// δ = 0 has no finite slope at zero head; a tiny δ keeps Newton's method going.
const LEAST_DELTA_CM: f64 = 1e-9;

/// Buffers of one evaluation; made once, evaluated often.
#[derive(Debug, Clone)]
pub(super) struct Flows {
    /// Net inflow in cm³/s; 0 for a tank that spills.
    pub net_cm3_s: Vec<f64>,
    /// ∂net/∂level in cm²/s, row by row.
    pub slope_cm2_s: Vec<f64>,
    /// Tanks held at their rim by what flows in.
    pub spilling: Vec<bool>,
}

impl Flows {
    pub fn new(tanks: usize) -> Self {
        Self {
            net_cm3_s: vec![0.0; tanks],
            slope_cm2_s: vec![0.0; tanks * tanks],
            spilling: vec![false; tanks],
        }
    }

    /// At levels in cm, pumped flows in cm³/s and k(α) of the valves.
    pub fn evaluate(
        &mut self,
        network: &Network,
        coefficients: &[f64],
        pumped_cm3_s: &[f64],
        levels_cm: &[f64],
        delta_cm: f64,
    ) {
        let n = levels_cm.len();
        self.net_cm3_s.fill(0.0);
        self.slope_cm2_s.fill(0.0);
        for (pump, &flow) in network.pumps.iter().zip(pumped_cm3_s) {
            for &(to, share) in &pump.outlets {
                self.net_cm3_s[to] += share * flow;
            }
            if let Some(from) = pump.from {
                self.net_cm3_s[from] -= flow;
            }
        }
        for (valve, &k) in network.valves.iter().zip(coefficients) {
            if k == 0.0 {
                continue;
            }
            let (from, head) = (valve.from, valve.head_cm(levels_cm));
            let flow = valve.law.flow_cm3_s(k, head, delta_cm);
            let slope = valve.law.slope_cm2_s(k, head, delta_cm.max(LEAST_DELTA_CM));
            self.net_cm3_s[from] -= flow;
            self.slope_cm2_s[from * n + from] -= slope;
            if let Some(to) = valve.to {
                self.net_cm3_s[to] += flow;
                self.slope_cm2_s[to * n + from] += slope;
                if valve.drive == ValveDrive::Between {
                    self.slope_cm2_s[from * n + to] += slope;
                    self.slope_cm2_s[to * n + to] -= slope;
                }
            }
        }
        self.pass_on(network, levels_cm);
    }

    /// Tanks at the rim into which more flows than out of them hand the rest to where they spill.
    fn pass_on(&mut self, network: &Network, levels_cm: &[f64]) {
        let n = levels_cm.len();
        self.spilling.fill(false);
        // A chain of spills is at most as long as there are tanks; water that went round in a ring is lost here.
        for _ in 0..n {
            let mut moved = false;
            for (i, tank) in network.tanks.iter().enumerate() {
                if levels_cm[i] < tank.height_cm || self.net_cm3_s[i] <= 0.0 {
                    continue;
                }
                moved = true;
                self.spilling[i] = true;
                let net = std::mem::take(&mut self.net_cm3_s[i]);
                if let Some(to) = tank.spills_to {
                    self.net_cm3_s[to] += tank.spill_share * net;
                }
                for j in 0..n {
                    let slope = std::mem::take(&mut self.slope_cm2_s[i * n + j]);
                    if let Some(to) = tank.spills_to {
                        self.slope_cm2_s[to * n + j] += tank.spill_share * slope;
                    }
                }
            }
            if !moved {
                break;
            }
        }
    }

    /// Where a stream into tank `i` ends up: itself, or the first tank down the spills that holds it; and the share of
    /// the stream that gets there.
    pub fn destination(&self, network: &Network, i: usize) -> Option<(usize, f64)> {
        let (mut at, mut share) = (i, 1.0);
        for _ in 0..self.spilling.len() {
            if !self.spilling[at] {
                return Some((at, share));
            }
            share *= network.tanks[at].spill_share;
            at = network.tanks[at].spills_to?;
        }
        None
    }

    /// What one cm³/s of a pump adds to each tank's net inflow, through `add(tank, share)`.
    pub fn pump_column(&self, network: &Network, pump: usize, mut add: impl FnMut(usize, f64)) {
        let pump = &network.pumps[pump];
        let mut into = |tank: usize, share: f64| {
            if let Some((to, kept)) = self.destination(network, tank) {
                add(to, share * kept);
            }
        };
        for &(to, share) in &pump.outlets {
            into(to, share);
        }
        if let Some(from) = pump.from {
            into(from, -1.0);
        }
    }
}

/// Whether no stream depends on a tank's level, with these k(α).
pub(super) fn is_idle(network: &Network, coefficients: &[f64], tank: usize) -> bool {
    network.valves.iter().zip(coefficients).all(|(valve, &k)| {
        let by_end = valve.drive == ValveDrive::Between && valve.to == Some(tank);
        k == 0.0 || !(valve.from == tank || by_end)
    })
}

/// The reservoir of a closed circuit: its level follows from the water.
pub(super) fn closed_reservoir(network: &Network) -> Option<usize> {
    network.reservoir.filter(|_| network.spec.water_cm3.is_some())
}
