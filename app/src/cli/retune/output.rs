//! Where reports go: never over a log.

use std::path::Path;

use crate::cli::Refusal;

/// Refuses a report in the place of a log.
pub(super) fn check(output: &Path, log: &Path) -> Result<(), Refusal> {
    let same = match (output.canonicalize(), log.canonicalize()) {
        (Ok(output), Ok(log)) => output == log,
        _ => false,
    };
    if same {
        return Err(Refusal(format!(
            "{} is the log itself, and a log is never written over: name another file with -o",
            output.display()
        )));
    }
    Ok(())
}

pub(super) fn write(path: &Path, text: &str) -> Result<(), Refusal> {
    std::fs::write(path, text)
        .map_err(|error| Refusal(format!("{} cannot be written: {error}", path.display())))
}
