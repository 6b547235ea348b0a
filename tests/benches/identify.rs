//! What identification costs: one structure, the choice among four, the study of a loop's log.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use vasos_engine::identify::{
    FitProblem, LoopRecord, Structure, StudyOptions, choose_model, fit_fopdt, fit_model, study_loop,
};
use vasos_engine::model::{Fopdt, ProcessModel, SampledInput, Sopdt, simulate_process};

/// Rows of a test with moves of the MV, noise of a twentieth of the movement's size, always the same.
struct Record {
    time_s: Vec<f64>,
    mv: Vec<f64>,
    pv: Vec<f64>,
}

impl Record {
    fn of(model: &ProcessModel, rows: usize) -> Self {
        let time_s: Vec<f64> = (0..rows).map(|k| 0.2 * k as f64).collect();
        let period = rows / 8;
        let mv: Vec<f64> =
            (0..rows).map(|k| if (k / period).is_multiple_of(2) { 3.0 } else { 3.3 }).collect();
        let moved: Vec<f64> = mv.iter().map(|u| u - 3.0).collect();
        let clean = simulate_process(model, &SampledInput::single(&time_s, &moved)).expect("a run");
        let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
        let mut normal = || (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0;
        let pv = clean.iter().map(|y| 15.0 + y + 0.05 * normal()).collect();
        Self { time_s, mv, pv }
    }

    fn problem(&self) -> FitProblem<'_> {
        FitProblem::new(black_box(&self.time_s), &self.pv, &self.mv)
    }
}

/// The model published for TQ2 of the STAD rig, in cm per V, as slow against the record for any number of rows.
fn first_order(rows: usize) -> ProcessModel {
    let time_constant_s = 152.0 * (rows as f64 / 10_000.0).min(5.0);
    ProcessModel::Fopdt(Fopdt::new(4.9, time_constant_s, 2.0).expect("a model"))
}

fn second_order() -> ProcessModel {
    ProcessModel::Sopdt(Sopdt::new(4.9, 60.0, 20.0, 0.0, 5.0).expect("a model"))
}

fn one_structure(c: &mut Criterion) {
    let mut group = c.benchmark_group("identify");
    group.sample_size(20);
    for rows in [10_000, 1_000_000] {
        let record = Record::of(&first_order(rows), rows);
        group.throughput(Throughput::Elements(rows as u64));
        group.bench_function(BenchmarkId::new("fopdt_with_intervals", rows), |b| {
            b.iter(|| fit_fopdt(&record.problem()).expect("a fit"));
        });
        group.bench_function(BenchmarkId::new("fopdt_with_verdicts", rows), |b| {
            b.iter(|| fit_model(&record.problem(), Structure::Fopdt).expect("a fit"));
        });
    }
    let record = Record::of(&second_order(), 10_000);
    group.throughput(Throughput::Elements(10_000));
    group.bench_function(BenchmarkId::new("sopdt", 10_000), |b| {
        b.iter(|| fit_model(&record.problem(), Structure::Sopdt).expect("a fit"));
    });
    group.finish();
}

fn several(c: &mut Criterion) {
    let mut group = c.benchmark_group("identify");
    group.sample_size(10);
    group.throughput(Throughput::Elements(10_000));
    for (name, model) in [("first_order", first_order(10_000)), ("second_order", second_order())] {
        let record = Record::of(&model, 10_000);
        group.bench_function(BenchmarkId::new("choice_of_four", name), |b| {
            b.iter(|| choose_model(&record.problem()).expect("a model"));
        });
        group.bench_function(BenchmarkId::new("study_of_a_log", name), |b| {
            b.iter(|| {
                let log = LoopRecord { problem: record.problem(), sp: None, mode: None };
                study_loop(&log, &StudyOptions::default()).expect("a study")
            });
        });
    }
    group.finish();
}

criterion_group!(benches, one_structure, several);
criterion_main!(benches);
