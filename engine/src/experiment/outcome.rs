//! What an experiment came to: columns to plot, expectations with what was found.

use super::check::CheckOutcome;
use crate::plant::Text;

/// A column of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct RunColumn {
    /// Name, with its unit where the rig gives one: `h1_cm`.
    pub name: String,
    /// Unit as shown; empty for none.
    pub unit: String,
    /// One value a row.
    pub values: Vec<f64>,
}

/// Times in seconds, and columns.
pub(super) type TimedColumns = (Vec<f64>, Vec<RunColumn>);

/// A finished run, or a table of a sweep.
#[derive(Debug, Clone, PartialEq)]
pub struct RunResult {
    /// Name in checks.
    pub id: String,
    /// Name shown to people.
    pub label: Text,
    /// Name of the axis: `time_s`, or a sweep's parameter.
    pub x_name: String,
    /// Unit of the axis as shown.
    pub x_unit: String,
    /// The axis, rising.
    pub x: Vec<f64>,
    /// Columns, each as long as the axis.
    pub columns: Vec<RunColumn>,
    /// Where PV comes to rest, where a computed response knows it exactly.
    pub final_value: Option<f64>,
}

impl RunResult {
    /// Values of a column by its name; the axis has a name as well.
    #[must_use]
    pub fn column(&self, name: &str) -> Option<&[f64]> {
        if name == self.x_name {
            return Some(&self.x);
        }
        self.columns.iter().find(|c| c.name == name).map(|c| c.values.as_slice())
    }
}

/// A finished experiment.
#[derive(Debug, Clone, PartialEq)]
pub struct ExperimentRun {
    /// Runs in the order of the file, sweeps unrolled, then the tables.
    pub runs: Vec<RunResult>,
    /// Expectations in the order of the file.
    pub checks: Vec<CheckOutcome>,
}

impl ExperimentRun {
    /// Whether every expectation is met.
    #[must_use]
    pub fn reached(&self) -> bool {
        self.checks.iter().all(CheckOutcome::passes)
    }

    /// A run or table by its id.
    #[must_use]
    pub fn run(&self, id: &str) -> Option<&RunResult> {
        self.runs.iter().find(|r| r.id == id)
    }
}

/// How far an experiment is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// Runs that are done.
    pub done: usize,
    /// Runs in all.
    pub of: usize,
    /// Share of the present run, 0 to 1.
    pub share: f64,
}

/// How an experiment ended.
#[derive(Debug, Clone, PartialEq)]
pub enum ExperimentEnd {
    /// With its results.
    Finished(ExperimentRun),
    /// Its flag was raised.
    Cancelled,
}
