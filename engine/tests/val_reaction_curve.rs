//! What the field reads off a reaction curve, against curves whose model is known.

mod records;

use rand::SeedableRng;
use rand::rngs::StdRng;
use vasos_engine::identify::{
    CurveMethod, FitProblem, ReactionCurve, ReactionCurveError, Structure, fit_model, reaction_curve,
};
use vasos_engine::model::ProcessModel;

use records::{Truth, moves, noise};

const STEP_S: f64 = 20.0;

fn record(truth: &Truth, h: f64, end_s: f64) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let rows = (end_s / h).round() as u32;
    let time_s: Vec<f64> = (0..=rows).map(|k| h * f64::from(k)).collect();
    let mv = moves(&time_s, &[(STEP_S, 3.5)], 3.0);
    let pv = truth.run(&time_s, &mv, 3.0).iter().map(|y| 12.0 + y).collect();
    (time_s, pv, mv)
}

fn of(r: &(Vec<f64>, Vec<f64>, Vec<f64>)) -> Result<ReactionCurve, ReactionCurveError> {
    reaction_curve(&FitProblem::new(&r.0, &r.1, &r.2))
}

/// Without noise every method gives the first order that made the curve: 1e-3 at rows a 200th of T apart, dead time on
/// a row and off it. The onset is known to a row only.
#[test]
fn val_first_orders_are_read_back() {
    for gain in [2.0, -0.4] {
        for l in [0.0, 0.1, 3.0, 11.93] {
            let (t, h) = (20.0, 0.1);
            let r = record(&Truth::First { k: gain, t, l }, h, 400.0);
            let found = of(&r).expect("a curve");
            assert_eq!(found.estimates.len(), CurveMethod::ALL.len());
            assert_eq!((found.step_row, found.mv), (200, [3.0, 3.5]));
            for e in &found.estimates {
                let m = &e.model;
                let off_row = (l / h - (l / h).round()).abs() > 1e-6;
                // What the first row after an onset between rows hides of it.
                let sampling = if off_row { h } else { 0.0 };
                let exact = matches!(
                    e.method,
                    CurveMethod::TwoPoints | CurveMethod::Area | CurveMethod::LeastSquares
                );
                let slack = 1e-3 * t + if exact { 0.0 } else { sampling };
                let what = format!("{:?}, K {gain}, L {l}: {m:?}", e.method);
                assert!((m.gain / gain - 1.0).abs() < 1e-3, "{what}");
                assert!((m.time_constant_s - t).abs() < slack, "{what}");
                assert!((m.dead_time_s - l).abs() < slack, "{what}");
                assert!(e.r2 > 0.9999, "{what}: {}", e.r2);
            }
        }
    }
}

/// Two equal time constants, s = t/T: the tangent in the point of inflection gives T_t = e T and L_t = (3 − e) T;
/// 28.3 and 63.2 % lie at solutions of 1 − (1 + s) e^(−s); mean residence 2 T; the response begins with the dead time.
#[test]
fn val_an_s_curve_by_hand() {
    let (tau, l) = (10.0, 4.0);
    let r = record(&Truth::Second { k: 1.5, tau, zeta: 1.0, tz: 0.0, l }, 0.05, 300.0);
    let found = of(&r).expect("a curve");
    let level = |p: f64| {
        let (mut a, mut b) = (0.0_f64, 20.0_f64);
        for _ in 0..80 {
            let m = 0.5 * (a + b);
            if 1.0 - (1.0 + m) * (-m).exp() < p { a = m } else { b = m }
        }
        a * tau
    };
    let (t28, t63) = (level(1.0 - f64::exp(-1.0 / 3.0)), level(1.0 - f64::exp(-1.0)));
    let e = std::f64::consts::E;
    let up_to = |s: f64| s - 2.0 + (2.0 + s) * f64::exp(-s);
    let residence = l + 2.0 * tau;
    let area = e * tau * up_to(2.0);
    let expected = [
        (CurveMethod::Tangent, e * tau, l + (3.0 - e) * tau),
        (CurveMethod::TwoPoints, 1.5 * (t63 - t28), l + t63 - 1.5 * (t63 - t28)),
        (CurveMethod::Onset, t63, l),
        (CurveMethod::Area, area, residence - area),
    ];
    for (method, t, dead) in expected {
        let m = found.estimate(method).expect("an estimate").model;
        assert!(
            (m.time_constant_s - t).abs() < 2e-3 * t + 0.01,
            "{method:?}: T {} for {t}",
            m.time_constant_s
        );
        assert!((m.dead_time_s - dead).abs() < 0.06, "{method:?}: L {} for {dead}", m.dead_time_s);
    }
    let best = found.estimates.iter().max_by(|a, b| a.r2.total_cmp(&b.r2)).expect("estimates");
    assert_eq!(best.method, CurveMethod::LeastSquares);
}

