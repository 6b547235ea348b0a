//! `vasos identify`: a process model from a log.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use vasos_engine::explain::number;
use vasos_engine::identify::{FitError, FitOptions, FitProblem, FopdtFit, fit_fopdt};
use vasos_engine::signal::{LogTable, derived_column};
use vasos_io::log::{ImportOptions, ImportedLog, Repair, import_log};

use super::json::{self, shown, table};
use super::{Answer, Refusal};

/// Arguments of `vasos identify`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  vasos identify step.csv --json
  vasos identify step.csv --pv h2_cm --mv u_v --from 100 --to 900
  vasos identify step.csv --pv T1 --mv '0.5*(u1+u2)' --mv-before 0
Columns that are not named are proposed from their names and behaviour. COL is a name or an expression of names.
Exit status 1: the log can be read, but no model can be told from it.")]
pub struct Arguments {
    /// Log file: CSV, TSV or the like.
    log: PathBuf,
    /// Process variable.
    #[arg(long, value_name = "COL")]
    pv: Option<String>,
    /// Manipulated variable.
    #[arg(long, value_name = "COL")]
    mv: Option<String>,
    /// Setpoint; only named in the answer.
    #[arg(long, value_name = "COL")]
    sp: Option<String>,
    /// Time column, where the proposal is wrong.
    #[arg(long, value_name = "COL")]
    time: Option<String>,
    /// Sample time in seconds, for a log without a time column.
    #[arg(long, value_name = "S")]
    sample_time: Option<f64>,
    /// Start of the stretch, in seconds since the first row.
    #[arg(long, value_name = "S", allow_hyphen_values = true)]
    from: Option<f64>,
    /// End of the stretch, in seconds since the first row.
    #[arg(long, value_name = "S", allow_hyphen_values = true)]
    to: Option<f64>,
    /// MV before the first row, for a log that starts at the step.
    #[arg(long, value_name = "V", allow_hyphen_values = true)]
    mv_before: Option<f64>,
    /// auto or fopdt; auto tries fopdt only for now, others are not available yet.
    #[arg(long, default_value = "auto")]
    structure: String,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

const STRUCTURES: [&str; 3] = ["ipdt", "sopdt", "rational"];

/// The columns in use, as named by the user or proposed.
struct Chosen {
    time: Option<String>,
    pv: String,
    mv: String,
    sp: Option<String>,
}

pub(super) fn run(arguments: &Arguments) -> Result<Answer, Refusal> {
    let mut warnings = Vec::new();
    match arguments.structure.as_str() {
        "auto" => warnings.push("auto: only fopdt is available yet, no other structure was tried".to_owned()),
        "fopdt" => {}
        name if STRUCTURES.contains(&name) => {
            return Err(Refusal::later(&format!("the structure {name}")));
        }
        name => return Err(Refusal(format!("there is no structure '{name}': choose auto or fopdt"))),
    }
    let log = import(arguments)?;
    let chosen = choose(arguments, &log)?;
    let column = |name: &str| derived_column(&log.table, name).map_err(Refusal::of);
    let (pv, mv) = (column(&chosen.pv)?, column(&chosen.mv)?);
    if let Some(sp) = &chosen.sp {
        column(sp)?;
    }
    let (from_s, to_s) = (arguments.from.unwrap_or(0.0), arguments.to.unwrap_or(f64::INFINITY));
    let rows = log.table.complete(&[&pv, &mv], from_s, to_s);
    if !rows.left_out.is_empty() {
        warnings.push(format!("{} rows without a value were left out", rows.left_out.len()));
    }
    let options = FitOptions {
        mv_before: arguments.mv_before,
        pv_name: chosen.pv.clone(),
        mv_name: chosen.mv.clone(),
        ..FitOptions::default()
    };
    let problem = FitProblem { options, ..FitProblem::new(&rows.time_s, &rows.columns[0], &rows.columns[1]) };
    match fit_fopdt(&problem) {
        Ok(fit) => Ok(answer(arguments.json, &chosen, &fit, &log.report.repairs, warnings)),
        Err(error @ FitError::NothingToFit { .. }) => {
            Ok(none(arguments.json, &chosen, &log, warnings, &error))
        }
        Err(error) => Err(Refusal::of(error)),
    }
}

fn import(arguments: &Arguments) -> Result<ImportedLog, Refusal> {
    let path: &Path = &arguments.log;
    let bytes = std::fs::read(path)
        .map_err(|error| Refusal(format!("{} cannot be read: {error}", path.display())))?;
    let name = path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let options = ImportOptions { sample_time_s: arguments.sample_time, time_column: arguments.time.clone() };
    import_log(&name, &bytes, &options).map_err(|error| Refusal(format!("{}: {error}", path.display())))
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
    })
}

