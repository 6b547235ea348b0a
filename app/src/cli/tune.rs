//! `vasos tune`: gains from published rules, each with what it is worth.

use serde_json::{Map, Value, json};
use vasos_engine::analyze::{Analysis, analyze};
use vasos_engine::model::ProcessModel;
use vasos_engine::tune::{
    ControllerKind, Rule, RuleError, RuleOptions, Tuning, find_rule, registry, tune_all,
};

use super::json::{self, shown, table};
use super::{Answer, Refusal, optimal, parse};

/// Arguments of `vasos tune`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  vasos tune --model K=4.9,T=152,L=2 --rule amigo --controller pid --json
  vasos tune --model Kv=0.03,L=2 --rule all
  vasos tune --model K=4.9,T=152,L=2 --optimal --ms 1.4 --controller pi --json
  vasos tune --model K=4.9,T=152,L=2 --model K=4.2,T=110,L=2.6 --optimal --ms 1.6 --ju 20 --controller pid
A rule without --controller gives the richest one it has for the model; --rule all then gives every one.
Exit status 1: the rule has no answer for this model, or no controller meets the limits (the floor is said).")]
pub struct Arguments {
    /// Process model, seconds: K=..,T=..,L=..  Kv=..,L=..  K=..,T1=..,T2=..,L=..[,Tz=..]  num=..,den=..,L=..; several
    /// times for an optimum over the worst of them.
    #[arg(long, required_unless_present = "response", allow_hyphen_values = true)]
    model: Vec<String>,
    /// A measured frequency response in place of a model, for an optimum: CSV with omega_rad_s, re, im, or what vasos
    /// excite --sine --json prints; several times for the worst of them.
    #[arg(long, value_name = "FILE", requires = "optimal")]
    pub(super) response: Vec<std::path::PathBuf>,
    /// Name of a rule, or all.
    #[arg(long, required_unless_present = "optimal", conflicts_with = "optimal")]
    rule: Option<String>,
    /// The best gains under limits on Ms, Mt and Ju; without any limit Ms is 1.4.
    #[arg(long)]
    optimal: bool,
    /// p, pi, pd or pid.
    #[arg(long)]
    pub(super) controller: Option<String>,
    /// Closed-loop time constant (τc or λ) in seconds, for the rules that have one.
    #[arg(long, value_name = "S", conflicts_with = "optimal", allow_hyphen_values = true)]
    tau_c: Option<f64>,
    /// Ku=..,Pu=.. from a test, for the rules that start from them.
    #[arg(long, value_name = "Ku=..,Pu=..", conflicts_with = "optimal", allow_hyphen_values = true)]
    ultimate: Option<String>,
    /// What to make best: jv (least, the default), max-ki, iae-load, iae-setpoint.
    #[arg(long, value_name = "WHAT", requires = "optimal")]
    pub(super) objective: Option<String>,
    /// Largest Ms = max |1/(1 + L)|, greater than 1.
    #[arg(long, value_name = "X", requires = "optimal", allow_hyphen_values = true)]
    pub(super) ms: Option<f64>,
    /// Largest Mt = max |L/(1 + L)|, 1 or more.
    #[arg(long, value_name = "X", requires = "optimal", allow_hyphen_values = true)]
    pub(super) mt: Option<f64>,
    /// Largest Ju = max |C/(1 + L)|, in MV units per PV unit.
    #[arg(long, value_name = "X", requires = "optimal", allow_hyphen_values = true)]
    pub(super) ju: Option<f64>,
    /// N of the derivative filter Td/N of an optimal PID, or free for the best N from 1 to 100; free where Ju is limited,
    /// else 10.
    #[arg(long, value_name = "N", requires = "optimal")]
    pub(super) filter: Option<String>,
    /// Overshoot of a setpoint step in percent, for which the weight b (and a setpoint filter, if need be) is chosen.
    #[arg(long, value_name = "PERCENT", requires = "optimal", allow_hyphen_values = true)]
    pub(super) overshoot: Option<f64>,
    /// Print JSON.
    #[arg(long)]
    pub(super) json: bool,
}

