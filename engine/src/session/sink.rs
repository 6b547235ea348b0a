//! Where samples and events of a run go: recorders implement this.

use std::sync::Arc;

use super::event::Event;
use crate::plant::Network;
use crate::signal::{ChannelSet, SampleBlock};

/// A consumer of a run. Called on the worker's thread: it must return at once, and count what it cannot take.
pub trait Sink: Send {
    /// A run begins, or goes on with this sink attached.
    fn started(&mut self, run: u64, network: &Arc<Network>, channels: &Arc<ChannelSet>);
    /// Samples since the last call.
    fn samples(&mut self, block: &SampleBlock);
    /// Something happened.
    fn event(&mut self, event: &Event);
}
