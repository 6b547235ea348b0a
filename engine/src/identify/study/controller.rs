//! The controller at work in a log: its gains from what it did.

use super::condition::median;
use crate::control::PidGains;
use crate::identify::fopdt::Interval;
use crate::identify::output_error::Symmetric;
use crate::identify::statistics::student_95;

/// A PI or PID controller as the log shows it, ideal form u = Kc (b SP − PV + ∫e dt/Ti − Td dPV/dt).
#[derive(Debug, Clone, PartialEq)]
pub struct ControllerFit {
    /// Kc in MV units per PV unit; negative where the MV rises with the PV.
    pub kc: f64,
    /// Its 95 % interval.
    pub kc_interval_95: Interval,
    /// Ti in seconds; absent without integral action.
    pub ti_s: Option<f64>,
    /// Its 95 % interval; the upper end ∞ where integral action is not told from none.
    pub ti_interval_95: Option<Interval>,
    /// Td in seconds; absent where derivative action is not told from none.
    pub td_s: Option<f64>,
    /// Its 95 % interval.
    pub td_interval_95: Option<Interval>,
    /// b: whether the proportional part acts on the setpoint.
    pub setpoint_weight: f64,
    /// Part of the MV's moves that the law explains.
    pub r2: f64,
    /// Median of what the law leaves of a move, in MV units.
    pub miss: f64,
    /// Moves regressed on.
    pub rows: usize,
    /// Rows from a PV to the MV that answers it.
    pub lag_rows: usize,
    /// Rows a move spans.
    pub stride: usize,
}

impl ControllerFit {
    /// The gains in the parallel form the engine computes with; `None` without proportional action.
    #[must_use]
    pub fn gains(&self) -> Option<PidGains> {
        let gains = match (self.ti_s, self.td_s) {
            (None, _) => PidGains::p(self.kc),
            (Some(ti_s), None) => PidGains::pi(self.kc, ti_s),
            (Some(ti_s), Some(td_s)) => PidGains::pid(self.kc, ti_s, td_s),
        };
        gains.validated().ok()
    }
}

/// Columns a controller is read from; all of N rows.
#[derive(Debug, Clone, Copy)]
pub(super) struct Columns<'a> {
    pub time_s: &'a [f64],
    pub pv: &'a [f64],
    /// Setpoint; absent: taken to stand still at an unknown value.
    pub sp: Option<&'a [f64]>,
    pub mv: &'a [f64],
    /// Rows that the controller wrote freely: in automatic, not at a limit.
    pub usable: &'a [bool],
    pub sample_time_s: f64,
}

/// Regresses the moves of the MV on those of the error: Δu = Kc (b Δr − Δy) + Kc/Ti ∫e dt − Kc Td Δ²y/h.
///
/// Tries moves over 1 to 8 rows, an answer in the same row and in the next, and b = 0 and 1; takes what explains the
/// moves best. `None` below 20 spans, where the MV moves in fewer than ten rows, where nothing explains a third of the
/// moves, or where not even the sign of Kc is told: then a hand moves the MV.
pub(super) fn fit_controller(columns: &Columns) -> Option<ControllerFit> {
    const EXPLAINED: f64 = 0.33;
    const STRIDES: [usize; 4] = [1, 2, 4, 8];
    /// A longer stride must explain this much more of its moves.
    const WORTH: f64 = 0.02;
    /// A controller answers row after row. While the MV stands still a first order obeys the law of a PI with Ti = T, so
    /// that a step by hand soon after the first row would pass for its doing.
    const ROWS_MOVED: usize = 10;
    if columns.mv.windows(2).filter(|w| w[0] != w[1]).count() < ROWS_MOVED {
        return None;
    }
    let moving = columns.sp.is_some_and(|sp| sp.iter().any(|v| *v != sp[0]));
    let mut best: Option<ControllerFit> = None;
    for stride in STRIDES {
        for lag_rows in [0, 1] {
            for setpoint_weight in if moving { &[1.0, 0.0][..] } else { &[1.0][..] } {
                let Some(fit) = regress(columns, stride, lag_rows, *setpoint_weight) else { continue };
                let margin = best.as_ref().map_or(0.0, |b| if b.stride < stride { WORTH } else { 0.0 });
                if best.as_ref().is_none_or(|b| fit.r2 > b.r2 + margin) {
                    best = Some(fit);
                }
            }
        }
    }
    let [low, high] = best.as_ref()?.kc_interval_95;
    best.filter(|b| b.r2 > EXPLAINED && low * high > 0.0)
}

/// Regressors of a move: proportional, integral, derivative, and a constant where the setpoint is unknown.
const COUNT: usize = 4;
/// Place of the constant.
const CONSTANT: usize = 3;
/// Part of the moves' squares that rounding of a log may leave.
const ROUNDING: f64 = 1e-12;

