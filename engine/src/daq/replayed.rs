//! The rig of a recording: it takes what commands set, and nothing of it moves.

use std::sync::Arc;

use super::source::{RigControls, Source};
use crate::plant::{
    ActiveFault, Fault, FaultKind, Measurement, Network, Plant, Reading, ReadingStatus, RigError, check_fault,
};

/// Stands where the plant of a recorded run stood, so that the commands of the recording find their loops, valves and
/// faults. Values are in the recording: this has none.
#[derive(Debug, Clone)]
pub struct ReplayedRig {
    network: Arc<Network>,
    measurement: Option<Measurement>,
    faults: Vec<ActiveFault>,
}

impl ReplayedRig {
    /// The rig at the beginning of its recording.
    #[must_use]
    pub fn new(network: Arc<Network>, measurement: Option<Measurement>) -> Self {
        Self { network, measurement, faults: vec![] }
    }
}

impl Source for ReplayedRig {
    fn network(&self) -> &Arc<Network> {
        &self.network
    }

    fn read(&mut self, readings: &mut [Reading]) {
        readings.fill(Reading { level_cm: f64::NAN, status: ReadingStatus::Good });
    }

    fn write(&mut self, _pump: usize, mv: f64) -> Result<f64, RigError> {
        Ok(mv)
    }

    fn advance(&mut self, _duration_s: f64) {}

    fn accelerates(&self) -> bool {
        true
    }

    fn rig(&mut self) -> Option<&mut dyn RigControls> {
        Some(self)
    }

    fn measurement(&self) -> Option<Measurement> {
        self.measurement
    }

    fn faults(&self) -> &[ActiveFault] {
        &self.faults
    }

    fn plant(&self) -> Option<&Plant> {
        None
    }
}

impl RigControls for ReplayedRig {
    fn set_angle(&mut self, _valve: usize, _angle_deg: f64) -> Result<(), RigError> {
        Ok(())
    }

    fn bump(&mut self, _tank: usize, delta_cm: f64) -> Result<f64, RigError> {
        Ok(delta_cm)
    }

    fn configure(&mut self, _configuration: usize) -> Result<(), RigError> {
        Ok(())
    }

    fn set_state(&mut self, _levels_cm: &[f64], _inputs: &[f64]) -> Result<(), RigError> {
        Ok(())
    }

    fn set_measurement(&mut self, measurement: Measurement) {
        self.measurement = Some(measurement);
    }

    fn set_seed(&mut self, _seed: u64) {}

    fn set_fault(&mut self, tag: &str, fault: Fault) -> Result<(), RigError> {
        check_fault(&self.network, tag, fault)?;
        self.faults.retain(|f| f.tag != tag || f.fault.kind() != fault.kind());
        self.faults.push(ActiveFault { tag: tag.to_owned(), fault });
        Ok(())
    }

    fn repair(&mut self, tag: &str, kind: Option<FaultKind>) -> Result<(), RigError> {
        let before = self.faults.len();
        self.faults.retain(|f| f.tag != tag || kind.is_some_and(|kind| f.fault.kind() != kind));
        if self.faults.len() == before {
            return Err(RigError::Sound { tag: tag.to_owned() });
        }
        Ok(())
    }
}
