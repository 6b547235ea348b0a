//! State space of a rational transfer function and its exact step under inputs that are cubic in time.

use nalgebra::{DMatrix, DVector};

/// `ẋ = A x + B v, y = C x + D v` in controllable canonical form with B = (0, …, 0, 1)ᵀ.
///
/// States are scaled by powers of the poles' mean modulus, so that slow processes of high order keep their digits.
#[derive(Debug, Clone)]
pub(crate) struct Realization {
    pub a: DMatrix<f64>,
    pub c: DVector<f64>,
    pub d: f64,
    /// C A, and C B.
    slope: DVector<f64>,
    jump: f64,
}

/// Values and slopes of a signal at both ends of a step: the cubic between them.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Hermite {
    pub start: f64,
    pub end: f64,
    /// Slope at the start, per second.
    pub start_slope: f64,
    /// Slope at the end, per second.
    pub end_slope: f64,
}

impl Hermite {
    #[cfg(test)]
    pub(crate) fn constant(value: f64) -> Self {
        Self { start: value, end: value, start_slope: 0.0, end_slope: 0.0 }
    }

    pub(crate) fn plus(self, value: f64) -> Self {
        Self { start: self.start + value, end: self.end + value, ..self }
    }

    /// Value and derivatives with respect to σ = t/h at σ = 0.
    fn derivatives(self, h: f64) -> [f64; 4] {
        let rise = self.end - self.start;
        let (s0, s1) = (h * self.start_slope, h * self.end_slope);
        [self.start, s0, 2.0 * (3.0 * rise - 2.0 * s0 - s1), 6.0 * (s0 + s1 - 2.0 * rise)]
    }

    /// Value and slope, per second, at a share of a step of h seconds.
    pub(crate) fn at(self, share: f64, h: f64) -> (f64, f64) {
        let [value, first, second, third] = self.derivatives(h);
        let slope = first + share * (second + 0.5 * share * third);
        (value + share * (first + share * (0.5 * second + share * third / 6.0)), slope / h)
    }

    /// Integral over a step of h seconds.
    pub(crate) fn integral(self, h: f64) -> f64 {
        0.5 * h * (self.start + self.end) + h * h / 12.0 * (self.start_slope - self.end_slope)
    }
}

impl Realization {
    /// From numerator and denominator in falling powers of s, no more zeros than poles.
    pub(crate) fn new(num: &[f64], den: &[f64]) -> Self {
        let order = den.len() - 1;
        let leading = den[0];
        let padded = |i: usize| {
            let missing = den.len() - num.len();
            if i < missing { 0.0 } else { num[i - missing] / leading }
        };
        let d = padded(0);
        let lowest = den.iter().rposition(|v| *v != 0.0).unwrap_or(0);
        let unit = if lowest == 0 { 1.0 } else { (den[lowest] / leading).abs().powf(1.0 / lowest as f64) };
        let mut a = DMatrix::zeros(order, order);
        let mut c = DVector::zeros(order);
        for i in 0..order {
            if i + 1 < order {
                a[(i, i + 1)] = unit;
            }
            // Column i belongs to the coefficient of sⁱ.
            let coefficient = den[order - i] / leading;
            let scale = unit.powi(order as i32 - 1 - i as i32);
            a[(order - 1, i)] = -coefficient / scale;
            c[i] = (padded(order - i) - coefficient * d) / scale;
        }
        let (slope, jump) = (a.tr_mul(&c), if order > 0 { c[order - 1] } else { 0.0 });
        Self { a, c, d, slope, jump }
    }

    pub(crate) fn order(&self) -> usize {
        self.c.len()
    }

    pub(crate) fn output(&self, x: &DVector<f64>, v: f64) -> f64 {
        self.c.dot(x) + self.d * v
    }

    /// ẏ, with v̇ given.
    pub(crate) fn output_slope(&self, x: &DVector<f64>, v: f64, v_slope: f64) -> f64 {
        self.slope.dot(x) + self.jump * v + self.d * v_slope
    }
}

