//! A stretch of a loop's log, studied as a whole: rows that are no measurements, the process, the controller, the valve.
//!
//! [`study_loop`] is what a face calls. It never fits through what it has seen: rows it doesn't trust don't count, an
//! MV logged ahead of its limits is taken at them, and a stretch in which nothing but feedback moves the MV gets a
//! reasoned no instead of a model.

mod clip;
mod clip_fit;
mod condition;
mod controller;
mod feedback;
mod finding;
mod interpolated;
mod limited;
mod mode;
mod pulses;
mod spikes;
mod stiction;
mod valve;

use std::borrow::Cow;

pub use controller::ControllerFit;
pub use finding::RecordFinding;
pub use mode::ModeColumn;
pub use stiction::Oscillation;

use super::{
    Choice, FitError, FitProblem, Loads, ReactionCurve, ReactionCurveError, Structure, choose_among,
    reaction_curve,
};
use crate::analyze::is_closed_loop_stable;
use crate::model::ProcessModel;
use condition::{Rows, condition, mended, slips};
use feedback::{controller_of, is_by_hand, refuse_feedback, reigns};
use limited::Limited;

/// What is asked of a study.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StudyOptions {
    /// Structure to fit; absent: all, the best first.
    pub structure: Option<Structure>,
    /// Limits of the MV, where the log holds it ahead of them.
    pub mv_limits: Option<[f64; 2]>,
    /// Takes every row as it is: no row is left out, no limit is looked for.
    pub as_is: bool,
}

/// A loop's record: the problem of the fit, with setpoint and mode where the log has them.
#[derive(Debug, Clone)]
pub struct LoopRecord<'a> {
    /// PV, MV, time, disturbances, what is known of them.
    pub problem: FitProblem<'a>,
    /// Setpoint, N rows.
    pub sp: Option<&'a [f64]>,
    /// Mode, N rows.
    pub mode: Option<ModeColumn<'a>>,
}

/// What a stretch of a loop's log says.
#[derive(Debug, Clone, PartialEq)]
pub struct LoopStudy {
    /// Fits of the process, best first, or why there is none.
    pub choice: Result<Choice, FitError>,
    /// The controller at work, where one can be seen.
    pub controller: Option<ControllerFit>,
    /// Regular oscillation, where there is one.
    pub oscillation: Option<Oscillation>,
    /// Estimates of the reaction curve where the stretch is one step between two rests, or why there are none.
    pub reaction_curve: Result<ReactionCurve, ReactionCurveError>,
    /// What else was seen.
    pub findings: Vec<RecordFinding>,
}

impl LoopStudy {
    /// Whether the stretch gives a model.
    #[must_use]
    pub fn has_model(&self) -> bool {
        self.choice.as_ref().is_ok_and(|c| c.chosen().is_usable())
    }
}

/// Studies a stretch.
///
/// # Errors
/// [`FitError`] for columns that cannot be read at all (lengths, numbers, time); what only keeps a model from being
/// fitted is in [`LoopStudy::choice`].
pub fn study_loop(record: &LoopRecord, options: &StudyOptions) -> Result<LoopStudy, FitError> {
    let mut problem = record.problem.clone();
    problem.check_columns()?;
    check_length(record)?;
    problem.options.loads = Loads::Auto;
    let mut findings = Vec::new();
    let rows = problem.time_s.len();
    let mut saturated = vec![false; rows];
    let (mended_mv, mended_sp);
    let mut record = record.clone();
    if !options.as_is {
        let seen = condition(&Rows {
            time_s: problem.time_s,
            pv: problem.pv,
            mv: problem.mv,
            manual: record.mode.map(|mode| mode.manual()),
            first_row: problem.options.first_row,
        });
        saturated = seen.saturated;
        findings = seen.findings;
        if problem.keep.is_none() && seen.keep.iter().any(|k| !k) {
            problem.keep = Some(Cow::Owned(seen.keep));
        }
        if let Some(mv) = seen.mv {
            mended_mv = mv;
            (problem.mv, record.problem.mv) = (&mended_mv, &mended_mv);
        }
        if let Some(sp) = record.sp {
            mended_sp = mended(sp, &slips(sp));
            record.sp = Some(&mended_sp);
        }
    }
    let structures = options.structure.map_or(Structure::CHOICE.to_vec(), |structure| vec![structure]);
    let Limited { mv: kept, mut choice, initial_state } =
        limited::choose(&problem, &structures, options, &mut findings);
    if let Some(kept) = &kept {
        for (flag, (a, b)) in saturated.iter_mut().zip(problem.mv.iter().zip(kept)) {
            *flag |= a != b;
        }
        problem.mv = kept;
    }
    problem.options.initial_state = initial_state;
    let mut controller = controller_of(&record, &problem, &saturated, &mut findings);
    if let Ok(choice) = &choice {
        controller = controller.filter(|c| !is_by_hand(c, &record, &problem, &choice.fits));
    }
    if let Ok(choice) = &mut choice {
        refuse_feedback(&record, &problem, controller.as_ref(), &saturated, choice);
    }
    let earlier = one_row_earlier(problem.mv);
    if !options.as_is
        && let Some(better) = answered_in_the_same_row(&problem, &earlier, &choice, &structures)
    {
        choice = Ok(better);
        findings.push(RecordFinding::MvEarlier);
    }
    let reigning = controller.as_ref().filter(|c| reigns(c, &saturated));
    if let (Ok(choice), Some(controller)) = (&choice, reigning) {
        of_the_loop(controller, choice, &mut findings);
    }
    let oscillation = oscillation_of(&problem, reigning, choice.as_ref().ok(), &mut findings);
    let reaction_curve = reaction_curve(&problem);
    Ok(LoopStudy { choice, controller, oscillation, reaction_curve, findings })
}

