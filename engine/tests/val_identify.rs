//! Identification against data whose model is known, an independent tool's fits, and chance.

use std::path::PathBuf;

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use vasos_engine::explain::Explain;
use vasos_engine::identify::{
    FitError, FitOptions, FitProblem, FitVerdict, FopdtFit, LoopRecord, ModeColumn, RecordFinding, Structure,
    StudyOptions, fit_fopdt, fit_model, simulate_fopdt, study_loop,
};
use vasos_engine::model::Fopdt;

/// Step response of a FOPDT in closed form, summed over the moves of the MV: an independent route to the truth.
fn closed_form(model: &Fopdt, time_s: &[f64], mv: &[f64], mv_before: f64, bias: f64, free: f64) -> Vec<f64> {
    let (t0, tc) = (time_s[0], model.time_constant_s);
    let mut moves = Vec::new();
    let mut last = mv_before;
    for (&t, &u) in time_s.iter().zip(mv) {
        if u != last {
            moves.push((t + model.dead_time_s, u - last));
            last = u;
        }
    }
    let rest = bias + model.gain * mv_before;
    let at = |t: f64| {
        let risen = moves.iter().filter(|(at, _)| *at < t);
        rest + free * (-(t - t0) / tc).exp()
            + risen.map(|(at, du)| -model.gain * du * (-(t - at) / tc).exp_m1()).sum::<f64>()
    };
    time_s.iter().map(|&t| at(t)).collect()
}

fn to_12_digits(values: &[f64]) -> Vec<f64> {
    values.iter().map(|v| format!("{v:.11e}").parse().expect("a number")).collect()
}

fn assert_recovers(truth: &Fopdt, fit: &FopdtFit, what: &str) {
    let t = truth.time_constant_s;
    let found = fit.model;
    assert!((found.gain / truth.gain - 1.0).abs() < 1e-6, "{what}: K {} for {}", found.gain, truth.gain);
    assert!((found.time_constant_s / t - 1.0).abs() < 1e-6, "{what}: T {} for {t}", found.time_constant_s);
    assert!(
        (found.dead_time_s - truth.dead_time_s).abs() < 1e-6 * t,
        "{what}: L {} for {}",
        found.dead_time_s,
        truth.dead_time_s
    );
}

fn steps(time_s: &[f64], at: &[(f64, f64)], start: f64) -> Vec<f64> {
    time_s.iter().map(|&t| at.iter().rev().find(|(from, _)| t >= *from).map_or(start, |m| m.1)).collect()
}

/// The specification of identification, "Must hold": noise-free data of 12 digits, T ≥ h/3, any dead time ≥ 0; K, T to 1e-6, L to 1e-6 T.
#[test]
fn val_noise_free_fopdt_is_recovered_at_any_dead_time() {
    let h = 0.5;
    let time_s: Vec<f64> = (0..400).map(|k| 1000.0 + h * f64::from(k)).collect();
    let mv = steps(&time_s, &[(1020.0, 4.0), (1090.0, 2.5), (1130.0, 3.7)], 3.0);
    for time_constant_s in [h / 3.0, 0.4, 2.0, 12.0, 40.0] {
        for dead_time_s in [0.0, 0.1, 0.25, 0.4999, 0.5, 1.0, 1.37, 5.0, 7.123456, 24.9] {
            for gain in [2.0, -0.03] {
                let truth = Fopdt { gain, time_constant_s, dead_time_s };
                let pv = to_12_digits(&closed_form(&truth, &time_s, &mv, 3.0, 10.0, 0.7));
                let what = format!("K {gain}, T {time_constant_s}, L {dead_time_s}");
                let fit = fit_fopdt(&FitProblem::new(&time_s, &pv, &mv)).expect("a fit");
                assert_recovers(&truth, &fit, &what);
                assert!(fit.passes + fit.thinned_passes < 400, "{what}: {} passes", fit.passes);
            }
        }
    }
}

