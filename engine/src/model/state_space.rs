//! Linear state space with dead time at its inputs: poles, zeros, gains, frequency response.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

use super::eigen::eigenvalues;
use super::realization::Realization;
use super::state_space_error::StateSpaceError;
use super::structure::{Pattern, submatrix};
use super::zeros::invariant_zeros;
use super::{TransferFunction, ZeroPoleGain};

/// Name and unit of a state, an input or an output.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Port {
    /// Name, for example a tank's tag.
    pub name: String,
    /// Unit, for example `cm`.
    pub unit: String,
}

impl Port {
    /// A name with its unit.
    #[must_use]
    pub fn new(name: &str, unit: &str) -> Self {
        Self { name: name.to_owned(), unit: unit.to_owned() }
    }
}

/// States, inputs and outputs of a [`StateSpace`], in the order of its matrices.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Ports {
    /// n states.
    pub states: Vec<Port>,
    /// m inputs.
    pub inputs: Vec<Port>,
    /// p outputs.
    pub outputs: Vec<Port>,
}

/// `ẋ(t) = A x(t) + Σⱼ Bⱼ uⱼ(t − θⱼ)`, `y(t) = C x(t) + Σⱼ Dⱼ uⱼ(t − θⱼ)`.
///
/// n states, m inputs, p outputs; A n×n in 1/s, B n×m, C p×n, D p×m. All of them are deviations from an operating
/// point. Made by [`StateSpace::new`], which refuses what does not fit together.
#[derive(Debug, Clone, PartialEq)]
pub struct StateSpace {
    a: DMatrix<f64>,
    b: DMatrix<f64>,
    c: DMatrix<f64>,
    d: DMatrix<f64>,
    input_delays_s: Vec<f64>,
    ports: Ports,
}

/// The four matrices of a state space.
#[derive(Debug, Clone, PartialEq)]
pub struct Matrices {
    /// A, n×n, in 1/s.
    pub a: DMatrix<f64>,
    /// B, n×m.
    pub b: DMatrix<f64>,
    /// C, p×n.
    pub c: DMatrix<f64>,
    /// D, p×m.
    pub d: DMatrix<f64>,
}

fn check_shape(
    what: &'static str,
    found: (usize, usize),
    expected: (usize, usize),
) -> Result<(), StateSpaceError> {
    if found == expected {
        return Ok(());
    }
    let ((rows, columns), (expected_rows, expected_columns)) = (found, expected);
    Err(StateSpaceError::Shape { what, rows, columns, expected_rows, expected_columns })
}

impl StateSpace {
    /// Checks that matrices, dead times in seconds and names fit together.
    ///
    /// # Errors
    /// [`StateSpaceError`] with the part that does not fit.
    pub fn new(matrices: Matrices, input_delays_s: Vec<f64>, ports: Ports) -> Result<Self, StateSpaceError> {
        let Matrices { a, b, c, d } = matrices;
        let (n, m, p) = (ports.states.len(), ports.inputs.len(), ports.outputs.len());
        for (what, matrix, expected) in
            [("A", &a, (n, n)), ("B", &b, (n, m)), ("C", &c, (p, n)), ("D", &d, (p, m))]
        {
            check_shape(what, matrix.shape(), expected)?;
            if matrix.iter().any(|v| !v.is_finite()) {
                return Err(StateSpaceError::NotFinite { what });
            }
        }
        check_shape("θ", (input_delays_s.len(), 1), (m, 1))?;
        for (delay, port) in input_delays_s.iter().zip(&ports.inputs) {
            if !(delay.is_finite() && *delay >= 0.0) {
                return Err(StateSpaceError::Delay { input: port.name.clone(), value: *delay });
            }
        }
        Ok(Self { a, b, c, d, input_delays_s, ports })
    }

