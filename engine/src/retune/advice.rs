//! What comes of a retuning, in words an operator can act on.

use crate::explain::{Explain, number};
use crate::identify::{FitError, FitVerdict};
use crate::tune::ControllerKind;
use crate::tune::optimum::OptimumError;

/// An answer, or a remark that goes with it.
#[derive(Debug, Clone, PartialEq)]
pub enum Advice {
    /// The log cannot tell a model.
    NoModel(FitVerdict),
    /// The log cannot be fitted at all.
    NoFit(FitError),
    /// The limits cannot be met.
    NoOptimum(OptimumError),
    /// Not even tuned for the worst of a family is the loop safe.
    TooUncertain,
    /// The valve sticks.
    ValveSticks {
        /// Move it needs to follow, in MV units.
        band: f64,
        /// Period of the swing in seconds.
        period_s: f64,
    },
    /// A swing comes from outside the loop.
    FromOutside {
        /// Period in seconds.
        period_s: f64,
        /// |S| there with the present tuning.
        now: f64,
        /// |S| there with the best tuning.
        then: f64,
    },
    /// The optimum, with nothing to compare it with.
    Best {
        /// Actions it has.
        controller: ControllerKind,
    },
    /// The optimum is better than the present tuning.
    Better {
        /// Actions it has.
        controller: ControllerKind,
        /// By how much the effect of a load shrinks, in percent.
        gain_percent: f64,
    },
    /// The present tuning is as good.
    Keep {
        /// What there would be to gain, in percent.
        gain_percent: f64,
    },
    /// The present tuning is past the limits, or not safe over the model's uncertainty.
    Robuster {
        /// Ms of the present tuning, the 95 % quantile where there is one.
        ms: f64,
        /// What the change costs, in percent.
        slower_percent: f64,
    },
    /// The present controller has no integral action.
    NoIntegral,
    /// The present tuning is not stable with the model.
    PresentUnstable,
    /// The optimum for the model alone is not safe over its uncertainty.
    Uncertain {
        /// Controller it concerns.
        controller: ControllerKind,
        /// Models as likely with which its loop is unstable, in percent.
        unstable_percent: f64,
        /// 95 % quantile of its Ms.
        ms: f64,
    },
    /// The optimum for the model alone is stable over its uncertainty, but not with the robustness asked for.
    Sensitive {
        /// Controller it concerns.
        controller: ControllerKind,
        /// 95 % quantile of its Ms.
        ms: f64,
    },
    /// Nothing can be said of the model's uncertainty.
    UncertaintyUnknown,
    /// The present tuning could not be read off the log well enough.
    PresentUnsure {
        /// Part of the MV's moves it explains, in percent.
        explained_percent: f64,
    },
    /// A log cannot tell dead times under its sample time.
    DeadTimeTaken {
        /// Dead time taken, in seconds.
        dead_time_s: f64,
    },
    /// A pure integrator is best.
    IntegratorOnly,
    /// Kc changes by a large factor.
    LargeMove {
        /// New over old Kc.
        factor: f64,
    },
    /// Noise of the PV moves the MV much.
    Restless {
        /// About twice the standard deviation of the MV, in MV units.
        mv_move: f64,
        /// In percent of what the MV moved in the log.
        percent: f64,
    },
}

