//! The loop over frequency: Nyquist curve with its circles and margins, Bode, Nichols, gang of four, poles and zeros.

mod over_frequency;
mod pole_map;

use eframe::egui::{self, RichText};
use egui_plot::{Line, LineStyle, Plot, PlotPoint, PlotPoints, Points, Polygon, Text};
use num_complex::Complex64;
use vasos_engine::analyze::{CurveOptions, LoopFunction, OpenLoop, frequency_curve};
use vasos_engine::control::PidGains;
use vasos_engine::document::{DocumentCommand, OptimumSettings};
use vasos_engine::model::ProcessModel;
use vasos_engine::tune::optimum::LoopLimits;

use crate::action::Action;
use crate::panes::View;
use crate::panes::tune::{row_in_view, title};
use crate::plots::Grip;
use crate::tuning::{PRESENT, Row};
use crate::{plots, text, theme, tr};

/// Points of the curve further away than this are left out: integral action runs to infinity.
const FARTHEST: f64 = 60.0;

/// State of the pane.
#[derive(Default)]
pub struct State {
    cached: Vec<(ProcessModel, PidGains, Vec<[f64; 3]>)>,
    shown: usize,
    curves: over_frequency::State,
    /// The limit on Ms is being dragged.
    dragging: bool,
}

/// What the pane can show.
const VIEWS: [&str; 5] =
    ["nyquist.curve", "nyquist.bode", "nyquist.nichols", "nyquist.gang_of_four", "nyquist.poles"];

impl State {
    /// (Re L, Im L, ω) along the curve.
    fn curve(&mut self, model: &ProcessModel, gains: &PidGains) -> Vec<[f64; 3]> {
        if let Some(i) = self.cached.iter().position(|(m, g, _)| m == model && g == gains) {
            return self.cached[i].2.clone();
        }
        let open = OpenLoop::new(model, gains);
        let points = frequency_curve(&open, LoopFunction::OpenLoop, &CurveOptions::default());
        let curve: Vec<[f64; 3]> =
            points.into_iter().filter(|(_, l)| l.norm() < FARTHEST).map(|(w, l)| [l.re, l.im, w]).collect();
        if self.cached.len() >= 8 {
            self.cached.remove(0);
        }
        self.cached.push((model.clone(), *gains, curve.clone()));
        curve
    }
}

/// Draws the pane.
pub fn ui(ui: &mut egui::Ui, view: &View, state: &mut State) -> Vec<Action> {
    let (Some(model), Some(row)) = (&view.tuning.model, row_in_view(view)) else {
        ui.add(
            egui::Label::new(RichText::new(tr!("nyquist.no_model")).color(theme::palette(ui).weak)).wrap(),
        );
        return vec![];
    };
    ui.horizontal_wrapped(|ui| {
        egui::ComboBox::from_id_salt("nyquist_view")
            .selected_text(tr!(VIEWS[state.shown]))
            .width(92.0)
            .show_ui(ui, |ui| {
                for (i, key) in VIEWS.iter().enumerate() {
                    ui.selectable_value(&mut state.shown, i, tr!(key));
                }
            });
        figures(ui, row);
    });
    let others = others(ui, view, row);
    if !view.tuning.compared.is_empty() {
        let names: Vec<(String, egui::Color32)> = others.iter().map(|o| (o.0.clone(), o.1)).collect();
        plots::legend(ui, &title(row), theme::palette(ui).pv, &names);
    }
    match state.shown {
        0 => return nyquist(ui, view, state, model, row, &others),
        4 => pole_map::ui(ui, model, row, &others),
        shown => {
            let tunings = over_frequency::Tunings { model, row, others: &others };
            over_frequency::ui(ui, shown, &tunings, &mut state.curves);
        }
    }
    vec![]
}

/// A tuning whose curves stand beside the one in view, with its name and colour.
type Other<'a> = (String, egui::Color32, &'a Row);

/// The tuning in use, and those that are compared.
fn others<'a>(ui: &egui::Ui, view: &View<'a>, row: &Row) -> Vec<Other<'a>> {
    let p = theme::palette(ui);
    let present = view.tuning.rows.first().filter(|r| r.rule == PRESENT && r.gains != row.gains);
    let compared = view.tuning.compared.iter().enumerate();
    let compared = compared.filter(|(_, r)| r.gains != row.gains && r.rule != PRESENT);
    let present = present.map(|r| (tr!("rules.present"), p.ghost, r));
    present.into_iter().chain(compared.map(|(k, r)| (title(r), theme::series(&p, k + 1), r))).collect()
}

