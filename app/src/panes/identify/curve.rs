//! The reaction curve with what each classical way reads off it.

use eframe::egui::{self, Color32, RichText};
use egui_plot::Line;
use vasos_engine::document::{DocumentCommand, FittedRows, ModelEntry, NewModel};
use vasos_engine::identify::{CurveMethod, ReactionCurve};
use vasos_engine::model::ProcessModel;

use super::evidence::{clock_axis, frame, legend, thinned, unit_of};
use crate::action::Action;
use crate::{text, theme, tr};

fn name(method: CurveMethod) -> String {
    match method {
        CurveMethod::Tangent => tr!("curve.tangent"),
        CurveMethod::TwoPoints => tr!("curve.two_points"),
        CurveMethod::Onset => tr!("curve.onset"),
        CurveMethod::Area => tr!("curve.area"),
        CurveMethod::LeastSquares => tr!("curve.least_squares"),
    }
}

fn colour(method: CurveMethod, p: &theme::Palette) -> Color32 {
    match method {
        CurveMethod::Tangent => p.sp,
        CurveMethod::TwoPoints => p.mv,
        CurveMethod::Onset => p.alarm,
        CurveMethod::Area => p.caution,
        CurveMethod::LeastSquares => p.pv,
    }
}

pub(super) fn ui(
    ui: &mut egui::Ui,
    entry: &ModelEntry,
    rows: &FittedRows,
    curve: &ReactionCurve,
    actions: &mut Vec<Action>,
) {
    let p = theme::palette(ui);
    table(ui, entry, curve, actions);
    legend(ui, &[(tr!("identify.data"), p.ghost)]);
    clock_axis(frame(ui, "reaction", format!("PV{}", unit_of(entry)))).show(ui, |plot| {
        plot.line(Line::new(tr!("identify.data"), thinned(&rows.time_s, &rows.pv)).color(p.ghost).width(1.2));
        for estimate in &curve.estimates {
            let points = thinned(&rows.time_s, &estimate.simulated);
            plot.line(Line::new(name(estimate.method), points).color(colour(estimate.method, &p)).width(1.4));
        }
    });
}

fn table(ui: &mut egui::Ui, entry: &ModelEntry, curve: &ReactionCurve, actions: &mut Vec<Action>) {
    let p = theme::palette(ui);
    egui::ScrollArea::horizontal().id_salt("reaction table").show(ui, |ui| {
        egui::Grid::new("reaction estimates").striped(true).spacing([7.0, 2.0]).show(ui, |ui| {
            for title in ["", "K", "T [s]", "L [s]", "R²", ""] {
                ui.label(RichText::new(title).size(theme::SMALL).color(p.weak));
            }
            ui.end_row();
            for estimate in &curve.estimates {
                let m = &estimate.model;
                ui.label(
                    RichText::new(name(estimate.method))
                        .size(theme::TABLE)
                        .color(colour(estimate.method, &p)),
                );
                for value in [m.gain, m.time_constant_s, m.dead_time_s] {
                    ui.label(RichText::new(text::brief(value)).size(theme::TABLE));
                }
                ui.label(RichText::new(text::fixed(estimate.r2, 4)).size(theme::TABLE));
                if ui.small_button(tr!("curve.take")).on_hover_text(tr!("curve.take_hint")).clicked() {
                    actions.push(Action::Document(DocumentCommand::AddModel(Box::new(NewModel {
                        model: ProcessModel::Fopdt(*m),
                        origin: entry.origin.clone(),
                        fit: None,
                        study: None,
                        rows: None,
                        pv_unit: entry.pv_unit.clone(),
                        mv_unit: entry.mv_unit.clone(),
                    }))));
                }
                ui.end_row();
            }
        });
    });
}
