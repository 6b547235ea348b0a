//! Inner products of the model's columns, accumulated in one pass, and what is solved with them.
//!
//! With the columns e (free state), 1, x (unit-gain response), eθ = ∂e/∂ln T, xθ = ∂x/∂ln T, xλ = T ∂x/∂L and the
//! residual r against a reference, the Gram matrix of a pass holds the residual sum of squares after the
//! linear unknowns are projected out, the gradient and the Gauss–Newton matrix of (ln T, L/T) at once
//! (Golub & Pereyra 1973; the step is Kaufman's, 1975). Taking r against the last linear estimate instead of the raw
//! data keeps the digits that a Gram matrix otherwise squares away.

use super::output_error::dot;

/// Rows a block of columns holds.
pub(super) const BLOCK: usize = 64;
const E: usize = 0;
const ONE: usize = 1;
const X: usize = 2;
const ET: usize = 3;
const XT: usize = 4;
const XL: usize = 5;
const R: usize = 6;
const COLUMNS: usize = 7;
/// Below this share of its own size a projected column counts as gone.
const SINGULAR: f64 = 1e-14;

/// Columns of up to [`BLOCK`] rows; unused rows are zero.
#[derive(Debug, Clone)]
pub(super) struct Block {
    pub rows: usize,
    pub e: [f64; BLOCK],
    pub et: [f64; BLOCK],
    pub x: [f64; BLOCK],
    pub xt: [f64; BLOCK],
    pub xl: [f64; BLOCK],
    pub r: [f64; BLOCK],
    /// Whether `e` and `et` hold anything but zeros.
    pub decaying: bool,
}

impl Block {
    pub fn zero() -> Self {
        let z = [0.0; BLOCK];
        Self { rows: 0, e: z, et: z, x: z, xt: z, xl: z, r: z, decaying: true }
    }
}

/// Linear unknowns: offset, gain, and the free state of each segment, on centred data.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Linear {
    pub bias: f64,
    pub gain: f64,
    pub free: Vec<f64>,
}

/// Symmetric inner products of one segment's columns.
#[derive(Debug, Clone)]
pub(super) struct Gram {
    products: [[f64; COLUMNS]; COLUMNS],
    arch: pulp::Arch,
}

/// Σ a over a block, in eight lanes.
#[inline(always)]
fn sum(a: &[f64; BLOCK]) -> f64 {
    let mut lanes = [0.0; 8];
    for i in (0..BLOCK).step_by(8) {
        for lane in 0..8 {
            lanes[lane] += a[i + lane];
        }
    }
    ((lanes[0] + lanes[1]) + (lanes[2] + lanes[3])) + ((lanes[4] + lanes[5]) + (lanes[6] + lanes[7]))
}

/// A block on its way into the products; the same bits whatever the width of this computer's vectors.
struct Add<'a> {
    products: &'a mut [[f64; COLUMNS]; COLUMNS],
    block: &'a Block,
}

impl pulp::NullaryFnOnce for Add<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { products: g, block } = self;
        g[ONE][ONE] += block.rows as f64;
        let steady = [(X, &block.x), (XT, &block.xt), (XL, &block.xl), (R, &block.r)];
        for (i, &(column, values)) in steady.iter().enumerate() {
            g[ONE][column] += sum(values);
            for &(other, others) in &steady[i..] {
                g[column][other] += dot(values, others);
            }
        }
        if block.decaying {
            g[E][E] += dot(&block.e, &block.e);
            g[E][ET] += dot(&block.e, &block.et);
            g[ET][ET] += dot(&block.et, &block.et);
            g[E][ONE] += sum(&block.e);
            g[ONE][ET] += sum(&block.et);
            g[E][X] += dot(&block.e, &block.x);
            g[X][ET] += dot(&block.x, &block.et);
            for &(column, values) in &steady[1..] {
                g[E][column] += dot(&block.e, values);
                g[ET][column] += dot(&block.et, values);
            }
        }
    }
}

impl Gram {
    pub fn zero() -> Self {
        Self { products: [[0.0; COLUMNS]; COLUMNS], arch: pulp::Arch::new() }
    }

    /// Adds the rows of a block.
    pub fn add(&mut self, block: &Block) {
        self.arch.dispatch(Add { products: &mut self.products, block });
    }

