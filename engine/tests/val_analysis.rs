//! Loop analysis against golden files, closed forms, dense grids and time responses.

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use serde_json::Value;
use vasos_engine::analyze::{
    Excitation, OpenLoop, Response, ResponseEnd, ResponseOptions, analyze, is_closed_loop_stable,
    step_response,
};
use vasos_engine::control::PidGains;
use vasos_engine::model::{Fopdt, Ipdt, ProcessModel, Sopdt};

const GOLDEN: &str = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../assets/golden/analysis.json"));

fn fopdt(k: f64, t: f64, l: f64) -> ProcessModel {
    ProcessModel::Fopdt(Fopdt::new(k, t, l).expect("a model"))
}

fn log_uniform(rng: &mut StdRng, low: f64, high: f64) -> f64 {
    (low.ln() + rng.random::<f64>() * (high / low).ln()).exp()
}

fn random_model(rng: &mut StdRng) -> ProcessModel {
    let gain = log_uniform(rng, 0.1, 10.0) * if rng.random::<f64>() < 0.3 { -1.0 } else { 1.0 };
    let scale = log_uniform(rng, 0.1, 100.0);
    let dead_time = if rng.random::<f64>() < 0.25 { 0.0 } else { scale * log_uniform(rng, 0.02, 5.0) };
    match rng.random_range(0..6) {
        0 => fopdt(gain, scale, dead_time),
        1 => ProcessModel::Ipdt(Ipdt::new(gain / scale, dead_time).expect("a model")),
        2 => {
            let zero = scale * (rng.random::<f64>() * 3.0 - 1.5);
            ProcessModel::Sopdt(
                Sopdt::new(gain, scale, scale * log_uniform(rng, 0.05, 1.0), zero, dead_time)
                    .expect("a model"),
            )
        }
        3 => {
            // Oscillatory second order behind a lag: K/((τ²s² + 2ζτs + 1)(0.3τs + 1)).
            let damping = log_uniform(rng, 0.03, 1.5);
            let (a, b) = (scale * scale, 2.0 * damping * scale);
            let lag = 0.3 * scale;
            ProcessModel::rational(&[gain], &[a * lag, a + b * lag, b + lag, 1.0], dead_time)
                .expect("a model")
        }
        4 => {
            // Open-loop unstable: K/(τs − 1), which wants a least gain.
            ProcessModel::rational(&[gain], &[scale, -1.0], 0.2 * dead_time).expect("a model")
        }
        _ => {
            // Four equal lags: K/(τs + 1)⁴.
            let t = scale;
            ProcessModel::rational(
                &[gain],
                &[t.powi(4), 4.0 * t.powi(3), 6.0 * t * t, 4.0 * t, 1.0],
                dead_time,
            )
            .expect("a model")
        }
    }
}

/// A time in seconds that goes with the model's own.
fn time_scale(model: &ProcessModel) -> f64 {
    match model {
        ProcessModel::Fopdt(m) => m.time_constant_s,
        ProcessModel::Ipdt(m) => 1.0 / m.velocity_gain.abs(),
        ProcessModel::Sopdt(m) => m.time_constant_1_s,
        ProcessModel::Rational(m) => m.den[0].powf(1.0 / (m.den.len() - 1) as f64),
    }
}

fn random_gains(rng: &mut StdRng, model: &ProcessModel) -> PidGains {
    let tf = model.transfer_function();
    let time = time_scale(model);
    let sign = if tf.num[tf.num.len() - 1] < 0.0 { -1.0 } else { 1.0 };
    let kc = sign * log_uniform(rng, 0.02, 20.0);
    let integral = if rng.random::<f64>() < 0.2 { f64::INFINITY } else { time * log_uniform(rng, 0.1, 10.0) };
    let derivative = if rng.random::<f64>() < 0.5 { 0.0 } else { time * log_uniform(rng, 0.02, 1.0) };
    PidGains { kc, ti_s: integral, td_s: derivative, n: log_uniform(rng, 3.0, 30.0) }
}

