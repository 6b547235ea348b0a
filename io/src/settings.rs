//! Settings of the user: small JSON files in the configuration folder, and the folder for recordings.
//!
//! A settings file is replaced whole: written beside, flushed to disk, then renamed over the old one, so that a
//! crash leaves the old file or the new one. A file that cannot be understood is kept as `name.json.damaged`.

use std::ffi::OsString;
use std::io::Write;
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde::de::DeserializeOwned;
use vasos_engine::explain::Explain;

/// Environment variable that overrides the folder of the settings.
pub const CONFIG_DIR_VARIABLE: &str = "VASOS_CONFIG_DIR";
/// Environment variable that overrides the folder of the recordings.
pub const RECORDINGS_DIR_VARIABLE: &str = "VASOS_RECORDINGS_DIR";

/// What went wrong with a settings file; the program goes on.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SettingsTrouble {
    /// The system names no folder for settings.
    #[error("there is no folder for settings on this system: set the variable VASOS_CONFIG_DIR to one")]
    NoFolder,
    /// A name that would leave the folder.
    #[error("'{name}' is no name for settings: use letters, digits, - and _")]
    Name {
        /// Name as given.
        name: String,
    },
    /// It is there but cannot be read.
    #[error("the settings in {path} cannot be read ({reason}): the defaults are used")]
    Read {
        /// File.
        path: String,
        /// The system's words.
        reason: String,
    },
    /// It is not what the program wrote.
    #[error(
        "the settings in {path} are damaged ({reason}): the defaults are used, the file is kept as {kept}"
    )]
    Damaged {
        /// File.
        path: String,
        /// What was expected.
        reason: String,
        /// Where it is now.
        kept: String,
    },
    /// It cannot be written.
    #[error("the settings cannot be saved to {path}: {reason}")]
    Write {
        /// File.
        path: String,
        /// The system's words.
        reason: String,
    },
}

impl Explain for SettingsTrouble {
    fn key(&self) -> &'static str {
        match self {
            Self::NoFolder => "settings.no_folder",
            Self::Name { .. } => "settings.name",
            Self::Read { .. } => "settings.read",
            Self::Damaged { .. } => "settings.damaged",
            Self::Write { .. } => "settings.write",
        }
    }

    fn args(&self) -> Vec<(&'static str, String)> {
        match self {
            Self::NoFolder => vec![],
            Self::Name { name } => vec![("name", name.clone())],
            Self::Read { path, reason } | Self::Write { path, reason } => {
                vec![("path", path.clone()), ("reason", reason.clone())]
            }
            Self::Damaged { path, reason, kept } => {
                vec![("path", path.clone()), ("reason", reason.clone()), ("kept", kept.clone())]
            }
        }
    }
}

impl SettingsTrouble {
    /// One of each kind, for the test that compares them with the translation files.
    #[must_use]
    pub fn samples() -> Vec<Self> {
        let text = |t: &str| t.to_owned();
        vec![
            Self::NoFolder,
            Self::Name { name: text("../x") },
            Self::Read { path: text("window.json"), reason: text("permission denied") },
            Self::Damaged {
                path: text("window.json"),
                reason: text("expected a number"),
                kept: text("window.json.damaged"),
            },
            Self::Write { path: text("window.json"), reason: text("disk full") },
        ]
    }
}

/// Settings by name, for example `window`; defaults where there are none or they are unusable.
#[must_use]
pub fn load<T: DeserializeOwned + Default>(name: &str) -> (T, Option<SettingsTrouble>) {
    match file(name) {
        Ok(path) => load_from(&path),
        Err(trouble) => (T::default(), Some(trouble)),
    }
}

/// Saves settings under a name, for example `window`.
///
/// # Errors
/// [`SettingsTrouble`]; the file of before is untouched then.
pub fn save<T: Serialize>(name: &str, settings: &T) -> Result<(), SettingsTrouble> {
    save_to(&file(name)?, settings)
}

/// Folder for recordings, created when it is missing: `Vasos` among the user's documents, or in the home folder.
///
/// A folder that cannot be created is returned all the same; whoever writes there gets the system's error.
#[must_use]
pub fn recordings_dir() -> PathBuf {
    let folder = variable(RECORDINGS_DIR_VARIABLE).unwrap_or_else(|| {
        let user = directories::UserDirs::new();
        let parent = user.as_ref().map(|u| u.document_dir().unwrap_or(u.home_dir()).to_owned());
        parent.unwrap_or_else(std::env::temp_dir).join("Vasos")
    });
    // The error comes up when the recording starts, with the path in it.
    drop(std::fs::create_dir_all(&folder));
    folder
}

