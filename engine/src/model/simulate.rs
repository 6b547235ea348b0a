//! A linear model over a sampled input: exact for an input held between its stamps, dead time exact.

use std::collections::HashMap;

use nalgebra::{DMatrix, DVector};

use super::state_space_error::StateSpaceError;
use super::{ModelError, Port, ProcessModel, StateSpace};

/// Stamps this close to an even grid, in sample times, are taken to lie on it.
const EVEN: f64 = 1e-9;
/// Matrices kept for the intervals of uneven stamps.
const MOST_KEPT: usize = 4096;

/// A sampled input: each value holds from its stamp until the next.
#[derive(Debug, Clone, PartialEq)]
pub struct SampledInput<'a> {
    /// N stamps in seconds, rising.
    pub time_s: &'a [f64],
    /// One column of N values for each input, in its unit, as deviation from the operating point.
    pub columns: Vec<&'a [f64]>,
    /// Value of each input before the first stamp; the dead times end there.
    pub before: Vec<f64>,
    /// State at the first stamp; `None`: at rest, 0.
    pub initial_state: Option<&'a [f64]>,
}

impl<'a> SampledInput<'a> {
    /// One input that was 0 before, the model at rest.
    #[must_use]
    pub fn single(time_s: &'a [f64], values: &'a [f64]) -> Self {
        Self { time_s, columns: vec![values], before: vec![0.0], initial_state: None }
    }

    fn check(&self, model: &StateSpace) -> Result<(), StateSpaceError> {
        let (rows, inputs) = (self.time_s.len(), model.b().ncols());
        let shape = |what, found: (usize, usize), expected: (usize, usize)| {
            let ((rows, columns), (expected_rows, expected_columns)) = (found, expected);
            let error = StateSpaceError::Shape { what, rows, columns, expected_rows, expected_columns };
            if found == expected { Ok(()) } else { Err(error) }
        };
        shape("u", (rows, self.columns.len()), (rows, inputs))?;
        shape("u before", (self.before.len(), 1), (inputs, 1))?;
        for column in &self.columns {
            shape("u", (column.len(), inputs), (rows, inputs))?;
        }
        if let Some(state) = self.initial_state {
            shape("x", (state.len(), 1), (model.order(), 1))?;
        }
        let finite = |values: &[f64]| values.iter().all(|v| v.is_finite());
        let clean = finite(&self.before) && self.initial_state.is_none_or(finite);
        if !(clean && self.columns.iter().all(|c| finite(c))) {
            return Err(StateSpaceError::NotFinite { what: "u" });
        }
        if !finite(self.time_s) {
            return Err(StateSpaceError::NotFinite { what: "t" });
        }
        match self.time_s.windows(2).position(|w| w[1] <= w[0]) {
            Some(i) => {
                let (from_s, to_s) = (self.time_s[i], self.time_s[i + 1]);
                Err(StateSpaceError::Time { row: i + 2, from_s, to_s })
            }
            None => Ok(()),
        }
    }

    /// Value of an input with its number in the column, −1 and below before the first stamp.
    fn value(&self, input: usize, index: isize) -> f64 {
        usize::try_from(index).map_or(self.before[input], |i| self.columns[input][i])
    }

    fn even_step_s(&self) -> Option<f64> {
        let rows = self.time_s.len();
        if rows < 2 {
            return None;
        }
        let start = self.time_s[0];
        let step = (self.time_s[rows - 1] - start) / (rows - 1) as f64;
        let even = |(k, t): (usize, &f64)| (t - start - k as f64 * step).abs() <= EVEN * step;
        self.time_s.iter().enumerate().all(even).then_some(step)
    }
}

/// The outputs at each stamp, one column of N values an output, just after the inputs have changed.
///
/// `x(t + h) = e^(Ah) x(t) + ∫₀ʰ e^(As) ds B u` between the instants at which a delayed input changes, which need not
/// be stamps: for N even stamps the split step is made once, for uneven ones each interval is cut where it must be.
///
/// # Errors
/// [`StateSpaceError`] for columns that do not fit the model, for values that are not finite and for time that does
/// not rise.
///
/// Source: Åström & Wittenmark, Computer-Controlled Systems, 3rd ed., section 2.3.
pub fn simulate(model: &StateSpace, input: &SampledInput) -> Result<Vec<Vec<f64>>, StateSpaceError> {
    input.check(model)?;
    let mut outputs = vec![Vec::with_capacity(input.time_s.len()); model.c().nrows()];
    let mut x = input.initial_state.map_or_else(|| DVector::zeros(model.order()), DVector::from_column_slice);
    match input.even_step_s() {
        Some(step_s) => even(model, input, step_s, &mut x, &mut outputs),
        None => uneven(model, input, &mut x, &mut outputs),
    }
    Ok(outputs)
}

/// [`simulate`] for a process model from one input to one output.
///
/// # Errors
/// [`StateSpaceError`] as there.
pub fn simulate_process(model: &ProcessModel, input: &SampledInput) -> Result<Vec<f64>, StateSpaceError> {
    let space = model.state_space(Port::new("u", ""), Port::new("y", ""));
    Ok(simulate(&space, input)?.swap_remove(0))
}

impl ProcessModel {
    /// The model as a state space in controllable canonical form; its dead time is that of the input.
    #[must_use]
    pub fn state_space(&self, input: Port, output: Port) -> StateSpace {
        StateSpace::of_proper(&self.transfer_function(), input, output)
    }
}

