//! The session's end of a recording: copies go into a bounded queue, nothing ever waits.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::SystemTime;

use crossbeam_channel::{Sender, TrySendError};
use vasos_engine::plant::Network;
use vasos_engine::session::{Event, Sink};
use vasos_engine::signal::{ChannelSet, SampleBlock};

use super::status::Status;

/// What the recorder is handed.
pub(super) enum Message {
    /// A run begins, or goes on.
    Run { run: u64, network: Arc<Network>, channels: Arc<ChannelSet> },
    /// Rows, and when they came.
    Rows { block: SampleBlock, wall: SystemTime },
    /// An event, and when it came.
    Event { event: Event, wall: SystemTime },
}

pub(super) struct RunSink {
    pub queue: Sender<Message>,
    pub status: Arc<Status>,
}

impl Sink for RunSink {
    fn started(&mut self, run: u64, network: &Arc<Network>, channels: &Arc<ChannelSet>) {
        let message = Message::Run { run, network: network.clone(), channels: channels.clone() };
        // Rows without their run are counted as lost by the recorder.
        drop(self.queue.try_send(message));
    }

    fn samples(&mut self, block: &SampleBlock) {
        let rows = block.time_s.len() as u64;
        let message = Message::Rows { block: block.clone(), wall: SystemTime::now() };
        match self.queue.try_send(message) {
            Ok(()) => self.status.rows.fetch_add(rows, Ordering::Relaxed),
            Err(TrySendError::Full(_)) => self.status.lost.fetch_add(rows, Ordering::Relaxed),
            // The recording was closed before it was detached.
            Err(TrySendError::Disconnected(_)) => 0,
        };
    }

    fn event(&mut self, event: &Event) {
        drop(self.queue.try_send(Message::Event { event: event.clone(), wall: SystemTime::now() }));
    }
}