impl std::fmt::Display for Advice {
    #[allow(clippy::too_many_lines, reason = "one sentence a kind")]
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let n = |v: &f64| number(*v);
        let whole = |v: &f64| number(v.round());
        match self {
            Self::NoModel(verdict) => write!(f, "this log cannot tell a tuning: {verdict}"),
            Self::NoFit(error) => write!(f, "this log cannot tell a tuning: {error}"),
            Self::NoOptimum(error) => write!(f, "no tuning meets the limits: {error}"),
            Self::TooUncertain => f.write_str(
                "the model is too uncertain to tune for: no tuning within the limits is safe with all the models that fit this log as well; record a larger or longer test",
            ),
            Self::ValveSticks { band, period_s } => write!(
                f,
                "don't retune: the valve sticks. The loop swings with a period of {} s in triangles and the valve needs a move of about {} to follow; have it mended, then record again",
                n(period_s),
                n(band)
            ),
            Self::FromOutside { period_s, now, then } => write!(
                f,
                "the swing with a period of {} s comes from outside this loop, which is stable with its present tuning: look upstream. The loop lets {} of it through now and {} with the best tuning within the limits",
                n(period_s),
                n(now),
                n(then)
            ),
            Self::Best { controller } => write!(
                f,
                "use the optimal {controller}: of all that keep the limits it rejects loads best; the present tuning is not known, so nothing is said of the gain"
            ),
            Self::Better { controller, gain_percent } => write!(
                f,
                "use the optimal {controller}: it keeps the limits, and a load does {} % less than with the present tuning",
                whole(gain_percent)
            ),
            Self::Keep { gain_percent } => write!(
                f,
                "leave the tuning as it is: it keeps the limits, and the best that is safe with what the log tells would gain {} % only",
                whole(gain_percent)
            ),
            Self::Robuster { ms, slower_percent } => write!(
                f,
                "use the optimal tuning for its robustness: the present one comes to Ms {} where the limits or the model's uncertainty ask for less; a load does {} % more in return",
                n(ms),
                whole(slower_percent)
            ),
            Self::NoIntegral => f.write_str(
                "use the optimal tuning: the present controller has no integral action, so that every load leaves an offset",
            ),
            Self::PresentUnstable => f.write_str(
                "retune this loop: its present tuning is not stable with the model; the optimal one is, and keeps the limits",
            ),
            Self::Uncertain { controller, unstable_percent, ms } => write!(
                f,
                "the optimal {controller} for the fitted model alone is not safe: with models that fit the log as well it is unstable in {} % of the cases, and 5 % of them have Ms over {}; the worst of a dozen such models was tuned for instead",
                n(unstable_percent),
                n(ms)
            ),
            Self::Sensitive { controller, ms } => write!(
                f,
                "the optimal {controller} for the fitted model alone is not safe: of the models that fit the log as well, 5 % have Ms over {} with it; the worst of a dozen such models was tuned for instead",
                n(ms)
            ),
            Self::UncertaintyUnknown => f.write_str(
                "the log leaves a parameter of the model open altogether, so nothing is said of how safe a tuning is; try it in small steps",
            ),
            Self::PresentUnsure { explained_percent } => write!(
                f,
                "the present tuning was not read off the log: a PID law explains {} % of the MV's moves only; give it with --present to compare",
                whole(explained_percent)
            ),
            Self::DeadTimeTaken { dead_time_s } => write!(
                f,
                "a dead time of {} s was taken for the tuning, half the time between rows: this log cannot tell a shorter one",
                n(dead_time_s)
            ),
            Self::IntegratorOnly => f.write_str(
                "a pure integrator is best here: a controller with Kc and Ti cannot be set to it; raise a limit for some proportional action",
            ),
            Self::LargeMove { factor } => write!(
                f,
                "Kc changes by a factor of {}: go there in two or three steps, and watch the loop in between",
                n(factor)
            ),
            Self::Restless { mv_move, percent } => write!(
                f,
                "noise of the PV will move the MV by about ±{}, {} % of its range in this log; give a limit with --ju if that wears the valve",
                n(mv_move),
                whole(percent)
            ),
        }
    }
}

