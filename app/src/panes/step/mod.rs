//! Time responses of the loop: a setpoint step and a load step, of y and of u, on the model with what its uncertainty
//! makes of them, and on the non-linear rig.

mod on_rig;
mod speed;

use eframe::egui::{self, RichText};
use egui_plot::{Line, Plot, PlotPoints, Polygon};
use vasos_engine::analyze::{Excitation, Response, ResponseOptions, step_response};
use vasos_engine::control::{ParallelGains, PidGains};
use vasos_engine::model::ProcessModel;
use vasos_engine::tune::TuningSpread;

use crate::action::Action;
use crate::answers::{Question, Reply};
use crate::panes::View;
use crate::panes::tune::{row_in_view, title};
use crate::tuning::{PRESENT, Row};
use crate::widgets::segmented;
use crate::{plots, text, theme, tr};
use speed::Handle;

/// State of the pane.
#[derive(Default)]
pub struct State {
    load: bool,
    rig: bool,
    /// The band last shown, until the next is worked out.
    band: Option<std::sync::Arc<Reply>>,
    cached: Vec<Cached>,
    /// The speed of the loop is being dragged.
    drag: Option<speed::Drag>,
}

struct Cached {
    model: ProcessModel,
    gains: PidGains,
    load: bool,
    b: f64,
    horizon_s: Option<f64>,
    response: std::rc::Rc<Response>,
}

impl State {
    fn response(
        &mut self,
        model: &ProcessModel,
        gains: &PidGains,
        b: f64,
        horizon_s: Option<f64>,
    ) -> std::rc::Rc<Response> {
        let load = self.load;
        let same = |c: &&Cached| {
            c.model == *model && c.gains == *gains && c.load == load && c.b == b && c.horizon_s == horizon_s
        };
        if let Some(known) = self.cached.iter().find(same) {
            return known.response.clone();
        }
        let excitation = if load { Excitation::Load } else { Excitation::Setpoint };
        let options = ResponseOptions { horizon_s, setpoint_weight_b: b, ..ResponseOptions::default() };
        let response = std::rc::Rc::new(step_response(model, gains, excitation, &options));
        if self.cached.len() >= 16 {
            self.cached.remove(0);
        }
        self.cached.push(Cached {
            model: model.clone(),
            gains: *gains,
            load,
            b,
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
        let places = [tr!("step.model"), tr!("step.rig")];
        if let Some(place) = segmented(ui, &tr!("step.place"), &places, usize::from(state.rig)) {
            state.rig = place == 1;
        }
        // The rig gets both, one after the other.
        if !state.rig
            && let Some(kind) = segmented(ui, &tr!("step.kind"), &kinds, usize::from(state.load))
        {
            state.load = kind == 1;
        }
    });
    if state.rig {
        return on_rig::ui(ui, view, row);
    }
    let b = view.tuning.setpoint.flatten().map_or(1.0, |side| side.b);
    let first = state.response(model, &row.gains, b, None);
    let settling = first.metrics().ok().and_then(|m| m.settling_time_s);
    let horizon_s = settling.filter(|s| *s > 0.0).map(|s| 1.8 * s);
    let horizon_s = state.drag.map_or(horizon_s, |drag| Some(drag.axis_s));
    let response = state.response(model, &row.gains, b, horizon_s);
    let shown_s = response.time_s.last().copied();
    let present = view.tuning.rows.first().filter(|r| r.rule == PRESENT && r.gains != row.gains);
    let mut others: Vec<(String, egui::Color32, std::rc::Rc<Response>)> = vec![];
    let p = theme::palette(ui);
    let overlaid = view.tuning.compared.iter().enumerate().filter(|(_, r)| r.gains != row.gains);
    if let Some(present) = present {
        others.push((tr!("rules.present"), p.ghost, state.response(model, &present.gains, 1.0, shown_s)));
    }
    for (k, other) in overlaid.filter(|(_, r)| r.rule != PRESENT) {
        let response = state.response(model, &other.gains, 1.0, shown_s);
        others.push((title(other), theme::series(&p, k + 1), response));
    }
    let (band, mut actions) = band(view, state, model, row, shown_s);
    let names: Vec<(String, egui::Color32)> = others.iter().map(|(n, c, _)| (n.clone(), *c)).collect();
    // The tuning in use alone, in grey, needs no names.
    if !view.tuning.compared.is_empty() {
        plots::legend(ui, &title(row), p.pv, &names);
    }
    let height = ui.available_height() - if band.is_some() { 52.0 } else { 36.0 };
    let units = view
        .document
        .model()
        .map_or((String::new(), String::new()), |e| (e.pv_unit.clone(), e.mv_unit.clone()));
    let legend = !view.tuning.compared.is_empty();
    let handle = if state.load { None } else { Handle::of(row, model.dead_time_s()) };
    let dragging = state.drag.is_some();
    let drawn = Drawn { response: &response, others: &others, legend, band: band.as_ref(), handle, dragging };
    let shown = curves(ui, true, 0.58 * height, &drawn, &units, state.load);
    curves(ui, false, 0.42 * height, &drawn, &units, state.load);
    match handle {
        Some(handle) => {
            let axis_s = shown_s.unwrap_or_default();
            actions.extend(handle.drag(ui, &mut state.drag, axis_s, &shown));
        }
        None => state.drag = None,
    }
    figures(ui, row, &first, state.load, &units);
    if let Some(band) = &band {
        let p = theme::palette(ui);
        let words = tr!(
            "step.spread",
            models = band.models,
            unstable = text::fixed(100.0 * band.unstable_share(), 1),
            low = text::brief(band.ms.low),
            high = text::brief(band.ms.high)
        );
        let colour = if band.unstable > 0 { p.caution } else { p.weak };
        ui.add(egui::Label::new(RichText::new(words).size(theme::SMALL).color(colour)).wrap());
    }
    actions
}

/// Curves of one plot.
struct Drawn<'a> {
    response: &'a Response,
    /// Whether names and colours stand above the plots.
    legend: bool,
    /// Name, colour and response of those beside it.
    others: &'a [(String, egui::Color32, std::rc::Rc<Response>)],
    band: Option<&'a TuningSpread>,
    /// The speed that the rule was asked for, and whether it is being dragged.
    handle: Option<Handle>,
    dragging: bool,
}

