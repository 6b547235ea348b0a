//! `vasos tune --optimal`: the best gains under limits, with their certificate.

use serde_json::{Map, Value, json};
use vasos_engine::analyze::{Analysis, CoarseStep, FrequencyResponse, OpenLoop};
use vasos_engine::control::ParallelGains;
use vasos_engine::model::ProcessModel;
use vasos_engine::tune::optimum::{
    DerivativeFilter, LoopLimits, Objective, Optimum, OptimumError, OptimumProblem, Process, Wanted, optimum,
};
use vasos_engine::tune::{ControllerKind, SetpointSide, setpoint_side};
use vasos_io::frequency_response::read_frequency_response;

use super::json::{self, shown, table};
use super::tune::{self, Arguments};
use super::{Answer, Refusal};

/// What is asked, as it came from the command line.
struct Question {
    kind: ControllerKind,
    wanted: Wanted,
    objective: Objective,
    limits: LoopLimits,
    overshoot_percent: Option<f64>,
}

pub(super) fn run(arguments: &Arguments, models: &[ProcessModel]) -> Result<Answer, Refusal> {
    let question = question(arguments)?;
    let mut processes: Vec<Process> = models.iter().cloned().map(Process::Model).collect();
    for path in &arguments.response {
        processes.push(Process::Measured(read_frequency_response(path).map_err(Refusal::of)?));
    }
    let processes = processes;
    let found = optimum(&OptimumProblem {
        processes: &processes,
        wanted: question.wanted,
        objective: question.objective,
        limits: question.limits,
    });
    match found {
        Ok(found) => Ok(answer(arguments.json, &processes, &question, &found)),
        Err(error) if error.is_answer() => Ok(refusal(arguments.json, &processes, &question, &error)),
        Err(error) => Err(Refusal::of(error)),
    }
}

fn question(arguments: &Arguments) -> Result<Question, Refusal> {
    let kind = arguments.controller.as_deref().map_or(Ok(ControllerKind::Pi), tune::controller)?;
    let objective = arguments.objective.as_deref().map_or(Ok(Objective::Jv), |name| {
        Objective::from_id(name).ok_or_else(|| {
            let known: Vec<&str> = Objective::ALL.iter().map(|o| o.id()).collect();
            Refusal(format!("there is no objective '{name}': choose one of {}", known.join(", ")))
        })
    })?;
    let none = arguments.ms.or(arguments.mt).or(arguments.ju).is_none();
    let limits = LoopLimits {
        ms: arguments.ms.unwrap_or(if none { LoopLimits::DEFAULT.ms } else { f64::INFINITY }),
        mt: arguments.mt.unwrap_or(f64::INFINITY),
        ju: arguments.ju.unwrap_or(f64::INFINITY),
    };
    let wanted = match (kind, arguments.filter.as_deref()) {
        (ControllerKind::Pi, None) => Wanted::Pi,
        (ControllerKind::Pi, Some(_)) => {
            return Err(Refusal("--filter belongs to --controller pid: a PI has no derivative".to_owned()));
        }
        (ControllerKind::Pid, None) => Wanted::pid(&limits),
        (ControllerKind::Pid, Some("free")) => Wanted::Pid(DerivativeFilter::Free),
        (ControllerKind::Pid, Some(text)) => {
            let n = text.parse::<f64>().map_err(|_| {
                Refusal(format!("--filter '{text}' is not usable: write a number greater than 0, or free"))
            })?;
            Wanted::Pid(DerivativeFilter::Ratio(n))
        }
        (ControllerKind::P | ControllerKind::Pd, _) => {
            return Err(Refusal(format!(
                "an optimal {kind} controller would have no integral action: choose --controller pi or pid"
            )));
        }
    };
    if let Some(percent) = arguments.overshoot
        && !(0.0..=100.0).contains(&percent)
    {
        return Err(Refusal(format!("--overshoot {percent} is not usable: give percent from 0 to 100")));
    }
    Ok(Question { kind, wanted, objective, limits, overshoot_percent: arguments.overshoot })
}

/// The worst of the loops, measure by measure.
fn worst(processes: &[Process], gains: &ParallelGains) -> Analysis {
    // The optimum stands on a response that is long enough.
    let of = |process: &Process| process.analyze(gains).unwrap_or_default();
    let all: Vec<Analysis> = processes.iter().map(of).collect();
    let by = |of: fn(&Analysis) -> Option<f64>, pick: fn(f64, f64) -> f64| {
        all.iter().map(of).reduce(|a, b| a.zip(b).map(|(a, b)| pick(a, b))).flatten()
    };
    let smallest = |of: fn(&Analysis) -> Option<f64>| all.iter().filter_map(of).reduce(f64::min);
    Analysis {
        ms: by(|a| a.ms, f64::max),
        mt: by(|a| a.mt, f64::max),
        jv: by(|a| a.jv, f64::max),
        ju: by(|a| a.ju, f64::max),
        gain_margin: smallest(|a| a.gain_margin),
        phase_margin_deg: smallest(|a| a.phase_margin_deg),
        stable: all.iter().all(|a| a.stable),
        ..all[0]
    }
}

