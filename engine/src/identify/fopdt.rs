//! The first-order-plus-dead-time fit by output error.

use super::FitError;
use super::gram::Linear;
use super::known::{reach_s, settled};
use super::optimise::{Bounds, Point, evaluate, no_reference, refine};
use super::problem::{FitProblem, Stretch};
use super::profile::dead_time_interval;
use super::response::{Dynamics, residuals};
use super::start::starts;
use super::statistics::{inverse, student_95, summed};
use crate::model::Fopdt;

/// Rows above which a start is sought on a thinned-out copy.
const START_ROWS: usize = 2048;
/// Coarsest step from one copy to the next.
const THINNING: usize = 32;
/// Passes a refinement may take.
const PASSES: usize = 40;
/// Above this many rows the cells next to the optimum are not tried.
const NEIGHBOUR_ROWS: usize = 20_000;

/// A pair of limits.
pub type Interval = [f64; 2];

/// One value for each of the model's three parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread<V> {
    /// For K, in PV units per MV unit.
    pub gain: V,
    /// For T, in seconds.
    pub time_constant_s: V,
    /// For L, in seconds.
    pub dead_time_s: V,
}

/// A fitted FOPDT with what is known about it.
#[derive(Debug, Clone, PartialEq)]
pub struct FopdtFit {
    /// K, T, L.
    pub model: Fopdt,
    /// Standard errors from the Jacobian and the residual variance; ∞ where the data cannot tell.
    pub standard_error: Spread<f64>,
    /// 95 % intervals (Student's t); those of T and L are cut at 0. Where the sample time exceeds the standard error of
    /// L, that of L is by likelihood ratio and need not be even about L.
    pub interval_95: Spread<Interval>,
    /// Covariance of (K, T, L).
    pub covariance: [[f64; 3]; 3],
    /// PV that an MV of 0 settles at, in PV units.
    pub bias: f64,
    /// Modelled PV of the first row, in PV units.
    pub initial_pv: f64,
    /// 100 (1 − ‖y − ŷ‖/‖y − ȳ‖) of the free run.
    pub fit_percent: f64,
    /// 1 − ‖y − ŷ‖²/‖y − ȳ‖².
    pub r2: f64,
    /// Mean squared residual, in PV units squared.
    pub mse: f64,
    /// Akaike's criterion, N ln(RSS/N) + 2 p with p unknowns.
    pub aic: f64,
    /// Rows fitted: all, but for those that answer an MV from before the first row or from a gap.
    pub rows: usize,
    /// Pieces between gaps.
    pub segments: usize,
    /// Free run ŷ, one value a row, in PV units; ahead of the first row fitted, the value there.
    pub simulated: Vec<f64>,
    /// Passes over all rows.
    pub passes: usize,
    /// Passes over thinned-out copies.
    pub thinned_passes: usize,
}

impl FopdtFit {
    /// y − ŷ, in PV units.
    #[must_use]
    pub fn residuals(&self, pv: &[f64]) -> Vec<f64> {
        pv.iter().zip(&self.simulated).map(|(y, simulated)| y - simulated).collect()
    }
}

/// Fits K e^(−Ls)/(T s + 1) to a stretch by output error.
///
/// y(t) = bias + K x(t) + free state, T ẋ = −x + u(t − L): exact for an MV held between arbitrary stamps, L ≥ 0
/// continuous. Minimises ‖y − ŷ‖² over K, T, L, bias and the initial state of each segment: a global start over
/// (T, L), then Gauss–Newton with the linear unknowns projected out. With a free start the rows within L of the start of a
/// segment answer an MV that is not known, and don't count.
///
/// # Errors
/// [`FitError`] names the column and the row of what is wrong with the data.
///
/// Source: Golub & Pereyra, SIAM J. Numer. Anal. 10 (1973) 413; Ljung, System Identification, 2nd ed., 7.2–7.4, 9.3.
pub fn fit_fopdt(problem: &FitProblem) -> Result<FopdtFit, FitError> {
    fit_with_stretch(problem).map(|(_, fit)| fit)
}

/// [`fit_fopdt`], and the stretch with the rows that counted.
pub(super) fn fit_with_stretch<'a>(problem: &FitProblem<'a>) -> Result<(Stretch<'a>, FopdtFit), FitError> {
    let stretch = problem.stretch()?;
    let bounds = Bounds::of(&stretch);
    let mut work = Work { passes: 0, thinned: 0 };
    let nothing = || FitError::NothingToFit {
        pv_name: problem.options.pv_name.clone(),
        mv_name: problem.options.mv_name.clone(),
    };
    let (known, best) = descend(&stretch, &bounds, &mut work);
    let best = try_fast_dynamics(&stretch, &known, best, &bounds, &mut work);
    let best = look_around(&known, best.ok_or_else(nothing)?, &bounds, &mut work);
    let refit = |known: &Stretch, from: &Point| {
        let found = refine(known, from.dynamics, &bounds, PASSES, &mut work.passes)?;
        Some(look_around(known, found, &bounds, &mut work))
    };
    let (stretch, best) = settled(&stretch, known, best, |at| reaches_s(&stretch, at), refit);
    let mut fit = report(&stretch, &best).ok_or_else(nothing)?;
    let error_s = fit.standard_error.dead_time_s;
    let t95 = student_95(stretch.kept().saturating_sub(stretch.unknowns()));
    if let Some(interval) = dead_time_interval(&stretch, &best, &bounds, error_s, t95, &mut work.passes) {
        fit.interval_95.dead_time_s = interval;
    }
    (fit.passes, fit.thinned_passes) = (work.passes, work.thinned);
    Ok((stretch, fit))
}

