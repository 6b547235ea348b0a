//! One pass over the grid that finds the peaks of S, T, G·S/s and C·S, the phase crossings and the bandwidth.
//!
//! The peaks are sought as minima of the reciprocals' squares, |1 + L|² and its multiples: near an almost unstable
//! frequency these are parabolas, while the peaks themselves are needles.

use std::f64::consts::PI;

use num_complex::Complex64;

use super::OpenLoop;
use super::grid::{Grid, RIPPLE_STEP_RAD};
use super::open_loop::LoopPoint;
use super::search::{minimum, parabola, root};

/// Im L relative to |L| under which a refined frequency is a true phase crossing and not a jump through a pole.
const ON_THE_REAL_AXIS: f64 = 1e-6;
/// The four functions by their place in an array: S, T, G·S/s, C·S.
pub(super) const S: usize = 0;
pub(super) const T: usize = 1;
pub(super) const V: usize = 2;
pub(super) const U: usize = 3;

/// A frequency at which L is real and negative.
#[derive(Debug, Clone, Copy)]
pub(super) struct PhaseCrossing {
    pub omega: f64,
    /// |L| there.
    pub magnitude: f64,
}

/// Reciprocal squares of the four functions; 0 stands for an infinite one.
type Reciprocals = [f64; 4];

#[derive(Clone, Copy)]
struct Seen {
    omega: f64,
    l: Complex64,
    values: Reciprocals,
}

/// What the pass has found so far.
pub(super) struct Sweep<'a> {
    open: &'a OpenLoop,
    /// Smallest reciprocal squares, limits at ω → 0 and ω → ∞ included.
    pub lowest: Reciprocals,
    /// Their frequencies in rad/s; 0 and ∞ for the limits.
    pub lowest_at: [f64; 4],
    /// Crossing with the largest |L| < 1: the first that a higher gain moves onto −1.
    pub above: Option<PhaseCrossing>,
    /// Crossing with the smallest |L| > 1: the first that a lower gain moves onto −1.
    pub below: Option<PhaseCrossing>,
    /// Frequency at which |T| first falls under |T(0)|/√2.
    pub bandwidth: Option<f64>,
    half_power: f64,
    before: Option<Seen>,
    last: Option<Seen>,
}

impl<'a> Sweep<'a> {
    /// Starts from the limits of the loop.
    pub(super) fn new(open: &'a OpenLoop) -> Self {
        let (at_zero, at_infinity) = (limits_at_zero(open), limits_at_infinity(open));
        let lowest = std::array::from_fn(|k| {
            let limit: f64 = at_zero[k].max(at_infinity[k]);
            1.0 / (limit * limit)
        });
        let lowest_at =
            std::array::from_fn(|k| if at_zero[k] >= at_infinity[k] { 0.0 } else { f64::INFINITY });
        let half_power = 2.0 / (at_zero[T] * at_zero[T]);
        let mut sweep = Self {
            open,
            lowest,
            lowest_at,
            above: None,
            below: None,
            bandwidth: None,
            half_power,
            before: None,
            last: None,
        };
        sweep.cross_at_the_ends();
        sweep
    }

    /// L real and negative at ω = 0 or, without dead time or in the limit of its ripples, at ω → ∞.
    fn cross_at_the_ends(&mut self) {
        let (process, controller) = (self.open.process_low(), self.open.controller_low());
        let at_zero = process.coefficient * controller.coefficient;
        if process.power + controller.power == 0 && at_zero < 0.0 {
            self.keep(PhaseCrossing { omega: 0.0, magnitude: -at_zero });
        }
        let at_infinity = self.open.process_high() * self.open.controller_high();
        if at_infinity < 0.0 || (at_infinity > 0.0 && self.open.dead_time_s > 0.0) {
            self.keep(PhaseCrossing { omega: f64::INFINITY, magnitude: at_infinity.abs() });
        }
    }

