//! Time responses of the loop: a setpoint step and a load step, of y and of u.

use eframe::egui::{self, RichText};
use egui_plot::{Line, Plot, PlotPoints};
use vasos_engine::analyze::{Excitation, Response, ResponseOptions, step_response};
use vasos_engine::control::PidGains;
use vasos_engine::model::ProcessModel;

use crate::action::Action;
use crate::panes::View;
use crate::panes::tune::row_in_view;
use crate::tuning::{PRESENT, Row};
use crate::widgets::segmented;
use crate::{plots, text, theme, tr};

/// State of the pane.
#[derive(Default)]
pub struct State {
    load: bool,
    cached: Vec<Cached>,
}

struct Cached {
    model: ProcessModel,
    gains: PidGains,
    load: bool,
    horizon_s: Option<f64>,
    response: std::rc::Rc<Response>,
}

impl State {
    fn response(
        &mut self,
        model: &ProcessModel,
        gains: &PidGains,
        horizon_s: Option<f64>,
    ) -> std::rc::Rc<Response> {
        let load = self.load;
        let same = |c: &&Cached| {
            c.model == *model && c.gains == *gains && c.load == load && c.horizon_s == horizon_s
        };
        if let Some(known) = self.cached.iter().find(same) {
            return known.response.clone();
        }
        let excitation = if load { Excitation::Load } else { Excitation::Setpoint };
        let options = ResponseOptions { horizon_s, ..ResponseOptions::default() };
        let response = std::rc::Rc::new(step_response(model, gains, excitation, &options));
        if self.cached.len() >= 12 {
            self.cached.remove(0);
        }
        self.cached.push(Cached {
            model: model.clone(),
            gains: *gains,
            load,
            horizon_s,
            response: response.clone(),
        });
        response
    }
}

/// Draws the pane.
pub fn ui(ui: &mut egui::Ui, view: &View, state: &mut State) -> Vec<Action> {
    let (Some(model), Some(row)) = (&view.tuning.model, row_in_view(view)) else {
        ui.add(egui::Label::new(RichText::new(tr!("step.no_model")).color(theme::palette(ui).weak)).wrap());
        return vec![];
    };
    ui.horizontal_wrapped(|ui| {
        let kinds = [tr!("step.setpoint"), tr!("step.load")];
        if let Some(kind) = segmented(ui, &tr!("step.kind"), &kinds, usize::from(state.load)) {
            state.load = kind == 1;
        }
    });
    let first = state.response(model, &row.gains, None);
    let settling = first.metrics().ok().and_then(|m| m.settling_time_s);
    let horizon_s = settling.filter(|s| *s > 0.0).map(|s| 1.8 * s);
    let response = state.response(model, &row.gains, horizon_s);
    let shown_s = response.time_s.last().copied();
    let present = view.tuning.rows.first().filter(|r| r.rule == PRESENT && r.gains != row.gains);
    let ghost = present.map(|r| state.response(model, &r.gains, shown_s));
    let height = ui.available_height() - 36.0;
    let units = view
        .document
        .model()
        .map_or((String::new(), String::new()), |e| (e.pv_unit.clone(), e.mv_unit.clone()));
    curves(ui, true, 0.58 * height, &response, ghost.as_deref(), &units, state.load);
    curves(ui, false, 0.42 * height, &response, ghost.as_deref(), &units, state.load);
    figures(ui, row, &first, state.load, &units);
    vec![]
}

fn curves(
    ui: &mut egui::Ui,
    is_pv: bool,
    height: f32,
    response: &Response,
    ghost: Option<&Response>,
    (pv_unit, mv_unit): &(String, String),
    load: bool,
) {
    let p = theme::palette(ui);
    let points = |r: &Response| -> PlotPoints<'static> {
        let values = if is_pv { &r.y } else { &r.u };
        r.time_s.iter().zip(values).map(|(t, v)| [*t, *v]).collect::<Vec<_>>().into()
    };
    // Responses to a unit step: PV per PV (or per MV), MV per PV (or per MV).
    let per = if load { mv_unit } else { pv_unit };
    let of = if is_pv { pv_unit } else { mv_unit };
    let known = !of.is_empty() && !per.is_empty();
    let unit = if known { format!(" [{}]", text::quotient(of, per)) } else { String::new() };
    let mut plot = Plot::new(if is_pv { "step_y" } else { "step_u" })
        .height(height.max(50.0))
        .allow_scroll(false)
        .custom_y_axes(vec![plots::y_axis(format!("{}{unit}", if is_pv { "PV" } else { "MV" }))])
        .grid_color(p.grid)
        .x_grid_spacer(plots::x_marks)
        .y_grid_spacer(plots::y_marks)
        .include_y(0.0);
    let time_label = if is_pv { String::new() } else { tr!("step.time_axis") };
    plot = plot.custom_x_axes(vec![plots::x_axis(time_label)]);
    let names = (tr!("step.in_view"), tr!("rules.present"));
    plot.show(ui, |plot| {
        if let Some(ghost) = ghost {
            plot.line(Line::new(names.1, points(ghost)).color(p.ghost).width(1.2));
        }
        let colour = if is_pv { p.pv } else { p.mv };
        plot.line(Line::new(names.0, points(response)).color(colour).width(theme::LINE));
    });
}

fn figures(ui: &mut egui::Ui, row: &Row, response: &Response, load: bool, units: &(String, String)) {
    let p = theme::palette(ui);
    let words = match response.metrics() {
        Ok(m) if row.analysis.stable => {
            let iae = if load { row.figures.iae_load } else { row.figures.iae_setpoint };
            // Of a unit step: the PV per PV for a setpoint, per MV for a load.
            let gain = text::quotient(&units.0, &units.1);
            let with = |number: String, unit: String| format!("{number} {unit}");
            let of = |times: &str, square: &str| {
                if load { format!("({gain}){square}·{times}") } else { times.to_owned() }
            };
            let tv_unit = if load { String::new() } else { text::quotient(&units.1, &units.0) };
            let first = tr!(
                "step.figures",
                iae = with(text::maybe(iae), of("s", "")),
                ise = with(text::brief(m.ise), of("s", "²")),
                itae = with(text::brief(m.itae), of("s²", "")),
                tv = with(text::brief(m.total_variation), tv_unit).trim_end().to_owned()
            );
            match m.overshoot_percent {
                Some(overshoot) => tr!("step.overshoot", overshoot = text::fixed(overshoot, 1), rest = first),
                None => tr!("step.peak", peak = text::brief(m.peak_error), rest = first),
            }
        }
        _ => tr!("tune.unstable_hint"),
    };
    ui.add(egui::Label::new(RichText::new(words).size(theme::SMALL).color(p.text)).wrap());
}
