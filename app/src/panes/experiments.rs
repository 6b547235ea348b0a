//! Prepared experiments: what they show, what must come of them, and whether it did.

use std::sync::Arc;

use eframe::egui::{self, RichText, Role, WidgetInfo};
use egui_extras::{Column, TableBuilder};
use egui_plot::{Corner, Legend, Line, Plot, PlotPoints};
use vasos_engine::experiment::{CheckOutcome, Expectation, Experiment, ExperimentRun, RunResult};

use crate::action::Action;
use crate::experiments::Desk;
use crate::panes::View;
use crate::{i18n, plots, text, theme, tr};

/// Width from which the list stands beside the experiment.
const WIDE: f32 = 640.0;
/// Width of the list.
const LIST: f32 = 300.0;
/// Most points drawn of a curve; more than any screen has columns.
const POINTS: usize = 4000;
/// Most curves of one plot.
const CURVES: usize = 12;

/// State of the pane.
#[derive(Default)]
pub struct State {
    /// Column in the plot; empty for the first.
    column: String,
}

/// Draws the pane.
pub fn ui(ui: &mut egui::Ui, view: &View, state: &mut State) -> Vec<Action> {
    let mut actions = vec![];
    let desk = view.experiments;
    if ui.available_width() >= WIDE {
        let rest = ui.available_size();
        ui.horizontal_top(|ui| {
            let down = egui::Layout::top_down_justified(egui::Align::Min);
            ui.allocate_ui_with_layout(egui::vec2(LIST, rest.y), down, |ui| list(ui, desk, &mut actions));
            ui.separator();
            ui.vertical(|ui| body(ui, desk, state, &mut actions));
        });
    } else {
        let shown = desk.in_view().map_or(String::new(), |e| title(e.as_ref()));
        let combo = egui::ComboBox::from_id_salt("experiment_choice")
            .width(ui.available_width() - 8.0)
            .selected_text(shown);
        let combo = combo.show_ui(ui, |ui| entries(ui, desk, &mut actions));
        combo.response.widget_info(|| WidgetInfo::labeled(Role::ComboBox, true, tr!("experiments.choose")));
        body(ui, desk, state, &mut actions);
    }
    actions
}

fn language() -> &'static str {
    i18n::current().tag()
}

fn title(experiment: &Experiment) -> String {
    experiment.spec.title.get(language()).to_owned()
}

fn list(ui: &mut egui::Ui, desk: &Desk, actions: &mut Vec<Action>) {
    egui::ScrollArea::vertical().id_salt("experiment_list").auto_shrink(false).show(ui, |ui| {
        entries(ui, desk, actions);
    });
}

/// A line an experiment: how it came out, and its title.
fn entries(ui: &mut egui::Ui, desk: &Desk, actions: &mut Vec<Action>) {
    let p = theme::palette(ui);
    for experiment in &desk.known {
        let id = &experiment.spec.id;
        let (mark, colour) = match desk.results.get(id).map(|run| run.reached()) {
            Some(true) => (tr!("experiments.ok"), p.mv),
            Some(false) => (tr!("experiments.not"), p.alarm),
            None => (String::new(), p.weak),
        };
        let chosen = desk.chosen == *id;
        let (colour, ink) = if chosen { (p.on_accent, p.on_accent) } else { (colour, p.text) };
        let mut job = egui::text::LayoutJob::default();
        let format = |font, color| egui::TextFormat { font_id: font, color, ..Default::default() };
        if !mark.is_empty() {
            job.append(&format!("{mark}  "), 0.0, format(theme::bold_font(theme::TABLE), colour));
        }
        job.append(&title(experiment), 0.0, format(egui::FontId::proportional(theme::TABLE), ink));
        if ui.selectable_label(chosen, job).clicked() {
            actions.push(Action::ChooseExperiment(id.clone()));
        }
    }
}

