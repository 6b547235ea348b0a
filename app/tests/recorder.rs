//! `vasos record` and `vasos replay` as programs: killed, out of disk, under a clock that jumps.

#[path = "../../tests/src/skip.rs"]
mod skip;

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;
use skip::skip;
use vasos_engine::session::{Event, RecordedRun};
use vasos_io::recording::{Parts, event_words, read_runs};

const PROGRAM: &str = env!("CARGO_BIN_EXE_vasos");

fn vasos(arguments: &[&str]) -> Output {
    let mut command = Command::new(PROGRAM);
    command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY").args(arguments);
    command.output().expect("the program starts")
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn json_of(output: &Output) -> Value {
    assert_eq!(output.status.code(), Some(0), "{}", said(output));
    serde_json::from_slice(&output.stdout).expect("JSON")
}

fn runs(path: &Path) -> Vec<RecordedRun> {
    read_runs(&Parts::of(path)).unwrap_or_else(|error| panic!("{error}"))
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a folder")
}

/// A number between 0 and 1 that differs from call to call and is the same in every run of the tests.
fn random(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*seed >> 11) as f64 / (1_u64 << 53) as f64
}

/// Starts a recorder and waits until a viewer could join, which is when it begins.
fn start(path: &Path, more: &[&str]) -> (Child, BufReader<std::process::ChildStderr>, Instant) {
    let mut child = Command::new(PROGRAM)
        .args(["record", "stad", "-o"])
        .arg(path)
        .args(more)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    let mut stderr = BufReader::new(child.stderr.take().expect("a pipe"));
    let mut line = String::new();
    stderr.read_line(&mut line).expect("text");
    assert!(line.contains("a viewer joins with"), "{line}");
    (child, stderr, Instant::now())
}

/// The issue: SIGKILL at 50 random moments. All but the last second of the recording opens.
#[test]
fn of_a_recorder_that_is_killed_fifty_times_all_but_the_last_second_opens() {
    const SPEED: f64 = 20.0;
    let folder = folder();
    let mut seed = 20;
    let mut lost_s = vec![];
    for round in 0..10 {
        // Five at a time: a part of 60 kB is full after some seconds, so that some are killed as they change files.
        let started: Vec<_> = (0..5)
            .map(|n| {
                let path = folder.path().join(format!("killed-{round}-{n}_.rrd"));
                let (child, _stderr, begun) = start(&path, &["--speed", "20", "--part-mb", "0.06"]);
                (path, child, begun, Duration::from_secs_f64(0.2 + 3.5 * random(&mut seed)))
            })
            .collect();
        let mut waiting: Vec<_> = started.into_iter().collect();
        waiting.sort_by_key(|(_, _, begun, after)| *begun + *after);
        for (path, mut child, begun, after) in waiting {
            std::thread::sleep((begun + after).saturating_duration_since(Instant::now()));
            child.kill().expect("SIGKILL");
            let ran_s = begun.elapsed().as_secs_f64();
            child.wait().expect("gone");
            let recorded_s = match read_runs(&Parts::of(&path)) {
                Ok(runs) => runs[0].span_s()[1] / SPEED,
                // Before the first batch there is nothing to lose.
                Err(error) => {
                    assert!(ran_s < 1.5, "after {ran_s} s: {error}");
                    0.0
                }
            };
            lost_s.push(ran_s - recorded_s);
        }
    }
    lost_s.sort_by(f64::total_cmp);
    let worst = lost_s[lost_s.len() - 1];
    println!("{} kills, lost: median {:.2} s, worst {worst:.2} s", lost_s.len(), lost_s[lost_s.len() / 2]);
    assert_eq!(lost_s.len(), 50);
    // A batch is written every 0.9 s; the rest is the time of five recorders on two cores to start and to write it.
    assert!(worst < 1.6, "{lost_s:?}");
    assert!(lost_s[lost_s.len() / 2] < 1.0, "{lost_s:?}");
}

/// Where a recorder runs in a shell that limits or takes away its disk.
fn shell(script: &str, variables: &[(&str, &Path)]) -> Output {
    let mut command = Command::new("bash");
    command.args(["-c", script]).env("VASOS", PROGRAM);
    for (name, value) in variables {
        command.env(name, value);
    }
    command.output().expect("bash starts")
}

