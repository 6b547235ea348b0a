//! What the engine costs: simulation at the sample time, analysis.

use std::hint::black_box;

use criterion::{BatchSize, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use vasos_engine::analyze::{analyze, step_figures};
use vasos_engine::control::{PidGains, PidTuning};
use vasos_engine::model::{Fopdt, ProcessModel};
use vasos_engine::plant::Measurement;
use vasos_engine::session::RigCommand;
use vasos_engine::sim::{ClosedLoop, Scenario, ScenarioEvent, Spread, Start, run_ensemble};
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
            b.iter_batched(start, |closed| an_hour(closed, samples, [10.0, 12.0]), BatchSize::LargeInput);
        });
    }
    group.throughput(Throughput::Elements(18_000));
    group.bench_function("stad_amigo_unfiltered", |b| {
        b.iter_batched(
            amigo_unfiltered,
            |closed| an_hour(closed, 18_000, [15.0, 17.0]),
            BatchSize::LargeInput,
        );
    });
    group.finish();
}

/// The paper's AMIGO tuning of TQ2 without a PV filter: noise drives the output from limit to limit, so that the flow
/// changes with every sample and TQ1 and TQ2 change places often.
fn amigo_unfiltered() -> ClosedLoop {
    let mut closed =
        ClosedLoop::simulated(preset("stad").expect("a preset"), 0, Measurement::DEFAULT, 1).expect("starts");
    let tag = || "LIC-02".to_owned();
    let tuning = PidTuning::new(PidGains::pid(7.0, 15.0, 1.0));
    for command in
        [RigCommand::Tuning { tag: tag(), tuning }, RigCommand::PvFilter { tag: tag(), time_constant_s: 0.0 }]
    {
        closed.apply(&command).expect("a tuning");
    }
    closed
}

fn an_hour(mut closed: ClosedLoop, samples: u64, setpoints_cm: [f64; 2]) -> f64 {
    let tags: Vec<String> = closed.loops().iter().map(|l| l.spec.id.clone()).collect();
    let mut last = 0.0;
    for sample in 0..samples {
        if sample % (samples / 6) == 0 {
            let level_cm = setpoints_cm[usize::from(!(sample / (samples / 6)).is_multiple_of(2))];
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

/// The same hour of STAD on many rigs that differ a little; elements are hours of a plant.
fn many_plants(c: &mut Criterion) {
    const PLANTS: usize = 64;
    let network = preset("stad").expect("a preset");
    let step = |k: u32| ScenarioEvent {
        at_s: 600.0 * f64::from(k),
        command: RigCommand::Setpoint {
            tag: "LIC-02".to_owned(),
            level_cm: if k.is_multiple_of(2) { 10.0 } else { 12.0 },
        },
    };
    let scenario = Scenario {
        schema: 1,
        rig: "stad".to_owned(),
        configuration: None,
        duration_s: HOUR_S,
        seed: 1,
        measurement: Measurement::DEFAULT,
        keep_every: 1,
        start: Start::default(),
        events: (0..6).map(step).collect(),
    };
    let spread = Spread { valves: 0.02, areas: 0.02, pumps: 0.01 };
    let mut group = c.benchmark_group("many_plants");
    group.sample_size(10);
    group.throughput(Throughput::Elements(PLANTS as u64));
    group.bench_function("64_hours_of_stad", |b| {
        b.iter(|| {
            let run = run_ensemble(&network, black_box(&scenario), PLANTS, spread).expect("runs");
            assert_eq!(run.in_lanes, PLANTS);
            run
        });
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

criterion_group!(benches, closed_loop, many_plants, analysis);
criterion_main!(benches);