    /// The state space of a proper transfer function.
    pub(super) fn of_proper(tf: &TransferFunction, input: Port, output: Port) -> Self {
        let realization = Realization::new(&tf.num, &tf.den);
        let n = realization.order();
        let mut b = DMatrix::zeros(n, 1);
        if n > 0 {
            b[(n - 1, 0)] = 1.0;
        }
        let states = (1..=n).map(|i| Port::new(&format!("x{i}"), "")).collect();
        Self {
            c: DMatrix::from_row_slice(1, n, realization.c.as_slice()),
            d: DMatrix::from_element(1, 1, realization.d),
            a: realization.a,
            b,
            input_delays_s: vec![tf.dead_time_s],
            ports: Ports { states, inputs: vec![input], outputs: vec![output] },
        }
    }

    /// A, n×n, in 1/s.
    #[must_use]
    pub fn a(&self) -> &DMatrix<f64> {
        &self.a
    }

    /// B, n×m, in state units per second and input unit.
    #[must_use]
    pub fn b(&self) -> &DMatrix<f64> {
        &self.b
    }

    /// C, p×n.
    #[must_use]
    pub fn c(&self) -> &DMatrix<f64> {
        &self.c
    }

    /// D, p×m.
    #[must_use]
    pub fn d(&self) -> &DMatrix<f64> {
        &self.d
    }

    /// θ of each input in seconds.
    #[must_use]
    pub fn input_delays_s(&self) -> &[f64] {
        &self.input_delays_s
    }

    /// Names and units.
    #[must_use]
    pub fn ports(&self) -> &Ports {
        &self.ports
    }

    /// n, the number of states.
    #[must_use]
    pub fn order(&self) -> usize {
        self.a.nrows()
    }

    /// Eigenvalues of A in 1/s, the slowest first.
    ///
    /// Found block by block of the states that act on each other, so that a cascade of equal tanks keeps its digits.
    #[must_use]
    pub fn poles(&self) -> Vec<Complex64> {
        let mut poles = eigenvalues(&self.a);
        slowest_first(&mut poles);
        poles
    }

    /// Transmission zeros in 1/s, the slowest first: the s at which G(s) loses rank, dead times left out (a dead time at
    /// an input has no zeros). States that no input reaches or no output shows are left out beforehand.
    ///
    /// Source: Emami-Naeini & Van Dooren, Automatica 18 (1982) 415.
    #[must_use]
    pub fn zeros(&self) -> Vec<Complex64> {
        let kept = Pattern::of(&self.a).between(&self.b, &self.c);
        let (a, b, c) = submatrix(&self.a, &self.b, &self.c, &kept);
        let mut zeros = invariant_zeros(a, b, c, self.d.clone());
        slowest_first(&mut zeros);
        zeros
    }

    /// `G(s) = (C (sI − A)⁻¹ B + D) diag(e^(−θs))` at a complex s in rad/s, p×m; `None` at a pole.
    #[must_use]
    pub fn eval(&self, s: Complex64) -> Option<DMatrix<Complex64>> {
        let n = self.order();
        let mut resolvent = self.a.map(|v| Complex64::new(-v, 0.0));
        for i in 0..n {
            resolvent[(i, i)] += s;
        }
        let complex = |m: &DMatrix<f64>| m.map(|v| Complex64::new(v, 0.0));
        let mut g = complex(&self.d);
        if n > 0 {
            g += complex(&self.c) * resolvent.lu().solve(&complex(&self.b))?;
        }
        for (mut column, delay) in g.column_iter_mut().zip(&self.input_delays_s) {
            column *= (-s * *delay).exp();
        }
        g.iter().all(|v| v.is_finite()).then_some(g)
    }

    /// `G(jω)`, ω in rad/s, p×m; `None` at a pole.
    #[must_use]
    pub fn at_omega(&self, omega_rad_s: f64) -> Option<DMatrix<Complex64>> {
        self.eval(Complex64::new(0.0, omega_rad_s))
    }

    /// `G(0)`, p×m, in output units per input unit; ±∞ where a channel integrates.
    #[must_use]
    pub fn dc_gain(&self) -> DMatrix<f64> {
        let (p, m) = self.d.shape();
        DMatrix::from_fn(p, m, |i, j| self.zero_pole_gain(i, j).static_gain())
    }

