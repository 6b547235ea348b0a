//! A tuning that may be chosen, and what it is worth on the model and on models as likely.

use crate::analyze::{Analysis, OpenLoop, StepFigures, analyze_loop, loop_figures};
use crate::control::{FormGains, ParallelGains, PidGains};
use crate::model::ProcessModel;
use crate::tune::{ControllerKind, RobustnessSpread, RuleOptions, RuleWarning, find_rule, robustness_spread};

/// Where a candidate comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CandidateRule {
    /// The certified optimum for the model.
    Optimal,
    /// The certified optimum for the worst of a family of models.
    OptimalFamily,
    /// A published rule, by its id.
    Published(&'static str),
    /// What the controller has now.
    Present,
}

impl CandidateRule {
    /// Name in JSON.
    #[must_use]
    pub fn id(self) -> &'static str {
        match self {
            Self::Optimal => "optimal",
            Self::OptimalFamily => "optimal_family",
            Self::Published(id) => id,
            Self::Present => "present",
        }
    }
}

/// A tuning and what it is worth.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// Where it comes from.
    pub rule: CandidateRule,
    /// Actions it has.
    pub controller: ControllerKind,
    /// Gains of the parallel form; Kp = 0 for a pure integrator.
    pub gains: ParallelGains,
    /// The loop with the model.
    pub analysis: Analysis,
    /// Its step responses.
    pub figures: StepFigures,
    /// The loop with models drawn from what the log leaves open; `None` where the log leaves a parameter open altogether.
    pub spread: Option<RobustnessSpread>,
    /// Remarks of a published rule.
    pub warnings: Vec<RuleWarning>,
}

impl Candidate {
    pub(super) fn new(
        rule: CandidateRule,
        controller: ControllerKind,
        gains: ParallelGains,
        model: &ProcessModel,
        draws: &[ProcessModel],
    ) -> Self {
        let open = OpenLoop::of_parallel(model, &gains);
        let analysis = analyze_loop(&open);
        let figures = loop_figures(&open, &analysis);
        let spread = robustness_spread(draws, &gains);
        Self { rule, controller, gains, analysis, figures, spread, warnings: Vec::new() }
    }

    /// The same gains in the ideal form; `None` for a pure integrator.
    #[must_use]
    pub fn ideal(&self) -> Option<PidGains> {
        FormGains::Parallel(self.gains).to_ideal().ok()
    }

    /// Whether a published rule was used inside its range.
    #[must_use]
    pub fn valid(&self) -> bool {
        !self.warnings.iter().any(RuleWarning::limits_validity)
    }

    /// Share of unstable loops over the model's uncertainty, 0…1.
    #[must_use]
    pub fn unstable_share(&self) -> Option<f64> {
        self.spread.as_ref().map(RobustnessSpread::unstable_share)
    }
}

/// Gains of the ideal form as the engine computes with them.
pub(super) fn parallel(gains: &PidGains) -> ParallelGains {
    let tf_s = if gains.td_s == 0.0 { 0.0 } else { gains.td_s / gains.n };
    ParallelGains { kp: gains.kc, ki: gains.ki(), kd: gains.kd(), tf_s }
}

/// Published rules that are shown beside the optimum.
const SHOWN: usize = 2;
/// Rules in the order in which they are tried: robust ones, with a formula for most structures.
const PREFERRED: [&str; 5] = ["simc", "amigo", "lambda", "isimc", "imc"];

/// The first two rules that hold for this model and give a stable loop.
pub(super) fn published(
    model: &ProcessModel,
    kind: ControllerKind,
    draws: &[ProcessModel],
) -> Vec<Candidate> {
    let applied = PREFERRED.iter().filter_map(|id| {
        let rule = find_rule(id, kind)?;
        let tuning = rule.tune(model, kind, &RuleOptions::default()).ok().filter(|t| t.valid())?;
        let rule = CandidateRule::Published(rule.id);
        let mut one = Candidate::new(rule, kind, parallel(&tuning.gains), model, draws);
        one.warnings = tuning.warnings;
        one.analysis.stable.then_some(one)
    });
    applied.take(SHOWN).collect()
}
