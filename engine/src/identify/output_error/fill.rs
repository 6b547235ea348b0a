//! One pass over a record: fills the columns block by block.

use super::columns::{Columns, Gram, ROWS};
use super::kernel::{First, Integrator, Kernel, Second};
use super::load::stepped;
use super::matrix2::Exponential;
use super::shape::{Linear, ONE, Order, Point, Shape};
use crate::identify::problem::{Input, Stretch};

/// A decay this small adds nothing to a sum in f64.
const GONE: f64 = 1e-18;

/// The Gram matrix of each segment, residuals taken against `reference`.
pub(in crate::identify) fn grams(
    stretch: &Stretch,
    shape: &Shape,
    points: &[Point],
    reference: &Linear,
) -> Vec<Gram> {
    let mut grams = vec![Gram::zero(shape.columns()); stretch.segments.len()];
    blocks(stretch, shape, points, reference, |segment, _, columns| grams[segment].add(columns));
    grams
}

/// Visits every block of known rows: segment, first row, columns.
pub(in crate::identify) fn blocks(
    stretch: &Stretch,
    shape: &Shape,
    points: &[Point],
    reference: &Linear,
    mut visit: impl FnMut(usize, usize, &Columns),
) {
    let mut columns = Columns::zero(shape.columns());
    let channel = |i: usize| -> Box<dyn Fill + '_> {
        let (order, point, column) = (shape.channels[i], points[i], shape.places[i].first);
        if i < shape.inputs() {
            fed(stretch, order, point, column, stretch.input(i))
        } else {
            stepped(stretch, order, point, column)
        }
    };
    let mut channels: Vec<Box<dyn Fill + '_>> = (0..points.len()).map(channel).collect();
    let middle_s = 0.5 * (stretch.t[0] + stretch.t[stretch.len() - 1]);
    for segment in 0..stretch.segments.len() {
        let range = stretch.segment(segment);
        let known = stretch.known(segment);
        let start_s = stretch.t[known.start.min(range.end - 1)];
        let is_free = match (shape.free, stretch.is_free(segment)) {
            (false, _) => Free::Absent,
            (true, false) => Free::Empty,
            (true, true) => Free::Estimated,
        };
        let mut modes: Vec<Modes> = (0..shape.inputs())
            .map(|i| Modes::new(shape.channels[i], points[i], shape.places[i].free, start_s, is_free))
            .collect();
        let mut first = range.start;
        while first < range.end {
            let end = if first < known.start { known.start } else { range.end };
            let rows = (end - first).min(ROWS);
            columns.rows = rows;
            columns.values[ONE][..rows].fill(1.0);
            if let Some(drift) = shape.drift_column {
                for (value, t) in columns.values[drift].iter_mut().zip(&stretch.t[first..first + rows]) {
                    *value = t - middle_s;
                }
            }
            for channel in &mut channels {
                channel.fill(stretch, first, rows, &mut columns);
            }
            if first < known.start {
                first += rows;
                continue;
            }
            for mode in &mut modes {
                mode.fill(stretch, first, rows, &mut columns);
            }
            residual(stretch, shape, reference, segment, first, &mut columns);
            let keep = stretch.keep.as_ref().map(|keep| &keep[first..first + rows]);
            columns.clear(keep);
            if !shape.differentiable {
                for &(_, column) in shape.shared.iter().chain(&shape.local).flat_map(|t| &t.derivatives) {
                    columns.alive[column] = false;
                }
            }
            visit(segment, first, &columns);
            first += rows;
        }
    }
}

fn residual(
    s: &Stretch,
    shape: &Shape,
    reference: &Linear,
    segment: usize,
    first: usize,
    columns: &mut Columns,
) {
    let rows = columns.rows;
    let mut r = [0.0; ROWS];
    for (value, y) in r.iter_mut().zip(&s.y[first..first + rows]) {
        *value = y - s.y_ref;
    }
    let shared = shape.shared.iter().zip(&reference.shared);
    let local = shape.local.iter().zip(&reference.local[segment]);
    for (term, &coefficient) in shared.chain(local) {
        if coefficient != 0.0 && columns.alive[term.column] {
            let column = &columns.values[term.column];
            for i in 0..rows {
                r[i] -= coefficient * column[i];
            }
        }
    }
    columns.values[shape.residual] = r;
}

