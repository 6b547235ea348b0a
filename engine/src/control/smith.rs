//! Smith predictor: the law sees the PV as it would be without the dead time.
//!
//! ```text
//! y' = y + x(t) − x(t − L),   T dx/dt = −x + K (u − u_start)
//! ```
//!
//! x is exact for an output held between samples, and so is its value L ago, also where L is no multiple of
//! the sample time. Source: O. J. M. Smith, Chem. Eng. Progress 53 (1957) 217–219.

use serde::{Deserialize, Serialize};

/// The model inside the predictor, first order with dead time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SmithModel {
    /// K in cm per MV unit.
    pub gain: f64,
    /// T in seconds.
    pub time_constant_s: f64,
    /// L in seconds.
    pub dead_time_s: f64,
}

/// The predictor in operation.
#[derive(Debug, Clone, PartialEq)]
pub struct SmithPredictor {
    model: SmithModel,
    /// Decay of x over a sample and to the place of the delayed value within a sample.
    decay: [f64; 2],
    x: f64,
    delayed: f64,
    start: f64,
    /// Delayed values to come, oldest at `oldest`.
    coming: Vec<f64>,
    oldest: usize,
}

impl SmithPredictor {
    /// A predictor at rest at the output `mv`.
    #[must_use]
    pub fn new(model: SmithModel, sample_time_s: f64, mv: f64) -> Self {
        let samples = model.dead_time_s / sample_time_s;
        let whole = (samples + 1e-9).floor();
        // The value L ago lies this far after the sample before it.
        let after_s = (1.0 - (samples - whole).max(0.0)) * sample_time_s;
        Self {
            model,
            decay: [sample_time_s, after_s].map(|t| (-t / model.time_constant_s).exp()),
            x: 0.0,
            delayed: 0.0,
            start: mv,
            coming: vec![0.0; whole as usize],
            oldest: 0,
        }
    }

    /// What is added to the PV now, in cm.
    #[must_use]
    pub fn correction(&self) -> f64 {
        self.x - self.delayed
    }

    /// Lets a sample pass with the output that is applied in it.
    pub fn advance(&mut self, mv: f64) {
        let goal = self.model.gain * (mv - self.start);
        let [next, between] = self.decay.map(|decay| goal + decay * (self.x - goal));
        self.x = next;
        match self.coming.get_mut(self.oldest) {
            Some(place) => {
                self.delayed = std::mem::replace(place, between);
                self.oldest = (self.oldest + 1) % self.coming.len();
            }
            None => self.delayed = between,
        }
    }
}