#[test]
fn a_file_that_may_not_grow_is_said_and_what_it_holds_opens() {
    let folder = folder();
    let path = folder.path().join("run.rrd");
    // 100 kB; the signal that comes with it would end a program that does not take it.
    let script = "ulimit -f 100; exec $VASOS record stad -o $OUT --duration 300 --speed 50 --no-viewer";
    let output = shell(script, &[("OUT", &path)]);
    let words = said(&output);
    assert_eq!(output.status.code(), Some(1), "{words}");
    assert!(words.contains("cannot be written") && words.contains("stays readable"), "{words}");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(text.contains("rows to 30"), "the run went on to its end: {text}");
    let run = &runs(&path)[0];
    assert!(run.len() > 100, "{} rows", run.len());
    let size = std::fs::metadata(&path).expect("a file").len();
    assert!(size <= 100 * 1024, "{size}");
    println!("{} rows in {size} bytes; {words}", run.len());
}

#[test]
fn a_disk_that_fills_and_is_freed_again_costs_what_did_not_fit() {
    let name = "a_disk_that_fills_and_is_freed_again_costs_what_did_not_fit";
    let mountable =
        shell("unshare -rm true && unshare -rm bash -c 'mount -t tmpfs -o size=1m tmpfs /mnt'", &[]);
    if !mountable.status.success() {
        return skip(name, "this system lets no test mount a tmpfs");
    }
    let folder = folder();
    let (mount, out) = (folder.path().join("disk"), folder.path().join("run.rrd"));
    std::fs::create_dir(&mount).expect("made");
    // A command comes while the disk is full.
    let scenario = folder.path().join("story.toml");
    let text = "schema = 1\nrig = \"stad\"\nduration_s = 1e6\n\
        [[event]]\nat_s = 300.0\nsetpoint = { tag = \"LIC-02\", level_cm = 18.0 }\n";
    std::fs::write(&scenario, text).expect("written");
    // The disk has 400 kB, 250 of them taken until four seconds have gone by.
    let script = "unshare -rm bash -c '
        mount -t tmpfs -o size=400k tmpfs $DISK
        head -c 250000 /dev/zero >$DISK/ballast
        $VASOS record $STORY -o $DISK/run.rrd --speed 100 --no-viewer &
        sleep 4; rm $DISK/ballast; sleep 3; kill -INT $!; wait $!; status=$?
        cp $DISK/run.rrd $OUT; exit $status'";
    let output = shell(script, &[("DISK", &mount), ("OUT", &out), ("STORY", &scenario)]);
    let words = said(&output);
    assert!(words.contains("cannot be written") && words.contains("is written again"), "{words}");
    let run = &runs(&out)[0];
    let gaps: Vec<f64> = run.rows.time_s.windows(2).map(|t| t[1] - t[0]).filter(|gap| *gap > 0.3).collect();
    assert_eq!(gaps.len(), 1, "one gap while it was full: {gaps:?}; {words}");
    let moved = |event: &&Event| event_words(&event.kind).1 == "LIC-02: setpoint 18 cm";
    assert_eq!(run.events.iter().find(moved).map(|event| event.time_s), Some(300.0), "no command is lost");
    let told = |event: &&Event| event_words(&event.kind).1.contains("batches before this are missing");
    let told: Vec<f64> = run.events.iter().filter(told).map(|event| event.time_s).collect();
    assert_eq!(told.len(), 1, "the file says it as well: {told:?}");
    println!("{} rows, a gap of {} s at 100 ×; {words}", run.len(), gaps[0]);
}