/// Peaks of |S|, |T|, |G S/s|, |C S| on a grid of a hundred thousand points, logarithmic and linear.
fn dense_peaks(open: &OpenLoop, low: f64, high: f64, dead_time: f64) -> [f64; 4] {
    let mut best = [0.0f64; 4];
    let mut look = |w: f64| {
        let (l, g, c) = (open.at_omega(w), open.process_at_omega(w), open.controller_at_omega(w));
        let s = 1.0 / (1.0 + l);
        for (b, v) in best.iter_mut().zip([s.norm(), (l * s).norm(), (g * s).norm() / w, (c * s).norm()]) {
            *b = b.max(v);
        }
    };
    let ratio = (high / low).powf(1.0 / 60_000.0);
    let mut w = low;
    while w < high {
        look(w);
        w *= ratio;
    }
    if dead_time > 0.0 {
        for i in 1..60_000 {
            look(f64::from(i) * 1e-3 / dead_time);
        }
    }
    best
}

/// Loops compared with a dense grid.
const LOOPS: usize = 200;

#[test]
fn peaks_agree_with_a_dense_grid_on_random_loops() {
    let mut rng = StdRng::seed_from_u64(20_260_101);
    let mut compared = 0;
    for case in 0..4000 {
        let model = random_model(&mut rng);
        let gains = random_gains(&mut rng, &model);
        let analysis = analyze(&model, &gains);
        if !analysis.stable || compared >= LOOPS {
            continue;
        }
        compared += 1;
        let scale = model.transfer_function().den[0]
            .abs()
            .powf(-1.0 / (model.transfer_function().den.len() - 1) as f64);
        let dense =
            dense_peaks(&OpenLoop::new(&model, &gains), scale * 1e-5, scale * 1e6, model.dead_time_s());
        let found = [analysis.ms, analysis.mt, analysis.jv, analysis.ju];
        for (k, (peak, grid)) in found.iter().zip(dense).enumerate() {
            let Some(peak) = peak else { continue };
            let shortfall = grid / peak - 1.0;
            assert!(
                shortfall < 1e-6,
                "case {case}, {k}: {peak} under the grid's {grid}: {model:?} {gains:?}"
            );
            // The grid itself misses the top of a needle, and a limit at ω → 0 or ∞, by a little.
            let needle = (analysis.ms.unwrap_or(1.0) / 20.0).powi(2).max(1.0);
            assert!(
                shortfall > -3e-3 * needle,
                "case {case}, {k}: {peak} over the grid's {grid}: {model:?} {gains:?}"
            );
        }
    }
    assert!(compared == LOOPS, "{compared}");
}

/// analysis.json: a dense grid, good to 1e-4; its Mt of 0.9999994 is the limit 1 at ω → 0 seen from the first point.
#[test]
fn val_published_loops_agree_with_the_golden_file() {
    let golden: Value = serde_json::from_str(GOLDEN).expect("json");
    for case in golden["cases"].as_array().expect("cases") {
        let number = |group: &str, key: &str| case[group][key].as_f64();
        let model = fopdt(
            number("model", "K").expect("K"),
            number("model", "T_s").expect("T"),
            number("model", "L_s").expect("L"),
        );
        let gains = PidGains {
            kc: number("controller", "Kc").expect("Kc"),
            ti_s: number("controller", "Ti_s").expect("Ti"),
            td_s: number("controller", "Td_s").expect("Td"),
            n: number("controller", "N").unwrap_or(10.0),
        };
        let analysis = serde_json::to_value(analyze(&model, &gains)).expect("json");
        assert_eq!(analysis["stable"], Value::Bool(true));
        let expected = case["expected"].as_object().expect("expected");
        assert_eq!(expected.len(), 8);
        for (key, value) in expected {
            let (found, value) = (analysis[key].as_f64().expect(key), value.as_f64().expect(key));
            assert!((found / value - 1.0).abs() < 1e-4, "{} {key}: {found}, golden {value}", case["case"]);
        }
    }
}

