//! The command line: the engine without a window. Nothing here needs a display.
//!
//! Exit status: 0 done, 1 the answer is no, 2 bad input with the reason on standard error. `--json` prints what the
//! text says as JSON, non-finite and absent numbers as `null`; its keys are an interface.

mod analyze;
mod compare;
mod controller;
mod ensemble;
mod excite;
mod experiment;
mod fit_plant;
mod identify;
mod json;
mod log_columns;
mod logs;
mod model;
mod optimal;
pub mod parse;
mod parse_gains;
mod point;
mod record;
mod replay;
mod retune;
mod simulate;
mod tune;

use std::ffi::OsString;
use std::io::Write;
use std::path::PathBuf;

use clap::{Parser, Subcommand};

const AFTER: &str = "\
Models:  K=4.9,T=152,L=2   Kv=0.03,L=2   K=1,T1=9,T2=3,L=1,Tz=-2   num=1 2,den=1 3 3 1,L=0
Exit status: 0 done, 1 the answer is no, 2 bad input (the reason is on standard error).

Examples:
  vasos                                      open the workbench
  vasos step.csv                             open it with a log
  vasos simulate run.toml -o run.csv
  vasos model stad --at LIC-02=19
  vasos excite stad --loop LIC-02 --relay 0.3
  vasos compare run.toml --recording run.csv --column h2_cm
  vasos log export.xlsx
  vasos identify step.csv --pv h2 --mv u --json
  vasos fit-plant stad log.csv --input u=u_v --output h3=h3_cm --fit FV03.k90=20..150
  vasos tune --model K=4.9,T=152,L=2 --rule amigo --controller pi
  vasos tune --model K=4.9,T=152,L=2 --optimal --ms 1.4 --controller pi
  vasos analyze --model K=4.9,T=152,L=2 --gains Kc=1.8,Ti=152
  vasos controller convert --gains Kc=2,Ti=60,Td=10 --from ideal --to series
  vasos retune loop.csv -o report.html
  vasos record stad -o run.rrd --duration 600 --speed 10
  vasos replay run.rrd -o run.parquet
  vasos experiment stad_figure_7";

/// Process control workbench: simulate, identify, tune, analyse.
#[derive(Debug, Parser)]
#[command(name = "vasos", version, args_conflicts_with_subcommands = true, after_help = AFTER)]
pub struct Cli {
    /// Project or log to open in the workbench; a file named like a command is written ./NAME.
    pub file: Option<PathBuf>,
    /// What to do without a window.
    #[command(subcommand)]
    pub command: Option<Command>,
}

/// Commands without a window.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Run a scenario on a simulated rig and write its signals.
    Simulate(simulate::Arguments),
    /// Linearise a rig at rest: state space, poles, zeros, transfer functions, gains, low-order models.
    Model(model::Arguments),
    /// Run a test on a loop of a simulated rig (step, relay, binary sequence, sines and others), and fit its model.
    Excite(Box<excite::Arguments>),
    /// Run models side by side on one input, against a recording.
    Compare(compare::Arguments),
    /// Say what is in log files: columns, units, time axis, what was repaired, and which columns are proposed.
    Log(logs::Arguments),
    /// Fit a process model to a log.
    Identify(identify::Arguments),
    /// Fit parameters of a rig to a recording: the tank network's own laws, simulated in free run.
    FitPlant(fit_plant::Arguments),
    /// Tune a controller for a model: by published rules, or the best under limits of robustness.
    Tune(tune::Arguments),
    /// Judge a controller on a model: stability, margins, sensitivities, responses.
    Analyze(analyze::Arguments),
    /// Convert gains between the forms of controllers, or write a controller as structured text.
    Controller(controller::Arguments),
    /// Run a prepared experiment, and say whether it came out as expected.
    Experiment(experiment::Arguments),
    /// Identify, tune, compare and report in one go: one log, or a folder of them.
    Retune(Box<retune::Arguments>),
    /// Not available yet: serve a simulated rig to other programs.
    Serve(Later),
    /// Run a rig in real time and record it, for viewers that join and for a replay.
    Record(record::Arguments),
    /// Say what is in a recording, play it, export it as CSV or Parquet, or open it in Rerun.
    Replay(replay::Arguments),
}

/// Arguments of a command that is to come.
#[derive(Debug, clap::Args)]
#[command(disable_help_flag = true)]
pub struct Later {
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, hide = true)]
    rest: Vec<OsString>,
}

/// What the command line asks for.
#[derive(Debug, PartialEq, Eq)]
pub enum CliOutcome {
    /// Everything is done and said; end with this status.
    Exit(u8),
    /// Open the workbench, with a project or a log.
    OpenWindow(Option<PathBuf>),
}

