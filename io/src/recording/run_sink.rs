//! The session's end of a recording: copies go into a bounded queue, nothing ever waits.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::SystemTime;

use crossbeam_channel::{Sender, TrySendError};
use vasos_engine::session::{Event, RunStart, Sink};
use vasos_engine::signal::SampleBlock;

use super::notes::Note;
use super::status::Status;

/// What the recorder is handed.
pub(super) enum Message {
    /// A run begins, or goes on.
    Run(Box<RunStart>),
    /// Rows, and when they came.
    Rows { block: SampleBlock, wall: SystemTime },
    /// An event, and when it came.
    Event { event: Event, wall: SystemTime },
    /// Something to be kept with the run.
    Note(Box<Note>),
}

pub(super) struct RunSink {
    pub queue: Sender<Message>,
    pub status: Arc<Status>,
}

impl Sink for RunSink {
    fn started(&mut self, start: &RunStart) {
        // Rows without their run are counted as lost by the recorder.
        drop(self.queue.try_send(Message::Run(Box::new(start.clone()))));
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
        let message = Message::Event { event: event.clone(), wall: SystemTime::now() };
        if let Err(TrySendError::Full(_)) = self.queue.try_send(message) {
            self.status.lost_events.fetch_add(1, Ordering::Relaxed);
        }
    }
}