fn one_row_earlier(mv: &[f64]) -> Vec<f64> {
    mv.iter().skip(1).chain(mv.last()).copied().collect()
}

/// The fit with every MV one row earlier, where the PV answers a move in its own row: then the log writes the MV ahead
/// of the PV, against the convention of records.
fn answered_in_the_same_row(
    problem: &FitProblem,
    earlier: &[f64],
    choice: &Result<Choice, FitError>,
    structures: &[Structure],
) -> Option<Choice> {
    /// Correlation of the residuals with the moves of their own row, in half widths of its band.
    const BANDS: f64 = 3.0;
    /// The squared residual must fall to this part.
    const FALL: f64 = 0.6;
    let fit = choice.as_ref().ok()?.chosen();
    if !fit.is_usable() {
        return None;
    }
    let at_once = fit.tests.cross_correlation.first()?.abs() > BANDS * fit.tests.cross_correlation_band;
    let no_dead_time = fit.parameter("L_s").is_some_and(|l| l.interval_95[0] <= 0.0);
    if !(at_once && no_dead_time) {
        return None;
    }
    let history = problem.history.as_ref().map(|history| history.one_row_earlier(problem.mv[0]));
    let shifted = FitProblem { mv: earlier, history, ..problem.clone() };
    let other = choose_among(&shifted, structures).ok()?;
    (other.chosen().mse < FALL * fit.mse && other.chosen().is_usable()).then_some(other)
}

fn check_length(record: &LoopRecord) -> Result<(), FitError> {
    let rows = record.problem.time_s.len();
    for column in [record.sp, record.mode.map(|mode| mode.values)].into_iter().flatten() {
        if column.len() != rows {
            return Err(FitError::LengthMismatch {
                time: rows,
                pv: record.problem.pv.len(),
                mv: column.len(),
                pv_name: record.problem.options.pv_name.clone(),
                mv_name: "SP or MODE".to_owned(),
            });
        }
    }
    Ok(())
}

/// What model and controller say of each other.
fn of_the_loop(controller: &ControllerFit, choice: &Choice, findings: &mut Vec<RecordFinding>) {
    let fit = choice.chosen();
    // A model that leaves a pattern of its own accuses nobody.
    let is_in_doubt = fit.verdicts.iter().any(|verdict| {
        use super::FitVerdict::{Poor, ResidualsFollowInput, Rings};
        matches!(verdict, Poor { .. } | Rings { .. } | ResidualsFollowInput { .. })
    });
    if !fit.is_usable() || is_in_doubt || controller.r2 < 0.5 {
        return;
    }
    let gain = fit.parameters[0].value;
    let [low, high] = fit.parameters[0].interval_95;
    // Only a sign beyond doubt is worth the alarm.
    if low * high > 0.0 && controller.kc_interval_95[0] * controller.kc_interval_95[1] > 0.0 {
        if gain * controller.kc < 0.0 {
            findings.push(RecordFinding::WrongSign { kc: controller.kc, gain });
        } else if let Some(gains) = controller.gains()
            && !is_closed_loop_stable(&fit.model, &gains)
        {
            findings.push(RecordFinding::UnstableTuning { kc: controller.kc });
        }
    }
}

fn oscillation_of(
    problem: &FitProblem,
    controller: Option<&ControllerFit>,
    choice: Option<&Choice>,
    findings: &mut Vec<RecordFinding>,
) -> Option<Oscillation> {
    // An open loop swings with what a hand does: no sign of the valve.
    controller.filter(|c| c.r2 > 0.3)?;
    // What was refused tells no structure either.
    let fit = choice.map(Choice::chosen).filter(|fit| fit.is_usable());
    let integrating = fit.is_some_and(|fit| matches!(fit.model, ProcessModel::Ipdt(_)));
    let found = stiction::oscillation(problem.time_s, problem.pv, problem.mv, integrating)?;
    if found.sticks() {
        findings.push(RecordFinding::Stiction {
            index: found.stiction_index,
            band: found.stiction_band,
            period_s: found.period_s,
        });
    } else if found.regularity > 1.0 {
        findings.push(RecordFinding::Oscillates { period_s: found.period_s, index: found.stiction_index });
    }
    Some(found)
}
