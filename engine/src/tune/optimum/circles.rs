//! Limits as circles in the plane of C.
//!
//! With t the square of the limit, in units that each limit brings along,
//!
//! ```text
//! |S| ≤ Ms     |C + 1/G| ≥ 1/(Ms |G|)                     forbidden: about −1/G
//! |T| ≤ Mt     |C|² ≤ t |C + 1/G|²,   t = Mt²
//! |C S| ≤ Ju   the same,              t = Ju² |G|²
//! ```
//!
//! the last two are circles about −t/(t − 1)/G with radius √t/|t − 1|/|G|: forbidden inside for t > 1, outside for t < 1. Near
//! t = 1 the circle is all but a straight line, and its quadratic in x is solved as it stands.

use super::points::Points;
use super::problem::LoopLimits;
use super::slice::Shaped;

/// Distance of t from 1 within which a circle is taken for a line.
const STRAIGHT: f64 = 1e-3;

/// A limit's circles at every point that C must keep out of.
#[derive(Debug, Default)]
pub(super) struct Forbidden {
    centre_re: Vec<f64>,
    pub centre_im: Vec<f64>,
    /// Squares of the radii; −∞ where nothing is forbidden.
    radius_sqr: Vec<f64>,
}

impl Forbidden {
    fn clear(&mut self, points: usize) {
        for of in [&mut self.centre_re, &mut self.centre_im, &mut self.radius_sqr] {
            of.clear();
            of.reserve(points);
        }
    }

    fn push(&mut self, centre_re: f64, centre_im: f64, radius_sqr: f64) {
        self.centre_re.push(centre_re);
        self.centre_im.push(centre_im);
        self.radius_sqr.push(radius_sqr);
    }

    /// Square of half the chord that each circle cuts out of the line of a gain; not above 0 where it cuts none.
    pub fn room(&self, shaped: &Shaped<'_>, kp: f64, room: &mut Vec<f64>) {
        let n = self.radius_sqr.len();
        room.resize(n, 0.0);
        let (radius_sqr, centre_re) = (&self.radius_sqr[..n], &self.centre_re[..n]);
        let (f_re, room) = (&shaped.f_re[..n], &mut room[..n]);
        for i in 0..n {
            let away = kp * f_re[i] - centre_re[i];
            room[i] = radius_sqr[i] - away * away;
        }
    }
}

/// No x at all.
const NOWHERE: (f64, f64) = (f64::INFINITY, 0.0);

/// A circle that C must stay in.
#[derive(Debug, Clone, Copy)]
pub(super) struct Inside {
    pub point: usize,
    centre_re: f64,
    centre_im: f64,
    radius_sqr: f64,
}

impl Inside {
    /// The x within it, below 0 as well.
    #[inline]
    pub fn inside(&self, shaped: &Shaped<'_>, kp: f64) -> (f64, f64) {
        let away = kp * shaped.f_re[self.point] - self.centre_re;
        let room = self.radius_sqr - away * away;
        if room < 0.0 {
            return NOWHERE;
        }
        let (centre, root) = (kp * shaped.f_im[self.point] - self.centre_im, room.sqrt());
        (centre - root, centre + root)
    }
}

/// A circle so large that it is all but a line, whichever side of it is free: `(t − 1) x² − 2 q₁ x + q₀ ≥ 0`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Turned {
    pub point: usize,
    t: f64,
    inverse_re: f64,
    inverse_im: f64,
}

/// The x that it leaves, or those that it takes.
pub(super) enum Side {
    Leaves(f64, f64),
    Takes(Option<(f64, f64)>),
}

impl Turned {
    /// What it does to the x of a gain.
    pub fn side(&self, shaped: &Shaped<'_>, kp: f64) -> Side {
        /// Distance of t from 1 that is rounding.
        const ROUNDING: f64 = 1e-12;
        let (re, im) = (kp * shaped.f_re[self.point], kp * shaped.f_im[self.point]);
        let (from_re, from_im) = (re + self.inverse_re, im + self.inverse_im);
        let q1 = self.t * from_im - im;
        let q0 = self.t * (from_re * from_re + from_im * from_im) - (re * re + im * im);
        let q2 = self.t - 1.0;
        if q2 > ROUNDING {
            return Side::Takes(forbidden(q2, q1, q0));
        }
        let (low, high) = between_roots(if q2 < -ROUNDING { q2 } else { 0.0 }, q1, q0);
        Side::Leaves(low, high)
    }
}

