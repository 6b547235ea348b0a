//! `vasos excite`: a test on a loop of a simulated rig, what it measured and the model it tells.

use std::path::PathBuf;

use serde_json::{Map, Value, json};
use vasos_engine::excitation::{
    AtRest, Ending, Excitation, ExcitationLimits, ExcitationReport, Finding, Hysteresis, Identified, Relay,
    Signal, StepEnd, SteppedSine, UltimateGain, identify_report,
};
use vasos_engine::explain::number;
use vasos_engine::identify::FitError;
use vasos_engine::plant::Measurement;
use vasos_engine::session::Rig;
use vasos_engine::sim::run_excitation;
use vasos_io::export::write_run;
use vasos_io::rig::load_rig;

use super::json::{self, shown, table};
use super::{Answer, Refusal, point};

/// Arguments of `vasos excite`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  vasos excite stad --loop LIC-02 --relay 0.3
  vasos excite stad --loop LIC-02 --level 19 --relay 0.3 --down 0.2 --hysteresis 0.1 -o relay.csv
  vasos excite stad --loop LIC-02 --step 0.1 --pv-high 17 --budget 1800 --json
  vasos excite stad --loop LIC-02 --prbs 0.2 --clock 5 --register 6
  vasos excite stad --loop LIC-02 --ultimate-gain 4 --kick 0.2 --ideal
  vasos excite stad --loop LIC-02 --sine 0.3 --frequencies 0.05,0.1,0.2
The loop is listened to first; then it is moved, within its limits, until all is measured. A CSV has the whole run.
With a hysteresis 4d/(πa) is not the ultimate gain: that of the fitted model is.
Exit status 1: the test ended before it was finished; the reason is in the answer.")]
pub struct Arguments {
    /// Preset or rig file.
    rig: String,
    /// Loop by its tag.
    #[arg(long = "loop", value_name = "TAG")]
    tag: String,
    #[command(flatten)]
    signal: SignalArguments,
    #[command(flatten)]
    settings: SettingArguments,
    /// Configuration of the rig; its first where none is named.
    #[arg(long, value_name = "ID")]
    configuration: Option<String>,
    /// Level in cm at which the rig is at rest at the start; that of its file where none is given.
    #[arg(long, value_name = "CM")]
    level: Option<f64>,
    /// Seed of the noise.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Without noise and converters.
    #[arg(long)]
    ideal: bool,
    /// CSV file to write; an existing one is replaced.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// How the loop is moved: exactly one of these.
#[derive(Debug, clap::Args)]
#[group(required = true, multiple = false)]
struct SignalArguments {
    /// Step of the output in its unit, until the PV is at rest.
    #[arg(long, value_name = "SIZE", allow_hyphen_values = true)]
    step: Option<f64>,
    /// Step of the setpoint in cm, until the PV is at rest.
    #[arg(long, value_name = "CM", allow_hyphen_values = true)]
    setpoint_step: Option<f64>,
    /// Relay of that amplitude.
    #[arg(long, value_name = "D", allow_hyphen_values = true)]
    relay: Option<f64>,
    /// Doublet of that amplitude, with --hold.
    #[arg(long, value_name = "A", allow_hyphen_values = true, requires = "hold")]
    doublet: Option<f64>,
    /// Binary sequence of maximum length of that amplitude, with --clock.
    #[arg(long, value_name = "A", requires = "clock", allow_hyphen_values = true)]
    prbs: Option<f64>,
    /// Sines of that amplitude, with --frequencies.
    #[arg(long, value_name = "A", requires = "frequencies", allow_hyphen_values = true)]
    sine: Option<f64>,
    /// Proportional control from that gain on, with --kick.
    #[arg(long, value_name = "K", requires = "kick", allow_hyphen_values = true)]
    ultimate_gain: Option<f64>,
}

/// What goes with a signal, and what the test keeps to.
#[derive(Debug, clap::Args)]
struct SettingArguments {
    /// Relay: amplitude downwards; another one than upwards gives the static gain.
    #[arg(long, value_name = "D", requires = "relay", allow_hyphen_values = true)]
    down: Option<f64>,
    /// Relay: hysteresis in cm.
    #[arg(
        long,
        value_name = "CM",
        requires = "relay",
        conflicts_with = "noise_factor",
        allow_hyphen_values = true
    )]
    hysteresis: Option<f64>,
    /// Relay: hysteresis as a multiple of the noise's sd(δ); 3 where neither is given.
    #[arg(long, value_name = "F", requires = "relay", allow_hyphen_values = true)]
    noise_factor: Option<f64>,
    /// Relay, sines and ultimate gain: cycles that are averaged.
    #[arg(long, value_name = "N")]
    cycles: Option<u32>,
    /// Doublet: length of each half in seconds.
    #[arg(long, value_name = "S", allow_hyphen_values = true)]
    hold: Option<f64>,
    /// Binary sequence: length of a bit in seconds.
    #[arg(long, value_name = "S", allow_hyphen_values = true)]
    clock: Option<f64>,
    /// Binary sequence: length of the register, 2 to 11.
    #[arg(long, value_name = "N", default_value_t = 6)]
    register: u32,
    /// Sines: frequencies in rad/s, with commas between them.
    #[arg(long, value_name = "LIST", value_delimiter = ',', allow_hyphen_values = true)]
    frequencies: Option<Vec<f64>>,
    /// Ultimate gain: change of the output that sets the loop going.
    #[arg(long, value_name = "V", allow_hyphen_values = true)]
    kick: Option<f64>,
    /// Step: leave the new value at the end.
    #[arg(long)]
    stay: bool,
    /// Begin whether or not the loop is at rest.
    #[arg(long)]
    not_at_rest: bool,
    /// Time to listen before the first move, in seconds.
    #[arg(long, value_name = "S", default_value_t = 30.0)]
    listen: f64,
    /// Longest time the test may take, in seconds.
    #[arg(long, value_name = "S", default_value_t = 3600.0)]
    budget: f64,
    /// Lowest PV in cm.
    #[arg(long, value_name = "CM", allow_hyphen_values = true)]
    pv_low: Option<f64>,
    /// Highest PV in cm.
    #[arg(long, value_name = "CM", allow_hyphen_values = true)]
    pv_high: Option<f64>,
    /// Lowest output.
    #[arg(long, value_name = "V", allow_hyphen_values = true)]
    mv_low: Option<f64>,
    /// Highest output.
    #[arg(long, value_name = "V", allow_hyphen_values = true)]
    mv_high: Option<f64>,
}

