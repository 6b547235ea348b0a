//! Closed-loop stability by the Nyquist criterion, dead time exact and without a frequency grid.
//!
//! With L = (N/D) e^(−sθ) the closed loop has its poles at the zeros of F = D + N e^(−sθ). |L(jω)| does not depend on
//! θ, so its unit crossings are roots of a polynomial in ω². Between two of them the winding of F about the origin is
//! closed form: where |L| < 1, F = D (1 + L) and 1 + L stays in the right half-plane; where |L| > 1,
//! F = N e^(−jωθ) (1 + 1/L) likewise. Summing the arguments counts the encirclements together with the open-loop
//! poles, whether these are unstable or on the imaginary axis. Sources: Nyquist 1932; Walton and Marshall, Direct
//! method for TDS stability analysis, IEE Proc. D 134, 1987 (crossings independent of the delay).

use std::f64::consts::{FRAC_PI_2, PI};

use num_complex::Complex64;

use super::OpenLoop;
use crate::model::roots::{at_j_omega, product, push_positive_roots};

/// Distance of L(jω) from −1 under which a unit crossing counts as lying on it: the loop oscillates for ever.
const ON_THE_CRITICAL_POINT: f64 = 1e-12;

/// A frequency at which |L| = 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct GainCrossing {
    pub omega: f64,
    pub l: Complex64,
}

/// All frequencies at which |L(jω)| crosses 1, in rising order.
pub(super) fn gain_crossings(open: &OpenLoop) -> Vec<GainCrossing> {
    // ω is measured in units of the loop's own frequencies, so that high powers stay in range.
    let unit = typical_omega(open);
    let (n, d) = (squared_magnitude(&open.num, unit), squared_magnitude(&open.den, unit));
    let offset = d.len() - n.len();
    let mut difference = d;
    for (i, v) in n.iter().enumerate() {
        difference[offset + i] -= v;
    }
    let mut squares = Vec::with_capacity(difference.len());
    push_positive_roots(&difference, &mut squares);
    squares
        .iter()
        .map(|x| {
            let omega = x.sqrt() * unit;
            GainCrossing { omega, l: open.at_omega(omega) }
        })
        .collect()
}

/// Geometric mean of the moduli of the loop's poles and zeros that are not at the origin, 1 rad/s without any.
pub(super) fn typical_omega(open: &OpenLoop) -> f64 {
    let moduli = open.poles.iter().chain(&open.zeros).map(|r| r.norm()).filter(|m| *m > 0.0);
    let (sum, count) = moduli.fold((0.0, 0), |(sum, count), m| (sum + m.ln(), count + 1));
    if count == 0 { 1.0 } else { (sum / f64::from(count)).exp() }
}

/// |p(j·unit·√x)|² as a polynomial in x.
fn squared_magnitude(p: &[f64], unit: f64) -> Vec<f64> {
    // p(jω) = E(x) + jω O(x) with alternating signs; here both in falling powers of x.
    let (mut even, mut odd) = (Vec::with_capacity(p.len()), Vec::with_capacity(p.len()));
    let degree = p.len() - 1;
    let mut scale = unit.powi(degree as i32);
    for (i, &c) in p.iter().enumerate() {
        let power = degree - i;
        let sign = if (power / 2).is_multiple_of(2) { 1.0 } else { -1.0 };
        if power.is_multiple_of(2) {
            even.push(sign * c * scale)
        } else {
            odd.push(sign * c * scale)
        }
        scale /= unit;
    }
    let mut out = vec![0.0; degree + 1];
    if !even.is_empty() {
        let square = product(&even, &even);
        let start = out.len() - square.len();
        for (i, v) in square.iter().enumerate() {
            out[start + i] += v;
        }
    }
    if !odd.is_empty() {
        let square = product(&odd, &odd);
        let start = out.len() - 1 - square.len();
        for (i, v) in square.iter().enumerate() {
            out[start + i] += v;
        }
    }
    out
}

/// Whether every closed-loop pole lies in the open left half-plane.
pub(super) fn is_stable(open: &OpenLoop, crossings: &[GainCrossing]) -> bool {
    unstable_poles(open, crossings) == Some(0)
}

