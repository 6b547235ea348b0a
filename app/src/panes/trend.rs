//! Signals over time: PV and SP above, MV below, on one time axis. Drag to pan, scroll to zoom, brush to choose a
//! stretch for identification.

use eframe::egui::{self, Color32, Id, Role, WidgetInfo, vec2};
use egui_plot::{GridMark, Line, LineStyle, Plot, PlotPoint, PlotPoints, PlotUi, Span, Text, VLine};
use vasos_engine::document::{DocumentCommand, SourceChoice, Stretch};
use vasos_engine::signal::{ChannelKind, Pyramid};
use vasos_engine::sim::LoopTarget;

use crate::action::{Action, Table};
use crate::panes::View;
use crate::theme::{self, Palette};
use crate::traces::RunTrace;
use crate::{plots, text, tr};

/// Stretches of time to choose from, in seconds; the last is everything.
const SPANS_S: [Option<f64>; 5] = [Some(60.0), Some(300.0), Some(600.0), Some(1800.0), None];

/// State of the pane.
pub struct State {
    /// The newest sample stays in view.
    pub follow: bool,
    span: usize,
    brushing: bool,
    brush_from_s: Option<f64>,
    bounds_s: [f64; 2],
    tanks: bool,
    was_log: bool,
}

impl Default for State {
    fn default() -> Self {
        Self {
            follow: true,
            span: 1,
            brushing: false,
            brush_from_s: None,
            bounds_s: [0.0, 300.0],
            tanks: false,
            was_log: false,
        }
    }
}

/// A curve to draw.
struct Curve<'a> {
    name: String,
    data: &'a Pyramid,
    colour: Color32,
    steps: bool,
    thin: bool,
}

/// Everything the two plots show.
struct Content<'a> {
    upper: Vec<Curve<'a>>,
    lower: Vec<Curve<'a>>,
    upper_axis: String,
    lower_axis: String,
    /// What is followed: the newest sample, or the time that is played.
    end_s: f64,
    end_of_all_s: f64,
}

/// Draws the pane.
pub fn ui(ui: &mut egui::Ui, view: &View, state: &mut State) -> Vec<Action> {
    let mut actions = vec![];
    let is_log = view.document.source == SourceChoice::Log && view.log.is_some();
    if is_log != state.was_log {
        state.was_log = is_log;
        state.follow = !is_log;
        let end_s = view.log.and_then(|l| l.table.time_s.last().copied()).unwrap_or(300.0);
        state.bounds_s = if is_log { [-0.02 * end_s, 1.05 * end_s] } else { [0.0, 300.0] };
    }
    let p = theme::palette(ui);
    header(ui, view, state, is_log, &mut actions);
    let content = if is_log { of_log(view, &p) } else { of_run(view, state, &p) };
    if state.follow {
        let all = content.end_of_all_s.max(60.0);
        let span = SPANS_S[state.span].unwrap_or(all);
        let end = if SPANS_S[state.span].is_some() { content.end_s.max(span) } else { all };
        state.bounds_s = [end - span, end + 0.05 * span];
    }
    legend(ui, &content);
    let height = ui.available_height();
    let upper = (height * 0.62).max(60.0);
    plot(ui, view, state, &p, true, upper, &content, &mut actions);
    plot(ui, view, state, &p, false, (height - upper - 4.0).max(40.0), &content, &mut actions);
    actions
}

fn header(ui: &mut egui::Ui, view: &View, state: &mut State, is_log: bool, actions: &mut Vec<Action>) {
    ui.horizontal_wrapped(|ui| {
        if is_log {
            if ui.button(tr!("trend.whole")).clicked() {
                let end_s = view.log.and_then(|l| l.table.time_s.last().copied()).unwrap_or(1.0);
                state.bounds_s = [-0.02 * end_s, 1.05 * end_s];
            }
        } else {
            ui.checkbox(&mut state.follow, tr!("trend.follow"));
            let label =
                |span: Option<f64>| span.map_or_else(|| tr!("trend.all"), |s| format!("{} min", s / 60.0));
            let before = state.span;
            let combo =
                egui::ComboBox::from_id_salt("span").width(70.0).selected_text(label(SPANS_S[state.span]));
            let combo = combo.show_ui(ui, |ui| {
                for (i, span) in SPANS_S.into_iter().enumerate() {
                    ui.selectable_value(&mut state.span, i, label(span));
                }
            });
            combo.response.widget_info(|| WidgetInfo::labeled(Role::ComboBox, true, tr!("trend.span")));
            state.follow |= before != state.span;
            ui.checkbox(&mut state.tanks, tr!("trend.tanks")).on_hover_text(tr!("trend.tanks_hint"));
        }
        ui.toggle_value(&mut state.brushing, tr!("trend.brush")).on_hover_text(tr!("trend.brush_hint"));
        if view.document.stretch.is_some() && ui.button(tr!("trend.no_stretch")).clicked() {
            actions.push(Action::Document(DocumentCommand::Stretch(None)));
        }
        if !is_log {
            if view.kept.is_some() {
                if ui.button(tr!("trend.drop_kept")).clicked() {
                    actions.push(Action::DropKeptRun);
                }
            } else if ui.button(tr!("trend.keep")).on_hover_text(tr!("trend.keep_hint")).clicked() {
                actions.push(Action::KeepRun);
            }
            if ui.button(tr!("trend.export")).on_hover_text(tr!("trend.export_hint")).clicked() {
                actions.push(Action::ExportTrend(Table::Csv));
            }
        }
    });
}

