//! JSON of models and results, and the text beside it. Keys are an interface: stable, documented in the io spec.

use serde_json::{Map, Value, json};
use vasos_engine::analyze::{Analysis, FrequencyResponse, StepFigures};
use vasos_engine::control::PidGains;
use vasos_engine::explain::number;
use vasos_engine::model::ProcessModel;
use vasos_engine::tune::ControllerKind;

/// A model with its structure; times in seconds.
pub fn model(model: &ProcessModel) -> Value {
    match model {
        ProcessModel::Fopdt(m) => {
            json!({"structure": "fopdt", "K": m.gain, "T_s": m.time_constant_s, "L_s": m.dead_time_s})
        }
        ProcessModel::Ipdt(m) => {
            json!({"structure": "ipdt", "Kv": m.velocity_gain, "L_s": m.dead_time_s})
        }
        ProcessModel::Sopdt(m) => json!({
            "structure": "sopdt",
            "K": m.gain,
            "T1_s": m.time_constant_1_s,
            "T2_s": m.time_constant_2_s,
            "Tz_s": m.zero_time_constant_s,
            "L_s": m.dead_time_s,
        }),
        ProcessModel::Rational(m) => {
            json!({"structure": "rational", "num": m.num, "den": m.den, "L_s": m.dead_time_s})
        }
    }
}

/// A measured frequency response by its range.
pub fn response(response: &FrequencyResponse) -> Value {
    json!({
        "structure": "frequency_response",
        "omega_rad_s": [response.first_omega(), response.last_omega()],
        "points": response.points(),
    })
}

/// Adds gains of the ideal form and Ki, Kd of the parallel one; without gains every number is null.
pub fn add_gains(to: &mut Map<String, Value>, kind: ControllerKind, gains: Option<&PidGains>) {
    to.insert("controller".into(), json!(kind.id()));
    let with = |f: fn(&PidGains) -> f64| gains.map(f);
    for (key, value) in [
        ("Kc", with(|g| g.kc)),
        ("Ti_s", with(|g| g.ti_s)),
        ("Td_s", with(|g| g.td_s)),
        // Without derivative action there is no filter.
        ("N", gains.filter(|g| g.td_s != 0.0).map(|g| g.n)),
        ("Ki", with(PidGains::ki)),
        ("Kd", with(PidGains::kd)),
    ] {
        // No −0, which a negative Kc makes of what is absent.
        to.insert(key.into(), json!(value.map(|v| v + 0.0)));
    }
}

/// Adds what the loop is worth.
pub fn add_analysis(to: &mut Map<String, Value>, a: &Analysis) {
    to.insert("stable".into(), json!(a.stable));
    for (key, value) in [
        ("Ms", a.ms),
        ("Mt", a.mt),
        ("Ju", a.ju),
        ("Jv", a.jv),
        ("gain_margin", a.gain_margin),
        ("phase_margin_deg", a.phase_margin_deg),
    ] {
        to.insert(key.into(), json!(value));
    }
}

/// Adds frequencies, the delay margin and the figures of the step responses.
pub fn add_figures(to: &mut Map<String, Value>, a: &Analysis, figures: &StepFigures) {
    for (key, value) in [
        ("w_gc_rad_s", a.w_gc_rad_s),
        ("w_180_rad_s", a.w_180_rad_s),
        ("delay_margin_s", a.delay_margin_s),
        ("iae_load", figures.iae_load),
        ("iae_setpoint", figures.iae_setpoint),
        ("overshoot_percent", figures.overshoot_percent),
    ] {
        to.insert(key.into(), json!(value));
    }
}

/// Adds whether the rule was in its range, and what has to be said.
pub fn add_remarks(to: &mut Map<String, Value>, valid: bool, warnings: &[String]) {
    to.insert("valid".into(), json!(valid));
    to.insert("warnings".into(), json!(warnings));
}

/// As printed to a pipe.
pub fn text(value: &Value) -> String {
    format!("{value:#}")
}

/// A number for people; – for what does not exist.
pub fn shown(value: Option<f64>) -> String {
    value.filter(|v| !v.is_nan()).map_or_else(|| "–".to_owned(), number)
}

/// Rows of words in aligned columns, the first column to the left, the others to the right.
pub fn table(rows: &[Vec<String>]) -> String {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |c: usize| rows.iter().filter_map(|r| r.get(c)).map(|w| w.chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let mut text = String::new();
    for row in rows {
        let mut line = String::new();
        for (column, (word, width)) in row.iter().zip(&widths).enumerate() {
            let gap = " ".repeat(width - word.chars().count());
            let (before, after) = if column == 0 { ("", gap.as_str()) } else { (gap.as_str(), "") };
            line.push_str(&format!("{before}{word}{after}  "));
        }
        text.push_str(line.trim_end());
        text.push('\n');
    }
    text
}