/// Noise of 3 % of the response: means over rests and parabolas hold every method within what its feature allows, and the
/// least squares are those of the fit.
#[test]
fn val_noise_is_smoothed() {
    let (t, l) = (20.0, 8.0);
    let clean = record(&Truth::First { k: 2.0, t, l }, 0.2, 300.0);
    for seed in 0..20 {
        let mut rng = StdRng::seed_from_u64(seed);
        let mut r = clean.clone();
        r.1.iter_mut().zip(noise(&mut rng, clean.1.len(), 0.0)).for_each(|(y, e)| *y += 0.03 * e);
        let found = of(&r).expect("a curve");
        assert!((found.noise - 0.03).abs() < 0.004, "{}", found.noise);
        for e in &found.estimates {
            let (dt, dl) = ((e.model.time_constant_s / t - 1.0).abs(), (e.model.dead_time_s - l).abs() / t);
            let [most_t, most_l] = match e.method {
                CurveMethod::LeastSquares => [0.03, 0.03],
                CurveMethod::Tangent => [0.25, 0.12],
                _ => [0.15, 0.12],
            };
            let what = format!("seed {seed}, {:?}: {:?}", e.method, e.model);
            assert!((e.model.gain / 2.0 - 1.0).abs() < 0.02, "{what}");
            assert!(dt < most_t && dl < most_l, "{what}");
            assert!(e.r2 > 0.97, "{what}: {}", e.r2);
        }
        // The rest ahead of a step tells the MV before the first row.
        let mut problem = FitProblem::new(&r.0, &r.1, &r.2);
        problem.options.mv_before = Some(r.2[0]);
        let fit = fit_model(&problem, Structure::Fopdt).expect("a fit");
        let ProcessModel::Fopdt(model) = fit.model else { panic!("a first order") };
        assert_eq!(found.estimate(CurveMethod::LeastSquares).expect("an estimate").model, model);
    }
}

#[test]
fn val_a_step_in_the_first_row_needs_the_mv_before() {
    let (time_s, pv, mv) = record(&Truth::First { k: 2.0, t: 20.0, l: 3.0 }, 0.1, 300.0);
    let from = mv.iter().position(|u| *u > 3.2).expect("a step");
    let mut problem = FitProblem::new(&time_s[from..], &pv[from..], &mv[from..]);
    assert!(matches!(reaction_curve(&problem), Err(ReactionCurveError::NoStep { .. })));
    problem.options.mv_before = Some(3.0);
    let found = reaction_curve(&problem).expect("a curve");
    let m = found.estimate(CurveMethod::TwoPoints).expect("an estimate").model;
    assert!((m.time_constant_s - 20.0).abs() < 0.02 && (m.dead_time_s - 3.0).abs() < 0.02, "{m:?}");
}

#[test]
fn val_what_is_no_reaction_curve_is_said() {
    let truth = Truth::First { k: 2.0, t: 20.0, l: 3.0 };
    let good = record(&truth, 0.5, 200.0);
    let kind = |r: &(Vec<f64>, Vec<f64>, Vec<f64>)| of(r).expect_err("refused");
    let mut several = good.clone();
    several.2[300..].fill(3.2);
    assert!(matches!(kind(&several), ReactionCurveError::SeveralSteps { moves: 2, .. }));
    let mut ramp = good.clone();
    (0..ramp.2.len()).for_each(|k| ramp.2[k] = k as f64 * 1e-3);
    assert!(matches!(kind(&ramp), ReactionCurveError::SeveralSteps { .. }));
    let mut still = good.clone();
    still.2.fill(3.0);
    assert!(matches!(kind(&still), ReactionCurveError::NoStep { .. }));
    assert!(matches!(kind(&record(&truth, 0.5, 60.0)), ReactionCurveError::NotAtRestAfter { .. }));
    let level = record(&Truth::Integrator { kv: 0.1, l: 2.0 }, 0.5, 200.0);
    assert!(matches!(kind(&level), ReactionCurveError::NotAtRestAfter { .. }));
    let mut before = good.clone();
    (0..40).for_each(|k| before.1[k] -= 0.01 * (40 - k) as f64);
    assert!(matches!(kind(&before), ReactionCurveError::NotAtRestBefore { .. }));
    assert!(matches!(kind(&record(&truth, 0.5, 23.0)), ReactionCurveError::TooShort { .. }));
    let mut deaf = good.clone();
    let mut rng = StdRng::seed_from_u64(3);
    deaf.1 = noise(&mut rng, deaf.0.len(), 0.0);
    assert!(matches!(kind(&deaf), ReactionCurveError::NoResponse { .. }));
    let mut broken = good;
    broken.1[7] = f64::NAN;
    assert!(matches!(kind(&broken), ReactionCurveError::Data(_)));
}
