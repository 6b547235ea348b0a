//! `vasos experiment`: a prepared experiment from start to end, and whether it came out as expected.

use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use serde_json::{Value, json};
use vasos_engine::experiment::{
    CheckOutcome, Expectation, Experiment, ExperimentEnd, ExperimentRun, RunResult, run_experiment,
};
use vasos_io::experiment::{EXPERIMENTS, experiment, explained, load_experiment, write_experiment_csv};

use super::json::{self, shown, table};
use super::{Answer, Refusal};

const LANGUAGE: &str = "en";

/// Arguments of `vasos experiment`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  vasos experiment --list
  vasos experiment stad_figure_7 -o figure_7.csv
  vasos experiment ./my_own.toml --json
Exit status: 0 every expectation is met, 1 one is not (it is marked, with the numbers), 2 the file is bad.
The format is in assets/SCHEMA.md. CSV: a column run, then the axes and columns of all runs.
JSON: {id, title, reached, checks: [{title, run, found, expected, tolerance, at_least, at_most, less_than, more_than,
printed, pass}], runs: [{id, title, rows, axis, columns}], output}; with --list {experiments: [{id, title, source}]}.")]
pub struct Arguments {
    /// Id of an experiment, or a file (TOML).
    #[arg(required_unless_present = "list", conflicts_with = "list")]
    name: Option<String>,
    /// List the experiments there are.
    #[arg(long)]
    list: bool,
    /// File for the columns of all runs: .csv; an existing file is replaced.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<Answer, Refusal> {
    let Some(name) = &arguments.name else { return listed(arguments.json) };
    if let Some(path) = &arguments.output
        && path.extension().is_none_or(|e| !e.eq_ignore_ascii_case("csv"))
    {
        return Err(Refusal(format!("{}: the name must end in .csv", path.display())));
    }
    let experiment = load_experiment(name).map_err(Refusal::of)?;
    let end = run_experiment(&experiment, &AtomicBool::new(false), &mut |_| {});
    let run = match end.map_err(|error| Refusal::of(explained(name, error)))? {
        ExperimentEnd::Finished(run) => run,
        // Nobody raises the flag here.
        ExperimentEnd::Cancelled => return Err(Refusal("the experiment was cancelled".to_owned())),
    };
    if let Some(path) = &arguments.output {
        write_experiment_csv(&run, path).map_err(Refusal::of)?;
    }
    let text = if arguments.json {
        let output = arguments.output.as_ref().map(|p| p.display().to_string());
        json::text(&whole(&experiment, &run, output))
    } else {
        words(&experiment, &run, arguments)
    };
    Ok(Answer { text, remarks: vec![], status: u8::from(!run.reached()) })
}

fn listed(as_json: bool) -> Result<Answer, Refusal> {
    let all =
        EXPERIMENTS.iter().map(|e| experiment(e.id)).collect::<Result<Vec<_>, _>>().map_err(Refusal::of)?;
    let said = |e: &Experiment| [&e.spec.title, &e.spec.source].map(|t| t.get(LANGUAGE).to_owned());
    if as_json {
        let item = |e: &Experiment| {
            let [title, source] = said(e);
            json!({"id": e.spec.id, "title": title, "source": source})
        };
        let items: Vec<Value> = all.iter().map(item).collect();
        return Ok(Answer::done(json::text(&json!({ "experiments": items }))));
    }
    let width = all.iter().map(|e| e.spec.id.chars().count()).max().unwrap_or(0);
    let line = |e: &Experiment| {
        let [title, source] = said(e);
        format!("{:width$}  {title} ({source})\n", e.spec.id)
    };
    Ok(Answer::done(all.iter().map(line).collect()))
}

