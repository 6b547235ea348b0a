//! Models side by side on a recording of a rig that is not quite the model.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::error::RunError;
use super::outcome::{RunColumn, TimedColumns};
use crate::plant::{Measurement, Network, OperatingPoint, RigError, SteadyTarget};
use crate::sim::{Comparison, InputSeries, LevelResistance, ModelKind, record_real_rig};

/// A pump's input in moves about a rest, the rig's recording, and what every model makes of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelsRun {
    /// Preset, or rig file beside the experiment's.
    pub rig: String,
    /// Configuration of the rig; absent: its first.
    pub configuration: Option<String>,
    /// Pump that moves.
    pub pump: String,
    /// Sensor whose readings are the recording; its tank is the output.
    pub sensor: String,
    /// Level of that tank at rest in cm: start and operating point of the linear models.
    pub level_cm: f64,
    /// Moves of the input about that at rest, one after the other, in its unit.
    pub moves: Vec<f64>,
    /// How long each is held, in seconds.
    pub hold_s: f64,
    /// Valves that let less through at high levels.
    #[serde(default)]
    pub resistance: Vec<ResistanceSpec>,
    /// Noise, quantisation and resolution of the recording.
    #[serde(default = "usual")]
    pub measurement: Measurement,
    /// Seed of the noise.
    #[serde(default)]
    pub seed: u64,
}

/// A valve of which the recorded rig's k falls above a level, see [`LevelResistance`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ResistanceSpec {
    /// Valve.
    pub valve: String,
    /// h₀ in cm.
    pub above_cm: f64,
    /// Share of k lost a centimetre above h₀.
    pub loss_per_cm: f64,
}

fn usual() -> Measurement {
    Measurement::DEFAULT
}

impl ModelsRun {
    pub(super) fn run(&self, network: &Arc<Network>) -> Result<TimedColumns, RunError> {
        let unknown = |tag: &str| RigError::Unknown { item: "models".to_owned(), reference: tag.to_owned() };
        let configurations = &network.spec.configurations;
        let configuration = match &self.configuration {
            None => 0,
            Some(id) => configurations.iter().position(|c| c.id == *id).ok_or_else(|| unknown(id))?,
        };
        let pump = network.pump(&self.pump).ok_or_else(|| unknown(&self.pump))?;
        let sensor = network.sensor(&self.sensor).ok_or_else(|| unknown(&self.sensor))?;
        let tank = network.sensors[sensor].tank;
        let resistances = self
            .resistance
            .iter()
            .map(|r| {
                let valve = network.valve(&r.valve).ok_or_else(|| unknown(&r.valve))?;
                Ok(LevelResistance { valve, above_cm: r.above_cm, loss_per_cm: r.loss_per_cm })
            })
            .collect::<Result<Vec<_>, RigError>>()?;
        let point = OperatingPoint::of_configuration(network, configuration)
            .at_levels(network, &[SteadyTarget { pump, tank, level_cm: self.level_cm }])?;
        let series = self.series(network, &point, pump);
        let recording = record_real_rig(
            network,
            configuration,
            &series,
            sensor,
            &resistances,
            self.measurement,
            self.seed,
        )?;
        let time_s = series.time_s.clone();
        let unit = network.spec.pumps[pump].unit.symbol().to_owned();
        let mut columns = vec![
            RunColumn { name: "u".to_owned(), unit, values: series.inputs[pump].clone() },
            RunColumn { name: "recording_cm".to_owned(), unit: "cm".to_owned(), values: recording },
        ];
        let comparison = Comparison::new(network.clone(), &point, tank, series)?;
        for kind in ModelKind::ALL {
            let (name, values) = (format!("{}_cm", kind.id()), comparison.run(kind)?);
            columns.push(RunColumn { name, unit: "cm".to_owned(), values });
        }
        Ok((time_s, columns))
    }

    fn series(&self, network: &Network, point: &OperatingPoint, pump: usize) -> InputSeries {
        let h = network.spec.sample_time_s;
        let rows = (self.hold_s * self.moves.len() as f64 / h).round() as usize;
        let time_s: Vec<f64> = (0..rows).map(|k| k as f64 * h).collect();
        let last = self.moves.len().saturating_sub(1);
        let moved = |t: &f64| self.moves.get(((t / self.hold_s) as usize).min(last)).copied().unwrap_or(0.0);
        let mut inputs: Vec<Vec<f64>> = point.inputs.iter().map(|u| vec![*u; rows]).collect();
        inputs[pump] = time_s.iter().map(|t| point.inputs[pump] + moved(t)).collect();
        InputSeries { time_s, inputs, angles_deg: vec![], start: point.clone() }
    }
}