pub(super) fn run(arguments: &Arguments) -> Result<Answer, Refusal> {
    if arguments.output.as_ref().is_some_and(|p| p.extension().is_none_or(|e| e != "csv")) {
        return Err(Refusal("the name of the output must end in .csv".to_owned()));
    }
    let network = load_rig(&arguments.rig).map_err(Refusal::of)?;
    let configuration = point::configuration(&network, arguments.configuration.as_deref())?;
    let measurement = if arguments.ideal { Measurement::IDEAL } else { Measurement::DEFAULT };
    let rig = Rig { network, configuration, measurement, seed: arguments.seed };
    let excitation = excitation(arguments);
    let (run, report) =
        run_excitation(&rig, &arguments.tag, arguments.level, &excitation).map_err(Refusal::of)?;
    if let Some(path) = &arguments.output {
        write_run(&run, path).map_err(Refusal::of)?;
    }
    let told = report.moved_at_s.map(|_| identify_report(&report));
    let has_model = |told: &Result<Identified, _>| told.as_ref().is_ok_and(|told| told.has_model);
    let status = u8::from(report.ending != Ending::Finished || !told.as_ref().is_some_and(has_model));
    let text = if arguments.json {
        json::text(&as_json(arguments, &report, told.as_ref()))
    } else {
        as_text(arguments, &report, told.as_ref())
    };
    Ok(Answer { text, remarks: vec![], status })
}

fn excitation(arguments: &Arguments) -> Excitation {
    let settings = &arguments.settings;
    Excitation {
        limits: ExcitationLimits {
            pv_low: settings.pv_low,
            pv_high: settings.pv_high,
            mv_low: settings.mv_low,
            mv_high: settings.mv_high,
        },
        budget_s: settings.budget,
        listen_s: settings.listen,
        at_rest: if settings.not_at_rest { AtRest::NotNeeded } else { AtRest::Required },
        ..Excitation::new(signal(&arguments.signal, settings))
    }
}

