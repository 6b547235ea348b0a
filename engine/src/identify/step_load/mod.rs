//! Steps of something unmeasured: looked for in what a fit leaves over, fitted along where they are beyond doubt.
//!
//! A load is a unit step behind a lag of its own, or none: K_d H(t − t_d)/(T_d s + 1), with an integrating process also
//! K_d H(t − t_d)/s. A fit without it spreads the change over gain, dynamics and offset, and its intervals miss the truth.
//! The time is searched by the score of a step at every place, gain and lag are descended to together with the process, so
//! that its intervals hold what the load leaves open. Up to [`MOST`] are taken one after the other, each where Schwarz's
//! criterion, over independent rows only, speaks for it very strongly: the search over the time alone makes a likelihood
//! ratio of 12 out of chance once in a hundred records (Andrews, Econometrica 61 (1993) 821), well below.

mod noise;
mod scan;
mod start;

use super::choose::{Choice, mean_squares, rank};
use super::fit_structure::{profile_dead_times, reaches_s, report, shape_like};
use super::judge;
use super::known::settled;
use super::model_fit::ModelFit;
use super::output_error::{Found, Linear, Order, Point, Shape, Work, again, evaluate, refine};
use super::problem::{FitProblem, Stretch};
use scan::{BINS, candidates};

/// Most loads of a stretch.
const MOST: usize = 3;
/// Difference of Schwarz's criterion that is "very strong" evidence (Kass & Raftery, JASA 90 (1995) 773).
const VERY_STRONG: f64 = 10.0;
/// Likelihood ratio of a step's score, as if rows were independent, below which nothing is tried.
const HINT: f64 = 12.0;
/// Rows of the copy on which candidates are compared.
const ROWS: usize = 1024;
/// Passes of a candidate on the copy, and of a fit next to its end.
const PASSES: usize = 12;

/// The choice with loads where they are due.
pub(super) fn with_loads_where_due(
    problem: &FitProblem,
    stretch: &Stretch,
    plain: &Choice,
    drifting: Choice,
) -> Choice {
    let chosen = plain.chosen();
    if is_exact(chosen) || !hints(stretch, chosen) {
        return drifting;
    }
    let mut loaded: Vec<ModelFit> = vec![];
    // A second order starts where a first one has found its load.
    let mut simplest_first: Vec<&ModelFit> = plain.fits.iter().collect();
    simplest_first.sort_by_key(|fit| fit.coordinates.values.len());
    for fit in simplest_first {
        let with = with_loads(problem, stretch, fit, &loaded);
        loaded.push(with);
    }
    if loaded.iter().all(|fit| fit.loads.is_empty()) {
        return drifting;
    }
    let choice = rank(loaded, stretch);
    let (with, without) = (choice.chosen(), drifting.chosen());
    if with.loads.is_empty() || gained(without, with, stretch) < VERY_STRONG {
        return drifting;
    }
    choice
}

/// A fit to the last digits leaves rounding, whatever its pattern.
fn is_exact(fit: &ModelFit) -> bool {
    fit.fit_percent > 99.9999
}

/// How much Schwarz's criterion falls from one fit to another: over the rows that are independent in the other, and with
/// coloured noise beside it; the lesser of the two.
fn gained(from: &ModelFit, to: &ModelFit, stretch: &Stretch) -> f64 {
    let added = to.unknowns as f64 - from.unknowns as f64;
    let n = independent_rows(to);
    let pair = [from.clone(), to.clone()];
    let squares = mean_squares(&pair, stretch);
    let by_rows = n * (squares[0] / squares[1]).ln() - added * n.ln();
    let counted = |fit: &ModelFit, row: usize| fit.residuals[row] != 0.0;
    let both: Vec<usize> =
        (0..from.residuals.len()).filter(|&row| counted(from, row) && counted(to, row)).collect();
    let [without, with] =
        [from, to].map(|fit| both.iter().map(|&row| fit.residuals[row]).collect::<Vec<f64>>());
    let rows = both.len().max(10) as f64;
    by_rows.min(noise::likelihood_ratio(&without, &with) - added * rows.ln())
}

fn independent_rows(fit: &ModelFit) -> f64 {
    (fit.rows as f64 / fit.tests.rows_per_independent).max(10.0)
}

/// The rows that a fit counted.
fn known<'a>(stretch: &Stretch<'a>, fit: &ModelFit) -> Stretch<'a> {
    stretch.known_after(fit.reach_s).unwrap_or_else(|| stretch.clone())
}

/// Whether the residuals of a fit hold anything like a step.
fn hints(stretch: &Stretch, fit: &ModelFit) -> bool {
    let here = known(stretch, fit);
    let shape = shape_like(&here, fit);
    let Some(found) = evaluate(&here, &shape, fit.points(), &Linear::zero(&shape, &here)) else {
        return false;
    };
    candidates(&here, &shape, &found).iter().any(|c| c.score > HINT)
}

