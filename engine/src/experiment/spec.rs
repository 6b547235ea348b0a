//! What an experiment file says: plain data, nothing checked yet. `assets/SCHEMA.md` documents every field.

use serde::{Deserialize, Serialize};

use super::analysis::{AnalysisRun, OptimumRun};
use super::check::CheckSpec;
use super::linear_loop::LoopRun;
use super::measure::Measure;
use super::models::ModelsRun;
use super::rig_run::ScenarioRun;
use super::step::StepRun;
use crate::plant::Text;

/// Version of experiment files that is read.
pub const EXPERIMENT_SCHEMA: u32 = 1;

/// A prepared experiment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExperimentSpec {
    /// Version of the file format; 1.
    pub schema: u32,
    /// Short name without spaces.
    pub id: String,
    /// Name shown to people.
    pub title: Text,
    /// What it shows.
    pub shows: Text,
    /// How to read the curves.
    pub reading: Text,
    /// Where it comes from, with the figure.
    pub source: Text,
    /// What to run.
    #[serde(rename = "run")]
    pub runs: Vec<RunSpec>,
    /// One number a run of a sweep, side by side.
    #[serde(rename = "table", default)]
    pub tables: Vec<TableSpec>,
    /// What must come of it.
    #[serde(rename = "check")]
    pub checks: Vec<CheckSpec>,
}

/// One run, or one for each value of a sweep; exactly one of `scenario`, `scenario_file`, `loop`, `step`, `analysis`,
/// `optimum`, `models`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunSpec {
    /// Name in checks.
    pub id: String,
    /// Name shown to people, `{value}` standing for that of a sweep; absent: the id.
    pub title: Option<Text>,
    /// One run for each value of a number.
    pub sweep: Option<Sweep>,
    /// A scenario on a rig.
    pub scenario: Option<ScenarioRun>,
    /// A scenario file beside the experiment's.
    pub scenario_file: Option<String>,
    /// A control law on a linear process.
    #[serde(rename = "loop")]
    pub closed_loop: Option<LoopRun>,
    /// A continuous step response.
    pub step: Option<StepRun>,
    /// What given gains are worth.
    pub analysis: Option<AnalysisRun>,
    /// The best gains under limits, and what they are worth.
    pub optimum: Option<OptimumRun>,
    /// Models side by side.
    pub models: Option<ModelsRun>,
    /// Which value of which sweep this is, once the sweep is unrolled.
    #[serde(skip)]
    pub member: Option<Member>,
}

/// A number of a run that takes several values. Unrolled before an [`super::Experiment`] is made.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sweep {
    /// Keys that lead to it from the run on, joined by points; an item of a list by its number from 0.
    pub parameter: String,
    /// Its values.
    pub values: Vec<f64>,
}

/// Place of a run in a sweep.
#[derive(Debug, Clone, PartialEq)]
pub struct Member {
    /// Id of the run that was swept.
    pub sweep: String,
    /// Value of the parameter.
    pub value: f64,
}

/// Columns with one row for each run of a sweep.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TableSpec {
    /// Name in checks, as of a run.
    pub id: String,
    /// Name shown to people; absent: the id.
    pub title: Option<Text>,
    /// Id of the swept run.
    pub sweep: String,
    /// Column name of the parameter.
    pub x: String,
    /// Its unit as shown.
    #[serde(default)]
    pub x_unit: String,
    /// Columns.
    #[serde(rename = "column")]
    pub columns: Vec<TableColumn>,
}

/// One column of a table: a sum of measures.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TableColumn {
    /// Column name.
    pub name: String,
    /// Unit as shown.
    #[serde(default)]
    pub unit: String,
    /// What is added up.
    pub sum: Vec<Term>,
}

/// A measure with a factor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Term {
    /// Factor.
    #[serde(default = "one")]
    pub factor: f64,
    /// Measure; its run is each of the sweep's.
    pub measure: Measure,
}

fn one() -> f64 {
    1.0
}
