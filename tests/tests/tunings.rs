//! Tunings before use: fronts with the rules on them, what a fit's uncertainty makes of a tuning, trials on the rig.

use vasos_engine::analyze::{Excitation, OpenLoop, analyze_loop};
use vasos_engine::control::{ParallelGains, PidGains, PidTuning};
use vasos_engine::identify::{FitProblem, Structure, fit_model};
use vasos_engine::model::{Fopdt, ProcessModel, SampledInput, simulate_process};
use vasos_engine::plant::Measurement;
use vasos_engine::session::RigCommand;
use vasos_engine::sim::{Trial, run_trial};
use vasos_engine::tune::optimum::{
    LoopLimits, Objective, OptimumProblem, Process, TradeOff, Wanted, front, on_front, optimum,
};
use vasos_engine::tune::{ControllerKind, RuleOptions, setpoint_side, tune_all, tuning_spread};
use vasos_io::rig::preset;

fn fopdt(k: f64, t: f64, l: f64) -> ProcessModel {
    ProcessModel::Fopdt(Fopdt::new(k, t, l).expect("a model"))
}

fn problem<'a>(processes: &'a [Process], limits: LoopLimits) -> OptimumProblem<'a> {
    OptimumProblem { processes, wanted: Wanted::Pi, objective: Objective::Jv, limits }
}

/// Looser limits never make it worse, and no rule's PI lies below the front.
#[test]
fn no_rule_lies_below_the_front() {
    for model in
        [fopdt(4.9, 152.0, 2.0), fopdt(8.7, 73.0, 2.0), fopdt(1.0, 1.0, 1.0), fopdt(0.6335, 8.0, 1.0)]
    {
        let processes = [Process::Model(model.clone())];
        for trade_off in [TradeOff::JvMs, TradeOff::JvJu] {
            // Over Ju the limit on Ms stays; points that pass it are no rivals.
            let limits = match trade_off {
                TradeOff::JvJu => LoopLimits { ms: 3.0, ..LoopLimits::DEFAULT },
                _ => LoopLimits { ms: f64::INFINITY, ..LoopLimits::DEFAULT },
            };
            let points = front(&problem(&processes, limits), trade_off, 40);
            assert!(points.len() > 30, "{model:?} {trade_off:?}: {}", points.len());
            for pair in points.windows(2) {
                assert!(pair[1].limit > pair[0].limit);
                assert!(pair[1].value <= pair[0].value * (1.0 + 1e-5), "{model:?} {pair:?}");
            }
            let below = |limit: f64| points.iter().rfind(|p| p.limit <= limit);
            for (rule, kind, tuned) in tune_all(&model, &RuleOptions::default()) {
                let Ok(tuning) = tuned else { continue };
                if kind != ControllerKind::Pi {
                    continue;
                }
                let open = OpenLoop::new(&model, &tuning.gains);
                let analysis = analyze_loop(&open);
                if analysis.ms.is_none_or(|ms| ms > limits.ms) {
                    continue;
                }
                let Some((limit, value)) = on_front(&open, &analysis, trade_off) else { continue };
                // The front at a point at least as lax as the rule can only be better.
                let lax = points.iter().find(|p| p.limit >= limit);
                if let Some(lax) = lax {
                    assert!(lax.value <= value * (1.0 + 1e-5), "{}: {value} {lax:?}", rule.id);
                }
                assert!(below(limit).is_none_or(|p| p.limit <= limit));
            }
        }
    }
}

/// Draws from a fit scatter as its intervals say.
#[test]
fn draws_scatter_as_the_intervals_say() {
    let truth = fopdt(2.0, 40.0, 6.0);
    let time_s: Vec<f64> = (0..600).map(f64::from).collect();
    let mv: Vec<f64> = time_s.iter().map(|t| if (*t / 90.0) as u32 % 2 == 1 { 1.0 } else { 0.0 }).collect();
    let clean = simulate_process(&truth, &SampledInput::single(&time_s, &mv)).expect("a response");
    let pv: Vec<f64> = clean
        .iter()
        .enumerate()
        .map(|(k, y)| y + 0.08 * (12.9898 * k as f64).sin().mul_add(43_758.545, 0.0).fract())
        .collect();
    let fit = fit_model(&FitProblem::new(&time_s, &pv, &mv), Structure::Fopdt).expect("a fit");
    let draws = fit.draws(4000, 3).expect("draws");
    assert_eq!(fit.draws(20, 3).expect("draws"), draws[..20]);
    let of = |name: &str| -> Vec<f64> {
        draws
            .iter()
            .map(|m| match (m, name) {
                (ProcessModel::Fopdt(m), "K") => m.gain,
                (ProcessModel::Fopdt(m), "T_s") => m.time_constant_s,
                (ProcessModel::Fopdt(m), _) => m.dead_time_s,
                _ => f64::NAN,
            })
            .collect()
    };
    for name in ["K", "T_s", "L_s"] {
        let values = of(name);
        let parameter = fit.parameter(name).expect("a parameter");
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let sd = (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64).sqrt();
        // Four standard errors of the mean and of the deviation of 4,000 draws.
        assert!((mean - parameter.value).abs() < 0.1 * parameter.standard_error, "{name}: {mean}");
        assert!(
            (sd / parameter.standard_error - 1.0).abs() < 0.06,
            "{name}: {sd} {}",
            parameter.standard_error
        );
    }
    let gains = ParallelGains { kp: 2.2, ki: 0.08, kd: 0.0, tf_s: 0.0 };
    let spread = tuning_spread(&draws[..200], &gains, Excitation::Load, 200.0).expect("models");
    let nominal = analyze_loop(&OpenLoop::of_parallel(&fit.model, &gains)).ms.expect("finite");
    assert!(spread.ms.low < nominal && nominal < spread.ms.high, "{spread:?}");
    assert_eq!(spread.unstable, 0);
}

