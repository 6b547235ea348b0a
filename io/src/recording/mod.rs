//! Recordings: every run goes to a `.rrd` file while it happens, and to viewers that join over the loopback.
//!
//! [`Recording::start`] gives a handle and a [`Sink`] to attach to a session. The sink copies into a bounded queue and
//! never waits; the thread `vasos-recorder` logs batches of about a second. The file comes first: a viewer that is
//! absent, slow or killed cannot hold it up, and a full disk costs the batches that do not fit, nothing else.
//! Each run (a session's run number) is a recording of its own in the one file, named `file · rig · run n`, so that
//! `time` starts at 0 in each; the viewer lists them side by side.
//!
//! | entity | component or archetype | values, in this order | unit | how often |
//! | --- | --- | --- | --- | --- |
//! | `/signals` | `loop_N`, N from 1 | SP, PV, MV of loop slot N | cm, cm, the pump's unit | every sample |
//! | `/signals` | `levels` | true level of each tank | cm | every sample |
//! | `/signals` | `flows` | for each pump its input and arriving flow, each valve its flow and angle, each tank its spill | pump's unit, cm³/s, cm³/s, °, cm³/s | every sample |
//! | `/events` | `TextLog` | what happened, with level | – | as it happens |
//! | `/events` | `told` | commands, alarms and states as TOML, for a replay | – | as it happens |
//! | `/models` | `TextDocument`, `model` | the model that came into use: in words, and as TOML with its units | – | as it happens |
//! | `/fits/model_N` | `Scalars` | PV as measured, PV of the model | the PV's | once a fit |
//! | `/nyquist/…` | `LineStrips2D`, `Points2D` | L(jω), unit circle, circle of Ms, −1; −Im L points up | 1 | when the loop changes |
//! | `/checks` | `rows` | check sums of the rows and events since the last one, as TOML | – | every half minute, and at the end |
//! | `/rig/water` | `Boxes2D` | the water in each tank | 1 = 1 cm of level, y down | up to 5 a second, one in two seconds at real time, some ten seconds together, when a level moves |
//! | `/rig/walls`, `/rig/pipes` | `Boxes2D`, `LineStrips2D` | the drawing | 1 = 1 cm of height | once |
//! | `/__properties/vasos` | text | `rig`, `run`, `program`; `rig_file`: the rig as it was set when the run began, a TOML rig file with the loops' laws, gains, setpoints and modes; `start`: configuration and imperfections | – | once |
//!
//! | timeline | kind | what it is |
//! | --- | --- | --- |
//! | `time` | duration | time of the run |
//! | `wall_clock` | timestamp | the computer's clock when the row came out of the session |
//!
//! The signals share one entity because each entity costs some 1 kB a batch. The blueprint maps its components to lines
//! and names them: the columns of [`vasos_engine::signal::ChannelSet`] with their
//! units in brackets. A value that does not exist, such as the PV before the first sample, is NaN.
//!
//! A recording that grows over [`RecordingOptions::part_bytes`] goes on in another file. Each part opens by itself: it
//! begins with the blueprint, the drawing, the settings and every command so far. Opened together, in the viewer or by
//! [`read_runs`], parts are one recording.
//!
//! Rows have check sums on `/checks`, and every text above that is TOML ends with one in a comment: what was changed on
//! a disk is said when it is read. Up to half a minute before the recorder was killed has none.

mod frames;
mod layout;
mod notes;
mod opening;
mod output;
mod play;
mod read;
mod run_sink;
mod seal;
mod status;
mod tanks;
mod tidy;
mod told;
mod trouble;
pub mod viewer;
mod words;
mod writer;

use std::net::{Ipv4Addr, TcpListener};
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::sync::{Arc, PoisonError};
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, Sender, TrySendError, bounded};
use rerun::grpc_server::GrpcServerSink;
use rerun::{MemoryLimit, ServerOptions};
use vasos_engine::session::Sink;

pub use layout::{EVENTS, FITS, FLOWS, LEVELS, MODELS, NYQUIST, RIG, SIGNALS, TIME, WALL_CLOCK};
pub use notes::{ModelNote, Note, NyquistNote};
pub use play::{Parts, Recorded, read_recorded, read_runs};
pub use read::{RecordedColumn, read_columns, read_recording};
pub use trouble::{RecordingError, RecordingFlaw, RecordingTrouble};
pub use words::line as event_words;

use output::Output;
use run_sink::{Message, RunSink};
use status::Status;
use writer::Writer;