/// spec tune.md section 2: S∞ and Ju of seed 001's three tunings with exact dead time, printed to four digits.
#[test]
fn val_seed_001_tables_3_and_5_with_exact_dead_time() {
    let model = fopdt(0.6335, 8.0, 1.0);
    for (kc, ti, ms, ju) in
        [(0.8, 40.0, 1.0510, 1.5785), (2.6, 17.33, 1.1845, 3.0846), (1.0, 9.09, 1.0718, 1.5785)]
    {
        let analysis = analyze(&model, &PidGains::pi(kc, ti));
        assert!((analysis.ms.expect("Ms") - ms).abs() < 5e-5);
        assert!((analysis.ju.expect("Ju") - ju).abs() < 5e-5);
        assert!((analysis.jv.expect("Jv") - ti / kc).abs() < 1e-9 * ti);
    }
}

/// Skogestad, J. Process Control 13, 2003, table 1: SIMC with τc = θ has Ms 1.59, GM 3.14, PM 61.4°, Mt 1.00 and a
/// delay margin of 2.14 θ on a first-order process; 1.70, 2.96, 46.9°, 1.30 and 1.59 θ on an integrating one.
#[expect(clippy::approx_constant, reason = "a printed gain margin that happens to be 3.14")]
#[test]
fn val_skogestad_2003_table_1() {
    let first_order = analyze(&fopdt(1.0, 4.0, 1.0), &PidGains::pi(2.0, 4.0));
    let integrating =
        analyze(&ProcessModel::Ipdt(Ipdt::new(1.0, 1.0).expect("a model")), &PidGains::pi(0.5, 8.0));
    for (found, [ms, gm, pm, mt, delay]) in
        [(first_order, [1.59, 3.14, 61.4, 1.00, 2.14]), (integrating, [1.70, 2.96, 46.9, 1.30, 1.59])]
    {
        assert!((found.ms.expect("Ms") - ms).abs() < 6e-3, "{found:?}");
        assert!((found.gain_margin.expect("GM") - gm).abs() < 6e-3, "{found:?}");
        assert!((found.phase_margin_deg.expect("PM") - pm).abs() < 6e-2, "{found:?}");
        assert!((found.mt.expect("Mt") - mt).abs() < 6e-3, "{found:?}");
        assert!((found.delay_margin_s.expect("DM") - delay).abs() < 6e-3, "{found:?}");
    }
}

/// Stability verdicts that a careless criterion gets wrong.
#[test]
fn stability_is_right_at_the_corners() {
    let stable = |m: &ProcessModel, g: PidGains| is_closed_loop_stable(m, &g);
    let lag = fopdt(2.0, 10.0, 0.0);
    assert!(stable(&lag, PidGains::p(1e9)), "a lag without dead time stands any gain");
    assert!(stable(&lag, PidGains::pi(1e9, 1e-3)));
    assert!(!stable(&lag, PidGains::p(-1.0)), "positive feedback above 1/K");
    assert!(stable(&lag, PidGains::p(-0.4)), "positive feedback under 1/K");
    assert!(!stable(&lag, PidGains::pi(-0.4, 10.0)));
    let late = fopdt(2.0, 10.0, 1.0);
    assert!(!stable(&late, PidGains::p(1e12)));
    assert!(!stable(&late, PidGains::pi(1e3, 1.0)));
    assert!(stable(&fopdt(-2.0, 10.0, 1.0), PidGains::pi(-1.0, 10.0)));
    assert!(!stable(&fopdt(-2.0, 10.0, 1.0), PidGains::pi(1.0, 10.0)));
    let tank = ProcessModel::Ipdt(Ipdt::new(0.1, 0.0).expect("a model"));
    assert!(stable(&tank, PidGains::p(1.0)) && stable(&tank, PidGains::pi(1.0, 1e-3)));
    assert!(!stable(&tank, PidGains::pi(-1.0, 10.0)));
    let late_tank = ProcessModel::Ipdt(Ipdt::new(0.1, 2.0).expect("a model"));
    let ultimate = std::f64::consts::PI / (2.0 * 0.1 * 2.0);
    assert!(stable(&late_tank, PidGains::p(0.9999 * ultimate)));
    assert!(!stable(&late_tank, PidGains::p(1.0001 * ultimate)));
    // 1/(s − 1) with dead time 0.5 wants 1 < Kc < Ku.
    let unstable = ProcessModel::rational(&[1.0], &[1.0, -1.0], 0.5).expect("a model");
    assert!(!stable(&unstable, PidGains::p(0.99)) && stable(&unstable, PidGains::p(1.01)));
    assert!(stable(&unstable, PidGains::p(2.0)) && !stable(&unstable, PidGains::p(4.0)));
    // An undamped oscillator needs derivative action, and not too late.
    let oscillator = ProcessModel::rational(&[1.0], &[1.0, 0.0, 1.0], 0.0).expect("a model");
    let pd = PidGains { ti_s: f64::INFINITY, ..PidGains::pid(1.0, 1.0, 0.5) };
    assert!(!stable(&oscillator, PidGains::p(1.0)) && stable(&oscillator, pd));
    // A double integrator with PD, and the same late.
    let double = ProcessModel::rational(&[1.0], &[1.0, 0.0, 0.0], 0.0).expect("a model");
    assert!(stable(&double, pd) && !stable(&double, PidGains::p(1.0)));
    // Zero and pole at the origin cancel in L but not in the loop.
    let washout = ProcessModel::rational(&[1.0, 0.0], &[1.0, 1.0], 0.0).expect("a model");
    assert!(!stable(&washout, PidGains::pi(1.0, 1.0)) && stable(&washout, PidGains::p(1.0)));
    // As many zeros as poles: with dead time |L(∞)| ≥ 1 is unstable however small the delay.
    let proper = |delay| ProcessModel::rational(&[1.0, 2.0], &[1.0, 1.0], delay).expect("a model");
    assert!(stable(&proper(0.0), PidGains::p(3.0)) && !stable(&proper(1e-6), PidGains::p(3.0)));
    assert!(stable(&proper(0.1), PidGains::p(0.4)));
    assert!(!stable(&lag, PidGains::p(f64::NAN)));
    assert!(stable(&lag, PidGains { kc: 0.0, ..PidGains::pi(1.0, 1.0) }));
}

