//! MVs logged ahead of their limits, made with a known truth: tight loops, several processes, seeds and limits.

use rand::SeedableRng;
use rand::rngs::StdRng;
use rand_distr::{Distribution, StandardNormal};
use vasos_engine::identify::{
    Disturbance, Drift, FitProblem, LoopRecord, LoopStudy, RecordFinding, StudyOptions, study_loop,
};

/// A first order under PI whose wish is logged while the valve keeps to its limits; sampled at 1 s.
#[derive(Debug, Clone, Copy)]
struct Tight {
    gain: f64,
    time_constant_s: f64,
    dead_time_s: usize,
    kc: f64,
    ti_s: f64,
    /// Height of the setpoint's square wave and its half period in rows.
    square: (f64, usize),
    limits: [f64; 2],
    noise: f64,
    rows: usize,
}

impl Default for Tight {
    fn default() -> Self {
        Self {
            gain: 2.0,
            time_constant_s: 40.0,
            dead_time_s: 5,
            kc: 3.0,
            ti_s: 40.0,
            square: (12.0, 200),
            limits: [35.0, 49.0],
            noise: 0.1,
            rows: 2000,
        }
    }
}

struct Record {
    time_s: Vec<f64>,
    pv: Vec<f64>,
    mv: Vec<f64>,
    sp: Vec<f64>,
}

impl Tight {
    /// The MV rests at 40 with the PV at 0.
    fn run(&self, seed: u64) -> Record {
        self.run_with(seed, &vec![0.0; self.rows])
    }

    /// With a disturbance that the PV answers by a first order of gain 1.5 and 25 s.
    fn run_with(&self, seed: u64, load: &[f64]) -> Record {
        let mut rng = StdRng::seed_from_u64(seed);
        let a = f64::exp(-1.0 / self.time_constant_s);
        let mut out = Record { time_s: vec![], pv: vec![], mv: vec![], sp: vec![] };
        let (mut y, mut integral, mut answer) = (0.0, 0.0, 0.0);
        let mut valve = vec![40.0; self.dead_time_s + 1];
        for (k, load) in load.iter().enumerate() {
            let normal: f64 = StandardNormal.sample(&mut rng);
            let pv = y + answer + self.noise * normal;
            let sp = if (k / self.square.1) % 2 == 1 { self.square.0 } else { 0.0 };
            let e = sp - pv;
            let wish = 40.0 + self.kc * (e + integral / self.ti_s);
            let got = wish.clamp(self.limits[0], self.limits[1]);
            // Clamped integral: the sum stands still while the wish drives further out.
            if wish == got || (wish - got) * e < 0.0 {
                integral += e;
            }
            valve.push(got);
            let delayed = valve[valve.len() - 1 - self.dead_time_s];
            y = a * y + (1.0 - a) * self.gain * (delayed - 40.0);
            answer += -f64::exp_m1(-1.0 / 25.0) * (1.5 * load - answer);
            out.time_s.push(k as f64);
            out.pv.push(pv);
            out.mv.push(wish);
            out.sp.push(sp);
        }
        out
    }
}

/// Levels held for a while each.
fn moving(rows: usize, seed: u64) -> Vec<f64> {
    let mut rng = StdRng::seed_from_u64(seed + 1000);
    let mut level = 0.0;
    (0..rows)
        .map(|k| {
            if k % 90 == 0 {
                level = 2.0 * {
                    let normal: f64 = StandardNormal.sample(&mut rng);
                    normal
                };
            }
            level
        })
        .collect()
}

fn study_beside(r: &Record, load: &[f64], sp: bool) -> LoopStudy {
    let mut problem = FitProblem::new(&r.time_s, &r.pv, &r.mv);
    problem.disturbances = vec![Disturbance { name: "feed".to_owned(), values: load }];
    let record = LoopRecord { problem, sp: sp.then_some(&r.sp), mode: None };
    study_loop(&record, &StudyOptions::default()).expect("a study")
}

