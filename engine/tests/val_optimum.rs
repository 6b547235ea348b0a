//! Optima against published ones, against golden numbers made by independent tools, and against plain searches.

#[path = "optimum/plain_search.rs"]
mod plain_search;
#[path = "optimum/problems.rs"]
mod problems;

use num_complex::Complex64;
use plain_search::plain_search;
use problems::{FREE, check_limits, rational, solve};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use vasos_engine::analyze::{FrequencyResponse, OpenLoop, analyze_loop, is_loop_stable, loop_figures};
use vasos_engine::control::ParallelGains;
use vasos_engine::model::{Fopdt, Ipdt, ProcessModel};
use vasos_engine::tune::optimum::{
    DerivativeFilter, Limit, LoopLimits, Objective, Optimum, OptimumError, OptimumProblem, Process, Wanted,
    optimum,
};

/// Everything that makes an optimum one, but that nothing is better.
fn check(model: &ProcessModel, limits: &LoopLimits, found: &Optimum) {
    check_limits(model, limits, found);
    assert!(!found.certificate.active.is_empty(), "{found:?}");
    assert!(found.certificate.gap.is_none_or(|gap| gap < 1e-4), "{found:?}");
}

/// golden/optimal_pi.json: numpy and scipy, dense grids; Jv good to 2e-5, the last case to 1e-3.
#[test]
fn val_least_jv_of_the_golden_file() {
    let golden: serde_json::Value =
        serde_json::from_str(include_str!("../../assets/golden/optimal_pi.json")).expect("json");
    let number = |v: &serde_json::Value| v.as_f64().unwrap_or(FREE);
    for case in golden["cases"].as_array().expect("cases") {
        let (m, l, best) = (&case["model"], &case["limits"], &case["optimum"]);
        let model = Fopdt::new(number(&m["K"]), number(&m["T_s"]), number(&m["L_s"])).expect("a model");
        let model = ProcessModel::Fopdt(model);
        let limits = LoopLimits { ms: number(&l["Ms"]), mt: number(&l["Mt"]), ju: number(&l["Ju"]) };
        let found = solve(&model, Wanted::Pi, Objective::Jv, limits).expect("an optimum");
        check(&model, &limits, &found);
        let tolerance = if best["Ms"].is_null() { 1e-3 } else { 3e-5 };
        let ratio = found.value / number(&best["Jv"]);
        assert!((ratio - 1.0).abs() < tolerance, "{}: Jv {} ({ratio})", case["case"], found.value);
    }
}

/// Åström and Hägglund's test batch with the reference values of spec tune.md, section 3: Ki within 2e-5 (given to
/// four to seven digits), where spec asks for 1e-3.
#[test]
fn val_largest_ki_of_the_test_batch() {
    let batch = [
        (rational(&[1.0], &[1.0, 3.0, 3.0, 1.0], 0.0), 0.325317, 0.685190),
        (rational(&[1.0], &[1.0, 1.0], 1.0), 0.373036, 0.714271),
        (rational(&[-2.0, 1.0], &[1.0, 3.0, 3.0, 1.0], 0.0), 0.100631, 0.184296),
        (rational(&[9.0], &[1.0, 3.0, 11.0, 9.0], 0.0), 0.838806, 1.540954),
        (rational(&[1.0], &[1.0, 3.0, 3.0, 1.0], 15.0), 0.026624, 0.048205),
        (rational(&[1.0], &[1.0, 2.0, 1.0, 0.0], 0.0), 1.0 / 84.0, 1.0 / 24.0),
    ];
    for (model, at_1_4, at_2) in &batch {
        for (ms, ki) in [(1.4, at_1_4), (2.0, at_2)] {
            let limits = LoopLimits { ms, mt: FREE, ju: FREE };
            let found = solve(model, Wanted::Pi, Objective::MaxKi, limits).expect("an optimum");
            check(model, &limits, &found);
            assert!((found.gains.ki / ki - 1.0).abs() < 2e-5, "{model:?} {ms}: {} {ki}", found.gains.ki);
        }
    }
}

