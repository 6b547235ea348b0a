//! Proof of a conversion: both forms, each computed by its own structure, driven with the same signal.
//!
//! Every block by Tustin's rule, s → 2(z − 1)/(h(z + 1)): forms with the same C(s) have the same C(z), so what
//! their outputs differ by is rounding.

use super::forms::{FormGains, ParallelGains, SeriesGains};
use super::gains::PidGains;

/// What a proof run came to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Proof {
    /// Samples driven.
    pub samples: usize,
    /// Sample time in seconds.
    pub sample_time_s: f64,
    /// Largest |u| of the source in MV units.
    pub largest_output: f64,
    /// Largest |u_source − u_converted| in MV units.
    pub largest_difference: f64,
}

impl Proof {
    /// The difference as a share of the output.
    #[must_use]
    pub fn relative(&self) -> f64 {
        if self.largest_output == 0.0 {
            self.largest_difference
        } else {
            self.largest_difference / self.largest_output
        }
    }
}

/// Length of a proof run.
const SAMPLES: usize = 5000;
/// Samples in the shortest time constant: enough that no block rings.
const SAMPLES_PER_TIME: f64 = 4.0;

/// Drives two sets of gains with steps, ramps and noise of errors within ±1 PV unit from rest.
#[must_use]
pub fn prove(source: &FormGains, converted: &FormGains) -> Proof {
    let shortest_s = times(source)
        .into_iter()
        .chain(times(converted))
        .filter(|t| t.is_finite() && *t > 0.0)
        .fold(f64::INFINITY, f64::min);
    let sample_time_s = if shortest_s.is_finite() { shortest_s / SAMPLES_PER_TIME } else { 1.0 };
    let (mut a, mut b) = (Blocks::default(), Blocks::default());
    let mut proof = Proof { samples: SAMPLES, sample_time_s, largest_output: 0.0, largest_difference: 0.0 };
    let mut noise: u64 = 0x9E37_79B9_7F4A_7C15;
    for k in 0..SAMPLES {
        noise ^= noise << 13;
        noise ^= noise >> 7;
        noise ^= noise << 17;
        let random = (noise >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
        let step = if k / 500 % 2 == 0 { 0.4 } else { -0.3 };
        let ramp = 0.2 * ((k % 700) as f64 / 700.0 - 0.5);
        let error = if k == 0 { 0.0 } else { step + ramp + 0.4 * random };
        let (u, v) = (a.step(source, error, sample_time_s), b.step(converted, error, sample_time_s));
        proof.largest_output = proof.largest_output.max(u.abs());
        proof.largest_difference = proof.largest_difference.max((u - v).abs());
    }
    proof
}

fn times(gains: &FormGains) -> [f64; 3] {
    match gains {
        FormGains::Ideal(g) => [g.ti_s, g.td_s, g.td_s / g.n],
        FormGains::Series(g) => [g.ti_s, g.td_s, g.td_s / g.n],
        FormGains::Parallel(g) => [g.kp / g.ki, g.kd / g.kp, g.tf_s].map(f64::abs),
    }
}

/// Memory of a form's blocks.
#[derive(Debug, Default)]
struct Blocks {
    error: f64,
    integral: f64,
    derivative: f64,
    lead: [f64; 2],
}

impl Blocks {
    fn step(&mut self, gains: &FormGains, error: f64, h: f64) -> f64 {
        let (sum, change) = (error + self.error, error - self.error);
        self.error = error;
        match *gains {
            FormGains::Ideal(PidGains { kc, ti_s, td_s, n }) => {
                self.integral += h / (2.0 * ti_s) * sum;
                self.differentiate(td_s, td_s / n, change, h);
                kc * (error + self.integral + self.derivative)
            }
            FormGains::Parallel(ParallelGains { kp, ki, kd, tf_s }) => {
                self.integral += ki * h / 2.0 * sum;
                self.differentiate(kd, tf_s, change, h);
                kp * error + self.integral + self.derivative
            }
            FormGains::Series(SeriesGains { kc, ti_s, td_s, n }) => {
                self.integral += h / (2.0 * ti_s) * sum;
                let [x, u] = self.lead;
                let (now, tf) = (kc * (error + self.integral), td_s / n);
                let out =
                    ((2.0 * tf - h) * u + (2.0 * td_s + h) * now - (2.0 * td_s - h) * x) / (2.0 * tf + h);
                self.lead = [now, out];
                out
            }
        }
    }

    /// gain·s/(1 + tf·s).
    fn differentiate(&mut self, gain: f64, tf: f64, change: f64, h: f64) {
        if gain != 0.0 {
            self.derivative = ((2.0 * tf - h) * self.derivative + 2.0 * gain * change) / (2.0 * tf + h);
        }
    }
}
