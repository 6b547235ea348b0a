//! A simulated rig that is not quite the model: what a recording of a real one looks like.

use std::sync::Arc;

use super::compare::InputSeries;
use crate::daq::{RigControls, SimulatedRig, Source};
use crate::plant::{Measurement, Network, Reading, ReadingStatus, RigError};

/// A valve that lets less through at high levels: its resistance is not the mean one the model has.
///
/// `k = k(α) · (1 − loss · max(0, h − h₀))`, h the level of the tank it drains; the loss is at most 0.9.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LevelResistance {
    /// Valve.
    pub valve: usize,
    /// h₀ in cm.
    pub above_cm: f64,
    /// Share of k lost a centimetre above h₀.
    pub loss_per_cm: f64,
}

/// A series sent through the rig with what a real one adds: noise, converters, and valves that change with the level.
///
/// Each valve of `resistances` is turned at every stamp to the angle at which its characteristic gives the reduced k, so
/// that the plant stays the network it is. Gives the readings of `sensor` in cm, taken just before the input of their
/// stamp.
///
/// # Errors
/// [`RigError`] when the start does not fit the rig.
pub fn record_real_rig(
    network: &Arc<Network>,
    configuration: usize,
    series: &InputSeries,
    sensor: usize,
    resistances: &[LevelResistance],
    measurement: Measurement,
    seed: u64,
) -> Result<Vec<f64>, RigError> {
    let mut rig = SimulatedRig::new(network.clone(), measurement, seed)?;
    rig.configure(configuration)?;
    for (valve, &angle) in series.start.angles_deg.iter().enumerate() {
        rig.set_angle(valve, angle)?;
    }
    rig.set_state(&series.start.levels_cm, &series.start.inputs)?;
    let blank = Reading { level_cm: f64::NAN, status: ReadingStatus::Good };
    let mut readings = vec![blank; network.sensors.len()];
    let mut out = Vec::with_capacity(series.time_s.len());
    for (k, &t) in series.time_s.iter().enumerate() {
        rig.read(&mut readings);
        out.push(readings[sensor].level_cm);
        for (pump, column) in series.inputs.iter().enumerate() {
            rig.write(pump, column[k])?;
        }
        for resistance in resistances {
            let valve = &network.valves[resistance.valve];
            let level_cm = rig.plant().map_or(0.0, |plant| plant.levels_cm()[valve.from]);
            let loss = (resistance.loss_per_cm * (level_cm - resistance.above_cm).max(0.0)).min(0.9);
            let full = series.start.angles_deg[resistance.valve].to_radians().sin();
            let angle = (full * (1.0 - loss).powf(1.0 / valve.exponent)).asin().to_degrees();
            rig.set_angle(resistance.valve, angle)?;
        }
        if let Some(next) = series.time_s.get(k + 1) {
            rig.advance(next - t);
        }
    }
    Ok(out)
}
