//! `vasos analyze`: what a controller is worth on a model.

use serde_json::{Map, Value, json};
use vasos_engine::analyze::{Analysis, OpenLoop, StepFigures, analyze_loop, analyze_measured, loop_figures};
use vasos_engine::control::FormGains;
use vasos_engine::tune::ControllerKind;
use vasos_io::frequency_response::read_frequency_response;

use super::json::{self, shown, table};
use super::{Answer, Refusal, optimal, parse};

/// Arguments of `vasos analyze`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  vasos analyze --model K=4.9,T=152,L=2 --gains Kc=7,Ti=15,Td=1,N=10 --json\n  vasos analyze --model K=1,T=1,L=5 --gains Kp=0,Ki=0.08"
)]
pub struct Arguments {
    /// Process model, seconds: K=..,T=..,L=..  Kv=..,L=..  K=..,T1=..,T2=..,L=..[,Tz=..]  num=..,den=..,L=..
    #[arg(long, required_unless_present = "response", allow_hyphen_values = true)]
    model: Option<String>,
    /// A measured frequency response in place of a model: CSV with omega_rad_s, re, im, or what vasos excite --sine
    /// --json prints.
    #[arg(long, value_name = "FILE", conflicts_with = "model")]
    response: Option<std::path::PathBuf>,
    /// Gains of the ideal form: Kc=..[,Ti=..][,Td=..][,N=..], without Ti no integral action, N is 10; or of the parallel
    /// form: Kp=..,Ki=..[,Kd=..,Tf=..], where Kp may be 0.
    #[arg(long, allow_hyphen_values = true)]
    gains: String,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<Answer, Refusal> {
    let gains = parse::any_gains(&arguments.gains).map_err(Refusal::of)?;
    let mut unseen = None;
    let (described, analysis, figures) = match (&arguments.model, &arguments.response) {
        (Some(model), _) => {
            let model = parse::model(model).map_err(Refusal::of)?;
            let open = OpenLoop::of_parallel(&model, &gains);
            let analysis = analyze_loop(&open);
            (json::model(&model), analysis, loop_figures(&open, &analysis))
        }
        (None, Some(path)) => {
            let response = read_frequency_response(path).map_err(Refusal::of)?;
            let analysis = analyze_measured(&response, &gains).map_err(Refusal::of)?;
            unseen = optimal::coarse(&response, &gains);
            (json::response(&response), analysis, StepFigures::default())
        }
        (None, None) => return Err(Refusal("give --model or --response".to_owned())),
    };
    let mut remarks = remarks(&analysis, &figures, arguments.model.is_some());
    remarks.extend(unseen);
    if arguments.json {
        let mut result = Map::new();
        match FormGains::Parallel(gains).to_ideal() {
            Ok(ideal) => json::add_gains(&mut result, ControllerKind::of(&ideal), Some(&ideal)),
            // Integral action alone has no ideal form.
            Err(_) => optimal::add_gains(&mut result, ControllerKind::Pi, &gains),
        }
        json::add_analysis(&mut result, &analysis);
        json::add_figures(&mut result, &analysis, &figures);
        json::add_remarks(&mut result, true, &remarks);
        let whole = json!({"model": described, "result": Value::Object(result)});
        return Ok(Answer::done(json::text(&whole)));
    }
    if !analysis.stable {
        return Ok(Answer::done("The loop is unstable: nothing else can be said of it.".to_owned()));
    }
    let a = &analysis;
    let rows = [
        ("Ms", a.ms, ""),
        ("Mt", a.mt, ""),
        ("Ju", a.ju, "MV/PV"),
        ("Jv", a.jv, "PV·s/MV"),
        ("gain margin", a.gain_margin, ""),
        ("phase margin", a.phase_margin_deg, "°"),
        ("delay margin", a.delay_margin_s, "s"),
        ("crossover", a.w_gc_rad_s, "rad/s"),
        ("phase crossover", a.w_180_rad_s, "rad/s"),
        ("IAE of a load step", figures.iae_load, "PV·s/MV"),
        ("IAE of a setpoint step", figures.iae_setpoint, "s"),
        ("overshoot", figures.overshoot_percent, "%"),
    ];
    let rows: Vec<Vec<String>> = std::iter::once(vec!["stable".to_owned(), "yes".to_owned()])
        .chain(rows.map(|(name, value, unit)| {
            vec![if unit.is_empty() { name.to_owned() } else { format!("{name} ({unit})") }, shown(value)]
        }))
        .collect();
    Ok(Answer::done(format!("{}{}", table(&rows), remarks.join("\n"))))
}

/// Why figures of the step responses are missing where they could be expected.
fn remarks(analysis: &Analysis, figures: &StepFigures, simulated: bool) -> Vec<String> {
    let missing = figures.iae_load.is_none() || figures.iae_setpoint.is_none();
    if !(analysis.stable && simulated && missing) {
        return vec![];
    }
    vec![
        "the step responses do not come to rest at the setpoint in the time that is simulated, so they have no IAE: the loop is too slow for its model, or has no integral action"
            .to_owned(),
    ]
}
