//! Several loops in one rig: each its own law, cascades, feed-forward, and how files and commands are refused.

use std::sync::Arc;

use vasos_engine::analyze::Excitation;
use vasos_engine::control::{Action, Clip, Law, LoopOptions, Mode, OutputLimits, PidGains, PidTuning, Sends};
use vasos_engine::document::{Consequence, Document, DocumentCommand, History, rig_commands};
use vasos_engine::plant::{Measurement, Network, RigError};
use vasos_engine::session::{CommandError, RigCommand};
use vasos_engine::sim::{ClosedLoop, LoopTarget, Scenario, run_scenario};
use vasos_io::rig::preset;
use vasos_tests::{CASCADE, three_tanks};

fn closed(network: Arc<Network>) -> ClosedLoop {
    ClosedLoop::simulated(network, 0, Measurement::IDEAL, 1).expect("starts")
}

fn apply(closed: &mut ClosedLoop, command: RigCommand) {
    closed.apply(&command).unwrap_or_else(|error| panic!("{command:?}: {error}"));
}

fn mode(tag: &str, mode: Mode) -> RigCommand {
    RigCommand::Mode { tag: tag.to_owned(), mode }
}

fn level(closed: &ClosedLoop, tank: usize) -> f64 {
    closed.source().plant().expect("simulated").levels_cm()[tank]
}

#[test]
fn on_off_pid_and_manual_live_in_one_rig() {
    let mut closed = closed(preset("simtank3").expect("preset"));
    let on_off = Law::OnOff { gap_cm: 0.5, action: Action::Reverse };
    apply(&mut closed, RigCommand::Law { tag: "LIC-01".to_owned(), law: on_off });
    apply(&mut closed, RigCommand::Law { tag: "LIC-02".to_owned(), law: Law::PID_2GL });
    apply(&mut closed, mode("LIC-02", Mode::Automatic));
    apply(&mut closed, RigCommand::Mv { tag: "LIC-03".to_owned(), value: 12.0 });
    let mut outputs = std::collections::BTreeSet::new();
    for k in 0..6000 {
        closed.step();
        if k > 3000 {
            outputs.insert(closed.loops()[0].control.mv().to_bits());
            assert!((level(&closed, 0) - 10.0).abs() < 0.8, "the on/off loop swings about its setpoint");
            assert!((level(&closed, 1) - 8.0).abs() < 0.5, "{}", level(&closed, 1));
        }
        assert_eq!(closed.loops()[2].control.mv(), 12.0);
    }
    assert_eq!(outputs, [0.0_f64.to_bits(), 100.0_f64.to_bits()].into());
}

#[test]
fn a_cascade_starts_at_rest_and_follows_its_outer_setpoint() {
    let mut closed = closed(three_tanks(CASCADE).expect("a rig"));
    let inner = &closed.loops()[0];
    assert_eq!((inner.target, inner.outer), (LoopTarget::Pump(0), Some(1)));
    assert_eq!((closed.loops()[1].target, closed.loops()[1].pump), (LoopTarget::Loop(0), 0));
    assert!((level(&closed, 2) - 2.0).abs() < 1e-6, "the outer setpoint decides where it rests");
    let (start, mv) = (level(&closed, 0), inner.control.mv());
    for _ in 0..20 {
        closed.step();
    }
    assert!((closed.loops()[0].control.mv() - mv).abs() < 1e-4, "it rests");
    assert!((closed.loops()[0].control.setpoint_cm - start).abs() < 1e-4);
    apply(&mut closed, RigCommand::Setpoint { tag: "LIC-03".to_owned(), level_cm: 3.0 });
    for _ in 0..20_000 {
        closed.step();
    }
    assert!((level(&closed, 2) - 3.0).abs() < 1e-3, "{}", level(&closed, 2));
    let refused = closed.apply(&RigCommand::Setpoint { tag: "LIC-01".to_owned(), level_cm: 5.0 });
    assert!(matches!(refused, Err(CommandError::Cascade { .. })), "{refused:?}");
}

