//! Tidying a finished file up: larger chunks and a footer.

use std::path::{Path, PathBuf};
use std::thread::JoinHandle;

/// A file larger than this is not optimised: that takes it into memory as a whole.
const OPTIMISE_BYTES: u64 = 64 * 1024 * 1024;

/// Rows of a chunk: what a cut of the file, or a damaged place, costs at most.
const MOST_ROWS: u64 = 1_000;

/// The file that is written while one is tidied up.
pub(super) fn tidying_path(path: &Path) -> PathBuf {
    let mut beside = path.as_os_str().to_owned();
    beside.push(".optimising");
    PathBuf::from(beside)
}

/// Rewrites a finished file of moderate size with larger chunks and a footer; on any doubt it stays as it is.
pub(super) fn tidy(path: &Path) {
    let size = |p: &Path| std::fs::metadata(p).map_or(0, |m| m.len());
    if size(path) > OPTIMISE_BYTES {
        return;
    }
    let beside = tidying_path(path);
    let profile = rerun::rrd::OptimizationProfile {
        chunk_max_rows: MOST_ROWS,
        chunk_max_rows_if_unsorted: MOST_ROWS,
        ..rerun::rrd::OptimizationProfile::OBJECT_STORE
    };
    let better = rerun::rrd::optimize_file(path, &beside, &profile).is_ok()
        && (1..=size(path)).contains(&size(&beside));
    if !(better && std::fs::rename(&beside, path).is_ok()) {
        drop(std::fs::remove_file(&beside));
    }
}

/// The same on a thread of its own; without one the file stays as it is, which is readable.
pub(super) fn tidy_beside(path: PathBuf) -> Option<JoinHandle<()>> {
    std::thread::Builder::new().name("vasos-tidying".to_owned()).spawn(move || tidy(&path)).ok()
}
