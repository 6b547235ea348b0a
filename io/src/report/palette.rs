//! Colours of a report: dark enough for white paper, apart from each other also for the colour-blind (Okabe and Ito).

/// What a curve is drawn in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ink {
    /// Measured data, and what is in use now.
    Data,
    /// Present tuning.
    Present,
    /// First choice.
    First,
    /// Second.
    Second,
    /// Third.
    Third,
    /// Fourth.
    Fourth,
    /// Limits and marks.
    Limit,
}

impl Ink {
    /// Colours of candidates in their order.
    #[must_use]
    pub fn of_candidate(place: usize) -> Self {
        [Self::First, Self::Second, Self::Third, Self::Fourth][place % 4]
    }

    pub(super) fn colour(self) -> &'static str {
        match self {
            Self::Data => "#8a939c",
            Self::Present => "#2f363d",
            Self::First => "#0072b2",
            Self::Second => "#d55e00",
            Self::Third => "#009e73",
            Self::Fourth => "#b5589a",
            Self::Limit => "#b42318",
        }
    }

    pub(super) fn width(self) -> f64 {
        match self {
            Self::Data | Self::Limit => 1.1,
            Self::First => 2.2,
            _ => 1.6,
        }
    }

    pub(super) fn dash(self) -> Option<&'static str> {
        match self {
            Self::Present => Some("6 3"),
            Self::Limit => Some("4 3"),
            Self::Second | Self::Third | Self::Fourth | Self::Data | Self::First => None,
        }
    }
}