#[test]
fn leaving_and_entering_cascade_brings_no_jump() {
    let mut closed = closed(three_tanks(CASCADE).expect("a rig"));
    apply(&mut closed, RigCommand::Setpoint { tag: "LIC-03".to_owned(), level_cm: 3.0 });
    for _ in 0..100 {
        closed.step();
    }
    let sp = |closed: &ClosedLoop| closed.loops()[0].control.setpoint_cm;
    let before = sp(&closed);
    apply(&mut closed, mode("LIC-01", Mode::Automatic));
    closed.step();
    assert_eq!(sp(&closed), before, "its own setpoint starts where the remote one was");
    assert_eq!(closed.loops()[1].control.actual_mode(), Mode::Manual, "the outer loop waits");
    assert_eq!(closed.loops()[1].control.mode, Mode::Automatic);
    let refused = closed.apply(&RigCommand::Mv { tag: "LIC-03".to_owned(), value: 7.0 });
    assert!(matches!(refused, Err(CommandError::Automatic { .. })), "{refused:?}");
    apply(&mut closed, mode("LIC-03", Mode::Manual));
    let refused = closed.apply(&RigCommand::Mv { tag: "LIC-03".to_owned(), value: 7.0 });
    assert!(matches!(refused, Err(CommandError::Follows { .. })), "{refused:?}");
    apply(&mut closed, mode("LIC-03", Mode::Automatic));
    apply(&mut closed, RigCommand::Setpoint { tag: "LIC-01".to_owned(), level_cm: 12.0 });
    for _ in 0..500 {
        closed.step();
        assert_eq!(closed.loops()[1].control.mv(), sp(&closed), "the outer output follows");
    }
    apply(&mut closed, mode("LIC-01", Mode::Cascade));
    let error = 3.0 - level(&closed, 2);
    closed.step();
    let step = 2.0 * 0.5 / (2.0 * 120.0) * 2.0 * error;
    assert!((sp(&closed) - 12.0 - step).abs() < 1e-2 * step.abs() + 1e-9, "{} {step}", sp(&closed) - 12.0);
    // An outer loop in manual gives the setpoint by hand.
    apply(&mut closed, mode("LIC-03", Mode::Manual));
    apply(&mut closed, RigCommand::Mv { tag: "LIC-03".to_owned(), value: 9.0 });
    closed.step();
    assert_eq!(sp(&closed), 9.0);
}

/// The outer loop must not lead the inner setpoint on where the pump cannot follow.
#[test]
fn an_outer_loop_holds_while_its_inner_loop_is_at_a_limit() {
    let mut closed = closed(three_tanks(CASCADE).expect("a rig"));
    let low = OutputLimits { high: Some(closed.loops()[0].control.mv() + 1.0), ..OutputLimits::default() };
    let options = Box::new(LoopOptions { output: low, ..LoopOptions::default() });
    apply(&mut closed, RigCommand::Options { tag: "LIC-01".to_owned(), options });
    apply(&mut closed, RigCommand::Setpoint { tag: "LIC-03".to_owned(), level_cm: 4.0 });
    let mut most = 0.0_f64;
    for _ in 0..8000 {
        closed.step();
        most = most.max(closed.loops()[0].control.setpoint_cm);
    }
    let held = closed.loops()[0].control.setpoint_cm;
    assert!(most < 20.0, "the setpoint wound up to {most} cm");
    apply(&mut closed, RigCommand::Setpoint { tag: "LIC-03".to_owned(), level_cm: 1.5 });
    closed.step();
    assert!(closed.loops()[0].control.setpoint_cm < held, "the other way is free at once");
}

/// A second stream into tank 3 disturbs the level there; its pump's input is known.
#[test]
fn feed_forward_meets_a_disturbance_before_the_level_moves() {
    let run = |feedforward: &str| {
        let loops = format!(
            "[[configuration.loop]]\nid = \"LIC-02\"\nsensor = \"LT02\"\npump = \"BA02\"\n\
             setpoint_cm = 8.0\nmode = \"automatic\"\nkc = 5.0\nti_s = 100.0\n{feedforward}"
        );
        let mut closed = closed(three_tanks(&loops).expect("a rig"));
        closed.step();
        apply(&mut closed, RigCommand::Mv { tag: "BA03".to_owned(), value: 15.0 });
        let mut area = 0.0;
        for _ in 0..4000 {
            closed.step();
            area += (level(&closed, 1) - 8.0).abs() * 0.5;
        }
        area
    };
    let without = run("");
    let with = run("options = { feedforward = { from = \"BA03\", gain = -0.62, lag_s = 25.0 } }");
    assert!(with < 0.5 * without, "{with} of {without} cm·s");
}

