//! A step of something unmeasured inside the stretch: found, told, and no harm to the intervals.
//!
//! Truth: K e^(−Ls)/(T s + 1), Kv e^(−Ls)/s or two lags, held input, L of whole and part rows; the load is a step added at
//! once to the PV, or to the input behind the dead time. Open loop has three moves of the MV, closed loop a PI with a square
//! wave on the setpoint. White noise of 1 % of the noise-free output's variance in open loop, as the specification has it. An
//! honest 95 % interval misses once in twenty: over 2,000 records the specification's 93–97 %.

mod records;

use rand::SeedableRng;
use rand::rngs::StdRng;
use vasos_engine::identify::{
    Choice, FitProblem, FitVerdict, Loads, LoopRecord, ModelFit, Structure, StudyOptions, choose_model,
    fit_model, study_loop,
};

use records::{moves, noise, share_of};

const FEW: u64 = 60;
const MANY: (u64, std::ops::RangeInclusive<u64>) = (2000, 1860..=1940);
const ROWS: usize = 600;

/// Where a load enters.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Place {
    /// Added to the PV.
    Output,
    /// Added to the input, behind its dead time.
    Input,
}

#[derive(Debug, Clone, Copy)]
enum Process {
    First,
    Integrator,
    TwoLags,
}

impl Process {
    /// Parallel first-order modes (gain, T); an integrator has T = ∞ and its Kv.
    fn modes(self) -> Vec<(f64, f64)> {
        match self {
            Self::First => vec![(2.0, 15.0)],
            Self::Integrator => vec![(0.02, f64::INFINITY)],
            // 2/((24 s + 1)(6 s + 1)) in partial fractions.
            Self::TwoLags => vec![(2.0 * 24.0 / 18.0, 24.0), (-2.0 * 6.0 / 18.0, 6.0)],
        }
    }

    fn truth(self) -> Vec<(&'static str, f64)> {
        match self {
            Self::First => vec![("K", 2.0), ("T_s", 15.0), ("L_s", DEAD_ROWS as f64 + PART)],
            Self::Integrator => vec![("Kv", 0.02), ("L_s", DEAD_ROWS as f64 + PART)],
            Self::TwoLags => {
                vec![("K", 2.0), ("T_s", 24.0), ("T2_s", 6.0), ("L_s", DEAD_ROWS as f64 + PART)]
            }
        }
    }

    fn structure(self) -> Structure {
        match self {
            Self::First => Structure::Fopdt,
            Self::Integrator => Structure::Ipdt,
            Self::TwoLags => Structure::Sopdt,
        }
    }

    /// Kc and Ti of the loop.
    fn controller(self) -> (f64, f64) {
        match self {
            Self::First => (0.6, 15.0),
            Self::Integrator => (2.5, 60.0),
            Self::TwoLags => (0.5, 24.0),
        }
    }
}

/// L = 5.3 s with rows a second apart: over a row the process sees the MV six rows back for 0.3 s, then that five back.
const DEAD_ROWS: usize = 5;
const PART: f64 = 0.3;

#[derive(Debug, Clone, Copy)]
struct Case {
    process: Process,
    closed: bool,
    place: Place,
    /// Row from which the load is there, and its size in units of where it enters.
    at: usize,
    size: f64,
    /// Further loads at the same place: row and size.
    more: &'static [(usize, f64)],
    /// Correlation of the noise's neighbours.
    rho: f64,
}

struct Record {
    time_s: Vec<f64>,
    pv: Vec<f64>,
    mv: Vec<f64>,
}

impl Case {
    fn record(&self, seed: u64) -> Record {
        let mut rng = StdRng::seed_from_u64(seed);
        let e = noise(&mut rng, ROWS, self.rho);
        let time_s: Vec<f64> = (0..ROWS).map(|k| k as f64).collect();
        let run = |sd: f64| {
            let e: Vec<f64> = e.iter().map(|e| sd * e).collect();
            self.run(&time_s, &e)
        };
        let sd = match (self.closed, self.process) {
            (true, Process::Integrator) => 0.05,
            (true, _) => 0.1,
            // The noise-free output without the load: its step is no movement that tells the process.
            _ => share_of(&Self { size: 0.0, more: &[], ..*self }.run(&time_s, &vec![0.0; ROWS]).0, 0.01),
        };
        let (pv, mv) = run(sd);
        Record { time_s, pv, mv }
    }

