//! Rigs fitted to records that something else made: scipy's two cascaded tanks that spill, and a real rig of two tanks.
//!
//! The real record may not be part of the project; the folder of it is named by `VASOS_TEST_DATA`.

use std::path::Path;
use std::sync::Arc;

use vasos_engine::identify::grey_box::{
    FreeParameter, GreyBoxProblem, GreyBoxRecord, RecordedInput, RecordedOutput, fit_rig, with_values,
};
use vasos_engine::plant::Network;
use vasos_engine::signal::LogTable;
use vasos_io::log::{ImportOptions, import_log};
use vasos_io::rig::{PRESETS, parse_rig, preset};
use vasos_io::rig_fitted::fitted_rig;
use vasos_tests::{root, skip};

fn table(path: &Path) -> LogTable {
    let bytes = std::fs::read(path).expect("a record");
    import_log("record.csv", &bytes, &ImportOptions::default()).expect("a table").table
}

fn column(table: &LogTable, name: &str) -> Vec<f64> {
    table.column(name).expect("a column").values.clone()
}

/// Rows of a record: an input, and outputs by tank.
fn rows(
    table: &LogTable,
    input: &str,
    outputs: &[(usize, &str)],
    range: std::ops::Range<usize>,
) -> GreyBoxRecord {
    let part = |name: &str| column(table, name)[range.clone()].to_vec();
    GreyBoxRecord {
        time_s: table.time_s[range.clone()].to_vec(),
        inputs: vec![RecordedInput { pump: 0, values: part(input) }],
        outputs: outputs
            .iter()
            .map(|&(tank, name)| RecordedOutput { tank, sensor: None, values: part(name) })
            .collect(),
    }
}

/// `assets/golden/cascaded_tanks_*.csv`, made by `tests/peers/cascaded_tanks_scipy.py` with these parameters and white
/// noise of 0.02 V on the lower level.
const TRUTH: [(&str, f64); 8] = [
    ("V1.k90", 0.048),
    ("V2.k90", 0.055),
    ("L1.k90", 0.004),
    ("L2.k90", 0.002),
    // 0.05 V/s per V in the preset's curve.
    ("pump.scale", 0.051 / 0.05),
    ("pump.offset_cm3_s", -0.012),
    ("upper.height_cm", 8.2),
    ("upper.spill_share", 0.35),
];

fn cascaded(column: &str) -> GreyBoxProblem {
    let network = preset("cascaded_tanks").expect("a preset");
    let record = |name: &str| {
        let table = table(&root().join(format!("assets/golden/cascaded_tanks_{name}.csv")));
        rows(&table, "u_v", &[(1, column)], 0..1024)
    };
    GreyBoxProblem {
        free: FreeParameter::marked(&network, 0).expect("marked parameters"),
        network,
        configuration: 0,
        train: record("estimation"),
        validate: Some(record("validation")),
    }
}

#[test]
fn val_cascaded_tanks_that_spill_are_found_within_their_intervals() {
    let fit = fit_rig(&cascaded("h2_v")).expect("a fit");
    for (name, truth) in TRUTH {
        let p = fit.parameters.iter().find(|p| p.name == name).expect("marked");
        println!("{name}: {} in {:?}, truth {truth}", p.value, p.interval_95);
        assert!((p.interval_95[0]..=p.interval_95[1]).contains(&truth), "{name}: {:?}", p.interval_95);
    }
    let validate = fit.validate.expect("a validation");
    assert!(fit.train.rmse < 0.0212 && validate.rmse < 0.0212, "{} {}", fit.train.rmse, validate.rmse);
    assert_eq!(fit.initial_samples, 50);
}

#[test]
fn val_cascaded_tanks_without_noise_are_found_exactly() {
    let fit = fit_rig(&cascaded("h2_exact_v")).expect("a fit");
    for (name, truth) in TRUTH {
        let p = fit.parameters.iter().find(|p| p.name == name).expect("marked");
        println!("{name}: {} of {truth}", p.value);
        // The record has seven decimals, and δ of the preset bends the root by 1e-6 of the flow.
        assert!((p.value / truth - 1.0).abs() < 2e-3, "{name}: {} of {truth}", p.value);
    }
}

#[test]
fn a_fitted_file_loads_and_keeps_what_else_is_in_it() {
    let text = PRESETS.iter().find(|p| p.id == "cascaded_tanks").expect("a preset").text;
    let problem = cascaded("h2_v");
    let values: Vec<f64> = problem.free.iter().map(|f| f.start * 1.05 + 0.01).collect();
    let spec = problem.spec_with(&values);
    let made = fitted_rig("cascaded_tanks.toml", text, &spec).expect("a file");
    assert_eq!(parse_rig("fitted.toml", &made.text).expect("loads").spec, spec);
    let comments =
        |text: &str| text.lines().filter(|l| l.starts_with('#')).map(str::to_owned).collect::<Vec<_>>();
    assert_eq!(comments(&made.text), comments(text));
    assert_eq!(made.no_longer_steady, Vec::<String>::new());
}

