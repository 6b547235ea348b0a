//! Gauss–Newton over (ln T, L/T) with Levenberg–Marquardt damping, the linear unknowns projected out.

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
const LARGEST_DAMPING: f64 = 1e7;

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
    let projected = project(&grams, reference, stretch.free)?;
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
    let mut best = evaluate(stretch, bounds.clip(start), &no_reference(stretch))?;
    let spare = stretch.len().saturating_sub(stretch.unknowns()).max(1) as f64;
    let tolerance = STEP_IN_STANDARD_ERRORS[usize::from(stretch.len() > MANY_ROWS)];
    let mut damping = 1e-6;
    for _ in 1..passes {
        let reduced = reduce(&best.projected);
        let step = reduced.step(damping, best.dynamics.dead_time_s <= 0.0);
        let target = moved(best.dynamics, step, bounds);
        let taken = difference(best.dynamics, target);
        let variance = best.rss() / spare;
        if reduced.is_small(taken, variance, tolerance) {
            break;
        }
        *evaluations += 1;
        let trial = evaluate(stretch, target, &best.projected.linear);
        match trial {
            Some(trial) if trial.rss() <= best.rss() => {
                damping = (damping * 0.1).max(1e-12);
                best = trial;
            }
            _ => damping = (damping * 30.0).max(1e-3),
        }
        if damping > LARGEST_DAMPING {
            break;
        }
    }
    Some(best)
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
