//! Controllers: gains in the field's forms, PID-I2GL and the loop around it.
//!
//! e = r − y; every quantity in engineering units. `update` allocates nothing. Input that is not finite
//! holds the last output and is reported.

mod control_loop;
mod gains;
mod pid_i2gl;

pub use control_loop::{ControlLoop, LoopSpec, check_filter};
pub use gains::{GainsError, PidGains};
pub use pid_i2gl::{ControlOutput, Mode, PidI2gl, PidTuning};
