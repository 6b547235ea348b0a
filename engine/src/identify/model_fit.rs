//! What a fit of any structure says, and how far it can be trusted.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::fopdt::Interval;
use super::output_error::{Order, Point, Symmetric};
use super::parameters::{Coordinates, Parameter};
use super::residual_tests::ResidualTests;
use super::{FitVerdict, Structure};
use crate::model::{ProcessModel, SampledInput, simulate_process};

/// Model from a measured disturbance to the PV.
#[derive(Debug, Clone, PartialEq)]
pub struct DisturbanceFit {
    /// Name of the column.
    pub name: String,
    /// First order, or integrating where the main model is.
    pub model: ProcessModel,
    /// Its parameters with their intervals.
    pub parameters: Vec<Parameter>,
}

/// What moved the PV once besides all that was measured: a step behind its own lag.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadFit {
    /// When it came, in seconds of the record.
    pub at_s: f64,
    /// Its 95 % interval, in seconds.
    pub at_interval_95: Interval,
    /// What it adds to the PV in the end, in PV units; see [`Self::integrates`].
    pub change: f64,
    /// Its 95 % interval.
    pub change_interval_95: Interval,
    pub(super) order: Order,
    pub(super) point: Point,
}

impl LoadFit {
    /// Whether the PV runs away from it: then the change is one of its rate, in PV units per second.
    #[must_use]
    pub fn integrates(&self) -> bool {
        self.order == Order::Integrator
    }
}

/// A fitted model of one structure.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelFit {
    /// Structure fitted.
    pub structure: Structure,
    /// From the MV to the PV.
    pub model: ProcessModel,
    /// Its parameters with their intervals.
    pub parameters: Vec<Parameter>,
    /// From measured disturbances to the PV.
    pub disturbances: Vec<DisturbanceFit>,
    /// What moved the PV besides, where it was looked for and found.
    pub loads: Vec<LoadFit>,
    /// PV that an MV of 0 settles at, in PV units; absent for an integrating model.
    pub bias: Option<f64>,
    /// MV at which an integrating PV stands still, in MV units.
    pub mv_at_rest: Option<f64>,
    /// Slow drift of the PV that goes with no input, in PV units per second, with its interval.
    pub drift: Option<(f64, Interval)>,
    /// Modelled PV of the first row fitted, in PV units.
    pub initial_pv: f64,
    /// 100 (1 − ‖y − ŷ‖/‖y − ȳ‖) of the free run.
    pub fit_percent: f64,
    /// 1 − ‖y − ŷ‖²/‖y − ȳ‖².
    pub r2: f64,
    /// Mean squared residual, in PV units squared.
    pub mse: f64,
    /// Akaike's criterion, N ln(RSS/N) + 2 p with p unknowns.
    pub aic: f64,
    /// Number of unknowns p, free states and all.
    pub unknowns: usize,
    /// Rows fitted.
    pub rows: usize,
    /// Pieces between gaps.
    pub segments: usize,
    /// Free run ŷ, one value a row, in PV units; ahead of the first row fitted, the value there.
    pub simulated: Vec<f64>,
    /// Residuals y − ŷ, 0 where a row did not count, in PV units.
    pub residuals: Vec<f64>,
    /// Correlations of the residuals.
    pub tests: ResidualTests,
    /// Findings, most important first; never empty.
    pub verdicts: Vec<FitVerdict>,
    /// Passes over all rows.
    pub passes: usize,
    /// Passes over thinned-out copies.
    pub thinned_passes: usize,
    /// Two-sided 95 % quantile the intervals use.
    pub(super) student: f64,
    pub(super) coordinates: Coordinates,
    /// How far back the fit looks, in seconds: its dead time with room for doubt.
    pub(super) reach_s: f64,
    /// For each segment the first row whose PV counted.
    pub(super) known_from: Vec<usize>,
}