fn body(ui: &mut egui::Ui, desk: &Desk, state: &mut State, actions: &mut Vec<Action>) {
    let Some(experiment) = desk.in_view() else {
        ui.weak(tr!("experiments.none"));
        return;
    };
    let spec = &experiment.spec;
    let result = desk.results.get(&spec.id);
    ui.horizontal(|ui| {
        match &desk.under_way {
            Some(under_way) if under_way.id == spec.id => {
                if ui.button(tr!("experiments.cancel")).clicked() {
                    actions.push(Action::CancelExperiment);
                }
                ui.add(egui::ProgressBar::new(under_way.share()).desired_width(120.0).show_percentage());
                ui.ctx().request_repaint_after(std::time::Duration::from_millis(100));
            }
            other => {
                let p = theme::palette(ui);
                let run = egui::Button::new(RichText::new(tr!("experiments.run")).color(p.on_accent))
                    .fill(p.accent);
                if ui.add_enabled(other.is_none(), run).clicked() {
                    actions.push(Action::RunExperiment(spec.id.clone()));
                }
            }
        }
        if let Some(run) = result {
            verdict(ui, run);
        }
    });
    egui::ScrollArea::vertical().id_salt("experiment_body").auto_shrink(false).show(ui, |ui| {
        ui.label(RichText::new(title(experiment)).family(theme::bold()).size(15.0));
        let wrapped = |ui: &mut egui::Ui, words: &str| {
            ui.add(egui::Label::new(words).wrap());
        };
        wrapped(ui, spec.shows.get(language()));
        wrapped(ui, spec.reading.get(language()));
        ui.add(egui::Label::new(RichText::new(spec.source.get(language())).weak()).wrap());
        let Some(run) = result else { return };
        ui.add_space(theme::GAP);
        plot(ui, state, run);
        ui.add_space(theme::GAP);
        checks(ui, run);
    });
}

fn verdict(ui: &mut egui::Ui, run: &ExperimentRun) {
    let p = theme::palette(ui);
    let met = run.checks.iter().filter(|c| c.passes()).count();
    let (words, colour) = if run.reached() {
        (tr!("experiments.reached", met = met), p.mv)
    } else {
        (tr!("experiments.missed", met = met, of = run.checks.len()), p.alarm)
    };
    ui.label(RichText::new(words).family(theme::bold()).color(colour));
}

/// Columns that the runs have, in the order of their appearance.
fn columns(run: &ExperimentRun) -> Vec<(String, String)> {
    let mut found: Vec<(String, String)> = vec![];
    for column in run.runs.iter().filter(|r| r.x.len() > 1).flat_map(|r| &r.columns) {
        if !found.iter().any(|(name, _)| *name == column.name) {
            found.push((column.name.clone(), column.unit.clone()));
        }
    }
    found
}

fn points(run: &RunResult, values: &[f64]) -> PlotPoints<'static> {
    let stride = run.x.len().div_ceil(POINTS).max(1);
    let pairs = run.x.iter().zip(values).step_by(stride);
    pairs.filter(|(_, y)| y.is_finite()).map(|(x, y)| [*x, *y]).collect::<Vec<_>>().into()
}