fn study(r: &Record, sp: bool) -> LoopStudy {
    let mut problem = FitProblem::new(&r.time_s, &r.pv, &r.mv);
    problem.options.drift = Drift::Auto;
    let record = LoopRecord { problem, sp: sp.then_some(&r.sp[..]), mode: None };
    study_loop(&record, &StudyOptions::default()).expect("a study")
}

fn limits_of(found: &LoopStudy) -> Option<[f64; 2]> {
    found.findings.iter().find_map(|f| match f {
        RecordFinding::MvBeyondLimits { limits, .. } => Some(*limits),
        _ => None,
    })
}

/// Truths in which the limits are reached in every move of the setpoint.
fn truths() -> Vec<Tight> {
    let base = Tight::default();
    vec![
        base,
        Tight { kc: 4.0, square: (10.0, 200), limits: [34.0, 50.0], ..base },
        Tight { kc: 5.0, square: (8.0, 150), limits: [36.0, 47.0], ..base },
        Tight {
            gain: 0.5,
            time_constant_s: 60.0,
            dead_time_s: 8,
            kc: 8.0,
            ti_s: 60.0,
            square: (4.0, 250),
            limits: [30.0, 52.0],
            noise: 0.02,
            rows: 3000,
        },
        Tight {
            gain: 5.0,
            time_constant_s: 25.0,
            dead_time_s: 3,
            kc: 1.0,
            ti_s: 25.0,
            square: (20.0, 120),
            limits: [38.0, 46.0],
            noise: 0.2,
            rows: 1500,
        },
        Tight { limits: [0.0, 48.0], ..base },
    ]
}

/// The search settled in a valley of limits too narrow with a T too short and a narrow interval: K = 2, T = 40 s with limits
/// 35 and 49 gave T = 134 s behind 37.1 and 47.4, and limits of 34 and 50 were not seen in four records of six.
#[test]
fn val_limits_of_a_tight_loop_are_found_with_the_process() {
    let (mut held, mut all) = (0, 0);
    for truth in truths() {
        for seed in 1..=6 {
            let found = study(&truth.run(seed), true);
            let limits = limits_of(&found).unwrap_or_else(|| panic!("no limits for {truth:?}, seed {seed}"));
            let width = truth.limits[1] - truth.limits[0];
            for i in 0..2 {
                // A limit that few rows pass may stay unknown; then those rows lie at the end of the record's range.
                let idle = truth.limits[i] < 10.0;
                let off = (limits[i] - truth.limits[i]).abs();
                assert!(off < 0.03 * width || idle, "{limits:?} for {truth:?}, seed {seed}");
            }
            let fit = found.choice.as_ref().expect("a model").chosen();
            let true_values =
                [("K", truth.gain), ("T_s", truth.time_constant_s), ("L_s", truth.dead_time_s as f64)];
            for (name, value) in true_values {
                let p = fit.parameter(name).expect("a parameter");
                assert!((p.value / value - 1.0).abs() < 0.04, "{name} = {p:?} for {truth:?}, seed {seed}");
                all += 1;
                held += usize::from(p.interval_95[0] <= value && value <= p.interval_95[1]);
            }
        }
    }
    // 108 intervals of 95 %, those of one record not independent of each other.
    assert!(100 * held >= 90 * all, "{held} of {all} intervals hold the truth");
}

/// Limits taken for known gave T to ±0.4 % where it is known to ±2 %.
#[test]
fn the_uncertainty_of_limits_is_in_the_intervals() {
    let truth = Tight::default();
    let r = truth.run(1);
    let half = |study: &LoopStudy, name: &str| {
        let p =
            study.choice.as_ref().expect("a model").chosen().parameter(name).expect("a parameter").clone();
        0.5 * (p.interval_95[1] - p.interval_95[0])
    };
    let problem = FitProblem::new(&r.time_s, &r.pv, &r.mv);
    let record = LoopRecord { problem, sp: Some(&r.sp), mode: None };
    let told = StudyOptions { mv_limits: Some(truth.limits), ..StudyOptions::default() };
    let told = study_loop(&record, &told).expect("a study");
    let found = study(&r, true);
    assert!(half(&found, "T_s") > 2.0 * half(&told, "T_s"));
    assert!(half(&found, "K") >= half(&told, "K"));
}