/// A rule applied, and its loop analysed.
struct Applied {
    rule: &'static Rule,
    kind: ControllerKind,
    outcome: Result<(Tuning, Analysis), RuleError>,
}

pub(super) fn run(arguments: &Arguments) -> Result<Answer, Refusal> {
    let models = arguments.model.iter().map(|m| parse::model(m)).collect::<Result<Vec<_>, _>>();
    let models = models.map_err(Refusal::of)?;
    if arguments.optimal {
        return optimal::run(arguments, &models);
    }
    of_an_optimum(arguments)?;
    let [model] = models.as_slice() else {
        return Err(Refusal("rules take one model: leave one, or ask for --optimal".to_owned()));
    };
    let ultimate = arguments.ultimate.as_deref().map(parse::ultimate).transpose().map_err(Refusal::of)?;
    let options = RuleOptions { tau_c_s: arguments.tau_c, ultimate, ..RuleOptions::default() };
    let kind = arguments.controller.as_deref().map(controller).transpose()?;
    let name = arguments.rule.as_deref().unwrap_or_default();
    let worth = |tuning: Tuning| {
        let analysis = analyze(model, &tuning.gains);
        (tuning, analysis)
    };
    let mut remarks = Vec::new();
    let applied: Vec<Applied> = if name == "all" {
        let wanted = |k: ControllerKind| kind.is_none_or(|wanted| wanted == k);
        let all = tune_all(model, &options).into_iter().filter(|(_, k, _)| wanted(*k));
        all.map(|(rule, kind, tuned)| Applied { rule, kind, outcome: tuned.map(worth) }).collect()
    } else {
        let rule = find_rule(name, kind.unwrap_or(ControllerKind::Pid)).ok_or_else(|| unknown_rule(name))?;
        let richest = || rule.controllers.iter().copied().max_by_key(|k| k.id().len());
        not_of_this_rule(arguments, rule)?;
        let first = kind.or_else(richest).unwrap_or(ControllerKind::Pi);
        let mut applied =
            Applied { rule, kind: first, outcome: rule.tune(model, first, &options).map(worth) };
        if kind.is_none() && matches!(applied.outcome, Err(RuleError::NeedsSecondOrder { .. })) {
            remarks.push(format!("{name} gives a PID for second-order models only: this is its PI"));
            let outcome = rule.tune(model, ControllerKind::Pi, &options).map(worth);
            applied = Applied { rule, kind: ControllerKind::Pi, outcome };
        }
        vec![applied]
    };
    let mut answer = answer(arguments.json, model, &applied)?;
    answer.remarks.splice(0..0, remarks);
    Ok(answer)
}

/// Refuses what only an optimum uses.
fn of_an_optimum(arguments: &Arguments) -> Result<(), Refusal> {
    let a = arguments;
    let limits = [("--ms", a.ms), ("--mt", a.mt), ("--ju", a.ju)].map(|(name, v)| (name, v.is_some()));
    let wishes = [
        ("--objective", a.objective.is_some()),
        ("--filter", a.filter.is_some()),
        ("--overshoot", a.overshoot.is_some()),
    ];
    match limits.iter().chain(&wishes).find(|(_, given)| *given) {
        Some((name, _)) => Err(Refusal(format!("{name} belongs to --optimal: rules have their own"))),
        None => Ok(()),
    }
}

