//! The data of a fit, taken out of the window so that a job can have it.

use std::borrow::Cow;
use std::sync::Arc;

use vasos_engine::document::{Document, FittedRows, LogRoles, ModelOrigin, NewModel, SourceChoice, Stretch};
use vasos_engine::excitation::{ExcitationReport, identify_report};
use vasos_engine::identify::{
    Disturbance, Drift, FitOptions, FitProblem, History, LoopRecord, LoopStudy, ModeColumn, Structure,
    StudyOptions, reaction_curve, study_loop,
};
use vasos_engine::signal::{ChannelKind, LogTable};

use crate::tr;
use crate::traces::RunTrace;
use crate::workbench::Outcome;

use super::State;

/// Columns of one stretch with what is known of them.
pub struct FitData {
    time_s: Vec<f64>,
    pv: Vec<f64>,
    mv: Vec<f64>,
    sp: Option<Vec<f64>>,
    mode: Option<Vec<f64>>,
    mode_words: Vec<String>,
    disturbance: Option<(String, Vec<f64>)>,
    /// The inputs ahead of the stretch.
    ahead: History<'static>,
    options: FitOptions,
    structure: Option<Structure>,
    origin: ModelOrigin,
    pv_unit: String,
    mv_unit: String,
}

impl FitData {
    /// Studies the stretch; called on a thread of its own.
    #[must_use]
    pub fn fit(self) -> Outcome {
        let mut problem = FitProblem::new(&self.time_s, &self.pv, &self.mv);
        problem.options = self.options;
        problem.history = Some(self.ahead.borrowed());
        problem.disturbances = self
            .disturbance
            .iter()
            .map(|(name, values)| Disturbance { name: name.clone(), values })
            .collect();
        let mode = self.mode.as_deref().map(|values| ModeColumn { values, words: &self.mode_words });
        let record = LoopRecord { problem, sp: self.sp.as_deref(), mode };
        let options = StudyOptions { structure: self.structure, ..StudyOptions::default() };
        let study = match study_loop(&record, &options) {
            Ok(study) => study,
            Err(error) => return Outcome::Failed(Box::new(error)),
        };
        let fit = match &study.choice {
            Ok(choice) => Arc::new(choice.chosen().clone()),
            Err(error) => return Outcome::Failed(Box::new(error.clone())),
        };
        Outcome::Model(Box::new(NewModel {
            model: fit.model.clone(),
            origin: self.origin,
            fit: Some(fit),
            study: Some(Arc::new(study)),
            rows: Some(Arc::new(FittedRows { time_s: self.time_s, pv: self.pv })),
            pv_unit: self.pv_unit,
            mv_unit: self.mv_unit,
        }))
    }
}

/// Takes the chosen stretch out of the run or the log.
///
/// # Errors
/// In words, when there is nothing to fit.
pub fn data(document: &Document, run: &RunTrace, state: &State, focus: usize) -> Result<FitData, String> {
    let whole = Stretch { from_s: f64::NEG_INFINITY, to_s: f64::INFINITY };
    let stretch = document.stretch.unwrap_or(whole);
    match (document.source, &document.log) {
        (SourceChoice::Log, Some(log)) => of_log(log, document.roles, state, stretch),
        _ => of_run(document, run, state, stretch, focus),
    }
}

fn of_log(log: &LogTable, roles: LogRoles, state: &State, stretch: Stretch) -> Result<FitData, String> {
    let column = |role: Option<usize>| role.and_then(|i| log.columns.get(i));
    let (Some(pv), Some(mv)) = (column(roles.pv), column(roles.mv)) else {
        return Err(tr!("identify.choose_columns"));
    };
    let other = column(roles.disturbance);
    let mut columns: Vec<&[f64]> = vec![&pv.values, &mv.values];
    columns.extend(other.map(|c| c.values.as_slice()));
    let rows = log.complete(&columns, stretch.from_s, stretch.to_s);
    let first_row = rows.first_line(log);
    let start_s = rows.time_s.first().copied().unwrap_or(stretch.from_s);
    let ahead = log.ahead(&columns[1..], start_s);
    let mut inputs_ahead = ahead.columns.into_iter().map(Cow::Owned);
    let ahead = History {
        time_s: ahead.time_s.into(),
        mv: inputs_ahead.next().unwrap_or_default(),
        disturbances: inputs_ahead.collect(),
    };
    let beside = |role: Option<usize>| column(role).and_then(|c| rows.held(&c.values));
    let (sp, mode) = (beside(roles.sp), beside(roles.mode));
    let mut values = rows.columns.into_iter();
    let (pv_values, mv_values) = (values.next().unwrap_or_default(), values.next().unwrap_or_default());
    let stretch = Stretch {
        from_s: rows.time_s.first().copied().unwrap_or(0.0),
        to_s: rows.time_s.last().copied().unwrap_or(0.0),
    };
    Ok(FitData {
        options: FitOptions {
            mv_before: state.mv_before,
            drift: Drift::Auto,
            pv_name: pv.name.clone(),
            mv_name: mv.name.clone(),
            first_row,
            ..FitOptions::default()
        },
        structure: state.structure,
        time_s: rows.time_s,
        pv: pv_values,
        mv: mv_values,
        sp,
        mode,
        mode_words: column(roles.mode).map(|c| c.states.clone()).unwrap_or_default(),
        disturbance: other.map(|c| c.name.clone()).zip(values.next()),
        ahead,
        origin: ModelOrigin::Log { name: log.name.clone(), stretch },
        pv_unit: pv.unit.clone().unwrap_or_default(),
        mv_unit: mv.unit.clone().unwrap_or_default(),
    })
}

