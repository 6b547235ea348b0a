//! Rules from the ultimate gain Ku and period Pu.

use super::Settings;
use crate::tune::ControllerKind::{self, P, Pd, Pi, Pid};
use crate::tune::Ultimate;

/// Ziegler and Nichols 1942, from the stability limit.
pub(in crate::tune) fn zn_closed_loop(at: Ultimate, kind: ControllerKind) -> Option<Settings> {
    let Ultimate { ku, pu_s } = at;
    match kind {
        P => Settings::p(0.5 * ku),
        Pi => Settings::pi(0.45 * ku, pu_s / 1.2),
        Pid => Settings::pid(0.6 * ku, pu_s / 2.0, pu_s / 8.0),
        Pd => None,
    }
}

/// Åström and Hägglund 1995, from a relay test.
pub(in crate::tune) fn relay_astrom(at: Ultimate, kind: ControllerKind) -> Option<Settings> {
    let Ultimate { ku, pu_s } = at;
    match kind {
        Pid => Settings::pid(ku / 1.7, pu_s / 2.0, pu_s / 8.0),
        P | Pi | Pd => None,
    }
}

/// Tyreus and Luyben 1992; PID by Luyben 1996.
pub(in crate::tune) fn tyreus_luyben(at: Ultimate, kind: ControllerKind) -> Option<Settings> {
    let Ultimate { ku, pu_s } = at;
    match kind {
        Pi => Settings::pi(ku / 3.2, 2.2 * pu_s),
        Pid => Settings::pid(ku / 2.2, 2.2 * pu_s, pu_s / 6.3),
        P | Pd => None,
    }
}
