//! `vasos simulate`: a scenario from start to end, to a file.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde_json::{Map, Value, json};
use vasos_engine::analyze::{Excitation, Metrics};
use vasos_engine::excitation::{Ending, ExcitationReport};
use vasos_engine::plant::Network;
use vasos_engine::session::{Event, EventKind, RunStart};
use vasos_engine::signal::SampleBlock;
use vasos_engine::sim::{LoopFigures, Run, Scenario, run_scenario, scenario_loop};
use vasos_io::export::write_run;
use vasos_io::recording::{Recording, RecordingOptions};
use vasos_io::rig::load_scenario;

use super::json::{self, shown, table};
use super::{Answer, Refusal, ensemble, excite};

/// Rows handed to the recorder at once.
const BLOCK: usize = 5000;

/// Arguments of `vasos simulate`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  vasos simulate assets/scenarios/setpoint_coupled.toml -o run.csv
  vasos simulate run.toml -o run.rrd     (a recording, for Rerun's viewer)
  vasos simulate run.toml --runs 1000 --spread 2
Without -o the values at the end are printed. The format of scenarios is in assets/SCHEMA.md.
--figures: of each loop from its last setpoint step to the end; without a step, or where the setpoint is another
loop's output, of the whole run as after a load. They are taken from the rows that are kept (keep_every).")]
pub struct Arguments {
    /// Scenario file (TOML).
    scenario: PathBuf,
    /// File to write: .csv, .parquet or .rrd. An existing file is replaced.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Add IE, IAE, ISE, ITAE, overshoot, decay ratio, rise and settling time, steady error, total variation of
    /// every loop.
    #[arg(long)]
    figures: bool,
    /// Run that many rigs at once, which differ from the file by --spread, each with noise of its own.
    #[arg(long, value_name = "N", conflicts_with_all = ["figures", "output"])]
    runs: Option<usize>,
    /// With --runs: standard deviation of every valve's k, tank's area and pump's flow, in percent.
    #[arg(long, value_name = "PERCENT", default_value_t = 0.0, requires = "runs")]
    spread: f64,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<Answer, Refusal> {
    let kind = arguments.output.as_deref().map(extension).transpose()?;
    let (scenario, network) = load_scenario(&arguments.scenario).map_err(Refusal::of)?;
    if let Some(count) = arguments.runs {
        return ensemble::run(&network, &scenario, count, arguments.spread / 100.0, arguments.json);
    }
    let run = run_scenario(network.clone(), &scenario).map_err(Refusal::of)?;
    if let (Some(path), Some(kind)) = (&arguments.output, kind) {
        match kind {
            Kind::Table => write_run(&run, path).map_err(Refusal::of)?,
            Kind::Recording => write_recording(&run, &scenario, &network, path)?,
        }
    }
    let last = run.values.chunks(run.channels.len()).last().unwrap_or_default();
    let channels = &run.channels.channels;
    if arguments.json {
        let end: Map<_, _> = channels.iter().zip(last).map(|(c, v)| (c.name.clone(), json!(v))).collect();
        let mut whole = json!({
            "rig": scenario.rig,
            "rows": run.time_s.len(),
            "end_time_s": run.time_s.last(),
            "end": end,
            "output": arguments.output.as_ref().map(|p| p.display().to_string()),
        });
        if arguments.figures {
            whole["figures"] = run.figures().iter().map(figures_json).collect();
        }
        if !run.excitations.is_empty() {
            whole["tests"] = run.excitations.iter().map(test_json).collect();
        }
        return Ok(Answer::done(json::text(&whole)));
    }
    let mut figures = if arguments.figures { figures_table(&run) } else { String::new() };
    run.excitations.iter().for_each(|report| figures.push_str(&format!("{}\n", excite::headline(report))));
    let mut text = format!("{} rows to {} s", run.time_s.len(), shown(run.time_s.last().copied()));
    if let Some(path) = &arguments.output {
        text.push_str(&format!(", written to {}\n{figures}", path.display()));
        return Ok(Answer::done(text));
    }
    let rows: Vec<Vec<String>> =
        channels.iter().zip(last).map(|(c, v)| vec![c.name.clone(), shown(Some(*v))]).collect();
    Ok(Answer::done(format!("{text}; at its end:\n{}{figures}", table(&rows))))
}

/// Figures by their names in JSON; None for what does not exist.
fn named(m: &Metrics) -> [(&'static str, Option<f64>); 14] {
    [
        ("ie", Some(m.ie)),
        ("iae", Some(m.iae)),
        ("ise", Some(m.ise)),
        ("itae", Some(m.itae)),
        ("peak_error", Some(m.peak_error)),
        ("final_value", Some(m.final_value)),
        ("steady_error", Some(m.steady_error)),
        ("overshoot_percent", m.overshoot_percent),
        ("decay_ratio", m.decay_ratio),
        ("rise_time_s", m.rise_time_s),
        ("settling_time_s", m.settling_time_s),
        ("total_variation", Some(m.total_variation)),
        ("max_u", Some(m.max_u)),
        ("min_u", Some(m.min_u)),
    ]
}

/// Number of a loop as its columns have it, from 1.
fn loop_number(figures: &LoopFigures) -> usize {
    figures.slot + 1
}

fn figures_json(figures: &LoopFigures) -> Value {
    let mut whole = Map::new();
    whole.insert("loop".into(), json!(loop_number(figures)));
    whole.insert("from_s".into(), json!(figures.from_s));
    whole.insert("excitation".into(), json!(excitation(figures)));
    let values = figures.metrics.as_ref().ok().map(named);
    for (name, value) in values.into_iter().flatten() {
        whole.insert(name.into(), json!(value));
    }
    whole.insert("reason".into(), json!(figures.metrics.as_ref().err().map(ToString::to_string)));
    Value::Object(whole)
}

/// How a test of the scenario ended.
fn test_json(report: &ExcitationReport) -> Value {
    let ended = match &report.ending {
        Ending::Finished => Value::Null,
        Ending::Stopped(reason) => json!(reason.to_string()),
    };
    json!({
        "loop": report.tag,
        "signal": report.excitation.signal.key(),
        "from_s": report.start_s,
        "finished": report.ending == Ending::Finished,
        "ended": ended,
    })
}

fn excitation(figures: &LoopFigures) -> &'static str {
    match figures.excitation {
        Excitation::Setpoint => "setpoint",
        Excitation::Load => "load",
    }
}

fn figures_table(run: &Run) -> String {
    let mut text = String::new();
    for figures in run.figures() {
        let from = shown(Some(figures.from_s));
        text.push_str(&format!("loop {}, {} from {from} s:\n", loop_number(&figures), excitation(&figures)));
        match &figures.metrics {
            Ok(metrics) => {
                let rows = named(metrics).map(|(name, value)| vec![format!("  {name}"), shown(value)]);
                text.push_str(&table(&rows));
            }
            Err(reason) => text.push_str(&format!("  {reason}\n")),
        }
    }
    text
}

#[derive(Clone, Copy)]
enum Kind {
    Table,
    Recording,
}

fn extension(path: &Path) -> Result<Kind, Refusal> {
    match path.extension().map(|e| e.to_string_lossy().to_lowercase()).as_deref() {
        Some("csv" | "parquet") => Ok(Kind::Table),
        Some("rrd") => Ok(Kind::Recording),
        _ => Err(Refusal(format!("{}: the name must end in .csv, .parquet or .rrd", path.display()))),
    }
}

fn write_recording(
    run: &Run,
    scenario: &Scenario,
    network: &Arc<Network>,
    path: &Path,
) -> Result<(), Refusal> {
    let options = RecordingOptions { serve: false, ..RecordingOptions::default() };
    let (recording, mut sink) = Recording::start(path, options).map_err(Refusal::of)?;
    sink.started(&RunStart::of(&scenario_loop(network, scenario).map_err(Refusal::of)?, 0));
    let carried_out = scenario.events.iter().filter(|event| event.at_s <= scenario.duration_s);
    for event in carried_out {
        sink.event(&Event { run: 0, time_s: event.at_s, kind: EventKind::Done(event.command.clone()) });
    }
    for report in &run.excitations {
        let time_s = report.start_s + report.record.time_s.last().copied().unwrap_or(0.0);
        sink.event(&Event { run: 0, time_s, kind: EventKind::ExcitationEnded(Arc::new(report.clone())) });
    }
    let width = run.channels.len();
    for (time_s, values) in run.time_s.chunks(BLOCK).zip(run.values.chunks(BLOCK * width)) {
        let channels = run.channels.clone();
        sink.samples(&SampleBlock { run: 0, channels, time_s: time_s.to_vec(), values: values.to_vec() });
    }
    drop(sink);
    let lost = recording.lost();
    recording.close().map_err(Refusal::of)?;
    if lost > 0 {
        return Err(Refusal(format!("{}: {lost} rows could not be written", path.display())));
    }
    Ok(())
}
