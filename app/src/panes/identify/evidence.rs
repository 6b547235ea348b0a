//! What speaks for and against a model: verdicts, what the log shows besides, and pictures of both.

use std::sync::Arc;

use eframe::egui::{self, Color32, RichText};
use egui_plot::{HLine, Line, LineStyle, Plot, PlotPoint, PlotPoints, Polygon};
use vasos_engine::document::{DocumentCommand, FittedRows, ModelEntry, NewModel};
use vasos_engine::identify::{ControllerFit, FitVerdict, LoopStudy, ModelFit};
use vasos_engine::model::ProcessModel;

use super::structure_name;
use crate::action::Action;
use crate::widgets::segmented;
use crate::{i18n, plots, text, theme, tr};

/// What is drawn of a fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Picture {
    /// Data and free run.
    #[default]
    Data,
    /// What the model leaves over.
    Residuals,
    /// Step response with its band.
    Step,
    /// Correlations of the residuals with their bands.
    Tests,
    /// What the classical ways read off a step, together on it.
    Curve,
}

pub fn ui(ui: &mut egui::Ui, entry: &ModelEntry, picture: &mut Picture, actions: &mut Vec<Action>) {
    heading(ui, entry, actions);
    let p = theme::palette(ui);
    let Some(fit) = &entry.fit else { return };
    let verdict = |ui: &mut egui::Ui, verdict: &FitVerdict| {
        let objection = verdict.is_objection();
        line(ui, &i18n::say(verdict), if objection { p.caution } else { p.text }, objection);
    };
    verdict(ui, fit.verdict());
    if let Some(rows) = &entry.rows {
        pictures(ui, entry, fit, rows, picture, actions);
    }
    for other in fit.verdicts.iter().skip(1) {
        verdict(ui, other);
    }
    let Some(study) = &entry.study else { return };
    if let Some(controller) = &study.controller {
        line(ui, &controller_words(controller), p.text, false);
    }
    for finding in &study.findings {
        let warning = finding.is_warning();
        line(ui, &i18n::say(finding), if warning { p.caution } else { p.weak }, warning);
    }
}

fn pictures(
    ui: &mut egui::Ui,
    entry: &ModelEntry,
    fit: &ModelFit,
    rows: &FittedRows,
    picture: &mut Picture,
    actions: &mut Vec<Action>,
) {
    let curve = entry.study.as_ref().and_then(|study| study.reaction_curve.as_ref().ok());
    let mut pictures = vec![
        (Picture::Data, tr!("identify.data")),
        (Picture::Residuals, tr!("identify.residuals")),
        (Picture::Step, tr!("identify.step")),
        (Picture::Tests, tr!("identify.tests")),
    ];
    if curve.is_some() {
        pictures.push((Picture::Curve, tr!("identify.curve")));
    }
    let labels: Vec<String> = pictures.iter().map(|(_, label)| label.clone()).collect();
    let chosen = pictures.iter().position(|(x, _)| x == picture).unwrap_or(0);
    ui.horizontal_wrapped(|ui| {
        if let Some(pressed) = segmented(ui, &tr!("identify.picture"), &labels, chosen) {
            *picture = pictures[pressed].0;
        }
    });
    match (*picture, curve) {
        (Picture::Residuals, _) => residuals(ui, entry, fit, rows),
        (Picture::Step, _) => step(ui, entry, fit),
        (Picture::Tests, _) => tests(ui, fit),
        (Picture::Curve, Some(curve)) => super::curve::ui(ui, entry, rows, curve, actions),
        (Picture::Data | Picture::Curve, _) => overlay(ui, entry, fit, rows),
    }
}

fn line(ui: &mut egui::Ui, words: &str, colour: Color32, warn: bool) {
    let sign = if warn { "! " } else { "" };
    ui.add(egui::Label::new(RichText::new(format!("{sign}{words}")).color(colour)).wrap());
}

/// Structure, dead time ratio, and the other structures that were fitted, each to be taken instead.
fn heading(ui: &mut egui::Ui, entry: &ModelEntry, actions: &mut Vec<Action>) {
    let p = theme::palette(ui);
    ui.horizontal_wrapped(|ui| {
        let name = entry.fit.as_ref().map_or_else(
            || match entry.model {
                ProcessModel::Fopdt(_) => tr!("structure.fopdt"),
                ProcessModel::Ipdt(_) => tr!("structure.ipdt"),
                ProcessModel::Sopdt(_) => tr!("structure.sopdt"),
                ProcessModel::Rational(_) => tr!("structure.rational"),
            },
            |f| structure_name(Some(f.structure)),
        );
        let ratio = match &entry.model {
            ProcessModel::Fopdt(m) => format!(" · θ/τ = {}", text::brief(m.dead_time_ratio())),
            _ => String::new(),
        };
        ui.label(RichText::new(format!("{name}{ratio}")).color(p.weak))
            .on_hover_text(tr!("identify.ratio_hint"));
        let (Some(study), Some(fit)) = (&entry.study, &entry.fit) else { return };
        for other in others(study, fit) {
            let words =
                format!("{} {} %", structure_name(Some(other.structure)), text::fixed(other.fit_percent, 1));
            if ui.small_button(words).on_hover_text(tr!("identify.take_instead")).clicked() {
                actions.push(Action::Document(DocumentCommand::AddModel(Box::new(instead(entry, other)))));
            }
        }
    });
}