/// The same with stamps off any grid, with a gap, and with an MV that moves all the time.
#[test]
fn val_noise_free_fopdt_is_recovered_from_uneven_stamps() {
    let mut rng = StdRng::seed_from_u64(7);
    for case in 0..60 {
        let mut now = 0.0;
        let time_s: Vec<f64> = (0..300)
            .map(|k| {
                now += 0.8 + 0.4 * rng.random::<f64>() + if case % 3 == 2 && k == 140 { 25.0 } else { 0.0 };
                now
            })
            .collect();
        let mut level = 50.0;
        let mv: Vec<f64> = (0..300)
            .map(|_| {
                if rng.random::<f64>() < if case % 2 == 0 { 0.02 } else { 0.5 } {
                    level = 100.0 * rng.random::<f64>();
                }
                level
            })
            .collect();
        let truth = Fopdt {
            gain: 0.5 + rng.random::<f64>(),
            time_constant_s: 0.6 * 40.0_f64.powf(rng.random::<f64>()),
            dead_time_s: if case % 5 == 0 { 0.0 } else { 12.0 * rng.random::<f64>() },
        };
        if mv.iter().all(|&u| u == mv[0]) {
            continue;
        }
        let pv = to_12_digits(&closed_form(&truth, &time_s, &mv, mv[0], -3.0, 4.0));
        let fit = fit_fopdt(&FitProblem::new(&time_s, &pv, &mv)).expect("a fit");
        assert_recovers(&truth, &fit, &format!("case {case}, {truth:?}"));
        assert_eq!(fit.segments, if case % 3 == 2 { 2 } else { 1 });
    }
}

/// The engine's own sampling against the closed form, on a grid and off it.
#[test]
fn val_simulation_equals_the_closed_form() {
    let even: Vec<f64> = (0..200).map(f64::from).collect();
    let uneven: Vec<f64> = even.iter().map(|t| t + 0.3 * (7.0 * t).sin()).collect();
    for time_s in [even, uneven] {
        let mv = steps(&time_s, &[(10.0, 2.0), (60.0, -1.0), (61.0, 5.0)], 1.0);
        for dead_time_s in [0.0, 0.4, 1.0, 17.9, 500.0] {
            let model = Fopdt { gain: 3.0, time_constant_s: 9.0, dead_time_s };
            let truth = closed_form(&model, &time_s, &mv, 0.5, 20.0, -2.0);
            let start = Some(20.0 + 3.0 * 0.5 - 2.0);
            let simulated = simulate_fopdt(&model, &time_s, &mv, 0.5, 20.0, start).expect("a run");
            for (a, b) in simulated.iter().zip(&truth) {
                assert!((a - b).abs() < 1e-11, "{a} for {b}");
            }
        }
    }
}

fn golden(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../assets/golden").join(name)
}

fn golden_columns(name: &str) -> Vec<Vec<f64>> {
    let text = std::fs::read_to_string(golden(name)).expect("golden file");
    let rows: Vec<Vec<f64>> = text
        .lines()
        .skip(1)
        .map(|line| line.split(',').map(|field| field.parse().expect("a number")).collect())
        .collect();
    (0..rows[0].len()).map(|c| rows.iter().map(|row| row[c]).collect()).collect()
}

const RIG_STEPS: [(&str, usize); 2] = [("rig_step_tq2_coupled.csv", 3), ("rig_step_tq3_decoupled.csv", 4)];

fn assert_near(found: &Fopdt, expected: [f64; 3], tolerance: f64, what: &str) {
    for (a, b) in [found.gain, found.time_constant_s, found.dead_time_s].into_iter().zip(expected) {
        assert!((a / b - 1.0).abs() < tolerance, "{what}: {a} for {b}");
    }
}