/// Positive x with q2 x² − 2 q1 x + q0 < 0 for q2 > 0.
fn forbidden(q2: f64, q1: f64, q0: f64) -> Option<(f64, f64)> {
    if q0 >= 0.0 && q1 <= 0.0 {
        return None;
    }
    let discriminant = q1 * q1 - q2 * q0;
    if discriminant <= 0.0 {
        return None;
    }
    let root = discriminant.sqrt();
    if q1 > 0.0 {
        let far = q1 + root;
        Some(((q0 / far).max(0.0), far / q2))
    } else {
        // q0 < 0: one root on each side of 0.
        Some((0.0, q0 / (q1 - root)))
    }
}

/// Where q2 x² − 2 q1 x + q0 ≥ 0 for q2 ≤ 0: between the roots; an empty interval where nowhere.
fn between_roots(q2: f64, q1: f64, q0: f64) -> (f64, f64) {
    if q2 == 0.0 {
        return match (q1 > 0.0, q0 >= 0.0) {
            (true, _) => (0.0, q0 / (2.0 * q1)),
            (false, true) => (0.0, f64::INFINITY),
            (false, false) => (if q1 < 0.0 { q0 / (2.0 * q1) } else { f64::INFINITY }, f64::INFINITY),
        };
    }
    let discriminant = q1 * q1 - q2 * q0;
    if discriminant < 0.0 {
        return NOWHERE;
    }
    let root = discriminant.sqrt();
    // Of both roots the one without cancellation first, the other by their product.
    let sum = if q1 > 0.0 { q1 + root } else { q1 - root };
    let (one, two) = (sum / q2, if sum == 0.0 { 0.0 } else { q0 / sum });
    (one.min(two).max(0.0), one.max(two))
}

/// All limits on some points.
#[derive(Debug, Default)]
pub(super) struct Circles {
    /// Those of Ms, Mt and Ju, as far as they are limits.
    kinds: [Forbidden; 3],
    used: usize,
    pub inside: Vec<Inside>,
    pub turned: Vec<Turned>,
}

impl Circles {
    pub fn set(&mut self, points: &Points, limits: &LoopLimits) {
        self.used = 0;
        self.inside.clear();
        self.turned.clear();
        let least = 1.0 / (limits.ms * limits.ms);
        if least > 0.0 {
            let kind = &mut self.kinds[0];
            kind.clear(points.len());
            for (i, (&re, &im)) in points.inverse_re.iter().zip(&points.inverse_im).enumerate() {
                kind.push(-re, -im, least / points.g_sqr[i]);
            }
            self.used = 1;
        }
        let t_sqr = limits.mt * limits.mt;
        if t_sqr.is_finite() {
            self.push_ratios(points, |g_sqr| (t_sqr, t_sqr / g_sqr));
        }
        let u_sqr = limits.ju * limits.ju;
        if u_sqr.is_finite() {
            self.push_ratios(points, |g_sqr| (u_sqr * g_sqr, u_sqr));
        }
    }

    /// |C|² ≤ t |C + 1/G|², from t and t/|G|² as |G|² gives them.
    fn push_ratios(&mut self, points: &Points, t_of: impl Fn(f64) -> (f64, f64)) {
        let kind = &mut self.kinds[self.used];
        kind.clear(points.len());
        for i in 0..points.len() {
            let ((t, over), re, im) = (t_of(points.g_sqr[i]), points.inverse_re[i], points.inverse_im[i]);
            let share = if t > 1.0 { 1.0 / (1.0 - 1.0 / t) } else { t / (t - 1.0) };
            let (centre_re, centre_im) = (-share * re, -share * im);
            let radius_sqr = over / ((t - 1.0) * (t - 1.0));
            if (t - 1.0).abs() < STRAIGHT {
                self.turned.push(Turned { point: i, t, inverse_re: re, inverse_im: im });
                kind.push(0.0, 0.0, f64::NEG_INFINITY);
            } else if t > 1.0 {
                kind.push(centre_re, centre_im, radius_sqr);
            } else {
                self.inside.push(Inside { point: i, centre_re, centre_im, radius_sqr });
                kind.push(0.0, 0.0, f64::NEG_INFINITY);
            }
        }
        self.used += 1;
    }

    /// The circles of each limit that C must keep out of.
    pub fn forbidden(&self) -> &[Forbidden] {
        &self.kinds[..self.used]
    }
}
