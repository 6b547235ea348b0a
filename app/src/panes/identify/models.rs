//! The models of the document, newest first, each with what its structure has.

use eframe::egui::{self, RichText};
use vasos_engine::document::{DocumentCommand, ModelEntry, ModelOrigin};
use vasos_engine::identify::Parameter;
use vasos_engine::model::ProcessModel;

use crate::action::Action;
use crate::panes::View;
use crate::{text, theme, tr};

pub fn table(ui: &mut egui::Ui, view: &View, actions: &mut Vec<Action>) {
    if view.document.models.is_empty() {
        return;
    }
    let p = theme::palette(ui);
    egui::ScrollArea::horizontal().id_salt("models").show(ui, |ui| {
        egui::Grid::new("models").striped(true).spacing([7.0, 3.0]).show(ui, |ui| {
            let titles = [
                "#".to_owned(),
                "K, Kv".to_owned(),
                "T [s]".to_owned(),
                "L [s]".to_owned(),
                tr!("identify.more"),
                tr!("identify.fit_percent"),
            ];
            for title in titles {
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
        ModelOrigin::Log { name, .. } | ModelOrigin::Recording { name } => name.clone(),
    };
    let hover = match &entry.origin {
        ModelOrigin::Typed | ModelOrigin::Recording { .. } => from.clone(),
        ModelOrigin::Run { stretch, .. } | ModelOrigin::Log { stretch, .. } => {
            format!("{from}, {} … {}", text::clock(stretch.from_s), text::clock(stretch.to_s))
        }
    };
    let button = ui.radio(chosen, entry.number.to_string()).on_hover_text(hover);
    if button.clicked() {
        actions.push(Action::Document(DocumentCommand::UseModel(entry.number)));
    }
    button.context_menu(|ui| {
        if ui.button(tr!("identify.remove")).clicked() {
            actions.push(Action::Document(DocumentCommand::RemoveModel(entry.number)));
        }
    });
    let parameters = parameters(entry);
    let find = |name: &str| parameters.iter().find(|c| c.0 == name);
    let cell = |ui: &mut egui::Ui, found: Option<&Cell>, unit: &str| {
        let words = found.map_or("–".to_owned(), |c| format!("{}{unit}", value_with_interval(c.1, c.2)));
        ui.label(RichText::new(words).size(theme::TABLE));
    };
    // Long units of logs push the other columns out; they stand under the pointer.
    let unit = text::quotient(&entry.pv_unit, &entry.mv_unit);
    let known = !(entry.pv_unit.is_empty() && entry.mv_unit.is_empty());
    let unit = if known && unit.chars().count() <= 8 { format!(" {unit}") } else { String::new() };
    cell(ui, find("K"), &unit);
    cell(ui, find("T_s"), "");
    cell(ui, find("L_s"), "");
    let more: Vec<String> = [("T2_s", "T2", " s"), ("zeta", "ζ", ""), ("Tz_s", "Tz", " s")]
        .into_iter()
        .filter_map(|(name, symbol, unit)| {
            find(name).map(|c| format!("{symbol} {}{unit}", value_with_interval(c.1, c.2)))
        })
        .collect();
    ui.label(
        RichText::new(if more.is_empty() { "–".to_owned() } else { more.join(", ") }).size(theme::TABLE),
    );
    let percent = entry.fit.as_ref().map_or("–".to_owned(), |f| text::fixed(f.fit_percent, 1));
    ui.label(RichText::new(percent).size(theme::TABLE));
}

/// Name, value, half the interval.
type Cell = (&'static str, f64, Option<f64>);

fn parameters(entry: &ModelEntry) -> Vec<Cell> {
    if let Some(fit) = &entry.fit {
        let half = |p: &Parameter| 0.5 * (p.interval_95[1] - p.interval_95[0]);
        let name = |p: &Parameter| if p.name == "Kv" { "K" } else { p.name };
        return fit.parameters.iter().map(|p| (name(p), p.value, Some(half(p)))).collect();
    }
    let l = ("L_s", entry.model.dead_time_s(), None);
    match &entry.model {
        ProcessModel::Fopdt(m) => vec![("K", m.gain, None), ("T_s", m.time_constant_s, None), l],
        ProcessModel::Ipdt(m) => vec![("K", m.velocity_gain, None), l],
        ProcessModel::Sopdt(m) => {
            let mut cells = vec![
                ("K", m.gain, None),
                ("T_s", m.time_constant_1_s, None),
                ("T2_s", m.time_constant_2_s, None),
                l,
            ];
            if m.zero_time_constant_s != 0.0 {
                cells.push(("Tz_s", m.zero_time_constant_s, None));
            }
            cells
        }
        ProcessModel::Rational(_) => vec![l],
    }
}

/// An interval far wider than the value says nothing in digits.
fn value_with_interval(value: f64, half: Option<f64>) -> String {
    let plus = half.map_or(String::new(), |h| {
        if h.is_nan() || h > 10.0 * f64::abs(value) {
            " ± ?".to_owned()
        } else {
            format!(" ±{}", text::rough(h))
        }
    });
    format!("{}{plus}", text::brief(value))
}
