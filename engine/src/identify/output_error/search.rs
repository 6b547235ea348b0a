//! Global start of a shape and its refinement from thinned-out copies to all rows.

use super::descend::{Bounds, Found, Refinement, evaluate, refine};
use super::shape::{Linear, Order, Point, Shape};
use crate::identify::problem::Stretch;
use crate::identify::start::starts;

/// Rows above which a start is sought on a thinned-out copy.
const START_ROWS: usize = 2048;
/// Rows of the copy on which grids are scanned.
const SCAN_ROWS: usize = 320;
/// Coarsest step from one copy to the next.
const THINNING: usize = 32;
/// Passes a refinement may take.
const PASSES: usize = 40;
/// Starts refined out of a grid.
const STARTS: usize = 4;

/// Passes so far.
#[derive(Debug, Clone, Copy, Default)]
pub(in crate::identify) struct Work {
    /// Over all rows.
    pub passes: usize,
    /// Over thinned-out copies.
    pub thinned: usize,
}

/// Points that simpler fits of the same stretch have found for the main channel.
#[derive(Debug, Clone, Default)]
pub(in crate::identify) struct Near {
    /// First order.
    pub first: Option<Point>,
    /// Of the same order.
    pub same: Option<Point>,
}

/// The best point of a shape.
pub(in crate::identify) fn search(
    stretch: &Stretch,
    shape: &Shape,
    near: &Near,
    work: &mut Work,
) -> Option<Found> {
    let copies = copies(stretch);
    let coarsest = copies.last().unwrap_or(stretch);
    let mut count = 0;
    let mut best = start(coarsest, shape, near, &mut count)?;
    if copies.is_empty() {
        work.passes += count;
        return Some(look_around(stretch, shape, best, work));
    }
    for copy in copies.iter().rev().skip(1) {
        best = refine(copy, shape, &best.points, PASSES, &mut count).unwrap_or(best);
    }
    work.thinned += count;
    let found = refine(stretch, shape, &best.points, PASSES, &mut work.passes)?;
    Some(look_around(stretch, shape, found, work))
}

/// The best point next to one that was found on nearly the same rows.
pub(in crate::identify) fn again(
    stretch: &Stretch,
    shape: &Shape,
    points: &[Point],
    work: &mut Work,
) -> Option<Found> {
    let found = refine(stretch, shape, points, PASSES, &mut work.passes)?;
    Some(look_around(stretch, shape, found, work))
}

/// The cost has a kink wherever a dead time passes a row: tries the neighbouring cells where the rows are far apart.
fn look_around(stretch: &Stretch, shape: &Shape, best: Found, work: &mut Work) -> Found {
    const CELL_PASSES: usize = 12;
    /// Above this many rows noise blurs the kinks.
    const ROWS: usize = 20_000;
    let mut best = best;
    let h = stretch.sample_time_s;
    for channel in 0..shape.inputs() {
        let found = best.points[channel];
        if h <= 0.02 * found.time_s || stretch.len() > ROWS || blurred(stretch, shape, &best, channel) {
            continue;
        }
        let cell = (found.dead_time_s / h).floor();
        let known = Some((channel, [cell * h, (cell + 1.0) * h]));
        let away = Refinement { stretch, shape, passes: CELL_PASSES, fixed: None, known };
        for dead_time_s in [(cell - 0.5) * h, cell * h, (cell + 1.5) * h] {
            let mut at = best.points.clone();
            at[channel].dead_time_s = dead_time_s.max(0.0);
            if let Some(other) = away.from(&at, &mut work.passes)
                && other.rss() < best.rss()
            {
                best = other;
            }
        }
    }
    best
}

/// Whether noise hides the kinks of a channel's dead time: its standard error exceeds the sample time.
fn blurred(stretch: &Stretch, shape: &Shape, found: &Found, channel: usize) -> bool {
    let at = shape.shared.len() + shape.first_unknown(channel) + shape.channels[channel].unknowns() - 1;
    let spare = stretch.kept().saturating_sub(shape.parameters(stretch)).max(1) as f64;
    // Without an inverse nothing tells the dead time, and no cell is better than its neighbour.
    found.projected.matrix.inverse().is_none_or(|c| {
        (found.rss() / spare * c.at(at, at)).sqrt() * found.points[channel].time_s > stretch.sample_time_s
    })
}