    /// Looks at the whole grid, and among the ripples of the dead time only where their envelope promises more.
    pub(super) fn run(&mut self, grid: &Grid) {
        let split = grid.omegas.partition_point(|w| *w <= grid.ripples_from);
        for &omega in &grid.omegas[..split] {
            self.visit(omega);
        }
        if split < grid.omegas.len() {
            self.follow_envelopes(&grid.omegas[split.saturating_sub(1)..]);
        }
    }

    fn visit(&mut self, omega: f64) {
        let point = self.open.point(omega);
        if !(point.one_plus_l_sqr.is_finite() && point.g_sqr > 0.0) {
            return;
        }
        let seen = Seen { omega, l: point.l, values: reciprocals(omega, &point) };
        if let Some(last) = self.last {
            self.cross(&last, &seen);
            if let Some(before) = self.before {
                for k in 0..4 {
                    if last.values[k] < before.values[k] && last.values[k] <= seen.values[k] {
                        self.refine(k, &before, &last, &seen);
                    }
                }
            }
        }
        self.before = self.last;
        self.last = Some(seen);
    }

    fn refine(&mut self, k: usize, before: &Seen, last: &Seen, next: &Seen) {
        let [a, m, b] = [before, last, next].map(|p| (p.omega, p.values[k]));
        // Points this dense show a peak at half its height or more, and a needle far above all else.
        if m.1 > 4.0 * self.lowest[k] && m.1 - 4.0 * parabola(a, m, b).1 > self.lowest[k] {
            return;
        }
        let open = self.open;
        let (omega, low) = minimum(|omega| reciprocals(omega, &open.point(omega))[k], a, m, b);
        if low < self.lowest[k] {
            (self.lowest[k], self.lowest_at[k]) = (low, omega);
        }
    }

    fn cross(&mut self, a: &Seen, b: &Seen) {
        if self.bandwidth.is_none() && a.values[T] <= self.half_power && b.values[T] > self.half_power {
            let (open, level) = (self.open, self.half_power);
            let excess = |omega| reciprocals(omega, &open.point(omega))[T] / level - 1.0;
            let (left, right) = (a.values[T] / level - 1.0, b.values[T] / level - 1.0);
            self.bandwidth = Some(root(excess, (a.omega, left), (b.omega, right)));
        }
        if (a.l.im > 0.0) == (b.l.im > 0.0) {
            return;
        }
        let estimate = (b.l.re * a.l.im - a.l.re * b.l.im) / (a.l.im - b.l.im);
        let hopeless = self.above.is_some_and(|c| -estimate < 0.7 * c.magnitude)
            || self.below.is_some_and(|c| -estimate > 1.4 * c.magnitude);
        if a.l.re.min(b.l.re) >= 0.0 || hopeless {
            return;
        }
        let open = self.open;
        let slope = |l: Complex64| l.im / l.norm();
        let omega = root(|w| slope(open.at_omega(w)), (a.omega, slope(a.l)), (b.omega, slope(b.l)));
        let l = open.at_omega(omega);
        if l.re < 0.0 && l.im.abs() <= ON_THE_REAL_AXIS * l.norm() {
            self.keep(PhaseCrossing { omega, magnitude: l.norm() });
        }
    }

    fn keep(&mut self, crossing: PhaseCrossing) {
        if crossing.magnitude < 1.0 {
            if self.above.is_none_or(|c| crossing.magnitude > c.magnitude) {
                self.above = Some(crossing);
            }
        } else if self.below.is_none_or(|c| crossing.magnitude < c.magnitude) {
            self.below = Some(crossing);
        }
    }

