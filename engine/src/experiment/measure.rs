//! One number of a run.

use serde::{Deserialize, Serialize};

use super::outcome::RunResult;
use crate::analyze::{Excitation, Metrics, metrics, metrics_at_rest};
use crate::sim::agreement;

/// A figure of a loop, as [`Metrics`] has it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[allow(missing_docs, reason = "each is the field of `Metrics` of its name")]
pub enum Figure {
    Ie,
    Iae,
    Ise,
    Itae,
    PeakError,
    FinalValue,
    SteadyError,
    OvershootPercent,
    DecayRatio,
    RiseTimeS,
    SettlingTimeS,
    TotalVariation,
    MaxU,
    MinU,
}

impl Figure {
    fn of(self, m: &Metrics) -> Option<f64> {
        match self {
            Self::Ie => Some(m.ie),
            Self::Iae => Some(m.iae),
            Self::Ise => Some(m.ise),
            Self::Itae => Some(m.itae),
            Self::PeakError => Some(m.peak_error),
            Self::FinalValue => Some(m.final_value),
            Self::SteadyError => Some(m.steady_error),
            Self::OvershootPercent => m.overshoot_percent,
            Self::DecayRatio => m.decay_ratio,
            Self::RiseTimeS => m.rise_time_s,
            Self::SettlingTimeS => m.settling_time_s,
            Self::TotalVariation => Some(m.total_variation),
            Self::MaxU => Some(m.max_u),
            Self::MinU => Some(m.min_u),
        }
    }
}

/// A number to take from a run. Windows run from `from` to `to` on the axis, both included; absent: its ends.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "of", rename_all = "snake_case", deny_unknown_fields)]
#[allow(missing_docs, reason = "fields that repeat in every kind: run, column and window")]
pub enum Measure {
    /// Value in the last row at or before `at`.
    Value { run: String, column: String, at: f64 },
    /// Value in the last row.
    End { run: String, column: String },
    /// Largest value.
    Max { run: String, column: String, from: Option<f64>, to: Option<f64> },
    /// Smallest value.
    Min { run: String, column: String, from: Option<f64>, to: Option<f64> },
    /// Mean over the rows.
    Mean { run: String, column: String, from: Option<f64>, to: Option<f64> },
    /// Standard deviation over the rows.
    Deviation { run: String, column: String, from: Option<f64>, to: Option<f64> },
    /// Σ |Δ| over the rows.
    Variation { run: String, column: String, from: Option<f64>, to: Option<f64> },
    /// Change from the first to the last row over their distance.
    Slope { run: String, column: String, from: Option<f64>, to: Option<f64> },
    /// Value in the first row at or after `at` less the value in the row before it.
    Jump { run: String, column: String, at: f64 },
    /// How long after `from` the column enters for good the band `about` ± `within`.
    Settles { run: String, column: String, about: f64, within: f64, from: Option<f64>, to: Option<f64> },
    /// Where, from `from` on, the column first is at `level` or has crossed it.
    Reaches { run: String, column: String, level: f64, from: Option<f64>, to: Option<f64> },
    /// How often the column crosses `level`.
    Crossings { run: String, column: String, level: f64, from: Option<f64>, to: Option<f64> },
    /// Share in percent of the rows with values from `low` to `high`.
    Share {
        run: String,
        column: String,
        low: Option<f64>,
        high: Option<f64>,
        from: Option<f64>,
        to: Option<f64>,
    },
    /// 1 where a spill is ever above 0, otherwise 0.
    Overflows { run: String, column: String },
    /// A figure of the loop over the window; `excitation` absent: setpoint.
    Figure {
        run: String,
        figure: Figure,
        excitation: Option<Excitation>,
        #[serde(rename = "loop")]
        slot: Option<usize>,
        from: Option<f64>,
        to: Option<f64>,
    },
    /// Mean squared difference of `column` and `against`.
    Mse { run: String, column: String, against: String, from: Option<f64>, to: Option<f64> },
    /// 100 (1 − ‖y − ŷ‖/‖y − ȳ‖), `column` ŷ and `against` y.
    Fit { run: String, column: String, against: String, from: Option<f64>, to: Option<f64> },
    /// Largest difference to a column of another run with the same axis; `against` absent: the same column.
    Distance {
        run: String,
        column: String,
        other: String,
        against: Option<String>,
        from: Option<f64>,
        to: Option<f64>,
    },
}