/// Expectation in words.
fn expected(expectation: &Expectation) -> String {
    let some = |v: f64| shown(Some(v));
    match *expectation {
        Expectation::Value { expected, tolerance } => format!("{} ± {}", exact(expected), exact(tolerance)),
        Expectation::Range { low, high } if low == f64::NEG_INFINITY => format!("≤ {}", some(high)),
        Expectation::Range { low, high } if high == f64::INFINITY => format!("≥ {}", some(low)),
        Expectation::Range { low, high } => format!("{} to {}", some(low), some(high)),
        Expectation::Less { than } => format!("< {}", shown(than)),
        Expectation::More { than } => format!("> {}", shown(than)),
    }
}

/// A number with as many digits as it takes, at most nine.
fn exact(value: f64) -> String {
    let digits = 8usize.saturating_sub(value.abs().max(1.0).log10() as usize);
    let text = format!("{value:.digits$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    if text == "0" && value != 0.0 || text.len() > 12 { format!("{value:e}") } else { text.to_owned() }
}

fn words(experiment: &Experiment, run: &ExperimentRun, arguments: &Arguments) -> String {
    let spec = &experiment.spec;
    let [title, source, shows, reading] =
        [&spec.title, &spec.source, &spec.shows, &spec.reading].map(|text| text.get(LANGUAGE));
    let mut text = format!("{title} ({source})\n{shows}\n{reading}\n\n");
    let head = ["check", "found", "expected", "printed", ""].map(str::to_owned).to_vec();
    let row = |check: &CheckOutcome| {
        let mark = if check.passes() { "ok" } else { "NO" };
        vec![
            check.title.get(LANGUAGE).to_owned(),
            check.found.filter(|v| v.is_finite()).map_or_else(|| "–".to_owned(), exact),
            expected(&check.expectation),
            check.printed.map_or_else(String::new, exact),
            mark.to_owned(),
        ]
    };
    let rows: Vec<_> = std::iter::once(head).chain(run.checks.iter().map(row)).collect();
    text.push_str(&table(&rows));
    let met = run.checks.iter().filter(|c| c.passes()).count();
    let verdict = if run.reached() { "reached" } else { "not reached" };
    text.push_str(&format!("\n{verdict}: {met} of {} checks, {} runs", run.checks.len(), run.runs.len()));
    if let Some(path) = &arguments.output {
        text.push_str(&format!(", written to {}", path.display()));
    }
    text
}

fn whole(experiment: &Experiment, run: &ExperimentRun, output: Option<String>) -> Value {
    let result = |r: &RunResult| {
        let columns: Vec<Value> = r.columns.iter().map(|c| json!({"name": c.name, "unit": c.unit})).collect();
        json!({
            "id": r.id,
            "title": r.label.get(LANGUAGE),
            "rows": r.x.len(),
            "axis": {"name": r.x_name, "unit": r.x_unit},
            "columns": columns,
        })
    };
    json!({
        "id": experiment.spec.id,
        "title": experiment.spec.title.get(LANGUAGE),
        "reached": run.reached(),
        "checks": run.checks.iter().map(check).collect::<Vec<_>>(),
        "runs": run.runs.iter().map(result).collect::<Vec<_>>(),
        "output": output,
    })
}

fn check(check: &CheckOutcome) -> Value {
    let mut whole = json!({
        "title": check.title.get(LANGUAGE),
        "run": check.run,
        "found": check.found,
        "expected": null,
        "tolerance": null,
        "at_least": null,
        "at_most": null,
        "less_than": null,
        "more_than": null,
        "printed": check.printed,
        "pass": check.passes(),
    });
    match check.expectation {
        Expectation::Value { expected, tolerance } => {
            whole["expected"] = json!(expected);
            whole["tolerance"] = json!(tolerance);
        }
        Expectation::Range { low, high } => {
            whole["at_least"] = json!(low);
            whole["at_most"] = json!(high);
        }
        Expectation::Less { than } => whole["less_than"] = json!(than),
        Expectation::More { than } => whole["more_than"] = json!(than),
    }
    whole
}
