//! Every rule on the model in use, analysed; kept until model or free time constants change.

use vasos_engine::analyze::{Analysis, OpenLoop, StepFigures, analyze, step_figures};
use vasos_engine::control::PidGains;
use vasos_engine::document::{Candidate, Document, ModelEntry, ModelOrigin, OptimumSettings};
use vasos_engine::identify::ControllerFit;
use vasos_engine::model::ProcessModel;
use vasos_engine::tune::optimum::{
    Certificate, DerivativeFilter, Objective, Optimum, OptimumError, OptimumProblem, Process, Wanted, optimum,
};
use vasos_engine::tune::{
    ControllerKind, Rule, RuleError, RuleOptions, RuleWarning, SetpointSide, Ultimate, registry,
    setpoint_side,
};

use crate::answers::{Answers, Question, Reply};
use crate::{i18n, tr};

/// Name of the row of the tuning in use.
pub const PRESENT: &str = "present";
/// Name of the rows of the best gains.
pub const OPTIMAL: &str = "optimal";

/// Name of the rows of gains that were made calmer by hand.
pub const DETUNED: &str = "detuned";

/// A row that gave gains.
#[derive(Debug, Clone)]
pub struct Row {
    /// Id of the rule, or [`PRESENT`].
    pub rule: &'static str,
    /// Key of its title.
    pub title_key: String,
    /// Source.
    pub source: &'static str,
    /// Controller.
    pub kind: ControllerKind,
    /// Gains.
    pub gains: PidGains,
    /// Free time constant in seconds.
    pub tau_c_s: Option<f64>,
    /// Remarks.
    pub warnings: Vec<RuleWarning>,
    /// Used inside its range.
    pub valid: bool,
    /// What the loop is worth.
    pub analysis: Analysis,
    /// IAE and overshoot.
    pub figures: StepFigures,
    /// Proof of the best gains.
    pub certificate: Option<Certificate>,
}

/// A rule that gave none.
#[derive(Debug, Clone)]
pub struct Refusal {
    /// Key of its title.
    pub title_key: &'static str,
    /// Controller.
    pub kind: ControllerKind,
    /// Why.
    pub why: Refused,
}

/// Why there are no gains.
#[derive(Debug, Clone)]
pub enum Refused {
    /// A rule has none.
    Rule(RuleError),
    /// No gains meet the limits.
    Optimum(OptimumError),
    /// A pure integrator is best, which no controller with Kc and Ti can be.
    IntegralAlone,
    /// They are being worked out.
    Pending,
}

impl Refused {
    /// In the user's language.
    #[must_use]
    pub fn say(&self) -> String {
        match self {
            Self::Rule(error) => i18n::say(error),
            Self::Optimum(error) => i18n::say(error),
            Self::IntegralAlone => tr!("tune.integral_alone"),
            Self::Pending => tr!("tune.pending"),
        }
    }
}

/// The table.
#[derive(Debug, Default)]
pub struct TuningTable {
    /// Model it was made for.
    pub model: Option<ProcessModel>,
    /// Rows, the tuning in use first.
    pub rows: Vec<Row>,
    /// Rules that gave nothing.
    pub refusals: Vec<Refusal>,
    /// What has to be worked out before the table is whole.
    pub questions: Vec<Question>,
    /// Tunings whose curves stay beside the one in view, as the table has them.
    pub compared: Vec<Row>,
    /// Weight of the setpoint for the overshoot that is wanted, with the tuning in view; `None` where none is wanted.
    pub setpoint: Option<Option<SetpointSide>>,
    of_setpoint: Option<(ProcessModel, PidGains, f64)>,
    key: Option<Key>,
}

#[derive(Debug, PartialEq, Clone)]
struct Key {
    number: u32,
    model: ProcessModel,
    tau_c_s: Vec<(String, f64)>,
    present: Option<PidGains>,
    optimum: OptimumSettings,
    ultimate: Option<Ultimate>,
    by_hand: Vec<Candidate>,
    /// Which of the questions were answered.
    answered: [bool; 2],
}

