//! Gauss–Newton over the non-linear unknowns with Levenberg–Marquardt damping.

use std::cell::Cell;

use super::fill::grams;
use super::project::{Projected, Symmetric, project};
use super::shape::{Linear, Order, Point, Shape};
use crate::identify::damped::descend;
use crate::identify::problem::Stretch;

/// A step below this many standard errors changes nothing a reader could see.
const STEP_IN_STANDARD_ERRORS: [f64; 2] = [1e-4, 1e-3];
/// Rows above which the larger of the two will do: passes are dear there.
const MANY_ROWS: usize = 5000;
/// A step this small is at the end of the digits.
const STEP_AT_ROUNDING: f64 = 1e-12;
/// Largest change of ln T, ln τ, ln ζ, L/T in a step.
const LARGEST_STEP: f64 = 1.5;
/// Where ζ may lie: a ring below the one never dies in a record, two time constants above the other are one.
const ZETA: [f64; 2] = [0.01, 30.0];

/// Where the unknowns may lie.
#[derive(Debug, Clone, Copy)]
pub(in crate::identify) struct Bounds {
    pub time_s: [f64; 2],
    pub dead_time_s: f64,
    /// For the time of a load.
    pub load_s: f64,
}

impl Bounds {
    /// From a thirtieth of the sample time to a hundred stretches.
    pub fn of(stretch: &Stretch) -> Self {
        Self {
            time_s: [stretch.sample_time_s / 30.0, 100.0 * stretch.span_s()],
            dead_time_s: 0.9 * stretch.span_s(),
            load_s: stretch.span_s() + stretch.t[0] - stretch.origin_s,
        }
    }

    /// The points of a shape within the bounds.
    pub fn clip_all(&self, shape: &Shape, points: &[Point]) -> Vec<Point> {
        let load = |i: usize| i >= shape.inputs();
        let within = |i: usize| if load(i) { Self { dead_time_s: self.load_s, ..*self } } else { *self };
        points.iter().enumerate().map(|(i, p)| within(i).clip(shape.channels[i], *p)).collect()
    }

    pub fn clip(&self, order: Order, p: Point) -> Point {
        Point {
            time_s: match order {
                Order::Integrator | Order::Jump => p.time_s,
                _ => p.time_s.clamp(self.time_s[0], self.time_s[1]),
            },
            zeta: p.zeta.clamp(ZETA[0], ZETA[1]),
            dead_time_s: p.dead_time_s.clamp(0.0, self.dead_time_s),
        }
    }
}

/// A point of the search with everything its pass gave.
#[derive(Debug, Clone)]
pub(in crate::identify) struct Found {
    pub points: Vec<Point>,
    pub projected: Projected,
}

impl Found {
    pub fn rss(&self) -> f64 {
        self.projected.rss
    }
}

/// One pass.
pub(in crate::identify) fn evaluate(
    stretch: &Stretch,
    shape: &Shape,
    points: Vec<Point>,
    reference: &Linear,
) -> Option<Found> {
    let grams = grams(stretch, shape, &points, reference);
    let projected = project(&grams, shape, reference)?;
    projected.rss.is_finite().then_some(Found { points, projected })
}

/// A refinement: how far it goes.
#[derive(Debug, Clone, Copy)]
pub(in crate::identify) struct Refinement<'a> {
    pub stretch: &'a Stretch<'a>,
    pub shape: &'a Shape,
    /// Most passes.
    pub passes: usize,
    /// The unknown held where it is.
    pub fixed: Option<usize>,
    /// A channel and two dead times: once between them it is given up, for the cost is smooth there and its minimum known.
    pub known: Option<(usize, [f64; 2])>,
}

/// Refines a start with at most `passes` passes, which it counts.
pub(in crate::identify) fn refine(
    stretch: &Stretch,
    shape: &Shape,
    start: &[Point],
    passes: usize,
    count: &mut usize,
) -> Option<Found> {
    Refinement { stretch, shape, passes, fixed: None, known: None }.from(start, count)
}