/// Fifteen processes under three sets of limits against a search that knows nothing of ours:
/// golden/optima_brute_force.json, made by tests/peers/optima_brute_force.py on dense grids.
///
/// Ours is never worse than its by more than that grid lets pass, and most agree.
#[test]
fn val_optima_of_a_brute_force_search() {
    let golden: serde_json::Value =
        serde_json::from_str(include_str!("../../assets/golden/optima_brute_force.json")).expect("json");
    let number = |v: &serde_json::Value| v.as_f64().unwrap_or(FREE);
    let list =
        |v: &serde_json::Value| -> Vec<f64> { v.as_array().expect("numbers").iter().map(number).collect() };
    let cases = golden["cases"].as_array().expect("cases");
    assert!(cases.len() >= 50, "{}", cases.len());
    let mut equal = 0;
    for case in cases {
        let model = rational(&list(&case["num"]), &list(&case["den"]), number(&case["L_s"]));
        let l = &case["limits"];
        let limits = LoopLimits { ms: number(&l["Ms"]), mt: number(&l["Mt"]), ju: number(&l["Ju"]) };
        let objective =
            Objective::from_id(case["objective"].as_str().expect("a word")).expect("an objective");
        let found = solve(&model, Wanted::Pi, objective, limits).expect("an optimum");
        check(&model, &limits, &found);
        let (ours, theirs) = (found.value.abs(), number(&case["optimum"]["value"]).abs());
        let worse = if objective == Objective::Jv { ours / theirs - 1.0 } else { theirs / ours - 1.0 };
        // Its grids can lose a narrow corner, by 5 % with a resonance; ours, which `check` proves, may not.
        equal += usize::from(worse.abs() < 5e-3);
        assert!(worse < 1e-3, "{} {limits:?} {objective:?}: {ours} {theirs}", case["case"]);
    }
    assert!(10 * equal >= 7 * cases.len(), "{equal} of {} agree", cases.len());
}

/// Random models of the kinds that rules are made for, and random limits, against the plain search.
#[test]
fn no_plain_search_finds_a_better_pi() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(7);
    for trial in 0..12 {
        let t = 10f64.powf(random.random_range(-0.5..1.5));
        let model = match trial % 4 {
            0 => ProcessModel::Fopdt(
                Fopdt::new(random.random_range(0.2..5.0), t, t * random.random_range(0.05..3.0))
                    .expect("a model"),
            ),
            1 => ProcessModel::Ipdt(Ipdt::new(random.random_range(0.05..2.0) / t, 0.3 * t).expect("a model")),
            2 => {
                let zeta = random.random_range(0.15..0.7);
                rational(&[1.0], &[t * t, 2.0 * zeta * t, 1.0], 0.2 * t)
            }
            _ => rational(&[-0.5 * t, 1.0], &[t * t, 2.0 * t, 1.0], 0.1 * t),
        };
        let mt = if trial % 4 == 1 { random.random_range(1.3..2.0) } else { random.random_range(1.05..1.6) };
        let limits = LoopLimits { ms: random.random_range(1.25..2.0), mt, ju: FREE };
        let found = solve(&model, Wanted::Pi, Objective::Jv, limits).expect("an optimum");
        check(&model, &limits, &found);
        let (kp, ki) = (found.gains.kp, found.gains.ki);
        let plain = plain_search(&model, &limits, (0.0, 4.0 * kp.max(0.02 * ki * t)), (0.0, 3.0 * ki));
        // The plain search stops short of the corner by what its last grid leaves.
        assert!(found.value <= plain * (1.0 + 1e-6), "{model:?} {limits:?}: {} {plain}", found.value);
        assert!(plain <= found.value * 1.03, "{model:?} {limits:?}: {} {plain}", found.value);
    }
}

/// The mirror image of a process has the mirror image of its optimum.
#[test]
fn a_negative_gain_mirrors_the_optimum() {
    for wanted in [Wanted::Pi, Wanted::Pid(DerivativeFilter::Ratio(10.0))] {
        let of = |gain: f64| {
            let model = ProcessModel::Fopdt(Fopdt::new(gain, 40.0, 8.0).expect("a model"));
            solve(&model, wanted, Objective::Jv, LoopLimits::DEFAULT).expect("an optimum")
        };
        let (plus, minus) = (of(1.7), of(-1.7));
        assert!((plus.gains.kp + minus.gains.kp).abs() < 1e-9 * plus.gains.kp);
        assert!((plus.value - minus.value).abs() < 1e-9 * plus.value);
    }
}

