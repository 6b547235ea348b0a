//! `vasos identify`: a process model from a log.

mod answer;

use std::path::PathBuf;

use serde_json::Value;
use vasos_engine::identify::{ControllerFit, FitError, ModelFit, study_loop};

use super::log_columns::{LoadedLog, LogArguments};
use super::{Answer, Refusal};

/// A fit as JSON.
pub(super) fn model_json(fit: &ModelFit) -> Value {
    answer::model(fit)
}

/// A controller read off a log as JSON.
pub(super) fn controller_json(fit: &ControllerFit) -> Value {
    answer::controller(fit)
}

/// Parameters of a fit as rows of a table.
pub(super) fn model_rows(fit: &ModelFit) -> Vec<Vec<String>> {
    answer::parameter_rows(fit)
}

/// Arguments of `vasos identify`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  vasos identify step.csv --json
  vasos identify step.csv --pv h2_cm --mv u_v --from 100 --to 900
  vasos identify step.csv --pv T1 --mv '0.5*(u1+u2)' --mv-before 0
  vasos identify loop.csv --structure sopdt --disturbance feed --drift linear
  vasos identify loop.csv --mv u0+du --mv-min 0 --mv-max 60
Columns that are not named are proposed from their names and behaviour. COL is a name or an expression of names.
A stretch with one step of the MV between two rests also gets the estimates of the reaction curve.
With a setpoint and an automatic mode the gains of the controller at work are read from the log as well.
Exit status 1: the log can be read, but no model can be told from it.")]
pub struct Arguments {
    /// Log file: text with separators, a workbook, Parquet or a recording; several become one log.
    #[arg(required = true, value_name = "LOG")]
    logs: Vec<PathBuf>,
    #[command(flatten)]
    columns: LogArguments,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<Answer, Refusal> {
    let options = arguments.columns.study_options()?;
    let log = LoadedLog::read(&arguments.logs, &arguments.columns)?;
    let study = match study_loop(&log.record(), &options) {
        Ok(study) => study,
        // The log is readable, and what it says is no.
        Err(error @ (FitError::ConstantMv { .. } | FitError::ConstantPv { .. })) => {
            return Ok(answer::nothing(arguments.json, &log.columns, &log.imported, log.warnings(), &error));
        }
        Err(error) => return Err(Refusal::of(error)),
    };
    if let Err(error) = &study.choice
        && !matches!(error, FitError::NothingToFit { .. })
    {
        return Err(Refusal::of(error));
    }
    let mut warnings = log.warnings();
    if let Err(error) = &study.reaction_curve
        && error.is_one_step()
    {
        warnings.push(format!("no reaction curve: {error}"));
    }
    Ok(answer::of(arguments.json, &log.columns, &study, &log.imported, warnings))
}
