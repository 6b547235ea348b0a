//! Fits one structure by output error and reports on it.

use super::fopdt::{Interval, fit_with_stretch};
use super::judge;
use super::known::{reach_s, settled};
use super::model_fit::{DisturbanceFit, LoadFit, ModelFit};
use super::output_error::{
    Around, Found, Linear, Near, Order, Point, Shape, Symmetric, Work, again, blocks, dead_time_interval,
    evaluate, is_wide, search,
};
use super::parameters::{Coordinates, Parameter};
use super::problem::{Drift, FitProblem, Loads, Stretch};
use super::residual_tests::ResidualTests;
use super::statistics::student_95;
use super::step_load::with_loads_where_due;
use super::{Choice, FitError, Structure};

/// Fits one structure to a stretch by output error.
///
/// y(t) = bias + drift t + G u + Σ Gj dj + free state: exact for inputs held between arbitrary stamps, dead times
/// continuous, a free state for each segment; rows within L of a segment's start answer an MV that is not known, and don't
/// count. Drift is fitted where `options.drift` asks for it; an integrating model
/// always has it, as the MV at which its PV stands still. Measured disturbances are first order, or integrating with
/// the main model. Intervals are Student's; where the residuals are not white, the covariance is multiplied by the
/// number of rows that say as much as one independent row.
///
/// # Errors
/// [`FitError`] names the column and the row of what is wrong with the data.
///
/// Source: Golub & Pereyra, SIAM J. Numer. Anal. 10 (1973) 413; Ljung, System Identification, 2nd ed., 7.2–7.4, 9.3.
pub fn fit_model(problem: &FitProblem, structure: Structure) -> Result<ModelFit, FitError> {
    let stretch = problem.stretch()?;
    let with = problem.options.drift == Drift::Linear;
    let plain = fit_on(problem, &stretch, structure, with, &Near::default())?;
    let auto = problem.options.drift == Drift::Auto && structure != Structure::Ipdt;
    let drifting = if auto { with_drift_where_due(problem, &stretch, plain.clone()) } else { plain.clone() };
    if problem.options.loads == Loads::None {
        return Ok(drifting);
    }
    let (plain, drifting) = (Choice::of_one(plain), Choice::of_one(drifting));
    Ok(with_loads_where_due(problem, &stretch, &plain, drifting).into_chosen())
}

/// Adds a drift where it explains far more than its own unknown would by chance.
pub(super) fn with_drift_where_due(problem: &FitProblem, stretch: &Stretch, plain: ModelFit) -> ModelFit {
    /// Schwarz's criterion must fall by this much: "very strong" evidence (Kass & Raftery, JASA 90 (1995) 773).
    const VERY_STRONG: f64 = 10.0;
    // Residuals without a trend leave a drift nothing to explain.
    if plain.fit_percent > 99.9 || plain.tests.is_white() || !tells_drift(stretch, &plain) {
        return plain;
    }
    let near = Near { same: Some(plain.coordinates.point()), ..Near::default() };
    let Ok(drifting) = fit_on(problem, stretch, plain.structure, true, &near) else { return plain };
    let independent = plain.rows as f64 / drifting.tests.rows_per_independent;
    let gained = independent * (plain.mse / drifting.mse).ln() - independent.max(2.0).ln();
    let told = drifting.drift.is_some_and(|(_, [low, high])| low > 0.0 || high < 0.0);
    if gained > VERY_STRONG && told { drifting } else { plain }
}

/// A drift and the end of a slow response look alike: they are told apart where the MV moves more than once and the
/// record is long for the dynamics.
fn tells_drift(stretch: &Stretch, fit: &ModelFit) -> bool {
    const TIME_CONSTANTS: f64 = 6.0;
    let moves = stretch.u.windows(2).filter(|w| w[0] != w[1]).take(2).count();
    let slow_s: f64 = ["T_s", "T2_s", "L_s"].iter().filter_map(|n| fit.parameter(n)).map(|p| p.value).sum();
    moves > 1 && stretch.span_s() > TIME_CONSTANTS * slow_s
}

