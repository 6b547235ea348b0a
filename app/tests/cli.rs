//! The program as scripts call it: exit status, JSON keys, reasons on standard error.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

fn vasos(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_vasos"));
    // No display: nothing here may need one.
    command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY").args(arguments);
    command.output().expect("the program starts")
}

fn json(arguments: &[&str]) -> (Value, i32) {
    let output = vasos(arguments);
    let text = String::from_utf8(output.stdout).expect("text");
    let value = serde_json::from_str(&text).unwrap_or_else(|error| panic!("{error}: {text}"));
    (value, output.status.code().expect("a status"))
}

/// Status and what standard error says.
fn refused(arguments: &[&str]) -> (i32, String) {
    let output = vasos(arguments);
    (output.status.code().expect("a status"), String::from_utf8(output.stderr).expect("text"))
}

fn asset(name: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets").join(name).display().to_string()
}

fn scratch(name: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join(name)
}

fn keys(value: &Value) -> Vec<&str> {
    let mut keys: Vec<&str> = value.as_object().expect("an object").keys().map(String::as_str).collect();
    keys.sort_unstable();
    keys
}

const MODEL: &str = "K=4.9,T=152,L=2";

#[test]
fn analyze_has_the_keys_of_the_spec_and_null_where_nothing_exists() {
    let (whole, status) = json(&["analyze", "--model", MODEL, "--gains", "Kc=7,Ti=15,Td=1,N=10", "--json"]);
    assert_eq!((status, keys(&whole)), (0, vec!["model", "result"]));
    let expected = [
        "Ju",
        "Jv",
        "Kc",
        "Kd",
        "Ki",
        "Ms",
        "Mt",
        "N",
        "Td_s",
        "Ti_s",
        "controller",
        "delay_margin_s",
        "gain_margin",
        "iae_load",
        "iae_setpoint",
        "overshoot_percent",
        "phase_margin_deg",
        "stable",
        "valid",
        "w_180_rad_s",
        "w_gc_rad_s",
        "warnings",
    ];
    assert_eq!(keys(&whole["result"]), expected);
    assert_eq!(whole["model"]["T_s"], 152.0);
    let (unstable, status) = json(&["analyze", "--model", MODEL, "--gains", "Kc=700", "--json"]);
    assert_eq!((status, &unstable["result"]["stable"]), (0, &Value::Bool(false)));
    assert!(unstable["result"]["Ms"].is_null() && unstable["result"]["Ti_s"].is_null());
}

#[test]
fn tune_gives_one_result_or_all_and_says_no_with_1() {
    let (whole, status) =
        json(&["tune", "--model", MODEL, "--rule", "amigo", "--controller", "pid", "--json"]);
    assert_eq!(status, 0);
    let result = &whole["results"][0];
    let expected = [
        "Ju",
        "Jv",
        "Kc",
        "Kd",
        "Ki",
        "Ms",
        "Mt",
        "N",
        "Td_s",
        "Ti_s",
        "controller",
        "gain_margin",
        "phase_margin_deg",
        "rule",
        "stable",
        "valid",
        "warnings",
    ];
    assert_eq!(keys(result), expected);
    assert_eq!((&result["rule"], &result["controller"]), (&"amigo".into(), &"pid".into()));
    let (all, status) = json(&["tune", "--model", MODEL, "--rule", "all", "--controller", "pi", "--json"]);
    let all = all["results"].as_array().expect("a list");
    assert!(status == 0 && all.len() > 8 && all.iter().all(|r| r["controller"] == "pi"));
    let (none, status) = json(&["tune", "--model", "K=1,T=5,L=0", "--rule", "amigo", "--json"]);
    assert!(status == 1 && none["results"][0]["Kc"].is_null());
}

#[test]
fn what_is_simulated_is_identified() {
    let csv = scratch("step.csv");
    let csv = csv.to_str().expect("text");
    let (run, status) = json(&["simulate", &asset("scenarios/step_coupled.toml"), "-o", csv, "--json"]);
    assert_eq!((status, &run["rows"]), (0, &Value::from(6001)));
    let header = std::fs::read_to_string(csv).expect("a file");
    assert!(header.starts_with("time_s,sp,pv,mv,h1_cm,"), "{}", &header[..40]);
    let (whole, status) =
        json(&["identify", csv, "--pv", "pv", "--mv", "mv", "--structure", "fopdt", "--json"]);
    assert_eq!(status, 0);
    assert_eq!(keys(&whole), ["chosen", "columns", "models", "repairs", "warnings"]);
    let model = &whole["models"][0];
    let expected =
        ["K", "L_s", "T_s", "aic", "bias", "fit_percent", "interval_95", "mse", "structure", "verdict"];
    assert_eq!(keys(model), expected);
    let near = |key: &str, expected: f64, tolerance: f64| {
        let value = model[key].as_f64().expect("a number");
        assert!((value - expected).abs() < tolerance, "{key} = {value}");
    };
    // The models that the STAD paper identified, 4.9, 152 and 2, on our calibrated rig.
    near("K", 4.98, 0.02);
    near("T_s", 153.4, 1.0);
    near("L_s", 2.2, 0.2);
    let (expression, _) = json(&["identify", csv, "--pv", "100*h2_cm/27", "--mv", "u_v", "--json"]);
    let gain = expression["models"][0]["K"].as_f64().expect("a number");
    assert!((gain / (4.98 * 100.0 / 27.0) - 1.0).abs() < 0.01, "{gain}");
}

#[test]
fn a_scenario_becomes_a_recording() {
    let path = scratch("run.rrd");
    let scenario = asset("scenarios/setpoint_coupled.toml");
    let output = vasos(&["simulate", &scenario, "-o", path.to_str().expect("text")]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let columns = vasos_io::recording::read_recording(&path).expect("reads");
    assert!(columns.iter().any(|c| c.time_s.len() == 6001));
}

#[test]
fn bad_input_ends_with_2_and_says_what_to_do() {
    let missing = asset("nothing.csv");
    let binary = env!("CARGO_BIN_EXE_vasos");
    for (arguments, word) in [
        (&["tune", "--model", "K=4,9,T=1", "--rule", "all"][..], "'9'"),
        (&["tune", "--model", MODEL, "--rule", "magic"][..], "amigo"),
        (&["tune", "--model", MODEL, "--rule", "amigo", "--controller", "x"][..], "pid"),
        (&["tune", "--model", MODEL, "--rule", "lambda", "--tau-c", "-1"][..], "-1"),
        (&["tune", "--model", MODEL, "--optimal", "--ms", "1.4"][..], "not available yet"),
        (&["analyze", "--model", MODEL, "--gains", "Kc=0"][..], "Kc = 0"),
        (&["identify", &missing][..], "nothing.csv"),
        (&["identify", binary][..], "export"),
        (&["identify", &missing, "--structure", "sopdt"][..], "not available yet"),
        (&["simulate", &missing][..], "nothing.csv"),
        (&["simulate", &missing, "-o", "x.parquet"][..], "not available yet"),
        (&["serve"][..], "not available yet"),
        (&["analyze"][..], "--model"),
    ] {
        let (status, said) = refused(arguments);
        assert!(status == 2 && said.contains(word), "{arguments:?}: {status} {said}");
    }
}
