//! `vasos compare`: models side by side on the input of a scenario or of a recording.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde_json::{Value, json};
use vasos_engine::plant::{Network, OperatingPoint, unrest_cm_s};
use vasos_engine::session::RigCommand;
use vasos_engine::signal::{ChannelKind, ChannelSet, derived_column};
use vasos_engine::sim::{
    Comparison, InputSeries, ModelKind, ModelTrace, Scenario, run_scenario, scenario_start,
};
use vasos_io::rig::load_scenario;

use super::json::{self, shown, table};
use super::logs::Reading;
use super::{Answer, Refusal, point};

/// Arguments of `vasos compare`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  vasos compare assets/scenarios/step_coupled.toml
  vasos compare run.toml --recording run.csv --column h2_cm --json
  vasos compare run.toml --at LIC-02=15 -o overlay.csv
Without --recording the scenario's own run is the recording, with its noise and converters. The rig, its configuration and
the start come from the scenario; pumps' inputs from the columns named as simulate names them, or with --input.
Valves that a scenario turns are followed by the non-linear model alone; with --recording all keep those of the start.
JSON: {rig, output, operating_level_cm, recording, rows, models: [{model, mse_cm2, fit_percent, reason}], remarks}.")]
pub struct Arguments {
    /// Scenario file (TOML).
    scenario: PathBuf,
    /// Recording to compare with: CSV, TSV or the like.
    #[arg(long, value_name = "LOG")]
    recording: Option<PathBuf>,
    /// Column of the recording that holds the output in cm.
    #[arg(long, value_name = "COL", requires = "recording")]
    column: Option<String>,
    /// Column of a pump's input, where it is not named as simulate names it; may be repeated.
    #[arg(long, value_name = "PUMP=COL", requires = "recording")]
    input: Vec<String>,
    /// Tank that is the output, by its tag, a sensor's or a loop's; otherwise that of the first loop.
    #[arg(long, value_name = "TAG")]
    pv: Option<String>,
    /// Operating point of the linear models, as for `vasos model`; otherwise the start of the run.
    #[arg(long, value_name = "TAG=NUMBER")]
    at: Vec<String>,
    /// File for the overlaid levels: .csv; an existing file is replaced.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// Input and output of the run that the models are held against.
struct Record {
    time_s: Vec<f64>,
    inputs: Vec<Vec<f64>>,
    angles_deg: Vec<Vec<f64>>,
    level_cm: Vec<f64>,
    left_out: usize,
}

pub(super) fn run(arguments: &Arguments) -> Result<Answer, Refusal> {
    let (scenario, network) = load_scenario(&arguments.scenario).map_err(Refusal::of)?;
    let (start, configuration) = scenario_start(network.clone(), &scenario).map_err(Refusal::of)?;
    let first = network.spec.configurations.get(configuration).and_then(|c| c.loops.first());
    let tag = arguments.pv.clone().or_else(|| first.map(|l| l.id.clone()));
    let tag = tag.or_else(|| network.spec.sensors.first().map(|s| s.id.clone()));
    let tag = tag.ok_or_else(|| Refusal("the rig has no sensor: name a tank with --pv".to_owned()))?;
    let tank = point::tank(&network, configuration, &tag)?;
    let record = match &arguments.recording {
        Some(path) => recorded(arguments, path, &network, tank)?,
        None => simulated(&network, &scenario, configuration, tank)?,
    };
    let mut remarks = remarks(&scenario);
    if record.left_out > 0 {
        remarks.push(format!("{} rows without a value were left out", record.left_out));
    }
    let at = if arguments.at.is_empty() {
        start.clone()
    } else {
        point::at_rest(&network, configuration, &start, &arguments.at)?
    };
    let at_rest =
        vasos_engine::plant::SteadyState { levels_cm: at.levels_cm.clone(), inputs: at.inputs.clone() };
    let unrest = unrest_cm_s(&network, &at.coefficients(&network), &at_rest);
    if unrest > 1e-6 {
        let rate = shown(Some(unrest));
        remarks.push(format!("the operating point is not at rest ({rate} cm/s): linear models are about a rest; name one with --at"));
    }
    let series = InputSeries {
        time_s: record.time_s.clone(),
        inputs: record.inputs,
        angles_deg: record.angles_deg,
        start,
    };
    let comparison = Comparison::new(network.clone(), &at, tank, series).map_err(Refusal::of)?;
    let models: Vec<(ModelKind, Result<ModelTrace, String>)> = ModelKind::ALL
        .into_iter()
        .map(|kind| (kind, comparison.trace(kind, &record.level_cm).map_err(|e| e.to_string())))
        .collect();
    if let Some(path) = &arguments.output {
        write_overlay(path, &record.time_s, &record.level_cm, &models)?;
    }
    let name = arguments.recording.as_ref().map(|p| p.display().to_string());
    let rows = record.time_s.len();
    Ok(if arguments.json {
        Answer::done(json::text(&whole(&network, &at, tank, name, rows, &models, &remarks)))
    } else {
        Answer::done(words(&network, tank, name, rows, &models, &remarks))
    })
}

/// What of the scenario the models leave out.
fn remarks(scenario: &Scenario) -> Vec<String> {
    let count =
        |wanted: fn(&RigCommand) -> bool| scenario.events.iter().filter(|e| wanted(&e.command)).count();
    let valves = count(|c| matches!(c, RigCommand::Valve { .. } | RigCommand::Configuration { .. }));
    let water = count(|c| {
        matches!(c, RigCommand::Bump { .. } | RigCommand::SteadyAt { .. } | RigCommand::Configuration { .. })
    });
    let mut out = Vec::new();
    if valves > 0 {
        out.push(format!(
            "the scenario turns valves ({valves} events): linear models keep those of the start"
        ));
    }
    if water > 0 {
        out.push(format!("the scenario moves water or delays ({water} events): no model follows that"));
    }
    out
}

fn simulated(
    network: &Arc<Network>,
    scenario: &Scenario,
    configuration: usize,
    tank: usize,
) -> Result<Record, Refusal> {
    let every = Scenario { keep_every: 1, ..scenario.clone() };
    let run = run_scenario(network.clone(), &every).map_err(Refusal::of)?;
    let column = |kind: ChannelKind| -> Vec<f64> {
        let width = run.channels.len();
        let index = run.channels.column(kind);
        index.map_or_else(Vec::new, |i| run.values.iter().skip(i).step_by(width).copied().collect())
    };
    let loops = network.spec.configurations.get(configuration).map_or(&[][..], |c| &c.loops);
    let measured = loops
        .iter()
        .position(|l| network.sensor(&l.sensor).is_some_and(|sensor| network.sensors[sensor].tank == tank));
    let level_cm = column(measured.map_or(ChannelKind::Level(tank), ChannelKind::Pv));
    let inputs = (0..network.pumps.len()).map(|i| column(ChannelKind::Input(i))).collect();
    let angles_deg = (0..network.valves.len()).map(|i| column(ChannelKind::Angle(i))).collect();
    Ok(Record { time_s: run.time_s.clone(), inputs, angles_deg, level_cm, left_out: 0 })
}

fn recorded(arguments: &Arguments, path: &Path, network: &Network, tank: usize) -> Result<Record, Refusal> {
    let log = Reading::default().open(&[path])?;
    let channels = ChannelSet::of(network);
    let usual = |kind| channels.column(kind).map_or_else(String::new, |i| channels.channels[i].name.clone());
    let mut columns = Vec::new();
    for (pump, spec) in network.spec.pumps.iter().enumerate() {
        let named =
            arguments.input.iter().find_map(|text| text.split_once('=').filter(|(tag, _)| *tag == spec.id));
        let name = named.map_or_else(|| usual(ChannelKind::Input(pump)), |(_, name)| name.to_owned());
        columns.push(derived_column(&log.table, &name).map_err(Refusal::of)?);
    }
    if let Some(text) = arguments
        .input
        .iter()
        .find(|text| text.split_once('=').is_none_or(|(tag, _)| network.pump(tag).is_none()))
    {
        return Err(Refusal(format!("'{text}': write PUMP=COLUMN with the tag of one of the rig's pumps")));
    }
    let output = arguments.column.clone().unwrap_or_else(|| usual(ChannelKind::Level(tank)));
    columns.push(derived_column(&log.table, &output).map_err(Refusal::of)?);
    let slices: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
    let mut rows = log.table.complete(&slices, 0.0, f64::INFINITY);
    let level_cm = rows.columns.pop().unwrap_or_default();
    let left_out = rows.left_out.len();
    Ok(Record { time_s: rows.time_s, inputs: rows.columns, angles_deg: vec![], level_cm, left_out })
}

fn write_overlay(
    path: &Path,
    time_s: &[f64],
    recording: &[f64],
    models: &[(ModelKind, Result<ModelTrace, String>)],
) -> Result<(), Refusal> {
    if path.extension().is_none_or(|e| !e.eq_ignore_ascii_case("csv")) {
        return Err(Refusal(format!("{}: the name must end in .csv", path.display())));
    }
    let traces: Vec<&ModelTrace> = models.iter().filter_map(|(_, t)| t.as_ref().ok()).collect();
    let mut text = String::from("time_s,recording_cm");
    traces.iter().for_each(|t| text.push_str(&format!(",{}_cm", t.kind.id())));
    text.push('\n');
    for (row, time) in time_s.iter().enumerate() {
        text.push_str(&format!("{},{}", (time * 1e9).round() / 1e9, recording[row]));
        traces.iter().for_each(|t| text.push_str(&format!(",{}", t.level_cm[row])));
        text.push('\n');
    }
    std::fs::write(path, text).map_err(|e| Refusal(format!("{} cannot be written: {e}", path.display())))
}

fn whole(
    network: &Network,
    at: &OperatingPoint,
    tank: usize,
    recording: Option<String>,
    rows: usize,
    models: &[(ModelKind, Result<ModelTrace, String>)],
    remarks: &[String],
) -> Value {
    let model = |(kind, trace): &(ModelKind, Result<ModelTrace, String>)| {
        let (trace, reason) = (trace.as_ref().ok(), trace.as_ref().err());
        json!({
            "model": kind.id(),
            "mse_cm2": trace.map(|t| t.mse_cm2),
            "fit_percent": trace.and_then(|t| t.fit_percent),
            "reason": reason,
        })
    };
    json!({
        "rig": network.spec.id,
        "output": network.spec.tanks[tank].id,
        "operating_level_cm": at.levels_cm[tank],
        "recording": recording,
        "rows": rows,
        "models": models.iter().map(model).collect::<Vec<_>>(),
        "remarks": remarks,
    })
}

fn words(
    network: &Network,
    tank: usize,
    recording: Option<String>,
    rows: usize,
    models: &[(ModelKind, Result<ModelTrace, String>)],
    remarks: &[String],
) -> String {
    let against = recording.unwrap_or_else(|| "the scenario's own run".to_owned());
    let mut text = format!("{} against {against}, {rows} rows\n", network.spec.tanks[tank].id);
    let mut lines = vec![["model", "MSE (cm²)", "fit (%)"].map(str::to_owned).to_vec()];
    for (kind, trace) in models {
        let name = kind.id().replace('_', " ");
        match trace {
            Ok(t) => lines.push(vec![name, shown(Some(t.mse_cm2)), shown(t.fit_percent)]),
            Err(_) => lines.push(vec![name, shown(None), shown(None)]),
        }
    }
    text.push_str(&table(&lines));
    let reasons = models.iter().filter_map(|(kind, t)| Some((kind, t.as_ref().err()?)));
    for (kind, reason) in reasons {
        text.push_str(&format!("note: {}: {reason}\n", kind.id().replace('_', " ")));
    }
    remarks.iter().for_each(|remark| text.push_str(&format!("note: {remark}\n")));
    text
}