/// Derivative action never makes the best worse, and a free filter never worse than a fixed one.
#[test]
fn more_freedom_is_never_worse() {
    for model in [
        rational(&[1.0], &[1.0, 3.0, 3.0, 1.0], 0.0),
        rational(&[1.0], &[1.0, 1.0], 1.0),
        rational(&[4.9], &[152.0, 1.0], 2.0),
        rational(&[-2.0, 1.0], &[1.0, 3.0, 3.0, 1.0], 0.0),
    ] {
        let limits = LoopLimits { ms: 1.6, mt: 1.4, ju: 10.0 };
        let of = |wanted| {
            let found = solve(&model, wanted, Objective::Jv, limits).expect("an optimum");
            check(&model, &limits, &found);
            found.value
        };
        let (pi, fixed, free) = (
            of(Wanted::Pi),
            of(Wanted::Pid(DerivativeFilter::Ratio(10.0))),
            of(Wanted::Pid(DerivativeFilter::Free)),
        );
        assert!(fixed <= pi * (1.0 + 1e-6), "{model:?}: {pi} {fixed}");
        assert!(free <= fixed * (1.0 + 2e-4), "{model:?}: {fixed} {free}");
    }
}

/// An unstable process, whose static gain has the other sign: Kp from 1/K up.
#[test]
fn an_unstable_process_is_stabilised_first() {
    let model = rational(&[2.0], &[10.0, -1.0], 1.0);
    let limits = LoopLimits { ms: 2.5, mt: 3.0, ju: FREE };
    let found = solve(&model, Wanted::Pi, Objective::Jv, limits).expect("an optimum");
    check(&model, &limits, &found);
    let plain = plain_search(&model, &limits, (0.5, 6.0), (0.0, 1.0));
    assert!(found.value <= plain * (1.0 + 1e-6) && plain < 1.02 * found.value, "{} {plain}", found.value);
}

#[test]
fn limits_that_no_controller_meets_are_answered_with_the_floor() {
    let model = ProcessModel::Fopdt(Fopdt::new(0.6335, 8.0, 1.0).expect("a model"));
    // With integral action C S is 1/G at ω → 0.
    let of_ju = solve(&model, Wanted::Pi, Objective::Jv, LoopLimits { ms: 1.4, mt: FREE, ju: 1.5 });
    let Err(OptimumError::Infeasible { limit: Limit::Ju, floor, .. }) = of_ju else { panic!("{of_ju:?}") };
    assert!((floor * 0.6335 - 1.0).abs() < 1e-12, "{floor}");
    // An unstable process cannot be had at Ms = 1.2: what the message names as floor can be had, a little less cannot.
    let unstable = rational(&[2.0], &[10.0, -1.0], 1.0);
    let asked = LoopLimits { ms: 1.2, mt: FREE, ju: FREE };
    let refused = solve(&unstable, Wanted::Pi, Objective::Jv, asked);
    let Err(OptimumError::Infeasible { limit: Limit::Ms, floor, .. }) = refused else {
        panic!("{refused:?}")
    };
    assert!(floor > 1.2 && floor < 2.5, "{floor}");
    let with = |ms| solve(&unstable, Wanted::Pi, Objective::MaxKi, LoopLimits { ms, ..asked });
    assert!(with(floor * 1.002).is_ok());
    assert!(with(floor * 0.99).is_err());
    // Nothing stabilises a double integrator with lag without derivative action.
    let double = rational(&[1.0], &[1.0, 0.0, 0.0], 0.5);
    let refused = solve(&double, Wanted::Pi, Objective::Jv, LoopLimits::DEFAULT);
    assert!(matches!(refused, Err(OptimumError::NotStabilisable { .. })), "{refused:?}");
    assert!(
        solve(
            &double,
            Wanted::Pid(DerivativeFilter::Ratio(10.0)),
            Objective::Jv,
            LoopLimits { ms: 2.0, ..LoopLimits::DEFAULT }
        )
        .is_ok()
    );
    // Without dead time nothing holds the gain of a first order but a limit on Ju.
    let lag = ProcessModel::Fopdt(Fopdt::new(2.0, 30.0, 0.0).expect("a model"));
    assert_eq!(solve(&lag, Wanted::Pi, Objective::Jv, LoopLimits::DEFAULT), Err(OptimumError::Unbounded));
    let held = LoopLimits { ms: 1.4, mt: FREE, ju: 5.0 };
    check(&lag, &held, &solve(&lag, Wanted::Pi, Objective::Jv, held).expect("an optimum"));
}

