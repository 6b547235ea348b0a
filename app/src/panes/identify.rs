//! From a stretch of data to a model: columns, stretch, fit, models in a table, overlay on the data.

use std::sync::Arc;

use eframe::egui::{self, RichText};
use egui_plot::{Line, Plot, PlotPoints};
use vasos_engine::document::{
    Document, DocumentCommand, FittedRows, ModelEntry, ModelOrigin, NewModel, SourceChoice, Stretch,
};
use vasos_engine::identify::{FitOptions, FitProblem, fit_fopdt};
use vasos_engine::model::{Fopdt, ProcessModel};
use vasos_engine::signal::ChannelKind;

use crate::action::Action;
use crate::panes::View;
use crate::traces::RunTrace;
use crate::workbench::{Outcome, column_choice};
use crate::{i18n, plots, text, theme, tr};

/// State of the pane.
pub struct State {
    mv_before: Option<f64>,
    typed: [f64; 3],
    typing: bool,
}

impl Default for State {
    fn default() -> Self {
        Self { mv_before: None, typed: [4.9, 152.0, 2.0], typing: false }
    }
}

/// The data of a fit, taken out of the window so that a job can have it.
pub struct FitData {
    time_s: Vec<f64>,
    pv: Vec<f64>,
    mv: Vec<f64>,
    options: FitOptions,
    origin: ModelOrigin,
    pv_unit: String,
    mv_unit: String,
}

impl FitData {
    /// Fits; called on a thread of its own.
    #[must_use]
    pub fn fit(self) -> Outcome {
        let mut problem = FitProblem::new(&self.time_s, &self.pv, &self.mv);
        problem.options = self.options;
        match fit_fopdt(&problem) {
            Ok(fit) => Outcome::Model(Box::new(NewModel {
                model: ProcessModel::Fopdt(fit.model),
                origin: self.origin,
                fit: Some(Arc::new(fit)),
                rows: Some(Arc::new(FittedRows { time_s: self.time_s, pv: self.pv })),
                pv_unit: self.pv_unit,
                mv_unit: self.mv_unit,
            })),
            Err(error) => Outcome::Failed(Box::new(error)),
        }
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
        (SourceChoice::Log, Some(log)) => {
            let (Some(pv), Some(mv)) = (document.roles.pv, document.roles.mv) else {
                return Err(tr!("identify.choose_columns"));
            };
            let (pv, mv) = (&log.columns[pv], &log.columns[mv]);
            let rows = log.complete(&[&pv.values, &mv.values], stretch.from_s, stretch.to_s);
            let [pv_values, mv_values] = [0, 1].map(|i| rows.columns[i].clone());
            let stretch = Stretch {
                from_s: rows.time_s.first().copied().unwrap_or(0.0),
                to_s: rows.time_s.last().copied().unwrap_or(0.0),
            };
            Ok(FitData {
                options: FitOptions {
                    mv_before: state.mv_before,
                    pv_name: pv.name.clone(),
                    mv_name: mv.name.clone(),
                    ..FitOptions::default()
                },
                time_s: rows.time_s,
                pv: pv_values,
                mv: mv_values,
                origin: ModelOrigin::Log { name: log.name.clone(), stretch },
                pv_unit: pv.unit.clone().unwrap_or_default(),
                mv_unit: mv.unit.clone().unwrap_or_default(),
            })
        }
        _ => of_run(document, run, stretch, focus),
    }
}

fn of_run(document: &Document, run: &RunTrace, stretch: Stretch, focus: usize) -> Result<FitData, String> {
    let columns = (run.column(ChannelKind::Pv(focus)), run.column(ChannelKind::Mv(focus)));
    let (Some(pv), Some(mv)) = columns else { return Err(tr!("identify.no_data")) };
    // Another configuration is another loop: only what came after the last change is of this one.
    let from_s = run.last_change_s(stretch.to_s).map_or(stretch.from_s, |s| s.max(stretch.from_s));
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
    Ok(FitData {
        pv: take(pv.values()),
        mv: take(mv.values()),
        time_s,
        options: FitOptions { pv_name: "PV".to_owned(), mv_name: "MV".to_owned(), ..FitOptions::default() },
        origin: ModelOrigin::Run { tag: active.map_or(String::new(), |l| l.id.clone()), stretch },
        pv_unit: "cm".to_owned(),
        mv_unit: unit.to_owned(),
    })
}

/// Draws the pane.
pub fn ui(ui: &mut egui::Ui, view: &View, state: &mut State) -> Vec<Action> {
    let mut actions = vec![];
    egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        source(ui, view, state, &mut actions);
        models(ui, view, &mut actions);
        if state.typing {
            type_model(ui, view, state, &mut actions);
        }
        if let Some(entry) = view.document.model() {
            verdict(ui, entry);
            overlay(ui, entry);
        } else {
            ui.add(
                egui::Label::new(RichText::new(tr!("identify.hint")).color(theme::palette(ui).weak)).wrap(),
            );
        }
    });
    actions
}