/// A point of a Nyquist curve with its uncertainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NyquistBand {
    /// Angular frequency in rad/s.
    pub omega_rad_s: f64,
    /// G(jω).
    pub value: Complex64,
    /// Semi-axes of the 95 % ellipse, the longer first.
    pub semi_axes: [f64; 2],
    /// Angle of the longer axis to the real one, in radians.
    pub angle_rad: f64,
}

impl ModelFit {
    /// The finding that comes first.
    #[must_use]
    pub fn verdict(&self) -> &FitVerdict {
        &self.verdicts[0]
    }

    /// A parameter by the name that files give it.
    #[must_use]
    pub fn parameter(&self, name: &str) -> Option<&Parameter> {
        self.parameters.iter().find(|p| p.name == name)
    }

    /// The dynamics as points of the search: of the MV, of each disturbance, of each load.
    pub(super) fn points(&self) -> Vec<Point> {
        let main = self.coordinates.point();
        let of = |d: &DisturbanceFit| {
            let value = |name| d.parameters.iter().find(|p| p.name == name).map(|p| p.value);
            let time_s = value("T_s").unwrap_or(main.time_s);
            Point { time_s, zeta: 1.0, dead_time_s: value("L_s").unwrap_or(0.0) }
        };
        let loads = self.loads.iter().map(|load| load.point);
        std::iter::once(main).chain(self.disturbances.iter().map(of)).chain(loads).collect()
    }

    /// Adds to the covariance what else is unknown; an interval by likelihood ratio grows on both sides.
    pub(super) fn widen(&mut self, added: &Symmetric) {
        let before = self.coordinates.covariance.clone();
        for i in 0..added.size {
            for j in 0..added.size {
                self.coordinates.covariance.add(i, j, added.at(i, j));
            }
        }
        let dead_time = self.parameters.iter().find(|p| p.name == "L_s").cloned();
        self.parameters = self.coordinates.parameters(self.student);
        let last = before.size - 1;
        if let (Some(old), Some(new)) = (dead_time, self.parameters.last_mut()) {
            let share = added.at(last, last) / self.coordinates.covariance.at(last, last);
            let more = self.student * new.standard_error * share.max(0.0).sqrt();
            let out = |end: f64| (end - old.value).hypot(more);
            new.interval_95 =
                [(old.value - out(old.interval_95[0])).max(0.0), old.value + out(old.interval_95[1])];
        }
    }

    /// Whether a finding says that the stretch cannot tell a model at all.
    #[must_use]
    pub fn is_usable(&self) -> bool {
        !self.verdicts.iter().any(FitVerdict::is_refusal)
    }

    /// Models drawn from what the stretch leaves open: the parameters' joint normal distribution in the coordinates of the
    /// search, ln T for a time constant, a dead time cut at 0.
    ///
    /// Same seed, same models. `None` where a parameter is not known at all, or the model is another kind's.
    #[must_use]
    pub fn draws(&self, count: usize, seed: u64) -> Option<Vec<ProcessModel>> {
        let c = &self.coordinates;
        let n = c.values.len();
        let covariance = DMatrix::from_fn(n, n, |i, j| c.covariance.at(i, j));
        if covariance.iter().any(|v| !v.is_finite()) {
            return None;
        }
        // By eigenvalues, because a covariance that rounding has made indefinite has no Cholesky factor.
        let eigen = covariance.symmetric_eigen();
        let scales = eigen.eigenvalues.map(|v| v.max(0.0).sqrt());
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let one = |_| {
            let z = DVector::from_fn(n, |i, _| scales[i] * normal());
            let away = &eigen.eigenvectors * z;
            let values: Vec<f64> = c.values.iter().zip(away.iter()).map(|(v, d)| v + d).collect();
            c.model_at(&values).ok()
        };
        (0..count).map(one).collect()
    }

