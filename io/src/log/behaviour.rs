//! What columns are by the way they move: setpoints hold still and are followed, an MV steps or answers the
//! controller's law, a PV is smooth and responds.

use vasos_engine::identify::{FitProblem, fit_fopdt};
use vasos_engine::signal::LogTable;

/// Rows looked at.
const ROWS: usize = 3000;
/// Share of rows with a change below which a signal counts as stepping.
const STEPPING: f64 = 0.05;
/// As many rows away from the only value are slips, not moves.
const LONE_ROWS: usize = 3;
/// Typical distance to a setpoint, in ranges of the PV, below which the PV counts as following it.
const FOLLOWED: f64 = 0.25;

/// How a column moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Motion {
    /// One value, bar a few outliers.
    Still,
    /// Holds between moves.
    Steps,
    /// Moves all the time.
    Flows,
    /// Rises by the same amount row by row, like a row number or another clock.
    Counts,
}

/// Columns of a log, thinned out, and how each moves.
#[derive(Debug)]
pub(super) struct Behaviour {
    time_s: Vec<f64>,
    columns: Vec<Vec<f64>>,
    /// 5 % and 95 % points.
    range: Vec<[f64; 2]>,
    /// Whether anything but one value ever occurs.
    ever_moves: Vec<bool>,
    pub motion: Vec<Motion>,
}

impl Behaviour {
    pub fn of(table: &LogTable) -> Self {
        let stride = table.len() / ROWS + 1;
        let thin = |v: &[f64]| v.iter().step_by(stride).copied().collect::<Vec<f64>>();
        let columns: Vec<Vec<f64>> = table.columns.iter().map(|c| filled(&thin(&c.values))).collect();
        let range: Vec<[f64; 2]> = columns.iter().map(|c| quantiles(c)).collect();
        let ever_moves = table.columns.iter().map(|c| moves(&c.values)).collect();
        let motion = table.columns.iter().zip(&columns).zip(&range).map(|((full, thin), range)| {
            if range[1] - range[0] <= 1e-9 * range[1].abs().max(1e-30) {
                let away = thin.iter().filter(|v| !(range[0]..=range[1]).contains(*v)).count();
                let stepped = away > LONE_ROWS || thin.first() != thin.last();
                return if stepped { Motion::Steps } else { Motion::Still };
            }
            let changes =
                full.values.windows(2).filter(|w| w[0] != w[1] && w[0].is_finite() && w[1].is_finite());
            let share = changes.count() as f64 / full.values.len() as f64;
            if share < STEPPING {
                Motion::Steps
            } else if counts(thin) {
                Motion::Counts
            } else {
                Motion::Flows
            }
        });
        let motion = motion.collect();
        Self { time_s: thin(&table.time_s), columns, range, ever_moves, motion }
    }

    fn free<'a>(&'a self, taken: &'a [usize]) -> impl Iterator<Item = usize> + 'a {
        (0..self.columns.len()).filter(move |i| !taken.contains(i))
    }

    pub fn any_moving_besides(&self, taken: &[usize]) -> bool {
        self.free(taken).any(|i| matches!(self.motion[i], Motion::Steps | Motion::Flows))
    }

    /// Typical distance of two columns in ranges of the second.
    fn distance(&self, sp: usize, pv: usize) -> f64 {
        let width = self.range[pv][1] - self.range[pv][0];
        let mut apart: Vec<f64> =
            self.columns[sp].iter().zip(&self.columns[pv]).map(|(a, b)| (a - b).abs()).collect();
        if apart.is_empty() || width.is_nan() || width <= 0.0 {
            return f64::INFINITY;
        }
        let middle = apart.len() / 2;
        *apart.select_nth_unstable_by(middle, f64::total_cmp).1 / width
    }

    /// The column that holds or steps and is followed most closely by one that flows: (setpoint, follower).
    pub fn tracked(&self, taken: &[usize]) -> Option<(usize, usize)> {
        let mut best: Option<(f64, usize, usize)> = None;
        for sp in self.free(taken).filter(|&i| matches!(self.motion[i], Motion::Still | Motion::Steps)) {
            if self.columns[sp].iter().all(|&v| v == 0.0) {
                continue;
            }
            for pv in self.free(taken).filter(|&i| i != sp && self.motion[i] == Motion::Flows) {
                let distance = self.distance(sp, pv);
                if distance < FOLLOWED && best.is_none_or(|b| distance < b.0) {
                    best = Some((distance, sp, pv));
                }
            }
        }
        best.map(|(_, sp, pv)| (sp, pv))
    }

