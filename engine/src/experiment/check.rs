//! An expectation, and what was found.

use serde::{Deserialize, Serialize};

use super::measure::Measure;
use crate::plant::Text;

/// An expectation of a file: a measure (less another, where `minus` is given), and exactly one of `expected` with
/// `tolerance`, `at_most` and `at_least` (either or both), `less_than`, `more_than`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CheckSpec {
    /// What is expected, in words.
    pub title: Text,
    /// What is measured.
    pub measure: Measure,
    /// What is taken off it.
    pub minus: Option<Measure>,
    /// Value that must be found …
    pub expected: Option<f64>,
    /// … to this, either way.
    pub tolerance: Option<f64>,
    /// Upper end.
    pub at_most: Option<f64>,
    /// Lower end.
    pub at_least: Option<f64>,
    /// A measure that must be larger.
    pub less_than: Option<Measure>,
    /// A measure that must be smaller.
    pub more_than: Option<Measure>,
    /// The value of the source, where it is not what is expected here.
    pub printed: Option<f64>,
}

/// What is expected, with the number of the other side where that is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Expectation {
    /// A value.
    Value {
        /// Value.
        expected: f64,
        /// Largest difference, either way.
        tolerance: f64,
    },
    /// A range.
    Range {
        /// Lower end; −∞ for none.
        low: f64,
        /// Upper end; ∞ for none.
        high: f64,
    },
    /// Less than a measure.
    Less {
        /// What was found for it.
        than: Option<f64>,
    },
    /// More than a measure.
    More {
        /// What was found for it.
        than: Option<f64>,
    },
}

impl Expectation {
    /// Whether a number meets it.
    #[must_use]
    pub fn admits(&self, found: f64) -> bool {
        match *self {
            Self::Value { expected, tolerance } => (found - expected).abs() <= tolerance,
            Self::Range { low, high } => (low..=high).contains(&found),
            Self::Less { than } => than.is_some_and(|than| found < than),
            Self::More { than } => than.is_some_and(|than| found > than),
        }
    }
}

/// An expectation held against the runs.
#[derive(Debug, Clone, PartialEq)]
pub struct CheckOutcome {
    /// What is expected, in words.
    pub title: Text,
    /// Run the measure is of.
    pub run: String,
    /// What was found; `None` where the run has no such number.
    pub found: Option<f64>,
    /// What was expected.
    pub expectation: Expectation,
    /// The value of the source, where it is another.
    pub printed: Option<f64>,
}

impl CheckOutcome {
    /// Whether it is met.
    #[must_use]
    pub fn passes(&self) -> bool {
        self.found.is_some_and(|found| self.expectation.admits(found))
    }
}

impl CheckSpec {
    /// All measures of it.
    pub(super) fn measures(&self) -> impl Iterator<Item = &Measure> {
        let others = [&self.minus, &self.less_than, &self.more_than].into_iter().flatten();
        std::iter::once(&self.measure).chain(others)
    }

    /// Whether it expects exactly one thing, with finite numbers.
    pub(super) fn is_whole(&self) -> bool {
        let range = self.at_most.is_some() || self.at_least.is_some();
        let kinds = [self.expected.is_some(), range, self.less_than.is_some(), self.more_than.is_some()];
        let one = kinds.iter().filter(|given| **given).count() == 1;
        let paired = self.expected.is_some() == self.tolerance.is_some();
        let numbers = [self.expected, self.tolerance, self.at_most, self.at_least];
        one && paired
            && numbers.into_iter().flatten().all(f64::is_finite)
            && self.tolerance.is_none_or(|t| t >= 0.0)
    }

    /// Held against the runs, `number` giving that of a measure.
    pub(super) fn outcome(&self, number: impl Fn(&Measure) -> Option<f64>) -> CheckOutcome {
        let found = match &self.minus {
            None => number(&self.measure),
            Some(minus) => number(&self.measure).zip(number(minus)).map(|(a, b)| a - b),
        };
        let expectation = match (&self.expected, &self.less_than, &self.more_than) {
            (Some(expected), _, _) => {
                Expectation::Value { expected: *expected, tolerance: self.tolerance.unwrap_or(0.0) }
            }
            (_, Some(other), _) => Expectation::Less { than: number(other) },
            (_, _, Some(other)) => Expectation::More { than: number(other) },
            _ => Expectation::Range {
                low: self.at_least.unwrap_or(f64::NEG_INFINITY),
                high: self.at_most.unwrap_or(f64::INFINITY),
            },
        };
        let run = self.measure.run().to_owned();
        CheckOutcome { title: self.title.clone(), run, found, expectation, printed: self.printed }
    }
}
