//! The exported function block is executed and compared with the law, sample by sample.

#[path = "structured_text/lexer.rs"]
mod lexer;
#[path = "structured_text/parser.rs"]
mod parser;
#[path = "structured_text/run.rs"]
mod run;

use rand::{Rng, RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use run::Instance;
use vasos_engine::control::{Clip, ControlInput, Controller, Limits, PidGains, PidI2gl, PidTuning, Sends};
use vasos_io::structured_text::{BlockOptions, is_block_name, structured_text};

fn options() -> BlockOptions {
    BlockOptions {
        name: "PID_I2GL".to_owned(),
        tuning: PidTuning::new(PidGains::pid(1.8, 152.0, 1e-7)),
        sample_time_s: 0.2,
        limits: Limits { low: 1.0, high: 3.5 },
        start: 2.0,
        clip: Clip::Output,
        sends: Sends::Position,
    }
}

fn random_tuning(rng: &mut impl Rng) -> PidTuning {
    let gains = PidGains {
        kc: rng.random_range(0.05..8.0) * if rng.random_bool(0.5) { 1.0 } else { -1.0 },
        ti_s: rng.random_range(0.5..200.0),
        td_s: if rng.random_bool(0.3) { 0.0 } else { rng.random_range(0.001..6.0) },
        n: rng.random_range(1.0..30.0),
    };
    PidTuning { gains, b: rng.random_range(0.0..2.0), c: rng.random_range(0.0..2.0) }
}

/// What the walk met, so that it cannot pass by what it is there for.
#[derive(Default, Debug)]
struct Met {
    at_limits: usize,
    manual: usize,
    held: usize,
    increments: usize,
    clipped_integral: usize,
    changes: usize,
}

/// 20 000 samples each of twenty controllers: noise and steps, saturation, manual, changes of every gain, weight,
/// limit and choice, signals that are no number.
#[test]
fn val_the_exported_text_does_what_the_law_does() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(61131);
    let (mut worst, mut met) = (0.0_f64, Met::default());
    for _ in 0..20 {
        let mut limits = Limits { low: rng.random_range(-5.0..1.0), high: rng.random_range(2.0..9.0) };
        let mut tuning = random_tuning(&mut rng);
        let (sample_time_s, start) = (rng.random_range(0.01..2.0), 1.5);
        let mut sends = Sends::Position;
        let mut clip = if rng.random_bool(0.5) { Clip::Integral } else { Clip::Output };
        let block = BlockOptions { tuning, sample_time_s, limits, start, clip, sends, ..options() };
        let mut text = Instance::new(&structured_text(&block)).unwrap_or_else(|error| panic!("{error}"));
        let mut law = PidI2gl::new(tuning, sample_time_s, -1e9, 1e9, start).clipping(clip);
        let (mut r, mut automatic, mut manual) = (10.0, true, start);
        for _ in 0..20_000 {
            if rng.random_bool(0.02) {
                r = rng.random_range(0.0..20.0);
            }
            if rng.random_bool(0.01) {
                met.changes += 1;
                match rng.random_range(0..6) {
                    0 => automatic = !automatic,
                    1 => manual = rng.random_range(-8.0..12.0),
                    2 => tuning = random_tuning(&mut rng),
                    3 => tuning.gains.kc /= 10.0,
                    4 => clip = if clip == Clip::Output { Clip::Integral } else { Clip::Output },
                    _ => limits.high = rng.random_range(2.0..9.0),
                }
                sends = if rng.random_bool(0.5) { Sends::Position } else { Sends::Increment };
                law.set_tuning(tuning);
                law.set_clip(clip);
            }
            let odd = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY];
            let y = match rng.random_range(0..500) {
                i @ 0..3 => odd[i],
                _ => r + rng.random_range(-3.0..3.0),
            };
            let before = law.mv();
            if !automatic {
                Controller::set_mv(&mut law, limits.clamp(manual));
                met.manual += 1;
            }
            let input = ControlInput { setpoint: r, pv: y, feedforward: 0.0, limits, controlling: automatic };
            let output = law.step(&input);
            for (name, value) in
                [("SP", r), ("PV", y), ("MAN", manual), ("LO", limits.low), ("HI", limits.high)]
            {
                text.set(name, value);
            }
            let g = tuning.gains;
            for (name, value) in [
                ("KC", g.kc),
                ("TI", g.ti_s),
                ("TD", g.td_s),
                ("NF", g.n),
                ("WB", tuning.b),
                ("WC", tuning.c),
            ] {
                text.set(name, value);
            }
            for (name, on) in
                [("S1", sends == Sends::Increment), ("S2", automatic), ("CLIP_I", clip == Clip::Integral)]
            {
                text.switch(name, on);
            }
            text.call();
            let expected = if sends == Sends::Increment { output.mv - before } else { output.mv };
            worst = worst.max((text.real("OUT") - expected).abs());
            assert_eq!(text.truth("HELD"), output.held);
            met.held += usize::from(output.held);
            met.at_limits += usize::from(output.cut.is_some());
            met.increments += usize::from(sends == Sends::Increment);
            met.clipped_integral += usize::from(clip == Clip::Integral && output.cut.is_some());
        }
    }
    println!("largest difference {worst:e} over 400 000 samples; {met:?}");
    assert!(worst < 1e-12, "{worst:e}");
    let Met { at_limits, manual, held, increments, clipped_integral, changes } = met;
    let least = [at_limits, manual, held, increments, clipped_integral, changes].into_iter().min();
    assert!(least > Some(1000), "the walk met everything");
}

