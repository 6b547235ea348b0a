//! The model's columns over a record: response and sensitivities, exact for a zero-order hold.
//!
//! T ẋ = −x + u(t − L). Over a piece of length δ with constant u and a = e^(−δ/T):
//! x⁺ = a x + (1 − a) u, xθ⁺ = a xθ + (δ/T) a (x − u) with θ = ln T, xλ⁺ = a xλ with λ = L/T, and xλ falls by Δu where
//! the delayed input moves. The free state is e = e^(−(t − ts)/T). x starts at rest with the MV before the first row.

use super::gram::{BLOCK, Block, Gram, Linear};
use super::problem::Stretch;

/// A decay this small adds nothing to a sum in f64.
const GONE: f64 = 1e-18;
/// States this small are set to zero: they would only run into denormals, forty times slower.
const FLUSH: f64 = 1e-150;

/// T and L in seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Dynamics {
    pub time_constant_s: f64,
    pub dead_time_s: f64,
}

/// One pass over a stretch: the Gram matrix of each segment, residuals taken against `reference`.
pub(super) fn pass(stretch: &Stretch, dynamics: Dynamics, reference: &Linear) -> Vec<Gram> {
    let mut grams = vec![Gram::zero(); stretch.segments.len()];
    blocks(stretch, dynamics, reference, |segment, _, block| grams[segment].add(block));
    grams
}

/// Residuals against `linear` of the known rows, handed on in blocks with the number of their first row.
pub(super) fn residuals(
    stretch: &Stretch,
    dynamics: Dynamics,
    linear: &Linear,
    mut visit: impl FnMut(usize, &[f64]),
) {
    blocks(stretch, dynamics, linear, |_, first, block| visit(first, &block.r[..block.rows]));
}

fn blocks(
    stretch: &Stretch,
    dynamics: Dynamics,
    reference: &Linear,
    mut visit: impl FnMut(usize, usize, &Block),
) {
    let mut block = Block::zero();
    let mut state = State {
        x: stretch.u_before - stretch.u_ref,
        xt: 0.0,
        xl: 0.0,
        delayed: stretch.u_before - stretch.u_ref,
        next: 0,
        next_switch_s: stretch.t[0] + dynamics.dead_time_s,
    };
    let grid = stretch.uniform.then(|| Grid::new(stretch.sample_time_s, dynamics));
    let mut decay = Decay { step_s: f64::NAN, value: 0.0 };
    for segment in 0..stretch.segments.len() {
        let range = stretch.segment(segment);
        let known = stretch.known(segment);
        let start_s = stretch.t[known.start.min(range.end - 1)];
        let mut free = Free { start_s, gone: !stretch.is_free(segment) };
        let mut first = range.start;
        while first < range.end {
            let end = if first < known.start { known.start } else { range.end };
            let rows = (end - first).min(BLOCK);
            match &grid {
                Some(grid) => state.fill_on_grid(grid, stretch, first, rows, &mut block),
                None => state.fill(stretch, dynamics, &mut decay, first, rows, &mut block),
            }
            if first < known.start {
                state.flush();
                first += rows;
                continue;
            }
            free.fill(stretch, dynamics.time_constant_s, first, rows, &mut block);
            residual(stretch, reference, segment, first, rows, &mut block);
            block.rows = rows;
            visit(segment, first, &block);
            state.flush();
            first += rows;
        }
    }
}

fn residual(s: &Stretch, reference: &Linear, segment: usize, first: usize, rows: usize, block: &mut Block) {
    let offset = s.y_ref + reference.bias;
    let y = &s.y[first..first + rows];
    for (i, &y_k) in y.iter().enumerate() {
        block.r[i] = y_k - offset - reference.gain * block.x[i];
    }
    if block.decaying {
        let free = reference.free[segment];
        for i in 0..rows {
            block.r[i] -= free * block.e[i];
        }
    }
    if rows < BLOCK {
        for column in [&mut block.x, &mut block.xt, &mut block.xl, &mut block.r] {
            column[rows..].fill(0.0);
        }
    }
}

/// Constants of a row on an even grid, where every interval has its switch at the same place.
struct Grid {
    /// Whole samples of the dead time.
    lag: usize,
    a: f64,
    /// Weight of the input before and after the switch in x.
    cx: [f64; 2],
    /// Weights of x and the two inputs in xθ.
    ct: [f64; 3],
    /// Weight of the move in xλ.
    cl: f64,
}

