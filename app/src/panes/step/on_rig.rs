//! The tuning in view on the non-linear rig, with its noise, converters and limits, against the tuning in use.

use eframe::egui::{self, RichText};
use egui_plot::{Line, Plot, PlotPoints};
use vasos_engine::control::PidTuning;
use vasos_engine::document::Applied;
use vasos_engine::session::RigCommand;
use vasos_engine::sim::{ScenarioError, Trial, TrialRun};

use crate::action::Action;
use crate::answers::{Question, Reply};
use crate::panes::View;
use crate::panes::tune::applied;
use crate::tuning::{PRESENT, Row, same_units};
use crate::{i18n, plots, text, theme, tr};

/// Step of the setpoint in cm, and what the pump keeps of its flow as a load.
const STEP_CM: f64 = 1.0;
const PUMP_SHARE: f64 = 0.95;
/// Length in units of the model's time constants, and its bounds in seconds.
const LENGTH: f64 = 12.0;
const LENGTHS_S: (f64, f64) = (300.0, 7200.0);

/// Draws the trial.
pub(super) fn ui(ui: &mut egui::Ui, view: &View, row: &Row) -> Vec<Action> {
    let mut actions = vec![];
    let weak = |ui: &mut egui::Ui, words: String| {
        let colour = theme::palette(ui).weak;
        ui.add(egui::Label::new(RichText::new(words).color(colour)).wrap());
    };
    let Some(question) = question(view, row) else {
        weak(ui, tr!("step.no_rig"));
        return actions;
    };
    let present = view.tuning.rows.first().filter(|r| r.rule == PRESENT && r.gains != row.gains);
    let other = present.and_then(|r| self::question(view, r));
    let mut ask = |question: Question| {
        let known = view.answers.find(&question);
        if known.is_none() {
            actions.push(Action::Ask(Box::new(question)));
        }
        known
    };
    let (found, ghost) = (ask(question), other.and_then(&mut ask));
    let ghost = trial_of(ghost.as_deref()).and_then(|run| run.as_ref().ok());
    match trial_of(found.as_deref()) {
        Some(Ok(run)) => draw(ui, view, run, ghost),
        Some(Err(error)) => weak(ui, i18n::say(error)),
        None => weak(ui, tr!("tune.pending")),
    }
    actions
}

fn trial_of(reply: Option<&Reply>) -> Option<&Result<TrialRun, ScenarioError>> {
    if let Some(Reply::Trial(run)) = reply { Some(run) } else { None }
}

/// The trial of a row; `None` where the model's units are not the loop's.
fn question(view: &View, row: &Row) -> Option<Question> {
    let document = view.document;
    let entry = document.model()?;
    if !same_units(document, entry, view.focus) || !row.gains.ti_s.is_finite() {
        return None;
    }
    let rig = &document.rig;
    let configuration = rig.network.spec.configurations.get(rig.configuration)?.id.clone();
    let tag = rig.active_loops().get(view.focus)?.id.clone();
    let settings = rig.loops.get(&tag)?;
    // What is in use is tried as it is, another row as the loop would take it over.
    let tried = if row.rule == PRESENT {
        Applied {
            tuning: PidTuning { gains: row.gains, ..settings.tuning },
            pv_filter_s: settings.pv_filter_s,
            setpoint_filter_s: settings.options.setpoint.filter_s,
        }
    } else {
        applied(view, row, &tag)
    };
    let mut options = Box::new(settings.options.clone());
    options.setpoint.filter_s = tried.setpoint_filter_s;
    let mut setup = rig.commands_after_load();
    setup.push(RigCommand::Options { tag: tag.clone(), options });
    let slow_s = entry.model.transfer_function();
    // The largest coefficient of a first power of s is the sum of its time constants.
    let den = &slow_s.den;
    let constant_s = if den.len() > 1 { (den[den.len() - 2] / den[den.len() - 1]).abs() } else { 0.0 };
    let length_s = if constant_s.is_finite() && constant_s > 0.0 { LENGTH * constant_s } else { LENGTHS_S.1 };
    let trial = Trial {
        configuration,
        setup,
        measurement: rig.measurement,
        seed: rig.seed,
        tuning: tried.tuning,
        pv_filter_s: tried.pv_filter_s,
        level_cm: settings.setpoint_cm,
        step_cm: STEP_CM,
        pump_share: PUMP_SHARE,
        duration_s: length_s.clamp(LENGTHS_S.0, LENGTHS_S.1).round(),
        tag,
    };
    Some(Question::Trial { network: rig.network.clone(), trial: Box::new(trial) })
}

fn draw(ui: &mut egui::Ui, view: &View, run: &TrialRun, ghost: Option<&TrialRun>) {
    let p = theme::palette(ui);
    let mv_unit = view.document.model().map_or("", |e| e.mv_unit.as_str());
    let height = ui.available_height() - 52.0;
    let curve = |time_s: &[f64], values: &[f64]| -> PlotPoints<'static> {
        time_s.iter().zip(values).map(|(t, v)| [*t, *v]).collect::<Vec<_>>().into()
    };
    for is_pv in [true, false] {
        let name = if is_pv { "PV [cm]".to_owned() } else { format!("MV [{mv_unit}]") };
        let time = if is_pv { String::new() } else { tr!("step.time_axis") };
        let names = (tr!("step.in_view"), tr!("rules.present"));
        Plot::new(("trial", is_pv))
            .height((if is_pv { 0.58 } else { 0.42 } * height).max(50.0))
            .allow_scroll(false)
            .custom_x_axes(vec![plots::x_axis(time)])
            .custom_y_axes(vec![plots::y_axis(name)])
            .x_grid_spacer(plots::x_marks)
            .y_grid_spacer(plots::y_marks)
            .grid_color(p.grid)
            .show(ui, |plot| {
                if is_pv {
                    plot.line(Line::new("SP", curve(&run.time_s, &run.sp)).color(p.sp).width(1.2));
                }
                let of = |run: &TrialRun| curve(&run.time_s, if is_pv { &run.pv } else { &run.mv });
                if let Some(ghost) = ghost {
                    plot.line(Line::new(names.1, of(ghost)).color(p.ghost).width(theme::TREND_LINE));
                }
                let colour = if is_pv { p.pv } else { p.mv };
                plot.line(Line::new(names.0, of(run)).color(colour).width(theme::TREND_LINE));
            });
    }
    let iae = |run: &TrialRun, load: bool| {
        let part = if load { &run.load } else { &run.setpoint };
        text::maybe(part.as_ref().map(|m| m.iae))
    };
    let travel = |run: &TrialRun| {
        let parts = [&run.setpoint, &run.load].into_iter().flatten();
        text::brief(parts.map(|m| m.total_variation).sum::<f64>())
    };
    let against = |own: String, other: Option<String>| match other {
        Some(other) => format!("{own} ({other})"),
        None => own,
    };
    let words = tr!(
        "step.trial",
        setpoint = against(iae(run, false), ghost.map(|g| iae(g, false))),
        load = against(iae(run, true), ghost.map(|g| iae(g, true))),
        travel = against(travel(run), ghost.map(travel)),
        unit = mv_unit,
        saturated = text::fixed(100.0 * run.saturated_share, 0)
    );
    ui.add(egui::Label::new(RichText::new(words).size(theme::SMALL).color(p.text)).wrap())
        .on_hover_text(tr!("step.trial_hint"));
}
