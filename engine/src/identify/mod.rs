//! Identification: from data to a model.
//!
//! [`choose_model`] takes any stretch of a log ([`FitProblem`]), fits every [`Structure`] and gives the best first;
//! [`fit_model`] fits one. A [`ModelFit`] carries intervals, bands, tests of its residuals and verdicts in plain words.
//! [`study_loop`] is for a loop's log as plants write it: it leaves out what is no measurement, reads the controller
//! along, and says when a stretch cannot tell a model.
//!
//! The way there: the stretch is validated ([`FitError`]), thinned out for a global start over the dynamics, then
//! refined on all its rows by Gauss–Newton with the linear unknowns projected out. [`fit_fopdt`] is the short cut for
//! a first order alone. [`simulate_fopdt`] runs a model over a record with the same sampling.
//!
//! [`grey_box`] fits chosen parameters of a whole rig to a recording instead.
//!
//! Convention of records: a row's MV applies from its time stamp until the next one; its PV was measured just
//! before the stamp. Policy for non-finite numbers: a row that holds one is refused with its number.

mod choose;
mod damped;
mod error;
mod fit_structure;
mod fopdt;
mod gram;
pub mod grey_box;
mod judge;
mod known;
mod model_fit;
mod optimise;
mod output_error;
mod parameters;
mod problem;
mod profile;
mod reaction_curve;
mod residual_tests;
mod response;
mod rest;
mod simulate;
mod start;
mod statistics;
mod step_load;
mod structure;
mod study;
mod verdict;

pub use choose::{Choice, choose_among, choose_model};
pub use error::FitError;
pub use fit_structure::fit_model;
pub use fopdt::{FopdtFit, Interval, Spread, fit_fopdt};
pub use known::History;
pub use model_fit::{DisturbanceFit, LoadFit, ModelFit, NyquistBand};
pub use parameters::Parameter;
pub use problem::{Disturbance, Drift, FitOptions, FitProblem, InitialState, Loads};
pub use reaction_curve::{CurveEstimate, CurveMethod, ReactionCurve, ReactionCurveError, reaction_curve};
pub use residual_tests::ResidualTests;
pub use rest::choose_from_rest;
pub use simulate::simulate_fopdt;
pub use structure::Structure;
pub use study::{
    ControllerFit, LoopRecord, LoopStudy, ModeColumn, Oscillation, RecordFinding, StudyOptions, study_loop,
};
pub use verdict::FitVerdict;
