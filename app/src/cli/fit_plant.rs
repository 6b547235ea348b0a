//! `vasos fit-plant`: parameters of a rig from a recording.

use std::path::{Path, PathBuf};

use serde_json::{Map, Value, json};
use vasos_engine::identify::grey_box::{
    FreeParameter, GreyBoxFit, GreyBoxProblem, GreyBoxRecord, GreyBoxVerdict, RecordFit, RecordedInput,
    RecordedOutput, fit_rig, input_named, output_named,
};
use vasos_engine::plant::Network;
use vasos_engine::signal::derived_column;
use vasos_io::rig::{load_rig, rig_text};
use vasos_io::rig_fitted::fitted_rig;

use super::json::{shown, table};
use super::logs::Reading;
use super::{Answer, Refusal};

/// Arguments of `vasos fit-plant`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  vasos fit-plant rig.toml train.csv --validate other.csv --input u=u_v --output h3=h3_cm -o fitted.toml --json
  vasos fit-plant stad log.csv --input BA01=u_v --output LT03=pv --fit FV03.k90=20..150 --fit BA01.delay_s=0..5
Parameters are named TAG.field. They are marked in the table [fit] of the rig file, or with --fit, which goes before:
  valve k90 · pump scale, offset_cm3_s, delay_s, point_1 … · tank area_cm2, height_cm, spill_share, leak_cm2_5_s ·
  sensor gain, offset_cm
A pump is named by its tag or signal (or 'pump' where there is one), a level by its tank's tag or signal or its sensor's
tag. COL is a column or an expression of columns. The rig is simulated in free run from initial levels that are estimated
along; those of --validate are estimated on its first rows alone.
Exit status 1: the rig does not follow the recording with any values within the bounds.
JSON: {parameters, interval_95, rmse_train, rmse_validate, initial_samples, standard_error, initial_levels, outputs:
[{output, rmse_train, fit_percent_train, rmse_validate, fit_percent_validate}], verdicts, rig, configuration, remarks}.")]
pub struct Arguments {
    /// Preset or rig file (TOML).
    rig: String,
    /// Recording to fit: text with separators, a workbook, Parquet or a recording.
    log: PathBuf,
    /// Another recording, to judge the fit by.
    #[arg(long, value_name = "LOG")]
    validate: Option<PathBuf>,
    /// Column of a pump's input; may be repeated.
    #[arg(long, value_name = "PUMP=COL")]
    input: Vec<String>,
    /// Column of a level; may be repeated.
    #[arg(long, value_name = "LEVEL=COL", required = true)]
    output: Vec<String>,
    /// Parameter to fit with its bounds; may be repeated.
    #[arg(long, value_name = "TAG.FIELD=LOW..HIGH", allow_hyphen_values = true)]
    fit: Vec<String>,
    /// Configuration of the rig; otherwise its first.
    #[arg(long, value_name = "ID")]
    configuration: Option<String>,
    #[command(flatten)]
    reading: Reading,
    /// Rig file to write with the fitted values in place; an existing file is replaced.
    #[arg(short = 'o', long = "fitted", value_name = "FILE")]
    fitted: Option<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<Answer, Refusal> {
    let network = load_rig(&arguments.rig).map_err(Refusal::of)?;
    let configuration = configuration(&network, arguments.configuration.as_deref())?;
    let mut problem = GreyBoxProblem {
        free: free(&network, configuration, &arguments.fit)?,
        train: record(arguments, &network, &arguments.log)?,
        validate: None,
        network,
        configuration,
    };
    if let Some(path) = &arguments.validate {
        problem.validate = Some(record(arguments, &problem.network, path)?);
    }
    let fit = fit_rig(&problem).map_err(Refusal::of)?;
    let remarks = match &arguments.fitted {
        Some(path) => write(arguments, &problem, &fit, path)?,
        None => vec![],
    };
    let text =
        if arguments.json { whole(&problem, &fit, &remarks).to_string() } else { words(&problem, &fit) };
    let hopeless = fit.verdicts.iter().any(GreyBoxVerdict::is_refusal);
    Ok(Answer { text, remarks, status: u8::from(hopeless) })
}

fn configuration(network: &Network, id: Option<&str>) -> Result<usize, Refusal> {
    let configurations = &network.spec.configurations;
    let Some(id) = id else { return Ok(0) };
    configurations.iter().position(|c| c.id.eq_ignore_ascii_case(id)).ok_or_else(|| {
        let known = configurations.iter().map(|c| c.id.as_str()).collect::<Vec<_>>().join(", ");
        Refusal(format!("the rig has no configuration '{id}'; there are {known}"))
    })
}

/// Marked parameters, those of the command line first.
fn free(network: &Network, configuration: usize, given: &[String]) -> Result<Vec<FreeParameter>, Refusal> {
    let mut free = Vec::new();
    for text in given {
        let parts = text.split_once('=').and_then(|(name, bounds)| {
            let (low, high) = bounds.split_once("..")?;
            Some((name, [low.trim().parse::<f64>().ok()?, high.trim().parse::<f64>().ok()?]))
        });
        let wrong =
            || Refusal(format!("--fit '{text}': write TAG.field=LOW..HIGH, for example FV01.k90=5..20"));
        let (name, bounds) = parts.ok_or_else(wrong)?;
        free.push(FreeParameter::new(network, configuration, name, bounds).map_err(Refusal::of)?);
    }
    let mut unmarked = network.spec.clone();
    for named in &free {
        unmarked.fit.iter_mut().for_each(|(tag, fields)| {
            fields.retain(|field, _| !format!("{tag}.{field}").eq_ignore_ascii_case(&named.name));
        });
    }
    let rest = Network { spec: unmarked, ..network.clone() };
    free.extend(FreeParameter::marked(&rest, configuration).map_err(Refusal::of)?);
    Ok(free)
}

/// The named columns of a log.
fn record(arguments: &Arguments, network: &Network, path: &Path) -> Result<GreyBoxRecord, Refusal> {
    let log = arguments.reading.open(&[path])?;
    let column = |text: &str, option: &str| -> Result<(String, Vec<f64>), Refusal> {
        let (name, column) =
            text.split_once('=').ok_or_else(|| Refusal(format!("--{option} '{text}': write NAME=COLUMN")))?;
        let values = derived_column(&log.table, column.trim())
            .map_err(|error| Refusal(format!("{}: {error}", path.display())))?;
        Ok((name.trim().to_owned(), values))
    };
    let mut record = GreyBoxRecord { time_s: log.table.time_s.clone(), inputs: vec![], outputs: vec![] };
    for text in &arguments.input {
        let (name, values) = column(text, "input")?;
        record.inputs.push(RecordedInput { pump: input_named(network, &name).map_err(Refusal::of)?, values });
    }
    for text in &arguments.output {
        let (name, values) = column(text, "output")?;
        let (tank, sensor) = output_named(network, &name).map_err(Refusal::of)?;
        record.outputs.push(RecordedOutput { tank, sensor, values });
    }
    Ok(record)
}

/// Writes the rig with the fitted values; gives what there is to say about it.
fn write(
    arguments: &Arguments,
    problem: &GreyBoxProblem,
    fit: &GreyBoxFit,
    path: &Path,
) -> Result<Vec<String>, Refusal> {
    let (name, text) = rig_text(&arguments.rig).map_err(Refusal::of)?;
    let values: Vec<f64> = fit.parameters.iter().map(|p| p.value).collect();
    let made = fitted_rig(&name, &text, &problem.spec_with(&values)).map_err(Refusal::of)?;
    std::fs::write(path, made.text)
        .map_err(|error| Refusal(format!("{} cannot be written: {error}", path.display())))?;
    let remark = |id: &String| {
        format!(
            "the fitted rig cannot hold the setpoints of '{id}': in the new file it does not start at rest"
        )
    };
    Ok(made.no_longer_steady.iter().map(remark).collect())
}

fn by_name<'a>(pairs: impl Iterator<Item = (&'a str, Value)>) -> Value {
    Value::Object(pairs.map(|(name, value)| (name.to_owned(), value)).collect::<Map<_, _>>())
}