impl Explain for Advice {
    fn key(&self) -> &'static str {
        match self {
            Self::NoModel(_) => "retune.no_model",
            Self::NoFit(_) => "retune.no_fit",
            Self::NoOptimum(_) => "retune.no_optimum",
            Self::TooUncertain => "retune.too_uncertain",
            Self::ValveSticks { .. } => "retune.valve_sticks",
            Self::FromOutside { .. } => "retune.from_outside",
            Self::Best { .. } => "retune.best",
            Self::Better { .. } => "retune.better",
            Self::Keep { .. } => "retune.keep",
            Self::Robuster { .. } => "retune.robuster",
            Self::NoIntegral => "retune.no_integral",
            Self::PresentUnstable => "retune.present_unstable",
            Self::Uncertain { .. } => "retune.uncertain",
            Self::Sensitive { .. } => "retune.sensitive",
            Self::UncertaintyUnknown => "retune.uncertainty_unknown",
            Self::PresentUnsure { .. } => "retune.present_unsure",
            Self::DeadTimeTaken { .. } => "retune.dead_time_taken",
            Self::IntegratorOnly => "retune.integrator_only",
            Self::LargeMove { .. } => "retune.large_move",
            Self::Restless { .. } => "retune.restless",
        }
    }

    fn args(&self) -> Vec<(&'static str, String)> {
        let n = |name: &'static str, v: &f64| (name, number(*v));
        let whole = |name: &'static str, v: &f64| (name, number(v.round()));
        match self {
            Self::NoModel(inner) => vec![("error", inner.to_string())],
            Self::NoFit(inner) => vec![("error", inner.to_string())],
            Self::NoOptimum(inner) => vec![("error", inner.to_string())],
            Self::ValveSticks { band, period_s } => vec![n("band", band), n("period_s", period_s)],
            Self::FromOutside { period_s, now, then } => {
                vec![n("period_s", period_s), n("now", now), n("then", then)]
            }
            Self::Best { controller } => vec![("controller", controller.to_string())],
            Self::Better { controller, gain_percent } => {
                vec![("controller", controller.to_string()), whole("percent", gain_percent)]
            }
            Self::Keep { gain_percent } => vec![whole("percent", gain_percent)],
            Self::Robuster { ms, slower_percent } => vec![n("ms", ms), whole("percent", slower_percent)],
            Self::Uncertain { controller, unstable_percent, ms } => {
                vec![("controller", controller.to_string()), n("percent", unstable_percent), n("ms", ms)]
            }
            Self::Sensitive { controller, ms } => {
                vec![("controller", controller.to_string()), n("ms", ms)]
            }
            Self::PresentUnsure { explained_percent } => vec![whole("percent", explained_percent)],
            Self::DeadTimeTaken { dead_time_s } => vec![n("dead_time_s", dead_time_s)],
            Self::LargeMove { factor } => vec![n("factor", factor)],
            Self::Restless { mv_move, percent } => vec![n("mv_move", mv_move), whole("percent", percent)],
            Self::TooUncertain
            | Self::NoIntegral
            | Self::PresentUnstable
            | Self::UncertaintyUnknown
            | Self::IntegratorOnly => vec![],
        }
    }

    fn cause(&self) -> Option<&dyn Explain> {
        match self {
            Self::NoModel(inner) => Some(inner),
            Self::NoFit(inner) => Some(inner),
            Self::NoOptimum(inner) => Some(inner),
            _ => None,
        }
    }
}

impl Advice {
    /// One of each kind, for the test that compares them with the translation files.
    #[must_use]
    pub fn samples() -> Vec<Self> {
        let controller = ControllerKind::Pi;
        vec![
            Self::NoModel(FitVerdict::GainUnknown),
            Self::NoFit(FitError::TooFewSamples { rows: 3, needed: 10 }),
            Self::NoOptimum(OptimumError::Unbounded),
            Self::TooUncertain,
            Self::ValveSticks { band: 1.4, period_s: 330.0 },
            Self::FromOutside { period_s: 210.0, now: 1.05, then: 0.62 },
            Self::Best { controller },
            Self::Better { controller, gain_percent: 41.7 },
            Self::Keep { gain_percent: 2.2 },
            Self::Robuster { ms: 2.9, slower_percent: 35.2 },
            Self::NoIntegral,
            Self::PresentUnstable,
            Self::Sensitive { controller, ms: 3.1 },
            Self::Uncertain { controller, unstable_percent: 4.5, ms: 3.1 },
            Self::UncertaintyUnknown,
            Self::PresentUnsure { explained_percent: 38.0 },
            Self::DeadTimeTaken { dead_time_s: 5.0 },
            Self::IntegratorOnly,
            Self::LargeMove { factor: 6.0 },
            Self::Restless { mv_move: 2.5, percent: 18.0 },
        ]
    }
}
