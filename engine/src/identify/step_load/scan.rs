//! Where a step would explain what a fit leaves over: its score at every place.
//!
//! With residuals r orthogonal to the fit's sensitivities J, a further column c lowers ‖r‖² by (cᵀr)²/(cᵀc − ‖Qᵀc‖²),
//! Q an orthonormal basis of J: what no parameter of the fit can make up for. Rows are taken together in bins.

use crate::identify::fit_structure::free_run;
use crate::identify::output_error::{Found, Order, Point, Shape, blocks, derivatives};
use crate::identify::problem::Stretch;

/// Bins of a stretch.
pub(super) const BINS: usize = 300;
/// Segments beyond which a stretch is too broken to be searched.
const SEGMENTS: usize = 8;
/// Part of a step that must be left once the sensitivities are taken out of it.
const SINGULAR: f64 = 1e-3;
/// Places tried of each kind of step.
const PLACES: usize = 2;
/// Bins that two places lie apart at least.
const APART: usize = 6;

/// A step that the residuals speak for.
#[derive(Debug, Clone, Copy)]
pub(super) struct Candidate {
    pub order: Order,
    pub point: Point,
    /// By how much it lowers the squared residuals, in mean squares.
    pub score: f64,
    /// The squared residuals that it leaves at these dynamics.
    pub left: f64,
}

/// The steps that the residuals of a fit speak for most, a few of each kind.
pub(super) fn candidates(here: &Stretch, shape: &Shape, found: &Found) -> Vec<Candidate> {
    if here.segments.len() > SEGMENTS {
        return vec![];
    }
    let Some(bins) = Bins::of(here, shape, found) else { return vec![] };
    kinds(here, shape, found).into_iter().flat_map(|(order, point)| bins.best(order, point)).collect()
}

/// Kinds of steps with the dynamics they are tried with.
fn kinds(here: &Stretch, shape: &Shape, found: &Found) -> Vec<(Order, Point)> {
    let jump = Point { time_s: here.sample_time_s, zeta: 1.0, dead_time_s: 0.0 };
    let main = found.points[0];
    let mut out = vec![(Order::Jump, jump)];
    let lag = match shape.channels[0] {
        Order::Integrator => {
            out.push((Order::Integrator, jump));
            here.span_s() / 30.0
        }
        Order::Second { .. } => {
            out.push((Order::Second { zero: false }, Point { dead_time_s: 0.0, ..main }));
            2.0 * main.zeta.max(0.5) * main.time_s
        }
        _ => main.time_s,
    };
    for share in [0.4, 1.0, 2.5] {
        let time_s = share * lag;
        if time_s > here.sample_time_s && time_s < 0.3 * here.span_s() {
            out.push((Order::First, Point { time_s, zeta: 1.0, dead_time_s: 0.0 }));
        }
    }
    out
}

/// Number of sensitivities of a fit.
pub(super) fn size(here: &Stretch, shape: &Shape) -> usize {
    shape.shared.len() + shape.unknowns + shape.local.len() * here.segments.len()
}

/// Hands on what each unknown of a fit does to each row: its place, the row and the share, which add up.
pub(super) fn sensitivities(
    here: &Stretch,
    shape: &Shape,
    found: &Found,
    mut put: impl FnMut(usize, usize, f64),
) {
    let linear = &found.projected.linear;
    blocks(here, shape, &found.points, linear, |segment, first, block| {
        let slopes = if shape.differentiable {
            derivatives(shape, &linear.shared, &linear.local[segment])
        } else {
            vec![]
        };
        let single = |column: usize| vec![(1.0, column)];
        let shared = shape.shared.iter().map(|t| single(t.column)).chain(slopes).enumerate();
        let start = shape.shared.len() + shape.unknowns + shape.local.len() * segment;
        let local = shape.local.iter().enumerate().map(|(i, t)| (start + i, single(t.column)));
        for (at, combination) in shared.chain(local) {
            for (weight, column) in combination.into_iter().filter(|(_, column)| block.alive[*column]) {
                for (i, value) in block.values[column][..block.rows].iter().enumerate() {
                    put(at, first + i, weight * value);
                }
            }
        }
    });
}

struct Bins {
    /// Root of the rows in each, its mean time, and the stamp of its first row, counted from the problem's first.
    weight: Vec<f64>,
    middle_s: Vec<f64>,
    first_s: Vec<f64>,
    /// Residuals, and an orthonormal basis of the sensitivities.
    residual: Vec<f64>,
    basis: Vec<Vec<f64>>,
    mean_square: f64,
    rss: f64,
}

