//! However a test on a loop ends, the loop is as it was, and what the operator does goes before it.

use rand::{Rng, RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use vasos_engine::control::{Clip, Law, LoopOptions, Mode, OutputLimits, PidGains, PidTuning, Sends};
use vasos_engine::excitation::{
    AtRest, Ending, Excitation, ExcitationError, ExcitationLimits, Hysteresis, Phase, Relay, Signal, StepEnd,
    SteppedSine, StopReason, UltimateGain,
};
use vasos_engine::plant::{Fault, Measurement};
use vasos_engine::session::{CommandError, RigCommand};
use vasos_engine::sim::ClosedLoop;
use vasos_tests::{
    TAG, begin, checked_step, excite, loop_settings, relay_test, signals, tag, tested_rig, to_its_end,
};

/// With its noise, the rig shows no oscillation under proportional control that its output could carry.
fn finds_nothing(signal: &Signal, measurement: Measurement) -> bool {
    matches!(signal, Signal::UltimateGain(_)) && measurement.noise
}

/// The loop controls again, and holds its level.
fn is_alive(closed: &mut ClosedLoop) {
    closed.apply(&RigCommand::Mode { tag: tag(), mode: Mode::Automatic }).expect("possible");
    for _ in 0..7500 {
        checked_step(closed);
    }
    let error_cm = closed.readings()[0].level_cm - closed.loops()[0].control.setpoint_cm;
    assert!(error_cm.abs() < 0.5, "{error_cm}");
}

#[test]
fn every_test_leaves_the_loop_as_it_was() {
    for mode in [Mode::Automatic, Mode::Manual] {
        for measurement in [Measurement::IDEAL, Measurement::DEFAULT] {
            for signal in signals() {
                let mut closed = tested_rig(mode, measurement);
                let (before, mv) = (loop_settings(&closed.loops()[0]), closed.loops()[0].control.mv());
                begin(&mut closed, &excite(signal.clone())).expect("begins");
                let report = to_its_end(&mut closed);
                if finds_nothing(&signal, measurement) {
                    let reason = &report.ending;
                    assert!(
                        matches!(reason, Ending::Stopped(StopReason::NoOscillation { .. })),
                        "{reason:?}"
                    );
                } else {
                    assert_eq!(report.ending, Ending::Finished, "{mode:?} {signal:?}");
                }
                assert_eq!(loop_settings(&closed.loops()[0]), before, "{signal:?}");
                assert_eq!(closed.loops()[0].control.actual_mode(), mode, "{signal:?}");
                if mode == Mode::Manual {
                    assert_eq!(closed.loops()[0].control.mv(), mv, "{signal:?}");
                }
                is_alive(&mut closed);
            }
        }
    }
}

/// In automatic without noise, the output after a test is the one before it, and no test makes it jump.
#[test]
fn the_end_of_a_test_is_no_bump() {
    let mut closed = tested_rig(Mode::Automatic, Measurement::IDEAL);
    let before = closed.loops()[0].control.mv();
    begin(&mut closed, &excite(Signal::Doublet { amplitude: 0.1, hold_s: 20.0 })).expect("begins");
    to_its_end(&mut closed);
    let mut last = closed.loops()[0].control.mv();
    assert!((last - before).abs() < 0.01, "{last} after {before}");
    for _ in 0..500 {
        checked_step(&mut closed);
        let mv = closed.loops()[0].control.mv();
        assert!((mv - last).abs() < 0.005, "{last} to {mv}");
        last = mv;
    }
}

/// A test under way, moved and with the level off its rest.
fn under_way(mode: Mode) -> ClosedLoop {
    let mut closed = tested_rig(mode, Measurement::DEFAULT);
    begin(&mut closed, &relay_test()).expect("begins");
    for _ in 0..150 {
        checked_step(&mut closed);
    }
    assert!(closed.excitation().is_some_and(|now| now.tag == TAG && now.progress.phase != Phase::Listening));
    closed
}

/// A name, what is done, and whether a reason is the one that follows.
type End = (&'static str, fn(&mut ClosedLoop), fn(&StopReason) -> bool);

#[test]
fn whatever_ends_a_test_the_loop_is_as_it_was() {
    for mode in [Mode::Automatic, Mode::Manual] {
        let ends: [End; 4] = [
            (
                "abort",
                |c| c.apply(&RigCommand::AbortExcitation { tag: tag() }).expect("possible"),
                |r| *r == StopReason::Operator,
            ),
            (
                "sensor",
                |c| {
                    let fault = Fault::BrokenWire;
                    c.apply(&RigCommand::Fault { tag: "LT02".to_owned(), fault }).expect("possible");
                },
                |r| *r == StopReason::PvLost,
            ),
            (
                "level",
                |c| {
                    let delta_cm = -13.8;
                    c.apply(&RigCommand::Bump { tag: "TQ2".to_owned(), delta_cm }).expect("possible");
                },
                |r| matches!(r, StopReason::PvLimit { low: 1.5, .. }),
            ),
            ("defect", |c| c.stop_excitation(StopReason::Defect), |r| *r == StopReason::Defect),
        ];
        for (name, end, expected) in ends {
            let mut closed = under_way(mode);
            let before = loop_settings(&closed.loops()[0]);
            end(&mut closed);
            let report = to_its_end(&mut closed);
            let Ending::Stopped(reason) = &report.ending else { panic!("{name}: finished") };
            assert!(expected(reason), "{name}: {reason}");
            assert_eq!(loop_settings(&closed.loops()[0]), before, "{name}");
            checked_step(&mut closed);
            assert_eq!(closed.loops()[0].control.actual_mode(), mode, "{name}");
            assert_eq!(closed.excitation(), None);
            if name == "sensor" {
                closed.apply(&RigCommand::Repair { tag: "LT02".to_owned(), kind: None }).expect("possible");
            }
            is_alive(&mut closed);
        }
    }
}

#[test]
fn limits_and_time_of_the_description_end_it() {
    let mut limited = excite(Signal::Step { size: 0.2, rest_share: 0.02, end: StepEnd::Stay });
    limited.limits.pv_high = Some(15.4);
    let mut running = tested_rig(Mode::Automatic, Measurement::DEFAULT);
    begin(&mut running, &limited).expect("begins");
    let report = to_its_end(&mut running);
    assert!(matches!(report.ending, Ending::Stopped(StopReason::PvLimit { high: 15.4, .. })));
    is_alive(&mut running);
    let short = Excitation { budget_s: 60.0, ..relay_test() };
    let mut running = tested_rig(Mode::Manual, Measurement::DEFAULT);
    let mv = running.loops()[0].control.mv();
    begin(&mut running, &short).expect("begins");
    let report = to_its_end(&mut running);
    assert_eq!(report.ending, Ending::Stopped(StopReason::Budget { budget_s: 60.0 }));
    assert!((report.record.time_s.len() as f64 * 0.2 - 60.0).abs() < 1.0);
    assert_eq!(running.loops()[0].control.mv(), mv);
}

/// The operator goes before a test: what he sends to the loop ends it, and is carried out.
#[test]
fn a_command_to_the_loop_ends_the_test_and_wins() {
    let tuning = PidTuning::new(PidGains { kc: 1.0, ti_s: 100.0, td_s: 0.0, n: 10.0 });
    let output = OutputLimits { high: Some(3.3), ..OutputLimits::default() };
    let options = Box::new(LoopOptions { output, ..LoopOptions::default() });
    let commands = [
        (Mode::Automatic, RigCommand::Mode { tag: tag(), mode: Mode::Manual }),
        (Mode::Automatic, RigCommand::Setpoint { tag: tag(), level_cm: 12.0 }),
        (Mode::Manual, RigCommand::Mv { tag: tag(), value: 2.7 }),
        (Mode::Manual, RigCommand::Mv { tag: "BA01".to_owned(), value: 2.7 }),
        (Mode::Automatic, RigCommand::Tuning { tag: tag(), tuning }),
        (Mode::Automatic, RigCommand::Law { tag: tag(), law: Law::PID_2GL }),
        (Mode::Automatic, RigCommand::Options { tag: tag(), options }),
        (Mode::Automatic, RigCommand::PvFilter { tag: tag(), time_constant_s: 2.0 }),
    ];
    for (mode, command) in commands {
        let mut running = under_way(mode);
        let at_rest = running.loops()[0].control.setpoint_cm;
        running.apply(&command).expect("possible");
        let report = running.ended_excitations().next().expect("ended");
        let key = command.key();
        assert_eq!(report.ending, Ending::Stopped(StopReason::Overruled { command: key }));
        let mut plain = tested_rig(mode, Measurement::DEFAULT);
        plain.apply(&command).expect("possible");
        assert_eq!(loop_settings(&running.loops()[0]), loop_settings(&plain.loops()[0]), "{command:?}");
        checked_step(&mut running);
        match command {
            RigCommand::Mv { value, .. } => assert_eq!(running.loops()[0].control.mv(), value),
            RigCommand::Setpoint { level_cm, .. } => {
                assert_eq!(running.loops()[0].control.setpoint_cm, level_cm);
            }
            _ => assert_eq!(running.loops()[0].control.setpoint_cm, at_rest),
        }
    }
}

#[test]
fn a_refused_command_and_one_to_another_part_leave_the_test_alone() {
    let mut running = under_way(Mode::Automatic);
    for refused in [
        RigCommand::Mv { tag: tag(), value: 2.0 },
        RigCommand::Setpoint { tag: tag(), level_cm: 99.0 },
        RigCommand::Configuration { id: "nowhere".to_owned() },
        RigCommand::SteadyAt { tag: tag(), level_cm: 26.9 },
    ] {
        assert!(running.apply(&refused).is_err(), "{refused:?}");
    }
    let error = begin(&mut running, &relay_test());
    assert!(matches!(error, Err(CommandError::Excitation(ExcitationError::Busy { .. }))), "{error:?}");
    running.apply(&RigCommand::Valve { tag: "FV03".to_owned(), angle_deg: 89.0 }).expect("possible");
    assert!(running.excitation().is_some());
    let report = to_its_end(&mut running);
    assert_eq!(report.ending, Ending::Finished);
    let rows = &report.record.time_s;
    assert!(rows.windows(2).all(|w| (w[1] - w[0] - 0.2).abs() < 1e-9), "no sample is missing");
    let none = running.apply(&RigCommand::AbortExcitation { tag: tag() });
    assert!(matches!(none, Err(CommandError::Excitation(ExcitationError::NotRunning { .. }))), "{none:?}");
}

#[test]
fn another_configuration_and_another_state_end_it() {
    let mut running = under_way(Mode::Automatic);
    running.apply(&RigCommand::Configuration { id: "decoupled".to_owned() }).expect("possible");
    let report = running.ended_excitations().next().expect("ended");
    assert_eq!(report.ending, Ending::Stopped(StopReason::Configuration));
    for _ in 0..100 {
        checked_step(&mut running);
    }
    assert_eq!(running.loops()[0].control.actual_mode(), Mode::Automatic);
    let mut running = under_way(Mode::Automatic);
    running.apply(&RigCommand::SteadyAt { tag: tag(), level_cm: 14.0 }).expect("possible");
    let report = running.ended_excitations().next().expect("ended");
    assert_eq!(report.ending, Ending::Stopped(StopReason::Restarted));
    is_alive(&mut running);
}

#[test]
fn an_actuator_that_adds_up_is_put_back_as_well() {
    let law = Law::PidI2gl { clip: Clip::Output, sends: Sends::Increment };
    for mode in [Mode::Automatic, Mode::Manual] {
        let mut running = tested_rig(mode, Measurement::IDEAL);
        running.apply(&RigCommand::Law { tag: tag(), law }).expect("possible");
        checked_step(&mut running);
        let mv = running.loops()[0].control.mv();
        begin(&mut running, &excite(Signal::Step { size: 0.1, rest_share: 0.05, end: StepEnd::Back }))
            .expect("begins");
        for _ in 0..200 {
            checked_step(&mut running);
        }
        assert!((running.loops()[0].control.mv() - mv - 0.1).abs() < 1e-6, "moved");
        running.apply(&RigCommand::AbortExcitation { tag: tag() }).expect("possible");
        checked_step(&mut running);
        let after = running.loops()[0].control.mv();
        assert!(
            (after - mv).abs() < if mode == Mode::Manual { 1e-9 } else { 0.01 },
            "{mode:?}: {after} after {mv}"
        );
    }
}

/// A test with sizes and times from mild to impossible.
fn random_test(rng: &mut impl Rng) -> Excitation {
    let odd = [f64::NAN, f64::INFINITY, -1.0, 0.0, 1e-300, 1e9, 5.0];
    let mut size = |most: f64| {
        if rng.random_bool(0.05) { odd[rng.random_range(0..odd.len())] } else { rng.random_range(0.01..most) }
    };
    let (amplitude, time_s) = (size(0.8), size(30.0));
    let (width, budget_s, listen_s) = (size(0.3), size(600.0), size(20.0));
    let limits = ExcitationLimits { pv_low: Some(size(20.0)).filter(|v| *v < 12.0), ..Default::default() };
    let hysteresis = if rng.random_bool(0.5) { Hysteresis::Given(width) } else { Hysteresis::Noise(3.0) };
    let signal = match rng.random_range(0..7) {
        0 => Signal::Step { size: amplitude - 0.4, rest_share: 0.05, end: StepEnd::Back },
        1 => Signal::SetpointStep { size: 5.0 * amplitude - 2.0, rest_share: 0.1, end: StepEnd::Back },
        2 => Signal::Relay(Relay { hysteresis, amplitude_down: Some(width), ..Relay::new(amplitude) }),
        3 => Signal::Doublet { amplitude, hold_s: time_s },
        4 => Signal::Prbs { amplitude, clock_s: time_s, register: rng.random_range(1..7), periods: 1 },
        5 => Signal::SteppedSine(SteppedSine {
            agreement: 0.1,
            ..SteppedSine::new(amplitude, vec![width, 0.3])
        }),
        _ => Signal::UltimateGain(UltimateGain::new(10.0 * width, amplitude)),
    };
    let at_rest = if rng.random_bool(0.8) { AtRest::NotNeeded } else { AtRest::Required };
    Excitation { limits, budget_s, listen_s, at_rest, ..Excitation::new(signal) }
}

fn random_command(rng: &mut impl Rng) -> RigCommand {
    let value: f64 = rng.random_range(0.5..20.0);
    let gains = PidGains { kc: 0.1 * value, ti_s: 15.0 * value, td_s: 0.0, n: 10.0 };
    let modes = [Mode::Manual, Mode::Automatic, Mode::Automatic];
    match rng.random_range(0..14) {
        0 | 1 => RigCommand::Mode { tag: tag(), mode: modes[rng.random_range(0..3)] },
        2 => RigCommand::Setpoint { tag: tag(), level_cm: value },
        3 => RigCommand::Mv { tag: tag(), value: 0.2 * value },
        4 => RigCommand::Tuning { tag: tag(), tuning: PidTuning::new(gains) },
        5 => RigCommand::Law { tag: tag(), law: if value < 10.0 { Law::default() } else { Law::PID_2GL } },
        6 => RigCommand::Bump { tag: "TQ2".to_owned(), delta_cm: value - 10.0 },
        7 => RigCommand::Configuration {
            id: if value < 5.0 { "decoupled".to_owned() } else { "coupled".to_owned() },
        },
        8 => RigCommand::Fault { tag: "LT02".to_owned(), fault: Fault::BrokenWire },
        9 | 12 | 13 => RigCommand::Repair { tag: "LT02".to_owned(), kind: None },
        10 => RigCommand::SteadyAt { tag: tag(), level_cm: value },
        _ => RigCommand::AbortExcitation { tag: tag() },
    }
}

/// Two rigs get the same commands, and one of them tests besides: whenever no test runs, their loops have the same
/// settings, and no output is ever out of its limits.
#[test]
fn no_test_and_no_command_in_any_order_leaves_a_trace_in_a_loop() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
    let mut tested = tested_rig(Mode::Automatic, Measurement::DEFAULT);
    let mut plain = tested_rig(Mode::Automatic, Measurement::DEFAULT);
    let (mut begun, mut finished, mut compared) = (0, 0, 0);
    for _ in 0..10_000 {
        if rng.random_bool(0.3) {
            begun += usize::from(begin(&mut tested, &random_test(&mut rng)).is_ok());
        }
        if rng.random_bool(0.04) {
            let command = random_command(&mut rng);
            let done = tested.apply(&command).is_ok();
            if !matches!(command, RigCommand::AbortExcitation { .. }) {
                assert_eq!(plain.apply(&command).is_ok(), done, "{command:?}");
            }
        }
        for _ in 0..rng.random_range(1..60) {
            checked_step(&mut tested);
            plain.step();
            finished += tested.ended_excitations().filter(|r| r.ending == Ending::Finished).count();
            if tested.excitation_progress().is_none() {
                assert_eq!(loop_settings(&tested.loops()[0]), loop_settings(&plain.loops()[0]));
                let control = &tested.loops()[0].control;
                assert_eq!(control.actual_mode(), control.mode);
                compared += 1;
            }
        }
    }
    println!("{begun} begun, {finished} finished, {compared} samples compared");
    assert!(begun > 200 && finished > 30 && compared > 10_000, "{begun} {finished} {compared}");
}
