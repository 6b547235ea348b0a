//! The setpoint side of a tuning: weights and a setpoint filter for a wanted overshoot, after the loop itself is tuned.
//!
//! The PV of a setpoint step is linear in the weight, y = y₀ + b (y₁ − y₀), so two responses say everything about b; a
//! filter 1/(Tsp s + 1) on the setpoint filters the response itself. c stays 0: the derivative does not see the
//! setpoint. Source: Åström and Hägglund, Advanced PID Control, ISA, 2006, section 5.3.

use crate::analyze::{Excitation, OpenLoop, Response, ResponseEnd, ResponseOptions, loop_response};

/// Weight and filter of the setpoint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SetpointSide {
    /// b, weight of the setpoint in the proportional part, 0…1.
    pub b: f64,
    /// Tsp, time constant of the filter on the setpoint in seconds; 0 without.
    pub filter_s: f64,
    /// Overshoot that comes of it, in percent.
    pub overshoot_percent: f64,
}

/// Halvings of the search for b and Tsp.
const HALVINGS: usize = 24;
/// Filters that are tried, at most, in units of the response's length.
const LONGEST_FILTER: f64 = 1.0;

/// The largest b in 0…1 whose overshoot does not pass `wanted_percent`; where even b = 0 passes it, the shortest filter
/// that holds it. `None` for an unstable loop, one without integral action, or a wish that is negative or not a number.
#[must_use]
pub fn setpoint_side(open: &OpenLoop, wanted_percent: f64) -> Option<SetpointSide> {
    if wanted_percent.is_nan() || wanted_percent < 0.0 {
        return None;
    }
    let with = |b: f64, horizon_s: Option<f64>| {
        let options = ResponseOptions { setpoint_weight_b: b, horizon_s, ..ResponseOptions::default() };
        loop_response(open, Excitation::Setpoint, &options)
    };
    let settled = |r: &Response| r.end == ResponseEnd::Settled && r.final_value == Some(1.0);
    let natural = [with(0.0, None), with(1.0, None)];
    if !natural.iter().all(settled) {
        return None;
    }
    let length_s = natural.iter().filter_map(|r| r.time_s.last().copied()).fold(0.0, f64::max);
    let [none, full] = [0.0, 1.0].map(|b| with(b, Some(length_s)));
    let count = none.y.len().min(full.y.len());
    let at = |b: f64| overshoot((0..count).map(|k| none.y[k] + b * (full.y[k] - none.y[k])));
    if at(0.0) > wanted_percent {
        return filtered(&none, length_s, wanted_percent);
    }
    let b = if at(1.0) <= wanted_percent { 1.0 } else { largest(|b| at(b) <= wanted_percent, 1.0) };
    Some(SetpointSide { b, filter_s: 0.0, overshoot_percent: at(b) })
}

/// Overshoot of a response to a unit step, in percent.
fn overshoot(y: impl Iterator<Item = f64>) -> f64 {
    // What a settled response rings by rounding is no overshoot.
    const ROUNDING: f64 = 1e-6;
    let peak = y.fold(f64::NEG_INFINITY, f64::max) - 1.0;
    if peak > ROUNDING { 100.0 * peak } else { 0.0 }
}

/// Upper end of where a property holds from 0 on.
fn largest(holds: impl Fn(f64) -> bool, most: f64) -> f64 {
    let (mut low, mut high) = (0.0, most);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if holds(middle) { low = middle } else { high = middle }
    }
    low
}

fn filtered(none: &Response, length_s: f64, wanted_percent: f64) -> Option<SetpointSide> {
    let at = |filter_s: f64| {
        let mut state = 0.0;
        let steps = none.time_s.windows(2).zip(none.y.windows(2));
        overshoot(steps.map(|(t, y)| {
            // Exact for a PV that runs straight between its samples.
            let h = t[1] - t[0];
            let decay = (-h / filter_s).exp();
            let slope = (y[1] - y[0]) / h;
            state = y[1] - slope * filter_s + (state - y[0] + slope * filter_s) * decay;
            state
        }))
    };
    let longest = LONGEST_FILTER * length_s;
    if at(longest) > wanted_percent {
        return None;
    }
    // The property holds from the wanted filter on: what falls short of it is sought from above.
    let filter_s = longest - largest(|short| at(longest - short) <= wanted_percent, longest);
    Some(SetpointSide { b: 0.0, filter_s, overshoot_percent: at(filter_s) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::PidGains;
    use crate::model::{Fopdt, ProcessModel};

    fn lively() -> OpenLoop {
        let model = ProcessModel::Fopdt(Fopdt::new(2.0, 30.0, 3.0).expect("a model"));
        OpenLoop::new(&model, &PidGains::pi(2.8, 9.0))
    }

    #[test]
    fn the_weight_gives_the_overshoot_that_was_wanted() {
        let open = lively();
        let simulated = |b: f64| {
            let options = ResponseOptions { setpoint_weight_b: b, ..ResponseOptions::default() };
            let metrics = loop_response(&open, Excitation::Setpoint, &options).metrics().expect("figures");
            metrics.overshoot_percent.expect("a setpoint step")
        };
        let (most, least) = (simulated(1.0), simulated(0.0));
        assert!(most > 40.0 && least > 2.0, "{most} {least}");
        let wanted = 0.5 * (most + least);
        let found = setpoint_side(&open, wanted).expect("a weight");
        assert!(found.b > 0.0 && found.b < 1.0 && found.filter_s == 0.0, "{found:?}");
        assert!((simulated(found.b) - wanted).abs() < 1e-2, "{found:?} {}", simulated(found.b));
        assert_eq!(setpoint_side(&open, 200.0).expect("a weight").b, 1.0);
    }

    #[test]
    fn where_no_weight_is_enough_a_filter_is() {
        let found = setpoint_side(&lively(), 1.0).expect("a filter");
        assert!(found.b == 0.0 && found.filter_s > 1.0, "{found:?}");
        assert!((found.overshoot_percent - 1.0).abs() < 1e-3, "{found:?}");
        assert_eq!(setpoint_side(&lively(), -1.0), None);
    }
}