/// A fit with as many loads as are beyond doubt; the fit itself where there is none.
fn with_loads(problem: &FitProblem, stretch: &Stretch, plain: &ModelFit, simpler: &[ModelFit]) -> ModelFit {
    let mut nested = vec![plain.clone()];
    while nested.len() <= MOST {
        let last = &nested[nested.len() - 1];
        let Some(next) = with_another(problem, stretch, last, simpler) else { break };
        if next.rows as f64 * (last.mse / next.mse).ln() < HINT {
            break;
        }
        nested.push(next);
    }
    let mut best = 0;
    for i in 1..nested.len() {
        if gained(&nested[best], &nested[i], stretch) > VERY_STRONG {
            best = i;
        }
    }
    nested.swap_remove(best)
}

/// A fit with one load more than another: the best there is.
fn with_another(
    problem: &FitProblem,
    stretch: &Stretch,
    fit: &ModelFit,
    simpler: &[ModelFit],
) -> Option<ModelFit> {
    let here = known(stretch, fit);
    let shape = shape_like(&here, fit);
    let at = evaluate(&here, &shape, fit.points(), &Linear::zero(&shape, &here))?;
    let (shape, best) = best_of(&here, &shape, &at, simpler)?;
    let mut work = Work::default();
    let refit = |known: &Stretch, from: &Found| again(known, &shape, &from.points, &mut work);
    let (here, found) = settled(stretch, here, best, |found| reaches_s(stretch, &shape, found), refit);
    let mut with = report(problem, &here, fit.structure, &shape, &found)?;
    profile_dead_times(&here, &shape, &found, None, &mut with, &mut work);
    (with.passes, with.thinned_passes) = (fit.passes + work.passes, fit.thinned_passes);
    with.verdicts = judge::of_model(&with, &here, problem);
    Some(with)
}

/// The most promising step and lag, descended to together with the process.
fn best_of(here: &Stretch, shape: &Shape, at: &Found, simpler: &[ModelFit]) -> Option<(Shape, Found)> {
    let thin = (here.len() > 2 * ROWS).then(|| here.thinned(here.len() / ROWS));
    let short = thin.as_ref().unwrap_or(here);
    let rows = short.kept() as f64;
    let width_s = here.span_s() / BINS as f64;
    let mut best: Option<(f64, Order, Found)> = None;
    let hinted = candidates(here, shape, at).into_iter().filter(|c| c.score > HINT);
    let mut starts: Vec<(Order, Vec<Point>)> =
        hinted.map(|c| (c.order, [&at.points[..], &[c.point]].concat())).collect();
    // A load as large as the moves of the MV has led the fit without it astray.
    if shape.loads == 0 {
        starts.extend(start::starts(here, shape, &at.points, simpler));
    }
    for (order, points) in starts {
        let wider = with_load(shape, order);
        let Some(found) = refine(short, &wider, &points, PASSES, &mut 0) else { continue };
        // A lag shorter than a row is a jump between two rows, and has no time of its own.
        let load = found.points[found.points.len() - 1];
        if order != Order::Jump && load.time_s < 0.5 * short.sample_time_s {
            continue;
        }
        let criterion = rows * found.rss().ln() + wider.parameters(short) as f64 * rows.ln();
        if best.as_ref().is_none_or(|b| criterion < b.0) {
            best = Some((criterion, order, found));
        }
    }
    let (_, order, found) = best?;
    let wider = with_load(shape, order);
    let found = refine(here, &wider, &found.points, 3 * PASSES, &mut 0)?;
    let jumps = order == Order::Jump;
    Some((wider.clone(), if jumps { at_the_best_row(here, &wider, found, width_s) } else { found }))
}

fn with_load(shape: &Shape, order: Order) -> Shape {
    let (inputs, loads) = shape.channels.split_at(shape.inputs());
    Shape::with_loads(inputs.to_vec(), &[loads, &[order]].concat(), shape.drift, shape.free)
}

/// Moves the last load, a jump, to the row at which it explains most, by ever smaller steps.
fn at_the_best_row(here: &Stretch, shape: &Shape, mut best: Found, width_s: f64) -> Found {
    let last = best.points.len() - 1;
    let mut step_s = width_s.max(here.sample_time_s);
    loop {
        let now_s = best.points[last].dead_time_s;
        let better = [-step_s, step_s].into_iter().find_map(|by| {
            let mut points: Vec<Point> = best.points.clone();
            points[last].dead_time_s = on_a_row(here, now_s + by);
            let other = refine(here, shape, &points, PASSES, &mut 0)?;
            (other.rss() < best.rss()).then_some(other)
        });
        match better {
            Some(found) => best = found,
            None if step_s <= here.sample_time_s => return best,
            None => step_s = (0.5 * step_s).max(here.sample_time_s),
        }
    }
}

/// The stamp of the row next to a time, both counted from the first row of the problem.
fn on_a_row(here: &Stretch, at_s: f64) -> f64 {
    let at_s = here.origin_s + at_s - 0.5 * here.sample_time_s;
    let row = here.t.partition_point(|t| *t < at_s).min(here.len() - 1);
    here.t[row] - here.origin_s
}
