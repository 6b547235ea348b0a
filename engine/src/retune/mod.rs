//! From what a log says to a tuning: candidates for the model, what each is worth over its uncertainty, and the choice.
//!
//! [`retune`] takes a [`LoopStudy`](crate::identify::LoopStudy) and gives a [`Retuning`]: the certified optimum under the
//! user's limits, two published rules, the present tuning, and which of them to use. The first [`Advice`] is the answer,
//! also where it is a no: a valve that sticks, a swing that comes from outside, a log that shows the controller alone.
//! Where the model is not known well enough for its own optimum, the optimum of a family of models as likely takes its
//! place. Same study, same options, same numbers.

mod advice;
mod best;
mod candidate;
mod decide;
mod family;
mod options;
mod remarks;
mod retuning;
mod swing;

pub use advice::Advice;
pub use candidate::{Candidate, CandidateRule};
pub use decide::retune;
pub use options::{LoopSigns, RetuneOptions};
pub use retuning::Retuning;