#[test]
fn what_is_infinite_or_missing_is_none() {
    let lag = analyze(&fopdt(2.0, 10.0, 1.0), &PidGains::p(0.2));
    assert!(lag.stable && lag.jv.is_none() && lag.w_gc_rad_s.is_none() && lag.delay_margin_s.is_none());
    assert!(lag.gain_margin.is_some());
    let free = analyze(&fopdt(2.0, 10.0, 0.0), &PidGains::pi(3.0, 10.0));
    assert_eq!((free.gain_margin, free.w_180_rad_s), (None, None));
    assert!((free.ms.expect("Ms") - 1.0).abs() < 1e-12 && (free.mt.expect("Mt") - 1.0).abs() < 1e-12);
    let unstable = analyze(&fopdt(2.0, 10.0, 1.0), &PidGains::p(1e3));
    assert_eq!(unstable, vasos_engine::analyze::Analysis::default());
    let filtered = analyze(&fopdt(1.0, 10.0, 0.0), &PidGains { n: 8.0, ..PidGains::pid(2.0, 10.0, 1.0) });
    assert!(filtered.ju.expect("Ju") >= 2.0 * 9.0);
}

/// With e^(−Ls)/s, P and gain k: L(jω) = k e^(−jωL)/(jω), so w_gc = k, PM = 90° − kL, w_180 = π/(2L), GM = π/(2kL).
#[test]
fn margins_agree_with_the_closed_form_of_an_integrator() {
    let (k, delay) = (0.4, 1.5);
    let analysis = analyze(&ProcessModel::Ipdt(Ipdt::new(1.0, delay).expect("a model")), &PidGains::p(k));
    let half_pi = std::f64::consts::FRAC_PI_2;
    for (found, expected) in [
        (analysis.w_gc_rad_s, k),
        (analysis.phase_margin_deg, (half_pi - k * delay).to_degrees()),
        (analysis.delay_margin_s, (half_pi - k * delay) / k),
        (analysis.w_180_rad_s, half_pi / delay),
        (analysis.gain_margin, half_pi / (k * delay)),
    ] {
        assert!((found.expect("a margin") / expected - 1.0).abs() < 1e-10, "{found:?} for {expected}");
    }
}

