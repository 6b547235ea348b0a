//! All logs of a folder, side by side.

use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use serde_json::{Value, json};
use vasos_engine::retune::{Advice, CandidateRule};
use vasos_io::report::{Block, Cell, Report, Table, Tone};

use super::one::Outcome;
use super::{Arguments, Task, answer, output, report};
use crate::cli::json::{self, shown, table};
use crate::cli::{Answer, Refusal};
use crate::i18n::{self, Language};
use crate::tr;

/// Endings that logs have.
const ENDINGS: [&str; 10] = ["csv", "tsv", "txt", "dat", "log", "xlsx", "xls", "ods", "parquet", "rrd"];

/// What came of a log, the most to gain first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Verdict {
    /// The present tuning is not stable.
    Unstable,
    /// There is something to gain, or a present tuning that is not known.
    Retune,
    /// The present tuning is as good.
    Keep,
    /// Valve or upstream first.
    DontRetune,
    /// The log tells no tuning.
    NoTuning,
    /// The file cannot be read.
    Unreadable,
}

impl Verdict {
    fn id(self) -> &'static str {
        match self {
            Self::Unstable => "unstable_now",
            Self::Retune => "retune",
            Self::Keep => "keep",
            Self::DontRetune => "dont_retune",
            Self::NoTuning => "no_tuning",
            Self::Unreadable => "unreadable",
        }
    }
}

/// A line of the table.
struct Line {
    name: String,
    verdict: Verdict,
    gain_percent: Option<f64>,
    /// Tuning to use, in words.
    tuning: Option<String>,
    reason: String,
    /// The same in the language of the reports.
    said: String,
    sticks: bool,
    swings: bool,
    /// Whole answer; absent for a file that cannot be read.
    whole: Option<Value>,
    /// Report of this log, where reports were asked for.
    html: Option<String>,
}

pub(super) fn run(arguments: &Arguments, task: &Task) -> Result<Answer, Refusal> {
    let files = files(&arguments.log)?;
    let reports = arguments.output.as_deref().filter(|o| !output::is_html(o));
    if let Some(folder) = reports {
        std::fs::create_dir_all(folder)
            .map_err(|error| Refusal(format!("{} cannot be made: {error}", folder.display())))?;
    }
    let mut lines = work(&files, arguments.jobs, |path| line(path, task, reports.is_some()));
    // Names are in order already, and the sort keeps it.
    lines.sort_by(|a, b| a.verdict.cmp(&b.verdict).then(gain_of(b).total_cmp(&gain_of(a))));
    write(arguments, &files, &lines)?;
    let text = if arguments.json {
        let folder = arguments.log.file_name().map(|n| n.to_string_lossy().into_owned());
        json::text(&json!({"folder": folder, "loops": lines.iter().map(as_json).collect::<Vec<_>>()}))
    } else {
        as_text(&lines)
    };
    // One log that told something makes the table an answer.
    let told = |line: &Line| !matches!(line.verdict, Verdict::NoTuning | Verdict::Unreadable);
    let status = u8::from(!lines.iter().any(told));
    Ok(Answer { text, remarks: vec![], status })
}

fn gain_of(line: &Line) -> f64 {
    line.gain_percent.unwrap_or(f64::NEG_INFINITY)
}

fn files(folder: &Path) -> Result<Vec<PathBuf>, Refusal> {
    let unreadable = |error: std::io::Error| Refusal(format!("{} cannot be read: {error}", folder.display()));
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(unreadable)? {
        let path = entry.map_err(unreadable)?.path();
        let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        if path.is_file() && ending.is_some_and(|e| ENDINGS.contains(&e.as_str())) {
            files.push(path);
        }
    }
    files.sort();
    if files.is_empty() {
        return Err(Refusal(format!(
            "{} holds no log: files that end in {} are looked at",
            folder.display(),
            ENDINGS.join(", ")
        )));
    }
    Ok(files)
}

/// Every file through `of` on `jobs` threads; the answers in the files' order, whoever finished first.
fn work(files: &[PathBuf], jobs: usize, of: impl Fn(&Path) -> Line + Sync) -> Vec<Line> {
    let next = AtomicUsize::new(0);
    let done: Mutex<Vec<(usize, Line)>> = Mutex::new(Vec::with_capacity(files.len()));
    std::thread::scope(|scope| {
        for _ in 0..jobs.min(files.len()) {
            scope.spawn(|| {
                loop {
                    let place = next.fetch_add(1, Ordering::Relaxed);
                    let Some(path) = files.get(place) else { return };
                    let line = of(path);
                    done.lock().unwrap_or_else(std::sync::PoisonError::into_inner).push((place, line));
                }
            });
        }
    });
    let mut done = done.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    done.sort_by_key(|(place, _)| *place);
    done.into_iter().map(|(_, line)| line).collect()
}