fn of_run<'a>(view: &View<'a>, state: &State, p: &Palette) -> Content<'a> {
    let mut content = Content {
        upper: vec![],
        lower: vec![],
        upper_axis: tr!("trend.level_axis"),
        lower_axis: "MV".to_owned(),
        end_s: view.snapshot.span_s.map_or_else(|| view.run.end_s(), |_| view.snapshot.time_s),
        end_of_all_s: view.run.end_s(),
    };
    let spec = &view.snapshot.network.spec;
    if state.tanks {
        for (i, tank) in spec.tanks.iter().enumerate() {
            let look = Look { colour: theme::series(p, i + 3), steps: false, thin: true };
            let name = format!("{} [cm]", tank.id);
            content.upper.extend(curve(view.run, ChannelKind::Level(i), name, look));
        }
    }
    for (slot, now) in view.snapshot.loops.iter().enumerate() {
        let unit = spec.pumps[now.pump].unit.symbol();
        if slot == view.focus {
            content.lower_axis = format!("MV [{unit}]");
        }
        // The loop in view stands out from the others.
        let other = slot != view.focus;
        let look = |colour: Color32, steps| Look {
            colour: if other { colour.gamma_multiply(0.6) } else { colour },
            steps,
            thin: other,
        };
        let pv = format!("PV {} [cm]", spec.sensors[now.sensor].id);
        // An outer loop's output is the setpoint of its inner one.
        let mv = match now.target {
            LoopTarget::Pump(pump) => format!("MV {} [{unit}]", spec.pumps[pump].id),
            LoopTarget::Loop(_) => format!("MV {} [cm]", now.tag),
        };
        if let Some(kept) = view.kept {
            let look = |steps| Look { colour: p.ghost, steps, thin: true };
            let was = tr!("trend.kept");
            content.upper.extend(curve(kept, ChannelKind::Pv(slot), format!("{pv}, {was}"), look(false)));
            content.lower.extend(curve(kept, ChannelKind::Mv(slot), format!("{mv}, {was}"), look(true)));
        }
        let sp = format!("SP {} [cm]", now.tag);
        content.upper.extend(curve(view.run, ChannelKind::Setpoint(slot), sp, look(p.sp, true)));
        content.upper.extend(curve(view.run, ChannelKind::Pv(slot), pv, look(p.pv, false)));
        content.lower.extend(curve(view.run, ChannelKind::Mv(slot), mv, look(p.mv, true)));
    }
    content
}

/// Names and colours of the curves, above the plots so that they hide nothing.
fn legend(ui: &mut egui::Ui, content: &Content) {
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing = vec2(4.0, 0.0);
        for curve in content.upper.iter().chain(&content.lower) {
            let (rect, _) = ui.allocate_exact_size(vec2(14.0, 14.0), egui::Sense::hover());
            ui.painter().hline(rect.x_range(), rect.center().y, egui::Stroke::new(2.0, curve.colour));
            ui.add(egui::Label::new(egui::RichText::new(&curve.name).size(theme::SMALL)).extend());
            ui.add_space(theme::GAP);
        }
    });
}

/// How a curve is drawn.
struct Look {
    colour: Color32,
    steps: bool,
    thin: bool,
}

fn curve(run: &RunTrace, kind: ChannelKind, name: String, look: Look) -> Option<Curve<'_>> {
    let Look { colour, steps, thin } = look;
    run.column(kind).map(|data| Curve { name, data, colour, steps, thin })
}