impl StateSpace {
    /// The state space of a transfer function; controllable canonical form, states scaled by the poles' mean modulus.
    ///
    /// # Errors
    /// [`ModelError`] for a function that is improper, empty, or not finite.
    pub fn of_transfer_function(
        tf: &super::TransferFunction,
        input: Port,
        output: Port,
    ) -> Result<Self, ModelError> {
        let checked = ProcessModel::rational(&tf.num, &tf.den, tf.dead_time_s)?;
        Ok(checked.state_space(input, output))
    }
}

/// e^(Ah) and ∫₀ʰ e^(As) ds B, by the exponential of the matrix that also holds the input.
pub(super) fn held(a: &DMatrix<f64>, b: &DMatrix<f64>, h: f64) -> (DMatrix<f64>, DMatrix<f64>) {
    let (n, m) = b.shape();
    if n == 0 || h == 0.0 {
        return (DMatrix::identity(n, n), DMatrix::zeros(n, m));
    }
    let mut joined = DMatrix::zeros(n + m, n + m);
    joined.view_mut((0, 0), (n, n)).copy_from(&(a * h));
    joined.view_mut((0, n), (n, m)).copy_from(&(b * h));
    let exponential = joined.exp();
    (exponential.view((0, 0), (n, n)).into_owned(), exponential.view((0, n), (n, m)).into_owned())
}

/// One input on an even grid: whole samples of dead time, and what the present and the earlier value add in a step.
struct Delayed {
    samples: isize,
    /// The dead time is no multiple of the step: the earlier value acts first.
    split: bool,
    earlier: DVector<f64>,
    present: DVector<f64>,
}

fn even(
    model: &StateSpace,
    input: &SampledInput,
    step_s: f64,
    x: &mut DVector<f64>,
    outputs: &mut [Vec<f64>],
) {
    let (a, rows, inputs) = (model.a(), input.time_s.len(), model.b().ncols());
    let phi = held(a, model.b(), step_s).0;
    let ways: Vec<Delayed> = (0..inputs)
        .map(|j| {
            let b = model.b().columns(j, 1).into_owned();
            let dead = model.input_delays_s()[j] / step_s;
            // A dead time far beyond the record only has to stay beyond it.
            let dead = dead.min(rows as f64 + 1.0);
            let whole = if (dead - dead.round()).abs() < EVEN { dead.round() } else { dead.floor() };
            let rest_s = (dead - whole).max(0.0) * step_s;
            let split = rest_s > EVEN * step_s;
            let (until, gamma) = held(a, &b, if split { step_s - rest_s } else { step_s });
            let earlier = if split { until * held(a, &b, rest_s).1 } else { DMatrix::zeros(a.nrows(), 1) };
            Delayed {
                samples: whole as isize,
                split,
                earlier: earlier.column(0).into_owned(),
                present: gamma.column(0).into_owned(),
            }
        })
        .collect();
    let mut next = x.clone();
    let mut now = DVector::zeros(inputs);
    for k in 0..rows {
        next.gemv(1.0, &phi, x, 0.0);
        for (j, way) in ways.iter().enumerate() {
            let index = k as isize - way.samples;
            let (earlier, present) = (input.value(j, index - 1), input.value(j, index));
            now[j] = if way.split { earlier } else { present };
            next.axpy(earlier, &way.earlier, 1.0);
            next.axpy(present, &way.present, 1.0);
        }
        push_outputs(model, x, &now, outputs);
        std::mem::swap(x, &mut next);
    }
}

fn push_outputs(model: &StateSpace, x: &DVector<f64>, u: &DVector<f64>, outputs: &mut [Vec<f64>]) {
    for (i, column) in outputs.iter_mut().enumerate() {
        let from_state: f64 = model.c().row(i).iter().zip(x.iter()).map(|(c, x)| c * x).sum();
        let through: f64 = model.d().row(i).iter().zip(u.iter()).map(|(d, u)| d * u).sum();
        column.push(from_state + through);
    }
}

fn uneven(model: &StateSpace, input: &SampledInput, x: &mut DVector<f64>, outputs: &mut [Vec<f64>]) {
    let inputs = model.b().ncols();
    let mut known: HashMap<u64, (DMatrix<f64>, DMatrix<f64>)> = HashMap::new();
    // Number of the value that acts now, for each input.
    let mut acting: Vec<isize> = vec![-1; inputs];
    let mut now = DVector::from_iterator(inputs, input.before.iter().copied());
    let mut next = x.clone();
    for (k, &at) in input.time_s.iter().enumerate() {
        let end = input.time_s.get(k + 1).copied();
        let mut t = at;
        let mut written = false;
        loop {
            let mut change = f64::INFINITY;
            for j in 0..inputs {
                let delay = model.input_delays_s()[j];
                let arrival = |i: isize| {
                    usize::try_from(i)
                        .ok()
                        .and_then(|i| input.time_s.get(i))
                        .map_or(f64::INFINITY, |t| t + delay)
                };
                while arrival(acting[j] + 1) <= t {
                    acting[j] += 1;
                }
                now[j] = input.value(j, acting[j]);
                change = change.min(arrival(acting[j] + 1));
            }
            if !written {
                push_outputs(model, x, &now, outputs);
                written = true;
            }
            let Some(end) = end else { return };
            let until = change.min(end);
            let h = until - t;
            if known.len() > MOST_KEPT {
                known.clear();
            }
            let (phi, gamma) = known.entry(h.to_bits()).or_insert_with(|| held(model.a(), model.b(), h));
            next.gemv(1.0, phi, x, 0.0);
            next.gemv(1.0, gamma, &now, 1.0);
            std::mem::swap(x, &mut next);
            t = until;
            if t >= end {
                break;
            }
        }
    }
}
