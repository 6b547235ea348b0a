//! Controllers: gains in the field's forms, PID-I2GL and the loop around it.

mod gains;

pub use gains::{GainsError, PidGains};
