//! Rules for K e^(−θs)/((τ1 s + 1)(τ2 s + 1)), τ1 ≥ τ2.

use super::Settings;
use crate::model::Sopdt;
use crate::tune::ControllerKind::{self, P, Pd, Pi, Pid};

/// Direct synthesis and lambda tuning: both lags cancelled, closed loop e^(−θs)/(τc s + 1).
pub(in crate::tune) fn direct_synthesis(m: &Sopdt, kind: ControllerKind, tau_c: f64) -> Option<Settings> {
    let (t1, t2) = (m.time_constant_1_s, m.time_constant_2_s);
    match kind {
        Pid => Settings::pid((t1 + t2) / (m.gain * (tau_c + m.dead_time_s)), t1 + t2, t1 * t2 / (t1 + t2)),
        P | Pi | Pd => None,
    }
}

/// SIMC PID, Skogestad 2003, series form.
pub(in crate::tune) fn simc(m: &Sopdt, kind: ControllerKind, tau_c: f64) -> Option<Settings> {
    let closed = tau_c + m.dead_time_s;
    let t1 = m.time_constant_1_s;
    match kind {
        Pid => Settings::from_series(t1 / (m.gain * closed), t1.min(4.0 * closed), m.time_constant_2_s),
        P | Pi | Pd => None,
    }
}