/// The search in Td and Kp stepped over the few gains near the least Ms: 1.36 was named as the floor of this process,
/// and 1.35 refused. A numpy simplex over Kp, Ki and Td on 2500 frequencies, from 25 random gains, comes to these for
/// Ki → 0, where it stops within 1e-4 of the limit.
#[test]
fn val_the_floor_of_a_pid_is_its_least_ms() {
    let model = rational(&[1.0], &[10.0, -1.0], 2.0);
    let pid = Wanted::Pid(DerivativeFilter::Ratio(10.0));
    let with = |ms| LoopLimits { ms, mt: FREE, ju: FREE };
    for (wanted, least) in [(pid, 1.314_09), (Wanted::Pi, 1.539_31)] {
        let refused = solve(&model, wanted, Objective::Jv, with(1.2));
        let Err(OptimumError::Infeasible { limit: Limit::Ms, floor, .. }) = refused else {
            panic!("{refused:?}")
        };
        assert!((floor / least - 1.0).abs() < 2e-4, "{floor} {least}");
        let near = with(1.0 + (least - 1.0) * 1.02);
        check_limits(&model, &near, &solve(&model, wanted, Objective::MaxKi, near).expect("an optimum"));
    }
}

/// An integrator wants a Kp far below the largest that stabilises: with a strict limit the search found none.
#[test]
fn a_strict_limit_is_met_by_small_gains() {
    let model = ProcessModel::Ipdt(Ipdt::new(0.03, 2.0).expect("a model"));
    for ms in [1.01, 1.001] {
        let limits = LoopLimits { ms, mt: FREE, ju: FREE };
        for objective in [Objective::Jv, Objective::MaxKi] {
            match solve(&model, Wanted::Pi, objective, limits) {
                Ok(found) => check_limits(&model, &limits, &found),
                Err(OptimumError::Infeasible { asked, floor, .. }) => assert!(floor > asked, "{floor}"),
                other => panic!("{ms} {other:?}"),
            }
        }
    }
}

/// A limit of 1.00001 and a floor of 1.0000123 both printed as 1.
#[test]
fn a_floor_is_told_apart_from_what_was_asked() {
    let refused =
        OptimumError::Infeasible { controller: "PI", limit: Limit::Ms, asked: 1.000_01, floor: 1.000_012_3 };
    let said = refused.to_string();
    assert!(said.contains("1.000010") && said.contains("1.000012"), "{said}");
    let far = OptimumError::Infeasible { controller: "PI", limit: Limit::Ms, asked: 1.000_01, floor: 1.5 };
    assert!(far.to_string().contains("under 1.00001:"), "{far}");
}

/// A gain whose square is not a number was said to have the wrong sign.
#[test]
fn a_gain_beyond_all_numbers_is_called_so() {
    for gain in [1e300, -1e-300] {
        let model = ProcessModel::Fopdt(Fopdt::new(gain, 1.0, 1.0).expect("a model"));
        let refused = solve(&model, Wanted::Pi, Objective::Jv, LoopLimits::DEFAULT);
        assert_eq!(refused, Err(OptimumError::OutOfRange { gain }));
    }
}

