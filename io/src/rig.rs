//! Rig and scenario files: TOML in, checked networks out, and the presets that ship inside the program.

use std::path::Path;
use std::sync::Arc;

use crate::rig_lines::{line_of, line_of_configuration};
use vasos_engine::experiment::ExperimentError;
use vasos_engine::explain::Explain;
use vasos_engine::plant::{Network, RigError, RigSpec};
use vasos_engine::session::CommandError;
use vasos_engine::sim::{Scenario, check_starts};

/// A preset that ships with the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Preset {
    /// Its id.
    pub id: &'static str,
    /// The file's text.
    pub text: &'static str,
}

/// The presets, the first being the one that opens.
pub const PRESETS: [Preset; 9] = [
    Preset { id: "stad", text: include_str!("../../assets/rigs/stad.toml") },
    Preset { id: "simtank1", text: include_str!("../../assets/rigs/simtank1.toml") },
    Preset { id: "simtank2", text: include_str!("../../assets/rigs/simtank2.toml") },
    Preset { id: "simtank3", text: include_str!("../../assets/rigs/simtank3.toml") },
    Preset { id: "cascade", text: include_str!("../../assets/rigs/cascade.toml") },
    Preset { id: "quadruple_minimum", text: include_str!("../../assets/rigs/quadruple_minimum.toml") },
    Preset { id: "quadruple_nonminimum", text: include_str!("../../assets/rigs/quadruple_nonminimum.toml") },
    Preset { id: "coupled_tanks", text: include_str!("../../assets/rigs/coupled_tanks.toml") },
    Preset { id: "cascaded_tanks", text: include_str!("../../assets/rigs/cascaded_tanks.toml") },
];

/// Why a rig or scenario file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// It cannot be read.
    #[error("{path} cannot be read: {reason}")]
    Read {
        /// Path as given.
        path: String,
        /// The system's words.
        reason: String,
    },
    /// It is not the TOML that the format asks for.
    #[error("{name}, line {line}: {reason}")]
    Format {
        /// File name.
        name: String,
        /// Line of the error, from 1.
        line: usize,
        /// What was expected.
        reason: String,
    },
    /// It describes a rig that cannot be.
    #[error("{}: {error}", place(name, *.line))]
    Rig {
        /// File name.
        name: String,
        /// Line of the item or field at fault, from 1, where it has one.
        line: Option<usize>,
        /// What is wrong.
        error: RigError,
    },
    /// It describes a rig that cannot start.
    #[error("{}: the rig cannot start in the configuration '{configuration}': {error}", place(name, *.line))]
    Start {
        /// File name.
        name: String,
        /// Line of the configuration, from 1, where there is one.
        line: Option<usize>,
        /// Id of the configuration; the rig's where it has none.
        configuration: String,
        /// Why not.
        error: Box<CommandError>,
    },
    /// It describes an experiment that cannot be.
    #[error("{}: {error}", place(name, *.line))]
    Experiment {
        /// File name.
        name: String,
        /// Line of the run, table or check at fault, from 1, where it has one.
        line: Option<usize>,
        /// What is wrong.
        error: Box<ExperimentError>,
    },
    /// It cannot be written.
    #[error("{path} cannot be written: {reason}")]
    Write {
        /// Path as given.
        path: String,
        /// The system's words.
        reason: String,
    },
}

fn place(name: &str, line: Option<usize>) -> String {
    line.map_or_else(|| name.to_owned(), |line| format!("{name}, line {line}"))
}

impl Explain for FileError {
    fn key(&self) -> &'static str {
        match self {
            Self::Read { .. } => "file.read",
            Self::Format { .. } => "file.format",
            Self::Rig { line: None, .. } => "file.rig",
            Self::Rig { .. } => "file.rig_line",
            Self::Start { line: None, .. } => "file.start",
            Self::Start { .. } => "file.start_line",
            Self::Experiment { line: None, .. } => "file.experiment",
            Self::Experiment { .. } => "file.experiment_line",
            Self::Write { .. } => "file.write",
        }
    }

    fn args(&self) -> Vec<(&'static str, String)> {
        match self {
            Self::Read { path, reason } | Self::Write { path, reason } => {
                vec![("path", path.clone()), ("reason", reason.clone())]
            }
            Self::Format { name, line, reason } => {
                vec![("name", name.clone()), ("line", line.to_string()), ("reason", reason.clone())]
            }
            Self::Rig { name, line, error } => {
                let mut args = vec![("name", name.clone()), ("error", error.to_string())];
                args.extend(line.map(|line| ("line", line.to_string())));
                args
            }
            Self::Experiment { name, line, error } => {
                let mut args = vec![("name", name.clone()), ("error", error.to_string())];
                args.extend(line.map(|line| ("line", line.to_string())));
                args
            }
            Self::Start { name, line, configuration, error } => {
                let mut args = vec![
                    ("name", name.clone()),
                    ("configuration", configuration.clone()),
                    ("error", error.to_string()),
                ];
                args.extend(line.map(|line| ("line", line.to_string())));
                args
            }
        }
    }

    fn cause(&self) -> Option<&dyn Explain> {
        match self {
            Self::Rig { error, .. } => Some(error),
            Self::Start { error, .. } => Some(&**error),
            Self::Experiment { error, .. } => Some(&**error),
            _ => None,
        }
    }
}

