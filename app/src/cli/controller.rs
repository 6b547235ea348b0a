//! `vasos controller`: gains in the form a controller wants them, and the controller itself as structured text.

use std::path::PathBuf;

use serde_json::{Value, json};
use vasos_engine::control::{
    Clip, Form, FormError, FormGains, Law, Limits, Mapping, Proof, Sends, ShownGains,
    proportional_band_percent, prove, repeats_per_min, repeats_per_s,
};
use vasos_engine::explain::number;
use vasos_io::structured_text::{BlockOptions, is_block_name, structured_text};

use super::json::{self, shown, table};
use super::parse_gains::{self, Spans};
use super::{Answer, Refusal};

/// Arguments of `vasos controller`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    #[command(subcommand)]
    task: Task,
}

#[derive(Debug, clap::Subcommand)]
enum Task {
    /// Convert gains between the ideal, parallel and series form, or a controller's own.
    Convert(Convert),
    /// Write PID-I2GL as an IEC 61131-3 function block.
    St(StructuredText),
}

#[derive(Debug, clap::Args)]
#[command(after_help = "\
Forms:
  ideal     Kc(1 + 1/(Ti s) + Td s/(1 + s Td/N))          Kc=..,Ti=..,Td=..,N=..
  parallel  Kp + Ki/s + Kd s/(1 + Tf s)                   Kp=..,Ki=..,Kd=..,Tf=..
  series    Kc(1 + 1/(Ti s))·(1 + Td s)/(1 + s Td/N)      Kc=..,Ti=..,Td=..,N=..
  legacy    a form of your own, by --mapping              gain=..,integral=..,derivative=..,filter=..
Instead of Kc: PB, a proportional band in percent, with both spans. Instead of Ti: Ti_min, repeats_per_min,
repeats_per_s. Instead of Td: Td_min. Ti left out means no integral action, N is 10.

Examples:
  vasos controller convert --gains Kc=2,Ti=60,Td=10 --from ideal --to series
  vasos controller convert --gains PB=50,repeats_per_min=1 --from series --to ideal --mv-span 100 --pv-span 100
  vasos controller convert --gains Kc=2,Ti=60,Td=10 --from ideal --to legacy \\
      --mapping base=series,gain=/100,integral=/60,derivative=0.0166666666666667,filter=1
Both forms are driven with the same signal; the largest difference of their outputs is printed.
Exit status 1: the form has no such controller; the reason has the numbers.")]
struct Convert {
    /// Gains in the form given by --from; times in seconds.
    #[arg(long, allow_hyphen_values = true)]
    gains: String,
    /// ideal, parallel, series or legacy.
    #[arg(long, value_name = "FORM")]
    from: String,
    /// ideal, parallel, series or legacy.
    #[arg(long, value_name = "FORM")]
    to: String,
    /// What a legacy controller shows: base=FORM,gain=F,integral=F,derivative=F,filter=F; F a factor, or /F for
    /// F divided by the value.
    #[arg(long, allow_hyphen_values = true)]
    mapping: Option<String>,
    /// Span of MV in its unit, for proportional bands.
    #[arg(long, value_name = "X", requires = "pv_span")]
    mv_span: Option<f64>,
    /// Span of PV in its unit, for proportional bands.
    #[arg(long, value_name = "X", requires = "mv_span")]
    pv_span: Option<f64>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, clap::Args)]
#[command(after_help = "\
Example:
  vasos controller st --gains Kc=1.8,Ti=152 --sample-time 0.2 --low 1 --high 3.5 -o pid_i2gl.st
Without -o the text is printed.")]
struct StructuredText {
    /// Gains of the ideal form and weights: Kc=..,Ti=..[,Td=..][,N=..][,b=..][,c=..]
    #[arg(long, allow_hyphen_values = true)]
    gains: String,
    /// Period of the task that calls the block, in seconds.
    #[arg(long, value_name = "S")]
    sample_time: f64,
    /// Lowest output.
    #[arg(long, value_name = "X", default_value_t = 0.0, allow_hyphen_values = true)]
    low: f64,
    /// Highest output.
    #[arg(long, value_name = "X", default_value_t = 100.0, allow_hyphen_values = true)]
    high: f64,
    /// Output before the first sample; without it the lowest.
    #[arg(long, value_name = "X", allow_hyphen_values = true)]
    start: Option<f64>,
    /// Clip the integral only: what P and D give beyond a limit is kept.
    #[arg(long)]
    clip_integral: bool,
    /// Send increments (switch S1), for an actuator that adds up.
    #[arg(long)]
    increments: bool,
    /// Name of the function block.
    #[arg(long, default_value = "PID_I2GL")]
    name: String,
    /// File to write; an existing file is replaced.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

pub(super) fn run(arguments: &Arguments) -> Result<Answer, Refusal> {
    match &arguments.task {
        Task::Convert(convert) => run_convert(convert),
        Task::St(text) => run_st(text),
    }
}

/// A form of the program, or one of the user's.
enum Way {
    Known(Form),
    Legacy(Mapping),
}

/// Gains in one of the two.
enum Written {
    Known(FormGains),
    Legacy(Mapping, ShownGains),
}

impl Written {
    fn gains(&self) -> FormGains {
        match self {
            Self::Known(gains) => *gains,
            Self::Legacy(mapping, shown) => mapping.gains(shown),
        }
    }