/// Blocks and events that wait for the recorder before rows are lost.
const QUEUE: usize = 4096;
/// What the server keeps for viewers that join later.
const SERVER_BYTES: u64 = 128 * 1024 * 1024;
/// Size at which a recording goes on in another file, unless told otherwise: four hours of a rig with twenty channels
/// at 5 Hz, and small enough to be tidied up in memory.
const PART_BYTES: u64 = 32 * 1024 * 1024;
/// Longest wait of [`Recording::close`].
const CLOSE_LIMIT: Duration = Duration::from_secs(5);
/// Rerun's own port, which viewers try first.
const USUAL_PORT: u16 = 9876;

/// How to record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RecordingOptions {
    /// Let viewers of this computer join the run.
    pub serve: bool,
    /// Port for them; `None` tries Rerun's own, 9876, then any free one.
    pub port: Option<u16>,
    /// Size in bytes at which the recording goes on in another file: `run.rrd`, `run-2.rrd`, …; `None`: never.
    pub part_bytes: Option<u64>,
}

impl Default for RecordingOptions {
    fn default() -> Self {
        Self { serve: true, port: None, part_bytes: Some(PART_BYTES) }
    }
}

/// A recording that runs; dropping it without [`Recording::close`] leaves the file complete but not optimised.
pub struct Recording {
    id: u64,
    path: PathBuf,
    address: Option<String>,
    status: Arc<Status>,
    done: Receiver<()>,
    notes: Option<Sender<Message>>,
    lost_reported: u64,
    lost_events_reported: u64,
    behind_reported: u64,
}

impl Recording {
    /// Creates the file and starts the recorder; attach the sink to a session under [`Recording::id`].
    ///
    /// An existing file of that name is replaced. A server that cannot start is a trouble, not an error.
    ///
    /// # Errors
    /// [`RecordingError`] when the file or a thread cannot be made.
    pub fn start(path: &Path, options: RecordingOptions) -> Result<(Self, Box<dyn Sink>), RecordingError> {
        let shown = path.display().to_string();
        let status = Arc::new(Status::new(shown.clone()));
        let mut output = Output::create(path, status.clone())
            .map_err(|reason| RecordingError::Create { path: shown, reason })?;
        let mut address = None;
        if options.serve {
            match serve(&mut output, options.port) {
                Ok(at) => address = Some(at),
                Err(reason) => status.report(RecordingTrouble::NoServer { reason }),
            }
        }
        let name = path.file_stem().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
        let (queue, messages) = bounded(QUEUE);
        let (said, done) = bounded::<()>(0);
        let writer = Writer::new(messages, output, status.clone(), name, options.part_bytes);
        let spawned = std::thread::Builder::new().name("vasos-recorder".to_owned()).spawn(move || {
            writer.record();
            drop(said);
        });
        spawned.map_err(|error| RecordingError::Start { reason: error.to_string() })?;
        let notes = Some(queue.clone());
        let sink = Box::new(RunSink { queue, status: status.clone() });
        let id = output::next_id();
        let path = path.to_owned();
        let recording = Self {
            id,
            path,
            address,
            status,
            done,
            notes,
            lost_reported: 0,
            lost_events_reported: 0,
            behind_reported: 0,
        };
        Ok((recording, sink))
    }

    /// Number unique in this process, for attaching and detaching the sink.
    #[must_use]
    pub fn id(&self) -> u64 {
        self.id
    }

    /// The file; the first one, where it goes on in others.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// All files of the recording, in order.
    #[must_use]
    pub fn parts(&self) -> Vec<PathBuf> {
        self.status.parts()
    }

    /// Keeps something with the present run, at its present time. What comes while the recorder is behind is left out and
    /// counted.
    pub fn note(&self, note: Note) {
        if let Some(notes) = &self.notes {
            let full = matches!(notes.try_send(Message::Note(Box::new(note))), Err(TrySendError::Full(_)));
            self.status.lost_events.fetch_add(u64::from(full), Ordering::Relaxed);
        }
    }

    /// Where a viewer joins: `rerun --connect ADDRESS`; `None` without a server.
    #[must_use]
    pub fn address(&self) -> Option<&str> {
        self.address.as_deref()
    }

    /// Rows handed to the recorder.
    #[must_use]
    pub fn rows(&self) -> u64 {
        self.status.rows.load(Ordering::Relaxed)
    }

    /// Rows that the recorder could not take.
    #[must_use]
    pub fn lost(&self) -> u64 {
        self.status.lost.load(Ordering::Relaxed)
    }

    /// What can still be asked when the recording is closed.
    #[must_use]
    pub fn tally(&self) -> Tally {
        Tally(self.status.clone())
    }

