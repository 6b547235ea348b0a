//! Rules for K e^(−θs)/(τs + 1).

use super::Settings;
use crate::model::Fopdt;
use crate::tune::ControllerKind::{self, P, Pd, Pi, Pid};

/// Ziegler and Nichols 1942, from the reaction curve.
pub(in crate::tune) fn zn_reaction(m: &Fopdt, kind: ControllerKind, _: f64) -> Option<Settings> {
    let (a, theta) = (unit_gain(m), m.dead_time_s);
    match kind {
        P => Settings::p(a),
        Pi => Settings::pi(0.9 * a, 3.33 * theta),
        Pid => Settings::pid(1.2 * a, 2.0 * theta, 0.5 * theta),
        Pd => None,
    }
}

/// Cohen and Coon 1953.
pub(in crate::tune) fn cohen_coon(m: &Fopdt, kind: ControllerKind, _: f64) -> Option<Settings> {
    let (a, theta, r) = (unit_gain(m), m.dead_time_s, m.dead_time_ratio());
    match kind {
        P => Settings::p(a * (1.0 + r / 3.0)),
        Pi => Settings::pi(a * (0.9 + r / 12.0), theta * (30.0 + 3.0 * r) / (9.0 + 20.0 * r)),
        Pd => Settings::pd(a * (1.25 + r / 6.0), theta * (6.0 - 2.0 * r) / (22.0 + 3.0 * r)),
        Pid => Settings::pid(
            a * (4.0 / 3.0 + r / 4.0),
            theta * (32.0 + 6.0 * r) / (13.0 + 8.0 * r),
            theta * 4.0 / (11.0 + 2.0 * r),
        ),
    }
}

/// Chien, Hrones and Reswick 1952, setpoint without overshoot.
pub(in crate::tune) fn chr_setpoint_0(m: &Fopdt, kind: ControllerKind, _: f64) -> Option<Settings> {
    let (a, tau, theta) = (unit_gain(m), m.time_constant_s, m.dead_time_s);
    match kind {
        P => Settings::p(0.3 * a),
        Pi => Settings::pi(0.35 * a, 1.2 * tau),
        Pid => Settings::pid(0.6 * a, tau, 0.5 * theta),
        Pd => None,
    }
}

/// Chien, Hrones and Reswick 1952, setpoint with 20 % overshoot, in the values of seed 004.
pub(in crate::tune) fn chr_setpoint_20(m: &Fopdt, kind: ControllerKind, _: f64) -> Option<Settings> {
    let (a, tau, theta) = (unit_gain(m), m.time_constant_s, m.dead_time_s);
    match kind {
        P => Settings::p(0.7 * a),
        Pi => Settings::pi(0.6 * a, tau),
        Pid => Settings::pid(0.95 * a, 1.357 * tau, 0.473 * theta),
        Pd => None,
    }
}

/// Chien, Hrones and Reswick 1952, load without overshoot.
pub(in crate::tune) fn chr_load_0(m: &Fopdt, kind: ControllerKind, _: f64) -> Option<Settings> {
    let (a, theta) = (unit_gain(m), m.dead_time_s);
    match kind {
        P => Settings::p(0.3 * a),
        Pi => Settings::pi(0.6 * a, 4.0 * theta),
        Pid => Settings::pid(0.95 * a, 2.4 * theta, 0.42 * theta),
        Pd => None,
    }
}

/// Chien, Hrones and Reswick 1952, load with 20 % overshoot.
pub(in crate::tune) fn chr_load_20(m: &Fopdt, kind: ControllerKind, _: f64) -> Option<Settings> {
    let (a, theta) = (unit_gain(m), m.dead_time_s);
    match kind {
        P => Settings::p(0.7 * a),
        Pi => Settings::pi(0.7 * a, 2.3 * theta),
        Pid => Settings::pid(1.2 * a, 2.0 * theta, 0.42 * theta),
        Pd => None,
    }
}

/// Least ITAE after a load step, as tabled in seed 003 (Smith and Corripio).
pub(in crate::tune) fn itae_load(m: &Fopdt, kind: ControllerKind, _: f64) -> Option<Settings> {
    let (k, tau, r) = (m.gain, m.time_constant_s, m.dead_time_ratio());
    match kind {
        P => Settings::p(0.49 / k * r.powf(-1.084)),
        Pi => Settings::pi(0.859 / k * r.powf(-0.977), tau / 0.674 * r.powf(0.680)),
        Pid => Settings::pid(
            1.357 / k * r.powf(-0.947),
            tau / 0.842 * r.powf(0.738),
            0.381 * tau * r.powf(0.995),
        ),
        Pd => None,
    }
}

