//! Where samples and events of a run go: recorders implement this.

use std::sync::Arc;

use super::event::Event;
use crate::plant::{Measurement, Network, RigSpec};
use crate::signal::{ChannelSet, SampleBlock};
use crate::sim::ClosedLoop;

/// What a run starts from, or goes on from when a sink joins it: enough to know later what was running.
#[derive(Debug, Clone)]
pub struct RunStart {
    /// Number of the run.
    pub run: u64,
    /// Structure of the rig.
    pub network: Arc<Network>,
    /// Columns of its rows.
    pub channels: Arc<ChannelSet>,
    /// The rig's file as it stands set now: loops with their laws, gains, setpoints and modes, angles, levels.
    pub as_set: RigSpec,
    /// Index of the configuration.
    pub configuration: usize,
    /// Imperfections that are on; `None` where the source is no simulated rig.
    pub measurement: Option<Measurement>,
}

impl RunStart {
    /// What a loop would go on from now.
    #[must_use]
    pub fn of(closed: &ClosedLoop, run: u64) -> Self {
        Self {
            run,
            network: closed.network().clone(),
            channels: closed.channels().clone(),
            as_set: closed.as_set(),
            configuration: closed.configuration(),
            measurement: closed.measurement(),
        }
    }
}

/// A consumer of a run. Called on the worker's thread: it must return at once, and count what it cannot take.
pub trait Sink: Send {
    /// A run begins, or goes on with this sink attached.
    fn started(&mut self, start: &RunStart);
    /// Samples since the last call.
    fn samples(&mut self, block: &SampleBlock);
    /// Something happened.
    fn event(&mut self, event: &Event);
}