fn of_log<'a>(view: &View<'a>, p: &Palette) -> Content<'a> {
    let (mut upper, mut lower) = (vec![], vec![]);
    let mut axes = [String::new(), String::new()];
    let mut end_s = 1.0;
    if let Some(log) = view.log {
        end_s = log.table.time_s.last().copied().unwrap_or(1.0);
        let roles = view.document.roles;
        let name = |i: usize| {
            let column = &log.table.columns[i];
            column.unit.as_ref().map_or(column.name.clone(), |u| format!("{} [{u}]", column.name))
        };
        let [pv, sp, mv] = log.roles(roles);
        for (what, data, index, colour, steps) in
            [("SP", sp, roles.sp, p.sp, true), ("PV", pv, roles.pv, p.pv, false)]
        {
            if let (Some(data), Some(i)) = (data, index) {
                upper.push(Curve { name: format!("{what} {}", name(i)), data, colour, steps, thin: false });
            }
        }
        if let (Some(data), Some(i)) = (mv, roles.mv) {
            lower.push(Curve {
                name: format!("MV {}", name(i)),
                data,
                colour: p.mv,
                steps: true,
                thin: false,
            });
        }
        let axis = |what: &str, index: Option<usize>| {
            let unit = index.and_then(|i| log.table.columns[i].unit.clone());
            unit.map_or_else(|| what.to_owned(), |u| format!("{what} [{u}]"))
        };
        axes = [axis("PV", roles.pv), axis("MV", roles.mv)];
    }
    let [upper_axis, lower_axis] = axes;
    Content { upper, lower, upper_axis, lower_axis, end_s, end_of_all_s: end_s }
}

#[allow(clippy::too_many_arguments, reason = "the two halves of one pane share all of its parts")]
fn plot(
    ui: &mut egui::Ui,
    view: &View,
    state: &mut State,
    p: &Palette,
    is_upper: bool,
    height: f32,
    content: &Content,
    actions: &mut Vec<Action>,
) {
    let curves = if is_upper { &content.upper } else { &content.lower };
    let axis = if is_upper { &content.upper_axis } else { &content.lower_axis };
    let names: Vec<String> = curves.iter().map(|c| c.name.clone()).collect();
    let time_label = if is_upper { String::new() } else { tr!("trend.time_axis") };
    let time_axis = |mark: GridMark, _: &std::ops::RangeInclusive<f64>| axis_time(mark);
    let plot = Plot::new(if is_upper { "upper" } else { "lower" })
        .height(height)
        .show_background(true)
        .allow_drag(!state.brushing)
        .allow_scroll(false)
        .allow_zoom(egui::Vec2b::new(true, false))
        .allow_boxed_zoom(false)
        .allow_double_click_reset(false)
        .link_cursor(Id::unique("trend"), [true, false])
        .custom_y_axes(vec![plots::y_axis(axis.clone()).min_thickness(plots::WIDE_Y_WIDTH)])
        .custom_x_axes(vec![plots::x_axis(time_label).formatter(time_axis)])
        .show_axes([true, true])
        .grid_color(p.grid)
        .set_margin_fraction(vec2(0.0, 0.12))
        .x_grid_spacer(plots::time_marks)
        .y_grid_spacer(plots::y_marks)
        .label_formatter(move |position| {
            let at = |point: &PlotPoint| format!("{}\n{}", text::clock(point.x), text::fixed(point.y, 3));
            match position {
                egui_plot::HoverPosition::NearDataPoint { plot_name, position, .. }
                    if names.iter().any(|n| n == plot_name) =>
                {
                    Some(format!("{plot_name}\n{}", at(position)))
                }
                egui_plot::HoverPosition::NearDataPoint { position, .. } => Some(at(position)),
                egui_plot::HoverPosition::Elsewhere { position } => Some(at(position)),
            }
        });
    let bounds = state.bounds_s;
    let (brushing, follow) = (state.brushing, state.follow);
    let pixels = ui.available_width().max(100.0) as usize;
    let stretch = view.document.stretch;
    let marks = &view.run.marks;
    let log = view.document.source == SourceChoice::Log;
    let played_s = view.snapshot.span_s.filter(|_| !log).map(|_| view.snapshot.time_s);
    let response = plot.show(ui, |plot_ui| {
        plot_ui.set_plot_bounds_x(bounds[0]..=bounds[1]);
        let range = draw_curves(plot_ui, curves, bounds, pixels);
        if let Some((low, high)) = range {
            let room = (0.08 * (high - low)).max(0.02 * high.abs()).max(0.05);
            plot_ui.set_plot_bounds_y(low - room..=high + room);
        }
        if let Some(Stretch { from_s, to_s }) = stretch {
            let edge = egui::Stroke::new(1.0, p.accent_text);
            plot_ui.span(Span::new("", from_s..=to_s).fill(p.shade).border(edge));
        }
        if !log {
            draw_marks(plot_ui, marks, bounds, is_upper, p);
        }
        if let Some(at_s) = played_s {
            plot_ui.vline(VLine::new("", at_s).color(p.accent_text).width(1.5));
        }
        let zoomed = plot_ui.response().hovered().then(|| plot_ui.ctx().input(|i| i.smooth_scroll_delta.y));
        let pointer = plot_ui.pointer_coordinate();
        let moved = f64::from(plot_ui.pointer_coordinate_drag_delta().x);
        (pointer, moved, zoomed.unwrap_or(0.0))
    });
    let (pointer, moved, scrolled) = response.inner;
    let r = &response.response;
    if brushing {
        brush(r, pointer, state, actions);
    } else if r.dragged() && moved != 0.0 {
        state.follow = false;
        state.bounds_s = [bounds[0] - moved, bounds[1] - moved];
    }
    if scrolled != 0.0 {
        let factor = (-f64::from(scrolled) / 200.0).exp();
        let anchor = if follow { bounds[1] } else { pointer.map_or(bounds[1], |q| q.x) };
        state.follow = false;
        state.bounds_s = [anchor + (bounds[0] - anchor) * factor, anchor + (bounds[1] - anchor) * factor];
    }
}