/// A valve that sticks under an MV moved by hand as a sine: its staircase looks cut at both ends.
fn sticking(band: f64, period_s: f64, seed: u64) -> Record {
    let mut rng = StdRng::seed_from_u64(seed);
    let a = f64::exp(-1.0_f64 / 20.0);
    let mut out = Record { time_s: vec![], pv: vec![], mv: vec![], sp: vec![] };
    let (mut y, mut valve) = (0.0, 50.0_f64);
    let mut delayed = vec![50.0; 4];
    for k in 0..2400 {
        let normal: f64 = StandardNormal.sample(&mut rng);
        let u = 50.0 + 10.0 * (std::f64::consts::TAU * f64::from(k) / period_s).sin();
        if (u - valve).abs() > band {
            valve = u;
        }
        out.time_s.push(f64::from(k));
        out.pv.push(y + 0.1 * normal);
        out.mv.push(u);
        out.sp.push(0.0);
        delayed.push(valve);
        y = a * y + (1.0 - a) * 1.5 * (delayed[delayed.len() - 4] - 50.0);
    }
    out
}

/// An MV moved as a sine with a staircase in the PV was taken for one logged ahead of limits.
#[test]
fn a_sticking_valve_is_not_taken_for_limits() {
    for (band, period_s) in [(3.0, 400.0), (5.0, 300.0), (6.0, 500.0), (2.0, 200.0), (8.0, 400.0)] {
        for seed in 1..=3 {
            let found = study(&sticking(band, period_s, seed), false);
            assert_eq!(limits_of(&found), None, "band {band}, period {period_s}, seed {seed}");
            let holds = found.findings.iter().find_map(|f| match f {
                RecordFinding::ValveHolds { band } => Some(*band),
                _ => None,
            });
            let holds = holds.unwrap_or_else(|| panic!("nothing for band {band}: {:?}", found.findings));
            assert!((0.5..2.0).contains(&(holds / band)), "{holds} for {band}");
        }
    }
}

/// With a measured disturbance neither limits nor a sticking valve were looked for: K = 2 came out as 1.2 with a narrow
/// interval.
#[test]
fn limits_and_a_sticking_valve_are_found_beside_a_disturbance() {
    for seed in 1..=3 {
        let truth = Tight::default();
        let load = moving(truth.rows, seed);
        let r = truth.run_with(seed, &load);
        let found = study_beside(&r, &load, true);
        let limits =
            limits_of(&found).unwrap_or_else(|| panic!("no limits, seed {seed}: {:?}", found.findings));
        let width = truth.limits[1] - truth.limits[0];
        assert!(
            (0..2).all(|i| (limits[i] - truth.limits[i]).abs() < 0.03 * width),
            "{limits:?}, seed {seed}"
        );
        let fit = found.choice.as_ref().expect("a model").chosen();
        assert!((fit.parameters[0].value / truth.gain - 1.0).abs() < 0.04, "{:?}", fit.parameters);
        let mut r = sticking(6.0, 400.0, seed);
        let load = moving(r.pv.len(), seed + 10);
        let mut answer = 0.0;
        for (y, d) in r.pv.iter_mut().zip(&load) {
            *y += answer;
            answer += 0.05 * (1.5 * d - answer);
        }
        let found = study_beside(&r, &load, false);
        assert_eq!(limits_of(&found), None, "seed {seed}");
        let holds = found.findings.iter().any(|f| matches!(f, RecordFinding::ValveHolds { .. }));
        assert!(holds, "seed {seed}: {:?}", found.findings);
    }
}

