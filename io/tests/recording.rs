//! Recordings of real sessions: every row in the file, whatever viewers, disks and signals do.

#[path = "../../tests/src/skip.rs"]
mod skip;
#[path = "recording/viewer.rs"]
mod viewer;

use std::path::Path;
use std::time::{Duration, Instant};

use skip::skip;
use vasos_engine::analyze::{CurveOptions, LoopFunction, OpenLoop, frequency_curve};
use vasos_engine::control::PidGains;
use vasos_engine::model::{Fopdt, ProcessModel};
use vasos_engine::plant::Measurement;
use vasos_engine::session::{Rig, RigCommand, Session, SessionCommand};
use vasos_engine::signal::ChannelKind;
use vasos_io::log::{FileFormat, ImportOptions, open_log};
use vasos_io::recording::{
    ModelNote, Note, NyquistNote, RecordedColumn, Recording, RecordingError, RecordingOptions,
    RecordingTrouble, read_recording,
};
use vasos_io::rig::preset;

const FILE_ONLY: RecordingOptions = RecordingOptions { serve: false, port: None, part_bytes: None };

fn rig(id: &str) -> Rig {
    Rig { network: preset(id).expect("preset"), configuration: 0, measurement: Measurement::DEFAULT, seed: 1 }
}

fn session(id: &str, speed: f64) -> Session {
    let session = Session::start(&rig(id), Box::new(|| ())).expect("starts");
    assert!(session.send(SessionCommand::Speed(speed)));
    session
}

/// A session with a recording attached, running.
fn record(session: &Session, path: &Path, options: RecordingOptions) -> Recording {
    let (recording, sink) = Recording::start(path, options).expect("records");
    assert!(session.send(SessionCommand::Attach { id: recording.id(), sink }));
    assert!(session.send(SessionCommand::Run));
    recording
}

/// Stops, detaches and closes; gives the time that closing took.
fn end(session: &Session, recording: Recording) -> Duration {
    assert!(session.send(SessionCommand::Pause));
    assert!(session.send(SessionCommand::Detach { id: recording.id() }));
    let begun = Instant::now();
    recording.close().expect("closes");
    begun.elapsed()
}

fn loop_of(columns: &[RecordedColumn]) -> &RecordedColumn {
    columns.iter().find(|c| c.component == "loop_1").expect("a loop")
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a folder")
}

#[test]
fn every_row_and_value_of_a_fast_run_is_in_the_file() {
    let folder = folder();
    let path = folder.path().join("run.rrd");
    let session = session("stad", 1000.0);
    let mut recording = record(&session, &path, FILE_ONLY);
    std::thread::sleep(Duration::from_millis(1500));
    let setpoint = RigCommand::Setpoint { tag: "LIC-02".to_owned(), level_cm: 17.0 };
    assert!(session.send(SessionCommand::Rig(setpoint)));
    std::thread::sleep(Duration::from_millis(1000));
    assert!(session.send(SessionCommand::Pause));
    let deadline = Instant::now() + Duration::from_secs(5);
    while session.snapshot().running && Instant::now() < deadline {
        std::thread::sleep(Duration::from_millis(5));
    }
    std::thread::sleep(Duration::from_millis(50));
    let (mut time_s, mut pv) = (vec![], vec![]);
    for block in session.samples() {
        let column = block.channels.column(ChannelKind::Pv(0)).expect("a PV");
        time_s.extend_from_slice(&block.time_s);
        pv.extend(block.column(column));
    }
    assert_eq!(recording.troubles(), []);
    assert_eq!((recording.rows(), recording.lost()), (time_s.len() as u64, 0));
    let bytes = recording.bytes();
    let closing = end(&session, recording);
    let after = std::fs::metadata(&path).expect("a file").len();
    println!(
        "{} rows: {:.1} B a row while running, {:.1} after, closed in {closing:?}",
        time_s.len(),
        bytes as f64 / time_s.len() as f64,
        after as f64 / time_s.len() as f64
    );
    let columns = read_recording(&path).expect("reads");
    let recorded = loop_of(&columns);
    assert!(time_s.len() > 1000, "{}", time_s.len());
    assert_eq!(recorded.time_s.len(), time_s.len());
    for (row, (t, pv)) in time_s.iter().zip(&pv).enumerate() {
        assert!((recorded.time_s[row] - t).abs() < 1e-8, "row {row}");
        let same = recorded.values[row][1].to_bits() == pv.to_bits();
        assert!(same, "row {row}: {} {pv}", recorded.values[row][1]);
    }
    for component in ["levels", "flows"] {
        let column = columns.iter().find(|c| c.component == component).expect("recorded");
        assert_eq!(column.time_s.len(), time_s.len(), "{component}");
    }
    for entity in ["/events", "/rig/water"] {
        assert!(columns.iter().any(|c| c.entity == entity), "{entity}");
    }
    assert!(closing < Duration::from_secs(5), "{closing:?}");
}