    /// Where |L| < 1 every ripple stays inside 1/(1 − |L|); only ripples beside an envelope's maximum can be peaks.
    fn follow_envelopes(&mut self, omegas: &[f64]) {
        let open = self.open;
        let period = 2.0 * PI / open.dead_time_s;
        let envelope = |omega: f64| {
            let (l_sqr, g_sqr, c_sqr) = open.magnitudes_sqr(omega);
            let room = (1.0 - l_sqr.sqrt()).max(0.0).powi(2);
            [room, room / l_sqr, room * omega * omega / g_sqr, room / c_sqr, 1.0 / l_sqr]
        };
        let start = omegas[0];
        let mut start_seen = false;
        let mut previous: Option<(f64, [f64; 5])> = None;
        let mut current = (start, envelope(start));
        for &omega in &omegas[1..] {
            let next = (omega, envelope(omega));
            for k in 0..5 {
                let best = if k < 4 {
                    self.lowest[k]
                } else {
                    self.above.map_or(f64::INFINITY, |c| 1.0 / (c.magnitude * c.magnitude))
                };
                let is_low = current.1[k] <= next.1[k] && previous.is_none_or(|p| current.1[k] < p.1[k]);
                if !is_low {
                    continue;
                }
                match previous {
                    None if current.1[k] < best && !start_seen => {
                        start_seen = true;
                        self.scan((start - period).max(0.3 * start), start + 1.5 * period, omegas);
                    }
                    Some(p) => {
                        let triple = [p, current, next].map(|(w, e)| (w, e[k]));
                        let (centre, low) = minimum(|w| envelope(w)[k], triple[0], triple[1], triple[2]);
                        if low < best {
                            self.scan(
                                (centre - 1.25 * period).max(0.3 * start),
                                centre + 1.25 * period,
                                omegas,
                            );
                        }
                    }
                    None => {}
                }
            }
            previous = Some(current);
            current = next;
        }
    }

    /// Visits every eighth of a ripple between two frequencies, and the grid's own points among them.
    fn scan(&mut self, from: f64, to: f64, omegas: &[f64]) {
        (self.before, self.last) = (None, None);
        let step = RIPPLE_STEP_RAD / self.open.dead_time_s;
        let mut own = omegas.iter().copied().skip_while(|w| *w <= from).peekable();
        let mut omega = from;
        while omega <= to {
            self.visit(omega);
            omega += step;
            while let Some(w) = own.next_if(|w| *w < omega) {
                self.visit(w);
            }
        }
    }
}

#[inline]
fn reciprocals(omega: f64, p: &LoopPoint) -> Reciprocals {
    let d = p.one_plus_l_sqr;
    // One division for |L|⁻², |G|⁻² and |C|⁻².
    let scaled = d / (p.g_sqr * p.c_sqr);
    [d, scaled, scaled * p.c_sqr * omega * omega, scaled * p.g_sqr]
}

/// |S|, |T|, |G S/s| and |C S| for ω → 0 of a stable loop, from the first terms of G and C.
fn limits_at_zero(open: &OpenLoop) -> [f64; 4] {
    let (g, c) = (open.process_low(), open.controller_low());
    let at_zero = |coefficient: f64, power: i32| match power.signum() {
        0 => coefficient.abs(),
        1 => 0.0,
        _ => f64::INFINITY,
    };
    let l0 = g.coefficient * c.coefficient;
    match (g.power + c.power).signum() {
        // L → ∞: S ≈ 1/L, G S/s ≈ 1/(s C), C S ≈ 1/G
        -1 => [0.0, 1.0, at_zero(1.0 / c.coefficient, -1 - c.power), at_zero(1.0 / g.coefficient, -g.power)],
        0 => {
            let s = 1.0 / (1.0 + l0);
            [
                s.abs(),
                (l0 * s).abs(),
                at_zero(g.coefficient * s, g.power - 1),
                at_zero(c.coefficient * s, c.power),
            ]
        }
        _ => [1.0, 0.0, at_zero(g.coefficient, g.power - 1), at_zero(c.coefficient, c.power)],
    }
}

/// |S|, |T|, |G S/s| and |C S| for ω → ∞; with dead time the largest value their ripples tend to.
fn limits_at_infinity(open: &OpenLoop) -> [f64; 4] {
    let (g, c) = (open.process_high(), open.controller_high());
    let l = g * c;
    let s = if open.dead_time_s > 0.0 { 1.0 / (1.0 - l.abs()) } else { 1.0 / (1.0 + l) };
    [s.abs(), (l * s).abs(), 0.0, (c * s).abs()]
}