/// A first order behind a curve of the MV, moved in steps of many levels.
fn behind_a_curve(curve: &dyn Fn(f64) -> f64, seed: u64) -> Record {
    let mut rng = StdRng::seed_from_u64(seed);
    let mut out = Record { time_s: vec![], pv: vec![], mv: vec![], sp: vec![] };
    let (mut y, mut u) = (0.0, 50.0);
    let mut delayed = vec![50.0; 4];
    for k in 0..2400 {
        let (a, b): (f64, f64) = (StandardNormal.sample(&mut rng), StandardNormal.sample(&mut rng));
        if k % 45 == 0 {
            u = (50.0 + 18.0 * b).clamp(5.0, 95.0);
        }
        out.time_s.push(f64::from(k));
        out.pv.push(y + 0.1 * a);
        out.mv.push(u);
        out.sp.push(0.0);
        delayed.push(u);
        y += 0.05 * (curve(delayed[delayed.len() - 4]) - y);
    }
    out
}

type Curve = (&'static str, Box<dyn Fn(f64) -> f64>);

/// A gain that falls at some level of the MV was stated as a limit that the MV was logged ahead of.
#[test]
fn a_gain_that_changes_with_the_mv_is_no_limit() {
    let knee = |to: f64| move |u: f64| if u < 50.0 { 2.0 * (u - 50.0) } else { 2.0 * to * (u - 50.0) };
    let root = |u: f64| 20.0 * (u / 10.0).sqrt();
    let curves: [Curve; 5] = [
        ("to a half", Box::new(knee(0.5))),
        ("to a quarter", Box::new(knee(0.25))),
        ("to a third", Box::new(knee(0.33))),
        ("threefold", Box::new(knee(3.0))),
        ("root", Box::new(root)),
    ];
    let mut said = 0;
    for (name, curve) in &curves {
        for seed in 1..=3 {
            let found = study(&behind_a_curve(curve, seed), false);
            assert_eq!(limits_of(&found), None, "{name}, seed {seed}: {:?}", found.findings);
            let changes = |f: &RecordFinding| matches!(f, RecordFinding::GainChanges { .. });
            said += usize::from(found.findings.iter().any(changes));
        }
    }
    assert!(said >= 6, "said of {said} records of 15");
    for seed in 1..=3 {
        let found = study(&behind_a_curve(&|u| 2.0 * (u.min(55.0) - 50.0), seed), false);
        let limits =
            limits_of(&found).unwrap_or_else(|| panic!("no limits, seed {seed}: {:?}", found.findings));
        assert!((limits[1] - 55.0).abs() < 1.0, "{limits:?}, seed {seed}");
    }
}

/// A limit that the user gave was stated as found, and a limit on the other side was not looked for.
#[test]
fn a_limit_that_was_given_is_no_finding_and_the_other_side_is_looked_at() {
    let truth = Tight::default();
    let r = truth.run(1);
    let problem = FitProblem::new(&r.time_s, &r.pv, &r.mv);
    let record = LoopRecord { problem, sp: Some(&r.sp), mode: None };
    for given in [truth.limits, [f64::NEG_INFINITY, truth.limits[1]]] {
        let options = StudyOptions { mv_limits: Some(given), ..StudyOptions::default() };
        let found = study_loop(&record, &options).expect("a study");
        let told = found.findings.iter().any(|f| matches!(f, RecordFinding::MvLimitsGiven { .. }));
        assert!(told, "{:?}", found.findings);
        let seen = limits_of(&found);
        if given == truth.limits {
            assert_eq!(seen, None);
        } else {
            let [low, high] = seen.unwrap_or_else(|| panic!("{:?}", found.findings));
            assert!((low - truth.limits[0]).abs() < 0.5 && high == truth.limits[1], "{low} {high}");
        }
        let gain = found.choice.as_ref().expect("a model").chosen().parameters[0].value;
        assert!((gain / truth.gain - 1.0).abs() < 0.03, "K {gain}");
    }
}
