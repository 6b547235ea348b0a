//! Recordings: what the recorder takes of a core while a run goes on, its bytes a row, and opening for a replay.

use std::hint::black_box;
use std::path::Path;
use std::time::{Duration, Instant};

use criterion::{Criterion, criterion_group, criterion_main};
use vasos_engine::plant::Measurement;
use vasos_engine::session::RunStart;
use vasos_engine::signal::SampleBlock;
use vasos_engine::sim::ClosedLoop;
use vasos_io::recording::{Parts, Recording, RecordingOptions, read_runs};
use vasos_io::rig::{PRESETS, preset};

const FILE_ONLY: RecordingOptions = RecordingOptions { serve: false, port: None, part_bytes: None };

/// Loops of the first preset with so many channels.
fn loops(channels: usize) -> ClosedLoop {
    PRESETS
        .iter()
        .map(|p| preset(p.id).expect("preset"))
        .map(|network| ClosedLoop::simulated(network, 0, Measurement::DEFAULT, 1).expect("starts"))
        .find(|closed| closed.channels().len() >= channels)
        .expect("a preset of that size")
}

/// Rows of a run, as a session hands them over.
fn rows(closed: &mut ClosedLoop, count: usize, from: usize, period_s: f64) -> SampleBlock {
    let channels = closed.channels().clone();
    let mut block = SampleBlock { run: 0, channels, time_s: vec![], values: vec![] };
    for row in 0..count {
        block.time_s.push((from + row) as f64 * period_s);
        block.values.extend_from_slice(closed.step());
    }
    block
}

/// Seconds of processor time of this process.
fn processor_s() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    let fields: Vec<&str> = stat.rsplit(')').next()?.split_whitespace().collect();
    let ticks = |i: usize| fields.get(i)?.parse::<f64>().ok();
    // User and system time in hundredths of a second.
    Some((ticks(11)? + ticks(12)?) / 100.0)
}

/// Twenty channels at 1 kHz in real time, in hundredths of a second as a fast session hands them over.
fn share_of_a_core(folder: &Path) {
    const SECONDS: usize = 12;
    let mut closed = loops(20);
    let start = RunStart::of(&closed, 0);
    let blocks: Vec<SampleBlock> = (0..100 * SECONDS).map(|k| rows(&mut closed, 10, 10 * k, 1e-3)).collect();
    let (recording, mut sink) = Recording::start(&folder.join("fast.rrd"), FILE_ONLY).expect("records");
    sink.started(&start);
    let (begun, before) = (Instant::now(), processor_s());
    for (k, block) in blocks.iter().enumerate() {
        let due = begun + Duration::from_millis(10 * k as u64);
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
        sink.samples(block);
    }
    let (elapsed_s, after) = (begun.elapsed().as_secs_f64(), processor_s());
    let (rows, lost, bytes) = (recording.rows(), recording.lost(), recording.bytes());
    drop(sink);
    recording.close().expect("closes");
    let closed_bytes = std::fs::metadata(folder.join("fast.rrd")).map_or(0, |m| m.len());
    let channels = start.channels.len();
    let share = before.zip(after).map(|(a, b)| 100.0 * (b - a) / elapsed_s);
    println!(
        "recording {channels} channels at 1 kHz: {} % of a core, {rows} rows, {lost} lost, {:.0} bytes a row, {:.0} after closing",
        share.map_or_else(|| "?".to_owned(), |s| format!("{s:.2}")),
        bytes as f64 / rows as f64,
        closed_bytes as f64 / rows as f64,
    );
}

fn recording(c: &mut Criterion) {
    let folder = std::env::temp_dir().join(format!("vasos-bench-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    share_of_a_core(&folder);
    let hour = folder.join("hour.rrd");
    let mut closed = loops(19);
    let start = RunStart::of(&closed, 0);
    let (recording, mut sink) = Recording::start(&hour, FILE_ONLY).expect("records");
    sink.started(&start);
    for k in 0..18 {
        sink.samples(&rows(&mut closed, 1000, 1000 * k, 0.2));
    }
    drop(sink);
    recording.close().expect("closes");
    let mut group = c.benchmark_group("recording");
    group.sample_size(20);
    group.bench_function("open an hour for a replay", |b| {
        b.iter(|| read_runs(black_box(&Parts::of(&hour))).expect("reads"));
    });
    group.finish();
    drop(std::fs::remove_dir_all(&folder));
}

criterion_group!(benches, recording);
criterion_main!(benches);
