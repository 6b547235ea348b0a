//! `vasos log`, and logs of all kinds as arguments of other commands.

use std::path::Path;
use std::process::{Command, Output};

use serde_json::{Value, json};

fn vasos(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_vasos"));
    command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY").args(arguments);
    command.output().expect("the program starts")
}

fn json_of(arguments: &[&str]) -> Value {
    let output = vasos(arguments);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("JSON")
}

fn file(folder: &Path, name: &str, text: &str) -> String {
    let path = folder.join(name);
    std::fs::write(&path, text).expect("a file");
    path.display().to_string()
}

/// A step of a first order, row by row, from `from` to `to`.
fn step(from: usize, to: usize) -> String {
    let row = |k: usize| {
        let mv = if k < 20 { 3.0 } else { 4.0 };
        let pv = if k < 20 { 10.0 } else { 10.0 + 2.0 * (1.0 - (-(k as f64 - 20.0) / 15.0).exp()) };
        let number = |v: f64| format!("{v:.4}").replace('.', ",");
        format!("{:02}/06/2024 10:{:02}:{:02};{};{}\n", 3, k / 60, k % 60, number(pv), number(mv))
    };
    format!("Hora;Nível (cm);Bomba (V)\n{}", (from..to).map(row).collect::<String>())
}

#[test]
fn says_what_is_in_a_log() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = file(folder.path(), "step.csv", &step(0, 120).replacen("10,0000", "ruim", 1));
    let found = json_of(&["log", &path, "--json"]);
    assert_eq!(found["rows"], 120);
    assert_eq!(found["length_s"], 119.0);
    assert_eq!(found["roles"], json!({"pv": "Nível", "sp": null, "mv": "Bomba", "mode": null}));
    assert_eq!(found["columns"][0]["unit"], "cm");
    assert_eq!(found["columns"][0]["missing"], 1);
    assert_eq!(found["format"]["text"]["decimal"], "comma");
    assert_eq!(found["start"], json!({"calendar": "2024-06-03T10:00:00"}));
    assert_eq!(found["repairs"][0]["kind"], "missing_values");
    assert_eq!(found["repairs"][0]["line"], 2);
    assert!(found["repairs"][0]["says"].as_str().is_some_and(|s| s.contains("ruim")));
    let turned = json_of(&["log", &path, "--dates", "month-first", "--json"]);
    assert_eq!(turned["start"], json!({"calendar": "2024-03-06T10:00:00"}));
    let text = String::from_utf8(vasos(&["log", &path]).stdout).expect("text");
    for words in ["120 rows", "Nível", "PV", "ruim", "Hora"] {
        assert!(text.contains(words), "{words} is not in\n{text}");
    }
}

#[test]
fn several_files_are_one_log_for_identify_too() {
    let folder = tempfile::tempdir().expect("a folder");
    let paths = [file(folder.path(), "1.csv", &step(0, 60)), file(folder.path(), "2.csv", &step(60, 120))];
    let found = json_of(&["log", &paths[1], &paths[0], "--json"]);
    assert_eq!((&found["rows"], &found["files"][1]["name"]), (&json!(120), &json!("2.csv")));
    let model = json_of(&["identify", &paths[0], &paths[1], "--structure", "fopdt", "--json"]);
    let gain = model["models"][0]["K"].as_f64().expect("a gain");
    assert!((gain - 2.0).abs() < 0.05, "{gain}");
}

#[test]
fn what_is_no_log_is_refused_with_the_reason() {
    let folder = tempfile::tempdir().expect("a folder");
    let prose = file(folder.path(), "letter.txt", "Dear all,\nthe pump is broken.\n");
    let dates = file(folder.path(), "dates.csv", "Time\n2024-11-26 12:29:33\n2024-11-26 12:30:33\n");
    let numbers = file(folder.path(), "six.txt", "0.75\n0.49\n116.9\n20\n1\n3\n");
    let nowhere = folder.path().join("nowhere.csv").display().to_string();
    for (path, reason) in [
        (&prose, "no rows of numbers"),
        (&dates, "2 time stamps but no measurement"),
        (&numbers, "6 numbers in one column"),
        (&nowhere, "cannot be read"),
    ] {
        let output = vasos(&["log", path]);
        let said = String::from_utf8(output.stderr).expect("text");
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains(reason) && said.contains(path.as_str()), "{said}");
    }
}