/// Kc, Ti, Td, N, Ki, Kd; what a pure integrator or a PI does not have is null.
pub(super) fn add_gains(to: &mut Map<String, Value>, kind: ControllerKind, gains: &ParallelGains) {
    let ParallelGains { kp, ki, kd, tf_s } = *gains;
    let integral_alone = kp == 0.0;
    let td_s = if kd == 0.0 { 0.0 } else { kd / kp };
    to.insert("controller".into(), json!(kind.id()));
    for (key, value) in [
        ("Kc", Some(kp)),
        ("Ti_s", (!integral_alone).then_some(kp / ki)),
        ("Td_s", Some(td_s)),
        ("N", (kd != 0.0).then_some(td_s / tf_s)),
        ("Ki", Some(ki)),
        ("Kd", Some(kd + 0.0)),
    ] {
        to.insert(key.into(), json!(value));
    }
}

fn limits_json(limits: &LoopLimits) -> Value {
    json!({"Ms": limits.ms, "Mt": limits.mt, "Ju": limits.ju})
}

fn whole(processes: &[Process], result: Value) -> String {
    let described = |process: &Process| match process {
        Process::Model(model) => json::model(model),
        Process::Measured(response) => json::response(response),
    };
    let mut to = Map::new();
    to.insert("model".into(), described(&processes[0]));
    if processes.len() > 1 {
        to.insert("models".into(), processes.iter().map(described).collect());
    }
    to.insert("results".into(), json!([result]));
    json::text(&Value::Object(to))
}

/// What an engineer should know before typing these gains in.
fn warnings(gains: &ParallelGains) -> Vec<String> {
    let mut found = Vec::new();
    if gains.kp == 0.0 {
        found.push(
            "a pure integrator is best here: a controller with Kc and Ti cannot be set to it; raise a limit for some proportional action".to_owned(),
        );
    } else if gains.kd != 0.0 && gains.kp / gains.ki < 4.0 * gains.kd / gains.kp {
        found.push(
            "Ti < 4·Td: the controller's zeros are complex, and no series form has these gains".to_owned(),
        );
    }
    found
}

/// What a response leaves unseen between its points.
pub(super) fn coarse(response: &FrequencyResponse, gains: &ParallelGains) -> Option<String> {
    let steps = response.coarse_steps(gains);
    let worst = steps.iter().max_by(|a, b| a.phase_deg.abs().total_cmp(&b.phase_deg.abs()))?;
    let between = |s: &CoarseStep| format!("{} and {}", shown(Some(s.from_rad_s)), shown(Some(s.to_rad_s)));
    let all: Vec<String> = steps.iter().map(between).collect();
    Some(format!(
        "the points lie too far apart for these gains to be relied on: between {} rad/s the phase changes by {}° and the gain by a factor of {}, and a peak there is not seen; measure more frequencies between {} rad/s",
        between(worst),
        shown(Some(worst.phase_deg.round())),
        shown(Some(worst.gain_ratio)),
        all.join(", between ")
    ))
}

fn answer(as_json: bool, processes: &[Process], question: &Question, found: &Optimum) -> Answer {
    let analysis = worst(processes, &found.gains);
    let first = processes.iter().find_map(|p| match p {
        Process::Model(model) => Some(OpenLoop::of_parallel(model, &found.gains)),
        Process::Measured(_) => None,
    });
    let side = |percent: f64| first.as_ref().and_then(|open| setpoint_side(open, percent));
    let weights = question.overshoot_percent.map(|percent| (percent, side(percent)));
    let mut remarks = warnings(&found.gains);
    for process in processes {
        if let Process::Measured(response) = process {
            remarks.extend(coarse(response, &found.gains));
        }
    }
    if let Some((percent, None)) = weights {
        remarks.push(format!("no weight and no filter of the setpoint holds the overshoot at {percent} %"));
    }
    let text = if as_json {
        whole(processes, result(question, found, &analysis, weights.and_then(|w| w.1), &remarks))
    } else {
        as_table(question, found, &analysis, weights.and_then(|w| w.1), &remarks)
    };
    Answer::done(text)
}