/// assets/golden/fopdt_scipy.json: the same model with bias and initial state free, and the MV ahead of the first row held
/// at its value there, which is told here. Both minimise one cost; the agreement is that of the shallower optimiser, better
/// than 1e-6.
#[test]
fn val_rig_steps_give_the_model_that_scipy_finds() {
    let expected =
        [[4.967_408_476, 153.362_956_67, 2.240_580_77], [8.643_626_669, 73.897_891_086, 2.293_557_81]];
    for ((name, pv), expected) in RIG_STEPS.into_iter().zip(expected) {
        let columns = golden_columns(name);
        let mut problem = FitProblem::new(&columns[0], &columns[pv], &columns[1]);
        problem.options.mv_before = Some(columns[1][0]);
        let fit = fit_fopdt(&problem).expect("a fit");
        assert_near(&fit.model, expected, 1e-6, name);
        let whole = fit_model(&problem, Structure::Fopdt).expect("a fit");
        assert!((whole.parameters[0].value / fit.model.gain - 1.0).abs() < 1e-12, "{name}");
        // A first order leaves a pattern of 1e-3 cm in a non-linear rig; without noise nothing hides it.
        let objections: Vec<_> = whole.verdicts.iter().filter(|v| v.is_objection()).collect();
        let pattern = |v: &&FitVerdict| {
            matches!(v, FitVerdict::ResidualsCorrelated { .. } | FitVerdict::ResidualsFollowInput { .. })
        };
        assert!(objections.iter().all(pattern), "{name}: {objections:?}");
    }
}

/// assets/golden/rig.json, good to 1e-3: there bias and state are held at the operating point, not estimated. A long
/// rest ahead of the step holds them as well.
#[test]
fn val_rig_steps_from_a_long_rest_give_the_golden_models() {
    let expected = [[4.985_767_63, 153.362_901_6, 2.208_551_34], [8.740_514_26, 73.897_832_7, 2.198_812_39]];
    for ((name, pv), expected) in RIG_STEPS.into_iter().zip(expected) {
        let columns = golden_columns(name);
        let rest = 100_000;
        let step_s = columns[0][1] - columns[0][0];
        let ahead = |value: f64, column: &[f64]| [vec![value; rest], column.to_vec()].concat();
        let time_s: Vec<f64> = (0..rest + columns[0].len()).map(|k| step_s * k as f64).collect();
        let y = ahead(columns[pv][0], &columns[pv]);
        let u = ahead(columns[1][0], &columns[1]);
        let fit = fit_fopdt(&FitProblem::new(&time_s, &y, &u)).expect("a fit");
        println!("{name}: {:?} {} %", fit.model, fit.fit_percent);
        assert_near(&fit.model, expected, 1e-3, name);
    }
}

/// How often 95 % intervals hold the truth, K, T, L in turn.
fn coverage(seeds: u64) -> [u64; 3] {
    let truth = Fopdt { gain: 2.0, time_constant_s: 10.0, dead_time_s: 3.3 };
    let time_s: Vec<f64> = (0..300).map(|k| 0.5 * f64::from(k)).collect();
    let mv = steps(&time_s, &[(15.0, 1.0), (75.0, 0.0)], 0.0);
    let clean = closed_form(&truth, &time_s, &mv, 0.0, 5.0, 0.0);
    let mean = clean.iter().sum::<f64>() / clean.len() as f64;
    let variance = clean.iter().map(|y| (y - mean).powi(2)).sum::<f64>() / clean.len() as f64;
    let sd = (0.01 * variance).sqrt();
    let (mut held, mut objections) = ([0; 3], 0);
    for seed in 0..seeds {
        let mut rng = StdRng::seed_from_u64(seed);
        let noise = |y: &f64| {
            let e: f64 = StandardNormal.sample(&mut rng);
            y + sd * e
        };
        let pv: Vec<f64> = clean.iter().map(noise).collect();
        let fit = fit_model(&FitProblem::new(&time_s, &pv, &mv), Structure::Fopdt).expect("a fit");
        let values = [truth.gain, truth.time_constant_s, truth.dead_time_s];
        for ((held, p), value) in held.iter_mut().zip(&fit.parameters).zip(values) {
            *held += u64::from(p.interval_95[0] <= value && value <= p.interval_95[1]);
        }
        // One record of white noise in a hundred looks coloured at 1 %.
        objections += u64::from(!matches!(fit.verdict(), FitVerdict::Good { .. }));
    }
    assert!(objections * 30 < seeds, "{objections} objections to {seeds} good records");
    held
}

