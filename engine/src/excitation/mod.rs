//! Tests that move a running loop so that a model can be told from what it answers.
//!
//! An [`Excitation`] describes one: its signal (step, setpoint step, relay, doublet, PRBS, stepped sine, ultimate gain),
//! the limits it keeps and the time it may take. An [`ExcitationRun`] carries it out sample by sample: it listens to
//! the loop as it is, says what to write, and ends with a reason; whoever owns the loop writes it and puts the loop
//! back. The [`ExcitationReport`] holds the record and what was measured; [`identify_report`] fits a model to it.
//!
//! Times in seconds, angular frequency in rad/s, PV and MV in their units. Neither clock nor thread here: time comes with
//! the samples, and a sample allocates nothing. Policy for non-finite numbers: a description that holds one is refused, a
//! PV that is none ends the run, and no output is ever other than finite.

mod check;
mod error;
mod listening;
mod prbs;
mod progress;
mod relay;
mod report;
mod rest;
mod run;
mod sequence;
mod signal;
mod sine;
mod spec;
mod step_test;
mod stop;
#[cfg(test)]
mod tests;
mod ultimate_gain;

pub use error::ExcitationError;
pub use prbs::{prbs_length, prbs_signs};
pub use progress::{Circumstances, Drive, Envelope, Phase, Progress, Restore};
pub use report::{
    Ending, ExcitationReport, ExcitationWarning, Finding, FrequencyPoint, Identified, Record, RelayFinding,
    StepFinding, UltimateFinding, identify_report,
};
pub use run::ExcitationRun;
pub use spec::{
    AtRest, Excitation, ExcitationLimits, Hysteresis, Relay, Signal, StepEnd, SteppedSine, UltimateGain,
};
pub use stop::StopReason;
