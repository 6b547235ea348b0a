//! What `vasos identify` prints.

use serde_json::{Map, Value, json};
use vasos_engine::explain::number;
use vasos_engine::identify::{
    ControllerFit, CurveMethod, FitError, LoopStudy, ModelFit, Parameter, ReactionCurve, Structure,
};
use vasos_io::log::ImportedLog;

use crate::cli::Answer;
use crate::cli::json::{self, shown, table};
use crate::cli::log_columns::Chosen;

pub(super) fn of(
    as_json: bool,
    chosen: &Chosen,
    study: &LoopStudy,
    log: &ImportedLog,
    mut warnings: Vec<String>,
) -> Answer {
    let repairs: Vec<String> = crate::cli::logs::repairs(&log.report);
    let usable = study.has_model();
    if let Ok(choice) = &study.choice {
        warnings.extend(choice.chosen().verdicts.iter().skip(1).map(ToString::to_string));
    }
    warnings.extend(study.findings.iter().map(ToString::to_string));
    let remarks = match &study.choice {
        Err(error) => vec![error.to_string()],
        Ok(choice) if !usable => vec![choice.chosen().verdict().to_string()],
        Ok(_) => vec![],
    };
    let status = u8::from(!usable);
    if as_json {
        let text = json::text(&whole(chosen, study, &repairs, &warnings));
        return Answer { text, remarks, status };
    }
    // Figures of a fit that is no model must not stand alone in a pipe or a report.
    let mut text = remarks.iter().map(|reason| format!("no model: {reason}\n")).collect::<String>()
        + &text(chosen, study);
    text.push_str(&study.reaction_curve.as_ref().map_or_else(|_| String::new(), curve_text));
    for line in warnings.iter().chain(&repairs) {
        text.push_str(&format!("note: {line}\n"));
    }
    Answer { text, remarks, status }
}

/// The answer where the log holds still: no model, with the reason.
pub(super) fn nothing(
    as_json: bool,
    chosen: &Chosen,
    log: &ImportedLog,
    warnings: Vec<String>,
    reason: &FitError,
) -> Answer {
    let repairs: Vec<String> = crate::cli::logs::repairs(&log.report);
    let text = if as_json {
        json::text(&json!({
            "columns": chosen.json(), "models": [], "chosen": null, "repairs": repairs, "warnings": warnings,
        }))
    } else {
        let notes: String = warnings.iter().chain(&repairs).map(|line| format!("note: {line}\n")).collect();
        format!("no model: {reason}\n{notes}")
    };
    Answer { text, remarks: vec![reason.to_string()], status: 1 }
}

fn whole(chosen: &Chosen, study: &LoopStudy, repairs: &[String], warnings: &[String]) -> Value {
    let models: Vec<Value> = study.choice.iter().flat_map(|c| &c.fits).map(model).collect();
    let structure = |fit: &ModelFit| fit.structure.key();
    let choice = study.choice.as_ref().ok();
    json!({
        "columns": chosen.json(),
        "models": models,
        "chosen": choice.filter(|c| c.chosen().is_usable()).map(|c| structure(c.chosen())),
        "runner_up": choice.and_then(|c| c.runner_up()).map(structure),
        "criterion": choice.map_or(vec![], |c| c.criterion.clone()),
        "controller": study.controller.as_ref().map(controller),
        "oscillation": study.oscillation.map(|o| json!({
            "period_s": o.period_s, "regularity": o.regularity, "stiction_index": o.stiction_index,
            "stiction_band": o.stiction_band, "sticks": o.sticks(),
        })),
        "reaction_curve": study.reaction_curve.as_ref().ok().map(|c| c.estimates.iter().map(|e| json!({
            "method": e.method.key(), "K": e.model.gain, "T_s": e.model.time_constant_s,
            "L_s": e.model.dead_time_s, "r2": e.r2,
        })).collect::<Vec<_>>()),
        "repairs": repairs,
        "warnings": warnings,
    })
}

/// Parameters under the names of the specs, and their intervals.
fn add_parameters(to: &mut Map<String, Value>, parameters: &[Parameter]) {
    let mut intervals = Map::new();
    for p in parameters {
        to.insert(p.name.into(), json!(p.value));
        intervals.insert(p.name.into(), json!(p.interval_95));
    }
    to.insert("interval_95".into(), Value::Object(intervals));
}

/// A fit under the names of the specs.
pub(super) fn model(fit: &ModelFit) -> Value {
    let mut out = Map::new();
    out.insert("structure".into(), json!(fit.structure.key()));
    add_parameters(&mut out, &fit.parameters);
    let tests = &fit.tests;
    for (key, value) in [
        ("bias", json!(fit.bias)),
        ("mv_at_rest", json!(fit.mv_at_rest)),
        ("drift_per_s", json!(fit.drift.map(|d| d.0))),
        (
            "loads",
            json!(
                fit.loads
                    .iter()
                    .map(|load| json!({
                        "at_s": load.at_s, "at_interval_95_s": load.at_interval_95, "change": load.change,
                        "change_interval_95": load.change_interval_95, "integrates": load.integrates(),
                    }))
                    .collect::<Vec<_>>()
            ),
        ),
        ("fit_percent", json!(fit.fit_percent)),
        ("r2", json!(fit.r2)),
        ("mse", json!(fit.mse)),
        ("aic", json!(fit.aic)),
        ("rows", json!(fit.rows)),
        ("verdict", json!(fit.verdict().to_string())),
        ("verdicts", json!(fit.verdicts.iter().map(ToString::to_string).collect::<Vec<_>>())),
        (
            "residuals",
            json!({
                "white": tests.is_white(), "white_probability": tests.white_probability,
                "follow_input": tests.follows_input(), "rows_per_independent": tests.rows_per_independent,
                "autocorrelation": tests.autocorrelation, "autocorrelation_band": tests.autocorrelation_band,
                "cross_correlation": tests.cross_correlation,
                "cross_correlation_band": tests.cross_correlation_band,
            }),
        ),
    ] {
        out.insert(key.into(), value);
    }
    if !fit.disturbances.is_empty() {
        let disturbances = fit.disturbances.iter().map(|d| {
            let mut one = Map::new();
            one.insert("column".into(), json!(d.name));
            add_parameters(&mut one, &d.parameters);
            Value::Object(one)
        });
        out.insert("disturbances".into(), disturbances.collect());
    }
    Value::Object(out)
}

