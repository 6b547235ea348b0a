//! A loop that swings: by its valve, by its own tuning, or by what comes from outside.

use num_complex::Complex64;

use super::options::LoopSigns;
use crate::analyze::{Analysis, OpenLoop};
use crate::control::ParallelGains;
use crate::identify::RecordFinding;
use crate::model::ProcessModel;

/// A regular swing that the setpoint does not explain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Swing {
    /// In triangles: the valve sticks.
    Valve { band: f64, period_s: f64 },
    /// In sines.
    Sine { period_s: f64 },
}

/// The swing of a study, unless the setpoint moves about as often: then it is the answer to it.
pub(super) fn swing(findings: &[RecordFinding], signs: &LoopSigns) -> Option<Swing> {
    let found = findings.iter().find_map(|f| match f {
        RecordFinding::Stiction { band, period_s, .. } => {
            Some((*period_s, Swing::Valve { band: *band, period_s: *period_s }))
        }
        RecordFinding::Oscillates { period_s, .. } => Some((*period_s, Swing::Sine { period_s: *period_s })),
        _ => None,
    });
    let (period_s, swing) = found?;
    let driven = signs.setpoint_moves as f64 * period_s > signs.span_s;
    (!driven).then_some(swing)
}

/// |S| at the period: how much of a swing from outside a loop lets through.
pub(super) fn passes(model: &ProcessModel, gains: &ParallelGains, period_s: f64) -> f64 {
    let open = OpenLoop::of_parallel(model, gains);
    let l = open.at_omega(std::f64::consts::TAU / period_s);
    1.0 / (Complex64::new(1.0, 0.0) + l).norm()
}

/// Whether a tuning brings forth a swing of its own: its loop is unstable with the model, or next to it, or rings just
/// where the swing is.
pub(super) fn is_its_own(present: &Analysis, passes: f64) -> bool {
    /// Ms from which a loop rings for long: its damping is under 0.2.
    const RINGS: f64 = 2.5;
    /// |S| from which a loop makes a small disturbance its own swing.
    const AMPLIFIES: f64 = 1.5;
    !present.stable || present.ms.is_none_or(|ms| ms > RINGS) || passes > AMPLIFIES
}

#[cfg(test)]
mod tests {
    use super::*;

    fn signs(setpoint_moves: usize) -> LoopSigns {
        LoopSigns { sample_time_s: 1.0, span_s: 1000.0, setpoint_moves, mv_range: 10.0 }
    }

    #[test]
    fn a_swing_that_the_setpoint_makes_is_none() {
        let found = [RecordFinding::Stiction { index: 0.9, band: 2.0, period_s: 100.0 }];
        assert_eq!(swing(&found, &signs(3)), Some(Swing::Valve { band: 2.0, period_s: 100.0 }));
        assert_eq!(swing(&found, &signs(19)), None);
        assert_eq!(swing(&[RecordFinding::MvEarlier], &signs(0)), None);
    }

    #[test]
    fn a_loop_next_to_instability_swings_by_itself() {
        let with = |ms| Analysis { stable: true, ms: Some(ms), ..Analysis::default() };
        assert!(is_its_own(&Analysis::default(), 0.1) && is_its_own(&with(3.0), 0.5));
        assert!(is_its_own(&with(2.0), 1.8) && !is_its_own(&with(1.5), 1.1));
    }
}
