//! Which structure a stretch speaks for.

use super::fit_structure::{fit_on, shape_like, with_drift_where_due};
use super::model_fit::ModelFit;
use super::output_error::{Linear, Near, evaluate};
use super::problem::{Drift, FitProblem, Loads, Stretch};
use super::step_load::with_loads_where_due;
use super::{FitError, FitVerdict, Structure};

/// Several structures on one stretch, best first.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    /// Fits with their criterion, best first; never empty.
    pub fits: Vec<ModelFit>,
    /// Schwarz's criterion of each fit, n ln(RSS/N) + p ln n with n independent rows, less the smallest.
    pub criterion: Vec<f64>,
}

impl Choice {
    /// A choice of one.
    #[must_use]
    pub fn of_one(fit: ModelFit) -> Self {
        Self { fits: vec![fit], criterion: vec![0.0] }
    }

    /// The fit chosen, without the others.
    pub(super) fn into_chosen(mut self) -> ModelFit {
        self.fits.swap_remove(0)
    }

    /// Says of every fit that the stretch cannot tell a model: nothing else about it matters then.
    pub(super) fn refuse(&mut self, verdict: &FitVerdict) {
        for fit in &mut self.fits {
            fit.verdicts = vec![verdict.clone()];
        }
    }

    /// Takes back that a fit is poor where noise of this standard deviation, in PV units, is all that it leaves.
    pub(crate) fn weigh_noise(&mut self, noise_sd: f64) {
        /// What a drift or a converter may add to the noise heard at rest.
        const ROOM: f64 = 1.3;
        for fit in self.fits.iter_mut().filter(|fit| fit.mse.sqrt() < ROOM * noise_sd) {
            for verdict in &mut fit.verdicts {
                if let FitVerdict::Poor { fit_percent } = *verdict {
                    *verdict = FitVerdict::Noisy { fit_percent };
                }
            }
        }
    }

    /// The fit chosen.
    #[must_use]
    pub fn chosen(&self) -> &ModelFit {
        &self.fits[0]
    }

    /// The next best, where another structure could be fitted.
    #[must_use]
    pub fn runner_up(&self) -> Option<&ModelFit> {
        self.fits.get(1)
    }
}

/// Fits all structures and puts the one first that Schwarz's criterion prefers.
///
/// The criterion counts independent rows only, n = N/(1 + 2 Σ ρ) of the best fit's residuals: rows that repeat each
/// other's noise would otherwise speak for ever more parameters. A structure without an interval for all its
/// parameters, with a second time constant smaller than its standard error, a zero whose interval holds 0, or a time
/// constant beyond twice the stretch, comes after those without such a flaw.
///
/// # Errors
/// [`FitError`] as [`super::fit_model`], where no structure can be fitted.
///
/// Source: Schwarz, Annals of Statistics 6 (1978) 461; Ljung, System Identification, 2nd ed., 16.4.
pub fn choose_model(problem: &FitProblem) -> Result<Choice, FitError> {
    choose_among(problem, &Structure::CHOICE)
}

/// [`choose_model`] among some structures, each after those whose dynamics start it.
///
/// # Errors
/// As there.
pub fn choose_among(problem: &FitProblem, structures: &[Structure]) -> Result<Choice, FitError> {
    let stretch = problem.stretch()?;
    let drift = problem.options.drift == Drift::Linear;
    let mut fits: Vec<ModelFit> = Vec::new();
    let mut first_error = None;
    for &structure in structures {
        let point = |of: Structure| fits.iter().find(|f| f.structure == of).map(|f| f.coordinates.point());
        let same = (structure == Structure::SopdtZero).then(|| point(Structure::Sopdt)).flatten();
        let near = Near { first: point(Structure::Fopdt), same };
        match fit_on(problem, &stretch, structure, drift, &near) {
            Ok(fit) => fits.push(fit),
            Err(error) => first_error = first_error.or(Some(error)),
        }
    }
    if fits.is_empty() {
        return Err(first_error.unwrap_or(FitError::TooFewSamples { rows: stretch.len(), needed: 0 }));
    }
    let plain = rank(fits, &stretch);
    let mut drifting = plain.clone();
    if problem.options.drift == Drift::Auto && plain.chosen().structure != Structure::Ipdt {
        drifting.fits[0] = with_drift_where_due(problem, &stretch, plain.chosen().clone());
    }
    if problem.options.loads == Loads::None {
        return Ok(drifting);
    }
    Ok(with_loads_where_due(problem, &stretch, &plain, drifting))
}