/// Two lags without dead time take any gain from a PID: what was a search that gave up says so.
#[test]
fn a_pid_that_nothing_holds_is_called_unbounded() {
    let pid = Wanted::Pid(DerivativeFilter::Ratio(10.0));
    for den in [
        [1.882_807_785_371_377_4, 23.237_069_923_970_143, 1.0],
        [14.790_444_696_352_413, 10.548_433_055_194_364, 1.0],
    ] {
        let model = rational(&[2.0], &den, 0.0);
        let limits = LoopLimits { ms: 2.4, ..LoopLimits::DEFAULT };
        let refused = solve(&model, pid, Objective::Jv, limits);
        assert_eq!(refused, Err(OptimumError::Unbounded), "{den:?}");
        let held = LoopLimits { ju: 20.0, ..limits };
        check(&model, &held, &solve(&model, pid, Objective::Jv, held).expect("an optimum"));
    }
}

#[test]
fn limits_that_are_no_limits_are_refused() {
    let model = ProcessModel::Fopdt(Fopdt::new(1.0, 8.0, 1.0).expect("a model"));
    for (limits, key) in [
        (LoopLimits { ms: 1.0, mt: FREE, ju: FREE }, "Ms"),
        (LoopLimits { ms: f64::NAN, mt: FREE, ju: FREE }, "Ms"),
        (LoopLimits { ms: 1.4, mt: 0.9, ju: FREE }, "Mt"),
        (LoopLimits { ms: 1.4, mt: FREE, ju: -1.0 }, "Ju"),
        (LoopLimits { ms: FREE, mt: FREE, ju: FREE }, "without any limit"),
    ] {
        let refused = solve(&model, Wanted::Pi, Objective::Jv, limits).expect_err("refused");
        assert!(refused.to_string().contains(key), "{refused}");
    }
}

/// Over a family every member meets the limits, and the family's optimum is no better than any member's own.
#[test]
fn a_family_is_held_to_its_worst_member() {
    let members: Vec<ProcessModel> = [(4.2, 120.0, 2.6), (4.9, 152.0, 2.0), (5.6, 190.0, 1.6)]
        .iter()
        .map(|&(k, t, l)| ProcessModel::Fopdt(Fopdt::new(k, t, l).expect("a model")))
        .collect();
    let limits = LoopLimits { ms: 1.5, mt: 1.3, ju: FREE };
    let processes: Vec<Process> = members.iter().cloned().map(Process::Model).collect();
    let problem =
        OptimumProblem { processes: &processes, wanted: Wanted::Pi, objective: Objective::Jv, limits };
    let found = optimum(&problem).expect("an optimum");
    let mut jv = 0.0f64;
    let mut ms = 0.0f64;
    for model in &members {
        let a = analyze_loop(&OpenLoop::of_parallel(model, &found.gains));
        assert!(a.stable && a.ms.expect("finite") <= limits.ms * (1.0 + 1e-8));
        assert!(a.mt.expect("finite") <= limits.mt * (1.0 + 1e-8));
        jv = jv.max(a.jv.expect("finite"));
        ms = ms.max(a.ms.expect("finite"));
        let own = solve(model, Wanted::Pi, Objective::Jv, limits).expect("an optimum");
        assert!(own.value <= found.value * (1.0 + 1e-6));
    }
    assert!((found.value / jv - 1.0).abs() < 1e-8);
    assert!((ms / limits.ms - 1.0).abs() < 1e-4 || found.certificate.active.contains(&Limit::Mt));
}

/// Eighty points of a model's frequency response give its optimum.
#[test]
fn a_measured_response_gives_the_optimum_of_its_process() {
    let model = rational(&[2.0], &[12.0, 7.0, 1.0], 1.5);
    let tf = model.transfer_function();
    let points: Vec<(f64, Complex64)> =
        (0..80).map(|k| 0.01 * 10f64.powf(3.0 * f64::from(k) / 79.0)).map(|w| (w, tf.at_omega(w))).collect();
    let measured = [Process::Measured(FrequencyResponse::new(&points).expect("points"))];
    let limits = LoopLimits { ms: 1.6, mt: FREE, ju: FREE };
    for wanted in [Wanted::Pi, Wanted::Pid(DerivativeFilter::Ratio(10.0))] {
        let problem = OptimumProblem { processes: &measured, wanted, objective: Objective::Jv, limits };
        let found = optimum(&problem).expect("an optimum");
        let exact = solve(&model, wanted, Objective::Jv, limits).expect("an optimum");
        assert!((found.value / exact.value - 1.0).abs() < 5e-3, "{} {}", found.value, exact.value);
        assert!(is_loop_stable(&OpenLoop::of_parallel(&model, &found.gains)));
    }
}