/// The specification of identification asks for 93–97 % over 2,000 seeds. Over 300 the count of hits of an honest 95 % interval is
/// binomial with mean 285 and sd 3.77; the bounds are four sd either side, 270 to 300.
#[test]
fn val_intervals_hold_the_truth_about_95_times_in_100() {
    for (held, what) in coverage(300).into_iter().zip(["K", "T", "L"]) {
        assert!((270..=300).contains(&held), "{what}: {held} of 300");
    }
}

/// The specification of identification: 93–97 % over 2,000 fixed seeds, white noise of 1 % of the output's variance, L > 3 sd(L).
#[test]
#[ignore = "release only: cargo test --release -p vasos-engine --test val_identify -- --ignored"]
fn val_coverage_over_2000_seeds() {
    for (held, what) in coverage(2000).into_iter().zip(["K", "T", "L"]) {
        println!("{what}: {} %", held as f64 / 20.0);
        assert!((1860..=1940).contains(&held), "{what}: {held} of 2000");
    }
}

#[test]
fn val_a_log_that_starts_at_the_step_asks_for_the_mv_before() {
    let model = Fopdt { gain: 2.0, time_constant_s: 10.0, dead_time_s: 3.3 };
    let time_s: Vec<f64> = (0..100).map(f64::from).collect();
    let mv = vec![60.0; 100];
    let pv = closed_form(&model, &time_s, &mv, 50.0, 5.0, 0.0);
    let mut problem = FitProblem::new(&time_s, &pv, &mv);
    assert!(matches!(fit_fopdt(&problem), Err(FitError::NeedsMvBefore { value: 60.0, .. })));
    problem.options.mv_before = Some(50.0);
    let fit = fit_fopdt(&problem).expect("a fit");
    assert_recovers(&model, &fit, "from the step on");
    assert!((fit.bias - 5.0).abs() < 1e-4);
    let whole = fit_model(&problem, Structure::Fopdt).expect("a fit");
    assert!(whole.verdicts.contains(&FitVerdict::StartsAtRest { mv_before: 50.0 }));
    problem.options.mv_before = Some(60.0);
    assert!(matches!(fit_fopdt(&problem), Err(FitError::ConstantMv { .. })));
}

#[test]
fn val_malformed_data_is_refused_by_column_and_row() {
    let time_s: Vec<f64> = (0..50).map(f64::from).collect();
    let mv = steps(&time_s, &[(10.0, 1.0)], 0.0);
    let pv: Vec<f64> = time_s.iter().map(|t| t.sin()).collect();
    let options = FitOptions {
        pv_name: "LT-103".into(),
        mv_name: "pump".into(),
        first_row: 2,
        ..FitOptions::default()
    };
    let fit = |t: &[f64], y: &[f64], u: &[f64]| {
        fit_fopdt(&FitProblem { options: options.clone(), ..FitProblem::new(t, y, u) })
            .expect_err("refused")
            .to_string()
    };
    assert!(fit(&time_s[..9], &pv[..9], &mv[..9]).contains("only 9 rows"));
    assert!(fit(&time_s, &pv[..9], &mv).contains("9 values of LT-103"));
    assert!(
        fit(&time_s, &vec![1.5; 50], &mv).contains("LT-103 does not move in this stretch (it stays at 1.5)")
    );
    assert!(fit(&time_s, &mv, &mv).contains("LT-103 and pump hold the same values"));
    let mut broken = pv.clone();
    broken[20] = f64::NAN;
    assert!(fit(&time_s, &broken, &mv).contains("LT-103 holds NaN in row 22"));
    broken[20] = f64::NEG_INFINITY;
    assert!(fit(&time_s, &broken, &mv).contains("row 22"));
    let mut back = time_s.clone();
    back[30] = 3.0;
    assert!(fit(&back, &pv, &mv).contains("time goes backwards in row 32"));
    assert!(fit(&vec![4.0; 50], &pv, &mv).contains("the same time"));
    assert!(fit(&time_s, &vec![1.0; 50], &vec![2.0; 50]).contains("LT-103 does not move"));
}

