//! Steps of something unmeasured: looked for in what a fit leaves over, fitted along where they are beyond doubt.
//!
//! A load is a unit step behind a lag of its own, or none: K_d H(t − t_d)/(T_d s + 1), with an integrating process also
//! K_d H(t − t_d)/s. A fit without it spreads the change over gain, dynamics and offset, and its intervals miss the truth.
//! The time is searched by the score of a step at every place, gain and lag are descended to together with the process, so
//! that its intervals hold what the load leaves open. Up to [`MOST`] are taken one after the other, each where Schwarz's
//! criterion, over independent rows only, speaks for it very strongly, and told only where noise is all that is left: the
//! search over the time alone makes a likelihood ratio of 12 out of chance once in a hundred records (Andrews, Econometrica 61 (1993) 821), well below.

mod level;
mod noise;
mod scan;
mod start;

use super::FitVerdict;
use super::choose::{Choice, rank};
use super::fit_structure::{free_run, profile_dead_times, reaches_s, report, shape_like};
use super::judge;
use super::known::settled;
use super::model_fit::ModelFit;
use super::output_error::{Found, Linear, Order, Point, Shape, Work, again, evaluate, refine};
use super::problem::{FitProblem, Stretch};
use super::residual_tests::ResidualTests;
use level::Level;
use scan::{BINS, candidates, sensitivities, size};

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
    let level = level_of(stretch, chosen);
    let otherwise = match &level {
        Some(level) if level.is_worth_a_word => with_level(drifting, level),
        _ => drifting,
    };
    let mut loaded: Vec<ModelFit> = vec![];
    // A second order starts where a first one has found its load.
    let mut simplest_first: Vec<&ModelFit> = plain.fits.iter().collect();
    simplest_first.sort_by_key(|fit| fit.coordinates.values.len());
    for fit in simplest_first {
        let with = with_loads(problem, stretch, fit, &loaded);
        loaded.push(with);
    }
    if loaded.iter().all(|fit| fit.loads.is_empty()) {
        return otherwise;
    }
    let choice = rank(loaded, stretch);
    let (with, without) = (choice.chosen(), otherwise.chosen());
    if with.loads.is_empty()
        || !is_complete(with, chosen, stretch)
        || gained(without, with, stretch) < VERY_STRONG
    {
        return otherwise;
    }
    // Steps at the moves of the MV mend what a gain that changes with its level breaks.
    if let Some(level) = level {
        let [loaded, _] = residuals_of(with, chosen, stretch);
        let rows = loaded.len() as f64;
        let ratio = rows * (power(&level.rival.residuals) / power(&loaded)).ln();
        let fewer = with.unknowns as f64 - level.rival.unknowns as f64;
        if loaded.len() == level.rival.residuals.len() && ratio < fewer * rows.ln() {
            return otherwise;
        }
    }
    choice
}

/// Whether a fit leaves nothing but noise, white or coloured. A process with more in it than its structure, one that is not
/// linear or that wanders, also looks as if something had moved it here and there; but then steps leave a pattern of their
/// own. In coloured noise a process that is not linear passes for one with a load at its only move: there neither is told.
fn is_complete(fit: &ModelFit, without: &ModelFit, stretch: &Stretch) -> bool {
    /// Independent rows below which noise and loads not yet found look alike: an autoregression takes either for noise.
    const INDEPENDENT: f64 = 45.0;
    /// Probability below which white innovations would be too unlikely.
    const WHITE: f64 = 1e-3;
    let tests = noise::innovation_tests(&fit.residuals, &stretch.u[stretch.history..]);
    let independent = fit.rows as f64 / fit.tests.rows_per_independent;
    let tells_wander = fit.tests.rows_per_independent <= 1.0
        || (independent >= INDEPENDENT && !hides_the_gain(fit, without));
    tells_wander && tests.white_probability > WHITE && !tests.follows_input()
}

/// A fit to the last digits leaves rounding, whatever its pattern.
fn is_exact(fit: &ModelFit) -> bool {
    fit.fit_percent > 99.9999
}

/// What an explanation leaves over, and what it takes.
#[derive(Debug, Clone)]
struct Rival {
    residuals: Vec<f64>,
    unknowns: usize,
}

impl Rival {
    fn tests(&self) -> ResidualTests {
        ResidualTests::new(&self.residuals, &vec![0.0; self.residuals.len()])
    }
}

/// How much Schwarz's criterion falls from one explanation to another of the same rows: over the rows that are independent
/// in the other, and with coloured noise beside it; the lesser of the two.
fn fall(from: &Rival, to: &Rival) -> f64 {
    by_rows(from, to).min(by_innovations(from, to))
}

fn by_rows(from: &Rival, to: &Rival) -> f64 {
    let added = to.unknowns as f64 - from.unknowns as f64;
    let rows = to.residuals.len().max(10) as f64;
    let n = (rows / to.tests().rows_per_independent).max(10.0);
    n * (power(&from.residuals) / power(&to.residuals)).ln() - added * n.ln()
}

