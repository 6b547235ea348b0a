//! The plant as the session sees it.

use std::sync::Arc;

use crate::plant::{ActiveFault, Fault, FaultKind, Measurement, Network, Plant, Reading, RigError};

/// Something with sensors and pumps that a session reads, writes and lets time pass on.
pub trait Source: Send {
    /// Tags, units and ranges.
    fn network(&self) -> &Arc<Network>;
    /// Reads every sensor, in the order of the network.
    fn read(&mut self, readings: &mut [Reading]);
    /// Writes a pump's input and gives what was written after its limits, in the pump's unit.
    ///
    /// # Errors
    /// [`RigError::Value`] when the value is not finite.
    fn write(&mut self, pump: usize, mv: f64) -> Result<f64, RigError>;
    /// Waits for, or computes, the next sample `duration_s` later.
    fn advance(&mut self, duration_s: f64);
    /// Whether time can run faster than the clock.
    fn accelerates(&self) -> bool;
    /// Valves, tanks and switches of a rig that has them.
    fn rig(&mut self) -> Option<&mut dyn RigControls>;
    /// Imperfections that are on, for a simulated rig.
    fn measurement(&self) -> Option<Measurement>;
    /// Faults that have been switched on, in that order.
    fn faults(&self) -> &[ActiveFault] {
        &[]
    }
    /// True state of a simulated plant.
    fn plant(&self) -> Option<&Plant>;
}

/// What only a rig with these parts can do.
pub trait RigControls {
    /// Turns a valve to an angle in degrees.
    ///
    /// # Errors
    /// [`RigError::Value`] outside 0…90°.
    fn set_angle(&mut self, valve: usize, angle_deg: f64) -> Result<(), RigError>;
    /// Adds to a tank's level, in cm; gives the change that fitted.
    ///
    /// # Errors
    /// [`RigError::Value`] when the value is not finite.
    fn bump(&mut self, tank: usize, delta_cm: f64) -> Result<f64, RigError>;
    /// Turns valves and delays to a configuration of the rig file.
    ///
    /// # Errors
    /// [`RigError`] when an angle is not possible.
    fn configure(&mut self, configuration: usize) -> Result<(), RigError>;
    /// Puts levels in cm and pump inputs to a state at rest.
    ///
    /// # Errors
    /// [`RigError`] when the water does not fit.
    fn set_state(&mut self, levels_cm: &[f64], inputs: &[f64]) -> Result<(), RigError>;
    /// Switches imperfections.
    fn set_measurement(&mut self, measurement: Measurement);
    /// Restarts the noise from a seed.
    fn set_seed(&mut self, seed: u64);
    /// Breaks a sensor, valve, tank or pump, or takes the rig's power; a fault of the same kind is replaced.
    ///
    /// # Errors
    /// [`RigError`] for a tag that is not there, or a fault or size that it cannot have.
    fn set_fault(&mut self, tag: &str, fault: Fault) -> Result<(), RigError>;
    /// Repairs one fault of a tag, or all of them.
    ///
    /// # Errors
    /// [`RigError::Sound`] when there is nothing to repair.
    fn repair(&mut self, tag: &str, kind: Option<FaultKind>) -> Result<(), RigError>;
}
