//! A limit as the thing to be made least: which value of it gains can meet, the others as they are.

use super::certificate::{Check, Limit};
use super::gain_search::{Candidate, Found};
use super::lead_search::Steps;
use super::problem::{LoopLimits, Objective};
use super::solve::{LARGEST_MS, Quest, Solver};

/// Largest values that are tried: of a limit on Ju and of the stretch, in units of what is given.
const MOST_JU: f64 = 1e6;
const MOST_MS: f64 = 1e3;
const MOST_STRETCH: f64 = 30.0;
/// Rounds of search and exact check, and the relative excess at which they end.
const ROUNDS: usize = 8;
const CLOSE: f64 = 1e-6;

/// What gives way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Giving {
    /// One limit.
    One(Limit),
    /// All of them alike, by a common factor of what they leave above their least values.
    Together,
}

/// A family of limits over one number, `above`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Relax {
    giving: Giving,
    given: LoopLimits,
    /// Least and largest `above`.
    pub range: (f64, f64),
}

impl Relax {
    /// One limit from what is given upwards; `None` where it is beyond what is tried.
    pub fn one(limit: Limit, given: LoopLimits) -> Option<Self> {
        let range = match limit {
            Limit::Ms | Limit::Mt if given.ms.min(given.mt) >= LARGEST_MS => return None,
            Limit::Ms => (given.ms - 1.0, LARGEST_MS - 1.0),
            Limit::Mt => ((given.mt - 1.0).max(1e-9), LARGEST_MS - 1.0),
            Limit::Ju => (given.ju, MOST_JU * given.ju),
        };
        (range.0 < range.1).then_some(Self { giving: Giving::One(limit), given, range })
    }

    /// Ms alone, from the largest that an optimum ever passes upwards.
    pub fn beyond() -> Self {
        let given = LoopLimits { ms: LARGEST_MS, mt: f64::INFINITY, ju: f64::INFINITY };
        Self { giving: Giving::One(Limit::Ms), given, range: (LARGEST_MS - 1.0, MOST_MS - 1.0) }
    }

    /// All limits by a factor, 1 as given.
    pub fn together(given: LoopLimits) -> Self {
        Self { giving: Giving::Together, given, range: (1.0, MOST_STRETCH) }
    }

    /// The limits for a value.
    pub fn limits(&self, above: f64) -> LoopLimits {
        let given = self.given;
        match self.giving {
            Giving::One(Limit::Ms) => LoopLimits { ms: 1.0 + above, ..given },
            Giving::One(Limit::Mt) => LoopLimits { mt: 1.0 + above, ..given },
            Giving::One(Limit::Ju) => LoopLimits { ju: above, ..given },
            Giving::Together => LoopLimits {
                ms: 1.0 + above * (given.ms - 1.0),
                mt: 1.0 + above * (given.mt - 1.0),
                ju: above * given.ju,
            },
        }
    }

    /// The value of the limit that gives way; the factor for all of them.
    fn value(&self, above: f64) -> f64 {
        match self.giving {
            Giving::One(Limit::Ms | Limit::Mt) => 1.0 + above,
            Giving::One(Limit::Ju) | Giving::Together => above,
        }
    }
}

impl Solver<'_> {
    /// The least that a limit can be, with gains that come so far; `None` where none stabilises under it.
    pub fn least(&mut self, relax: Relax) -> Option<(f64, Candidate)> {
        let quest =
            Quest { objective: Objective::MaxKi, limits: relax.limits(relax.range.1), relax: Some(relax) };
        let mut known: Option<Candidate> = None;
        let mut least = None;
        for _ in 0..ROUNDS {
            let found = match known {
                Some(known) => self.look_nearby(&quest, known, Steps::NEARBY),
                None => self.look_everywhere(&quest),
            };
            let Found::Best(candidate) = found else { break };
            let limits = relax.limits(candidate.value);
            let check = Check::of(&self.family, &limits, quest.objective, &candidate).ok()?;
            if !check.unstable.is_empty() {
                check.unstable.iter().for_each(|plant| self.family.refine(*plant));
                known = None;
                continue;
            }
            self.add(&check);
            let value = relax.value(candidate.value) * (1.0 + check.excess.max(0.0));
            if least.is_none_or(|(v, _)| value < v) {
                least = Some((value, candidate));
            }
            if known.is_some() && check.excess < CLOSE {
                break;
            }
            known = Some(candidate);
        }
        least
    }
}