/// Fits a structure with or without drift; `near` are points of the main channel already found.
pub(super) fn fit_on(
    problem: &FitProblem,
    stretch: &Stretch,
    structure: Structure,
    drift: bool,
    near: &Near,
) -> Result<ModelFit, FitError> {
    let shape = shape_of(stretch, structure, drift);
    let nothing = || FitError::NothingToFit {
        pv_name: problem.options.pv_name.clone(),
        mv_name: problem.options.mv_name.clone(),
    };
    let mut work = Work::default();
    let plain =
        structure == Structure::Fopdt && !drift && stretch.keep.is_none() && problem.disturbances.is_empty();
    let mut by_short_cut = None;
    let (known, found) = if plain {
        let (known, fit) = fit_with_stretch(problem)?;
        work = Work { passes: fit.passes + 1, thinned: fit.thinned_passes };
        by_short_cut = Some(fit.interval_95.dead_time_s);
        let point =
            Point { time_s: fit.model.time_constant_s, zeta: 1.0, dead_time_s: fit.model.dead_time_s };
        // Residuals against the short cut's answer keep the digits that the inner products would square away.
        let mut reference = Linear::zero(&shape, &known);
        reference.shared = vec![fit.bias + fit.model.gain * known.u_ref - known.y_ref, fit.model.gain];
        let found = evaluate(&known, &shape, vec![point], &reference).ok_or_else(nothing)?;
        (known, found)
    } else {
        let first = search(stretch, &shape, near, &mut work).ok_or_else(nothing)?;
        let refit = |known: &Stretch, from: &Found| again(known, &shape, &from.points, &mut work);
        settled(stretch, stretch.clone(), first, |found| reaches_s(stretch, &shape, found), refit)
    };
    let mut fit = report(problem, &known, structure, &shape, &found).ok_or_else(nothing)?;
    profile_dead_times(&known, &shape, &found, by_short_cut, &mut fit, &mut work);
    (fit.passes, fit.thinned_passes) = (work.passes, work.thinned);
    fit.verdicts = judge::of_model(&fit, &known, problem);
    Ok(fit)
}

/// How far back a fit looks, with and without room for doubt about its dead times: the farthest of its channels.
///
/// A disturbance that stands still from the first row on for as long as its dead time is taken to have stood still ahead of
/// it as well, and one of a long dead time to have been where it starts: the rows it would cost tell more of the MV than its
/// unknown past spoils.
pub(super) fn reaches_s(stretch: &Stretch, shape: &Shape, found: &Found) -> [f64; 2] {
    /// Part of the stretch beyond which the dead time of a disturbance costs too many rows.
    const LONG: f64 = 0.1;
    let spare = stretch.kept().saturating_sub(shape.parameters(stretch)).max(1) as f64;
    let covariance = found.projected.matrix.inverse();
    let inputs = found.points.iter().take(shape.inputs());
    inputs.enumerate().fold([0.0_f64; 2], |farthest, (channel, point)| {
        let at = shape.shared.len() + shape.first_unknown(channel) + shape.channels[channel].unknowns() - 1;
        let error =
            covariance.as_ref().map_or(f64::INFINITY, |c| (found.rss() / spare * c.at(at, at)).sqrt());
        let own = reach_s(point.dead_time_s, error * point.time_s);
        let rests = stretch.rests_s(channel) > point.dead_time_s;
        if channel > 0 && (rests || own[0] > LONG * stretch.span_s()) {
            return farthest;
        }
        [farthest[0].max(own[0]), farthest[1].max(own[1])]
    })
}

/// Intervals of the dead times by likelihood ratio, where the curvature would not do; `by_short_cut` is that of the
/// short cut, which holds where the residuals are white and the interval is narrow.
pub(super) fn profile_dead_times(
    stretch: &Stretch,
    shape: &Shape,
    found: &Found,
    by_short_cut: Option<Interval>,
    fit: &mut ModelFit,
    work: &mut Work,
) {
    let variance = fit.mse * fit.rows as f64 / freedom(fit.rows, fit.unknowns, &fit.tests);
    let white = fit.tests.rows_per_independent <= 1.0;
    let student = fit.student;
    let main = std::iter::once(&mut fit.parameters);
    let all = main.chain(fit.disturbances.iter_mut().map(|d| &mut d.parameters));
    for (channel, parameters) in all.enumerate() {
        let Some(l) = parameters.iter_mut().find(|p| p.name == "L_s") else { continue };
        let around = Around { channel, standard_error_s: l.standard_error, student, variance };
        let known = by_short_cut.filter(|_| white && !is_wide(stretch, shape, found, around));
        let interval = known.or_else(|| dead_time_interval(stretch, shape, found, around, &mut work.passes));
        l.interval_95 = interval.unwrap_or(l.interval_95);
    }
}

/// The shape of a fit, on its stretch.
pub(super) fn shape_like(stretch: &Stretch, fit: &ModelFit) -> Shape {
    let loads: Vec<Order> = fit.loads.iter().map(|load| load.order).collect();
    shape_with(stretch, fit.structure, fit.drift.is_some(), &loads)
}

