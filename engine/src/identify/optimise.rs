//! Gauss–Newton over (ln T, L/T) with Levenberg–Marquardt damping, the linear unknowns projected out.

use super::damped::descend;
use super::gram::{Linear, Projected, project};
use super::problem::Stretch;
use super::response::{Dynamics, pass};

/// A step below this many standard errors changes nothing a reader could see; and where passes are dear.
const STEP_IN_STANDARD_ERRORS: [f64; 2] = [1e-5, 1e-3];
/// Rows above which passes are dear.
const MANY_ROWS: usize = 100_000;
/// A step this small, relative to T, is at the end of the digits.
const STEP_AT_ROUNDING: f64 = 1e-12;
/// Largest change of ln T in a step.
const LARGEST_STEP: f64 = 1.5;

/// Where T and L may lie, in seconds.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bounds {
    pub shortest_s: f64,
    pub longest_s: f64,
    pub longest_dead_time_s: f64,
}

impl Bounds {
    /// From a thirtieth of the sample time to a hundred stretches.
    pub fn of(stretch: &Stretch) -> Self {
        Self {
            shortest_s: stretch.sample_time_s / 30.0,
            longest_s: 100.0 * stretch.span_s(),
            longest_dead_time_s: 0.9 * stretch.span_s(),
        }
    }

    fn clip(&self, d: Dynamics) -> Dynamics {
        Dynamics {
            time_constant_s: d.time_constant_s.clamp(self.shortest_s, self.longest_s),
            dead_time_s: d.dead_time_s.clamp(0.0, self.longest_dead_time_s),
        }
    }
}

/// A point of the search with everything its pass gave.
#[derive(Debug, Clone)]
pub(super) struct Point {
    pub dynamics: Dynamics,
    pub projected: Projected,
}

impl Point {
    pub fn rss(&self) -> f64 {
        self.projected.rss
    }
}

/// One pass over the stretch at (T, L).
pub(super) fn evaluate(stretch: &Stretch, dynamics: Dynamics, reference: &Linear) -> Option<Point> {
    let grams = pass(stretch, dynamics, reference);
    let projected = project(&grams, reference, stretch.has_free())?;
    projected.rss.is_finite().then_some(Point { dynamics, projected })
}

/// A linear reference of zeros for a stretch.
pub(super) fn no_reference(stretch: &Stretch) -> Linear {
    Linear { bias: 0.0, gain: 0.0, free: vec![0.0; stretch.segments.len()] }
}

/// Refines a start on a stretch with at most `passes` passes, which it counts in `evaluations`.
pub(super) fn refine(
    stretch: &Stretch,
    start: Dynamics,
    bounds: &Bounds,
    passes: usize,
    evaluations: &mut usize,
) -> Option<Point> {
    *evaluations += 1;
    let start = evaluate(stretch, bounds.clip(start), &no_reference(stretch))?;
    let spare = stretch.kept().saturating_sub(stretch.unknowns()).max(1) as f64;
    let tolerance = STEP_IN_STANDARD_ERRORS[usize::from(stretch.len() > MANY_ROWS)];
    let step = |at: &Point, damping: f64| {
        let reduced = reduce(&at.projected);
        let target = moved(at.dynamics, reduced.step(damping, at.dynamics.dead_time_s <= 0.0), bounds);
        let taken = difference(at.dynamics, target);
        (!reduced.is_small(taken, at.rss() / spare, tolerance)).then_some(target)
    };
    let pass = |target: Dynamics, best: &Point| evaluate(stretch, target, &best.projected.linear);
    Some(descend(start, passes, evaluations, Point::rss, step, pass))
}

/// The best T for a given L, from a point nearby.
pub(super) fn refine_time_constant(
    stretch: &Stretch,
    near: &Point,
    dead_time_s: f64,
    bounds: &Bounds,
    evaluations: &mut usize,
) -> Option<Point> {
    /// Gauss–Newton in one unknown from a start this close ends in so many.
    const PASSES: usize = 4;
    let mut at = bounds.clip(Dynamics { dead_time_s, ..near.dynamics });
    let mut best: Option<Point> = None;
    for _ in 0..PASSES {
        *evaluations += 1;
        let point = evaluate(stretch, at, &near.projected.linear)?;
        let reduced = reduce(&point.projected);
        let alone = if reduced.h[0][0] > 0.0 { reduced.g[0] / reduced.h[0][0] } else { 0.0 };
        if best.as_ref().is_none_or(|b| point.rss() < b.rss()) {
            best = Some(point);
        }
        if alone.abs() < 1e-6 {
            break;
        }
        at = bounds
            .clip(Dynamics { time_constant_s: at.time_constant_s * alone.clamp(-1.0, 1.0).exp(), ..at });
    }
    best
}

fn moved(from: Dynamics, step: [f64; 2], bounds: &Bounds) -> Dynamics {
    let time_constant_s = from.time_constant_s * step[0].clamp(-LARGEST_STEP, LARGEST_STEP).exp();
    bounds.clip(Dynamics { time_constant_s, dead_time_s: from.dead_time_s + step[1] * from.time_constant_s })
}

fn difference(from: Dynamics, to: Dynamics) -> [f64; 2] {
    [
        (to.time_constant_s / from.time_constant_s).ln(),
        (to.dead_time_s - from.dead_time_s) / from.time_constant_s,
    ]
}

/// Normal equations of (ln T, L/T) alone.
struct Reduced {
    h: [[f64; 2]; 2],
    g: [f64; 2],
}

fn reduce(projected: &Projected) -> Reduced {
    let (mut m, mut b) = (projected.matrix, projected.rhs);
    for p in 0..2 {
        if m[p][p] <= 0.0 {
            continue;
        }
        for i in p + 1..4 {
            let share = m[i][p] / m[p][p];
            let row = m[p];
            m[i].iter_mut().zip(row).skip(p).for_each(|(value, pivot)| *value -= share * pivot);
            b[i] -= share * b[p];
        }
    }
    Reduced { h: [[m[2][2], m[2][3]], [m[3][2], m[3][3]]], g: [b[2], b[3]] }
}

impl Reduced {
    fn step(&self, damping: f64, at_zero_dead_time: bool) -> [f64; 2] {
        let (a, d) = (self.h[0][0] * (1.0 + damping), self.h[1][1] * (1.0 + damping));
        let off = 0.5 * (self.h[0][1] + self.h[1][0]);
        let only_time_constant = [if a > 0.0 { self.g[0] / a } else { 0.0 }, 0.0];
        let determinant = a * d - off * off;
        if determinant.is_nan() || determinant <= 1e-14 * a * d {
            return only_time_constant;
        }
        let step = [
            (d * self.g[0] - off * self.g[1]) / determinant,
            (a * self.g[1] - off * self.g[0]) / determinant,
        ];
        if at_zero_dead_time && step[1] <= 0.0 { only_time_constant } else { step }
    }

    fn is_small(&self, step: [f64; 2], variance: f64, tolerance: f64) -> bool {
        (0..2).all(|i| {
            // √(1/Hii) is the standard error with the other fixed: the smaller, hence safer, of the two.
            let error = if self.h[i][i] > 0.0 { (variance / self.h[i][i]).sqrt() } else { 0.0 };
            step[i].abs() <= (tolerance * error).max(STEP_AT_ROUNDING)
        })
    }
}
