//! Gains that depend on the level.

use serde::{Deserialize, Serialize};

use super::tuning::PidTuning;

/// Gains at one level.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SchedulePoint {
    /// Level in cm.
    pub level_cm: f64,
    /// Kc in MV units per cm.
    pub kc: f64,
    /// Ti in seconds; absent: the loop's own.
    pub ti_s: Option<f64>,
}

/// The tuning at a level: Kc and Ti straight between the points, constant outside; Td, N, b, c as they are.
///
/// A table without points gives the tuning itself.
#[must_use]
pub fn scheduled(table: &[SchedulePoint], tuning: PidTuning, level_cm: f64) -> PidTuning {
    let after = table.partition_point(|p| p.level_cm <= level_cm);
    let (Some(low), Some(high)) =
        (table.get(after.saturating_sub(1)), table.get(after.min(table.len().saturating_sub(1))))
    else {
        return tuning;
    };
    let way = high.level_cm - low.level_cm;
    let share = if way > 0.0 { ((level_cm - low.level_cm) / way).clamp(0.0, 1.0) } else { 0.0 };
    let ti = |p: &SchedulePoint| p.ti_s.unwrap_or(tuning.gains.ti_s);
    let mut at = tuning;
    at.gains.kc = low.kc + share * (high.kc - low.kc);
    // Not a mean of two infinities.
    at.gains.ti_s = if ti(low) == ti(high) { ti(low) } else { ti(low) + share * (ti(high) - ti(low)) };
    at
}
