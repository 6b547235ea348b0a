//! How often the intervals of a fit hold the truth: every structure and every kind of record, over fixed seeds.
//!
//! An honest 95 % interval misses once in twenty. Over 300 seeds the count of hits is binomial with mean 285 and
//! sd 3.77: four sd either side are 270 to 300. Over 2,000 seeds, in release, the specification's 93–97 %.

mod records;

use rand::SeedableRng;
use rand::rngs::StdRng;
use vasos_engine::identify::{Disturbance, Drift, FitProblem, ModelFit, Structure, fit_model};

use records::{Truth, moves, noise, share_of};

const FEW: (u64, std::ops::RangeInclusive<u64>) = (300, 270..=300);
const MANY: (u64, std::ops::RangeInclusive<u64>) = (2000, 1860..=1940);

/// A record without noise, and what a fit of it must hold.
struct Experiment {
    structure: Structure,
    drift: Drift,
    time_s: Vec<f64>,
    mv: Vec<f64>,
    disturbance: Option<Vec<f64>>,
    clean: Vec<f64>,
    /// Parameters of the main channel, then those of the disturbance.
    expected: Vec<(&'static str, f64)>,
    drift_per_s: Option<f64>,
    /// Share of the output's variance that the noise has, and the correlation of its neighbours.
    noise: (f64, f64),
}

impl Experiment {
    fn of(structure: Structure, truth: &Truth, time_s: Vec<f64>, mv: Vec<f64>) -> Self {
        let clean = truth.run(&time_s, &mv, mv[0]);
        let expected = truth.expected().into_iter().map(|(name, value, _)| (name, value)).collect();
        let (disturbance, drift_per_s) = (None, None);
        Self {
            structure,
            drift: Drift::None,
            time_s,
            mv,
            disturbance,
            clean,
            expected,
            drift_per_s,
            noise: (0.01, 0.0),
        }
    }

    fn fit(&self, seed: u64) -> ModelFit {
        let mut rng = StdRng::seed_from_u64(seed);
        let (share, rho) = self.noise;
        let sd = share_of(&self.clean, share);
        let noise = noise(&mut rng, self.clean.len(), rho);
        let pv: Vec<f64> = self.clean.iter().zip(noise).map(|(y, e)| y + sd * e).collect();
        let mut problem = FitProblem::new(&self.time_s, &pv, &self.mv);
        problem.options.drift = self.drift;
        if let Some(values) = &self.disturbance {
            problem.disturbances = vec![Disturbance { name: "feed".to_owned(), values }];
        }
        fit_model(&problem, self.structure).expect("a fit")
    }

    /// For each parameter, how many of the seeds' intervals hold it.
    fn held(&self, seeds: u64) -> Vec<(String, u64)> {
        let expected: Vec<(&str, f64)> =
            self.expected.iter().copied().chain(self.drift_per_s.map(|d| ("drift", d))).collect();
        let mut held: Vec<(String, u64)> = expected.iter().map(|(name, _)| ((*name).to_owned(), 0)).collect();
        for seed in 0..seeds {
            let fit = self.fit(seed);
            for ((_, count), value) in held.iter_mut().zip(self.holds(&fit, &expected)) {
                *count += u64::from(value);
            }
        }
        held
    }

