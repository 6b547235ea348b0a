//! Why an experiment cannot be, and what of the file it is about.

use crate::analyze::MetricsError;
use crate::control::{FormError, GainsError};
use crate::explain::Explain;
use crate::model::{ModelError, StateSpaceError};
use crate::plant::RigError;
use crate::sim::{CompareError, ScenarioError};
use crate::tune::optimum::OptimumError;

/// Item of an experiment's file that an error is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// The file as a whole.
    Whole,
    /// A run, by its number from 0 in the file.
    Run(usize),
    /// A table, by its number from 0.
    Table(usize),
    /// An expectation, by its number from 0.
    Check(usize),
}

/// Why a run is not possible.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RunError {
    /// The rig refuses.
    #[error(transparent)]
    Rig(#[from] RigError),
    /// The scenario refuses.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// The process is none.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The gains have no ideal form.
    #[error(transparent)]
    Form(#[from] FormError),
    /// The gains are not usable.
    #[error(transparent)]
    Gains(#[from] GainsError),
    /// The input cannot be simulated.
    #[error(transparent)]
    Samples(#[from] StateSpaceError),
    /// There are no best gains.
    #[error(transparent)]
    Optimum(#[from] OptimumError),
    /// The models cannot be compared.
    #[error(transparent)]
    Compare(#[from] CompareError),
    /// The response has no figures.
    #[error(transparent)]
    Metrics(#[from] MetricsError),
}

impl RunError {
    fn inner(&self) -> &dyn Explain {
        match self {
            Self::Rig(error) => error,
            Self::Scenario(error) => error,
            Self::Model(error) => error,
            Self::Form(error) => error,
            Self::Gains(error) => error,
            Self::Samples(error) => error,
            Self::Optimum(error) => error,
            Self::Compare(error) => error,
            Self::Metrics(error) => error,
        }
    }
}

impl Explain for RunError {
    fn key(&self) -> &'static str {
        self.inner().key()
    }

    fn args(&self) -> Vec<(&'static str, String)> {
        self.inner().args()
    }

    fn cause(&self) -> Option<&dyn Explain> {
        self.inner().cause()
    }
}

/// Why an experiment cannot be run.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ExperimentError {
    /// A file of a format this version does not read.
    #[error("this experiment has schema {found}; this version reads schema {known}")]
    Schema {
        /// Schema of the file.
        found: u32,
        /// Schema this version reads.
        known: u32,
    },
    /// Nothing to run, or nothing expected.
    #[error("an experiment needs at least one [[run]] and at least one [[check]]")]
    Empty,
    /// An id that cannot be.
    #[error("'{id}' is not possible as an id: use letters, digits, _, - and . without blanks, each once")]
    Id {
        /// Offending id.
        id: String,
        /// Run or table of that id.
        place: Place,
    },
    /// A run of no kind, or of several.
    #[error(
        "the run {run} is {count} things: give it exactly one of scenario, scenario_file, loop, step, analysis, optimum and models"
    )]
    Kind {
        /// Id of the run.
        run: String,
        /// Number of kinds.
        count: usize,
        /// The run.
        place: Place,
    },
    /// A run that is not there.
    #[error("there is no run {run}; there are {runs}")]
    UnknownRun {
        /// Id.
        run: String,
        /// Ids there are.
        runs: String,
        /// What refers to it.
        place: Place,
    },
    /// A rig that is neither a preset nor a file.
    #[error("there is no rig {rig}: name a preset ({presets}) or a rig file beside this one")]
    UnknownRig {
        /// Rig as written.
        rig: String,
        /// Presets there are.
        presets: String,
        /// The run.
        place: Place,
    },
    /// A column that is not there.
    #[error("the run {run} has no column {column}; it has {columns}")]
    UnknownColumn {
        /// Id of the run.
        run: String,
        /// Column.
        column: String,
        /// Columns there are.
        columns: String,
        /// What refers to it.
        place: Place,
    },
    /// An expectation of nothing, or of several things.
    #[error(
        "a check expects one thing: expected with a tolerance of 0 or more, at_most and at_least, less_than, or more_than"
    )]
    Expectation {
        /// The expectation.
        place: Place,
    },
    /// A sweep without values, or of a number the run does not have.
    #[error(
        "the run {run} cannot be swept over {parameter}: give the keys of a number of that run, and its values"
    )]
    Sweep {
        /// Id of the run.
        run: String,
        /// Parameter as written.
        parameter: String,
        /// The run.
        place: Place,
    },
    /// A number that is out of its range.
    #[error("{field} = {} is not possible; it must be {expected}", crate::explain::number(*.value))]
    Value {
        /// Field.
        field: &'static str,
        /// Offending value.
        value: f64,
        /// What is possible.
        expected: &'static str,
        /// The run.
        place: Place,
    },
    /// A run that is not possible.
    #[error("{run}: {error}")]
    Run {
        /// Id of the run.
        run: String,
        /// Why not.
        error: Box<RunError>,
        /// The run.
        place: Place,
    },
}