    /// Size of the files now, in bytes; those that are full count as they were before they were tidied up.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.status.bytes.load(Ordering::Relaxed) + self.status.bytes_before.load(Ordering::Relaxed)
    }

    /// What went wrong since the last call.
    pub fn troubles(&mut self) -> Vec<RecordingTrouble> {
        let mut troubles = self.status.take_troubles();
        let lost = self.lost();
        if lost > self.lost_reported {
            troubles.push(RecordingTrouble::RowsLost { count: lost - self.lost_reported });
            self.lost_reported = lost;
        }
        let lost = self.status.lost_events.load(Ordering::Relaxed);
        if lost > self.lost_events_reported {
            troubles.push(RecordingTrouble::EventsLost { count: lost - self.lost_events_reported });
            self.lost_events_reported = lost;
        }
        let behind = self.status.behind.load(Ordering::Relaxed);
        if behind > self.behind_reported {
            troubles.push(RecordingTrouble::ViewerBehind { count: behind - self.behind_reported });
            self.behind_reported = behind;
        }
        troubles
    }

    /// Ends the recording: the rows under way are written, the file is made final, and a file of moderate size is
    /// optimised. Detach the sink first, or rows of the next second are still taken. Waits at most five seconds for
    /// the recorder, whatever viewers do.
    ///
    /// # Errors
    /// [`RecordingTrouble::NotClosed`] when the disk does not answer in time, or the last write error.
    pub fn close(mut self) -> Result<(), RecordingTrouble> {
        self.notes = None;
        self.status.closing.store(true, Ordering::Relaxed);
        let path = || self.path.display().to_string();
        if self.done.recv_timeout(CLOSE_LIMIT) == Err(crossbeam_channel::RecvTimeoutError::Timeout) {
            return Err(RecordingTrouble::NotClosed { path: path(), seconds: CLOSE_LIMIT.as_secs() });
        }
        let unwritten = |t: &RecordingTrouble| {
            matches!(t, RecordingTrouble::Write { .. } | RecordingTrouble::Resumed { .. })
        };
        if let Some(trouble) = self.troubles().into_iter().rfind(unwritten) {
            return Err(trouble);
        }
        if let Some(last) = self.parts().last() {
            tidy::tidy(last);
        }
        let tidying =
            std::mem::take(&mut *self.status.tidying.lock().unwrap_or_else(PoisonError::into_inner));
        // A part that is half tidied up would leave its other half behind.
        tidying.into_iter().for_each(|thread| drop(thread.join()));
        Ok(())
    }
}

/// Counts of a recording; they are final when it is closed.
#[derive(Clone)]
pub struct Tally(Arc<Status>);

impl Tally {
    /// Rows handed to the recorder.
    #[must_use]
    pub fn rows(&self) -> u64 {
        self.0.rows.load(Ordering::Relaxed)
    }

    /// Rows that the recorder could not take.
    #[must_use]
    pub fn lost(&self) -> u64 {
        self.0.lost.load(Ordering::Relaxed)
    }

    /// Events and notes that the recorder could not take.
    #[must_use]
    pub fn lost_events(&self) -> u64 {
        self.0.lost_events.load(Ordering::Relaxed)
    }

    /// Messages that the file did not take, because the disk was full or gone.
    #[must_use]
    pub fn unwritten(&self) -> u64 {
        self.0.unwritten.load(Ordering::Relaxed)
    }

    /// All files, in order.
    #[must_use]
    pub fn parts(&self) -> Vec<PathBuf> {
        self.0.parts()
    }
}

/// Starts a server on the loopback and gives the address for viewers.
fn serve(output: &mut Output, port: Option<u16>) -> Result<String, String> {
    let free = |port: u16| TcpListener::bind((Ipv4Addr::LOCALHOST, port)).and_then(|l| l.local_addr());
    let bound = match port {
        Some(port) => free(port),
        None => free(USUAL_PORT).or_else(|_| free(0)),
    };
    let port = bound.map_err(|error| error.to_string())?.port();
    let options =
        ServerOptions { memory_limit: MemoryLimit::from_bytes(SERVER_BYTES), ..ServerOptions::default() };
    let server = GrpcServerSink::new("127.0.0.1", port, options).map_err(|error| error.to_string())?;
    let address = server.uri().to_string();
    output.serve(server)?;
    // The server binds on a thread of its own and says nothing when it cannot.
    let limit = Instant::now() + Duration::from_secs(2);
    while std::net::TcpStream::connect((Ipv4Addr::LOCALHOST, port)).is_err() {
        if Instant::now() > limit {
            return Err(format!("nothing answers on port {port}"));
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    Ok(address)
}