/// Dynamics faster than the thinned-out copies show, or an MV that repeats itself faster, can send the search astray:
/// starts again from the liveliest rows at full resolution, and goes on from there if all rows agree.
fn try_fast_dynamics(
    stretch: &Stretch,
    known: &Stretch,
    best: Option<Point>,
    bounds: &Bounds,
    work: &mut Work,
) -> Option<Point> {
    /// Windows as long as this many time constants tell them well.
    const TIME_CONSTANTS: f64 = 5.0;
    /// A start from a sample of the rows costs this much at most where it is right.
    const WORTH_REFINING: f64 = 1.05;
    if stretch.len() <= START_ROWS {
        return best;
    }
    let window = liveliest(stretch);
    let window_bounds = Bounds::of(&window);
    let Some(found) = descend(&window, &window_bounds, &mut Work { passes: 0, thinned: 0 }).1 else {
        return best;
    };
    let Some(best) = best else {
        return refine(known, found.dynamics, bounds, PASSES, &mut work.passes);
    };
    let (a, b) = (best.dynamics, found.dynamics);
    let alike = (a.time_constant_s / b.time_constant_s).ln().abs() < 0.5
        && (a.dead_time_s - b.dead_time_s).abs() < a.time_constant_s.max(3.0 * stretch.sample_time_s);
    if alike || b.time_constant_s * TIME_CONSTANTS > window.span_s() {
        return Some(best);
    }
    work.passes += 1;
    let promising =
        evaluate(known, b, &no_reference(known)).filter(|p| p.rss() < WORTH_REFINING * best.rss());
    let again = promising.and_then(|_| refine(known, b, bounds, PASSES, &mut work.passes));
    better(Some(best), again)
}

/// How far back a fit looks, with and without room for doubt about its dead time.
fn reaches_s(stretch: &Stretch, at: &Point) -> [f64; 2] {
    let spare = stretch.kept().saturating_sub(stretch.unknowns()).max(1) as f64;
    let error_s = covariance(at, at.rss() / spare)[2][2].sqrt();
    reach_s(at.dynamics.dead_time_s, error_s)
}

struct Work {
    passes: usize,
    thinned: usize,
}

fn better(a: Option<Point>, b: Option<Point>) -> Option<Point> {
    match (a, b) {
        (Some(a), Some(b)) => Some(if b.rss() < a.rss() { b } else { a }),
        (a, b) => a.or(b),
    }
}

/// From the thinnest copy to all rows; with those of them that the dead time of the copies leaves to count.
fn descend<'a>(stretch: &Stretch<'a>, bounds: &Bounds, work: &mut Work) -> (Stretch<'a>, Option<Point>) {
    let mut copies: Vec<Stretch> = Vec::new();
    while let Some(factor) = {
        let rows = copies.last().unwrap_or(stretch).len();
        (rows > START_ROWS).then(|| (rows / (START_ROWS / 2)).clamp(2, THINNING))
    } {
        let copy = copies.last().unwrap_or(stretch).thinned(factor);
        copies.push(copy);
    }
    let coarsest = copies.last().unwrap_or(stretch);
    let mut count = 0;
    let mut best = None;
    for start in starts(coarsest) {
        best = better(best, refine(coarsest, start, bounds, PASSES, &mut count));
    }
    let (Some(mut best), Some(first_copy)) = (best.clone(), copies.first()) else {
        work.passes += count;
        return (stretch.clone(), best);
    };
    for copy in copies.iter().rev().skip(1) {
        best = refine(copy, best.dynamics, bounds, PASSES, &mut count).unwrap_or(best);
    }
    work.thinned += count;
    // A copy tells the dead time to a part of its step.
    let reach_s = reaches_s(first_copy, &best)[0] + 0.5 * first_copy.sample_time_s;
    let known = stretch.known_after(reach_s).unwrap_or_else(|| stretch.clone());
    let found = refine(&known, best.dynamics, bounds, PASSES, &mut work.passes);
    (known, found)
}

