//! Recordings back as runs: what a replay shows is what was, whatever became of the file.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use vasos_engine::control::{Law, Mode, PidGains, PidTuning};
use vasos_engine::model::{Fopdt, ProcessModel};
use vasos_engine::plant::{Fault, Measurement, RigSpec};
use vasos_engine::session::{
    EventKind, RecordedRun, Rig, RigCommand, RunStart, Session, SessionCommand, Snapshot,
};
use vasos_engine::signal::SampleBlock;
use vasos_engine::sim::ClosedLoop;
use vasos_io::export::write_recorded;
use vasos_io::log::{ImportOptions, Repair, open_log};
use vasos_io::recording::{
    ModelNote, Note, Parts, Recorded, Recording, RecordingError, RecordingFlaw, RecordingOptions,
    RecordingTrouble, read_recorded, read_runs,
};
use vasos_io::rig::{PRESETS, preset};

const FILE_ONLY: RecordingOptions = RecordingOptions { serve: false, port: None, part_bytes: None };

fn rig(id: &str) -> Rig {
    Rig { network: preset(id).expect("preset"), configuration: 0, measurement: Measurement::DEFAULT, seed: 1 }
}

fn loops(id: &str) -> ClosedLoop {
    let rig = rig(id);
    ClosedLoop::simulated(rig.network, rig.configuration, rig.measurement, rig.seed).expect("starts")
}

/// Lets a session take samples one by one, and gives its state after the last.
fn steps(session: &Session, samples: u64) -> Arc<Snapshot> {
    let wanted = session.snapshot().samples + samples;
    for _ in 0..samples {
        while !session.send(SessionCommand::Step) {
            std::thread::sleep(Duration::from_millis(1));
        }
    }
    until(session, |now| now.samples >= wanted)
}

fn until(session: &Session, done: impl Fn(&Snapshot) -> bool) -> Arc<Snapshot> {
    let limit = Instant::now() + Duration::from_secs(20);
    loop {
        let now = session.snapshot();
        if done(&now) {
            return now;
        }
        assert!(Instant::now() < limit, "waited in vain");
        std::thread::sleep(Duration::from_millis(1));
    }
}

fn send(session: &Session, command: RigCommand) {
    assert!(session.send(SessionCommand::Rig(command)));
}

fn close(session: &Session, recording: Recording) {
    assert!(session.send(SessionCommand::Detach { id: recording.id() }));
    recording.close().expect("closes");
}

fn only_run(path: &Path) -> RecordedRun {
    let mut runs = read_runs(&Parts::of(path)).expect("reads");
    assert_eq!(runs.len(), 1);
    runs.remove(0)
}

fn tag() -> String {
    "LIC-02".to_owned()
}

/// What is done to the rig, a command before each stretch of samples.
fn story() -> Vec<RigCommand> {
    let gains = PidGains { kc: 5.2, ti_s: 120.0, td_s: 3.0, n: 10.0 };
    vec![
        RigCommand::Setpoint { tag: tag(), level_cm: 17.0 },
        RigCommand::Law { tag: tag(), law: Law::PID_2GL },
        RigCommand::Tuning { tag: tag(), tuning: PidTuning::new(gains) },
        RigCommand::Valve { tag: "FV03".to_owned(), angle_deg: 62.5 },
        RigCommand::Mode { tag: tag(), mode: Mode::Manual },
        RigCommand::Mv { tag: tag(), value: 3.1 },
        RigCommand::Fault { tag: "TQ2".to_owned(), fault: Fault::Leak { k_cm2_5_s: 3.0 } },
        RigCommand::Bump { tag: "TQ1".to_owned(), delta_cm: 1.0 },
        RigCommand::Mode { tag: tag(), mode: Mode::Automatic },
        RigCommand::Repair { tag: "TQ2".to_owned(), kind: None },
        RigCommand::PvFilter { tag: tag(), time_constant_s: 2.0 },
    ]
}