pub(super) fn shape_of(stretch: &Stretch, structure: Structure, drift: bool) -> Shape {
    shape_with(stretch, structure, drift, &[])
}

/// The shape of a structure with loads besides what was measured.
pub(super) fn shape_with(stretch: &Stretch, structure: Structure, drift: bool, loads: &[Order]) -> Shape {
    let (main, other) = match structure {
        Structure::Fopdt => (Order::First, Order::First),
        Structure::Ipdt => (Order::Integrator, Order::Integrator),
        Structure::Sopdt => (Order::Second { zero: false }, Order::First),
        Structure::SopdtZero => (Order::Second { zero: true }, Order::First),
    };
    let mut channels = vec![main];
    channels.extend(stretch.others.iter().map(|_| other));
    Shape::with_loads(channels, loads, drift, stretch.has_free())
}

pub(super) fn report(
    problem: &FitProblem,
    stretch: &Stretch,
    structure: Structure,
    shape: &Shape,
    found: &Found,
) -> Option<ModelFit> {
    let linear = &found.projected.linear;
    let (simulated, mut residuals) = free_run(stretch, shape, found);
    let simulated = stretch.filled_back(simulated);
    residuals.drain(..stretch.history);
    let rows = stretch.kept();
    let rss: f64 = residuals.iter().map(|r| r * r).sum();
    let movement: f64 = stretch.kept_rows().map(|k| (stretch.y[k] - stretch.y_ref).powi(2)).sum();
    let unknowns = shape.parameters(stretch);
    let tests = ResidualTests::new(&residuals, &stretch.u[stretch.history..]);
    let freedom = freedom(rows, unknowns, &tests);
    let student = student_95(freedom as usize);
    let variance = rss / freedom;
    let whole = found.projected.matrix.inverse();
    let coordinates = |channel: usize, structure: Structure| {
        let places = places(shape, channel);
        let covariance = taken(whole.as_ref(), &places, variance);
        let first = shape.gains[channel];
        let gains = if structure == Structure::SopdtZero { 2 } else { 1 };
        Coordinates::new(structure, &linear.shared[first..first + gains], found.points[channel], covariance)
    };
    let main = coordinates(0, structure);
    let model = main.model_at(&main.values).ok()?;
    let other = if structure == Structure::Ipdt { Structure::Ipdt } else { Structure::Fopdt };
    let mut disturbances = Vec::new();
    for (i, d) in problem.disturbances.iter().enumerate() {
        let c = coordinates(i + 1, other);
        let model = c.model_at(&c.values).ok()?;
        disturbances.push(DisturbanceFit { name: d.name.clone(), model, parameters: c.parameters(student) });
    }
    let slope = shape.drift_term().map(|at| {
        let error = taken(whole.as_ref(), &[at], variance).at(0, 0).sqrt();
        let value = linear.shared[at];
        (value, [value - student * error, value + student * error] as Interval)
    });
    let gain = linear.shared[shape.gains[0]];
    let centred: f64 =
        (0..shape.inputs()).map(|i| linear.shared[shape.gains[i]] * stretch.input(i).reference).sum();
    let mse = rss / rows as f64;
    let mut parameters = main.parameters(student);
    parameters.iter_mut().for_each(|p| forget(p, stretch));
    Some(ModelFit {
        structure,
        model,
        parameters,
        disturbances,
        loads: loads_of(stretch, shape, found, whole.as_ref().map(|w| (w, variance)), student),
        bias: (!shape.integrating()).then(|| stretch.y_ref + linear.shared[0] - centred),
        mv_at_rest: slope.filter(|_| shape.integrating()).map(|(s, _)| stretch.u_ref - s / gain),
        drift: slope.filter(|_| !shape.integrating()),
        initial_pv: simulated[0],
        fit_percent: 100.0 * (1.0 - (rss / movement).sqrt()),
        r2: 1.0 - rss / movement,
        mse,
        aic: rows as f64 * mse.max(f64::MIN_POSITIVE).ln() + 2.0 * unknowns as f64,
        unknowns,
        rows,
        segments: stretch.segments.len(),
        simulated,
        residuals,
        tests,
        verdicts: Vec::new(),
        passes: 0,
        thinned_passes: 0,
        student,
        coordinates: main,
        reach_s: reaches_s(stretch, shape, found)[0],
        known_from: (0..stretch.segments.len()).map(|s| stretch.known(s).start - stretch.history).collect(),
    })
}

