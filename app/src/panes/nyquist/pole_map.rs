//! Poles and zeros of the rational part of the loop.

use eframe::egui::{self, RichText};
use egui_plot::{MarkerShape, Plot, PlotUi, Points, VLine};
use num_complex::Complex64;
use vasos_engine::analyze::OpenLoop;
use vasos_engine::model::ProcessModel;

use crate::tuning::Row;
use crate::{plots, text, theme, tr};

/// A root on the plane in 1/s, and the words for it.
type Named = ([f64; 2], String);

/// Draws the map: the loop in view, and those beside it. What all have in common, the process, lies under one mark.
pub(super) fn ui(ui: &mut egui::Ui, model: &ProcessModel, row: &Row, others: &[super::Other<'_>]) {
    let p = theme::palette(ui);
    let dead_time_s = model.dead_time_s();
    if dead_time_s > 0.0 {
        let words = tr!("nyquist.poles_note", dead_time = text::brief(dead_time_s));
        ui.add(egui::Label::new(RichText::new(words).size(theme::SMALL).color(p.weak)).wrap());
    }
    let in_view = OpenLoop::new(model, &row.gains);
    let beside: Vec<(&str, egui::Color32, OpenLoop)> = others
        .iter()
        .map(|(name, colour, other)| (name.as_str(), *colour, OpenLoop::new(model, &other.gains)))
        .collect();
    let mut roots = named(&in_view, None);
    roots.extend(beside.iter().flat_map(|(name, _, open)| named(open, Some(name))));
    let reach = roots.iter().map(|n| n.0[0].hypot(n.0[1])).fold(1e-6, f64::max);
    Plot::new("poles")
        .height(ui.available_height() - 4.0)
        .allow_scroll(false)
        .data_aspect(1.0)
        .include_x(-1.15 * reach)
        .include_x(0.4 * reach)
        .include_y(-0.6 * reach)
        .include_y(0.6 * reach)
        .custom_x_axes(vec![plots::x_axis("Re s [rad/s]")])
        .custom_y_axes(vec![plots::y_axis("Im s [rad/s]")])
        .x_grid_spacer(plots::x_marks)
        .y_grid_spacer(plots::y_marks)
        .grid_color(p.grid)
        .label_formatter(move |position| {
            let at = match position {
                egui_plot::HoverPosition::NearDataPoint { position, .. }
                | egui_plot::HoverPosition::Elsewhere { position } => *position,
            };
            let away = |q: &[f64; 2]| (q[0] - at.x).hypot(q[1] - at.y);
            let nearest = roots.iter().min_by(|a, b| away(&a.0).total_cmp(&away(&b.0)))?;
            (away(&nearest.0) < 0.05 * reach).then(|| nearest.1.clone())
        })
        .show(ui, |plot| {
            plot.vline(VLine::new("", 0.0).color(p.weak).width(1.0));
            for (_, colour, open) in &beside {
                marks(plot, open, [*colour; 2], [5.0, 4.0]);
            }
            marks(plot, &in_view, [p.pv, p.sp], [6.0, 5.0]);
        });
}

/// Crosses for poles, circles for zeros, in their colours and sizes.
fn marks(plot: &mut PlotUi<'_>, open: &OpenLoop, colours: [egui::Color32; 2], radii: [f32; 2]) {
    let on_plane = |roots: &[Complex64]| roots.iter().map(|r| [r.re, r.im]).collect::<Vec<_>>();
    let poles = Points::new(tr!("nyquist.pole"), on_plane(open.poles()));
    plot.points(poles.shape(MarkerShape::Cross).radius(radii[0]).color(colours[0]));
    let zeros = Points::new(tr!("nyquist.zero"), on_plane(open.zeros()));
    plot.points(zeros.shape(MarkerShape::Circle).filled(false).radius(radii[1]).color(colours[1]));
}

fn named(open: &OpenLoop, of: Option<&str>) -> Vec<Named> {
    let poles = open.poles().iter().map(|r| (r, tr!("nyquist.pole")));
    let zeros = open.zeros().iter().map(|r| (r, tr!("nyquist.zero")));
    let of = of.map_or(String::new(), |of| format!("{of}\n"));
    let words = |(r, name): (&Complex64, String)| {
        let im = if r.im == 0.0 { String::new() } else { format!(" ± j {}", text::brief(r.im.abs())) };
        ([r.re, r.im], format!("{of}{name} {}{im} rad/s", text::brief(r.re)))
    };
    poles.chain(zeros).map(words).collect()
}
