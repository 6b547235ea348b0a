//! MVs moved by hand as smooth waves, with a known process behind them: no feedback, whatever their shape.

use rand::SeedableRng;
use rand::rngs::StdRng;
use rand_distr::{Distribution, StandardNormal};
use vasos_engine::identify::{
    Drift, FitProblem, FitVerdict, LoopRecord, LoopStudy, ModeColumn, RecordFinding, StudyOptions, study_loop,
};

struct Record {
    time_s: Vec<f64>,
    pv: Vec<f64>,
    mv: Vec<f64>,
    sp: Vec<f64>,
}

/// A record by hand: `hand` over time, with a first order behind it.
fn by_hand(
    gain: f64,
    t_s: f64,
    dead_time: usize,
    noise: f64,
    seed: u64,
    hand: impl Fn(f64) -> f64,
) -> Record {
    let mut rng = StdRng::seed_from_u64(seed);
    let a = f64::exp(-1.0 / t_s);
    let mut out = Record { time_s: vec![], pv: vec![], mv: vec![], sp: vec![] };
    let mut y = 0.0;
    let mut delayed = vec![hand(0.0); dead_time + 1];
    for k in 0..1800 {
        let normal: f64 = StandardNormal.sample(&mut rng);
        let t = f64::from(k);
        out.time_s.push(t);
        out.pv.push(20.0 + y + noise * normal);
        out.mv.push(hand(t));
        out.sp.push(20.0);
        delayed.push(hand(t));
        y = a * y + (1.0 - a) * gain * (delayed[delayed.len() - 1 - dead_time] - hand(0.0));
    }
    out
}

fn study(r: &Record, mode: Option<ModeColumn>) -> LoopStudy {
    study_from(r, mode, None)
}

fn study_from(r: &Record, mode: Option<ModeColumn>, mv_before: Option<f64>) -> LoopStudy {
    let mut problem = FitProblem::new(&r.time_s, &r.pv, &r.mv);
    problem.options.mv_before = mv_before;
    problem.options.drift = Drift::Auto;
    study_loop(&LoopRecord { problem, sp: Some(&r.sp), mode }, &StudyOptions::default()).expect("a study")
}

type Wave = (&'static str, fn(f64) -> f64);

const WAVES: [Wave; 5] = [
    ("slow sine", |t| 8.0 * (t / 60.0).sin()),
    ("sine", |t| 8.0 * (t / 15.0).sin()),
    ("ramp", |t| t / 20.0),
    ("triangle", |t| 5.0 * ((t / 150.0) % 2.0 - 1.0).abs()),
    ("two sines", |t| 8.0 * (t / 60.0).sin() + 3.0 * (t / 23.0).cos()),
];

/// 8·sin(t/60) by hand was taken for a controller's answer and refused; where it was not, its swing was called that of a
/// loop, and a triangle's that of a sticking valve.
#[test]
fn val_a_hand_that_moves_the_mv_smoothly_is_no_controller() {
    for (name, wave) in WAVES {
        for noise in [0.0, 0.01, 0.1, 0.5] {
            for (gain, t_s, dead_time) in [(2.0, 40.0, 5), (-1.0, 20.0, 2), (0.5, 90.0, 20)] {
                let r = by_hand(gain, t_s, dead_time, noise, 3, wave);
                for told in [Some(wave(0.0)), None] {
                    let found = study_from(&r, None, told);
                    let what = format!("{name}, noise {noise}, K {gain}, {told:?} before");
                    let fit = found.choice.as_ref().expect("a model").chosen();
                    let refused = fit.verdicts.iter().any(|v| matches!(v, FitVerdict::NoExcitation { .. }));
                    assert!(!refused, "{what}: {:?} {:?}", fit.verdicts, found.controller);
                    assert!(found.findings.is_empty(), "{what}: {:?} {:?}", found.findings, found.controller);
                    let [low, high] = fit.parameters[0].interval_95;
                    let error = (fit.parameters[0].value / gain - 1.0).abs();
                    // Without the MV ahead of the first row noise leaves more open, of a ramp all.
                    let held = told.is_none() && (!found.has_model() || low <= gain && gain <= high);
                    assert!(error < 0.01 + 0.3 * noise || held, "{what}: {:?}", fit.parameters);
                }
            }
        }
    }
}

/// A mode that says so in words: nothing a hand wrote is read as the controller's, nor as a limit.
#[test]
fn rows_in_manual_count_for_no_controller() {
    let words = ["AUTO".to_owned(), " Man".to_owned()];
    let codes = vec![1.0; 1800];
    let r = by_hand(0.5, 90.0, 20, 0.5, 5, |t| (8.0 * (t / 15.0).sin()).clamp(-5.0, 6.0));
    let found = study(&r, Some(ModeColumn { values: &codes, words: &words }));
    assert!(found.controller.is_none() && found.findings.is_empty(), "{:?}", found.findings);
    let half: Vec<f64> = (0..1800).map(|k| f64::from(u8::from(k >= 900))).collect();
    let found = study(&r, Some(ModeColumn { values: &half, words: &words }));
    let mode = found.findings.iter().find_map(|f| match f {
        RecordFinding::ModeChanges { mode, .. } => Some(mode.clone()),
        _ => None,
    });
    assert_eq!(mode.as_deref(), Some("AUTO"), "{:?}", found.findings);
}

/// Levels of a binary sequence or of a hand were flagged as limits of the valve.
#[test]
fn an_mv_of_few_levels_has_no_limits() {
    let mut state = 0x5a5a_u32;
    let mut levels = Vec::new();
    for _ in 0..1800 {
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        levels.push(f64::from(state % 2));
    }
    let r = by_hand(1.0, 20.0, 2, 0.02, 1, |t| 3.0 * levels[(t as usize / 2).min(899)]);
    let found = study(&r, None);
    assert!(
        !found.findings.iter().any(|f| matches!(f, RecordFinding::MvAtLimit { .. })),
        "{:?}",
        found.findings
    );
}