/// Least ITAE after a setpoint step, as tabled in seed 003 (Smith and Corripio).
pub(in crate::tune) fn itae_setpoint(m: &Fopdt, kind: ControllerKind, _: f64) -> Option<Settings> {
    let (k, tau, r) = (m.gain, m.time_constant_s, m.dead_time_ratio());
    match kind {
        Pi => Settings::pi(0.586 / k * r.powf(-0.916), tau / (1.03 - 0.165 * r)),
        Pid => {
            Settings::pid(0.965 / k * r.powf(-0.855), tau / (0.796 - 0.147 * r), 0.308 * tau * r.powf(0.929))
        }
        P | Pd => None,
    }
}

/// AMIGO, Åström and Hägglund 2006.
pub(in crate::tune) fn amigo(m: &Fopdt, kind: ControllerKind, _: f64) -> Option<Settings> {
    let (k, tau, theta) = (m.gain, m.time_constant_s, m.dead_time_s);
    match kind {
        Pi => {
            let gain = 0.15 / k + (0.35 - theta * tau / (theta + tau).powi(2)) * unit_gain(m);
            let lag = tau * tau + 12.0 * theta * tau + 7.0 * theta * theta;
            Settings::pi(gain, 0.35 * theta + 13.0 * theta * tau * tau / lag)
        }
        Pid => Settings::pid(
            (0.2 + 0.45 * tau / theta) / k,
            theta * (0.4 * theta + 0.8 * tau) / (theta + 0.1 * tau),
            0.5 * theta * tau / (0.3 * theta + tau),
        ),
        P | Pd => None,
    }
}

/// Direct synthesis and lambda tuning: the lag cancelled, closed loop e^(−θs)/(τc s + 1).
pub(in crate::tune) fn direct_synthesis(m: &Fopdt, kind: ControllerKind, tau_c: f64) -> Option<Settings> {
    let tau = m.time_constant_s;
    match kind {
        Pi => Settings::pi(tau / (m.gain * (tau_c + m.dead_time_s)), tau),
        P | Pd | Pid => None,
    }
}

/// Internal model control, Rivera, Morari and Skogestad 1986.
pub(in crate::tune) fn imc(m: &Fopdt, kind: ControllerKind, lambda: f64) -> Option<Settings> {
    let (k, tau, theta) = (m.gain, m.time_constant_s, m.dead_time_s);
    let (sum, ti) = (2.0 * tau + theta, tau + 0.5 * theta);
    match kind {
        Pi => Settings::pi(sum / (2.0 * k * lambda), ti),
        Pid => Settings::pid(sum / (k * (2.0 * lambda + theta)), ti, tau * theta / sum),
        P | Pd => None,
    }
}

/// SIMC, Skogestad 2003.
pub(in crate::tune) fn simc(m: &Fopdt, kind: ControllerKind, tau_c: f64) -> Option<Settings> {
    let tau = m.time_constant_s;
    let closed = tau_c + m.dead_time_s;
    match kind {
        Pi => Settings::pi(tau / (m.gain * closed), tau.min(4.0 * closed)),
        P | Pd | Pid => None,
    }
}

/// Improved SIMC PI, Grimholt and Skogestad 2012: SIMC with τ + θ/3 for τ.
pub(in crate::tune) fn isimc_pi(m: &Fopdt, kind: ControllerKind, tau_c: f64) -> Option<Settings> {
    let longer = Fopdt { time_constant_s: m.time_constant_s + m.dead_time_s / 3.0, ..*m };
    simc(&longer, kind, tau_c)
}

/// Improved SIMC PID, Grimholt and Skogestad 2018: SIMC's PI with Td′ = θ/3, series form.
pub(in crate::tune) fn isimc_pid(m: &Fopdt, kind: ControllerKind, tau_c: f64) -> Option<Settings> {
    let pi = simc(m, Pi, tau_c)?;
    match kind {
        Pid => Settings::from_series(pi.kc, pi.ti_s, m.dead_time_s / 3.0),
        P | Pi | Pd => None,
    }
}

/// τ/(K θ).
fn unit_gain(m: &Fopdt) -> f64 {
    m.time_constant_s / (m.gain * m.dead_time_s)
}
