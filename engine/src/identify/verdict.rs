//! What a fit is worth, in plain words with its numbers.

use crate::explain::{Explain, number};

/// One finding about a fit; a fit without objections has [`FitVerdict::Good`] first.
#[derive(Debug, Clone, PartialEq)]
pub enum FitVerdict {
    /// Nothing to object to.
    Good {
        /// Fit in percent.
        fit_percent: f64,
        /// Gain, `K` or `Kv`.
        gain: &'static str,
        /// Half the 95 % interval of the gain, in percent of it.
        gain_percent: f64,
    },
    /// Feedback alone moves the MV: the stretch cannot tell the process from the controller.
    NoExcitation {
        /// Name of the MV column.
        mv_name: String,
        /// Part of the MV's moves that follows from the PV, in percent.
        explained_percent: f64,
    },
    /// Disturbances move the PV more than the few moves of the setpoint do.
    Disturbed {
        /// Fit in percent.
        fit_percent: f64,
        /// Part of the MV's moves that follows from the PV, in percent.
        explained_percent: f64,
    },
    /// A measured disturbance that does not move the PV beyond doubt.
    DisturbanceUnknown {
        /// Name of its column.
        name: String,
    },
    /// The model explains little of the PV's movement.
    Poor {
        /// Fit in percent.
        fit_percent: f64,
    },
    /// The model leaves nothing but noise, which hides most of the PV's movement.
    Noisy {
        /// Fit in percent.
        fit_percent: f64,
    },
    /// The move was too small for the noise.
    GainUncertain {
        /// Half the 95 % interval of the gain, in percent of it.
        percent: f64,
        /// Move of the MV that would bring it to ±10 %, in MV units.
        mv_move: f64,
        /// Largest move there was, in MV units.
        mv_moved: f64,
    },
    /// The PV does not answer the MV beyond doubt: not even a sign is told.
    GainUnknown,
    /// A time constant, damping or zero that the noise hides.
    ParameterUncertain {
        /// `T`, `T2`, `zeta` or `Tz`.
        name: &'static str,
        /// Half the 95 % interval, in percent of the value.
        percent: f64,
        /// Move of the MV that would bring it to ±20 %, in MV units.
        mv_move: f64,
    },
    /// Nothing is known of a parameter.
    ParameterUnknown {
        /// `T`, `T2`, `zeta`, `Tz` or `L`.
        name: &'static str,
    },
    /// The model rings, and leaves more than noise: a disturbance that swings looks the same.
    Rings {
        /// Period in seconds.
        period_s: f64,
        /// ζ.
        zeta: f64,
    },
    /// The interval of L reaches 0.
    DeadTimeUnknown {
        /// Upper end of the interval, in seconds.
        upper_s: f64,
        /// Move of the MV that would bring its lower end off 0, in MV units.
        mv_move: f64,
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
    /// Residuals are not white; the intervals allow for it.
    ResidualsCorrelated {
        /// Correlation of neighbouring residuals.
        correlation: f64,
        /// Rows that say as much as one independent row.
        rows: f64,
    },
    /// Residuals still follow the MV: there is more in the process than in the model.
    ResidualsFollowInput {
        /// Largest correlation with an earlier move.
        correlation: f64,
        /// Rows after the move.
        lag: usize,
    },
    /// A drift was fitted along.
    Drift {
        /// In PV units per hour.
        per_hour: f64,
    },
    /// Something unmeasured moved the PV once, and was fitted along.
    Load {
        /// When, in seconds of the record.
        at_s: f64,
        /// What it adds to the PV, in PV units.
        change: f64,
    },
    /// Something unmeasured changed the rate of an integrating PV once, and was fitted along.
    LoadRate {
        /// When, in seconds of the record.
        at_s: f64,
        /// What it adds to the rate, in PV units per hour.
        per_hour: f64,
    },
    /// The gain changes with the level of the MV.
    GainByLevel {
        /// Lowest and highest MV, in MV units.
        levels: [f64; 2],
        /// Gain there.
        gains: [f64; 2],
    },
    /// The PV runs away.
    Diverges {
        /// How much farther the PV moves in the last eighth of the stretch than in the fourth.
        times: f64,
    },
    /// What came unmeasured came with a move of the MV.
    LoadWithMv {
        /// When, in seconds of the record.
        at_s: f64,
    },
    /// The stretch has gaps.
    Segments {
        /// Pieces fitted with a free state each.
        count: usize,
    },
    /// The start was taken to be at rest: the PV stands still ahead of the first move, or that move was the first row.
    StartsAtRest {
        /// MV before the first row, in MV units.
        mv_before: f64,
    },
}

impl std::fmt::Display for FitVerdict {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let n = number;
        match self {
            Self::Good { fit_percent, gain, gain_percent } => write!(
                f,
                "good: the model explains the movement to {} %; {gain} is known to ±{} %",
                n(*fit_percent),
                n(*gain_percent)
            ),
            Self::NoExcitation { mv_name, explained_percent } => write!(
                f,
                "nothing but feedback moves {mv_name} here ({} % of its moves follow from the PV): such a stretch shows the controller, not the process, and cannot tell a gain or a dead time; move the setpoint, or the output in manual, by a step that stands out of the noise",
                n(*explained_percent)
            ),
            Self::Disturbed { fit_percent, explained_percent } => write!(
                f,
                "disturbances rule this stretch: the model explains {} % of the PV, and {} % of the MV's moves are feedback; what a few small moves of the setpoint show is no model, move it further and more often",
                n(*fit_percent),
                n(*explained_percent)
            ),
            Self::DisturbanceUnknown { name } => {
                write!(f, "{name} does not move the PV beyond doubt here: leave it out, or record it moving")
            }
            Self::Poor { fit_percent } => write!(
                f,
                "the fit is poor ({} %): the MV explains little of this PV's movement, or the structure is the wrong one",
                n(*fit_percent)
            ),
            Self::Noisy { fit_percent } => write!(
                f,
                "noise hides most of the PV's movement: the fit is {} %, and what the model leaves is noise; a larger move of the MV would stand out of it",
                n(*fit_percent)
            ),
            Self::GainUnknown => write!(
                f,
                "the PV does not answer the MV beyond doubt here: not even the sign of the gain can be told; move the MV further, or choose a stretch in which it moves"
            ),
            Self::Rings { period_s, zeta } => write!(
                f,
                "the model rings with a period of {} s (damping {}): a disturbance that swings with it would look the same; compare with a stretch in which the MV stands still",
                n(*period_s),
                n(*zeta)
            ),
            Self::GainUncertain { .. }
            | Self::ParameterUncertain { .. }
            | Self::ParameterUnknown { .. }
            | Self::DeadTimeUnknown { .. }
            | Self::TimeConstantLong { .. }
            | Self::TimeConstantShort { .. } => self.write_parameter(f),
            Self::ResolutionLimited { resolution, levels } => write!(
                f,
                "resolution, not noise, limits the gain: the PV moves in steps of {} and the whole movement is {} of them; the intervals are too optimistic",
                n(*resolution),
                n(*levels)
            ),
            Self::ResidualsCorrelated { correlation, rows } => write!(
                f,
                "what the model leaves over is not white (neighbours correlate by {}): the intervals count {} rows as one",
                n(*correlation),
                n(*rows)
            ),
            Self::ResidualsFollowInput { correlation, lag } => write!(
                f,
                "what the model leaves over still follows the MV (correlation {} after {lag} rows): the process has more in it than this structure, and the intervals are those of a structure that holds: too narrow",
                n(*correlation)
            ),
            Self::Drift { .. }
            | Self::Load { .. }
            | Self::LoadRate { .. }
            | Self::LoadWithMv { .. }
            | Self::GainByLevel { .. }
            | Self::Diverges { .. } => self.write_process(f),
            Self::Segments { count } => {
                write!(f, "the stretch has gaps: fitted as {count} segments, each with its own start")
            }
            Self::StartsAtRest { mv_before } => write!(
                f,
                "the PV was taken to be at rest ahead of the first move, with the MV at {}",
                n(*mv_before)
            ),
        }
    }
}

