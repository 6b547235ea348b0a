//! Global start: the residual of every (T, L) of a grid, on an even, thinned-out copy of the record.
//!
//! With the filtered input z of one T, the sums over z delayed by n rows follow from running sums; only
//! Σ y z is worked out for each n. So a grid of a thousand points costs less than a pass over the data.

use super::problem::Stretch;
use super::response::Dynamics;
use super::statistics::mean;

/// Points of the even grid.
const POINTS: usize = 512;
/// Ratio of neighbouring time constants.
const RATIO: f64 = 1.6;
/// Starts handed on, of each kind.
const STARTS: usize = 3;
/// Part of z that must be left once offset and free state are taken out of it.
const SINGULAR: f64 = 1e-8;

/// The most promising (T, L): with a free state, where it is free, and at rest, where a step soon after the first
/// row leaves a valley too narrow for the grid once the state is free.
pub(super) fn starts(stretch: &Stretch) -> Vec<Dynamics> {
    let even = Even::of(stretch);
    let mut chosen: Vec<Dynamics> = Vec::new();
    for free in [true, false] {
        if free && stretch.at_rest {
            continue;
        }
        let mut found: Vec<(f64, Dynamics)> = Vec::new();
        let mut time_constant_s = 0.3 * even.step_s;
        while time_constant_s < 20.0 * stretch.span_s() {
            even.scan(time_constant_s, free, &mut found);
            time_constant_s *= RATIO;
        }
        found.retain(|(rss, _)| rss.is_finite());
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        let most = chosen.len() + STARTS;
        for (_, d) in found {
            if chosen.len() == most {
                break;
            }
            if !chosen.iter().any(|c| even.near(c, &d)) {
                chosen.push(d);
            }
        }
    }
    if chosen.is_empty() {
        chosen.push(Dynamics { time_constant_s: stretch.span_s() / 5.0, dead_time_s: 0.0 });
    }
    chosen
}

/// Record on an even grid, centred: the input at 0 before the first row, the output at mean 0.
struct Even {
    step_s: f64,
    u: Vec<f64>,
    y: Vec<f64>,
    /// Typical rows between moves of the input.
    rows_between_moves: f64,
}

impl Even {
    fn of(s: &Stretch) -> Self {
        let points = s.len().min(POINTS);
        let step_s = s.span_s() / (points - 1) as f64;
        let (mut u, mut y) = (Vec::with_capacity(points), Vec::with_capacity(points));
        let (mut row, mut row_u) = (0, 0);
        for k in 0..points {
            let at = s.t[0] + k as f64 * step_s;
            while row + 2 < s.len() && s.t[row + 1] <= at {
                row += 1;
            }
            let width = s.t[row + 1] - s.t[row];
            let share = if width > 0.0 { ((at - s.t[row]) / width).clamp(0.0, 1.0) } else { 1.0 };
            y.push(s.y[row] + share * (s.y[row + 1] - s.y[row]));
            u.push(mean_between(s, at, at + step_s, &mut row_u) - s.u_before);
        }
        let offset = mean(&y);
        y.iter_mut().for_each(|v| *v -= offset);
        let range = u.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let moves = u.windows(2).filter(|w| (w[1] - w[0]).abs() > 1e-3 * range).count();
        Self { step_s, rows_between_moves: points as f64 / (moves + 1) as f64, u, y }
    }

    fn near(&self, a: &Dynamics, b: &Dynamics) -> bool {
        (a.time_constant_s / b.time_constant_s).ln().abs() < 1.5 * RATIO.ln()
            && (a.dead_time_s - b.dead_time_s).abs() < (0.5 * b.time_constant_s).max(2.5 * self.step_s)
    }