fn of_run(
    document: &Document,
    run: &RunTrace,
    state: &State,
    stretch: Stretch,
    focus: usize,
) -> Result<FitData, String> {
    let columns = (run.column(ChannelKind::Pv(focus)), run.column(ChannelKind::Mv(focus)));
    let (Some(pv), Some(mv)) = columns else { return Err(tr!("identify.no_data")) };
    let sp = run.column(ChannelKind::Setpoint(focus));
    // Another configuration is another loop: only what came after the last change is of this one.
    let change_s = run.last_change_s(stretch.to_s).unwrap_or(f64::NEG_INFINITY);
    let from_s = change_s.max(stretch.from_s);
    let rows_ahead = mv.index_at(change_s)..mv.index_at(from_s);
    let ahead = History {
        time_s: mv.time_s()[rows_ahead.clone()].to_vec().into(),
        mv: mv.values()[rows_ahead].to_vec().into(),
        disturbances: vec![],
    };
    let range = pv.index_at(from_s)..pv.index_at(stretch.to_s);
    let active = document.rig.active_loops().get(focus);
    let spec = &document.rig.network.spec;
    let unit = active
        .and_then(|l| spec.pumps.iter().find(|p| Some(&p.id) == l.pump.as_ref()))
        .map_or("", |p| p.unit.symbol());
    let whole: Vec<usize> =
        range.filter(|&i| pv.values()[i].is_finite() && mv.values()[i].is_finite()).collect();
    let take = |values: &[f64]| whole.iter().map(|&i| values[i]).collect::<Vec<f64>>();
    let time_s = take(pv.time_s());
    let stretch = Stretch {
        from_s: time_s.first().copied().unwrap_or(0.0),
        to_s: time_s.last().copied().unwrap_or(0.0),
    };
    let sp = sp.filter(|sp| sp.values().len() == pv.values().len()).map(|sp| take(sp.values()));
    Ok(FitData {
        pv: take(pv.values()),
        mv: take(mv.values()),
        sp: sp.filter(|sp| sp.iter().all(|v| v.is_finite())),
        mode: None,
        mode_words: Vec::new(),
        disturbance: None,
        ahead,
        time_s,
        options: FitOptions {
            pv_name: "PV".to_owned(),
            mv_name: "MV".to_owned(),
            drift: Drift::Auto,
            ..FitOptions::default()
        },
        structure: state.structure,
        origin: ModelOrigin::Run { tag: active.map_or(String::new(), |l| l.id.clone()), stretch },
        pv_unit: "cm".to_owned(),
        mv_unit: unit.to_owned(),
    })
}

/// The model that a test's record tells, in the units of its loop; called on a thread of its own.
#[must_use]
pub fn of_report(report: &ExcitationReport, mv_unit: String) -> Outcome {
    let told = match identify_report(report) {
        Ok(told) => told,
        Err(error) => return Outcome::Failed(Box::new(error)),
    };
    let fit = Arc::new(told.fit().clone());
    let record = &report.record;
    let end = |at: Option<&f64>| at.copied().unwrap_or(report.start_s);
    let stretch = Stretch { from_s: end(record.time_s.first()), to_s: end(record.time_s.last()) };
    let reaction_curve = reaction_curve(&FitProblem::new(&record.time_s, &record.pv, &record.mv));
    let choice = Ok(told.choice);
    let study = LoopStudy { choice, controller: None, oscillation: None, reaction_curve, findings: vec![] };
    Outcome::Model(Box::new(NewModel {
        model: fit.model.clone(),
        origin: ModelOrigin::Run { tag: report.tag.clone(), stretch },
        fit: Some(fit),
        study: Some(Arc::new(study)),
        rows: Some(Arc::new(FittedRows { time_s: record.time_s.clone(), pv: record.pv.clone() })),
        pv_unit: "cm".to_owned(),
        mv_unit,
    }))
}

/// Name of a structure, or of the choice among all.
pub fn structure_name(structure: Option<Structure>) -> String {
    match structure {
        None => tr!("structure.auto"),
        Some(Structure::Fopdt) => tr!("structure.fopdt"),
        Some(Structure::Ipdt) => tr!("structure.ipdt"),
        Some(Structure::Sopdt) => tr!("structure.sopdt"),
        Some(Structure::SopdtZero) => tr!("structure.sopdt_zero"),
    }
}
