//! Responses of unit-gain dynamics to a held input, with their sensitivities, exact from switch to switch.
//!
//! | dynamics | equation | unknowns |
//! | --- | --- | --- |
//! | first order | T ẋ = u − x | ln T |
//! | integrator | ẋ = u | |
//! | second order | τ² ẍ + 2ζτ ẋ + x = u, w = τ ẋ | ln τ, ln ζ |
//!
//! and the dead time, in units of T, τ or a fixed time. Where the delayed input moves by Δ, the sensitivity to the
//! dead time falls by what the move adds to the rate of change.

use super::matrix2::{Exponential, apply};

/// What a kernel's state is carried over a piece with.
pub(super) trait Kernel {
    /// Constants of a piece of one duration.
    type Factors: Copy;

    /// Constants of a piece of `duration_s`.
    fn factors(&self, duration_s: f64) -> Self::Factors;
    /// Carries the state over a piece with the input held at `u`.
    fn hold(&mut self, factors: &Self::Factors, u: f64);
    /// Lets the delayed input move by `delta`.
    fn jump(&mut self, delta: f64);
    /// Values of the columns: every basis function, then its derivatives.
    fn output(&self) -> impl AsRef<[f64]>;
    /// Sets states near the end of the number range to zero: denormals are forty times slower.
    fn flush(&mut self);
}

/// States this small are set to zero.
const FLUSH: f64 = 1e-150;

fn flush(values: &mut [f64]) {
    for value in values.iter_mut().filter(|v| v.abs() < FLUSH) {
        *value = 0.0;
    }
}

/// First order: x, ∂x/∂ln T, T ∂x/∂L.
#[derive(Debug, Clone)]
pub(super) struct First {
    time_constant_s: f64,
    state: [f64; 3],
}

impl First {
    pub fn at_rest(time_constant_s: f64, u: f64) -> Self {
        Self { time_constant_s, state: [u, 0.0, 0.0] }
    }
}

impl Kernel for First {
    type Factors = [f64; 2];

    fn factors(&self, duration_s: f64) -> [f64; 2] {
        let pieces = duration_s / self.time_constant_s;
        let a = (-pieces).exp();
        [a, pieces * a]
    }

    fn hold(&mut self, &[a, sa]: &[f64; 2], u: f64) {
        let [x, by_t, by_l] = self.state;
        let distance = x - u;
        self.state = [u + a * distance, a * by_t + sa * distance, a * by_l];
    }

    fn jump(&mut self, delta: f64) {
        self.state[2] -= delta;
    }

    fn output(&self) -> impl AsRef<[f64]> {
        self.state
    }

    fn flush(&mut self) {
        flush(&mut self.state);
    }
}

/// Integrator: x, scale ∂x/∂L.
#[derive(Debug, Clone)]
pub(super) struct Integrator {
    scale_s: f64,
    state: [f64; 2],
}

impl Integrator {
    pub fn new(scale_s: f64) -> Self {
        Self { scale_s, state: [0.0, 0.0] }
    }
}

impl Kernel for Integrator {
    type Factors = f64;

    fn factors(&self, duration_s: f64) -> f64 {
        duration_s
    }

    fn hold(&mut self, duration_s: &f64, u: f64) {
        self.state[0] += u * duration_s;
    }

    fn jump(&mut self, delta: f64) {
        self.state[1] -= self.scale_s * delta;
    }

    fn output(&self) -> impl AsRef<[f64]> {
        self.state
    }

    fn flush(&mut self) {}
}

/// Second order: (x, w) and their derivatives to ln τ, ln ζ and L/τ.
#[derive(Debug, Clone)]
pub(super) struct Second {
    tau_s: f64,
    zeta: f64,
    z: [f64; 2],
    by_tau: [f64; 2],
    by_zeta: [f64; 2],
    by_l: [f64; 2],
}

impl Second {
    pub fn at_rest(tau_s: f64, zeta: f64, u: f64) -> Self {
        let zero = [0.0; 2];
        Self { tau_s, zeta, z: [u, 0.0], by_tau: zero, by_zeta: zero, by_l: zero }
    }
}

impl Kernel for Second {
    type Factors = Exponential;

    fn factors(&self, duration_s: f64) -> Exponential {
        Exponential::new(duration_s / self.tau_s, self.zeta)
    }

    fn hold(&mut self, f: &Exponential, u: f64) {
        let distance = [self.z[0] - u, self.z[1]];
        let moved = apply(&f.e, distance);
        let (turn_tau, turn_zeta) = (apply(&f.by_tau, distance), apply(&f.by_zeta, distance));
        let (tau, zeta) = (apply(&f.e, self.by_tau), apply(&f.e, self.by_zeta));
        self.by_tau = [tau[0] + turn_tau[0], tau[1] + turn_tau[1]];
        self.by_zeta = [zeta[0] + turn_zeta[0], zeta[1] + turn_zeta[1]];
        self.by_l = apply(&f.e, self.by_l);
        self.z = [moved[0] + u, moved[1]];
    }

    fn jump(&mut self, delta: f64) {
        self.by_l[1] -= delta;
    }

    fn output(&self) -> impl AsRef<[f64]> {
        [
            self.z[0],
            self.by_tau[0],
            self.by_zeta[0],
            self.by_l[0],
            self.z[1],
            self.by_tau[1],
            self.by_zeta[1],
            self.by_l[1],
        ]
    }

    fn flush(&mut self) {
        for part in [&mut self.z, &mut self.by_tau, &mut self.by_zeta, &mut self.by_l] {
            flush(part);
        }
    }
}
