//! Damaged files: logs, rigs and scenarios changed at random. None may panic or take a second; a log in which one field
//! was spoilt keeps every other number as it was.
//!
//! `VASOS_MUTATIONS=1000000 cargo test --release -p vasos-io --test mutations` runs as many as it says; without it, few.
//! What fails is printed with its number: the same number gives the same input.

mod seeds;

use std::panic::catch_unwind;
use std::time::{Duration, Instant};

use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use vasos_io::log::{ImportOptions, ImportedLog, import_log};
use vasos_io::rig::{PRESETS, load_scenario, parse_rig};

use seeds::{Seed, log_seeds};

/// Longest time for one small input.
const LIMIT: Duration = Duration::from_secs(1);
/// Inputs of an ordinary run of the tests; a debug build is some ten times slower.
const FEW: usize = if cfg!(debug_assertions) { 2_000 } else { 20_000 };

fn count() -> usize {
    std::env::var("VASOS_MUTATIONS").ok().and_then(|n| n.parse().ok()).unwrap_or(FEW)
}

/// What a damaged file has in it.
const TOKENS: [&[u8]; 34] = [
    b",",
    b";",
    b"\t",
    b"||",
    b"|",
    b"\n",
    b"\r\n",
    b"\r",
    b" ",
    b"\"",
    b"'",
    b"-",
    b".",
    b"e",
    b"1e999",
    b"NaN",
    b"inf",
    b"#",
    b"[",
    b"]",
    b"=",
    b"->",
    b":",
    b"T1:",
    b"0",
    b"99999999999999999999",
    b"2024-01-02",
    b"10:00:00",
    b"31/02/2024",
    b"\xff",
    b"\0",
    b"\xEF\xBB\xBF",
    b"\xC3\xA9",
    b"Bad",
];

fn mutate(random: &mut Xoshiro256PlusPlus, bytes: &mut Vec<u8>, others: &[Vec<u8>]) {
    let at = |random: &mut Xoshiro256PlusPlus, n: usize| random.random_range(0..n + 1);
    for _ in 0..random.random_range(1..6) {
        let (a, b) = (at(random, bytes.len()), at(random, bytes.len()));
        let (from, to) = (a.min(b), a.max(b).min(a.min(b) + 200));
        match random.random_range(0..8) {
            0 if !bytes.is_empty() => {
                let i = a % bytes.len();
                bytes[i] ^= 1 << (b % 8);
            }
            1 => drop(bytes.drain(from..to)),
            2 => drop(bytes.splice(a..a, TOKENS[b % TOKENS.len()].iter().copied())),
            3 => {
                let copy = bytes[from..to].to_vec();
                drop(bytes.splice(b..b, copy));
            }
            4 => bytes.truncate(a),
            5 => {
                let other = &others[b % others.len()];
                let from = a % other.len();
                let piece = other[from..(from + 80).min(other.len())].to_vec();
                drop(bytes.splice(a..a, piece));
            }
            6 => {
                let (old, new) = (TOKENS[a % 9], TOKENS[b % 9]);
                if let Some(i) = bytes.windows(old.len()).position(|w| w == old) {
                    drop(bytes.splice(i..i + old.len(), new.iter().copied()));
                }
            }
            _ => {
                let mut lines: Vec<&[u8]> = bytes.split_inclusive(|b| *b == b'\n').collect();
                let n = lines.len().max(1);
                if n > 1 {
                    lines.swap(a % n, b % n);
                }
                *bytes = lines.concat();
            }
        }
    }
}

/// A log that keeps the promises of its type.
fn check(log: &ImportedLog) {
    let table = &log.table;
    assert!(table.len() > 1 && table.lines.len() == table.len());
    assert!(table.time_s.iter().all(|t| t.is_finite()), "time that is no number");
    assert!(table.time_s.windows(2).all(|w| w[1] >= w[0]), "time runs back");
    for column in &table.columns {
        assert_eq!(column.values.len(), table.len());
        assert!(column.values.iter().all(|v| !v.is_infinite()));
        let states = column.states.len();
        let is_state = |v: &f64| v.is_nan() || (*v >= 0.0 && (*v as usize) < states);
        assert!(states == 0 || column.values.iter().all(is_state), "a state without a word");
    }
}