/// Independent rows beyond the unknowns: where few rows are independent, what is left over tells little of their noise, and
/// its correlation comes out too small.
fn freedom(rows: usize, unknowns: usize, tests: &ResidualTests) -> f64 {
    /// As few as Student's t still has a use for.
    const LEAST: f64 = 3.0;
    let spare = |independent: f64, least: f64| (independent - unknowns as f64).max(least);
    if tests.rows_per_independent > 1.0 {
        spare(rows as f64 / tests.rows_per_independent, LEAST)
    } else {
        spare(rows as f64, 1.0)
    }
}

/// The loads of a fit with their intervals.
fn loads_of(
    stretch: &Stretch,
    shape: &Shape,
    found: &Found,
    covariance: Option<(&Symmetric, f64)>,
    student: f64,
) -> Vec<LoadFit> {
    let error =
        |at: usize| covariance.map_or(f64::INFINITY, |(c, variance)| (variance * c.at(at, at)).sqrt());
    let around = |value: f64, error: f64| [value - student * error, value + student * error];
    (shape.inputs()..shape.channels.len())
        .map(|i| {
            let (order, point, gain) = (shape.channels[i], found.points[i], shape.gains[i]);
            let change = found.projected.linear.shared[gain];
            let at_s = stretch.origin_s + point.dead_time_s;
            // A jump lies between two rows.
            let at_interval_95 = if order == Order::Jump {
                [at_s - stretch.sample_time_s, at_s]
            } else {
                let last = shape.shared.len() + shape.first_unknown(i) + order.unknowns() - 1;
                around(at_s, error(last) * point.time_s)
            };
            LoadFit {
                at_s,
                at_interval_95,
                change,
                change_interval_95: around(change, error(gain)),
                order,
                point,
            }
        })
        .collect()
}

/// A time whose interval reaches far beyond the stretch, or a gain whose interval dwarfs all that was seen, is unknown.
fn forget(p: &mut Parameter, stretch: &Stretch) {
    /// Lengths of the stretch.
    const SPANS: f64 = 1e3;
    /// Ratios of the PV's range to the MV's.
    const GAINS: f64 = 1e6;
    let range = |values: &[f64]| {
        let ends = values.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], v| [a.min(*v), b.max(*v)]);
        ends[1] - ends[0]
    };
    let width = p.interval_95[1] - p.interval_95[0];
    let (most, low) = match p.name {
        "K" => (GAINS * range(&stretch.y) / range(&stretch.u), f64::NEG_INFINITY),
        "Kv" => (GAINS * range(&stretch.y) / (range(&stretch.u) * stretch.span_s()), f64::NEG_INFINITY),
        "zeta" => (SPANS, 0.0),
        "Tz_s" => (SPANS * stretch.span_s(), f64::NEG_INFINITY),
        _ => (SPANS * stretch.span_s(), 0.0),
    };
    if width.is_nan() || width > most {
        p.standard_error = f64::INFINITY;
        p.interval_95 = [low, f64::INFINITY];
    }
}

/// Places of a channel's gains and unknowns in the matrix of the projected problem.
fn places(shape: &Shape, channel: usize) -> Vec<usize> {
    let order = shape.channels[channel];
    let gains = if order == (Order::Second { zero: true }) { 2 } else { 1 };
    let first = shape.shared.len() + shape.first_unknown(channel);
    (shape.gains[channel]..shape.gains[channel] + gains).chain(first..first + order.unknowns()).collect()
}

/// Part of a covariance, scaled; ∞ where there is none.
fn taken(whole: Option<&Symmetric>, places: &[usize], variance: f64) -> Symmetric {
    let mut out = Symmetric::zero(places.len());
    for (i, &p) in places.iter().enumerate() {
        for (j, &q) in places.iter().enumerate() {
            out.set(i, j, whole.map_or(f64::INFINITY, |w| variance * w.at(p, q)));
        }
    }
    out
}

/// Free run ŷ on every known row, and the residuals of those that count; NaN and 0 on the others.
pub(super) fn free_run(stretch: &Stretch, shape: &Shape, found: &Found) -> (Vec<f64>, Vec<f64>) {
    let mut simulated = vec![f64::NAN; stretch.len()];
    let mut residuals = vec![0.0; stretch.len()];
    let whole = Stretch { keep: None, ..stretch.clone() };
    blocks(
        &whole,
        &shape.without_derivatives(),
        &found.points,
        &found.projected.linear,
        |_, first, columns| {
            for (i, r) in columns.values[shape.residual][..columns.rows].iter().enumerate() {
                simulated[first + i] = stretch.y[first + i] - r;
                residuals[first + i] = if stretch.is_kept(first + i) { *r } else { 0.0 };
            }
        },
    );
    (simulated, residuals)
}
