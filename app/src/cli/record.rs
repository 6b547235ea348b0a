//! `vasos record`: a rig in real time, recorded while it runs.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use serde_json::json;
use vasos_engine::explain::number;
use vasos_engine::plant::{Measurement, Network};
use vasos_engine::session::{EventKind, Session, SessionCommand};
use vasos_engine::sim::{ClosedLoop, ScenarioEvent, scenario_loop};
use vasos_io::recording::{Recording, RecordingOptions, event_words};
use vasos_io::rig::{load_rig, load_scenario, rig_text};

use super::json;
use super::{Answer, Refusal};

/// Between two looks at the run.
const TICK: Duration = Duration::from_millis(20);
/// Bytes of a megabyte.
const MEGABYTE: u64 = 1_000_000;

/// Arguments of `vasos record`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  vasos record stad -o run.rrd                        until Ctrl-C
  vasos record stad -o run.rrd --duration 3600 --speed 100
  vasos record run.toml -o run.rrd --part-mb 100      a scenario, with its start and its commands
A viewer joins while it runs: rerun --connect ADDRESS, with the address that is printed at the start. What goes wrong is
said on standard error at once; the run goes on. A recording that grows over --part-mb goes on in run-2.rrd, run-3.rrd, …
JSON: {files, bytes, rows, lost, lost_events, unwritten, end_time_s}; lost, lost_events: rows and events that the recorder
could not take, unwritten: batches that the disk did not take. Each of them makes the exit status 1, and so does a recording
without a row.")]
pub struct Arguments {
    /// Preset, rig file or scenario file (TOML).
    #[arg(default_value = "stad")]
    rig: String,
    /// Recording to write; an existing file is replaced.
    #[arg(short, long, value_name = "FILE.rrd")]
    output: PathBuf,
    /// Length in seconds of the run; without it, a scenario's own, or until Ctrl-C.
    #[arg(long, value_name = "S")]
    duration: Option<f64>,
    /// Times real time, 1 to 1000.
    #[arg(long, value_name = "X", default_value_t = 1.0)]
    speed: f64,
    /// Configuration of the rig; without it, its first.
    #[arg(long, value_name = "ID")]
    configuration: Option<String>,
    /// Port of this computer on which viewers join; without it, 9876 or any free one.
    #[arg(long, value_name = "PORT", conflicts_with = "no_viewer")]
    port: Option<u16>,
    /// Let no viewer join.
    #[arg(long)]
    no_viewer: bool,
    /// Size in megabytes at which the recording goes on in another file; 0: never.
    #[arg(long, value_name = "MB", default_value_t = 32.0)]
    part_mb: f64,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// What is to be run.
struct Task {
    closed: ClosedLoop,
    events: Vec<ScenarioEvent>,
    duration_s: Option<f64>,
}

pub(super) fn run(arguments: &Arguments) -> Result<Answer, Refusal> {
    let within = |name: &str, value: f64, range: std::ops::RangeInclusive<f64>| {
        if range.contains(&value) {
            return Ok(());
        }
        Err(Refusal(format!("--{name} {value}: expected {} to {}", range.start(), range.end())))
    };
    within("speed", arguments.speed, 1.0..=1000.0)?;
    within("part-mb", arguments.part_mb, 0.0..=1e6)?;
    if let Some(duration_s) = arguments.duration {
        within("duration", duration_s, 0.0..=1e9)?;
    }
    let is_recording = |p: &Path| p.extension().is_some_and(|e| e.eq_ignore_ascii_case("rrd"));
    if !is_recording(&arguments.output) {
        return Err(Refusal(format!("{}: the name must end in .rrd", arguments.output.display())));
    }
    let task = task(arguments)?;
    let stop = Arc::new(AtomicBool::new(false));
    let asked = stop.clone();
    // A second call within one process, as tests make it, keeps the first handler.
    drop(ctrlc::set_handler(move || asked.store(true, Ordering::Relaxed)));
    record(arguments, task, &stop)
}

fn task(arguments: &Arguments) -> Result<Task, Refusal> {
    let (_, text) = rig_text(&arguments.rig).map_err(Refusal::of)?;
    let is_scenario = text.lines().any(|line| line.trim_start().starts_with("duration_s"));
    if is_scenario {
        if arguments.configuration.is_some() {
            return Err(Refusal("--configuration: a scenario names its own".to_owned()));
        }
        let (scenario, network) = load_scenario(Path::new(&arguments.rig)).map_err(Refusal::of)?;
        let closed = scenario_loop(&network, &scenario).map_err(Refusal::of)?;
        let duration_s = arguments.duration.or(Some(scenario.duration_s));
        return Ok(Task { closed, events: scenario.events, duration_s });
    }
    let network = load_rig(&arguments.rig).map_err(Refusal::of)?;
    let configuration = configuration(&network, arguments.configuration.as_deref())?;
    let closed =
        ClosedLoop::simulated(network, configuration, Measurement::DEFAULT, 1).map_err(Refusal::of)?;
    Ok(Task { closed, events: vec![], duration_s: arguments.duration })
}

fn configuration(network: &Network, id: Option<&str>) -> Result<usize, Refusal> {
    let Some(id) = id else { return Ok(0) };
    let known = &network.spec.configurations;
    known.iter().position(|c| c.id == id).ok_or_else(|| {
        let ids: Vec<&str> = known.iter().map(|c| c.id.as_str()).collect();
        Refusal(format!("--configuration {id}: the rig has {}", ids.join(", ")))
    })
}

fn record(arguments: &Arguments, task: Task, stop: &AtomicBool) -> Result<Answer, Refusal> {
    let part_bytes = (arguments.part_mb > 0.0).then_some((arguments.part_mb * MEGABYTE as f64) as u64);
    let options = RecordingOptions { serve: !arguments.no_viewer, port: arguments.port, part_bytes };
    let (mut recording, sink) = Recording::start(&arguments.output, options).map_err(Refusal::of)?;
    let Task { closed, events, duration_s } = task;
    let session = Session::of(closed, Box::new(|| {}));
    if let Some(address) = recording.address() {
        eprintln!(
            "vasos: recording to {}; a viewer joins with: rerun --connect {address}",
            arguments.output.display()
        );
    }
    let send = |command| {
        if session.send(command) { Ok(()) } else { Err(Refusal("the run does not answer".to_owned())) }
    };
    send(SessionCommand::Attach { id: recording.id(), sink })?;
    send(SessionCommand::Speed(arguments.speed))?;
    send(SessionCommand::Plan { events, end_s: duration_s })?;
    send(SessionCommand::Run)?;
    let (mut refusals, mut begun) = (0, false);
    loop {
        std::thread::sleep(TICK);
        session.samples().for_each(drop);
        for event in session.events() {
            if matches!(event.kind, EventKind::Refused(_) | EventKind::Stopped { .. }) {
                refusals += 1;
                eprintln!("vasos: at {} s, {}", number(event.time_s), event_words(&event.kind).1);
            }
        }
        for trouble in recording.troubles() {
            eprintln!("vasos: {trouble}");
        }
        let now = session.snapshot();
        begun |= now.running;
        // At its end the run stands still by itself.
        if begun && !now.running || stop.load(Ordering::Relaxed) {
            break;
        }
    }
    send(SessionCommand::Pause)?;
    send(SessionCommand::Detach { id: recording.id() })?;
    let limit = Instant::now() + Duration::from_secs(2);
    while session.snapshot().running && Instant::now() < limit {
        std::thread::sleep(TICK);
    }
    // Sample times are multiples of the sample time: nine decimals hide the rounding.
    let end_time_s = (session.snapshot().time_s * 1e9).round() / 1e9;
    drop(session);
    let tally = recording.tally();
    for trouble in recording.troubles() {
        eprintln!("vasos: {trouble}");
    }
    let closed = recording.close();
    // The last rows may have begun another file, or found the disk full.
    let (rows, lost, unwritten, files) = (tally.rows(), tally.lost(), tally.unwritten(), tally.parts());
    let lost_events = tally.lost_events();
    let bytes: u64 = files.iter().map(|f| std::fs::metadata(f).map_or(0, |m| m.len())).sum();
    let names: Vec<String> = files.iter().map(|f| f.display().to_string()).collect();
    let text = if arguments.json {
        json::text(&json!({
            "files": names, "bytes": bytes, "rows": rows, "lost": lost, "lost_events": lost_events,
            "unwritten": unwritten, "end_time_s": end_time_s,
        }))
    } else {
        format!("{rows} rows to {end_time_s} s in {bytes} bytes: {}", names.join(", "))
    };
    let mut remarks: Vec<String> = closed.err().map(|trouble| trouble.to_string()).into_iter().collect();
    if rows == 0 {
        remarks.push("nothing was recorded: the run ended before its first sample".to_owned());
    }
    let missing = lost > 0 || lost_events > 0 || unwritten > 0;
    let status = u8::from(missing || !remarks.is_empty() || refusals > 0);
    Ok(Answer { text, remarks, status })
}
