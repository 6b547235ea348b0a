//! Tests on the loops of running rigs: what they measure, and that they leave the loop as it was however they end.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{Duration, Instant};

use vasos_engine::control::{Law, LoopOptions, Mode, OutputLimits, PidGains, PidTuning};
use vasos_engine::daq::{RigControls, Source};
use vasos_engine::excitation::{
    AtRest, Ending, Excitation, ExcitationError, ExcitationReport, Finding, Hysteresis, Phase, Relay, Signal,
    StepEnd, SteppedSine, StopReason, UltimateGain, identify_report,
};
use vasos_engine::plant::{Fault, Measurement, Network, Plant, Reading, ReadingStatus, RigError};
use vasos_engine::session::{CommandError, EventKind, Rig, RigCommand, Session, SessionCommand};
use vasos_engine::sim::{ActiveLoop, ClosedLoop, run_excitation};
use vasos_io::rig::{load_scenario, parse_rig, preset, write_run_csv};

const TAG: &str = "LIC-02";

fn tag() -> String {
    TAG.to_owned()
}

fn rig(measurement: Measurement) -> Rig {
    Rig { network: preset("stad").expect("preset"), configuration: 0, measurement, seed: 3 }
}

fn closed(mode: Mode, measurement: Measurement) -> ClosedLoop {
    let mut closed =
        ClosedLoop::simulated(preset("stad").expect("preset"), 0, measurement, 3).expect("starts");
    closed.apply(&RigCommand::Mode { tag: tag(), mode }).expect("possible");
    for _ in 0..10 {
        closed.step();
    }
    closed
}

fn excite(signal: Signal) -> Excitation {
    Excitation { at_rest: AtRest::NotNeeded, listen_s: 10.0, ..Excitation::new(signal) }
}

fn begin(closed: &mut ClosedLoop, excitation: &Excitation) -> Result<(), CommandError> {
    closed.apply(&RigCommand::Excite { tag: tag(), excitation: Box::new(excitation.clone()) })
}

fn relay() -> Excitation {
    excite(Signal::Relay(Relay { hysteresis: Hysteresis::Given(0.1), ..Relay::new(0.3) }))
}

fn signals() -> Vec<Signal> {
    vec![
        Signal::Step { size: 0.1, rest_share: 0.05, end: StepEnd::Back },
        Signal::SetpointStep { size: 1.0, rest_share: 0.05, end: StepEnd::Back },
        Signal::Relay(Relay { hysteresis: Hysteresis::Given(0.1), ..Relay::new(0.3) }),
        Signal::Doublet { amplitude: 0.2, hold_s: 60.0 },
        Signal::Prbs { amplitude: 0.2, clock_s: 5.0, register: 5, periods: 1 },
        Signal::SteppedSine(SteppedSine { agreement: 0.05, ..SteppedSine::new(0.3, vec![0.1, 0.3]) }),
        Signal::UltimateGain(UltimateGain::new(4.0, 0.4)),
    ]
}

/// With its noise, the rig shows no oscillation under proportional control that its output could carry.
fn finds_nothing(signal: &Signal, measurement: Measurement) -> bool {
    matches!(signal, Signal::UltimateGain(_)) && measurement.noise
}

/// Everything of a loop that an operator sets.
fn settings(active: &ActiveLoop) -> impl PartialEq + std::fmt::Debug + use<> {
    let control = &active.control;
    let law = (*control.law(), control.tuning(), control.options().clone(), control.pv_filter_s());
    (active.spec.clone(), control.mode, control.setpoint_cm, law)
}

/// One sample, in which the output is finite and within its limits.
fn step(closed: &mut ClosedLoop) {
    closed.step();
    let control = &closed.loops()[0].control;
    let (mv, limits) = (control.mv(), control.limits());
    assert!((limits.low..=limits.high).contains(&mv), "{mv} at {} s", closed.time_s());
}

fn to_its_end(closed: &mut ClosedLoop) -> ExcitationReport {
    while !closed.has_ended_excitations() {
        step(closed);
    }
    closed.ended_excitations().next().expect("ended")
}

