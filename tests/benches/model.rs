//! What models of a rig cost: a steady state with its linearisation, what is read off it, and a simulated record.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use vasos_engine::model::{ReducedOrder, SampledInput, fit_step_response, half_rule, simulate};
use vasos_engine::plant::{LinearOptions, Linearisation, Network, OperatingPoint, SteadyTarget, linearise};
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

criterion_group!(benches, steady_and_linear, what_is_read_off);
criterion_main!(benches);
