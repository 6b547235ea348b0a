//! The trade-off map: what is possible, and where every rule and the tuning in use stand against it.

use eframe::egui::{self, RichText};
use egui_plot::{Line, Plot, PlotBounds, PlotPoint, Points, Text};
use vasos_engine::tune::ControllerKind;
use vasos_engine::tune::optimum::{LoopLimits, TradeOff};

use super::{choose, row_in_view};
use crate::action::Action;
use crate::answers::{Question, Reply};
use crate::panes::View;
use crate::tuning::{OPTIMAL, PRESENT, Row, wanted};
use crate::widgets::segmented;
use crate::{plots, text, theme, tr};

/// Ms beyond which a rule is not on the map.
const LARGEST_MS: f64 = 3.2;
/// How near a click must be to a point, in points of the screen.
const REACH: f32 = 14.0;
/// Size of a letter of a label, about, in points of the screen.
const LETTER: egui::Vec2 = egui::vec2(6.1, 13.0);
/// Room about what is shown: in Ms, and in decades.
const ROOM_MS: f64 = 0.08;
const ROOM_DECADES: f64 = 0.25;

/// State of the map.
#[derive(Default)]
pub(super) struct State {
    axes: usize,
    /// Fronts last shown, so that a limit that is dragged doesn't empty the map.
    shown: Vec<(ControllerKind, TradeOff, Vec<[f64; 2]>)>,
}

impl State {
    fn trade_off(&self) -> TradeOff {
        TradeOff::ALL[self.axes.min(2)]
    }
}

/// Which two measures are shown.
pub(super) fn head(ui: &mut egui::Ui, state: &mut State) {
    let axes = ["Jv – Ms".to_owned(), "Jv – Ju".to_owned(), "IAE – Ms".to_owned()];
    if let Some(chosen) = segmented(ui, &tr!("tune.axes"), &axes, state.axes) {
        state.axes = chosen;
    }
}

/// A tuning on the map; the vertical axis is logarithmic, that of Ju too.
struct Spot<'a> {
    row: &'a Row,
    at: [f64; 2],
}

/// Draws the map.
pub(super) fn ui(ui: &mut egui::Ui, view: &View, state: &mut State, height: f32, actions: &mut Vec<Action>) {
    let trade_off = state.trade_off();
    let fronts = fronts(view, state, trade_off, actions);
    let spots: Vec<Spot<'_>> = view.tuning.rows.iter().filter_map(|row| spot(row, trade_off)).collect();
    let p = theme::palette(ui);
    let chosen = row_in_view(view).map(|r| (r.rule, r.kind));
    let by_ju = trade_off == TradeOff::JvJu;
    let entry = view.document.model();
    let (pv, mv) = entry.map_or(("", ""), |e| (e.pv_unit.as_str(), e.mv_unit.as_str()));
    let x_name = if by_ju { with_unit("Ju", text::quotient(mv, pv)) } else { "Ms".to_owned() };
    let y_name = if trade_off == TradeOff::IaeMs { tr!("tune.iae_axis") } else { "Jv".to_owned() };
    let y_name = with_unit(&y_name, format!("{}·s", text::quotient(pv, mv)));
    let response = Plot::new(("map", state.axes))
        .height(height)
        .allow_scroll(false)
        .custom_x_axes(vec![if by_ju { plots::log_x_axis(x_name) } else { plots::x_axis(x_name) }])
        .custom_y_axes(vec![plots::log_y_axis(y_name)])
        .x_grid_spacer(if by_ju { plots::log_marks } else { plots::x_marks })
        .y_grid_spacer(plots::log_marks)
        .grid_color(p.grid)
        .label_formatter(|_| None)
        .show(ui, |plot| {
            if plot.auto_bounds().any() {
                plot.set_plot_bounds(bounds(&fronts, &spots, by_ju));
            }
            for (kind, points) in &fronts {
                let name = tr!("tune.front", controller = kind.to_string());
                let colour = if *kind == ControllerKind::Pi { p.pv } else { p.sp };
                // Below the front nothing lies: there its name is in nobody's way.
                if let Some(last) = points.get(2 * points.len() / 3) {
                    let label = RichText::new(name.clone()).size(theme::SMALL).color(colour);
                    let at = PlotPoint::new(last[0], last[1]);
                    plot.text(Text::new("", at, label).anchor(egui::Align2::RIGHT_TOP));
                }
                plot.line(Line::new(name, points.clone()).color(colour).width(theme::LINE));
            }
            for spot in &spots {
                let strong = chosen == Some((spot.row.rule, spot.row.kind));
                let colour = match spot.row.rule {
                    PRESENT => p.mv,
                    OPTIMAL => p.accent_text,
                    _ => p.weak,
                };
                let points = Points::new(title(spot.row), vec![spot.at]);
                plot.points(points.radius(if strong { 6.0 } else { 4.0 }).color(colour));
            }
            labels(plot, &spots, chosen, &p);
            plot.response().hover_pos().and_then(|pointer| nearest(plot, &spots, pointer))
        });
    if let Some(index) = response.inner {
        let row = spots[index].row;
        response.response.clone().on_hover_text_at_pointer(about(row));
        if response.response.clicked() {
            choose(row, actions);
        }
    }
}