/// Refuses what other rules use and this one does not.
fn not_of_this_rule(arguments: &Arguments, rule: &Rule) -> Result<(), Refusal> {
    let refused = |name: &str, uses: fn(&Rule) -> bool| {
        let mut ids: Vec<&str> = registry().iter().filter(|r| uses(r)).map(|r| r.id).collect();
        ids.dedup();
        Err(Refusal(format!(
            "the rule {} does not use {name}: {} do, and all takes it",
            rule.id,
            ids.join(", ")
        )))
    };
    if arguments.tau_c.is_some() && !rule.has_free_time_constant() {
        return refused("--tau-c", Rule::has_free_time_constant);
    }
    if arguments.ultimate.is_some() && !rule.is_closed_loop() {
        return refused("--ultimate", Rule::is_closed_loop);
    }
    Ok(())
}

pub(super) fn controller(name: &str) -> Result<ControllerKind, Refusal> {
    ControllerKind::from_id(name)
        .ok_or_else(|| Refusal(format!("there is no controller '{name}': choose p, pi, pd or pid")))
}

fn unknown_rule(name: &str) -> Refusal {
    let known: Vec<&str> = registry().iter().map(|rule| rule.id).collect();
    Refusal(format!("there is no rule '{name}': choose all, or one of {}", known.join(", ")))
}

fn answer(as_json: bool, model: &ProcessModel, applied: &[Applied]) -> Result<Answer, Refusal> {
    let mut status = 0;
    let mut remarks = Vec::new();
    if applied.iter().all(|a| a.outcome.is_err()) {
        // Wrong numbers are bad input; a rule that has no answer is an answer.
        for failed in applied.iter().filter_map(|a| a.outcome.as_ref().err()) {
            if matches!(failed, RuleError::TauC { .. } | RuleError::Ultimate { .. }) {
                return Err(Refusal::of(failed));
            }
        }
        status = 1;
        remarks = applied.iter().filter_map(|a| a.outcome.as_ref().err()).map(ToString::to_string).collect();
        remarks.dedup();
    }
    let text = if as_json {
        let results: Vec<Value> = applied.iter().map(result).collect();
        json::text(&json!({"model": json::model(model), "results": results}))
    } else {
        as_table(applied)
    };
    Ok(Answer { text, remarks, status })
}

fn result(applied: &Applied) -> Value {
    let mut to = Map::new();
    to.insert("rule".into(), json!(applied.rule.id));
    match &applied.outcome {
        Ok((tuning, analysis)) => {
            let warnings: Vec<String> = tuning.warnings.iter().map(ToString::to_string).collect();
            json::add_gains(&mut to, applied.kind, Some(&tuning.gains));
            json::add_analysis(&mut to, analysis);
            json::add_remarks(&mut to, tuning.valid(), &warnings);
        }
        Err(error) => {
            json::add_gains(&mut to, applied.kind, None);
            json::add_analysis(&mut to, &Analysis::default());
            json::add_remarks(&mut to, false, &[error.to_string()]);
        }
    }
    Value::Object(to)
}

fn as_table(applied: &[Applied]) -> String {
    let head = ["rule", "controller", "Kc", "Ti (s)", "Td (s)", "Ms", "Mt", "Ju", "Jv", "GM", "PM (°)"];
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    let mut notes = String::new();
    for one in applied {
        let name = format!("{} {}", one.rule.id, one.kind);
        match &one.outcome {
            Ok((tuning, a)) => {
                let g = &tuning.gains;
                let mut row = vec![one.rule.id.to_owned(), one.kind.to_string()];
                row.extend([g.kc, g.ti_s, g.td_s].map(|v| shown(Some(v))));
                row.extend([a.ms, a.mt, a.ju, a.jv, a.gain_margin, a.phase_margin_deg].map(shown));
                rows.push(row);
                if !a.stable {
                    notes.push_str(&format!("{name}: the loop is unstable\n"));
                }
                for warning in &tuning.warnings {
                    notes.push_str(&format!("{name}: {warning}\n"));
                }
            }
            Err(error) if applied.len() > 1 => notes.push_str(&format!("{name}: {error}\n")),
            Err(_) => {}
        }
    }
    if rows.len() == 1 {
        return notes;
    }
    format!("{}\n{notes}", table(&rows))
}