fn others<'a>(study: &'a LoopStudy, fit: &'a ModelFit) -> impl Iterator<Item = &'a ModelFit> {
    let fits = study.choice.as_ref().map_or(&[][..], |c| c.fits.as_slice());
    fits.iter().filter(|f| f.structure != fit.structure)
}

fn instead(entry: &ModelEntry, other: &ModelFit) -> NewModel {
    NewModel {
        model: other.model.clone(),
        origin: entry.origin.clone(),
        fit: Some(Arc::new(other.clone())),
        study: entry.study.clone(),
        rows: entry.rows.clone(),
        pv_unit: entry.pv_unit.clone(),
        mv_unit: entry.mv_unit.clone(),
    }
}

fn controller_words(c: &ControllerFit) -> String {
    let half = |interval: [f64; 2]| text::rough(0.5 * (interval[1] - interval[0]));
    let mut words = format!("Kc = {} ±{}", text::brief(c.kc), half(c.kc_interval_95));
    for (name, value, interval) in [("Ti", c.ti_s, c.ti_interval_95), ("Td", c.td_s, c.td_interval_95)] {
        if let (Some(value), Some(interval)) = (value, interval) {
            let plus =
                if interval[1].is_finite() { format!(" ±{}", half(interval)) } else { " ± ?".to_owned() };
            words.push_str(&format!(", {name} = {}{plus} s", text::brief(value)));
        }
    }
    tr!("identify.controller", gains = words, percent = text::fixed(100.0 * c.r2, 0))
}

/// Points of a curve that a screen can show.
pub(super) fn thinned(time_s: &[f64], values: &[f64]) -> PlotPoints<'static> {
    let thin = (time_s.len() / 1500).max(1);
    time_s.iter().zip(values).step_by(thin).map(|(t, v)| [*t, *v]).collect::<Vec<[f64; 2]>>().into()
}

pub(super) fn legend(ui: &mut egui::Ui, entries: &[(String, Color32)]) {
    ui.horizontal(|ui| {
        for (words, colour) in entries {
            let (rect, _) = ui.allocate_exact_size(egui::vec2(14.0, 10.0), egui::Sense::hover());
            ui.painter().hline(rect.x_range(), rect.center().y, egui::Stroke::new(2.0, *colour));
            ui.label(RichText::new(words).size(theme::SMALL));
        }
    });
}

