//! What can go wrong with a recording: at its start, and while it runs.

use vasos_engine::explain::{Explain, number};

/// Why a recording cannot start or be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum RecordingError {
    /// The file cannot be created.
    #[error("the recording {path} cannot be written: {reason}")]
    Create {
        /// File.
        path: String,
        /// The system's words.
        reason: String,
    },
    /// The system refuses a thread or the recorder its stream.
    #[error("the recorder does not start: {reason}")]
    Start {
        /// What was said.
        reason: String,
    },
    /// The file cannot be read.
    #[error("{path} is not a recording that can be read: {reason}")]
    Read {
        /// File.
        path: String,
        /// What was said.
        reason: String,
    },
    /// Nothing is recorded in the file.
    #[error("{path} holds no recording: it is empty or not a file of Rerun")]
    Nothing {
        /// File.
        path: String,
    },
    /// Recorded by another program, or of a rig that is not known.
    #[error("{path} holds no run of a rig; open it as a log to use its numbers")]
    NoRig {
        /// File.
        path: String,
    },
}

/// What goes wrong while recording; the run itself goes on.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum RecordingTrouble {
    /// The recorder could not keep up.
    #[error("{count} rows of the run are missing in the recording: the recorder could not keep up")]
    RowsLost {
        /// Rows since the last report.
        count: u64,
    },
    /// The recorder could not keep up with what happened.
    #[error(
        "{count} events, commands or models are missing in the recording: the recorder could not keep up; a replay may show other settings than there were"
    )]
    EventsLost {
        /// Events since the last report.
        count: u64,
    },
    /// The file cannot take what is recorded.
    #[error(
        "the recording {path} cannot be written: {reason}; what it holds so far stays readable, and recording goes on as soon as the file takes data again"
    )]
    Write {
        /// File.
        path: String,
        /// The system's words.
        reason: String,
    },
    /// The file was taken away while it was written.
    #[error(
        "the recording {path} was removed or renamed while it was written: what it held is not there any more, and the recording goes on in a new file of that name"
    )]
    Removed {
        /// File.
        path: String,
    },
    /// A recording that should go on in another file cannot.
    #[error("the recording {path} cannot go on in another file: {reason}; it grows on in the present one")]
    NoPart {
        /// First file.
        path: String,
        /// The system's words.
        reason: String,
    },
    /// The file takes data again.
    #[error("the recording {path} is written again; {count} batches are missing in between")]
    Resumed {
        /// File.
        path: String,
        /// Batches of about a second that are not in the file.
        count: u64,
    },
    /// A batch that Rerun refuses: a defect.
    #[error("a batch could not be recorded: {reason}")]
    Log {
        /// What was said.
        reason: String,
    },
    /// No server for viewers; the file is written all the same.
    #[error("no viewer can watch this recording live: {reason}; the file is written all the same")]
    NoServer {
        /// What was said.
        reason: String,
    },
    /// A viewer does not read; the file has everything.
    #[error(
        "the viewer is too slow: {count} messages were not sent to it; the file has them, open it to see all"
    )]
    ViewerBehind {
        /// Messages since the last report.
        count: u64,
    },
    /// The file could not be completed in time.
    #[error("the recording {path} is not completed after {seconds} s; what it holds is readable")]
    NotClosed {
        /// File.
        path: String,
        /// Seconds waited.
        seconds: u64,
    },
}

/// What is missing in a recording, or cannot be read; everything else was read.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RecordingFlaw {
    /// The file ends in the middle: of what follows nothing is known.
    #[error("{path} ends in the middle of a message, at byte {at}: what came after it is missing")]
    Cut {
        /// File.
        path: String,
        /// Byte.
        at: u64,
    },
    /// Messages that cannot be read.
    #[error(
        "{path} is damaged from byte {at} on: {messages} messages cannot be read, and values of others may be wrong"
    )]
    Damaged {
        /// File.
        path: String,
        /// First byte.
        at: u64,
        /// How many.
        messages: usize,
    },
    /// Rows that are missing between others.
    #[error("{run}: rows are missing in {gaps} places, {} s in all, the first behind {} s", number(*.missing_s), number(*.from_s))]
    Gap {
        /// Name of the run.
        run: String,
        /// Time in seconds of the row before the first gap.
        from_s: f64,
        /// Length of all gaps in seconds.
        missing_s: f64,
        /// How many.
        gaps: usize,
    },
    /// Rows whose check sum differs.
    #[error("{run}: rows from {} to {} s are not as they were written: the file was changed or damaged there; do not trust them", number(*.from_s), number(*.to_s))]
    RowsAltered {
        /// Name of the run.
        run: String,
        /// Time in seconds of the first row that may be wrong.
        from_s: f64,
        /// Time in seconds of the last one.
        to_s: f64,
    },
    /// The run was not ended.
    #[error(
        "{run} has no end: it is still being recorded, the recorder was killed, or its last file is missing; what came after {} s is not there", number(*.last_s)
    )]
    NoEnd {
        /// Name of the run.
        run: String,
        /// Time of the last row in seconds; 0 where there is none.
        last_s: f64,
    },
    /// Texts whose check sum differs.
    #[error(
        "{run}: {texts} of its settings, commands, events and models are not as they were written: the file was changed or damaged; commands among them are not carried out"
    )]
    TextsAltered {
        /// Name of the run.
        run: String,
        /// How many.
        texts: usize,
    },
}

