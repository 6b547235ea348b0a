//! `vasos model` and `vasos compare` as scripts call them.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

fn vasos(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_vasos"));
    // No display: nothing here may need one.
    command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY").args(arguments);
    command.output().expect("the program starts")
}

fn json(arguments: &[&str]) -> Value {
    let output = vasos(arguments);
    let text = String::from_utf8(output.stdout).expect("text");
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{error}: {text}"))
}

fn refused(arguments: &[&str]) -> String {
    let output = vasos(arguments);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}");
    String::from_utf8(output.stderr).expect("text")
}

fn keys(value: &Value) -> Vec<&str> {
    let mut keys: Vec<&str> = value.as_object().expect("an object").keys().map(String::as_str).collect();
    keys.sort_unstable();
    keys
}

fn scenario(name: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets/scenarios").join(name).display().to_string()
}

fn scratch(name: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join(name)
}

#[test]
fn model_has_the_keys_its_help_names() {
    let model = json(&["model", "quadruple_nonminimum", "--json"]);
    assert_eq!(
        keys(&model),
        [
            "A",
            "B",
            "C",
            "D",
            "configuration",
            "dc_gain",
            "delays_s",
            "inputs",
            "operating_point",
            "outputs",
            "poles",
            "remarks",
            "rga",
            "rig",
            "states",
            "time_constants_s",
            "transfer_functions",
            "zeros",
        ]
    );
    let function = &model["transfer_functions"][0];
    assert_eq!(
        keys(function),
        [
            "L_s",
            "dc_gain",
            "den",
            "first_order_fit",
            "first_order_half_rule",
            "gain",
            "input",
            "num",
            "output",
            "poles",
            "reasons",
            "second_order_half_rule",
            "time_constants_s",
            "zeros",
        ]
    );
    let help = String::from_utf8(vasos(&["model", "--help"]).stdout).expect("text");
    for key in keys(&model).into_iter().chain(keys(function)).chain(keys(&model["operating_point"])) {
        assert!(help.contains(key), "the help names {key}");
    }
    // Johansson's zero in the right half-plane, and its relative gain.
    assert!((model["zeros"][0][0].as_f64().expect("real") - 0.013).abs() < 1e-3);
    assert!((model["rga"][0][0].as_f64().expect("a number") + 0.64).abs() < 0.01);
}

#[test]
fn model_takes_levels_inputs_and_angles() {
    let at = json(&["model", "stad", "--configuration", "coupled", "--at", "LIC-02=19", "--json"]);
    let point = &at["operating_point"];
    assert_eq!(point["levels_cm"]["TQ2"], 19.0);
    assert!((point["inputs"]["BA01"].as_f64().expect("V") - 3.185_810_6).abs() < 1e-6);
    assert_eq!(at["delays_s"][0], 1.7);
    // The published model of TQ2 is 4.9 cm/V and 152 s.
    let fit = &at["transfer_functions"][0]["first_order_fit"];
    assert!((fit["K"].as_f64().expect("K") - 5.11).abs() < 0.01, "{fit}");
    assert!((fit["T_s"].as_f64().expect("T") - 152.6).abs() < 0.1, "{fit}");
    let by_input = json(&["model", "stad", "--at", "BA01=3.1858106", "--pv", "TQ2", "--json"]);
    assert!((by_input["operating_point"]["levels_cm"]["TQ2"].as_f64().expect("cm") - 19.0).abs() < 1e-4);
    assert_eq!(by_input["outputs"].as_array().expect("outputs").len(), 1);
    let turned = json(&[
        "model",
        "stad",
        "--at",
        "FV01=33",
        "--at",
        "LIC-02=10",
        "--disturbances",
        "angles",
        "--json",
    ]);
    assert_eq!(turned["operating_point"]["angles_deg"]["FV01"], 33.0);
    assert_eq!(turned["inputs"].as_array().expect("inputs").len(), 4);
    // FV03 shut: TQ3 fills and spills, and an integrator has no gain at rest.
    let shut = json(&["model", "stad", "--configuration", "decoupled", "--at", "FV03=0", "--json"]);
    assert!(
        shut["dc_gain"].as_array().expect("rows").iter().all(|r| r[0] == 0.0 || r[0].is_null()),
        "{shut}"
    );
}