/// Slack for times that are products of a sample time.
const SLACK: f64 = 1e-9;

/// Rows of a window.
#[derive(Debug, Clone, Copy)]
struct Window {
    first: usize,
    /// One past the last.
    end: usize,
}

impl Measure {
    /// Id of the run.
    #[must_use]
    pub fn run(&self) -> &str {
        match self {
            Self::Value { run, .. }
            | Self::End { run, .. }
            | Self::Max { run, .. }
            | Self::Min { run, .. }
            | Self::Mean { run, .. }
            | Self::Deviation { run, .. }
            | Self::Variation { run, .. }
            | Self::Slope { run, .. }
            | Self::Jump { run, .. }
            | Self::Settles { run, .. }
            | Self::Reaches { run, .. }
            | Self::Crossings { run, .. }
            | Self::Share { run, .. }
            | Self::Overflows { run, .. }
            | Self::Figure { run, .. }
            | Self::Mse { run, .. }
            | Self::Fit { run, .. }
            | Self::Distance { run, .. } => run,
        }
    }

    /// Ids of all runs it looks at.
    #[must_use]
    pub fn runs(&self) -> Vec<&str> {
        match self {
            Self::Distance { run, other, .. } => vec![run, other],
            _ => vec![self.run()],
        }
    }

    /// Columns that it looks at, each with the id of its run.
    #[must_use]
    pub fn columns(&self) -> Vec<(&str, String)> {
        match self {
            Self::Value { column, .. }
            | Self::End { column, .. }
            | Self::Max { column, .. }
            | Self::Min { column, .. }
            | Self::Mean { column, .. }
            | Self::Deviation { column, .. }
            | Self::Variation { column, .. }
            | Self::Slope { column, .. }
            | Self::Jump { column, .. }
            | Self::Settles { column, .. }
            | Self::Reaches { column, .. }
            | Self::Crossings { column, .. }
            | Self::Share { column, .. }
            | Self::Overflows { column, .. } => vec![(self.run(), column.clone())],
            Self::Distance { run, column, other, against, .. } => {
                vec![(run, column.clone()), (other, against.as_ref().unwrap_or(column).clone())]
            }
            Self::Mse { column, against, .. } | Self::Fit { column, against, .. } => {
                vec![(self.run(), column.clone()), (self.run(), against.clone())]
            }
            Self::Figure { slot, .. } => loop_columns(*slot).map(|name| (self.run(), name)).to_vec(),
        }
    }

    fn window(&self) -> (Option<f64>, Option<f64>) {
        match self {
            Self::Max { from, to, .. }
            | Self::Min { from, to, .. }
            | Self::Mean { from, to, .. }
            | Self::Deviation { from, to, .. }
            | Self::Variation { from, to, .. }
            | Self::Slope { from, to, .. }
            | Self::Settles { from, to, .. }
            | Self::Reaches { from, to, .. }
            | Self::Crossings { from, to, .. }
            | Self::Share { from, to, .. }
            | Self::Figure { from, to, .. }
            | Self::Mse { from, to, .. }
            | Self::Fit { from, to, .. }
            | Self::Distance { from, to, .. } => (*from, *to),
            Self::Value { .. } | Self::End { .. } | Self::Jump { .. } | Self::Overflows { .. } => {
                (None, None)
            }
        }
    }

