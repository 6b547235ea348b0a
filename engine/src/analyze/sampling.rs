//! Whether the points of a measured frequency response lie close enough for what a loop makes of them.

use super::measured::FrequencyResponse;
use crate::control::ParallelGains;

/// |L| at either of two points from which on what lies between bears on the loop: a resonance may multiply it.
const HEARD: f64 = 0.1;
/// Largest step of the phase between two points in radians, and of the gain as a factor beyond the slopes that
/// processes without resonance have there, 0 to −40 dB a decade.
const PHASE_STEP: f64 = std::f64::consts::FRAC_PI_4;
const GAIN_STEP: f64 = 2.0;
const STEEPEST: f64 = -2.0;

/// Two neighbouring points that lie too far apart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CoarseStep {
    /// Lower frequency in rad/s.
    pub from_rad_s: f64,
    /// Upper frequency in rad/s.
    pub to_rad_s: f64,
    /// Change of the phase in degrees, lag negative.
    pub phase_deg: f64,
    /// Gain at the upper over gain at the lower frequency.
    pub gain_ratio: f64,
}

impl FrequencyResponse {
    /// The steps between neighbouring points, in the range where the loop has any gain, that more than 45° or a factor of
    /// 2 beyond −40 dB a decade make too coarse: a resonance may stand between.
    #[must_use]
    pub fn coarse_steps(&self, gains: &ParallelGains) -> Vec<CoarseStep> {
        let (x, gain, phase) = (&self.log_omega, &self.log_gain, &self.phase_rad);
        let loop_gain = |i: usize| gain[i].exp() * gains.at_omega(x[i].exp()).norm();
        let step = |i: usize| {
            let turn = phase[i] - phase[i - 1];
            let rise = gain[i] - gain[i - 1];
            let fall = STEEPEST * (x[i] - x[i - 1]) - rise;
            let coarse = turn.abs() > PHASE_STEP || rise.max(fall) > GAIN_STEP.ln();
            let heard = loop_gain(i).max(loop_gain(i - 1)) >= HEARD;
            (coarse && heard).then(|| CoarseStep {
                from_rad_s: x[i - 1].exp(),
                to_rad_s: x[i].exp(),
                phase_deg: turn.to_degrees(),
                gain_ratio: rise.exp(),
            })
        };
        (1..x.len()).filter_map(step).collect()
    }
}

#[cfg(test)]
mod tests {
    use num_complex::Complex64;

    use super::*;

    /// e^(−0.1 s)/(s² + 0.2 s + 1) behind a lag of 0.5 s, from 0.02 to 40 rad/s.
    fn resonance(count: i32) -> FrequencyResponse {
        let of = |k: i32| {
            let omega = 0.02 * 2000f64.powf(f64::from(k) / f64::from(count - 1));
            let s = Complex64::new(0.0, omega);
            (omega, (-0.1 * s).exp() / ((s * s + 0.2 * s + 1.0) * (0.5 * s + 1.0)))
        };
        FrequencyResponse::new(&(0..count).map(of).collect::<Vec<_>>()).expect("a response")
    }

    /// Twelve points step over the resonance at 1 rad/s, and gains from them had an Ms of 30 where 1.5 was asked.
    #[test]
    fn points_that_step_over_a_resonance_are_named() {
        let gains = ParallelGains { kp: 0.2, ki: 0.3, kd: 0.0, tf_s: 0.0 };
        let found = resonance(12).coarse_steps(&gains);
        assert!(found.iter().any(|s| s.from_rad_s < 1.0 && s.to_rad_s > 1.0), "{found:?}");
        assert_eq!(resonance(400).coarse_steps(&gains), vec![]);
    }
}