#[test]
fn a_replay_shows_at_every_time_what_was_there() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.rrd");
    let session = Session::of(loops("stad"), Box::new(|| ()));
    // A command before the recording begins belongs to its beginning.
    send(
        &session,
        RigCommand::Tuning {
            tag: tag(),
            tuning: PidTuning::new(PidGains { kc: 2.5, ti_s: 80.0, td_s: 1.0, n: 8.0 }),
        },
    );
    steps(&session, 10);
    let (recording, sink) = Recording::start(&path, FILE_ONLY).expect("records");
    assert!(session.send(SessionCommand::Attach { id: recording.id(), sink }));
    let mut seen = vec![steps(&session, 20)];
    for command in story() {
        send(&session, command);
        seen.push(steps(&session, 20));
    }
    for event in session.events() {
        assert!(!matches!(event.kind, EventKind::Refused(_)), "{:?}", event.kind);
    }
    close(&session, recording);
    let run = only_run(&path);
    assert_eq!(run.len(), 20 * seen.len());
    let by_hand: Vec<usize> =
        (0..run.len()).filter(|&row| run.modes()[0][row] == Some(Mode::Manual)).collect();
    assert_eq!(by_hand, (100..180).collect::<Vec<_>>(), "rows that were taken by hand");
    let player = Session::replay(Arc::new(run.clone()), Box::new(|| ()));
    // Forwards, then back in leaps.
    let order = (0..seen.len()).chain((0..seen.len()).rev().step_by(3));
    for index in order {
        let was = &seen[index];
        // The last row before the state was seen.
        let row = 20 * (index + 1) - 1;
        let at_s = run.rows.time_s[row];
        assert!(player.send(SessionCommand::Seek(at_s)));
        let shown = until(&player, |now| now.time_s == at_s);
        assert_eq!(shown.configuration, was.configuration);
        assert_eq!(shown.faults, was.faults, "{index}");
        assert_eq!(shown.loops.len(), was.loops.len());
        for (shown, was) in shown.loops.iter().zip(&was.loops) {
            assert_eq!((&shown.tag, shown.mode, shown.law), (&was.tag, was.mode, was.law), "{index}");
            assert_eq!(shown.tuning, was.tuning, "{index}");
            assert_eq!(shown.pv_filter_s, was.pv_filter_s, "{index}");
            assert_eq!(shown.setpoint_cm, was.setpoint_cm, "{index}");
            assert_eq!((shown.mv, shown.pv_cm), (was.mv, was.pv_cm), "{index}");
        }
        for (shown, was) in shown.valves.iter().zip(&was.valves) {
            assert_eq!(shown.angle_deg, was.angle_deg, "{index}");
        }
        assert_eq!(run.row_at(at_s), Some(row));
        for (tank, shown) in shown.tanks.iter().enumerate() {
            let column =
                run.channels().column(vasos_engine::signal::ChannelKind::Level(tank)).expect("level");
            assert_eq!(shown.level_cm, run.rows.row(row)[column]);
        }
    }
}

#[test]
fn a_replay_plays_to_its_end_and_takes_no_commands() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.rrd");
    let session = Session::of(loops("stad"), Box::new(|| ()));
    let (recording, sink) = Recording::start(&path, FILE_ONLY).expect("records");
    assert!(session.send(SessionCommand::Attach { id: recording.id(), sink }));
    steps(&session, 100);
    close(&session, recording);
    let run = Arc::new(only_run(&path));
    let player = Session::replay(run.clone(), Box::new(|| ()));
    assert!(player.send(SessionCommand::Speed(100.0)));
    assert!(player.send(SessionCommand::Run));
    let [from_s, to_s] = run.span_s();
    let end = until(&player, |now| now.time_s == to_s && !now.running);
    assert_eq!(end.span_s, Some([from_s, to_s]));
    let rows: usize = player.samples().map(|block| block.time_s.len()).sum();
    assert_eq!(rows, run.len());
    player.events().for_each(drop);
    send(&player, RigCommand::Setpoint { tag: tag(), level_cm: 12.0 });
    assert!(player.send(SessionCommand::Seek(from_s)));
    until(&player, |now| now.time_s == from_s);
    let refused = player.events().any(|event| matches!(event.kind, EventKind::Refused(_)));
    assert!(refused, "a recording is not changed");
    // Played again from its end, it begins anew.
    for time_s in [f64::NAN, -5.0, f64::INFINITY, 3.0] {
        assert!(player.send(SessionCommand::Seek(time_s)));
    }
    until(&player, |now| now.time_s == 3.0);
}