/// The cost has a kink wherever L passes a row: tries the neighbouring cells where the rows are far apart.
fn look_around(stretch: &Stretch, best: Point, bounds: &Bounds, work: &mut Work) -> Point {
    const CELL_PASSES: usize = 8;
    let found = best.dynamics;
    let coarse = stretch.sample_time_s > 0.02 * found.time_constant_s;
    if !coarse || stretch.len() > NEIGHBOUR_ROWS {
        return best;
    }
    let cell = (found.dead_time_s / stretch.sample_time_s).floor();
    let mut best = best;
    for middle in [cell - 0.5, cell + 1.5] {
        if middle > 0.0 {
            let start = Dynamics { dead_time_s: middle * stretch.sample_time_s, ..found };
            if let Some(other) = refine(stretch, start, bounds, CELL_PASSES, &mut work.passes)
                && other.rss() < best.rss()
            {
                best = other;
            }
        }
    }
    best
}

/// The [`START_ROWS`] neighbouring rows in which the MV varies most.
fn liveliest<'a>(s: &Stretch<'a>) -> Stretch<'a> {
    let first = (0..=s.len() - START_ROWS)
        .step_by(START_ROWS / 2)
        .max_by(|&a, &b| activity(&s.u[a..a + START_ROWS]).total_cmp(&activity(&s.u[b..b + START_ROWS])))
        .unwrap_or(0);
    let mut window = s.clone();
    let rows = first..first + START_ROWS;
    let u_before = if first > 0 { s.u[first - 1] } else { s.u_before };
    let slice = |v: &[f64]| std::borrow::Cow::Owned(v[rows.clone()].to_vec());
    (window.t, window.u, window.y) = (slice(&s.t), slice(&s.u), slice(&s.y));
    window.u_before = u_before;
    window.segments.truncate(1);
    window.at_rest = s.at_rest && first == 0;
    window
}

fn activity(u: &[f64]) -> f64 {
    u.windows(2).map(|w| (w[1] - w[0]).abs()).sum()
}

fn report(stretch: &Stretch, best: &Point) -> Option<FopdtFit> {
    let Dynamics { time_constant_s, dead_time_s } = best.dynamics;
    let linear = &best.projected.linear;
    let model = Fopdt::new(linear.gain, time_constant_s, dead_time_s).ok()?;
    let (simulated, rss) = free_run(stretch, best.dynamics, linear);
    let rows = stretch.kept();
    let movement: f64 = (0..stretch.segments.len())
        .map(|s| summed(&stretch.y[stretch.known(s)], |y| (y - stretch.y_ref).powi(2)))
        .sum();
    let freedom = rows.saturating_sub(stretch.unknowns()).max(1);
    let covariance = covariance(best, rss / freedom as f64);
    let standard_error = Spread {
        gain: covariance[0][0].sqrt(),
        time_constant_s: covariance[1][1].sqrt(),
        dead_time_s: covariance[2][2].sqrt(),
    };
    let t95 = student_95(freedom);
    let around = |value: f64, error: f64, floor: f64| [(value - t95 * error).max(floor), value + t95 * error];
    Some(FopdtFit {
        model,
        standard_error,
        interval_95: Spread {
            gain: around(model.gain, standard_error.gain, f64::NEG_INFINITY),
            time_constant_s: around(time_constant_s, standard_error.time_constant_s, 0.0),
            dead_time_s: around(dead_time_s, standard_error.dead_time_s, 0.0),
        },
        covariance,
        bias: stretch.y_ref + linear.bias - linear.gain * stretch.u_ref,
        initial_pv: simulated[0],
        fit_percent: 100.0 * (1.0 - (rss / movement).sqrt()),
        r2: 1.0 - rss / movement,
        mse: rss / rows as f64,
        aic: rows as f64 * (rss / rows as f64).max(f64::MIN_POSITIVE).ln() + 2.0 * stretch.unknowns() as f64,
        rows,
        segments: stretch.segments.len(),
        simulated,
        passes: 0,
        thinned_passes: 0,
    })
}

fn free_run(stretch: &Stretch, dynamics: Dynamics, linear: &Linear) -> (Vec<f64>, f64) {
    let mut simulated = vec![f64::NAN; stretch.len()];
    let mut rss = 0.0;
    residuals(stretch, dynamics, linear, |first, r| {
        for (i, r) in r.iter().enumerate() {
            simulated[first + i] = stretch.y[first + i] - r;
        }
        rss += r.iter().map(|r| r * r).sum::<f64>();
    });
    (stretch.filled_back(simulated), rss)
}

/// Covariance of (K, T, L) from that of (bias, K, ln T, L/T).
fn covariance(best: &Point, variance: f64) -> [[f64; 3]; 3] {
    let time_constant_s = best.dynamics.time_constant_s;
    let scale = [1.0, time_constant_s, time_constant_s];
    match inverse(&best.projected.matrix) {
        Some(c) => {
            std::array::from_fn(|i| std::array::from_fn(|j| variance * scale[i] * scale[j] * c[i + 1][j + 1]))
        }
        None => [[f64::INFINITY; 3]; 3],
    }
}
