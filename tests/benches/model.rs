//! What models of a rig cost: a steady state with its linearisation, what is read off it, a simulated record, and a
//! fit of the rig to a recording.

use std::hint::black_box;
use std::sync::Arc;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use vasos_engine::identify::grey_box::{
    FreeParameter, GreyBoxProblem, GreyBoxRecord, RecordedInput, RecordedOutput, fit_rig,
};
use vasos_engine::model::{ReducedOrder, SampledInput, fit_step_response, half_rule, simulate};
use vasos_engine::plant::{
    LinearOptions, Linearisation, Network, OperatingPoint, Plant, SteadyTarget, linearise,
};
use vasos_io::rig::preset;

/// Every loop of a configuration at its setpoint.
fn targets(network: &Network, configuration: usize) -> Vec<SteadyTarget> {
    let loops = &network.spec.configurations[configuration].loops;
    let target = |l: &vasos_engine::control::LoopSpec| SteadyTarget {
        pump: l.pump.as_deref().and_then(|p| network.pump(p)).expect("a pump"),
        tank: network.sensors[network.sensor(&l.sensor).expect("a sensor")].tank,
        level_cm: l.setpoint_cm,
    };
    loops.iter().map(target).collect()
}

fn linear(network: &Network, configuration: usize) -> Linearisation {
    let point = OperatingPoint::of_configuration(network, configuration)
        .at_levels(network, &targets(network, configuration))
        .expect("at rest");
    linearise(network, &point, &LinearOptions::default()).expect("smooth")
}

/// From a configuration's setpoints to A, B, C, D, from the levels of the rig file as the first guess.
fn steady_and_linear(c: &mut Criterion) {
    let mut group = c.benchmark_group("steady_state_and_linearisation");
    for (id, configuration) in [
        ("stad", 0),
        ("stad", 1),
        ("quadruple_minimum", 0),
        ("quadruple_nonminimum", 0),
        ("coupled_tanks", 0),
    ] {
        let network = preset(id).expect("a preset");
        let name = format!("{id}/{}", network.spec.configurations[configuration].id);
        group.bench_function(BenchmarkId::from_parameter(name), |b| {
            b.iter(|| linear(black_box(&network), configuration));
        });
    }
    group.finish();
}

/// Poles, zeros, gains and relative gains of the quadruple tank; reductions of STAD; an hour of samples.
fn what_is_read_off(c: &mut Criterion) {
    let mut group = c.benchmark_group("linear_model");
    let quadruple = linear(&preset("quadruple_minimum").expect("a preset"), 0).model;
    group.bench_function("zeros_of_2x2", |b| b.iter(|| black_box(&quadruple).zeros()));
    group.bench_function("relative_gains_of_2x2", |b| b.iter(|| black_box(&quadruple).rga()));
    let stad = linear(&preset("stad").expect("a preset"), 0).model;
    let channel = stad.zero_pole_gain(0, 0);
    group.bench_function("transfer_function", |b| b.iter(|| black_box(&stad).transfer_function(0, 0)));
    group.bench_function("half_rule", |b| b.iter(|| half_rule(black_box(&channel), ReducedOrder::First)));
    group.sample_size(20);
    group.bench_function("fit_of_the_step_response", |b| {
        b.iter(|| fit_step_response(black_box(&channel), ReducedOrder::First));
    });
    let time_s: Vec<f64> = (0..18_000).map(|k| 0.2 * f64::from(k)).collect();
    let u: Vec<f64> = (0..18_000).map(|k| f64::from(k / 500 % 3) - 1.0).collect();
    let input = SampledInput::single(&time_s, &u);
    group.bench_function("18000_samples_with_dead_time", |b| b.iter(|| simulate(black_box(&stad), &input)));
    group.finish();
}

/// 10⁴ samples of the coupled STAD with noise, both measured levels, the pump moved every `hold` samples.
fn stad_record(network: &Arc<Network>, hold: usize) -> GreyBoxRecord {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let mut plant = Plant::new(network.clone()).expect("a plant");
    let mut record = GreyBoxRecord {
        time_s: vec![],
        inputs: vec![RecordedInput { pump: 0, values: vec![] }],
        outputs: [1, 2].map(|tank| RecordedOutput { tank, sensor: None, values: vec![] }).to_vec(),
    };
    let mut u = 2.5;
    for k in 0..10_000 {
        if k % hold == 0 {
            u = rng.random_range(1.5..3.2);
        }
        plant.set_input(0, u).expect("a number");
        record.time_s.push(0.2 * k as f64);
        record.inputs[0].values.push(u);
        for output in &mut record.outputs {
            let noise: f64 = (0..12).map(|_| rng.random::<f64>()).sum();
            output.values.push(plant.levels_cm()[output.tank] + 0.05 * (noise - 6.0));
        }
        plant.advance(0.2);
    }
    record
}

/// Six parameters of STAD and its initial levels, from values 10 % off.
fn fit_of_a_rig(c: &mut Criterion) {
    let mut group = c.benchmark_group("fit_of_a_rig");
    group.sample_size(10);
    let network = preset("stad").expect("a preset");
    let names = ["FV01.k90", "FV02.k90", "FV03.k90", "BA01.scale", "BA01.delay_s", "TQ3.area_cm2"];
    let free = |name: &&str| {
        let at = FreeParameter::new(&network, 0, name, [0.0001, 1000.0]).expect("a parameter");
        FreeParameter { start: 1.1 * at.start, bounds: [0.2 * at.start, 5.0 * at.start], ..at }
    };
    for hold in [1, 100] {
        let problem = GreyBoxProblem {
            free: names.iter().map(free).collect(),
            train: stad_record(&network, hold),
            validate: None,
            network: network.clone(),
            configuration: 0,
        };
        group.bench_function(BenchmarkId::new("stad_6_parameters_10000_samples", hold), |b| {
            b.iter(|| fit_rig(black_box(&problem)));
        });
    }
    group.finish();
}

criterion_group!(benches, steady_and_linear, what_is_read_off, fit_of_a_rig);
criterion_main!(benches);