    fn run(&self, time_s: &[f64], noise: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let by_hand = match self.process {
            Process::Integrator => {
                moves(time_s, &[(45.0, 1.0), (165.0, -1.0), (330.0, 0.6), (495.0, -0.5)], 0.0)
            }
            _ => moves(time_s, &[(48.0, 1.0), (240.0, -0.5), (420.0, 0.7)], 0.0),
        };
        let (kc, ti) = self.process.controller();
        let modes = self.process.modes();
        let mut states = vec![0.0; modes.len()];
        let (mut pv, mut mv) = (vec![], vec![]);
        let (mut u, mut last) = (0.0, 0.0);
        for k in 0..ROWS {
            let steps = std::iter::once((self.at, self.size)).chain(self.more.iter().copied());
            let load: f64 = steps.filter(|(at, _)| k >= *at).map(|(_, size)| size).sum();
            let (output, input) = if self.place == Place::Output { (load, 0.0) } else { (0.0, load) };
            let measured = states.iter().sum::<f64>() + output + noise[k];
            if self.closed {
                let sp = if (k / 100) % 2 == 1 { 2.0 } else { 0.0 };
                let error: f64 = sp - measured;
                u += kc * ((error - last) + error / ti);
                last = error;
            } else {
                u = by_hand[k];
            }
            pv.push(measured);
            mv.push(u);
            let back = |rows: usize| if k >= rows { mv[k - rows] } else { 0.0 };
            for (state, (gain, t)) in states.iter_mut().zip(&modes) {
                for (value, duration) in [(back(DEAD_ROWS + 1), PART), (back(DEAD_ROWS), 1.0 - PART)] {
                    let value = value + input;
                    if t.is_finite() {
                        let a = f64::exp(-duration / t);
                        *state = a * *state + (1.0 - a) * gain * value;
                    } else {
                        *state += gain * value * duration;
                    }
                }
            }
        }
        (pv, mv)
    }

    fn problem<'a>(&self, record: &'a Record) -> FitProblem<'a> {
        let mut problem = FitProblem::new(&record.time_s, &record.pv, &record.mv);
        problem.options.loads = Loads::Auto;
        problem
    }

    fn fit(&self, seed: u64) -> ModelFit {
        let record = self.record(seed);
        fit_model(&self.problem(&record), self.process.structure()).expect("a fit")
    }

    fn choice(&self, seed: u64) -> Choice {
        let record = self.record(seed);
        choose_model(&self.problem(&record)).expect("a choice")
    }
}

#[derive(Debug, Default)]
struct Count {
    held: Vec<(String, u64)>,
    /// Records in which a load was told, and of those the ones that place it right.
    told: u64,
    placed: u64,
}

fn count(case: &Case, seeds: u64) -> Count {
    let mut out = Count::default();
    let truth = case.process.truth();
    out.held = truth.iter().map(|(name, _)| ((*name).to_owned(), 0)).collect();
    for seed in 0..seeds {
        let fit = case.fit(seed);
        for ((name, value), (_, held)) in truth.iter().zip(&mut out.held) {
            let value = match (fit.parameter("zeta").is_some(), *name) {
                // An underdamped fit of two lags tells them by tau and zeta.
                (true, "T_s") => f64::sqrt(24.0 * 6.0),
                (true, "T2_s") => 0.5 * 30.0 / f64::sqrt(24.0 * 6.0),
                _ => *value,
            };
            let name = if *name == "T2_s" && fit.parameter("zeta").is_some() { "zeta" } else { name };
            let [low, high] = fit.parameter(name).expect("a parameter").interval_95;
            *held += u64::from((low..=high).contains(&value));
        }
        out.told += u64::from(!fit.loads.is_empty());
        out.placed += u64::from(fit.loads.len() == 1 && (fit.loads[0].at_s - case.at as f64).abs() < 15.0);
    }
    out
}

