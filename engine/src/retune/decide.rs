//! Candidates, and which of them to use.

use super::advice::Advice;
use super::candidate::{Candidate, CandidateRule, parallel, published};
use super::family::{family, with_dead_time};
use super::options::{LoopSigns, RetuneOptions};
use super::swing::{Swing, is_its_own, passes, swing};
use crate::identify::{LoopStudy, ModelFit};
use crate::model::ProcessModel;
use crate::tune::ControllerKind;
use crate::tune::optimum::{Objective, OptimumError, OptimumProblem, Process, Wanted, optimum};

/// What comes of a retuning.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Retuning {
    /// Model that was tuned for; absent where the log gives none.
    pub model: Option<ProcessModel>,
    /// Models drawn from what the log leaves open; none where it leaves a parameter open altogether.
    pub draws: Vec<ProcessModel>,
    /// Tunings, the best first, the present one last.
    pub candidates: Vec<Candidate>,
    /// Which of them to use; absent where none should be.
    pub recommended: Option<usize>,
    /// The answer first, then what goes with it.
    pub advice: Vec<Advice>,
}

impl Retuning {
    /// The tuning to use.
    #[must_use]
    pub fn choice(&self) -> Option<&Candidate> {
        self.candidates.get(self.recommended?)
    }

    /// The present tuning.
    #[must_use]
    pub fn present(&self) -> Option<&Candidate> {
        self.candidates.iter().find(|c| c.rule == CandidateRule::Present)
    }

    /// How much smaller the IAE of a load step becomes, in percent of the present one; Jv where an IAE does not exist.
    /// Negative where the present tuning is faster. `None` without a stable present tuning with integral action.
    #[must_use]
    pub fn gain(&self) -> Option<(&'static str, f64)> {
        gain(self.choice()?, self.present()?)
    }

    fn none(advice: Advice) -> Self {
        Self { advice: vec![advice], ..Self::default() }
    }
}

fn gain(new: &Candidate, old: &Candidate) -> Option<(&'static str, f64)> {
    let percent = |new: Option<f64>, old: Option<f64>| {
        new.zip(old).filter(|(_, old)| *old > 0.0).map(|(new, old)| 100.0 * (1.0 - new / old))
    };
    percent(new.figures.iae_load, old.figures.iae_load)
        .map(|p| ("iae_load", p))
        .or_else(|| percent(new.analysis.jv, old.analysis.jv).map(|p| ("Jv", p)))
}

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

fn present_gains(
    study: &LoopStudy,
    options: &RetuneOptions,
    remarks: &mut Vec<Advice>,
) -> Option<crate::control::PidGains> {
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

/// Share of unstable loops and 95 % quantile of Ms from which the optimum of the model alone is not to be used.
const MOST_UNSTABLE: f64 = 0.01;
const MOST_MS: f64 = 2.0;

fn is_robust(candidate: &Candidate, limit_ms: f64) -> bool {
    // A user who asks for Ms over 2 does not mind an Ms over 2.
    let most = MOST_MS.max(1.2 * if limit_ms.is_finite() { limit_ms } else { 1.0 });
    candidate.spread.as_ref().is_none_or(|s| s.unstable_share() <= MOST_UNSTABLE && s.ms.high <= most)
}

/// Adds the optima; which of them to use, or why there is none.
fn best(
    model: &ProcessModel,
    options: &RetuneOptions,
    out: &mut Retuning,
) -> Result<Result<usize, Advice>, OptimumError> {
    let pid = options.controller == ControllerKind::Pid;
    let mut kinds = vec![ControllerKind::Pi];
    if pid {
        kinds.insert(0, ControllerKind::Pid);
    }
    let mut answer = None;
    for kind in kinds {
        let found = best_of(model, kind, options, out)?;
        // The controller that was asked for first; the other only where there is none.
        if answer.as_ref().is_none_or(Result::is_err) {
            answer = Some(found);
        }
    }
    Ok(answer.unwrap_or(Err(Advice::TooUncertain)))
}

fn best_of(
    model: &ProcessModel,
    kind: ControllerKind,
    options: &RetuneOptions,
    out: &mut Retuning,
) -> Result<Result<usize, Advice>, OptimumError> {
    let nominal = match solve(&[Process::Model(model.clone())], kind, options) {
        Ok(gains) => gains,
        Err(error) if error.is_answer() => return Ok(Err(Advice::NoOptimum(error))),
        Err(error) => return Err(error),
    };
    let candidate = Candidate::new(CandidateRule::Optimal, kind, nominal, model, &out.draws);
    let robust = is_robust(&candidate, options.limits.ms);
    let spread = candidate.spread.clone();
    out.candidates.push(candidate);
    if robust {
        return Ok(Ok(out.candidates.len() - 1));
    }
    let (unstable_percent, ms) =
        spread.map_or((0.0, f64::INFINITY), |s| (100.0 * s.unstable_share(), s.ms.high));
    out.advice.push(Advice::Uncertain { controller: kind, unstable_percent, ms });
    let family = family(model, &out.draws, &nominal);
    let Ok(gains) = solve(&family, kind, options) else { return Ok(Err(Advice::TooUncertain)) };
    let candidate = Candidate::new(CandidateRule::OptimalFamily, kind, gains, model, &out.draws);
    let robust = is_robust(&candidate, options.limits.ms);
    out.candidates.push(candidate);
    Ok(if robust { Ok(out.candidates.len() - 1) } else { Err(Advice::TooUncertain) })
}

fn solve(
    processes: &[Process],
    kind: ControllerKind,
    options: &RetuneOptions,
) -> Result<crate::control::ParallelGains, OptimumError> {
    let wanted = if kind == ControllerKind::Pid { Wanted::pid(&options.limits) } else { Wanted::Pi };
    let problem = OptimumProblem { processes, wanted, objective: Objective::Jv, limits: options.limits };
    optimum(&problem).map(|found| found.gains)
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

/// What to know before the numbers are typed in.
fn remarks_on_choice(out: &Retuning, fit: &ModelFit, signs: &LoopSigns) -> Vec<Advice> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::PidGains;
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
        let said = out.advice.iter().any(|a| matches!(a, Advice::Uncertain { .. } | Advice::NoModel(_)));
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
