//! What panes ask for. One dispatcher carries it out.

use std::path::PathBuf;

use vasos_engine::document::DocumentCommand;
use vasos_engine::session::RigCommand;

use crate::answers::Question;
use crate::i18n::Language;
use crate::panes::PaneKind;

/// A kind of file for tables.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Table {
    /// Text, a row a line.
    Csv,
    /// Parquet, with units.
    Parquet,
}

impl Table {
    /// Ending of its files.
    #[must_use]
    pub fn ending(self) -> &'static str {
        match self {
            Self::Csv => "csv",
            Self::Parquet => "parquet",
        }
    }
}

/// Something a pane, a menu or a key asks for.
#[derive(Debug, Clone)]
pub enum Action {
    /// A change that can be undone.
    Document(DocumentCommand),
    /// The change before this was the last of its drag.
    Seal,
    /// Something of the rig that is no setting: a bump, an output in manual.
    Rig(RigCommand),
    /// Take back.
    Undo,
    /// Do again.
    Redo,
    /// Let time go on, or stand still.
    ToggleRunning,
    /// One sample.
    Step,
    /// Times real time.
    Speed(f64),
    /// Start the run again as the rig file and the settings have it.
    Restart,
    /// Rest at the loop's setpoint.
    SteadyAt(String, f64),
    /// Open a preset.
    OpenPreset(&'static str),
    /// Ask for a file and open it.
    AskFile,
    /// Open a file: a log or a rig.
    OpenFile(PathBuf),
    /// Open several files as one log.
    OpenLogs(Vec<PathBuf>),
    /// Play a run of the recording that was opened.
    PlayRun(usize),
    /// Go to a time of the recording that is played, in seconds.
    Seek(f64),
    /// Show the recording that runs, or the last one, in Rerun's viewer.
    OpenInRerun,
    /// Begin or end a recording.
    ToggleRecording,
    /// Record every run from the start.
    RecordAlways(bool),
    /// Switch the language.
    Language(Language),
    /// Switch between light and dark.
    ToggleTheme,
    /// Size of everything on the screen, 1 being normal.
    Zoom(f32),
    /// Keep the present run behind the next.
    KeepRun,
    /// Forget the kept run.
    DropKeptRun,
    /// Fit a model to the chosen stretch.
    Identify,
    /// Show an experiment.
    ChooseExperiment(String),
    /// Carry an experiment out.
    RunExperiment(String),
    /// End the experiment that runs.
    CancelExperiment,
    /// Show a pane alone, or all of them again.
    Maximise(PaneKind),
    /// Panes as at the first start.
    ResetLayout,
    /// Save the run's samples, as CSV or Parquet.
    ExportTrend(Table),
    /// Empty the log.
    ClearLog,
    /// Work something out beside the window, unless it is known.
    Ask(Box<Question>),
    /// Put words on the clipboard.
    Copy(String),
}
