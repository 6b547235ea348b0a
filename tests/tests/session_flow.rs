//! The session under everything a face can send.

use std::sync::Arc;
use std::time::{Duration, Instant};

use rand::{Rng, RngExt, SeedableRng};
use vasos_engine::control::{Mode, PidGains, PidTuning};
use vasos_engine::plant::{Measurement, Network};
use vasos_engine::session::{CommandError, Event, EventKind, Rig, RigCommand, Session, SessionCommand};
use vasos_engine::sim::ClosedLoop;
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
    assert!(session.send(SessionCommand::Step));
    let before = session.snapshot().samples;
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

/// The issue: the worker survives anything the UI can send, for 10⁵ steps, and never blocks it.
#[test]
fn the_worker_survives_a_hundred_thousand_steps_of_random_commands() {
    let mut rng = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(20_261_122);
    let session = Session::start(&fast("stad"), Box::new(|| ())).expect("starts");
    let mut slowest = Duration::ZERO;
    let (mut steps, mut sent) = (0_u64, 0_u64);
    assert!(session.send(SessionCommand::Speed(1000.0)) && session.send(SessionCommand::Run));
    let started = Instant::now();
    while steps < 100_000 {
        let command = random_command(&mut rng);
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
        }
        let snapshot = session.snapshot();
        for (tank, now) in snapshot.network.tanks.iter().zip(&snapshot.tanks) {
            assert!((0.0..=tank.height_cm).contains(&now.level_cm), "{}", now.level_cm);
        }
        assert!(snapshot.balance_error_cm3.abs() < 1e-4, "{}", snapshot.balance_error_cm3);
        std::thread::sleep(Duration::from_micros(300));
        assert!(started.elapsed() < Duration::from_secs(120), "{steps} steps after two minutes");
    }
    println!("{steps} steps, {sent} commands, slowest send {slowest:?}");
    assert!(slowest < Duration::from_millis(50), "a send took {slowest:?}");
    assert!(session.send(SessionCommand::Load(Box::new(rig("stad")))));
    wait("a fresh run after all that", || session.snapshot().time_s < 1000.0);
}

fn random_command(rng: &mut impl Rng) -> SessionCommand {
    let odd = [f64::NAN, f64::INFINITY, -1e300, -5.0, 0.0, 1e-300, 1.0, 3.3, 15.0, 26.9, 45.0, 90.0, 1e9];
    let value =
        if rng.random_bool(0.3) { odd[rng.random_range(0..odd.len())] } else { rng.random_range(0.0..30.0) };
    let pick = |rng: &mut dyn Rng, tags: &[&str]| {
        let index = (rng.next_u32() as usize) % tags.len();
        tags[index].to_owned()
    };
    let loops = ["LIC-02", "LIC-03", "LIC-01", "BA01", "", "TQ1"];
    let gains = PidGains { kc: value, ti_s: 20.0 * value, td_s: value / 9.0, n: 10.0 };
    match rng.random_range(0..32) {
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
            let mode = if rng.random_bool(0.5) { Mode::Manual } else { Mode::Automatic };
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
        30 => SessionCommand::Rig(RigCommand::Seed { seed: rng.random() }),
        _ => SessionCommand::Run,
    }
}
