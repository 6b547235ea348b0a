//! `vasos replay`: what is in a recording; played, exported, or opened in Rerun.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use serde_json::{Value, json};
use vasos_engine::control::LoopSpec;
use vasos_engine::session::{RecordedRun, Session, SessionCommand};
use vasos_io::export::{mode_columns, with_unit, write_recorded};
use vasos_io::recording::viewer::{self, Shown};
use vasos_io::recording::{Parts, Recorded, event_words, read_recorded};

use super::json::{self, shown, table};
use super::{Answer, Refusal};

/// Between two looks at the player.
const TICK: Duration = Duration::from_millis(20);

/// Arguments of `vasos replay`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  vasos replay run.rrd                     what is in it: rig, loops as set, length, models
  vasos replay run.rrd --events            what happened
  vasos replay run.rrd -o run.parquet      its columns, with units (or run.csv)
  vasos replay run.rrd --speed 10          its rows as CSV on standard output, ten times as fast as they came
  vasos replay run.rrd --open              in Rerun's viewer
A recording that goes on in several files (run.rrd, run-2.rrd, …) is read as one. What is missing in it or damaged is said on
standard error, and the exit status is 1 then. To see it on the rig: vasos run.rrd
JSON: {files, flaws, runs: [{run, name, rig, configuration, rows, from_s, to_s, columns: [{name, unit}], loops: [{loop, law, mode,
setpoint_cm, Kc, Ti_s, Td_s}], events: [{time_s, what}], models: [{time_s, model, pv_unit, mv_unit}]}]}.")]
pub struct Arguments {
    /// Recording (.rrd).
    recording: PathBuf,
    /// Which run of the recording, from 1; without it, the longest for -o and --speed, else all.
    #[arg(long, value_name = "N")]
    run: Option<usize>,
    /// List what happened.
    #[arg(long)]
    events: bool,
    /// Write its rows: .csv or .parquet. An existing file is replaced.
    #[arg(short, long, value_name = "FILE", conflicts_with = "speed")]
    output: Option<PathBuf>,
    /// Play it: rows as CSV on standard output, at so many times real time, 1 to 1000.
    #[arg(long, value_name = "X", conflicts_with = "json")]
    speed: Option<f64>,
    /// Open it in Rerun's viewer.
    #[arg(long, conflicts_with_all = ["speed", "output"])]
    open: bool,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<Answer, Refusal> {
    let recorded = read_recorded(&Parts::of(&arguments.recording)).map_err(Refusal::of)?;
    let flaws: Vec<String> = recorded.flaws.iter().map(ToString::to_string).collect();
    let mut answer = answer(arguments, &recorded, &flaws)?;
    // What is missing is an answer of its own.
    answer.status = answer.status.max(u8::from(!flaws.is_empty()));
    if flaws.is_empty() && answer.status == 0 && recorded.runs.iter().all(RecordedRun::is_empty) {
        answer.remarks.push("the recording has no rows: it ended before the first was written".to_owned());
        answer.status = 1;
    }
    answer.remarks.extend(flaws);
    Ok(answer)
}

fn answer(arguments: &Arguments, recorded: &Recorded, flaws: &[String]) -> Result<Answer, Refusal> {
    let Recorded { runs, files, .. } = recorded;
    if arguments.open {
        let program = viewer::find().map_err(Refusal::of)?;
        viewer::open_with(&program, &Shown::Files(files.clone())).map_err(Refusal::of)?;
        return Ok(Answer::done(format!("opened in {}", program.display())));
    }
    let one = match arguments.run {
        Some(number) => Some(number.checked_sub(1).filter(|i| *i < runs.len()).ok_or_else(|| {
            Refusal(format!("--run {number}: the recording has {} runs, counted from 1", runs.len()))
        })?),
        None => None,
    };
    let longest = (0..runs.len()).max_by_key(|&i| runs[i].len()).unwrap_or(0);
    if let Some(speed) = arguments.speed {
        return play(Arc::new(runs[one.unwrap_or(longest)].clone()), speed);
    }
    if let Some(path) = &arguments.output {
        let index = one.unwrap_or(longest);
        write_recorded(&runs[index], path).map_err(Refusal::of)?;
        let text = format!(
            "run {} of {}: {} rows of {} columns, written to {}",
            index + 1,
            runs.len(),
            runs[index].len(),
            runs[index].channels().len(),
            path.display()
        );
        if arguments.json {
            let shown =
                json!({ "run": index + 1, "rows": runs[index].len(), "output": path.display().to_string() });
            return Ok(Answer::done(json::text(&shown)));
        }
        let mut answer = Answer::done(text);
        if runs[index].is_empty() {
            answer
                .remarks
                .push("the run has no rows: the file holds nothing but the names of its columns".to_owned());
            answer.status = 1;
        }
        return Ok(answer);
    }
    let chosen: Vec<(usize, &RecordedRun)> =
        runs.iter().enumerate().filter(|(i, _)| one.is_none_or(|one| one == *i)).collect();
    if arguments.json {
        let files: Vec<String> = files.iter().map(|f| f.display().to_string()).collect();
        let runs: Vec<Value> = chosen.iter().map(|(i, run)| run_json(i + 1, run)).collect();
        return Ok(Answer::done(json::text(&json!({ "files": files, "flaws": flaws, "runs": runs }))));
    }
    let text: Vec<String> =
        chosen.iter().map(|(i, run)| run_text(i + 1, run, &arguments.recording, arguments.events)).collect();
    Ok(Answer::done(text.join("\n")))
}

/// Loops of the configuration in which the run begins.
fn loops(run: &RecordedRun) -> &[LoopSpec] {
    run.network.spec.configurations.get(run.configuration).map_or(&[], |c| &c.loops)
}

fn configuration(run: &RecordedRun) -> Option<&str> {
    run.network.spec.configurations.get(run.configuration).map(|c| c.id.as_str())
}

fn run_json(number: usize, run: &RecordedRun) -> Value {
    let [from_s, to_s] = run.span_s();
    let channels = &run.channels().channels;
    let columns: Vec<Value> =
        channels.iter().map(|c| json!({ "name": with_unit(c), "unit": c.unit })).collect();
    let finite = |value: f64| value.is_finite().then_some(value);
    let of_loop = |l: &LoopSpec| {
        let gains = l.tuning().gains;
        json!({
            "loop": l.id, "law": l.law.id(), "mode": mode(l), "setpoint_cm": l.setpoint_cm,
            "Kc": gains.kc, "Ti_s": finite(gains.ti_s), "Td_s": gains.td_s,
        })
    };
    let events: Vec<Value> = run
        .events
        .iter()
        .map(|event| json!({ "time_s": event.time_s, "what": event_words(&event.kind).1 }))
        .collect();
    let model = |m: &vasos_engine::session::RecordedModel| {
        json!({
            "time_s": m.time_s, "model": json::model(&m.model), "pv_unit": m.pv_unit, "mv_unit": m.mv_unit,
        })
    };
    json!({
        "run": number,
        "name": run.name,
        "rig": run.network.spec.id,
        "configuration": configuration(run),
        "rows": run.len(),
        "from_s": from_s,
        "to_s": to_s,
        "columns": columns,
        "loops": loops(run).iter().map(of_loop).collect::<Vec<_>>(),
        "events": events,
        "models": run.models.iter().map(model).collect::<Vec<_>>(),
    })
}

fn mode(l: &LoopSpec) -> &'static str {
    use vasos_engine::control::Mode;
    match l.mode {
        Mode::Manual => "manual",
        Mode::Automatic => "automatic",
        Mode::Cascade => "cascade",
    }
}

