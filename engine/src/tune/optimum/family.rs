//! The processes of one problem together: their points, their stabilising gains, the check of a candidate.

use super::points::{Plant, Points};
use super::problem::{LoopLimits, Process};
use super::slice::Lead;
use crate::analyze::{FrequencyResponseError, OpenLoop, Peaks, is_loop_stable, measured_peaks, peaks};
use crate::control::ParallelGains;

/// The processes, the sign of their gain turned positive.
#[derive(Debug, Clone)]
pub(super) struct Family<'a> {
    pub plants: Vec<Plant<'a>>,
    /// Sign of the controller's gains.
    pub sign: f64,
    pub points: Points,
    /// End of each plant's own points; those that a check adds come after all.
    ends: Vec<usize>,
    halvings: Vec<u32>,
}

impl<'a> Family<'a> {
    pub fn new(processes: &'a [Process], sign: f64) -> Self {
        let plants: Vec<Plant<'a>> = processes.iter().map(Plant::new).collect();
        let mut points = Points::default();
        let mut ends = Vec::with_capacity(plants.len());
        for plant in &plants {
            plant.push_points(sign, &mut points);
            ends.push(points.len());
        }
        let halvings = vec![0; plants.len()];
        Self { plants, sign, points, ends, halvings }
    }

    /// Adds a frequency of a plant, to be met from now on.
    pub fn add(&mut self, plant: usize, omega: f64) {
        let g = self.sign * self.plants[plant].at_omega(omega);
        self.points.push(omega, g);
    }

    /// Halves the distances between the points of a plant, a few times at most.
    pub fn refine(&mut self, plant: usize) {
        const MOST: u32 = 4;
        if self.halvings[plant] >= MOST {
            return;
        }
        let own: Vec<f64> = self.points.omega[self.own_points(plant)].to_vec();
        self.halvings[plant] += 1;
        let parts = 1 << self.halvings[plant];
        for pair in own.windows(2) {
            for k in (1..parts).step_by(2) {
                self.add(plant, pair[0] * (pair[1] / pair[0]).powf(f64::from(k) / f64::from(parts)));
            }
        }
    }

    /// Whether points have been added between those that a plant started with.
    pub fn is_refined(&self) -> bool {
        self.halvings.iter().any(|times| *times > 0)
    }

    /// Whether the static gain of a process has the other sign than the controller, as an odd number of unstable poles
    /// wants it.
    pub fn is_reversed(&self) -> bool {
        self.plants.iter().any(|p| p.low.power == 0 && self.sign * p.low.coefficient < 0.0)
    }

    /// Gains with their sign, as a controller of the parallel form.
    pub fn gains(&self, lead: Lead, kp: f64, ki: f64) -> ParallelGains {
        ParallelGains {
            kp: self.sign * kp,
            ki: self.sign * ki,
            kd: self.sign * kp * lead.td_s,
            tf_s: lead.tf_s,
        }
    }

    /// Where a plant's own points stand among all.
    pub fn own_points(&self, plant: usize) -> std::ops::Range<usize> {
        let start = if plant == 0 { 0 } else { self.ends[plant - 1] };
        start..self.ends[plant]
    }

    /// Whether every loop is stable.
    pub fn is_stable(&self, lead: Lead, kp: f64, ki: f64) -> bool {
        (0..self.plants.len()).all(|i| self.is_one_stable(i, lead, kp, ki))
    }

    /// Whether one of them is.
    pub fn is_one_stable(&self, plant: usize, lead: Lead, kp: f64, ki: f64) -> bool {
        let gains = self.gains(lead, kp, ki);
        match self.plants[plant].process {
            Process::Model(model) => is_loop_stable(&OpenLoop::of_parallel(model, &gains)),
            Process::Measured(response) => matches!(measured_peaks(response, &gains), Ok(Some(_))),
        }
    }

    /// Peaks of one loop; `Ok(None)` where it is unstable.
    pub fn peaks(
        &self,
        plant: usize,
        gains: &ParallelGains,
    ) -> Result<Option<Peaks>, FrequencyResponseError> {
        match self.plants[plant].process {
            Process::Model(model) => Ok(peaks(&OpenLoop::of_parallel(model, gains))),
            Process::Measured(response) => measured_peaks(response, gains),
        }
    }

    /// The least Ju of any controller with integral action: 1/|G(0)|, 0 where every process integrates.
    pub fn least_ju(&self) -> f64 {
        self.plants.iter().map(Plant::least_ju).fold(0.0, f64::max)
    }

    /// Kp beyond which the limits at ω → ∞ are not met.
    pub fn largest_kp(&self, lead: Lead, limits: &LoopLimits) -> f64 {
        let mut largest = f64::INFINITY;
        for plant in &self.plants {
            let high = plant.high.abs();
            if high == 0.0 {
                largest = largest.min(limits.ju / lead.high());
            } else if plant.dead_time_s > 0.0 {
                // Ripples come as near to −1 as 1 − |L(∞)|.
                let room = (1.0 - 1.0 / limits.ms).min(limits.mt / (1.0 + limits.mt));
                let of_ju = limits.ju / (1.0 + limits.ju * high);
                let of_ju = if of_ju.is_nan() { 1.0 / high } else { of_ju };
                largest = largest.min((room / high).min(of_ju) / lead.high());
            }
        }
        largest
    }
}