pub(super) fn frame(ui: &egui::Ui, name: &'static str, y: String) -> Plot<'static> {
    let p = theme::palette(ui);
    Plot::new(name)
        .height(ui.available_height().clamp(160.0, 420.0))
        .allow_scroll(false)
        .custom_y_axes(vec![plots::y_axis(y)])
        .grid_color(p.grid)
        .y_grid_spacer(plots::y_marks)
}

pub(super) fn clock_axis(plot: Plot<'static>) -> Plot<'static> {
    plot.custom_x_axes(vec![
        plots::x_axis(tr!("trend.time_axis")).formatter(|mark, _| text::clock(mark.value)),
    ])
    .x_grid_spacer(plots::time_marks)
}

pub(super) fn unit_of(entry: &ModelEntry) -> String {
    if entry.pv_unit.is_empty() { String::new() } else { format!(" [{}]", entry.pv_unit) }
}

/// Data and free run of the model.
fn overlay(ui: &mut egui::Ui, entry: &ModelEntry, fit: &ModelFit, rows: &FittedRows) {
    let p = theme::palette(ui);
    legend(ui, &[(tr!("identify.data"), p.ghost), (tr!("identify.model"), p.pv)]);
    clock_axis(frame(ui, "overlay", format!("PV{}", unit_of(entry)))).show(ui, |plot| {
        plot.line(Line::new(tr!("identify.data"), thinned(&rows.time_s, &rows.pv)).color(p.ghost).width(1.2));
        plot.line(
            Line::new(tr!("identify.model"), thinned(&rows.time_s, &fit.simulated))
                .color(p.pv)
                .width(theme::LINE),
        );
    });
}

fn residuals(ui: &mut egui::Ui, entry: &ModelEntry, fit: &ModelFit, rows: &FittedRows) {
    let p = theme::palette(ui);
    legend(ui, &[(tr!("identify.residuals"), p.pv)]);
    clock_axis(frame(ui, "residuals", format!("{}{}", tr!("identify.residual_axis"), unit_of(entry)))).show(
        ui,
        |plot| {
            plot.hline(HLine::new("0", 0.0).color(p.ghost));
            plot.line(
                Line::new(tr!("identify.residuals"), thinned(&rows.time_s, &fit.residuals))
                    .color(p.pv)
                    .width(1.2),
            );
        },
    );
}

/// Response to a unit step of the MV with its pointwise 95 % band.
fn step(ui: &mut egui::Ui, entry: &ModelEntry, fit: &ModelFit) {
    const POINTS: u32 = 200;
    let p = theme::palette(ui);
    let value = |name: &str| fit.parameter(name).map_or(0.0, |q| q.value);
    let slow_s = value("T_s") + value("T2_s");
    let span_s = value("L_s") + if slow_s > 0.0 { 5.0 * slow_s } else { 10.0 * value("L_s").max(1.0) };
    let time_s: Vec<f64> = (0..=POINTS).map(|k| span_s * f64::from(k) / f64::from(POINTS)).collect();
    let band = fit.step_band(&time_s);
    legend(ui, &[(tr!("identify.model"), p.pv), (tr!("identify.band"), p.ghost)]);
    let unit = text::quotient(&entry.pv_unit, &entry.mv_unit);
    let unit = if unit.is_empty() { unit } else { format!(" [{unit}]") };
    let plot = frame(ui, "step_band", format!("{}{unit}", tr!("identify.step_axis")))
        .custom_x_axes(vec![plots::x_axis(tr!("identify.time_axis"))])
        .x_grid_spacer(plots::x_marks);
    let curve = |i: usize| -> Vec<[f64; 2]> {
        time_s.iter().zip(&band).map(|(t, b)| [*t, b[i]]).filter(|q| q[1].is_finite()).collect()
    };
    plot.show(ui, |plot| {
        // Strips: a polygon over the whole band would not be convex.
        let (low, high) = (curve(0), curve(2));
        for (a, b) in low.windows(2).zip(high.windows(2)) {
            let corners = vec![a[0], a[1], b[1], b[0]];
            plot.polygon(
                Polygon::new("", PlotPoints::from(corners))
                    .fill_color(p.pv.gamma_multiply(0.15))
                    .stroke(egui::Stroke::NONE)
                    .allow_hover(false),
            );
        }
        for edge in [low, high] {
            plot.line(
                Line::new(tr!("identify.band"), PlotPoints::from(edge))
                    .color(p.ghost)
                    .width(1.0)
                    .style(LineStyle::dashed_dense()),
            );
        }
        plot.line(
            Line::new(tr!("identify.model"), PlotPoints::from(curve(1))).color(p.pv).width(theme::LINE),
        );
    });
}

/// Autocorrelation of the residuals and their correlation with the moves of the MV, each with its band.
fn tests(ui: &mut egui::Ui, fit: &ModelFit) {
    let p = theme::palette(ui);
    legend(ui, &[(tr!("identify.autocorrelation"), p.pv), (tr!("identify.cross_correlation"), p.mv)]);
    let plot = frame(ui, "tests", tr!("identify.correlation_axis"))
        .custom_x_axes(vec![plots::x_axis(tr!("identify.lag_axis"))])
        .x_grid_spacer(plots::x_marks)
        .include_y(0.5)
        .include_y(-0.5);
    plot.show(ui, |plot| {
        for (band, colour) in
            [(fit.tests.autocorrelation_band, p.pv), (fit.tests.cross_correlation_band, p.mv)]
        {
            for edge in [band, -band] {
                plot.hline(
                    HLine::new("95 %", edge)
                        .color(colour.gamma_multiply(0.6))
                        .style(LineStyle::dashed_dense()),
                );
            }
        }
        plot.hline(HLine::new("0", 0.0).color(p.ghost));
        let stems =
            [(&fit.tests.autocorrelation, 1.0, p.pv, -0.12), (&fit.tests.cross_correlation, 0.0, p.mv, 0.12)];
        for (values, first, colour, shift) in stems {
            for (k, value) in values.iter().enumerate() {
                let x = first + k as f64 + shift;
                let points = vec![PlotPoint::new(x, 0.0), PlotPoint::new(x, *value)];
                plot.line(
                    Line::new("", PlotPoints::Owned(points)).color(colour).width(2.5).allow_hover(false),
                );
            }
        }
    });
}
