//! All Ki at one Kp: which of them meet every limit, and which of those is best.
//!
//! At a fixed Kp, with x = Ki/ω and P = G·F, F = 1 + s Td/(1 + s Tf), each limit is at each frequency a quadratic
//! inequality in x:
//!
//! ```text
//! |1 + L|² = N(x) = |G|² x² − 2 m x + a,   a = |1 + Kp P|²,   m = |G|² Kp Im F − Im G
//! |S| ≤ Ms     N ≥ 1/Ms²
//! |T| ≤ Mt     Mt² N ≥ |G|² (x² − 2 Kp Im F x + Kp² |F|²)
//! |C S| ≤ Ju   Ju² N ≥        x² − 2 Kp Im F x + Kp² |F|²
//! ```
//!
//! so the Ki that meet them all come out in closed form as a few intervals. The load sensitivity is as simple: with
//! D = ω² N/|G|² = Ki² − 2 p Ki + q, p = ω m/|G|², q = ω² a/|G|², 1/Jv² is Ki² plus the lower envelope of straight lines,
//! to which the limit ω → 0, Jv ≥ 1/Ki, adds the line 0. Source of the idea: Åström, Panagopoulos and Hägglund,
//! Design of PI controllers based on non-convex optimization, Automatica 34, 1998; the closed form in Ki is our own.

use super::points::Points;
use super::problem::LoopLimits;

/// Td and Tf of a PID controller in seconds; both 0 for PI.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Lead {
    pub td_s: f64,
    pub tf_s: f64,
}

impl Lead {
    pub const NONE: Self = Self { td_s: 0.0, tf_s: 0.0 };

    /// F(∞).
    pub fn high(&self) -> f64 {
        if self.td_s == 0.0 { 1.0 } else { 1.0 + self.td_s / self.tf_s }
    }
}

/// Points with P = G·F at each.
#[derive(Debug, Clone)]
pub(super) struct Shaped<'a> {
    pub points: &'a Points,
    pub lead: Lead,
    f_im: Vec<f64>,
    f_sqr: Vec<f64>,
    pub p_re: Vec<f64>,
    pub p_im: Vec<f64>,
    p_sqr: Vec<f64>,
}

impl<'a> Shaped<'a> {
    pub fn new(points: &'a Points, lead: Lead) -> Self {
        let n = points.len();
        let mut shaped = Self {
            points,
            lead,
            f_im: vec![0.0; n],
            f_sqr: vec![1.0; n],
            p_re: points.g_re.clone(),
            p_im: points.g_im.clone(),
            p_sqr: points.g_sqr.clone(),
        };
        if lead.td_s == 0.0 {
            return shaped;
        }
        for i in 0..n {
            let omega = points.omega[i];
            let filter = omega * lead.tf_s;
            let im = omega * lead.td_s / (1.0 + filter * filter);
            let re = 1.0 + im * filter;
            let sqr = re * re + im * im;
            (shaped.f_im[i], shaped.f_sqr[i]) = (im, sqr);
            shaped.p_re[i] = points.g_re[i] * re - points.g_im[i] * im;
            shaped.p_im[i] = points.g_re[i] * im + points.g_im[i] * re;
            shaped.p_sqr[i] = points.g_sqr[i] * sqr;
        }
        shaped
    }
}

/// Intervals of Ki that meet every limit at every point, rising; the last may end at ∞.
#[derive(Debug, Default)]
pub(super) struct Allowed {
    pub intervals: Vec<(f64, f64)>,
    forbidden: Vec<(f64, f64)>,
}

/// Neighbouring frequencies forbid overlapping stretches: they are joined as they come.
struct Joining {
    open: Option<(f64, f64)>,
}

impl Joining {
    fn add(&mut self, low: f64, high: f64, to: &mut Vec<(f64, f64)>) {
        match &mut self.open {
            Some(open) if low <= open.1 && high >= open.0 => {
                open.0 = open.0.min(low);
                open.1 = open.1.max(high);
            }
            open => to.extend(open.replace((low, high))),
        }
    }
}

/// Positive x with q2 x² − 2 q1 x + q0 < 0 for q2 > 0.
#[inline]
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