/// Spec: at most 400 bytes a row of ten channels while running. The reference rig has 19 and five rows a second in real
/// time, over which the fixed cost of a batch, 1 to 1.5 kB, is spread.
#[test]
fn a_row_costs_few_bytes() {
    for (id, speed, most) in [("simtank1", 2.5, 400.0), ("stad", 2.0, 300.0), ("stad", 1.0, 450.0)] {
        let folder = folder();
        let path = folder.path().join("run.rrd");
        let session = session(id, speed);
        let recording = record(&session, &path, FILE_ONLY);
        std::thread::sleep(Duration::from_millis(1500));
        let (rows, bytes) = (recording.rows(), recording.bytes());
        std::thread::sleep(Duration::from_secs(5));
        let rows_between = recording.rows() - rows;
        let running = (recording.bytes() - bytes) as f64 / rows_between as f64;
        let all = recording.rows();
        end(&session, recording);
        let after = std::fs::metadata(&path).expect("a file").len();
        let channels = preset(id).map(|n| vasos_engine::signal::ChannelSet::of(&n).len()).expect("preset");
        println!(
            "{id} at {speed} ×, {channels} channels: {running:.0} B a row running, {all} rows in {after} B"
        );
        assert!(running < most, "{running}");
    }
}

#[test]
fn a_new_run_is_a_recording_of_its_own_in_the_same_file() {
    let folder = folder();
    let path = folder.path().join("run.rrd");
    let session = session("stad", 100.0);
    let recording = record(&session, &path, FILE_ONLY);
    std::thread::sleep(Duration::from_millis(300));
    assert!(session.send(SessionCommand::Load(Box::new(rig("simtank2")))));
    std::thread::sleep(Duration::from_millis(300));
    let rows = recording.rows();
    end(&session, recording);
    let columns = read_recording(&path).expect("reads");
    let mut runs: Vec<(&str, usize)> = columns
        .iter()
        .filter(|c| c.component == "loop_1")
        .map(|c| (c.recording.as_str(), c.values.len()))
        .collect();
    runs.dedup_by_key(|r| r.0);
    assert_eq!(runs.len(), 2, "{runs:?}");
    assert!(runs.iter().map(|r| r.1).sum::<usize>() as u64 >= rows, "{runs:?} of {rows}");
}

#[test]
fn files_that_hold_no_recording_are_refused_in_words() {
    let folder = folder();
    for (name, content) in [("empty.rrd", &b""[..]), ("garbage.rrd", &b"not a recording at all"[..])] {
        let path = folder.path().join(name);
        std::fs::write(&path, content).expect("written");
        let error = read_recording(&path).expect_err(name);
        println!("{error}");
    }
    let error = read_recording(&folder.path().join("absent.rrd")).expect_err("absent");
    assert!(matches!(error, RecordingError::Read { .. }));
    let Err(error) = Recording::start(&folder.path().join("no/folder/run.rrd"), FILE_ONLY) else {
        panic!("there is no such folder");
    };
    assert!(matches!(error, RecordingError::Create { .. }), "{error}");
}

