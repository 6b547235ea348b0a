//! What a fit is worth, in plain words with its numbers.

use crate::explain::{Explain, number};

/// One finding about a fit; a fit without objections has [`FitVerdict::Good`] alone.
#[derive(Debug, Clone, PartialEq)]
pub enum FitVerdict {
    /// Nothing to object to.
    Good {
        /// Fit in percent.
        fit_percent: f64,
        /// Half the 95 % interval of K, in percent of K.
        gain_percent: f64,
        /// Half the 95 % interval of T, in percent of T.
        time_constant_percent: f64,
    },
    /// The model explains little of the PV's movement.
    Poor {
        /// Fit in percent.
        fit_percent: f64,
    },
    /// The move was too small for the noise.
    GainUncertain {
        /// Half the 95 % interval of K, in percent of K.
        percent: f64,
        /// How many times as large a move would bring it to ±10 %.
        times: f64,
    },
    /// The interval of L reaches 0.
    DeadTimeUnknown {
        /// Upper end of the interval, in seconds.
        upper_s: f64,
        /// How many times as large a move would bring its lower end off 0.
        times: f64,
    },
    /// T cannot be told from a stretch shorter than it.
    TimeConstantLong {
        /// T in seconds.
        time_constant_s: f64,
        /// Length of the stretch in seconds.
        span_s: f64,
    },
    /// T lies below what the sampling can show.
    TimeConstantShort {
        /// T in seconds.
        time_constant_s: f64,
        /// Sample time in seconds.
        sample_time_s: f64,
    },
    /// Residuals are smaller than a step of the PV.
    ResolutionLimited {
        /// Step of the PV in PV units.
        resolution: f64,
        /// How many steps the modelled movement is high.
        levels: f64,
    },
    /// Residuals are not white: the intervals are too narrow.
    ResidualsCorrelated {
        /// Correlation of neighbouring residuals.
        correlation: f64,
    },
    /// The stretch has gaps.
    Segments {
        /// Pieces fitted with a free state each.
        count: usize,
    },
    /// The MV never moves after the first row: the start was taken to be at rest.
    StartsAtRest {
        /// MV before the first row, in MV units.
        mv_before: f64,
    },
}

impl std::fmt::Display for FitVerdict {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Good { fit_percent, gain_percent, time_constant_percent } => write!(
                f,
                "good: the model explains the movement to {} %; K is known to ±{} %, T to ±{} %",
                number(*fit_percent),
                number(*gain_percent),
                number(*time_constant_percent)
            ),
            Self::Poor { fit_percent } => write!(
                f,
                "the fit is poor ({} %): the MV explains little of this PV's movement, or a first-order model is the wrong one",
                number(*fit_percent)
            ),
            Self::GainUncertain { percent, times } => write!(
                f,
                "the move was too small for this noise: the gain is known only to ±{} %; a move {} times as large would give ±10 %",
                number(*percent),
                number(*times)
            ),
            Self::DeadTimeUnknown { upper_s, times } => write!(
                f,
                "the dead time is not identifiable here: it lies between 0 and {} s; a move {} times as large would tell it from 0",
                number(*upper_s),
                number(*times)
            ),
            Self::TimeConstantLong { time_constant_s, span_s } => write!(
                f,
                "T = {} s is longer than the stretch ({} s): only the ratio K/T is known, record longer",
                number(*time_constant_s),
                number(*span_s)
            ),
            Self::TimeConstantShort { time_constant_s, sample_time_s } => write!(
                f,
                "T = {} s is too short for a sample time of {} s: only an upper bound, sample faster",
                number(*time_constant_s),
                number(*sample_time_s)
            ),
            Self::ResolutionLimited { resolution, levels } => write!(
                f,
                "resolution, not noise, limits the gain: the PV moves in steps of {} and the whole movement is {} of them; the intervals are too optimistic",
                number(*resolution),
                number(*levels)
            ),
            Self::ResidualsCorrelated { correlation } => write!(
                f,
                "what the model leaves over is not noise (neighbours correlate by {}): the true intervals are wider than those given",
                number(*correlation)
            ),
            Self::Segments { count } => {
                write!(f, "the stretch has gaps: fitted as {count} segments, each with its own start")
            }
            Self::StartsAtRest { mv_before } => write!(
                f,
                "the MV does not move after the first row: the PV was taken to be at rest with the MV at {} before it",
                number(*mv_before)
            ),
        }
    }
}