#[test]
fn a_leak_becomes_a_valve_and_a_weak_pump_no_longer_starts_at_rest() {
    let text = PRESETS.iter().find(|p| p.id == "stad").expect("a preset").text;
    let network = preset("stad").expect("a preset");
    let values = [("TQ2.leak_cm2_5_s", 0.8), ("BA01.scale", 0.5), ("BA01.delay_s", 2.1)];
    let values: Vec<_> = (values.iter())
        .map(|(name, value)| {
            let bounds = [0.0001_f64.min(*value), 10.0];
            let bounds = if name.contains("leak") { [0.0, 10.0] } else { bounds };
            (FreeParameter::new(&network, 0, name, bounds).expect("a parameter").target, *value)
        })
        .collect();
    let made = fitted_rig("stad.toml", text, &with_values(&network.spec, 0, &values)).expect("a file");
    let spec = parse_rig("fitted.toml", &made.text).expect("loads").spec.clone();
    assert_eq!(spec.configurations[0].delays_s["BA01"], 2.1);
    assert_eq!(spec.valves.last().map(|v| (v.id.as_str(), v.k90)), Some(("TQ2_leak", 0.8)));
    assert_eq!(made.no_longer_steady, ["coupled", "decoupled"]);
}

/// A rig of two tanks on a microcontroller, recorded by its makers (VASOS_TEST_DATA/stm32_two_tanks): the pump goes to
/// full duty at rest; levels in cm. Only shares of the areas show, which are therefore given.
const STM32: &str = r#"
schema = 1
id = "stm32"
title = "Two tanks"
delta_cm = 0.05
sample_time_s = 1.0
tank = [
  { id = "TQ1", signal = "h1", area_cm2 = 50.0, height_cm = 30.0, initial_cm = 2.0 },
  { id = "TQ2", signal = "h2", area_cm2 = 50.0, height_cm = 30.0, initial_cm = 1.0 },
]
pump = [{ id = "P", signal = "u", flow_signal = "q", to = "TQ1", unit = "%", min = 0.0, max = 100.0, initial = 0.0, curve = [[0.0, 0.0], [100.0, 20.0]] }]
valve = [
  { id = "V1", signal = "q1", from = "TQ1", to = "TQ2", drive = "free_fall", k90 = 10.0, angle_deg = 90.0 },
  { id = "V2", signal = "q2", from = "TQ2", drive = "free_fall", k90 = 5.0, angle_deg = 90.0 },
  { id = "L2", signal = "l2", from = "TQ2", drive = "free_fall", law = "laminar", k90 = 0.0, angle_deg = 90.0 },
]

[fit]
P.scale = [0.05, 5.0]
V1.k90 = [0.5, 100.0]
V2.k90 = [0.1, 50.0]
L2.k90 = [0.0, 5.0]
"#;

#[test]
fn val_a_real_rig_fitted_on_one_half_is_followed_on_the_other() {
    let Some(folder) = std::env::var_os("VASOS_TEST_DATA") else {
        return skip("val_a_real_rig_fitted_on_one_half_is_followed_on_the_other", "no VASOS_TEST_DATA");
    };
    let path = Path::new(&folder).join("stm32_two_tanks/Open_Loop.csv");
    if !path.exists() {
        return skip("val_a_real_rig_fitted_on_one_half_is_followed_on_the_other", "no stm32_two_tanks");
    }
    let table = table(&path);
    let network: Arc<Network> = parse_rig("stm32.toml", STM32).expect("a rig");
    let half = table.time_s.len() / 2;
    let part = |range| rows(&table, "3", &[(0, "1"), (1, "2")], range);
    let problem = GreyBoxProblem {
        free: FreeParameter::marked(&network, 0).expect("marked parameters"),
        train: part(0..half),
        validate: Some(part(half..table.time_s.len())),
        network,
        configuration: 0,
    };
    let fit = fit_rig(&problem).expect("a fit");
    let validate = fit.validate.expect("a validation");
    for p in &fit.parameters {
        println!("{}: {} in {:?}", p.name, p.value, p.interval_95);
    }
    for (train, other) in fit.train.outputs.iter().zip(&validate.outputs) {
        println!(
            "{}: {} cm fitted, {} cm in free run on the other half",
            train.signal, train.rmse, other.rmse
        );
    }
    println!("{:?}", fit.verdicts);
    // The lower level goes from 1.5 to 18 cm with noise of about 0.15 cm.
    assert!(fit.train.outputs[1].rmse < 0.4 && validate.outputs[1].rmse < 0.4);
}
