//! What the plots of several panes share.

use eframe::egui::{self, Rangef};
use egui_plot::{AxisHints, GridInput, GridMark, PlotPoint, PlotResponse};

/// Least distance of labels on a horizontal and a vertical axis, in points.
const X_SPACING: f32 = 56.0;
const Y_SPACING: f32 = 19.0;
/// Width kept for the labels of a vertical axis, so that plots above each other line up.
const Y_WIDTH: f32 = 56.0;
/// The same for the trend, whose values may be long.
pub const WIDE_Y_WIDTH: f32 = 72.0;

/// Labels appear at full strength or not at all: half-faded ones cannot be read on a projector.
fn spacing(least: f32) -> Rangef {
    Rangef::new(least, least + 0.1)
}

/// How near to a mark in a plot a drag of it must begin, in points of the screen.
const REACH: f64 = 9.0;

/// What the pointer does with a mark that can be dragged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Grip {
    /// Nothing.
    Away,
    /// It could take hold of it.
    Near,
    /// It holds it, here.
    Held(PlotPoint),
    /// It has just let it go.
    Released,
}

/// What the pointer does with a mark that it `held` a frame ago; `distance` of a place from the mark in points of the
/// screen. A drag begins within nine points of it.
pub fn grip(
    ui: &egui::Ui,
    shown: &PlotResponse<()>,
    held: bool,
    distance: impl Fn(PlotPoint) -> f64,
) -> Grip {
    let released = if held { Grip::Released } else { Grip::Away };
    let Some(pointer) = shown.response.interact_pointer_pos().or(shown.response.hover_pos()) else {
        return released;
    };
    let at = shown.transform.value_from_position(pointer);
    let near = distance(at) < REACH;
    let (down, pressed) = ui.input(|i| (i.pointer.primary_down(), i.pointer.primary_pressed()));
    match (down, held) {
        (true, _) if held || near && pressed => Grip::Held(at),
        (false, false) if near => Grip::Near,
        (false, _) => released,
        (true, _) => Grip::Away,
    }
}

/// A horizontal axis.
#[must_use]
pub fn x_axis(name: impl Into<String>) -> AxisHints<'static> {
    AxisHints::new_x().label(name.into()).label_spacing(spacing(X_SPACING)).formatter(label)
}

/// A vertical axis.
#[must_use]
pub fn y_axis(name: impl Into<String>) -> AxisHints<'static> {
    AxisHints::new_y()
        .label(name.into())
        .label_spacing(spacing(Y_SPACING))
        .formatter(label)
        .min_thickness(Y_WIDTH)
}

/// A horizontal axis of decimal logarithms, labelled with the numbers themselves.
#[must_use]
pub fn log_x_axis(name: impl Into<String>) -> AxisHints<'static> {
    AxisHints::new_x().label(name.into()).label_spacing(spacing(X_SPACING)).formatter(power_label)
}

/// A vertical axis of decimal logarithms.
#[must_use]
pub fn log_y_axis(name: impl Into<String>) -> AxisHints<'static> {
    y_axis(name).formatter(power_label)
}

/// Marks at 1, 2, 5 of every decade, or at whole decades where those are many.
#[must_use]
pub fn log_marks(input: GridInput) -> Vec<GridMark> {
    let (low, high) = input.bounds;
    if !(high > low && high - low < 60.0) {
        return vec![];
    }
    let within = if high - low > 2.5 { &[1.0][..] } else { &[1.0, 2.0, 5.0] };
    let decades = (low.floor() as i32)..=(high.ceil() as i32);
    let marks = decades.flat_map(|d| within.iter().map(move |m| f64::from(d) + f64::log10(*m)));
    marks.filter(|v| (low..=high).contains(v)).map(|value| GridMark { value, step_size: 1.0 }).collect()
}

fn power_label(mark: GridMark, _: &std::ops::RangeInclusive<f64>) -> String {
    crate::text::brief(10f64.powf(mark.value))
}

/// What egui_plot's recommended step stands for on the screen, in points.
const RECOMMENDED: f64 = 8.0;
/// Steps of a time axis in seconds; beyond them, whole multiples of ten hours.
const TIME_STEPS_S: [f64; 20] = [
    0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 30.0, 60.0, 120.0, 300.0, 600.0, 1200.0, 1800.0, 3600.0,
    7200.0, 10_800.0, 21_600.0, 36_000.0,
];

/// Smallest step whose labels have room.
fn least_step(input: &GridInput, spacing: f32) -> Option<f64> {
    let step = input.base_step_size / RECOMMENDED * f64::from(spacing) * 1.1;
    let span = input.bounds.1 - input.bounds.0;
    (step.is_finite() && step > 0.0 && span.is_finite() && span > 0.0).then_some(step)
}