impl Refinement<'_> {
    /// The point reached, and the passes taken added to `count`.
    pub fn from(&self, start: &[Point], count: &mut usize) -> Option<Found> {
        let Self { stretch, shape, .. } = *self;
        let bounds = Bounds::of(stretch);
        let clip = |points: &[Point]| bounds.clip_all(shape, points);
        *count += 1;
        let start = evaluate(stretch, shape, clip(start), &Linear::zero(shape, stretch))?;
        let spare = stretch.kept().saturating_sub(shape.parameters(stretch)).max(1) as f64;
        let tolerance = STEP_IN_STANDARD_ERRORS[usize::from(stretch.len() > MANY_ROWS)];
        let valley = Valley::new();
        let step = |at: &Found, damping: f64| {
            let variance = at.rss() / spare;
            if self.is_known(at) || valley.is_flat(at.rss(), tolerance * variance) {
                return None;
            }
            let reduced = Reduced::of(&at.projected, &held(shape, &at.points, self.fixed));
            let target = clip(&moved(shape, &at.points, &reduced.step(damping)));
            let taken = difference(shape, &at.points, &target);
            (!reduced.is_small(&taken, variance, tolerance)).then_some(target)
        };
        let pass =
            |target: Vec<Point>, best: &Found| evaluate(stretch, shape, target, &best.projected.linear);
        Some(descend(start, self.passes, count, Found::rss, step, pass))
    }

    fn is_known(&self, at: &Found) -> bool {
        self.known.is_some_and(|(channel, [from, to])| {
            let dead_time_s = at.points[channel].dead_time_s;
            from < dead_time_s && dead_time_s < to
        })
    }
}

/// Tells that a descent has come to the floor of a valley, along which long steps gain nothing: a zero on a time constant
/// leaves both free, and what is told has long been found.
struct Valley {
    last: Cell<f64>,
    slow: Cell<usize>,
}

impl Valley {
    /// Gains in turn that are worth nothing.
    const SLOW: usize = 3;

    fn new() -> Self {
        Self { last: Cell::new(f64::INFINITY), slow: Cell::new(0) }
    }

    /// Whether the last gains were each below `worth`.
    fn is_flat(&self, rss: f64, worth: f64) -> bool {
        let gain = self.last.replace(rss) - rss;
        if gain > 0.0 {
            self.slow.set(if gain < worth { self.slow.get() + 1 } else { 0 });
        }
        self.slow.get() >= Self::SLOW
    }
}