    fn in_way(gains: &FormGains, way: &Way) -> Result<Self, FormError> {
        Ok(match way {
            Way::Known(form) => Self::Known(gains.to_form(*form)?),
            Way::Legacy(mapping) => Self::Legacy(*mapping, mapping.shown(gains)?),
        })
    }
}

fn run_convert(arguments: &Convert) -> Result<Answer, Refusal> {
    let mapping = arguments.mapping.as_deref().map(parse_gains::mapping).transpose().map_err(Refusal::of)?;
    let spans = arguments.mv_span.zip(arguments.pv_span);
    if let Some(span) = spans.iter().flat_map(|(mv, pv)| [mv, pv]).find(|s| !s.is_finite() || **s <= 0.0) {
        return Err(Refusal(format!(
            "a span of {} is not possible: it must be greater than 0",
            number(*span)
        )));
    }
    let way = |name: &str| match (parse_gains::form(name), name, mapping) {
        (Some(form), ..) => Ok(Way::Known(form)),
        (None, "legacy", Some(mapping)) => Ok(Way::Legacy(mapping)),
        (None, "legacy", None) => Err(Refusal("legacy has no formula of its own: give --mapping".to_owned())),
        _ => Err(Refusal(format!("there is no form '{name}': choose ideal, parallel, series or legacy"))),
    };
    let source = match way(&arguments.from)? {
        Way::Known(form) => {
            Written::Known(parse_gains::form_gains(&arguments.gains, form, spans).map_err(Refusal::of)?)
        }
        Way::Legacy(mapping) => {
            Written::Legacy(mapping, parse_gains::shown_gains(&arguments.gains).map_err(Refusal::of)?)
        }
    };
    let gains = source.gains();
    let target = way(&arguments.to)?;
    if let Err(FormError::Gains(error)) = gains.to_ideal() {
        return Err(Refusal::of(error));
    }
    let converted = Written::in_way(&gains, &target).map_err(|error| error.to_string());
    let proven = converted.and_then(|converted| Ok((proven(&source, &converted, spans)?, converted)));
    Ok(match proven {
        Ok((proof, converted)) => converted_answer(arguments.json, &source, &converted, &proof, spans),
        Err(reason) => {
            let whole = json!({
                "from": as_json(&source, spans),
                "to": Value::Null,
                "proof": Value::Null,
                "reason": reason,
            });
            let text = if arguments.json { json::text(&whole) } else { String::new() };
            Answer { text, remarks: vec![reason], status: 1 }
        }
    })
}

/// The proof of a conversion, or the reason why there is none: a number or an output beyond all numbers. A proof
/// passes over what is not a number, so the outputs of both sides are asked for.
fn proven(source: &Written, converted: &Written, spans: Spans) -> Result<Proof, String> {
    let timed = converted.gains().form() != Form::Parallel;
    for (name, value) in numbers(converted, spans) {
        let no_integral = timed && matches!(name, "Ti_s" | "Ti_min" | "integral") && value == f64::INFINITY;
        if !value.is_finite() && !no_integral {
            return Err(format!(
                "the converted {name} = {} is not a finite number: no controller has such gains",
                number(value)
            ));
        }
    }
    let proof = prove(&source.gains(), &converted.gains());
    let back = prove(&converted.gains(), &source.gains());
    for output in [proof.largest_output, back.largest_output] {
        if !(output.is_finite() && output > 0.0) {
            return Err(format!(
                "the conversion cannot be proved: max |u| = {} for errors within ±1; no controller has such gains",
                number(output)
            ));
        }
    }
    Ok(proof)
}

fn converted_answer(
    as_text: bool,
    source: &Written,
    converted: &Written,
    proof: &Proof,
    spans: Spans,
) -> Answer {
    if as_text {
        let whole = json!({
            "from": as_json(source, spans),
            "to": as_json(converted, spans),
            "proof": proof_json(proof),
            "reason": Value::Null,
        });
        return Answer::done(json::text(&whole));
    }
    let rows: Vec<Vec<String>> = numbers(converted, spans)
        .into_iter()
        .map(|(name, value)| vec![name.to_owned(), shown(Some(value))])
        .collect();
    let proof = format!(
        "proof: max |Δu| = {} at max |u| = {}, {} samples of {} s",
        number(proof.largest_difference),
        number(proof.largest_output),
        proof.samples,
        number(proof.sample_time_s),
    );
    Answer::done(format!("{}{proof}", table(&rows)))
}

fn proof_json(proof: &Proof) -> Value {
    json!({
        "max_abs_du": proof.largest_difference,
        "max_abs_u": proof.largest_output,
        "samples": proof.samples,
        "sample_time_s": proof.sample_time_s,
    })
}

/// The numbers of a form by their names, in every unit a plant may ask for.
fn numbers(written: &Written, spans: Spans) -> Vec<(&'static str, f64)> {
    let band = |kc: f64| spans.map(|(mv, pv)| ("PB_percent", proportional_band_percent(kc, mv, pv)));
    let timed = |kc: f64, ti_s: f64, td_s: f64, n: f64| {
        let mut rows = vec![("Kc", kc)];
        rows.extend(band(kc));
        rows.extend([
            ("Ti_s", ti_s),
            ("Ti_min", ti_s / 60.0),
            ("repeats_per_s", repeats_per_s(ti_s)),
            ("repeats_per_min", repeats_per_min(ti_s)),
            ("Td_s", td_s),
            ("Td_min", td_s / 60.0),
            ("N", n),
        ]);
        rows
    };
    match written {
        Written::Legacy(_, s) => vec![
            ("gain", s.gain),
            ("integral", s.integral),
            ("derivative", s.derivative),
            ("filter", s.filter),
        ],
        Written::Known(FormGains::Ideal(g)) => timed(g.kc, g.ti_s, g.td_s, g.n),
        Written::Known(FormGains::Series(g)) => timed(g.kc, g.ti_s, g.td_s, g.n),
        Written::Known(FormGains::Parallel(g)) => {
            vec![("Kp", g.kp), ("Ki", g.ki), ("Kd", g.kd), ("Tf_s", g.tf_s)]
        }
    }
}

fn as_json(written: &Written, spans: Spans) -> Value {
    let form = match written {
        Written::Known(gains) => gains.form().id(),
        Written::Legacy(..) => "legacy",
    };
    let mut whole = serde_json::Map::from_iter([("form".to_owned(), json!(form))]);
    whole.extend(numbers(written, spans).into_iter().map(|(name, value)| (name.to_owned(), json!(value))));
    Value::Object(whole)
}

fn run_st(arguments: &StructuredText) -> Result<Answer, Refusal> {
    let tuning = parse_gains::tuning(&arguments.gains).map_err(Refusal::of)?;
    let tuning = tuning.validated(&Law::default()).map_err(Refusal::of)?;
    let (low, high, h) = (arguments.low, arguments.high, arguments.sample_time);
    if !(h.is_finite() && h > 0.0) {
        return Err(Refusal(format!(
            "a sample time of {} s is not possible: it must be greater than 0",
            number(h)
        )));
    }
    if !(low.is_finite() && high.is_finite() && low < high) {
        let [low, high] = [low, high].map(number);
        return Err(Refusal(format!(
            "limits of {low} and {high} are not possible: --low must be under --high"
        )));
    }
    let start = arguments.start.unwrap_or(low);
    if !(low..=high).contains(&start) {
        return Err(Refusal(format!("a start of {} is outside the limits", number(start))));
    }
    if !is_block_name(&arguments.name) {
        let name = &arguments.name;
        return Err(Refusal(format!(
            "'{name}' is no name for a function block: use letters, digits and single underscores, a letter first"
        )));
    }
    let text = structured_text(&BlockOptions {
        name: arguments.name.clone(),
        tuning,
        sample_time_s: h,
        limits: Limits { low, high },
        start,
        clip: if arguments.clip_integral { Clip::Integral } else { Clip::Output },
        sends: if arguments.increments { Sends::Increment } else { Sends::Position },
    });
    let Some(path) = &arguments.output else { return Ok(Answer::done(text)) };
    std::fs::write(path, text)
        .map_err(|error| Refusal(format!("{} cannot be written: {error}", path.display())))?;
    Ok(Answer::done(format!("written to {}", path.display())))
}
