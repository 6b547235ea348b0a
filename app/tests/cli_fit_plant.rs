//! `vasos fit-plant` as scripts call it.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

fn vasos(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_vasos"));
    command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY").args(arguments);
    command.output().expect("the program starts")
}

fn asset(name: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets").join(name).display().to_string()
}

fn scratch(name: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join(name)
}

/// Arguments of a fit of the cascaded tanks to the record that scipy made, with more of them.
fn fit(more: &[&str]) -> Output {
    let log = asset("golden/cascaded_tanks_estimation.csv");
    let mut arguments = vec!["fit-plant", "cascaded_tanks", &log];
    arguments.extend(more);
    vasos(&arguments)
}

#[test]
fn it_answers_with_the_keys_of_the_spec_and_writes_a_rig_that_loads() {
    let (other, fitted) = (asset("golden/cascaded_tanks_validation.csv"), scratch("fitted.toml"));
    let path = fitted.display().to_string();
    let columns = ["--input", "pump=u_v", "--output", "h2=h2_v", "--validate", &other, "-o", &path, "--json"];
    let output = fit(&columns);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let said: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(said["initial_samples"], 50);
    for error in ["rmse_train", "rmse_validate"] {
        let rmse = said[error].as_f64().expect("a number");
        assert!((rmse / 0.02 - 1.0).abs() < 0.05, "{error} {rmse}");
    }
    let truth = said["interval_95"]["upper.spill_share"].as_array().expect("an interval");
    assert!(truth[0].as_f64() < Some(0.35) && truth[1].as_f64() > Some(0.35), "{truth:?}");
    assert_eq!(said["parameters"].as_object().map(serde_json::Map::len), Some(8));
    // The file it wrote is a rig, and one that follows the record from the start.
    let log = asset("golden/cascaded_tanks_estimation.csv");
    let again = ["fit-plant", &path, &log, "--input", "u=u_v", "--output", "LT02=h2_v", "--json"];
    let again: Value = serde_json::from_slice(&vasos(&again).stdout).expect("JSON");
    let scale = again["parameters"]["pump.scale"].as_f64().expect("a number");
    assert!((scale - 1.0).abs() < 1e-3, "{scale}");
    assert!(again["rmse_validate"].is_null());
}

#[test]
fn what_is_wrong_is_bad_input_with_the_reason() {
    let columns = ["--input", "pump=u_v", "--output", "h2=h2_v"];
    let cases: [(&[&str], &str); 8] = [
        (&["--input", "pump=u_v", "--output", "h2=level"], "level"),
        (&["--input", "u2=u_v", "--output", "h2=h2_v"], "there is no input u2"),
        (&["--input", "u=u_v", "--output", "h9=h2_v"], "there is no output h9"),
        (&["--output", "h2=h2_v"], "u=COLUMN"),
        (&["--fit", "V1.k=0..1"], "V1.k90"),
        (&["--fit", "V1.k90=1..0.1"], "must lie below"),
        (&["--fit", "V1.k90=1..2"], "outside its bounds"),
        (&["--fit", "V1.k90"], "LOW..HIGH"),
    ];
    for (arguments, reason) in cases {
        let whole: Vec<&str> =
            if arguments[0] == "--fit" { [&columns, arguments].concat() } else { arguments.to_vec() };
        let output = fit(&whole);
        let said = String::from_utf8(output.stderr).expect("text");
        assert!(output.status.code() == Some(2) && said.contains(reason), "{arguments:?}: {said}");
    }
    let log = asset("golden/cascaded_tanks_estimation.csv");
    let bare = vasos(&["fit-plant", "cascade", &log, "--input", "u=u_v", "--output", "h2=h2_v"]);
    assert!(String::from_utf8_lossy(&bare.stderr).contains("[fit]"));
}

/// A rig that cannot follow the record was answered with status 0.
#[test]
fn a_hopeless_fit_is_a_no() {
    let output = fit(&["--input", "pump=u_v", "--output", "h2=8-h2_v"]);
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert_eq!(output.status.code(), Some(1), "{said} {}", String::from_utf8_lossy(&output.stderr));
}
