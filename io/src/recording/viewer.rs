//! Rerun's viewer as a program of its own: found where it is usually installed, started on a recording or a running one.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use vasos_engine::explain::Explain;

/// Names the viewer's program where it is in no usual place.
pub const VARIABLE: &str = "VASOS_RERUN";

/// Version of the viewer that reads what this program writes.
pub const VERSION: &str = "0.36.3";

/// Why the viewer does not open.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ViewerError {
    /// It is not installed.
    #[error(
        "Rerun's viewer was not found; install it with: pip install rerun-sdk=={version} (or: cargo install rerun-cli --version {version}), or name its program in {VARIABLE}"
    )]
    Missing {
        /// Version that fits.
        version: String,
    },
    /// It does not start.
    #[error("Rerun's viewer {program} does not start: {reason}")]
    Start {
        /// Program.
        program: String,
        /// The system's words.
        reason: String,
    },
}

impl Explain for ViewerError {
    fn key(&self) -> &'static str {
        match self {
            Self::Missing { .. } => "viewer.missing",
            Self::Start { .. } => "viewer.start",
        }
    }

    fn args(&self) -> Vec<(&'static str, String)> {
        match self {
            Self::Missing { version } => {
                vec![("version", version.clone()), ("variable", VARIABLE.to_owned())]
            }
            Self::Start { program, reason } => {
                vec![("program", program.clone()), ("reason", reason.clone())]
            }
        }
    }
}

impl ViewerError {
    /// One of each kind, for the test that compares them with the translation files.
    #[must_use]
    pub fn samples() -> Vec<Self> {
        vec![
            Self::Missing { version: VERSION.to_owned() },
            Self::Start { program: "/usr/bin/rerun".to_owned(), reason: "permission denied".to_owned() },
        ]
    }
}

/// What the viewer shows.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Shown {
    /// Files, the parts of a recording or several recordings.
    Files(Vec<PathBuf>),
    /// A recording that runs, by the address of its server.
    Running(String),
}

/// The viewer's program.
///
/// # Errors
/// [`ViewerError::Missing`] with what to install.
pub fn find() -> Result<PathBuf, ViewerError> {
    let named = std::env::var_os(VARIABLE).filter(|v| !v.is_empty()).map(PathBuf::from);
    let candidates = named.into_iter().chain(places());
    candidates
        .into_iter()
        .find(|program| program.is_file())
        .ok_or_else(|| ViewerError::Missing { version: VERSION.to_owned() })
}

/// Where it is usually installed: the path, Python environments, what pip and cargo install for one user.
fn places() -> Vec<PathBuf> {
    let name = format!("rerun{}", std::env::consts::EXE_SUFFIX);
    let bin = if cfg!(windows) { "Scripts" } else { "bin" };
    let mut folders: Vec<PathBuf> =
        std::env::var_os("VIRTUAL_ENV").map(|v| PathBuf::from(v).join(bin)).into_iter().collect();
    folders.extend(std::env::var_os("PATH").iter().flat_map(|path| std::env::split_paths(path)));
    let here = std::env::current_dir().ok();
    let program = std::env::current_exe().ok();
    // A checkout has its environment in its root, the program somewhere below it.
    let above = program.iter().flat_map(|p| p.ancestors().skip(1).take(4).map(Path::to_owned));
    folders.extend(here.into_iter().chain(above).map(|folder| folder.join(".venv").join(bin)));
    if let Some(user) = directories::BaseDirs::new() {
        folders.extend([".cargo/bin", ".local/bin"].map(|folder| user.home_dir().join(folder)));
    }
    folders.into_iter().map(|folder| folder.join(&name)).collect()
}

/// Starts the viewer on something. It lives on when this program ends.
///
/// # Errors
/// [`ViewerError`].
pub fn open(shown: &Shown) -> Result<Child, ViewerError> {
    open_with(&find()?, shown)
}

/// Starts a given program as the viewer.
///
/// # Errors
/// [`ViewerError::Start`].
pub fn open_with(program: &Path, shown: &Shown) -> Result<Child, ViewerError> {
    let mut command = Command::new(program);
    match shown {
        // A port of its own: on the usual one it would take a recording's server for another viewer.
        Shown::Files(files) => {
            command.args(["--bind", "127.0.0.1", "--port", "0"]);
            command.args(files.iter().map(|file| -> &OsStr { file.as_os_str() }));
        }
        Shown::Running(address) => {
            command.args(["--connect", address]);
        }
    }
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command.spawn().map_err(|error| ViewerError::Start {
        program: program.display().to_string(),
        reason: error.to_string(),
    })
}
