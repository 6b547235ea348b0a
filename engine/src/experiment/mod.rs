//! Prepared experiments: what to run, and what must come of it.
//!
//! An [`ExperimentSpec`] is what a file says; [`Experiment`] is the same checked, with the rigs it runs on.
//! [`run_experiment`] gives an [`ExperimentRun`]: the columns of every run, the tables drawn from them, and each
//! expectation with what was found. A run is a scenario on a rig, a law at its sample time on a linear process, a
//! continuous step response, the analysis of given or of the best gains, or models side by side.

mod analysis;
mod check;
mod error;
mod linear_loop;
mod measure;
mod models;
mod outcome;
mod prepare;
mod rig_run;
mod runner;
mod spec;
mod step;

pub use analysis::{AnalysisRun, OptimumRun};
pub use check::{CheckOutcome, CheckSpec, Expectation};
pub use error::{ExperimentError, Place, RunError};
pub use linear_loop::{LoopEvent, LoopRun};
pub use measure::{Figure, Measure};
pub use models::{ModelsRun, ResistanceSpec};
pub use outcome::{ExperimentEnd, ExperimentRun, Progress, RunColumn, RunResult};
pub use prepare::Experiment;
pub use rig_run::{RigChanges, ScenarioRun};
pub use runner::run_experiment;
pub use spec::{EXPERIMENT_SCHEMA, ExperimentSpec, Member, RunSpec, Sweep, TableColumn, TableSpec, Term};
pub use step::StepRun;
