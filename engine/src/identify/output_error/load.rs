//! The columns of a load: what a unit step that nobody measured does to the PV from its time on.

use super::columns::Columns;
use super::fill::Fill;
use super::kernel::{First, Integrator, Kernel, Second};
use super::shape::{Order, Point};
use crate::identify::problem::Stretch;

/// The channel of a load.
pub(super) fn stepped(s: &Stretch, order: Order, point: Point, column: usize) -> Box<dyn Fill> {
    let at_s = s.origin_s + point.dead_time_s;
    match order {
        Order::Jump => Box::new(Jump { at_s, column }),
        Order::First => Box::new(Step::new(First::at_rest(point.time_s, 0.0), at_s, column, 3)),
        Order::Integrator => Box::new(Step::new(Integrator::new(point.time_s), at_s, column, 2)),
        Order::Second { .. } => {
            Box::new(Step::new(Second::at_rest(point.time_s, point.zeta, 0.0), at_s, column, 4))
        }
    }
}

/// 1 from a time on.
struct Jump {
    at_s: f64,
    column: usize,
}

impl Fill for Jump {
    fn fill(&mut self, s: &Stretch, first: usize, rows: usize, columns: &mut Columns) {
        for (value, t) in columns.values[self.column].iter_mut().zip(&s.t[first..first + rows]) {
            *value = f64::from(u8::from(*t >= self.at_s));
        }
    }
}

/// A kernel behind a unit step.
struct Step<K: Kernel> {
    kernel: K,
    at_s: f64,
    column: usize,
    count: usize,
    begun: bool,
    last: Option<(f64, K::Factors)>,
}

impl<K: Kernel> Step<K> {
    fn new(kernel: K, at_s: f64, column: usize, count: usize) -> Self {
        Self { kernel, at_s, column, count, begun: false, last: None }
    }

    fn hold(&mut self, duration_s: f64) {
        let factors = match self.last {
            Some((last_s, factors)) if last_s == duration_s => factors,
            _ => self.kernel.factors(duration_s),
        };
        self.last = Some((duration_s, factors));
        self.kernel.hold(&factors, 1.0);
    }
}

impl<K: Kernel> Fill for Step<K> {
    fn fill(&mut self, s: &Stretch, first: usize, rows: usize, columns: &mut Columns) {
        for i in 0..rows {
            let k = first + i;
            if self.begun {
                self.hold(if s.uniform { s.sample_time_s } else { s.t[k] - s.t[k - 1] });
            } else if self.at_s < s.t[k] {
                self.kernel.jump(1.0);
                self.begun = true;
                self.hold(s.t[k] - self.at_s);
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
