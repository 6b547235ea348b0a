//! What comes of a retuning.

use super::advice::Advice;
use super::candidate::{Candidate, CandidateRule};
use crate::model::ProcessModel;

/// What comes of a retuning.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Retuning {
    /// Model that was tuned for; absent where the log gives none.
    pub model: Option<ProcessModel>,
    /// Models drawn from what the log leaves open; none where it leaves a parameter open altogether.
    pub draws: Vec<ProcessModel>,
    /// Tunings, the best first, the present one last.
    pub candidates: Vec<Candidate>,
    /// Which of them to use; absent where none should be.
    pub recommended: Option<usize>,
    /// The answer first, then what goes with it.
    pub advice: Vec<Advice>,
}

impl Retuning {
    /// The tuning to use.
    #[must_use]
    pub fn choice(&self) -> Option<&Candidate> {
        self.candidates.get(self.recommended?)
    }

    /// The present tuning.
    #[must_use]
    pub fn present(&self) -> Option<&Candidate> {
        self.candidates.iter().find(|c| c.rule == CandidateRule::Present)
    }

    /// How much smaller the IAE of a load step becomes, in percent of the present one; Jv where an IAE does not exist.
    /// Negative where the present tuning is faster. `None` without a stable present tuning with integral action.
    #[must_use]
    pub fn gain(&self) -> Option<(&'static str, f64)> {
        gain(self.choice()?, self.present()?)
    }

    pub(super) fn none(advice: Advice) -> Self {
        Self { advice: vec![advice], ..Self::default() }
    }
}

/// The measure in which a tuning gains on another, and the gain in percent.
pub(super) fn gain(new: &Candidate, old: &Candidate) -> Option<(&'static str, f64)> {
    let percent = |new: Option<f64>, old: Option<f64>| {
        new.zip(old).filter(|(_, old)| *old > 0.0).map(|(new, old)| 100.0 * (1.0 - new / old))
    };
    percent(new.figures.iae_load, old.figures.iae_load)
        .map(|p| ("iae_load", p))
        .or_else(|| percent(new.analysis.jv, old.analysis.jv).map(|p| ("Jv", p)))
}
