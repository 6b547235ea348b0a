//! Linear process models: FOPDT, IPDT, SOPDT and rational transfer functions with dead time.
//!
//! Time in seconds, angular frequency in rad/s, gains in PV units per MV unit.
//! Policy for non-finite numbers: a model that holds one is refused by its constructor.

mod process_model;
mod transfer_function;

pub use process_model::{Fopdt, Ipdt, ModelError, ProcessModel, Sopdt};
pub use transfer_function::TransferFunction;
