//! What `vasos retune` prints for one log.

use serde_json::{Map, Value, json};
use vasos_engine::analyze::Analysis;
use vasos_engine::control::{
    Form, FormGains, PidGains, SeriesGains, proportional_band_percent, repeats_per_min, repeats_per_s,
};
use vasos_engine::explain::number;
use vasos_engine::retune::{Candidate, Retuning};
use vasos_engine::tune::optimum::LoopLimits;

use super::Task;
use super::one::Outcome;
use crate::cli::identify;
use crate::cli::json::{self, shown, table};
use crate::tr;

pub(super) fn json(outcome: &Outcome, task: &Task) -> String {
    json::text(&value(outcome, task))
}

pub(super) fn value(outcome: &Outcome, task: &Task) -> Value {
    let rows = &outcome.log.stretch.rows;
    let retuning = &outcome.retuning;
    let choice = outcome.study.choice.as_ref().ok();
    let gain = retuning.gain();
    let recommended = retuning.choice();
    json!({
        "log": {
            "file": outcome.name, "sha256": outcome.sha256, "rows": rows.time_s.len(),
            "from_s": rows.time_s.first(), "to_s": rows.time_s.last(),
        },
        "columns": outcome.log.columns.json(),
        "limits": limits(&task.options.limits),
        "model": choice.filter(|_| outcome.study.has_model()).map(|c| identify::model_json(c.chosen())),
        "controller_in_log": outcome.study.controller.as_ref().map(identify::controller_json),
        "findings": outcome.study.findings.iter().map(ToString::to_string).collect::<Vec<_>>(),
        "oscillation": outcome.study.oscillation.map(|o| json!({
            "period_s": o.period_s, "regularity": o.regularity, "stiction_index": o.stiction_index,
            "stiction_band": o.stiction_band, "sticks": o.sticks(),
        })),
        "present": retuning.present().map(|c| candidate(c, task)),
        "candidates": retuning.candidates.iter().map(|c| candidate(c, task)).collect::<Vec<_>>(),
        "draws": retuning.draws.len(),
        "seed": task.options.seed,
        "recommended": recommended.map(|c| c.rule.id()),
        "recommended_controller": recommended.map(|c| c.controller.id()),
        "reason": outcome.reason(),
        "gain_percent": gain.map(|g| g.1),
        "gain_measure": gain.map(|g| g.0),
        "warnings": outcome.warnings(),
        "repairs": outcome.repairs(),
    })
}

fn limits(limits: &LoopLimits) -> Value {
    json!({"Ms": limits.ms, "Mt": limits.mt, "Ju": limits.ju})
}

/// A number, or null where JSON has none.
fn finite(value: f64) -> Option<f64> {
    Some(value).filter(|v| v.is_finite())
}

fn candidate(one: &Candidate, task: &Task) -> Value {
    let mut to = Map::new();
    to.insert("rule".into(), json!(one.rule.id()));
    let ideal = one.ideal();
    json::add_gains(&mut to, one.controller, ideal.as_ref());
    // A pure integrator has no ideal form, but these.
    to.insert("Ki".into(), json!(one.gains.ki));
    to.insert("Kd".into(), json!(one.gains.kd));
    json::add_analysis(&mut to, &one.analysis);
    json::add_figures(&mut to, &one.analysis, &one.figures);
    let quantiles = one.spread.as_ref().map(|s| [s.ms.low, s.ms.middle, s.ms.high].map(finite));
    to.insert("unstable_share".into(), json!(one.unstable_share()));
    to.insert("ms_quantiles".into(), json!(quantiles));
    to.insert("forms".into(), forms(one, ideal.as_ref()));
    to.insert("dcs".into(), ideal.as_ref().map_or(Value::Null, |g| dcs(g, task)));
    let warnings: Vec<String> = one.warnings.iter().map(ToString::to_string).collect();
    json::add_remarks(&mut to, one.valid(), &warnings);
    Value::Object(to)
}

/// The same gains in the series form, where it has them.
pub(super) fn series(one: &Candidate) -> Option<SeriesGains> {
    match FormGains::Parallel(one.gains).to_form(Form::Series) {
        Ok(FormGains::Series(gains)) => Some(gains),
        _ => None,
    }
}