    fn at(&self, i: usize, j: usize) -> f64 {
        let (i, j) = if i <= j { (i, j) } else { (j, i) };
        self.products[i][j]
    }

    /// Inner product of columns given as (weight, column) sums.
    fn between(&self, a: &[(f64, usize)], b: &[(f64, usize)]) -> f64 {
        a.iter()
            .flat_map(|&(wa, i)| b.iter().map(move |&(wb, j)| (wa * wb, i, j)))
            .fold(0.0, |total, (w, i, j)| if w == 0.0 { total } else { total + w * self.at(i, j) })
    }
}

/// The projected problem of a pass: what is left of (bias, gain, ln T, L/T) once the free states are gone.
#[derive(Debug, Clone)]
pub(super) struct Projected {
    /// Gauss–Newton matrix over bias, gain, ln T, L/T.
    pub matrix: [[f64; 4]; 4],
    /// Its right-hand side.
    pub rhs: [f64; 4],
    /// Residual sum of squares with the linear unknowns at their best.
    pub rss: f64,
    /// Linear unknowns at their best for this (T, L).
    pub linear: Linear,
}

/// Solves the linear unknowns and projects out the free states; `None` where the gain cannot be told.
pub(super) fn project(grams: &[Gram], reference: &Linear, free: bool) -> Option<Projected> {
    let mut s = [[0.0; 3]; 3];
    let columns = [ONE, X, R];
    for gram in grams {
        let ee = gram.at(E, E);
        for i in 0..3 {
            for j in i..3 {
                let taken =
                    if free && ee > 0.0 { gram.at(E, columns[i]) * gram.at(E, columns[j]) / ee } else { 0.0 };
                s[i][j] += gram.at(columns[i], columns[j]) - taken;
            }
        }
    }
    let raw_x: f64 = grams.iter().map(|g| g.at(X, X)).sum();
    let raw_one: f64 = grams.iter().map(|g| g.at(ONE, ONE)).sum();
    if s[0][0] <= SINGULAR * raw_one {
        return None;
    }
    let xx = s[1][1] - s[0][1] * s[0][1] / s[0][0];
    let xr = s[1][2] - s[0][1] * s[0][2] / s[0][0];
    let gain = if xx > SINGULAR * raw_x { xr / xx } else { return None };
    let bias = (s[0][2] - s[0][1] * gain) / s[0][0];
    let rss = s[2][2] - bias * s[0][2] - gain * s[1][2];
    let states = grams.iter().zip(&reference.free).map(|(g, last)| {
        let ee = g.at(E, E);
        if free && ee > 0.0 {
            last + (g.at(E, R) - bias * g.at(E, ONE) - gain * g.at(E, X)) / ee
        } else {
            0.0
        }
    });
    let linear = Linear { bias: reference.bias + bias, gain: reference.gain + gain, free: states.collect() };
    let (matrix, rhs) = normal_equations(grams, &linear, free);
    Some(Projected { matrix, rhs, rss: rss.max(0.0), linear })
}

fn normal_equations(grams: &[Gram], linear: &Linear, free: bool) -> ([[f64; 4]; 4], [f64; 4]) {
    let (mut matrix, mut rhs) = ([[0.0; 4]; 4], [0.0; 4]);
    for (gram, &state) in grams.iter().zip(&linear.free) {
        let time_constant = [(linear.gain, XT), (state, ET)];
        let dead_time = [(linear.gain, XL)];
        let columns: [&[(f64, usize)]; 4] = [&[(1.0, ONE)], &[(1.0, X)], &time_constant, &dead_time];
        let e: &[(f64, usize)] = &[(1.0, E)];
        let r: &[(f64, usize)] = &[(1.0, R)];
        let ee = gram.at(E, E);
        let share = if free && ee > 0.0 { 1.0 / ee } else { 0.0 };
        let on_e = columns.map(|c| if share > 0.0 { gram.between(c, e) } else { 0.0 });
        let r_e = gram.between(r, e);
        for i in 0..4 {
            rhs[i] += gram.between(columns[i], r) - share * on_e[i] * r_e;
            for j in 0..4 {
                matrix[i][j] += gram.between(columns[i], columns[j]) - share * on_e[i] * on_e[j];
            }
        }
    }
    (matrix, rhs)
}
