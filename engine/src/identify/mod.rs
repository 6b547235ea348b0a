//! Identification: from data to a model.
//!
//! [`fit_fopdt`] takes any stretch of a log ([`FitProblem`]) and gives the first-order-plus-dead-time model
//! with its intervals and a verdict in plain words ([`FopdtFit`]). The way there: the stretch is validated
//! ([`FitError`]), thinned out for a global start over (T, L), then refined on all its rows by Gauss–Newton with
//! the linear unknowns projected out. [`simulate_fopdt`] runs a model over a record with the same sampling.
//!
//! Convention of records: a row's MV applies from its time stamp until the next one; its PV was measured just
//! before the stamp. Policy for non-finite numbers: a row that holds one is refused with its number.

mod error;
mod fopdt;
mod gram;
mod optimise;
mod problem;
mod response;
mod simulate;
mod start;
mod statistics;
mod verdict;

pub use error::FitError;
pub use fopdt::{FopdtFit, Interval, Spread, fit_fopdt};
pub use problem::{FitOptions, FitProblem, InitialState};
pub use simulate::simulate_fopdt;
pub use verdict::FitVerdict;
