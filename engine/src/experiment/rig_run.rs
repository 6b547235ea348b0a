//! A scenario on a rig, with what is changed of the rig.

use std::collections::BTreeMap;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::error::RunError;
use super::outcome::{RunColumn, TimedColumns};
use crate::plant::{Measurement, Network, RigError, RigSpec};
use crate::sim::{Run, Scenario, ScenarioEvent, Start, run_scenario_while};

/// A scenario as in a scenario file, and changes of its rig.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScenarioRun {
    /// Preset, or rig file beside the experiment's.
    pub rig: String,
    /// Configuration of the rig; absent: its first.
    pub configuration: Option<String>,
    /// Length in seconds.
    pub duration_s: f64,
    /// Seed of the noise.
    #[serde(default)]
    pub seed: u64,
    /// Noise, quantisation and resolution.
    #[serde(default = "usual")]
    pub measurement: Measurement,
    /// Every how many samples a row is kept.
    #[serde(default = "every")]
    pub keep_every: u32,
    /// State at the start.
    #[serde(default)]
    pub start: Start,
    /// What of the rig is other than in its file.
    #[serde(default)]
    pub changes: RigChanges,
    /// Commands, in any order.
    #[serde(rename = "event", default)]
    pub events: Vec<ScenarioEvent>,
}

/// Numbers of a rig that an experiment changes; what is left out stays.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RigChanges {
    /// δ in cm.
    pub delta_cm: Option<f64>,
    /// Sample time in seconds.
    pub sample_time_s: Option<f64>,
    /// Rims in cm by tank.
    pub heights_cm: BTreeMap<String, f64>,
    /// Cross-sections in cm² by tank.
    pub areas_cm2: BTreeMap<String, f64>,
    /// Angles in degrees by valve, in every configuration.
    pub angles_deg: BTreeMap<String, f64>,
    /// k at 90° by valve.
    pub k90: BTreeMap<String, f64>,
}

fn usual() -> Measurement {
    Measurement::DEFAULT
}

fn every() -> u32 {
    1
}

impl RigChanges {
    /// The rig with the changes.
    ///
    /// # Errors
    /// [`RigError`] for a tag the rig does not have, and for a value that is not possible.
    pub fn of(&self, network: &Arc<Network>) -> Result<Arc<Network>, RigError> {
        if *self == Self::default() {
            return Ok(network.clone());
        }
        let mut spec: RigSpec = network.spec.clone();
        let unknown = |tag: &String| RigError::Unknown { item: "changes".to_owned(), reference: tag.clone() };
        spec.delta_cm = self.delta_cm.unwrap_or(spec.delta_cm);
        spec.sample_time_s = self.sample_time_s.unwrap_or(spec.sample_time_s);
        for (tag, &height_cm) in &self.heights_cm {
            spec.tanks[network.tank(tag).ok_or_else(|| unknown(tag))?].height_cm = height_cm;
        }
        for (tag, &area_cm2) in &self.areas_cm2 {
            spec.tanks[network.tank(tag).ok_or_else(|| unknown(tag))?].area_cm2 = area_cm2;
        }
        for (tag, &k90) in &self.k90 {
            spec.valves[network.valve(tag).ok_or_else(|| unknown(tag))?].k90 = k90;
        }
        for (tag, &angle_deg) in &self.angles_deg {
            let valve = network.valve(tag).ok_or_else(|| unknown(tag))?;
            spec.valves[valve].angle_deg = angle_deg;
            for configuration in &mut spec.configurations {
                configuration.angles_deg.insert(spec.valves[valve].id.clone(), angle_deg);
            }
        }
        Ok(Arc::new(Network::new(spec)?))
    }
}

impl ScenarioRun {
    /// The same without a change of the rig.
    #[must_use]
    pub fn of(scenario: Scenario) -> Self {
        Self {
            rig: scenario.rig,
            configuration: scenario.configuration,
            duration_s: scenario.duration_s,
            seed: scenario.seed,
            measurement: scenario.measurement,
            keep_every: scenario.keep_every,
            start: scenario.start,
            changes: RigChanges::default(),
            events: scenario.events,
        }
    }

    /// The scenario, without the changes of its rig.
    #[must_use]
    pub fn scenario(&self) -> Scenario {
        Scenario {
            schema: 1,
            rig: self.rig.clone(),
            configuration: self.configuration.clone(),
            duration_s: self.duration_s,
            seed: self.seed,
            measurement: self.measurement,
            keep_every: self.keep_every,
            start: self.start.clone(),
            events: self.events.clone(),
        }
    }

    /// Runs it; `go_on` is asked with the share done, and `None` is what its no gives.
    pub(super) fn run(
        &self,
        network: &Arc<Network>,
        go_on: &mut dyn FnMut(f64) -> bool,
    ) -> Result<Option<TimedColumns>, RunError> {
        let network = self.changes.of(network)?;
        let run = run_scenario_while(network, &self.scenario(), go_on)?;
        Ok(run.map(|run| {
            let columns = columns(&run);
            (run.time_s, columns)
        }))
    }
}

fn columns(run: &Run) -> Vec<RunColumn> {
    let width = run.channels.len();
    let named = run.channels.channels.iter().enumerate();
    named
        .map(|(i, channel)| RunColumn {
            name: channel.name.clone(),
            unit: channel.unit.to_owned(),
            values: run.values.iter().skip(i).step_by(width).copied().collect(),
        })
        .collect()
}
