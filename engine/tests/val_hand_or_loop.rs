//! Who moves the MV, a hand or a controller? Records of known truth on both sides of the line.

use rand::SeedableRng;
use rand::rngs::StdRng;
use rand_distr::{Distribution, StandardNormal};
use vasos_engine::identify::{
    Drift, FitProblem, FitVerdict, LoopRecord, LoopStudy, RecordFinding, StudyOptions, study_loop,
};

struct Record {
    time_s: Vec<f64>,
    pv: Vec<f64>,
    mv: Vec<f64>,
    sp: Vec<f64>,
}

/// A first order sampled at 1 s.
#[derive(Debug, Clone, Copy)]
struct Process {
    gain: f64,
    t_s: f64,
    dead_time: usize,
    noise: f64,
    rows: usize,
}

/// A PI and the limits of its output.
#[derive(Debug, Clone, Copy)]
struct Pi {
    kc: f64,
    ti_s: f64,
    limits: [f64; 2],
}

impl Process {
    fn run(&self, seed: u64, load: impl Fn(f64) -> f64, mut mv: impl FnMut(usize, f64) -> f64) -> Record {
        let mut rng = StdRng::seed_from_u64(seed);
        let a = f64::exp(-1.0 / self.t_s);
        let mut out = Record { time_s: vec![], pv: vec![], mv: vec![], sp: vec![] };
        let mut y = 0.0;
        for k in 0..self.rows {
            let normal: f64 = StandardNormal.sample(&mut rng);
            let pv = 20.0 + y + load(k as f64) + self.noise * normal;
            out.time_s.push(k as f64);
            out.pv.push(pv);
            out.mv.push(mv(k, pv));
            out.sp.push(20.0);
            let delayed = out.mv[k.saturating_sub(self.dead_time)] - out.mv[0];
            y = a * y + (1.0 - a) * self.gain * delayed;
        }
        out
    }

    fn by_hand(&self, seed: u64, hand: &dyn Fn(f64) -> f64) -> Record {
        self.run(seed, |_| 0.0, |k, _| hand(k as f64))
    }

    fn in_loop(&self, seed: u64, pi: Pi, load: &dyn Fn(f64) -> f64) -> Record {
        let (mut integral, mut last) = (0.0, 0.0);
        self.run(seed, load, |k, pv| {
            let e = 20.0 - pv;
            if k == 0 {
                last = e;
            }
            integral = f64::clamp(integral + pi.kc * ((e - last) + e / pi.ti_s), pi.limits[0], pi.limits[1]);
            last = e;
            integral
        })
    }
}

fn study(r: &Record, sp: bool) -> LoopStudy {
    let mut problem = FitProblem::new(&r.time_s, &r.pv, &r.mv);
    problem.options.drift = Drift::Auto;
    let record = LoopRecord { problem, sp: sp.then_some(&r.sp), mode: None };
    study_loop(&record, &StudyOptions::default()).expect("a study")
}

fn is_refused(found: &LoopStudy) -> bool {
    let verdicts = found.choice.as_ref().map(|c| c.chosen().verdicts.clone()).unwrap_or_default();
    verdicts.iter().any(|v| matches!(v, FitVerdict::NoExcitation { .. } | FitVerdict::Disturbed { .. }))
}

fn accuses(found: &LoopStudy) -> Option<&RecordFinding> {
    found.findings.iter().find(|f| {
        matches!(
            f,
            RecordFinding::WrongSign { .. }
                | RecordFinding::UnstableTuning { .. }
                | RecordFinding::Stiction { .. }
        )
    })
}

fn smooth(seed: u64, rows: usize, lag_s: f64) -> Vec<f64> {
    let mut rng = StdRng::seed_from_u64(seed + 77);
    let mut states = [0.0_f64; 3];
    (0..rows)
        .map(|_| {
            let normal: f64 = StandardNormal.sample(&mut rng);
            let mut input = 60.0 * normal;
            for state in &mut states {
                *state += (input - *state) / lag_s;
                input = *state;
            }
            input
        })
        .collect()
}

const PROCESSES: [(f64, f64, usize); 4] = [(2.0, 40.0, 0), (0.5, 90.0, 0), (-1.0, 20.0, 2), (2.0, 40.0, 5)];

/// What a study says, for a message.
fn said(found: &LoopStudy) -> String {
    let fit = found.choice.as_ref().map(|c| (c.chosen().structure, c.chosen().verdicts.clone()));
    format!("{:?} {fit:?} {:?}", found.controller, found.findings)
}