#[test]
fn margins_are_where_stability_flips() {
    let mut rng = StdRng::seed_from_u64(77);
    let (mut up, mut down, mut late) = (0, 0, 0);
    for case in 0..1500 {
        let model = random_model(&mut rng);
        let gains = random_gains(&mut rng, &model);
        let analysis = analyze(&model, &gains);
        if !analysis.stable {
            continue;
        }
        let scaled =
            |factor: f64| is_closed_loop_stable(&model, &PidGains { kc: gains.kc * factor, ..gains });
        if let Some(margin) = analysis.gain_margin.filter(|m| *m > 1.001) {
            assert!(
                scaled(margin * (1.0 - 1e-6)) && !scaled(margin * (1.0 + 1e-6)),
                "{case}: {model:?} {gains:?}"
            );
            up += 1;
        } else if analysis.gain_margin.is_none() {
            assert!(scaled(1e3) && scaled(1e6), "{case}: {model:?} {gains:?}");
        }
        if let Some(margin) = analysis.gain_reduction_margin.filter(|m| *m < 0.999) {
            assert!(
                scaled(margin * (1.0 + 1e-6)) && !scaled(margin * (1.0 - 1e-6)),
                "{case}: {model:?} {gains:?}"
            );
            down += 1;
        }
        if let Some(delay) = analysis.delay_margin_s.filter(|d| *d > 0.0) {
            let tf = model.transfer_function();
            let delayed = |d: f64| {
                let model = ProcessModel::rational(&tf.num, &tf.den, tf.dead_time_s + d).expect("a model");
                is_closed_loop_stable(&model, &gains)
            };
            assert!(
                delayed(delay * (1.0 - 1e-6)) && !delayed(delay * (1.0 + 1e-6)),
                "{case}: {model:?} {gains:?}"
            );
            late += 1;
        }
    }
    assert!(up > 300 && down > 30 && late > 300, "{up} {down} {late}");
}

/// Two independent routes: the winding of the characteristic function and the simulated response.
#[test]
fn the_nyquist_verdict_agrees_with_the_simulated_loop() {
    let mut rng = StdRng::seed_from_u64(4);
    let (mut stable, mut unstable) = (0, 0);
    while stable + unstable < 200 {
        let model = random_model(&mut rng);
        let gains = random_gains(&mut rng, &model);
        let open = OpenLoop::new(&model, &gains);
        let near_marginal =
            [0.93, 1.0, 1.07].map(|f| is_closed_loop_stable(&model, &PidGains { kc: gains.kc * f, ..gains }));
        if near_marginal.iter().any(|s| *s != near_marginal[1]) {
            continue;
        }
        // The same long horizon for both verdicts: the simulation is not told which one it belongs to.
        let integral = if gains.ti_s.is_finite() { gains.ti_s } else { 0.0 };
        let slow =
            60.0 * (1.0 / crossing(&open)).max(model.dead_time_s()).max(integral).max(time_scale(&model));
        let options = ResponseOptions { horizon_s: Some(slow), ..ResponseOptions::default() };
        let response = step_response(&model, &gains, Excitation::Load, &options);
        let bounded = is_bounded(&response);
        assert_eq!(bounded, near_marginal[1], "{model:?} {gains:?}");
        if bounded { stable += 1 } else { unstable += 1 }
    }
    assert!(stable > 50 && unstable > 20, "{stable} {unstable}");
}

/// A frequency at which |L| falls through 1, or the middle of the grid.
fn crossing(open: &OpenLoop) -> f64 {
    (-80..80)
        .map(|i| 10f64.powf(f64::from(i) / 20.0))
        .rev()
        .find(|w| open.at_omega(*w).norm() > 1.0)
        .unwrap_or(1.0)
}

/// The last third of the run does not swing wider than the middle third.
fn is_bounded(response: &Response) -> bool {
    if response.end == ResponseEnd::Diverged {
        return false;
    }
    let n = response.y.len();
    let spread = |part: &[f64]| {
        let (low, high) = part.iter().fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(*v), b.max(*v)));
        high - low
    };
    let (middle, last) = (spread(&response.y[n / 3..2 * n / 3]), spread(&response.y[2 * n / 3..]));
    last <= middle * 1.01 + 1e-9
}