impl FileError {
    /// One of each kind, for the test that compares them with the translation files.
    #[must_use]
    pub fn samples() -> Vec<Self> {
        let text = |t: &str| t.to_owned();
        let start = |line| Self::Start {
            name: text("a.toml"),
            line,
            configuration: text("coupled"),
            error: Box::new(CommandError::UnknownTag { tag: text("LIC-01") }),
        };
        vec![
            Self::Read { path: text("a.toml"), reason: text("not found") },
            Self::Format { name: text("a.toml"), line: 3, reason: text("expected a number") },
            Self::Rig { name: text("a.toml"), line: None, error: RigError::NoTank },
            Self::Rig { name: text("a.toml"), line: Some(12), error: RigError::NoTank },
            Self::Experiment { name: text("a.toml"), line: None, error: Box::new(ExperimentError::Empty) },
            Self::Experiment { name: text("a.toml"), line: Some(9), error: Box::new(ExperimentError::Empty) },
            start(None),
            start(Some(70)),
            Self::Write { path: text("a.csv"), reason: text("disk full") },
        ]
    }
}

/// A preset by its id.
///
/// # Errors
/// [`FileError::Read`] when there is none of that name.
pub fn preset(id: &str) -> Result<Arc<Network>, FileError> {
    let found = PRESETS.iter().find(|p| p.id == id).ok_or_else(|| FileError::Read {
        path: id.to_owned(),
        reason: format!("no preset of that name; there are {}", PRESETS.map(|p| p.id).join(", ")),
    })?;
    parse_rig(&format!("{id}.toml"), found.text)
}

/// A rig from the text of its file; `name` stands in errors.
///
/// # Errors
/// [`FileError`] with the line, the item and value that cannot be, or the configuration that cannot start.
pub fn parse_rig(name: &str, text: &str) -> Result<Arc<Network>, FileError> {
    let spec: RigSpec = parse(name, text)?;
    let network = Network::new(spec).map_err(|error| FileError::Rig {
        name: name.to_owned(),
        line: line_of(text, &error),
        error,
    })?;
    let network = Arc::new(network);
    check_starts(&network).map_err(|start| FileError::Start {
        name: name.to_owned(),
        line: line_of_configuration(text, &start.configuration),
        configuration: start.configuration,
        error: Box::new(start.error),
    })?;
    Ok(network)
}

/// A rig by preset id, or by path of a file.
///
/// # Errors
/// [`FileError`].
pub fn load_rig(id_or_path: &str) -> Result<Arc<Network>, FileError> {
    if PRESETS.iter().any(|p| p.id == id_or_path) {
        return preset(id_or_path);
    }
    let path = Path::new(id_or_path);
    parse_rig(&file_name(path), &read_text(path)?)
}

/// The text of a rig by preset id, or by path of a file; with the name that stands in errors.
///
/// # Errors
/// [`FileError::Read`].
pub fn rig_text(id_or_path: &str) -> Result<(String, String), FileError> {
    if let Some(preset) = PRESETS.iter().find(|p| p.id == id_or_path) {
        return Ok((format!("{id_or_path}.toml"), preset.text.to_owned()));
    }
    let path = Path::new(id_or_path);
    Ok((file_name(path), read_text(path)?))
}

/// A scenario file, and the rig it names (a preset, or a file beside it).
///
/// # Errors
/// [`FileError`].
pub fn load_scenario(path: &Path) -> Result<(Scenario, Arc<Network>), FileError> {
    let name = file_name(path);
    let text = read_text(path)?;
    let scenario: Scenario = parse(&name, &text)?;
    if scenario.schema != 1 {
        let error = RigError::Schema { found: scenario.schema, known: 1 };
        return Err(FileError::Rig { name, line: line_of(&text, &error), error });
    }
    let network = if PRESETS.iter().any(|p| p.id == scenario.rig) {
        preset(&scenario.rig)?
    } else {
        let beside = path.parent().unwrap_or(Path::new(".")).join(&scenario.rig);
        parse_rig(&file_name(&beside), &read_text(&beside)?)?
    };
    Ok((scenario, network))
}

pub(crate) fn parse<T: serde::de::DeserializeOwned>(name: &str, text: &str) -> Result<T, FileError> {
    toml::from_str(text).map_err(|error| {
        let start = error.span().map_or(0, |span| span.start.min(text.len()));
        let line = text.get(..start).map_or(1, |before| before.matches('\n').count() + 1);
        FileError::Format { name: name.to_owned(), line, reason: error.message().trim().to_owned() }
    })
}

pub(crate) fn read_text(path: &Path) -> Result<String, FileError> {
    let failed = |reason: String| FileError::Read { path: path.display().to_string(), reason };
    if path.is_dir() {
        return Err(failed("it is a folder; choose the file inside it".to_owned()));
    }
    std::fs::read_to_string(path).map_err(|error| failed(error.to_string()))
}

pub(crate) fn file_name(path: &Path) -> String {
    path.file_name().map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into_owned())
}