#[test]
fn the_rig_of_every_preset_travels_with_its_recording() {
    for preset in PRESETS {
        let closed = loops(preset.id);
        let start = RunStart::of(&closed, 3);
        let text = toml::to_string(&start.as_set).expect("TOML");
        let back: RigSpec = toml::from_str(&text).expect(preset.id);
        assert_eq!(back, start.as_set, "{}", preset.id);
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("run.rrd");
        let (recording, mut sink) = Recording::start(&path, FILE_ONLY).expect("records");
        sink.started(&start);
        let channels = start.channels.clone();
        let values: Vec<f64> = (0..2 * channels.len()).map(|i| i as f64).collect();
        sink.samples(&SampleBlock { run: 3, channels, time_s: vec![0.0, 0.2], values: values.clone() });
        recording.note(Note::Model(ModelNote {
            number: 1,
            words: "a model".to_owned(),
            model: ProcessModel::Fopdt(Fopdt { gain: 4.9, time_constant_s: 152.0, dead_time_s: 2.0 }),
            pv_unit: "cm".to_owned(),
            mv_unit: "V".to_owned(),
            rows: vec![[0.0, 1.0, 1.1], [0.2, 1.2, 1.15]],
        }));
        drop(sink);
        recording.close().expect("closes");
        let run = only_run(&path);
        assert_eq!(run.network.spec, start.as_set, "{}", preset.id);
        assert_eq!(run.rows.values, values, "{}", preset.id);
        assert_eq!((run.rows.run, run.configuration), (3, 0));
        assert_eq!(run.measurement, Some(Measurement::DEFAULT));
        assert_eq!(run.models.len(), 1, "{}", preset.id);
        assert_eq!(run.models[0].mv_unit, "V");
    }
}

/// A run of `rows` rows at the sample time, all in one go.
fn long_run(path: &Path, rows: usize, options: RecordingOptions, pause: Duration) -> SampleBlock {
    let closed = loops("stad");
    let start = RunStart::of(&closed, 0);
    let (recording, mut sink) = Recording::start(path, options).expect("records");
    sink.started(&start);
    let width = start.channels.len();
    let time_s: Vec<f64> = (0..rows).map(|row| row as f64 * 0.2).collect();
    let values: Vec<f64> =
        (0..rows * width).map(|i| 15.0 + ((i as f64) * 0.7153).sin() * ((i % 17) as f64)).collect();
    for (t, v) in time_s.chunks(500).zip(values.chunks(500 * width)) {
        let channels = start.channels.clone();
        sink.samples(&SampleBlock { run: 0, channels, time_s: t.to_vec(), values: v.to_vec() });
        std::thread::sleep(pause);
    }
    drop(sink);
    recording.close().expect("closes");
    SampleBlock { run: 0, channels: start.channels, time_s, values }
}

#[test]
fn a_recording_that_grows_goes_on_in_files_that_open_by_themselves() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.rrd");
    // Another recording beside it has a name like that of a part.
    long_run(&folder.path().join("run-3.rrd"), 700, FILE_ONLY, Duration::ZERO);
    let session = Session::of(loops("stad"), Box::new(|| ()));
    let options = RecordingOptions { part_bytes: Some(200_000), ..FILE_ONLY };
    let (recording, sink) = Recording::start(&path, options).expect("records");
    assert!(session.send(SessionCommand::Speed(1000.0)));
    assert!(session.send(SessionCommand::Attach { id: recording.id(), sink }));
    assert!(session.send(SessionCommand::Run));
    std::thread::sleep(Duration::from_millis(1200));
    send(&session, RigCommand::Setpoint { tag: tag(), level_cm: 18.0 });
    let limit = Instant::now() + Duration::from_secs(30);
    while recording.parts().len() < 3 && Instant::now() < limit {
        std::thread::sleep(Duration::from_millis(50));
    }
    assert!(session.send(SessionCommand::Pause));
    until(&session, |now| !now.running);
    std::thread::sleep(Duration::from_millis(100));
    let (rows, lost, parts) = (recording.rows(), recording.lost(), recording.parts());
    close(&session, recording);
    assert!(parts.len() >= 3 && lost == 0, "{parts:?}, lost {lost}");
    assert!(
        !parts.contains(&folder.path().join("run-3.rrd")),
        "a file that was there is left alone: {parts:?}"
    );
    // Parts are tidied up beside; until that is over they are as they were written.
    let whole = only_run(&path);
    assert_eq!(whole.len() as u64, rows);
    assert!(whole.rows.time_s.windows(2).all(|t| (t[1] - t[0] - 0.2).abs() < 1e-6));
    let setpoints = |run: &RecordedRun| {
        let is = |kind: &EventKind| matches!(kind, EventKind::Done(RigCommand::Setpoint { .. }));
        run.events.iter().filter(|event| is(&event.kind)).count()
    };
    assert_eq!(setpoints(&whole), 1, "what opens a part counts once");
    let mut sum = 0;
    for part in &parts {
        let alone = read_runs(&Parts(vec![part.clone()])).expect("reads");
        assert_eq!(alone.len(), 1);
        assert_eq!(alone[0].network.spec, whole.network.spec);
        sum += alone[0].len();
    }
    assert_eq!(sum as u64, rows);
    let flaws = |parts: &[PathBuf]| read_recorded(&Parts(parts.to_vec())).expect("reads").flaws;
    assert_eq!(flaws(&parts), []);
    let without_last = flaws(&parts[..parts.len() - 1]);
    assert!(matches!(without_last[..], [RecordingFlaw::NoEnd { .. }]), "{without_last:?}");
    let last = read_runs(&Parts(vec![parts[parts.len() - 1].clone()])).expect("reads");
    assert_eq!(setpoints(&last[0]), 1, "a part knows the commands before it");
}

