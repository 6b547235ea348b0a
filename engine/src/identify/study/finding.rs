//! What a look at a loop's log shows, in plain words with its numbers.

use crate::explain::{Explain, number};

/// One finding about a record, apart from the fit.
#[derive(Debug, Clone, PartialEq)]
pub enum RecordFinding {
    /// The PV was read less often than the log was written.
    Oversampled {
        /// Rows a value is held for.
        rows: usize,
    },
    /// The PV was filled in by straight lines between the values read.
    Interpolated {
        /// Values between which the lines run.
        values: usize,
        /// All rows.
        rows: usize,
    },
    /// The PV stood still while it should have shown its noise.
    Frozen {
        /// Rows left out.
        rows: usize,
        /// Start of the first stretch, in seconds of the record.
        from_s: f64,
        /// End of the first stretch, in seconds of the record.
        to_s: f64,
        /// How many stretches.
        times: usize,
    },
    /// Spikes.
    Outliers {
        /// Rows left out.
        count: usize,
        /// The first of them, as the user counts.
        row: usize,
        /// Its PV.
        value: f64,
    },
    /// Single rows of the MV far outside the others.
    MvSlips {
        /// Rows mended.
        count: usize,
        /// The first of them, as the user counts.
        row: usize,
        /// Its MV.
        value: f64,
    },
    /// The PV moves in steps.
    Quantised {
        /// Step in PV units.
        step: f64,
    },
    /// The MV stays at a limit.
    MvAtLimit {
        /// Limit in MV units.
        limit: f64,
        /// Rows at it.
        rows: usize,
    },
    /// The PV does not follow the MV beyond a limit: it was logged before its limits.
    MvBeyondLimits {
        /// Limits the PV speaks for, in MV units.
        limits: [f64; 2],
        /// Rows beyond them.
        rows: usize,
    },
    /// Limits of the MV that the user gave.
    MvLimitsGiven {
        /// Range of the MV within them, in MV units.
        limits: [f64; 2],
        /// Rows beyond them.
        rows: usize,
    },
    /// The gain is another beyond some level of the MV: the process is not linear.
    GainChanges {
        /// Levels at which it changes, in MV units.
        limits: [f64; 2],
        /// The gain beyond them, in percent of that between.
        percent: f64,
    },
    /// Other limits of the MV would explain the PV as well.
    MvLimitsUnknown {
        /// Limits taken, in MV units.
        limits: [f64; 2],
    },
    /// The PV follows the MV as behind a valve that sticks or has play.
    ValveHolds {
        /// What the valve must be asked for to move, in MV units.
        band: f64,
    },
    /// The PV answers a move of the MV in its own row: the log writes the MV ahead of the PV.
    MvEarlier,
    /// The mode changes within the stretch.
    ModeChanges {
        /// How often.
        count: usize,
        /// Time of the first change, in seconds of the record.
        at_s: f64,
        /// Mode in which the controller was read, as the log writes it.
        mode: String,
    },
    /// The loop swings.
    Oscillates {
        /// Period in seconds.
        period_s: f64,
        /// Index of its shape, 0 a sine, 1 a triangle.
        index: f64,
    },
    /// The loop swings as behind a sticking valve.
    Stiction {
        /// Index of its shape, 0 a sine, 1 a triangle.
        index: f64,
        /// Dead band of the valve, in MV units.
        band: f64,
        /// Period in seconds.
        period_s: f64,
    },
    /// The controller in use drives the PV the wrong way.
    WrongSign {
        /// Kc of the controller in the log.
        kc: f64,
        /// Gain of the model.
        gain: f64,
    },
    /// The controller in use is not stable with the model.
    UnstableTuning {
        /// Kc of the controller in the log.
        kc: f64,
    },
}

