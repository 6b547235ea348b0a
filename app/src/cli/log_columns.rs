//! The columns and the stretch of a log, as the commands that read one take them.

use std::path::Path;

use serde_json::{Value, json};
use vasos_engine::identify::{
    Disturbance, Drift, FitOptions, FitProblem, History, LoopRecord, ModeColumn, Structure, StudyOptions,
};
use vasos_engine::signal::{CompleteRows, LogTable, derived_column};
use vasos_io::log::ImportedLog;

use super::Refusal;
use super::logs::Reading;

/// Columns, stretch and treatment of a log.
#[derive(Debug, Clone, clap::Args)]
pub(super) struct LogArguments {
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
}

/// The columns in use, as named by the user or proposed.
pub(super) struct Chosen {
    pub time: Option<String>,
    pub pv: String,
    pub mv: String,
    pub sp: Option<String>,
    pub mode: Option<String>,
    pub disturbances: Vec<String>,
}

impl Chosen {
    pub(super) fn json(&self) -> Value {
        json!({
            "time": self.time, "pv": self.pv, "mv": self.mv, "sp": self.sp, "mode": self.mode,
            "disturbances": self.disturbances,
        })
    }
}

impl LogArguments {
    pub(super) fn study_options(&self) -> Result<StudyOptions, Refusal> {
        let structure = match self.structure.as_str() {
            "auto" => None,
            name => Some(Structure::from_key(name).ok_or_else(|| {
                let known: Vec<&str> = Structure::ALL.iter().map(|s| s.key()).collect();
                Refusal(format!("there is no structure '{name}': choose auto or one of {}", known.join(", ")))
            })?),
        };
        let mv_limits = match (self.mv_min, self.mv_max) {
            (None, None) => None,
            (low, high) => {
                let limits = [low.unwrap_or(f64::NEG_INFINITY), high.unwrap_or(f64::INFINITY)];
                if limits[0].is_nan() || limits[1].is_nan() || limits[0] >= limits[1] {
                    return Err(Refusal(format!(
                        "--mv-min {} must lie below --mv-max {}",
                        limits[0], limits[1]
                    )));
                }
                Some(limits)
            }
        };
        Ok(StudyOptions { structure, mv_limits, as_is: self.as_is })
    }
}

fn drift(name: &str) -> Result<Drift, Refusal> {
    match name {
        "none" => Ok(Drift::None),
        "linear" => Ok(Drift::Linear),
        "auto" => Ok(Drift::Auto),
        _ => Err(Refusal(format!("there is no drift '{name}': choose none, linear or auto"))),
    }
}

/// A log that was read, its columns chosen and its stretch cut out.
pub(super) struct LoadedLog {
    pub imported: ImportedLog,
    pub columns: Chosen,
    pub stretch: Stretch,
    options: FitOptions,
}

impl LoadedLog {
    /// Reads one log, or several as one.
    pub(super) fn read<P: AsRef<Path>>(paths: &[P], arguments: &LogArguments) -> Result<Self, Refusal> {
        let drift = drift(&arguments.drift)?;
        let imported = arguments.reading.open(paths)?;
        let columns = choose(arguments, &imported)?;
        let stretch = Stretch::of(arguments, &imported.table, &columns)?;
        let options = FitOptions {
            mv_before: arguments.mv_before,
            drift,
            pv_name: columns.pv.clone(),
            mv_name: columns.mv.clone(),
            first_row: stretch.first_row,
            ..FitOptions::default()
        };
        Ok(Self { imported, columns, stretch, options })
    }

    pub(super) fn record(&self) -> LoopRecord<'_> {
        let rows = &self.stretch.rows;
        let mut problem = FitProblem::new(&rows.time_s, &rows.columns[0], &rows.columns[1]);
        problem.options = self.options.clone();
        let others = self.columns.disturbances.iter().zip(&rows.columns[2..]);
        problem.disturbances =
            others.map(|(name, values)| Disturbance { name: name.clone(), values }).collect();
        problem.history = self.stretch.history();
        LoopRecord { problem, sp: self.stretch.sp.as_deref(), mode: self.stretch.mode() }
    }

    /// What happened to the rows.
    pub(super) fn warnings(&self) -> Vec<String> {
        let left_out = self.stretch.rows.left_out.len();
        if left_out == 0 { vec![] } else { vec![format!("{left_out} rows without a value were left out")] }
    }
}

fn choose(arguments: &LogArguments, log: &ImportedLog) -> Result<Chosen, Refusal> {
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
pub(super) struct Stretch {
    /// PV, MV and the disturbances.
    pub rows: CompleteRows,
    /// MV and disturbances ahead of them.
    ahead: CompleteRows,
    pub sp: Option<Vec<f64>>,
    mode: Option<Vec<f64>>,
    /// Words of the mode, where its column holds words.
    mode_words: Vec<String>,
    /// Line of the file the first row came from.
    first_row: usize,
}

impl Stretch {
    fn of(arguments: &LogArguments, table: &LogTable, chosen: &Chosen) -> Result<Self, Refusal> {
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
        let start_s = rows.time_s.first().copied().unwrap_or(from_s);
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
            ahead: table.ahead(&slices[1..], start_s),
            rows,
        })
    }

    fn history(&self) -> Option<History<'_>> {
        let (mv, disturbances) = self.ahead.columns.split_first()?;
        Some(History {
            time_s: self.ahead.time_s.as_slice().into(),
            mv: mv.as_slice().into(),
            disturbances: disturbances.iter().map(|values| values.as_slice().into()).collect(),
        })
    }

    fn mode(&self) -> Option<ModeColumn<'_>> {
        self.mode.as_deref().map(|values| ModeColumn { values, words: &self.mode_words })
    }
}