/// Runs one input; panics with its number. A busy computer may hold one up: the shortest of three times counts.
fn run(case: usize, what: &str, input: &[u8], work: impl Fn() + std::panic::RefUnwindSafe) {
    let shown = || String::from_utf8_lossy(input).into_owned();
    let mut spent = Duration::MAX;
    for _ in 0..3 {
        let begun = Instant::now();
        let outcome = catch_unwind(&work);
        assert!(outcome.is_ok(), "{what} {case} panicked:\n{}", shown());
        spent = spent.min(begun.elapsed());
        if spent < LIMIT {
            return;
        }
    }
    panic!("{what} {case} took {spent:?}:\n{}", shown());
}

#[test]
fn damaged_logs_give_a_log_or_a_reason() {
    let seeds: Vec<Vec<u8>> = log_seeds().into_iter().map(|seed| seed.bytes()).collect();
    for case in 0..count() / 2 {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(case as u64);
        let mut bytes = seeds[case % seeds.len()].clone();
        mutate(&mut random, &mut bytes, &seeds);
        run(case, "log", &bytes, || {
            if let Ok(log) = import_log("damaged", &bytes, &ImportOptions::default()) {
                check(&log);
            }
        });
    }
}

/// Values by line of the file and name of the column.
fn value_at(log: &ImportedLog, line: u32, column: &str) -> Option<f64> {
    let row = log.table.lines.iter().position(|l| *l == line)?;
    log.table.column(column).map(|c| c.values[row])
}

#[test]
fn a_spoilt_field_leaves_the_other_numbers_alone() {
    const SPOILT: [&str; 16] = [
        "",
        "Bad",
        "x",
        "-",
        "1.2.3",
        "99999",
        "-0",
        "é",
        "#",
        "I/O Timeout",
        "No Data",
        "1e400",
        "2024",
        "nan",
        "?",
        "12:61",
    ];
    let seeds: Vec<Seed> = log_seeds().into_iter().filter(|seed| seed.is_table).collect();
    let whole: Vec<ImportedLog> = seeds
        .iter()
        .map(|seed| import_log("whole", &seed.bytes(), &ImportOptions::default()).expect("a log"))
        .collect();
    for case in 0..count() / 4 {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(case as u64);
        let (seed, before) = (&seeds[case % seeds.len()], &whole[case % seeds.len()]);
        let row = random.random_range(0..seed.rows.len());
        let field = random.random_range(1..seed.rows[row].len());
        let mut spoilt = seed.clone();
        spoilt.rows[row][field] = SPOILT[random.random_range(0..SPOILT.len())].to_owned();
        let bytes = spoilt.bytes();
        run(case, "field", &bytes, || {
            let log = import_log("spoilt", &bytes, &ImportOptions::default()).expect("still a log");
            check(&log);
            let line = (seed.header_lines + row + 1) as u32;
            for column in before.table.columns.iter().filter(|c| c.states.is_empty()) {
                for (k, &other) in before.table.lines.iter().enumerate() {
                    if other == line && column.name == seed.names[field] {
                        continue;
                    }
                    let (then, now) = (column.values[k], value_at(&log, other, &column.name));
                    // A row whose time was spoilt is left out, and that is told.
                    if other == line && now.is_none() && !log.report.repairs.is_empty() {
                        continue;
                    }
                    let same = now.is_some_and(|now| now == then || (now.is_nan() && then.is_nan()));
                    assert!(same, "{} in line {other}: {then} became {now:?}", column.name);
                }
            }
        });
    }
}

#[test]
fn damaged_rigs_and_scenarios_give_a_reason() {
    let rigs: Vec<Vec<u8>> = PRESETS.iter().map(|p| p.text.as_bytes().to_vec()).collect();
    let scenario = b"rig = \"stad\"\nduration_s = 60\nseed = 3\n\n[[event]]\ntime_s = 10\nsetpoint = { loop = \"LIC-02\", level_cm = 20 }\n".to_vec();
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scenario.toml");
    for case in 0..count() / 4 {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(case as u64);
        let is_rig = case % 4 > 0;
        let mut bytes = if is_rig { rigs[case % rigs.len()].clone() } else { scenario.clone() };
        mutate(&mut random, &mut bytes, &rigs);
        let text = String::from_utf8_lossy(&bytes).into_owned();
        if !is_rig {
            std::fs::write(&path, &text).expect("a file");
        }
        run(case, if is_rig { "rig" } else { "scenario" }, &bytes, || {
            if is_rig {
                drop(parse_rig("damaged", &text));
            } else {
                drop(load_scenario(&path));
            }
        });
    }
}