/// The issue: a file cut at every 1,000th byte. What is whole before the cut is there; nothing is invented.
#[test]
fn of_a_file_that_was_cut_off_everything_whole_opens() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.rrd");
    let (options, pause) = (FILE_ONLY, Duration::from_millis(1100));
    // As a killed recorder leaves it: never closed, so not optimised.
    let closed = loops("stad");
    let start = RunStart::of(&closed, 0);
    let whole = {
        let (recording, mut sink) = Recording::start(&path, options).expect("records");
        sink.started(&start);
        let width = start.channels.len();
        let time_s: Vec<f64> = (0..800).map(|row| f64::from(row) * 0.2).collect();
        let values: Vec<f64> = (0..800 * width).map(|i| (i as f64 * 0.7153).sin()).collect();
        for (t, v) in time_s.chunks(200).zip(values.chunks(200 * width)) {
            let channels = start.channels.clone();
            sink.samples(&SampleBlock { run: 0, channels, time_s: t.to_vec(), values: v.to_vec() });
            std::thread::sleep(pause);
        }
        drop(sink);
        std::thread::sleep(Duration::from_millis(300));
        drop(recording);
        SampleBlock { run: 0, channels: start.channels.clone(), time_s, values }
    };
    let optimised = folder.path().join("closed.rrd");
    let of_closed = long_run(&optimised, 800, FILE_ONLY, Duration::ZERO);
    for (path, whole) in [(&path, &whole), (&optimised, &of_closed)] {
        let bytes = std::fs::read(path).expect("a file");
        let cut = folder.path().join("cut/run.rrd");
        std::fs::create_dir_all(cut.parent().expect("a folder")).expect("made");
        let (mut before, mut refused, mut opened) = (0, 0, 0);
        for end in (0..bytes.len()).step_by(1000).chain([bytes.len()]) {
            std::fs::write(&cut, &bytes[..end]).expect("written");
            let begun = Instant::now();
            match read_recorded(&Parts::of(&cut)) {
                Ok(Recorded { runs, flaws, .. }) => {
                    opened += 1;
                    // Also where the cut falls between two messages.
                    assert_eq!(flaws.is_empty(), end == bytes.len(), "{end} bytes: {flaws:?}");
                    let run = &runs[0];
                    let rows = run.len();
                    assert!(rows >= before, "{rows} rows of {end} bytes, {before} of fewer");
                    before = rows;
                    let width = whole.channels.len();
                    let near = |a: &f64, b: &f64| (a - b).abs() < 1e-8;
                    assert!(run.rows.time_s.iter().zip(&whole.time_s).all(|(a, b)| near(a, b)));
                    assert_eq!(run.rows.values, whole.values[..rows * width], "{end} bytes");
                }
                Err(error) => {
                    refused += 1;
                    assert_eq!(before, 0, "{end} bytes: {error}");
                    let in_words = matches!(
                        error,
                        RecordingError::Read { .. }
                            | RecordingError::Nothing { .. }
                            | RecordingError::NoRig { .. }
                    );
                    assert!(in_words, "{error}");
                }
            }
            drop(open_log(&cut, &ImportOptions::default()));
            assert!(begun.elapsed() < Duration::from_secs(2), "{end} bytes");
        }
        assert_eq!(before, whole.time_s.len());
        println!("{} bytes: {opened} cuts open, {refused} are refused in words", bytes.len());
    }
}

