//! `vasos model`: the linear models of a rig at an operating point.

mod words;

use nalgebra::DMatrix;
use num_complex::Complex64;
use serde_json::{Map, Value, json};
use vasos_engine::explain::number;
use vasos_engine::model::{
    Port, ProcessModel, ReducedOrder, StateSpace, StepFit, ZeroPoleGain, fit_step_response, half_rule,
};
use vasos_engine::plant::{
    CurveSide, Disturbances, LinearOptions, Linearisation, Network, OperatingPoint, linearise,
};
use vasos_io::rig::load_rig;

use super::json;
use super::{Answer, Refusal, point};

/// Arguments of `vasos model`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  vasos model stad --configuration coupled --at LIC-02=19
  vasos model quadruple_nonminimum --json
  vasos model my_rig.toml --at BA01=2.4 --at FV01=33 --pv TQ1 --disturbances angles
The point is at rest: loops in automatic hold the levels given, or else their setpoints; pumps without such a loop keep the
input given, or else that of the rig file.
JSON: {rig, configuration, operating_point: {levels_cm, inputs, angles_deg, unrest_cm_s}, states, inputs, outputs, A, B, C, D,
delays_s, poles, zeros, time_constants_s, dc_gain, rga, transfer_functions: [{output, input, num, den, L_s, zeros, poles, gain,
dc_gain, time_constants_s, first_order_half_rule, second_order_half_rule, first_order_fit, reasons}], remarks}; roots are
[re, im] in 1/s, coefficients in falling powers of s, infinite and absent numbers null.")]
pub struct Arguments {
    /// Rig: a preset, or a file (TOML).
    rig: String,
    /// Configuration of the rig; its first where none is named.
    #[arg(long, value_name = "ID")]
    configuration: Option<String>,
    /// Level of a loop in cm, input of a pump, or angle of a valve; may be repeated.
    #[arg(long, value_name = "TAG=NUMBER")]
    at: Vec<String>,
    /// Tank (by its tag, a sensor's or a loop's) whose level is an output; may be repeated. Those with sensors otherwise.
    #[arg(long, value_name = "TAG")]
    pv: Vec<String>,
    /// Inputs beside the pumps: none, coefficients (k of the valves) or angles.
    #[arg(long, default_value = "none")]
    disturbances: String,
    /// Side of the pump curve's slope where the input stands on one of its points: above or below.
    #[arg(long, default_value = "above")]
    side: String,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<Answer, Refusal> {
    let network = load_rig(&arguments.rig).map_err(Refusal::of)?;
    let configuration = point::configuration(&network, arguments.configuration.as_deref())?;
    let start = OperatingPoint::of_configuration(&network, configuration);
    let at = point::at_rest(&network, configuration, &start, &arguments.at)?;
    let outputs =
        arguments.pv.iter().map(|tag| point::tank(&network, configuration, tag)).collect::<Result<_, _>>()?;
    let disturbances = match arguments.disturbances.as_str() {
        "none" => Disturbances::None,
        "coefficients" => Disturbances::Coefficients,
        "angles" => Disturbances::Angles,
        other => return Err(Refusal(format!("'{other}': choose none, coefficients or angles"))),
    };
    let side = match arguments.side.as_str() {
        "above" => CurveSide::Above,
        "below" => CurveSide::Below,
        other => return Err(Refusal(format!("'{other}': choose above or below"))),
    };
    let outputs = (!arguments.pv.is_empty()).then_some(outputs);
    let options = LinearOptions { outputs, disturbances, side };
    let linear = linearise(&network, &at, &options).map_err(Refusal::of)?;
    let id = network.spec.configurations.get(configuration).map(|c| c.id.as_str());
    let text = if arguments.json {
        json::text(&whole(&network, id, &linear, side))
    } else {
        words::words(&network, id, &linear, side)
    };
    Ok(Answer::done(text))
}

/// One channel with its reductions.
struct Channel {
    output: usize,
    input: usize,
    exact: ZeroPoleGain,
    first: Result<ProcessModel, String>,
    second: Result<ProcessModel, String>,
    fit: Result<StepFit, String>,
}

fn channels(model: &StateSpace) -> Vec<Channel> {
    let (p, m) = model.d().shape();
    let pairs = (0..p).flat_map(|output| (0..m).map(move |input| (output, input)));
    let channel = |(output, input)| {
        let exact = model.zero_pole_gain(output, input);
        let half = |order| half_rule(&exact, order).map_err(|e| e.to_string());
        let (first, second) = (half(ReducedOrder::First), half(ReducedOrder::Second));
        let fit = fit_step_response(&exact, ReducedOrder::First).map_err(|e| e.to_string());
        Channel { output, input, exact, first, second, fit }
    };
    pairs.map(channel).collect()
}

fn remarks(network: &Network, linear: &Linearisation, side: CurveSide) -> Vec<String> {
    let tank = |i: &usize| network.spec.tanks[*i].id.clone();
    let mut out = Vec::new();
    for id in linear.left_out.iter().map(tank) {
        out.push(format!("{id} is no state: no flow depends on its level"));
    }
    for id in linear.spilling.iter().map(tank) {
        out.push(format!("{id} is full and spills: its level does not move"));
    }
    for &pump in &linear.on_a_break {
        let (id, input) = (&network.spec.pumps[pump].id, number(linear.point.inputs[pump]));
        let side = if side == CurveSide::Above { "above" } else { "below" };
        out.push(format!("{id} stands on a point of its curve ({input}): the slope is that {side} it"));
    }
    for (pump, slope) in linear.pump_slopes.iter().enumerate().filter(|(_, slope)| **slope == 0.0) {
        let (id, input) = (&network.spec.pumps[pump].id, number(linear.point.inputs[pump]));
        out.push(format!("{id} at {input} moves no water when it moves: its slope is {slope}"));
    }
    out
}

fn complex(values: &[Complex64]) -> Value {
    values.iter().map(|v| json!([v.re, v.im])).collect()
}

fn rows(matrix: &DMatrix<f64>) -> Value {
    matrix.row_iter().map(|row| json!(row.iter().collect::<Vec<_>>())).collect()
}

fn by_tag<'a>(tags: impl Iterator<Item = &'a String>, values: &[f64]) -> Value {
    Value::Object(tags.zip(values).map(|(tag, value)| (tag.clone(), json!(value))).collect::<Map<_, _>>())
}

