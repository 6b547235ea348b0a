//! The two files that `benches/peers` gives to other readers, 10⁶ rows of 10 columns each, and how long Vasos takes.
//!
//! ```text
//! cargo run --release --package vasos-io --example read_log -- write FOLDER
//! cargo run --release --package vasos-io --example read_log -- read FILE [RUNS] [OUT.json]
//! ```
//!
//! `clean.csv` is numbers alone; `messy.csv` has dates, decimal commas, words among the numbers, blanks and text states.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::time::Instant;

use serde_json::json;
use vasos_io::log::{ImportOptions, open_log};

const ROWS: u64 = 1_000_000;

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["write", folder] => write(Path::new(folder)),
        ["read", file, ref rest @ ..] => read(file, rest),
        _ => Err("write FOLDER, or read FILE [RUNS] [OUT.json]".into()),
    }
}

fn read(file: &str, rest: &[&str]) -> Result<(), Failure> {
    let runs: u32 = rest.first().map_or(Ok(5), |runs| runs.parse())?;
    let (mut best_s, mut rows) = (f64::INFINITY, 0);
    for _ in 0..runs {
        let begun = Instant::now();
        let log = open_log(Path::new(file), &ImportOptions::default())?;
        best_s = best_s.min(begun.elapsed().as_secs_f64());
        rows = log.table.len();
    }
    println!("{:.0} ms, {rows} rows", 1e3 * best_s);
    if let Some(path) = rest.get(1) {
        let found = json!({ "version": env!("CARGO_PKG_VERSION"), "seconds": best_s, "rows": rows });
        std::fs::write(path, found.to_string())?;
    }
    Ok(())
}

/// Digits that look like noise, always the same.
fn scattered(k: u64) -> u64 {
    let k = k.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (k ^ (k >> 29)).wrapping_mul(0xBF58_476D_1CE4_E5B9) >> 20
}

/// Nine or ten digits.
fn value(row: u64, column: u64, mark: char) -> String {
    let digits = scattered(row * 16 + column) % 1_000_000_000;
    format!("{}{mark}{:06}", digits / 1_000_000, digits % 1_000_000)
}

fn write(folder: &Path) -> Result<(), Failure> {
    let mut out = BufWriter::new(File::create(folder.join("clean.csv"))?);
    let names: Vec<String> = (1..10).map(|i| format!("TIC{i}.PV")).collect();
    writeln!(out, "time,{}", names.join(","))?;
    for row in 0..ROWS {
        write!(out, "{}.{}", row / 10, row % 10)?;
        for column in 1..10 {
            write!(out, ",{}", value(row, column, '.'))?;
        }
        out.write_all(b"\n")?;
    }
    out.flush()?;
    let mut out = BufWriter::new(File::create(folder.join("messy.csv"))?);
    let names: Vec<String> = (1..8).map(|i| format!("TIC{i}.PV")).collect();
    writeln!(out, "time;{};mode;valve", names.join(";"))?;
    for row in 0..ROWS {
        let (day, second) = (1 + row / 86_400, row % 86_400);
        write!(out, "{day:02}.03.2024 {:02}:{:02}:{:02}", second / 3600, second / 60 % 60, second % 60)?;
        for column in 1..8 {
            match scattered(row * 16 + column) % 700 {
                0 => out.write_all(b";Bad")?,
                1 => out.write_all(b";")?,
                _ => write!(out, ";{}", value(row, column, ','))?,
            }
        }
        let mode = ["AUTO", "MAN"][(scattered(row / 1000) % 2) as usize];
        writeln!(out, ";{mode};{}", ["open", "closed", "travel"][(scattered(row / 50) % 3) as usize])?;
    }
    Ok(out.flush()?)
}
