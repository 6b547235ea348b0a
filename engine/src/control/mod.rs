//! Controllers: the laws, the forms their gains are written in, and the loop around them.
//!
//! e = r − y; every quantity in engineering units. Every law is a [`Controller`]: a small state machine whose
//! `step` allocates nothing. Input that is not finite holds the last output and is reported. What stands
//! around a law (filters, limits, feed-forward, predictor, schedule) is in [`ControlLoop`], whose header gives
//! the order.

mod control_loop;
mod controller;
mod deadband;
mod derivative;
mod feedforward;
mod forms;
mod gains;
mod law;
mod loop_spec;
mod on_off;
mod options;
mod pid_2gl;
mod pid_i2gl;
mod plain_loop;
mod proof;
mod schedule;
mod setpoint_path;
mod smith;
mod tuning;
mod units;
mod wiring;

pub use control_loop::{ControlLoop, LoopInput, OutputRange};
pub use controller::{Bound, ControlInput, ControlOutput, Controller, Limits, Mode, Parts};
pub use deadband::Deadband;
pub use derivative::derivative_coefficients;
pub use feedforward::{Feedforward, LeadLag};
pub use forms::{Form, FormError, FormGains, ParallelGains, SeriesGains};
pub use gains::{GainsError, PidGains};
pub use law::{Action, AntiWindup, Clip, Law, Sends};
pub use loop_spec::{LoopSpec, check_filter};
pub use on_off::OnOff;
pub use options::{LoopOptions, OutputLimits};
pub use pid_2gl::Pid2gl;
pub use pid_i2gl::PidI2gl;
pub(crate) use plain_loop::PlainLoop;
pub use proof::{Proof, prove};
pub use schedule::{SchedulePoint, scheduled};
pub use setpoint_path::{SetpointPath, SetpointShaper};
pub use smith::{SmithModel, SmithPredictor};
pub use tuning::PidTuning;
pub use units::{
    Mapping, Scale, ShownGains, kc_of_proportional_band, proportional_band_percent, repeats_per_min,
    repeats_per_s,
};
pub use wiring::{check_loop, check_loops, execution_order, final_pump, outer_of, output_range};
