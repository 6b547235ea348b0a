//! Least squares between the bounds: Levenberg and Marquardt's method on the exact sensitivities.
//!
//! ```text
//! minimise Σ w_o (y − ŷ(p))²,   (JᵀWJ + μ diag JᵀWJ) δ = JᵀW e,   p ← clamp(p + δ)
//! ```
//!
//! An unknown on its bound that wants to go beyond it stands still for the step. Source: Madsen, Nielsen and Tingleff,
//! Methods for non-linear least squares problems, 2nd ed. (2004), 3.2.

use nalgebra::{DMatrix, DVector};

use super::free_run::FreeRun;
use super::problem::Record;
use super::structure::Structure;

/// Step, as a share of the bounds' width, that ends the search.
const SAME_STEP: f64 = 1e-10;

/// Sum of squares with its normal equations.
#[derive(Debug, Clone)]
pub(super) struct Sums {
    pub cost: f64,
    pub gram: DMatrix<f64>,
    pub gradient: DVector<f64>,
}

/// What is searched: the record with the weight of every output, bounds, and which unknowns are free.
pub(super) struct Search<'a> {
    pub structure: &'a Structure,
    pub record: &'a Record,
    /// Weight of each output's rows, in 1/cm².
    pub weights: Vec<f64>,
    pub bounds: &'a [[f64; 2]],
    pub free: &'a [bool],
    pub most_rounds: usize,
    /// Share of the sum of squares that a step has to gain to go on. Without noise every step gains nearly all, down to
    /// the integrator's own errors.
    pub same_cost: f64,
}

/// Where a search ended.
#[derive(Debug, Clone)]
pub(super) struct Found {
    pub unknowns: Vec<f64>,
    pub sums: Sums,
    /// Simulations with sensitivities.
    pub runs: usize,
}

impl Search<'_> {
    /// Sum of squares at these unknowns, with its slopes.
    pub fn sums(&self, unknowns: &[f64]) -> Sums {
        let (p, outputs, weights) = (unknowns.len(), &self.record.outputs, &self.weights);
        let (mut cost, mut gradient) = (0.0, vec![0.0; p]);
        let mut gram = vec![0.0; p * p];
        let mut run = FreeRun::new(self.structure, &self.record.moves, unknowns, true);
        run.run(|row, output, value, slopes| {
            let residual = outputs[output][row] - value;
            if residual.is_nan() {
                return;
            }
            let weight = weights[output];
            cost += weight * residual * residual;
            for (i, &slope) in slopes.iter().enumerate() {
                let weighted = weight * slope;
                gradient[i] += weighted * residual;
                // The lower half; the other follows.
                for (sum, other) in gram[i * p..=i * p + i].iter_mut().zip(slopes) {
                    *sum += weighted * other;
                }
            }
        });
        let gram = DMatrix::from_fn(p, p, |i, j| gram[i.max(j) * p + i.min(j)]);
        let cost = if cost.is_finite() { cost } else { f64::INFINITY };
        Sums { cost, gram, gradient: DVector::from_vec(gradient) }
    }

    /// Sum of squares alone.
    pub fn cost(&self, unknowns: &[f64]) -> f64 {
        let mut cost = 0.0;
        FreeRun::new(self.structure, &self.record.moves, unknowns, false).run(|row, output, value, _| {
            let residual = self.record.outputs[output][row] - value;
            if !residual.is_nan() {
                cost += self.weights[output] * residual * residual;
            }
        });
        if cost.is_finite() { cost } else { f64::INFINITY }
    }

    /// Goes downhill from a start until nothing is gained.
    pub fn descend(&self, start: &[f64]) -> Found {
        let clamp = |i: usize, x: f64| x.clamp(self.bounds[i][0], self.bounds[i][1]);
        let mut unknowns: Vec<f64> = start.iter().enumerate().map(|(i, &x)| clamp(i, x)).collect();
        let mut sums = self.sums(&unknowns);
        let (mut damping, mut growth, mut runs) = (1e-4, 2.0, 1);
        for _ in 0..self.most_rounds {
            let moving = self.moving(&unknowns, &sums);
            let Some(step) = damped_step(&sums, &moving, damping) else { break };
            let mut next = unknowns.clone();
            for (&i, step) in moving.iter().zip(step.iter()) {
                next[i] = clamp(i, unknowns[i] + step);
            }
            let width = |i: usize| self.bounds[i][1] - self.bounds[i][0];
            let moved =
                moving.iter().map(|&i| ((next[i] - unknowns[i]) / width(i)).abs()).fold(0.0, f64::max);
            if moved < SAME_STEP {
                break;
            }
            let change = DVector::from_fn(next.len(), |i, _| next[i] - unknowns[i]);
            let predicted = 2.0 * change.dot(&sums.gradient) - change.dot(&(&sums.gram * &change));
            if damping < 1.0 && predicted.abs() < self.same_cost * sums.cost {
                break;
            }
            let there = self.sums(&next);
            runs += 1;
            let gained = sums.cost - there.cost;
            if gained > 0.0 {
                let ratio = gained / predicted.max(f64::MIN_POSITIVE);
                damping = (damping * (1.0 - (2.0 * ratio - 1.0).powi(3)).max(0.1)).max(1e-15);
                growth = 2.0;
                let ends = gained < self.same_cost * sums.cost;
                (unknowns, sums) = (next, there);
                if ends {
                    break;
                }
            } else {
                (damping, growth) = (damping * growth, growth * 2.0);
                if damping > 1e12 {
                    break;
                }
            }
        }
        Found { unknowns, sums, runs }
    }

    /// Unknowns that may move: free, and not held by a bound.
    fn moving(&self, unknowns: &[f64], sums: &Sums) -> Vec<usize> {
        let held = |i: usize| {
            let ([low, high], wants) = (self.bounds[i], sums.gradient[i]);
            (unknowns[i] <= low && wants <= 0.0) || (unknowns[i] >= high && wants >= 0.0)
        };
        (0..unknowns.len()).filter(|&i| self.free[i] && sums.gram[(i, i)] > 0.0 && !held(i)).collect()
    }
}

/// The step of some unknowns; `None` where there is none.
fn damped_step(sums: &Sums, moving: &[usize], damping: f64) -> Option<DVector<f64>> {
    if moving.is_empty() || !sums.cost.is_finite() {
        return None;
    }
    let scale: Vec<f64> = moving.iter().map(|&i| sums.gram[(i, i)].sqrt()).collect();
    let n = moving.len();
    let matrix = DMatrix::from_fn(n, n, |a, b| {
        let entry = sums.gram[(moving[a], moving[b])] / (scale[a] * scale[b]);
        if a == b { entry + damping + 1e-14 } else { entry }
    });
    let right = DVector::from_fn(n, |a, _| sums.gradient[moving[a]] / scale[a]);
    let step = matrix.cholesky()?.solve(&right);
    Some(DVector::from_fn(n, |a, _| step[a] / scale[a]))
}
