//! The estimates of the field beside least squares, from one step of the MV between two rests.
//!
//! Each method reads a few features off the curve; K is the same for all of them, Δy/Δu between the two rests. They
//! say what a hand with a ruler would find, so that it can be held against the fit of all rows.

mod curve;
mod error;
mod methods;

use super::{FitProblem, Structure, fit_model, simulate_fopdt};
use crate::model::Fopdt;

use curve::Curve;
pub use error::ReactionCurveError;

/// How a first order with dead time is read off a reaction curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum CurveMethod {
    /// The steepest tangent: L where it leaves the first rest, L + T where it meets the last.
    Tangent,
    /// T = 1.5 (t63.2 − t28.3), L = t63.2 − T.
    TwoPoints,
    /// L when the PV begins to respond, T = t63.2 − L.
    Onset,
    /// L + T is the area between curve and last rest, T = e × the area under the curve up to L + T.
    Area,
    /// Least squares on all rows.
    LeastSquares,
}

impl CurveMethod {
    /// All of them, in the order they are shown.
    pub const ALL: [Self; 5] = [Self::Tangent, Self::TwoPoints, Self::Onset, Self::Area, Self::LeastSquares];

    /// As files and the command line name it.
    #[must_use]
    pub fn key(self) -> &'static str {
        match self {
            Self::Tangent => "tangent",
            Self::TwoPoints => "two_points",
            Self::Onset => "onset",
            Self::Area => "area",
            Self::LeastSquares => "least_squares",
        }
    }
}

/// What one method finds.
#[derive(Debug, Clone, PartialEq)]
pub struct CurveEstimate {
    /// The method.
    pub method: CurveMethod,
    /// Its model.
    pub model: Fopdt,
    /// 1 − ‖y − ŷ‖²/‖y − ȳ‖² over the rows that count; negative where a straight line would do better.
    pub r2: f64,
    /// ŷ from the first rest on, one value a row, in PV units.
    pub simulated: Vec<f64>,
}

/// A step between two rests, and what the methods find in it.
#[derive(Debug, Clone, PartialEq)]
pub struct ReactionCurve {
    /// Row from which the MV is another.
    pub step_row: usize,
    /// Its time stamp, in seconds.
    pub step_time_s: f64,
    /// MV before and after, in MV units.
    pub mv: [f64; 2],
    /// PV of the rests before and after, in PV units.
    pub pv: [f64; 2],
    /// Standard deviation of the PV at rest, in PV units.
    pub noise: f64,
    /// In the order of [`CurveMethod::ALL`]; a method that finds no positive time constant is left out.
    pub estimates: Vec<CurveEstimate>,
}

impl ReactionCurve {
    /// What one method finds.
    #[must_use]
    pub fn estimate(&self, method: CurveMethod) -> Option<&CurveEstimate> {
        self.estimates.iter().find(|e| e.method == method)
    }
}

/// Reads K, T and L off a reaction curve by every method.
///
/// The record needs one step of the MV, the PV at rest before it (with `mv_before` and a step in the first row that row
/// is the rest) and at rest again at its end. Times count from the step; a dead time below 0 is taken as 0. Rests are
/// means over many rows, crossings and slopes come from local parabolas as wide as the noise at rest demands, so that
/// without noise the answers are exact up to the sampling. Linear in the number of rows but for the least squares.
///
/// # Errors
/// [`ReactionCurveError`]: malformed data, no step or several, no response, not at rest before or after.
///
/// Sources: Ziegler & Nichols, Trans. ASME 64 (1942) 759 (tangent); Smith, `InTech` 4/1972 and Smith & Corripio, Principles
/// and Practice of Automatic Process Control, 2nd ed., 7-2.3 (two points); Anais do XX CBA (2014) 3322 (onset);
/// Åström & Hägglund, PID Controllers, 2nd ed. (1995), 2.4 (area).
pub fn reaction_curve(problem: &FitProblem) -> Result<ReactionCurve, ReactionCurveError> {
    let curve = Curve::of(problem)?;
    let gain = (curve.pv[1] - curve.pv[0]) / (curve.mv[1] - curve.mv[0]);
    let mut estimates = Vec::new();
    for method in CurveMethod::ALL {
        let estimate = if method == CurveMethod::LeastSquares {
            least_squares(problem, &curve)
        } else {
            methods::times(&curve, method)
                .and_then(|(time_constant_s, dead_time_s)| {
                    Fopdt::new(gain, time_constant_s, dead_time_s.max(0.0)).ok()
                })
                .and_then(|model| by_hand(problem, &curve, method, model))
        };
        estimates.extend(estimate);
    }
    Ok(ReactionCurve {
        step_row: curve.step_row,
        step_time_s: problem.time_s[curve.step_row],
        mv: curve.mv,
        pv: curve.pv,
        noise: curve.noise,
        estimates,
    })
}

/// A model run from the first rest.
fn by_hand(problem: &FitProblem, curve: &Curve, method: CurveMethod, model: Fopdt) -> Option<CurveEstimate> {
    let bias = curve.pv[0] - model.gain * curve.mv[0];
    let simulated = simulate_fopdt(&model, problem.time_s, problem.mv, curve.mv[0], bias, None).ok()?;
    Some(CurveEstimate { method, model, r2: r2(problem, &simulated), simulated })
}

fn least_squares(problem: &FitProblem, curve: &Curve) -> Option<CurveEstimate> {
    let mut problem = problem.clone();
    problem.options.mv_before = Some(curve.mv[0]);
    let fit = fit_model(&problem, Structure::Fopdt).ok()?;
    let crate::model::ProcessModel::Fopdt(model) = fit.model else { return None };
    Some(CurveEstimate { method: CurveMethod::LeastSquares, model, r2: fit.r2, simulated: fit.simulated })
}

fn r2(problem: &FitProblem, simulated: &[f64]) -> f64 {
    let counted = |row: usize| curve::counts(problem, row);
    let rows = || (0..simulated.len()).filter(|&row| counted(row));
    let mean = rows().map(|row| problem.pv[row]).sum::<f64>() / rows().count().max(1) as f64;
    let left: f64 = rows().map(|row| (problem.pv[row] - simulated[row]).powi(2)).sum();
    let all: f64 = rows().map(|row| (problem.pv[row] - mean).powi(2)).sum();
    1.0 - left / all
}
