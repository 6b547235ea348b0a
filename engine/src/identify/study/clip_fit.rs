//! Limits of an MV fitted together with the process.
//!
//! For given limits the process is at its best (variable projection once more); its residual r(φ) over the limits φ is
//! differentiable wherever no row lies at one, and Gauss–Newton goes down ‖r‖². The slopes are differences of residuals
//! of two fits, which leaves in them only what no parameter of the process can make up for: the matrix DᵀD is the
//! Schur complement of the limits in that of the joint problem, σ²(DᵀD)⁻¹ their covariance.
//!
//! Source: Golub & Pereyra, SIAM J. Numer. Anal. 10 (1973) 413.

use std::borrow::Cow;

use crate::identify::fit_structure::{free_run, shape_like};
use crate::identify::output_error::{Found, Point, Shape, Symmetric, refine};
use crate::identify::problem::{FitProblem, Stretch};
use crate::identify::statistics::mean;
use crate::identify::{ModelFit, judge};

/// Passes of a fit that starts next to its end.
const PASSES: usize = 20;
const ROUNDS: usize = 20;
/// Shares of a step that are tried.
const SHARES: [f64; 5] = [1.0, 0.5, 0.2, 0.05, 0.01];
/// A step below this many standard errors of the limits changes nothing a reader could see.
const STEP_IN_STANDARD_ERRORS: f64 = 0.01;
/// Difference for a slope, as a part of the distance of the limits.
const DIFFERENCE: f64 = 1e-3;

/// A process with the limits ahead of it.
#[derive(Debug, Clone)]
pub(super) struct LimitsFit {
    /// In MV units.
    pub limits: [f64; 2],
    pub found: Found,
    /// Squared residual over the rows that count.
    pub rss: f64,
}

/// The stretch with its MV kept within limits; every `factor` rows are one.
pub(super) fn clipped<'a>(stretch: &Stretch<'a>, limits: [f64; 2], factor: usize) -> Stretch<'a> {
    let u: Vec<f64> = stretch.u.iter().map(|u| u.clamp(limits[0], limits[1])).collect();
    let u_before = stretch.u_before.clamp(limits[0], limits[1]);
    let kept = Stretch { u_ref: mean(&u), u: Cow::Owned(u), u_before, ..stretch.clone() };
    // The mean of what the valve got, not of what it was asked for: limits come before thinning out.
    if factor > 1 { kept.thinned(factor) } else { kept }
}

/// Limits at which the squared residual is least, from some nearby.
pub(super) fn descend(
    stretch: &Stretch,
    factor: usize,
    shape: &Shape,
    limits: [f64; 2],
    points: &[Point],
) -> Option<LimitsFit> {
    let whole = range(&stretch.u);
    let at = |limits: [f64; 2], points: &[Point]| fit_at(stretch, factor, shape, limits, points);
    let mut best = at(limits, points)?;
    for _ in 0..ROUNDS {
        let slopes = Slopes::of(stretch, factor, shape, &best)?;
        let step = slopes.step();
        let variance = slopes.variance(shape, &best);
        if (0..2).all(|i| step[i].abs() <= STEP_IN_STANDARD_ERRORS * (variance / slopes.square[i][i]).sqrt())
        {
            break;
        }
        let trial = SHARES.iter().find_map(|share| {
            let low = (best.limits[0] + share * step[0]).clamp(whole[0], whole[1]);
            let high = (best.limits[1] + share * step[1]).clamp(whole[0], whole[1]);
            let worth = high - low > 1e-6 * (whole[1] - whole[0]);
            let trial = worth.then(|| at([low, high], &best.found.points)).flatten()?;
            (trial.rss < best.rss).then_some(trial)
        });
        let Some(trial) = trial else { break };
        best = trial;
    }
    Some(best)
}

/// Limits without one that the rows hardly speak for: the squared residual of `rows` rows is as good without it.
pub(super) fn without_idle(stretch: &Stretch, shape: &Shape, fit: LimitsFit) -> LimitsFit {
    /// Logarithm of the likelihood ratio below which a limit explains nothing.
    const EVIDENCE: f64 = 10.0;
    let whole = range(&stretch.u);
    let rows = stretch.kept() as f64;
    let mut best = fit;
    for i in 0..2 {
        let mut limits = best.limits;
        limits[i] = whole[i];
        if limits != best.limits
            && let Some(other) = descend(stretch, 1, shape, limits, &best.found.points)
            && rows * (other.rss / best.rss).ln() < EVIDENCE
        {
            best = other;
        }
    }
    best
}

fn fit_at(
    stretch: &Stretch,
    factor: usize,
    shape: &Shape,
    limits: [f64; 2],
    points: &[Point],
) -> Option<LimitsFit> {
    let found = refine(&clipped(stretch, limits, factor), shape, points, PASSES, &mut 0)?;
    Some(LimitsFit { limits, rss: found.rss(), found })
}

/// What the best process leaves over, by the limits.
struct Slopes {
    residuals: Vec<f64>,
    /// ∂r/∂φ for the lower and the upper limit.
    slopes: [Vec<f64>; 2],
    /// Dynamics and gains of the process with a limit moved, and by how much it was.
    moved: [(Found, f64); 2],
    /// DᵀD.
    square: [[f64; 2]; 2],
}

