//! What the plots of several panes share.

use eframe::egui::Rangef;
use egui_plot::AxisHints;

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