    /// Relative gain array at rest, `Λ = G(0) ∘ (G(0)⁻¹)ᵀ`; `None` where G(0) is not square, singular or not finite.
    ///
    /// Source: Bristol, IEEE Trans. Autom. Control 11 (1966) 133.
    #[must_use]
    pub fn rga(&self) -> Option<DMatrix<f64>> {
        let gain = self.dc_gain();
        if !gain.is_square() || gain.is_empty() || gain.iter().any(|v| !v.is_finite()) {
            return None;
        }
        let inverse = gain.clone().try_inverse()?;
        Some(gain.component_mul(&inverse.transpose()))
    }

    /// The minimal transfer function from input `j` to output `i`, as zeros, poles and gain.
    ///
    /// States off every way from the input to the output are left out exactly; a zero and a pole closer than 1e-8 of
    /// their modulus cancel.
    ///
    /// # Panics
    /// When there is no such input or output.
    #[must_use]
    pub fn zero_pole_gain(&self, output: usize, input: usize) -> ZeroPoleGain {
        let (b, c) = (self.b.columns(input, 1).into_owned(), self.c.rows(output, 1).into_owned());
        let kept = Pattern::of(&self.a).between(&b, &c);
        let (a, b, c) = submatrix(&self.a, &b, &c, &kept);
        let d = self.d[(output, input)];
        let poles = eigenvalues(&a);
        let zeros = invariant_zeros(a.clone(), b.clone(), c.clone(), DMatrix::from_element(1, 1, d));
        // A real point away from the spectrum: there both forms are well-conditioned.
        let radius = poles.iter().chain(&zeros).map(|r| r.norm()).fold(0.0, f64::max);
        let s = if radius > 0.0 { 2.0 * radius } else { 1.0 };
        let mut value = d;
        if a.nrows() > 0 {
            let shifted = DMatrix::identity(a.nrows(), a.nrows()) * s - &a;
            let x: DVector<f64> =
                shifted.lu().solve(&b.column(0).into_owned()).unwrap_or_else(|| DVector::zeros(a.nrows()));
            value += c.row(0).transpose().dot(&x);
        }
        let product = |roots: &[Complex64]| roots.iter().map(|r| s - r).product::<Complex64>().re;
        let gain = value * product(&poles) / product(&zeros);
        ZeroPoleGain { zeros, poles, gain, dead_time_s: self.input_delays_s[input] }.minimal()
    }

    /// The minimal transfer function from input `j` to output `i` with coefficients in falling powers of s.
    ///
    /// # Panics
    /// When there is no such input or output.
    #[must_use]
    pub fn transfer_function(&self, output: usize, input: usize) -> TransferFunction {
        self.zero_pole_gain(output, input).transfer_function()
    }

    /// One channel as a state space of its own, with all states.
    ///
    /// # Errors
    /// [`StateSpaceError::NoChannel`].
    pub fn channel(&self, output: usize, input: usize) -> Result<Self, StateSpaceError> {
        let no = |what, index: usize| StateSpaceError::NoChannel { what, index: index + 1 };
        let to = self.ports.outputs.get(output).ok_or(no("output", output))?.clone();
        let from = self.ports.inputs.get(input).ok_or(no("input", input))?.clone();
        Ok(Self {
            a: self.a.clone(),
            b: self.b.columns(input, 1).into_owned(),
            c: self.c.rows(output, 1).into_owned(),
            d: DMatrix::from_element(1, 1, self.d[(output, input)]),
            input_delays_s: vec![self.input_delays_s[input]],
            ports: Ports { states: self.ports.states.clone(), inputs: vec![from], outputs: vec![to] },
        })
    }
}

/// Sorts by falling real part, conjugate pairs with the positive imaginary part first.
pub(crate) fn slowest_first(roots: &mut [Complex64]) {
    roots.sort_by(|a, b| b.re.total_cmp(&a.re).then(b.im.total_cmp(&a.im)));
}
