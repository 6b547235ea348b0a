//! Real logs, read where `VASOS_TEST_DATA` says; their licences keep them out of the project.

#![allow(dead_code, reason = "each test binary uses its part")]

use std::io::Write;
use std::path::{Path, PathBuf};

fn folder() -> Option<PathBuf> {
    std::env::var_os("VASOS_TEST_DATA").map(PathBuf::from).filter(|p| p.is_dir())
}

/// A log by its path in the folder; `None` where there is no folder.
pub fn read_log(path: &str) -> Option<Vec<u8>> {
    let path = folder()?.join(path);
    Some(std::fs::read(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display())))
}

/// Notes that a test was not run, and why.
pub fn skip(name: &str, why: &str) {
    println!("skipped {name}: {why}");
    if let Some(path) = std::env::var_os("VASOS_SKIPPED")
        && let Ok(mut file) = std::fs::OpenOptions::new().create(true).append(true).open(path)
    {
        let _ = writeln!(file, "{name}: {why}");
    }
}

/// Visits every file below the folder; gives how many.
pub fn for_each_log(mut visit: impl FnMut(&str, &[u8])) -> usize {
    fn walk(at: &Path, visit: &mut dyn FnMut(&str, &[u8])) -> usize {
        let Ok(entries) = std::fs::read_dir(at) else { return 0 };
        let paths = entries.flatten().map(|e| e.path());
        paths
            .map(|path| {
                if path.is_dir() {
                    return walk(&path, visit);
                }
                let bytes = std::fs::read(&path).expect("a readable file");
                visit(&path.to_string_lossy(), &bytes);
                1
            })
            .sum()
    }
    folder().map_or(0, |folder| walk(&folder, &mut visit))
}

/// The folder and every log in it, sorted; `None` where there is no folder.
pub fn log_paths() -> Option<(PathBuf, Vec<PathBuf>)> {
    fn walk(at: &Path, found: &mut Vec<PathBuf>) {
        let Ok(entries) = std::fs::read_dir(at) else { return };
        for path in entries.flatten().map(|e| e.path()) {
            if path.is_dir() {
                walk(&path, found);
            } else if path.extension().is_none_or(|e| e != "md") {
                found.push(path);
            }
        }
    }
    let folder = folder()?;
    let mut found = Vec::new();
    walk(&folder, &mut found);
    found.sort();
    Some((folder, found))
}