fn run_text(number: usize, run: &RecordedRun, path: &Path, with_events: bool) -> String {
    let [from_s, to_s] = run.span_s();
    let mut text = format!(
        "{}, run {number}: {} {}, {} to {} s, {} rows of {} columns, {} events, {} models\n",
        path.display(),
        run.network.spec.id,
        configuration(run).unwrap_or_default(),
        shown(Some(from_s)),
        shown(Some(to_s)),
        run.len(),
        run.channels().len(),
        run.events.len(),
        run.models.len(),
    );
    let rows: Vec<Vec<String>> = loops(run)
        .iter()
        .map(|l| {
            let gains = l.tuning().gains;
            vec![
                format!("  {}", l.id),
                l.law.id().to_owned(),
                mode(l).to_owned(),
                format!("SP {} cm", shown(Some(l.setpoint_cm))),
                format!("Kc {}", shown(Some(gains.kc))),
                format!("Ti {} s", shown(Some(gains.ti_s))),
                format!("Td {} s", shown(Some(gains.td_s))),
            ]
        })
        .collect();
    text.push_str(&table(&rows));
    for model in &run.models {
        text.push_str(&format!("  model at {} s: {}\n", shown(Some(model.time_s)), model.model));
    }
    if with_events {
        for event in &run.events {
            text.push_str(&format!(
                "  {:>10} s  {}\n",
                shown(Some(event.time_s)),
                event_words(&event.kind).1
            ));
        }
    }
    text
}

/// Rows on standard output as the player reaches them; a reader that closes its pipe ends it.
fn play(run: Arc<RecordedRun>, speed: f64) -> Result<Answer, Refusal> {
    if !(1.0..=1000.0).contains(&speed) {
        return Err(Refusal(format!("--speed {speed}: expected 1 to 1000")));
    }
    let done = || Ok(Answer::done(String::new()));
    let mut out = std::io::stdout().lock();
    let modes = mode_columns(&run);
    let mode_names = modes.iter().map(|(name, _)| name.clone());
    let names: Vec<String> = run.channels().channels.iter().map(with_unit).chain(mode_names).collect();
    if writeln!(out, "time_s,{}", names.join(",")).is_err() {
        return done();
    }
    let session = Session::replay(run.clone(), Box::new(|| {}));
    let send = |command| session.send(command);
    if !(send(SessionCommand::Speed(speed)) && send(SessionCommand::Run)) {
        return Err(Refusal("the player does not answer".to_owned()));
    }
    let mut next = 0;
    while next < run.len() {
        std::thread::sleep(TICK);
        let now = session.snapshot();
        while next < run.len() && run.rows.time_s[next] <= now.time_s {
            let cell = |v: &f64| if v.is_nan() { String::new() } else { v.to_string() };
            let mode_cells = modes.iter().map(|(_, words)| words[next].to_owned());
            let cells: Vec<String> = run.rows.row(next).iter().map(cell).chain(mode_cells).collect();
            let time_s = (run.rows.time_s[next] * 1e9).round() / 1e9;
            if writeln!(out, "{time_s},{}", cells.join(",")).and_then(|()| out.flush()).is_err() {
                return done();
            }
            next += 1;
        }
    }
    done()
}