/// A channel that writes its columns.
pub(super) trait Fill {
    /// Writes `rows` rows from `first` on; called for all rows in their order.
    fn fill(&mut self, s: &Stretch, first: usize, rows: usize, columns: &mut Columns);
}

/// A channel from an input.
fn fed<'a>(
    s: &Stretch<'_>,
    order: Order,
    point: Point,
    column: usize,
    input: Input<'a>,
) -> Box<dyn Fill + 'a> {
    let (u, l) = (input.before - input.reference, point.dead_time_s);
    match order {
        Order::First | Order::Jump => {
            Box::new(Feed::new(First::at_rest(point.time_s, u), s, l, column, 3, input))
        }
        Order::Integrator => Box::new(Feed::new(Integrator::new(point.time_s), s, l, column, 2, input)),
        Order::Second { zero } => {
            let kernel = Second::at_rest(point.time_s, point.zeta, u);
            Box::new(Feed::new(kernel, s, l, column, if zero { 8 } else { 4 }, input))
        }
    }
}

/// The delayed input of a channel and the kernel it drives.
struct Feed<'a, K: Kernel> {
    kernel: K,
    input: Input<'a>,
    column: usize,
    count: usize,
    dead_time_s: f64,
    /// Even grid: whole samples of the dead time, and the constants before and after its switch and over both.
    grid: Option<(usize, [K::Factors; 3])>,
    /// Uneven stamps: delayed input in force, row whose input comes into force next and when, last constants.
    delayed: f64,
    next: usize,
    next_switch_s: f64,
    last: Option<(f64, K::Factors)>,
}

impl<'a, K: Kernel> Feed<'a, K> {
    fn new(
        kernel: K,
        s: &Stretch<'_>,
        dead_time_s: f64,
        column: usize,
        count: usize,
        input: Input<'a>,
    ) -> Self {
        let grid = s.uniform.then(|| {
            let h = s.sample_time_s;
            let lag = (dead_time_s / h).floor();
            let before = dead_time_s - lag * h;
            (lag as usize, [before, h - before, h].map(|d| kernel.factors(d)))
        });
        Self {
            kernel,
            input,
            column,
            count,
            dead_time_s,
            grid,
            delayed: input.before - input.reference,
            next: 0,
            next_switch_s: s.t[0] + dead_time_s,
            last: None,
        }
    }

    fn advance(&mut self, s: &Stretch, k: usize) {
        let mut now = s.t[k - 1];
        while self.next < k && self.next_switch_s < s.t[k] {
            let u = self.input.centred(Some(self.next));
            if u != self.delayed {
                let at = self.next_switch_s.max(now);
                self.hold(at - now);
                now = at;
                self.kernel.jump(u - self.delayed);
                self.delayed = u;
            }
            self.next += 1;
            self.next_switch_s = s.t[self.next] + self.dead_time_s;
        }
        self.hold(s.t[k] - now);
    }

    fn hold(&mut self, duration_s: f64) {
        let factors = match self.last {
            Some((last_s, factors)) if last_s == duration_s => factors,
            _ => self.kernel.factors(duration_s),
        };
        self.last = Some((duration_s, factors));
        self.kernel.hold(&factors, self.delayed);
    }
}

impl<K: Kernel> Fill for Feed<'_, K> {
    fn fill(&mut self, s: &Stretch, first: usize, rows: usize, columns: &mut Columns) {
        for i in 0..rows {
            let k = first + i;
            if k > 0 {
                match self.grid {
                    Some((lag, ref factors)) => {
                        let old = self.input.centred(k.checked_sub(lag + 2));
                        let new = self.input.centred(k.checked_sub(lag + 1));
                        if old == new {
                            self.kernel.hold(&factors[2], old);
                        } else {
                            self.kernel.hold(&factors[0], old);
                            self.kernel.jump(new - old);
                            self.kernel.hold(&factors[1], new);
                        }
                    }
                    None => self.advance(s, k),
                }
            }
            let output = self.kernel.output();
            for (column, &value) in
                columns.values[self.column..].iter_mut().zip(&output.as_ref()[..self.count])
            {
                column[i] = value;
            }
        }
        self.kernel.flush();
    }
}

