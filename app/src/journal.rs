//! What happened, in words, for the log pane.

use std::collections::VecDeque;

use vasos_engine::excitation::Ending;
use vasos_engine::plant::FaultKind;
use vasos_engine::session::{Event, EventKind, RigCommand};

use crate::{i18n, text, tr};

/// How much an entry matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Weight {
    /// It went as asked.
    Note,
    /// Worth a look.
    Caution,
    /// Something was refused or is abnormal.
    Alarm,
}

/// One entry.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// Time of the run in seconds, where it belongs to one.
    pub time_s: Option<f64>,
    /// How much it matters.
    pub weight: Weight,
    /// The words, in the language of the moment it happened.
    pub words: String,
    /// Entries of one thread in a row show as the last of them.
    pub thread: Option<String>,
}

/// Entries kept.
const MOST_ENTRIES: usize = 2000;

/// Adds an entry; one of the same thread replaces the last.
pub fn add(journal: &mut VecDeque<Entry>, entry: Entry) {
    if entry.thread.is_some() && journal.back().is_some_and(|last| last.thread == entry.thread) {
        journal.pop_back();
    }
    if journal.len() >= MOST_ENTRIES {
        journal.pop_front();
    }
    journal.push_back(entry);
}

/// An entry without a time.
#[must_use]
pub fn entry(weight: Weight, words: String) -> Entry {
    Entry { time_s: None, weight, words, thread: None }
}

/// The words for an event of the session.
#[must_use]
pub fn of_event(event: &Event) -> Entry {
    let (weight, words, thread) = match &event.kind {
        EventKind::RigLoaded { id } => (Weight::Note, tr!("event.rig_loaded", id = id), None),
        EventKind::Running => (Weight::Note, tr!("event.running"), None),
        EventKind::Paused => (Weight::Note, tr!("event.paused"), None),
        EventKind::Done(command) => {
            let thread = match command {
                RigCommand::Valve { tag, .. }
                | RigCommand::Setpoint { tag, .. }
                | RigCommand::Mv { tag, .. } => Some(format!("{:?} {tag}", std::mem::discriminant(command))),
                _ => None,
            };
            (Weight::Note, done(command), thread)
        }
        EventKind::Refused(error) => (Weight::Alarm, i18n::say(error), None),
        EventKind::Alarm(alarm, on) => {
            let words = tr!(&format!("alarm.{}", alarm.key()), tag = alarm.tag());
            if *on {
                (Weight::Alarm, words, None)
            } else {
                (Weight::Note, tr!("event.alarm_over", alarm = words), None)
            }
        }
        EventKind::ExcitationProgress { tag, progress } => {
            let phase = tr!(&format!("excitation.phase.{}", progress.phase.key()));
            let words = if progress.cycle > 0 {
                tr!("event.excitation_cycle", tag = tag, phase = phase, cycle = progress.cycle)
            } else {
                tr!("event.excitation_phase", tag = tag, phase = phase)
            };
            (Weight::Note, words, Some(format!("excitation {tag}")))
        }
        EventKind::ExcitationEnded(report) => match &report.ending {
            Ending::Finished => (Weight::Note, tr!("event.excitation_finished", tag = report.tag), None),
            Ending::Stopped(reason) => {
                let reason = i18n::say(reason);
                (Weight::Alarm, tr!("event.excitation_stopped", tag = report.tag, reason = reason), None)
            }
        },
        EventKind::Recorded { words, .. } => (Weight::Note, words.clone(), None),
        EventKind::SamplesLost { count } => (Weight::Alarm, tr!("event.samples_lost", count = count), None),
        EventKind::EventsLost { count } => (Weight::Alarm, tr!("event.events_lost", count = count), None),
        EventKind::Stopped { reason } => (Weight::Alarm, tr!("event.stopped", reason = reason), None),
    };
    Entry { time_s: Some(event.time_s), weight, words, thread }
}

fn done(command: &RigCommand) -> String {
    match command {
        RigCommand::Setpoint { tag, level_cm } => {
            tr!("event.setpoint", tag = tag, level = text::fixed(*level_cm, 2))
        }
        RigCommand::Mode { tag, mode } => {
            let mode = match mode {
                vasos_engine::control::Mode::Manual => tr!("mode.manual"),
                vasos_engine::control::Mode::Automatic => tr!("mode.auto"),
                vasos_engine::control::Mode::Cascade => tr!("mode.cascade"),
            };
            tr!("event.mode", tag = tag, mode = mode)
        }
        RigCommand::Mv { tag, value } => tr!("event.mv", tag = tag, value = text::fixed(*value, 3)),
        RigCommand::Tuning { tag, tuning } => {
            let g = tuning.gains;
            tr!(
                "event.tuning",
                tag = tag,
                kc = text::brief(g.kc),
                ti = text::brief(g.ti_s),
                td = text::brief(g.td_s)
            )
        }
        RigCommand::Law { tag, law } => {
            let law = tr!(&format!("law.{}", law.id()));
            tr!("event.law", tag = tag, law = law)
        }
        RigCommand::Options { tag, .. } => tr!("event.options", tag = tag),
        RigCommand::PvFilter { tag, time_constant_s } => {
            tr!("event.pv_filter", tag = tag, filter = text::brief(*time_constant_s))
        }
        RigCommand::Valve { tag, angle_deg } => {
            tr!("event.valve", tag = tag, angle = text::fixed(*angle_deg, 1))
        }
        RigCommand::Bump { tag, delta_cm } => tr!("event.bump", tag = tag, delta = text::fixed(*delta_cm, 1)),
        RigCommand::Configuration { id } => tr!("event.configuration", id = id),
        RigCommand::SteadyAt { tag, level_cm } => {
            tr!("event.steady_at", tag = tag, level = text::fixed(*level_cm, 2))
        }
        RigCommand::Measurement { measurement } => {
            let word = |on: bool| if on { tr!("state.on") } else { tr!("state.off") };
            tr!(
                "event.measurement",
                noise = word(measurement.noise),
                quantisation = word(measurement.quantisation)
            )
        }
        RigCommand::Seed { seed } => tr!("event.seed", seed = seed),
        RigCommand::Excite { tag, excitation } => {
            let signal = tr!(&format!("excitation.signal.{}", excitation.signal.key()));
            tr!("event.excite", tag = tag, signal = signal)
        }
        RigCommand::AbortExcitation { tag } => tr!("event.abort_excitation", tag = tag),
        RigCommand::Fault { tag, fault } => tr!("event.fault", tag = tag, fault = fault_name(fault.kind())),
        RigCommand::Repair { tag, kind: Some(kind) } => {
            tr!("event.repair", tag = tag, fault = fault_name(*kind))
        }
        RigCommand::Repair { tag, kind: None } => tr!("event.repair_all", tag = tag),
    }
}

/// The name of a fault.
#[must_use]
pub fn fault_name(kind: FaultKind) -> String {
    tr!(&format!("fault.{}", kind.key()))
}

/// The name of a step of the history.
#[must_use]
pub fn change(key: &str) -> String {
    tr!(&format!("change.{key}"))
}