#[test]
fn wrong_loops_are_refused_with_loop_field_and_value() {
    let change = |from: &str, to: &str| {
        assert!(CASCADE.contains(from), "{from}");
        three_tanks(&CASCADE.replacen(from, to, 1)).expect_err(to).to_string()
    };
    for (from, to, said) in [
        ("pump = \"BA01\"", "pump = \"BA01\"\ncascade_to = \"LIC-03\"", "LIC-01 must write one thing"),
        ("pump = \"BA01\"", "cascade_to = \"LIC-03\"", "leads to no pump"),
        ("pump = \"BA01\"\n", "", "LIC-01 must write one thing"),
        ("cascade_to = \"LIC-01\"", "cascade_to = \"LIC-09\"", "LIC-09"),
        ("cascade_to = \"LIC-01\"", "pump = \"BA03\"", "LIC-01 cannot be in cascade"),
        ("cascade_to = \"LIC-01\"", "pump = \"BA01\"", "LIC-01 and LIC-03 both write BA01"),
        ("kc = 20.0", "", "LIC-01: kc = NaN"),
        ("kc = 20.0", "kc = 0.0", "LIC-01: kc = 0"),
        ("ti_s = 30.0", "", "LIC-01: ti_s = ∞"),
        ("kc = 20.0", "gains = { form = \"parallel\", kp = 0.0, ki = 1.0 }", "Kp = 0"),
        ("kc = 20.0", "kc = 20.0\ngains = { form = \"series\", kc = 2.0 }", "LIC-01: kc = 20"),
        ("kc = 20.0", "kc = 2.0\nlaw = { kind = \"magic\" }", "magic"),
        ("kc = 20.0", "kc = 2.0\nlaw = { kind = \"on_off\", gap_cm = -1.0 }", "gap_cm = -1"),
        ("kc = 20.0", "kc = 2.0\nlaw = { kind = \"pid_2gl\", bias = 101.0 }", "bias = 101"),
        ("kc = 20.0", "kc = 2.0\noptions = { output = { high = 101.0 } }", "output.high = 101"),
        ("kc = 20.0", "kc = 2.0\noptions = { output = { low = 50.0, high = 50.0 } }", "output.high = 50"),
        ("kc = 20.0", "kc = 2.0\noptions = { setpoint = { ramp_cm_s = 0.0 } }", "setpoint.ramp_cm_s = 0"),
        ("kc = 20.0", "kc = 2.0\noptions = { feedforward = { from = \"BA01\", gain = 1.0 } }", "BA01"),
        (
            "kc = 20.0",
            "kc = 2.0\noptions = { feedforward = { from = \"LT03\", gain = 1.0, lead_s = 1.0 } }",
            "feedforward.lag_s = 0",
        ),
        (
            "kc = 20.0",
            "kc = 2.0\noptions = { schedule = [{ level_cm = 1.0, kc = 1.0 }, { level_cm = 1.0, kc = 2.0 }] }",
            "schedule.level_cm = 1",
        ),
        (
            "kc = 20.0",
            "kc = 2.0\noptions = { schedule = [{ level_cm = 1.0, kc = 1.0 }, { level_cm = 2.0, kc = -2.0 }] }",
            "schedule.kc = -2",
        ),
        (
            "kc = 20.0",
            "kc = 2.0\noptions = { smith = { gain = 0.0, time_constant_s = 1.0, dead_time_s = 1.0 } }",
            "smith.gain = 0",
        ),
    ] {
        let error = change(from, to);
        assert!(error.contains(said), "{to}: {error}");
    }
}

#[test]
fn a_running_loop_refuses_what_its_file_would() {
    let mut closed = closed(three_tanks(CASCADE).expect("a rig"));
    let tag = || "LIC-03".to_owned();
    let p = PidTuning::new(PidGains::p(2.0));
    assert!(closed.apply(&RigCommand::Tuning { tag: tag(), tuning: p }).is_err(), "PID-I2GL needs Ti");
    apply(&mut closed, RigCommand::Law { tag: tag(), law: Law::PID_2GL });
    apply(&mut closed, RigCommand::Tuning { tag: tag(), tuning: p });
    let back = closed.apply(&RigCommand::Law { tag: tag(), law: Law::default() });
    assert!(matches!(back, Err(CommandError::Rig(RigError::Value { field: "ti_s", .. }))), "{back:?}");
    let alone = closed.apply(&mode("LIC-03", Mode::Cascade));
    assert!(matches!(alone, Err(CommandError::Rig(RigError::NoOuterLoop { .. }))), "{alone:?}");
    assert_eq!(closed.loops()[1].control.law().id(), "pid_2gl", "nothing has changed");
}

