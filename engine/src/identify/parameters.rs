//! From the unknowns of the search to the parameters a reader knows, with their intervals.

use super::Structure;
use super::fopdt::Interval;
use super::output_error::{Point, Symmetric};
use crate::model::{Fopdt, Ipdt, ModelError, ProcessModel, Sopdt};

/// One parameter of a model.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// `K`, `Kv`, `T_s`, `T2_s`, `zeta`, `Tz_s` or `L_s`, as files name it.
    pub name: &'static str,
    /// Value; times in seconds, gains in PV units per unit of the input.
    pub value: f64,
    /// Standard error; ∞ where the data cannot tell.
    pub standard_error: f64,
    /// 95 % interval; that of a time is cut at 0.
    pub interval_95: Interval,
}

/// The unknowns of one channel in the coordinates of the search: gain, slope of a zero, ln T or ln τ, ln ζ, L/T₀.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Coordinates {
    structure: Structure,
    /// T₀: what L is measured in.
    base_s: f64,
    /// Values.
    pub values: Vec<f64>,
    /// Covariance of the values.
    pub covariance: Symmetric,
}

impl Coordinates {
    pub fn new(structure: Structure, gains: &[f64], point: Point, covariance: Symmetric) -> Self {
        let mut values = gains.to_vec();
        if structure != Structure::Ipdt {
            values.push(point.time_s.ln());
        }
        if matches!(structure, Structure::Sopdt | Structure::SopdtZero) {
            values.push(point.zeta.ln());
        }
        values.push(point.dead_time_s / point.time_s);
        Self { structure, base_s: point.time_s, values, covariance }
    }

    /// How many of the values are gains.
    pub fn gains(&self) -> usize {
        if self.structure == Structure::SopdtZero { 2 } else { 1 }
    }

    /// Values of other gains and dynamics in these coordinates.
    pub fn values_at(&self, gains: &[f64], point: Point) -> Vec<f64> {
        let there = Self::new(self.structure, gains, point, Symmetric::zero(0));
        let mut values = there.values;
        if let Some(dead_time) = values.last_mut() {
            *dead_time = point.dead_time_s / self.base_s;
        }
        values
    }

    /// The dynamics as a point of the search.
    pub fn point(&self) -> Point {
        let (v, last) = (&self.values, self.values.len() - 1);
        let zeta = match self.structure {
            Structure::Sopdt | Structure::SopdtZero => v[last - 1].exp(),
            _ => 1.0,
        };
        Point { time_s: self.base_s, zeta, dead_time_s: v[last] * self.base_s }
    }

    /// The model at these or other values.
    pub fn model_at(&self, v: &[f64]) -> Result<ProcessModel, ModelError> {
        let dead_time_s = (v[v.len() - 1] * self.base_s).max(0.0);
        match self.structure {
            Structure::Fopdt => Ok(ProcessModel::Fopdt(Fopdt::new(v[0], v[1].exp(), dead_time_s)?)),
            Structure::Ipdt => Ok(ProcessModel::Ipdt(Ipdt::new(v[0], dead_time_s)?)),
            Structure::Sopdt => second_order(v[0], 0.0, v[1].exp(), v[2].exp(), dead_time_s),
            Structure::SopdtZero => {
                let tau_s = v[2].exp();
                second_order(v[0], v[1] * tau_s / v[0], tau_s, v[3].exp(), dead_time_s)
            }
        }
    }

    /// Standard error of a function of the values, by its gradient.
    pub fn standard_error(&self, f: impl Fn(&[f64]) -> f64) -> f64 {
        let gradient: Vec<f64> = (0..self.values.len()).map(|i| self.slope(i, &f)).collect();
        self.covariance.form(&gradient).max(0.0).sqrt()
    }

    /// ∂f/∂v[i] by central difference, a small part of the standard error wide.
    pub fn slope(&self, i: usize, f: impl Fn(&[f64]) -> f64) -> f64 {
        let error = self.covariance.at(i, i).sqrt();
        let size = self.values[i].abs().max(1e-3);
        let step =
            if error.is_finite() { (0.01 * error).clamp(1e-7 * size, 1e-3 * size) } else { 1e-5 * size };
        let at = |d: f64| {
            let mut v = self.values.clone();
            v[i] += d;
            f(&v)
        };
        (at(step) - at(-step)) / (2.0 * step)
    }

