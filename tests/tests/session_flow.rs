//! The session under everything a face can send.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use rand::{Rng, RngExt, SeedableRng};
use vasos_engine::control::{
    Action, AntiWindup, Clip, Deadband, Feedforward, Law, LoopOptions, Mode, OutputLimits, PidGains,
    PidTuning, SchedulePoint, Sends, SetpointPath, SmithModel,
};
use vasos_engine::document::{Document, DocumentCommand};
use vasos_engine::excitation::{AtRest, Excitation, Relay, Signal, StepEnd, UltimateGain};
use vasos_engine::plant::spec::ValveLaw;
use vasos_engine::plant::{Measurement, Network, RigSpec};
use vasos_engine::session::{
    Alarm, CommandError, Event, EventKind, Rig, RigCommand, RunStart, Session, SessionCommand, Sink,
};
use vasos_engine::signal::{ChannelKind, SampleBlock};
use vasos_engine::sim::{ClosedLoop, Scenario, ScenarioError, check_starts, run_scenario};
use vasos_io::rig::{PRESETS, preset};

fn rig(id: &str) -> Rig {
    Rig { network: preset(id).expect("preset"), configuration: 0, measurement: Measurement::DEFAULT, seed: 1 }
}

/// A rig sampled so fast that many samples pass in a second of the test.
fn fast(id: &str) -> Rig {
    let mut spec = preset(id).expect("preset").spec.clone();
    spec.sample_time_s = 0.05;
    let network = Arc::new(Network::new(spec).expect("valid"));
    Rig { network, ..rig(id) }
}

fn start(id: &str) -> Session {
    Session::start(&rig(id), Box::new(|| ())).expect("starts")
}

fn send(session: &Session, command: RigCommand) {
    assert!(session.send(SessionCommand::Rig(command)));
}

fn wait(what: &str, mut done: impl FnMut() -> bool) {
    let start = Instant::now();
    while !done() {
        assert!(start.elapsed() < Duration::from_secs(20), "waited in vain for: {what}");
        std::thread::sleep(Duration::from_millis(2));
    }
}

fn events(session: &Session) -> Vec<Event> {
    session.events().collect()
}

#[test]
fn it_starts_at_rest_and_runs_at_the_speed_it_is_told() {
    let session = start("stad");
    let first = session.snapshot();
    assert!(!first.running && first.time_s == 0.0);
    assert!((first.tanks[1].level_cm - 15.0).abs() < 1e-6, "the coupled loop starts at its setpoint");
    assert!(session.send(SessionCommand::Speed(1000.0)) && session.send(SessionCommand::Run));
    wait("100 s of the run", || session.snapshot().time_s > 100.0);
    assert!(session.send(SessionCommand::Pause));
    wait("a pause", || !session.snapshot().running);
    let (mut rows, mut last_s) = (0, -1.0);
    wait("the samples", || {
        for block in session.samples() {
            assert!(
                block.time_s.iter().all(|&t| {
                    let later = t > last_s;
                    last_s = t;
                    later
                }),
                "time goes forward"
            );
            rows += block.time_s.len();
        }
        rows as u64 == session.snapshot().samples
    });
    let before = session.snapshot().samples;
    assert!(session.send(SessionCommand::Step));
    wait("one step", || session.snapshot().samples == before + 1);
}