    /// The flowing column closest to a setpoint.
    pub fn tracker_of(&self, sp: usize, taken: &[usize]) -> Option<usize> {
        let flowing = self.free(taken).filter(|&i| i != sp && self.motion[i] == Motion::Flows);
        let near = flowing.map(|i| (self.distance(sp, i), i)).filter(|(d, _)| *d < 2.0 * FOLLOWED);
        near.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, i)| i)
    }

    /// The flowing column that moves furthest for its roughness: what responds rather than acts.
    pub fn responder(&self, taken: &[usize]) -> Option<usize> {
        let smoothness = |i: usize| {
            let c = &self.columns[i];
            let rough = c.windows(2).map(|w| (w[1] - w[0]).abs()).sum::<f64>() / c.len() as f64;
            (self.range[i][1] - self.range[i][0]) / rough.max(1e-300)
        };
        let flowing: Vec<usize> = self.free(taken).filter(|&i| self.motion[i] == Motion::Flows).collect();
        let stepping = || self.free(taken).find(|&i| self.motion[i] == Motion::Steps);
        flowing.iter().copied().max_by(|&a, &b| smoothness(a).total_cmp(&smoothness(b))).or_else(stepping)
    }

    /// The column a PV answers to: one that steps and explains it, else one that flows, else one that ever moves.
    ///
    /// `open` says that no setpoint is known: then an MV that was set once, ahead of the log, is likelier than one
    /// that moves as restlessly as the PV.
    pub fn driver_of(&self, pv: usize, open: bool, taken: &[usize]) -> Option<usize> {
        let explains = |i: usize| {
            let problem = FitProblem::new(&self.time_s, &self.columns[pv], &self.columns[i]);
            fit_fopdt(&problem).map_or(f64::NEG_INFINITY, |fit| fit.fit_percent)
        };
        let held =
            self.free(taken).filter(|&i| self.motion[i] == Motion::Still && self.columns[i][0] != 0.0).last();
        for motion in [Motion::Steps, Motion::Flows] {
            if motion == Motion::Flows && open && held.is_some() {
                return held;
            }
            let of_kind: Vec<usize> = self.free(taken).filter(|&i| self.motion[i] == motion).collect();
            let best = match of_kind[..] {
                [only] => Some(only),
                _ => of_kind.into_iter().max_by(|&a, &b| explains(a).total_cmp(&explains(b))),
            };
            if best.is_some() {
                return best;
            }
        }
        // Of columns that hold still, loops are logged as setpoint first, then output.
        let still = |slips: bool| {
            let held = self.free(taken).filter(move |&i| self.motion[i] == Motion::Still);
            held.filter(move |&i| (self.ever_moves[i] || !slips) && self.columns[i].iter().any(|&v| v != 0.0))
                .last()
        };
        still(true).or_else(|| still(false))
    }

    /// A column that holds or steps within reach of the PV.
    pub fn setpoint_of(&self, pv: usize, taken: &[usize]) -> Option<usize> {
        let holds = |i: usize| matches!(self.motion[i], Motion::Still | Motion::Steps);
        let near = self.free(taken).filter(|&i| holds(i) && self.columns[i][0] != 0.0);
        let near = near.map(|i| (self.distance(i, pv), i)).filter(|(d, _)| *d < 1.5);
        near.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, i)| i)
    }
}

/// Missing values replaced by the last one there was.
fn filled(values: &[f64]) -> Vec<f64> {
    let mut last = values.iter().copied().find(|v| v.is_finite()).unwrap_or(0.0);
    let hold = |&v: &f64| {
        if v.is_finite() {
            last = v;
        }
        last
    };
    values.iter().map(hold).collect()
}

fn quantiles(values: &[f64]) -> [f64; 2] {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let at = |share: f64| sorted.get((share * (sorted.len().saturating_sub(1)) as f64) as usize).copied();
    [at(0.05).unwrap_or(0.0), at(0.95).unwrap_or(0.0)]
}

fn counts(values: &[f64]) -> bool {
    let step = values.get(1).map_or(0.0, |v| v - values[0]);
    step > 0.0 && values.windows(2).all(|w| (w[1] - w[0] - step).abs() <= 1e-6 * step)
}

fn moves(values: &[f64]) -> bool {
    values.iter().any(|v| v.is_finite() && *v != values[0])
}
