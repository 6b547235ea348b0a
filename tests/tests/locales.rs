//! Every sentence in every language: the translation files against each other, against the window's source and
//! against the English that errors print themselves.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use vasos_app::cli::parse::ParseError;
use vasos_engine::analyze::{FrequencyResponseError, MetricsError};
use vasos_engine::control::{FormError, GainsError};
use vasos_engine::document::DocumentError;
use vasos_engine::excitation::{ExcitationError, ExcitationWarning, StopReason};
use vasos_engine::experiment::{ExperimentError, RunError};
use vasos_engine::explain::Explain;
use vasos_engine::identify::grey_box::{GreyBoxError, GreyBoxVerdict};
use vasos_engine::identify::{FitError, FitVerdict, ReactionCurveError, RecordFinding};
use vasos_engine::model::{ModelError, ReduceError, StateSpaceError};
use vasos_engine::plant::{LinearError, RigError};
use vasos_engine::retune::Advice;
use vasos_engine::session::{Alarm, CommandError};
use vasos_engine::signal::ExpressionError;
use vasos_engine::sim::{CompareError, ScenarioError};
use vasos_engine::tune::optimum::OptimumError;
use vasos_engine::tune::{RuleError, RuleWarning, registry};
use vasos_io::frequency_response::FrequencyFileError;
use vasos_io::log::{ImportError, Repair};
use vasos_io::recording::viewer::ViewerError;
use vasos_io::recording::{RecordingError, RecordingFlaw, RecordingTrouble};
use vasos_io::rig::FileError;
use vasos_io::settings::SettingsTrouble;
use vasos_tests::{root, sources};

type Sentences = BTreeMap<String, String>;

/// A translation file with its nested keys joined by points.
fn sentences(language: &str) -> Sentences {
    fn flatten(value: &serde_json::Value, prefix: &str, out: &mut Sentences) {
        match value {
            serde_json::Value::Object(section) => {
                for (key, value) in section {
                    let joined = if prefix.is_empty() { key.clone() } else { format!("{prefix}.{key}") };
                    flatten(value, &joined, out);
                }
            }
            serde_json::Value::String(text) => {
                out.insert(prefix.to_owned(), text.clone());
            }
            other => assert_eq!(prefix, "_version", "{prefix} is {other}, not a text"),
        }
    }
    let path = root().join(format!("assets/locales/{language}.yml"));
    let text = std::fs::read_to_string(&path).expect("a translation file");
    let value = serde_saphyr::from_str(&text).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let mut out = Sentences::new();
    flatten(&value, "", &mut out);
    out
}

fn placeholders(sentence: &str) -> BTreeSet<&str> {
    sentence.split("%{").skip(1).filter_map(|rest| Some(rest.split_once('}')?.0)).collect()
}

#[test]
fn both_languages_say_the_same_things_with_the_same_values() {
    let (english, portuguese) = (sentences("en"), sentences("pt-BR"));
    let keys = |s: &Sentences| s.keys().cloned().collect::<BTreeSet<_>>();
    let only_one: Vec<_> = keys(&english).symmetric_difference(&keys(&portuguese)).cloned().collect();
    assert!(only_one.is_empty(), "in one language only: {only_one:?}");
    for (key, text) in &english {
        assert!(!text.trim().is_empty() && !portuguese[key].trim().is_empty(), "{key} is empty");
        assert_eq!(placeholders(text), placeholders(&portuguese[key]), "placeholders of {key}");
    }
}

/// The arguments of a call from after its opening parenthesis, split at the commas between them.
fn arguments(text: &str) -> Vec<&str> {
    let mut arguments = Vec::new();
    let (mut depth, mut quoted, mut escaped, mut start) = (1, false, false, 0);
    for (at, c) in text.char_indices() {
        match c {
            _ if escaped => escaped = false,
            '\\' if quoted => escaped = true,
            '"' => quoted = !quoted,
            '(' | '[' | '{' if !quoted => depth += 1,
            ')' | ']' | '}' if !quoted => depth -= 1,
            _ => {}
        }
        if depth == 0 || depth == 1 && !quoted && c == ',' {
            arguments.push(text[start..at].trim());
            start = at + 1;
        }
        if depth == 0 {
            break;
        }
    }
    arguments
}

/// The app's code without its comments.
fn app_sources() -> Vec<(PathBuf, String)> {
    let code = |l: &&str| !l.trim_start().starts_with("//");
    let bare = |text: String| text.lines().filter(code).collect::<Vec<_>>().join("\n");
    let found: Vec<_> = sources("app/src").into_iter().map(|(path, text)| (path, bare(text))).collect();
    assert!(!found.is_empty());
    found
}

