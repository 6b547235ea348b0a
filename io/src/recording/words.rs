//! Events as lines of the recording's log, in English.

use rerun::TextLogLevel;
use vasos_engine::control::Mode;
use vasos_engine::excitation::Ending;
use vasos_engine::explain::number;
use vasos_engine::session::{Alarm, EventKind, RigCommand};

/// Level (of Rerun's text log) and English text of an event.
#[must_use]
pub fn line(kind: &EventKind) -> (&'static str, String) {
    let (info, warning) = (TextLogLevel::INFO, TextLogLevel::WARN);
    match kind {
        EventKind::RigLoaded { id } => (info, format!("rig {id} loaded")),
        EventKind::Running => (info, "running".to_owned()),
        EventKind::Paused => (info, "paused".to_owned()),
        EventKind::Done(command) => (info, done(command)),
        EventKind::Refused(error) => (warning, format!("refused: {error}")),
        EventKind::Alarm(alarm, true) => (warning, format!("alarm: {}", state(alarm))),
        EventKind::Alarm(alarm, false) => (info, format!("over: {}", state(alarm))),
        EventKind::ExcitationProgress { tag, progress } => {
            let cycle = if progress.cycle > 0 { format!(" {}", progress.cycle) } else { String::new() };
            (info, format!("{tag}: test {}{cycle}", progress.phase.key().replace('_', " ")))
        }
        EventKind::ExcitationEnded(report) => match &report.ending {
            Ending::Finished => (info, format!("{}: test finished", report.tag)),
            Ending::Stopped(reason) => (warning, format!("{}: test {reason}", report.tag)),
        },
        EventKind::Recorded { words, .. } => (info, words.clone()),
        EventKind::SamplesLost { count } => (warning, format!("{count} samples given up")),
        EventKind::EventsLost { count } => (warning, format!("{count} events given up")),
        EventKind::Stopped { reason } => (TextLogLevel::ERROR, format!("stopped by a defect: {reason}")),
    }
}

fn state(alarm: &Alarm) -> String {
    let tag = alarm.tag();
    match alarm {
        Alarm::Overflow { .. } => format!("{tag} spills over its rim"),
        Alarm::PumpDry { .. } => format!("{tag} draws from an empty tank"),
        Alarm::BelowRange { .. } => format!("{tag} below its range"),
        Alarm::AboveRange { .. } => format!("{tag} above its range"),
        Alarm::SensorFault { .. } => format!("{tag} gives no signal"),
        Alarm::OutputAtLimit { .. } => format!("output of {tag} at its limit"),
    }
}

fn done(command: &RigCommand) -> String {
    match command {
        RigCommand::Setpoint { tag, level_cm } => format!("{tag}: setpoint {} cm", number(*level_cm)),
        RigCommand::Mode { tag, mode: Mode::Manual } => format!("{tag}: manual"),
        RigCommand::Mode { tag, mode: Mode::Automatic } => format!("{tag}: automatic"),
        RigCommand::Mode { tag, mode: Mode::Cascade } => format!("{tag}: cascade"),
        RigCommand::Law { tag, law } => format!("{tag}: law {}", law.id()),
        RigCommand::Options { tag, .. } => format!("{tag}: other options around its law"),
        RigCommand::Mv { tag, value } => format!("{tag}: output {}", number(*value)),
        RigCommand::Tuning { tag, tuning } => {
            let g = tuning.gains;
            let [kc, ti, td] = [g.kc, g.ti_s, g.td_s].map(number);
            format!("{tag}: Kc {kc}, Ti {ti} s, Td {td} s")
        }
        RigCommand::PvFilter { tag, time_constant_s } => {
            format!("{tag}: PV filter {} s", number(*time_constant_s))
        }
        RigCommand::Valve { tag, angle_deg } => format!("{tag}: {}°", number(*angle_deg)),
        RigCommand::Bump { tag, delta_cm } => format!("{tag}: level moved by {} cm", number(*delta_cm)),
        RigCommand::Configuration { id } => format!("configuration {id}"),
        RigCommand::SteadyAt { tag, level_cm } => format!("{tag}: at rest at {} cm", number(*level_cm)),
        RigCommand::Measurement { measurement: m } => {
            let on = |on: bool| if on { "on" } else { "off" };
            let [noise, quantisation, resolution] = [m.noise, m.quantisation, m.resolution].map(on);
            format!("noise {noise}, quantisation {quantisation}, resolution {resolution}")
        }
        RigCommand::Excite { tag, excitation } => {
            format!("{tag}: test {} begun", excitation.signal.key().replace('_', " "))
        }
        RigCommand::AbortExcitation { tag } => format!("{tag}: end of the test asked for"),
        RigCommand::Fault { tag, fault } => format!("{tag}: fault {}", fault.kind().key()),
        RigCommand::Repair { tag, kind } => {
            format!("{tag}: repaired{}", kind.map_or(String::new(), |k| format!(" ({})", k.key())))
        }
        RigCommand::Seed { seed } => format!("noise from seed {seed}"),
    }
}