/// The loop controls again, and holds its level.
fn is_alive(closed: &mut ClosedLoop) {
    closed.apply(&RigCommand::Mode { tag: tag(), mode: Mode::Automatic }).expect("possible");
    for _ in 0..7500 {
        step(closed);
    }
    let error_cm = closed.readings()[0].level_cm - closed.loops()[0].control.setpoint_cm;
    assert!(error_cm.abs() < 0.5, "{error_cm}");
}

#[test]
fn every_test_leaves_the_loop_as_it_was() {
    for mode in [Mode::Automatic, Mode::Manual] {
        for measurement in [Measurement::IDEAL, Measurement::DEFAULT] {
            for signal in signals() {
                let mut closed = closed(mode, measurement);
                let (before, mv) = (settings(&closed.loops()[0]), closed.loops()[0].control.mv());
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
                assert_eq!(settings(&closed.loops()[0]), before, "{signal:?}");
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
    let mut closed = closed(Mode::Automatic, Measurement::IDEAL);
    let before = closed.loops()[0].control.mv();
    begin(&mut closed, &excite(Signal::Doublet { amplitude: 0.1, hold_s: 20.0 })).expect("begins");
    to_its_end(&mut closed);
    let mut last = closed.loops()[0].control.mv();
    assert!((last - before).abs() < 0.01, "{last} after {before}");
    for _ in 0..500 {
        step(&mut closed);
        let mv = closed.loops()[0].control.mv();
        assert!((mv - last).abs() < 0.005, "{last} to {mv}");
        last = mv;
    }
}

/// A test under way, moved and with the level off its rest.
fn under_way(mode: Mode) -> ClosedLoop {
    let mut closed = closed(mode, Measurement::DEFAULT);
    begin(&mut closed, &relay()).expect("begins");
    for _ in 0..150 {
        step(&mut closed);
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
            let before = settings(&closed.loops()[0]);
            end(&mut closed);
            let report = to_its_end(&mut closed);
            let Ending::Stopped(reason) = &report.ending else { panic!("{name}: finished") };
            assert!(expected(reason), "{name}: {reason}");
            assert_eq!(settings(&closed.loops()[0]), before, "{name}");
            step(&mut closed);
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
    let mut running = closed(Mode::Automatic, Measurement::DEFAULT);
    begin(&mut running, &limited).expect("begins");
    let report = to_its_end(&mut running);
    assert!(matches!(report.ending, Ending::Stopped(StopReason::PvLimit { high: 15.4, .. })));
    is_alive(&mut running);
    let short = Excitation { budget_s: 60.0, ..relay() };
    let mut running = closed(Mode::Manual, Measurement::DEFAULT);
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
        let mut plain = closed(mode, Measurement::DEFAULT);
        plain.apply(&command).expect("possible");
        assert_eq!(settings(&running.loops()[0]), settings(&plain.loops()[0]), "{command:?}");
        step(&mut running);
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
    let error = begin(&mut running, &relay());
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
        step(&mut running);
    }
    assert_eq!(running.loops()[0].control.actual_mode(), Mode::Automatic);
    let mut running = under_way(Mode::Automatic);
    running.apply(&RigCommand::SteadyAt { tag: tag(), level_cm: 14.0 }).expect("possible");
    let report = running.ended_excitations().next().expect("ended");
    assert_eq!(report.ending, Ending::Stopped(StopReason::Restarted));
    is_alive(&mut running);
}

#[test]
fn preconditions_are_refused_in_words() {
    let mut running = closed(Mode::Automatic, Measurement::DEFAULT);
    let error = begin(&mut running, &excite(Signal::Relay(Relay::new(2.0)))).expect_err("no room");
    assert!(matches!(error, CommandError::Excitation(ExcitationError::Margin { .. })), "{error}");
    let mut off = relay();
    off.limits.pv_low = Some(16.0);
    let error = begin(&mut running, &off).expect_err("outside");
    assert!(matches!(error, CommandError::Excitation(ExcitationError::PvOutside { .. })), "{error}");
    let nowhere = RigCommand::Excite { tag: "LIC-09".to_owned(), excitation: Box::new(relay()) };
    assert!(matches!(running.apply(&nowhere), Err(CommandError::UnknownTag { .. })));
    running.apply(&RigCommand::Fault { tag: "LT02".to_owned(), fault: Fault::BrokenWire }).expect("possible");
    step(&mut running);
    let error = begin(&mut running, &relay()).expect_err("no PV");
    assert!(matches!(error, CommandError::Excitation(ExcitationError::NoPv { .. })), "{error}");
    let mut moving = closed(Mode::Automatic, Measurement::DEFAULT);
    moving.apply(&RigCommand::Setpoint { tag: tag(), level_cm: 18.0 }).expect("possible");
    begin(&mut moving, &Excitation { at_rest: AtRest::Required, ..relay() }).expect("begins to listen");
    let report = to_its_end(&mut moving);
    assert!(matches!(report.ending, Ending::Stopped(StopReason::NotAtRest { .. })), "{:?}", report.ending);
}

/// On the noisy rig the relay's own estimate is far from the ultimate gain, and that of the fitted model is not.
#[test]
fn a_relay_on_the_noisy_rig_tells_the_ultimate_gain_by_its_model() {
    let signal = Signal::UltimateGain(UltimateGain::new(4.0, 0.4));
    let (_, exact) =
        run_excitation(&rig(Measurement::IDEAL), TAG, Some(15.0), &Excitation::new(signal)).expect("runs");
    let Finding::Ultimate(exact) = exact.finding else { panic!("{:?}", exact.ending) };
    let relay = Relay { hysteresis: Hysteresis::Given(0.15), cycles: 6, ..Relay::new(0.4) };
    let relay = Excitation { at_rest: AtRest::NotNeeded, ..Excitation::new(Signal::Relay(relay)) };
    let (run, report) = run_excitation(&rig(Measurement::DEFAULT), TAG, Some(15.0), &relay).expect("runs");
    assert_eq!(report.ending, Ending::Finished);
    let Finding::Relay(cycle) = report.finding else { panic!("no cycle") };
    let told = identify_report(&report).expect("a model");
    println!("{cycle:?}\n{:?} {} %\n{:?} {exact:?}", told.fit.model, told.fit.fit_percent, told.ultimate);
    let ultimate = told.ultimate.expect("a limit");
    assert!(cycle.ku < 0.3 * exact.ku && told.warnings.is_empty());
    assert!((ultimate.ku / exact.ku - 1.0).abs() < 0.3 && (ultimate.pu_s / exact.pu_s - 1.0).abs() < 0.3);
    assert_eq!(run.time_s.len(), report.record.time_s.len());
    assert_eq!(run.column("pv").expect("a column"), report.record.pv);
    assert_eq!(run.column("mv").expect("a column"), report.record.mv);
}

/// A first-order process behind the trait that live devices implement: no plant, no valves, nothing to set.
struct Device {
    network: Arc<Network>,
    level_cm: f64,
    input: f64,
    pipe: VecDeque<f64>,
}

impl Device {
    /// K = 4 cm/V, T = 40 s, L = 3 s, at rest at 10 cm with 2 V.
    fn new() -> Self {
        let network = preset("stad").expect("preset");
        Self { network, level_cm: 10.0, input: 2.0, pipe: VecDeque::from(vec![2.0; 15]) }
    }
}

impl Source for Device {
    fn network(&self) -> &Arc<Network> {
        &self.network
    }

    fn read(&mut self, readings: &mut [Reading]) {
        readings.fill(Reading { level_cm: self.level_cm, status: ReadingStatus::Good });
    }

    fn write(&mut self, _: usize, mv: f64) -> Result<f64, RigError> {
        self.input = mv.clamp(1.0, 3.5);
        Ok(self.input)
    }

    fn advance(&mut self, duration_s: f64) {
        self.pipe.push_back(self.input);
        let input = self.pipe.pop_front().unwrap_or(self.input);
        let share = -(-duration_s / 40.0).exp_m1();
        self.level_cm += share * (10.0 + 4.0 * (input - 2.0) - self.level_cm);
    }

    fn accelerates(&self) -> bool {
        false
    }

    fn rig(&mut self) -> Option<&mut dyn RigControls> {
        None
    }

    fn measurement(&self) -> Option<Measurement> {
        None
    }

    fn plant(&self) -> Option<&Plant> {
        None
    }
}

#[test]
fn a_live_source_is_tested_through_the_same_trait() {
    let mut live = ClosedLoop::new(Box::new(Device::new()), 0);
    live.apply(&RigCommand::Mode { tag: tag(), mode: Mode::Manual }).expect("possible");
    live.apply(&RigCommand::Mv { tag: tag(), value: 2.0 }).expect("possible");
    live.step();
    let relay = Excitation::new(Signal::Relay(Relay { amplitude_down: Some(0.3), ..Relay::new(0.5) }));
    begin(&mut live, &relay).expect("begins");
    let report = to_its_end(&mut live);
    assert_eq!(report.ending, Ending::Finished);
    assert_eq!(live.loops()[0].control.mv(), 2.0);
    let model = identify_report(&report).expect("a model").fit.model;
    let near = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-3;
    assert!(near(model.gain, 4.0) && near(model.time_constant_s, 40.0), "{model:?}");
    assert!(near(model.dead_time_s, 3.0), "{model:?}");
}

/// SimTank with three tanks, the level of the third over that of the first.
fn cascade() -> ClosedLoop {
    let text = vasos_io::rig::PRESETS.iter().find(|p| p.id == "simtank3").expect("preset").text;
    let head = text.split("[[configuration.loop]]").next().expect("a head");
    let loops = r#"
[[configuration.loop]]
id = "LIC-01"
sensor = "LT01"
pump = "BA01"
setpoint_cm = 10.0
mode = "cascade"
kc = 20.0
ti_s = 30.0

[[configuration.loop]]
id = "LIC-03"
sensor = "LT03"
cascade_to = "LIC-01"
setpoint_cm = 2.0
mode = "automatic"
kc = 2.0
ti_s = 120.0
"#;
    let network = parse_rig("loops.toml", &format!("{head}start_steady = true\n{loops}")).expect("a rig");
    let mut closed = ClosedLoop::simulated(network, 0, Measurement::IDEAL, 1).expect("starts");
    for _ in 0..20 {
        closed.step();
    }
    closed
}

#[test]
fn a_cascade_is_tested_at_either_loop_and_goes_on_without_a_bump() {
    for (tested, signal) in [
        ("LIC-03", Signal::Doublet { amplitude: 0.5, hold_s: 20.0 }),
        ("LIC-01", Signal::Doublet { amplitude: 2.0, hold_s: 20.0 }),
        ("LIC-01", Signal::SetpointStep { size: 0.5, rest_share: 0.05, end: StepEnd::Back }),
    ] {
        let mut closed = cascade();
        let settings = |closed: &ClosedLoop| {
            let setpoint_cm = closed.loops()[1].control.setpoint_cm;
            (closed.loops().iter().map(|l| l.control.mode).collect::<Vec<_>>(), setpoint_cm)
        };
        let before = settings(&closed);
        let listen_s = 30.0;
        let test = Box::new(Excitation { listen_s, ..Excitation::new(signal.clone()) });
        closed.apply(&RigCommand::Excite { tag: tested.to_owned(), excitation: test }).expect("begins");
        while closed.excitation_progress().is_some_and(|p| p.elapsed_s < listen_s + 5.0) {
            closed.step();
        }
        assert!(closed.excitation().is_some(), "{tested} {signal:?}");
        closed.apply(&RigCommand::AbortExcitation { tag: tested.to_owned() }).expect("possible");
        assert_eq!(settings(&closed), before, "{tested} {signal:?}");
        closed.step();
        let (mut last, range) = (closed.loops()[0].control.setpoint_cm, 27.0);
        for _ in 0..200 {
            closed.step();
            let setpoint_cm = closed.loops()[0].control.setpoint_cm;
            assert!(
                (setpoint_cm - last).abs() < 0.01 * range,
                "{tested} {signal:?}: {last} to {setpoint_cm}"
            );
            last = setpoint_cm;
        }
        assert_eq!(closed.loops()[0].control.actual_mode(), Mode::Cascade);
    }
}

#[test]
fn an_outer_loop_is_tested_only_while_its_inner_loop_listens() {
    let doublet = || Box::new(Excitation::new(Signal::Doublet { amplitude: 0.5, hold_s: 20.0 }));
    let excite = || RigCommand::Excite { tag: "LIC-03".to_owned(), excitation: doublet() };
    let inner = |mode| RigCommand::Mode { tag: "LIC-01".to_owned(), mode };
    let mut closed = cascade();
    closed.apply(&excite()).expect("begins");
    closed.step();
    closed.apply(&inner(Mode::Automatic)).expect("possible");
    closed.step();
    let report = closed.ended_excitations().next().expect("ended");
    assert_eq!(report.ending, Ending::Stopped(StopReason::Unlinked));
    assert!(matches!(closed.apply(&excite()), Err(CommandError::Follows { .. })));
}

fn wait(what: &str, mut done: impl FnMut() -> bool) {
    let start = Instant::now();
    while !done() {
        assert!(start.elapsed() < Duration::from_secs(20), "waited in vain for: {what}");
        std::thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn a_session_tells_how_a_test_goes_on_and_what_came_of_it() {
    let session = Session::start(&rig(Measurement::DEFAULT), Box::new(|| ())).expect("starts");
    assert!(session.send(SessionCommand::Speed(1000.0)) && session.send(SessionCommand::Run));
    wait("samples", || session.snapshot().time_s > 5.0);
    let excite = || RigCommand::Excite { tag: tag(), excitation: Box::new(relay()) };
    assert!(session.send(SessionCommand::Rig(excite())));
    wait("the test in the snapshot", || session.snapshot().excitation.is_some());
    let mut kinds = vec![];
    wait("its end", || {
        kinds.extend(session.events().map(|e| e.kind));
        session.samples().for_each(drop);
        kinds.iter().any(|k| matches!(k, EventKind::ExcitationEnded(_)))
    });
    assert!(session.send(SessionCommand::Pause));
    wait("a pause", || !session.snapshot().running);
    assert_eq!(session.snapshot().excitation, None);
    let begun = kinds.iter().position(|k| matches!(k, EventKind::Done(RigCommand::Excite { .. })));
    let phases: Vec<Phase> = kinds
        .iter()
        .filter_map(|k| match k {
            EventKind::ExcitationProgress { progress, .. } => Some(progress.phase),
            _ => None,
        })
        .collect();
    assert!(begun.is_some() && phases.starts_with(&[Phase::Listening, Phase::FirstPulse, Phase::Cycling]));
    assert!(phases.len() < 20, "at most one word in a few seconds: {}", phases.len());
    let report: Option<Arc<ExcitationReport>> = kinds.iter().find_map(|k| match k {
        EventKind::ExcitationEnded(report) => Some(report.clone()),
        _ => None,
    });
    assert_eq!(report.expect("a report").ending, Ending::Finished);
    // A new run ends a test of the one before.
    assert!(session.send(SessionCommand::Rig(excite())));
    assert!(session.send(SessionCommand::Load(Box::new(rig(Measurement::DEFAULT)))));
    let mut ended = None;
    wait("its end by the new run", || {
        ended = session.events().find_map(|e| match e.kind {
            EventKind::ExcitationEnded(report) => Some((e.run, report.ending.clone())),
            _ => None,
        });
        ended.is_some()
    });
    assert_eq!(ended, Some((0, Ending::Stopped(StopReason::NewRun))));
}

#[test]
fn a_scenario_file_runs_a_test_and_its_csv_shows_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("relay.toml");
    let text = "schema = 1\nrig = \"stad\"\nduration_s = 400.0\n\n[[event]]\nat_s = 5.0\n\
                excite = { tag = \"LIC-02\", excitation = { signal = { relay = { amplitude = 0.8 } }, at_rest = \"not_needed\" } }\n";
    std::fs::write(&path, text).expect("written");
    let (scenario, network) = load_scenario(&path).expect("a scenario");
    let run = vasos_engine::sim::run_scenario(network, &scenario).expect("runs");
    assert_eq!(run.excitations.len(), 1);
    assert_eq!(run.excitations[0].ending, Ending::Finished);
    let csv = folder.path().join("run.csv");
    write_run_csv(&run, &csv).expect("written");
    let written = std::fs::read_to_string(csv).expect("there");
    assert_eq!(written.lines().count(), run.time_s.len() + 1);
    for (wrong, at) in [("amplitude = 0.8", "amplitudes = 0.8"), ("not_needed", "never")] {
        std::fs::write(&path, text.replace(wrong, at)).expect("written");
        let error = load_scenario(&path).expect_err("refused").to_string();
        assert!(error.contains("line 7"), "{error}");
    }
}