fn literal(argument: &str) -> Option<&str> {
    argument.strip_prefix('"')?.strip_suffix('"').filter(|inner| !inner.contains('"'))
}

/// Every `tr!("key", name = …)`, with the names its sentence asks for; every `tr!(&format!("section.{…}"))`.
#[test]
fn what_the_window_says_is_there_and_gets_its_values() {
    let english = sentences("en");
    let mut wrong = Vec::new();
    for (path, code) in app_sources() {
        for call in code.split("tr!(").skip(1) {
            let arguments = arguments(call);
            let Some((key, values)) = arguments.split_first() else { continue };
            if let Some(key) = literal(key) {
                let given: BTreeSet<&str> =
                    values.iter().filter_map(|v| Some(v.split_once('=')?.0.trim())).collect();
                match english.get(key) {
                    None => wrong.push(format!("{}: no sentence {key}", path.display())),
                    Some(text) if placeholders(text) != given => {
                        wrong.push(format!("{}: {key} is given {given:?} for '{text}'", path.display()));
                    }
                    Some(_) => {}
                }
            } else if let Some((prefix, _)) = key.strip_prefix("&format!(\"").and_then(|k| k.split_once('{'))
                && !english.keys().any(|k| k.starts_with(prefix))
            {
                wrong.push(format!("{}: no section {prefix}", path.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Keys that reach `tr!` through a variable: texts of the shape `section.word` of a section there is.
#[test]
fn keys_that_go_through_variables_are_there() {
    let english = sentences("en");
    let sections: BTreeSet<&str> = english.keys().filter_map(|k| k.split('.').next()).collect();
    let plain =
        |text: &str| text.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || "_.".contains(c));
    let is_file =
        |text: &str| [".json", ".toml", ".csv", ".rrd", ".png"].iter().any(|end| text.ends_with(end));
    let mut wrong = Vec::new();
    for (path, code) in app_sources() {
        for text in code.lines().flat_map(|line| line.split('"').skip(1).step_by(2)) {
            let Some((section, rest)) = text.split_once('.') else { continue };
            let looks_like_a_key = plain(text) && !rest.is_empty() && !text.ends_with('.') && !is_file(text);
            let known = english.contains_key(text) || english.contains_key(&format!("said.{text}"));
            if looks_like_a_key && sections.contains(section) && !known {
                wrong.push(format!("{}: no sentence {text}", path.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn alarms_and_rules_have_names() {
    let english = sentences("en");
    let tag = String::new;
    let alarms = [
        Alarm::Overflow { tag: tag() },
        Alarm::PumpDry { tag: tag() },
        Alarm::BelowRange { tag: tag() },
        Alarm::AboveRange { tag: tag() },
        Alarm::SensorFault { tag: tag() },
        Alarm::OutputAtLimit { tag: tag() },
    ];
    for alarm in alarms {
        let sentence = english.get(&format!("alarm.{}", alarm.key()));
        assert!(sentence.is_some_and(|s| s.contains("%{tag}")), "{alarm:?}");
    }
    for rule in registry() {
        assert!(english.contains_key(rule.title_key), "{}", rule.title_key);
    }
}

/// Steps of the history are named by keys that only `DocumentCommand::key` spells out.
#[test]
fn steps_of_the_history_have_names() {
    let english = sentences("en");
    let path = root().join("engine/src/document/command.rs");
    let source = std::fs::read_to_string(path).expect("the source");
    let key = source.split("pub fn key(&self)").nth(1).and_then(|rest| rest.split("\n    }").next());
    let keys: Vec<&str> =
        key.expect("fn key").split("=> \"").skip(1).filter_map(|k| k.split('"').next()).collect();
    assert!(keys.len() > 10, "{keys:?}");
    for key in keys {
        assert!(english.contains_key(&format!("change.{key}")), "change.{key}");
    }
}

fn boxed<E: Explain + 'static>(samples: Vec<E>) -> Vec<Box<dyn Explain>> {
    samples.into_iter().map(|e| Box::new(e) as Box<dyn Explain>).collect()
}

/// One value of every kind of every error and finding.
fn findings() -> Vec<(&'static str, Vec<Box<dyn Explain>>)> {
    let refused = || CommandError::Speed { speed: -3.0 };
    let scenario = vec![
        ScenarioError::Command { at_s: 3.0, error: refused() },
        ScenarioError::Command { at_s: 3.0, error: RigError::NoTank.into() },
        ScenarioError::Event { at_s: 3.0, command: "fault", error: refused() },
        ScenarioError::Keep,
        ScenarioError::Length { duration_s: -1.0 },
        ScenarioError::Duration { duration_s: 1e9, sample_time_s: 0.2 },
    ];
    vec![
        ("RigError", boxed(RigError::samples())),
        ("CompareError", boxed(CompareError::samples())),
        ("LinearError", boxed(LinearError::samples())),
        ("ReduceError", boxed(ReduceError::samples())),
        ("StateSpaceError", boxed(StateSpaceError::samples())),
        ("ExperimentError", boxed(ExperimentError::samples())),
        ("RunError", vec![Box::new(RunError::Rig(RigError::NoTank))]),
        ("GainsError", boxed(GainsError::samples())),
        ("FormError", boxed(FormError::samples())),
        ("FrequencyFileError", boxed(FrequencyFileError::samples())),
        ("FrequencyResponseError", boxed(FrequencyResponseError::samples())),
        ("OptimumError", boxed(OptimumError::samples())),
        ("ModelError", boxed(ModelError::samples())),
        ("CommandError", boxed(CommandError::samples())),
        ("ExcitationError", boxed(ExcitationError::samples())),
        ("StopReason", boxed(StopReason::samples())),
        ("ExcitationWarning", boxed(ExcitationWarning::samples())),
        ("DocumentError", boxed(DocumentError::samples())),
        ("ScenarioError", boxed(scenario)),
        ("RecordingFlaw", boxed(RecordingFlaw::samples())),
        ("ViewerError", boxed(ViewerError::samples())),
        ("FitError", boxed(FitError::samples())),
        ("ReactionCurveError", boxed(ReactionCurveError::samples())),
        ("FitVerdict", boxed(FitVerdict::samples())),
        ("GreyBoxError", boxed(GreyBoxError::samples())),
        ("GreyBoxVerdict", boxed(GreyBoxVerdict::samples())),
        ("RecordFinding", boxed(RecordFinding::samples())),
        ("Advice", boxed(Advice::samples())),
        ("ExpressionError", boxed(ExpressionError::samples())),
        ("RuleError", boxed(RuleError::samples())),
        ("RuleWarning", boxed(RuleWarning::samples())),
        ("MetricsError", boxed(MetricsError::samples())),
        ("ImportError", boxed(ImportError::samples())),
        ("Repair", boxed(Repair::samples())),
        ("FileError", boxed(FileError::samples())),
        ("SettingsTrouble", boxed(SettingsTrouble::samples())),
        ("RecordingError", boxed(RecordingError::samples())),
        ("RecordingTrouble", boxed(RecordingTrouble::samples())),
        ("ParseError", boxed(ParseError::samples())),
    ]
}

/// A finding in words, as the window puts them together.
fn say(what: &dyn Explain, sentences: &Sentences) -> String {
    let key = format!("said.{}", what.key());
    let mut text = sentences.get(&key).unwrap_or_else(|| panic!("no sentence {key}")).clone();
    for (name, value) in what.args() {
        let value = what.cause().filter(|_| name == "error").map_or(value, |cause| say(cause, sentences));
        text = text.replace(&format!("%{{{name}}}"), &value);
    }
    text
}

#[test]
fn errors_say_in_the_window_what_they_print() {
    let (english, portuguese) = (sentences("en"), sentences("pt-BR"));
    for finding in findings().iter().flat_map(|(_, samples)| samples) {
        assert_eq!(say(&**finding, &english), finding.to_string(), "said.{}", finding.key());
        let translated = say(&**finding, &portuguese);
        assert!(!translated.contains("%{"), "said.{} leaves a value open: {translated}", finding.key());
    }
}

#[test]
fn no_error_is_left_out_here() {
    let mut found = BTreeSet::new();
    for (_, text) in ["engine/src", "io/src", "app/src"].into_iter().flat_map(sources) {
        let names = text.lines().filter_map(|l| l.strip_prefix("impl Explain for "));
        found.extend(names.map(|n| n.trim_end_matches([' ', '{']).to_owned()));
    }
    // A defect of a job of the window; private to it.
    found.remove("Defect");
    let compared = findings().into_iter().map(|(name, _)| name.to_owned()).collect();
    assert_eq!(found, compared, "errors with sentences, and those whose sentences are compared");
}

/// A sentence nobody says is a sentence nobody keeps true.
#[test]
fn every_sentence_under_said_belongs_to_an_error() {
    let known: BTreeSet<String> =
        findings().iter().flat_map(|(_, samples)| samples).map(|f| format!("said.{}", f.key())).collect();
    let sources = app_sources();
    let of_app = |key: &str| {
        let quoted = format!("\"{}\"", key.trim_start_matches("said."));
        sources.iter().any(|(_, code)| code.contains(&quoted))
    };
    let said = sentences("en").into_keys().filter(|k| k.starts_with("said."));
    let idle: Vec<_> = said.filter(|k| !known.contains(k) && !of_app(k)).collect();
    assert!(idle.is_empty(), "{idle:?}");
}
