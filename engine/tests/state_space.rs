//! State spaces against themselves by other routes: frequency response, determinants, rest, small steps.

mod rigs;

use nalgebra::DMatrix;
use num_complex::Complex64;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use rigs::random_rig;
use vasos_engine::model::{
    Matrices, Port, Ports, ProcessModel, SampledInput, StateSpace, StateSpaceError, ZeroPoleGain, simulate,
    simulate_process,
};
use vasos_engine::plant::{LinearOptions, Linearisation, OperatingPoint, linearise, steady_levels};

fn ports(n: usize, m: usize, p: usize) -> Ports {
    let many =
        |letter: &str, count: usize| (0..count).map(|i| Port::new(&format!("{letter}{i}"), "")).collect();
    Ports { states: many("x", n), inputs: many("u", m), outputs: many("y", p) }
}

/// Full matrices with feedthrough in some; stable or not.
fn random_system(rng: &mut Xoshiro256PlusPlus, n: usize, m: usize, p: usize, through: bool) -> StateSpace {
    let mut fill = |rows, columns| DMatrix::from_fn(rows, columns, |_, _| rng.random_range(-1.0..1.0));
    let matrices = Matrices {
        a: fill(n, n) - DMatrix::identity(n, n) * 1.5,
        b: fill(n, m),
        c: fill(p, n),
        d: if through { fill(p, m) } else { DMatrix::zeros(p, m) },
    };
    let delays = (0..m).map(|_| rng.random_range(0.0..2.0)).collect();
    StateSpace::new(matrices, delays, ports(n, m, p)).expect("it fits")
}

/// A random network at rest under random inputs.
fn random_linear(rng: &mut Xoshiro256PlusPlus) -> (vasos_engine::plant::Network, Linearisation) {
    let network = random_rig(rng);
    let mut point = OperatingPoint::of_configuration(&network, 0);
    point.inputs.iter_mut().for_each(|u| *u = rng.random_range(0.3..2.4));
    let k = point.coefficients(&network);
    point.levels_cm = steady_levels(&network, &k, &point.inputs, &point.levels_cm);
    let outputs = Some((0..network.tanks.len()).collect());
    let linear =
        linearise(&network, &point, &LinearOptions { outputs, ..LinearOptions::default() }).expect("smooth");
    (network, linear)
}

#[test]
fn transfer_functions_are_the_frequency_response() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(21);
    let mut worst = 0.0_f64;
    let mut check = |model: &StateSpace, scale: f64| {
        for omega in [0.03, 0.3, 1.0, 4.0] {
            let whole = model.at_omega(omega * scale).expect("no pole on the axis");
            for (i, j) in (0..whole.nrows()).flat_map(|i| (0..whole.ncols()).map(move |j| (i, j))) {
                let s = Complex64::new(0.0, omega * scale);
                let ours = model.zero_pole_gain(i, j).eval(s);
                let (size, largest) = (whole[(i, j)].norm(), whole.map(|v| v.norm()).max());
                if ours.norm() == 0.0 {
                    // No way from this input to this output; the whole matrix only nearly says so.
                    assert!(size <= 1e-10 * largest, "{size} of {largest}");
                } else {
                    worst = worst.max((ours - whole[(i, j)]).norm() / size);
                }
            }
        }
    };
    for k in 0..150 {
        let (n, m, p) = (1 + k % 6, 1 + k % 3, 1 + k % 2);
        check(&random_system(&mut rng, n, m, p, k % 4 == 0), 1.0);
        check(&random_linear(&mut rng).1.model, 0.05);
    }
    println!("largest relative difference {worst:.1e}");
    assert!(worst < 1e-8, "{worst}");
}