impl Grid {
    fn new(h: f64, dynamics: Dynamics) -> Self {
        let (time_constant, ratio) = (dynamics.time_constant_s, dynamics.dead_time_s / h);
        let lag = ratio.floor();
        let before = (ratio - lag) * h / time_constant;
        let after = (1.0 - (ratio - lag)) * h / time_constant;
        let (a1, a2) = ((-before).exp(), (-after).exp());
        let a = a1 * a2;
        Self {
            lag: lag as usize,
            a,
            cx: [-(-before).exp_m1() * a2, -(-after).exp_m1()],
            ct: [a * (before + after), after * a2 - (before + after) * a, -after * a2],
            cl: a2,
        }
    }
}

/// The free state's column within a segment.
struct Free {
    start_s: f64,
    gone: bool,
}

impl Free {
    fn fill(&mut self, s: &Stretch, time_constant_s: f64, first: usize, rows: usize, block: &mut Block) {
        if self.gone {
            block.decaying = false;
            return;
        }
        block.decaying = true;
        let rate = if s.uniform { (-s.sample_time_s / time_constant_s).exp() } else { 0.0 };
        let mut e = (-(s.t[first] - self.start_s) / time_constant_s).exp();
        for i in 0..rows {
            let age = (s.t[first + i] - self.start_s) / time_constant_s;
            if i > 0 {
                e = if s.uniform { e * rate } else { (-age).exp() };
            }
            if e < GONE {
                e = 0.0;
            }
            block.e[i] = e;
            block.et[i] = age * e;
        }
        block.e[rows..].fill(0.0);
        block.et[rows..].fill(0.0);
        self.gone = e == 0.0;
    }
}

/// The last exponential computed: stamps repeat their steps.
struct Decay {
    step_s: f64,
    value: f64,
}

struct State {
    x: f64,
    xt: f64,
    xl: f64,
    /// Delayed input in force.
    delayed: f64,
    /// Row whose MV comes into force next, and when.
    next: usize,
    next_switch_s: f64,
}

impl State {
    fn flush(&mut self) {
        for value in [&mut self.x, &mut self.xt, &mut self.xl] {
            if value.abs() < FLUSH {
                *value = 0.0;
            }
        }
    }

    fn fill_on_grid(&mut self, grid: &Grid, s: &Stretch, first: usize, rows: usize, block: &mut Block) {
        let mut inputs = [0.0; BLOCK + 1];
        let shift = grid.lag + 2;
        if first >= shift {
            let delayed = &s.u[first - shift..=first - shift + rows];
            for (input, u) in inputs.iter_mut().zip(delayed) {
                *input = u - s.u_ref;
            }
        } else {
            for (i, input) in inputs.iter_mut().enumerate().take(rows + 1) {
                let u = (first + i).checked_sub(shift).map_or(s.u_before, |k| s.u[k]);
                *input = u - s.u_ref;
            }
        }
        let (mut x, mut xt, mut xl) = (self.x, self.xt, self.xl);
        let start = usize::from(first == 0);
        if start == 1 {
            (block.x[0], block.xt[0], block.xl[0]) = (x, xt, xl);
        }
        for i in start..rows {
            let (p, q) = (inputs[i], inputs[i + 1]);
            xt = grid.a * xt + (grid.ct[0] * x + (grid.ct[1] * p + grid.ct[2] * q));
            x = grid.a * x + (grid.cx[0] * p + grid.cx[1] * q);
            xl = grid.a * xl + grid.cl * (p - q);
            block.x[i] = x;
            block.xt[i] = xt;
            block.xl[i] = xl;
        }
        (self.x, self.xt, self.xl) = (x, xt, xl);
    }

    fn fill(
        &mut self,
        s: &Stretch,
        dynamics: Dynamics,
        decay: &mut Decay,
        first: usize,
        rows: usize,
        block: &mut Block,
    ) {
        for i in 0..rows {
            let k = first + i;
            if k > 0 {
                let mut now = s.t[k - 1];
                while self.next < k && self.next_switch_s < s.t[k] {
                    let u = s.u[self.next] - s.u_ref;
                    if u != self.delayed {
                        let at = self.next_switch_s.max(now);
                        self.hold(at - now, dynamics.time_constant_s, decay);
                        now = at;
                        self.xl += self.delayed - u;
                        self.delayed = u;
                    }
                    self.next += 1;
                    self.next_switch_s = s.t[self.next] + dynamics.dead_time_s;
                }
                self.hold(s.t[k] - now, dynamics.time_constant_s, decay);
            }
            block.x[i] = self.x;
            block.xt[i] = self.xt;
            block.xl[i] = self.xl;
        }
    }

    fn hold(&mut self, step_s: f64, time_constant_s: f64, decay: &mut Decay) {
        if step_s != decay.step_s {
            *decay = Decay { step_s, value: (-step_s / time_constant_s).exp() };
        }
        let a = decay.value;
        let distance = self.x - self.delayed;
        self.xt = a * self.xt + step_s / time_constant_s * a * distance;
        self.x = self.delayed + a * distance;
        self.xl *= a;
    }
}