/// The Nyquist curve.
fn nyquist(
    ui: &mut egui::Ui,
    view: &View,
    state: &mut State,
    model: &ProcessModel,
    row: &Row,
    others: &[Other<'_>],
) -> Vec<Action> {
    let p = theme::palette(ui);
    let curve = state.curve(model, &row.gains);
    let beside: Vec<(String, egui::Color32, Vec<[f64; 3]>)> = others
        .iter()
        .map(|(name, colour, r)| (name.clone(), *colour, state.curve(model, &r.gains)))
        .collect();
    let hover = curve.clone();
    let ellipses = uncertainty(view, model, &row.gains, &curve);
    let limit = view.document.optimum.limits.ms;
    let dragging = state.dragging;
    let response = Plot::new("nyquist")
        .data_aspect(1.0)
        .allow_scroll(false)
        .allow_drag(!dragging)
        .include_x(-2.4)
        .include_x(0.8)
        .include_y(-2.2)
        .include_y(1.0)
        .default_x_bounds(-2.4, 0.8)
        .default_y_bounds(-2.2, 1.0)
        .auto_bounds([false, false])
        .custom_x_axes(vec![plots::x_axis("Re L(jω)")])
        .custom_y_axes(vec![plots::y_axis("Im L(jω)")])
        .grid_color(p.grid)
        .x_grid_spacer(plots::x_marks)
        .y_grid_spacer(plots::y_marks)
        .label_formatter(move |position| {
            let at = match position {
                egui_plot::HoverPosition::NearDataPoint { position, .. }
                | egui_plot::HoverPosition::Elsewhere { position } => *position,
            };
            let near = |q: &[f64; 3]| (q[0] - at.x).hypot(q[1] - at.y);
            let nearest = hover.iter().min_by(|a, b| near(a).total_cmp(&near(b)))?;
            (near(nearest) < 0.15).then(|| {
                format!(
                    "ω = {} rad/s\n|L| = {}",
                    text::brief(nearest[2]),
                    text::brief(nearest[0].hypot(nearest[1]))
                )
            })
        })
        .show(ui, |plot| {
            circles(plot, row, &p);
            limit_circle(plot, limit, &p);
            for (name, colour, curve) in &beside {
                plot.line(Line::new(name.clone(), plane(curve)).color(*colour).width(1.2));
            }
            for ellipse in &ellipses {
                let fill = Polygon::new(tr!("nyquist.band"), PlotPoints::from(ellipse.clone()));
                plot.polygon(
                    fill.fill_color(p.pv.gamma_multiply(0.10))
                        .stroke(egui::Stroke::new(0.6, p.pv.gamma_multiply(0.35)))
                        .allow_hover(false),
                );
            }
            plot.line(Line::new(tr!("nyquist.loop"), plane(&curve)).color(p.pv).width(theme::LINE));
            plot.points(Points::new("−1", vec![[-1.0, 0.0]]).radius(4.5).color(p.alarm));
            let label = RichText::new("−1").color(p.text).size(theme::BODY);
            plot.text(Text::new("", PlotPoint::new(-1.0, 0.16), label));
        });
    drag_limit(ui, view, state, &response)
}

/// The limit on Ms of the best gains as a circle about −1.
fn limit_circle(plot: &mut egui_plot::PlotUi<'_>, limit: f64, p: &theme::Palette) {
    if !limit.is_finite() {
        return;
    }
    let name = tr!("nyquist.limit", ms = text::brief(limit));
    plot.line(Line::new(name, circle(-1.0, 1.0 / limit)).color(p.caution).width(1.2));
}

/// The circle of the limit follows the pointer; the best gains follow the limit.
fn drag_limit(
    ui: &egui::Ui,
    view: &View,
    state: &mut State,
    shown: &egui_plot::PlotResponse<()>,
) -> Vec<Action> {
    const RANGE: (f64, f64) = (1.02, 4.0);
    let settings = view.document.optimum;
    let radius_at = |at: PlotPoint| (at.x + 1.0).hypot(at.y);
    let scale = shown.transform.dpos_dvalue_x().abs();
    let away = |at: PlotPoint| (radius_at(at) - 1.0 / settings.limits.ms).abs() * scale;
    let grip = plots::grip(ui, shown, state.dragging, away);
    state.dragging = matches!(grip, Grip::Held(_));
    let at = match grip {
        Grip::Away => return vec![],
        Grip::Released => return vec![Action::Seal],
        Grip::Near => {
            ui.ctx().set_cursor_icon(egui::CursorIcon::Grab);
            return vec![];
        }
        Grip::Held(at) => at,
    };
    ui.ctx().set_cursor_icon(egui::CursorIcon::Grabbing);
    let ms = (1.0 / radius_at(at)).clamp(RANGE.0, RANGE.1);
    let limits = LoopLimits { ms, ..settings.limits };
    vec![Action::Document(DocumentCommand::Optimum(OptimumSettings { limits, ..settings }))]
}

/// 95 % ellipses of the fitted process along the loop's curve, where they can be seen.
fn uncertainty(
    view: &View,
    model: &ProcessModel,
    gains: &PidGains,
    curve: &[[f64; 3]],
) -> Vec<Vec<[f64; 2]>> {
    const ELLIPSES: usize = 28;
    const CORNERS: u32 = 40;
    let fit = view.document.model().and_then(|entry| entry.fit.as_ref()).filter(|fit| fit.model == *model);
    let Some(fit) = fit else { return vec![] };
    let near: Vec<f64> = curve.iter().filter(|q| q[0].hypot(q[1]) < 4.0).map(|q| q[2]).collect();
    let omega: Vec<f64> = near.iter().copied().step_by((near.len() / ELLIPSES).max(1)).collect();
    let open = OpenLoop::new(model, gains);
    let seen = fit.nyquist_band(&omega).into_iter().filter(|band| band.semi_axes[0].is_finite());
    seen.map(|band| {
        let controller = open.controller_at_omega(band.omega_rad_s);
        (0..CORNERS)
            .map(|k| {
                let angle = f64::from(k) * std::f64::consts::TAU / f64::from(CORNERS);
                let along = Complex64::new(band.semi_axes[0] * angle.cos(), band.semi_axes[1] * angle.sin());
                let point = controller * (band.value + along * Complex64::from_polar(1.0, band.angle_rad));
                [point.re, point.im]
            })
            .collect()
    })
    .collect()
}

fn plane(curve: &[[f64; 3]]) -> PlotPoints<'static> {
    curve.iter().map(|q| [q[0], q[1]]).collect::<Vec<_>>().into()
}