const PROCESSES: [Process; 3] = [Process::First, Process::Integrator, Process::TwoLags];

/// Loads of all sizes, places and times on open and closed loops.
fn loaded() -> Vec<Case> {
    let mut out = vec![];
    for process in PROCESSES {
        for closed in [false, true] {
            for (place, at, size) in [
                (Place::Output, 130, 0.3),
                (Place::Output, 300, 1.0),
                (Place::Output, 480, 3.0),
                (Place::Input, 150, 1.0),
                (Place::Input, 310, 0.4),
            ] {
                out.push(Case { process, closed, place, at, size, more: &[], rho: 0.0 });
            }
        }
    }
    out
}

fn unloaded(rho: f64) -> Vec<Case> {
    let one = |(process, closed)| Case {
        process,
        closed,
        place: Place::Output,
        at: 300,
        size: 0.0,
        more: &[],
        rho,
    };
    PROCESSES.into_iter().flat_map(|p| [(p, false), (p, true)]).map(one).collect()
}

fn percent(part: u64, of: u64) -> String {
    format!("{:.1}", 100.0 * part as f64 / of as f64)
}

fn line(case: &Case, found: &Count, seeds: u64) -> String {
    let held: Vec<String> = found.held.iter().map(|(n, h)| format!("{n} {}", percent(*h, seeds))).collect();
    format!("{case:?}: {} told {}", held.join(", "), percent(found.told, seeds))
}