impl std::fmt::Display for RecordFinding {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let n = number;
        match self {
            Self::Oversampled { rows } => write!(
                f,
                "the PV changes only every {rows} rows: the log is written faster than the PV is read, and each value counts once"
            ),
            Self::Interpolated { values, rows } => write!(
                f,
                "the PV runs in straight lines between {values} of its {rows} rows: what lies between was filled in, not measured, and only those {values} count"
            ),
            Self::Frozen { rows, from_s, to_s, times } => write!(
                f,
                "the PV stands still without its noise, {times} times, first from {} to {} s: {rows} rows were left out",
                n(*from_s),
                n(*to_s)
            ),
            Self::Outliers { count, row, value } => write!(
                f,
                "spikes left out of the PV: {count} rows, the first is row {row} with {}",
                n(*value)
            ),
            Self::MvSlips { count, row, value } => write!(
                f,
                "slips of the MV, taken as the row before: {count} rows, the first is row {row} with {}",
                n(*value)
            ),
            Self::Quantised { step } => write!(f, "the PV moves in steps of {}", n(*step)),
            Self::MvAtLimit { limit, rows } => write!(
                f,
                "the MV is at its limit {} for {rows} rows: there the controller does not act",
                n(*limit)
            ),
            Self::MvBeyondLimits { .. }
            | Self::MvLimitsGiven { .. }
            | Self::GainChanges { .. }
            | Self::MvLimitsUnknown { .. } => self.write_limits(f),
            Self::ValveHolds { band } => write!(
                f,
                "the PV follows the MV as behind a valve that moves only once it was asked for about {}: it sticks or has play, and the model holds for larger moves only",
                n(*band)
            ),
            Self::MvEarlier => write!(
                f,
                "the PV answers a move of the MV in its own row: the log writes the MV ahead of the PV, and each MV was taken one row earlier"
            ),
            Self::ModeChanges { count, at_s, mode } => write!(
                f,
                "the mode changes {count} times, first at {} s; the controller was read in mode {mode}",
                n(*at_s)
            ),
            Self::Oscillates { period_s, index } => write!(
                f,
                "the loop swings with a period of {} s; its shape is no sign of a sticking valve (index {}, stiction from 0.6)",
                n(*period_s),
                n(*index)
            ),
            Self::Stiction { index, band, period_s } => write!(
                f,
                "the valve seems to stick: the loop swings with a period of {} s in triangles (index {}, stiction from 0.6), and the valve needs a move of about {} to follow; no tuning mends that",
                n(*period_s),
                n(*index),
                n(*band)
            ),
            Self::WrongSign { kc, gain } => write!(
                f,
                "the controller in the log acts the wrong way: Kc = {} with a process gain of {} drives the PV off its setpoint",
                n(*kc),
                n(*gain)
            ),
            Self::UnstableTuning { kc } => {
                write!(f, "the tuning in the log (Kc = {}) is not stable with this model", n(*kc))
            }
        }
    }
}

impl Explain for RecordFinding {
    fn key(&self) -> &'static str {
        match self {
            Self::Oversampled { .. } => "record.oversampled",
            Self::Interpolated { .. } => "record.interpolated",
            Self::Frozen { .. } => "record.frozen",
            Self::Outliers { .. } => "record.outliers",
            Self::MvSlips { .. } => "record.mv_slips",
            Self::Quantised { .. } => "record.quantised",
            Self::MvAtLimit { .. } => "record.mv_at_limit",
            Self::MvBeyondLimits { .. } => "record.mv_beyond_limits",
            Self::MvLimitsGiven { .. } => "record.mv_limits_given",
            Self::GainChanges { .. } => "record.gain_changes",
            Self::MvLimitsUnknown { .. } => "record.mv_limits_unknown",
            Self::ValveHolds { .. } => "record.valve_holds",
            Self::MvEarlier => "record.mv_earlier",
            Self::ModeChanges { .. } => "record.mode_changes",
            Self::Oscillates { .. } => "record.oscillates",
            Self::Stiction { .. } => "record.stiction",
            Self::WrongSign { .. } => "record.wrong_sign",
            Self::UnstableTuning { .. } => "record.unstable_tuning",
        }
    }

    fn args(&self) -> Vec<(&'static str, String)> {
        let n = |name: &'static str, value: &f64| (name, number(*value));
        let whole = |name: &'static str, value: &usize| (name, value.to_string());
        match self {
            Self::Oversampled { rows } => vec![whole("rows", rows)],
            Self::Interpolated { values, rows } => vec![whole("values", values), whole("rows", rows)],
            Self::Frozen { rows, from_s, to_s, times } => {
                vec![whole("rows", rows), n("from_s", from_s), n("to_s", to_s), whole("times", times)]
            }
            Self::Outliers { count, row, value } | Self::MvSlips { count, row, value } => {
                vec![whole("count", count), whole("row", row), n("value", value)]
            }
            Self::Quantised { step } => vec![n("step", step)],
            Self::MvAtLimit { limit, rows } => vec![n("limit", limit), whole("rows", rows)],
            Self::MvBeyondLimits { limits, rows } | Self::MvLimitsGiven { limits, rows } => {
                vec![n("low", &limits[0]), n("high", &limits[1]), whole("rows", rows)]
            }
            Self::GainChanges { limits, percent } => {
                vec![n("low", &limits[0]), n("high", &limits[1]), n("percent", percent)]
            }
            Self::MvLimitsUnknown { limits } => vec![n("low", &limits[0]), n("high", &limits[1])],
            Self::ValveHolds { band } => vec![n("band", band)],
            Self::MvEarlier => vec![],
            Self::ModeChanges { count, at_s, mode } => {
                vec![whole("count", count), n("at_s", at_s), ("mode", mode.clone())]
            }
            Self::Oscillates { period_s, index } => vec![n("period_s", period_s), n("index", index)],
            Self::Stiction { index, band, period_s } => {
                vec![n("index", index), n("band", band), n("period_s", period_s)]
            }
            Self::WrongSign { kc, gain } => vec![n("kc", kc), n("gain", gain)],
            Self::UnstableTuning { kc } => vec![n("kc", kc)],
        }
    }
}

