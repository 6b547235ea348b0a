//! Finds the limits of an MV that was logged ahead of them.
//!
//! The squared residual over a pair of limits has more than one valley: a tight loop keeps its MV near rest and crosses
//! its limits only in passing, and limits that are too narrow with a T that is too short explain much of it as well. So
//! a grid over both limits finds the valleys on a thinned-out copy, each is descended, and the deepest are descended
//! again on all rows.

use std::borrow::Cow;

use super::clip_fit::{LimitsFit, clipped, descend, without_idle};
use super::valve::{Valve, holding_cost};
use crate::identify::fit_structure::{free_run, shape_of};
use crate::identify::output_error::{Linear, Near, Point, Shape, Work, evaluate, refine, search};
use crate::identify::problem::{Other, Stretch};
use crate::identify::statistics::mean;
use crate::identify::{FitProblem, Structure};

/// Rows of the copy on which the grid is tried.
const ROWS: usize = 700;
/// Parts into which the grid cuts the rows of the MV, and its range: a limit may lie where few rows do.
const PARTS: usize = 7;
/// Valleys descended on the copy, and on all rows.
const VALLEYS: [usize; 2] = [10, 3];
/// Passes of a fit that starts next to its end.
const PASSES: usize = 20;
/// Limits closer than this part of their distance are the same.
const ALIKE: f64 = 0.02;
/// The squared residual must fall to this part, or the limits explain nothing.
const FALL: f64 = 0.5;
/// The same against a model with as many more parameters as there are limits.
const FALL_OF_LARGER: f64 = 0.8;
/// A fit this good leaves limits nothing to explain, in percent.
const GOOD_PERCENT: f64 = 99.0;

/// Limits at which the PV stops following the MV.
#[derive(Debug, Clone)]
pub(super) struct Limits {
    /// Those that explain the PV best, in MV units.
    pub best: [f64; 2],
    /// Others that explain it nearly as well, with their squared residual as a multiple of the best one's.
    pub others: Vec<([f64; 2], f64)>,
}

/// What stands between the MV of a log and what the process got.
#[derive(Debug, Clone)]
pub(super) enum Seen {
    /// Nothing that explains much.
    Nothing,
    /// Limits behind the log.
    Limits(Limits),
    /// No limits: beyond these levels of the MV the gain is another.
    GainChanges {
        /// In MV units.
        limits: [f64; 2],
        /// The gain beyond them, in percent of that between.
        percent: f64,
    },
    /// A valve that moves only once it was asked for that much, in MV units.
    Holds(f64),
}

/// Looks for limits behind the log, and for a valve that sticks, which cuts the tops of a slow wave as limits do.
pub(super) fn look(problem: &FitProblem) -> Seen {
    look_closely(problem).unwrap_or(Seen::Nothing)
}

