//! `vasos experiment` as scripts and instructors call it.

use std::path::PathBuf;
use std::process::{Command, Output};

use serde_json::Value;

fn vasos(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_vasos"));
    // No display: nothing here may need one.
    command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY").arg("experiment").args(arguments);
    command.output().expect("the program starts")
}

fn scratch(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name)
}

fn json(output: &Output) -> Value {
    let text = String::from_utf8_lossy(&output.stdout);
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{error}: {text}"))
}

/// A file of one's own: an embedded one with a text replaced.
fn own(name: &str, from: &str, to: &str) -> String {
    let text = vasos_io::experiment::EXPERIMENTS
        .iter()
        .find(|e| e.id == "simtank_steady_levels")
        .expect("there")
        .text;
    assert!(text.contains(from));
    let path = scratch(name);
    std::fs::write(&path, text.replacen(from, to, 1)).expect("written");
    path.display().to_string()
}

#[test]
fn the_status_says_whether_the_outcome_is_reached() {
    let csv = scratch("levels.csv");
    let output = vasos(&["simtank_steady_levels", "-o", &csv.display().to_string()]);
    let text = String::from_utf8_lossy(&output.stdout);
    assert_eq!(output.status.code(), Some(0), "{text}");
    assert!(text.contains("reached: 6 of 6 checks") && !text.contains("not reached"), "{text}");
    let rows = std::fs::read_to_string(csv).expect("a file");
    assert!(rows.starts_with("run,time_s,q_cm3_s,sp,pv,mv,h1_cm,") && rows.contains("\nrest,,20,"), "{rows}");

    let missed = vasos(&[&own("missed.toml", "expected = 5.935", "expected = 5.945")]);
    let text = String::from_utf8_lossy(&missed.stdout);
    assert_eq!(missed.status.code(), Some(1), "{text}");
    let line = text.lines().find(|l| l.ends_with("NO")).expect("the check");
    assert!(line.contains("20 cm³/s") && line.contains("5.935") && line.contains("5.945 ± 0.0006"), "{line}");

    let bad = vasos(&[&own("bad.toml", "duration_s", "duration")]);
    let said = String::from_utf8_lossy(&bad.stderr);
    assert_eq!(bad.status.code(), Some(2), "{said}");
    assert!(said.contains("bad.toml, line ") && said.contains("unknown field `duration`"), "{said}");
    assert_eq!(vasos(&["no_such_experiment"]).status.code(), Some(2));
    assert_eq!(vasos(&["simtank_steady_levels", "-o", "x.rrd"]).status.code(), Some(2));
    assert_eq!(vasos(&[]).status.code(), Some(2));
}

#[test]
fn json_has_the_keys_its_help_names() {
    let list = json(&vasos(&["--list", "--json"]));
    let ids: Vec<&str> =
        list["experiments"].as_array().expect("a list").iter().filter_map(|e| e["id"].as_str()).collect();
    assert!(ids.contains(&"stad_figure_7"), "{ids:?}");
    let whole = json(&vasos(&["uff_second_order", "--json"]));
    assert_eq!((&whole["id"], &whole["reached"]), (&Value::from("uff_second_order"), &Value::from(true)));
    let check = whole["checks"][1].as_object().expect("a check");
    let mut keys: Vec<&str> = check.keys().map(String::as_str).collect();
    keys.sort_unstable();
    let named = [
        "at_least",
        "at_most",
        "expected",
        "found",
        "less_than",
        "more_than",
        "pass",
        "printed",
        "run",
        "title",
        "tolerance",
    ];
    assert_eq!(keys, named);
    assert_eq!(whole["runs"][0]["axis"]["name"], "time_s");
}