/// Draws the curves and gives the range of what is in view.
fn draw_curves(
    plot_ui: &mut PlotUi,
    curves: &[Curve],
    bounds: [f64; 2],
    pixels: usize,
) -> Option<(f64, f64)> {
    let mut range: Option<(f64, f64)> = None;
    let mut points = Vec::new();
    for curve in curves {
        curve.data.draw(bounds[0], bounds[1], pixels, &mut points);
        for q in &points {
            let (low, high) = range.unwrap_or((q[1], q[1]));
            range = Some((low.min(q[1]), high.max(q[1])));
        }
        let stepped = curve.steps && points.len() < 2 * pixels;
        let line: Vec<[f64; 2]> = if stepped { steps(&points, bounds[1]) } else { points.clone() };
        let width = if curve.thin { 1.0 } else { theme::TREND_LINE };
        let line = Line::new(curve.name.clone(), PlotPoints::from(line)).color(curve.colour).width(width);
        plot_ui.line(line);
    }
    range
}

/// A value holds until the next sample.
fn steps(points: &[[f64; 2]], end_s: f64) -> Vec<[f64; 2]> {
    let mut line = Vec::with_capacity(2 * points.len() + 1);
    for (i, q) in points.iter().enumerate() {
        if i > 0 && points[i - 1][1] != q[1] {
            line.push([q[0], points[i - 1][1]]);
        }
        line.push(*q);
    }
    if let (Some(&[t, v]), 1) = (line.last(), line.len()) {
        line.push([t.max(end_s), v]);
    }
    line
}

fn draw_marks(
    plot_ui: &mut PlotUi,
    marks: &[crate::traces::Mark],
    bounds: [f64; 2],
    words: bool,
    p: &Palette,
) {
    let span = bounds[1] - bounds[0];
    let visible = marks.iter().filter(|m| (bounds[0]..=bounds[1]).contains(&m.time_s));
    let top = plot_ui.plot_bounds().max()[1];
    let mut free_from_s = f64::NEG_INFINITY;
    for mark in visible {
        plot_ui.vline(VLine::new("", mark.time_s).color(p.weak).width(1.0).style(LineStyle::dashed_dense()));
        // Words that would run into each other stay away; the log has them all.
        if words && mark.time_s > free_from_s {
            let label = egui::RichText::new(format!(" {}", mark.words)).size(theme::SMALL).color(p.weak);
            let text = Text::new("", PlotPoint::new(mark.time_s, top), label).anchor(egui::Align2::LEFT_TOP);
            plot_ui.text(text);
            free_from_s = mark.time_s + 0.16 * span;
        }
    }
}

fn brush(r: &egui::Response, pointer: Option<PlotPoint>, state: &mut State, actions: &mut Vec<Action>) {
    let Some(at) = pointer.map(|q| q.x) else { return };
    if r.drag_started() {
        state.brush_from_s = Some(at);
    }
    if let (Some(from), true) = (state.brush_from_s, r.dragged()) {
        let stretch = Stretch { from_s: from.min(at), to_s: from.max(at) };
        if stretch.to_s > stretch.from_s {
            actions.push(Action::Document(DocumentCommand::Stretch(Some(stretch))));
        }
    }
    if r.drag_stopped() {
        state.brush_from_s = None;
        state.brushing = false;
        actions.push(Action::Seal);
    }
}

fn axis_time(mark: GridMark) -> String {
    if mark.step_size < 1.0 {
        format!("{} s", text::fixed(mark.value, 1))
    } else if mark.value < 0.0 {
        String::new()
    } else {
        text::clock(mark.value)
    }
}