type Shape<'a> = (&'a str, Box<dyn Fn(f64) -> f64 + 'a>);

/// A slow hand on a process without dead time was taken for a controller, its ramps for one of the wrong sign, and its
/// triangles for a sticking valve: the law found was the process read backwards.
#[test]
fn val_a_hand_stays_a_hand_whatever_it_draws() {
    let triangle = |t: f64, period: f64| 5.0 * ((2.0 * t / period) % 2.0 - 1.0).abs();
    let trapeze = |t: f64, period: f64| (5.0 * triangle(t, period) - 12.0).clamp(-5.0, 5.0);
    for (i, (gain, t_s, dead_time)) in PROCESSES.into_iter().enumerate() {
        for (j, noise) in [0.0, 0.02, 0.2].into_iter().enumerate() {
            let p = Process { gain, t_s, dead_time, noise, rows: 1500 };
            let random: Vec<Vec<f64>> = [8.0, 20.0].iter().map(|lag| smooth(1, p.rows, *lag)).collect();
            let hands: Vec<Shape> = vec![
                ("smooth, 8 s", Box::new(|t| random[0][t as usize])),
                ("smooth, 20 s", Box::new(|t| random[1][t as usize])),
                ("ramps", Box::new(|t| trapeze(t, 500.0))),
                ("slow ramps", Box::new(|t| trapeze(t, 1100.0))),
                ("one ramp", Box::new(|t| ((t - 300.0) / 40.0).clamp(0.0, 10.0))),
                ("sine", Box::new(|t| 5.0 * (t / 15.0).sin())),
                ("triangle of 60 s", Box::new(|t| triangle(t, 60.0))),
                ("triangle of 120 s", Box::new(|t| triangle(t, 120.0))),
                ("triangle of 200 s", Box::new(|t| triangle(t, 200.0))),
                ("triangle of 400 s", Box::new(|t| triangle(t, 400.0))),
            ];
            for (name, hand) in &hands {
                let found = study(&p.by_hand(1, hand), (i + j) % 2 == 0);
                let right = !is_refused(&found) && accuses(&found).is_none();
                assert!(right, "{name}, {p:?}: {}", said(&found));
            }
        }
    }
}

/// Under a load that is a sine or a ramp the controller's output is as smooth as a hand's: it gave a model.
#[test]
fn val_feedback_stays_feedback_whatever_the_load_draws() {
    let loads: Vec<Shape> = vec![
        ("sine", Box::new(|t| 3.0 * (t / 40.0).sin())),
        ("slow sine", Box::new(|t| 3.0 * (t / 120.0).sin())),
        ("ramp", Box::new(|t| t / 50.0)),
        ("ramp from 200 s", Box::new(|t| (t - 200.0).max(0.0) / 50.0)),
    ];
    for (gain, t_s, dead_time) in PROCESSES {
        // Without noise a ramp under an unknown setpoint leaves a PV at rest and an MV that goes straight on.
        for (noise, sp) in [(0.0, true), (1e-6, false), (0.05, true), (0.05, false)] {
            let p = Process { gain, t_s, dead_time, noise, rows: 1500 };
            let pi = Pi { kc: 1.2 / gain, ti_s: t_s, limits: [-1e9, 1e9] };
            for (name, load) in &loads {
                let found = study(&p.in_loop(1, pi, load), sp);
                assert!(!found.has_model(), "{name}, {p:?}, SP {sp}: {}", said(&found));
            }
        }
    }
}

/// Rows at a limit were no rows of the controller: with more than half of them there a record of feedback alone gave a
/// model, and accused the controller of the wrong sign.
#[test]
fn val_feedback_that_is_mostly_at_its_limits_gives_no_model() {
    for seed in 1..=2 {
        for limit in [0.3, 1.0, 2.0] {
            for (gain, t_s, dead_time) in PROCESSES {
                let p = Process { gain, t_s, dead_time, noise: 0.05, rows: 2000 };
                let walk = smooth(seed, p.rows, 30.0);
                let pi = Pi { kc: 2.0 / gain, ti_s: t_s, limits: [-limit, limit] };
                let found = study(&p.in_loop(seed, pi, &|t| walk[t as usize]), true);
                let right = !found.has_model() && accuses(&found).is_none();
                assert!(right, "{p:?}, limit {limit}, seed {seed}: {}", said(&found));
            }
        }
    }
}
