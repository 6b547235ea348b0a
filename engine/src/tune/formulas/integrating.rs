//! Rules for Kv e^(−θs)/s.

use super::Settings;
use crate::model::Ipdt;
use crate::tune::ControllerKind::{self, P, Pd, Pi, Pid};

/// Ziegler and Nichols 1942, whose reaction rate R is Kv.
pub(in crate::tune) fn zn_reaction(m: &Ipdt, kind: ControllerKind, _: f64) -> Option<Settings> {
    let (a, theta) = (1.0 / (m.velocity_gain * m.dead_time_s), m.dead_time_s);
    match kind {
        P => Settings::p(a),
        Pi => Settings::pi(0.9 * a, 3.33 * theta),
        Pid => Settings::pid(1.2 * a, 2.0 * theta, 0.5 * theta),
        Pd => None,
    }
}

/// AMIGO for integrators, Åström and Hägglund 2006.
pub(in crate::tune) fn amigo(m: &Ipdt, kind: ControllerKind, _: f64) -> Option<Settings> {
    let (a, theta) = (1.0 / (m.velocity_gain * m.dead_time_s), m.dead_time_s);
    match kind {
        Pi => Settings::pi(0.35 * a, 13.4 * theta),
        Pid => Settings::pid(0.45 * a, 8.0 * theta, 0.5 * theta),
        P | Pd => None,
    }
}

/// Lambda tuning for integrators.
pub(in crate::tune) fn lambda(m: &Ipdt, kind: ControllerKind, lambda: f64) -> Option<Settings> {
    let (kv, theta) = (m.velocity_gain, m.dead_time_s);
    match kind {
        Pi => {
            let ti = 2.0 * lambda + theta;
            Settings::pi(ti / (kv * (lambda + theta).powi(2)), ti)
        }
        P | Pd | Pid => None,
    }
}

/// SIMC, Skogestad 2003; also the improved PI, whose τ + θ/3 is lost in an infinite τ.
pub(in crate::tune) fn simc(m: &Ipdt, kind: ControllerKind, tau_c: f64) -> Option<Settings> {
    let closed = tau_c + m.dead_time_s;
    match kind {
        Pi => Settings::pi(1.0 / (m.velocity_gain * closed), 4.0 * closed),
        P | Pd | Pid => None,
    }
}

/// Improved SIMC PID, Grimholt and Skogestad 2018: SIMC's PI with Td′ = θ/3, series form.
pub(in crate::tune) fn isimc_pid(m: &Ipdt, kind: ControllerKind, tau_c: f64) -> Option<Settings> {
    let pi = simc(m, Pi, tau_c)?;
    match kind {
        Pid => Settings::from_series(pi.kc, pi.ti_s, m.dead_time_s / 3.0),
        P | Pi | Pd => None,
    }
}