#[test]
fn a_recording_goes_out_as_csv_and_parquet_with_units_and_comes_back() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.rrd");
    long_run(&path, 300, FILE_ONLY, Duration::ZERO);
    let run = only_run(&path);
    for name in ["run.csv", "run.parquet"] {
        let file = folder.path().join(name);
        write_recorded(&run, &file).expect("written");
        let log = open_log(&file, &ImportOptions::default()).expect("opens");
        assert_eq!(log.table.len(), 300, "{name}");
        for (index, channel) in run.channels().channels.iter().enumerate() {
            let column = &log.table.columns[index];
            assert!(column.values.iter().copied().eq(run.rows.column(index)), "{name}: {}", column.name);
            assert_eq!(column.unit.as_deref().unwrap_or(""), channel.unit, "{name}: {}", column.name);
        }
        let roles = &log.report.roles;
        let found = [&roles.pv, &roles.sp, &roles.mv].map(|r| r.as_deref());
        assert_eq!(found, [Some("pv_cm"), Some("sp_cm"), Some("mv_v")], "{name}");
        assert_eq!(roles.mode.as_deref(), Some("mode"), "{name}");
        assert_eq!(log.table.columns.last().map(|c| &c.states[..]), Some(&["AUTO".to_owned()][..]), "{name}");
    }
    let error = write_recorded(&run, &folder.path().join("run.txt")).expect_err("no such kind");
    assert!(error.to_string().contains(".parquet"), "{error}");
}

/// Single bits flipped all over a file: every one is read or refused in words. Nothing panics, nothing reserves memory that
/// is not there, and what cannot be read is said.
#[test]
fn a_bit_that_flipped_costs_its_message_and_is_said() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.rrd");
    long_run(&path, 400, FILE_ONLY, Duration::ZERO);
    let bytes = std::fs::read(&path).expect("a file");
    let damaged = folder.path().join("damaged.rrd");
    let whole = only_run(&path);
    let (mut said, mut refused, mut unsaid) = (0, 0, vec![]);
    let flips = 250;
    let stride = bytes.len() / flips;
    for k in 0..flips {
        let (at, bit) = (k * stride + (k * 7919) % stride, k % 8);
        let mut flipped = bytes.clone();
        flipped[at] ^= 1 << bit;
        std::fs::write(&damaged, &flipped).expect("written");
        match read_recorded(&Parts(vec![damaged.clone()])) {
            Ok(recorded) => {
                said += usize::from(!recorded.flaws.is_empty());
                let [run] = &recorded.runs[..] else { panic!("byte {at}: {} runs", recorded.runs.len()) };
                // The same to the bit, NaN included; names are nothing that one reckons with.
                let same = format!("{:?}", run.rows) == format!("{:?}", whole.rows)
                    && run.events == whole.events
                    && run.network.spec == whole.network.spec
                    && (run.configuration, run.measurement) == (whole.configuration, whole.measurement);
                if !same && recorded.flaws.is_empty() {
                    unsaid.push((at, bit));
                }
            }
            Err(error) => {
                refused += 1;
                assert!(!error.to_string().is_empty());
            }
        }
        if let Ok(log) = open_log(&damaged, &ImportOptions::default()) {
            let told = log.report.repairs.iter().any(|r| matches!(r, Repair::Recording { .. }));
            assert!(told || log.table.len() == whole.len(), "byte {at}: {} rows", log.table.len());
        }
    }
    println!(
        "{flips} bits: {said} said, {refused} refused, {} changed something and nothing was said",
        unsaid.len()
    );
    assert!(said + refused > flips / 2, "{said} {refused}");
    assert_eq!(unsaid, [], "byte and bit");
}