pub(super) fn controller(c: &ControllerFit) -> Value {
    json!({
        "Kc": c.kc, "Ti_s": c.ti_s, "Td_s": c.td_s, "b": c.setpoint_weight, "r2": c.r2, "rows": c.rows,
        "interval_95": {"Kc": c.kc_interval_95, "Ti_s": c.ti_interval_95, "Td_s": c.td_interval_95},
    })
}

fn curve_text(curve: &ReactionCurve) -> String {
    let mut rows = vec![["reaction curve", "K", "T (s)", "L (s)", "R²"].map(str::to_owned).to_vec()];
    for e in &curve.estimates {
        let way = match e.method {
            CurveMethod::Tangent => "tangent",
            CurveMethod::TwoPoints => "two points",
            CurveMethod::Onset => "begin and 63.2 %",
            CurveMethod::Area => "area",
            CurveMethod::LeastSquares => "least squares",
        };
        let numbers = [e.model.gain, e.model.time_constant_s, e.model.dead_time_s, e.r2];
        let mut row = vec![way.to_owned()];
        row.extend(numbers.map(|value| shown(Some(value))));
        rows.push(row);
    }
    table(&rows)
}

fn between(interval: [f64; 2]) -> String {
    if interval.iter().any(|end| end.is_nan()) || interval[1] == f64::INFINITY && interval[0] <= 0.0 {
        return "unknown".to_owned();
    }
    if interval[1] == f64::INFINITY {
        return format!("from {}", number(interval[0]));
    }
    format!("{} to {}", number(interval[0]), number(interval[1]))
}

/// Name of a parameter as a table shows it.
fn label(name: &str) -> String {
    name.strip_suffix("_s").map_or(name.to_owned(), |symbol| format!("{symbol} (s)"))
}

fn title(structure: Structure) -> &'static str {
    match structure {
        Structure::Fopdt => "fopdt",
        Structure::Ipdt => "ipdt",
        Structure::Sopdt => "sopdt",
        Structure::SopdtZero => "sopdt with zero",
    }
}

fn parameter_row(p: &Parameter) -> Vec<String> {
    vec![label(p.name), shown(Some(p.value)), between(p.interval_95)]
}

/// Structure, then a parameter a row with its interval.
pub(super) fn parameter_rows(fit: &ModelFit) -> Vec<Vec<String>> {
    let head = vec![title(fit.structure).to_owned(), String::new(), "95 % interval".to_owned()];
    std::iter::once(head).chain(fit.parameters.iter().map(parameter_row)).collect()
}

fn text(chosen: &Chosen, study: &LoopStudy) -> String {
    let mut out = String::new();
    if let Ok(choice) = &study.choice {
        let fit = choice.chosen();
        out.push_str(&format!("PV {}, MV {}, {} rows\n", chosen.pv, chosen.mv, fit.rows));
        let parameter = |p: &Parameter| vec![label(p.name), shown(Some(p.value)), between(p.interval_95)];
        let mut rows = vec![vec![title(fit.structure).to_owned(), String::new(), "95 % interval".to_owned()]];
        rows.extend(fit.parameters.iter().map(parameter));
        for d in &fit.disturbances {
            rows.push(vec![format!("from {}", d.name)]);
            rows.extend(d.parameters.iter().map(parameter_row));
        }
        for (name, value) in
            [("bias", fit.bias), ("MV at rest", fit.mv_at_rest), ("fit (%)", Some(fit.fit_percent))]
        {
            if value.is_some() {
                rows.push(vec![name.to_owned(), shown(value)]);
            }
        }
        out.push_str(&table(&rows));
        if fit.is_usable() {
            out.push_str(&format!("{}\n", fit.verdict()));
        }
        if let Some(next) = choice.runner_up() {
            out.push_str(&format!(
                "next best: {}, fit {} %, criterion {} more\n",
                title(next.structure),
                number(next.fit_percent),
                number(choice.criterion[1])
            ));
        }
    }
    if let Some(c) = &study.controller {
        let mut rows = vec![vec![
            "controller in the log".to_owned(),
            String::new(),
            format!("95 % interval; explains {} % of the MV's moves", number((100.0 * c.r2).round())),
        ]];
        rows.push(vec!["Kc".to_owned(), shown(Some(c.kc)), between(c.kc_interval_95)]);
        for (name, value, interval) in
            [("Ti (s)", c.ti_s, c.ti_interval_95), ("Td (s)", c.td_s, c.td_interval_95)]
        {
            if let (Some(value), Some(interval)) = (value, interval) {
                rows.push(vec![name.to_owned(), shown(Some(value)), between(interval)]);
            }
        }
        out.push_str(&table(&rows));
    }
    out
}