/// Everything that is shown, with room for the names about it.
fn bounds(fronts: &[(ControllerKind, Vec<[f64; 2]>)], spots: &[Spot<'_>], by_ju: bool) -> PlotBounds {
    let all = fronts.iter().flat_map(|f| f.1.iter().copied()).chain(spots.iter().map(|s| s.at));
    let start = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    let (low, high) = all.fold(start, |(low, high), q| {
        ([low[0].min(q[0]), low[1].min(q[1])], [high[0].max(q[0]), high[1].max(q[1])])
    });
    if low[0] > high[0] {
        return PlotBounds::from_min_max([1.0, -1.0], [3.0, 1.0]);
    }
    let room = if by_ju { ROOM_DECADES } else { ROOM_MS };
    PlotBounds::from_min_max([low[0] - room, low[1] - ROOM_DECADES], [high[0] + room, high[1] + ROOM_DECADES])
}

fn with_unit(name: &str, unit: String) -> String {
    if unit.is_empty() || unit == "·s" { name.to_owned() } else { format!("{name} [{unit}]") }
}

fn title(row: &Row) -> String {
    let name = if row.rule == PRESENT { tr!("rules.present") } else { tr!(&row.title_key) };
    format!("{name} · {}", row.kind)
}

fn about(row: &Row) -> String {
    let g = &row.gains;
    format!(
        "{}\nKc {}  Ti {} s  Td {} s\nMs {}  Jv {}  Ju {}",
        title(row),
        text::brief(g.kc),
        text::brief(g.ti_s),
        text::brief(g.td_s),
        text::maybe(row.analysis.ms),
        text::maybe(row.analysis.jv),
        text::maybe(row.analysis.ju)
    )
}

/// Where a row lies; none if its loop is unstable or off the map.
fn spot(row: &Row, trade_off: TradeOff) -> Option<Spot<'_>> {
    let a = &row.analysis;
    let positive = |v: Option<f64>| v.filter(|v| *v > 0.0 && v.is_finite());
    let ms = positive(a.ms).filter(|ms| *ms < LARGEST_MS);
    let at = match trade_off {
        TradeOff::JvMs => [ms?, positive(a.jv)?.log10()],
        TradeOff::JvJu => {
            ms?;
            [positive(a.ju)?.log10(), positive(a.jv)?.log10()]
        }
        TradeOff::IaeMs => [ms?, positive(row.figures.iae_load)?.log10()],
    };
    Some(Spot { row, at })
}