fn look_closely(problem: &FitProblem) -> Option<Seen> {
    let mut sorted = problem.mv.to_vec();
    sorted.sort_by(f64::total_cmp);
    let mut levels = sorted.clone();
    levels.dedup();
    // An MV of few levels is a hand's: what it asked for, it got.
    if levels.len() < 30 || problem.pv.len() < 50 {
        return None;
    }
    let stretch = problem.stretch().ok()?;
    let factor = stretch.len().div_ceil(ROWS);
    let short = mended(&stretch);
    let shape = shape_of(&stretch, Structure::Fopdt, false);
    let whole = [sorted[0], sorted[sorted.len() - 1]];
    // The grid is tried on the MV alone: what disturbances do is known well enough to find the valleys.
    let (of_mv, others) = without_others(&short, factor, &shape)?;
    let alone = shape_of(&of_mv, Structure::Fopdt, false);
    let cost = |limits: [f64; 2]| {
        let (rss, point) = tried(&clipped(&of_mv, limits, factor), &alone)?;
        Some((rss, [vec![point], others.clone()].concat()))
    };
    let (plain, plain_points) = cost(whole)?;
    if fit_percent(&clipped(&of_mv, whole, factor), plain) > GOOD_PERCENT
        || is_mostly_noise(&stretch, &shape, &plain_points)
    {
        return None;
    }
    let mut valleys = vec![(plain, whole, plain_points.clone())];
    let levels = grid(&sorted);
    // Both together: with a valve that jumps between its limits neither alone explains anything.
    for (i, &low) in levels.iter().enumerate() {
        for &high in &levels[i + 1..] {
            valleys.extend(cost([low, high]).map(|(rss, points)| (rss, [low, high], points)));
        }
    }
    valleys.sort_by(|a, b| a.0.total_cmp(&b.0));
    let on_copy = deepest(&short, factor, &shape, &valleys, VALLEYS[0]);
    let least = on_copy.first()?.rss;
    // What a valve hides goes into the disturbances' share: there both are fitted together again.
    let behind = |held: &Stretch| {
        if others.is_empty() {
            tried(held, &alone).map(|(rss, _)| rss)
        } else {
            refine(held, &shape, &plain_points, PASSES, &mut 0).map(|found| found.rss())
        }
    };
    if let Some(Valve { band, rss }) = holding_cost(&short, factor, behind)
        && rss < least
    {
        return (rss < FALL * plain).then_some(Seen::Holds(band));
    }
    if least > 1.5 * FALL * plain {
        return None;
    }
    let starts: Vec<_> = on_copy.iter().map(|f| (f.rss, f.limits, f.found.points.clone())).collect();
    let stretch = stretch.known_after(starts[0].2[0].dead_time_s).unwrap_or(stretch);
    let found = deepest(&stretch, 1, &shape, &starts, VALLEYS[1]);
    let best = without_idle(&stretch, &shape, found.first()?.clone());
    // What a larger model explains without limits is no sign of any.
    let without =
        [(Structure::Fopdt, FALL), (Structure::SopdtZero, FALL_OF_LARGER)].map(|(structure, part)| {
            let shape = shape_of(&stretch, structure, false);
            let fit = search(&stretch, &shape, &Near::default(), &mut Work::default());
            part * fit.map_or(f64::INFINITY, |f| f.rss())
        });
    // A limit beyond which next to nothing lies is none.
    let beyond = problem.mv.iter().filter(|u| !(best.limits[0]..=best.limits[1]).contains(*u)).count();
    (best.rss < without[0].min(without[1]) && 100 * beyond > problem.mv.len()).then(|| {
        if let Some(percent) = gain_beyond(&stretch, &best, &shape) {
            return Seen::GainChanges { limits: best.limits, percent };
        }
        let others = found[1..].iter().map(|f| (f.limits, f.rss / best.rss)).collect();
        Seen::Limits(Limits { best: best.limits, others })
    })
}

/// Whether so much of a fit's residual is white noise that neither limits nor a valve can explain [`FALL`] of it: second
/// differences of noise have six times its variance, while what they leave over passes a lag of many rows.
fn is_mostly_noise(stretch: &Stretch, shape: &Shape, points: &[Point]) -> bool {
    const MOST: f64 = 0.6;
    const ROWS_OF_LAG: f64 = 10.0;
    if points[0].time_s < ROWS_OF_LAG * stretch.sample_time_s {
        return false;
    }
    let found = evaluate(stretch, shape, points.to_vec(), &Linear::zero(shape, stretch));
    let Some(found) = found else { return false };
    let (_, residuals) = free_run(stretch, shape, &found);
    let (mut noise, mut all) = (0.0, 0.0);
    for row in
        (1..residuals.len().saturating_sub(1)).filter(|row| (row - 1..=row + 1).all(|k| stretch.is_kept(k)))
    {
        noise += (residuals[row - 1] - 2.0 * residuals[row] + residuals[row + 1]).powi(2) / 6.0;
        all += residuals[row].powi(2);
    }
    noise > MOST * all
}

/// The gain beyond limits in percent of that between them, where it is not next to nothing as behind a real limit.
///
/// What lies beyond goes in as an input of its own with the process's dynamics: a limit leaves it no gain.
fn gain_beyond(stretch: &Stretch, at: &LimitsFit, shape: &Shape) -> Option<f64> {
    /// Percent up to which limits that are a little off explain it.
    const NOTHING: f64 = 12.0;
    /// The squared residual must fall to this part.
    const FALL: f64 = 0.9;
    let mut within = clipped(stretch, at.limits, 1);
    let past =
        |u: &[f64]| -> Vec<f64> { u.iter().map(|u| u - u.clamp(at.limits[0], at.limits[1])).collect() };
    within.others.push(Other::new(past(&stretch.u).into()));
    let channels = [shape.channels.clone(), vec![shape.channels[0]]].concat();
    let wide = Shape::new(channels, shape.drift, shape.free);
    let mut points = at.found.points.clone();
    points.push(points[0]);
    let found = evaluate(&within, &wide, points, &Linear::zero(&wide, &within))?;
    let gain = |channel: usize| found.projected.linear.shared[wide.gains[channel]];
    let percent = 100.0 * gain(wide.gains.len() - 1) / gain(0);
    (found.rss() < FALL * at.rss && percent.abs() > NOTHING).then_some(percent)
}