impl TuningTable {
    /// Brings the table in line with the document and the loop in view; does nothing when it is.
    pub fn update(&mut self, document: &Document, focus: usize, answers: &Answers) {
        let Some(entry) = document.model() else {
            if self.key.is_some() {
                *self = Self::default();
            }
            return;
        };
        let mut key = key(document, entry, focus);
        let questions = questions(&entry.model, &document.optimum);
        key.answered = questions.each_ref().map(|q| q.as_ref().is_some_and(|q| answers.find(q).is_some()));
        if self.key.as_ref() == Some(&key) {
            self.follow(document);
            return;
        }
        let same_model = self.key.as_ref().is_some_and(|k| k.model == key.model);
        let old = if same_model { std::mem::take(&mut self.rows) } else { vec![] };
        self.rows.clear();
        self.refusals.clear();
        if let Some(gains) = key.present {
            self.rows.push(judged(&entry.model, &old, PRESENT, gains));
        }
        for by_hand in &key.by_hand {
            self.rows.push(judged(&entry.model, &old, DETUNED, by_hand.gains));
        }
        self.questions.clear();
        for (kind, question) in [ControllerKind::Pi, ControllerKind::Pid].into_iter().zip(questions) {
            let found = match question {
                None => best(&entry.model, kind, &document.optimum),
                Some(question) => match answers.find(&question).as_deref() {
                    Some(Reply::Optimum(found)) => found.clone(),
                    _ => {
                        let why = Refused::Pending;
                        self.refusals.push(Refusal { title_key: "rules.optimal", kind, why });
                        self.questions.push(question);
                        continue;
                    }
                },
            };
            self.take_best(&entry.model, &old, kind, found);
        }
        for rule in registry() {
            for &kind in rule.controllers {
                let options = RuleOptions {
                    tau_c_s: document.tau_c_s.get(rule.id).copied(),
                    ultimate: key.ultimate,
                    ..RuleOptions::default()
                };
                self.apply(&entry.model, &old, rule, kind, &options);
            }
        }
        self.model = Some(entry.model.clone());
        self.key = Some(key);
        self.follow(document);
    }

    /// Brings in line what hangs on the tuning in view and on those compared.
    fn follow(&mut self, document: &Document) {
        let rows = &self.rows;
        let same = |c: &Candidate| rows.iter().find(|r| r.rule == c.rule && r.kind.id() == c.controller);
        self.compared = document.compared.iter().filter_map(same).cloned().collect();
        let Some((model, percent)) = self.model.as_ref().zip(document.overshoot_percent) else {
            (self.setpoint, self.of_setpoint) = (None, None);
            return;
        };
        let in_view = document.candidate.as_ref().and_then(same).or(rows.first());
        let Some(gains) = in_view.map(|r| r.gains) else { return };
        let of = Some((model.clone(), gains, percent));
        if self.of_setpoint != of {
            self.setpoint = Some(setpoint_side(&OpenLoop::new(model, &gains), percent));
            self.of_setpoint = of;
        }
    }

    fn take_best(
        &mut self,
        model: &ProcessModel,
        old: &[Row],
        kind: ControllerKind,
        found: Result<Optimum, OptimumError>,
    ) {
        let refused = match found {
            Ok(found) => match found.ideal() {
                Some(gains) => {
                    let mut row = judged(model, old, OPTIMAL, gains);
                    row.source = SOURCE;
                    row.kind = kind;
                    row.certificate = Some(found.certificate);
                    self.rows.push(row);
                    return;
                }
                None => Refused::IntegralAlone,
            },
            Err(error) => Refused::Optimum(error),
        };
        self.refusals.push(Refusal { title_key: "rules.optimal", kind, why: refused });
    }

    fn apply(
        &mut self,
        model: &ProcessModel,
        old: &[Row],
        rule: &'static Rule,
        kind: ControllerKind,
        options: &RuleOptions,
    ) {
        match rule.tune(model, kind, options) {
            Ok(tuning) => {
                let valid = tuning.valid();
                let mut row = judged(model, old, rule.id, tuning.gains);
                row.title_key = rule.title_key.to_owned();
                row.source = rule.source;
                row.kind = kind;
                row.tau_c_s = tuning.tau_c_s.filter(|_| rule.has_free_time_constant());
                row.warnings = tuning.warnings;
                row.valid = valid;
                self.rows.push(row);
            }
            Err(error) => {
                self.refusals.push(Refusal { title_key: rule.title_key, kind, why: Refused::Rule(error) })
            }
        }
    }

