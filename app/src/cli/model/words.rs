//! The answer of `vasos model` for people.

use nalgebra::DMatrix;
use num_complex::Complex64;
use vasos_engine::explain::number;
use vasos_engine::model::{Port, ProcessModel, StepFit};
use vasos_engine::plant::{CurveSide, Linearisation, Network};

use super::super::json::{shown, table};
use super::{Channel, channels, relative_gains, remarks, time_constants};

fn root(value: &Complex64) -> String {
    let sign = if value.im < 0.0 { '−' } else { '+' };
    match value.im {
        0.0 => number(value.re),
        im => format!("{} {sign} {}j", number(value.re), number(im.abs())),
    }
}

fn roots(values: &[Complex64]) -> String {
    if values.is_empty() { "none".to_owned() } else { values.iter().map(root).collect::<Vec<_>>().join(", ") }
}

fn numbers(values: &[f64]) -> String {
    values.iter().map(|v| shown(Some(*v))).collect::<Vec<_>>().join(", ")
}

/// A matrix with the names of its rows and columns.
fn named(matrix: &DMatrix<f64>, title: &str, to: &[String], from: &[String]) -> String {
    let mut lines = vec![std::iter::once(title.to_owned()).chain(from.iter().cloned()).collect::<Vec<_>>()];
    for (row, name) in matrix.row_iter().zip(to) {
        lines.push(std::iter::once(name.clone()).chain(row.iter().map(|v| shown(Some(*v)))).collect());
    }
    table(&lines)
}

fn in_words(model: &ProcessModel) -> String {
    match model {
        ProcessModel::Fopdt(m) => {
            format!("K {}, T {} s, L {} s", number(m.gain), number(m.time_constant_s), number(m.dead_time_s))
        }
        ProcessModel::Ipdt(m) => format!("Kv {}, L {} s", number(m.velocity_gain), number(m.dead_time_s)),
        ProcessModel::Sopdt(m) => format!(
            "K {}, T1 {} s, T2 {} s, L {} s",
            number(m.gain),
            number(m.time_constant_1_s),
            number(m.time_constant_2_s),
            number(m.dead_time_s)
        ),
        ProcessModel::Rational(m) => {
            format!("num {}, den {}, L {} s", numbers(&m.num), numbers(&m.den), number(m.dead_time_s))
        }
    }
}

/// Everything in lines and tables.
pub(super) fn words(
    network: &Network,
    configuration: Option<&str>,
    linear: &Linearisation,
    side: CurveSide,
) -> String {
    let (spec, model, at) = (&network.spec, &linear.model, &linear.point);
    let names = model.ports();
    let full = |ports: &[Port]| -> Vec<String> {
        ports.iter().map(|p| format!("{} ({})", p.name, p.unit)).collect()
    };
    let (states, inputs, outputs) = (full(&names.states), full(&names.inputs), full(&names.outputs));
    let mut text = format!("{} {}\n", spec.id, configuration.unwrap_or_default()).trim_end().to_owned();
    let levels = spec.tanks.iter().zip(&at.levels_cm).map(|(t, h)| format!("{} {} cm", t.id, number(*h)));
    let pumps = spec.pumps.iter().zip(&at.inputs);
    let pumps = pumps.map(|(p, u)| format!("{} {} {}", p.id, number(*u), p.unit.symbol()));
    let angles = spec.valves.iter().zip(&at.angles_deg).map(|(v, a)| format!("{} {}°", v.id, number(*a)));
    text.push_str(&format!("\nat {}\n", levels.chain(pumps).chain(angles).collect::<Vec<_>>().join(", ")));
    for (matrix, title, to, from) in [
        (model.a(), "A (1/s)", &states, &states),
        (model.b(), "B", &states, &inputs),
        (model.c(), "C", &outputs, &states),
    ] {
        text.push_str(&format!("\n{}", named(matrix, title, to, from)));
    }
    text.push_str("\nD = 0\n");
    text.push_str(&format!("dead times (s): {}\n", numbers(model.input_delays_s())));
    text.push_str(&format!("poles (1/s): {}\n", roots(&model.poles())));
    text.push_str(&format!("zeros (1/s): {}\n", roots(&model.zeros())));
    text.push_str(&format!("time constants (s): {}\n", numbers(&time_constants(model))));
    text.push_str(&format!("\n{}", named(&model.dc_gain(), "gain at rest", &outputs, &inputs)));
    if let Some(rga) = relative_gains(model) {
        text.push_str(&format!("\n{}", named(&rga, "relative gains", &outputs, &inputs)));
    }
    for c in channels(model) {
        text.push_str(&format!("\n{} → {}\n", inputs[c.input], outputs[c.output]));
        for (name, value) in channel_lines(&c) {
            text.push_str(&format!("  {name}: {value}\n"));
        }
    }
    for remark in remarks(network, linear, side) {
        text.push_str(&format!("\nnote: {remark}"));
    }
    text
}

fn channel_lines(c: &Channel) -> Vec<(&'static str, String)> {
    if c.exact.gain == 0.0 {
        return vec![("transfer function", "0".to_owned())];
    }
    let tf = c.exact.transfer_function();
    let reduced = |model: &Result<ProcessModel, String>| model.as_ref().map_or_else(Clone::clone, in_words);
    let fit = |fit: &StepFit| format!("{}, fit {} %", in_words(&fit.model), number(fit.fit_percent));
    vec![
        ("numerator", numbers(&tf.num)),
        ("denominator", numbers(&tf.den)),
        ("dead time (s)", number(tf.dead_time_s)),
        ("zeros (1/s)", roots(&c.exact.zeros)),
        ("poles (1/s)", roots(&c.exact.poles)),
        ("first order, half rule", reduced(&c.first)),
        ("second order, half rule", reduced(&c.second)),
        ("first order, step fit", c.fit.as_ref().map_or_else(Clone::clone, fit)),
    ]
}
