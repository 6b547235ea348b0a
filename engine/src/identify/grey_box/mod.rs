//! Grey box: chosen parameters of any rig fitted to a recording, its levels simulated in free run by the rig's own laws.
//!
//! A [`GreyBoxProblem`] names the free parameters ([`FreeParameter`], by `TAG.field`) and the record; [`fit_rig`] gives
//! values with intervals, errors of fit and validation, and verdicts in plain words. [`with_values`] puts the values into
//! a rig description.
//!
//! Sensitivities are exact: the variational equations are integrated along with the levels, and jump where an input
//! arrives after a delay that is free and where a tank gets to a rim. Conventions: an input applies from its stamp until
//! the next one; what was in the air of a transport delay before the first is estimated along, as the initial levels are;
//! pumps always find water. A missing output (NaN) is passed over, a missing
//! input holds its last value.

mod error;
mod fit;
mod flows;
mod free_run;
mod judge;
mod optimise;
mod problem;
mod start;
mod structure;
mod target;
mod verdict;

pub use error::GreyBoxError;
pub use fit::{
    GreyBoxFit, INITIAL_SAMPLES, OutputFit, RecordFit, RigParameter, Simulated, fit_rig, simulate_rig,
};
pub use problem::{
    FreeParameter, GreyBoxProblem, GreyBoxRecord, RecordedInput, RecordedOutput, input_named, output_named,
};
pub use target::{Target, with_values};
pub use verdict::GreyBoxVerdict;
