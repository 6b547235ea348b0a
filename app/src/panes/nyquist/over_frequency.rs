//! Curves over frequency: Bode, Nichols, and the gang of four, with the tuning in use behind the one in view.

use eframe::egui;
use egui_plot::{HLine, Line, LineStyle, Plot, PlotPoints, Points};
use num_complex::Complex64;
use vasos_engine::analyze::{CurveOptions, LoopFunction, OpenLoop, frequency_curve, frequency_range};
use vasos_engine::control::PidGains;
use vasos_engine::model::ProcessModel;

use crate::tuning::Row;
use crate::{plots, text, theme, tr};

/// The tunings whose curves are shown.
pub(super) struct Tunings<'a> {
    pub model: &'a ProcessModel,
    pub row: &'a Row,
    /// Those beside it, with name and colour.
    pub others: &'a [super::Other<'a>],
}

/// Curves of loops, kept until model or gains change.
#[derive(Default)]
pub struct State {
    cached: Vec<(ProcessModel, PidGains, Curves)>,
}

/// (ω, value) of each function.
#[derive(Clone)]
struct Curves {
    open: Vec<(f64, Complex64)>,
    four: [Vec<(f64, Complex64)>; 4],
}

const FOUR: [(LoopFunction, &str); 4] = [
    (LoopFunction::Sensitivity, "S"),
    (LoopFunction::ComplementarySensitivity, "T"),
    (LoopFunction::LoadSensitivity, "G·S"),
    (LoopFunction::ControlSensitivity, "C·S"),
];

impl State {
    fn curves(&mut self, model: &ProcessModel, gains: &PidGains) -> Curves {
        if let Some((_, _, known)) = self.cached.iter().find(|(m, g, _)| m == model && g == gains) {
            return known.clone();
        }
        let open = OpenLoop::new(model, gains);
        let options = CurveOptions {
            range_rad_s: Some(frequency_range(&open)),
            most_points: 1500,
            ..CurveOptions::default()
        };
        let of = |function| frequency_curve(&open, function, &options);
        let curves =
            Curves { open: of(LoopFunction::OpenLoop), four: FOUR.map(|(function, _)| of(function)) };
        if self.cached.len() >= 8 {
            self.cached.remove(0);
        }
        self.cached.push((model.clone(), *gains, curves.clone()));
        curves
    }
}

/// Draws one of the views: 1 Bode, 2 Nichols, 3 gang of four.
pub(super) fn ui(ui: &mut egui::Ui, shown: usize, tunings: &Tunings<'_>, state: &mut State) {
    let curves = state.curves(tunings.model, &tunings.row.gains);
    let others: Vec<Beside> = tunings
        .others
        .iter()
        .map(|(name, colour, row)| Beside {
            name: name.clone(),
            colour: *colour,
            curves: state.curves(tunings.model, &row.gains),
        })
        .collect();
    match shown {
        1 => bode(ui, &curves, &others),
        2 => nichols(ui, &curves, &others),
        _ => gang_of_four(ui, &curves, &others),
    }
}

/// Curves of another tuning.
struct Beside {
    name: String,
    colour: egui::Color32,
    curves: Curves,
}

fn decibel(v: Complex64) -> f64 {
    20.0 * v.norm().max(1e-12).log10()
}

/// Phase in degrees without jumps of a whole turn, from −180…180 at the first point on.
fn phases_deg(curve: &[(f64, Complex64)]) -> Vec<f64> {
    let mut last: Option<f64> = None;
    let unwrapped = curve.iter().map(|(_, v)| {
        let angle = v.arg().to_degrees();
        let turns = last.map_or(0.0, |l| ((l - angle) / 360.0).round());
        let angle = angle + 360.0 * turns;
        last = Some(angle);
        angle
    });
    unwrapped.collect()
}

fn line(points: Vec<[f64; 2]>, name: String, colour: egui::Color32, width: f32) -> Line<'static> {
    Line::new(name, PlotPoints::from(points)).color(colour).width(width)
}

/// Words at the pointer: the frequency of the nearest point of a curve.
fn at_pointer(
    points: Vec<([f64; 2], f64)>,
    reach: [f64; 2],
    words: impl Fn([f64; 2], f64) -> String + 'static,
) -> impl Fn(&egui_plot::HoverPosition<'_>) -> Option<String> {
    move |position| {
        let at = match position {
            egui_plot::HoverPosition::NearDataPoint { position, .. }
            | egui_plot::HoverPosition::Elsewhere { position } => *position,
        };
        let away = |q: &[f64; 2]| ((q[0] - at.x) / reach[0]).hypot((q[1] - at.y) / reach[1]);
        let nearest = points.iter().min_by(|a, b| away(&a.0).total_cmp(&away(&b.0)))?;
        (away(&nearest.0) < 1.0).then(|| words(nearest.0, nearest.1))
    }
}

