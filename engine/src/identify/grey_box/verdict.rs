//! What a fit of a rig is worth, in plain words with its numbers.

use crate::explain::{Explain, number};

/// One finding about a fit; one without objections has [`GreyBoxVerdict::Good`] alone.
#[derive(Debug, Clone, PartialEq)]
pub enum GreyBoxVerdict {
    /// Nothing to object to.
    Good {
        /// Fit in percent, of all outputs together.
        fit_percent: f64,
    },
    /// The rig with its best parameters does not follow the record.
    Poor {
        /// Fit in percent, of all outputs together.
        fit_percent: f64,
    },
    /// The outputs do not depend on a parameter in this record.
    NoEffect {
        /// Parameter.
        name: String,
    },
    /// Parameters that make up for each other: only some combination of them shows.
    MakeUp {
        /// The parameters.
        names: String,
    },
    /// The interval is as wide as the bounds, or wider.
    Unknown {
        /// Parameter.
        name: String,
        /// Bounds.
        low: f64,
        /// Bounds.
        high: f64,
    },
    /// The best value lies on a bound.
    AtBound {
        /// Parameter.
        name: String,
        /// The bound.
        bound: f64,
    },
    /// Residuals are not white; the intervals allow for it.
    Correlated {
        /// Signal of the output.
        output: String,
        /// Rows that say as much as one independent row.
        rows: f64,
    },
    /// The other record is followed much worse than the fitted one.
    WorseElsewhere {
        /// Error of the fitted record.
        train: f64,
        /// Error of the other one.
        validate: f64,
    },
}

impl GreyBoxVerdict {
    /// Whether it says that the fit is of no use.
    #[must_use]
    pub fn is_refusal(&self) -> bool {
        /// Fit in percent below which the rig follows nothing of the record.
        const NOTHING_PERCENT: f64 = 20.0;
        matches!(self, Self::Poor { fit_percent } if fit_percent.is_nan() || *fit_percent < NOTHING_PERCENT)
    }
}

impl std::fmt::Display for GreyBoxVerdict {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let n = number;
        match self {
            Self::Good { fit_percent } => {
                write!(f, "good: in free run the rig explains the movement to {} %", n(*fit_percent))
            }
            Self::Poor { fit_percent } => write!(
                f,
                "the fit is poor ({} %): with no values within the bounds does the rig follow this record; free more parameters, or ask whether it is another rig",
                n(*fit_percent)
            ),
            Self::NoEffect { name } => write!(
                f,
                "the outputs do not depend on {name} in this record: it stays as it was; record what it acts on"
            ),
            Self::MakeUp { names } => write!(
                f,
                "{names} make up for each other: the record tells only what they do together; fix one of them at a known value"
            ),
            Self::Unknown { name, low, high } => write!(
                f,
                "{name} cannot be told: its interval is as wide as its bounds {}…{}; move the input more, or fix it",
                n(*low),
                n(*high)
            ),
            Self::AtBound { name, bound } => {
                write!(f, "{name} lies on its bound {}: widen the bounds if it may lie beyond", n(*bound))
            }
            Self::Correlated { output, rows } => write!(
                f,
                "what is left of {output} is not noise: {} rows say as much as one independent one, and the intervals allow for it",
                n(*rows)
            ),
            Self::WorseElsewhere { train, validate } => write!(
                f,
                "the other record is followed worse: an error of {} there, of {} where it was fitted",
                n(*validate),
                n(*train)
            ),
        }
    }
}

impl Explain for GreyBoxVerdict {
    fn key(&self) -> &'static str {
        match self {
            Self::Good { .. } => "grey_box_verdict.good",
            Self::Poor { .. } => "grey_box_verdict.poor",
            Self::NoEffect { .. } => "grey_box_verdict.no_effect",
            Self::MakeUp { .. } => "grey_box_verdict.make_up",
            Self::Unknown { .. } => "grey_box_verdict.unknown",
            Self::AtBound { .. } => "grey_box_verdict.at_bound",
            Self::Correlated { .. } => "grey_box_verdict.correlated",
            Self::WorseElsewhere { .. } => "grey_box_verdict.worse_elsewhere",
        }
    }

    fn args(&self) -> Vec<(&'static str, String)> {
        let n = |x: &f64| number(*x);
        match self {
            Self::Good { fit_percent } | Self::Poor { fit_percent } => vec![("fit_percent", n(fit_percent))],
            Self::NoEffect { name } => vec![("name", name.clone())],
            Self::MakeUp { names } => vec![("names", names.clone())],
            Self::Unknown { name, low, high } => {
                vec![("name", name.clone()), ("low", n(low)), ("high", n(high))]
            }
            Self::AtBound { name, bound } => vec![("name", name.clone()), ("bound", n(bound))],
            Self::Correlated { output, rows } => vec![("output", output.clone()), ("rows", n(rows))],
            Self::WorseElsewhere { train, validate } => vec![("train", n(train)), ("validate", n(validate))],
        }
    }
}

impl GreyBoxVerdict {
    /// One value of every variant, for the test that compares sentences and translations.
    #[must_use]
    pub fn samples() -> Vec<Self> {
        let name = || "FV01.k90".to_owned();
        vec![
            Self::Good { fit_percent: 97.3 },
            Self::Poor { fit_percent: 12.0 },
            Self::NoEffect { name: name() },
            Self::MakeUp { names: "BA01.scale, TQ1.area_cm2".to_owned() },
            Self::Unknown { name: name(), low: 1.0, high: 20.0 },
            Self::AtBound { name: name(), bound: 20.0 },
            Self::Correlated { output: "h3".to_owned(), rows: 7.5 },
            Self::WorseElsewhere { train: 0.05, validate: 0.4 },
        ]
    }
}
