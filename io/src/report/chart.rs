//! What a chart shows: axes, and marks over them.

use super::palette::Ink;

/// How values lie along an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Scale {
    /// Evenly.
    #[default]
    Linear,
    /// By their logarithm; values must be greater than 0.
    Log,
}

/// An axis.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Axis {
    /// Name with its unit.
    pub label: String,
    /// First and last value; `None` fits the marks.
    pub range: Option<(f64, f64)>,
    /// Linear or logarithmic.
    pub scale: Scale,
}

impl Axis {
    /// A linear axis that fits the marks.
    #[must_use]
    pub fn fitting(label: impl Into<String>) -> Self {
        Self { label: label.into(), ..Self::default() }
    }

    /// A linear axis between two values.
    #[must_use]
    pub fn between(label: impl Into<String>, low: f64, high: f64) -> Self {
        Self { label: label.into(), range: Some((low, high)), scale: Scale::Linear }
    }

    /// A logarithmic axis that fits the marks.
    #[must_use]
    pub fn log(label: impl Into<String>) -> Self {
        Self { label: label.into(), range: None, scale: Scale::Log }
    }
}

/// Something drawn over the axes; what has no name is not in the legend.
#[derive(Debug, Clone, PartialEq)]
pub enum Mark {
    /// A curve; a value that is not finite interrupts it.
    Line {
        /// Name in the legend.
        name: Option<String>,
        /// (x, y) in the axes' units.
        points: Vec<(f64, f64)>,
        /// Colour.
        ink: Ink,
    },
    /// The area between two curves.
    Band {
        /// Name in the legend.
        name: Option<String>,
        /// (x, lower, upper).
        points: Vec<(f64, f64, f64)>,
        /// Colour.
        ink: Ink,
    },
    /// One point with its words beside it.
    Point {
        /// Words beside it.
        label: String,
        /// x.
        x: f64,
        /// y.
        y: f64,
        /// Colour.
        ink: Ink,
    },
    /// A circle; round only in a chart of equal axes.
    Circle {
        /// Name in the legend.
        name: Option<String>,
        /// Centre.
        centre: (f64, f64),
        /// Radius.
        radius: f64,
        /// Colour.
        ink: Ink,
    },
}

impl Mark {
    /// A named curve.
    #[must_use]
    pub fn line(name: impl Into<String>, points: Vec<(f64, f64)>, ink: Ink) -> Self {
        Self::Line { name: Some(name.into()), points, ink }
    }

    pub(super) fn legend(&self) -> Option<(&str, Ink, bool)> {
        match self {
            Self::Line { name, ink, .. } | Self::Circle { name, ink, .. } => {
                name.as_deref().map(|n| (n, *ink, false))
            }
            Self::Band { name, ink, .. } => name.as_deref().map(|n| (n, *ink, true)),
            Self::Point { .. } => None,
        }
    }

    /// Corners of what it covers.
    pub(super) fn reach(&self) -> Vec<(f64, f64)> {
        match self {
            Self::Line { points, .. } => points.clone(),
            Self::Band { points, .. } => points.iter().flat_map(|p| [(p.0, p.1), (p.0, p.2)]).collect(),
            Self::Point { x, y, .. } => vec![(*x, *y)],
            Self::Circle { centre, radius, .. } => {
                vec![(centre.0 - radius, centre.1 - radius), (centre.0 + radius, centre.1 + radius)]
            }
        }
    }
}

/// A chart.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    /// What it shows, for those who cannot see it.
    pub title: String,
    /// Width in pixels; it scales with the page.
    pub width: f64,
    /// Height of the plot in pixels, without legend and labels.
    pub height: f64,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// Marks, drawn in their order.
    pub marks: Vec<Mark>,
}

impl Chart {
    /// A chart as wide as the page.
    #[must_use]
    pub fn wide(title: impl Into<String>, x: Axis, y: Axis, marks: Vec<Mark>) -> Self {
        Self { title: title.into(), width: 760.0, height: 220.0, x, y, marks }
    }

    /// A chart half as wide.
    #[must_use]
    pub fn half(title: impl Into<String>, x: Axis, y: Axis, marks: Vec<Mark>) -> Self {
        Self { title: title.into(), width: 375.0, height: 190.0, x, y, marks }
    }
}