impl Explain for FitVerdict {
    fn key(&self) -> &'static str {
        match self {
            Self::Good { .. } => "verdict.good",
            Self::NoExcitation { .. } => "verdict.no_excitation",
            Self::Disturbed { .. } => "verdict.disturbed",
            Self::DisturbanceUnknown { .. } => "verdict.disturbance_unknown",
            Self::Poor { .. } => "verdict.poor",
            Self::Noisy { .. } => "verdict.noisy",
            Self::GainUncertain { .. } => "verdict.gain_uncertain",
            Self::GainUnknown => "verdict.gain_unknown",
            Self::ParameterUncertain { .. } => "verdict.parameter_uncertain",
            Self::ParameterUnknown { .. } => "verdict.parameter_unknown",
            Self::Rings { .. } => "verdict.rings",
            Self::DeadTimeUnknown { .. } => "verdict.dead_time_unknown",
            Self::TimeConstantLong { .. } => "verdict.time_constant_long",
            Self::TimeConstantShort { .. } => "verdict.time_constant_short",
            Self::ResolutionLimited { .. } => "verdict.resolution_limited",
            Self::ResidualsCorrelated { .. } => "verdict.residuals_correlated",
            Self::ResidualsFollowInput { .. } => "verdict.residuals_follow_input",
            Self::Drift { .. } => "verdict.drift",
            Self::Load { .. } => "verdict.load",
            Self::LoadRate { .. } => "verdict.load_rate",
            Self::GainByLevel { .. } => "verdict.gain_by_level",
            Self::Diverges { .. } => "verdict.diverges",
            Self::LoadWithMv { .. } => "verdict.load_with_mv",
            Self::Segments { .. } => "verdict.segments",
            Self::StartsAtRest { .. } => "verdict.starts_at_rest",
        }
    }

    fn args(&self) -> Vec<(&'static str, String)> {
        let n = |name: &'static str, value: &f64| (name, number(*value));
        match self {
            Self::Good { fit_percent, gain, gain_percent } => vec![
                n("fit_percent", fit_percent),
                ("gain", (*gain).to_owned()),
                n("gain_percent", gain_percent),
            ],
            Self::NoExcitation { mv_name, explained_percent } => {
                vec![("mv_name", mv_name.clone()), n("explained_percent", explained_percent)]
            }
            Self::Disturbed { fit_percent, explained_percent } => {
                vec![n("fit_percent", fit_percent), n("explained_percent", explained_percent)]
            }
            Self::DisturbanceUnknown { name } => vec![("name", name.clone())],
            Self::Poor { fit_percent } | Self::Noisy { fit_percent } => vec![n("fit_percent", fit_percent)],
            Self::GainUncertain { percent, mv_move, mv_moved } => {
                vec![n("percent", percent), n("mv_move", mv_move), n("mv_moved", mv_moved)]
            }
            Self::GainUnknown => vec![],
            Self::ParameterUncertain { name, percent, mv_move } => {
                vec![("name", (*name).to_owned()), n("percent", percent), n("mv_move", mv_move)]
            }
            Self::ParameterUnknown { name } => vec![("name", (*name).to_owned())],
            Self::Rings { period_s, zeta } => vec![n("period_s", period_s), n("zeta", zeta)],
            Self::DeadTimeUnknown { upper_s, mv_move } => {
                vec![n("upper_s", upper_s), n("mv_move", mv_move)]
            }
            Self::TimeConstantLong { time_constant_s, span_s } => {
                vec![n("time_constant_s", time_constant_s), n("span_s", span_s)]
            }
            Self::TimeConstantShort { time_constant_s, sample_time_s } => {
                vec![n("time_constant_s", time_constant_s), n("sample_time_s", sample_time_s)]
            }
            Self::ResolutionLimited { resolution, levels } => {
                vec![n("resolution", resolution), n("levels", levels)]
            }
            Self::ResidualsCorrelated { correlation, rows } => {
                vec![n("correlation", correlation), n("rows", rows)]
            }
            Self::ResidualsFollowInput { correlation, lag } => {
                vec![n("correlation", correlation), ("lag", lag.to_string())]
            }
            Self::Drift { per_hour } => vec![n("per_hour", per_hour)],
            Self::Load { at_s, change } => vec![n("at_s", at_s), n("change", change)],
            Self::LoadRate { at_s, per_hour } => vec![n("at_s", at_s), n("per_hour", per_hour)],
            Self::GainByLevel { levels, gains } => vec![
                n("low", &levels[0]),
                n("high", &levels[1]),
                n("gain_low", &gains[0]),
                n("gain_high", &gains[1]),
            ],
            Self::Diverges { times } => vec![n("times", times)],
            Self::LoadWithMv { at_s } => vec![n("at_s", at_s)],
            Self::Segments { count } => vec![("count", count.to_string())],
            Self::StartsAtRest { mv_before } => vec![n("mv_before", mv_before)],
        }
    }
}

