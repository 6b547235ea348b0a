//! Whether a rig can start at all: what its file promises against what its water and valves allow.

use std::sync::Arc;

use super::closed_loop::ClosedLoop;
use crate::plant::{Measurement, Network};
use crate::session::CommandError;

/// A rig that is possible on paper but cannot start.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("the rig cannot start in the configuration '{configuration}': {error}")]
pub struct StartError {
    /// Id of the configuration; the rig's where it has none.
    pub configuration: String,
    /// Why not.
    pub error: CommandError,
}

/// Starts a simulated rig once in each of its configurations.
///
/// # Errors
/// [`StartError`] of the first configuration that is refused.
pub fn check_starts(network: &Arc<Network>) -> Result<(), StartError> {
    let spec = &network.spec;
    for index in 0..spec.configurations.len().max(1) {
        ClosedLoop::simulated(network.clone(), index, Measurement::IDEAL, 0).map_err(|error| {
            let configuration = spec.configurations.get(index).map_or(&spec.id, |c| &c.id).clone();
            StartError { configuration, error }
        })?;
    }
    Ok(())
}
