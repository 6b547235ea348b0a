//! Loop analysis: what a controller is worth on a model, in frequency and in time, dead time always exact.
//!
//! [`analyze`] gives stability, peaks and margins; [`frequency_curve`] the curves behind them; [`step_response`] the
//! time responses, which [`metrics`] judges as it judges any recorded run. Seconds, rad/s, gains in PV units per MV
//! unit. Non-finite gains give an unstable verdict, non-finite samples a typed error.

mod analysis;
mod closed_loop;
mod frequency;
mod grid;
mod metrics;
mod open_loop;
mod response;
mod search;
mod stability;
mod sweep;

pub use analysis::{Analysis, analyze, analyze_loop, is_closed_loop_stable};
pub use frequency::{CurveOptions, LoopFunction, frequency_curve, frequency_range};
pub use metrics::{Excitation, Metrics, MetricsError, metrics, metrics_at_rest};
pub use open_loop::OpenLoop;
pub use response::{Response, ResponseEnd, ResponseOptions, StepFigures, step_figures, step_response};
