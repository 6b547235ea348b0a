//! Feed-forward of a measured disturbance: gain with lead and lag.

use serde::{Deserialize, Serialize};

/// `gain·(1 + lead·s)/(1 + lag·s)` from a sensor's level or a pump's input to the output.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Feedforward {
    /// Tag of the sensor or pump that gives the disturbance.
    pub from: String,
    /// Gain in MV units per cm, or per unit of the pump's input.
    pub gain: f64,
    /// Lead in seconds; needs a lag.
    #[serde(default)]
    pub lead_s: f64,
    /// Lag in seconds.
    #[serde(default)]
    pub lag_s: f64,
}

/// The filter in operation, for changes since it was switched on.
///
/// Tustin's rule, backward difference where 2·lag < h:
///
/// ```text
/// y_k = [(2lag − h) y_{k−1} + (2lead + h) d_k − (2lead − h) d_{k−1}]/(2lag + h)
/// y_k = [lag·y_{k−1} + (lead + h) d_k − lead·d_{k−1}]/(lag + h)
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LeadLag {
    /// Disturbance at the start, last change from it, last filtered change.
    now: Option<[f64; 3]>,
}

impl LeadLag {
    /// One sample: what the feed-forward adds to the output, in MV units. A disturbance that is not finite
    /// holds the last value.
    pub fn step(&mut self, spec: &Feedforward, disturbance: f64, sample_time_s: f64) -> f64 {
        if !disturbance.is_finite() {
            return spec.gain * self.now.map_or(0.0, |[.., filtered]| filtered);
        }
        let [start, last, filtered] = self.now.unwrap_or([disturbance, 0.0, 0.0]);
        let (h, lead, lag, change) = (sample_time_s, spec.lead_s, spec.lag_s, disturbance - start);
        let filtered = if lag == 0.0 {
            change
        } else if 2.0 * lag < h {
            (lag * filtered + (lead + h) * change - lead * last) / (lag + h)
        } else {
            ((2.0 * lag - h) * filtered + (2.0 * lead + h) * change - (2.0 * lead - h) * last)
                / (2.0 * lag + h)
        };
        self.now = Some([start, change, filtered]);
        spec.gain * filtered
    }
}
