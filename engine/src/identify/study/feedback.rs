//! What of the MV's moves is feedback: the controller at work, and whether anything else tells the process.

use super::condition::median;
use super::controller::{Columns, ControllerFit, fit_controller};
use super::{LoopRecord, RecordFinding};
use crate::identify::{Choice, FitProblem, FitVerdict, ModelFit, Structure};

/// The controller, read in the mode in which it explains the MV best; never where a hand writes the MV.
pub(super) fn controller_of(
    record: &LoopRecord,
    problem: &FitProblem,
    saturated: &[bool],
    findings: &mut Vec<RecordFinding>,
) -> Option<ControllerFit> {
    /// More codes than this are no modes.
    const MODES: usize = 6;
    let rows = problem.time_s.len();
    let sample_time_s = sample_time(problem.time_s);
    let keep = |k: usize| problem.keep.as_ref().is_none_or(|keep| keep[k]);
    let in_mode = |mode: Option<f64>| -> Option<ControllerFit> {
        let usable: Vec<bool> = (0..rows)
            .map(|k| {
                keep(k)
                    && !saturated[k]
                    && mode.is_none_or(|m| record.mode.is_some_and(|column| column.values[k] == m))
            })
            .collect();
        fit_controller(&Columns {
            time_s: problem.time_s,
            pv: problem.pv,
            sp: record.sp,
            mv: record.problem.mv,
            usable: &usable,
            sample_time_s,
        })
    };
    let Some(column) = record.mode else { return in_mode(None) };
    let codes = column.values;
    let mut modes = codes.to_vec();
    modes.sort_by(f64::total_cmp);
    modes.dedup();
    if modes.len() > MODES {
        return in_mode(None);
    }
    let found = modes
        .iter()
        .filter(|mode| !column.is_manual(**mode))
        .filter_map(|&mode| in_mode(Some(mode)).map(|fit| (mode, fit)))
        .max_by(|a, b| a.1.r2.total_cmp(&b.1.r2));
    let changes: Vec<usize> = (1..rows).filter(|&k| codes[k] != codes[k - 1]).collect();
    if let Some(&first) = changes.first() {
        let automatic = codes.iter().copied().find(|code| !column.is_manual(*code)).unwrap_or(codes[0]);
        findings.push(RecordFinding::ModeChanges {
            count: changes.len(),
            at_s: problem.time_s[first],
            mode: column.name(found.as_ref().map_or(automatic, |f| f.0)),
        });
    }
    found.map(|f| f.1)
}

