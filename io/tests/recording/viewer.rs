//! Rerun's own viewer, from the project's Python environment.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use super::skip;

pub struct Viewer {
    program: PathBuf,
    home: tempfile::TempDir,
}

/// The viewer in `.venv` of the repository or in the folder that `VASOS_VENV` names; says why there is none.
pub fn find(test: &str) -> Option<Viewer> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../.venv");
    let venv = std::env::var_os("VASOS_VENV").map_or(root, PathBuf::from);
    // The program itself: what pip puts into bin is a script beside it, and killing that leaves the viewer alone.
    let site = venv.join("lib").read_dir().into_iter().flatten().flatten().map(|python| python.path());
    let program = site.map(|s| s.join("site-packages/rerun_sdk/rerun_cli/rerun")).find(|p| p.is_file());
    let Some(program) = program else {
        let why = "no viewer: python3 -m venv .venv && .venv/bin/pip install rerun-sdk==0.36.3";
        skip(test, why);
        return None;
    };
    let viewer = Viewer { program, home: tempfile::tempdir().expect("a folder") };
    let status = viewer.command().args(["analytics", "disable"]).status();
    assert!(status.expect("the viewer starts").success());
    Some(viewer)
}

impl Viewer {
    fn command(&self) -> Command {
        let mut command = Command::new(&self.program);
        let home = self.home.path();
        for variable in ["HOME", "XDG_CONFIG_HOME", "XDG_DATA_HOME", "XDG_CACHE_HOME", "XDG_RUNTIME_DIR"] {
            command.env(variable, home);
        }
        command.stdout(Stdio::null()).stderr(Stdio::null());
        command
    }

    /// Opens files without a window and takes a picture.
    pub fn screenshot(&self, files: &[&OsStr], picture: &Path) {
        let mut command = self.command();
        command.args(["--headless", "--window-size", "1400x900", "--bind", "127.0.0.1", "--port", "0"]);
        command.arg("--screenshot-to").arg(picture).args(files);
        let status = command.status().expect("the viewer starts");
        assert!(status.success(), "{status}");
    }

    /// Joins a live recording without a window.
    pub fn join(&self, address: &str) -> Child {
        let mut command = self.command();
        command.args(["--headless", "--window-size", "800x600", "--connect", address]);
        command.spawn().expect("the viewer starts")
    }
}

/// Makes a viewer stand still without ending it.
pub fn stop(viewer: &Child) {
    let status = Command::new("kill").args(["-STOP", &viewer.id().to_string()]).status();
    assert!(status.expect("kill starts").success());
}
