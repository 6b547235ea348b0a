//! Loop analysis: what a controller is worth on a model, in frequency and in time, dead time always exact.
//!
//! [`analyze`] gives stability, peaks and margins; [`frequency_curve`] the curves behind them; [`step_response`] the
//! time responses, which [`metrics`] judges as it judges any recorded run. Seconds, rad/s, gains in PV units per MV
//! unit. Non-finite gains give an unstable verdict, non-finite samples a typed error.

mod absolute_error;
mod analysis;
mod closed_loop;
mod frequency;
mod grid;
mod measured;
mod measured_error;
mod metrics;
mod open_loop;
mod response;
mod sampling;
mod search;
mod stability;
mod sweep;

pub(crate) use absolute_error::quick_iae;
pub(crate) use analysis::unstable_loop_poles;
pub use analysis::{
    Analysis, Peak, Peaks, analyze, analyze_loop, is_closed_loop_stable, is_loop_stable, peaks,
};
pub use frequency::{CurveOptions, LoopFunction, frequency_curve, frequency_range};
pub(crate) use grid::{natural_frequencies, resonances};
pub use measured::{FrequencyResponse, analyze_measured, measured_peaks};
pub use measured_error::FrequencyResponseError;
pub use metrics::{Excitation, Metrics, MetricsError, metrics, metrics_at_rest};
pub(crate) use open_loop::Asymptote;
pub use open_loop::OpenLoop;
pub use response::{
    Response, ResponseEnd, ResponseOptions, StepFigures, loop_figures, loop_response, step_figures,
    step_response,
};
pub use sampling::CoarseStep;