#[test]
fn wrong_values_are_refused_in_words_and_change_nothing() {
    let session = start("stad");
    let tag = || "LIC-02".to_owned();
    let before = session.snapshot();
    send(&session, RigCommand::Setpoint { tag: tag(), level_cm: 30.0 });
    send(&session, RigCommand::Setpoint { tag: tag(), level_cm: f64::NAN });
    send(&session, RigCommand::Mv { tag: tag(), value: 2.0 });
    send(&session, RigCommand::Valve { tag: "FV01".to_owned(), angle_deg: 91.0 });
    send(&session, RigCommand::Bump { tag: "TQ9".to_owned(), delta_cm: 1.0 });
    send(&session, RigCommand::Tuning { tag: tag(), tuning: PidTuning::new(PidGains::p(2.0)) });
    send(&session, RigCommand::SteadyAt { tag: tag(), level_cm: 25.0 });
    assert!(session.send(SessionCommand::Speed(0.0)));
    let mut refused = vec![];
    wait("eight refusals", || {
        refused.extend(events(&session).into_iter().filter_map(|e| match e.kind {
            EventKind::Refused(error) => Some(error),
            _ => None,
        }));
        refused.len() == 8
    });
    assert!(matches!(refused[0], CommandError::Setpoint { rim_cm: 27.0, .. }));
    assert!(matches!(refused[2], CommandError::Automatic { .. }));
    println!("{}", refused.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"));
    let after = session.snapshot();
    assert_eq!((&after.tanks, &after.valves), (&before.tanks, &before.valves));
    assert_eq!(after.loops[0].tuning, before.loops[0].tuning);
    assert_eq!(after.loops[0].setpoint_cm, before.loops[0].setpoint_cm);
}

#[test]
fn manual_and_back_and_coupled_to_decoupled_bring_no_bump() {
    let mut closed =
        ClosedLoop::simulated(preset("stad").expect("preset"), 0, Measurement::IDEAL, 1).expect("starts");
    let mv = |closed: &ClosedLoop| closed.loops()[0].control.mv();
    for _ in 0..50 {
        closed.step();
    }
    let before = mv(&closed);
    let mode = |mode| RigCommand::Mode { tag: "LIC-02".to_owned(), mode };
    closed.apply(&mode(Mode::Manual)).expect("manual");
    closed.step();
    assert_eq!(mv(&closed), before);
    closed.apply(&mode(Mode::Automatic)).expect("automatic");
    closed.step();
    assert!((mv(&closed) - before).abs() < 1e-9, "{} {}", mv(&closed), before);
    let levels = closed.source().plant().expect("simulated").levels_cm().to_vec();
    let water = closed.source().plant().expect("simulated").balance().total_cm3();
    closed.apply(&RigCommand::Configuration { id: "decoupled".to_owned() }).expect("turns");
    let plant = closed.source().plant().expect("simulated");
    assert_eq!(plant.levels_cm(), levels, "levels stay");
    assert!((plant.balance().total_cm3() - water).abs() < 1e-9, "water in the air stays counted");
    assert_eq!(mv(&closed), before, "the other loop takes over at the present output");
    closed.step();
    // e is −13.7 cm at once; only the integral may move the output: Kc·h/(2Ti)·2e.
    let moved = (mv(&closed) - before).abs();
    assert!(moved < 0.9 * 0.2 / 73.0 * 27.0, "moved by {moved} V");
    assert_eq!(closed.loops()[0].spec.id, "LIC-03");
}

/// A sink that does what it is told to at its first event after the start.
struct Scripted<F: FnMut() + Send>(F);

impl<F: FnMut() + Send> Sink for Scripted<F> {
    fn started(&mut self, _: &RunStart) {}
    fn samples(&mut self, _: &SampleBlock) {}
    fn event(&mut self, _: &Event) {
        (self.0)();
    }
}

#[test]
fn a_sink_that_panicked_took_the_worker_with_it() {
    let session = start("stad");
    let sink = Box::new(Scripted(|| panic!("a defect of the sink")));
    assert!(session.send(SessionCommand::Attach { id: 1, sink }));
    assert!(session.send(SessionCommand::Run));
    let mut reasons = vec![];
    wait("the defect to be said", || {
        reasons.extend(events(&session).into_iter().filter_map(|e| match e.kind {
            EventKind::Stopped { reason } => Some(reason),
            _ => None,
        }));
        !reasons.is_empty()
    });
    assert_eq!(reasons, ["a defect of the sink"]);
    wait("the run to stop", || !session.snapshot().running);
    assert!(session.send(SessionCommand::Speed(1000.0)) && session.send(SessionCommand::Run));
    wait("time to go on without that sink", || session.snapshot().time_s > 10.0);
}

/// Pumps and sensors that a file can name but that are not there: `Load` panics on such a network.
#[test]
fn a_rig_that_panicked_at_its_load_took_the_worker_with_it() {
    let session = start("stad");
    let mut broken = Network::clone(&preset("stad").expect("preset"));
    broken.pumps.clear();
    let network = Arc::new(broken);
    assert!(session.send(SessionCommand::Load(Box::new(Rig { network, ..rig("stad") }))));
    wait("the defect to be said", || {
        events(&session).iter().any(|e| matches!(e.kind, EventKind::Stopped { .. }))
    });
    assert!(session.send(SessionCommand::Load(Box::new(rig("simtank1")))));
    wait("the next rig", || session.snapshot().network.spec.id == "simtank1");
}

#[test]
fn events_nobody_fetched_vanished_without_a_word() {
    let session = start("stad");
    let total = 20_000;
    for i in 0..total {
        let level_cm = f64::from(i % 20);
        let command = || RigCommand::Setpoint { tag: "LIC-02".to_owned(), level_cm };
        wait("room for a command", || session.send(SessionCommand::Rig(command())));
    }
    let (mut done, mut lost) = (0, 0);
    wait("every event to be there or counted", || {
        for event in session.events() {
            match event.kind {
                EventKind::Done(_) => done += 1,
                EventKind::EventsLost { count } => lost += count,
                _ => {}
            }
        }
        done + lost == total as usize
    });
    assert!(lost > 0, "{done} events were kept");
}

#[test]
fn a_sink_that_hung_kept_the_program_from_ending() {
    let session = start("stad");
    let (release, held) = crossbeam_channel::bounded::<()>(0);
    let sink = Box::new(Scripted(move || assert!(held.recv().is_err(), "nobody sends")));
    assert!(session.send(SessionCommand::Attach { id: 1, sink }) && session.send(SessionCommand::Run));
    std::thread::sleep(Duration::from_millis(100));
    let begun = Instant::now();
    drop(session);
    assert!(begun.elapsed() < Duration::from_secs(4), "{:?}", begun.elapsed());
    drop(release);
}

/// Level at the lower end of the sensor's range: each sample falls on either side.
#[test]
fn noise_at_the_end_of_the_range_made_the_alarms_flicker() {
    let session = start("stad");
    // 3.8 mA of a transmitter with 4 mA at 1.5 cm and 20 mA at 25.5 cm.
    let limit = 1.2;
    let valve = |tag: &str| RigCommand::Valve { tag: tag.to_owned(), angle_deg: 0.0 };
    send(&session, RigCommand::Mode { tag: "LIC-02".to_owned(), mode: Mode::Manual });
    send(&session, RigCommand::Mv { tag: "LIC-02".to_owned(), value: 0.0 });
    for tag in ["FV01", "FV02", "FV03"] {
        send(&session, valve(tag));
    }
    let level_cm = session.snapshot().tanks[1].level_cm;
    send(&session, RigCommand::Bump { tag: "TQ2".to_owned(), delta_cm: limit - level_cm });
    for _ in 0..3000 {
        assert!(session.send(SessionCommand::Step));
    }
    let (mut alarms, mut below, mut rows) = (0, 0, 0);
    wait("the samples", || {
        for event in session.events() {
            alarms += usize::from(matches!(event.kind, EventKind::Alarm(Alarm::BelowRange { .. }, _)));
        }
        for block in session.samples() {
            let pv = block.channels.column(ChannelKind::Pv(0)).expect("a PV");
            below += block.column(pv).filter(|&pv| pv < limit + 0.01).count();
            rows += block.time_s.len();
        }
        rows == 3000
    });
    println!("{below} of {rows} samples below the range, {alarms} changes of the alarm");
    assert!((500..2500).contains(&below), "the level lies at the limit: {below} samples below");
    assert!(alarms < 20, "{alarms} changes");
    send(&session, RigCommand::Bump { tag: "TQ2".to_owned(), delta_cm: -1.0 });
    for _ in 0..10 {
        assert!(session.send(SessionCommand::Step));
    }
    let below = Alarm::BelowRange { tag: "LT02".to_owned() };
    wait("the alarm after two seconds below", || session.snapshot().alarms.contains(&below));
}

/// Two loops in each of two configurations.
fn twice(id: &str) -> Arc<Network> {
    let mut spec = preset(id).expect("preset").spec.clone();
    let mut second = spec.configurations[0].clone();
    second.id = "second".to_owned();
    for l in &mut second.loops {
        l.id.push('b');
    }
    spec.configurations.push(second);
    Arc::new(Network::new(spec).expect("valid"))
}

#[test]
fn a_turn_of_the_rig_put_every_loop_in_the_mode_of_the_first() {
    let network = twice("simtank2");
    let manual = || RigCommand::Mode { tag: "LIC-02".to_owned(), mode: Mode::Manual };
    let mut closed = ClosedLoop::simulated(network.clone(), 0, Measurement::IDEAL, 1).expect("starts");
    closed.apply(&manual()).expect("manual");
    closed.apply(&RigCommand::Configuration { id: "second".to_owned() }).expect("turns");
    let modes: Vec<Mode> = closed.loops().iter().map(|l| l.control.mode).collect();
    assert_eq!(modes, [Mode::Automatic, Mode::Manual]);
    let document = Document::new(network);
    let document = document.after(&DocumentCommand::Mode("LIC-02".to_owned(), Mode::Manual)).expect("manual");
    let document = document.after(&DocumentCommand::Configuration(1)).expect("turns");
    let modes = ["LIC-01b", "LIC-02b"].map(|tag| document.rig.loops[tag].mode);
    assert_eq!(modes, [Mode::Automatic, Mode::Manual], "the document agrees with the session");
}

#[test]
fn a_run_of_negative_length_was_called_too_long() {
    let run = |duration: &str| {
        let text = format!("schema = 1\nrig = \"stad\"\nduration_s = {duration}\n");
        let scenario: Scenario = toml::from_str(&text).expect("a scenario");
        run_scenario(preset("stad").expect("preset"), &scenario).map(|run| run.time_s.len())
    };
    for duration in ["-1.0", "-1e-12", "nan", "-inf"] {
        assert!(matches!(run(duration), Err(ScenarioError::Length { .. })), "{duration}");
    }
    for duration in ["1e9", "inf"] {
        assert!(matches!(run(duration), Err(ScenarioError::Duration { .. })), "{duration}");
    }
    assert_eq!(run("0.0"), Ok(1));
}

/// Rigs at the edge of what a file may say.
fn odd_rigs() -> Vec<Rig> {
    let odd = |id: &str, change: fn(&mut RigSpec)| {
        let mut spec = preset(id).expect("preset").spec.clone();
        spec.sample_time_s = 0.05;
        change(&mut spec);
        let network = Arc::new(Network::new(spec).expect("valid"));
        check_starts(&network).expect("starts");
        Rig { network, ..rig(id) }
    };
    vec![
        odd("stad", |spec| spec.configurations.clear()),
        odd("simtank1", |spec| {
            spec.tanks[0].area_cm2 = 1e-3;
            spec.tanks[0].height_cm = 1e-2;
            spec.configurations[0].loops[0].setpoint_cm = 5e-3;
        }),
        odd("simtank3", |spec| spec.delta_cm = 0.0),
        odd("simtank2", |spec| spec.valves.iter_mut().for_each(|v| v.law = ValveLaw::Laminar)),
        odd("stad", |spec| {
            spec.pumps[0].delay_s = 0.0;
            spec.configurations.iter_mut().for_each(|c| c.delays_s.clear());
        }),
        odd("simtank2", |spec| {
            let [inner, outer] = &mut spec.configurations[0].loops[..] else { panic!("two loops") };
            inner.mode = Mode::Cascade;
            (outer.pump, outer.cascade_to, outer.mode) = (None, Some(inner.id.clone()), Mode::Automatic);
        }),
        odd("simtank1", |spec| {
            spec.pumps.clear();
            spec.sensors.clear();
            spec.configurations.clear();
        }),
    ]
}

/// What a sink of the random test has seen.
#[derive(Default)]
struct Seen {
    starts: AtomicU64,
    rows: AtomicU64,
    events: AtomicU64,
}

struct Counting(Arc<Seen>);

impl Sink for Counting {
    fn started(&mut self, _: &RunStart) {
        self.0.starts.fetch_add(1, Ordering::Relaxed);
    }

    fn samples(&mut self, block: &SampleBlock) {
        assert_eq!(block.values.len(), block.time_s.len() * block.channels.len());
        self.0.rows.fetch_add(block.time_s.len() as u64, Ordering::Relaxed);
    }

    fn event(&mut self, _: &Event) {
        self.0.events.fetch_add(1, Ordering::Relaxed);
    }
}

/// The issue: the worker survives anything the UI can send, for 10⁵ steps, and never blocks it.
#[test]
fn the_worker_survives_a_hundred_thousand_steps_of_random_commands() {
    let mut rng = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(20_261_122);
    let session = Session::start(&fast("stad"), Box::new(|| ())).expect("starts");
    let (odd, seen) = (odd_rigs(), Arc::new(Seen::default()));
    let mut loaded = BTreeSet::new();
    let mut slowest = Duration::ZERO;
    let (mut steps, mut sent) = (0_u64, 0_u64);
    assert!(session.send(SessionCommand::Speed(1000.0)) && session.send(SessionCommand::Run));
    let started = Instant::now();
    while steps < 100_000 {
        let command = random_command(&mut rng, &odd, &seen);
        let begun = Instant::now();
        let taken = session.send(command);
        slowest = slowest.max(begun.elapsed());
        sent += u64::from(taken);
        for block in session.samples() {
            steps += block.time_s.len() as u64;
            assert!(block.values.len() == block.time_s.len() * block.channels.len());
        }
        for event in session.events() {
            assert!(!matches!(event.kind, EventKind::Stopped { .. }), "{event:?}");
            if let EventKind::RigLoaded { id } = event.kind {
                loaded.insert(id);
            }
        }
        let snapshot = session.snapshot();
        for (tank, now) in snapshot.network.tanks.iter().zip(&snapshot.tanks) {
            assert!((0.0..=tank.height_cm).contains(&now.level_cm), "{}", now.level_cm);
        }
        assert!(snapshot.balance_error_cm3.abs() < 1e-4, "{}", snapshot.balance_error_cm3);
        std::thread::sleep(Duration::from_micros(300));
        assert!(started.elapsed() < Duration::from_secs(120), "{steps} steps after two minutes");
    }
    let count = |of: &AtomicU64| of.load(Ordering::Relaxed);
    let (starts, rows, told) = (count(&seen.starts), count(&seen.rows), count(&seen.events));
    println!("{steps} steps, {sent} commands, slowest send {slowest:?}, {loaded:?}");
    println!("sinks: {starts} starts, {rows} rows, {told} events");
    assert!(starts > 10 && rows > 10_000 && told > 1000, "the sinks took part");
    assert!(slowest < Duration::from_millis(50), "a send took {slowest:?}");
    assert!(session.send(SessionCommand::Load(Box::new(rig("stad")))));
    wait("a fresh run after all that", || session.snapshot().time_s < 1000.0);
}

fn random_command(rng: &mut impl Rng, rigs: &[Rig], seen: &Arc<Seen>) -> SessionCommand {
    let odd = [f64::NAN, f64::INFINITY, -1e300, -5.0, 0.0, 1e-300, 1.0, 3.3, 15.0, 26.9, 45.0, 90.0, 1e9];
    let value =
        if rng.random_bool(0.3) { odd[rng.random_range(0..odd.len())] } else { rng.random_range(0.0..30.0) };
    let pick = |rng: &mut dyn Rng, tags: &[&str]| {
        let index = (rng.next_u32() as usize) % tags.len();
        tags[index].to_owned()
    };
    let loops = ["LIC-02", "LIC-03", "LIC-01", "BA01", "", "TQ1"];
    let gains = PidGains { kc: value, ti_s: 20.0 * value, td_s: value / 9.0, n: 10.0 };
    match rng.random_range(0..46) {
        42..=44 => {
            let excitation = Box::new(random_test(rng, value));
            SessionCommand::Rig(RigCommand::Excite { tag: pick(rng, &loops), excitation })
        }
        45 => SessionCommand::Rig(RigCommand::AbortExcitation { tag: pick(rng, &loops) }),
        36..=38 => {
            SessionCommand::Rig(RigCommand::Law { tag: pick(rng, &loops), law: random_law(rng, value) })
        }
        39..=41 => {
            let options = Box::new(random_options(rng, value));
            SessionCommand::Rig(RigCommand::Options { tag: pick(rng, &loops), options })
        }
        0 => SessionCommand::Run,
        1 if rng.random_bool(0.2) => SessionCommand::Pause,
        2 if rng.random_bool(0.1) => SessionCommand::Step,
        3 => SessionCommand::Speed(if rng.random_bool(0.5) { 1000.0 } else { value }),
        4 if rng.random_bool(0.1) => {
            let id = PRESETS[rng.random_range(0..PRESETS.len())].id;
            SessionCommand::Load(Box::new(fast(id)))
        }
        5..=8 => SessionCommand::Rig(RigCommand::Setpoint { tag: pick(rng, &loops), level_cm: value }),
        9..=11 => {
            let mode = [Mode::Manual, Mode::Automatic, Mode::Cascade][rng.random_range(0..3)];
            SessionCommand::Rig(RigCommand::Mode { tag: pick(rng, &loops), mode })
        }
        12..=15 => SessionCommand::Rig(RigCommand::Mv { tag: pick(rng, &loops), value }),
        16..=17 => {
            SessionCommand::Rig(RigCommand::Tuning { tag: pick(rng, &loops), tuning: PidTuning::new(gains) })
        }
        18 => SessionCommand::Rig(RigCommand::PvFilter { tag: pick(rng, &loops), time_constant_s: value }),
        19..=23 => SessionCommand::Rig(RigCommand::Valve {
            tag: pick(rng, &["FV01", "FV02", "FV03", "V1", "V12", "?"]),
            angle_deg: 3.0 * value,
        }),
        24..=26 => SessionCommand::Rig(RigCommand::Bump {
            tag: pick(rng, &["TQ1", "TQ2", "TQ3", "TQ4", "x"]),
            delta_cm: value - 10.0,
        }),
        27 => SessionCommand::Rig(RigCommand::Configuration {
            id: pick(rng, &["coupled", "decoupled", "standard", "none"]),
        }),
        28 => SessionCommand::Rig(RigCommand::SteadyAt { tag: pick(rng, &loops), level_cm: value }),
        29 => SessionCommand::Rig(RigCommand::Measurement {
            measurement: Measurement {
                noise: rng.random_bool(0.5),
                quantisation: rng.random_bool(0.5),
                resolution: rng.random_bool(0.5),
            },
        }),
        32 => SessionCommand::Attach { id: rng.random_range(0..4), sink: Box::new(Counting(seen.clone())) },
        33 | 34 => SessionCommand::Detach { id: rng.random_range(0..4) },
        35 if rng.random_bool(0.1) => {
            SessionCommand::Load(Box::new(rigs[rng.random_range(0..rigs.len())].clone()))
        }
        30 => SessionCommand::Rig(RigCommand::Seed { seed: rng.random() }),
        _ => SessionCommand::Run,
    }
}

/// Some tests on a loop; `value` may be odd.
fn random_test(rng: &mut impl Rng, value: f64) -> Excitation {
    let signal = match rng.random_range(0..5) {
        0 => Signal::Relay(Relay::new(value / 30.0)),
        1 => Signal::Step { size: value / 50.0, rest_share: 0.05, end: StepEnd::Stay },
        2 => Signal::SetpointStep { size: value / 10.0, rest_share: 0.05, end: StepEnd::Stay },
        3 => Signal::Prbs { amplitude: value / 50.0, clock_s: 3.0, register: 4, periods: 1 },
        _ => Signal::UltimateGain(UltimateGain::new(value, 0.2)),
    };
    let at_rest = AtRest::NotNeeded;
    Excitation { at_rest, listen_s: 3.0, budget_s: 60.0, ..Excitation::new(signal) }
}

fn random_law(rng: &mut impl Rng, value: f64) -> Law {
    let clip = if rng.random_bool(0.5) { Clip::Integral } else { Clip::Output };
    let sends = if rng.random_bool(0.5) { Sends::Increment } else { Sends::Position };
    let anti_windup = if rng.random_bool(0.5) {
        AntiWindup::Clamping
    } else {
        AntiWindup::BackCalculation { tracking_s: rng.random_bool(0.5).then_some(value) }
    };
    let action = if rng.random_bool(0.5) { Action::Direct } else { Action::Reverse };
    match rng.random_range(0..3) {
        0 => Law::PidI2gl { clip, sends },
        1 => Law::Pid2gl { bias: rng.random_bool(0.3).then_some(value), anti_windup },
        _ => Law::OnOff { gap_cm: value / 10.0, action },
    }
}

/// Each option on or off; `value` may be odd.
fn random_options(rng: &mut impl Rng, value: f64) -> LoopOptions {
    let from = ["LT02", "LT01", "BA01", "BA02"][rng.random_range(0..4)].to_owned();
    let mut on = |value: f64| rng.random_bool(0.3).then_some(value);
    LoopOptions {
        output: OutputLimits { low: on(value / 20.0), high: on(value / 5.0), rate_per_s: on(value) },
        setpoint: SetpointPath { ramp_cm_s: on(value), filter_s: on(value).unwrap_or(0.0) },
        deadband: on(value).map(|half_width_cm| Deadband { half_width_cm, factor: 0.3 }),
        schedule: on(value).map(|kc| SchedulePoint { level_cm: 7.0, kc, ti_s: None }).into_iter().collect(),
        feedforward: on(value).map(|gain| Feedforward { from, gain, lead_s: 3.0, lag_s: value }),
        smith: on(value).map(|gain| SmithModel { gain, time_constant_s: value, dead_time_s: value / 2.0 }),
    }
}

/// A row is filled part by part; every cell must be what its channel says.
#[test]
fn every_cell_of_a_row_is_what_its_channel_says() {
    for p in PRESETS {
        let network = preset(p.id).expect("preset");
        let mut closed = ClosedLoop::simulated(network, 0, Measurement::DEFAULT, 1).expect("starts");
        for _ in 0..50 {
            closed.step();
        }
        // Flows and levels are those before the sample time passes; outputs those that were written in it.
        let before = closed.source().plant().expect("simulated").clone();
        let row = closed.step().to_vec();
        let after = closed.source().plant().expect("simulated");
        for (value, channel) in row.iter().zip(&closed.channels().channels) {
            let expected = match channel.kind {
                ChannelKind::Level(i) => before.levels_cm()[i],
                ChannelKind::Arriving(i) => before.arriving_flows_cm3_s()[i],
                ChannelKind::ValveFlow(i) => before.valve_flows_cm3_s()[i],
                ChannelKind::Angle(i) => before.angles_deg()[i],
                ChannelKind::Spill(i) => before.spill_flows_cm3_s()[i],
                ChannelKind::Input(i) => after.inputs()[i],
                ChannelKind::Setpoint(i) => closed.loops()[i].control.setpoint_cm,
                ChannelKind::Pv(i) => closed.readings()[closed.loops()[i].sensor].level_cm,
                ChannelKind::Mv(i) => closed.loops()[i].control.mv(),
            };
            assert_eq!(*value, expected, "{}: {}", p.id, channel.name);
        }
    }
}