fn regress(c: &Columns, stride: usize, lag: usize, b: f64) -> Option<ControllerFit> {
    let rows = moves(c, stride, lag, b);
    let with_constant = c.sp.is_none();
    let derivative = solve(&rows, &[true, true, true, with_constant])?;
    // Derivative action stays in only where it is beyond doubt.
    let keep = derivative.values[2].abs() > 4.0 * derivative.errors[2]
        && derivative.values[2] * derivative.values[0] > 0.0;
    let solved = if keep { derivative } else { solve(&rows, &[true, true, false, with_constant])? };
    let [kp, ki, kd, _] = solved.values;
    let t = student_95(rows.len().saturating_sub(3));
    let around = |value: f64, error: f64| [value - t * error, value + t * error];
    let ratio = |value: f64, i: usize, inverse: bool| -> Interval {
        // Delta method of kp/ki or kd/kp.
        let relative = (solved.errors[0] / kp).powi(2) + (solved.errors[i] / solved.values[i]).powi(2)
            - 2.0 * solved.cross[i] / (kp * solved.values[i]);
        let error = value.abs() * relative.max(0.0).sqrt();
        let high = if inverse && solved.values[i].abs() < t * solved.errors[i] {
            f64::INFINITY
        } else {
            value + t * error
        };
        [(value - t * error).max(0.0), high]
    };
    let integral = kp * ki > 0.0 && solved.errors[1] > 0.0;
    let ti_s = integral.then(|| kp / ki);
    // A controller that integrates the error of the row before, or the mean of both, makes the same moves with another
    // Kc: Kc Δe + Ki h e₋₁ = (Kc − Ki h) Δe + Ki h e. The log does not tell which.
    let other_sums_s = if integral { c.sample_time_s } else { 0.0 };
    let mut kc_interval_95 = around(kp, solved.errors[0]);
    kc_interval_95[usize::from(kp > 0.0)] += ki * other_sums_s;
    let td_s = keep.then(|| kd / kp);
    Some(ControllerFit {
        kc: kp,
        kc_interval_95,
        ti_s,
        ti_interval_95: ti_s.map(|ti| ratio(ti, 1, true)).map(|[low, high]| [low, high + other_sums_s]),
        td_s,
        td_interval_95: td_s.map(|td| ratio(td, 2, false)),
        setpoint_weight: b,
        r2: solved.r2,
        miss: solved.miss,
        rows: rows.len(),
        lag_rows: lag,
        stride,
    })
}

/// One move: regressors and Δu.
type Move = ([f64; COUNT], f64);

fn moves(c: &Columns, stride: usize, lag: usize, b: f64) -> Vec<Move> {
    let n = c.mv.len();
    let sp = |k: usize| c.sp.map_or(0.0, |sp| sp[k]);
    let mut out = Vec::new();
    let mut k = lag + 2 * stride;
    while k < n {
        let (now, last, before) = (k - lag, k - lag - stride, k - lag - 2 * stride);
        let whole = (before..=k).all(|i| c.usable[i]);
        let even = (c.time_s[k] - c.time_s[k - stride]) < 1.5 * stride as f64 * c.sample_time_s
            && (c.time_s[last] - c.time_s[before]) < 1.5 * stride as f64 * c.sample_time_s;
        if whole && even {
            let span_s = c.time_s[now] - c.time_s[last];
            let moved = b * (sp(now) - sp(last)) - (c.pv[now] - c.pv[last]);
            // The integral of a sampled controller: each row's error for its sample time.
            let integral: f64 =
                (last + 1..=now).map(|i| (sp(i) - c.pv[i]) * (c.time_s[i] - c.time_s[i - 1])).sum();
            let bend = -((c.pv[now] - c.pv[last]) - (c.pv[last] - c.pv[before])) / span_s.max(1e-9);
            out.push(([moved, integral, bend, span_s], c.mv[k] - c.mv[k - stride]));
        }
        // Moves that share rows are not independent: take each row once.
        k += stride;
    }
    out
}

struct Solved {
    values: [f64; COUNT],
    errors: [f64; COUNT],
    /// Covariance with the first value.
    cross: [f64; COUNT],
    r2: f64,
    /// Median size of what is left.
    miss: f64,
}

fn solve(rows: &[Move], wanted: &[bool; COUNT]) -> Option<Solved> {
    const ROWS: usize = 20;
    if rows.len() < ROWS {
        return None;
    }
    let places: Vec<usize> = (0..COUNT).filter(|&i| wanted[i]).collect();
    let size = places.len();
    let mut matrix = Symmetric::zero(size);
    let mut rhs = vec![0.0; size];
    let (mut total, mut of_constant) = (0.0, [0.0; 2]);
    for (x, y) in rows {
        total += y * y;
        of_constant = [of_constant[0] + x[CONSTANT] * y, of_constant[1] + x[CONSTANT] * x[CONSTANT]];
        for (a, &i) in places.iter().enumerate() {
            rhs[a] += x[i] * y;
            for (b, &j) in places.iter().enumerate() {
                matrix.add(a, b, x[i] * x[j]);
            }
        }
    }
    let inverse = matrix.inverse()?;
    let mut out =
        Solved { values: [0.0; COUNT], errors: [0.0; COUNT], cross: [0.0; COUNT], r2: 0.0, miss: 0.0 };
    for (a, &i) in places.iter().enumerate() {
        out.values[i] = (0..size).map(|b| inverse.at(a, b) * rhs[b]).sum();
    }
    let mut misses: Vec<f64> = rows
        .iter()
        .map(|(x, y)| (y - places.iter().map(|&i| out.values[i] * x[i]).sum::<f64>()).abs())
        .collect();
    let left: f64 = misses.iter().map(|miss| miss * miss).sum();
    out.miss = median(&mut misses);
    let variance = left / rows.len().saturating_sub(size).max(1) as f64;
    for (a, &i) in places.iter().enumerate() {
        out.errors[i] = (variance * inverse.at(a, a)).sqrt();
        out.cross[i] = variance * inverse.at(0, a);
    }
    // A straight line of the MV is no answer to the PV, nor is what rounding leaves of one.
    let line =
        if wanted[CONSTANT] { of_constant[0].powi(2) / of_constant[1].max(f64::MIN_POSITIVE) } else { 0.0 };
    let answered = total - line;
    out.r2 = if answered > ROUNDING * total { 1.0 - left / answered } else { 0.0 };
    (out.values[0].is_finite() && out.values[0] != 0.0).then_some(out)
}
