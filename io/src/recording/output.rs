//! Where messages of the recorder go: the file first, then the server for viewers, which can never hold the file up.
//!
//! One sink for both, rather than Rerun's `MultiSink` of `FileSink` and `GrpcServerSink`: those write on threads of
//! their own that say nothing of a full disk, and a file cut in the middle of a message would stay so.

use std::fs::{File, TryLockError};
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use crossbeam_channel::{Sender, TrySendError, bounded};
use rerun::external::{re_build_info, re_log_encoding};
use rerun::log::LogMsg;
use rerun::sink::{LogSink, SinkFlushError};

use super::status::Status;
use super::tidy::{tidy_beside, tidying_path};
use super::trouble::RecordingTrouble;

type Encoder = re_log_encoding::Encoder<File>;

/// Messages that wait for the server before a viewer misses some.
const SERVER_QUEUE: usize = 1024;
/// Messages with commands that open every further part of a recording: hours of dragging.
const MOST_KEPT: usize = 10_000;

/// The file and the server of a recording; every run's stream has a handle on them.
#[derive(Clone)]
pub(super) struct Output {
    disk: Arc<Mutex<Disk>>,
    server: Option<Sender<LogMsg>>,
    status: Arc<Status>,
}

/// What becomes of the messages that come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Keep {
    /// They are written.
    Write,
    /// They open the run: every further part of the file begins with them as well.
    Open,
    /// They carry settings that a replay of any later part needs.
    Settings,
}

impl Output {
    /// Creates the file and writes its header.
    pub fn create(path: &Path, status: Arc<Status>) -> Result<Self, String> {
        let disk = Disk::create(path)?;
        status.bytes.store(disk.good_bytes, Ordering::Relaxed);
        status.add_part(path);
        Ok(Self { disk: Arc::new(Mutex::new(disk)), server: None, status })
    }

    /// Passes everything from now on to a server as well, on a thread of its own.
    pub fn serve(&mut self, server: rerun::grpc_server::GrpcServerSink) -> Result<(), String> {
        let (sender, queue) = bounded::<LogMsg>(SERVER_QUEUE);
        let spawned = std::thread::Builder::new().name("vasos-viewers".to_owned()).spawn(move || {
            for message in queue {
                server.send(message);
            }
            // Dropping the server waits for viewers, maybe for ever: nobody waits for this thread.
        });
        spawned.map_err(|error| error.to_string())?;
        self.server = Some(sender);
        Ok(())
    }

    fn disk(&self) -> MutexGuard<'_, Disk> {
        self.disk.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Says what becomes of the messages from now on. A run that opens takes the place of the one before.
    pub fn keep(&self, keep: Keep) {
        let mut disk = self.disk();
        if keep == Keep::Open {
            disk.opening.clear();
        } else if disk.keep == Keep::Open {
            disk.opened_bytes = disk.good_bytes;
        }
        disk.keep = keep;
    }

    /// Notices that the file was taken away, and begins it anew with all that opens the run.
    pub fn check_there(&self) {
        let mut disk = self.disk();
        if disk.is_there() {
            return;
        }
        self.status.report(RecordingTrouble::Removed { path: disk.path.display().to_string() });
        self.status.unwritten.fetch_add(1, Ordering::Relaxed);
        let anew = File::create(&disk.path).map_err(|error| error.to_string());
        let begun = anew.and_then(|file| {
            let (path, stem) = (disk.path.clone(), disk.stem.clone());
            Disk::on(file, &path, stem, disk.number, disk.opening.clone())?.opened()
        });
        match begun {
            Ok(begun) => {
                self.status.bytes.store(begun.good_bytes, Ordering::Relaxed);
                *disk = begun;
            }
            Err(reason) => self.status.report_write(&reason),
        }
    }

    /// Whether the file has grown over a size; of a small part the opening would be all.
    pub fn is_over(&self, most_bytes: u64) -> bool {
        let disk = self.disk();
        disk.good_bytes >= most_bytes.saturating_add(disk.opened_bytes)
    }

    /// Goes on in a new file; the one that is full is tidied up beside.
    pub fn rotate(&self) {
        let mut disk = self.disk();
        let next = match disk.next_part() {
            Ok(next) => next,
            Err(reason) => {
                drop(disk);
                return self.status.report_part(&reason);
            }
        };
        let full = std::mem::replace(&mut *disk, next);
        self.status.add_part(&disk.path);
        self.status.bytes_before.fetch_add(full.good_bytes, Ordering::Relaxed);
        self.status.bytes.store(disk.good_bytes, Ordering::Relaxed);
        drop(disk);
        let path = full.path.clone();
        drop(full.file.sync_all());
        drop(full);
        self.status.tidying.lock().unwrap_or_else(PoisonError::into_inner).extend(tidy_beside(path));
    }

    /// Makes sure that the system has all of the file.
    pub fn finish(&self) {
        if let Err(error) = self.disk().file.sync_all() {
            self.status.report_write(&error.to_string());
        }
    }
}

impl LogSink for Output {
    fn send(&self, message: LogMsg) {
        let mut disk = self.disk();
        disk.remember(&message);
        match disk.append_or_owe(&message) {
            Ok(missing) => {
                self.status.bytes.store(disk.good_bytes, Ordering::Relaxed);
                if missing > 0 {
                    self.status.report_resumed(missing);
                }
            }
            Err(reason) => self.status.report_write(&reason),
        }
        drop(disk);
        if let Some(server) = &self.server
            && let Err(TrySendError::Full(_)) = server.try_send(message)
        {
            self.status.behind.fetch_add(1, Ordering::Relaxed);
        }
    }

    fn flush_blocking(&self, _timeout: Duration) -> Result<(), SinkFlushError> {
        // Every message goes to the file at once; the server flushes by itself.
        Ok(())
    }
}