    /// Local minima over the dead time for one time constant, added to `found` as (residual, T and L).
    fn scan(&self, time_constant_s: f64, free: bool, found: &mut Vec<(f64, Dynamics)>) {
        let rows = self.y.len();
        let a = (-self.step_s / time_constant_s).exp();
        let (mut z, mut e) = (vec![0.0; rows], vec![0.0; rows]);
        let mut sums = [vec![0.0; rows], vec![0.0; rows], vec![0.0; rows]];
        let (mut z_k, mut e_k) = (0.0, if free { 1.0 } else { 0.0 });
        let mut running = [0.0; 3];
        for k in 0..rows {
            if k > 0 {
                z_k = a * z_k + (1.0 - a) * self.u[k - 1];
                e_k = if e_k < 1e-18 { 0.0 } else { e_k * a };
            }
            (z[k], e[k]) = (z_k, e_k);
            running = [running[0] + z_k, running[1] + z_k * z_k, running[2] + z_k * e_k];
            for (sum, value) in sums.iter_mut().zip(running) {
                sum[k] = value;
            }
        }
        let fixed = Fixed::of(&self.y, &e);
        let mut scanned: Vec<(f64, usize)> = Vec::new();
        let mut lag = 0;
        let stride = (0.3 * time_constant_s / self.step_s).max(1.0);
        while lag < rows * 3 / 4 {
            let last = rows - 1 - lag;
            let zy = dot(&z[..=last], &self.y[lag..]);
            let shifted = [sums[0][last], sums[1][last], a.powi(lag as i32) * sums[2][last]];
            scanned.push((fixed.rss(shifted, zy), lag));
            let far = 0.08 * lag as f64;
            let most = (0.5 * self.rows_between_moves).max(0.3 * time_constant_s / self.step_s);
            lag += stride.max(far).min(most).max(1.0) as usize;
        }
        for (i, &(rss, lag)) in scanned.iter().enumerate() {
            let lower_left = i == 0 || rss <= scanned[i - 1].0;
            let lower_right = i + 1 == scanned.len() || rss <= scanned[i + 1].0;
            if lower_left && lower_right {
                found.push((rss, Dynamics { time_constant_s, dead_time_s: lag as f64 * self.step_s }));
            }
        }
    }
}

/// Inner products of the columns that don't depend on the dead time.
struct Fixed {
    rows: f64,
    e: f64,
    ee: f64,
    ey: f64,
    yy: f64,
}

impl Fixed {
    fn of(y: &[f64], e: &[f64]) -> Self {
        Self { rows: y.len() as f64, e: e.iter().sum(), ee: dot(e, e), ey: dot(e, y), yy: dot(y, y) }
    }

    /// Residual sum of squares given Σz, Σz², Σez and Σzy; y has mean 0.
    fn rss(&self, [z, zz, ez]: [f64; 3], zy: f64) -> f64 {
        let ee = self.ee - self.e * self.e / self.rows;
        let ez = ez - self.e * z / self.rows;
        let (mut zz_left, mut zy_left, mut yy_left) = (zz - z * z / self.rows, zy, self.yy);
        if ee > SINGULAR * self.ee {
            zz_left -= ez * ez / ee;
            zy_left -= ez * self.ey / ee;
            yy_left -= self.ey * self.ey / ee;
        }
        if zz_left > SINGULAR * zz { yy_left - zy_left * zy_left / zz_left } else { f64::INFINITY }
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut lanes = [0.0; 4];
    let (ca, cb) = (a.chunks_exact(4), b.chunks_exact(4));
    let rest: f64 = ca.remainder().iter().zip(cb.remainder()).map(|(x, y)| x * y).sum();
    for (x, y) in ca.zip(cb) {
        for lane in 0..4 {
            lanes[lane] += x[lane] * y[lane];
        }
    }
    lanes.iter().sum::<f64>() + rest
}

/// Mean of the held MV between two times; `row` is where the last call left off.
fn mean_between(s: &Stretch, from: f64, to: f64, row: &mut usize) -> f64 {
    let last = s.len() - 1;
    while *row < last && s.t[*row + 1] <= from {
        *row += 1;
    }
    let (mut k, mut now, mut total) = (*row, from, 0.0);
    while k < last && s.t[k + 1] < to {
        total += s.u[k] * (s.t[k + 1] - now).max(0.0);
        now = s.t[k + 1].max(now);
        k += 1;
    }
    (total + s.u[k] * (to - now)) / (to - from)
}
