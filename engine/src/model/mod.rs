//! Linear process models: FOPDT, IPDT, SOPDT, rational transfer functions with dead time, and state space.
//!
//! [`StateSpace`] gives poles, transmission zeros, gains and the minimal transfer function of each channel;
//! [`simulate`] runs any of them over a sampled input; [`half_rule`] and [`fit_step_response`] reduce a
//! transfer function to the structures that tuning rules want.
//!
//! Time in seconds, angular frequency in rad/s, gains in PV units per MV unit.
//! Policy for non-finite numbers: a model that holds one is refused by its constructor.

mod eigen;
mod half_rule;
mod held_input;
mod process_model;
pub(crate) mod realization;
mod reduce_error;
pub(crate) mod roots;
mod simulate;
mod state_space;
mod state_space_error;
mod step_fit;
mod structure;
mod transfer_function;
mod zero_pole_gain;
mod zeros;

pub use half_rule::{ReducedOrder, half_rule};
pub use held_input::HeldInput;
pub use process_model::{Fopdt, Ipdt, ModelError, ProcessModel, Sopdt};
pub use reduce_error::ReduceError;
pub use simulate::{SampledInput, simulate, simulate_process};
pub use state_space::{Matrices, Port, Ports, StateSpace};
pub use state_space_error::StateSpaceError;
pub use step_fit::{StepFit, fit_step_response};
pub use transfer_function::TransferFunction;
pub use zero_pole_gain::ZeroPoleGain;