/// What a command answers.
#[derive(Debug)]
struct Answer {
    /// For standard output.
    text: String,
    /// Remarks for standard error.
    remarks: Vec<String>,
    /// 0, or 1 for a no.
    status: u8,
}

impl Answer {
    fn done(text: String) -> Self {
        Self { text, remarks: vec![], status: 0 }
    }
}

/// Bad input, in words that say what to do.
#[derive(Debug)]
struct Refusal(String);

impl Refusal {
    fn of(error: impl std::fmt::Display) -> Self {
        Self(error.to_string())
    }

    fn later(what: &str) -> Self {
        Self(format!("{what} is not available yet"))
    }
}

/// Reads the arguments, the program's name first, and does what they say.
///
/// Prints to standard output and standard error; opens no window.
pub fn main_with(arguments: impl Iterator<Item = OsString>) -> CliOutcome {
    match Cli::try_parse_from(arguments) {
        Ok(cli) => run(cli),
        Err(error) => {
            // Help and version come this way as well, with status 0.
            drop(error.print());
            CliOutcome::Exit(u8::try_from(error.exit_code()).unwrap_or(2))
        }
    }
}

/// Does what the arguments say.
#[must_use]
pub fn run(cli: Cli) -> CliOutcome {
    let Some(command) = cli.command else { return CliOutcome::OpenWindow(cli.file) };
    survive_file_limits();
    let answered = match &command {
        Command::Simulate(arguments) => simulate::run(arguments),
        Command::Model(arguments) => model::run(arguments),
        Command::Excite(arguments) => excite::run(arguments),
        Command::Compare(arguments) => compare::run(arguments),
        Command::Log(arguments) => logs::run(arguments),
        Command::Identify(arguments) => identify::run(arguments),
        Command::FitPlant(arguments) => fit_plant::run(arguments),
        Command::Tune(arguments) => tune::run(arguments),
        Command::Analyze(arguments) => analyze::run(arguments),
        Command::Controller(arguments) => controller::run(arguments),
        Command::Experiment(arguments) => experiment::run(arguments),
        Command::Retune(arguments) => retune::run(arguments),
        Command::Serve(_) => Err(Refusal::later("vasos serve")),
        Command::Record(arguments) => record::run(arguments),
        Command::Replay(arguments) => replay::run(arguments),
    };
    CliOutcome::Exit(say(answered))
}

/// Prints an answer; a reader that closes its pipe early is no error.
fn say(answered: Result<Answer, Refusal>) -> u8 {
    match answered {
        Ok(answer) => {
            let mut out = std::io::stdout().lock();
            let text = answer.text.trim_end();
            if !text.is_empty() {
                drop(writeln!(out, "{text}").and_then(|()| out.flush()));
            }
            for remark in answer.remarks {
                drop(writeln!(std::io::stderr(), "vasos: {remark}"));
            }
            answer.status
        }
        Err(Refusal(reason)) => {
            drop(writeln!(std::io::stderr(), "vasos: {reason}"));
            2
        }
    }
}

/// A file that may not grow is an error of its write, no reason to die: what is recorded after it matters as well.
fn survive_file_limits() {
    #[cfg(unix)]
    drop(signal_hook::flag::register(signal_hook::consts::SIGXFSZ, std::sync::Arc::default()));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outcome(arguments: &[&str]) -> CliOutcome {
        main_with(std::iter::once("vasos").chain(arguments.iter().copied()).map(OsString::from))
    }

    #[test]
    fn the_definitions_are_consistent() {
        use clap::CommandFactory;
        Cli::command().debug_assert();
    }

    #[test]
    fn a_bare_path_opens_the_window_and_a_command_does_not() {
        assert_eq!(outcome(&[]), CliOutcome::OpenWindow(None));
        for path in ["step.csv", "./tune", "/a b/c.vasos"] {
            assert_eq!(outcome(&[path]), CliOutcome::OpenWindow(Some(path.into())));
        }
        assert_eq!(outcome(&["analyze", "--model", "K=1,T=2,L=1", "--gains", "Kc=1"]), CliOutcome::Exit(0));
        assert_eq!(outcome(&["step.csv", "tune"]), CliOutcome::Exit(2));
        assert_eq!(outcome(&["--wrong"]), CliOutcome::Exit(2));
        assert_eq!(outcome(&["--help"]), CliOutcome::Exit(0));
    }

    #[test]
    fn what_is_to_come_says_so() {
        assert_eq!(outcome(&["serve", "--list", "x"]), CliOutcome::Exit(2));
    }
}