impl Explain for RecordingFlaw {
    fn key(&self) -> &'static str {
        match self {
            Self::Cut { .. } => "recording.cut",
            Self::Damaged { .. } => "recording.damaged",
            Self::Gap { .. } => "recording.gap",
            Self::RowsAltered { .. } => "recording.rows_altered",
            Self::NoEnd { .. } => "recording.no_end",
            Self::TextsAltered { .. } => "recording.texts_altered",
        }
    }

    fn args(&self) -> Vec<(&'static str, String)> {
        match self {
            Self::Cut { path, at } => vec![("path", path.clone()), ("at", at.to_string())],
            Self::Damaged { path, at, messages } => {
                vec![("path", path.clone()), ("at", at.to_string()), ("messages", messages.to_string())]
            }
            Self::Gap { run, from_s, missing_s, gaps } => vec![
                ("run", run.clone()),
                ("from_s", number(*from_s)),
                ("missing_s", number(*missing_s)),
                ("gaps", gaps.to_string()),
            ],
            Self::RowsAltered { run, from_s, to_s } => {
                vec![("run", run.clone()), ("from_s", number(*from_s)), ("to_s", number(*to_s))]
            }
            Self::NoEnd { run, last_s } => vec![("run", run.clone()), ("last_s", number(*last_s))],
            Self::TextsAltered { run, texts } => vec![("run", run.clone()), ("texts", texts.to_string())],
        }
    }
}

impl RecordingFlaw {
    /// One of each kind, for the test that compares them with the translation files.
    #[must_use]
    pub fn samples() -> Vec<Self> {
        let path = || "run.rrd".to_owned();
        let run = || "run · stad · run 1".to_owned();
        vec![
            Self::Cut { path: path(), at: 12_000 },
            Self::Damaged { path: path(), at: 12_000, messages: 3 },
            Self::Gap { run: run(), from_s: 12.0, missing_s: 3.5, gaps: 2 },
            Self::RowsAltered { run: run(), from_s: 30.0, to_s: 60.0 },
            Self::NoEnd { run: run(), last_s: 412.6 },
            Self::TextsAltered { run: run(), texts: 1 },
        ]
    }
}

impl Explain for RecordingError {
    fn key(&self) -> &'static str {
        match self {
            Self::Create { .. } => "recording.create",
            Self::Start { .. } => "recording.start",
            Self::Read { .. } => "recording.read",
            Self::Nothing { .. } => "recording.nothing",
            Self::NoRig { .. } => "recording.no_rig",
        }
    }

    fn args(&self) -> Vec<(&'static str, String)> {
        match self {
            Self::Create { path, reason } | Self::Read { path, reason } => {
                vec![("path", path.clone()), ("reason", reason.clone())]
            }
            Self::Start { reason } => vec![("reason", reason.clone())],
            Self::Nothing { path } | Self::NoRig { path } => vec![("path", path.clone())],
        }
    }
}

impl RecordingError {
    /// One of each kind, for the test that compares them with the translation files.
    #[must_use]
    pub fn samples() -> Vec<Self> {
        let text = |t: &str| t.to_owned();
        vec![
            Self::Create { path: text("run.rrd"), reason: text("permission denied") },
            Self::Start { reason: text("too many threads") },
            Self::Read { path: text("run.rrd"), reason: text("unknown version") },
            Self::Nothing { path: text("run.rrd") },
            Self::NoRig { path: text("run.rrd") },
        ]
    }
}

impl Explain for RecordingTrouble {
    fn key(&self) -> &'static str {
        match self {
            Self::RowsLost { .. } => "recording.rows_lost",
            Self::EventsLost { .. } => "recording.events_lost",
            Self::Write { .. } => "recording.write",
            Self::NoPart { .. } => "recording.no_part",
            Self::Removed { .. } => "recording.removed",
            Self::Resumed { .. } => "recording.resumed",
            Self::Log { .. } => "recording.log",
            Self::NoServer { .. } => "recording.no_server",
            Self::ViewerBehind { .. } => "recording.viewer_behind",
            Self::NotClosed { .. } => "recording.not_closed",
        }
    }

    fn args(&self) -> Vec<(&'static str, String)> {
        match self {
            Self::RowsLost { count } | Self::EventsLost { count } | Self::ViewerBehind { count } => {
                vec![("count", count.to_string())]
            }
            Self::Write { path, reason } | Self::NoPart { path, reason } => {
                vec![("path", path.clone()), ("reason", reason.clone())]
            }
            Self::Resumed { path, count } => vec![("path", path.clone()), ("count", count.to_string())],
            Self::Removed { path } => vec![("path", path.clone())],
            Self::Log { reason } | Self::NoServer { reason } => vec![("reason", reason.clone())],
            Self::NotClosed { path, seconds } => {
                vec![("path", path.clone()), ("seconds", seconds.to_string())]
            }
        }
    }
}

impl RecordingTrouble {
    /// One of each kind, for the test that compares them with the translation files.
    #[must_use]
    pub fn samples() -> Vec<Self> {
        let text = |t: &str| t.to_owned();
        vec![
            Self::RowsLost { count: 120 },
            Self::EventsLost { count: 3 },
            Self::Write { path: text("run.rrd"), reason: text("no space left on device") },
            Self::Removed { path: text("run.rrd") },
            Self::NoPart { path: text("run.rrd"), reason: text("permission denied") },
            Self::Resumed { path: text("run.rrd"), count: 12 },
            Self::Log { reason: text("lengths differ") },
            Self::NoServer { reason: text("address in use") },
            Self::ViewerBehind { count: 40 },
            Self::NotClosed { path: text("run.rrd"), seconds: 5 },
        ]
    }
}
