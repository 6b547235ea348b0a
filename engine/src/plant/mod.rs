//! The plant: one general network of tanks, pumps, valves and sensors, described by a file.
//!
//! For every tank `A dh/dt = Σ inflows − Σ outflows − spill`, solved in flux form: the integrator sums the
//! volume of every stream over a step and moves exactly that volume, so that water is conserved to
//! rounding. Units: cm, s, cm², cm³/s. Inputs that are not finite are refused before they reach a state.

mod curve;
mod error;
mod faults;
mod flow_law;
mod flows;
mod lanes;
mod linear;
mod linear_error;
mod motion;
mod motions;
mod names;
mod network;
mod pipe;
mod pump_curve;
mod rims;
mod roots;
mod sensor;
pub mod spec;
mod state;
mod steady;
mod steady_solver;
mod streams;
mod two_numbers;

pub use error::RigError;
pub(crate) use error::demand;
pub use faults::{ActiveFault, Fault, FaultKind, FaultyPart, check_fault};
pub use flow_law::{regularised_root, regularised_root_slope};
pub(crate) use lanes::{Number, Pack};
pub use linear::{Disturbances, LinearOptions, Linearisation, OperatingPoint, linearise};
pub use linear_error::LinearError;
pub(crate) use motion::Motion;
pub(crate) use motions::copy_few;
pub use network::{Network, Pump, RIG_SCHEMA, Sensor, Tank, Valve};
pub(crate) use pipe::Pipe;
pub use pump_curve::CurveSide;
pub(crate) use sensor::nearest;
pub use sensor::{Measurement, Reading, ReadingStatus, Transmitter};
pub use spec::{InputUnit, RigSpec, Text};
pub use state::{Balance, Plant};
pub use steady::{SteadyState, SteadyTarget, steady_at_level, steady_at_levels, steady_levels, unrest_cm_s};
pub(crate) use streams::widest;