fn result(
    question: &Question,
    found: &Optimum,
    analysis: &Analysis,
    weights: Option<SetpointSide>,
    remarks: &[String],
) -> Value {
    let mut to = Map::new();
    to.insert("rule".into(), json!("optimal"));
    add_gains(&mut to, question.kind, &found.gains);
    json::add_analysis(&mut to, analysis);
    json::add_remarks(&mut to, true, remarks);
    to.insert("objective".into(), json!(question.objective.id()));
    to.insert("value".into(), json!(found.value));
    to.insert("limits".into(), limits_json(&question.limits));
    to.insert("active".into(), json!(found.certificate.active));
    let c = &found.certificate;
    to.insert("certificate".into(), json!({"gap": c.gap, "excess": c.excess, "rounds": c.rounds}));
    if question.overshoot_percent.is_some() {
        to.insert("b".into(), json!(weights.map(|w| w.b)));
        to.insert("c".into(), json!(weights.map(|_| 0.0)));
        to.insert("setpoint_filter_s".into(), json!(weights.map(|w| w.filter_s)));
        to.insert("overshoot_percent".into(), json!(weights.map(|w| w.overshoot_percent)));
    }
    Value::Object(to)
}

fn as_table(
    question: &Question,
    found: &Optimum,
    a: &Analysis,
    weights: Option<SetpointSide>,
    remarks: &[String],
) -> String {
    let ParallelGains { kp, ki, kd, tf_s } = found.gains;
    let some = |v: f64| Some(v).filter(|v| v.is_finite());
    let limit = |value: f64| {
        if value.is_finite() { format!("  (limit {})", shown(Some(value))) } else { String::new() }
    };
    let mut rows = vec![
        vec!["Kc".to_owned(), shown(some(kp))],
        vec!["Ti (s)".to_owned(), shown(some(kp / ki).filter(|_| kp != 0.0))],
    ];
    if question.kind == ControllerKind::Pid {
        rows.push(vec!["Td (s)".to_owned(), shown(Some(if kd == 0.0 { 0.0 } else { kd / kp }))]);
        rows.push(vec!["N".to_owned(), shown((kd != 0.0).then(|| kd / kp / tf_s))]);
    }
    rows.push(vec!["Ki".to_owned(), shown(some(ki))]);
    let l = &question.limits;
    let limited = [("Ms", a.ms, l.ms), ("Mt", a.mt, l.mt), ("Ju", a.ju, l.ju)];
    rows.extend(limited.map(|(name, value, most)| vec![name.to_owned(), shown(value), limit(most)]));
    rows.push(vec!["Jv".to_owned(), shown(a.jv)]);
    rows.push(vec!["gain margin".to_owned(), shown(a.gain_margin)]);
    rows.push(vec!["phase margin (°)".to_owned(), shown(a.phase_margin_deg)]);
    if let Some(w) = weights {
        rows.push(vec!["setpoint weight b".to_owned(), shown(Some(w.b))]);
        rows.push(vec!["setpoint filter (s)".to_owned(), shown(Some(w.filter_s))]);
        rows.push(vec!["overshoot (%)".to_owned(), shown(Some(w.overshoot_percent))]);
    }
    let active: Vec<String> = found.certificate.active.iter().map(ToString::to_string).collect();
    let bound = match (active.is_empty(), found.certificate.gap) {
        (true, _) => "No limit binds.".to_owned(),
        (false, Some(gap)) => {
            format!(
                "Held by {}; the search and the exact check agree to {} %.",
                active.join(", "),
                shown(Some(100.0 * gap))
            )
        }
        (false, None) => format!("Held by {}.", active.join(", ")),
    };
    format!("{}{bound}\n{}", table(&rows), remarks.join("\n"))
}

fn refusal(as_json: bool, processes: &[Process], question: &Question, error: &OptimumError) -> Answer {
    let reason = error.to_string();
    if !as_json {
        return Answer { text: String::new(), remarks: vec![reason], status: 1 };
    }
    let mut to = Map::new();
    to.insert("rule".into(), json!("optimal"));
    json::add_gains(&mut to, question.kind, None);
    json::add_analysis(&mut to, &Analysis::default());
    json::add_remarks(&mut to, false, std::slice::from_ref(&reason));
    to.insert("objective".into(), json!(question.objective.id()));
    to.insert("limits".into(), limits_json(&question.limits));
    to.insert("active".into(), json!([]));
    let mut floor = Map::new();
    if let OptimumError::Infeasible { limit, floor: value, .. }
    | OptimumError::InfeasibleAtFilter { limit, floor: value, .. }
    | OptimumError::InfeasibleTogether { limit, floor: value, .. } = error
    {
        floor.insert(limit.to_string(), json!(value));
    }
    to.insert("floor".into(), Value::Object(floor));
    Answer { text: whole(processes, Value::Object(to)), remarks: vec![reason], status: 1 }
}