/// Where a square system has a zero, `[A − zI, B; C, D]` is singular; and there are as many as the determinant has roots.
#[test]
fn zeros_make_the_system_matrix_singular() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(22);
    let mut worst = 0.0_f64;
    for k in 0..200 {
        let (n, m) = (2 + k % 5, 1 + k % 2);
        let through = k % 3 == 0;
        let model = random_system(&mut rng, n, m, m, through);
        let zeros = model.zeros();
        // With a regular D as many zeros as states; with D = 0 and a regular C B, m fewer.
        assert_eq!(zeros.len(), if through { n } else { n - m }, "{n} states, {m} inputs");
        for zero in zeros {
            let complex = |matrix: &DMatrix<f64>| matrix.map(|v| Complex64::new(v, 0.0));
            let mut whole = DMatrix::zeros(n + m, n + m);
            whole.view_mut((0, 0), (n, n)).copy_from(&complex(model.a()));
            (0..n).for_each(|i| whole[(i, i)] -= zero);
            whole.view_mut((0, n), (n, m)).copy_from(&complex(model.b()));
            whole.view_mut((n, 0), (m, n)).copy_from(&complex(model.c()));
            whole.view_mut((n, n), (m, m)).copy_from(&complex(model.d()));
            let singular = whole.svd(false, false).singular_values;
            let smallest = singular.iter().copied().fold(f64::INFINITY, f64::min);
            worst = worst.max(smallest / singular.max());
        }
    }
    println!("smallest over largest singular value: at most {worst:.1e}");
    assert!(worst < 1e-10, "{worst}");
}

/// The gain at rest is what the rig's own levels at rest move by.
#[test]
fn gains_at_rest_are_those_of_the_rig() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(23);
    let mut checked = 0;
    for _ in 0..100 {
        let (network, linear) = random_linear(&mut rng);
        if !linear.spilling.is_empty() || !linear.on_a_break.is_empty() {
            continue;
        }
        let k = linear.point.coefficients(&network);
        let gain = linear.model.dc_gain();
        for pump in 0..network.pumps.len() {
            let h = 1e-4;
            let moved = |by: f64| {
                let mut inputs = linear.point.inputs.clone();
                inputs[pump] += by;
                steady_levels(&network, &k, &inputs, &linear.point.levels_cm)
            };
            if (linear.point.inputs[pump] - 1.0).abs() < 2.0 * h {
                continue;
            }
            let (up, down) = (moved(h), moved(-h));
            for tank in 0..network.tanks.len() {
                let slope = (up[tank] - down[tank]) / (2.0 * h);
                assert!(
                    (gain[(tank, pump)] - slope).abs() < 1e-4 * (1.0 + slope.abs()),
                    "{} {slope}",
                    gain[(tank, pump)]
                );
                checked += 1;
            }
        }
    }
    assert!(checked > 200, "{checked}");
}

/// Several inputs with a dead time each are the sum of one at a time; uneven stamps say the same as even ones; both agree
/// with small steps of Euler's method extrapolated.
#[test]
fn simulation_is_linear_in_its_inputs_and_blind_to_the_stamps() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(24);
    for k in 0..30 {
        let model = random_system(&mut rng, 1 + k % 4, 2, 2, k % 2 == 0);
        let time_s: Vec<f64> = (0..60).map(|k| 0.3 * f64::from(k)).collect();
        let u: Vec<Vec<f64>> =
            (0..2).map(|_| time_s.iter().map(|_| rng.random_range(-1.0..1.0)).collect()).collect();
        let zero = vec![0.0; time_s.len()];
        let run = |time_s: &[f64], a: &[f64], b: &[f64], before: [f64; 2]| {
            let input =
                SampledInput { time_s, columns: vec![a, b], before: before.to_vec(), initial_state: None };
            simulate(&model, &input).expect("runs")
        };
        let both = run(&time_s, &u[0], &u[1], [0.5, -0.25]);
        let (one, other) = (run(&time_s, &u[0], &zero, [0.5, 0.0]), run(&time_s, &zero, &u[1], [0.0, -0.25]));
        // Every stamp is kept, and one between two of them makes the grid uneven.
        let mut uneven = time_s.clone();
        uneven.insert(31, 9.111);
        let again = |values: &[f64]| {
            let mut values = values.to_vec();
            values.insert(31, values[30]);
            values
        };
        let third = run(&uneven, &again(&u[0]), &again(&u[1]), [0.5, -0.25]);
        for output in 0..2 {
            let mut kept = third[output].clone();
            kept.remove(31);
            for i in 0..time_s.len() {
                let sum = one[output][i] + other[output][i];
                assert!((both[output][i] - sum).abs() < 1e-12 * (1.0 + sum.abs()));
                // A dead time that is whole samples to rounding may switch on either side of its stamp only with D.
                assert!((both[output][i] - kept[i]).abs() < 1e-10 * (1.0 + sum.abs()), "{k} {i}");
            }
        }
    }
}