#[test]
fn a_full_disk_is_said_and_does_not_stop_the_run() {
    if !Path::new("/dev/full").exists() {
        return skip("a_full_disk_is_said_and_does_not_stop_the_run", "there is no /dev/full");
    }
    let refused = Recording::start(Path::new("/dev/full"), FILE_ONLY);
    let Err(RecordingError::Create { reason, .. }) = refused else { panic!("the header does not fit") };
    println!("{reason}");
}

#[test]
fn a_port_in_use_is_a_trouble_and_another_is_found_when_free_to_choose() {
    let folder = folder();
    let taken = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = taken.local_addr().expect("bound").port();
    let options = RecordingOptions { port: Some(port), ..RecordingOptions::default() };
    let (mut recording, sink) = Recording::start(&folder.path().join("a.rrd"), options).expect("records");
    assert_eq!(recording.address(), None);
    assert!(matches!(recording.troubles()[..], [RecordingTrouble::NoServer { .. }]));
    drop(sink);
    recording.close().expect("closes");
    let start = |name: &str| Recording::start(&folder.path().join(name), RecordingOptions::default());
    let ((first, _a), (second, _b)) = (start("b.rrd").expect("records"), start("c.rrd").expect("records"));
    let (a, b) = (first.address().expect("served"), second.address().expect("served"));
    assert!(a.starts_with("rerun+http://127.0.0.1:") && a.ends_with("/proxy"), "{a}");
    assert_ne!(a, b);
}