fn source(ui: &mut egui::Ui, view: &View, state: &mut State, actions: &mut Vec<Action>) {
    let document = view.document;
    let is_log = document.source == SourceChoice::Log;
    if let (true, Some(log)) = (is_log, &document.log) {
        ui.horizontal_wrapped(|ui| {
            ui.spacing_mut().item_spacing.x = 3.0;
            let width = (ui.available_width() - 142.0) / 3.0;
            let mut roles = document.roles;
            let mut changed = false;
            for (what, role) in [("PV", &mut roles.pv), ("SP", &mut roles.sp), ("MV", &mut roles.mv)] {
                changed |= column_choice(ui, what, role, log, width);
            }
            if changed {
                actions.push(Action::Document(DocumentCommand::Roles(roles)));
            }
        });
        ui.horizontal(|ui| {
            let mut known = state.mv_before.is_some();
            ui.checkbox(&mut known, tr!("identify.mv_before")).on_hover_text(tr!("identify.mv_before_hint"));
            let mut value = state.mv_before.unwrap_or(0.0);
            if known {
                ui.add(egui::DragValue::new(&mut value).speed(0.1));
            }
            state.mv_before = known.then_some(value);
        });
    }
    ui.horizontal_wrapped(|ui| {
        let p = theme::palette(ui);
        let words = if view.fitting { tr!("identify.fitting") } else { tr!("identify.fit") };
        let button = egui::Button::new(RichText::new(words).color(p.on_accent)).fill(p.accent);
        if ui.add_enabled(!view.fitting, button).on_hover_text(tr!("identify.fit_hint")).clicked() {
            actions.push(Action::Identify);
        }
        ui.toggle_value(&mut state.typing, tr!("identify.type"));
        let stretch = document.stretch.map_or_else(
            || tr!("identify.everything"),
            |s| format!("{} … {}", text::clock(s.from_s), text::clock(s.to_s)),
        );
        ui.label(RichText::new(stretch).color(p.weak));
    });
}

fn models(ui: &mut egui::Ui, view: &View, actions: &mut Vec<Action>) {
    if view.document.models.is_empty() {
        return;
    }
    let p = theme::palette(ui);
    egui::ScrollArea::horizontal().id_salt("models").show(ui, |ui| {
        egui::Grid::new("models").striped(true).spacing([7.0, 3.0]).show(ui, |ui| {
            for title in [
                "#".to_owned(),
                "K".to_owned(),
                "T [s]".to_owned(),
                "L [s]".to_owned(),
                tr!("identify.fit_percent"),
            ] {
                ui.label(RichText::new(title).size(theme::SMALL).color(p.weak));
            }
            ui.end_row();
            for entry in view.document.models.iter().rev() {
                row(ui, view, entry, actions);
                ui.end_row();
            }
        });
    });
}

fn row(ui: &mut egui::Ui, view: &View, entry: &ModelEntry, actions: &mut Vec<Action>) {
    let chosen = view.document.model_in_use == Some(entry.number);
    let from = match &entry.origin {
        ModelOrigin::Typed => tr!("identify.typed"),
        ModelOrigin::Run { tag, .. } => tag.clone(),
        ModelOrigin::Log { name, .. } => name.clone(),
    };
    let hover = match &entry.origin {
        ModelOrigin::Typed => from.clone(),
        ModelOrigin::Run { stretch, .. } | ModelOrigin::Log { stretch, .. } => {
            format!("{from}, {} … {}", text::clock(stretch.from_s), text::clock(stretch.to_s))
        }
    };
    let name = entry.number.to_string();
    let button = ui.radio(chosen, name).on_hover_text(hover);
    if button.clicked() {
        actions.push(Action::Document(DocumentCommand::UseModel(entry.number)));
    }
    button.context_menu(|ui| {
        if ui.button(tr!("identify.remove")).clicked() {
            actions.push(Action::Document(DocumentCommand::RemoveModel(entry.number)));
        }
    });
    let ProcessModel::Fopdt(Fopdt { gain, time_constant_s, dead_time_s }) = entry.model else { return };
    let half = |interval: Option<[f64; 2]>| interval.map(|[low, high]| 0.5 * (high - low));
    let intervals = entry.fit.as_ref().map(|f| f.interval_95);
    let cells = [
        (gain, half(intervals.map(|i| i.gain))),
        (time_constant_s, half(intervals.map(|i| i.time_constant_s))),
        (dead_time_s, half(intervals.map(|i| i.dead_time_s))),
    ];
    for (i, (value, half)) in cells.into_iter().enumerate() {
        // An interval far wider than the value says nothing in digits.
        let plus = half.map_or(String::new(), |h| {
            if h > 10.0 * f64::abs(value) { " ± ?".to_owned() } else { format!(" ±{}", text::rough(h)) }
        });
        // Long units of logs push the other columns out; they stand under the pointer.
        let unit = text::quotient(&entry.pv_unit, &entry.mv_unit);
        let unit = if i == 0 && unit.chars().count() <= 8 { format!(" {unit}") } else { String::new() };
        ui.label(RichText::new(format!("{}{plus}{unit}", text::brief(value))).size(theme::TABLE));
    }
    let percent = entry.fit.as_ref().map_or("–".to_owned(), |f| text::fixed(f.fit_percent, 1));
    ui.label(RichText::new(percent).size(theme::TABLE));
}