/// The file, always cut back to its last whole message.
struct Disk {
    path: PathBuf,
    /// Name of the first part without its ending, for those that follow.
    stem: PathBuf,
    number: u32,
    encoder: Encoder,
    file: File,
    good_bytes: u64,
    /// Bytes of what opens the run.
    opened_bytes: u64,
    missing: u64,
    keep: Keep,
    opening: Vec<LogMsg>,
    /// Messages with settings that the file has not taken: they are written as soon as it does.
    owed: Vec<LogMsg>,
}

impl Disk {
    fn create(path: &Path) -> Result<Self, String> {
        // Emptied only once it is known that nobody else records to it.
        let file = File::options().write(true).create(true).truncate(false).open(path);
        let file = file.map_err(|error| error.to_string())?;
        if let Err(TryLockError::WouldBlock) = file.try_lock() {
            return Err("another recorder writes to it; choose another name".to_owned());
        }
        // A device has no length to cut.
        if file.metadata().is_ok_and(|m| m.is_file()) {
            file.set_len(0).map_err(|error| error.to_string())?;
        }
        drop(std::fs::remove_file(tidying_path(path)));
        Self::on(file, path, path.with_extension(""), 1, vec![])
    }

    fn on(file: File, path: &Path, stem: PathBuf, number: u32, opening: Vec<LogMsg>) -> Result<Self, String> {
        let again = file.try_clone().map_err(|error| error.to_string())?;
        let options = re_log_encoding::rrd::EncodingOptions::PROTOBUF_COMPRESSED;
        let mut encoder = Encoder::new_eager(re_build_info::CrateVersion::LOCAL, options, file)
            .map_err(|error| innermost(&error))?;
        // A footer would grow in memory with every batch for days; optimising at the end adds one.
        encoder.do_not_emit_footer();
        let (path, keep) = (path.to_owned(), Keep::Write);
        let mut disk = Self {
            path,
            stem,
            number,
            encoder,
            file: again,
            good_bytes: 0,
            opened_bytes: 0,
            missing: 0,
            keep,
            opening,
            owed: vec![],
        };
        disk.good_bytes = disk.file.stream_position().unwrap_or_default();
        Ok(disk)
    }

    /// The next part, with everything that opens the run; a file that is there already is left alone.
    fn next_part(&self) -> Result<Self, String> {
        let mut number = self.number;
        let (file, path) = loop {
            number += 1;
            let mut name = self.stem.clone().into_os_string();
            name.push(format!("-{number}.rrd"));
            let path = PathBuf::from(name);
            match File::options().write(true).create_new(true).open(&path) {
                Ok(file) => break (file, path),
                Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => {}
                Err(error) => return Err(error.to_string()),
            }
        };
        let made = Self::on(file, &path, self.stem.clone(), number, self.opening.clone());
        let made = made.and_then(Self::opened);
        if made.is_err() {
            // Half an opening is of no use, and its name is wanted for the next attempt.
            drop(std::fs::remove_file(&path));
        }
        made
    }

    /// Writes all that opens the run.
    fn opened(mut self) -> Result<Self, String> {
        let opening = std::mem::take(&mut self.opening);
        opening.iter().try_for_each(|message| self.append(message).map(drop))?;
        self.opening = opening;
        self.opened_bytes = self.good_bytes;
        Ok(self)
    }

    /// Whether the path still leads to the file that is written.
    fn is_there(&self) -> bool {
        #[cfg(unix)]
        {
            use std::os::unix::fs::MetadataExt;
            let same =
                |a: &std::fs::Metadata, b: &std::fs::Metadata| (a.dev(), a.ino()) == (b.dev(), b.ino());
            let (open, named) = (self.file.metadata(), std::fs::metadata(&self.path));
            open.is_ok_and(|open| named.is_ok_and(|named| same(&open, &named)))
        }
        #[cfg(not(unix))]
        self.path.exists()
    }

    fn remember(&mut self, message: &LogMsg) {
        if self.keep != Keep::Write && self.opening.len() < MOST_KEPT {
            self.opening.push(message.clone());
        }
    }

    /// As [`Self::append`], and with it the settings that the file did not take before.
    fn append_or_owe(&mut self, message: &LogMsg) -> Result<u64, String> {
        let written = self.append(message);
        if written.is_err() && self.keep == Keep::Settings && self.owed.len() < MOST_KEPT {
            self.owed.push(message.clone());
        }
        if written.is_ok() {
            while let Some(owed) = self.owed.pop() {
                if self.append(&owed).is_err() {
                    self.owed.push(owed);
                    break;
                }
            }
        }
        written
    }

    /// Writes a message whole or not at all; gives how many were missed before it.
    fn append(&mut self, message: &LogMsg) -> Result<u64, String> {
        match self.encoder.append(message) {
            Ok(bytes) => {
                self.good_bytes += bytes;
                Ok(std::mem::take(&mut self.missing))
            }
            Err(error) => {
                self.missing += 1;
                let cut = self.file.set_len(self.good_bytes);
                let cut = cut.and_then(|()| self.file.seek(SeekFrom::Start(self.good_bytes)));
                drop(cut.and_then(|_| self.file.flush()));
                Err(innermost(&error))
            }
        }
    }
}

/// The system's words, without those of the layers in between.
fn innermost(error: &dyn std::error::Error) -> String {
    match error.source() {
        Some(source) => innermost(source),
        None => error.to_string(),
    }
}

/// Number of the next recording of this process.
pub(super) fn next_id() -> u64 {
    static NEXT: AtomicU64 = AtomicU64::new(1);
    NEXT.fetch_add(1, Ordering::Relaxed)
}
