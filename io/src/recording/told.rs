//! What a replay needs to know of a run, as text inside its recording: settings at the beginning, commands, alarms,
//! models. TOML, because gains may be infinite, which JSON cannot say.

use rerun::AnyValues;
use rerun::components::Text;
use serde::{Deserialize, Serialize};
use vasos_engine::model::ProcessModel;
use vasos_engine::plant::Measurement;
use vasos_engine::session::{Alarm, EventKind, RigCommand, RunStart};

/// Property of a recording that holds what follows.
pub(super) const PROPERTY: &str = "vasos";
/// Fields of the property.
pub(super) const RIG_FILE: &str = "rig_file";
pub(super) const START: &str = "start";
pub(super) const RUN: &str = "run";

/// What the rig file does not say of a beginning.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Beginning {
    /// Id of the configuration.
    pub configuration: String,
    /// Imperfections that are on.
    pub measurement: Option<Measurement>,
}

/// The property of a run.
pub(super) fn property(start: &RunStart) -> Result<AnyValues, toml::ser::Error> {
    let configuration = start.network.spec.configurations.get(start.configuration);
    let beginning = Beginning {
        configuration: configuration.map_or_else(String::new, |c| c.id.clone()),
        measurement: start.measurement,
    };
    Ok(AnyValues::default()
        .with_component::<Text>("rig", [start.network.spec.id.as_str()])
        .with_component::<Text>(RUN, [start.run.to_string()])
        .with_component::<Text>("program", [format!("Vasos {}", env!("CARGO_PKG_VERSION"))])
        .with_component::<Text>(RIG_FILE, [toml::to_string(&start.as_set)?])
        .with_component::<Text>(START, [toml::to_string(&beginning)?]))
}

/// An event as far as a replay carries it out.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
struct Told {
    #[serde(skip_serializing_if = "Option::is_none")]
    rig_loaded: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    running: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    alarm_on: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    alarm: Option<Alarm>,
    #[serde(skip_serializing_if = "Option::is_none")]
    command: Option<RigCommand>,
}

/// An event as text; empty for kinds of which the words are enough.
pub(super) fn told(kind: &EventKind) -> String {
    let none = Told::default();
    let told = match kind {
        EventKind::RigLoaded { id } => Told { rig_loaded: Some(id.clone()), ..none },
        EventKind::Running => Told { running: Some(true), ..none },
        EventKind::Paused => Told { running: Some(false), ..none },
        EventKind::Done(command) => Told { command: Some(command.clone()), ..none },
        EventKind::Alarm(alarm, on) => Told { alarm: Some(alarm.clone()), alarm_on: Some(*on), ..none },
        _ => return String::new(),
    };
    toml::to_string(&told).unwrap_or_default()
}

/// The event that a text tells, else its words.
pub(super) fn event_kind(text: &str, words: String) -> EventKind {
    let told: Told = toml::from_str(text).unwrap_or_default();
    match told {
        Told { command: Some(command), .. } => EventKind::Done(command),
        Told { alarm: Some(alarm), alarm_on, .. } => EventKind::Alarm(alarm, alarm_on == Some(true)),
        Told { running: Some(true), .. } => EventKind::Running,
        Told { running: Some(false), .. } => EventKind::Paused,
        Told { rig_loaded: Some(id), .. } => EventKind::RigLoaded { id },
        Told { .. } => EventKind::Recorded { words },
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
            EventKind::Alarm(Alarm::Overflow { tag: "TQ2".to_owned() }, true),
            EventKind::Alarm(Alarm::Overflow { tag: "TQ2".to_owned() }, false),
        ]);
        for kind in kinds {
            let text = told(&kind);
            assert_eq!(event_kind(&text, String::new()), kind, "{text}");
        }
        let words = || "a test ended".to_owned();
        for nonsense in ["", "command = 3", "[command.setpoint]\ntag = 1", "\u{0}"] {
            assert_eq!(event_kind(nonsense, words()), EventKind::Recorded { words: words() });
        }
    }
}