/// A copy without what disturbances do to the PV with a process that has no limits, and the dynamics of each.
fn without_others<'a>(
    stretch: &Stretch<'a>,
    factor: usize,
    shape: &Shape,
) -> Option<(Stretch<'a>, Vec<Point>)> {
    let mut out = stretch.clone();
    if stretch.others.is_empty() {
        return Some((out, vec![]));
    }
    let copy = if factor > 1 { stretch.thinned(factor) } else { stretch.clone() };
    let found = search(&copy, shape, &Near::default(), &mut Work::default())?;
    let mut whole = evaluate(stretch, shape, found.points, &Linear::zero(shape, stretch))?;
    let linear = &mut whole.projected.linear;
    linear.local.iter_mut().for_each(|state| state.fill(0.0));
    for (i, coefficient) in linear.shared.iter_mut().enumerate() {
        if !shape.gains[1..].contains(&i) {
            *coefficient = 0.0;
        }
    }
    let (of_others, _) = free_run(stretch, shape, &whole);
    out.y = stretch.y.iter().zip(of_others).map(|(y, other)| y - (other - stretch.y_ref)).collect();
    out.y_ref = mean(&out.y);
    out.others.clear();
    Some((out, whole.points[1..].to_vec()))
}

/// Levels of the MV at which limits are tried; `sorted` holds its rows.
fn grid(sorted: &[f64]) -> Vec<f64> {
    let (low, high) = (sorted[0], sorted[sorted.len() - 1]);
    let mut levels: Vec<f64> = (0..=PARTS).map(|i| sorted[(sorted.len() - 1) * i / PARTS]).collect();
    levels.extend((1..PARTS).map(|i| low + (high - low) * i as f64 / PARTS as f64));
    // Zero is where many a limit lies.
    levels.push(0.0);
    levels.retain(|v| (low..=high).contains(v));
    levels.sort_by(f64::total_cmp);
    levels.dedup_by(|a, b| *a - *b < 0.01 * (high - low));
    levels
}

/// Squared residual and dynamics of the best first order.
fn tried(stretch: &Stretch, shape: &Shape) -> Option<(f64, Point)> {
    search(stretch, shape, &Near::default(), &mut Work::default()).map(|f| (f.rss(), f.points[0]))
}

fn fit_percent(stretch: &Stretch, rss: f64) -> f64 {
    let movement: f64 = stretch.y.iter().map(|y| (y - stretch.y_ref).powi(2)).sum();
    100.0 * (1.0 - (rss / movement).sqrt())
}

/// A copy in which every row counts: those that did not hold the PV of the row before.
fn mended<'a>(stretch: &Stretch<'a>) -> Stretch<'a> {
    let mut out = stretch.clone();
    if let Some(keep) = out.keep.take() {
        let mut last = stretch.y_ref;
        let y = stretch.y.iter().zip(keep.iter()).map(|(y, keep)| {
            last = if *keep { *y } else { last };
            last
        });
        out.y = Cow::Owned(y.collect());
    }
    out
}

/// Descends the first of some starts, no two alike; the deepest first.
fn deepest(
    stretch: &Stretch,
    factor: usize,
    shape: &Shape,
    starts: &[(f64, [f64; 2], Vec<Point>)],
    count: usize,
) -> Vec<LimitsFit> {
    let mut found: Vec<LimitsFit> = Vec::new();
    for (_, limits, points) in starts.iter().take(count) {
        if let Some(fit) = descend(stretch, factor, shape, *limits, points) {
            match found.iter_mut().find(|other| are_alike(other.limits, fit.limits)) {
                Some(other) if fit.rss < other.rss => *other = fit,
                Some(_) => {}
                None => found.push(fit),
            }
        }
    }
    found.sort_by(|a, b| a.rss.total_cmp(&b.rss));
    found
}

fn are_alike(a: [f64; 2], b: [f64; 2]) -> bool {
    let close = ALIKE * (a[1] - a[0]);
    (a[0] - b[0]).abs() < close && (a[1] - b[1]).abs() < close
}
