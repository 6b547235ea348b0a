//! Linearisation and steady states of random networks, against complex-step derivatives of the balance written anew.

mod rigs;

use num_complex::Complex64;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use rigs::{pump, random_rig, rig, tank, valve};
use vasos_engine::plant::spec::{ValveDrive, ValveLaw};
use vasos_engine::plant::{
    CurveSide, Disturbances, LinearError, LinearOptions, Network, OperatingPoint, RigError, SteadyState,
    SteadyTarget, linearise, steady_at_level, steady_at_levels, steady_levels, unrest_cm_s,
};

/// dh/dt with everything complex: levels, flows of the pumps, k of the valves.
fn rates(network: &Network, levels: &[Complex64], flows: &[Complex64], k: &[Complex64]) -> Vec<Complex64> {
    let mut net = vec![Complex64::new(0.0, 0.0); levels.len()];
    for (spec, &flow) in network.spec.pumps.iter().zip(flows) {
        let index = |id: &str| network.tank(id).expect("a tank");
        let split: f64 = spec.split.values().sum();
        net[index(&spec.to)] += flow * (1.0 - split);
        for (id, share) in &spec.split {
            net[index(id)] += flow * share;
        }
    }
    for (valve, &k) in network.valves.iter().zip(k) {
        let head = match (valve.drive, valve.to) {
            (ValveDrive::Between, Some(to)) => levels[valve.from] - levels[to],
            _ => levels[valve.from],
        };
        let delta = network.delta_cm;
        let flow = match valve.law {
            ValveLaw::SquareRoot => k * head / (head * head + delta * delta).sqrt().sqrt(),
            ValveLaw::Laminar => k * head,
        };
        net[valve.from] -= flow;
        if let Some(to) = valve.to {
            net[to] += flow;
        }
    }
    net.iter().zip(&network.tanks).map(|(q, t)| q / t.area_cm2).collect()
}

const STEP: f64 = 1e-40;

fn perturbed(values: &[f64], which: usize) -> Vec<Complex64> {
    values.iter().enumerate().map(|(i, v)| Complex64::new(*v, if i == which { STEP } else { 0.0 })).collect()
}

#[test]
fn every_derivative_is_that_of_the_balance_to_the_last_digits() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
    let none = usize::MAX;
    let (mut entries, mut worst) = (0, 0.0_f64);
    for _ in 0..400 {
        let network = random_rig(&mut rng);
        let n = network.tanks.len();
        let mut point = OperatingPoint::of_configuration(&network, 0);
        for level in &mut point.levels_cm {
            *level = rng.random_range(0.01..59.0);
        }
        if rng.random_bool(0.3) && n > 1 {
            // Near equality the root is in its smooth part.
            point.levels_cm[1] = point.levels_cm[0] + rng.random_range(-0.02..0.02);
        }
        for input in &mut point.inputs {
            *input = rng.random_range(0.01..4.9);
        }
        let k = point.coefficients(&network);
        let flows: Vec<f64> =
            network.pumps.iter().zip(&point.inputs).map(|(p, &u)| p.flow_cm3_s(u)).collect();
        let options = LinearOptions {
            outputs: Some((0..n).collect()),
            disturbances: Disturbances::Coefficients,
            side: CurveSide::Above,
        };
        let linear = linearise(&network, &point, &options).expect("smooth");
        assert_eq!(linear.states, (0..n).collect::<Vec<_>>());
        let mut check = |ours: f64, exact: f64| {
            entries += 1;
            worst = worst.max((ours - exact).abs() / (1e-12 + exact.abs()));
        };
        for j in 0..n {
            let at = rates(
                &network,
                &perturbed(&point.levels_cm, j),
                &perturbed(&flows, none),
                &perturbed(&k, none),
            );
            (0..n).for_each(|i| check(linear.model.a()[(i, j)], at[i].im / STEP));
        }
        for j in 0..flows.len() {
            let at = rates(
                &network,
                &perturbed(&point.levels_cm, none),
                &perturbed(&flows, j),
                &perturbed(&k, none),
            );
            let slope = network.pumps[j].flow_cm3_s(point.inputs[j] + 1e-6)
                - network.pumps[j].flow_cm3_s(point.inputs[j]);
            assert!((linear.pump_slopes[j] - slope / 1e-6).abs() < 1e-6, "{}", point.inputs[j]);
            (0..n).for_each(|i| check(linear.model.b()[(i, j)], linear.pump_slopes[j] * at[i].im / STEP));
            assert_eq!(linear.model.input_delays_s()[j], point.delays_s[j]);
        }
        for j in 0..k.len() {
            let at = rates(
                &network,
                &perturbed(&point.levels_cm, none),
                &perturbed(&flows, none),
                &perturbed(&k, j),
            );
            (0..n).for_each(|i| check(linear.model.b()[(i, flows.len() + j)], at[i].im / STEP));
        }
    }
    println!("{entries} derivatives, largest relative difference {worst:.1e}");
    assert!(worst < 1e-12, "{worst}");
}