impl ExperimentError {
    /// What of the file it is about.
    #[must_use]
    pub fn place(&self) -> Place {
        match self {
            Self::Schema { .. } | Self::Empty => Place::Whole,
            Self::Id { place, .. }
            | Self::Kind { place, .. }
            | Self::UnknownRun { place, .. }
            | Self::UnknownRig { place, .. }
            | Self::UnknownColumn { place, .. }
            | Self::Expectation { place }
            | Self::Sweep { place, .. }
            | Self::Value { place, .. }
            | Self::Run { place, .. } => *place,
        }
    }

    /// One of each kind, for the test that compares them with the translation files.
    #[must_use]
    pub fn samples() -> Vec<Self> {
        let text = |t: &str| t.to_owned();
        let place = Place::Run(0);
        vec![
            Self::Schema { found: 9, known: 1 },
            Self::Empty,
            Self::Id { id: text("a b"), place },
            Self::Kind { run: text("a"), count: 2, place },
            Self::UnknownRun { run: text("b"), runs: text("a"), place },
            Self::UnknownRig { rig: text("std"), presets: text("stad, simtank1"), place },
            Self::UnknownColumn { run: text("a"), column: text("h9_cm"), columns: text("pv, mv"), place },
            Self::Expectation { place },
            Self::Sweep { run: text("a"), parameter: text("loop.gains.kq"), place },
            Self::Value { field: "duration_s", value: -1.0, expected: "> 0", place },
            Self::Run { run: text("a"), error: Box::new(RigError::NoTank.into()), place },
        ]
    }
}

impl Explain for ExperimentError {
    fn key(&self) -> &'static str {
        match self {
            Self::Schema { .. } => "experiment.schema",
            Self::Empty => "experiment.empty",
            Self::Id { .. } => "experiment.id",
            Self::Kind { .. } => "experiment.kind",
            Self::UnknownRun { .. } => "experiment.unknown_run",
            Self::UnknownRig { .. } => "experiment.unknown_rig",
            Self::UnknownColumn { .. } => "experiment.unknown_column",
            Self::Expectation { .. } => "experiment.expectation",
            Self::Sweep { .. } => "experiment.sweep",
            Self::Value { .. } => "experiment.value",
            Self::Run { .. } => "experiment.run",
        }
    }

    fn args(&self) -> Vec<(&'static str, String)> {
        match self {
            Self::Schema { found, known } => vec![("found", found.to_string()), ("known", known.to_string())],
            Self::Empty | Self::Expectation { .. } => vec![],
            Self::Id { id, .. } => vec![("id", id.clone())],
            Self::Kind { run, count, .. } => vec![("run", run.clone()), ("count", count.to_string())],
            Self::UnknownRun { run, runs, .. } => vec![("run", run.clone()), ("runs", runs.clone())],
            Self::UnknownRig { rig, presets, .. } => {
                vec![("rig", rig.clone()), ("presets", presets.clone())]
            }
            Self::UnknownColumn { run, column, columns, .. } => {
                vec![("run", run.clone()), ("column", column.clone()), ("columns", columns.clone())]
            }
            Self::Sweep { run, parameter, .. } => {
                vec![("run", run.clone()), ("parameter", parameter.clone())]
            }
            Self::Value { field, value, expected, .. } => vec![
                ("field", (*field).to_owned()),
                ("value", crate::explain::number(*value)),
                ("expected", (*expected).to_owned()),
            ],
            Self::Run { run, error, .. } => vec![("run", run.clone()), ("error", error.to_string())],
        }
    }

    fn cause(&self) -> Option<&dyn Explain> {
        match self {
            Self::Run { error, .. } => Some(&**error),
            _ => None,
        }
    }
}
