//! A log much larger than the memory it may take beyond its numbers. One test a process, because what is measured is the
//! most the process ever held.
//!
//! `cargo test --release -p vasos-io --test big_log -- --ignored` reads 2 GB; it takes as much room on the disk for a
//! minute.

use std::fs::File;
use std::io::{BufWriter, Write};

use vasos_io::log::{ImportOptions, open_log};

/// Columns beside the time.
const COLUMNS: usize = 10;
/// What a log may take beyond its numbers.
const BEYOND: u64 = 300_000_000;

/// The most memory this process ever held, in bytes; `None` where the system does not say.
fn peak() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM"))?;
    line.split_whitespace().nth(1)?.parse::<u64>().ok().map(|kb| kb * 1024)
}

/// Writes a log of at least `bytes`, and says how many rows it has.
fn write(path: &std::path::Path, bytes: u64) -> usize {
    let mut out = BufWriter::with_capacity(1 << 20, File::create(path).expect("a file"));
    let mut written = 0;
    let names: Vec<String> = (0..COLUMNS).map(|i| format!("TIC{i}.PV")).collect();
    written += out.write(format!("time;{}\n", names.join(";")).as_bytes()).expect("room") as u64;
    let tails: Vec<String> = (0..997)
        .map(|k| {
            (0..COLUMNS)
                .map(|i| format!(";{}.{:06}", 100 + (k * 31 + i * 17) % 800, k * 1009 % 1_000_000))
                .collect()
        })
        .collect();
    let mut rows = 0;
    while written < bytes {
        let row = format!("{}.{}{}\n", rows / 10, rows % 10, tails[rows % tails.len()]);
        out.write_all(row.as_bytes()).expect("room");
        written += row.len() as u64;
        rows += 1;
    }
    out.flush().expect("room");
    rows
}

fn reads_in_little_memory(bytes: u64) {
    let Some(before) = peak() else {
        println!("skipped: this system does not say how much memory a process took");
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("big.csv");
    let rows = write(&path, bytes);
    let begun = std::time::Instant::now();
    let log = open_log(&path, &ImportOptions::default()).expect("a log");
    let spent_s = begun.elapsed().as_secs_f64();
    assert_eq!(log.table.len(), rows);
    assert!(log.report.repairs.is_empty(), "{:?}", log.report.repairs);
    let numbers = (rows * (COLUMNS + 1) * size_of::<f64>()) as u64;
    let taken = peak().expect("known a moment ago") - before;
    println!("{bytes} bytes, {rows} rows in {spent_s:.1} s: {taken} bytes taken, {numbers} of them numbers");
    assert!(taken < numbers + BEYOND.min(bytes / 2), "{taken} for {numbers}");
    assert!(taken < 3 * numbers, "{taken} for {numbers}");
}

#[test]
fn a_log_takes_little_more_memory_than_its_numbers() {
    reads_in_little_memory(200_000_000);
}

#[test]
#[ignore = "2 GB on the disk and as much in memory"]
fn two_gigabytes_take_little_more_memory_than_their_numbers() {
    reads_in_little_memory(2_000_000_000);
}
