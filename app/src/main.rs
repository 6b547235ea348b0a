//! `vasos`: the workbench, or one of its commands.

use std::process::ExitCode;

use vasos_app::cli::{self, CliOutcome};
use vasos_app::workbench::{self, Options};

fn main() -> ExitCode {
    match cli::main_with(std::env::args_os()) {
        CliOutcome::Exit(status) => ExitCode::from(status),
        CliOutcome::OpenWindow(file) => match workbench::open(Options { file, ..Options::default() }) {
            Ok(()) => ExitCode::SUCCESS,
            Err(error) => {
                eprintln!("vasos: the window cannot be opened: {error:#}");
                ExitCode::from(2)
            }
        },
    }
}