fn by_innovations(from: &Rival, to: &Rival) -> f64 {
    let added = to.unknowns as f64 - from.unknowns as f64;
    let rows = to.residuals.len().max(10) as f64;
    noise::likelihood_ratio(&from.residuals, &to.residuals) - added * rows.ln()
}

/// The same of two fits. In coloured noise the one with less in it is also taken at its best for such noise, and more is
/// asked for: of 600 records of 600 rows of noise of correlation 0.97, ten held a step of this evidence and four of twice as
/// much.
fn gained(from: &ModelFit, to: &ModelFit, stretch: &Stretch) -> f64 {
    let common = common(from, to, stretch);
    let rival = |fit: &ModelFit, residuals| Rival { residuals, unknowns: fit.unknowns };
    let [without, with] = [from, to].map(|fit| rival(fit, residuals_on(&common, fit)));
    let found = fall(&without, &with);
    if found < VERY_STRONG || !noise::is_coloured(&with.residuals) {
        return found;
    }
    let Some(best) = at_best(&common, from) else { return found };
    found.min(by_innovations(&without, &with).min(by_innovations(&rival(from, best), &with)) - VERY_STRONG)
}

/// Residuals of a fit at its best for coloured noise.
fn at_best(common: &Stretch, fit: &ModelFit) -> Option<Vec<f64>> {
    let shape = shape_like(common, fit);
    let at = evaluate(common, &shape, fit.points(), &Linear::zero(&shape, common))?;
    let kept: Vec<usize> = common.kept_rows().collect();
    let mut columns = vec![vec![0.0; common.len()]; size(common, &shape)];
    sensitivities(common, &shape, &at, |column, row, value| columns[column][row] += value);
    let residuals = free_run(common, &shape, &at).1;
    let counted = |values: &[f64]| -> Vec<f64> { kept.iter().map(|&row| values[row]).collect() };
    let columns: Vec<Vec<f64>> = columns.iter().map(|column| counted(column)).collect();
    Some(noise::at_best(counted(&residuals), &columns))
}

/// The gain at the ends of the MV's range, where it changes with the level beyond doubt.
fn level_of(stretch: &Stretch, fit: &ModelFit) -> Option<Level> {
    /// The squared residual must fall to this part: what matters less is a matter of the structure.
    const FALL: f64 = 0.7;
    let level = level::look(stretch, fit)?;
    let [straight, _] = residuals_of(fit, fit, stretch);
    let straight = Rival { residuals: straight, unknowns: fit.unknowns };
    let explains = power(&level.rival.residuals) < FALL * power(&straight.residuals);
    (straight.residuals.len() == level.rival.residuals.len()
        && explains
        && fall(&straight, &level.rival) > VERY_STRONG)
        .then_some(level)
}

/// The choice with what was found of the gain.
fn with_level(mut choice: Choice, level: &Level) -> Choice {
    let verdict = FitVerdict::GainByLevel { levels: level.levels, gains: level.gains };
    let fit = &mut choice.fits[0];
    fit.verdicts.retain(|verdict| !matches!(verdict, FitVerdict::Good { .. }));
    fit.verdicts.insert(0, verdict);
    choice
}

/// Twice the logarithm of the likelihood ratio of two fits, as if rows were independent.
fn ratio(from: &ModelFit, to: &ModelFit, stretch: &Stretch) -> f64 {
    let [without, with] = residuals_of(from, to, stretch);
    with.len() as f64 * (power(&without) / power(&with)).ln()
}

fn power(residuals: &[f64]) -> f64 {
    residuals.iter().map(|r| r * r).sum::<f64>().max(f64::MIN_POSITIVE)
}

/// The rows that the one of the shorter dead time of two fits explains: a fit that leaves more out leaves out what speaks
/// against it.
fn common<'a>(a: &ModelFit, b: &ModelFit, stretch: &Stretch<'a>) -> Stretch<'a> {
    stretch.known_after(a.reach_s.min(b.reach_s)).unwrap_or_else(|| stretch.clone())
}

/// Residuals of two fits on the same rows.
fn residuals_of(a: &ModelFit, b: &ModelFit, stretch: &Stretch) -> [Vec<f64>; 2] {
    let common = common(a, b, stretch);
    [a, b].map(|fit| residuals_on(&common, fit))
}

