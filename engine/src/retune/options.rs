//! What a retuning is asked for.

use crate::control::PidGains;
use crate::tune::ControllerKind;
use crate::tune::optimum::LoopLimits;

/// What is asked of a retuning.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RetuneOptions {
    /// PI or PID; with PID the best PI is shown beside it.
    pub controller: ControllerKind,
    /// Limits of the optimum.
    pub limits: LoopLimits,
    /// Present tuning; absent: as the log shows it.
    pub present: Option<PidGains>,
    /// Models drawn from what the log leaves open.
    pub draws: usize,
    /// Seed of the draws.
    pub seed: u64,
}

impl Default for RetuneOptions {
    fn default() -> Self {
        Self {
            controller: ControllerKind::Pi,
            limits: LoopLimits::DEFAULT,
            present: None,
            draws: 200,
            seed: 1,
        }
    }
}

/// What the rows themselves say beside the study.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoopSigns {
    /// Usual time between rows in seconds.
    pub sample_time_s: f64,
    /// Length of the stretch in seconds.
    pub span_s: f64,
    /// How often the setpoint moves.
    pub setpoint_moves: usize,
    /// Largest less smallest MV.
    pub mv_range: f64,
}

impl LoopSigns {
    /// Reads them off the rows of a record; `sp` where the log has one.
    #[must_use]
    pub fn of(time_s: &[f64], mv: &[f64], sp: Option<&[f64]>) -> Self {
        let mut gaps: Vec<f64> = time_s.windows(2).map(|w| w[1] - w[0]).collect();
        gaps.sort_unstable_by(f64::total_cmp);
        let (low, high) =
            mv.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
        Self {
            sample_time_s: gaps.get(gaps.len() / 2).copied().unwrap_or(0.0),
            span_s: time_s.last().zip(time_s.first()).map_or(0.0, |(last, first)| last - first),
            setpoint_moves: sp.map_or(0, |sp| sp.windows(2).filter(|w| w[0] != w[1]).count()),
            mv_range: (high - low).max(0.0),
        }
    }
}