fn names(table: &LogTable) -> String {
    table.columns.iter().map(|c| c.name.as_str()).collect::<Vec<_>>().join(", ")
}

fn columns(chosen: &Chosen) -> Value {
    json!({"time": chosen.time, "pv": chosen.pv, "mv": chosen.mv, "sp": chosen.sp})
}

fn answer(
    as_json: bool,
    chosen: &Chosen,
    fit: &FopdtFit,
    repairs: &[Repair],
    mut warnings: Vec<String>,
) -> Answer {
    warnings.extend(fit.verdicts.iter().skip(1).map(ToString::to_string));
    let repairs: Vec<String> = repairs.iter().map(ToString::to_string).collect();
    let (m, i) = (&fit.model, &fit.interval_95);
    if as_json {
        let model = json!({
            "structure": "fopdt",
            "K": m.gain,
            "T_s": m.time_constant_s,
            "L_s": m.dead_time_s,
            "bias": fit.bias,
            "interval_95": {"K": i.gain, "T_s": i.time_constant_s, "L_s": i.dead_time_s},
            "fit_percent": fit.fit_percent,
            "mse": fit.mse,
            "aic": fit.aic,
            "verdict": fit.verdict().to_string(),
        });
        let whole = json!({
            "columns": columns(chosen),
            "models": [model],
            "chosen": "fopdt",
            "repairs": repairs,
            "warnings": warnings,
        });
        return Answer::done(json::text(&whole));
    }
    let row = |name: &str, value: f64, interval: [f64; 2]| {
        let between = format!("{} to {}", number(interval[0]), number(interval[1]));
        vec![name.to_owned(), shown(Some(value)), between]
    };
    let rows = vec![
        vec!["fopdt".to_owned(), String::new(), "95 % interval".to_owned()],
        row("K", m.gain, i.gain),
        row("T (s)", m.time_constant_s, i.time_constant_s),
        row("L (s)", m.dead_time_s, i.dead_time_s),
        vec!["bias".to_owned(), shown(Some(fit.bias))],
        vec!["fit (%)".to_owned(), shown(Some(fit.fit_percent))],
    ];
    let mut text = format!("PV {}, MV {}, {} rows\n", chosen.pv, chosen.mv, fit.rows);
    text.push_str(&table(&rows));
    text.push_str(&format!("{}\n", fit.verdict()));
    for line in warnings.iter().chain(&repairs) {
        text.push_str(&format!("note: {line}\n"));
    }
    Answer::done(text)
}

fn none(
    as_json: bool,
    chosen: &Chosen,
    log: &ImportedLog,
    warnings: Vec<String>,
    error: &FitError,
) -> Answer {
    let repairs: Vec<String> = log.report.repairs.iter().map(ToString::to_string).collect();
    let whole = json!({
        "columns": columns(chosen),
        "models": [],
        "chosen": Value::Null,
        "repairs": repairs,
        "warnings": warnings,
    });
    let text = if as_json { json::text(&whole) } else { String::new() };
    Answer { text, remarks: vec![error.to_string()], status: 1 }
}