    /// The row of a rule and controller.
    #[must_use]
    pub fn find(&self, rule: &str, controller: &str) -> Option<&Row> {
        self.rows.iter().find(|r| r.rule == rule && r.kind.id() == controller)
    }
}

/// Whether a model is in the units of the loop in view: cm, and the unit of its pump.
#[must_use]
pub fn same_units(document: &Document, entry: &ModelEntry, focus: usize) -> bool {
    let spec = &document.rig.network.spec;
    let pump = document
        .rig
        .active_loops()
        .get(focus)
        .and_then(|l| spec.pumps.iter().find(|p| Some(&p.id) == l.pump.as_ref()));
    pump.is_some_and(|p| entry.pv_unit == "cm" && entry.mv_unit == p.unit.symbol())
}

fn key(document: &Document, entry: &ModelEntry, focus: usize) -> Key {
    let tag = document.rig.active_loops().get(focus).map(|l| l.id.clone());
    let present = tag.and_then(|t| document.rig.loops.get(&t)).map(|l| l.tuning.gains);
    // Gains in other units than the model's say nothing on it. A log has its own controller, in its own units.
    let present = match entry.origin {
        ModelOrigin::Log { .. } => {
            entry.study.as_ref().and_then(|s| s.controller.as_ref()).and_then(ControllerFit::gains)
        }
        _ => present.filter(|_| same_units(document, entry, focus)),
    };
    // Ku of a test on the rig is in the units of its loop.
    let ultimate = document.ultimate.filter(|_| same_units(document, entry, focus));
    let mut by_hand: Vec<Candidate> = vec![];
    for one in document.candidate.iter().chain(&document.compared).filter(|c| c.rule == DETUNED) {
        if !by_hand.iter().any(|known| known.controller == one.controller) {
            by_hand.push(one.clone());
        }
    }
    Key {
        ultimate,
        by_hand,
        number: entry.number,
        model: entry.model.clone(),
        tau_c_s: document.tau_c_s.iter().map(|(k, v)| (k.clone(), *v)).collect(),
        present,
        optimum: document.optimum,
        answered: [false; 2],
    }
}

/// Where the best gains come from.
const SOURCE: &str =
    "Kristiansson, Lennartson, Evaluation and simple tuning of PID controllers, J. Process Control 16, 2006";

/// The controller whose best gains are shown.
#[must_use]
pub fn wanted(kind: ControllerKind, settings: &OptimumSettings) -> Wanted {
    if kind == ControllerKind::Pid { Wanted::pid(&settings.limits) } else { Wanted::Pi }
}

/// What takes longer than a frame may: simulated objectives, and a filter that is free.
fn questions(model: &ProcessModel, settings: &OptimumSettings) -> [Option<Question>; 2] {
    let simulated = matches!(settings.objective, Objective::IaeLoad | Objective::IaeSetpoint);
    [ControllerKind::Pi, ControllerKind::Pid].map(|kind| {
        let wanted = wanted(kind, settings);
        let slow = simulated || wanted == Wanted::Pid(DerivativeFilter::Free);
        slow.then(|| Question::Optimum {
            model: model.clone(),
            wanted,
            limits: settings.limits,
            objective: settings.objective,
        })
    })
}

fn best(
    model: &ProcessModel,
    kind: ControllerKind,
    settings: &OptimumSettings,
) -> Result<Optimum, OptimumError> {
    let processes = [Process::Model(model.clone())];
    optimum(&OptimumProblem {
        processes: &processes,
        wanted: wanted(kind, settings),
        objective: settings.objective,
        limits: settings.limits,
    })
}

/// A row with its figures, taken from an older table where the gains are the same.
fn judged(model: &ProcessModel, old: &[Row], rule: &'static str, gains: PidGains) -> Row {
    let known = old.iter().find(|r| r.gains == gains).map(|r| (r.analysis, r.figures));
    let (analysis, figures) = known.unwrap_or_else(|| {
        let analysis = analyze(model, &gains);
        (analysis, step_figures(model, &gains, &analysis))
    });
    Row {
        rule,
        title_key: format!("rules.{rule}"),
        source: "",
        kind: ControllerKind::of(&gains),
        gains,
        tau_c_s: None,
        warnings: vec![],
        valid: true,
        analysis,
        figures,
        certificate: None,
    }
}