/// A response that ends before −180° was said to have the wrong sign.
#[test]
fn a_response_that_ends_too_early_says_so() {
    let model = rational(&[1.0], &[1.0, 3.0, 3.0, 1.0], 1.0);
    let points: Vec<(f64, Complex64)> =
        (0..20).map(|k| 0.01 * 1.2f64.powi(k)).map(|w| (w, model.transfer_function().at_omega(w))).collect();
    let response = FrequencyResponse::new(&points).expect("points");
    let processes = [Process::Measured(response)];
    let limits = LoopLimits { ms: 1.4, mt: FREE, ju: FREE };
    let refused = optimum(&OptimumProblem {
        processes: &processes,
        wanted: Wanted::Pi,
        objective: Objective::Jv,
        limits,
    });
    let said = refused.expect_err("nothing is known").to_string();
    assert!(said.contains("measure to a higher frequency"), "{said}");
}

/// Of two hundred models only the worst few are simulated: all of them took nine seconds. The value is still the worst.
#[test]
fn the_least_iae_of_many_models_is_that_of_the_worst() {
    let model = |k: u32| {
        let at = |step: u32| 1.0 + 0.15 * (f64::from((k * step) % 20) / 9.5 - 1.0);
        ProcessModel::Fopdt(Fopdt::new(4.9 * at(1), 152.0 * at(7), 2.0 * at(13)).expect("a model"))
    };
    let models: Vec<ProcessModel> = (0..40).map(model).collect();
    let processes: Vec<Process> = models.iter().cloned().map(Process::Model).collect();
    let limits = LoopLimits { ms: 1.6, mt: FREE, ju: FREE };
    let found = optimum(&OptimumProblem {
        processes: &processes,
        wanted: Wanted::Pi,
        objective: Objective::IaeLoad,
        limits,
    })
    .expect("an optimum");
    let iae = |m: &ProcessModel| {
        let open = OpenLoop::of_parallel(m, &found.gains);
        loop_figures(&open, &analyze_loop(&open)).iae_load.expect("a response that settles")
    };
    let worst = models.iter().map(iae).fold(0.0, f64::max);
    assert!((found.value / worst - 1.0).abs() < 1e-6, "{} {worst}", found.value);
    models.iter().for_each(|m| check_limits(m, &limits, &found));
}

/// The least IAE is no worse than that of the least Jv, and a plain look about it finds nothing better.
#[test]
fn least_iae_is_a_valley() {
    use vasos_engine::analyze::{Excitation, ResponseOptions, loop_response};
    let model = rational(&[1.0], &[1.0, 1.0], 1.0);
    let limits = LoopLimits { ms: 1.7, mt: FREE, ju: FREE };
    for (objective, excitation) in
        [(Objective::IaeLoad, Excitation::Load), (Objective::IaeSetpoint, Excitation::Setpoint)]
    {
        let found = solve(&model, Wanted::Pi, objective, limits).expect("an optimum");
        check(&model, &limits, &found);
        for (p, i) in [(1.03, 1.0), (0.97, 1.0), (1.0, 1.03), (1.0, 0.97), (1.03, 0.97), (0.97, 1.03)] {
            let gains = ParallelGains { kp: p * found.gains.kp, ki: i * found.gains.ki, ..found.gains };
            let open = OpenLoop::of_parallel(&model, &gains);
            if analyze_loop(&open).ms.is_none_or(|ms| ms > limits.ms) {
                continue;
            }
            let iae =
                loop_response(&open, excitation, &ResponseOptions::default()).metrics().expect("figures").iae;
            assert!(iae >= found.value * (1.0 - 1e-4), "{objective:?} {p} {i}: {iae} {}", found.value);
        }
    }
}

