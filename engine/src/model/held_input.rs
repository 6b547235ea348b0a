//! A linear process under an input that is held between samples, one sample at a time.

use std::collections::VecDeque;

use nalgebra::{DMatrix, DVector};

use super::simulate::held;
use super::{Port, ProcessModel};

/// A process at rest at 0, with its dead time exact: `x(t + h) = e^(Ah) x(t) + ∫₀ʰ e^(As) ds B u`.
///
/// Source: Åström & Wittenmark, Computer-Controlled Systems, 3rd ed., section 2.3.
#[derive(Debug, Clone)]
pub struct HeldInput {
    phi: DMatrix<f64>,
    /// What the value before the newest that has arrived adds in a step.
    earlier: DVector<f64>,
    /// What the newest that has arrived adds.
    present: DVector<f64>,
    c: DVector<f64>,
    d: f64,
    x: DVector<f64>,
    /// Inputs on their way, the oldest in front; it has arrived at the start of the step.
    way: VecDeque<f64>,
}

/// Dead times this close to a whole number of samples, in samples, are that number.
const EVEN: f64 = 1e-9;

impl HeldInput {
    /// A process sampled every `sample_time_s` seconds, which is above 0.
    #[must_use]
    pub fn new(process: &ProcessModel, sample_time_s: f64) -> Self {
        let space = process.state_space(Port::new("u", ""), Port::new("y", ""));
        let (a, b, h) = (space.a(), space.b(), sample_time_s);
        let dead = space.input_delays_s()[0] / h;
        let whole = if (dead - dead.round()).abs() < EVEN { dead.round() } else { dead.floor() };
        let rest_s = (dead - whole).max(0.0) * h;
        let split = rest_s > EVEN * h;
        let (until, gamma) = held(a, b, if split { h - rest_s } else { h });
        let earlier = if split { until * held(a, b, rest_s).1 } else { DMatrix::zeros(a.nrows(), 1) };
        Self {
            phi: held(a, b, h).0,
            earlier: earlier.column(0).into_owned(),
            present: gamma.column(0).into_owned(),
            c: space.c().row(0).transpose(),
            d: space.d()[(0, 0)],
            x: DVector::zeros(space.order()),
            way: std::iter::repeat_n(0.0, whole as usize + 1).collect(),
        }
    }

    /// y before the next input acts.
    #[must_use]
    pub fn output(&self) -> f64 {
        self.c.dot(&self.x) + self.d * self.way.front().copied().unwrap_or(0.0)
    }

    /// Holds an input for a sample.
    pub fn advance(&mut self, u: f64) {
        let earlier = self.way.pop_front().unwrap_or(0.0);
        self.way.push_back(u);
        let present = self.way.front().copied().unwrap_or(u);
        let mut next = &self.phi * &self.x;
        next.axpy(earlier, &self.earlier, 1.0);
        next.axpy(present, &self.present, 1.0);
        self.x = next;
    }
}

#[cfg(test)]
mod tests {
    use super::super::{SampledInput, simulate_process};
    use super::*;

    /// The whole record at once, by another loop over the same matrices, and with a dead time between samples.
    #[test]
    fn sample_by_sample_it_is_what_the_whole_record_gives() {
        let time_s: Vec<f64> = (0..200).map(|k| 0.3 * f64::from(k)).collect();
        let u: Vec<f64> = time_s.iter().map(|t| (0.4 * t).sin() + 1.0).collect();
        for dead_time_s in [0.0, 0.1, 0.3, 1.0, 2.1] {
            let model = ProcessModel::rational(&[1.0, 2.0], &[3.0, 4.0, 1.0], dead_time_s).expect("a model");
            let whole = simulate_process(&model, &SampledInput::single(&time_s, &u)).expect("runs");
            let mut process = HeldInput::new(&model, 0.3);
            for (k, (u, y)) in u.iter().zip(&whole).enumerate() {
                assert!((process.output() - y).abs() < 1e-12, "{dead_time_s} {k}");
                process.advance(*u);
            }
        }
    }
}
