//! Candidates, and which of them to use.

use super::advice::Advice;
use super::best::{best, is_robust};
use super::candidate::{Candidate, CandidateRule, parallel, published};
use super::family::with_dead_time;
use super::options::{LoopSigns, RetuneOptions};
use super::remarks::remarks_on_choice;
use super::retuning::{Retuning, gain};
use super::swing::{Swing, is_its_own, passes, swing};
use crate::control::PidGains;
use crate::identify::LoopStudy;
use crate::model::ProcessModel;
use crate::tune::ControllerKind;
use crate::tune::optimum::OptimumError;

/// Tunes for the model of a study, compares, and chooses.
///
/// # Errors
/// [`OptimumError`] for limits that cannot be asked for; a limit that no controller meets is an [`Advice`].
pub fn retune(
    study: &LoopStudy,
    signs: &LoopSigns,
    options: &RetuneOptions,
) -> Result<Retuning, OptimumError> {
    let swing = swing(&study.findings, signs);
    let fit = match &study.choice {
        Ok(choice) if choice.chosen().is_usable() => choice.chosen(),
        Ok(choice) => {
            return Ok(without_model(swing, Advice::NoModel(choice.chosen().verdict().clone())));
        }
        Err(error) => return Ok(without_model(swing, Advice::NoFit(error.clone()))),
    };
    let mut out = Retuning::default();
    let mut remarks = Vec::new();
    let floor_s = 0.5 * signs.sample_time_s;
    let model = with_dead_time(&fit.model, floor_s);
    if model != fit.model {
        remarks.push(Advice::DeadTimeTaken { dead_time_s: floor_s });
    }
    let draws = fit.draws(options.draws, options.seed).unwrap_or_default();
    out.draws = draws.iter().map(|m| with_dead_time(m, floor_s)).collect();
    if out.draws.is_empty() {
        remarks.push(Advice::UncertaintyUnknown);
    }
    let present = present_gains(study, options, &mut remarks).map(|g| {
        Candidate::new(CandidateRule::Present, ControllerKind::of(&g), parallel(&g), &model, &out.draws)
    });
    let best = best(&model, options, &mut out)?;
    out.candidates.extend(published(&model, options.controller, &out.draws));
    out.candidates.extend(present);
    decide(&mut out, best, &model, swing, options);
    remarks.extend(remarks_on_choice(&out, fit, signs));
    out.advice.extend(remarks);
    out.model = Some(model);
    Ok(out)
}

fn without_model(swing: Option<Swing>, reason: Advice) -> Retuning {
    match swing {
        Some(Swing::Valve { band, period_s }) => {
            let mut out = Retuning::none(Advice::ValveSticks { band, period_s });
            out.advice.push(reason);
            out
        }
        _ => Retuning::none(reason),
    }
}

/// Least share of its own moves that a controller read from a log must explain.
const READ_WELL: f64 = 0.5;

fn present_gains(study: &LoopStudy, options: &RetuneOptions, remarks: &mut Vec<Advice>) -> Option<PidGains> {
    if options.present.is_some() {
        return options.present;
    }
    let controller = study.controller.as_ref()?;
    if controller.r2 < READ_WELL {
        remarks.push(Advice::PresentUnsure { explained_percent: 100.0 * controller.r2 });
        return None;
    }
    controller.gains()
}

/// Gain in percent under which a change is not worth its risk.
const WORTH_PERCENT: f64 = 5.0;
/// Share by which a swing from outside must shrink for a retuning to be worth it.
const SMALLER: f64 = 0.9;

fn decide(
    out: &mut Retuning,
    best: Result<usize, Advice>,
    model: &ProcessModel,
    swing: Option<Swing>,
    options: &RetuneOptions,
) {
    let earlier = std::mem::take(&mut out.advice);
    let best = match best {
        Ok(best) => best,
        Err(reason) => {
            out.advice = std::iter::once(reason).chain(earlier).collect();
            return;
        }
    };
    let (new, present) = (&out.candidates[best], out.present());
    if let Some(Swing::Valve { band, period_s }) = swing {
        out.advice = vec![Advice::ValveSticks { band, period_s }];
        return;
    }
    let mut after = Vec::new();
    if let (Some(Swing::Sine { period_s }), Some(present)) = (swing, present) {
        let [now, then] = [present, new].map(|c| passes(model, &c.gains, period_s));
        let advice = Advice::FromOutside { period_s, now, then };
        let is_its_own = is_its_own(&present.analysis, now);
        if !is_its_own && then > SMALLER * now {
            out.advice = vec![advice];
            return;
        }
        if !is_its_own {
            after.push(advice);
        }
    }
    let gain = present.and_then(|p| gain(new, p)).map(|g| g.1);
    let (first, recommended) = match (present, gain) {
        (None, _) => (Advice::Best { controller: new.controller }, best),
        (Some(p), _) if !p.analysis.stable => (Advice::PresentUnstable, best),
        (Some(p), None) if p.gains.ki == 0.0 => (Advice::NoIntegral, best),
        (Some(p), gain) => {
            let within = keeps(p, options) && is_robust(p, options.limits.ms);
            match gain {
                Some(percent) if within && percent < WORTH_PERCENT => {
                    let place = out.candidates.iter().position(|c| c.rule == CandidateRule::Present);
                    (Advice::Keep { gain_percent: percent.max(0.0) }, place.unwrap_or(best))
                }
                Some(percent) if percent >= WORTH_PERCENT => {
                    (Advice::Better { controller: new.controller, gain_percent: percent }, best)
                }
                _ => {
                    let slower_percent = (-gain.unwrap_or(0.0)).max(0.0);
                    let ms = p.spread.as_ref().map(|s| s.ms.high).or(p.analysis.ms).unwrap_or(f64::INFINITY);
                    (Advice::Robuster { ms, slower_percent }, best)
                }
            }
        }
    };
    out.recommended = Some(recommended);
    out.advice = std::iter::once(first).chain(earlier).chain(after).collect();
}