#[test]
fn a_clock_that_jumps_costs_nothing() {
    let name = "a_clock_that_jumps_costs_nothing";
    let library = [
        "/usr/lib/x86_64-linux-gnu/faketime/libfaketime.so.1",
        "/usr/lib/aarch64-linux-gnu/faketime/libfaketime.so.1",
    ]
    .into_iter()
    .find(|path| Path::new(path).is_file());
    let Some(library) = library else { return skip(name, "no libfaketime: apt-get install libfaketime") };
    let folder = folder();
    let (path, clock) = (folder.path().join("run.rrd"), folder.path().join("clock"));
    std::fs::write(&clock, "+0").expect("written");
    let mut child = Command::new(PROGRAM)
        .args(["record", "stad", "--speed", "50", "--no-viewer", "--json", "-o"])
        .arg(&path)
        .env("LD_PRELOAD", library)
        .env("FAKETIME_TIMESTAMP_FILE", &clock)
        .env("FAKETIME_NO_CACHE", "1")
        .env("FAKETIME_DONT_FAKE_MONOTONIC", "1")
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    for jump in ["-7200", "+86400", "+0", "-315360000", "+315360000"] {
        std::thread::sleep(Duration::from_millis(900));
        std::fs::write(&clock, jump).expect("written");
    }
    std::thread::sleep(Duration::from_millis(900));
    interrupt(&child);
    let told = {
        let mut text = String::new();
        std::io::Read::read_to_string(&mut child.stdout.take().expect("a pipe"), &mut text).expect("text");
        text
    };
    let status = child.wait().expect("gone");
    assert!(status.success(), "{status}: {told}");
    let told: Value = serde_json::from_str(&told).expect("JSON");
    let run = &runs(&path)[0];
    assert_eq!(told["rows"], run.len());
    assert_eq!(told["lost"], 0);
    assert!(run.len() > 1000, "{}", run.len());
    assert!(
        run.rows.time_s.windows(2).all(|t| (t[1] - t[0] - 0.2).abs() < 1e-6),
        "time of the run goes on evenly"
    );
}

fn interrupt(child: &Child) {
    let status = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(status.expect("kill starts").success());
}

#[test]
fn an_interrupted_recorder_closes_its_recording() {
    let folder = folder();
    let path = folder.path().join("run.rrd");
    let (mut child, _stderr, _) = start(&path, &["--speed", "50"]);
    std::thread::sleep(Duration::from_millis(1500));
    interrupt(&child);
    let status = child.wait().expect("gone");
    assert!(status.success(), "{status}");
    assert!(runs(&path)[0].len() > 100);
}