    /// Response of the PV to a unit step of the MV with its pointwise 95 % band: (lower, value, upper) at each time,
    /// in PV units per MV unit. `time_s` in seconds from the step, not decreasing.
    #[must_use]
    pub fn step_band(&self, time_s: &[f64]) -> Vec<[f64; 3]> {
        let at = |v: &[f64]| {
            let response = self.coordinates.model_at(v).ok().and_then(|m| step_response(&m, time_s));
            response.unwrap_or_else(|| vec![f64::NAN; time_s.len()])
        };
        let middle = at(&self.coordinates.values);
        let errors = self.band_errors(&at, time_s.len());
        middle.iter().zip(errors).map(|(m, e)| [m - self.student * e, *m, m + self.student * e]).collect()
    }

    /// Standard error of every value of a curve of the model.
    fn band_errors(&self, curve: &dyn Fn(&[f64]) -> Vec<f64>, points: usize) -> Vec<f64> {
        let c = &self.coordinates;
        let slopes: Vec<Vec<f64>> = (0..c.values.len()).map(|i| slope_of(c, i, curve)).collect();
        (0..points)
            .map(|k| {
                let gradient: Vec<f64> = slopes.iter().map(|s| s[k]).collect();
                c.covariance.form(&gradient).max(0.0).sqrt()
            })
            .collect()
    }

    /// G(jω) with its 95 % ellipses; `omega_rad_s` in rad/s, > 0.
    #[must_use]
    pub fn nyquist_band(&self, omega_rad_s: &[f64]) -> Vec<NyquistBand> {
        /// √ of the 95 % quantile of χ² with two degrees of freedom.
        const RADIUS: f64 = 2.447_746_83;
        let c = &self.coordinates;
        let curve = |v: &[f64]| -> Vec<f64> {
            let Ok(model) = c.model_at(v) else { return vec![f64::NAN; 2 * omega_rad_s.len()] };
            let tf = model.transfer_function();
            omega_rad_s.iter().map(|w| tf.at_omega(*w)).flat_map(|g| [g.re, g.im]).collect()
        };
        let middle = curve(&c.values);
        let slopes: Vec<Vec<f64>> = (0..c.values.len()).map(|i| slope_of(c, i, &curve)).collect();
        omega_rad_s
            .iter()
            .enumerate()
            .map(|(k, &omega)| {
                let gradient = |part: usize| -> Vec<f64> { slopes.iter().map(|s| s[2 * k + part]).collect() };
                let (re, im) = (gradient(0), gradient(1));
                let sum: Vec<f64> = re.iter().zip(&im).map(|(a, b)| a + b).collect();
                let (a, d) = (c.covariance.form(&re), c.covariance.form(&im));
                let b = 0.5 * (c.covariance.form(&sum) - a - d);
                let (middle_of, half) = (0.5 * (a + d), (0.25 * (a - d) * (a - d) + b * b).sqrt());
                let axis = |square: f64| RADIUS * square.max(0.0).sqrt();
                NyquistBand {
                    omega_rad_s: omega,
                    value: Complex64::new(middle[2 * k], middle[2 * k + 1]),
                    semi_axes: [axis(middle_of + half), axis(middle_of - half)],
                    angle_rad: 0.5 * (2.0 * b).atan2(a - d),
                }
            })
            .collect()
    }
}

fn slope_of(c: &Coordinates, i: usize, curve: &dyn Fn(&[f64]) -> Vec<f64>) -> Vec<f64> {
    let error = c.covariance.at(i, i).sqrt();
    let step =
        if error.is_finite() { (0.05 * error).clamp(1e-7, 1e-3) } else { 1e-5 } * c.values[i].abs().max(1e-2);
    let at = |d: f64| {
        let mut v = c.values.clone();
        v[i] += d;
        curve(&v)
    };
    at(step).iter().zip(at(-step)).map(|(a, b)| (a - b) / (2.0 * step)).collect()
}

/// Exact response of a model to a unit step at the first of the given times.
fn step_response(model: &ProcessModel, time_s: &[f64]) -> Option<Vec<f64>> {
    let ones = vec![1.0; time_s.len()];
    simulate_process(model, &SampledInput::single(time_s, &ones)).ok()
}
