//! A pump's characteristic curve backwards, and its slope.

use super::spec::PumpSpec;

/// Flows nearer than this share of 1 + |q| are the same.
const SAME_FLOW: f64 = 1e-9;
/// Inputs nearer to a point of the curve than this share of the curve's width stand on it.
const ON_POINT: f64 = 1e-9;

/// On which side of a break of the curve its slope is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum CurveSide {
    /// Towards higher inputs.
    #[default]
    Above,
    /// Towards lower inputs.
    Below,
}

fn flow(pump: &PumpSpec, input: f64) -> f64 {
    let curve = &pump.curve;
    let after = curve.partition_point(|p| p[0] <= input);
    match (after.checked_sub(1).map(|i| curve[i]), curve.get(after)) {
        (None, Some(first)) => first[1],
        (Some([x0, q0]), Some(&[x1, q1])) => q0 + (q1 - q0) * (input - x0) / (x1 - x0),
        (Some([_, last]), None) => last,
        (None, None) => 0.0,
    }
}

/// The lowest input within the pump's limits that gives a flow in cm³/s.
///
/// # Errors
/// The lowest and the highest flow it can give.
pub(super) fn input_for(pump: &PumpSpec, flow_cm3_s: f64) -> Result<f64, [f64; 2]> {
    let inside = pump.curve.iter().filter(|p| p[0] > pump.min && p[0] < pump.max).copied();
    let points = [[pump.min, flow(pump, pump.min)]].into_iter().chain(inside);
    let tolerance = SAME_FLOW * (1.0 + flow_cm3_s.abs());
    let mut before: Option<[f64; 2]> = None;
    let mut range = [f64::INFINITY, f64::NEG_INFINITY];
    for [u1, q1] in points.chain([[pump.max, flow(pump, pump.max)]]) {
        if (q1 - flow_cm3_s).abs() <= tolerance && before.is_none_or(|[_, q0]| (q0 - q1).abs() <= tolerance) {
            return Ok(u1);
        }
        if let Some([u0, q0]) = before
            && (q0.min(q1) - tolerance..=q0.max(q1) + tolerance).contains(&flow_cm3_s)
        {
            return Ok(u0 + (u1 - u0) * ((flow_cm3_s - q0) / (q1 - q0)).clamp(0.0, 1.0));
        }
        range = [range[0].min(q1), range[1].max(q1)];
        before = Some([u1, q1]);
    }
    Err(range)
}

/// Slope of the curve in cm³/s per unit of the input, and whether the input stands on a break of it.
pub(super) fn slope_at(pump: &PumpSpec, input: f64, side: CurveSide) -> (f64, bool) {
    let curve = &pump.curve;
    let near = ON_POINT * (curve[curve.len() - 1][0] - curve[0][0]);
    let slope = |i: usize| -> f64 {
        // Segment i runs from point i − 1 to point i; outside the flow is constant.
        if i == 0 || i == curve.len() {
            return 0.0;
        }
        let ([x0, q0], [x1, q1]) = (curve[i - 1], curve[i]);
        (q1 - q0) / (x1 - x0)
    };
    match curve.iter().position(|p| (p[0] - input).abs() <= near) {
        Some(point) => {
            let (below, above) = (slope(point), slope(point + 1));
            (if side == CurveSide::Above { above } else { below }, below != above)
        }
        None => (slope(curve.partition_point(|p| p[0] <= input)), false),
    }
}