#[test]
fn what_was_recorded_is_listed_exported_and_played() {
    let folder = folder();
    let file = |name: &str| folder.path().join(name).display().to_string();
    let scenario = folder.path().join("story.toml");
    let text = "schema = 1\nrig = \"stad\"\nduration_s = 60.0\n\
        [[event]]\nat_s = 10.0\nsetpoint = { tag = \"LIC-02\", level_cm = 18.0 }\n";
    std::fs::write(&scenario, text).expect("written");
    let (rrd, scenario) = (file("run.rrd"), scenario.display().to_string());
    let recorded =
        json_of(&vasos(&["record", &scenario, "-o", &rrd, "--speed", "100", "--no-viewer", "--json"]));
    assert_eq!(recorded["lost"], 0);
    let listed = json_of(&vasos(&["replay", &rrd, "--json"]));
    let run = &listed["runs"][0];
    assert_eq!(run["rows"], recorded["rows"]);
    assert_eq!((&run["rig"], &run["configuration"]), (&"stad".into(), &"coupled".into()));
    assert_eq!(run["loops"][0]["loop"], "LIC-02");
    assert!(run["loops"][0]["Kc"].is_number());
    let events = run["events"].as_array().expect("events");
    let setpoint = events.iter().find(|e| e["what"] == "LIC-02: setpoint 18 cm").expect("the setpoint");
    assert_eq!(setpoint["time_s"], 10.0, "{setpoint}");
    assert_eq!((&run["rows"], &run["to_s"]), (&301.into(), &60.0.into()));
    let text = String::from_utf8(vasos(&["replay", &rrd, "--events"]).stdout).expect("text");
    assert!(text.contains("LIC-02") && text.contains("setpoint 18 cm"), "{text}");

    let csv = file("run.csv");
    assert_eq!(vasos(&["replay", &rrd, "-o", &csv]).status.code(), Some(0));
    let exported = std::fs::read_to_string(&csv).expect("a file");
    assert!(exported.starts_with("time_s,sp_cm,pv_cm,mv_v,h1_cm"), "{}", &exported[..80]);
    assert!(exported.lines().skip(1).all(|row| row.ends_with(",AUTO")), "{}", &exported[..80]);
    let begun = Instant::now();
    let played = vasos(&["replay", &rrd, "--speed", "20"]);
    let took_s = begun.elapsed().as_secs_f64();
    let same = String::from_utf8(played.stdout).expect("text") == exported;
    assert!(same, "{}", String::from_utf8_lossy(&played.stderr));
    assert!(took_s > 2.5, "60 s at 20 × in {took_s} s");

    for (arguments, words) in [
        (&["replay", &csv][..], "not a recording"),
        (&["replay", &rrd, "--run", "2"], "1 runs"),
        (&["replay", &rrd, "-o", "run.txt"], ".parquet"),
        (&["replay", &rrd, "--speed", "0"], "1 to 1000"),
        (&["record", "stad", "-o", "run.csv"], ".rrd"),
        (&["record", "no_such_rig", "-o", "run.rrd"], "no_such_rig"),
        (&["record", "stad", "-o", "run.rrd", "--speed", "nan"], "1 to 1000"),
        (&["record", "stad", "-o", "run.rrd", "--configuration", "x"], "coupled, decoupled"),
        (&["record", "stad", "-o", "/no/folder/run.rrd"], "cannot be written"),
    ] {
        let output = vasos(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(said(&output).contains(words), "{arguments:?}: {}", said(&output));
    }
}

#[test]
fn a_simulated_scenario_goes_out_as_csv_parquet_and_recording_alike() {
    let folder = folder();
    let scenario = folder.path().join("run.toml");
    std::fs::write(&scenario, "schema = 1\nrig = \"simtank1\"\nduration_s = 30.0\n").expect("written");
    let written: Vec<PathBuf> =
        ["csv", "parquet", "rrd"].map(|e| folder.path().join(format!("run.{e}"))).into();
    for path in &written {
        let out = vasos(&["simulate", &scenario.display().to_string(), "-o", &path.display().to_string()]);
        assert_eq!(out.status.code(), Some(0), "{}", said(&out));
    }
    let logs: Vec<_> = written
        .iter()
        .map(|path| vasos_io::log::open_log(path, &vasos_io::log::ImportOptions::default()).expect("opens"))
        .collect();
    for log in &logs[1..] {
        assert_eq!(log.table.time_s.len(), logs[0].table.time_s.len());
        for (a, b) in log.table.columns.iter().zip(&logs[0].table.columns) {
            assert_eq!(a.name, b.name);
            let same = a.values.iter().zip(&b.values).all(|(a, b)| a == b || a.is_nan() && b.is_nan());
            assert!(same, "{}", a.name);
        }
    }
}

/// The viewer is a program of its own: a stand-in that writes down how it was called shows what would be started.
#[cfg(unix)]
#[test]
fn a_recording_is_opened_in_the_viewer_that_is_named_or_the_reader_is_told_how_to_get_one() {
    use std::os::unix::fs::PermissionsExt;
    let folder = folder();
    let file = |name: &str| folder.path().join(name);
    let scenario = file("run.toml");
    std::fs::write(&scenario, "schema = 1\nrig = \"simtank1\"\nduration_s = 10.0\n").expect("written");
    let rrd = file("run.rrd").display().to_string();
    let made = vasos(&["simulate", &scenario.display().to_string(), "-o", &rrd]);
    assert_eq!(made.status.code(), Some(0), "{}", said(&made));
    let (viewer, called) = (file("rerun"), file("called"));
    // Built-in words only: there is no path.
    let script = format!("#!/bin/sh\necho \"$@\" >{}\n", called.display());
    std::fs::write(&viewer, script).expect("written");
    std::fs::set_permissions(&viewer, std::fs::Permissions::from_mode(0o755)).expect("executable");
    let open = |viewer: &Path| {
        let mut command = Command::new(PROGRAM);
        // Nothing of this computer's own is found.
        command.env("VASOS_RERUN", viewer).env("PATH", "/nowhere").env("HOME", folder.path());
        command.env_remove("VIRTUAL_ENV").current_dir(folder.path()).args(["replay", &rrd, "--open"]);
        command.output().expect("the program starts")
    };
    let opened = open(&viewer);
    assert_eq!(opened.status.code(), Some(0), "{}", said(&opened));
    let limit = Instant::now() + Duration::from_secs(10);
    let mut arguments = String::new();
    while !arguments.ends_with('\n') && Instant::now() < limit {
        std::thread::sleep(Duration::from_millis(20));
        arguments = std::fs::read_to_string(&called).unwrap_or_default();
    }
    assert_eq!(arguments.trim(), format!("--bind 127.0.0.1 --port 0 {rrd}"));
}