/// The signal; what it requires, the parser has seen to.
fn signal(asked: &SignalArguments, settings: &SettingArguments) -> Signal {
    let end = if settings.stay { StepEnd::Stay } else { StepEnd::Back };
    let missing = f64::NAN;
    if let Some(size) = asked.step {
        Signal::Step { size, rest_share: 0.02, end }
    } else if let Some(size) = asked.setpoint_step {
        Signal::SetpointStep { size, rest_share: 0.02, end }
    } else if let Some(amplitude) = asked.relay {
        let mut relay = Relay { amplitude_down: settings.down, ..Relay::new(amplitude) };
        if let Some(width) = settings.hysteresis {
            relay.hysteresis = Hysteresis::Given(width);
        } else if let Some(factor) = settings.noise_factor {
            relay.hysteresis = Hysteresis::Noise(factor);
        }
        relay.cycles = settings.cycles.unwrap_or(relay.cycles);
        Signal::Relay(relay)
    } else if let Some(amplitude) = asked.doublet {
        Signal::Doublet { amplitude, hold_s: settings.hold.unwrap_or(missing) }
    } else if let Some(amplitude) = asked.prbs {
        let clock_s = settings.clock.unwrap_or(missing);
        Signal::Prbs { amplitude, clock_s, register: settings.register, periods: 1 }
    } else if let Some(amplitude) = asked.sine {
        let mut sine = SteppedSine::new(amplitude, settings.frequencies.clone().unwrap_or_default());
        sine.cycles = settings.cycles.unwrap_or(sine.cycles);
        Signal::SteppedSine(sine)
    } else {
        let gain = asked.ultimate_gain.unwrap_or(missing);
        let mut test = UltimateGain::new(gain, settings.kick.unwrap_or(missing));
        test.cycles = settings.cycles.unwrap_or(test.cycles);
        Signal::UltimateGain(test)
    }
}

type Told<'a> = Option<&'a Result<Identified, FitError>>;

/// What was measured, by the names of JSON.
fn measured(finding: &Finding) -> Vec<(&'static str, Option<f64>)> {
    match finding {
        Finding::Step(step) => vec![
            ("change", Some(step.change)),
            ("gain", Some(step.gain)),
            ("settled_after_s", Some(step.settled_after_s)),
        ],
        Finding::Relay(relay) => vec![
            ("Pu_s", Some(relay.period_s)),
            ("wu_rad_s", Some(relay.omega_rad_s)),
            ("amplitude", Some(relay.amplitude)),
            ("hysteresis", Some(relay.hysteresis)),
            ("hysteresis_ratio", Some(relay.hysteresis_ratio())),
            ("Ku", Some(relay.ku)),
            ("Ku_hysteresis", relay.ku_hysteresis),
            ("static_gain", relay.static_gain),
            ("static_gain_error", relay.static_gain_error),
        ],
        Finding::Ultimate(found) => vec![("Ku", Some(found.ku)), ("Pu_s", Some(found.pu_s))],
        Finding::Frequencies(_) | Finding::Nothing => vec![],
    }
}

