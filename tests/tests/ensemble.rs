//! Many plants at once against the same plants one by one.

use vasos_engine::plant::Measurement;
use vasos_engine::sim::{Scenario, Spread, run_ensemble, run_scenario};
use vasos_io::rig::preset;

fn scenario(rig: &str, measurement: Measurement) -> Scenario {
    let mut scenario: Scenario = toml::from_str(&format!(
        "schema = 1\nrig = \"{rig}\"\nduration_s = 1200.0\nseed = 5\n\
         event = [{{ at_s = 60.0, setpoint = {{ tag = \"LIC-02\", level_cm = 16.0 }} }}]"
    ))
    .expect("a scenario");
    scenario.measurement = measurement;
    scenario
}

const NO_SPREAD: Spread = Spread { valves: 0.0, areas: 0.0, pumps: 0.0 };
const SPREAD: Spread = Spread { valves: 0.02, areas: 0.02, pumps: 0.01 };

/// Plants in lanes share their steps, so that they differ from the same plants alone by the integrator's own error;
/// without converters no code flips, and the controllers stay together.
#[test]
fn plants_in_lanes_do_what_they_do_alone() {
    let network = preset("stad").expect("preset");
    let noisy = Measurement { noise: true, quantisation: false, resolution: false };
    let mut scenario = scenario("stad", noisy);
    let eight = run_ensemble(&network, &scenario, 8, SPREAD).expect("runs");
    let nine = run_ensemble(&network, &scenario, 9, SPREAD).expect("runs");
    assert_eq!((eight.in_lanes, nine.in_lanes), (8, 8), "the ninth is alone");
    assert_eq!(eight.members[..], nine.members[..8], "the first eight do not know of the ninth");
    // A valve that is turned to where it stands changes nothing, but lanes do not take it.
    scenario.events.push(vasos_engine::sim::ScenarioEvent {
        at_s: 0.0,
        command: vasos_engine::session::RigCommand::Valve { tag: "FV01".to_owned(), angle_deg: 30.0 },
    });
    let alone = run_ensemble(&network, &scenario, 8, SPREAD).expect("runs");
    assert_eq!(alone.in_lanes, 0);
    for (a, b) in eight.members.iter().zip(&alone.members) {
        assert!((a.end_cm - b.end_cm).abs() < 1e-5, "{} {}", a.end_cm, b.end_cm);
        assert!((a.iae_cm_s - b.iae_cm_s).abs() < 1e-3, "{} {}", a.iae_cm_s, b.iae_cm_s);
        assert!((a.tv / b.tv - 1.0).abs() < 1e-4);
    }
    for (a, b) in eight.bands_cm.iter().flatten().zip(alone.bands_cm.iter().flatten()) {
        assert!((a - b).abs() < 1e-5);
    }
}

#[test]
fn without_a_spread_every_plant_is_the_rig_of_the_file() {
    let network = preset("stad").expect("preset");
    let scenario = scenario("stad", Measurement::IDEAL);
    let together = run_ensemble(&network, &scenario, 8, NO_SPREAD).expect("runs");
    let single = run_scenario(network, &scenario).expect("runs");
    let level = single.column("h2_cm").expect("a column");
    for member in &together.members {
        assert!((member.end_cm - level[level.len() - 1]).abs() < 1e-9);
    }
}

#[test]
fn a_spread_spreads_and_the_same_seed_gives_the_same_bytes() {
    let network = preset("stad").expect("preset");
    let scenario = scenario("stad", Measurement::DEFAULT);
    let first = run_ensemble(&network, &scenario, 40, SPREAD).expect("runs");
    assert!(first == run_ensemble(&network, &scenario, 40, SPREAD).expect("runs"));
    assert_eq!(first.in_lanes, 40);
    assert!(first.bands_cm.iter().all(|[low, middle, high]| low <= middle && middle <= high));
    let [low, _, high] = first.bands_cm[50];
    assert!(high - low > 0.05, "{low} {high}");
}

#[test]
fn what_hits_a_rim_runs_one_by_one() {
    // The tank starts at its rim, with the pump at full flow and its loop too slow to take it back in time.
    let network = preset("simtank1").expect("preset");
    let mut scenario = scenario("simtank1", Measurement::DEFAULT);
    scenario.events[0].command =
        vasos_engine::session::RigCommand::Setpoint { tag: "LIC-01".to_owned(), level_cm: 29.9 };
    scenario.events[0].at_s = 0.0;
    scenario.start.levels_cm.insert("TQ1".to_owned(), 29.99);
    scenario.start.inputs.insert("BA01".to_owned(), 100.0);
    let run = run_ensemble(&network, &scenario, 8, SPREAD).expect("runs");
    assert_eq!((run.in_lanes, run.members.len()), (0, 8));
    assert!(run.members.iter().all(|m| (29.9..=30.0).contains(&m.level_cm[1])), "{:?}", run.members);
}

#[test]
fn impossible_ensembles_are_refused_in_words() {
    let network = preset("stad").expect("preset");
    let scenario = scenario("stad", Measurement::DEFAULT);
    let refusal =
        |count, spread| run_ensemble(&network, &scenario, count, spread).expect_err("refused").to_string();
    assert!(refusal(0, NO_SPREAD).contains("runs"));
    assert!(refusal(8, Spread { valves: 0.5, ..NO_SPREAD }).contains("spread of valves"));
    assert!(refusal(8, Spread { pumps: f64::NAN, ..NO_SPREAD }).contains("spread of pumps"));
}