/// Fits of a stretch, at least one, in the order of the criterion.
pub(super) fn rank(fits: Vec<ModelFit>, stretch: &Stretch) -> Choice {
    let squares = mean_squares(&fits, stretch);
    let best = fits.iter().zip(&squares).min_by(|a, b| a.1.total_cmp(b.1));
    let best = best.map_or(1.0, |(fit, _)| fit.tests.rows_per_independent);
    let n = (fits[0].rows as f64 / best).max(10.0);
    // Below this the rows are explained to rounding and the criterion would weigh digits.
    let floor =
        1e-18 * stretch.y.iter().map(|y| (y - stretch.y_ref).powi(2)).sum::<f64>() / stretch.len() as f64;
    let criterion =
        |f: &ModelFit, mse: f64| n * mse.max(floor).max(f64::MIN_POSITIVE).ln() + f.unknowns as f64 * n.ln();
    let span_s = stretch.span_s();
    let mut order: Vec<(bool, f64, ModelFit)> = fits
        .into_iter()
        .zip(squares)
        .map(|(f, mse)| (is_flawed(&f, span_s), criterion(&f, mse), f))
        .collect();
    order.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let enough = (0..order.len())
        .filter(|&i| order[i].0 == order[0].0 && order[i].1 < order[0].1 + VERY_STRONG)
        // What still follows the MV is in the process, however little it weighs.
        .filter(|&i| order[0].2.tests.follows_input() || !order[i].2.tests.follows_input());
    if let Some(simplest) = enough.min_by_key(|&i| order[i].2.unknowns) {
        order[..=simplest].rotate_right(1);
    }
    let smallest = order.iter().map(|o| o.1).fold(f64::INFINITY, f64::min);
    let criterion = order.iter().map(|o| o.1 - smallest).collect();
    Choice { fits: order.into_iter().map(|o| o.2).collect(), criterion }
}

/// Mean squared residual of each fit on the same rows, in PV units squared.
///
/// Each leaves out what its own dead time cannot explain at the start; one that takes a slow beginning for a dead time would
/// leave out what speaks against it. Compared are the rows that half of them explain.
fn mean_squares(fits: &[ModelFit], stretch: &Stretch) -> Vec<f64> {
    let mut reaches: Vec<f64> = fits.iter().map(|f| f.reach_s).collect();
    reaches.sort_by(f64::total_cmp);
    let typical = reaches.get(reaches.len().saturating_sub(1) / 2).copied().unwrap_or(0.0);
    let Some(common) = stretch.known_after(typical) else { return fits.iter().map(|f| f.mse).collect() };
    let rows = common.kept() as f64;
    fits.iter()
        .map(|f| {
            if f.known_from.iter().enumerate().all(|(s, from)| common.known(s).start == common.history + from)
            {
                return f.mse;
            }
            let shape = shape_like(&common, f).without_derivatives();
            let at = evaluate(&common, &shape, f.points(), &Linear::zero(&shape, &common));
            at.map_or(f64::INFINITY, |at| at.rss() / rows)
        })
        .collect()
}

/// Difference of Schwarz's criterion that is "very strong" evidence (Kass & Raftery, JASA 90 (1995) 773).
const VERY_STRONG: f64 = 10.0;

/// Whether a zero may cancel a time constant: their ratio is not told from 1, or next to it.
fn cancels(fit: &ModelFit) -> bool {
    /// A pole and a zero this close leave nothing to see between them.
    const ALIKE: f64 = 0.1;
    let (Some(zero), true) = (fit.parameter("Tz_s"), fit.parameter("T2_s").is_some()) else { return false };
    ["T_s", "T2_s"].iter().filter_map(|name| fit.parameter(name)).any(|pole| {
        let apart =
            zero.interval_95[0].max(pole.interval_95[0]) > zero.interval_95[1].min(pole.interval_95[1]);
        (zero.value / pole.value - 1.0).abs() < ALIKE || !apart
    })
}

/// Whether a parameter that sets the structure apart from a simpler one cannot be told from nothing.
fn is_flawed(fit: &ModelFit, span_s: f64) -> bool {
    let unknown = fit.parameters.iter().any(|p| !p.standard_error.is_finite());
    let nothing =
        |name: &str| fit.parameter(name).is_some_and(|p| p.interval_95[0] <= 0.0 && p.interval_95[1] >= 0.0);
    let scattered = fit.parameter("T2_s").is_some_and(|p| p.standard_error > p.value);
    let long = fit.parameter("T_s").is_some_and(|t| t.value > 2.0 * span_s);
    unknown || scattered || nothing("T2_s") || nothing("Tz_s") || cancels(fit) || long
}