impl RecordFinding {
    /// What is said of limits of the MV; nothing for the others.
    fn write_limits(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let n = number;
        match self {
            Self::MvBeyondLimits { limits, rows } => write!(
                f,
                "the PV follows the MV only between {} and {}, as where the MV is logged ahead of its limits: {rows} rows lie beyond and were taken at the limit",
                n(limits[0]),
                n(limits[1])
            ),
            Self::MvLimitsGiven { limits, rows } => write!(
                f,
                "{rows} rows of the MV lie beyond the limits given and were taken at them: it is between {} and {}",
                n(limits[0]),
                n(limits[1])
            ),
            Self::GainChanges { limits, percent } => write!(
                f,
                "the gain changes with the MV: below {} and above {} it is about {} % of that between; one linear model holds for neither, fit a stretch on one side",
                n(limits[0]),
                n(limits[1]),
                n(*percent)
            ),
            Self::MvLimitsUnknown { limits } => write!(
                f,
                "the limits of the MV ({} and {}) cannot be told from this stretch, and T and L depend on them: give them with --mv-min and --mv-max",
                n(limits[0]),
                n(limits[1])
            ),
            _ => Ok(()),
        }
    }

    /// Whether an engineer should act on it.
    #[must_use]
    pub fn is_warning(&self) -> bool {
        matches!(
            self,
            Self::Stiction { .. }
                | Self::WrongSign { .. }
                | Self::UnstableTuning { .. }
                | Self::MvBeyondLimits { .. }
                | Self::GainChanges { .. }
                | Self::MvLimitsUnknown { .. }
                | Self::ValveHolds { .. }
        )
    }

    /// One value of every variant, for the test that compares sentences and translations.
    #[must_use]
    pub fn samples() -> Vec<Self> {
        vec![
            Self::Oversampled { rows: 4 },
            Self::Interpolated { values: 121, rows: 1201 },
            Self::Frozen { rows: 60, from_s: 120.0, to_s: 180.0, times: 2 },
            Self::Outliers { count: 3, row: 17, value: -999.0 },
            Self::MvSlips { count: 1, row: 40, value: 500.0 },
            Self::Quantised { step: 0.35 },
            Self::MvAtLimit { limit: 100.0, rows: 42 },
            Self::MvBeyondLimits { limits: [0.0, 60.0], rows: 250 },
            Self::MvLimitsGiven { limits: [12.5, 60.0], rows: 250 },
            Self::GainChanges { limits: [20.0, 60.0], percent: 31.0 },
            Self::MvLimitsUnknown { limits: [35.0, 49.0] },
            Self::ValveHolds { band: 1.4 },
            Self::MvEarlier,
            Self::ModeChanges { count: 5, at_s: 320.0, mode: "AUTO".to_owned() },
            Self::Oscillates { period_s: 210.0, index: 0.35 },
            Self::Stiction { index: 0.82, band: 1.4, period_s: 330.0 },
            Self::WrongSign { kc: -2.5, gain: 4.1 },
            Self::UnstableTuning { kc: 30.0 },
        ]
    }
}