/// The child of the test below: records until it is killed.
#[test]
fn record_until_killed() {
    let Some(path) = std::env::var_os("VASOS_TEST_RECORD_TO") else { return };
    let session = session("stad", 20.0);
    let recording = record(&session, Path::new(&path), FILE_ONLY);
    loop {
        println!("ROWS {}", recording.rows());
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn of_a_killed_program_all_but_the_last_second_opens() {
    use std::io::{BufRead, BufReader};
    let folder = folder();
    let path = folder.path().join("killed.rrd");
    let mut child = std::process::Command::new(std::env::current_exe().expect("this test"))
        .args(["--exact", "record_until_killed", "--nocapture"])
        .env("VASOS_TEST_RECORD_TO", &path)
        .stdout(std::process::Stdio::piped())
        .spawn()
        .expect("a child");
    let begun = Instant::now();
    let mut handed = 0_usize;
    for line in BufReader::new(child.stdout.take().expect("a pipe")).lines() {
        let line = line.expect("text");
        if let Some(rows) = line.strip_prefix("ROWS ") {
            handed = rows.parse().expect("a number");
        }
        if begun.elapsed() > Duration::from_millis(4500) {
            break;
        }
    }
    child.kill().expect("SIGKILL");
    child.wait().expect("gone");
    let columns = read_recording(&path).expect("reads");
    let rows = loop_of(&columns).time_s.len();
    println!("{rows} rows of {handed}");
    // 100 rows a second of wall time at 20 ×; one batch and the time to write it may be missing.
    assert!(rows + 150 >= handed && rows > 200, "{rows} of {handed}");
}

#[test]
fn the_file_opens_laid_out_in_the_viewer() {
    let Some(viewer) = viewer::find("the_file_opens_laid_out_in_the_viewer") else { return };
    let folder = folder();
    let path = folder.path().join("run.rrd");
    let session = session("stad", 100.0);
    let recording = record(&session, &path, FILE_ONLY);
    std::thread::sleep(Duration::from_millis(800));
    let setpoint = |level_cm| RigCommand::Setpoint { tag: "LIC-02".to_owned(), level_cm };
    assert!(session.send(SessionCommand::Rig(setpoint(18.0))));
    std::thread::sleep(Duration::from_millis(2500));
    let model = ProcessModel::Fopdt(Fopdt { gain: 4.9, time_constant_s: 152.0, dead_time_s: 2.0 });
    let open = OpenLoop::new(&model, &PidGains { kc: 1.8, ti_s: 152.0, td_s: 0.0, n: 10.0 });
    let curve = frequency_curve(&open, LoopFunction::OpenLoop, &CurveOptions::default());
    let fitted =
        |row: i32| [f64::from(row), 15.0 + 0.1 * f64::from(row).sqrt(), 15.05 + 0.1 * f64::from(row).sqrt()];
    recording.note(Note::Model(ModelNote {
        number: 1,
        words: format!("**Model 1**\n\n{model}"),
        model,
        pv_unit: "cm".to_owned(),
        mv_unit: "V".to_owned(),
        rows: (0..200).map(fitted).collect(),
    }));
    recording.note(Note::Nyquist(NyquistNote {
        words: "LIC-02: Kc 1.8, Ti 152 s".to_owned(),
        curve: curve.iter().map(|(_, l)| [l.re, l.im]).collect(),
        ms: Some(1.14),
    }));
    assert!(session.send(SessionCommand::Rig(setpoint(31.0))));
    assert!(session.send(SessionCommand::Rig(setpoint(12.0))));
    std::thread::sleep(Duration::from_millis(2500));
    end(&session, recording);
    let picture = std::env::var_os("VASOS_SCREENSHOT")
        .map_or_else(|| folder.path().join("run.png"), std::path::PathBuf::from);
    viewer.screenshot(&[path.as_os_str()], &picture);
    assert!(std::fs::metadata(&picture).expect("a picture").len() > 30_000, "the viewer shows something");
}

#[test]
fn a_viewer_that_joins_and_is_killed_costs_no_row() {
    let Some(viewer) = viewer::find("a_viewer_that_joins_and_is_killed_costs_no_row") else { return };
    let folder = folder();
    let path = folder.path().join("run.rrd");
    let session = session("stad", 200.0);
    let options = RecordingOptions::default();
    let mut recording = record(&session, &path, options);
    let address = recording.address().expect("served").to_owned();
    let mut joined = viewer.join(&address);
    std::thread::sleep(Duration::from_secs(3));
    joined.kill().expect("SIGKILL");
    joined.wait().expect("gone");
    let mut stopped = viewer.join(&address);
    std::thread::sleep(Duration::from_secs(2));
    viewer::stop(&stopped);
    std::thread::sleep(Duration::from_secs(2));
    assert!(session.send(SessionCommand::Pause));
    std::thread::sleep(Duration::from_millis(200));
    let (rows, lost) = (recording.rows(), recording.lost());
    println!("{:?}", recording.troubles());
    let closing = end(&session, recording);
    stopped.kill().expect("SIGKILL");
    stopped.wait().expect("gone");
    println!("closed in {closing:?} with a viewer that stands still");
    assert_eq!(lost, 0);
    assert_eq!(loop_of(&read_recording(&path).expect("reads")).time_s.len() as u64, rows);
}

#[test]
fn a_recording_opens_as_a_log() {
    let folder = folder();
    let path = folder.path().join("run.rrd");
    let session = session("stad", 200.0);
    let recording = record(&session, &path, FILE_ONLY);
    std::thread::sleep(Duration::from_millis(500));
    end(&session, recording);
    let columns = read_recording(&path).expect("reads");
    let recorded = loop_of(&columns);
    let log = open_log(&path, &ImportOptions::default()).expect("a log");
    assert_eq!(log.report.format, FileFormat::Recording);
    assert_eq!(log.table.len(), recorded.time_s.len(), "{:?}", log.report.repairs);
    let pv = log.table.column("pv").expect("a PV");
    assert_eq!(pv.unit.as_deref(), Some("cm"));
    for (row, values) in recorded.values.iter().enumerate() {
        assert!(pv.values[row] == values[1] || (pv.values[row].is_nan() && values[1].is_nan()));
        let time_s = recorded.time_s[row] - recorded.time_s[0];
        assert!((log.table.time_s[row] - time_s).abs() < 1e-9);
    }
    let roles = &log.report.roles;
    assert_eq!(roles.mv.as_deref(), Some("mv"));
    assert_eq!(roles.sp.as_deref(), Some("sp"));
}