/// Hits of all cases taken together: a seed's noise is one of each case's, so that few seeds scatter alike.
fn check_coverage(cases: &[Case], seeds: u64, wanted: &std::ops::RangeInclusive<u64>, told: bool) {
    let mut wrong = vec![];
    for case in cases {
        let found = count(case, seeds);
        println!("{}", line(case, &found, seeds));
        let in_order = found.held.iter().all(|(_, held)| wanted.contains(held));
        // A load that is there is told at its place; one that is not is told in less than two of a hundred.
        let said = if told { found.placed * 100 >= seeds * 97 } else { found.told * 50 <= seeds };
        if !in_order || !said {
            wrong.push(format!("{} placed {}", line(case, &found, seeds), percent(found.placed, seeds)));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// 240 fits: five loads on six loops, eight records each. Each interval holds the truth in all but a few.
#[test]
fn intervals_hold_the_truth_beside_a_load() {
    let (mut held, mut all) = (0, 0);
    for case in loaded() {
        let found = count(&case, 8);
        assert!(found.placed >= 7, "{}", line(&case, &found, 8));
        held += found.held.iter().map(|(_, held)| held).sum::<u64>();
        all += 8 * found.held.len() as u64;
    }
    println!("{held} of {all}");
    // 95 % of 720, and intervals of a fit go together: sd of about 2 %, three of them below.
    assert!(held as f64 > 0.89 * all as f64, "{held} of {all}");
}

#[test]
#[ignore = "release only: cargo test --release -p vasos-engine --test val_loads -- --ignored"]
fn val_loads_over_2000() {
    check_coverage(&loaded(), MANY.0, &MANY.1, true);
}

#[test]
fn no_load_is_told_where_there_is_none() {
    for case in unloaded(0.0) {
        let found = count(&case, FEW);
        assert!(found.told == 0, "{}", line(&case, &found, FEW));
    }
}

#[test]
#[ignore = "release only: cargo test --release -p vasos-engine --test val_loads -- --ignored"]
fn val_no_load_over_2000() {
    check_coverage(&unloaded(0.0), MANY.0, &MANY.1, false);
}

/// Noise that wanders: coverage is that of `val_coverage`'s coloured noise; here only that no load is told.
#[test]
#[ignore = "release only: cargo test --release -p vasos-engine --test val_loads -- --ignored"]
fn val_no_load_in_coloured_noise_over_2000() {
    for case in [0.5, 0.8].into_iter().flat_map(unloaded) {
        let found = count(&case, MANY.0);
        println!("{}", line(&case, &found, MANY.0));
        assert!(found.told * 50 <= MANY.0, "{}", line(&case, &found, MANY.0));
    }
}

/// The raw residuals had to be white: with noise that wanders no load was ever told, and the interval of K beside two of them
/// was ±70 % or wider.
#[test]
fn loads_are_told_in_noise_that_wanders() {
    let more: [&'static [(usize, f64)]; 3] = [&[], &[(380, -1.5)], &[(300, -1.5), (450, 2.0)]];
    let (mut placed, mut held, mut all) = (0, 0, 0);
    for more in more {
        // In open loop the first of three hides the others, and nothing may be told.
        for closed in if more.len() == 2 { vec![true] } else { vec![false, true] } {
            let case = Case {
                process: Process::First,
                closed,
                place: Place::Output,
                at: 140,
                size: 1.0,
                more,
                rho: 0.8,
            };
            for seed in 0..6 {
                let fit = case.fit(seed);
                let near = |at: usize| fit.loads.iter().any(|l| (l.at_s - at as f64).abs() < 15.0);
                let mut places = std::iter::once(case.at).chain(more.iter().map(|(at, _)| *at));
                let right = fit.loads.len() == 1 + more.len() && places.all(near);
                let [low, high] = fit.parameters[0].interval_95;
                placed += u64::from(right);
                held += u64::from((low..=high).contains(&2.0) && high - low < 0.4);
                all += 1;
            }
        }
    }
    println!("{placed} placed, {held} held of {all}");
    assert!(placed * 10 >= all * 9 && held * 10 >= all * 8, "{placed} placed, {held} held of {all}");
}

#[test]
fn no_load_is_told_in_noise_that_wanders() {
    for case in [0.8, 0.9].into_iter().flat_map(unloaded) {
        let found = count(&case, 12);
        assert!(found.told == 0, "{}", line(&case, &found, 12));
    }
}

/// With all structures to choose from the load is told at its place, and the structure is the one chosen without it.
#[test]
fn a_choice_tells_the_load_and_keeps_the_structure() {
    for process in [Process::First, Process::TwoLags] {
        for closed in [false, true] {
            let case = Case { process, closed, place: Place::Input, at: 320, size: 0.6, more: &[], rho: 0.0 };
            for seed in 0..3 {
                let choice = case.choice(seed);
                let fit = choice.chosen();
                let without = Case { size: 0.0, ..case }.choice(seed);
                assert_eq!(fit.structure, without.chosen().structure, "{case:?} {seed}");
                let told = fit.verdicts.iter().find_map(|v| match v {
                    FitVerdict::Load { at_s, change } => Some((*at_s, *change)),
                    _ => None,
                });
                let (at_s, change) = told.unwrap_or_else(|| panic!("{case:?} {seed}: {:?}", fit.verdicts));
                assert!((at_s - 320.0).abs() < 12.0 && (change - 1.2).abs() < 0.2, "{at_s} {change}");
            }
        }
    }
}

/// What a study says of a record.
fn said(time_s: &[f64], pv: &[f64], mv: &[f64]) -> Vec<FitVerdict> {
    let record = LoopRecord { problem: FitProblem::new(time_s, pv, mv), sp: None, mode: None };
    let study = study_loop(&record, &StudyOptions::default()).expect("a study");
    study.choice.expect("a choice").chosen().verdicts.clone()
}

/// Three moves between three levels, y∞ = 2 u + square · u², T = 30 s, L = 5 s, noise of sd 0.05.
fn bent(square: f64, seed: u64) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let e = noise(&mut StdRng::seed_from_u64(seed), 1200, 0.0);
    let time_s: Vec<f64> = (0..1200).map(f64::from).collect();
    let mv = moves(&time_s, &[(100.0, 15.0), (400.0, 20.0), (700.0, 10.0)], 10.0);
    let rest = |u: f64| 2.0 * u + square * u * u;
    let (mut y, a) = (rest(10.0), f64::exp(-1.0 / 30.0));
    let pv = (0..1200)
        .map(|k| {
            let now = y + 0.05 * e[k];
            y = a * y + (1.0 - a) * rest(mv[k.saturating_sub(5)]);
            now
        })
        .collect();
    (time_s, pv, mv)
}

/// y∞ = 2 u + 0.1 u² has the slope 2 + 0.2 u: 4 at 10 and 6 at 20. Steps at the moves would explain it as well.
#[test]
fn a_gain_that_changes_with_the_level_of_the_mv_is_told() {
    for seed in 0..5 {
        let (time_s, pv, mv) = bent(0.1, seed);
        let found = said(&time_s, &pv, &mv);
        let Some(FitVerdict::GainByLevel { levels, gains }) = found.first() else { panic!("{found:?}") };
        assert_eq!(*levels, [10.0, 20.0]);
        assert!((gains[0] - 4.0).abs() < 0.05 && (gains[1] - 6.0).abs() < 0.05, "{gains:?}");
        for straight in [0.0, 0.005] {
            let (time_s, pv, mv) = bent(straight, seed);
            let found = said(&time_s, &pv, &mv);
            // A twentieth from end to end leaves a pattern in this little noise, but nothing that came unmeasured.
            let good = matches!(found[0], FitVerdict::Good { .. });
            assert_eq!(good, straight == 0.0, "{straight}: {found:?}");
            assert!(!found.iter().any(|v| matches!(v, FitVerdict::Load { .. })), "{straight}: {found:?}");
        }
    }
}

/// A first order whose sign or loop lets it run away: the last rows fitted to the last digit passed for a good model.
#[test]
fn a_record_that_runs_away_is_not_called_good() {
    for (pole, kc) in [(-1.0 / 30.0, 6.0), (-1.0 / 30.0, 8.0), (1.0 / 30.0, 0.0)] {
        for sd in [0.0, 0.05] {
            let e = noise(&mut StdRng::seed_from_u64(7), 300, 0.0);
            let time_s: Vec<f64> = (0..300).map(f64::from).collect();
            let (a, mut y, mut sum) = (f64::exp(pole), 0.0, 0.0);
            let (mut pv, mut mv) = (vec![], vec![]);
            for k in 0..300 {
                let (now, sp) = (y + sd * e[k], f64::from(u8::from(k > 20)));
                let error = sp - now;
                sum += kc * error / 30.0;
                pv.push(now);
                mv.push(if kc > 0.0 { kc * error + sum } else { sp });
                y = a * y + 2.0 * (1.0 - a).abs() * if k >= 5 { mv[k - 5] } else { 0.0 };
            }
            let found = said(&time_s, &pv, &mv);
            assert!(
                !found.iter().any(|v| matches!(v, FitVerdict::Good { .. })),
                "{pole} {kc} {sd}: {found:?}"
            );
        }
    }
}

/// A load that runs up under a loop whose setpoint nobody knows, L = 0, no noise: the controller's answer is no model.
#[test]
fn a_ramp_of_a_load_under_feedback_gives_no_model() {
    for dead_rows in [0, 1] {
        let time_s: Vec<f64> = (0..600).map(f64::from).collect();
        let (a, mut y, mut sum) = (f64::exp(-1.0 / 30.0), 0.0, 0.0);
        let (mut pv, mut mv) = (vec![], vec![]);
        for k in 0..600 {
            let now = y + 0.01 * k as f64;
            sum -= 0.8 * now / 30.0;
            pv.push(now);
            mv.push(sum - 0.8 * now);
            y = a * y + 2.0 * (1.0 - a) * if k >= dead_rows { mv[k - dead_rows] } else { 0.0 };
        }
        let found = said(&time_s, &pv, &mv);
        assert!(found.iter().any(FitVerdict::is_refusal), "{dead_rows}: {found:?}");
    }
}
