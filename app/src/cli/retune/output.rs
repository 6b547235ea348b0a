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

/// Refuses a name that says something else than what is written.
pub(super) fn check_html(output: &Path) -> Result<(), Refusal> {
    if is_html(output) {
        return Ok(());
    }
    Err(Refusal(format!("{}: the report is HTML, its name must end in .html", output.display())))
}

pub(super) fn is_html(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("html") || e.eq_ignore_ascii_case("htm"))
}

pub(super) fn write(path: &Path, text: &str) -> Result<(), Refusal> {
    std::fs::write(path, text)
        .map_err(|error| Refusal(format!("{} cannot be written: {error}", path.display())))
}