fn figures(ui: &mut egui::Ui, row: &Row) {
    let a = &row.analysis;
    {
        ui.label(RichText::new(title(row)).family(theme::bold()));
        let p = theme::palette(ui);
        let words = if a.stable {
            tr!(
                "nyquist.figures",
                ms = text::maybe(a.ms),
                mt = text::maybe(a.mt),
                gm = text::maybe(a.gain_margin),
                pm = text::maybe(a.phase_margin_deg),
                dm = text::maybe(a.delay_margin_s)
            )
        } else {
            tr!("tune.unstable_hint")
        };
        ui.label(RichText::new(words).size(theme::SMALL).color(if a.stable { p.weak } else { p.caution }));
    }
}

fn circle(x: f64, r: f64) -> PlotPoints<'static> {
    (0..=128)
        .map(|i| {
            let a = std::f64::consts::TAU * f64::from(i) / 128.0;
            [x + r * a.cos(), r * a.sin()]
        })
        .collect::<Vec<_>>()
        .into()
}

/// |S| = Ms is the circle of radius 1/Ms about −1; |T| = Mt the one about −Mt²/(Mt² − 1) of radius Mt/(Mt² − 1),
/// for Mt = 1 the line Re L = −½.
fn circles(plot: &mut egui_plot::PlotUi<'_>, row: &Row, p: &theme::Palette) {
    let unit =
        Line::new("|L| = 1", circle(0.0, 1.0)).color(p.grid).width(1.0).style(LineStyle::dotted_dense());
    plot.line(unit);
    if let Some(ms) = row.analysis.ms {
        let fill = Polygon::new(format!("Ms = {}", text::brief(ms)), circle(-1.0, 1.0 / ms));
        let edge = egui::Stroke::new(1.2, p.accent_text);
        plot.polygon(fill.fill_color(p.shade).stroke(edge).style(LineStyle::dashed_dense()));
        let label = RichText::new(format!("Ms {}", text::brief(ms))).color(p.accent_text).size(theme::SMALL);
        plot.text(Text::new("", PlotPoint::new(-1.0, -1.0 / ms - 0.12), label));
    }
    if let Some(mt) = row.analysis.mt {
        let edge = egui::Stroke::new(1.2, p.sp);
        let name = format!("Mt = {}", text::brief(mt));
        if mt > 1.0 + 1e-6 {
            let square = mt * mt - 1.0;
            let outline = Line::new(name, circle(-mt * mt / square, mt / square)).stroke(edge);
            plot.line(outline.style(LineStyle::dashed_dense()));
        } else {
            let line = vec![[-0.5, -FARTHEST], [-0.5, FARTHEST]];
            plot.line(Line::new(name, line).stroke(edge).style(LineStyle::dashed_dense()));
        }
        let label = RichText::new(format!("Mt {}", text::brief(mt))).color(p.sp).size(theme::SMALL);
        plot.text(Text::new("", PlotPoint::new(-0.54, -1.35), label).anchor(egui::Align2::RIGHT_CENTER));
    }
}