    /// The number, `None` where the run has none: a window without rows, a band never entered, no overshoot.
    ///
    /// Columns that are not there give `None` too; [`super::run_experiment`] refuses them first.
    #[must_use]
    pub fn of(&self, result: &RunResult, other: Option<&RunResult>) -> Option<f64> {
        let window = rows(&result.x, self.window())?;
        let column = |name: &str| Some(&result.column(name)?[window.first..window.end]);
        let x = &result.x[window.first..window.end];
        match self {
            Self::Figure { figure, excitation, slot, .. } => {
                let [sp, pv, mv] = loop_columns(*slot);
                let excitation = excitation.unwrap_or(Excitation::Setpoint);
                let whole = x.len() == result.x.len();
                let (r, y, u) = (column(&sp)?, column(&pv)?, column(&mv)?);
                let figures = match result.final_value.filter(|_| whole) {
                    Some(rest) => metrics_at_rest(x, r, y, u, excitation, rest),
                    None => metrics(x, r, y, u, excitation),
                };
                figure.of(&figures.ok()?)
            }
            Self::Mse { column: model, against, .. } => Some(agreement(column(against)?, column(model)?).0),
            Self::Fit { column: model, against, .. } => agreement(column(against)?, column(model)?).1,
            Self::Distance { column: name, against, .. } => {
                let other = other?;
                let across = rows(&other.x, self.window())?;
                let theirs = &other.column(against.as_ref().unwrap_or(name))?[across.first..across.end];
                let ours = column(name)?;
                let same = other.x[across.first..across.end].iter().zip(x).all(|(a, b)| (a - b).abs() < 1e-6);
                (same && theirs.len() == ours.len())
                    .then(|| ours.iter().zip(theirs).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs())))
            }
            _ => self.of_column(x, column(&self.columns().first()?.1)?),
        }
    }

    /// A measure of one column over its window.
    fn of_column(&self, x: &[f64], v: &[f64]) -> Option<f64> {
        let count = v.len() as f64;
        let mean = || v.iter().sum::<f64>() / count;
        match self {
            Self::Value { at, .. } => {
                let after = x.partition_point(|t| *t <= at + SLACK);
                after.checked_sub(1).map(|row| v[row])
            }
            Self::End { .. } => v.last().copied(),
            Self::Max { .. } => Some(v.iter().copied().fold(f64::NEG_INFINITY, f64::max)),
            Self::Min { .. } => Some(v.iter().copied().fold(f64::INFINITY, f64::min)),
            Self::Mean { .. } => Some(mean()),
            Self::Deviation { .. } => {
                let mean = mean();
                Some((v.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / count).sqrt())
            }
            Self::Variation { .. } => Some(v.windows(2).map(|w| (w[1] - w[0]).abs()).sum()),
            Self::Slope { .. } => {
                let last = x.len() - 1;
                (last > 0).then(|| (v[last] - v[0]) / (x[last] - x[0]))
            }
            Self::Jump { at, .. } => {
                let row = x.partition_point(|t| *t < at - SLACK);
                (row > 0 && row < v.len()).then(|| v[row] - v[row - 1])
            }
            Self::Settles { about, within, .. } => {
                let outside = v.iter().rposition(|v| (v - about).abs() > *within);
                let row = outside.map_or(0, |row| row + 1);
                (row < v.len()).then(|| x[row] - x[0])
            }
            Self::Reaches { level, .. } => {
                let side = v[0] - level;
                v.iter().position(|v| (v - level) * side <= 0.0).map(|row| x[row])
            }
            Self::Crossings { level, .. } => {
                let sides = v.iter().map(|v| v > level).collect::<Vec<_>>();
                Some(sides.windows(2).filter(|w| w[0] != w[1]).count() as f64)
            }
            Self::Share { low, high, .. } => {
                let (low, high) = (low.unwrap_or(f64::NEG_INFINITY), high.unwrap_or(f64::INFINITY));
                Some(100.0 * v.iter().filter(|v| (low..=high).contains(v)).count() as f64 / count)
            }
            Self::Overflows { .. } => Some(f64::from(u8::from(v.iter().any(|v| *v > 0.0)))),
            Self::Figure { .. } | Self::Mse { .. } | Self::Fit { .. } | Self::Distance { .. } => None,
        }
    }
}

/// Columns of a loop by its number from 1: plain names, or with the number where there are several loops.
fn loop_columns(slot: Option<usize>) -> [String; 3] {
    let number = slot.map_or_else(String::new, |n| n.to_string());
    ["sp", "pv", "mv"].map(|name| format!("{name}{number}"))
}

/// Rows within a window; `None` when there is none.
fn rows(x: &[f64], (from, to): (Option<f64>, Option<f64>)) -> Option<Window> {
    let first = from.map_or(0, |from| x.partition_point(|t| *t < from - SLACK));
    let end = to.map_or(x.len(), |to| x.partition_point(|t| *t <= to + SLACK));
    (first < end).then_some(Window { first, end })
}
