//! All Ki at one Kp: which of them meet every limit, and which of those is best.
//!
//! At a fixed Kp, with x = Ki/ω and F = 1 + s Td/(1 + s Tf), the controller C = Kp F − jx moves along a straight line at
//! each frequency, and each limit is a circle that it must not enter, or not leave ([`super::circles`]):
//!
//! ```text
//! |C − c|² = r² + (x − ξ)²,   r = Kp Re F − Re c,   ξ = Kp Im F − Im c
//! ```
//!
//! so the Ki that meet them all come out in closed form as a few intervals, and a frequency whose circle the line misses
//! costs a product and a comparison. The load sensitivity is as simple: with c = −1/G, ω² |C − c|² = Ki² − 2 p Ki + q,
//! p = ω ξ, q = ω² (ξ² + r²), and 1/Jv² is Ki² plus the lower envelope of straight lines, to which the limit ω → 0,
//! Jv ≥ 1/Ki, adds the line 0. Source of the idea: Åström, Panagopoulos and Hägglund, Design of PI controllers based on
//! non-convex optimization, Automatica 34, 1998; the closed form in Ki is our own.

use super::circles::{Circles, Side};
use super::points::Points;
use super::problem::LoopLimits;
use crate::control::ParallelGains;

/// Td and Tf of a PID controller in seconds; both 0 for PI.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Lead {
    pub td_s: f64,
    pub tf_s: f64,
}

impl Lead {
    pub const NONE: Self = Self { td_s: 0.0, tf_s: 0.0 };

    /// Those of a controller of the parallel form.
    pub fn of(gains: &ParallelGains) -> Self {
        if gains.kd == 0.0 { Self::NONE } else { Self { td_s: gains.kd / gains.kp, tf_s: gains.tf_s } }
    }

    /// F(∞).
    pub fn high(&self) -> f64 {
        if self.td_s == 0.0 { 1.0 } else { 1.0 + self.td_s / self.tf_s }
    }
}

/// Points with F at each.
#[derive(Debug, Clone)]
pub(super) struct Shaped<'a> {
    pub points: &'a Points,
    pub lead: Lead,
    pub f_re: Vec<f64>,
    pub f_im: Vec<f64>,
}

impl<'a> Shaped<'a> {
    pub fn new(points: &'a Points, lead: Lead) -> Self {
        let n = points.len();
        let mut shaped = Self { points, lead, f_re: vec![1.0; n], f_im: vec![0.0; n] };
        if lead.td_s > 0.0 {
            for ((omega, re), im) in points.omega.iter().zip(&mut shaped.f_re).zip(&mut shaped.f_im) {
                let filter = omega * lead.tf_s;
                *im = omega * lead.td_s / (1.0 + filter * filter);
                *re = 1.0 + *im * filter;
            }
        }
        shaped
    }

    /// P = G·F at a point, real and imaginary part.
    pub fn process(&self, i: usize) -> (f64, f64) {
        let (g_re, g_im) = (self.points.g_re[i], self.points.g_im[i]);
        let (f_re, f_im) = (self.f_re[i], self.f_im[i]);
        (g_re * f_re - g_im * f_im, g_re * f_im + g_im * f_re)
    }
}

/// Intervals of Ki that meet every limit at every point, rising; the last may end at ∞.
#[derive(Debug, Default)]
pub(super) struct Allowed {
    pub intervals: Vec<(f64, f64)>,
    circles: Circles,
    forbidden: Vec<(f64, f64)>,
    /// Squares of what a line leaves of a circle's radius.
    room: Vec<f64>,
}

/// Neighbouring frequencies forbid overlapping stretches: they are joined as they come.
struct Joining {
    open: Option<(f64, f64)>,
}

impl Joining {
    fn add(&mut self, low: f64, high: f64, to: &mut Vec<(f64, f64)>) {
        match &mut self.open {
            Some(open) if low <= open.1 && high >= open.0 => {
                // Plain comparisons: none of them is no number.
                if low < open.0 {
                    open.0 = low;
                }
                if high > open.1 {
                    open.1 = high;
                }
            }
            open => to.extend(open.replace((low, high))),
        }
    }
}

impl Allowed {
    /// Takes the limits that [`Self::at`] goes by, on these points.
    pub fn limit(&mut self, points: &Points, limits: &LoopLimits) {
        self.circles.set(points, limits);
    }

