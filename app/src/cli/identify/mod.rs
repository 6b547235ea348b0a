//! `vasos identify`: a process model from a log.

mod answer;

use std::path::PathBuf;

use vasos_engine::identify::{
    Disturbance, Drift, FitError, FitOptions, FitProblem, LoopRecord, ModeColumn, ModelFit, Structure,
    StudyOptions, study_loop,
};
use vasos_engine::signal::{CompleteRows, LogTable, derived_column};
use vasos_io::log::ImportedLog;

use super::logs::Reading;
use super::{Answer, Refusal};

/// A fit as JSON.
pub(super) fn model_json(fit: &ModelFit) -> serde_json::Value {
    answer::model(fit)
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
    /// Process variable.
    #[arg(long, value_name = "COL")]
    pv: Option<String>,
    /// Manipulated variable.
    #[arg(long, value_name = "COL")]
    mv: Option<String>,
    /// Setpoint, for the controller's gains.
    #[arg(long, value_name = "COL")]
    sp: Option<String>,
    /// Mode of the controller.
    #[arg(long, value_name = "COL")]
    mode: Option<String>,
    /// Measured disturbance: another input of the PV; may be given several times.
    #[arg(long, value_name = "COL")]
    disturbance: Vec<String>,
    #[command(flatten)]
    reading: Reading,
    /// Start of the stretch, in seconds since the first row.
    #[arg(long, value_name = "S", allow_hyphen_values = true)]
    from: Option<f64>,
    /// End of the stretch, in seconds since the first row.
    #[arg(long, value_name = "S", allow_hyphen_values = true)]
    to: Option<f64>,
    /// MV before the first row, for a log that starts at the step.
    #[arg(long, value_name = "V", allow_hyphen_values = true)]
    mv_before: Option<f64>,
    /// Lower limit of the MV, for a log that holds it ahead of its limits.
    #[arg(long, value_name = "V", allow_hyphen_values = true)]
    mv_min: Option<f64>,
    /// Upper limit of the MV, for a log that holds it ahead of its limits.
    #[arg(long, value_name = "V", allow_hyphen_values = true)]
    mv_max: Option<f64>,
    /// auto, fopdt, ipdt, sopdt or `sopdt_zero`; auto fits all and chooses.
    #[arg(long, default_value = "auto")]
    structure: String,
    /// none, linear or auto: a straight drift of the PV that follows no input.
    #[arg(long, default_value = "auto")]
    drift: String,
    /// Takes every row as it is: leaves out no spike or frozen stretch, looks for no limit of the MV.
    #[arg(long)]
    as_is: bool,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// The columns in use, as named by the user or proposed.
struct Chosen {
    time: Option<String>,
    pv: String,
    mv: String,
    sp: Option<String>,
    mode: Option<String>,
    disturbances: Vec<String>,
}

pub(super) fn run(arguments: &Arguments) -> Result<Answer, Refusal> {
    let options = study_options(arguments)?;
    let drift = drift(&arguments.drift)?;
    let log = arguments.reading.open(&arguments.logs)?;
    let chosen = choose(arguments, &log)?;
    let stretch = Stretch::of(arguments, &log.table, &chosen)?;
    let fit_options = FitOptions {
        mv_before: arguments.mv_before,
        drift,
        pv_name: chosen.pv.clone(),
        mv_name: chosen.mv.clone(),
        first_row: stretch.first_row,
        ..FitOptions::default()
    };
    let rows = &stretch.rows;
    let mut problem = FitProblem::new(&rows.time_s, &rows.columns[0], &rows.columns[1]);
    problem.options = fit_options;
    let others = chosen.disturbances.iter().zip(&rows.columns[2..]);
    problem.disturbances = others.map(|(name, values)| Disturbance { name: name.clone(), values }).collect();
    let record = LoopRecord { problem, sp: stretch.sp.as_deref(), mode: stretch.mode() };
    let study = study_loop(&record, &options).map_err(Refusal::of)?;
    if let Err(error) = &study.choice
        && !matches!(error, FitError::NothingToFit { .. })
    {
        return Err(Refusal::of(error));
    }
    let mut warnings = Vec::new();
    if !rows.left_out.is_empty() {
        warnings.push(format!("{} rows without a value were left out", rows.left_out.len()));
    }
    if let Err(error) = &study.reaction_curve
        && error.is_one_step()
    {
        warnings.push(format!("no reaction curve: {error}"));
    }
    Ok(answer::of(arguments.json, &chosen, &study, &log, warnings))
}

fn study_options(arguments: &Arguments) -> Result<StudyOptions, Refusal> {
    let structure = match arguments.structure.as_str() {
        "auto" => None,
        name => Some(Structure::from_key(name).ok_or_else(|| {
            let known: Vec<&str> = Structure::ALL.iter().map(|s| s.key()).collect();
            Refusal(format!("there is no structure '{name}': choose auto or one of {}", known.join(", ")))
        })?),
    };
    let mv_limits = match (arguments.mv_min, arguments.mv_max) {
        (None, None) => None,
        (low, high) => {
            let limits = [low.unwrap_or(f64::NEG_INFINITY), high.unwrap_or(f64::INFINITY)];
            if limits[0].is_nan() || limits[1].is_nan() || limits[0] >= limits[1] {
                return Err(Refusal(format!("--mv-min {} must lie below --mv-max {}", limits[0], limits[1])));
            }
            Some(limits)
        }
    };
    Ok(StudyOptions { structure, mv_limits, as_is: arguments.as_is })
}

fn drift(name: &str) -> Result<Drift, Refusal> {
    match name {
        "none" => Ok(Drift::None),
        "linear" => Ok(Drift::Linear),
        "auto" => Ok(Drift::Auto),
        _ => Err(Refusal(format!("there is no drift '{name}': choose none, linear or auto"))),
    }
}

fn choose(arguments: &Arguments, log: &ImportedLog) -> Result<Chosen, Refusal> {
    let roles = &log.report.roles;
    let pick = |given: &Option<String>, proposed: &Option<String>, option: &str| {
        given.clone().or_else(|| proposed.clone()).ok_or_else(|| {
            let columns = names(&log.table);
            Refusal(format!(
                "no column looks like the {option}: name it with --{option}; there are {columns}"
            ))
        })
    };
    Ok(Chosen {
        time: log.report.time_column.clone(),
        pv: pick(&arguments.pv, &roles.pv, "pv")?,
        mv: pick(&arguments.mv, &roles.mv, "mv")?,
        sp: arguments.sp.clone().or_else(|| roles.sp.clone()),
        mode: arguments.mode.clone().or_else(|| roles.mode.clone()),
        disturbances: arguments.disturbance.clone(),
    })
}

fn names(table: &LogTable) -> String {
    table.columns.iter().map(|c| c.name.as_str()).collect::<Vec<_>>().join(", ")
}

/// The rows of a fit.
struct Stretch {
    /// PV, MV and the disturbances.
    rows: CompleteRows,
    sp: Option<Vec<f64>>,
    mode: Option<Vec<f64>>,
    /// Words of the mode, where its column holds words.
    mode_words: Vec<String>,
    /// Line of the file the first row came from.
    first_row: usize,
}

impl Stretch {
    fn of(arguments: &Arguments, table: &LogTable, chosen: &Chosen) -> Result<Self, Refusal> {
        let column = |name: &String| derived_column(table, name).map_err(Refusal::of);
        let mut columns = vec![column(&chosen.pv)?, column(&chosen.mv)?];
        for name in &chosen.disturbances {
            columns.push(column(name)?);
        }
        let (from_s, to_s) = (arguments.from.unwrap_or(0.0), arguments.to.unwrap_or(f64::INFINITY));
        if from_s.is_nan() || to_s.is_nan() || from_s >= to_s {
            return Err(Refusal(format!("--from {from_s} must be less than --to {to_s}")));
        }
        let slices: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
        let rows = table.complete(&slices, from_s, to_s);
        // A setpoint or mode that is missing here and there holds its last value.
        let held = |name: &Option<String>| -> Result<Option<Vec<f64>>, Refusal> {
            let Some(name) = name else { return Ok(None) };
            Ok(rows.held(&column(name)?))
        };
        let words = |name: &String| table.columns.iter().find(|c| c.name == *name).map(|c| c.states.clone());
        Ok(Self {
            sp: held(&chosen.sp)?,
            mode: held(&chosen.mode)?,
            mode_words: chosen.mode.as_ref().and_then(words).unwrap_or_default(),
            first_row: rows.first_line(table),
            rows,
        })
    }

    fn mode(&self) -> Option<ModeColumn<'_>> {
        self.mode.as_deref().map(|values| ModeColumn { values, words: &self.mode_words })
    }
}
