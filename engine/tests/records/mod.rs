//! Processes in closed form, the records they make, and noise.

// Not every test uses all of them.
#![allow(dead_code)]

use num_complex::Complex64;
use rand::rngs::StdRng;
use rand_distr::{Distribution, StandardNormal};

/// Truth of a test: K (Tz s + 1)/(τ² s² + 2ζτ s + 1), or with an integrator K/s, dead time L.
#[derive(Debug, Clone, Copy)]
pub enum Truth {
    First { k: f64, t: f64, l: f64 },
    Integrator { kv: f64, l: f64 },
    Second { k: f64, tau: f64, zeta: f64, tz: f64, l: f64 },
}

impl Truth {
    /// Response to a unit step, dead time left out: residues at the poles.
    pub fn step(&self, t: f64) -> f64 {
        match *self {
            _ if t <= 0.0 => 0.0,
            Self::First { k, t: tc, .. } => -k * (-t / tc).exp_m1(),
            Self::Integrator { kv, .. } => kv * t,
            Self::Second { k, tau, zeta: 1.0, tz, .. } => {
                let e = (-t / tau).exp();
                k * (1.0 - (1.0 + t / tau) * e + tz * t / (tau * tau) * e)
            }
            Self::Second { k, tau, zeta, tz, .. } => {
                let root = Complex64::new(zeta * zeta - 1.0, 0.0).sqrt();
                let poles = [(-zeta + root) / tau, (-zeta - root) / tau];
                let residue = |p: Complex64, q: Complex64| (1.0 + tz * p) / (tau * tau * (p - q) * p);
                let sum = residue(poles[0], poles[1]) * (poles[0] * t).exp()
                    + residue(poles[1], poles[0]) * (poles[1] * t).exp();
                k * (1.0 + sum.re)
            }
        }
    }

    pub fn dead_time(&self) -> f64 {
        match *self {
            Self::First { l, .. } | Self::Integrator { l, .. } | Self::Second { l, .. } => l,
        }
    }

    /// Response to a held input that was `before` ahead of the first row.
    pub fn run(&self, time_s: &[f64], u: &[f64], before: f64) -> Vec<f64> {
        let mut last = before;
        let mut moves = vec![];
        for (&t, &u) in time_s.iter().zip(u) {
            if u != last {
                moves.push((t + self.dead_time(), u - last));
                last = u;
            }
        }
        time_s.iter().map(|&t| moves.iter().map(|(at, du)| du * self.step(t - at)).sum()).collect()
    }

    /// What a fit of it must give: name and value, with the size that its tolerance refers to.
    pub fn expected(&self) -> Vec<(&'static str, f64, f64)> {
        match *self {
            Self::First { k, t, l } => vec![("K", k, k), ("T_s", t, t), ("L_s", l, t)],
            Self::Integrator { kv, l } => vec![("Kv", kv, kv), ("L_s", l, l.max(1.0))],
            Self::Second { k, tau, zeta, tz, l } => {
                let mut out = vec![("K", k, k), ("L_s", l, tau)];
                if tz != 0.0 {
                    out.push(("Tz_s", tz, tz));
                }
                if zeta < 1.0 {
                    out.extend([("T_s", tau, tau), ("zeta", zeta, zeta)]);
                } else {
                    let slow = zeta + (zeta * zeta - 1.0).sqrt();
                    out.extend([("T_s", tau * slow, tau * slow), ("T2_s", tau / slow, tau / slow)]);
                }
                out
            }
        }
    }
}

/// An input that is moved to given values at given times.
pub fn moves(time_s: &[f64], at: &[(f64, f64)], start: f64) -> Vec<f64> {
    time_s.iter().map(|&t| at.iter().rev().find(|(from, _)| t >= *from).map_or(start, |m| m.1)).collect()
}

/// Standard normal noise, each value correlated with the one before by `rho`.
pub fn noise(rng: &mut StdRng, rows: usize, rho: f64) -> Vec<f64> {
    let mut last: f64 = StandardNormal.sample(rng);
    (0..rows)
        .map(|_| {
            let now = last;
            let fresh: f64 = StandardNormal.sample(rng);
            last = rho * last + (1.0 - rho * rho).sqrt() * fresh;
            now
        })
        .collect()
}

/// Standard deviation of noise of a share of a signal's variance.
pub fn share_of(clean: &[f64], share: f64) -> f64 {
    let mean = clean.iter().sum::<f64>() / clean.len() as f64;
    (share * clean.iter().map(|y| (y - mean).powi(2)).sum::<f64>() / clean.len() as f64).sqrt()
}
