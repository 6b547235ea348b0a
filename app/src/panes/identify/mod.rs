//! From a stretch of data to a model: columns, stretch, fit, models in a table, what speaks for and against them.

mod data;
mod evidence;
mod excite;
mod models;

use eframe::egui::{self, RichText};
use vasos_engine::document::{DocumentCommand, LogRoles, ModelOrigin, NewModel, SourceChoice};
use vasos_engine::identify::Structure;
use vasos_engine::model::{Fopdt, ProcessModel};
use vasos_engine::signal::LogTable;

pub use data::{FitData, data, of_report, structure_name};
pub use excite::Bench;

use crate::action::Action;
use crate::panes::View;
use crate::workbench::column_choice;
use crate::{i18n, text, theme, tr};

/// State of the pane.
pub struct State {
    mv_before: Option<f64>,
    structure: Option<Structure>,
    picture: evidence::Picture,
    /// Tests of the running loop.
    pub bench: Bench,
    typed: [f64; 3],
    typing: bool,
}

impl Default for State {
    fn default() -> Self {
        Self {
            mv_before: None,
            structure: None,
            picture: evidence::Picture::default(),
            bench: Bench::default(),
            typed: [4.9, 152.0, 2.0],
            typing: false,
        }
    }
}

/// Draws the pane.
pub fn ui(ui: &mut egui::Ui, view: &View, state: &mut State) -> Vec<Action> {
    let mut actions = vec![];
    egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        source(ui, view, state, &mut actions);
        excite::ui(ui, view, &mut state.bench, &mut actions);
        models::table(ui, view, &mut actions);
        if state.typing {
            type_model(ui, view, state, &mut actions);
        }
        if let Some(entry) = view.document.model() {
            evidence::ui(ui, entry, &mut state.picture, &mut actions);
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
        columns(ui, log, document.roles, state, actions);
    }
    ui.horizontal_wrapped(|ui| {
        let p = theme::palette(ui);
        let words = if view.fitting { tr!("identify.fitting") } else { tr!("identify.fit") };
        let button = egui::Button::new(RichText::new(words).color(p.on_accent)).fill(p.accent);
        if ui.add_enabled(!view.fitting, button).on_hover_text(tr!("identify.fit_hint")).clicked() {
            actions.push(Action::Identify);
        }
        structure_choice(ui, state);
        ui.toggle_value(&mut state.typing, tr!("identify.type"));
        let stretch = document.stretch.map_or_else(
            || tr!("identify.everything"),
            |s| format!("{} … {}", text::clock(s.from_s), text::clock(s.to_s)),
        );
        ui.label(RichText::new(stretch).color(p.weak));
    });
}

/// Which column of the log is what; what a log seldom needs is folded away.
fn columns(
    ui: &mut egui::Ui,
    log: &LogTable,
    before: LogRoles,
    state: &mut State,
    actions: &mut Vec<Action>,
) {
    let mut roles = before;
    let choices = |ui: &mut egui::Ui, line: Vec<(String, &mut Option<usize>)>| {
        ui.horizontal_wrapped(|ui| {
            ui.spacing_mut().item_spacing.x = 3.0;
            let width = (ui.available_width() - 142.0) / 3.0;
            for (what, role) in line {
                column_choice(ui, &what, role, log, width);
            }
        });
    };
    let named = [("PV", &mut roles.pv), ("SP", &mut roles.sp), ("MV", &mut roles.mv)];
    choices(ui, named.map(|(what, role)| (what.to_owned(), role)).into());
    egui::CollapsingHeader::new(tr!("identify.more_columns")).id_salt("more columns").show(ui, |ui| {
        let mode = (tr!("identify.mode"), &mut roles.mode);
        choices(ui, vec![mode, (tr!("identify.disturbance"), &mut roles.disturbance)]);
        ui.horizontal(|ui| {
            let mut known = state.mv_before.is_some();
            ui.checkbox(&mut known, tr!("identify.mv_before")).on_hover_text(tr!("identify.mv_before_hint"));
            let mut value = state.mv_before.unwrap_or(0.0);
            if known {
                ui.add(egui::DragValue::new(&mut value).speed(0.1));
            }
            state.mv_before = known.then_some(value);
        });
    });
    if roles != before {
        actions.push(Action::Document(DocumentCommand::Roles(roles)));
    }
}

/// Which structure the next fit has.
fn structure_choice(ui: &mut egui::Ui, state: &mut State) {
    let label = tr!("identify.structure");
    let response = egui::ComboBox::from_id_salt("structure")
        .width(104.0)
        .selected_text(structure_name(state.structure))
        .show_ui(ui, |ui| {
            for choice in std::iter::once(None).chain(Structure::ALL.map(Some)) {
                ui.selectable_value(&mut state.structure, choice, structure_name(choice));
            }
        })
        .response;
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::ComboBox, true, &label));
    response.on_hover_text(tr!("identify.structure_hint"));
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
                study: None,
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