fn as_json(arguments: &Arguments, report: &ExcitationReport, told: Told) -> Value {
    let mut found: Map<String, Value> =
        measured(&report.finding).into_iter().map(|(name, value)| (name.to_owned(), json!(value))).collect();
    if let Finding::Frequencies(points) = &report.finding {
        let point = |p: &vasos_engine::excitation::FrequencyPoint| json!({"w_rad_s": p.omega_rad_s, "re": p.response.re, "im": p.response.im});
        found.insert("frequencies".into(), points.iter().map(point).collect());
    }
    let ended = match &report.ending {
        Ending::Finished => Value::Null,
        Ending::Stopped(reason) => json!(reason.to_string()),
    };
    let model = told.and_then(|t| t.as_ref().ok()).filter(|told| told.has_model).map(|told| {
        let mut model = super::identify::model_json(told.fit());
        for (key, value) in [("Ku", told.ultimate.map(|u| u.ku)), ("Pu_s", told.ultimate.map(|u| u.pu_s))] {
            model[key] = json!(value);
        }
        model
    });
    let of_model = told.and_then(|t| t.as_ref().ok()).into_iter().flat_map(|told| &told.warnings);
    let warnings: Vec<String> = report.warnings().iter().chain(of_model).map(ToString::to_string).collect();
    json!({
        "loop": report.tag,
        "signal": report.excitation.signal.key(),
        "finished": report.ending == Ending::Finished,
        "ended": ended,
        "limits": {
            "pv": [report.envelope.pv.low, report.envelope.pv.high],
            "mv": [report.envelope.mv.low, report.envelope.mv.high],
        },
        "rows": report.record.time_s.len(),
        "pv_at_rest": report.pv_at_rest,
        "mv_at_rest": report.mv_at_rest,
        "noise_sd": report.noise_sd,
        "measured": found,
        "model": model,
        "warnings": warnings,
        "output": arguments.output.as_ref().map(|p| p.display().to_string()),
    })
}

/// Which test it was, and how it ended.
pub(super) fn headline(report: &ExcitationReport) -> String {
    let name = report.excitation.signal.key().replace('_', " ");
    let span_s = report.record.time_s.last().map(|last| last - report.start_s);
    match &report.ending {
        Ending::Finished => format!("{}: {name} test finished after {} s", report.tag, shown(span_s)),
        Ending::Stopped(reason) => format!("{}: {name} test {reason}", report.tag),
    }
}

fn as_text(arguments: &Arguments, report: &ExcitationReport, told: Told) -> String {
    let mut text = headline(report);
    if let Some(path) = &arguments.output {
        text.push_str(&format!(", written to {}", path.display()));
    }
    let (pv, mv) = (report.envelope.pv, report.envelope.mv);
    let between = |low, high| format!("{} to {}", number(low), number(high));
    text.push_str(&format!("\nkept PV {}, MV {}\n", between(pv.low, pv.high), between(mv.low, mv.high)));
    let mut rows: Vec<Vec<String>> = [
        ("PV at rest", report.pv_at_rest),
        ("MV at rest", report.mv_at_rest),
        ("noise (sd)", report.noise_sd),
    ]
    .into_iter()
    .filter(|(_, value)| value.is_some())
    .map(|(name, value)| vec![name.to_owned(), shown(value)])
    .collect();
    rows.extend(measured(&report.finding).into_iter().map(|(name, v)| vec![name.to_owned(), shown(v)]));
    text.push_str(&table(&rows));
    if let Finding::Frequencies(points) = &report.finding {
        let heads = ["w (rad/s)", "|G|", "phase (deg)"].map(str::to_owned).to_vec();
        let row = |p: &vasos_engine::excitation::FrequencyPoint| {
            [p.omega_rad_s, p.response.norm(), p.response.arg().to_degrees()].map(number).to_vec()
        };
        let rows: Vec<_> = std::iter::once(heads).chain(points.iter().map(row)).collect();
        text.push_str(&table(&rows));
    }
    match told {
        Some(Ok(told)) if told.has_model => text.push_str(&model_text(told)),
        Some(Ok(told)) => told.warnings.iter().for_each(|w| text.push_str(&format!("note: {w}\n"))),
        Some(Err(error)) => text.push_str(&format!("no model: {error}\n")),
        None => {}
    }
    for warning in report.warnings() {
        text.push_str(&format!("note: {warning}\n"));
    }
    text
}

fn model_text(told: &Identified) -> String {
    let single = |name: &str, value: Option<f64>| vec![name.to_owned(), shown(value)];
    let mut rows = super::identify::model_rows(told.fit());
    rows.extend([
        single("fit (%)", Some(told.fit().fit_percent)),
        single("Ku of the model", told.ultimate.map(|u| u.ku)),
        single("Pu of the model (s)", told.ultimate.map(|u| u.pu_s)),
    ]);
    let mut text = table(&rows);
    for verdict in &told.fit().verdicts {
        text.push_str(&format!("{verdict}\n"));
    }
    for warning in &told.warnings {
        text.push_str(&format!("note: {warning}\n"));
    }
    text
}