/// The least IAE of a setpoint step lies far from the least Jv: one search from there got stuck in valleys, so that a PID
/// did worse than the PI, and a laxer limit worse than a stricter one; or it ended without an answer.
#[test]
fn more_freedom_is_never_worse_for_the_iae_either() {
    let pid = Wanted::Pid(DerivativeFilter::Ratio(10.0));
    for (k, t, l) in [(2.92, 11.9, 1.6), (4.9, 152.0, 2.0), (1.0, 1.0, 0.3)] {
        let model = ProcessModel::Fopdt(Fopdt::new(k, t, l).expect("a model"));
        let of = |wanted, ms| {
            let limits = LoopLimits { ms, ..LoopLimits::DEFAULT };
            solve(&model, wanted, Objective::IaeSetpoint, limits).expect("an optimum").value
        };
        let (pi, lax_pi, with_d, lax_with_d) =
            (of(Wanted::Pi, 1.8), of(Wanted::Pi, 2.2), of(pid, 1.8), of(pid, 2.2));
        assert!(with_d <= pi * (1.0 + 1e-3), "{k} {t} {l}: {pi} {with_d}");
        assert!(lax_with_d <= lax_pi * (1.0 + 1e-3), "{k} {t} {l}: {lax_pi} {lax_with_d}");
        assert!(lax_pi <= pi * 1.02, "{k} {t} {l}: {pi} {lax_pi}");
    }
    let model = ProcessModel::Fopdt(Fopdt::new(1.0, 1.0, 1.0).expect("a model"));
    let held = LoopLimits { ms: 1.4, mt: FREE, ju: 5.0 };
    check(&model, &held, &solve(&model, pid, Objective::IaeLoad, held).expect("an optimum"));
}

/// Long dead times have a second valley of Td far out; an independent search found these gains.
#[test]
fn a_pid_for_a_long_dead_time_takes_the_deeper_valley() {
    let pid = Wanted::Pid(DerivativeFilter::Ratio(10.0));
    for (model, jv) in
        [(rational(&[1.0], &[1.0, 2.0, 1.0], 15.0), 27.665), (rational(&[1.0], &[1.0, 1.0], 8.0), 14.537)]
    {
        let found = solve(&model, pid, Objective::Jv, LoopLimits::DEFAULT).expect("an optimum");
        check(&model, &LoopLimits::DEFAULT, &found);
        assert!(found.value < jv * 1.002, "{} {jv}", found.value);
    }
}

/// With two integrators in the loop |T| passes 1 somewhere: ∫ ln|T|/ω² dω ≥ 0.
#[test]
fn no_integrator_has_mt_1() {
    let model = ProcessModel::Ipdt(Ipdt::new(1.0, 1.0).expect("a model"));
    let limits = LoopLimits { ms: 1.6, mt: 1.0, ju: FREE };
    let refused = solve(&model, Wanted::Pi, Objective::Jv, limits);
    assert!(
        matches!(refused, Err(OptimumError::Infeasible { limit: Limit::Mt, floor, .. }) if floor > 1.0),
        "{refused:?}"
    );
}

/// With N fixed and Ju limited the far valley, where the derivative is the controller's main part, was never looked at: a
/// PID was given that is no better than the PI. Gains by an independent brute force.
#[test]
fn a_pid_under_a_limit_on_ju_takes_the_far_valley() {
    for (model, limits, n, jv) in [
        (rational(&[1.0], &[1.0, 1.0, 0.0], 0.2), (1.6, FREE, 2.0), 10.0, 9.372),
        (rational(&[1.0], &[0.1, 0.9, -1.0], 0.1), (2.2, FREE, 12.0), 10.0, 0.5818),
        (rational(&[4.9], &[152.0, 1.0], 2.0), (1.4, 1.2, 8.0), 10.0, 3.8242),
    ] {
        let limits = LoopLimits { ms: limits.0, mt: limits.1, ju: limits.2 };
        let found = solve(&model, Wanted::Pid(DerivativeFilter::Ratio(n)), Objective::Jv, limits);
        let found = found.expect("an optimum");
        check_limits(&model, &limits, &found);
        assert!(found.value < jv * 1.002, "{} {jv}", found.value);
        let pi = solve(&model, Wanted::Pi, Objective::Jv, limits).expect("an optimum");
        assert!(found.value <= pi.value, "{} {}", found.value, pi.value);
    }
}