fn forms(one: &Candidate, ideal: Option<&PidGains>) -> Value {
    let series = series(one).map(|s| json!({"Kc": s.kc, "Ti_s": finite(s.ti_s), "Td_s": s.td_s, "N": s.n}));
    json!({
        "ideal": ideal.map(|g| json!({"Kc": g.kc, "Ti_s": finite(g.ti_s), "Td_s": g.td_s, "N": g.n})),
        "parallel": {"Kp": one.gains.kp, "Ki": one.gains.ki, "Kd": one.gains.kd, "Tf_s": one.gains.tf_s},
        "series": series,
    })
}

fn dcs(gains: &PidGains, task: &Task) -> Value {
    let band = task.spans.map(|(mv, pv)| proportional_band_percent(gains.kc.abs(), mv, pv));
    json!({
        "action": action(gains),
        "PB_percent": band,
        "Ti_min": finite(gains.ti_s / 60.0),
        "repeats_per_min": repeats_per_min(gains.ti_s),
        "repeats_per_s": repeats_per_s(gains.ti_s),
        "Td_min": gains.td_s / 60.0,
    })
}

/// What a controller calls the sign of its gain.
pub(super) fn action(gains: &PidGains) -> &'static str {
    if gains.kc < 0.0 { "direct" } else { "reverse" }
}

/// Name of a candidate for people.
pub(super) fn title(one: &Candidate) -> String {
    match one.rule.id() {
        "optimal_family" => tr!("retuning.optimal_family", controller = one.controller),
        "optimal" => tr!("retuning.optimal", controller = one.controller),
        "present" => tr!("retuning.present_one", controller = one.controller),
        // The rules go by the names that the command line knows.
        id => format!("{id} {}", one.controller),
    }
}

/// Head of the table of [`row`].
pub(super) fn head() -> [String; 12] {
    [
        tr!("retuning.tuning"),
        "Kc".to_owned(),
        "Ti (s)".to_owned(),
        "Td (s)".to_owned(),
        "Ms".to_owned(),
        "Mt".to_owned(),
        "Ju".to_owned(),
        "Jv".to_owned(),
        tr!("retuning.iae_load"),
        tr!("retuning.iae_setpoint"),
        tr!("retuning.overshoot"),
        tr!("retuning.unstable"),
    ]
}

/// Kc, Ti, Td and what they are worth, in the order of the table's head.
pub(super) fn row(one: &Candidate) -> Vec<String> {
    let Analysis { ms, mt, ju, jv, .. } = one.analysis;
    let ideal = one.ideal();
    let mut row = vec![title(one)];
    row.push(shown(Some(one.gains.kp)));
    row.push(shown(ideal.map(|g| g.ti_s)));
    row.push(shown(ideal.map(|g| g.td_s)));
    row.extend([ms, mt, ju, jv].map(shown));
    let f = &one.figures;
    row.extend([f.iae_load, f.iae_setpoint, f.overshoot_percent].map(shown));
    row.push(shown(one.unstable_share().map(|s| 100.0 * s)));
    row
}

pub(super) fn text(outcome: &Outcome) -> String {
    let retuning: &Retuning = &outcome.retuning;
    let columns = &outcome.log.columns;
    let mut out = format!("{}\n\n", outcome.reason());
    out.push_str(&format!(
        "PV {}, MV {}, {} rows\n",
        columns.pv,
        columns.mv,
        outcome.log.stretch.rows.time_s.len()
    ));
    if let (Ok(choice), true) = (&outcome.study.choice, outcome.study.has_model()) {
        out.push_str(&table(&identify::model_rows(choice.chosen())));
        out.push_str(&format!("{}\n\n", choice.chosen().verdict()));
    }
    if !retuning.candidates.is_empty() {
        let mut rows = vec![head().to_vec()];
        rows.extend(retuning.candidates.iter().enumerate().map(|(place, one)| {
            let mut row = row(one);
            if retuning.recommended == Some(place) {
                row[0].insert_str(0, "→ ");
            }
            row
        }));
        out.push_str(&table(&rows));
    }
    if let Some((measure, percent)) = retuning.gain() {
        let name = if measure == "Jv" { "Jv" } else { "IAE of a load" };
        let way = if percent < 0.0 { "more" } else { "less" };
        out.push_str(&format!("{name} against the present tuning: {} % {way}\n", number(percent.abs())));
    }
    for line in outcome.warnings().iter().chain(&outcome.repairs()) {
        out.push_str(&format!("note: {line}\n"));
    }
    out
}