fn line(path: &Path, task: &Task, with_report: bool) -> Line {
    let name = path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    match Outcome::of(path, task) {
        Ok(outcome) => {
            let retuning = &outcome.retuning;
            let verdict = match retuning.advice.first() {
                Some(Advice::PresentUnstable) => Verdict::Unstable,
                Some(Advice::ValveSticks { .. } | Advice::FromOutside { .. }) => Verdict::DontRetune,
                _ => match retuning.choice().map(|c| c.rule) {
                    Some(CandidateRule::Present) => Verdict::Keep,
                    Some(_) => Verdict::Retune,
                    None => Verdict::NoTuning,
                },
            };
            let oscillation = outcome.study.oscillation;
            Line {
                name,
                verdict,
                gain_percent: retuning.gain().map(|g| g.1),
                tuning: retuning.choice().map(answer::title),
                reason: outcome.reason(),
                said: report::in_its_language(task, || outcome.reason()),
                sticks: oscillation.is_some_and(|o| o.sticks()),
                swings: oscillation.is_some_and(|o| o.regularity > 1.0),
                whole: Some(answer::value(&outcome, task)),
                html: with_report.then(|| report::of(&outcome, task).html()),
            }
        }
        Err(Refusal(reason)) => Line {
            // The folder is named already, and must not tell answers apart.
            reason: reason.replace(&path.display().to_string(), &name),
            said: reason.replace(&path.display().to_string(), &name),
            name,
            verdict: Verdict::Unreadable,
            gain_percent: None,
            tuning: None,
            sticks: false,
            swings: false,
            whole: None,
            html: None,
        },
    }
}

fn as_json(line: &Line) -> Value {
    json!({
        "file": line.name, "verdict": line.verdict.id(), "gain_percent": line.gain_percent,
        "sticks": line.sticks, "oscillates": line.swings, "reason": line.reason, "answer": line.whole,
    })
}

fn as_text(lines: &[Line]) -> String {
    let mut rows =
        vec![["log", "verdict", "gain (%)", "tuning", "sticks", "swings"].map(str::to_owned).to_vec()];
    let mark = |yes: bool| if yes { "yes".to_owned() } else { "–".to_owned() };
    rows.extend(lines.iter().map(|l| {
        vec![
            l.name.clone(),
            l.verdict.id().to_owned(),
            shown(l.gain_percent),
            l.tuning.clone().unwrap_or_else(|| "–".to_owned()),
            mark(l.sticks),
            mark(l.swings),
        ]
    }));
    let mut text = table(&rows);
    text.push('\n');
    for line in lines {
        text.push_str(&format!("{}: {}\n", line.name, line.reason));
    }
    text
}

fn write(arguments: &Arguments, files: &[PathBuf], lines: &[Line]) -> Result<(), Refusal> {
    let Some(path) = &arguments.output else { return Ok(()) };
    let safe = |path: &Path| files.iter().try_for_each(|log| output::check(path, log));
    if output::is_html(path) {
        safe(path)?;
        return output::write(path, &overview(arguments, lines, false).html());
    }
    for line in lines {
        if let Some(html) = &line.html {
            let to = path.join(report_name(&line.name));
            safe(&to)?;
            output::write(&to, html)?;
        }
    }
    let index = path.join("index.html");
    safe(&index)?;
    output::write(&index, &overview(arguments, lines, true).html())
}

fn report_name(log: &str) -> String {
    format!("{log}.html")
}

fn overview(arguments: &Arguments, lines: &[Line], with_links: bool) -> Report {
    i18n::set(arguments.language);
    let report = in_language(arguments, lines, with_links);
    i18n::set(Language::English);
    report
}

fn in_language(arguments: &Arguments, lines: &[Line], with_links: bool) -> Report {
    let rows = lines.iter().map(|l| {
        let name = if with_links && l.html.is_some() {
            Cell::link(&l.name, report_name(&l.name))
        } else {
            Cell::words(&l.name)
        };
        vec![
            name,
            Cell::words(tr!(&format!("retuning.verdict_{}", l.verdict.id()))),
            Cell::number(shown(l.gain_percent)),
            Cell::words(l.said.clone()),
        ]
    });
    let head =
        vec![tr!("retuning.log"), tr!("retuning.verdict"), tr!("retuning.gain"), tr!("retuning.reason")];
    let sticking = lines.iter().filter(|l| l.sticks).count();
    let swinging = lines.iter().filter(|l| l.swings && !l.sticks).count();
    let mut blocks = Vec::new();
    if sticking + swinging > 0 {
        blocks
            .push(Block::Note(Tone::Warning, tr!("retuning.swings", sticking = sticking, others = swinging)));
    }
    blocks.push(Block::Table(Table { head, rows: rows.collect(), marked: None }));
    blocks.push(Block::Paragraph(tr!("retuning.gain_note")));
    let folder = arguments.log.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let provenance = [
        (tr!("retuning.folder"), folder.clone()),
        (tr!("retuning.logs"), lines.len().to_string()),
        (tr!("retuning.program"), format!("Vasos {}", env!("CARGO_PKG_VERSION"))),
    ];
    Report {
        language: arguments.language.tag(),
        title: tr!("retuning.title", name = folder),
        provenance: provenance.to_vec(),
        blocks,
    }
}
