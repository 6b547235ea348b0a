//! `vasos excite` as scripts call it.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

fn excite(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_vasos"));
    command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY").arg("excite").args(arguments);
    command.output().expect("the program starts")
}

fn json(arguments: &[&str]) -> (Value, i32) {
    let output = excite(&[&["stad", "--loop", "LIC-02", "--level", "15", "--json"], arguments].concat());
    let text = String::from_utf8(output.stdout).expect("text");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    let value = serde_json::from_str(&text).unwrap_or_else(|error| panic!("{error}: {text}{said}"));
    (value, output.status.code().expect("a status"))
}

fn refused(arguments: &[&str]) -> String {
    let output = excite(arguments);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}");
    String::from_utf8(output.stderr).expect("text")
}

fn scratch(name: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join(name)
}

#[test]
fn a_relay_gives_its_cycle_the_model_and_the_whole_run() {
    let path = scratch("excite_relay.csv");
    let name = path.to_str().expect("a path");
    let (whole, status) = json(&["--relay", "0.4", "--hysteresis", "0.1", "--ideal", "-o", name]);
    assert_eq!((status, &whole["finished"], &whole["ended"]), (0, &Value::Bool(true), &Value::Null));
    let mut keys: Vec<&str> = whole.as_object().expect("an object").keys().map(String::as_str).collect();
    keys.sort_unstable();
    let expected = [
        "ended",
        "finished",
        "limits",
        "loop",
        "measured",
        "model",
        "mv_at_rest",
        "noise_sd",
        "output",
        "pv_at_rest",
        "rows",
        "signal",
        "warnings",
    ];
    assert_eq!(keys, expected);
    for key in ["Ku", "Pu_s", "amplitude", "hysteresis", "wu_rad_s"] {
        assert!(whole["measured"][key].as_f64().is_some_and(|v| v > 0.0), "{key}");
    }
    assert!(whole["measured"]["static_gain"].is_null(), "a symmetric relay does not tell it");
    // The rig's exact ultimate gain at that level, with its sampling, is 15.2.
    let ku = whole["model"]["Ku"].as_f64().expect("a number");
    assert!((ku / 15.2 - 1.0).abs() < 0.2, "{ku}");
    let csv = std::fs::read_to_string(&path).expect("written");
    assert_eq!(csv.lines().count() as u64, whole["rows"].as_u64().expect("a number") + 1);
    let text = String::from_utf8(excite(&["stad", "--loop", "LIC-02", "--relay", "0.4"]).stdout);
    let text = text.expect("text");
    assert!(text.contains("relay test finished") && text.contains("Ku of the model"), "{text}");
}

#[test]
fn every_signal_runs() {
    for (signal, measured) in [
        (&["--step", "0.1"][..], "gain"),
        (&["--setpoint-step", "1", "--stay"], "gain"),
        (&["--doublet", "0.2", "--hold", "60"], ""),
        (&["--prbs", "0.2", "--clock", "5", "--register", "5"], ""),
        (&["--sine", "0.3", "--frequencies", "0.1,0.3", "--cycles", "2"], "frequencies"),
        (&["--ultimate-gain", "4", "--kick", "0.2"], "Ku"),
    ] {
        let (whole, status) = json(&[signal, &["--ideal"]].concat());
        assert_eq!(status, 0, "{signal:?}: {}", whole["ended"]);
        assert!(measured.is_empty() || !whole["measured"][measured].is_null(), "{signal:?}");
    }
}

#[test]
fn a_test_that_ends_early_is_a_no_with_its_reason() {
    let (whole, status) = json(&["--step", "0.3", "--pv-high", "15.5"]);
    assert_eq!((status, &whole["finished"]), (1, &Value::Bool(false)));
    assert!(whole["ended"].as_str().is_some_and(|r| r.contains("15.5")), "{}", whole["ended"]);
    let (whole, status) = json(&["--relay", "0.4", "--budget", "40"]);
    assert_eq!(status, 1);
    assert!(whole["ended"].as_str().is_some_and(|r| r.contains("40 s")), "{}", whole["ended"]);
}

#[test]
fn what_cannot_be_is_refused_in_words() {
    for (arguments, said) in [
        (&["stad", "--loop", "LIC-02", "--relay", "3"][..], "smaller move"),
        (&["stad", "--loop", "LIC-09", "--relay", "0.3"], "LIC-09"),
        (&["nowhere", "--loop", "LIC-02", "--relay", "0.3"], "nowhere"),
        (&["stad", "--loop", "LIC-02", "--relay", "-0.3"], "it must be > 0"),
        (&["stad", "--loop", "LIC-02", "--relay", "0.3", "--cycles", "1"], "cycles"),
        (&["stad", "--loop", "LIC-02"], "required"),
        (&["stad", "--loop", "LIC-02", "--relay", "0.3", "--step", "0.1"], "cannot be used"),
        (&["stad", "--loop", "LIC-02", "--doublet", "0.3"], "--hold"),
        (&["stad", "--loop", "LIC-02", "--relay", "0.3", "-o", "x.txt"], ".csv"),
    ] {
        let error = refused(arguments);
        assert!(error.contains(said), "{arguments:?}: {error}");
    }
}

#[test]
fn a_scenario_says_how_its_tests_ended() {
    let path = scratch("excite_scenario.toml");
    let test =
        "excite = { tag = \"LIC-02\", excitation = { signal = { step = { size = 0.1 } }, budget_s = 60.0 } }";
    let scenario = "schema = 1\nrig = \"stad\"\nduration_s = 90.0\n[[event]]\nat_s = 5.0\n";
    std::fs::write(&path, format!("{scenario}{test}\n")).expect("written");
    let simulate = |more: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_vasos"));
        let output = command.arg("simulate").arg(&path).args(more).output().expect("the program starts");
        assert_eq!(output.status.code(), Some(0));
        String::from_utf8(output.stdout).expect("text")
    };
    let text = simulate(&[]);
    assert!(text.contains("LIC-02: step test ended after 60 s"), "{text}");
    let whole: Value = serde_json::from_str(&simulate(&["--json"])).expect("JSON");
    let test = &whole["tests"][0];
    assert_eq!(
        (&test["signal"], &test["finished"], &test["from_s"]),
        (&"step".into(), &false.into(), &5.0.into())
    );
}
