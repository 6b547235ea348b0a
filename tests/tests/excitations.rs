//! Tests on the loops of running rigs: what they measure, in cascades, sessions, files and on live sources.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{Duration, Instant};

use vasos_engine::control::{Clip, Law, Mode, Sends};
use vasos_engine::daq::{RigControls, Source};
use vasos_engine::excitation::{
    AtRest, Ending, Excitation, ExcitationError, ExcitationReport, Finding, Hysteresis, Phase, Relay, Signal,
    StepEnd, StopReason, UltimateGain, identify_report,
};
use vasos_engine::model::ProcessModel;
use vasos_engine::plant::{Fault, Measurement, Network, Plant, Reading, ReadingStatus, RigError};
use vasos_engine::session::{CommandError, EventKind, Rig, RigCommand, Session, SessionCommand};
use vasos_engine::sim::{ClosedLoop, run_excitation};
use vasos_io::export::write_run;
use vasos_io::rig::{load_scenario, preset};
use vasos_tests::{
    CASCADE, TAG, begin, checked_step, excite, relay_test, tag, tested_rig, three_tanks, to_its_end,
};

fn rig(measurement: Measurement) -> Rig {
    Rig { network: preset("stad").expect("preset"), configuration: 0, measurement, seed: 3 }
}

#[test]
fn preconditions_are_refused_in_words() {
    let mut running = tested_rig(Mode::Automatic, Measurement::DEFAULT);
    let error = begin(&mut running, &excite(Signal::Relay(Relay::new(2.0)))).expect_err("no room");
    assert!(matches!(error, CommandError::Excitation(ExcitationError::Margin { .. })), "{error}");
    let mut off = relay_test();
    off.limits.pv_low = Some(16.0);
    let error = begin(&mut running, &off).expect_err("outside");
    assert!(matches!(error, CommandError::Excitation(ExcitationError::PvOutside { .. })), "{error}");
    let nowhere = RigCommand::Excite { tag: "LIC-09".to_owned(), excitation: Box::new(relay_test()) };
    assert!(matches!(running.apply(&nowhere), Err(CommandError::UnknownTag { .. })));
    running.apply(&RigCommand::Fault { tag: "LT02".to_owned(), fault: Fault::BrokenWire }).expect("possible");
    checked_step(&mut running);
    let error = begin(&mut running, &relay_test()).expect_err("no PV");
    assert!(matches!(error, CommandError::Excitation(ExcitationError::NoPv { .. })), "{error}");
    let mut moving = tested_rig(Mode::Automatic, Measurement::DEFAULT);
    moving.apply(&RigCommand::Setpoint { tag: tag(), level_cm: 18.0 }).expect("possible");
    begin(&mut moving, &Excitation { at_rest: AtRest::Required, ..relay_test() }).expect("begins to listen");
    let report = to_its_end(&mut moving);
    assert!(matches!(report.ending, Ending::Stopped(StopReason::NotAtRest { .. })), "{:?}", report.ending);
    assert_eq!(report.moved_at_s, None);
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
    println!("{cycle:?}\n{:?} {} %\n{:?} {exact:?}", told.fit().model, told.fit().fit_percent, told.ultimate);
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
    let ProcessModel::Fopdt(model) = identify_report(&report).expect("a model").fit().model else {
        panic!("no first order")
    };
    let near = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-3;
    assert!(near(model.gain, 4.0) && near(model.time_constant_s, 40.0), "{model:?}");
    assert!(near(model.dead_time_s, 3.0), "{model:?}");
}

/// SimTank with three tanks, the level of the third over that of the first.
fn cascade() -> ClosedLoop {
    let network = three_tanks(CASCADE).expect("a rig");
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
    let excite = || RigCommand::Excite { tag: tag(), excitation: Box::new(relay_test()) };
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
    write_run(&run, &csv).expect("written");
    let written = std::fs::read_to_string(csv).expect("there");
    assert_eq!(written.lines().count(), run.time_s.len() + 1);
    for (wrong, at) in [("amplitude = 0.8", "amplitudes = 0.8"), ("not_needed", "never")] {
        std::fs::write(&path, text.replace(wrong, at)).expect("written");
        let error = load_scenario(&path).expect_err("refused").to_string();
        assert!(error.contains("line 7"), "{error}");
    }
}

#[test]
fn an_output_by_hand_reaches_an_actuator_that_adds_up() {
    let law = Law::PidI2gl { clip: Clip::Output, sends: Sends::Increment };
    let mut manual = tested_rig(Mode::Manual, Measurement::IDEAL);
    manual.apply(&RigCommand::Law { tag: tag(), law }).expect("possible");
    manual.apply(&RigCommand::Mv { tag: tag(), value: 2.7 }).expect("possible");
    checked_step(&mut manual);
    assert_eq!(manual.loops()[0].control.mv(), 2.7);
}