#[test]
fn model_says_what_it_cannot_do() {
    for (arguments, says) in [
        (&["model", "stad", "--at", "LIC-02=26"][..], "between 0 and 20.52 cm"),
        (
            &["model", "stad", "--at", "LIC-03=12"],
            "'LIC-03' cannot be set here: there are LIC-02, BA01, FV01",
        ),
        (&["model", "stad", "--at", "LIC-02"], "write TAG=NUMBER"),
        (&["model", "stad", "--at", "LIC-02=high"], "'high' is not a number"),
        (&["model", "stad", "--at", "FV01=91"], "FV01: angle_deg = 91"),
        (&["model", "stad", "--at", "BA01=2", "--at", "LIC-02=9"], "both given"),
        (&["model", "stad", "--configuration", "x"], "there are coupled, decoupled"),
        (&["model", "stad", "--pv", "TQ9"], "tanks are TQ1"),
        (&["model", "stad", "--pv", "TQ4"], "delivers 1.7 s later"),
        (&["model", "nowhere"], "nowhere"),
    ] {
        let reason = refused(arguments);
        assert!(reason.contains(says), "{arguments:?}: {reason}");
    }
}

#[test]
fn compare_holds_models_against_the_run_and_against_a_recording() {
    let file = scenario("step_coupled.toml");
    let own = json(&["compare", &file, "--json"]);
    assert_eq!(keys(&own), ["models", "operating_level_cm", "output", "recording", "remarks", "rig", "rows"]);
    assert_eq!(keys(&own["models"][0]), ["fit_percent", "model", "mse_cm2", "reason"]);
    let names: Vec<&str> =
        own["models"].as_array().expect("models").iter().filter_map(|m| m["model"].as_str()).collect();
    assert_eq!(
        names,
        ["non_linear", "state_space", "state_space_behind_curve", "transfer_function", "fopdt"]
    );
    assert!(own["models"][0]["fit_percent"].as_f64().expect("%") > 99.9999);
    assert!(own["models"][2]["fit_percent"].as_f64().expect("%") > 98.0);
    let (run, overlay) = (scratch("compare_run.csv"), scratch("compare_overlay.csv"));
    let (run, overlay) = (run.display().to_string(), overlay.display().to_string());
    assert_eq!(vasos(&["simulate", &file, "-o", &run]).status.code(), Some(0));
    let read = json(&["compare", &file, "--recording", &run, "--column", "h2_cm", "-o", &overlay, "--json"]);
    assert_eq!(read["rows"], own["rows"]);
    for (a, b) in
        read["models"].as_array().expect("models").iter().zip(own["models"].as_array().expect("models"))
    {
        let (a, b) = (a["fit_percent"].as_f64().expect("%"), b["fit_percent"].as_f64().expect("%"));
        assert!((a - b).abs() < 1e-4, "{a} {b}");
    }
    let text = std::fs::read_to_string(&overlay).expect("the overlay");
    assert!(text.starts_with("time_s,recording_cm,non_linear_cm,state_space_cm"), "{}", &text[..80]);
    assert_eq!(text.lines().count() as u64, own["rows"].as_u64().expect("rows") + 1);
    let reason = refused(&["compare", &file, "--recording", &run, "--input", "BA09=u_v"]);
    assert!(reason.contains("BA09=u_v"), "{reason}");
    let reason = refused(&["compare", &file, "--column", "h2_cm"]);
    assert!(reason.contains("--recording"), "{reason}");
}

#[test]
fn compare_follows_turned_valves_with_the_non_linear_model_alone() {
    let file = scratch("turned.toml");
    let text = "schema = 1\nrig = \"stad\"\nconfiguration = \"decoupled\"\nduration_s = 300.0\n\n[[event]]\nat_s = 50.0\nvalve = { tag = \"FV03\", angle_deg = 31.0 }\n";
    std::fs::write(&file, text).expect("written");
    let turned = json(&["compare", &file.display().to_string(), "--json"]);
    let mse = |i: usize| turned["models"][i]["mse_cm2"].as_f64().expect("cm²");
    // What is left of the non-linear model is noise and converter: 0.05 cm of it.
    assert!(mse(0) < 0.004 && mse(1) > 20.0 * mse(0), "{turned}");
    assert!(turned["remarks"][0].as_str().expect("a remark").contains("turns valves"), "{turned}");
}