/// Numbers of a column that are worked on together.
const TOGETHER: usize = 4;

/// The exact map of a state over one step: x⁺ = Φ x + Σ Γₖ v⁽ᵏ⁾ for an input cubic in time.
#[derive(Debug, Clone)]
pub(crate) struct Step {
    /// Columns of Φ, then of Γ, each filled up with zeros to whole blocks.
    columns: Vec<[f64; TOGETHER]>,
    h: f64,
    scratch: Vec<[f64; TOGETHER]>,
}

impl Step {
    /// For `ẋ = A x + (0, …, 0, gain)ᵀ v` over h seconds, by the exponential of the matrix that also holds the input.
    pub(crate) fn new(a: &DMatrix<f64>, gain: f64, h: f64) -> Self {
        let n = a.nrows();
        let mut joined = DMatrix::zeros(n + 4, n + 4);
        joined.view_mut((0, 0), (n, n)).copy_from(&(a * h));
        if n > 0 {
            joined[(n - 1, n)] = gain * h;
        }
        for k in 0..3 {
            joined[(n + k, n + k + 1)] = 1.0;
        }
        let exponential = joined.exp();
        let blocks = n.div_ceil(TOGETHER);
        let mut columns = vec![[0.0; TOGETHER]; blocks * (n + 4)];
        for j in 0..if n > 0 { n + 4 } else { 0 } {
            for i in 0..n {
                columns[j * blocks + i / TOGETHER][i % TOGETHER] = exponential[(i, j)];
            }
        }
        Self { columns, h, scratch: vec![[0.0; TOGETHER]; blocks] }
    }

    /// Moves the state on by one step; allocates nothing.
    pub(crate) fn advance(&mut self, x: &mut DVector<f64>, input: Hermite) {
        let v = input.derivatives(self.h);
        self.scratch.fill([0.0; TOGETHER]);
        let columns = self.columns.chunks_exact(self.scratch.len().max(1));
        for (column, &factor) in columns.zip(x.iter().chain(&v)) {
            for (sums, shares) in self.scratch.iter_mut().zip(column) {
                for (sum, share) in sums.iter_mut().zip(shares) {
                    *sum += share * factor;
                }
            }
        }
        for (x, sum) in x.iter_mut().zip(self.scratch.as_flattened()) {
            *x = *sum;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lag_under_a_cubic_input_follows_the_closed_form() {
        // ẋ = −x/T + v/T with v = t³: x = t³ − 3Tt² + 6T²t − 6T³(1 − e^(−t/T)).
        let (time_constant, h) = (0.7, 0.25);
        let realization = Realization::new(&[1.0], &[time_constant, 1.0]);
        let mut step = Step::new(&realization.a, 1.0, h);
        let mut x = DVector::zeros(1);
        for k in 0..8 {
            let (t0, t1) = (f64::from(k) * h, f64::from(k + 1) * h);
            let input = Hermite {
                start: t0.powi(3),
                end: t1.powi(3),
                start_slope: 3.0 * t0 * t0,
                end_slope: 3.0 * t1 * t1,
            };
            step.advance(&mut x, input);
        }
        let (t, c): (f64, f64) = (8.0 * h, time_constant);
        let expected =
            t.powi(3) - 3.0 * c * t * t + 6.0 * c * c * t - 6.0 * c.powi(3) * (1.0 - (-t / c).exp());
        assert!((realization.output(&x, 0.0) - expected).abs() < 1e-12 * expected);
    }

    #[test]
    fn the_realization_has_the_gain_and_the_jump_of_its_transfer_function() {
        let realization = Realization::new(&[2.0, 3.0, 5.0], &[4.0, 6.0, 2.0]);
        assert!((realization.d - 0.5).abs() < 1e-15);
        let mut step = Step::new(&realization.a, 1.0, 100.0);
        let mut x = DVector::zeros(2);
        step.advance(&mut x, Hermite::constant(1.0));
        assert!((realization.output(&x, 1.0) - 2.5).abs() < 1e-9);
    }
}
