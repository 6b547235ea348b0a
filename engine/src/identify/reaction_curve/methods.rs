//! What each method reads off the normalised curve z(t), 0 at the first rest and 1 at the last.

use super::CurveMethod;
use super::curve::Curve;

/// Standard error that smoothing leaves to a value of the curve.
const SMOOTH: f64 = 0.01;
/// Part of a slope that noise may be.
const SLOPE_NOISE: f64 = 0.03;
/// Response that counts as one where there is no noise: a digit.
const ROUNDING: f64 = 1e-6;
/// Standard deviations of the curve at rest that it must leave to count as responding.
const BAND: f64 = 3.0;

/// (T, L) in seconds by a method; `None` where the curve has no such feature, or T comes out ≤ 0.
pub(super) fn times(curve: &Curve, method: CurveMethod) -> Option<(f64, f64)> {
    let t63 = crossing(curve, 1.0 - (-1.0_f64).exp())?;
    let t28 = crossing(curve, 1.0 - (-1.0_f64 / 3.0).exp())?;
    let two_points_s = 1.5 * (t63 - t28);
    let (t, l) = match method {
        CurveMethod::TwoPoints => (two_points_s, t63 - two_points_s),
        CurveMethod::Onset => {
            let onset_s = onset(curve, t28);
            (t63 - onset_s, onset_s)
        }
        CurveMethod::Tangent => tangent(curve, two_points_s)?,
        CurveMethod::Area => area(curve),
        CurveMethod::LeastSquares => return None,
    };
    (t > 0.0 && t.is_finite() && l.is_finite()).then_some((t, l))
}

/// Points to each side that a parabola needs so that noise leaves [`SMOOTH`]: its middle has 9/4 of a mean's variance.
fn half_width(curve: &Curve) -> usize {
    let points = 2.25 * (curve.z_noise / SMOOTH).powi(2);
    ((points / 2.0).ceil() as usize).min(curve.t.len() / 8)
}

/// The curve at a point, from a parabola through its neighbours (Savitzky & Golay, Anal. Chem. 36 (1964) 1627).
fn smoothed(curve: &Curve, at: usize, half: usize) -> f64 {
    let half = half.min(at).min(curve.t.len() - 1 - at);
    if half < 2 {
        return curve.z[at];
    }
    let rows = at - half..=at + half;
    let (t, z) = (&curve.t[rows.clone()], &curve.z[rows]);
    let width = (t[t.len() - 1] - t[0]).max(f64::MIN_POSITIVE);
    let mut m = nalgebra::Matrix3::zeros();
    let mut b = nalgebra::Vector3::zeros();
    for (t, z) in t.iter().zip(z) {
        let x = (t - curve.t[at]) / width;
        let row = nalgebra::Vector3::new(1.0, x, x * x);
        m += row * row.transpose();
        b += row * *z;
    }
    m.cholesky().map_or(curve.z[at], |factor| factor.solve(&b)[0])
}

/// When the smoothed curve first reaches a level, between two points by a straight line.
fn crossing(curve: &Curve, level: f64) -> Option<f64> {
    let half = half_width(curve);
    let mut last = (curve.t[0], smoothed(curve, 0, half));
    for at in 1..curve.t.len() {
        let now = (curve.t[at], smoothed(curve, at, half));
        if now.1 >= level {
            let share = if now.1 > last.1 { (level - last.1) / (now.1 - last.1) } else { 1.0 };
            return Some(last.0 + share.clamp(0.0, 1.0) * (now.0 - last.0));
        }
        last = now;
    }
    None
}