#[test]
fn angles_as_inputs_are_the_coefficients_by_the_chain_rule() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(12);
    for _ in 0..50 {
        let network = random_rig(&mut rng);
        let mut point = OperatingPoint::of_configuration(&network, 0);
        point.levels_cm.fill(7.0);
        let with = |disturbances| LinearOptions { disturbances, ..LinearOptions::default() };
        let by_k = linearise(&network, &point, &with(Disturbances::Coefficients)).expect("smooth");
        let by_angle = linearise(&network, &point, &with(Disturbances::Angles)).expect("smooth");
        for (j, valve) in network.valves.iter().enumerate() {
            let (angle, h) = (point.angles_deg[j], 1e-4);
            let growth = (valve.coefficient(angle + h) - valve.coefficient(angle - h)) / (2.0 * h);
            let column = network.pumps.len() + j;
            for i in 0..by_k.states.len() {
                let expected = by_k.model.b()[(i, column)] * growth;
                assert!((by_angle.model.b()[(i, column)] - expected).abs() < 1e-7 * (1.0 + expected.abs()));
            }
        }
    }
}

#[test]
fn what_a_level_needs_gives_that_level() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(13);
    let (mut held, mut refused) = (0, 0);
    for _ in 0..300 {
        let network = random_rig(&mut rng);
        let k = OperatingPoint::of_configuration(&network, 0).coefficients(&network);
        let (n, m) = (network.tanks.len(), network.pumps.len());
        let inputs: Vec<f64> = (0..m).map(|_| rng.random_range(0.2..4.5)).collect();
        let empty = vec![0.0; n];
        let levels_cm = steady_levels(&network, &k, &inputs, &empty);
        let state = SteadyState { levels_cm: levels_cm.clone(), inputs: inputs.clone() };
        assert!(unrest_cm_s(&network, &k, &state) < 1e-9, "{state:?}");
        // Back from the levels of the fed tanks to the inputs, all at once.
        let targets: Vec<SteadyTarget> =
            (0..m).map(|i| SteadyTarget { pump: i, tank: i, level_cm: levels_cm[i] }).collect();
        if levels_cm.iter().any(|&level| level >= 60.0) {
            refused += 1;
            continue;
        }
        let start: Vec<f64> = (0..m).map(|_| rng.random_range(0.0..5.0)).collect();
        let back =
            steady_at_levels(&network, &k, &start, &empty, &targets).expect("the levels of a steady state");
        for (a, b) in back.inputs.iter().zip(&inputs) {
            assert!((a - b).abs() < 1e-6, "{:?} for {inputs:?}", back.inputs);
        }
        for (a, b) in back.levels_cm.iter().zip(&levels_cm) {
            assert!((a - b).abs() < 1e-6, "{:?} for {levels_cm:?}", back.levels_cm);
        }
        held += 1;
    }
    println!("{held} steady states and back, {refused} with a full tank");
    assert!(held > 150);
}