/// Weight and filter chosen for an overshoot, as the window applies them: the rig without noise keeps to it, but for what
/// its own laws add; without them it passes it by far.
#[test]
fn the_setpoint_side_keeps_the_rig_to_its_overshoot() {
    let network = preset("stad").expect("a preset");
    let gains = PidGains::pi(3.0, 5.0);
    let side = setpoint_side(&OpenLoop::new(&fopdt(4.9, 152.0, 2.0), &gains), 5.0).expect("a setpoint side");
    assert!(side.b == 0.0 && side.filter_s > 0.0, "{side:?}");
    let settings = network.spec.configurations[0].loops[0].clone();
    let overshoot = |b: f64, filter_s: f64| {
        let mut options = Box::new(settings.options.clone());
        options.setpoint.filter_s = filter_s;
        let trial = Trial {
            configuration: "coupled".to_owned(),
            setup: vec![RigCommand::Options { tag: "LIC-02".to_owned(), options }],
            measurement: Measurement { noise: false, quantisation: false, resolution: false },
            seed: 5,
            tag: "LIC-02".to_owned(),
            tuning: PidTuning { gains, b, c: 0.0 },
            pv_filter_s: 0.0,
            level_cm: 15.0,
            step_cm: 0.2,
            pump_share: 0.95,
            duration_s: 1200.0,
        };
        run_trial(&network, &trial).expect("a trial").setpoint.expect("figures").overshoot_percent
    };
    let (plain, kept) = (overshoot(1.0, 0.0), overshoot(side.b, side.filter_s));
    println!("overshoot {plain:?} % without, {kept:?} % with {side:?}");
    assert!(plain.expect("a step") > 40.0 && kept.expect("a step") < 8.0);
}

/// The optimum, tried on the rig with noise and converters, beats direct synthesis on the load; its step saturates no
/// more than the pump's range makes it.
#[test]
fn a_trial_on_the_rig_tells_two_tunings_apart() {
    let network = preset("stad").expect("a preset");
    let model = fopdt(4.9, 152.0, 2.0);
    let processes = [Process::Model(model)];
    let limits = LoopLimits { ms: 1.4, mt: f64::INFINITY, ju: 6.0 };
    let best = optimum(&problem(&processes, limits)).expect("an optimum").ideal().expect("an ideal form");
    let trial = |gains: PidGains, measurement: Measurement| {
        let trial = Trial {
            configuration: "coupled".to_owned(),
            setup: vec![],
            measurement,
            seed: 5,
            tag: "LIC-02".to_owned(),
            tuning: PidTuning::new(gains),
            pv_filter_s: 0.0,
            level_cm: 15.0,
            step_cm: 1.0,
            pump_share: 0.95,
            duration_s: 1200.0,
        };
        let run = run_trial(&network, &trial).expect("a trial");
        assert_eq!(run_trial(&network, &trial).expect("a trial"), run);
        run
    };
    let noisy = Measurement::DEFAULT;
    let still = Measurement { noise: false, quantisation: false, resolution: false };
    for measurement in [noisy, still] {
        let (optimal, synthesis) = (trial(best, measurement), trial(PidGains::pi(1.8, 152.0), measurement));
        let iae = |run: &vasos_engine::sim::TrialRun| run.load.expect("figures").iae;
        assert!(iae(&optimal) < 0.5 * iae(&synthesis), "{} {}", iae(&optimal), iae(&synthesis));
        let late = optimal.pv.len() - 500;
        let mean = optimal.pv[late..].iter().sum::<f64>() / 500.0;
        assert!((mean - 16.0).abs() < 0.1, "{mean}");
        assert!(optimal.saturated_share < 0.2, "{}", optimal.saturated_share);
    }
    let refused = run_trial(
        &network,
        &Trial {
            configuration: "coupled".to_owned(),
            setup: vec![],
            measurement: noisy,
            seed: 5,
            tag: "LIC-99".to_owned(),
            tuning: PidTuning::new(best),
            pv_filter_s: 0.0,
            level_cm: 15.0,
            step_cm: 1.0,
            pump_share: 0.95,
            duration_s: 100.0,
        },
    );
    assert!(refused.expect_err("no such loop").to_string().contains("LIC-99"));
}