fn plot(ui: &mut egui::Ui, state: &mut State, run: &Arc<ExperimentRun>) {
    let names = columns(run);
    let preferred = ["pv", "pv1", "y", "recording"];
    let first = preferred.iter().find_map(|p| names.iter().find(|(name, _)| name == p)).or(names.first());
    let Some((first, _)) = first else { return };
    if !names.iter().any(|(name, _)| *name == state.column) {
        state.column.clone_from(first);
    }
    ui.horizontal(|ui| {
        let label = ui.label(tr!("experiments.column"));
        let combo = egui::ComboBox::from_id_salt("column").selected_text(&state.column);
        let combo = combo.show_ui(ui, |ui| {
            for (name, _) in &names {
                ui.selectable_value(&mut state.column, name.clone(), name);
            }
        });
        combo.response.labelled_by(label.id);
    });
    let unit = names.iter().find(|(name, _)| *name == state.column).map_or("", |(_, unit)| unit);
    let with: Vec<&RunResult> =
        run.runs.iter().filter(|r| r.x.len() > 1 && r.column(&state.column).is_some()).take(CURVES).collect();
    let Some(axis) = with.first() else { return };
    let p = theme::palette(ui);
    let named =
        |name: &str, unit: &str| if unit.is_empty() { name.to_owned() } else { format!("{name} [{unit}]") };
    Plot::new("experiment_plot")
        .height(230.0)
        .allow_scroll(false)
        .legend(Legend::default().position(Corner::LeftTop))
        .grid_color(p.grid)
        .custom_x_axes(vec![plots::x_axis(named(&axis.x_name, &axis.x_unit))])
        .custom_y_axes(vec![plots::y_axis(named(&state.column, unit))])
        .x_grid_spacer(plots::x_marks)
        .y_grid_spacer(plots::y_marks)
        .show(ui, |plot| {
            if let [only] = with[..] {
                // Of a single run, everything of the same unit belongs together.
                for (i, column) in only.columns.iter().filter(|c| c.unit == unit).take(CURVES).enumerate() {
                    let line = Line::new(column.name.clone(), points(only, &column.values));
                    plot.line(line.color(theme::series(&p, i)).width(theme::TREND_LINE));
                }
                return;
            }
            for (i, result) in with.iter().enumerate().filter(|(_, r)| r.x_name == axis.x_name) {
                let Some(values) = result.column(&state.column) else { continue };
                let line = Line::new(result.label.get(language()).to_owned(), points(result, values));
                plot.line(line.color(theme::series(&p, i)).width(theme::TREND_LINE));
            }
        });
}

/// An expectation in the language's words and numbers.
fn expected(expectation: &Expectation) -> String {
    let n = text::rough;
    match *expectation {
        Expectation::Value { expected, tolerance } => format!("{} ± {}", text::brief(expected), n(tolerance)),
        Expectation::Range { low, high } if low == f64::NEG_INFINITY => format!("≤ {}", text::brief(high)),
        Expectation::Range { low, high } if high == f64::INFINITY => format!("≥ {}", text::brief(low)),
        Expectation::Range { low, high } => format!("{} … {}", text::brief(low), text::brief(high)),
        Expectation::Less { than } => format!("< {}", text::maybe(than)),
        Expectation::More { than } => format!("> {}", text::maybe(than)),
    }
}

fn checks(ui: &mut egui::Ui, run: &ExperimentRun) {
    let p = theme::palette(ui);
    let height = 22.0;
    TableBuilder::new(ui)
        .id_salt("checks")
        .striped(false)
        .vscroll(false)
        .column(Column::exact(58.0))
        .column(Column::remainder().at_least(120.0).clip(true))
        .columns(Column::exact(84.0), 3)
        .header(height, |mut head| {
            for words in
                ["", "experiments.check", "experiments.found", "experiments.expected", "experiments.printed"]
            {
                head.col(|ui| {
                    if !words.is_empty() {
                        ui.label(RichText::new(tr!(words)).size(theme::TABLE).color(p.weak));
                    }
                });
            }
        })
        .body(|mut body| {
            for check in &run.checks {
                body.row(height, |mut row| line(&mut row, check, &p));
            }
        });
}

fn line(row: &mut egui_extras::TableRow<'_, '_>, check: &CheckOutcome, p: &theme::Palette) {
    let (mark, colour) =
        if check.passes() { (tr!("experiments.ok"), p.mv) } else { (tr!("experiments.not"), p.alarm) };
    row.col(|ui| {
        ui.label(RichText::new(mark).family(theme::bold()).size(theme::TABLE).color(colour));
    });
    row.col(|ui| {
        let words = check.title.get(language());
        ui.add(egui::Label::new(RichText::new(words).size(theme::TABLE)).truncate()).on_hover_text(words);
    });
    let found = check.found.filter(|v| v.is_finite());
    for words in
        [text::maybe(found), expected(&check.expectation), check.printed.map_or(String::new(), text::brief)]
    {
        row.col(|ui| {
            ui.label(RichText::new(words).size(theme::TABLE));
        });
    }
}
