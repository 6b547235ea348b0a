//! What can go wrong with a recording: at its start, and while it runs.

use vasos_engine::explain::Explain;

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
            Self::Write { .. } => "recording.write",
            Self::NoPart { .. } => "recording.no_part",
            Self::Resumed { .. } => "recording.resumed",
            Self::Log { .. } => "recording.log",
            Self::NoServer { .. } => "recording.no_server",
            Self::ViewerBehind { .. } => "recording.viewer_behind",
            Self::NotClosed { .. } => "recording.not_closed",
        }
    }

    fn args(&self) -> Vec<(&'static str, String)> {
        match self {
            Self::RowsLost { count } | Self::ViewerBehind { count } => vec![("count", count.to_string())],
            Self::Write { path, reason } | Self::NoPart { path, reason } => {
                vec![("path", path.clone()), ("reason", reason.clone())]
            }
            Self::Resumed { path, count } => vec![("path", path.clone()), ("count", count.to_string())],
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
            Self::Write { path: text("run.rrd"), reason: text("no space left on device") },
            Self::NoPart { path: text("run.rrd"), reason: text("permission denied") },
            Self::Resumed { path: text("run.rrd"), count: 12 },
            Self::Log { reason: text("lengths differ") },
            Self::NoServer { reason: text("address in use") },
            Self::ViewerBehind { count: 40 },
            Self::NotClosed { path: text("run.rrd"), seconds: 5 },
        ]
    }
}
