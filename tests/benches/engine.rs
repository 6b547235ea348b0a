//! What the engine costs: simulation at the sample time, identification, analysis.

use std::hint::black_box;

use criterion::{BatchSize, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use vasos_engine::analyze::{analyze, step_figures};
use vasos_engine::control::PidGains;
use vasos_engine::identify::{FitProblem, fit_fopdt, simulate_fopdt};
use vasos_engine::model::{Fopdt, ProcessModel};
use vasos_engine::plant::Measurement;
use vasos_engine::session::RigCommand;
use vasos_engine::sim::ClosedLoop;
use vasos_io::rig::{PRESETS, preset};

const HOUR_S: f64 = 3600.0;

/// The model published for TQ2 of the STAD rig: cm per V, seconds.
fn model() -> Fopdt {
    Fopdt::new(4.9, 152.0, 2.0).expect("a model")
}

/// An hour of each preset with noise and converters; a loop steps its setpoint every ten minutes.
fn closed_loop(c: &mut Criterion) {
    let mut group = c.benchmark_group("one_hour_of_samples");
    group.sample_size(20);
    for id in PRESETS.map(|p| p.id) {
        let network = preset(id).expect("a preset");
        let samples = (HOUR_S / network.spec.sample_time_s).round() as u64;
        let start = || ClosedLoop::simulated(network.clone(), 0, Measurement::DEFAULT, 1).expect("starts");
        group.throughput(Throughput::Elements(samples));
        group.bench_function(BenchmarkId::from_parameter(id), |b| {
            b.iter_batched(start, |closed| an_hour(closed, samples), BatchSize::LargeInput);
        });
    }
    group.finish();
}

fn an_hour(mut closed: ClosedLoop, samples: u64) -> f64 {
    let tags: Vec<String> = closed.loops().iter().map(|l| l.spec.id.clone()).collect();
    let mut last = 0.0;
    for sample in 0..samples {
        if sample % (samples / 6) == 0 {
            let level_cm = if (sample / (samples / 6)).is_multiple_of(2) { 10.0 } else { 12.0 };
            for tag in &tags {
                closed
                    .apply(&RigCommand::Setpoint { tag: tag.clone(), level_cm })
                    .expect("a level below the rim");
            }
        }
        last = black_box(closed.step())[0];
    }
    last
}

/// Ten thousand rows of a step test with noise of 0.05 cm, always the same.
fn identify(c: &mut Criterion) {
    const ROWS: u32 = 10_000;
    let time_s: Vec<f64> = (0..ROWS).map(|k| 0.2 * f64::from(k)).collect();
    let mv: Vec<f64> = time_s.iter().map(|t| if (100.0..1100.0).contains(t) { 4.0 } else { 3.0 }).collect();
    let clean = simulate_fopdt(&model(), &time_s, &mv, 3.0, 0.0, None).expect("a run");
    let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
    let mut normal = || (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0;
    let pv: Vec<f64> = clean.iter().map(|y| y + 0.05 * normal()).collect();
    let mut group = c.benchmark_group("identify");
    group.throughput(Throughput::Elements(u64::from(ROWS)));
    group.bench_function("fopdt_of_10000_rows", |b| {
        b.iter(|| fit_fopdt(&FitProblem::new(black_box(&time_s), &pv, &mv)).expect("a fit"));
    });
    group.finish();
}

fn analysis(c: &mut Criterion) {
    let model = ProcessModel::Fopdt(model());
    let tunings = [("pi", PidGains::pi(1.94, 32.0)), ("pid", PidGains::pid(2.5, 24.0, 4.0))];
    let mut group = c.benchmark_group("analysis");
    for (name, gains) in tunings {
        let found = analyze(&model, &gains);
        assert!(found.stable);
        group.bench_function(BenchmarkId::new("frequency", name), |b| {
            b.iter(|| analyze(black_box(&model), black_box(&gains)));
        });
        group.bench_function(BenchmarkId::new("time_responses", name), |b| {
            b.iter(|| step_figures(black_box(&model), black_box(&gains), &found));
        });
    }
    group.finish();
}

criterion_group!(benches, closed_loop, identify, analysis);
criterion_main!(benches);