/// The search over Td went to and fro until it gave up: ordinary problems had no answer.
#[test]
fn a_pid_search_that_does_not_settle_still_answers() {
    let lag = rational(&[1.0], &[1.0, 1.0], 10.0);
    let integrator = rational(&[1.0], &[1.0, 1.0, 0.0], 0.2);
    for (model, ms, ju, n) in
        [(&lag, 2.0, 3.3966, 2.0), (&lag, 1.6, 3.0, 10.0), (&integrator, 1.7, 2.714_167_274_040_975_5, 40.0)]
    {
        let limits = LoopLimits { ms, mt: FREE, ju };
        let pi = solve(model, Wanted::Pi, Objective::Jv, limits).expect("an optimum");
        for filter in [DerivativeFilter::Ratio(n), DerivativeFilter::Free] {
            let found = solve(model, Wanted::Pid(filter), Objective::Jv, limits).expect("an answer");
            check_limits(model, &limits, &found);
            assert!(found.value <= pi.value, "{filter:?} {} {}", found.value, pi.value);
        }
    }
}

/// The free filter ended above N = 1, which it may take.
#[test]
fn a_free_filter_is_no_worse_than_its_least_n() {
    for (model, ms, ju, jv) in [
        (ProcessModel::Ipdt(Ipdt::new(0.03, 2.0).expect("a model")), 1.4, 8.999_96, 2.526),
        (rational(&[1.0], &[1.0, 3.0, 3.0, 1.0], 0.5), 1.7, 1.001_72, 3.775),
    ] {
        let limits = LoopLimits { ms, mt: FREE, ju };
        let free =
            solve(&model, Wanted::Pid(DerivativeFilter::Free), Objective::Jv, limits).expect("an optimum");
        check_limits(&model, &limits, &free);
        assert!(free.value < jv * 1.001, "{} {jv}", free.value);
    }
}

/// The search by simulation stayed where the least Jv had put it; gains by an independent search.
#[test]
fn the_least_iae_of_a_setpoint_is_sought_from_several_places() {
    for ((k, t, l), ms, iae) in [((2.0, 10.0, 1.0), 1.7, 1.8267), ((1.0, 5.0, 1.0), 1.5, 2.0863)] {
        let model = ProcessModel::Fopdt(Fopdt::new(k, t, l).expect("a model"));
        let limits = LoopLimits { ms, mt: FREE, ju: FREE };
        let found = solve(&model, Wanted::Pid(DerivativeFilter::Ratio(10.0)), Objective::IaeSetpoint, limits)
            .expect("an optimum");
        check_limits(&model, &limits, &found);
        assert!(found.value < iae * 1.005, "{} {iae}", found.value);
    }
}

/// What a PI stabilises only with an Ms over 8 was said not to be stabilised by any: e^(−0.9 s)/(s − 1) is by Kc = 1.05,
/// Ti = 10000 s, with an Ms of 46.8.
#[test]
fn a_process_hard_to_stabilise_is_not_called_impossible() {
    for (l, known) in [(0.7, 8.5), (0.8, 17.0), (0.9, 46.9), (0.95, 180.0)] {
        let model = rational(&[1.0], &[1.0, -1.0], l);
        let refused = solve(&model, Wanted::Pi, Objective::Jv, LoopLimits::DEFAULT);
        let Err(OptimumError::Infeasible { limit: Limit::Ms, floor, .. }) = refused else {
            panic!("{l}: {refused:?}")
        };
        assert!(floor > 8.0 && floor < known, "{l}: {floor}");
    }
    let beyond = solve(&rational(&[1.0], &[1.0, -1.0], 1.1), Wanted::Pi, Objective::Jv, LoopLimits::DEFAULT);
    assert!(matches!(beyond, Err(OptimumError::NotStabilisable { .. })), "{beyond:?}");
}