/// Whether a tuning keeps the limits, to a hundredth.
fn keeps(candidate: &Candidate, options: &RetuneOptions) -> bool {
    const NEAR: f64 = 1.01;
    let (a, l) = (&candidate.analysis, &options.limits);
    [(a.ms, l.ms), (a.mt, l.mt), (a.ju, l.ju)]
        .iter()
        .all(|(value, limit)| limit.is_infinite() || value.is_some_and(|v| v <= NEAR * limit))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::{FitProblem, LoopRecord, StudyOptions, study_loop};
    use crate::tune::optimum::LoopLimits;

    /// A first-order process, K = 2, T = 40 s, dead time 4 s, under PI with a moving setpoint; a row a second.
    fn log(rows: usize, noise: f64, kc: f64, ti_s: f64) -> [Vec<f64>; 4] {
        let decay = (-1.0f64 / 40.0).exp();
        let (mut level, mut integral, mut state) = (0.0f64, 0.0, 7u64);
        let [mut time, mut pv, mut sp, mut mv]: [Vec<f64>; 4] = Default::default();
        for k in 0..rows {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let uniform = (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
            let setpoint = f64::from(u8::from(k / 200 % 2 == 1));
            let seen = level + noise * uniform;
            integral += kc / ti_s * (setpoint - seen);
            mv.push(kc * (setpoint - seen) + integral);
            time.push(k as f64);
            pv.push(seen);
            sp.push(setpoint);
            let arrives = 2.0 * if k >= 4 { mv[k - 4] } else { 0.0 };
            level = arrives + (level - arrives) * decay;
        }
        [time, pv, sp, mv]
    }

    fn retuned(rows: usize, noise: f64, present: (f64, f64), options: &RetuneOptions) -> Retuning {
        let [time, pv, sp, mv] = log(rows, noise, present.0, present.1);
        let record = LoopRecord { problem: FitProblem::new(&time, &pv, &mv), sp: Some(&sp), mode: None };
        let start = std::time::Instant::now();
        let study = study_loop(&record, &StudyOptions::default()).expect("a study");
        let studied = start.elapsed();
        let out = retune(&study, &LoopSigns::of(&time, &mv, Some(&sp)), options).expect("an answer");
        println!("{rows} rows: study {studied:?}, retuning {:?}", start.elapsed() - studied);
        out
    }

    #[test]
    fn the_optimum_keeps_its_limits_and_says_what_it_gains() {
        let options = RetuneOptions::default();
        let out = retuned(10_000, 0.02, (0.5, 60.0), &options);
        assert_eq!(out.choice().map(|c| c.rule), Some(CandidateRule::Optimal), "{:?}", out.advice);
        assert!(out.choice().and_then(|c| c.analysis.ms).expect("stable") <= 1.4 * (1.0 + 1e-8));
        assert!(out.gain().expect("a gain").1 > 30.0, "{:?}", out.gain());
        assert_eq!(out, retuned(10_000, 0.02, (0.5, 60.0), &options));
    }

    #[test]
    fn a_model_that_is_barely_known_is_tuned_for_with_others_as_likely() {
        let loose = RetuneOptions {
            limits: LoopLimits { ms: 1.9, ..LoopLimits::DEFAULT },
            ..RetuneOptions::default()
        };
        let out = retuned(400, 2.0, (0.5, 60.0), &loose);
        let family = out.candidates.iter().any(|c| c.rule == CandidateRule::OptimalFamily);
        let said = out
            .advice
            .iter()
            .any(|a| matches!(a, Advice::Uncertain { .. } | Advice::Sensitive { .. } | Advice::NoModel(_)));
        assert!(said && (family || out.model.is_none()), "{:?}", out.advice);
    }

    #[test]
    fn a_limit_that_nothing_meets_is_an_answer() {
        let options = RetuneOptions {
            limits: LoopLimits { ju: 0.1, ..LoopLimits::DEFAULT },
            present: Some(PidGains::pi(0.5, 60.0)),
            ..RetuneOptions::default()
        };
        let out = retuned(800, 0.02, (0.5, 60.0), &options);
        assert!(
            matches!(out.advice[0], Advice::NoOptimum(_)) && out.recommended.is_none(),
            "{:?}",
            out.advice
        );
        assert!(out.present().is_some() && out.candidates.len() == 3);
        let wrong = RetuneOptions { limits: LoopLimits { ms: 0.9, ..LoopLimits::DEFAULT }, ..options };
        let [time, pv, sp, mv] = log(800, 0.02, 0.5, 60.0);
        let record = LoopRecord { problem: FitProblem::new(&time, &pv, &mv), sp: Some(&sp), mode: None };
        let study = study_loop(&record, &StudyOptions::default()).expect("a study");
        assert!(retune(&study, &LoopSigns::of(&time, &mv, None), &wrong).is_err());
    }
}