impl FitVerdict {
    /// What is said of a single parameter; nothing for the others.
    fn write_parameter(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let n = number;
        match self {
            Self::GainUncertain { percent, mv_move, mv_moved } => write!(
                f,
                "the move was too small for this noise: the gain is known only to ±{} %; a move of the MV by {} instead of {} would give ±10 %",
                n(*percent),
                n(*mv_move),
                n(*mv_moved)
            ),
            Self::ParameterUncertain { name, percent, mv_move } => write!(
                f,
                "{name} is known only to ±{} %: a move of the MV by {} would give ±20 %",
                n(*percent),
                n(*mv_move)
            ),
            Self::ParameterUnknown { name } => {
                write!(f, "{name} is unknown: this stretch does not tell it")
            }
            Self::DeadTimeUnknown { upper_s, mv_move } => write!(
                f,
                "the dead time is not identifiable here: it lies between 0 and {} s; a move of the MV by {} would tell it from 0",
                n(*upper_s),
                n(*mv_move)
            ),
            Self::TimeConstantLong { time_constant_s, span_s } => write!(
                f,
                "T = {} s is longer than the stretch ({} s): only the ratio K/T is known, record longer",
                n(*time_constant_s),
                n(*span_s)
            ),
            Self::TimeConstantShort { time_constant_s, sample_time_s } => write!(
                f,
                "T = {} s is too short for a sample time of {} s: only an upper bound, sample faster",
                n(*time_constant_s),
                n(*sample_time_s)
            ),
            _ => Ok(()),
        }
    }