#[test]
fn rows_that_are_missing_are_said() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.rrd");
    let start = RunStart::of(&loops("stad"), 0);
    let (recording, mut sink) = Recording::start(&path, FILE_ONLY).expect("records");
    sink.started(&start);
    let width = start.channels.len();
    for from in [0, 300] {
        let time_s: Vec<f64> = (from..from + 100).map(|row| f64::from(row) * 0.2).collect();
        let channels = start.channels.clone();
        sink.samples(&SampleBlock { run: 0, channels, time_s, values: vec![1.0; 100 * width] });
    }
    drop(sink);
    recording.close().expect("closes");
    let recorded = read_recorded(&Parts::of(&path)).expect("reads");
    let [RecordingFlaw::Gap { from_s, missing_s, gaps, .. }] = &recorded.flaws[..] else {
        panic!("{:?}", recorded.flaws)
    };
    assert!((from_s - 19.8).abs() < 1e-9 && (missing_s - 40.2).abs() < 1e-6 && *gaps == 1);
    let log = open_log(&path, &ImportOptions::default()).expect("opens");
    assert!(log.report.repairs.iter().any(|r| matches!(r, Repair::Recording { .. })));
}

#[test]
fn a_file_belongs_to_one_recorder() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.rrd");
    let start = RunStart::of(&loops("stad"), 0);
    let (first, mut sink) = Recording::start(&path, FILE_ONLY).expect("records");
    sink.started(&start);
    let Err(RecordingError::Create { reason, .. }) = Recording::start(&path, FILE_ONLY) else {
        panic!("a second recorder on one file")
    };
    assert!(reason.contains("another recorder"), "{reason}");
    drop(sink);
    first.close().expect("closes");
    assert_eq!(read_runs(&Parts::of(&path)).expect("reads").len(), 1, "the first is not harmed");
}

#[cfg(unix)]
#[test]
fn a_file_that_is_taken_away_is_begun_anew() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.rrd");
    let session = Session::of(loops("stad"), Box::new(|| ()));
    let (mut recording, sink) = Recording::start(&path, FILE_ONLY).expect("records");
    assert!(session.send(SessionCommand::Attach { id: recording.id(), sink }));
    assert!(session.send(SessionCommand::Speed(50.0)));
    assert!(session.send(SessionCommand::Run));
    std::thread::sleep(Duration::from_millis(1500));
    std::fs::remove_file(&path).expect("removed");
    std::thread::sleep(Duration::from_millis(2500));
    let told = recording.troubles();
    assert!(told.iter().any(|t| matches!(t, RecordingTrouble::Removed { .. })), "{told:?}");
    assert!(recording.tally().unwritten() > 0);
    close(&session, recording);
    assert!(only_run(&path).len() > 50);
}

/// A plan carries commands out before the sample of their time, at any speed: the run is that of the scenario.
#[test]
fn a_scenario_at_any_speed_is_the_scenario() {
    use vasos_engine::sim::{Scenario, ScenarioEvent, run_scenario, scenario_loop};
    let network = preset("stad").expect("preset");
    let at = |at_s: f64, level_cm: f64| ScenarioEvent {
        at_s,
        command: RigCommand::Setpoint { tag: tag(), level_cm },
    };
    let scenario = Scenario {
        schema: 1,
        rig: "stad".to_owned(),
        configuration: None,
        duration_s: 300.0,
        seed: 3,
        measurement: Measurement::DEFAULT,
        keep_every: 1,
        start: Default::default(),
        events: vec![at(200.0, 13.0), at(50.0, 17.0)],
    };
    let expected = run_scenario(network.clone(), &scenario).expect("runs");
    let session = Session::of(scenario_loop(&network, &scenario).expect("starts"), Box::new(|| ()));
    assert!(session.send(SessionCommand::Plan { events: scenario.events.clone(), end_s: Some(300.0) }));
    assert!(session.send(SessionCommand::Speed(1000.0)));
    assert!(session.send(SessionCommand::Run));
    until(&session, |now| now.time_s > 300.0 && !now.running);
    let mut time_s = vec![];
    let mut values = vec![];
    let limit = Instant::now() + Duration::from_secs(5);
    while time_s.len() < expected.time_s.len() && Instant::now() < limit {
        for block in session.samples() {
            time_s.extend(block.time_s);
            values.extend(block.values);
        }
    }
    assert_eq!(time_s, expected.time_s);
    assert!(values.iter().zip(&expected.values).all(|(a, b)| a.to_bits() == b.to_bits()));
}
