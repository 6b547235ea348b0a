//! What a change of the document means for the running rig.

use std::sync::Arc;

use super::data::{Document, LoopSettings, RigSettings};
use crate::control::{Law, Mode};
use crate::session::RigCommand;

/// What the session has to do so that the rig agrees with the document.
#[derive(Debug, Clone, PartialEq)]
pub enum Consequence {
    /// Start a new run on the rig of the new version, then send its settings.
    Reload,
    /// Send these commands.
    Commands(Vec<RigCommand>),
}

/// The difference between two versions, for the session.
#[must_use]
pub fn rig_commands(before: &Document, after: &Document) -> Consequence {
    if !Arc::ptr_eq(&before.rig.network, &after.rig.network) {
        return Consequence::Reload;
    }
    Consequence::Commands(difference(&before.rig, &after.rig))
}

impl RigSettings {
    /// Everything in which these settings differ from those of the rig's file in the same configuration.
    #[must_use]
    pub fn commands_after_load(&self) -> Vec<RigCommand> {
        let mut fresh = Self::new(self.network.clone());
        fresh.configuration = self.configuration;
        fresh.turn_valves();
        fresh.measurement = self.measurement;
        fresh.seed = self.seed;
        difference(&fresh, self)
    }
}

fn difference(before: &RigSettings, after: &RigSettings) -> Vec<RigCommand> {
    let mut commands = vec![];
    let spec = &after.network.spec;
    let mut angles = before.angles_deg.clone();
    let turned = before.configuration != after.configuration;
    if turned && let Some(configuration) = spec.configurations.get(after.configuration) {
        commands.push(RigCommand::Configuration { id: configuration.id.clone() });
        for (id, &angle_deg) in &configuration.angles_deg {
            if let Some(valve) = after.network.valve(id) {
                angles[valve] = angle_deg;
            }
        }
    }
    for (i, valve) in spec.valves.iter().enumerate() {
        if angles[i] != after.angles_deg[i] {
            commands.push(RigCommand::Valve { tag: valve.id.clone(), angle_deg: after.angles_deg[i] });
        }
    }
    for active in after.active_loops() {
        let Some(new) = after.loops.get(&active.id) else { continue };
        // A loop that takes over gets all its settings: the session keeps its own copy of them.
        let old = before.loops.get(&active.id).filter(|_| !turned);
        loop_commands(&active.id, old, new, &mut commands);
    }
    if before.measurement != after.measurement {
        commands.push(RigCommand::Measurement { measurement: after.measurement });
    }
    if before.seed != after.seed {
        commands.push(RigCommand::Seed { seed: after.seed });
    }
    commands
}

/// What turns a loop from one state of its settings to another; all of them where there was none.
fn loop_commands(id: &str, old: Option<&LoopSettings>, new: &LoopSettings, commands: &mut Vec<RigCommand>) {
    let tag = || id.to_owned();
    let mode = || RigCommand::Mode { tag: tag(), mode: new.mode };
    let other_mode = old.is_none_or(|o| o.mode != new.mode);
    // Out of cascade first: there, the operator's setpoint is refused. Into it last.
    let leaves_cascade = new.mode != Mode::Cascade && old.is_none_or(|o| o.mode == Mode::Cascade);
    if other_mode && leaves_cascade {
        commands.push(mode());
    }
    if new.mode != Mode::Cascade && old.is_none_or(|o| o.setpoint_cm != new.setpoint_cm || leaves_cascade) {
        commands.push(RigCommand::Setpoint { tag: tag(), level_cm: new.setpoint_cm });
    }
    let law = old.is_none_or(|o| o.law != new.law).then(|| RigCommand::Law { tag: tag(), law: new.law });
    let tuning = old
        .is_none_or(|o| o.tuning != new.tuning)
        .then(|| RigCommand::Tuning { tag: tag(), tuning: new.tuning });
    let options = old
        .is_none_or(|o| o.options != new.options)
        .then(|| RigCommand::Options { tag: tag(), options: Box::new(new.options.clone()) });
    // Each step has to be possible with what is still as it was: PID-I2GL needs its integral time before it
    // comes, the positional PID may get none after it came, and on/off has neither schedule nor feed-forward.
    let steps = match new.law {
        Law::PidI2gl { .. } => [tuning, law, options],
        Law::Pid2gl { .. } => [law, tuning, options],
        Law::OnOff { .. } => [options, law, tuning],
    };
    commands.extend(steps.into_iter().flatten());
    if old.is_none_or(|o| o.pv_filter_s != new.pv_filter_s) {
        commands.push(RigCommand::PvFilter { tag: tag(), time_constant_s: new.pv_filter_s });
    }
    if other_mode && !leaves_cascade {
        commands.push(mode());
    }
}
