//! Tests that need something this computer lacks say so instead of passing in silence.

use std::io::Write;

/// Says that a test was skipped and why, on standard output and in the file that `VASOS_SKIPPED` names.
///
/// # Panics
/// When that file cannot be written.
pub fn skip(test: &str, reason: &str) {
    println!("skipped: {test}: {reason}");
    if let Some(path) = std::env::var_os("VASOS_SKIPPED") {
        let mut file =
            std::fs::OpenOptions::new().create(true).append(true).open(path).expect("the list opens");
        writeln!(file, "{test}: {reason}").expect("the list takes a line");
    }
}
