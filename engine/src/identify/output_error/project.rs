//! The linear unknowns solved and projected out of a pass (Golub & Pereyra 1973; the step is Kaufman's, 1975).

use super::columns::Gram;
use super::shape::{Linear, Shape, Term};

/// Below this share of its own size a projected column counts as gone.
const SINGULAR: f64 = 1e-13;

/// What a pass says at its point, with the linear unknowns at their best.
#[derive(Debug, Clone)]
pub(in crate::identify) struct Projected {
    /// Residual sum of squares.
    pub rss: f64,
    pub linear: Linear,
    /// Gauss–Newton matrix over (shared linear unknowns, non-linear unknowns), the local ones projected out.
    pub matrix: Symmetric,
    /// Its right-hand side.
    pub rhs: Vec<f64>,
    /// How many of `matrix`' rows are linear.
    pub linear_count: usize,
}

/// A square matrix by rows.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::identify) struct Symmetric {
    pub size: usize,
    values: Vec<f64>,
}

impl Symmetric {
    pub fn zero(size: usize) -> Self {
        Self { size, values: vec![0.0; size * size] }
    }

    pub fn at(&self, i: usize, j: usize) -> f64 {
        self.values[i * self.size + j]
    }

    pub fn set(&mut self, i: usize, j: usize, value: f64) {
        self.values[i * self.size + j] = value;
    }

    pub fn add(&mut self, i: usize, j: usize, value: f64) {
        self.values[i * self.size + j] += value;
    }

    /// Gauss–Jordan on the given pivots, one after the other; those that have vanished against `scale` are left out
    /// and their row and column are cleared. Returns which were taken.
    pub fn eliminate(&mut self, pivots: std::ops::Range<usize>, scale: &[f64]) -> Vec<bool> {
        let n = self.size;
        pivots
            .map(|p| {
                let pivot = self.at(p, p);
                if pivot.is_nan() || pivot <= SINGULAR * scale[p] {
                    for i in 0..n {
                        self.set(p, i, 0.0);
                        self.set(i, p, 0.0);
                    }
                    return false;
                }
                for i in (0..n).filter(|&i| i != p) {
                    let share = self.at(i, p) / pivot;
                    if share != 0.0 {
                        for j in 0..n {
                            let value = self.at(p, j);
                            self.add(i, j, -share * value);
                        }
                        self.set(i, p, 0.0);
                    }
                }
                true
            })
            .collect()
    }

    /// vᵀ M v; ∞ where M holds no finite number.
    pub fn form(&self, v: &[f64]) -> f64 {
        let mut total = 0.0;
        for i in (0..self.size).filter(|&i| v[i] != 0.0) {
            for j in (0..self.size).filter(|&j| v[j] != 0.0) {
                total += v[i] * v[j] * self.at(i, j);
            }
        }
        if total.is_nan() { f64::INFINITY } else { total }
    }

    /// Inverse of a symmetric positive definite matrix; `None` when it is singular to rounding.
    pub fn inverse(&self) -> Option<Self> {
        let n = self.size;
        let scale: Vec<f64> = (0..n).map(|i| self.at(i, i).sqrt()).collect();
        if scale.iter().any(|s| s.is_nan() || *s <= 0.0) {
            return None;
        }
        let scaled = nalgebra::DMatrix::from_fn(n, n, |i, j| {
            0.5 * (self.at(i, j) + self.at(j, i)) / (scale[i] * scale[j])
        });
        let factor = nalgebra::Cholesky::new(scaled)?;
        if (0..n).any(|i| factor.l_dirty()[(i, i)] < SINGULAR.sqrt()) {
            return None;
        }
        let inverse = factor.inverse();
        let mut out = Self::zero(n);
        for i in 0..n {
            for j in 0..n {
                out.set(i, j, inverse[(i, j)] / (scale[i] * scale[j]));
            }
        }
        Some(out)
    }
}

/// Solves the linear unknowns; `None` where the gain of the first channel cannot be told.
pub(in crate::identify) fn project(grams: &[Gram], shape: &Shape, reference: &Linear) -> Option<Projected> {
    let (linear, rss) = solve_linear(grams, shape, reference)?;
    if !shape.differentiable {
        let linear_count = shape.shared.len();
        return Some(Projected { rss, linear, matrix: Symmetric::zero(0), rhs: vec![], linear_count });
    }
    let (matrix, rhs) = normal_equations(grams, shape, &linear, reference);
    Some(Projected { rss, linear, matrix, rhs, linear_count: shape.shared.len() })
}

