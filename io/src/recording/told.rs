//! What a replay needs to know of a run, as text inside its recording: settings at the beginning, commands, alarms,
//! models. TOML, because gains may be infinite, which JSON cannot say.

use rerun::AnyValues;
use rerun::components::Text;
use serde::{Deserialize, Serialize};
use vasos_engine::model::ProcessModel;
use vasos_engine::plant::Measurement;
use vasos_engine::session::{Alarm, EventKind, RigCommand, RunStart};

use super::seal::{is_whole, sealed};

/// Property of a recording that holds what follows.
pub(super) const PROPERTY: &str = "vasos";
/// Fields of the property.
pub(super) const RIG: &str = "rig";
pub(super) const RIG_FILE: &str = "rig_file";
pub(super) const START: &str = "start";
pub(super) const RUN: &str = "run";

/// What the rig file does not say of a beginning.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Beginning {
    /// Id of the configuration.
    pub configuration: String,
    /// Whether the last check sum of the run says that it is the last: it did not in recordings from before.
    #[serde(default)]
    pub tells_end: bool,
    /// Imperfections that are on.
    pub measurement: Option<Measurement>,
}

/// The property of a run.
pub(super) fn property(start: &RunStart) -> Result<AnyValues, toml::ser::Error> {
    let configuration = start.network.spec.configurations.get(start.configuration);
    let beginning = Beginning {
        configuration: configuration.map_or_else(String::new, |c| c.id.clone()),
        tells_end: true,
        measurement: start.measurement,
    };
    let (rig, run) = (start.network.spec.id.as_str(), start.run.to_string());
    let rig_file = sealed(&toml::to_string(&start.as_set)?, &[]);
    let beginning = sealed(&toml::to_string(&beginning)?, &[rig, &run]);
    Ok(AnyValues::default()
        .with_component::<Text>(RIG, [rig])
        .with_component::<Text>(RUN, [run])
        .with_component::<Text>("program", [format!("Vasos {}", env!("CARGO_PKG_VERSION"))])
        .with_component::<Text>(RIG_FILE, [rig_file])
        .with_component::<Text>(START, [beginning]))
}

/// An event as far as a replay carries it out.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
struct Told {
    #[serde(skip_serializing_if = "Option::is_none")]
    number: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    rig_loaded: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    running: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    alarm_on: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    alarm: Option<Alarm>,
    #[serde(skip_serializing_if = "Option::is_none")]
    test_over: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    command: Option<RigCommand>,
}

/// An event as text, sealed with its words: its number in the run, and for kinds of which the words are not enough what
/// a replay needs.
pub(super) fn told(kind: &EventKind, number: u64, words: &str) -> String {
    let none = Told { number: Some(number), ..Told::default() };
    let told = match kind {
        EventKind::RigLoaded { id } => Told { rig_loaded: Some(id.clone()), ..none },
        EventKind::Running => Told { running: Some(true), ..none },
        EventKind::Paused => Told { running: Some(false), ..none },
        EventKind::Done(command) => Told { command: Some(command.clone()), ..none },
        EventKind::Alarm(alarm, on) => Told { alarm: Some(alarm.clone()), alarm_on: Some(*on), ..none },
        EventKind::ExcitationEnded(report) => Told { test_over: Some(report.tag.clone()), ..none },
        EventKind::Recorded { test_over, .. } => Told { test_over: test_over.clone(), ..none },
        _ => none,
    };
    sealed(&toml::to_string(&told).unwrap_or_default(), &[words])
}

/// What a text tells of an event.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Heard {
    pub kind: EventKind,
    /// Its number in the run; `None` in recordings without.
    pub number: Option<u64>,
    /// The text and the words are as they were written.
    pub whole: bool,
}

/// The event that a text tells; its words where there is no more, or what there is has been changed.
/// `sums`: as [`is_whole`] has it.
pub(super) fn heard(text: &str, words: String, sums: bool) -> Heard {
    let whole = is_whole(text, &[&words], sums);
    let told: Option<Told> = toml::from_str(text).ok().filter(|_| whole);
    let number = told.as_ref().and_then(|told| told.number);
    Heard { kind: event_kind(told.unwrap_or_default(), words), number, whole }
}

fn event_kind(told: Told, words: String) -> EventKind {
    match told {
        Told { command: Some(command), .. } => EventKind::Done(command),
        Told { alarm: Some(alarm), alarm_on, .. } => EventKind::Alarm(alarm, alarm_on == Some(true)),
        Told { running: Some(true), .. } => EventKind::Running,
        Told { running: Some(false), .. } => EventKind::Paused,
        Told { rig_loaded: Some(id), .. } => EventKind::RigLoaded { id },
        Told { test_over, .. } => EventKind::Recorded { words, test_over },
    }
}

/// A model as text.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct ToldModel {
    pub pv_unit: String,
    pub mv_unit: String,
    pub model: ProcessModel,
}

#[cfg(test)]
mod tests {
    use super::*;
    use vasos_engine::control::{LoopOptions, Mode, PidGains, PidTuning};
    use vasos_engine::plant::{Fault, FaultKind};

    #[test]
    fn what_was_told_is_understood() {
        let tag = || "LIC-02".to_owned();
        let gains = PidGains { kc: -0.1, ti_s: f64::INFINITY, td_s: 1.0 / 3.0, n: 10.0 };
        let commands = [
            RigCommand::Tuning { tag: tag(), tuning: PidTuning::new(gains) },
            RigCommand::Setpoint { tag: tag(), level_cm: 0.1 + 0.2 },
            RigCommand::Mode { tag: tag(), mode: Mode::Cascade },
            RigCommand::Options { tag: tag(), options: Box::new(LoopOptions::default()) },
            RigCommand::Fault { tag: "TQ2".to_owned(), fault: Fault::Leak { k_cm2_5_s: 2.0 } },
            RigCommand::Repair { tag: "TQ2".to_owned(), kind: Some(FaultKind::Leak) },
            RigCommand::Repair { tag: "TQ2".to_owned(), kind: None },
            RigCommand::Measurement { measurement: Measurement::IDEAL },
        ];
        let kinds = commands.into_iter().map(EventKind::Done).chain([
            EventKind::Running,
            EventKind::Paused,
            EventKind::RigLoaded { id: "stad".to_owned() },
            EventKind::Recorded { words: "words".to_owned(), test_over: Some(tag()) },
            EventKind::Alarm(Alarm::Overflow { tag: "TQ2".to_owned() }, true),
            EventKind::Alarm(Alarm::Overflow { tag: "TQ2".to_owned() }, false),
        ]);
        for kind in kinds {
            let text = told(&kind, 7, "words");
            let heard = heard(&text, "words".to_owned(), true);
            assert_eq!(heard, Heard { kind, number: Some(7), whole: true }, "{text}");
        }
        let words = || "a test ended".to_owned();
        for nonsense in ["", "command = 3", "[command.setpoint]\ntag = 1", "\u{0}"] {
            let kind = EventKind::Recorded { words: words(), test_over: None };
            assert_eq!(heard(nonsense, words(), false), Heard { kind, number: None, whole: true });
        }
        let text = told(&EventKind::Running, 0, "running");
        let heard = heard(&text.replace("true", "false"), "running".to_owned(), true);
        let kind = EventKind::Recorded { words: "running".to_owned(), test_over: None };
        assert_eq!(heard.kind, kind, "changed: not carried out");
        assert!(!heard.whole);
    }
}