/// Median step of the stamps.
fn sample_time(time_s: &[f64]) -> f64 {
    let mut steps: Vec<f64> = time_s.windows(2).map(|w| w[1] - w[0]).filter(|d| *d > 0.0).collect();
    if steps.is_empty() {
        return 1.0;
    }
    let middle = steps.len() / 2;
    *steps.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Whether what looks like feedback is a hand's smooth motion.
///
/// The law of a PI fits any slow wave and the wave's own answer: two numbers for a size and a phase. Then the motion
/// follows from its own past at least as well as from the PV, and the process explains the PV, with a lag of its own; the
/// inverse of a controller, which feedback alone would show, has none.
pub(super) fn is_by_hand(
    controller: &ControllerFit,
    record: &LoopRecord,
    problem: &FitProblem,
    fits: &[ModelFit],
) -> bool {
    /// Part of the MV's moves up to which rounding of a log reaches.
    const ROUNDING: f64 = 1e-9;
    /// A typical row, the corners of a motion left aside, must follow from the past this much better.
    const TYPICAL: f64 = 0.5;
    /// A law that explains this part of the moves is at work, however long the MV rests between them.
    const EXACT: f64 = 0.95;
    let h_s = sample_time(problem.time_s);
    let explaining: Vec<&ModelFit> = fits.iter().filter(|fit| explains(fit, h_s)).collect();
    if explaining.is_empty() {
        return false;
    }
    if is_still(record) && explaining.iter().any(|fit| is_inverse(controller, fit)) {
        return true;
    }
    let left = 1.0 - controller.r2;
    // What follows the law to the last digit was computed by it.
    if left <= ROUNDING {
        return false;
    }
    let Some(own) = OwnPast::of(record.problem.mv, controller.stride) else { return false };
    let between_corners = controller.r2 < EXACT && own.miss < TYPICAL * controller.miss;
    between_corners || own.part <= left + ROUNDING
}

/// Whether the law is the process read backwards: u = (y + T ẏ)/K, a slow hand's moves out of the PV's answer to them.
///
/// A controller of that gain would feed back the wrong way, with no integral action.
fn is_inverse(controller: &ControllerFit, fit: &ModelFit) -> bool {
    /// Kc K of the inverse of a first order is −1; noise of the PV and moves as fast as the process take from it.
    const GAIN: std::ops::Range<f64> = -1.25..0.0;
    /// Time constants of the process beyond which an integral is none.
    const SLOW: f64 = 10.0;
    let time = |name| fit.parameter(name).map_or(0.0, |p| p.value);
    let gain = fit.parameters[0].value * controller.kc;
    let integrates = controller.ti_s.is_some_and(|ti| ti < SLOW * (time("T_s") + time("L_s")));
    fit.structure != Structure::Ipdt && GAIN.contains(&gain) && !integrates
}

/// Whether the setpoint never moves, or is not known to.
fn is_still(record: &LoopRecord) -> bool {
    record.sp.is_none_or(|sp| sp.iter().all(|v| *v == sp[0]))
}

/// Whether a controller was read from most of the moves that no limit cut off. What a few rows show, such as those ahead of
/// a test, says nothing of the rest.
pub(super) fn reigns(controller: &ControllerFit, saturated: &[bool]) -> bool {
    let needed = 2 * controller.stride + controller.lag_rows + 1;
    let free = saturated.windows(needed).filter(|rows| rows.iter().all(|s| !s)).count();
    2 * controller.rows * controller.stride > free
}

/// Whether a process without a zero explains the PV, to its noise or nearly, and lags the MV.
fn explains(fit: &ModelFit, sample_time_s: f64) -> bool {
    /// Fit in percent from which a process explains its PV, and from which white residuals say that it does.
    const PERCENT: [f64; 2] = [80.0, 20.0];
    /// Sample times that a process lags at least.
    const LAGS: f64 = 2.0;
    let time = |name| fit.parameter(name).map_or(0.0, |p| p.value);
    let lags = fit.structure == Structure::Ipdt || time("T_s") + time("L_s") > LAGS * sample_time_s;
    let enough = PERCENT[usize::from(fit.tests.is_white())];
    lags && fit.structure != Structure::SopdtZero && fit.fit_percent > enough
}

/// What of an MV's moves does not follow from the three before.
struct OwnPast {
    /// Part of their squares.
    part: f64,
    /// Median, in MV units.
    miss: f64,
}

impl OwnPast {
    /// Of the moves over `stride` rows.
    fn of(mv: &[f64], stride: usize) -> Option<Self> {
        const PAST: usize = 3;
        let ends = || mv.iter().step_by(stride);
        let moves: Vec<f64> = ends().zip(ends().skip(1)).map(|(a, b)| b - a).collect();
        if moves.len() < 10 * PAST {
            return None;
        }
        let rows = moves.len() - PAST;
        let past = nalgebra::DMatrix::from_fn(rows, PAST, |i, j| moves[i + j]);
        let now = nalgebra::DVector::from_fn(rows, |i, _| moves[i + PAST]);
        let total = now.norm_squared();
        let weights = past.clone().svd(true, true).solve(&now, 1e-10).ok()?;
        let left = now - past * weights;
        // Corners pull the weights; between them a motion by hand just goes on.
        let mut misses: Vec<f64> = left.iter().map(|v| v.abs()).collect();
        let mut bends: Vec<f64> = moves.windows(2).map(|w| (w[1] - w[0]).abs()).collect();
        let miss = median(&mut misses).min(median(&mut bends));
        (total > 0.0).then(|| Self { part: left.norm_squared() / total, miss })
    }
}

/// A stretch in which the MV does nothing but answer the PV shows the controller, not the process.
pub(super) fn refuse_feedback(
    record: &LoopRecord,
    problem: &FitProblem,
    controller: Option<&ControllerFit>,
    saturated: &[bool],
    choice: &mut Choice,
) {
    /// Part of the MV's moves that feedback explains where nothing else moves it.
    const FEEDBACK: f64 = 0.7;
    /// A setpoint that moves this seldom leaves disturbances the most of the record.
    const FEW_MOVES: usize = 5;
    /// Fit in percent from which a few moves of the setpoint do tell the process.
    const TOLD_PERCENT: f64 = 75.0;
    let throughout = |c: &&ControllerFit| reigns(c, saturated);
    let Some(controller) = controller.filter(|c| c.r2 > FEEDBACK).filter(throughout) else { return };
    let still = is_still(record);
    let one_mode = record.mode.is_none_or(|mode| mode.values.iter().all(|m| *m == mode.values[0]));
    let other_excitation = problem.disturbances.iter().any(|d| d.values.iter().any(|v| *v != d.values[0]));
    if still && one_mode && !other_excitation {
        choice.refuse(&FitVerdict::NoExcitation {
            mv_name: problem.options.mv_name.clone(),
            explained_percent: 100.0 * controller.r2,
        });
        return;
    }
    let setpoint_moves = record.sp.map_or(0, |sp| sp.windows(2).filter(|w| w[0] != w[1]).count());
    let fit_percent = choice.chosen().fit_percent;
    if !still && setpoint_moves < FEW_MOVES && fit_percent < TOLD_PERCENT && one_mode && !other_excitation {
        choice.refuse(&FitVerdict::Disturbed { fit_percent, explained_percent: 100.0 * controller.r2 });
    }
}
