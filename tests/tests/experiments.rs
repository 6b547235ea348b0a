//! Every experiment that ships reaches its outcome, and would say so if it did not.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use vasos_engine::experiment::{
    CheckOutcome, Expectation, Experiment, ExperimentEnd, ExperimentRun, run_experiment,
};
use vasos_engine::plant::Text;
use vasos_io::experiment::{
    EXPERIMENTS, experiment, explained, load_experiment, parse_experiment, write_experiment_csv,
};
use vasos_tests::root;

fn finished(experiment: &Experiment) -> ExperimentRun {
    let end = run_experiment(experiment, &AtomicBool::new(false), &mut |_| {});
    match end.unwrap_or_else(|error| panic!("{}: {error}", experiment.spec.id)) {
        ExperimentEnd::Finished(run) => run,
        ExperimentEnd::Cancelled => panic!("nobody cancels"),
    }
}

fn load(id: &str) -> Experiment {
    experiment(id).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn every_experiment_reaches_its_outcome() {
    for embedded in EXPERIMENTS {
        let start = std::time::Instant::now();
        let run = finished(&load(embedded.id));
        println!("{}: {} checks, {} ms", embedded.id, run.checks.len(), start.elapsed().as_millis());
        let missed: Vec<_> = run.checks.iter().filter(|check| !check.passes()).collect();
        assert!(missed.is_empty(), "{}: {missed:#?}", embedded.id);
        for result in &run.runs {
            assert!(result.columns.iter().all(|c| c.values.len() == result.x.len()), "{}", result.id);
        }
    }
}

/// A check that would pass whatever the run gives checks nothing.
#[test]
fn a_falsified_expectation_is_not_reached() {
    for embedded in EXPERIMENTS {
        let run = finished(&load(embedded.id));
        for check in &run.checks {
            let found = check.found.expect("a number");
            let falsified = match check.expectation {
                Expectation::Value { expected, tolerance } => {
                    Expectation::Value { expected: expected + 2.1 * tolerance.max(1e-3), tolerance }
                }
                Expectation::Range { low, high } if high.is_finite() => {
                    Expectation::Range { low, high: found.min(high) - 1e-9 - 1e-6 * found.abs() }
                }
                Expectation::Range { high, .. } => {
                    Expectation::Range { low: found + 1e-9 + 1e-6 * found.abs(), high }
                }
                Expectation::Less { than } => Expectation::More { than },
                Expectation::More { than } => Expectation::Less { than },
            };
            let other = CheckOutcome { expectation: falsified, ..check.clone() };
            assert!(check.passes() && !other.passes(), "{}: {:?}", embedded.id, check.title);
            let nothing = CheckOutcome { found: None, ..check.clone() };
            assert!(!nothing.passes());
        }
    }
    let text = EXPERIMENTS.iter().find(|e| e.id == "simtank_steady_levels").expect("there").text;
    let falsified = text.replacen("expected = 5.935", "expected = 5.945", 1);
    let experiment = parse_experiment("own.toml", &falsified, Path::new("")).expect("an experiment");
    let run = finished(&experiment);
    assert!(!run.reached() && run.checks.iter().filter(|c| !c.passes()).count() == 1);
}

#[test]
fn files_are_named_as_they_call_themselves_and_speak_both_languages() {
    let both = |text: &Text| match text {
        Text::One(text) => text.chars().filter(|c| c.is_alphabetic()).count() < 40,
        Text::ByLanguage(texts) => texts.keys().map(String::as_str).eq(["en", "pt-BR"]),
    };
    for embedded in EXPERIMENTS {
        let spec = load(embedded.id).spec;
        assert_eq!(spec.id, embedded.id);
        for text in [&spec.title, &spec.shows, &spec.reading, &spec.source] {
            let languages = matches!(text, Text::ByLanguage(_)) && both(text);
            assert!(languages && text.get("en") != text.get("pt-BR"), "{}: {text:?}", spec.id);
        }
        let titles =
            spec.runs.iter().filter_map(|r| r.title.as_ref()).chain(spec.checks.iter().map(|c| &c.title));
        for title in titles {
            assert!(both(title), "{}: {title:?}", spec.id);
        }
    }
    let folder = std::fs::read_dir(root().join("assets/experiments")).expect("listed");
    let names = folder.map(|e| e.expect("an entry").path());
    let files: BTreeSet<String> =
        names.map(|p| p.file_stem().expect("a name").to_string_lossy().into_owned()).collect();
    let embedded: BTreeSet<String> = EXPERIMENTS.iter().map(|e| e.id.to_owned()).collect();
    assert_eq!(files, embedded, "files, and those the program has");
}

#[test]
fn the_same_experiment_gives_the_same_bytes() {
    let folder = tempfile::tempdir().expect("a folder");
    let [a, b] = ["a.csv", "b.csv"].map(|name| {
        let path = folder.path().join(name);
        write_experiment_csv(&finished(&load("stad_figure_7")), &path).expect("written");
        std::fs::read_to_string(path).expect("read")
    });
    assert!(a == b && a.starts_with("run,time_s,sp,pv,mv,load\nopen_loop,0,0,0,0,0\n"), "{}", &a[..80]);
}

#[test]
fn a_raised_flag_ends_it_and_progress_goes_forward() {
    let experiment = load("stad_figure_7");
    let cancel = AtomicBool::new(false);
    let mut seen = Vec::new();
    let end = run_experiment(&experiment, &cancel, &mut |progress| {
        seen.push(progress.done as f64 + progress.share);
        cancel.store(progress.done == 2, Ordering::Relaxed);
    });
    assert_eq!(end, Ok(ExperimentEnd::Cancelled));
    assert!(
        seen.windows(2).all(|w| w[1] >= w[0]) && seen.len() >= 3 && seen.iter().all(|s| *s < 3.0),
        "{seen:?}"
    );
}

/// A bad file is mended where its error points.
#[test]
fn errors_name_the_line_and_what_was_expected() {
    let text = EXPERIMENTS.iter().find(|e| e.id == "simtank_steady_levels").expect("there").text;
    // What is replaced, by what, the line it is reported on (that of the text that stands there), and what is said.
    let cases = [
        ("duration_s = 3000.0", "duration_s = \"long\"", "duration_s", "expected f64"),
        ("of = \"overflows\"", "of = \"overflow\"", "of = \"overflow\"", "unknown variant `overflow`"),
        ("tolerance = 0.0006\n", "", "[[check]]", "a check expects one thing"),
        ("run = \"rest\"", "run = \"rast\"", "[[check]]", "there is no run rast; there are q_20"),
        ("inputs.BA01\"", "inputs.BA07\"", "[[run]]", "cannot be swept over scenario.start.inputs.BA07"),
        ("sweep = \"q\"", "sweep = \"p\"", "[[table]]", "there is no run p; there are q"),
        ("id = \"rest\"", "id = \"q_20\"", "[[table]]", "'q_20' is not possible as an id"),
        (
            "rig = \"simtank1\"",
            "rig = \"simtank9\"",
            "[[run]]",
            "there is no rig simtank9: name a preset (stad, ",
        ),
        ("keep_every = 10", "keep_evry = 10", "keep_evry", "unknown field `keep_evry`"),
    ];
    for (from, to, on, says) in cases {
        let changed = text.replacen(from, to, 1);
        assert!(changed != text, "{from}");
        let line = changed[..changed.find(on).expect(on)].matches('\n').count() + 1;
        let error = parse_experiment("own.toml", &changed, Path::new("")).expect_err(to).to_string();
        println!("{error}");
        assert!(
            error.starts_with(&format!("own.toml, line {line}: ")) && error.contains(says),
            "{to}: {error}"
        );
    }
    // What only a run can tell.
    let folder = tempfile::tempdir().expect("a folder");
    let cases = [
        ("column = \"h1_spill_cm3_s\"", "column = \"h9\"", "the run q_70 has no column h9; it has sp"),
        ("tag = \"LIC-01\"", "tag = \"LIC-09\"", "q_20: at 0 s, mode: there is no LIC-09"),
    ];
    for (from, to, says) in cases {
        let path = folder.path().join("own.toml");
        std::fs::write(&path, text.replacen(from, to, 1)).expect("written");
        let name = path.display().to_string();
        let experiment = load_experiment(&name).expect("reads");
        let error = run_experiment(&experiment, &AtomicBool::new(false), &mut |_| {}).expect_err(to);
        let said = explained(&name, error).to_string();
        assert!(said.starts_with("own.toml, line ") && said.contains(says), "{said}");
    }
    assert!(load_experiment("no_such").is_err());
}

#[test]
fn a_scenario_file_is_found_beside_the_experiment() {
    let folder = tempfile::tempdir().expect("a folder");
    let scenario = "schema = 1\nrig = \"simtank1\"\nduration_s = 10.0\n";
    std::fs::write(folder.path().join("run.toml"), scenario).expect("written");
    let text = "schema = 1\nid = \"own\"\ntitle = \"t\"\nshows = \"s\"\nreading = \"r\"\nsource = \"o\"\n\
        [[run]]\nid = \"a\"\nscenario_file = \"run.toml\"\n\
        [[check]]\ntitle = \"level\"\nmeasure = { of = \"max\", run = \"a\", column = \"h1_cm\" }\nat_most = 30.0\n";
    let path = folder.path().join("own.toml");
    std::fs::write(&path, text).expect("written");
    let run = finished(&load_experiment(&path.display().to_string()).expect("reads"));
    assert!(run.reached() && run.runs[0].x.len() == 21);
}
