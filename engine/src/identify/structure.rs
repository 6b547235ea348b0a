//! Which kind of model is fitted.

use serde::{Deserialize, Serialize};

/// A structure that a stretch can be fitted with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Structure {
    /// K e^(−Ls)/(T s + 1).
    Fopdt,
    /// Kv e^(−Ls)/s.
    Ipdt,
    /// K e^(−Ls)/(τ² s² + 2ζτ s + 1), over- or underdamped.
    Sopdt,
    /// K (Tz s + 1) e^(−Ls)/(τ² s² + 2ζτ s + 1).
    SopdtZero,
}

impl Structure {
    /// All of them, simplest first.
    pub const ALL: [Self; 4] = [Self::Ipdt, Self::Fopdt, Self::Sopdt, Self::SopdtZero];

    /// All of them, each after those whose dynamics start its search.
    pub const CHOICE: [Self; 4] = [Self::Fopdt, Self::Ipdt, Self::Sopdt, Self::SopdtZero];

    /// As files and the command line name it.
    #[must_use]
    pub fn key(self) -> &'static str {
        match self {
            Self::Fopdt => "fopdt",
            Self::Ipdt => "ipdt",
            Self::Sopdt => "sopdt",
            Self::SopdtZero => "sopdt_zero",
        }
    }

    /// The structure of a name.
    #[must_use]
    pub fn from_key(key: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|s| s.key() == key)
    }
}
