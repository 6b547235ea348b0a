//! What to know before the numbers are typed in.

use super::advice::Advice;
use super::candidate::CandidateRule;
use super::options::LoopSigns;
use super::retuning::Retuning;
use crate::identify::ModelFit;

/// What to know before the numbers are typed in.
pub(super) fn remarks_on_choice(out: &Retuning, fit: &ModelFit, signs: &LoopSigns) -> Vec<Advice> {
    /// Change of Kc that is better made in steps.
    const LARGE: f64 = 4.0;
    /// Share of the MV's range in the log that noise may move it by.
    const RESTLESS: f64 = 0.1;
    let mut remarks = Vec::new();
    let Some(choice) = out.choice() else { return remarks };
    if choice.rule == CandidateRule::Present {
        return remarks;
    }
    if choice.gains.kp == 0.0 {
        remarks.push(Advice::IntegratorOnly);
    }
    if let Some(present) = out.present() {
        let factor = choice.gains.kp / present.gains.kp;
        if factor > LARGE || (factor > 0.0 && factor < 1.0 / LARGE) {
            remarks.push(Advice::LargeMove { factor });
        }
    }
    // What neighbours share is slow, and the integral takes care of it: the rest is noise.
    let shared = fit.tests.autocorrelation.first().copied().unwrap_or(0.0).clamp(0.0, 1.0);
    let noise = (fit.mse * (1.0 - shared)).sqrt();
    let moved = 2.0 * choice.analysis.ju.unwrap_or(choice.gains.kp.abs()) * noise;
    if moved > RESTLESS * signs.mv_range && signs.mv_range > 0.0 {
        remarks.push(Advice::Restless { mv_move: moved, percent: 100.0 * moved / signs.mv_range });
    }
    remarks
}