fn copies(stretch: &Stretch) -> Vec<Stretch<'static>> {
    let mut copies: Vec<Stretch<'static>> = Vec::new();
    loop {
        let from: &Stretch = copies.last().map_or(stretch, |copy| copy);
        let rows = from.len();
        if rows <= START_ROWS {
            return copies;
        }
        let copy = from.thinned((rows / (START_ROWS / 2)).clamp(2, THINNING));
        copies.push(copy);
    }
}

fn better(a: Option<Found>, b: Option<Found>) -> Option<Found> {
    match (a, b) {
        (Some(a), Some(b)) => Some(if b.rss() < a.rss() { b } else { a }),
        (a, b) => a.or(b),
    }
}

/// The best point on a short record: the main channel first, then each further one, then all together.
fn start(stretch: &Stretch, shape: &Shape, near: &Near, count: &mut usize) -> Option<Found> {
    let main = shape.channels[0];
    let alone = Shape::new(vec![main], shape.drift, shape.free);
    let mut candidates = main_starts(stretch, &alone, near, count);
    candidates.extend(near.same);
    let best = most_promising(stretch, &alone, candidates, count);
    let mut best = best?;
    for channel in 1..shape.channels.len() {
        let so_far = Shape::new(shape.channels[..=channel].to_vec(), shape.drift, shape.free);
        let grid = grid_of(stretch, shape.channels[channel]);
        let with = |point: Point| {
            let mut points = best.points.clone();
            points.push(point);
            points
        };
        let chosen = scan(stretch, &so_far, grid.into_iter().map(with).collect(), count);
        let mut joint = None;
        for points in chosen {
            joint = better(joint, refine(stretch, &so_far, &points, PASSES, count));
        }
        best = joint?;
    }
    if shape.channels.len() > 1 {
        // With the disturbances explained the main channel may look otherwise.
        let grid = grid_of(stretch, main).into_iter().map(|point| {
            let mut points = best.points.clone();
            points[0] = point;
            points
        });
        for points in scan(stretch, shape, grid.collect(), count) {
            best = better(Some(best), refine(stretch, shape, &points, PASSES, count))?;
        }
    }
    Some(best)
}

/// Refines candidates briefly on a short copy, and the better half of them to the end.
fn most_promising(
    stretch: &Stretch,
    shape: &Shape,
    candidates: Vec<Point>,
    count: &mut usize,
) -> Option<Found> {
    const BRIEF: usize = 10;
    const TO_THE_END: usize = 2;
    let mut tried: Vec<(f64, Point)> = Vec::new();
    if stretch.len() > 2 * SCAN_ROWS && candidates.len() > TO_THE_END {
        let short = stretch.thinned(stretch.len().div_ceil(SCAN_ROWS));
        for point in candidates {
            if let Some(found) = refine(&short, shape, &[point], BRIEF, count) {
                tried.push((found.rss(), found.points[0]));
            }
        }
        tried.sort_by(|a, b| a.0.total_cmp(&b.0));
        tried.truncate(TO_THE_END);
    } else {
        tried.extend(candidates.into_iter().map(|point| (0.0, point)));
    }
    let mut best = None;
    for (_, point) in tried {
        best = better(best, refine(stretch, shape, &[point], PASSES, count));
    }
    best
}

fn main_starts(stretch: &Stretch, alone: &Shape, near: &Near, count: &mut usize) -> Vec<Point> {
    let plain = |d: &crate::identify::response::Dynamics| Point {
        time_s: d.time_constant_s,
        zeta: 1.0,
        dead_time_s: d.dead_time_s,
    };
    match alone.channels[0] {
        Order::First if stretch.keep.is_none() => starts(stretch).iter().map(plain).collect(),
        Order::First => {
            let grid = grid_of(stretch, Order::First).into_iter().map(|p| vec![p]).collect();
            scan(stretch, alone, grid, count).into_iter().map(|points| points[0]).collect()
        }
        Order::Integrator => {
            let grid = grid_of(stretch, Order::Integrator).into_iter().map(|p| vec![p]).collect();
            scan(stretch, alone, grid, count).into_iter().map(|points| points[0]).collect()
        }
        Order::Second { .. } => second_starts(stretch, alone, near, count),
        Order::Jump => vec![],
    }
}