fn decimal_marks(input: &GridInput, spacing: f32) -> Vec<GridMark> {
    let Some(least) = least_step(input, spacing) else { return vec![] };
    let power = 10f64.powf(least.log10().floor());
    let step =
        [1.0, 2.0, 5.0, 10.0].into_iter().map(|m| m * power).find(|s| *s >= least).unwrap_or(10.0 * power);
    marks(input.bounds, step)
}

/// Marks of a horizontal axis every 1, 2 or 5 times a power of ten.
#[must_use]
pub fn x_marks(input: GridInput) -> Vec<GridMark> {
    let mut marks = decimal_marks(&input, X_SPACING);
    keep_whole_labels(&mut marks, &input, X_SPACING);
    marks
}

/// Marks of a vertical axis every 1, 2 or 5 times a power of ten.
#[must_use]
pub fn y_marks(input: GridInput) -> Vec<GridMark> {
    decimal_marks(&input, 1.3 * Y_SPACING)
}

/// Marks at whole steps of a clock.
#[must_use]
pub fn time_marks(input: GridInput) -> Vec<GridMark> {
    let Some(least) = least_step(&input, 1.3 * X_SPACING) else { return vec![] };
    let tens_of_hours = (least / 36_000.0).ceil() * 36_000.0;
    let step = TIME_STEPS_S.into_iter().find(|s| *s >= least).unwrap_or(tens_of_hours);
    let mut marks = marks(input.bounds, step);
    keep_whole_labels(&mut marks, &input, X_SPACING);
    marks
}

/// Drops marks so close to the right end that their labels would be cut in half.
fn keep_whole_labels(marks: &mut Vec<GridMark>, input: &GridInput, spacing: f32) {
    let half_label = least_step(input, 0.45 * spacing).unwrap_or(0.0);
    marks.retain(|m| input.bounds.1 - m.value >= half_label);
}

/// A mark's value with the decimals that its step needs.
fn label(mark: GridMark, _: &std::ops::RangeInclusive<f64>) -> String {
    let decimals = (-mark.step_size.log10().floor()).clamp(0.0, 9.0) as usize;
    crate::text::fixed(mark.value, decimals)
}

fn marks(bounds: (f64, f64), step_size: f64) -> Vec<GridMark> {
    let first = (bounds.0 / step_size).ceil();
    let count = ((bounds.1 / step_size).floor() - first).clamp(0.0, 200.0) as usize;
    (0..=count).map(|i| GridMark { value: (first + i as f64) * step_size, step_size }).collect()
}

/// Names of overlaid curves in their colours, in as many rows as they need: inside a plot they would lie over the curves.
pub fn legend(
    ui: &mut eframe::egui::Ui,
    own: &str,
    colour: eframe::egui::Color32,
    others: &[(String, eframe::egui::Color32)],
) {
    ui.scope(|ui| {
        // Rows of words, not of buttons.
        ui.spacing_mut().interact_size.y = crate::theme::SMALL + 2.0;
        ui.horizontal_wrapped(|ui| {
            ui.spacing_mut().item_spacing = eframe::egui::vec2(8.0, 0.0);
            let own = std::iter::once((own, colour));
            for (name, colour) in own.chain(others.iter().map(|(name, colour)| (name.as_str(), *colour))) {
                let words = eframe::egui::RichText::new(format!("— {name}"));
                ui.add(eframe::egui::Label::new(words.size(crate::theme::SMALL).color(colour)).extend());
            }
        });
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(marks: &[GridMark]) -> Vec<f64> {
        marks.iter().map(|m| m.value).collect()
    }

    /// A plot of so many points from `low` to `high`.
    fn plot(points: f64, low: f64, high: f64) -> GridInput {
        GridInput { bounds: (low, high), base_step_size: RECOMMENDED * (high - low) / points }
    }

    #[test]
    fn marks_are_round_and_have_room() {
        assert_eq!(values(&y_marks(plot(100.0, 14.7, 16.3))), [15.0, 15.5, 16.0]);
        assert_eq!(values(&time_marks(plot(520.0, 0.0, 315.0))), [0.0, 60.0, 120.0, 180.0, 240.0]);
        assert_eq!(values(&time_marks(plot(200.0, 0.0, 315.0))), [0.0]);
        assert!(
            y_marks(plot(100.0, 1.0, 1.0)).is_empty() && time_marks(plot(100.0, f64::NAN, 1.0)).is_empty()
        );
        assert!(time_marks(plot(400.0, 0.0, 1e9)).len() <= 201);
        let half = GridMark { value: 2.5, step_size: 0.5 };
        assert_eq!(label(half, &(0.0..=3.0)), "2.5");
    }
}
