//! What the plots of several panes share.

use eframe::egui::Rangef;
use egui_plot::{AxisHints, GridInput, GridMark};

/// Least distance of labels on a horizontal and a vertical axis, in points.
const X_SPACING: f32 = 56.0;
const Y_SPACING: f32 = 19.0;
/// Width kept for the labels of a vertical axis, so that plots above each other line up.
const Y_WIDTH: f32 = 46.0;

/// Labels appear at full strength or not at all: half-faded ones cannot be read on a projector.
fn spacing(least: f32) -> Rangef {
    Rangef::new(least, least + 0.1)
}

/// A horizontal axis.
#[must_use]
pub fn x_axis(label: impl Into<String>) -> AxisHints<'static> {
    AxisHints::new_x().label(label.into()).label_spacing(spacing(X_SPACING))
}

/// A vertical axis.
#[must_use]
pub fn y_axis(label: impl Into<String>) -> AxisHints<'static> {
    AxisHints::new_y().label(label.into()).label_spacing(spacing(Y_SPACING)).min_thickness(Y_WIDTH)
}

/// About so many marks on an axis.
const MARKS: f64 = 5.0;
/// Steps of a time axis in seconds; beyond them, whole multiples of ten hours.
const TIME_STEPS_S: [f64; 20] = [
    0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 30.0, 60.0, 120.0, 300.0, 600.0, 1200.0, 1800.0, 3600.0, 7200.0, 10_800.0,
    21_600.0, 36_000.0,
];

/// Marks every 1, 2 or 5 times a power of ten.
#[must_use]
pub fn decimal_marks(input: GridInput) -> Vec<GridMark> {
    let span = input.bounds.1 - input.bounds.0;
    let rough = span / MARKS;
    if !(rough.is_finite() && rough > 0.0) {
        return vec![];
    }
    let power = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].into_iter().map(|m| m * power).find(|s| *s >= rough).unwrap_or(10.0 * power);
    marks(input.bounds, step)
}

/// Marks at whole steps of a clock.
#[must_use]
pub fn time_marks(input: GridInput) -> Vec<GridMark> {
    let rough = (input.bounds.1 - input.bounds.0) / (MARKS + 1.0);
    if !(rough.is_finite() && rough > 0.0) {
        return vec![];
    }
    let tens_of_hours = (rough / 36_000.0).ceil() * 36_000.0;
    let step = TIME_STEPS_S.into_iter().find(|s| *s >= rough).unwrap_or(tens_of_hours);
    marks(input.bounds, step)
}

fn marks(bounds: (f64, f64), step_size: f64) -> Vec<GridMark> {
    let first = (bounds.0 / step_size).ceil();
    let count = ((bounds.1 / step_size).floor() - first).clamp(0.0, 200.0) as usize;
    (0..=count).map(|i| GridMark { value: (first + i as f64) * step_size, step_size }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(marks: &[GridMark]) -> Vec<f64> {
        marks.iter().map(|m| m.value).collect()
    }

    #[test]
    fn marks_are_round_and_in_view() {
        let input = |low: f64, high: f64| GridInput { bounds: (low, high), base_step_size: 0.1 };
        assert_eq!(values(&decimal_marks(input(14.7, 16.3))), [15.0, 15.5, 16.0]);
        assert_eq!(values(&time_marks(input(0.0, 315.0))), [0.0, 60.0, 120.0, 180.0, 240.0, 300.0]);
        assert_eq!(values(&time_marks(input(11_000.0, 11_300.0))).len(), 5);
        assert!(decimal_marks(input(1.0, 1.0)).is_empty() && time_marks(input(f64::NAN, 1.0)).is_empty());
        assert!(time_marks(input(0.0, 1e9)).len() <= 201);
    }
}
