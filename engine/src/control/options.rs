//! What stands around the law of a loop, as files and commands give it.

use serde::{Deserialize, Serialize};

use super::deadband::Deadband;
use super::feedforward::Feedforward;
use super::law::{AntiWindup, Law};
use super::schedule::SchedulePoint;
use super::setpoint_path::SetpointPath;
use super::smith::SmithModel;
use crate::plant::{RigError, demand};

/// Narrower limits of a loop's output than those of what it writes.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct OutputLimits {
    /// Lowest output in MV units; absent: that of the pump.
    pub low: Option<f64>,
    /// Highest output in MV units; absent: that of the pump.
    pub high: Option<f64>,
    /// Largest change per second in MV units; absent: that of the pump.
    pub rate_per_s: Option<f64>,
}

/// Everything around the law; what is left out is off.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LoopOptions {
    /// Limits of the output.
    pub output: OutputLimits,
    /// Ramp and filter of the setpoint.
    pub setpoint: SetpointPath,
    /// Band about the setpoint in which the error counts less.
    pub deadband: Option<Deadband>,
    /// Gains by level, levels rising; empty for none.
    pub schedule: Vec<SchedulePoint>,
    /// Feed-forward of a measured disturbance.
    pub feedforward: Option<Feedforward>,
    /// Smith predictor.
    pub smith: Option<SmithModel>,
}

/// Longest time constant and dead time around a law, in seconds.
const LONGEST_S: f64 = 3600.0;
/// Bound on gains, widths and rates.
const MOST: f64 = 1e9;

impl Law {
    /// Checks the law's own settings for the loop `item`, whose output lies in `range`.
    ///
    /// # Errors
    /// [`RigError::Value`] with the offending field.
    pub fn check(&self, item: &str, range: [f64; 2]) -> Result<(), RigError> {
        match *self {
            Self::PidI2gl { .. } => Ok(()),
            Self::Pid2gl { bias, anti_windup } => {
                if let AntiWindup::BackCalculation { tracking_s: Some(tracking_s) } = anti_windup {
                    let ok = tracking_s > 0.0 && tracking_s <= MOST;
                    demand(item, "tracking_s", tracking_s, ok, "> 0 and ≤ 1e9")?;
                }
                let [low, high] = range;
                let bias = bias.unwrap_or(low);
                demand(item, "bias", bias, (low..=high).contains(&bias), format!("{low}…{high}"))
            }
            Self::OnOff { gap_cm, .. } => {
                demand(item, "gap_cm", gap_cm, (0.0..=MOST).contains(&gap_cm), "0…1e9")
            }
        }
    }
}

impl LoopOptions {
    /// Checks every value for the loop `item`, whose output lies in `range`, with a law.
    ///
    /// # Errors
    /// [`RigError::Value`] with the offending field.
    pub fn check(&self, item: &str, law: &Law, range: [f64; 2]) -> Result<(), RigError> {
        let [least, most] = range;
        let low = self.output.low.unwrap_or(least);
        demand(item, "output.low", low, (least..most).contains(&low), format!("{least}…{most}"))?;
        let high = self.output.high.unwrap_or(most);
        demand(item, "output.high", high, high > low && high <= most, format!("> {low} and ≤ {most}"))?;
        let positive = |field, value: Option<f64>| match value {
            Some(value) => demand(item, field, value, value > 0.0 && value <= MOST, "> 0 and ≤ 1e9"),
            None => Ok(()),
        };
        positive("output.rate_per_s", self.output.rate_per_s)?;
        positive("setpoint.ramp_cm_s", self.setpoint.ramp_cm_s)?;
        let time =
            |field, value: f64| demand(item, field, value, (0.0..=LONGEST_S).contains(&value), "0…3600");
        time("setpoint.filter_s", self.setpoint.filter_s)?;
        if let Some(band) = &self.deadband {
            positive("deadband.half_width_cm", Some(band.half_width_cm))?;
            let ok = (0.0..=1.0).contains(&band.factor);
            demand(item, "deadband.factor", band.factor, ok, "0…1")?;
        }
        if let Some(model) = &self.smith {
            demand(item, "smith.gain", model.gain, model.gain != 0.0 && model.gain.abs() <= MOST, "≠ 0")?;
            positive("smith.time_constant_s", Some(model.time_constant_s))?;
            time("smith.dead_time_s", model.dead_time_s)?;
        }
        if let Some(path) = &self.feedforward {
            demand(
                item,
                "feedforward.gain",
                path.gain,
                path.gain.abs() <= MOST && law.is_pid(),
                "within ±1e9, with a PID",
            )?;
            time("feedforward.lag_s", path.lag_s)?;
            time("feedforward.lead_s", path.lead_s)?;
            let ok = path.lead_s == 0.0 || path.lag_s > 0.0;
            demand(item, "feedforward.lag_s", path.lag_s, ok, "> 0 where there is a lead")?;
        }
        self.check_schedule(item, law)
    }

    /// Levels rise, gains keep one sign, PID-I2GL keeps its integral action.
    fn check_schedule(&self, item: &str, law: &Law) -> Result<(), RigError> {
        let mut last_cm = f64::NEG_INFINITY;
        for point in &self.schedule {
            let level_cm = point.level_cm;
            let ok = level_cm > last_cm && level_cm.abs() <= MOST;
            demand(item, "schedule.level_cm", level_cm, ok, "rising from point to point")?;
            last_cm = level_cm;
            let alike = point.kc * self.schedule[0].kc > 0.0 && point.kc.abs() <= MOST;
            demand(item, "schedule.kc", point.kc, alike && law.is_pid(), "≠ 0, all of one sign, with a PID")?;
            if let Some(ti_s) = point.ti_s {
                demand(item, "schedule.ti_s", ti_s, ti_s > 0.0, "> 0")?;
            }
        }
        Ok(())
    }
}
