//! What reading a log costs: 10⁶ rows of 10 columns, clean and messy, on one core.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use vasos_io::log::{ImportOptions, import_log};

const ROWS: usize = 1_000_000;

fn value(row: usize, column: usize) -> f64 {
    500.0 + 400.0 * ((row * 7 + column * 1313) as f64 * 0.013).sin()
}

/// Numbers alone, nine or ten digits each.
fn clean() -> String {
    let names: Vec<String> = (1..10).map(|i| format!("TIC{i}.PV")).collect();
    let mut text = format!("time,{}\n", names.join(","));
    for row in 0..ROWS {
        text.push_str(&format!("{}.{}", row / 10, row % 10));
        for column in 1..10 {
            text.push_str(&format!(",{:.6}", value(row, column)));
        }
        text.push('\n');
    }
    text
}

/// Dates, decimal commas, words among the numbers, blanks, text states.
fn messy() -> String {
    let names: Vec<String> = (1..8).map(|i| format!("TIC{i}.PV")).collect();
    let mut text = format!("time;{};mode;valve\n", names.join(";"));
    for row in 0..ROWS {
        let (day, second) = (1 + row / 86_400, row % 86_400);
        text.push_str(&format!(
            "{day:02}.03.2024 {:02}:{:02}:{:02}",
            second / 3600,
            second / 60 % 60,
            second % 60
        ));
        for column in 1..8 {
            match (row * 31 + column * 17) % 700 {
                0 => text.push_str(";Bad"),
                1 => text.push(';'),
                _ => text.push_str(&format!(";{:.6}", value(row, column)).replace('.', ",")),
            }
        }
        text.push_str(if row % 2000 < 1000 { ";AUTO" } else { ";MAN" });
        text.push_str([";open\n", ";closed\n", ";travel\n"][row / 50 % 3]);
    }
    text
}

fn import(c: &mut Criterion) {
    let mut group = c.benchmark_group("log");
    group.sample_size(10);
    for (name, text) in [("clean", clean()), ("messy", messy())] {
        group.throughput(Throughput::Bytes(text.len() as u64));
        group.bench_function(name, |b| {
            b.iter(|| import_log(name, text.as_bytes(), &ImportOptions::default()).expect("a log"));
        });
    }
    group.finish();
}

criterion_group!(benches, import);
criterion_main!(benches);