/// Closed-loop poles in the right half-plane; `None` where one lies on its edge, or they are without end.
pub(super) fn unstable_poles(open: &OpenLoop, crossings: &[GainCrossing]) -> Option<u32> {
    let l_at_infinity = open.process_high() * open.controller_high();
    let leading = if open.num.len() == open.den.len() { open.num[0] } else { 0.0 };
    let degenerate = if open.dead_time_s > 0.0 {
        l_at_infinity.abs() >= 1.0 - ON_THE_CRITICAL_POINT
    } else {
        (open.den[0] + leading).abs() <= ON_THE_CRITICAL_POINT * open.den[0].abs()
    };
    let (n0, d0) = (open.num[open.num.len() - 1], open.den[open.den.len() - 1]);
    let finite = open.num.iter().chain(&open.den).all(|c| c.is_finite());
    let at_origin = (n0 + d0).abs() <= ON_THE_CRITICAL_POINT * n0.abs().max(d0.abs());
    let on_critical_point = |c: &GainCrossing| {
        let distance = (1.0 + c.l).norm();
        distance.is_nan() || distance <= ON_THE_CRITICAL_POINT
    };
    if !finite || degenerate || at_origin || crossings.iter().any(on_critical_point) {
        return None;
    }
    let turns = winding(open, crossings) / FRAC_PI_2;
    let degree = (open.den.len() - 1) as f64;
    Some((0.5 * (degree - turns)).round().max(0.0) as u32)
}

/// Change of arg F(jω) from ω = 0 to ∞ in radians: π/2 times (degree − 2 × unstable closed-loop poles).
fn winding(open: &OpenLoop, crossings: &[GainCrossing]) -> f64 {
    let mut total = 0.0;
    for i in 0..=crossings.len() {
        let from = i.checked_sub(1).map(|k| crossings[k]);
        let to = crossings.get(i).copied();
        let inside = match (from, to) {
            (None, None) => typical_omega(open),
            (None, Some(b)) => 0.5 * b.omega,
            (Some(a), None) => 2.0 * a.omega,
            (Some(a), Some(b)) => (a.omega * b.omega).sqrt(),
        };
        let large = open.magnitudes_sqr(inside).0 > 1.0;
        let start = from.map_or(0.0, |c| c.omega);
        let end = to.map_or(f64::INFINITY, |c| c.omega);
        let remainder = |crossing: Option<GainCrossing>| {
            crossing.map_or(0.0, |c| if large { (1.0 + 1.0 / c.l).arg() } else { (1.0 + c.l).arg() })
        };
        total += remainder(to) - remainder(from);
        total += if large {
            turn(&open.num, &open.zeros, start, end)
        } else {
            turn(&open.den, &open.poles, start, end)
        };
        if large && open.dead_time_s > 0.0 {
            total -= (end - start) * open.dead_time_s;
        }
    }
    total
}

/// Change of arg p(jω) for ω from `start` to `end`, between which p has no root on the imaginary axis.
///
/// The roots, which may be inaccurate where several are equal, only count the whole turns; the rest is p itself.
fn turn(p: &[f64], roots: &[Complex64], start: f64, end: f64) -> f64 {
    let counted: f64 = roots.iter().map(|r| turn_about(*r, start, end)).sum();
    let exact = argument(p, end) - argument(p, start);
    exact + 2.0 * PI * ((counted - exact) / (2.0 * PI)).round()
}

/// Change of arg(jω − root) for ω from `start` to `end`, within ±π.
fn turn_about(root: Complex64, start: f64, end: f64) -> f64 {
    let distance = root.re.abs();
    let angle = |omega: f64| if omega.is_infinite() { FRAC_PI_2 } else { (omega - root.im).atan2(distance) };
    let change = angle(end) - angle(start);
    if root.re > 0.0 { -change } else { change }
}

/// arg p(jω) up to whole turns, also in the limits ω → 0 and ω → ∞.
fn argument(p: &[f64], omega: f64) -> f64 {
    let of_term =
        |coefficient: f64, power: usize| power as f64 * FRAC_PI_2 + if coefficient < 0.0 { PI } else { 0.0 };
    if omega.is_infinite() {
        of_term(p[0], p.len() - 1)
    } else if omega == 0.0 {
        let power = p.iter().rev().position(|v| *v != 0.0).unwrap_or(0);
        of_term(p[p.len() - 1 - power], power)
    } else {
        let (re, im) = at_j_omega(p, omega);
        im.atan2(re)
    }
}

/// Smallest angle between L at a unit crossing and −1, in radians, and the delay that closes it in seconds.
pub(super) fn angle_to_critical(l: Complex64) -> (f64, f64) {
    let lag = l.arg() + PI;
    let lag = if lag <= 0.0 { lag + 2.0 * PI } else { lag };
    (lag.min(2.0 * PI - lag), lag)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::PidGains;
    use crate::model::ProcessModel;

    /// Roots found one by one put one of these eight equal lags into the right half-plane.
    #[test]
    fn eight_equal_lags_are_not_called_unstable() {
        let den: Vec<f64> = (0..8).fold(vec![1.0], |c, _| product(&c, &[4.33, 1.0]));
        let model = ProcessModel::rational(&[4.7], &den, 0.0).expect("a model");
        let open = OpenLoop::new(&model, &PidGains { n: 4.9, ..PidGains::pid(0.045, 12.4, 2.06) });
        assert!(is_stable(&open, &gain_crossings(&open)));
    }
}
