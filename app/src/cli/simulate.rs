//! `vasos simulate`: a scenario from start to end, to a file.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde_json::{Map, json};
use vasos_engine::plant::Network;
use vasos_engine::session::{Event, EventKind};
use vasos_engine::signal::SampleBlock;
use vasos_engine::sim::{Run, Scenario, run_scenario};
use vasos_io::recording::{Recording, RecordingOptions};
use vasos_io::rig::{load_scenario, write_run_csv};

use super::json::{self, shown, table};
use super::{Answer, Refusal};

/// Rows handed to the recorder at once.
const BLOCK: usize = 5000;

/// Arguments of `vasos simulate`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  vasos simulate assets/scenarios/setpoint_coupled.toml -o run.csv
  vasos simulate run.toml -o run.rrd     (a recording, for Rerun's viewer)
Without -o the values at the end are printed. The format of scenarios is in assets/SCHEMA.md.")]
pub struct Arguments {
    /// Scenario file (TOML).
    scenario: PathBuf,
    /// File to write: .csv or .rrd; .parquet is not available yet. An existing file is replaced.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<Answer, Refusal> {
    let kind = arguments.output.as_deref().map(extension).transpose()?;
    let (scenario, network) = load_scenario(&arguments.scenario).map_err(Refusal::of)?;
    let run = run_scenario(network.clone(), &scenario).map_err(Refusal::of)?;
    if let (Some(path), Some(kind)) = (&arguments.output, kind) {
        match kind {
            Kind::Csv => write_run_csv(&run, path).map_err(Refusal::of)?,
            Kind::Recording => write_recording(&run, &scenario, &network, path)?,
        }
    }
    let last = run.values.chunks(run.channels.len()).last().unwrap_or_default();
    let channels = &run.channels.channels;
    if arguments.json {
        let end: Map<_, _> = channels.iter().zip(last).map(|(c, v)| (c.name.clone(), json!(v))).collect();
        let whole = json!({
            "rig": scenario.rig,
            "rows": run.time_s.len(),
            "end_time_s": run.time_s.last(),
            "end": end,
            "output": arguments.output.as_ref().map(|p| p.display().to_string()),
        });
        return Ok(Answer::done(json::text(&whole)));
    }
    let mut text = format!("{} rows to {} s", run.time_s.len(), shown(run.time_s.last().copied()));
    if let Some(path) = &arguments.output {
        text.push_str(&format!(", written to {}", path.display()));
        return Ok(Answer::done(text));
    }
    let rows: Vec<Vec<String>> =
        channels.iter().zip(last).map(|(c, v)| vec![c.name.clone(), shown(Some(*v))]).collect();
    Ok(Answer::done(format!("{text}; at its end:\n{}", table(&rows))))
}

#[derive(Clone, Copy)]
enum Kind {
    Csv,
    Recording,
}

fn extension(path: &Path) -> Result<Kind, Refusal> {
    match path.extension().map(|e| e.to_string_lossy().to_lowercase()).as_deref() {
        Some("csv") => Ok(Kind::Csv),
        Some("rrd") => Ok(Kind::Recording),
        Some("parquet") => Err(Refusal::later("writing .parquet")),
        _ => Err(Refusal(format!("{}: the name must end in .csv or .rrd", path.display()))),
    }
}

fn write_recording(
    run: &Run,
    scenario: &Scenario,
    network: &Arc<Network>,
    path: &Path,
) -> Result<(), Refusal> {
    let options = RecordingOptions { serve: false, port: None };
    let (recording, mut sink) = Recording::start(path, options).map_err(Refusal::of)?;
    sink.started(0, network, &run.channels);
    for event in &scenario.events {
        sink.event(&Event { run: 0, time_s: event.at_s, kind: EventKind::Done(event.command.clone()) });
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