/// Anything goes in; a result or a typed error comes out, with no number that is not one.
#[test]
fn val_garbage_never_panics() {
    let mut rng = StdRng::seed_from_u64(99);
    for case in 0..400 {
        let rows = rng.random_range(0..120);
        let scale = 10.0_f64.powi(rng.random_range(-300..300));
        let mut draw = |kind: u32| -> Vec<f64> {
            (0..rows)
                .map(|k| match kind {
                    0 => f64::from(k),
                    1 => scale * rng.random::<f64>(),
                    2 => f64::from(rng.random_range(0..2)),
                    3 => [f64::NAN, f64::INFINITY, 1e308, -1e308, 0.0, 1e-320][rng.random_range(0..6)],
                    _ => (f64::from(k) * rng.random::<f64>()).floor(),
                })
                .collect()
        };
        let (mut time_s, pv, mv) = (draw(case % 5), draw((case / 5) % 4), draw((case / 20) % 4));
        if case % 2 == 0 {
            time_s.sort_by(f64::total_cmp);
        }
        match fit_fopdt(&FitProblem::new(&time_s, &pv, &mv)) {
            Ok(fit) => assert!(fit.model.gain.is_finite() && fit.model.time_constant_s > 0.0, "case {case}"),
            Err(error) => assert!(!error.to_string().is_empty()),
        }
        let record = LoopRecord {
            problem: FitProblem::new(&time_s, &pv, &mv),
            sp: Some(&pv),
            mode: Some(ModeColumn::of_numbers(&mv)),
        };
        if let Ok(study) = study_loop(&record, &StudyOptions::default())
            && let Ok(choice) = study.choice
        {
            for fit in &choice.fits {
                assert!(
                    fit.parameters.iter().all(|p| p.value.is_finite()),
                    "case {case}: {:?}",
                    fit.parameters
                );
                assert!(!fit.verdicts.is_empty());
            }
        }
    }
}

#[test]
fn every_sentence_carries_its_numbers() {
    let errors = FitError::samples().into_iter().map(|e| (e.key(), e.to_string(), e.args()));
    let verdicts = FitVerdict::samples().into_iter().map(|v| (v.key(), v.to_string(), v.args()));
    let findings = RecordFinding::samples().into_iter().map(|f| (f.key(), f.to_string(), f.args()));
    for (key, text, args) in errors.chain(verdicts).chain(findings) {
        for (name, value) in args {
            assert!(text.contains(&value), "{key}: {name} = {value} is not in '{text}'");
        }
    }
}

/// A long record whose MV repeats every 8 s was fitted 680 s late: thinned out, one period looked like another.
#[test]
fn a_repeating_mv_does_not_alias_the_dead_time() {
    let model = Fopdt { gain: 4.9, time_constant_s: 0.3, dead_time_s: 1.0 };
    let time_s: Vec<f64> = (0..100_000).map(|k| 0.2 * f64::from(k)).collect();
    let mv: Vec<f64> = (0..100_000).map(|k| if (k / 20) % 2 == 1 { 3.3 } else { 3.0 }).collect();
    let mut rng = StdRng::seed_from_u64(3);
    let clean = simulate_fopdt(&model, &time_s, &mv, 3.0, 4.0, None).expect("a run");
    let noise = |y: &f64| {
        let e: f64 = StandardNormal.sample(&mut rng);
        y + 0.05 * e
    };
    let pv: Vec<f64> = clean.iter().map(noise).collect();
    let fit = fit_fopdt(&FitProblem::new(&time_s, &pv, &mv)).expect("a fit");
    assert!((fit.model.dead_time_s - 1.0).abs() < 0.02, "{:?}", fit.model);
    assert!((fit.model.time_constant_s - 0.3).abs() < 0.02, "{:?}", fit.model);
}
