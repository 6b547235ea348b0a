//! Answers that take longer than a frame: asked by the pane that shows them, worked out beside the window, kept.

use std::sync::Arc;

use vasos_engine::analyze::Excitation;
use vasos_engine::control::ParallelGains;
use vasos_engine::identify::ModelFit;
use vasos_engine::model::ProcessModel;
use vasos_engine::plant::Network;
use vasos_engine::sim::{ScenarioError, Trial, TrialRun, run_trial};
use vasos_engine::tune::optimum::{
    FrontPoint, LoopLimits, Objective, Optimum, OptimumError, OptimumProblem, Process, TradeOff, Wanted,
    front, optimum,
};
use vasos_engine::tune::{TuningSpread, tuning_spread};

/// Models drawn for a band, and their seed: the same fit shows the same band.
const DRAWS: usize = 200;
const SEED: u64 = 1;
/// Points of a front; one that is simulated has fewer.
const POINTS: usize = 32;
const SIMULATED_POINTS: usize = 12;
/// Answers kept.
const MOST: usize = 24;

/// Something to work out.
#[derive(Debug, Clone)]
pub enum Question {
    /// A trade-off front.
    Front {
        /// Process.
        model: ProcessModel,
        /// Controller.
        wanted: Wanted,
        /// Limits; the one that is traded does not matter.
        limits: LoopLimits,
        /// What is traded.
        trade_off: TradeOff,
    },
    /// Best gains that need simulation.
    Optimum {
        /// Process.
        model: ProcessModel,
        /// Controller.
        wanted: Wanted,
        /// Limits.
        limits: LoopLimits,
        /// Objective.
        objective: Objective,
    },
    /// A tuning over the uncertainty of a fit.
    Spread {
        /// The fit.
        fit: Arc<ModelFit>,
        /// The tuning.
        gains: ParallelGains,
        /// What steps.
        excitation: Excitation,
        /// Length in seconds.
        horizon_s: f64,
    },
    /// A tuning on the rig.
    Trial {
        /// The rig.
        network: Arc<Network>,
        /// What is tried.
        trial: Box<Trial>,
    },
}

impl PartialEq for Question {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (
                Self::Front { model, wanted, limits, trade_off },
                Self::Front { model: m, wanted: w, limits: l, trade_off: t },
            ) => model == m && wanted == w && limits == l && trade_off == t,
            (
                Self::Optimum { model, wanted, limits, objective },
                Self::Optimum { model: m, wanted: w, limits: l, objective: o },
            ) => model == m && wanted == w && limits == l && objective == o,
            (
                Self::Spread { fit, gains, excitation, horizon_s },
                Self::Spread { fit: f, gains: g, excitation: e, horizon_s: h },
            ) => Arc::ptr_eq(fit, f) && gains == g && excitation == e && horizon_s == h,
            (Self::Trial { network, trial }, Self::Trial { network: n, trial: t }) => {
                Arc::ptr_eq(network, n) && trial == t
            }
            _ => false,
        }
    }
}

/// What came of it.
#[derive(Debug, Clone)]
pub enum Reply {
    /// Points of the front, rising in the limit.
    Front(Vec<FrontPoint>),
    /// The best gains, or why there are none.
    Optimum(Result<Optimum, OptimumError>),
    /// The band; none where the fit leaves a parameter open.
    Spread(Option<TuningSpread>),
    /// The run, or why it is not possible.
    Trial(Box<Result<TrialRun, ScenarioError>>),
}

impl Question {
    /// Works it out.
    #[must_use]
    pub fn answer(&self) -> Reply {
        match self {
            Self::Front { model, wanted, limits, trade_off } => {
                let processes = [Process::Model(model.clone())];
                let problem = OptimumProblem {
                    processes: &processes,
                    wanted: *wanted,
                    objective: Objective::Jv,
                    limits: *limits,
                };
                let count = if *trade_off == TradeOff::IaeMs { SIMULATED_POINTS } else { POINTS };
                Reply::Front(front(&problem, *trade_off, count))
            }
            Self::Optimum { model, wanted, limits, objective } => {
                let processes = [Process::Model(model.clone())];
                let problem = OptimumProblem {
                    processes: &processes,
                    wanted: *wanted,
                    objective: *objective,
                    limits: *limits,
                };
                Reply::Optimum(optimum(&problem))
            }
            Self::Spread { fit, gains, excitation, horizon_s } => {
                let draws = fit.draws(DRAWS, SEED);
                Reply::Spread(draws.and_then(|d| tuning_spread(&d, gains, *excitation, *horizon_s)))
            }
            Self::Trial { network, trial } => Reply::Trial(Box::new(run_trial(network, trial))),
        }
    }
}

/// Answers at hand, and what is under way.
#[derive(Debug, Default)]
pub struct Answers {
    known: Vec<(Question, Arc<Reply>)>,
    under_way: Vec<Question>,
}

impl Answers {
    /// The answer to a question, if it is at hand.
    #[must_use]
    pub fn find(&self, question: &Question) -> Option<Arc<Reply>> {
        self.known.iter().find(|(q, _)| q == question).map(|(_, reply)| reply.clone())
    }

    /// Whether anything is being worked out.
    #[must_use]
    pub fn is_busy(&self) -> bool {
        !self.under_way.is_empty()
    }

    /// Whether this question has to be begun: it is not known, not under way, and there is room.
    #[must_use]
    pub fn begins(&mut self, question: &Question) -> bool {
        const AT_ONCE: usize = 2;
        // A limit that is dragged asks anew in every frame: what it passes on its way is not worked out.
        let new = self.find(question).is_none()
            && !self.under_way.contains(question)
            && self.under_way.len() < AT_ONCE;
        if new {
            self.under_way.push(question.clone());
        }
        new
    }

    /// Takes an answer.
    pub fn take(&mut self, question: Question, reply: Reply) {
        self.under_way.retain(|q| *q != question);
        if self.known.len() >= MOST {
            self.known.remove(0);
        }
        self.known.push((question, Arc::new(reply)));
    }

    /// Forgets what is under way, after a job has come to nothing.
    pub fn give_up(&mut self) {
        self.under_way.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vasos_engine::model::Fopdt;

    fn question(ms: f64) -> Question {
        Question::Front {
            model: ProcessModel::Fopdt(Fopdt::new(2.0, 30.0, 3.0).expect("a model")),
            wanted: Wanted::Pi,
            limits: LoopLimits { ms, ..LoopLimits::DEFAULT },
            trade_off: TradeOff::JvJu,
        }
    }

    #[test]
    fn a_question_is_worked_out_once() {
        let mut answers = Answers::default();
        assert!(answers.begins(&question(1.4)) && !answers.begins(&question(1.4)));
        assert!(answers.begins(&question(1.5)) && !answers.begins(&question(1.6)), "two at once");
        let reply = question(1.4).answer();
        answers.take(question(1.4), reply);
        assert!(!answers.begins(&question(1.4)) && answers.begins(&question(1.6)));
        let known = answers.find(&question(1.4)).expect("known");
        let Reply::Front(points) = &*known else { panic!("{known:?}") };
        assert!(points.len() > 10);
    }
}