    /// The parameters with intervals of `student` standard errors.
    pub fn parameters(&self, student: f64) -> Vec<Parameter> {
        let last = self.values.len() - 1;
        let base_s = self.base_s;
        let mut out = Vec::new();
        let mut add = |name: &'static str, time: bool, f: &dyn Fn(&[f64]) -> f64| {
            let value = f(&self.values);
            let standard_error = self.standard_error(f);
            let low = value - student * standard_error;
            let low = if time { low.max(0.0) } else { low };
            let interval_95 = [low, value + student * standard_error];
            out.push(Parameter { name, value, standard_error, interval_95 });
        };
        let dead_time = move |v: &[f64]| v[last] * base_s;
        match self.structure {
            Structure::Fopdt => {
                add("K", false, &|v| v[0]);
                // Even about T, as its standard error is: the logarithm is the search's, not the reader's.
                let t = self.values[1].exp();
                add("T_s", true, &|v| t * (1.0 + v[1] - t.ln()));
            }
            Structure::Ipdt => add("Kv", false, &|v| v[0]),
            Structure::Sopdt => {
                add("K", false, &|v| v[0]);
                self.second_order(1, student, &mut out);
            }
            Structure::SopdtZero => {
                add("K", false, &|v| v[0]);
                add("Tz_s", false, &|v| v[1] * v[2].exp() / v[0]);
                self.second_order(2, student, &mut out);
            }
        }
        let value = dead_time(&self.values);
        let standard_error = self.standard_error(dead_time);
        let interval_95 = [(value - student * standard_error).max(0.0), value + student * standard_error];
        out.push(Parameter { name: "L_s", value, standard_error, interval_95 });
        out
    }

    /// T1 and T2, or τ and ζ. Near ζ = 1 the two time constants depend on ζ by a root, so that their intervals are the
    /// extent of the confidence ellipse of (ln τ, ln ζ), not a slope's.
    fn second_order(&self, first: usize, student: f64, out: &mut Vec<Parameter>) {
        let (tau, zeta) = (self.values[first].exp(), self.values[first + 1].exp());
        let parameter = |name, value: f64, interval: Interval| Parameter {
            name,
            value,
            standard_error: (interval[1] - interval[0]) / (2.0 * student),
            interval_95: interval,
        };
        if zeta < 1.0 {
            for (i, name, value) in [(first, "T_s", tau), (first + 1, "zeta", zeta)] {
                let error = value * self.covariance.at(i, i).sqrt();
                let interval = [(value - student * error).max(0.0), value + student * error];
                out.push(Parameter { name, value, standard_error: error, interval_95: interval });
            }
            return;
        }
        let found = time_constants(tau, zeta);
        let mut ends = [[found[0]; 2], [found[1]; 2]];
        let (a, b, c) = (
            self.covariance.at(first, first),
            self.covariance.at(first, first + 1),
            self.covariance.at(first + 1, first + 1),
        );
        if !(a.is_finite() && c.is_finite()) {
            ends = [[0.0, f64::INFINITY]; 2];
        } else {
            const DIRECTIONS: u32 = 90;
            // Cholesky of the 2 × 2 block maps the unit circle onto the ellipse.
            let l11 = a.max(0.0).sqrt();
            let l21 = if l11 > 0.0 { b / l11 } else { 0.0 };
            let l22 = (c - l21 * l21).max(0.0).sqrt();
            for k in 0..DIRECTIONS {
                let angle = f64::from(k) * std::f64::consts::TAU / f64::from(DIRECTIONS);
                let (x, y) = (student * angle.cos(), student * angle.sin());
                let at = time_constants(tau * (l11 * x).exp(), zeta * (l21 * x + l22 * y).exp());
                for (end, value) in ends.iter_mut().zip(at) {
                    *end = [end[0].min(value), end[1].max(value)];
                }
            }
        }
        out.push(parameter("T_s", found[0], ends[0]));
        out.push(parameter("T2_s", found[1], ends[1]));
    }
}

/// T1 ≥ T2 of τ and ζ; two equal ones below ζ = 1.
fn time_constants(tau: f64, zeta: f64) -> [f64; 2] {
    let zeta = zeta.max(1.0);
    let slow = zeta + ((zeta - 1.0) * (zeta + 1.0)).sqrt();
    [tau * slow, tau / slow]
}

fn second_order(
    k: f64,
    tz_s: f64,
    tau_s: f64,
    zeta: f64,
    dead_time_s: f64,
) -> Result<ProcessModel, ModelError> {
    if zeta >= 1.0 {
        let [t1, t2] = time_constants(tau_s, zeta);
        return Ok(ProcessModel::Sopdt(Sopdt::new(k, t1, t2, tz_s, dead_time_s)?));
    }
    let num = if tz_s == 0.0 { vec![k] } else { vec![k * tz_s, k] };
    ProcessModel::rational(&num, &[tau_s * tau_s, 2.0 * zeta * tau_s, 1.0], dead_time_s)
}
