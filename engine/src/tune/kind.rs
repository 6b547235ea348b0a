//! Which actions a controller has.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::control::PidGains;

/// Proportional, integral and derivative action in the combinations that rules are made for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ControllerKind {
    /// Proportional.
    P,
    /// Proportional and integral.
    Pi,
    /// Proportional and derivative.
    Pd,
    /// All three.
    Pid,
}

impl ControllerKind {
    /// All kinds, from the simplest.
    pub const ALL: [Self; 4] = [Self::P, Self::Pi, Self::Pd, Self::Pid];

    /// Name on the command line and in JSON: `p`, `pi`, `pd`, `pid`.
    #[must_use]
    pub const fn id(self) -> &'static str {
        match self {
            Self::P => "p",
            Self::Pi => "pi",
            Self::Pd => "pd",
            Self::Pid => "pid",
        }
    }

    /// The kind with this name, in either case.
    #[must_use]
    pub fn from_id(id: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.id().eq_ignore_ascii_case(id))
    }

    /// The actions a set of gains really has.
    #[must_use]
    pub fn of(gains: &PidGains) -> Self {
        match (gains.ti_s.is_finite(), gains.td_s > 0.0) {
            (false, false) => Self::P,
            (true, false) => Self::Pi,
            (false, true) => Self::Pd,
            (true, true) => Self::Pid,
        }
    }
}

impl fmt::Display for ControllerKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::P => "P",
            Self::Pi => "PI",
            Self::Pd => "PD",
            Self::Pid => "PID",
        })
    }
}
