//! `vasos retune`: from a loop's log to a tuning, with a report; of one log, or of all in a folder.

mod answer;
mod figures;
mod folder;
mod one;
mod output;
mod report;

use std::path::PathBuf;

use vasos_engine::retune::RetuneOptions;
use vasos_engine::tune::ControllerKind;
use vasos_engine::tune::optimum::LoopLimits;

use super::log_columns::LogArguments;
use super::{Answer, Refusal, parse, tune};
use crate::i18n::Language;

/// Arguments of `vasos retune`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  vasos retune loop.csv -o report.html
  vasos retune loop.csv --present Kc=1.2,Ti=90 --ms 1.4 --json
  vasos retune loop.csv --pv h2_cm --mv u_v --sp sp --from 100 --to 900 --controller pid
  vasos retune loop.csv --ms 1.6 --ju 20 --pv-span 100 --mv-span 100
  vasos retune logs/ --jobs 4 -o reports/
  vasos retune loop.csv --language pt-BR -o report.html
Identifies the process, tunes for it and compares: the best tuning under the limits, two published rules, and the
present tuning as --present gives it or the log shows it, each on 200 models that fit the log as well.
A folder gives a table of all its logs (text, workbooks, Parquet, recordings), those that gain most first; with -o a report for each
in that folder, or the table alone where -o ends in .html.
Exit status 1: don't retune, or the log cannot tell a tuning; the answer says why. Of a folder: no log
of it tells anything.")]
pub struct Arguments {
    /// Log file, or a folder of them.
    log: PathBuf,
    #[command(flatten)]
    columns: LogArguments,
    /// Present tuning, ideal form: Kc=..[,Ti=..][,Td=..][,N=..]; without it as the log shows it.
    #[arg(long, value_name = "GAINS", allow_hyphen_values = true)]
    present: Option<String>,
    /// pi or pid.
    #[arg(long, default_value = "pi")]
    controller: String,
    /// Largest Ms = max |1/(1 + L)|, greater than 1; 1.4 where no limit is given.
    #[arg(long, value_name = "X", allow_hyphen_values = true)]
    ms: Option<f64>,
    /// Largest Mt = max |L/(1 + L)|, 1 or more.
    #[arg(long, value_name = "X", allow_hyphen_values = true)]
    mt: Option<f64>,
    /// Largest Ju = max |C/(1 + L)|, in MV units per PV unit.
    #[arg(long, value_name = "X", allow_hyphen_values = true)]
    ju: Option<f64>,
    /// Span of MV in its unit, for proportional bands.
    #[arg(long, value_name = "X", requires = "pv_span")]
    mv_span: Option<f64>,
    /// Span of PV in its unit, for proportional bands.
    #[arg(long, value_name = "X", requires = "mv_span")]
    pv_span: Option<f64>,
    /// Logs of a folder that are worked on at a time.
    #[arg(long, value_name = "N", default_value_t = 1)]
    jobs: usize,
    /// Report to write, HTML; for a folder the folder of the reports, or an HTML file for the table.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Language of the report: en or pt-BR.
    #[arg(long, value_name = "TAG", default_value = "en", value_parser = language)]
    language: Language,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

fn language(tag: &str) -> Result<Language, String> {
    let known = || Language::ALL.map(Language::tag).join(", ");
    Language::ALL
        .into_iter()
        .find(|l| l.tag().eq_ignore_ascii_case(tag))
        .ok_or_else(|| format!("there is no language '{tag}': choose one of {}", known()))
}

/// What is asked of every log, checked.
struct Task<'a> {
    columns: &'a LogArguments,
    options: RetuneOptions,
    /// Of the reports.
    language: Language,
    /// Spans of MV and PV.
    spans: Option<(f64, f64)>,
}

pub(super) fn run(arguments: &Arguments) -> Result<Answer, Refusal> {
    let task = task(arguments)?;
    if arguments.log.is_dir() {
        return folder::run(arguments, &task);
    }
    one::run(arguments, &task)
}

fn task(arguments: &Arguments) -> Result<Task<'_>, Refusal> {
    let controller = match tune::controller(&arguments.controller)? {
        kind @ (ControllerKind::Pi | ControllerKind::Pid) => kind,
        kind => {
            return Err(Refusal(format!(
                "an optimal {kind} controller would have no integral action: choose --controller pi or pid"
            )));
        }
    };
    let none = arguments.ms.or(arguments.mt).or(arguments.ju).is_none();
    let limits = LoopLimits {
        ms: arguments.ms.unwrap_or(if none { LoopLimits::DEFAULT.ms } else { f64::INFINITY }),
        mt: arguments.mt.unwrap_or(f64::INFINITY),
        ju: arguments.ju.unwrap_or(f64::INFINITY),
    };
    // Said before the first log is read, and for a log without a model as well.
    for (name, value, usable) in [
        ("ms", arguments.ms, limits.ms > 1.0),
        ("mt", arguments.mt, limits.mt >= 1.0),
        ("ju", arguments.ju, limits.ju > 0.0),
    ] {
        if let (Some(value), false) = (value, usable) {
            return Err(Refusal(format!(
                "--{name} {value} is not usable: Ms must be greater than 1, Mt 1 or more, Ju greater than 0"
            )));
        }
    }
    let present = arguments.present.as_deref().map(parse::gains).transpose().map_err(Refusal::of)?;
    let spans = arguments.mv_span.zip(arguments.pv_span);
    if let Some(span) = spans.iter().flat_map(|(mv, pv)| [mv, pv]).find(|s| !s.is_finite() || **s <= 0.0) {
        return Err(Refusal(format!("a span of {span} is not possible: it must be greater than 0")));
    }
    if arguments.jobs == 0 {
        return Err(Refusal("--jobs 0 would never end: give 1 or more".to_owned()));
    }
    let options = RetuneOptions { controller, limits, present, ..RetuneOptions::default() };
    Ok(Task { columns: &arguments.columns, language: arguments.language, options, spans })
}