    /// What is said of a process that is more than a linear answer to its MV; nothing for the others.
    fn write_process(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let n = number;
        match self {
            Self::Drift { per_hour } => {
                write!(f, "a drift of {} an hour that follows no input was taken out", n(*per_hour))
            }
            Self::Load { at_s, change } => write!(
                f,
                "the process was moved by something unmeasured at t = {} s: it adds {} to the PV and was fitted along",
                n(*at_s),
                n(*change)
            ),
            Self::LoadRate { at_s, per_hour } => write!(
                f,
                "the process was moved by something unmeasured at t = {} s: from there on the PV moves by {} more an hour, which was fitted along",
                n(*at_s),
                n(*per_hour)
            ),
            Self::GainByLevel { levels, gains } => write!(
                f,
                "the gain changes with the MV: about {} at {}, about {} at {}; one linear model holds between them only on average, fit a stretch near the level at which the loop runs",
                n(gains[0]),
                n(levels[0]),
                n(gains[1]),
                n(levels[1])
            ),
            Self::Diverges { times } => write!(
                f,
                "the PV runs away: in the last eighth of the stretch it moves {} times as far as in the fourth, so that the last rows outweigh all others and the intervals are those of a model that holds however far it goes; choose a stretch that ends earlier",
                n(*times)
            ),
            Self::LoadWithMv { at_s } => write!(
                f,
                "something unmeasured moved the process at t = {} s together with the MV: which of the two did what, this stretch hardly tells; move the MV once more on its own",
                n(*at_s)
            ),
            _ => Ok(()),
        }
    }

    /// Whether it speaks against using the model.
    #[must_use]
    pub fn is_objection(&self) -> bool {
        !matches!(
            self,
            Self::Good { .. }
                | Self::Segments { .. }
                | Self::StartsAtRest { .. }
                | Self::Drift { .. }
                | Self::Load { .. }
                | Self::LoadRate { .. }
        )
    }

    /// Whether it says that the stretch cannot tell a model at all.
    #[must_use]
    pub fn is_refusal(&self) -> bool {
        /// Fit in percent below which nothing of the PV is explained.
        const NOTHING_PERCENT: f64 = 20.0;
        match self {
            Self::NoExcitation { .. } | Self::Disturbed { .. } | Self::GainUnknown => true,
            Self::Poor { fit_percent } => *fit_percent < NOTHING_PERCENT,
            // One or two steps of the sensor have no shape.
            Self::ResolutionLimited { levels, .. } => *levels < 3.0,
            _ => false,
        }
    }

    /// One value of every variant, for the test that compares sentences and translations.
    #[must_use]
    pub fn samples() -> Vec<Self> {
        vec![
            Self::Good { fit_percent: 97.4, gain: "K", gain_percent: 1.2 },
            Self::NoExcitation { mv_name: "FIC101.MV".to_owned(), explained_percent: 98.5 },
            Self::Disturbed { fit_percent: 41.0, explained_percent: 92.0 },
            Self::DisturbanceUnknown { name: "feed".to_owned() },
            Self::Poor { fit_percent: 12.0 },
            Self::Noisy { fit_percent: 31.0 },
            Self::GainUncertain { percent: 40.0, mv_move: 4.0, mv_moved: 1.0 },
            Self::GainUnknown,
            Self::ParameterUncertain { name: "T2", percent: 80.0, mv_move: 4.0 },
            Self::ParameterUnknown { name: "T2" },
            Self::Rings { period_s: 75.0, zeta: 0.12 },
            Self::DeadTimeUnknown { upper_s: 3.5, mv_move: 2.0 },
            Self::TimeConstantLong { time_constant_s: 900.0, span_s: 300.0 },
            Self::TimeConstantShort { time_constant_s: 0.01, sample_time_s: 0.2 },
            Self::ResolutionLimited { resolution: 0.35, levels: 4.5 },
            Self::ResidualsCorrelated { correlation: 0.82, rows: 10.0 },
            Self::ResidualsFollowInput { correlation: 0.31, lag: 4 },
            Self::Drift { per_hour: -0.4 },
            Self::Load { at_s: 420.0, change: -3.2 },
            Self::LoadRate { at_s: 420.0, per_hour: 1.8 },
            Self::LoadWithMv { at_s: 420.0 },
            Self::GainByLevel { levels: [10.0, 20.0], gains: [2.0, 4.0] },
            Self::Diverges { times: 340.0 },
            Self::Segments { count: 3 },
            Self::StartsAtRest { mv_before: 0.0 },
        ]
    }
}