fn whole(network: &Network, configuration: Option<&str>, linear: &Linearisation, side: CurveSide) -> Value {
    let (spec, model, at) = (&network.spec, &linear.model, &linear.point);
    let ports =
        |ports: &[Port]| -> Value { ports.iter().map(|p| json!({"name": p.name, "unit": p.unit})).collect() };
    let names = model.ports();
    let functions: Vec<Value> = channels(model)
        .into_iter()
        .map(|c| {
            let tf = c.exact.transfer_function();
            let reduced = |model: &Result<ProcessModel, String>| model.as_ref().ok().map(json::model);
            let fit = c.fit.as_ref().ok().map(|fit| {
                let mut value = json::model(&fit.model);
                value["fit_percent"] = json!(fit.fit_percent);
                value
            });
            let mut reasons = [c.first.as_ref().err(), c.second.as_ref().err(), c.fit.as_ref().err()]
                .into_iter()
                .flatten()
                .cloned()
                .collect::<Vec<_>>();
            reasons.dedup();
            json!({
                "output": names.outputs[c.output].name,
                "input": names.inputs[c.input].name,
                "num": tf.num,
                "den": tf.den,
                "L_s": tf.dead_time_s,
                "zeros": complex(&c.exact.zeros),
                "poles": complex(&c.exact.poles),
                "gain": c.exact.gain,
                "dc_gain": c.exact.static_gain(),
                "time_constants_s": c.exact.time_constants_s(),
                "first_order_half_rule": reduced(&c.first),
                "second_order_half_rule": reduced(&c.second),
                "first_order_fit": fit,
                "reasons": reasons,
            })
        })
        .collect();
    json!({
        "rig": spec.id,
        "configuration": configuration,
        "operating_point": {
            "levels_cm": by_tag(spec.tanks.iter().map(|t| &t.id), &at.levels_cm),
            "inputs": by_tag(spec.pumps.iter().map(|p| &p.id), &at.inputs),
            "angles_deg": by_tag(spec.valves.iter().map(|v| &v.id), &at.angles_deg),
            "unrest_cm_s": linear.unrest_cm_s,
        },
        "states": ports(&names.states),
        "inputs": ports(&names.inputs),
        "outputs": ports(&names.outputs),
        "A": rows(model.a()),
        "B": rows(model.b()),
        "C": rows(model.c()),
        "D": rows(model.d()),
        "delays_s": model.input_delays_s(),
        "poles": complex(&model.poles()),
        "zeros": complex(&model.zeros()),
        "time_constants_s": time_constants(model),
        "dc_gain": rows(&model.dc_gain()),
        "rga": relative_gains(model).map(|g| rows(&g)),
        "transfer_functions": functions,
        "remarks": remarks(network, linear, side),
    })
}

fn time_constants(model: &StateSpace) -> Vec<f64> {
    let (poles, zeros) = (model.poles(), Vec::new());
    ZeroPoleGain { zeros, poles, gain: 1.0, dead_time_s: 0.0 }.time_constants_s()
}

/// Only of interest where several loops meet.
fn relative_gains(model: &StateSpace) -> Option<DMatrix<f64>> {
    (model.d().nrows() > 1).then(|| model.rga()).flatten()
}