/// For each unknown: which way it may not go.
fn held(shape: &Shape, points: &[Point], fixed: Option<usize>) -> Vec<Side> {
    let mut out = Vec::with_capacity(shape.unknowns);
    for (order, p) in shape.channels.iter().zip(points) {
        if let Order::Second { .. } = order {
            out.push(Side::None);
            out.push(if p.zeta >= ZETA[1] {
                Side::Up
            } else if p.zeta <= ZETA[0] {
                Side::Down
            } else {
                Side::None
            });
        } else if *order == Order::First {
            out.push(Side::None);
        }
        if *order != Order::Jump {
            out.push(if p.dead_time_s <= 0.0 { Side::Down } else { Side::None });
        }
    }
    if let Some(fixed) = fixed {
        out[fixed] = Side::Both;
    }
    out
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Side {
    None,
    Down,
    Up,
    Both,
}

fn moved(shape: &Shape, points: &[Point], step: &[f64]) -> Vec<Point> {
    let mut k = 0;
    let mut take = || {
        k += 1;
        step[k - 1]
    };
    shape
        .channels
        .iter()
        .zip(points)
        .map(|(order, p)| {
            let mut q = *p;
            match order {
                Order::First => q.time_s *= take().clamp(-LARGEST_STEP, LARGEST_STEP).exp(),
                Order::Integrator => {}
                Order::Jump => return q,
                Order::Second { .. } => {
                    q.time_s *= take().clamp(-LARGEST_STEP, LARGEST_STEP).exp();
                    q.zeta *= take().clamp(-LARGEST_STEP, LARGEST_STEP).exp();
                }
            }
            q.dead_time_s += take() * p.time_s;
            q
        })
        .collect()
}

fn difference(shape: &Shape, from: &[Point], to: &[Point]) -> Vec<f64> {
    let mut out = Vec::with_capacity(shape.unknowns);
    for ((order, a), b) in shape.channels.iter().zip(from).zip(to) {
        if *order == Order::Jump {
            continue;
        }
        if *order != Order::Integrator {
            out.push((b.time_s / a.time_s).ln());
        }
        if let Order::Second { .. } = order {
            out.push((b.zeta / a.zeta).ln());
        }
        out.push((b.dead_time_s - a.dead_time_s) / a.time_s);
    }
    out
}

/// Normal equations of the non-linear unknowns alone.
struct Reduced {
    h: Symmetric,
    g: Vec<f64>,
    held: Vec<Side>,
}

impl Reduced {
    fn of(projected: &Projected, held: &[Side]) -> Self {
        let (lin, n) = (projected.linear_count, held.len());
        let mut whole = Symmetric::zero(lin + n + 1);
        for i in 0..lin + n {
            for j in 0..lin + n {
                whole.set(i, j, projected.matrix.at(i, j));
            }
            whole.set(i, lin + n, projected.rhs[i]);
            whole.set(lin + n, i, projected.rhs[i]);
        }
        let scale: Vec<f64> = (0..=lin + n).map(|i| whole.at(i, i)).collect();
        whole.eliminate(0..lin, &scale);
        let mut h = Symmetric::zero(n);
        for i in 0..n {
            for j in 0..n {
                h.set(i, j, whole.at(lin + i, lin + j));
            }
        }
        Self { h, g: (0..n).map(|i| whole.at(lin + i, lin + n)).collect(), held: held.to_vec() }
    }

    /// Damped step; an unknown at its bound that would leave it stays.
    fn step(&self, damping: f64) -> Vec<f64> {
        let n = self.g.len();
        let mut free: Vec<usize> =
            (0..n).filter(|&i| self.h.at(i, i) > 0.0 && self.held[i] != Side::Both).collect();
        loop {
            let step = self.solve(damping, &free);
            let leaving = free.iter().position(|&i| match self.held[i] {
                Side::None | Side::Both => false,
                Side::Down => step[i] <= 0.0,
                Side::Up => step[i] >= 0.0,
            });
            match leaving {
                Some(at) => {
                    free.remove(at);
                }
                None => return step,
            }
        }
    }

    fn solve(&self, damping: f64, free: &[usize]) -> Vec<f64> {
        let mut step = vec![0.0; self.g.len()];
        let size = free.len();
        let mut m = Symmetric::zero(size + 1);
        for (a, &i) in free.iter().enumerate() {
            for (b, &j) in free.iter().enumerate() {
                let value = 0.5 * (self.h.at(i, j) + self.h.at(j, i));
                m.set(a, b, if a == b { value * (1.0 + damping) } else { value });
            }
            m.set(a, size, self.g[i]);
        }
        let scale: Vec<f64> = (0..=size).map(|a| m.at(a, a)).collect();
        let taken = m.eliminate(0..size, &scale);
        for (a, &i) in free.iter().enumerate() {
            if taken[a] {
                step[i] = m.at(a, size) / m.at(a, a);
            }
        }
        step
    }

    fn is_small(&self, step: &[f64], variance: f64, tolerance: f64) -> bool {
        step.iter().enumerate().all(|(i, step)| {
            // √(1/Hii) is the standard error with the others fixed: the smaller, hence safer, of the two.
            let h = self.h.at(i, i);
            let error = if h > 0.0 { (variance / h).sqrt() } else { 0.0 };
            step.abs() <= (tolerance * error).max(STEP_AT_ROUNDING)
        })
    }
}