/// When the smoothed curve leaves the band of its noise for good, ahead of `before_s`.
fn onset(curve: &Curve, before_s: f64) -> f64 {
    let half = half_width(curve);
    let left_over = if half < 2 { 1.0 } else { (2.25 / (2 * half + 1) as f64).sqrt() };
    let band = (BAND * left_over * curve.z_noise).max(ROUNDING);
    let end = curve.t.partition_point(|t| *t < before_s);
    let inside = (0..end).rev().find(|&at| smoothed(curve, at, half) <= band);
    let Some(at) = inside else { return 0.0 };
    let next = (at + 1).min(curve.t.len() - 1);
    // A straight line through the first two points outside, back to 0: between the last inside and the first outside.
    let after = (next + 1).min(curve.t.len() - 1);
    let (z1, z2) = (smoothed(curve, next, half), smoothed(curve, after, half));
    let slope = (z2 - z1) / (curve.t[after] - curve.t[next]);
    let back = if slope > 0.0 { curve.t[next] - z1 / slope } else { curve.t[at] };
    back.clamp(curve.t[at], curve.t[next])
}

/// Mean of the curve, of time, and slope of the straight line through points `from` to `to`, both in.
fn chord(curve: &Curve, from: usize, to: usize) -> Option<(f64, f64, f64)> {
    let n = (to - from + 1) as f64;
    let (t, z) = (&curve.t[from..=to], &curve.z[from..=to]);
    let (tm, zm) = (t.iter().sum::<f64>() / n, z.iter().sum::<f64>() / n);
    let spread: f64 = t.iter().map(|t| (t - tm).powi(2)).sum();
    let along: f64 = t.iter().zip(z).map(|(t, z)| (t - tm) * (z - zm)).sum();
    (spread > 0.0).then(|| (tm, zm, along / spread))
}

/// The steepest straight line through neighbouring points, as (time, value, slope), for a number of them.
fn steepest(curve: &Curve, points: usize) -> Option<(f64, f64, f64)> {
    let last = curve.t.partition_point(|t| *t <= curve.rest_s).max(points).min(curve.t.len());
    (0..(last + 1).saturating_sub(points))
        .filter_map(|from| chord(curve, from, from + points - 1))
        .max_by(|a, b| a.2.total_cmp(&b.2))
}

/// The tangent where the curve is steepest. Its slope is that of ever shorter chords: 2 s(w) − s(2w), which is exact to
/// second order whether the curve is steepest in a bend (S-shaped) or at a kink (first order).
fn tangent(curve: &Curve, scale_s: f64) -> Option<(f64, f64)> {
    let points = chord_points(curve, scale_s);
    let (at_s, value, short) = steepest(curve, points)?;
    let long = steepest(curve, (2 * points - 1).min(curve.t.len()))?.2;
    let slope = (2.0 * short - long).clamp(short, 1.25 * short);
    (slope > 0.0).then(|| (1.0 / slope, at_s - value / slope))
}

/// Points of a chord: as few as noise allows, at most half a time constant.
fn chord_points(curve: &Curve, scale_s: f64) -> usize {
    let step_s = curve.t[curve.t.len() - 1] / (curve.t.len() - 1) as f64;
    let most = ((0.5 * scale_s / step_s) as usize).max(2);
    let enough = |points: &usize| {
        let width = (*points - 1) as f64 * step_s / scale_s;
        let error = curve.z_noise * (12.0 / *points as f64).sqrt() / width;
        error <= SLOPE_NOISE
    };
    (2..=most).find(enough).unwrap_or(most)
}

/// By trapezoids: ∫ (1 − z) dt up to the last rest is L + T, and e ∫ z dt up to L + T is T.
fn area(curve: &Curve) -> (f64, f64) {
    let residence_s = integral(curve, curve.rest_s, |z| 1.0 - z);
    let t = std::f64::consts::E * integral(curve, residence_s, |z| z);
    (t, residence_s - t)
}

fn integral(curve: &Curve, to_s: f64, f: impl Fn(f64) -> f64) -> f64 {
    let mut total = 0.0;
    let mut last = (0.0, f(0.0));
    for (&t, &z) in curve.t.iter().zip(&curve.z) {
        if t <= last.0 {
            last.1 = f(z);
            continue;
        }
        let now = if t > to_s {
            let share = (to_s - last.0) / (t - last.0);
            (to_s, last.1 + share * (f(z) - last.1))
        } else {
            (t, f(z))
        };
        total += 0.5 * (now.0 - last.0) * (last.1 + now.1);
        last = now;
        if t > to_s {
            break;
        }
    }
    total
}