/// What the uncertainty of the model's fit makes of the tuning in view, asked for where it is not known.
fn band(
    view: &View,
    state: &mut State,
    model: &ProcessModel,
    row: &Row,
    horizon_s: Option<f64>,
) -> (Option<TuningSpread>, Vec<Action>) {
    let fit = view.document.model().and_then(|entry| entry.fit.clone()).filter(|fit| fit.model == *model);
    let (Some(fit), Some(horizon_s)) = (fit, horizon_s) else {
        state.band = None;
        return (None, vec![]);
    };
    let gains = ParallelGains::from(row.gains);
    let excitation = if state.load { Excitation::Load } else { Excitation::Setpoint };
    let question = Question::Spread { fit, gains, excitation, horizon_s };
    let mut actions = vec![];
    match view.answers.find(&question) {
        Some(reply) => state.band = Some(reply),
        None => actions.push(Action::Ask(Box::new(question))),
    }
    let band = match state.band.as_deref() {
        Some(Reply::Spread(band)) => band.clone(),
        _ => None,
    };
    (band, actions)
}

fn curves(
    ui: &mut egui::Ui,
    is_pv: bool,
    height: f32,
    drawn: &Drawn<'_>,
    (pv_unit, mv_unit): &(String, String),
    load: bool,
) -> egui_plot::PlotResponse<()> {
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
        .allow_drag(!drawn.dragging)
        .custom_y_axes(vec![plots::y_axis(format!("{}{unit}", if is_pv { "PV" } else { "MV" }))])
        .grid_color(p.grid)
        .x_grid_spacer(plots::x_marks)
        .y_grid_spacer(plots::y_marks)
        .include_y(0.0);
    let time_label = if is_pv { String::new() } else { tr!("step.time_axis") };
    plot = plot.custom_x_axes(vec![plots::x_axis(time_label)]);
    plot.show(ui, |plot| {
        // Beside others the colour stands for the tuning, not for the signal.
        let colour = if is_pv || drawn.legend { p.pv } else { p.mv };
        if let Some(band) = drawn.band {
            let values = if is_pv { &band.pv } else { &band.mv };
            plot.polygon(fan(&band.time_s, values).fill_color(colour.gamma_multiply(0.16)));
        }
        for (name, colour, other) in drawn.others {
            plot.line(Line::new(name.clone(), points(other)).color(*colour).width(1.2));
        }
        plot.line(Line::new(tr!("step.in_view"), points(drawn.response)).color(colour).width(theme::LINE));
        if let Some(handle) = drawn.handle.filter(|_| is_pv) {
            handle.draw(plot, &p);
        }
    })
}

/// From the lower edge of a band along and back along the upper one, as far as both are finite.
fn fan(time_s: &[f64], band: &[[f64; 3]]) -> Polygon<'static> {
    /// A loop that runs away would leave nothing else to be seen.
    const FARTHEST: f64 = 20.0;
    let known = time_s.iter().zip(band).take_while(|(_, b)| b.iter().all(|v| v.abs() < FARTHEST));
    let known: Vec<(f64, [f64; 3])> = known.map(|(t, b)| (*t, *b)).collect();
    let lower = known.iter().map(|(t, b)| [*t, b[0]]);
    let upper = known.iter().rev().map(|(t, b)| [*t, b[2]]);
    let outline: Vec<[f64; 2]> = lower.chain(upper).collect();
    Polygon::new(tr!("step.band"), PlotPoints::from(outline)).stroke(egui::Stroke::NONE).allow_hover(false)
}

fn figures(ui: &mut egui::Ui, row: &Row, response: &Response, load: bool, units: &(String, String)) {
    let p = theme::palette(ui);
    let words = match response.metrics() {
        Ok(m) if row.analysis.stable => {
            let iae = if load { row.figures.iae_load } else { Some(m.iae) };
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