fn solve_linear(grams: &[Gram], shape: &Shape, reference: &Linear) -> Option<(Linear, f64)> {
    let (locals, shared) = (shape.local.len(), shape.shared.len());
    let columns: Vec<usize> = shape
        .local
        .iter()
        .chain(&shape.shared)
        .map(|t| t.column)
        .chain(std::iter::once(shape.residual))
        .collect();
    let size = columns.len();
    let mut whole = Symmetric::zero(shared + 1);
    let mut scale = vec![0.0; shared + 1];
    let mut segments = Vec::with_capacity(grams.len());
    for gram in grams {
        let mut s = Symmetric::zero(size);
        for i in 0..size {
            for j in 0..size {
                s.set(i, j, gram.at(columns[i], columns[j]));
            }
        }
        let sizes: Vec<f64> = (0..size).map(|i| s.at(i, i)).collect();
        let taken = s.eliminate(0..locals, &sizes);
        for i in 0..=shared {
            scale[i] += sizes[locals + i];
            for j in 0..=shared {
                whole.add(i, j, s.at(locals + i, locals + j));
            }
        }
        segments.push((s, taken));
    }
    let taken = whole.eliminate(0..shared, &scale);
    if !taken[shape.gains[0]] {
        return None;
    }
    let solution: Vec<f64> =
        (0..shared).map(|i| if taken[i] { whole.at(i, shared) / whole.at(i, i) } else { 0.0 }).collect();
    let local = segments
        .iter()
        .zip(&reference.local)
        .map(|((s, taken), last)| {
            (0..locals)
                .map(|i| {
                    if !taken[i] {
                        return last[i];
                    }
                    let rest: f64 = solution.iter().enumerate().map(|(j, c)| c * s.at(i, locals + j)).sum();
                    last[i] + (s.at(i, size - 1) - rest) / s.at(i, i)
                })
                .collect()
        })
        .collect();
    let linear =
        Linear { shared: reference.shared.iter().zip(&solution).map(|(a, b)| a + b).collect(), local };
    let rss = whole.at(shared, shared).max(0.0);
    rss.is_finite().then_some((linear, rss))
}

/// A sum of columns.
type Combination = Vec<(f64, usize)>;

fn between(gram: &Gram, a: &Combination, b: &Combination) -> f64 {
    let mut total = 0.0;
    for &(wa, i) in a {
        for &(wb, j) in b {
            total += wa * wb * gram.at(i, j);
        }
    }
    total
}

/// Derivatives of the model to the non-linear unknowns as combinations of columns.
pub(in crate::identify) fn derivatives(shape: &Shape, shared: &[f64], local: &[f64]) -> Vec<Combination> {
    let mut out = vec![Combination::new(); shape.unknowns];
    let mut take = |terms: &[Term], coefficients: &[f64]| {
        for (term, &c) in terms.iter().zip(coefficients) {
            for &(unknown, column) in term.derivatives.iter().filter(|_| c != 0.0) {
                out[unknown].push((c, column));
            }
        }
    };
    take(&shape.shared, shared);
    take(&shape.local, local);
    out
}

fn normal_equations(
    grams: &[Gram],
    shape: &Shape,
    linear: &Linear,
    reference: &Linear,
) -> (Symmetric, Vec<f64>) {
    let (locals, shared) = (shape.local.len(), shape.shared.len());
    let count = shared + shape.unknowns;
    let (mut matrix, mut rhs) = (Symmetric::zero(count), vec![0.0; count]);
    for (segment, gram) in grams.iter().enumerate() {
        let mut columns: Vec<Combination> = Vec::with_capacity(locals + count + 1);
        columns.extend(shape.local.iter().chain(&shape.shared).map(|t| vec![(1.0, t.column)]));
        columns.extend(derivatives(shape, &linear.shared, &linear.local[segment]));
        // What is left with the new linear unknowns: r less what they add to the reference.
        let mut left: Combination = vec![(1.0, shape.residual)];
        let moved = shape.shared.iter().zip(linear.shared.iter().zip(&reference.shared));
        let moved_local = shape.local.iter().zip(linear.local[segment].iter().zip(&reference.local[segment]));
        left.extend(moved.chain(moved_local).map(|(term, (new, old))| (old - new, term.column)));
        columns.push(left);
        let size = columns.len();
        let mut s = Symmetric::zero(size);
        for i in 0..size {
            for j in i..size {
                let value = between(gram, &columns[i], &columns[j]);
                s.set(i, j, value);
                s.set(j, i, value);
            }
        }
        let sizes: Vec<f64> = (0..size).map(|i| s.at(i, i)).collect();
        s.eliminate(0..locals, &sizes);
        for (i, right) in rhs.iter_mut().enumerate() {
            *right += s.at(locals + i, size - 1);
            for j in 0..count {
                matrix.add(i, j, s.at(locals + i, locals + j));
            }
        }
    }
    (matrix, rhs)
}
