//! `vasos tune --optimal` and `vasos analyze --response` as scripts call them.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

fn vasos(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_vasos"));
    // No display: nothing here may need one.
    command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY").args(arguments);
    command.output().expect("the program starts")
}

fn json(arguments: &[&str], status: i32) -> Value {
    let output = vasos(arguments);
    let text = String::from_utf8(output.stdout).expect("text");
    assert_eq!(output.status.code(), Some(status), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{error}: {text}"))
}

fn refused(arguments: &[&str]) -> String {
    let output = vasos(arguments);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}");
    String::from_utf8(output.stderr).expect("text")
}

fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap_or_else(|| panic!("{key} in {value}"))
}

const FIC_18: &str = "K=0.6335,T=8,L=1";

#[test]
fn an_optimum_has_its_gains_limits_and_proof() {
    let whole = json(
        &["tune", "--model", FIC_18, "--optimal", "--ms", "1.05", "--mt", "1", "--ju", "1.58", "--json"],
        0,
    );
    let result = &whole["results"][0];
    // Spec tune.md, section 3: Jv 10.958 at Kp 0.6183, Ti 6.775; the optimum is flat.
    assert!((number(result, "Jv") / 10.958_16 - 1.0).abs() < 1e-4, "{result}");
    assert!((number(result, "Kc") / 0.6183 - 1.0).abs() < 5e-3, "{result}");
    assert!((number(result, "Kc") / number(result, "Ti_s") / number(result, "Ki") - 1.0).abs() < 1e-12);
    assert_eq!((&result["rule"], &result["controller"]), (&"optimal".into(), &"pi".into()));
    assert_eq!(result["limits"], serde_json::json!({"Ms": 1.05, "Mt": 1.0, "Ju": 1.58}));
    assert!(result["active"].as_array().expect("a list").contains(&"Ms".into()), "{result}");
    assert!(number(&result["certificate"], "gap") < 1e-4 && number(&result["certificate"], "excess") <= 1e-9);
    for key in [
        "stable",
        "Ms",
        "Mt",
        "Ju",
        "gain_margin",
        "phase_margin_deg",
        "valid",
        "warnings",
        "Td_s",
        "N",
        "Kd",
    ] {
        assert!(result.get(key).is_some(), "{key}");
    }
    assert_eq!(result["N"], Value::Null, "a PI has no filter");
}

#[test]
fn what_no_controller_meets_is_a_no_with_the_floor() {
    let whole = json(&["tune", "--model", FIC_18, "--optimal", "--ju", "1.5", "--json"], 1);
    let result = &whole["results"][0];
    assert_eq!(result["Kc"], Value::Null);
    assert!((number(&result["floor"], "Ju") * 0.6335 - 1.0).abs() < 1e-9, "{result}");
    let output = vasos(&["tune", "--model", "K=2,T=30,L=0", "--optimal", "--ms", "1.4"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&output.stderr).contains("set a limit on Ju"));
}

#[test]
fn questions_that_cannot_be_asked_are_refused() {
    let tune = |rest: &[&str]| {
        let start = ["tune", "--model", FIC_18, "--optimal"];
        refused(&start.iter().chain(rest).copied().collect::<Vec<_>>())
    };
    for (rest, words) in [
        (&["--ms", "0.9"][..], "must be greater than 1"),
        (&["--ms", "-2"][..], "must be greater than 1"),
        (&["--mt", "0.5"][..], "it must be 1 or more"),
        (&["--ju", "0"][..], "must be greater than 0"),
        (&["--objective", "best"][..], "choose one of jv, max-ki, iae-load, iae-setpoint"),
        (&["--controller", "p"][..], "choose --controller pi or pid"),
        (&["--filter", "10"][..], "belongs to --controller pid"),
        (&["--controller", "pid", "--filter", "0"][..], "must be greater than 0"),
        (&["--overshoot", "-5"][..], "from 0 to 100"),
    ] {
        let said = tune(rest);
        assert!(said.contains(words), "{rest:?}: {said}");
    }
    assert!(
        refused(&["tune", "--model", FIC_18, "--model", FIC_18, "--rule", "simc"])
            .contains("rules take one model")
    );
}

#[test]
fn a_family_an_objective_and_an_overshoot_are_kept() {
    let whole = json(
        &[
            "tune",
            "--model",
            "K=4.9,T=152,L=2",
            "--model",
            "K=4.2,T=110,L=2.6",
            "--optimal",
            "--objective",
            "max-ki",
            "--ms",
            "1.5",
            "--controller",
            "pi",
            "--overshoot",
            "10",
            "--json",
        ],
        0,
    );
    assert_eq!(whole["models"].as_array().map(Vec::len), Some(2));
    let result = &whole["results"][0];
    assert!(number(result, "Ms") <= 1.5 + 1e-6);
    assert_eq!(number(result, "value"), number(result, "Ki"));
    assert!(number(result, "overshoot_percent") <= 10.0 + 1e-6);
    let b = number(result, "b");
    assert!((0.0..=1.0).contains(&b), "{b}");
}

fn scratch(name: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join(name)
}

/// K = 2, T = 30 s, L = 3 s as sixty points, by the formula.
#[test]
fn a_measured_response_takes_a_models_place() {
    let mut text = "omega_rad_s;gain;phase_deg\n".to_owned();
    for k in 0..60 {
        let w = 0.003 * 10f64.powf(3.0 * f64::from(k) / 59.0);
        let gain = 2.0 / 1f64.hypot(30.0 * w);
        let phase = -(30.0 * w).atan() - 3.0 * w;
        text.push_str(&format!("{w};{gain};{}\n", phase.to_degrees()));
    }
    let path = scratch("response.csv");
    std::fs::write(&path, text).expect("written");
    let path = path.display().to_string();
    let best = |source: &[&str]| {
        let rest = ["--optimal", "--ms", "1.6", "--json"];
        let whole = json(&[&["tune"], source, &rest[..]].concat(), 0);
        number(&whole["results"][0], "Jv")
    };
    let (measured, model) = (best(&["--response", &path]), best(&["--model", "K=2,T=30,L=3"]));
    assert!((measured / model - 1.0).abs() < 5e-3, "{measured} {model}");
    let judged = |source: [&str; 2]| {
        let whole = json(&["analyze", source[0], source[1], "--gains", "Kc=3,Ti=20", "--json"], 0);
        number(&whole["result"], "Ms")
    };
    let (measured, model) = (judged(["--response", &path]), judged(["--model", "K=2,T=30,L=3"]));
    assert!((measured / model - 1.0).abs() < 5e-3, "{measured} {model}");
    assert!(refused(&["analyze", "--response", "none.csv", "--gains", "Kc=1"]).contains("cannot be read"));
    assert!(
        refused(&["tune", "--response", &path, "--optimal", "--objective", "iae-load"])
            .contains("choose Jv or Ki")
    );
}