impl Bins {
    fn of(here: &Stretch, shape: &Shape, found: &Found) -> Option<Self> {
        let rows_of_bin = here.len().div_ceil(BINS);
        let bin = |row: usize| row / rows_of_bin;
        let count = bin(here.len() - 1) + 1;
        let mut columns = vec![vec![0.0; count]; size(here, shape)];
        let mut out = Self {
            weight: vec![0.0; count],
            middle_s: vec![0.0; count],
            first_s: (0..count).map(|i| here.t[i * rows_of_bin] - here.origin_s).collect(),
            residual: vec![0.0; count],
            basis: vec![],
            rss: found.rss(),
            mean_square: found.rss() / here.kept().max(1) as f64,
        };
        sensitivities(here, shape, found, |at, row, value| columns[at][bin(row)] += value);
        let residuals = free_run(here, shape, found).1;
        for row in here.kept_rows() {
            let at = bin(row);
            out.residual[at] += residuals[row];
            out.weight[at] += 1.0;
            out.middle_s[at] += here.t[row] - here.origin_s;
        }
        for at in 0..count {
            let rows = out.weight[at];
            out.middle_s[at] = if rows > 0.0 { out.middle_s[at] / rows } else { out.first_s[at] };
            out.weight[at] = rows.sqrt();
            let scale = if rows > 0.0 { 1.0 / out.weight[at] } else { 0.0 };
            out.residual[at] *= scale;
            columns.iter_mut().for_each(|column| column[at] *= scale);
        }
        out.basis = orthonormal(columns);
        (out.mean_square > 0.0).then_some(out)
    }

    /// The best places for a step of some dynamics.
    fn best(&self, order: Order, dynamics: Point) -> Vec<Candidate> {
        let count = self.weight.len();
        let mut scores: Vec<(f64, usize)> =
            (1..count).map(|at| (self.score(order, dynamics, at), at)).collect();
        scores.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut out: Vec<usize> = vec![];
        let mut found = vec![];
        for (score, at) in scores {
            if found.len() == PLACES {
                break;
            }
            if out.iter().all(|other| other.abs_diff(at) >= APART) {
                out.push(at);
                let point = Point { dead_time_s: self.first_s[at], ..dynamics };
                let left = self.rss - score * self.mean_square;
                found.push(Candidate { order, point, score, left });
            }
        }
        found
    }

    /// Fall of the squared residuals by a step at the start of a bin, in mean squares.
    fn score(&self, order: Order, dynamics: Point, at: usize) -> f64 {
        let response = response_of(order, dynamics);
        let start_s = self.first_s[at];
        let column: Vec<f64> = (at..self.weight.len())
            .map(|i| self.weight[i] * response((self.middle_s[i] - start_s).max(0.0)))
            .collect();
        let with = |other: &[f64]| -> f64 { column.iter().zip(&other[at..]).map(|(a, b)| a * b).sum() };
        let power: f64 = column.iter().map(|c| c * c).sum();
        let left = power - self.basis.iter().map(|q| with(q).powi(2)).sum::<f64>();
        if left > SINGULAR * power { with(&self.residual).powi(2) / (left * self.mean_square) } else { 0.0 }
    }
}

/// Response to a unit step, by the time since.
fn response_of(order: Order, dynamics: Point) -> impl Fn(f64) -> f64 {
    let Point { time_s, zeta, .. } = dynamics;
    move |t_s: f64| match order {
        Order::Jump => 1.0,
        Order::Integrator => t_s / time_s,
        Order::First => -(-t_s / time_s).exp_m1(),
        // Near enough to find the place: two lags in line.
        Order::Second { .. } => {
            let each = time_s * zeta.max(0.5);
            1.0 - (1.0 + t_s / each) * (-t_s / each).exp()
        }
    }
}

/// An orthonormal basis of columns, by Gram and Schmidt's method, twice over.
fn orthonormal(columns: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    /// Part of a column below which what is left is rounding.
    const ROUNDING: f64 = 1e-7;
    let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
    let mut basis: Vec<Vec<f64>> = vec![];
    for mut column in columns {
        let size = dot(&column, &column).sqrt();
        for _ in 0..2 {
            for q in &basis {
                let share = dot(q, &column);
                column.iter_mut().zip(q).for_each(|(c, q)| *c -= share * q);
            }
        }
        let left = dot(&column, &column).sqrt();
        if left > ROUNDING * size && left > 0.0 {
            column.iter_mut().for_each(|c| *c /= left);
            basis.push(column);
        }
    }
    basis
}