#[test]
fn an_unreachable_level_names_the_range_and_a_pair_names_the_pump() {
    let two = |k: f64| {
        rig(
            vec![tank(0, 100.0, 30.0), tank(1, 100.0, 30.0)],
            vec![pump(0, 0), pump(1, 1)],
            vec![valve("F0", 0, Some(1), k), valve("F1", 1, None, k)],
            0.05,
        )
    };
    let network = two(20.0);
    let error =
        steady_at_level(&network, &[20.0, 20.0], &[1.0, 0.0], &[0.0, 0.0], 0, 0, 29.0).expect_err("too high");
    assert!(
        matches!(&error, RigError::Unreachable { tank, lowest_cm, highest_cm, .. }
            if tank == "TQ0" && *lowest_cm == 0.0 && (*highest_cm - 12.25).abs() < 1e-3),
        "{error}"
    );
    let target = |pump, tank, level_cm| SteadyTarget { pump, tank, level_cm };
    // TQ1 gets all that TQ0 passes on: it cannot stand lower with a pump that only adds.
    let targets = [target(0, 0, 10.0), target(1, 1, 5.0)];
    let error =
        steady_at_levels(&network, &[20.0, 20.0], &[1.0, 0.0], &[0.0, 0.0], &targets).expect_err("negative");
    assert!(
        matches!(&error, RigError::OutOfReach { pump, needed_cm3_s, .. } if pump == "BA1" && *needed_cm3_s < 0.0)
    );
    // Which pump is named for which tank makes no difference.
    let targets = [target(0, 1, 5.0), target(1, 0, 5.0)];
    let result = steady_at_levels(&network, &[20.0, 20.0], &[1.0, 0.0], &[0.0, 0.0], &targets);
    assert!(result.is_ok(), "{result:?}");
    let apart = rig(
        vec![tank(0, 100.0, 30.0), tank(1, 100.0, 30.0)],
        vec![pump(0, 0), pump(1, 0)],
        vec![valve("F0", 0, None, 20.0), valve("F1", 1, None, 20.0)],
        0.05,
    );
    let error = steady_at_levels(&apart, &[20.0, 20.0], &[1.0, 1.0], &[0.0, 0.0], &targets)
        .expect_err("nothing reaches TQ1");
    assert!(matches!(&error, RigError::NoBalance { tanks } if tanks == "TQ1, TQ0"), "{error}");
}

#[test]
fn a_shut_valve_makes_an_integrator() {
    let network = rig(
        vec![tank(0, 100.0, 30.0), tank(1, 50.0, 30.0)],
        vec![pump(0, 0)],
        vec![valve("F0", 0, Some(1), 20.0), valve("F1", 1, None, 20.0)],
        0.05,
    );
    let mut point = OperatingPoint::of_configuration(&network, 0);
    point.angles_deg[1] = 0.0;
    let target = SteadyTarget { pump: 0, tank: 1, level_cm: 12.0 };
    let point = point.at_levels(&network, &[target]).expect("it rests without flow");
    assert_eq!(point.inputs[0], 0.0);
    assert!(point.levels_cm[0].abs() < 1e-9 && point.levels_cm[1] == 12.0, "{:?}", point.levels_cm);
    let options = LinearOptions { outputs: Some(vec![1]), ..LinearOptions::default() };
    let linear = linearise(&network, &point, &options).expect("smooth");
    assert_eq!(linear.model.poles()[0], Complex64::new(0.0, 0.0));
    assert_eq!(linear.model.dc_gain()[(0, 0)], f64::INFINITY);
    let g = linear.model.zero_pole_gain(0, 0);
    // k√h at h = 0 with δ: slope k/√δ; the integrator gathers 20 cm³/s a volt in 50 cm².
    let fast = 20.0 / 0.05_f64.sqrt() / 100.0;
    assert!((g.poles[1].re + fast).abs() < 1e-9 * fast, "{:?}", g.poles);
    assert!((g.gain - 20.0 / 100.0 * 20.0 / 0.05_f64.sqrt() / 50.0).abs() < 1e-9, "{}", g.gain);
}