    /// For each expected parameter, whether the interval of a fit holds it.
    fn holds(&self, fit: &ModelFit, expected: &[(&str, f64)]) -> Vec<bool> {
        let others = fit.disturbances.iter().flat_map(|d| &d.parameters);
        let parameters = fit.parameters.iter().chain(others).map(|p| (p.name, p.interval_95));
        let mut found: Vec<(&str, [f64; 2])> =
            parameters.chain(fit.drift.map(|(_, interval)| ("drift", interval))).collect();
        let mut holds = |&(name, value): &(&str, f64)| {
            let at = found.iter().position(|(of, _)| *of == name).unwrap_or_else(|| panic!("no {name}"));
            let [low, high] = found.remove(at).1;
            low <= value && value <= high
        };
        // Near the border between the two, noise makes of an overdamped process an underdamped one: then the same
        // truth is told by tau and zeta, which stand in for T and T2.
        if fit.parameter("zeta").is_some()
            && let Some(at) = expected.iter().position(|(name, _)| *name == "T2_s")
        {
            let (slow, quick) = (expected[at - 1].1, expected[at].1);
            let tau = (slow * quick).sqrt();
            let mut told = expected.to_vec();
            told[at - 1].1 = tau;
            told[at] = ("zeta", 0.5 * (slow + quick) / tau);
            return told.iter().map(&mut holds).collect();
        }
        expected.iter().map(&mut holds).collect()
    }
}

fn seconds(rows: u32, h: f64) -> Vec<f64> {
    (0..rows).map(|k| h * f64::from(k)).collect()
}

fn three_moves(time_s: &[f64]) -> Vec<f64> {
    let span = time_s[time_s.len() - 1];
    moves(time_s, &[(0.08 * span, 4.0), (0.4 * span, 2.5), (0.7 * span, 3.7)], 3.0)
}

fn overdamped() -> Experiment {
    let time_s = seconds(500, 1.0);
    let mv = three_moves(&time_s);
    // T1 = 24, T2 = 6.
    let truth = Truth::Second { k: 2.0, tau: 12.0, zeta: 1.25, tz: 0.0, l: 7.3 };
    Experiment::of(Structure::Sopdt, &truth, time_s, mv)
}

fn near_critical() -> Experiment {
    let time_s = seconds(500, 1.0);
    let mv = three_moves(&time_s);
    let truth = Truth::Second { k: 2.0, tau: 12.0, zeta: 1.02, tz: 0.0, l: 7.3 };
    Experiment::of(Structure::Sopdt, &truth, time_s, mv)
}

fn underdamped() -> Experiment {
    let time_s = seconds(500, 1.0);
    let mv = three_moves(&time_s);
    let truth = Truth::Second { k: -1.2, tau: 10.0, zeta: 0.5, tz: 0.0, l: 4.6 };
    Experiment::of(Structure::Sopdt, &truth, time_s, mv)
}

fn with_zero() -> Experiment {
    let time_s = seconds(600, 1.0);
    let mv = three_moves(&time_s);
    let truth = Truth::Second { k: 2.0, tau: 12.0, zeta: 1.25, tz: -15.0, l: 5.4 };
    Experiment::of(Structure::SopdtZero, &truth, time_s, mv)
}

fn integrating() -> Experiment {
    let time_s = seconds(400, 1.0);
    let mv = moves(&time_s, &[(30.0, 4.0), (110.0, 2.0), (220.0, 3.6), (330.0, 2.5)], 3.0);
    Experiment::of(Structure::Ipdt, &Truth::Integrator { kv: 0.02, l: 6.3 }, time_s, mv)
}

fn drifting() -> Experiment {
    let time_s = seconds(400, 1.0);
    let mv = three_moves(&time_s);
    let mut out = Experiment::of(Structure::Fopdt, &Truth::First { k: 2.0, t: 15.0, l: 5.3 }, time_s, mv);
    let drift = 0.004;
    out.clean.iter_mut().zip(&out.time_s).for_each(|(y, t)| *y += drift * t);
    (out.drift, out.drift_per_s) = (Drift::Linear, Some(drift));
    out
}

fn disturbed() -> Experiment {
    let time_s = seconds(500, 1.0);
    let mv = three_moves(&time_s);
    let feed = moves(&time_s, &[(90.0, 12.0), (170.0, 7.0), (280.0, 11.0), (420.0, 9.0)], 10.0);
    let other = Truth::First { k: -0.5, t: 30.0, l: 9.2 };
    let more = other.run(&time_s, &feed, 10.0);
    let mut out = Experiment::of(Structure::Fopdt, &Truth::First { k: 2.0, t: 15.0, l: 5.3 }, time_s, mv);
    out.clean.iter_mut().zip(more).for_each(|(y, more)| *y += more);
    out.disturbance = Some(feed);
    out.expected.extend(other.expected().into_iter().map(|(name, value, _)| (name, value)));
    out
}

fn uneven() -> Experiment {
    use rand::RngExt;
    let mut rng = StdRng::seed_from_u64(4711);
    let mut now = 0.0;
    let time_s: Vec<f64> = (0..400)
        .map(|_| {
            now += 0.6 + 0.8 * rng.random::<f64>();
            now
        })
        .collect();
    let mv = three_moves(&time_s);
    Experiment::of(Structure::Fopdt, &Truth::First { k: 2.0, t: 15.0, l: 5.3 }, time_s, mv)
}

/// Rows a third of T apart: the cost has kinks in L that noise does not blur.
fn coarse() -> Experiment {
    let time_s = seconds(240, 5.0);
    let mv = moves(&time_s, &[(100.0, 4.0), (450.0, 2.5), (800.0, 3.7)], 3.0);
    Experiment::of(Structure::Fopdt, &Truth::First { k: 2.0, t: 15.0, l: 8.0 }, time_s, mv)
}

fn coarse_second() -> Experiment {
    let time_s = seconds(240, 5.0);
    let mv = moves(&time_s, &[(100.0, 4.0), (450.0, 2.5), (800.0, 3.7)], 3.0);
    let truth = Truth::Second { k: 2.0, tau: 12.0, zeta: 0.6, tz: 0.0, l: 8.0 };
    Experiment::of(Structure::Sopdt, &truth, time_s, mv)
}

fn coloured(structure: Structure) -> Experiment {
    let time_s = seconds(800, 1.0);
    let mv = three_moves(&time_s);
    let truth = match structure {
        Structure::Fopdt => Truth::First { k: 2.0, t: 15.0, l: 5.3 },
        _ => Truth::Second { k: 2.0, tau: 12.0, zeta: 0.7, tz: 0.0, l: 7.3 },
    };
    Experiment { noise: (0.01, 0.8), ..Experiment::of(structure, &truth, time_s, mv) }
}

fn check(what: &str, found: &[(String, u64)], seeds: u64, wanted: &std::ops::RangeInclusive<u64>) {
    let percent = |n: &u64| format!("{:.1}", 100.0 * *n as f64 / seeds as f64);
    let line: Vec<String> = found.iter().map(|(name, n)| format!("{name} {}", percent(n))).collect();
    println!("{what}: {}", line.join(", "));
    let wrong: Vec<_> = found.iter().filter(|(_, n)| !wanted.contains(n)).collect();
    assert!(wrong.is_empty(), "{what}: {wrong:?} of {seeds}, wanted {wanted:?}");
}

macro_rules! coverage {
    ($($name:ident, $over_2000:ident, $what:literal, $experiment:expr;)+) => {$(
        #[test]
        fn $name() {
            check($what, &$experiment.held(FEW.0), FEW.0, &FEW.1);
        }

        #[test]
        #[ignore = "release only: cargo test --release -p vasos-engine --test val_coverage -- --ignored"]
        fn $over_2000() {
            check($what, &$experiment.held(MANY.0), MANY.0, &MANY.1);
        }
    )+};
}

coverage! {
    val_sopdt, val_sopdt_over_2000, "SOPDT", overdamped();
    val_sopdt_near_critical, val_sopdt_near_critical_over_2000, "SOPDT, zeta 1.02", near_critical();
    val_underdamped, val_underdamped_over_2000, "SOPDT, zeta 0.5", underdamped();
    val_zero, val_zero_over_2000, "SOPDT with zero", with_zero();
    val_ipdt, val_ipdt_over_2000, "IPDT", integrating();
    val_drift, val_drift_over_2000, "FOPDT with drift", drifting();
    val_disturbance, val_disturbance_over_2000, "FOPDT with a disturbance", disturbed();
    val_uneven, val_uneven_over_2000, "FOPDT, uneven stamps", uneven();
    val_coarse, val_coarse_over_2000, "FOPDT, coarse rows", coarse();
    val_coarse_second, val_coarse_second_over_2000, "SOPDT, coarse rows", coarse_second();
}

/// A FOPDT process under PI with a square wave on the setpoint; the controller sees the noise it is recorded with.
fn closed_loop(seed: u64) -> ModelFit {
    let mut rng = StdRng::seed_from_u64(seed);
    let e = noise(&mut rng, 800, 0.0);
    // L of 5.3 rows: over a row the process sees 0.3 of the value six rows back, then that of five back.
    let (k, t, whole, part) = (2.0, 15.0, 5, 0.3);
    let a = f64::exp(-1.0 / t);
    let first = (1.0 - f64::exp(-part / t)) * f64::exp(-(1.0 - part) / t);
    let second = 1.0 - f64::exp(-(1.0 - part) / t);
    let (mut y, mut u, mut last) = (0.0, 0.0, 0.0);
    let (mut pv, mut mv) = (vec![], vec![]);
    for row in 0..800 {
        let measured = y + 0.1 * e[row];
        let sp = if (row / 80) % 2 == 1 { 2.0 } else { 0.0 };
        let error = sp - measured;
        u += 0.6 * ((error - last) + error / 15.0);
        last = error;
        pv.push(measured);
        mv.push(u);
        let back = |rows: usize| if row >= rows { mv[row - rows] } else { 0.0 };
        y = a * y + k * (first * back(whole + 1) + second * back(whole));
    }
    let time_s = seconds(800, 1.0);
    fit_model(&FitProblem::new(&time_s, &pv, &mv), Structure::Fopdt).expect("a fit")
}

fn closed_loop_held(seeds: u64) -> Vec<(String, u64)> {
    let mut held = [("K", 2.0, 0), ("T_s", 15.0, 0), ("L_s", 5.3, 0)];
    for seed in 0..seeds {
        let fit = closed_loop(seed);
        for (name, value, count) in &mut held {
            let [low, high] = fit.parameter(name).expect("a parameter").interval_95;
            *count += u64::from((low..=high).contains(value));
        }
    }
    held.map(|(name, _, count)| (name.to_owned(), count)).to_vec()
}

#[test]
fn val_closed_loop() {
    check("FOPDT in a loop", &closed_loop_held(FEW.0), FEW.0, &FEW.1);
}

#[test]
#[ignore = "release only: cargo test --release -p vasos-engine --test val_coverage -- --ignored"]
fn val_closed_loop_over_2000() {
    check("FOPDT in a loop", &closed_loop_held(MANY.0), MANY.0, &MANY.1);
}

/// First-order noise, ρ = 0.8: rows that repeat each other count less, and the intervals hold the truth at least nine times in ten.
#[test]
fn val_coloured_noise() {
    for structure in [Structure::Fopdt, Structure::Sopdt] {
        // 90 % over 300 seeds: four sd of 5.2 below 270.
        check("AR(1)", &coloured(structure).held(300), 300, &(249..=300));
    }
}

#[test]
#[ignore = "release only: cargo test --release -p vasos-engine --test val_coverage -- --ignored"]
fn val_coloured_noise_over_2000() {
    for structure in [Structure::Fopdt, Structure::Sopdt] {
        check("AR(1)", &coloured(structure).held(2000), 2000, &(1800..=2000));
    }
}
