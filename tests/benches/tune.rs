//! What analysis and tuning cost: the full analysis of a loop, certified optima, the worst case over a family, a front
//! with every rule on it, and a retuning from the log on.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use vasos_engine::analyze::{OpenLoop, analyze};
use vasos_engine::control::PidGains;
use vasos_engine::identify::{Drift, FitProblem, LoopRecord, StudyOptions, study_loop};
use vasos_engine::model::{Fopdt, ProcessModel};
use vasos_engine::retune::{LoopSigns, RetuneOptions, retune};
use vasos_engine::signal::derived_column;
use vasos_engine::tune::optimum::{
    DerivativeFilter, LoopLimits, Objective, OptimumProblem, Process, TradeOff, Wanted, front, on_front,
    optimum,
};
use vasos_engine::tune::{RuleOptions, tune_all};
use vasos_io::log::{ImportOptions, ImportedLog, import_log};

fn fopdt(k: f64, t: f64, l: f64) -> ProcessModel {
    ProcessModel::Fopdt(Fopdt::new(k, t, l).expect("a model"))
}

fn rational(num: &[f64], den: &[f64], dead_time_s: f64) -> ProcessModel {
    ProcessModel::rational(num, den, dead_time_s).expect("a model")
}

/// (s + 1)⁸.
const EIGHT_LAGS: [f64; 9] = [1.0, 8.0, 28.0, 56.0, 70.0, 56.0, 28.0, 8.0, 1.0];

fn analysis(c: &mut Criterion) {
    let mut group = c.benchmark_group("analyze");
    let gains = PidGains::pid(7.0, 15.0, 1.0);
    let model = fopdt(4.9, 152.0, 2.0);
    group.bench_function("fopdt", |b| b.iter(|| analyze(black_box(&model), &gains)));
    let model = rational(&[1.0], &EIGHT_LAGS, 1.0);
    let gains = PidGains::pid(0.4, 4.0, 1.5);
    group.bench_function("order_8", |b| b.iter(|| analyze(black_box(&model), &gains)));
    group.finish();
}

fn optima(c: &mut Criterion) {
    let models = [
        ("stad_tq2", fopdt(4.9, 152.0, 2.0)),
        ("fic_18", fopdt(0.6335, 8.0, 1.0)),
        ("balanced", fopdt(1.0, 1.0, 1.0)),
        ("three_lags", rational(&[1.0], &[1.0, 3.0, 3.0, 1.0], 0.0)),
        ("long_dead_time", rational(&[1.0], &[1.0, 3.0, 3.0, 1.0], 15.0)),
        ("eight_lags", rational(&[1.0], &EIGHT_LAGS, 0.0)),
    ];
    let limits = LoopLimits { ms: 1.6, mt: 1.4, ju: f64::INFINITY };
    for (name, wanted, objective) in [
        ("pi_jv", Wanted::Pi, Objective::Jv),
        ("pi_max_ki", Wanted::Pi, Objective::MaxKi),
        ("pid_jv", Wanted::Pid(DerivativeFilter::Ratio(10.0)), Objective::Jv),
    ] {
        let mut group = c.benchmark_group(format!("optimum_{name}"));
        for (model_name, model) in &models {
            let processes = [Process::Model(model.clone())];
            let problem = OptimumProblem { processes: &processes, wanted, objective, limits };
            group.bench_function(BenchmarkId::from_parameter(model_name), |b| {
                b.iter(|| optimum(black_box(&problem)));
            });
        }
        group.finish();
    }
}

/// Twenty models about TQ2's, within ±15 % in every parameter.
fn worst_case(c: &mut Criterion) {
    let at = |k: u32, step: u32| 1.0 + 0.15 * (f64::from((k * step) % 20) / 9.5 - 1.0);
    let family: Vec<Process> =
        (0..20).map(|k| Process::Model(fopdt(4.9 * at(k, 1), 152.0 * at(k, 7), 2.0 * at(k, 13)))).collect();
    let limits = LoopLimits { ms: 1.6, mt: 1.5, ju: f64::INFINITY };
    let problem = OptimumProblem { processes: &family, wanted: Wanted::Pi, objective: Objective::Jv, limits };
    c.bench_function("worst_case_of_20", |b| b.iter(|| optimum(black_box(&problem))));
}

