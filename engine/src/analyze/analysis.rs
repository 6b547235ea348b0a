//! The full analysis of a loop: stability first, then sensitivities and margins.

use num_complex::Complex64;
use serde::{Deserialize, Serialize};

use super::OpenLoop;
use super::grid::Grid;
use super::stability::{GainCrossing, angle_to_critical, gain_crossings, is_stable, unstable_poles};
use super::sweep::{PhaseCrossing, S, Sweep, T, U, V};
use crate::control::PidGains;
use crate::model::ProcessModel;

/// What a loop L = G·C is worth; S = 1/(1 + L), T = L/(1 + L).
///
/// Every measure is `None` for an unstable loop, and where it does not exist or is infinite. Peaks include their
/// limits at ω → 0 and ω → ∞. JSON keys are the field's symbols.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Analysis {
    /// Whether every closed-loop pole lies in the open left half-plane, by the Nyquist criterion with exact dead time.
    pub stable: bool,
    /// Ms = ‖S‖∞.
    #[serde(rename = "Ms")]
    pub ms: Option<f64>,
    /// Mt = ‖T‖∞.
    #[serde(rename = "Mt")]
    pub mt: Option<f64>,
    /// Jv = ‖G S/s‖∞ in PV units times seconds per MV unit; none without integral action on a process with G(0) ≠ 0.
    #[serde(rename = "Jv")]
    pub jv: Option<f64>,
    /// Ju = ‖C S‖∞ in MV units per PV unit.
    #[serde(rename = "Ju")]
    pub ju: Option<f64>,
    /// Smallest factor > 1 on Kc that makes the loop oscillate for ever; none if no increase does.
    pub gain_margin: Option<f64>,
    /// Largest factor < 1 on Kc that makes the loop oscillate for ever; none if no decrease does.
    pub gain_reduction_margin: Option<f64>,
    /// Frequency of the gain margin in rad/s; none also when the margin is a limit for ω → ∞.
    pub w_180_rad_s: Option<f64>,
    /// Smallest angle in degrees between L and −1 over all frequencies with |L| = 1, lead or lag.
    pub phase_margin_deg: Option<f64>,
    /// Frequency of the phase margin in rad/s.
    pub w_gc_rad_s: Option<f64>,
    /// Smallest additional dead time in seconds that makes the loop oscillate for ever.
    pub delay_margin_s: Option<f64>,
    /// Frequency in rad/s at which |T| first falls under |T(0)|/√2.
    pub bandwidth_rad_s: Option<f64>,
}

impl Analysis {
    /// GMs = max(Ms, α Mt), Kristiansson and Lennartson's one number for stability margins.
    ///
    /// α is the ratio of the limits on Ms and Mt; `None` for an unstable loop.
    #[must_use]
    pub fn generalised_margin(&self, alpha: f64) -> Option<f64> {
        Some(self.ms?.max(alpha * self.mt?))
    }
}

/// Analyses the loop of a model and a controller, dead time exact, peaks to a relative error under 1e-6.
///
/// Never fails: gains that are not finite give an unstable verdict, Kc = 0 the open loop.
/// Source of Jv and Ju: Kristiansson and Lennartson, Evaluation and simple tuning of PID controllers with
/// high-frequency robustness, J. Process Control 16, 2006.
#[must_use]
pub fn analyze(model: &ProcessModel, gains: &PidGains) -> Analysis {
    analyze_loop(&OpenLoop::new(model, gains))
}

/// [`analyze`] for a loop that is already built.
#[must_use]
pub fn analyze_loop(open: &OpenLoop) -> Analysis {
    let crossings = gain_crossings(open);
    if !is_stable(open, &crossings) {
        return Analysis::default();
    }
    let mut sweep = Sweep::new(open);
    sweep.run(&Grid::new(open, &crossings));
    let peak = |k: usize| Some(1.0 / sweep.lowest[k].sqrt()).filter(|v| v.is_finite());
    let (nearest, delay_margin_s) = phase_and_delay(open, &crossings);
    let margin = |c: Option<PhaseCrossing>| c.map(|c| 1.0 / c.magnitude).filter(|m| m.is_finite());
    Analysis {
        stable: true,
        ms: peak(S),
        mt: peak(T),
        jv: peak(V),
        ju: peak(U),
        gain_margin: margin(sweep.above),
        gain_reduction_margin: margin(sweep.below),
        w_180_rad_s: sweep.above.map(|c| c.omega).filter(|w| w.is_finite()),
        phase_margin_deg: nearest.map(|(_, angle)| angle.to_degrees()),
        w_gc_rad_s: nearest.map(|(omega, _)| omega),
        delay_margin_s,
        bandwidth_rad_s: sweep.bandwidth,
    }
}

/// Whether a loop is stable, see [`is_closed_loop_stable`].
#[must_use]
pub fn is_loop_stable(open: &OpenLoop) -> bool {
    is_stable(open, &gain_crossings(open))
}

/// How many poles of the closed loop are unstable; `None` where one is on the verge, or they are without end.
pub(crate) fn unstable_loop_poles(open: &OpenLoop) -> Option<u32> {
    unstable_poles(open, &gain_crossings(open))
}

/// Whether the closed loop is stable: the verdict of [`analyze`] alone, a few hundred nanoseconds.
#[must_use]
pub fn is_closed_loop_stable(model: &ProcessModel, gains: &PidGains) -> bool {
    is_loop_stable(&OpenLoop::new(model, gains))
}

/// The largest value of a function of the loop over all frequencies, and where it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Peak {
    /// The value; ∞ where there is no bound.
    pub value: f64,
    /// Its frequency in rad/s; 0 and ∞ for the limits.
    pub omega_rad_s: f64,
}

/// Peaks of |S|, |T|, |G S/s| and |C S|.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Peaks {
    /// Of |S|: Ms.
    pub s: Peak,
    /// Of |T|: Mt.
    pub t: Peak,
    /// Of |G S/s|: Jv.
    pub v: Peak,
    /// Of |C S|: Ju.
    pub u: Peak,
}

/// The four peaks with their frequencies to the precision of [`analyze`]; `None` for an unstable loop.
#[must_use]
pub fn peaks(open: &OpenLoop) -> Option<Peaks> {
    let crossings = gain_crossings(open);
    if !is_stable(open, &crossings) {
        return None;
    }
    let mut sweep = Sweep::new(open);
    sweep.run(&Grid::new(open, &crossings));
    let [s, t, v, u] = std::array::from_fn(|k| Peak {
        value: 1.0 / sweep.lowest[k].sqrt(),
        omega_rad_s: sweep.lowest_at[k],
    });
    Some(Peaks { s, t, v, u })
}

/// Unit crossing nearest to −1 as (ω, angle in radians), and the smallest delay over all of them.
///
/// A loop whose |L| stays at 1 or above for ω → ∞ stands no delay at all.
fn phase_and_delay(open: &OpenLoop, crossings: &[GainCrossing]) -> (Option<(f64, f64)>, Option<f64>) {
    let l_at_infinity = (open.process_high() * open.controller_high()).abs();
    let mut nearest: Option<(f64, f64)> = None;
    let mut delay = if l_at_infinity >= 1.0 { Some(0.0) } else { None };
    for crossing in crossings {
        let unit: Complex64 = crossing.l;
        let (angle, lag) = angle_to_critical(unit);
        if nearest.is_none_or(|(_, best)| angle < best) {
            nearest = Some((crossing.omega, angle));
        }
        let closing = lag / crossing.omega;
        if delay.is_none_or(|best| closing < best) {
            delay = Some(closing);
        }
    }
    (nearest, delay)
}
