//! `vasos`: the workbench, or one of its commands.

use std::process::ExitCode;

use vasos_app::cli::{self, CliOutcome};
use vasos_app::workbench::{self, Options};

fn main() -> ExitCode {
    match cli::main_with(std::env::args_os()) {
        CliOutcome::Exit(status) => ExitCode::from(status),
        CliOutcome::OpenWindow(_) if !has_display() => {
            eprintln!(
                "vasos: there is no display to open the window on (neither DISPLAY nor WAYLAND_DISPLAY is set); \
                 the commands need none, see `vasos help`"
            );
            ExitCode::from(2)
        }
        CliOutcome::OpenWindow(file) => match workbench::open(Options { file, ..Options::default() }) {
            Ok(()) => ExitCode::SUCCESS,
            Err(error) => {
                eprintln!("vasos: the window cannot be opened: {error:#}");
                ExitCode::from(2)
            }
        },
    }
}

/// Whether there is a display server to ask for a window; elsewhere than on Unix desktops there always is.
fn has_display() -> bool {
    let named = |name: &str| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    !cfg!(target_os = "linux") || named("DISPLAY") || named("WAYLAND_DISPLAY")
}