/// Forty points of PI, and every rule beside them.
fn pareto_front(c: &mut Criterion) {
    let model = fopdt(4.9, 152.0, 2.0);
    let processes = [Process::Model(model.clone())];
    let limits = LoopLimits { ms: 2.0, mt: f64::INFINITY, ju: f64::INFINITY };
    let problem =
        OptimumProblem { processes: &processes, wanted: Wanted::Pi, objective: Objective::Jv, limits };
    c.bench_function("front_of_40_with_rules", |b| {
        b.iter(|| {
            let points = front(black_box(&problem), TradeOff::JvMs, 40);
            let rules = tune_all(&model, &RuleOptions::default());
            let placed = rules.into_iter().filter_map(|(_, _, tuned)| tuned.ok()).filter_map(|tuning| {
                let analysis = analyze(&model, &tuning.gains);
                on_front(&OpenLoop::new(&model, &tuning.gains), &analysis, TradeOff::JvMs)
            });
            (points, placed.count())
        });
    });
}

/// Rows of a first order, K = 2, T = 40 s, dead time 4 s, under PI with a moving setpoint, as CSV; a row a second.
fn loop_log(rows: usize) -> String {
    let decay = (-1.0f64 / 40.0).exp();
    let (mut level, mut integral, mut state) = (0.0f64, 0.0, 7u64);
    let mut arriving = [0.0; 4];
    let mut text = "time_s,sp,pv,mv\n".to_owned();
    for k in 0..rows {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let noise = 0.02 * ((state >> 11) as f64 / (1u64 << 53) as f64 - 0.5);
        let setpoint = f64::from(u8::from(k / 200 % 2 == 1));
        let error = setpoint - (level + noise);
        integral += 0.5 / 60.0 * error;
        let mv = 0.5 * error + integral;
        text.push_str(&format!("{k},{setpoint},{:.6},{mv:.6}\n", level + noise));
        let arrives = 2.0 * std::mem::replace(&mut arriving[k % 4], mv);
        level = arrives + (level - arrives) * decay;
    }
    text
}

/// What `vasos retune` does for a log of 10⁴ rows, but for the report: reading, the study, the tuning. The study alone
/// stands beside it.
fn retuning(c: &mut Criterion) {
    let csv = loop_log(10_000);
    let read = || import_log("loop.csv", csv.as_bytes(), &ImportOptions::default()).expect("a log");
    let columns =
        |log: &ImportedLog| ["pv", "mv", "sp"].map(|n| derived_column(&log.table, n).expect("a column"));
    let study = |log: &ImportedLog, [pv, mv, sp]: &[Vec<f64>; 3]| {
        let mut problem = FitProblem::new(&log.table.time_s, pv, mv);
        problem.options.drift = Drift::Auto;
        let record = LoopRecord { problem, sp: Some(sp), mode: None };
        study_loop(&record, &StudyOptions::default()).expect("a study")
    };
    let mut group = c.benchmark_group("retune_10_000_rows");
    group.sample_size(20);
    group.bench_function("whole", |b| {
        b.iter(|| {
            let log = read();
            let columns = columns(&log);
            let study = study(&log, &columns);
            let signs = LoopSigns::of(&log.table.time_s, &columns[1], Some(&columns[2]));
            retune(&study, &signs, &RetuneOptions::default()).expect("an answer")
        });
    });
    let log = read();
    let columns = columns(&log);
    group.bench_function("study", |b| b.iter(|| study(&log, &columns)));
    group.finish();
}

criterion_group!(benches, analysis, optima, worst_case, pareto_front, retuning);
criterion_main!(benches);