/// What becomes of the columns of a segment's free modes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Free {
    /// The shape has none.
    Absent,
    /// The segment starts at rest.
    Empty,
    Estimated,
}

/// The free modes of a channel within a segment.
struct Modes {
    order: Order,
    point: Point,
    column: usize,
    start_s: f64,
    free: Free,
    gone: bool,
}

impl Modes {
    fn new(order: Order, point: Point, column: usize, start_s: f64, free: Free) -> Self {
        Self { order, point, column, start_s, free, gone: false }
    }

    fn fill(&mut self, s: &Stretch, first: usize, rows: usize, columns: &mut Columns) {
        let count = match self.order {
            Order::First => 2,
            Order::Integrator | Order::Jump => 0,
            Order::Second { .. } => 6,
        };
        if self.free == Free::Absent {
            return;
        }
        let alive = self.free == Free::Estimated && !self.gone;
        columns.alive[self.column..self.column + count].fill(alive);
        if !alive {
            return;
        }
        match self.order {
            Order::First => self.fill_first(s, first, rows, columns),
            Order::Integrator | Order::Jump => {}
            Order::Second { .. } => self.fill_second(s, first, rows, columns),
        }
    }

    fn fill_first(&mut self, s: &Stretch, first: usize, rows: usize, columns: &mut Columns) {
        let time_s = self.point.time_s;
        let rate = (-s.sample_time_s / time_s).exp();
        let mut e = (-(s.t[first] - self.start_s) / time_s).exp();
        for i in 0..rows {
            let age = (s.t[first + i] - self.start_s) / time_s;
            if i > 0 {
                e = if s.uniform { e * rate } else { (-age).exp() };
            }
            if e < GONE {
                e = 0.0;
            }
            columns.values[self.column][i] = e;
            columns.values[self.column + 1][i] = age * e;
        }
        self.gone = e == 0.0;
    }

    fn fill_second(&mut self, s: &Stretch, first: usize, rows: usize, columns: &mut Columns) {
        let Point { time_s, zeta, .. } = self.point;
        let at = |k: usize| {
            let whole = Exponential::new((s.t[k] - self.start_s) / time_s, zeta);
            UpperRow { e: whole.e[0], by_tau: whole.by_tau[0], by_zeta: whole.by_zeta[0] }
        };
        let step = Exponential::new(s.sample_time_s / time_s, zeta);
        let mut now = at(first);
        let mut last = 0.0;
        for i in 0..rows {
            if i > 0 {
                now = if s.uniform { carried(&now, &step) } else { at(first + i) };
            }
            let UpperRow { e, by_tau, by_zeta } = &now;
            let rows_of = [e[0], by_tau[0], by_zeta[0], e[1], by_tau[1], by_zeta[1]];
            for (column, value) in columns.values[self.column..].iter_mut().zip(rows_of) {
                column[i] = value;
            }
            last = now.e[0].abs() + now.e[1].abs();
        }
        self.gone = last < GONE;
    }
}

/// The upper row of E(s + h) from that of E(s) and from E(h), with its derivatives by the product rule.
fn carried(now: &UpperRow, step: &Exponential) -> UpperRow {
    let times = |a: [f64; 2], b: &[[f64; 2]; 2]| -> [f64; 2] {
        std::array::from_fn(|j| a[0] * b[0][j] + a[1] * b[1][j])
    };
    let sum = |a: [f64; 2], b: [f64; 2]| [a[0] + b[0], a[1] + b[1]];
    UpperRow {
        e: times(now.e, &step.e),
        by_tau: sum(times(now.by_tau, &step.e), times(now.e, &step.by_tau)),
        by_zeta: sum(times(now.by_zeta, &step.e), times(now.e, &step.by_zeta)),
    }
}

/// What an exponential says of the output: its upper row.
struct UpperRow {
    e: [f64; 2],
    by_tau: [f64; 2],
    by_zeta: [f64; 2],
}
