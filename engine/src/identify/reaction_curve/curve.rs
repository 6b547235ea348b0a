//! The step, the two rests and the normalised response between them.

use super::ReactionCurveError;
use crate::identify::FitProblem;

/// Part of the MV's range that counts as a move; sensors of the MV have noise as well.
const MOVE: f64 = 0.05;
/// Fewest rows from the step on.
const RESPONSE_ROWS: usize = 10;
/// How far the PV may move ahead of the step, as part of the response.
const STILL_BEFORE: f64 = 0.05;
/// How far it may move over the last quarter: a first order at rest to 2 %, that is after four time constants, moves by 3.1 %.
const STILL_AFTER: f64 = 0.035;
/// Standard errors below which a movement is the noise's.
const BY_CHANCE: f64 = 3.0;
/// Tails of the response tried for the last rest, as parts of it, the longest first.
const TAILS: [f64; 5] = [0.5, 0.33, 0.2, 0.125, 0.08];
/// How far the PV may move over the tail that is taken.
const TAIL_STILL: f64 = 0.002;
/// Points of the response that are looked at, without noise and with it; longer ones are averaged in groups of rows.
const POINTS: [usize; 2] = [10_000, 1000];
/// Noise, as part of the response, that is worth averaging.
const NOISY: f64 = 1e-3;

/// A reaction curve, ready to be read.
#[derive(Debug, Clone)]
pub(super) struct Curve {
    pub step_row: usize,
    pub mv: [f64; 2],
    pub pv: [f64; 2],
    /// Standard deviation of the PV at rest.
    pub noise: f64,
    /// Times since the step in seconds, not decreasing, and the response from 0 to 1.
    pub t: Vec<f64>,
    pub z: Vec<f64>,
    /// Standard deviation of the noise in `z`.
    pub z_noise: f64,
    /// Time since the step at which the last rest begins, in seconds.
    pub rest_s: f64,
}

pub(super) fn counts(problem: &FitProblem, row: usize) -> bool {
    problem.keep.as_ref().is_none_or(|keep| keep[row])
}

impl Curve {
    pub fn of(problem: &FitProblem) -> Result<Self, ReactionCurveError> {
        problem.check_columns().map_err(ReactionCurveError::Data)?;
        let (step_row, mv) = step(problem)?;
        let column = || problem.options.pv_name.clone();
        let start_s = problem.time_s.get(step_row).copied().unwrap_or(0.0);
        let points = |rows: std::ops::Range<usize>| -> Vec<(f64, f64)> {
            rows.filter(|&row| counts(problem, row))
                .map(|row| (problem.time_s[row] - start_s, problem.pv[row]))
                .collect()
        };
        // A row's PV was measured just before its stamp, so that of the step still belongs to the rest.
        let before = points(0..step_row + 1);
        let after = points(step_row..problem.time_s.len());
        if after.len() < RESPONSE_ROWS || before.is_empty() {
            return Err(ReactionCurveError::TooShort { rows: after.len(), needed: RESPONSE_ROWS });
        }
        let end_s = after[after.len() - 1].0;
        let tail = |part: f64| {
            let from = after.partition_point(|(t, _)| *t < (1.0 - part) * end_s);
            &after[from.min(after.len() - 3)..]
        };
        let first = Line::through(&before);
        let rough = Line::through(tail(0.25));
        let moved = rough.mean - first.mean;
        let noise = first.pooled_noise(&rough);
        if moved == 0.0 || moved.abs() < BY_CHANCE * noise * (first.share() + rough.share()).sqrt() {
            return Err(ReactionCurveError::NoResponse { column: column(), moved, noise });
        }
        let beyond = |line: &Line, still: f64| {
            let moves = line.rise.abs();
            (moves > still * moved.abs() && moves > BY_CHANCE * line.rise_error)
                .then_some(100.0 * moves / moved.abs())
        };
        if let Some(percent) = beyond(&first, STILL_BEFORE) {
            return Err(ReactionCurveError::NotAtRestBefore { column: column(), percent });
        }
        if let Some(percent) = beyond(&rough, STILL_AFTER) {
            return Err(ReactionCurveError::NotAtRestAfter { column: column(), percent });
        }
        let shortest = TAILS[TAILS.len() - 1];
        let part = TAILS.into_iter().find(|part| {
            let line = Line::through(tail(*part));
            line.rise.abs() <= (TAIL_STILL * moved.abs()).max(line.rise_error)
        });
        let part = part.unwrap_or(shortest);
        let last = Line::through(tail(part));
        let pv = [first.mean, last.mean];
        let noise = first.pooled_noise(&last);
        let size = pv[1] - pv[0];
        let most = POINTS[usize::from((noise / size).abs() > NOISY)];
        let group = after.len().div_ceil(most);
        let (mut t, mut z) = (Vec::with_capacity(most), Vec::with_capacity(most));
        for rows in after.chunks(group) {
            let n = rows.len() as f64;
            t.push(rows.iter().map(|r| r.0).sum::<f64>() / n);
            z.push((rows.iter().map(|r| r.1).sum::<f64>() / n - pv[0]) / size);
        }
        let z_noise = (noise / size).abs() / (group as f64).sqrt();
        let rest_s = tail(part)[0].0;
        Ok(Self { step_row, mv, pv, noise, t, z, z_noise, rest_s })
    }
}