fn levels(of: &RecordFit) -> Value {
    by_name(of.initial_levels.iter().map(|(tag, level)| (tag.as_str(), json!(level))))
}

fn whole(problem: &GreyBoxProblem, fit: &GreyBoxFit, remarks: &[String]) -> Value {
    let each = |value: fn(&vasos_engine::identify::grey_box::RigParameter) -> Value| {
        by_name(fit.parameters.iter().map(|p| (p.name.as_str(), value(p))))
    };
    let validate = fit.validate.as_ref();
    let output = |(i, o): (usize, &vasos_engine::identify::grey_box::OutputFit)| {
        let other = validate.and_then(|v| v.outputs.get(i));
        json!({
            "output": o.signal,
            "rmse_train": o.rmse,
            "fit_percent_train": o.fit_percent,
            "rmse_validate": other.map(|o| o.rmse),
            "fit_percent_validate": other.map(|o| o.fit_percent),
        })
    };
    let configuration = problem.network.spec.configurations.get(problem.configuration);
    json!({
        "parameters": each(|p| json!(p.value)),
        "interval_95": each(|p| json!(p.interval_95)),
        "rmse_train": fit.train.rmse,
        "rmse_validate": validate.map(|v| v.rmse),
        "initial_samples": fit.initial_samples,
        "standard_error": each(|p| json!(p.standard_error)),
        "initial_levels": { "train": levels(&fit.train), "validate": validate.map(levels) },
        "outputs": fit.train.outputs.iter().enumerate().map(output).collect::<Vec<_>>(),
        "verdicts": fit.verdicts.iter().map(ToString::to_string).collect::<Vec<_>>(),
        "rig": problem.network.spec.id,
        "configuration": configuration.map(|c| &c.id),
        "remarks": remarks,
    })
}

fn words(problem: &GreyBoxProblem, fit: &GreyBoxFit) -> String {
    let rows = problem.train.time_s.len();
    let mut text = format!("{} in free run over {rows} rows\n", problem.network.spec.id);
    let mut lines = vec![["parameter", "value", "from", "to", "in the file"].map(str::to_owned).to_vec()];
    for p in &fit.parameters {
        let [low, high] = p.interval_95.map(Some).map(shown);
        lines.push(vec![p.name.clone(), shown(Some(p.value)), low, high, shown(Some(p.start))]);
    }
    text.push_str(&table(&lines));
    text.push('\n');
    let mut lines =
        vec![["level", "RMSE", "fit (%)", "RMSE elsewhere", "fit (%)"].map(str::to_owned).to_vec()];
    for (i, o) in fit.train.outputs.iter().enumerate() {
        let other = fit.validate.as_ref().and_then(|v| v.outputs.get(i));
        lines.push(vec![
            o.signal.clone(),
            shown(Some(o.rmse)),
            shown(Some(o.fit_percent)),
            shown(other.map(|o| o.rmse)),
            shown(other.map(|o| o.fit_percent)),
        ]);
    }
    text.push_str(&table(&lines));
    fit.verdicts.iter().for_each(|v| text.push_str(&format!("note: {v}\n")));
    text
}