/// A second order near the first-order fit, and anything that rings.
fn second_starts(stretch: &Stretch, alone: &Shape, near: &Near, count: &mut usize) -> Vec<Point> {
    let nearby = near.first.or_else(|| {
        let first = Shape::new(vec![Order::First], alone.drift, alone.free);
        let starts = main_starts(stretch, &first, near, count);
        most_promising(stretch, &first, starts, count).map(|f| f.points[0])
    });
    let (time_s, dead_time_s) =
        nearby.map_or((stretch.span_s() / 5.0, 0.0), |point| (point.time_s, point.dead_time_s));
    let mut grid = Vec::new();
    let quickest = stretch.sample_time_s;
    for zeta in [0.15, 0.45, 1.0, 2.5] {
        for tau in [0.1, 0.25, 0.5, 1.0] {
            let time_s = (tau * time_s).max(quickest);
            for share in [0.0, 0.5, 1.0] {
                grid.push(vec![Point { time_s, zeta, dead_time_s: share * dead_time_s }]);
            }
        }
        if zeta < 0.9 {
            let mut time_s = 2.0 * quickest;
            while time_s < 0.3 * stretch.span_s() {
                grid.push(vec![Point { time_s, zeta, dead_time_s: 0.0 }]);
                time_s *= 1.5;
            }
        }
    }
    scan(stretch, alone, grid, count).into_iter().map(|points| points[0]).collect()
}

/// Points to scan for a channel of which nothing is known.
fn grid_of(stretch: &Stretch, order: Order) -> Vec<Point> {
    let span_s = stretch.span_s();
    let step_s = span_s / SCAN_ROWS.min(stretch.len()) as f64;
    let mut dead_times = vec![0.0];
    let mut dead_time_s = step_s;
    while dead_time_s < 0.6 * span_s {
        dead_times.push(dead_time_s);
        dead_time_s = (1.25 * dead_time_s).max(dead_time_s + step_s);
    }
    if order == Order::Integrator {
        let time_s = stretch.sample_time_s;
        return dead_times.into_iter().map(|dead_time_s| Point { time_s, zeta: 1.0, dead_time_s }).collect();
    }
    let mut grid = Vec::new();
    let mut time_s = 0.5 * stretch.sample_time_s.max(0.2 * step_s);
    while time_s < 5.0 * span_s {
        let stride = 0.25 * time_s;
        let mut last = f64::NEG_INFINITY;
        for &dead_time_s in &dead_times {
            if dead_time_s >= last + stride {
                grid.push(Point { time_s, zeta: 1.0, dead_time_s });
                last = dead_time_s;
            }
        }
        time_s *= 2.0;
    }
    grid
}

/// The most promising of a list, on a thinned-out copy, no two alike.
fn scan(stretch: &Stretch, shape: &Shape, grid: Vec<Vec<Point>>, count: &mut usize) -> Vec<Vec<Point>> {
    let thin = (stretch.len() > SCAN_ROWS).then(|| stretch.thinned(stretch.len().div_ceil(SCAN_ROWS)));
    let record = thin.as_ref().unwrap_or(stretch);
    let quick = shape.without_derivatives();
    let bounds = Bounds::of(record);
    let zero = Linear::zero(&quick, record);
    let mut found: Vec<(f64, Vec<Point>)> = Vec::new();
    for points in grid {
        let points: Vec<Point> =
            points.iter().zip(&shape.channels).map(|(p, o)| bounds.clip(*o, *p)).collect();
        if let Some(at) = evaluate(record, &quick, points, &zero) {
            found.push((at.rss(), at.points));
        }
    }
    *count += 1;
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut chosen: Vec<Vec<Point>> = Vec::new();
    for (_, points) in found {
        if chosen.len() == STARTS {
            break;
        }
        let alike = |other: &Vec<Point>| {
            other.iter().zip(&points).all(|(a, b)| {
                (a.time_s / b.time_s).ln().abs() < 0.5
                    && (a.zeta / b.zeta).ln().abs() < 0.7
                    && (a.dead_time_s - b.dead_time_s).abs()
                        < (0.3 * b.time_s).max(1.5 * record.sample_time_s)
            })
        };
        if !chosen.iter().any(alike) {
            chosen.push(points);
        }
    }
    chosen
}