/// 2 e^(−0.7 s)/(3 s + 1) in closed form, and a biproper one that jumps.
#[test]
fn closed_forms_come_out() {
    let model = ProcessModel::rational(&[2.0], &[3.0, 1.0], 0.7).expect("a model");
    let time_s: Vec<f64> = (0..100).map(|k| 0.25 * f64::from(k)).collect();
    let step = vec![1.0; 100];
    let y = simulate_process(&model, &SampledInput::single(&time_s, &step)).expect("runs");
    for (t, y) in time_s.iter().zip(y) {
        let expected = if *t < 0.7 { 0.0 } else { 2.0 * (1.0 - (-(t - 0.7) / 3.0).exp()) };
        assert!((y - expected).abs() < 1e-13, "{t}: {y} for {expected}");
    }
    let lead = ProcessModel::rational(&[2.0, 1.0], &[4.0, 1.0], 0.0).expect("a model");
    let y = simulate_process(&lead, &SampledInput::single(&time_s, &step)).expect("runs");
    assert!((y[0] - 0.5).abs() < 1e-15 && (y[8] - (1.0 - 0.5 * (-0.5_f64).exp())).abs() < 1e-13);
}

#[test]
fn state_spaces_and_transfer_functions_go_over_into_each_other() {
    let tf = vasos_engine::model::TransferFunction {
        num: vec![3.0, -1.0, 0.5],
        den: vec![2.0, 5.0, 4.0, 1.0],
        dead_time_s: 0.4,
    };
    let space =
        StateSpace::of_transfer_function(&tf, Port::new("u", "V"), Port::new("y", "cm")).expect("proper");
    let back = space.transfer_function(0, 0);
    assert_eq!(back.dead_time_s, 0.4);
    for (ours, expected) in back.num.iter().zip(&tf.num).chain(back.den.iter().zip(&tf.den)) {
        assert!((ours - expected / 2.0).abs() < 1e-10, "{back:?}");
    }
    // (s + 1) stands on both sides and goes.
    let tf = vasos_engine::model::TransferFunction {
        num: vec![1.0, 3.0, 2.0],
        den: vec![1.0, 6.0, 11.0, 6.0],
        dead_time_s: 0.0,
    };
    let space =
        StateSpace::of_transfer_function(&tf, Port::new("u", ""), Port::new("y", "")).expect("proper");
    let ZeroPoleGain { zeros, poles, .. } = space.zero_pole_gain(0, 0);
    assert!(zeros.is_empty() && poles.len() == 1 && (poles[0] + 3.0).norm() < 1e-9, "{zeros:?} {poles:?}");
}

#[test]
fn what_does_not_fit_is_refused() {
    let good = || Matrices {
        a: DMatrix::zeros(2, 2),
        b: DMatrix::zeros(2, 1),
        c: DMatrix::zeros(1, 2),
        d: DMatrix::zeros(1, 1),
    };
    let wrong = Matrices { b: DMatrix::zeros(1, 1), ..good() };
    let error = StateSpace::new(wrong, vec![0.0], ports(2, 1, 1)).expect_err("B");
    assert_eq!(error.to_string(), "B has 1 × 1 entries and needs 2 × 1");
    let nan = Matrices { c: DMatrix::from_element(1, 2, f64::NAN), ..good() };
    assert_eq!(
        StateSpace::new(nan, vec![0.0], ports(2, 1, 1)),
        Err(StateSpaceError::NotFinite { what: "C" })
    );
    assert!(matches!(
        StateSpace::new(good(), vec![-1.0], ports(2, 1, 1)),
        Err(StateSpaceError::Delay { .. })
    ));
    let model = StateSpace::new(good(), vec![0.0], ports(2, 1, 1)).expect("it fits");
    let run =
        |time_s: &[f64], u: &[f64]| simulate(&model, &SampledInput::single(time_s, u)).map(|y| y[0].len());
    assert_eq!(run(&[0.0, 1.0], &[1.0, 1.0]), Ok(2));
    assert_eq!(run(&[], &[]), Ok(0));
    assert!(matches!(run(&[0.0, 1.0], &[1.0]), Err(StateSpaceError::Shape { what: "u", .. })));
    assert!(matches!(run(&[0.0, 0.0], &[1.0, 1.0]), Err(StateSpaceError::Time { row: 2, .. })));
    assert!(matches!(run(&[0.0, 1.0], &[1.0, f64::NAN]), Err(StateSpaceError::NotFinite { what: "u" })));
}
