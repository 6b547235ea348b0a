//! Performance figures of every loop of a finished run.

use crate::analyze::{Excitation, Metrics, MetricsError, metrics};
use crate::signal::ChannelKind;

use super::scenario::Run;

/// Figures of one loop slot.
#[derive(Debug, Clone, PartialEq)]
pub struct LoopFigures {
    /// Loop slot, from 0.
    pub slot: usize,
    /// Where the figures begin, in seconds of the run; their times count from here.
    pub from_s: f64,
    /// What set the loop in motion.
    pub excitation: Excitation,
    /// The figures.
    pub metrics: Result<Metrics, MetricsError>,
}

/// Share of the rows in which a setpoint may step; one that moves more often is another loop's output.
const MOST_STEPS: f64 = 0.1;

impl Run {
    /// Figures of every loop slot, from its last setpoint step to the end. Where the setpoint never steps, or
    /// moves in more than a tenth of the rows as an outer loop's output does, the whole run counts as a load's.
    ///
    /// The rows that were kept are what counts: a run that keeps few of them has coarse figures. Rows from
    /// before the slot had a loop are left out.
    #[must_use]
    pub fn figures(&self) -> Vec<LoopFigures> {
        (0..self.channels.slots).filter_map(|slot| self.figures_of(slot)).collect()
    }

    fn figures_of(&self, slot: usize) -> Option<LoopFigures> {
        let column = |kind| -> Option<Vec<f64>> {
            let index = self.channels.column(kind)?;
            Some(self.values.iter().skip(index).step_by(self.channels.len()).copied().collect())
        };
        let [r, y, u] = [
            column(ChannelKind::Setpoint(slot))?,
            column(ChannelKind::Pv(slot))?,
            column(ChannelKind::Mv(slot))?,
        ];
        let first = r.iter().rposition(|v| v.is_nan()).map_or(0, |last| last + 1);
        let steps: Vec<usize> = (first + 1..r.len()).filter(|&i| r[i] != r[i - 1]).collect();
        let stepped = (steps.len() as f64) <= MOST_STEPS * r.len() as f64;
        let (start, excitation) = match steps.last() {
            Some(&last) if stepped => (last, Excitation::Setpoint),
            _ => (first, Excitation::Load),
        };
        let start = start.min(r.len());
        let figures = metrics(&self.time_s[start..], &r[start..], &y[start..], &u[start..], excitation);
        let from_s = self.time_s.get(start).copied().unwrap_or(f64::NAN);
        Some(LoopFigures { slot, from_s, excitation, metrics: figures })
    }
}