/// Fronts of PI and PID, asked for where they are not known; the last ones until they are.
fn fronts(
    view: &View,
    state: &mut State,
    trade_off: TradeOff,
    actions: &mut Vec<Action>,
) -> Vec<(ControllerKind, Vec<[f64; 2]>)> {
    let Some(model) = &view.tuning.model else { return vec![] };
    let settings = &view.document.optimum;
    let limits = match trade_off {
        TradeOff::JvMs | TradeOff::IaeMs => LoopLimits { ms: 2.0, ..settings.limits },
        TradeOff::JvJu => LoopLimits { ju: f64::INFINITY, ..settings.limits },
    };
    let mut found = Vec::new();
    for kind in [ControllerKind::Pi, ControllerKind::Pid] {
        let question =
            Question::Front { model: model.clone(), wanted: wanted(kind, settings), limits, trade_off };
        let known = match view.answers.find(&question).as_deref() {
            Some(Reply::Front(points)) => {
                let by_ju = trade_off == TradeOff::JvJu;
                let x = |limit: f64| if by_ju { limit.log10() } else { limit };
                Some(points.iter().map(|p| [x(p.limit), p.value.log10()]).collect::<Vec<_>>())
            }
            _ => {
                actions.push(Action::Ask(Box::new(question)));
                None
            }
        };
        let slot = state.shown.iter().position(|(k, t, _)| *k == kind && *t == trade_off);
        match (known, slot) {
            (Some(points), Some(slot)) => state.shown[slot].2.clone_from(&points),
            (Some(points), None) => state.shown.push((kind, trade_off, points)),
            _ => {}
        }
        let shown = state.shown.iter().find(|(k, t, _)| *k == kind && *t == trade_off);
        found.extend(shown.map(|(k, _, points)| (*k, points.clone())));
    }
    found
}

/// Names beside the points, the chosen one and the tuning in use first; one that would cover another is left out.
fn labels(
    plot: &mut egui_plot::PlotUi<'_>,
    spots: &[Spot<'_>],
    chosen: Option<(&'static str, ControllerKind)>,
    p: &theme::Palette,
) {
    let mut order: Vec<&Spot<'_>> = spots.iter().collect();
    let rank = |s: &Spot<'_>| match s.row.rule {
        _ if chosen == Some((s.row.rule, s.row.kind)) => 0,
        PRESENT => 1,
        OPTIMAL => 2,
        _ => 3,
    };
    order.sort_by_key(|s| rank(s));
    let mut taken: Vec<egui::Rect> = Vec::new();
    let frame = plot.response().rect;
    for spot in order {
        let at = plot.screen_from_plot(PlotPoint::new(spot.at[0], spot.at[1]));
        let words = title(spot.row);
        let size = egui::vec2(LETTER.x * words.chars().count() as f32, LETTER.y);
        // To the right of the point, or to its left where the plot ends.
        let right = at.x + size.x + 8.0 < frame.right();
        let corner = at + egui::vec2(if right { 7.0 } else { -7.0 - size.x }, -size.y - 1.0);
        let rect = egui::Rect::from_min_size(corner, size);
        if !frame.contains_rect(rect) || taken.iter().any(|other| other.intersects(rect)) {
            continue;
        }
        taken.push(rect);
        let ink = if rank(spot) < 3 { p.text } else { p.weak };
        let label = RichText::new(words).size(theme::SMALL).color(ink);
        let (anchor, from) = if right {
            (egui::Align2::LEFT_BOTTOM, rect.left_bottom())
        } else {
            (egui::Align2::RIGHT_BOTTOM, egui::pos2(at.x - 7.0, rect.bottom()))
        };
        plot.text(Text::new("", plot.plot_from_screen(from), label).anchor(anchor));
    }
}

/// The spot under the pointer.
fn nearest(plot: &egui_plot::PlotUi<'_>, spots: &[Spot<'_>], pointer: egui::Pos2) -> Option<usize> {
    let distance =
        |spot: &Spot<'_>| plot.screen_from_plot(PlotPoint::new(spot.at[0], spot.at[1])).distance(pointer);
    let found = spots.iter().map(distance).enumerate().min_by(|a, b| a.1.total_cmp(&b.1))?;
    (found.1 < REACH).then_some(found.0)
}