/// Residuals of a fit on the rows that count; none where it cannot be evaluated.
fn residuals_on(common: &Stretch, fit: &ModelFit) -> Vec<f64> {
    let shape = shape_like(common, fit).without_derivatives();
    let at = evaluate(common, &shape, fit.points(), &Linear::zero(&shape, common));
    at.map_or_else(Vec::new, |at| {
        let residuals = free_run(common, &shape, &at).1;
        common.kept_rows().map(|row| residuals[row]).collect()
    })
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
        if ratio(last, &next, stretch) < HINT {
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
    /// Part of the rows that a fit must count to be a guide: a dead time that leaves most of them out explains little.
    const GUIDE: f64 = 0.8;
    let known = known(stretch, fit);
    let is_guide = known.kept() as f64 > GUIDE * stretch.kept() as f64;
    let here = if is_guide { known } else { stretch.clone() };
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
    say_where_it_hides_the_gain(&mut with, fit);
    Some(with)
}

/// Says so where a load and the MV came together.
fn say_where_it_hides_the_gain(with: &mut ModelFit, without: &ModelFit) {
    if let Some(load) = with.loads.last()
        && hides_the_gain(with, without)
    {
        let verdict = FitVerdict::LoadWithMv { at_s: load.at_s };
        with.verdicts.retain(|verdict| !matches!(verdict, FitVerdict::Good { .. }));
        with.verdicts.insert(0, verdict);
    }
}

/// Whether loads leave the gain far less known, for the noise there is, than the fit without would have it: then a load came
/// together with the MV.
fn hides_the_gain(with: &ModelFit, without: &ModelFit) -> bool {
    /// Ratio of the gain's errors for the same noise.
    const HIDDEN: f64 = 4.0;
    let noise = |fit: &ModelFit| (fit.mse * fit.tests.rows_per_independent).sqrt();
    let error = |fit: &ModelFit| fit.parameters[0].standard_error / noise(fit);
    error(with) > HIDDEN * error(without)
}

/// The most promising step and lag, descended to together with the process.
fn best_of(here: &Stretch, shape: &Shape, at: &Found, simpler: &[ModelFit]) -> Option<(Shape, Found)> {
    let thin = (here.len() > 2 * ROWS).then(|| here.thinned(here.len() / ROWS));
    let short = thin.as_ref().unwrap_or(here);
    let hinted = candidates(here, shape, at).into_iter().filter(|c| c.score > HINT);
    let starts = hinted.map(|c| (c.order, [&at.points[..], &[c.point]].concat())).collect();
    let mut best = lowest(short, shape, starts);
    // A load as large as the moves of the MV has led the fit without it astray.
    let leaves_more = |(_, order, found): &Start| !leaves_noise(short, &with_load(shape, *order), found);
    if shape.loads == 0 && best.as_ref().is_none_or(leaves_more) {
        let other = lowest(short, shape, start::starts(here, shape, &at.points, simpler));
        best = [best, other].into_iter().flatten().min_by(|a, b| a.0.total_cmp(&b.0));
    }
    let (_, order, found) = best?;
    let wider = with_load(shape, order);
    let found = refine(here, &wider, &found.points, 3 * PASSES, &mut 0)?;
    let (_, order, found) = as_a_jump(here, shape, (criterion(here, &wider, &found), order, found));
    Some((with_load(shape, order), found))
}

/// A load with its process, and its criterion.
type Start = (f64, Order, Found);

/// Schwarz's, as if rows were independent.
fn criterion(here: &Stretch, shape: &Shape, found: &Found) -> f64 {
    let rows = here.kept() as f64;
    rows * found.rss().max(f64::MIN_POSITIVE).ln() + shape.parameters(here) as f64 * rows.ln()
}

/// The best of some starts, each descended from.
fn lowest(short: &Stretch, shape: &Shape, starts: Vec<(Order, Vec<Point>)>) -> Option<Start> {
    let one = |(order, points): (Order, Vec<Point>)| {
        let wider = with_load(shape, order);
        let found = refine(short, &wider, &points, PASSES, &mut 0)?;
        Some(as_a_jump(short, shape, (criterion(short, &wider, &found), order, found)))
    };
    starts.into_iter().filter_map(one).min_by(|a, b| a.0.total_cmp(&b.0))
}

/// A load that is there at once, at its best row; one with a lag of few rows where it is better so. A lag shorter than a
/// row is a jump between two rows, and has no time of its own.
fn as_a_jump(here: &Stretch, shape: &Shape, start: Start) -> Start {
    const SHORTEST: f64 = 0.7;
    const SHORT: f64 = 4.0;
    let (_, order, found) = &start;
    let load = found.points[found.points.len() - 1];
    let rows_long = load.time_s / here.sample_time_s;
    if !matches!(order, Order::Jump | Order::First) || (*order == Order::First && rows_long > SHORT) {
        return start;
    }
    let wider = with_load(shape, Order::Jump);
    let width_s =
        if *order == Order::Jump { here.span_s() / BINS as f64 } else { SHORT * here.sample_time_s };
    let mut points = found.points.clone();
    let last = points.len() - 1;
    points[last].dead_time_s = on_a_row(here, load.dead_time_s + 0.5 * here.sample_time_s);
    let Some(jump) = refine(here, &wider, &points, PASSES, &mut 0) else { return start };
    let jump = at_the_best_row(here, &wider, jump, width_s);
    let value = criterion(here, &wider, &jump);
    if *order == Order::Jump || rows_long < SHORTEST || value < start.0 {
        return (value, Order::Jump, jump);
    }
    start
}

/// Whether residuals are white.
fn leaves_noise(short: &Stretch, shape: &Shape, found: &Found) -> bool {
    let (_, mut residuals) = free_run(short, shape, found);
    residuals.drain(..short.history.min(residuals.len()));
    ResidualTests::new(&residuals, &short.u[short.u.len() - residuals.len()..]).is_white()
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