impl Explain for FitVerdict {
    fn key(&self) -> &'static str {
        match self {
            Self::Good { .. } => "verdict.good",
            Self::Poor { .. } => "verdict.poor",
            Self::GainUncertain { .. } => "verdict.gain_uncertain",
            Self::DeadTimeUnknown { .. } => "verdict.dead_time_unknown",
            Self::TimeConstantLong { .. } => "verdict.time_constant_long",
            Self::TimeConstantShort { .. } => "verdict.time_constant_short",
            Self::ResolutionLimited { .. } => "verdict.resolution_limited",
            Self::ResidualsCorrelated { .. } => "verdict.residuals_correlated",
            Self::Segments { .. } => "verdict.segments",
            Self::StartsAtRest { .. } => "verdict.starts_at_rest",
        }
    }

    fn args(&self) -> Vec<(&'static str, String)> {
        match *self {
            Self::Good { fit_percent, gain_percent, time_constant_percent } => vec![
                ("fit_percent", number(fit_percent)),
                ("gain_percent", number(gain_percent)),
                ("time_constant_percent", number(time_constant_percent)),
            ],
            Self::Poor { fit_percent } => vec![("fit_percent", number(fit_percent))],
            Self::GainUncertain { percent, times } => {
                vec![("percent", number(percent)), ("times", number(times))]
            }
            Self::DeadTimeUnknown { upper_s, times } => {
                vec![("upper_s", number(upper_s)), ("times", number(times))]
            }
            Self::TimeConstantLong { time_constant_s, span_s } => {
                vec![("time_constant_s", number(time_constant_s)), ("span_s", number(span_s))]
            }
            Self::TimeConstantShort { time_constant_s, sample_time_s } => {
                vec![("time_constant_s", number(time_constant_s)), ("sample_time_s", number(sample_time_s))]
            }
            Self::ResolutionLimited { resolution, levels } => {
                vec![("resolution", number(resolution)), ("levels", number(levels))]
            }
            Self::ResidualsCorrelated { correlation } => vec![("correlation", number(correlation))],
            Self::Segments { count } => vec![("count", count.to_string())],
            Self::StartsAtRest { mv_before } => vec![("mv_before", number(mv_before))],
        }
    }
}

impl FitVerdict {
    /// Whether it speaks against using the model.
    #[must_use]
    pub fn is_objection(&self) -> bool {
        !matches!(self, Self::Good { .. } | Self::Segments { .. } | Self::StartsAtRest { .. })
    }

    /// One value of every variant, for the test that compares sentences and translations.
    #[must_use]
    pub fn samples() -> Vec<Self> {
        vec![
            Self::Good { fit_percent: 97.4, gain_percent: 1.2, time_constant_percent: 2.5 },
            Self::Poor { fit_percent: 12.0 },
            Self::GainUncertain { percent: 40.0, times: 4.0 },
            Self::DeadTimeUnknown { upper_s: 3.5, times: 2.0 },
            Self::TimeConstantLong { time_constant_s: 900.0, span_s: 300.0 },
            Self::TimeConstantShort { time_constant_s: 0.01, sample_time_s: 0.2 },
            Self::ResolutionLimited { resolution: 0.35, levels: 4.5 },
            Self::ResidualsCorrelated { correlation: 0.82 },
            Self::Segments { count: 3 },
            Self::StartsAtRest { mv_before: 0.0 },
        ]
    }
}