impl Slopes {
    fn of(stretch: &Stretch, factor: usize, shape: &Shape, at: &LimitsFit) -> Option<Self> {
        let residuals_of =
            |limits: [f64; 2], found: &Found| free_run(&clipped(stretch, limits, factor), shape, found).1;
        let residuals = residuals_of(at.limits, &at.found);
        let width = at.limits[1] - at.limits[0];
        let whole = range(&stretch.u);
        let side = |i: usize| -> Option<(Vec<f64>, (Found, f64))> {
            // A limit that no row passes is none.
            if at.limits[i] == whole[i] {
                return Some((vec![0.0; residuals.len()], (at.found.clone(), 1.0)));
            }
            // Inwards, where there are rows.
            let by = if i == 0 { DIFFERENCE * width } else { -DIFFERENCE * width };
            let mut limits = at.limits;
            limits[i] += by;
            let other = fit_at(stretch, factor, shape, limits, &at.found.points)?;
            let moved = residuals_of(limits, &other.found);
            let slope = moved.iter().zip(&residuals).map(|(a, b)| (a - b) / by).collect();
            Some((slope, (other.found, by)))
        };
        let ((low, low_moved), (high, high_moved)) = (side(0)?, side(1)?);
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let cross = product(&low, &high);
        let square = [[product(&low, &low), cross], [cross, product(&high, &high)]];
        Some(Self { residuals, slopes: [low, high], moved: [low_moved, high_moved], square })
    }

    /// −(DᵀD)⁻¹ Dᵀr; a limit that changes nothing stays.
    fn step(&self) -> [f64; 2] {
        let g = [0, 1].map(|i| -self.slopes[i].iter().zip(&self.residuals).map(|(d, r)| d * r).sum::<f64>());
        self.inverse().map_or([0.0; 2], |c| [0, 1].map(|i| c[i][0] * g[0] + c[i][1] * g[1]))
    }

    /// (DᵀD)⁻¹, with zeros for a limit that changes nothing.
    fn inverse(&self) -> Option<[[f64; 2]; 2]> {
        let [[a, b], [_, d]] = self.square;
        let least = 1e-12 * a.max(d);
        match (a > least, d > least) {
            (true, true) => {
                let determinant = a * d - b * b;
                (determinant > 1e-12 * a * d)
                    .then(|| [[d / determinant, -b / determinant], [-b / determinant, a / determinant]])
            }
            (true, false) => Some([[1.0 / a, 0.0], [0.0, 0.0]]),
            (false, true) => Some([[0.0, 0.0], [0.0, 1.0 / d]]),
            (false, false) => None,
        }
    }

    fn variance(&self, shape: &Shape, at: &LimitsFit) -> f64 {
        let unknowns = shape.unknowns + shape.shared.len() + shape.local.len() + 2;
        at.rss / self.residuals.len().saturating_sub(unknowns).max(1) as f64
    }
}

fn range(values: &[f64]) -> [f64; 2] {
    values.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], v| [a.min(*v), b.max(*v)])
}

/// The stretch of a problem with the rows that a fit of it counted.
fn stretch_like<'a>(problem: &FitProblem<'a>, fit: &ModelFit) -> Option<Stretch<'a>> {
    let stretch = problem.stretch().ok()?;
    Some(stretch.known_after(fit.reach_s).unwrap_or(stretch))
}

/// Limits descended again with the structure of a fit; `problem` holds the MV as it was logged.
pub(super) fn descend_with(problem: &FitProblem, limits: [f64; 2], fit: &ModelFit) -> Option<[f64; 2]> {
    let stretch = stretch_like(problem, fit)?;
    let shape = shape_like(&stretch, fit);
    descend(&stretch, 1, &shape, limits, &fit.points()).map(|f| f.limits)
}

/// Lets the uncertainty of the limits into the intervals of a fit, and gives their standard errors; `problem` holds the
/// MV as it was logged. `None` where the limits cannot be told.
///
/// Cov θ grows by A Cov φ Aᵀ, A = ∂θ/∂φ of the best process over the limits: what the joint Gauss–Newton matrix holds
/// for θ once the limits are eliminated from it.
pub(super) fn allow_for_limits(
    problem: &FitProblem,
    limits: [f64; 2],
    fit: &mut ModelFit,
) -> Option<[f64; 2]> {
    let stretch = stretch_like(problem, fit)?;
    let shape = shape_like(&stretch, fit);
    let at = fit_at(&stretch, 1, &shape, limits, &fit.points())?;
    let slopes = Slopes::of(&stretch, 1, &shape, &at)?;
    let inverse = slopes.inverse()?;
    let variance = slopes.variance(&shape, &at) * fit.tests.rows_per_independent;
    let covariance = |i: usize, j: usize| variance * inverse[i][j];
    let values = |found: &Found| {
        let first = shape.gains[0];
        let gains = fit.coordinates.gains();
        fit.coordinates.values_at(&found.projected.linear.shared[first..first + gains], found.points[0])
    };
    let here = values(&at.found);
    let by_limit: Vec<Vec<f64>> = slopes
        .moved
        .iter()
        .map(|(found, by)| values(found).iter().zip(&here).map(|(a, b)| (a - b) / by).collect())
        .collect();
    let mut added = Symmetric::zero(here.len());
    for i in 0..here.len() {
        for j in 0..here.len() {
            for (a, left) in by_limit.iter().enumerate() {
                for (b, right) in by_limit.iter().enumerate() {
                    added.add(i, j, left[i] * covariance(a, b) * right[j]);
                }
            }
        }
    }
    fit.widen(&added);
    fit.verdicts = judge::of_model(fit, &clipped(&stretch, limits, 1), problem);
    Some([covariance(0, 0).sqrt(), covariance(1, 1).sqrt()])
}
