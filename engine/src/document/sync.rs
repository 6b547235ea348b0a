//! What a change of the document means for the running rig.

use std::sync::Arc;

use super::data::{Document, RigSettings};
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
        let old = before.loops.get(&active.id);
        let tag = || active.id.clone();
        // A loop that takes over gets all its settings: the session keeps its own copy of them.
        let differs = |same: bool| turned || !same;
        if differs(old.is_some_and(|o| o.setpoint_cm == new.setpoint_cm)) {
            commands.push(RigCommand::Setpoint { tag: tag(), level_cm: new.setpoint_cm });
        }
        if differs(old.is_some_and(|o| o.tuning == new.tuning)) {
            commands.push(RigCommand::Tuning { tag: tag(), tuning: new.tuning });
        }
        if differs(old.is_some_and(|o| o.pv_filter_s == new.pv_filter_s)) {
            commands.push(RigCommand::PvFilter { tag: tag(), time_constant_s: new.pv_filter_s });
        }
        if differs(old.is_some_and(|o| o.mode == new.mode)) {
            commands.push(RigCommand::Mode { tag: tag(), mode: new.mode });
        }
    }
    if before.measurement != after.measurement {
        commands.push(RigCommand::Measurement { measurement: after.measurement });
    }
    if before.seed != after.seed {
        commands.push(RigCommand::Seed { seed: after.seed });
    }
    commands
}
