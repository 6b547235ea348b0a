//! The examples of assets/SCHEMA.md and the scenarios that ship are read and run.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use vasos_engine::experiment::{ExperimentEnd, run_experiment};
use vasos_engine::session::RigCommand;
use vasos_engine::sim::{Scenario, run_scenario};
use vasos_io::experiment::parse_experiment;
use vasos_io::export::write_run;
use vasos_io::rig::{load_scenario, parse_rig};

fn assets() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets")
}

/// Text of the code block that opens with ```` ```toml KIND ````.
fn example(kind: &str) -> String {
    let page = std::fs::read_to_string(assets().join("SCHEMA.md")).expect("the page");
    let opening = format!("```toml {kind}\n");
    let start = page.find(&opening).expect("an example") + opening.len();
    let end = page[start..].find("```").expect("its end");
    page[start..start + end].to_owned()
}

fn runs(scenario: &Path) -> usize {
    let (scenario, network) = load_scenario(scenario).unwrap_or_else(|error| panic!("{error}"));
    run_scenario(network, &scenario).unwrap_or_else(|error| panic!("{error}")).time_s.len()
}

#[test]
fn the_rig_example_is_a_rig() {
    let network = parse_rig("SCHEMA.md", &example("rig")).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((network.tanks.len(), network.spec.configurations.len()), (2, 2));
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("rig.toml"), example("rig")).expect("written");
    let scenario = folder.path().join("run.toml");
    std::fs::write(&scenario, "schema = 1\nrig = \"rig.toml\"\nduration_s = 10.0\n").expect("written");
    assert_eq!(runs(&scenario), 21, "a rig file beside the scenario");
}

#[test]
fn the_scenario_example_runs_and_shows_every_command() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.toml");
    std::fs::write(&path, example("scenario")).expect("written");
    assert_eq!(runs(&path), 301);
    let scenario: Scenario = toml::from_str(&example("scenario")).expect("a scenario");
    let shown: BTreeSet<&str> = scenario.events.iter().map(|e| e.command.key()).collect();
    assert_eq!(shown, RigCommand::KEYS.into_iter().collect(), "every command");
}

#[test]
fn every_scenario_that_ships_runs_and_is_the_same_each_time() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut count = 0;
    for entry in std::fs::read_dir(assets().join("scenarios")).expect("listed") {
        let path = entry.expect("an entry").path();
        let (scenario, network) = load_scenario(&path).unwrap_or_else(|error| panic!("{error}"));
        let mut texts = Vec::new();
        for name in ["a.csv", "b.csv"] {
            let run = run_scenario(network.clone(), &scenario).unwrap_or_else(|error| panic!("{error}"));
            let file = folder.path().join(name);
            write_run(&run, &file).expect("written");
            texts.push(std::fs::read(file).expect("read"));
        }
        assert!(texts[0] == texts[1] && texts[0].len() > 10_000, "{}", path.display());
        count += 1;
    }
    assert!(count >= 4, "{count}");
}

#[test]
fn the_experiment_example_reaches_its_outcome() {
    let experiment = parse_experiment("SCHEMA.md", &example("experiment"), Path::new(""))
        .unwrap_or_else(|error| panic!("{error}"));
    let end = run_experiment(&experiment, &AtomicBool::new(false), &mut |_| {});
    let ExperimentEnd::Finished(run) = end.unwrap_or_else(|error| panic!("{error}")) else {
        panic!("nobody cancels")
    };
    assert!(run.reached(), "{:#?}", run.checks);
    assert_eq!(run.runs.len(), 8, "two of the sweep, one of each other kind, and a table");
}