/// Row of the one step and the MV on both sides of it.
fn step(problem: &FitProblem) -> Result<(usize, [f64; 2]), ReactionCurveError> {
    let mv = problem.mv;
    let column = || problem.options.mv_name.clone();
    let no_step = || ReactionCurveError::NoStep { column: column() };
    let before =
        problem.options.mv_before.filter(|v| v.is_finite()).or(mv.first().copied()).ok_or_else(no_step)?;
    let (low, high) = mv.iter().fold((before, before), |(a, b), v| (a.min(*v), b.max(*v)));
    let size = high - low;
    if size <= 0.0 {
        return Err(no_step());
    }
    let previous = |row: usize| if row == 0 { before } else { mv[row - 1] };
    let mut moves = (0..mv.len()).filter(|&row| (mv[row] - previous(row)).abs() > MOVE * size);
    let Some(at) = moves.next() else {
        // A ramp in small stairs.
        let stairs = (0..mv.len()).filter(|&row| mv[row] != previous(row)).count();
        return Err(ReactionCurveError::SeveralSteps { column: column(), moves: stairs });
    };
    let more = moves.count();
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let levels = [if at == 0 { before } else { mean(&mv[..at]) }, mean(&mv[at..])];
    let still = |rows: &[f64], level: f64| rows.iter().all(|v| (v - level).abs() <= MOVE * size);
    if more > 0 || !still(&mv[..at], levels[0]) || !still(&mv[at..], levels[1]) {
        let moves = (0..mv.len()).filter(|&row| mv[row] != previous(row)).count();
        return Err(ReactionCurveError::SeveralSteps { column: column(), moves: moves.max(2) });
    }
    Ok((at, levels))
}

/// A straight line through a few rows: where the PV is, how far it moves meanwhile, how much it scatters.
struct Line {
    rows: f64,
    mean: f64,
    /// Movement from the first row to the last, and its standard error.
    rise: f64,
    rise_error: f64,
    /// Sum of squares about the line, and its degrees of freedom.
    scatter: f64,
    freedom: f64,
}

impl Line {
    fn through(points: &[(f64, f64)]) -> Self {
        let rows = points.len() as f64;
        let sum = |f: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(f).sum::<f64>();
        let (middle, mean) = (sum(&|p| p.0) / rows, sum(&|p| p.1) / rows);
        let spread = sum(&|p| (p.0 - middle).powi(2));
        let slope = if spread > 0.0 { sum(&|p| (p.0 - middle) * (p.1 - mean)) / spread } else { 0.0 };
        let span_s = points[points.len() - 1].0 - points[0].0;
        let scatter = sum(&|p| (p.1 - mean - slope * (p.0 - middle)).powi(2));
        let freedom = (rows - 2.0).max(0.0);
        let rise_error =
            if freedom > 0.0 && spread > 0.0 { (scatter / freedom / spread).sqrt() * span_s } else { 0.0 };
        Self { rows, mean, rise: slope * span_s, rise_error, scatter, freedom }
    }

    /// Variance of the mean for noise of variance 1.
    fn share(&self) -> f64 {
        1.0 / self.rows
    }

    fn pooled_noise(&self, other: &Self) -> f64 {
        ((self.scatter + other.scatter) / (self.freedom + other.freedom).max(1.0)).sqrt()
    }
}
