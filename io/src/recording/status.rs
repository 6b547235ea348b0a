//! What a recorder says of itself, shared between its threads and its handle.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread::JoinHandle;

use super::trouble::RecordingTrouble;

/// Troubles kept for a handle that does not ask.
const MOST_TROUBLES: usize = 100;

#[derive(Default)]
pub(super) struct Status {
    /// File, as shown in sentences.
    pub path: String,
    /// Rows handed to the recorder.
    pub rows: AtomicU64,
    /// Rows it could not take.
    pub lost: AtomicU64,
    /// Events and notes it could not take.
    pub lost_events: AtomicU64,
    /// Bytes of the file that is written.
    pub bytes: AtomicU64,
    /// Bytes of the parts before it, as they were when they were full.
    pub bytes_before: AtomicU64,
    /// Messages no viewer got.
    pub behind: AtomicU64,
    /// Messages that the file did not take.
    pub unwritten: AtomicU64,
    /// Batches that are missing in front of one that was written again, until the recorder has told the file.
    pub missing_before: AtomicU64,
    /// The handle wants the recorder to end.
    pub closing: AtomicBool,
    writing_fails: AtomicBool,
    troubles: Mutex<Vec<RecordingTrouble>>,
    /// Threads that tidy full parts up.
    pub tidying: Mutex<Vec<JoinHandle<()>>>,
    parts: Mutex<Vec<PathBuf>>,
    part_fails: AtomicBool,
}

impl Status {
    pub fn new(path: String) -> Self {
        Self { path, ..Self::default() }
    }

    pub fn report(&self, trouble: RecordingTrouble) {
        let mut troubles = self.troubles.lock().unwrap_or_else(PoisonError::into_inner);
        if troubles.len() < MOST_TROUBLES && !troubles.contains(&trouble) {
            troubles.push(trouble);
        }
    }

    /// Says once that the file takes no data, until it does again.
    pub fn report_write(&self, reason: &str) {
        self.unwritten.fetch_add(1, Ordering::Relaxed);
        if !self.writing_fails.swap(true, Ordering::Relaxed) {
            self.report(RecordingTrouble::Write { path: self.path.clone(), reason: reason.to_owned() });
        }
    }

    pub fn report_resumed(&self, count: u64) {
        self.missing_before.fetch_add(count, Ordering::Relaxed);
        self.writing_fails.store(false, Ordering::Relaxed);
        self.report(RecordingTrouble::Resumed { path: self.path.clone(), count });
    }

    /// Says once that no further part can begin, until one does.
    pub fn report_part(&self, reason: &str) {
        if !self.part_fails.swap(true, Ordering::Relaxed) {
            self.report(RecordingTrouble::NoPart { path: self.path.clone(), reason: reason.to_owned() });
        }
    }

    pub fn add_part(&self, path: &Path) {
        self.part_fails.store(false, Ordering::Relaxed);
        self.parts.lock().unwrap_or_else(PoisonError::into_inner).push(path.to_owned());
    }

    /// Files of the recording, in order.
    pub fn parts(&self) -> Vec<PathBuf> {
        self.parts.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    pub fn take_troubles(&self) -> Vec<RecordingTrouble> {
        std::mem::take(&mut *self.troubles.lock().unwrap_or_else(PoisonError::into_inner))
    }
}
