//! Where messages of the recorder go: the file first, then the server for viewers, which can never hold the file up.

use std::fs::File;
use std::io::{Seek, SeekFrom, Write};
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use crossbeam_channel::{Sender, TrySendError, bounded};
use rerun::external::{re_build_info, re_log_encoding};
use rerun::log::LogMsg;
use rerun::sink::{LogSink, SinkFlushError};

use super::status::Status;

type Encoder = re_log_encoding::Encoder<File>;

/// Messages that wait for the server before a viewer misses some.
const SERVER_QUEUE: usize = 1024;

/// The file and the server of a recording; every run's stream has a handle on them.
#[derive(Clone)]
pub(super) struct Output {
    disk: Arc<Mutex<Disk>>,
    server: Option<Sender<LogMsg>>,
    status: Arc<Status>,
}

impl Output {
    /// Creates the file and writes its header.
    pub fn create(path: &Path, status: Arc<Status>) -> Result<Self, String> {
        let file = File::create(path).map_err(|error| error.to_string())?;
        let again = file.try_clone().map_err(|error| error.to_string())?;
        let options = re_log_encoding::rrd::EncodingOptions::PROTOBUF_COMPRESSED;
        let mut encoder = Encoder::new_eager(re_build_info::CrateVersion::LOCAL, options, file)
            .map_err(|error| error.to_string())?;
        // A footer would grow in memory with every batch for days; optimising at the end adds one.
        encoder.do_not_emit_footer();
        let mut disk = Disk { encoder, file: again, good_bytes: 0, missing: 0 };
        disk.good_bytes = disk.file.stream_position().unwrap_or_default();
        status.bytes.store(disk.good_bytes, Ordering::Relaxed);
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

    /// Makes sure that the system has all of the file.
    pub fn finish(&self) {
        let disk = self.disk.lock().unwrap_or_else(PoisonError::into_inner);
        if let Err(error) = disk.file.sync_all() {
            self.status.report_write(&error.to_string());
        }
    }
}

impl LogSink for Output {
    fn send(&self, message: LogMsg) {
        let mut disk = self.disk.lock().unwrap_or_else(PoisonError::into_inner);
        match disk.append(&message) {
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
    encoder: Encoder,
    file: File,
    good_bytes: u64,
    missing: u64,
}

impl Disk {
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