fn load_from<T: DeserializeOwned + Default>(path: &Path) -> (T, Option<SettingsTrouble>) {
    let shown = path.display().to_string();
    let bytes = match std::fs::read(path) {
        Ok(bytes) => bytes,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return (T::default(), None),
        Err(error) => {
            let trouble = SettingsTrouble::Read { path: shown, reason: error.to_string() };
            return (T::default(), Some(trouble));
        }
    };
    match serde_json::from_slice(&bytes) {
        Ok(settings) => (settings, None),
        Err(error) => {
            let kept = with_suffix(path, ".damaged");
            let trouble = match std::fs::rename(path, &kept) {
                Ok(()) => SettingsTrouble::Damaged {
                    path: shown,
                    reason: error.to_string(),
                    kept: kept.display().to_string(),
                },
                Err(failed) => SettingsTrouble::Read { path: shown, reason: format!("{error}; {failed}") },
            };
            (T::default(), Some(trouble))
        }
    }
}

fn save_to<T: Serialize>(path: &Path, settings: &T) -> Result<(), SettingsTrouble> {
    let failed = |reason: String| SettingsTrouble::Write { path: path.display().to_string(), reason };
    let text = serde_json::to_vec_pretty(settings).map_err(|error| failed(error.to_string()))?;
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).map_err(|error| failed(error.to_string()))?;
    }
    // A name of its own for each process: two windows that close together must not share it.
    let beside = with_suffix(path, &format!(".{}.new", std::process::id()));
    let written = write_through(&beside, &text).and_then(|()| std::fs::rename(&beside, path));
    written.map_err(|error| {
        drop(std::fs::remove_file(&beside));
        failed(error.to_string())
    })
}

fn write_through(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let mut file = std::fs::File::create(path)?;
    file.write_all(bytes)?;
    file.sync_all()
}

fn file(name: &str) -> Result<PathBuf, SettingsTrouble> {
    let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_');
    if name.is_empty() || !name.chars().all(plain) {
        return Err(SettingsTrouble::Name { name: name.to_owned() });
    }
    let usual = || directories::ProjectDirs::from("", "", "vasos").map(|d| d.config_dir().to_owned());
    let folder = variable(CONFIG_DIR_VARIABLE).or_else(usual).ok_or(SettingsTrouble::NoFolder)?;
    Ok(folder.join(format!("{name}.json")))
}

fn variable(name: &str) -> Option<PathBuf> {
    std::env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from)
}

fn with_suffix(path: &Path, suffix: &str) -> PathBuf {
    let mut name = OsString::from(path);
    name.push(suffix);
    PathBuf::from(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, Default, PartialEq, Serialize, serde::Deserialize)]
    struct Window {
        width: u32,
    }

    #[test]
    fn what_is_saved_is_loaded_and_nothing_is_left_beside() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("deeper/window.json");
        assert_eq!(load_from::<Window>(&path), (Window::default(), None), "nothing there is no trouble");
        for width in [800, 1400] {
            save_to(&path, &Window { width }).expect("saved");
            assert_eq!(load_from::<Window>(&path), (Window { width }, None));
        }
        let files = std::fs::read_dir(path.parent().expect("a parent")).expect("listed").count();
        assert_eq!(files, 1);
    }

    #[test]
    fn a_damaged_file_is_kept_beside_and_said() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("window.json");
        std::fs::write(&path, "{\"width\": 8").expect("written");
        let (window, trouble) = load_from::<Window>(&path);
        assert_eq!(window, Window::default());
        assert!(matches!(trouble, Some(SettingsTrouble::Damaged { .. })), "{trouble:?}");
        let kept = folder.path().join("window.json.damaged");
        assert_eq!(std::fs::read_to_string(kept).expect("kept"), "{\"width\": 8");
        assert_eq!(load_from::<Window>(&path).1, None, "said once");
    }

    #[test]
    fn a_folder_that_is_a_file_is_an_error_in_words() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("a_file");
        std::fs::write(&file, "").expect("written");
        let trouble = save_to(&file.join("window.json"), &Window::default()).expect_err("no folder");
        assert!(matches!(trouble, SettingsTrouble::Write { .. }), "{trouble}");
    }

    #[test]
    fn names_cannot_leave_the_folder() {
        for name in ["", "..", "a/b", "../window"] {
            assert!(matches!(file(name), Err(SettingsTrouble::Name { .. })), "{name}");
        }
    }
}