/// Law and options travel with the document: to the rig, back by undo, and again after a reload.
#[test]
fn law_and_options_are_undone_and_reach_a_reloaded_rig() {
    let network = three_tanks(CASCADE).expect("a rig");
    let mut history = History::new(Document::new(network.clone()));
    let tag = || "LIC-03".to_owned();
    let mut options = LoopOptions::default();
    options.setpoint.ramp_cm_s = Some(0.1);
    let p = PidTuning::new(PidGains::p(2.0));
    let changes = [
        DocumentCommand::Law(tag(), Law::PID_2GL),
        DocumentCommand::Tuning(tag(), p),
        DocumentCommand::Options(tag(), Box::new(options.clone())),
        DocumentCommand::Mode("LIC-01".to_owned(), Mode::Automatic),
        DocumentCommand::Setpoint("LIC-01".to_owned(), 11.0),
    ];
    let mut running = closed(network.clone());
    let agree = |running: &mut ClosedLoop, before: &Document, after: &Document| {
        let Consequence::Commands(commands) = rig_commands(before, after) else { panic!("no reload") };
        commands.into_iter().for_each(|command| apply(running, command));
        running.step();
    };
    for change in changes {
        let before = history.document().clone();
        history.apply(&change).unwrap_or_else(|error| panic!("{change:?}: {error}"));
        history.seal();
        agree(&mut running, &before, history.document());
    }
    let refused = history.apply(&DocumentCommand::Law(tag(), Law::default()));
    assert!(refused.is_err(), "PID-I2GL without integral action");
    let check = |running: &ClosedLoop| {
        let [inner, outer] = running.loops() else { panic!("two loops") };
        assert_eq!((inner.control.mode, inner.control.setpoint_cm), (Mode::Automatic, 11.0));
        assert_eq!((outer.control.law(), outer.control.options()), (&Law::PID_2GL, &options));
        assert_eq!(outer.control.tuning(), p);
    };
    check(&running);
    let mut reloaded = closed(network);
    for command in history.document().rig.commands_after_load() {
        apply(&mut reloaded, command);
    }
    check(&reloaded);
    for _ in 0..5 {
        let before = history.document().clone();
        assert!(history.undo());
        agree(&mut running, &before, history.document());
    }
    let [inner, outer] = running.loops() else { panic!("two loops") };
    assert_eq!((inner.control.mode, outer.control.law().id()), (Mode::Cascade, "pid_i2gl"));
    assert_eq!(outer.control.options(), &LoopOptions::default());
}

/// The outer loop's figures begin at its setpoint step; the inner loop's setpoint moves all the time.
#[test]
fn figures_begin_at_the_last_setpoint_step() {
    let network = three_tanks(CASCADE).expect("a rig");
    let text = "schema = 1\nrig = \"x\"\nduration_s = 3000.0\nmeasurement = { noise = false, quantisation = false, \
                resolution = false }\n[[event]]\nat_s = 100.0\nsetpoint = { tag = \"LIC-03\", level_cm = 3.0 }\n";
    let scenario: Scenario = toml::from_str(text).expect("a scenario");
    let figures = run_scenario(network, &scenario).expect("runs").figures();
    let [inner, outer] = &figures[..] else { panic!("two loops: {figures:?}") };
    assert_eq!((inner.excitation, inner.from_s), (Excitation::Load, 0.0));
    assert_eq!((outer.excitation, outer.from_s), (Excitation::Setpoint, 100.0));
    let metrics = outer.metrics.as_ref().expect("figures");
    assert!((metrics.final_value - 3.0).abs() < 0.05 && metrics.rise_time_s.is_some(), "{metrics:?}");
    // PID-I2GL, slow and far from its limits: ∫ e dt = Ti/Kc·Δu.
    let integral = 120.0 / 2.0 * (metrics.max_u - metrics.min_u);
    assert!(metrics.ie > 0.0 && metrics.ie < 1.5 * integral, "{} {integral}", metrics.ie);
}

/// Spec control.md: unfiltered, the paper's AMIGO 7/15/1 has its MV at a limit most of the time; increments that
/// the limiter cuts are lost to one side and the level sinks. Clipping the integral alone keeps it.
#[test]
fn val_noise_at_the_limits_lets_the_level_sink_unless_the_integral_alone_is_clipped() {
    let mean = |clip| {
        let network = preset("stad").expect("preset");
        let mut closed = ClosedLoop::simulated(network, 0, Measurement::DEFAULT, 7).expect("starts");
        let tag = || "LIC-02".to_owned();
        let tuning = PidTuning::new(PidGains::pid(7.0, 15.0, 1.0));
        apply(&mut closed, RigCommand::Tuning { tag: tag(), tuning });
        let law = Law::PidI2gl { clip, sends: Sends::Position };
        apply(&mut closed, RigCommand::Law { tag: tag(), law });
        let (mut sum, mut at_limit) = (0.0, 0);
        for k in 0..9000 {
            closed.step();
            if k >= 4500 {
                sum += level(&closed, 1) / 4500.0;
                at_limit += usize::from(closed.loops()[0].control.at_limit().is_some());
            }
        }
        (sum, at_limit as f64 / 4500.0)
    };
    let (whole, integral) = (mean(Clip::Output), mean(Clip::Integral));
    println!("mean level and share at a limit: {whole:?} clipped whole, {integral:?} clipped integral");
    assert!(whole.1 > 0.5 && whole.0 < 14.0, "{whole:?}");
    assert!((integral.0 - 15.0).abs() < 0.3, "{integral:?}");
}