#[test]
fn a_tank_that_spills_passes_its_stream_on_and_has_no_state() {
    let mut top = tank(0, 100.0, 10.0);
    top.spills_to = Some("TQ1".to_owned());
    let network = rig(
        vec![top, tank(1, 50.0, 30.0)],
        vec![pump(0, 0)],
        vec![valve("F0", 0, None, 5.0), valve("F1", 1, None, 10.0)],
        0.05,
    );
    let mut point = OperatingPoint::of_configuration(&network, 0);
    point.inputs[0] = 2.0;
    let point = point.at_levels(&network, &[]).expect("rest");
    let through = 5.0 * 10.0 / (100.0 + 0.05_f64.powi(2)).powf(0.25);
    let spilled = 20.0 + 25.0 / 1.5 - through;
    assert_eq!(point.levels_cm[0], 10.0);
    assert!((point.levels_cm[1] - (spilled / 10.0).powi(2)).abs() < 2e-3, "{:?}", point.levels_cm);
    let options = LinearOptions { outputs: Some(vec![0, 1]), ..LinearOptions::default() };
    let linear = linearise(&network, &point, &options).expect("smooth");
    assert_eq!((linear.states.as_slice(), linear.spilling.as_slice()), (&[1][..], &[0][..]));
    assert!((linear.model.b()[(0, 0)] - 25.0 / 1.5 / 50.0).abs() < 1e-12, "all that is added spills");
    assert_eq!(linear.model.dc_gain()[(0, 0)], 0.0);
    // The wanted level below: the upper tank is full, so the flow follows from both.
    let held =
        point.at_levels(&network, &[SteadyTarget { pump: 0, tank: 1, level_cm: 4.0 }]).expect("reachable");
    let wanted = through + 10.0 * 4.0 / (16.0 + 0.05_f64.powi(2)).powf(0.25);
    assert!((network.pumps[0].flow_cm3_s(held.inputs[0]) - wanted).abs() < 1e-8, "{held:?}");
}

#[test]
fn the_slope_at_a_break_is_that_of_the_side_asked_for() {
    let network = rig(vec![tank(0, 100.0, 30.0)], vec![pump(0, 0)], vec![valve("F0", 0, None, 10.0)], 0.05);
    let mut point = OperatingPoint::of_configuration(&network, 0);
    point.levels_cm[0] = 4.0;
    point.inputs[0] = 2.5;
    for (side, slope) in [(CurveSide::Above, 10.0), (CurveSide::Below, 25.0 / 1.5)] {
        let options = LinearOptions { outputs: Some(vec![0]), side, ..LinearOptions::default() };
        let linear = linearise(&network, &point, &options).expect("smooth");
        assert!((linear.pump_slopes[0] - slope).abs() < 1e-12);
        assert_eq!(linear.on_a_break, vec![0]);
    }
}

#[test]
fn what_has_no_linear_model_is_refused_by_name() {
    let plain = rig(vec![tank(0, 100.0, 30.0)], vec![pump(0, 0)], vec![valve("F0", 0, None, 10.0)], 0.0);
    let point = OperatingPoint::of_configuration(&plain, 0);
    let error = linearise(&plain, &point, &LinearOptions::default()).expect_err("infinite slope");
    assert!(matches!(error, LinearError::NoSlope { valve, head_cm } if valve == "F0" && head_cm == 0.0));
    let mut drawing = pump(0, 1);
    (drawing.from, drawing.delay_s) = (Some("TQ0".to_owned()), 1.5);
    let valves = vec![valve("F0", 0, Some(1), 10.0), valve("F1", 1, Some(0), 10.0)];
    let circuit = rig(vec![tank(0, 100.0, 30.0), tank(1, 100.0, 30.0)], vec![drawing], valves, 0.05);
    let mut point = OperatingPoint::of_configuration(&circuit, 0);
    point.levels_cm = vec![5.0, 5.0];
    let error = linearise(&circuit, &point, &LinearOptions::default()).expect_err("two delays");
    assert!(matches!(error, LinearError::TwoDelays { delay_s, .. } if delay_s == 1.5));
}