    /// Fills the intervals for a gain; there may be none.
    pub fn at(&mut self, shaped: &Shaped<'_>, kp: f64) {
        self.intervals.clear();
        self.forbidden.clear();
        let Self { circles, forbidden, room, .. } = self;
        let (mut lowest, mut highest) = (0.0f64, f64::INFINITY);
        let omega = &shaped.points.omega;
        let mut keep_in = |low: f64, high: f64| {
            if low > lowest {
                lowest = low;
            }
            if high < highest {
                highest = high;
            }
        };
        for circle in &circles.inside {
            let (low, high) = circle.inside(shaped, kp);
            keep_in(low * omega[circle.point], high * omega[circle.point]);
        }
        for circle in &circles.turned {
            let omega = omega[circle.point];
            match circle.side(shaped, kp) {
                Side::Leaves(low, high) => keep_in(low * omega, high * omega),
                Side::Takes(taken) => forbidden.extend(taken.map(|(low, high)| (low * omega, high * omega))),
            }
        }
        if lowest >= highest {
            return;
        }
        for kind in circles.forbidden() {
            kind.room(shaped, kp, room);
            let mut joining = Joining { open: None };
            let places = shaped.f_im.iter().zip(&kind.centre_im).zip(omega);
            for (&room, ((f_im, centre_im), omega)) in room.iter().zip(places) {
                if room > 0.0 {
                    let (centre, root) = (kp * f_im - centre_im, room.sqrt());
                    if centre + root > 0.0 {
                        joining.add((centre - root) * omega, (centre + root) * omega, forbidden);
                    }
                }
            }
            forbidden.extend(joining.open);
        }
        self.complement(lowest, highest);
    }

    fn complement(&mut self, lowest: f64, highest: f64) {
        self.forbidden.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let mut from = lowest;
        for &(low, high) in &self.forbidden {
            if low >= highest {
                break;
            }
            if low > from {
                self.intervals.push((from, low));
            }
            from = from.max(high);
        }
        if highest > from {
            self.intervals.push((from, highest));
        }
    }
}

/// 1/Jv² over Ki at one Kp: Ki² plus the lower envelope of the lines q − 2 p Ki.
#[derive(Debug, Default)]
pub(super) struct LoadEnvelope {
    p: Vec<f64>,
    q: Vec<f64>,
    /// The lines that come below 0 between the Ki under search.
    low: Vec<EnvelopeLine>,
}

/// A line of the envelope.
#[derive(Debug, Clone, Copy)]
struct EnvelopeLine {
    p: f64,
    q: f64,
}

impl LoadEnvelope {
    pub fn at(&mut self, shaped: &Shaped<'_>, kp: f64) {
        let points = shaped.points;
        let n = points.len();
        self.p.resize(n, 0.0);
        self.q.resize(n, 0.0);
        let (omega, re, im) = (&points.omega[..n], &points.inverse_re[..n], &points.inverse_im[..n]);
        let (f_re, f_im, p, q) = (&shaped.f_re[..n], &shaped.f_im[..n], &mut self.p[..n], &mut self.q[..n]);
        for i in 0..n {
            let away = omega[i] * (re[i] + kp * f_re[i]);
            p[i] = omega[i] * (im[i] + kp * f_im[i]);
            q[i] = p[i] * p[i] + away * away;
        }
    }

    /// Keeps the lines that come below 0 between two Ki; a line that does not at either does not between them.
    fn keep_low(&mut self, low: f64, high: f64) {
        self.low.clear();
        for (&p, &q) in self.p.iter().zip(&self.q) {
            if (q < 2.0 * p * low) | (q < 2.0 * p * high) {
                self.low.push(EnvelopeLine { p, q });
            }
        }
    }

    /// The lowest line at a Ki; the limit ω → 0 is the line 0.
    fn lowest(&self, ki: f64) -> EnvelopeLine {
        let (mut best, mut value) = (EnvelopeLine { p: 0.0, q: 0.0 }, 0.0);
        for line in &self.low {
            let here = line.q - 2.0 * line.p * ki;
            if here < value {
                (best, value) = (*line, here);
            }
        }
        best
    }

    /// The Ki between two that gives the least Jv, with that Jv.
    pub fn best(&mut self, low: f64, high: f64) -> (f64, f64) {
        const STEPS: usize = 40;
        self.keep_low(low, high);
        let value = |ki: f64, line: EnvelopeLine| ki * ki + line.q - 2.0 * line.p * ki;
        let (mut left, mut right) = ((low, self.lowest(low)), (high, self.lowest(high)));
        let mut best = (high, value(high, right.1));
        let mut take = |ki: f64, line: EnvelopeLine| {
            let v = value(ki, line);
            if v > best.1 {
                best = (ki, v);
            }
        };
        take(left.0, left.1);
        // Where 1/Jv² still rises at the right end nothing to the left is better.
        if right.0 < right.1.p && left.0 >= left.1.p {
            for _ in 0..STEPS {
                let slopes = right.1.p - left.1.p;
                let crossing = 0.5 * (right.1.q - left.1.q) / slopes;
                let inside = crossing > left.0 && crossing < right.0;
                let ki = if inside { crossing } else { 0.5 * (left.0 + right.0) };
                let line = self.lowest(ki);
                take(ki, line);
                let met = value(ki, line) >= value(ki, left.1) * (1.0 - 1e-12);
                if inside && met || right.0 - left.0 < 1e-9 * right.0 {
                    break;
                }
                if ki >= line.p {
                    left = (ki, line);
                } else {
                    right = (ki, line);
                }
            }
        }
        (best.0, if best.1 > 0.0 { 1.0 / best.1.sqrt() } else { f64::INFINITY })
    }
}