/// The block as MATIEC compiled it against the law: a compiler and a program that no one here made.
#[test]
fn val_the_law_does_what_matiec_made_of_the_exported_text() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../assets/golden/structured_text_matiec.csv");
    let mut reader = csv::Reader::from_path(path).expect("the file");
    let gains = PidGains { kc: 1.8, ti_s: 20.0, td_s: 1.5, n: 8.0 };
    let mut law = PidI2gl::new(PidTuning { gains, b: 0.7, c: 0.2 }, 0.2, -1e9, 1e9, 2.0);
    let (mut worst, mut rows) = (0.0_f64, 0);
    for record in reader.records() {
        let row: Vec<f64> =
            record.expect("a row").iter().map(|cell| cell.parse().expect("a number")).collect();
        let [sp, pv, man, s2, s1, clip, kc, ti_s, td_s, n, b, c, low, high, out, held] = row[..] else {
            panic!("sixteen columns")
        };
        let limits = Limits { low, high };
        law.set_tuning(PidTuning { gains: PidGains { kc, ti_s, td_s, n }, b, c });
        law.set_clip(if clip > 0.0 { Clip::Integral } else { Clip::Output });
        let before = law.mv();
        if s2 == 0.0 {
            Controller::set_mv(&mut law, limits.clamp(man));
        }
        let controlling = s2 > 0.0;
        let output = law.step(&ControlInput { setpoint: sp, pv, feedforward: 0.0, limits, controlling });
        let expected = if s1 > 0.0 { output.mv - before } else { output.mv };
        worst = worst.max((out - expected).abs());
        assert_eq!(output.held, held > 0.0, "row {rows}");
        rows += 1;
    }
    println!("largest difference {worst:e} in {rows} rows");
    assert!(worst < 1e-12 && rows == 1500, "{worst:e}");
}

#[test]
fn numbers_and_names_are_those_of_the_norm() {
    let text = structured_text(&options());
    assert!(text.contains("TI : LREAL := 152.0;") && text.contains("TD : LREAL := 1.0E-7;"), "{text}");
    assert!(!text.contains('%') && text.is_ascii());
    assert_eq!(Instance::new(&text).expect("in the subset").name(), "PID_I2GL");
    for (name, possible) in
        [("PID_1", true), ("1PID", false), ("A__B", false), ("A_", false), ("a b", false), ("", false)]
    {
        assert_eq!(is_block_name(name), possible, "{name}");
    }
}

/// The reader of this test refuses what it would otherwise read wrongly.
#[test]
fn the_interpreter_refuses_what_is_outside_its_subset() {
    let block = |body: &str| {
        let head = "FUNCTION_BLOCK F VAR A : LREAL; B : BOOL; END_VAR ";
        Instance::new(&format!("{head}{body} END_FUNCTION_BLOCK")).map(|_| ())
    };
    assert_eq!(block("A := 2.0 + 3.0 * A; B := A > 1.0 AND NOT B;"), Ok(()));
    for wrong in [
        "A := 2;",
        "A := B;",
        "B := A;",
        "C := 1.0;",
        "A := 1.0",
        "IF A THEN A := 1.0; END_IF;",
        "A := SQRT(A);",
        "A := LIMIT(A, A);",
        "WHILE B DO A := 1.0; END_WHILE;",
        "A := 1.0; (* open",
        "A = 1.0;",
        "B := A AND B;",
    ] {
        assert!(block(wrong).is_err(), "{wrong}");
    }
    let value = |expression: &str| {
        let text = format!("FUNCTION_BLOCK F VAR A : LREAL; END_VAR A := {expression}; END_FUNCTION_BLOCK");
        let mut instance = Instance::new(&text).expect("in the subset");
        instance.call();
        instance.real("A")
    };
    assert_eq!(value("2.0 + 3.0 * 4.0 - 6.0 / 3.0"), 12.0);
    assert_eq!(value("-(1.0 - 2.0 - 3.0)"), 4.0);
    assert_eq!(value("LIMIT(1.0, 9.0, 5.0)"), 5.0);
}