impl Allowed {
    /// Fills the intervals for a gain; there may be none.
    pub fn at(&mut self, shaped: &Shaped<'_>, limits: &LoopLimits, kp: f64) {
        let points = shaped.points;
        self.intervals.clear();
        self.forbidden.clear();
        let (mut lowest, mut highest) = (0.0f64, f64::INFINITY);
        let mut joining = [const { Joining { open: None } }; 3];
        let s_level = 1.0 / (limits.ms * limits.ms);
        let (t_sqr, u_sqr) = (limits.mt * limits.mt, limits.ju * limits.ju);
        let kp_sqr = kp * kp;
        for i in 0..points.len() {
            let (omega, g_sqr) = (points.omega[i], points.g_sqr[i]);
            let a = 1.0 + 2.0 * kp * shaped.p_re[i] + kp_sqr * shaped.p_sqr[i];
            let m = kp * g_sqr * shaped.f_im[i] - points.g_im[i];
            if let Some((low, high)) = forbidden(g_sqr, m, a - s_level) {
                joining[0].add(low * omega, high * omega, &mut self.forbidden);
            }
            if t_sqr.is_finite() {
                let q2 = (t_sqr - 1.0) * g_sqr;
                let q1 = t_sqr * m - g_sqr * kp * shaped.f_im[i];
                let q0 = t_sqr * a - kp_sqr * shaped.p_sqr[i];
                if q2 > 1e-12 * g_sqr {
                    if let Some((low, high)) = forbidden(q2, q1, q0) {
                        joining[1].add(low * omega, high * omega, &mut self.forbidden);
                    }
                } else if q1 > 0.0 {
                    highest = highest.min(omega * q0 / (2.0 * q1));
                } else if q0 < 0.0 {
                    lowest = if q1 < 0.0 { lowest.max(omega * q0 / (2.0 * q1)) } else { f64::INFINITY };
                }
            }
            if u_sqr.is_finite() {
                let q2 = u_sqr * g_sqr - 1.0;
                let q1 = u_sqr * m - kp * shaped.f_im[i];
                let q0 = u_sqr * a - kp_sqr * shaped.f_sqr[i];
                if q2 > 0.0 {
                    if let Some((low, high)) = forbidden(q2, q1, q0) {
                        joining[2].add(low * omega, high * omega, &mut self.forbidden);
                    }
                } else {
                    let (low, high) = between_roots(q2, q1, q0);
                    lowest = lowest.max(low * omega);
                    highest = highest.min(high * omega);
                }
            }
        }
        self.forbidden.extend(joining.iter().filter_map(|j| j.open));
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

/// Where q2 x² − 2 q1 x + q0 ≥ 0 for q2 ≤ 0: between the roots; an empty interval where nowhere.
fn between_roots(q2: f64, q1: f64, q0: f64) -> (f64, f64) {
    const NOWHERE: (f64, f64) = (f64::INFINITY, 0.0);
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

/// 1/Jv² over Ki at one Kp: Ki² plus the lower envelope of the lines q − 2 p Ki.
#[derive(Debug, Default)]
pub(super) struct LoadEnvelope {
    p: Vec<f64>,
    q: Vec<f64>,
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
        for i in 0..n {
            let g_sqr = points.g_sqr[i];
            let a = 1.0 + 2.0 * kp * shaped.p_re[i] + kp * kp * shaped.p_sqr[i];
            let scale = points.omega[i] / g_sqr;
            self.p[i] = scale * (kp * g_sqr * shaped.f_im[i] - points.g_im[i]);
            self.q[i] = scale * points.omega[i] * a;
        }
    }

    /// The lowest line at a Ki; the limit ω → 0 is the line 0.
    fn lowest(&self, ki: f64) -> EnvelopeLine {
        let (mut best, mut value) = (EnvelopeLine { p: 0.0, q: 0.0 }, 0.0);
        let twice = 2.0 * ki;
        for (p, q) in self.p.iter().zip(&self.q) {
            let line = q - twice * p;
            if line < value {
                (best, value) = (EnvelopeLine { p: *p, q: *q }, line);
            }
        }
        best
    }

    /// The Ki between two that gives the least Jv, with that Jv.
    pub fn best(&self, low: f64, high: f64) -> (f64, f64) {
        const STEPS: usize = 40;
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