fn bode(ui: &mut egui::Ui, curves: &Curves, others: &[Beside]) {
    let p = theme::palette(ui);
    let height = 0.5 * ui.available_height() - 4.0;
    for part in 0..2 {
        let of = |c: &Curves| -> Vec<[f64; 2]> {
            if part == 0 {
                c.open.iter().map(|(w, v)| [w.log10(), decibel(*v)]).collect()
            } else {
                c.open.iter().zip(phases_deg(&c.open)).map(|((w, _), a)| [w.log10(), a]).collect()
            }
        };
        let points = of(curves);
        let unit = if part == 0 { "dB" } else { "°" };
        let hover = points.iter().map(|q| (*q, 10f64.powf(q[0]))).collect();
        let reach = if part == 0 { [0.1, 6.0] } else { [0.1, 25.0] };
        let formatter = at_pointer(hover, reach, move |q, omega| {
            format!("ω = {} rad/s\n{} {unit}", text::brief(omega), text::fixed(q[1], 1))
        });
        let y_name = if part == 0 { "|L| [dB]".to_owned() } else { "arg L [°]".to_owned() };
        let x_name = if part == 0 { String::new() } else { "ω [rad/s]".to_owned() };
        let (low, high) = if part == 0 { (-40.0, 40.0) } else { (-360.0, 0.0) };
        Plot::new(("bode", part))
            .height(height.max(50.0))
            .link_axis(egui::Id::unique("bode"), [true, false])
            .allow_scroll(false)
            .default_y_bounds(low, high)
            .custom_x_axes(vec![plots::log_x_axis(x_name)])
            .custom_y_axes(vec![plots::y_axis(y_name)])
            .x_grid_spacer(plots::log_marks)
            .y_grid_spacer(plots::y_marks)
            .grid_color(p.grid)
            .label_formatter(formatter)
            .show(ui, |plot| {
                let critical = if part == 0 { 0.0 } else { -180.0 };
                plot.hline(
                    HLine::new("", critical).color(p.alarm).width(1.0).style(LineStyle::dashed_dense()),
                );
                for other in others {
                    plot.line(line(of(&other.curves), other.name.clone(), other.colour, 1.2));
                }
                plot.line(line(points, tr!("nyquist.loop"), p.pv, theme::LINE));
            });
    }
}

fn nichols(ui: &mut egui::Ui, curves: &Curves, others: &[Beside]) {
    let p = theme::palette(ui);
    let of = |c: &Curves| -> Vec<[f64; 2]> {
        c.open.iter().zip(phases_deg(&c.open)).map(|((_, v), a)| [a, decibel(*v)]).collect()
    };
    let points = of(curves);
    let hover = points.iter().zip(&curves.open).map(|(q, (w, _))| (*q, *w)).collect();
    let formatter = at_pointer(hover, [15.0, 4.0], |q, omega| {
        format!("ω = {} rad/s\n{}°, {} dB", text::brief(omega), text::fixed(q[0], 1), text::fixed(q[1], 1))
    });
    Plot::new("nichols")
        .height(ui.available_height() - 4.0)
        .allow_scroll(false)
        .default_x_bounds(-360.0, 0.0)
        .default_y_bounds(-40.0, 40.0)
        .custom_x_axes(vec![plots::x_axis("arg L [°]")])
        .custom_y_axes(vec![plots::y_axis("|L| [dB]")])
        .x_grid_spacer(plots::x_marks)
        .y_grid_spacer(plots::y_marks)
        .grid_color(p.grid)
        .label_formatter(formatter)
        .show(ui, |plot| {
            for other in others {
                plot.line(line(of(&other.curves), other.name.clone(), other.colour, 1.2));
            }
            plot.line(line(points, tr!("nyquist.loop"), p.pv, theme::LINE));
            plot.points(Points::new("−1", vec![[-180.0, 0.0]]).radius(4.5).color(p.alarm));
        });
}

fn gang_of_four(ui: &mut egui::Ui, curves: &Curves, others: &[Beside]) {
    let p = theme::palette(ui);
    let height = (0.5 * ui.available_height() - 4.0).max(50.0);
    let width = 0.5 * ui.available_width() - 4.0;
    for row in 0..2 {
        ui.horizontal(|ui| {
            for column in 0..2 {
                let k = 2 * row + column;
                let of = |c: &Curves| -> Vec<[f64; 2]> {
                    c.four[k].iter().map(|(w, v)| [w.log10(), v.norm().max(1e-12).log10()]).collect()
                };
                let points = of(curves);
                let hover = points.iter().map(|q| (*q, 10f64.powf(q[0]))).collect();
                let name = FOUR[k].1;
                let formatter = at_pointer(hover, [0.15, 0.3], move |q, omega| {
                    format!("ω = {} rad/s\n|{name}| = {}", text::brief(omega), text::brief(10f64.powf(q[1])))
                });
                let x_name = if row == 0 { String::new() } else { "ω [rad/s]".to_owned() };
                let top = points.iter().map(|q| q[1]).fold(f64::NEG_INFINITY, f64::max);
                Plot::new(("four", k))
                    .height(height)
                    .width(width)
                    .allow_scroll(false)
                    .default_y_bounds(top - 3.0, top + 0.3)
                    .custom_x_axes(vec![plots::log_x_axis(x_name)])
                    .custom_y_axes(vec![plots::log_y_axis(format!("|{name}|"))])
                    .x_grid_spacer(plots::log_marks)
                    .y_grid_spacer(plots::log_marks)
                    .grid_color(p.grid)
                    .label_formatter(formatter)
                    .show(ui, |plot| {
                        for other in others {
                            plot.line(line(of(&other.curves), other.name.clone(), other.colour, 1.2));
                        }
                        plot.line(line(points, name.to_owned(), p.pv, theme::LINE));
                    });
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn phases_run_on_without_jumps() {
        let curve: Vec<(f64, Complex64)> =
            (0..200).map(|k| (f64::from(k), Complex64::from_polar(1.0, -0.1 * f64::from(k)))).collect();
        let phases = phases_deg(&curve);
        assert!((phases[199] + (0.1f64 * 199.0).to_degrees()).abs() < 1e-9);
    }
}