fn type_model(ui: &mut egui::Ui, view: &View, state: &mut State, actions: &mut Vec<Action>) {
    let loop_unit = view
        .snapshot
        .loops
        .get(view.focus)
        .map_or("", |l| view.snapshot.network.spec.pumps[l.pump].unit.symbol());
    ui.horizontal_wrapped(|ui| {
        let [k, t, l] = &mut state.typed;
        for (name, value, suffix) in
            [("K", k, format!(" cm/{loop_unit}")), ("T", t, " s".to_owned()), ("L", l, " s".to_owned())]
        {
            let name = ui.label(name);
            ui.add(egui::DragValue::new(value).speed(0.05).max_decimals(4).suffix(suffix))
                .labelled_by(name.id);
        }
        let model = Fopdt::new(state.typed[0], state.typed[1], state.typed[2]);
        if ui.add_enabled(model.is_ok(), egui::Button::new(tr!("identify.add"))).clicked()
            && let Ok(model) = model
        {
            actions.push(Action::Document(DocumentCommand::AddModel(Box::new(NewModel {
                model: ProcessModel::Fopdt(model),
                origin: ModelOrigin::Typed,
                fit: None,
                rows: None,
                pv_unit: "cm".to_owned(),
                mv_unit: loop_unit.to_owned(),
            }))));
            state.typing = false;
        }
        if let Err(error) = model {
            ui.label(RichText::new(format!("! {}", i18n::say(&error))).color(theme::palette(ui).caution));
        }
    });
}

fn verdict(ui: &mut egui::Ui, entry: &ModelEntry) {
    let p = theme::palette(ui);
    if let ProcessModel::Fopdt(model) = &entry.model {
        ui.label(
            RichText::new(format!("FOPDT · θ/τ = {}", text::brief(model.dead_time_ratio()))).color(p.weak),
        )
        .on_hover_text(tr!("identify.ratio_hint"));
    }
    let Some(fit) = &entry.fit else { return };
    for verdict in &fit.verdicts {
        let objection = verdict.is_objection();
        let sign = if objection { "! " } else { "" };
        let colour = if objection { p.caution } else { p.text };
        ui.add(egui::Label::new(RichText::new(format!("{sign}{}", i18n::say(verdict))).color(colour)).wrap());
    }
}

/// Data and free run of the model, with what the model leaves over.
fn overlay(ui: &mut egui::Ui, entry: &ModelEntry) {
    let (Some(fit), Some(rows)) = (&entry.fit, &entry.rows) else { return };
    let (time_s, pv) = (&rows.time_s, &rows.pv);
    let p = theme::palette(ui);
    let thin = (time_s.len() / 1500).max(1);
    let points = |values: &[f64]| -> PlotPoints<'static> {
        time_s.iter().zip(values).step_by(thin).map(|(t, v)| [*t, *v]).collect::<Vec<[f64; 2]>>().into()
    };
    let unit = if entry.pv_unit.is_empty() { String::new() } else { format!(" [{}]", entry.pv_unit) };
    ui.horizontal(|ui| {
        for (words, colour) in [(tr!("identify.data"), p.ghost), (tr!("identify.model"), p.pv)] {
            let (rect, _) = ui.allocate_exact_size(egui::vec2(14.0, 10.0), egui::Sense::hover());
            ui.painter().hline(rect.x_range(), rect.center().y, egui::Stroke::new(2.0, colour));
            ui.label(RichText::new(words).size(theme::SMALL));
        }
    });
    Plot::new("overlay")
        .height(ui.available_height().clamp(110.0, 420.0))
        .allow_scroll(false)
        .custom_y_axes(vec![plots::y_axis(format!("PV{unit}"))])
        .custom_x_axes(vec![
            plots::x_axis(tr!("trend.time_axis")).formatter(|mark, _| text::clock(mark.value)),
        ])
        .grid_color(p.grid)
        .x_grid_spacer(plots::time_marks)
        .y_grid_spacer(plots::y_marks)
        .show(ui, |plot| {
            plot.line(Line::new(tr!("identify.data"), points(pv)).color(p.ghost).width(1.2));
            plot.line(
                Line::new(tr!("identify.model"), points(&fit.simulated)).color(p.pv).width(theme::LINE),
            );
        });
}
