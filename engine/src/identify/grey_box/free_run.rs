//! The simulation in free run: from the initial levels on nothing is fed back from the measurements.
//!
//! Classical Runge–Kutta between the moments at which something changes: an input arrives after its delay, a vessel gets
//! to its rim or leaves it. There the levels go on and their sensitivities jump, by the shift of the moment itself:
//!
//! ```text
//! s⁺ = s⁻ + (f⁻ − f⁺) ∂τ/∂p,   ∂τ/∂θ = 1 for an input that arrives,   ∂τ/∂p = (∂H/∂p − s⁻_i)/f⁻_i at the rim H of i
//! ```
//!
//! Samples in a step are read from the cubic through both its ends. Source: Hiskens and Pai, IEEE Trans. Circuits and
//! Systems I 47 (2000) 204.

use super::flows::{Flow, Mode, Numbers, Scratch, longest_step_s, slopes};
use super::structure::Structure;

/// Times nearer than this are the same, in seconds.
const SAME_S: f64 = 1e-9;
/// How far over the rim a vessel counts as full, in cm, and how much has to be missing in cm³/s until it is no longer:
/// so that one does not undo the other.
const OVER_CM: f64 = 1e-9;
const MISSING_CM3_S: f64 = 1e-9;
/// Slowest rise in cm/s for which the moment of the rim has a slope.
const SLOW_CM_S: f64 = 1e-9;

/// Inputs and time stamps of a record.
#[derive(Debug, Clone)]
pub(super) struct Moves {
    /// Time stamps in seconds, not decreasing.
    pub time_s: Vec<f64>,
    /// Of each pump the moves of its input: when, and to what. The first is the first row.
    pub inputs: Vec<Vec<(f64, f64)>>,
}

/// One run through a record.
pub(super) struct FreeRun<'a> {
    structure: &'a Structure,
    moves: &'a Moves,
    unknowns: &'a [f64],
    /// How many derivatives are carried: all or none.
    width: usize,
    numbers: Numbers,
    mode: Mode,
    scratch: Scratch,
    /// Next move of every feed.
    next: Vec<usize>,
    time_s: f64,
    /// State and slopes at both ends of a step.
    z: Vec<f64>,
    f: Vec<f64>,
    z1: Vec<f64>,
    f1: Vec<f64>,
    stage: Vec<f64>,
    k: Vec<f64>,
    sum: Vec<f64>,
    derivatives: Vec<f64>,
    row: usize,
    /// Steps taken.
    pub steps: u64,
}

impl<'a> FreeRun<'a> {
    pub fn new(structure: &'a Structure, moves: &'a Moves, unknowns: &'a [f64], sensitive: bool) -> Self {
        let n = structure.vessels.len();
        let width = if sensitive { structure.unknowns() } else { 0 };
        let numbers = Numbers::new(structure, unknowns);
        let zero = vec![0.0; n * (1 + width)];
        let feeds = structure.feeds.iter().map(|f| match f.in_air {
            Some(slot) => Flow::unknown(unknowns, slot),
            None => structure.pumps[f.pump].flow(unknowns, moves.inputs[f.pump][0].1),
        });
        let mut made = Self {
            mode: Mode { feeds: feeds.collect(), full: vec![false; n] },
            scratch: Scratch::new(structure),
            next: structure.feeds.iter().map(|f| usize::from(f.in_air.is_none())).collect(),
            time_s: moves.time_s[0],
            z: zero.clone(),
            f: zero.clone(),
            z1: zero.clone(),
            f1: zero.clone(),
            stage: zero.clone(),
            k: zero.clone(),
            sum: zero,
            derivatives: vec![0.0; width],
            row: 0,
            steps: 0,
            structure,
            moves,
            unknowns,
            width,
            numbers,
        };
        made.begin();
        made
    }

    /// Sets the initial levels; one above its rim is full.
    fn begin(&mut self) {
        let (n, p) = (self.structure.vessels.len(), self.structure.parameters);
        for i in 0..n {
            self.z[i] = self.unknowns[p + i];
            if self.z[i] < self.numbers.height[i] {
                if self.width > 0 {
                    self.z[n + i * self.width + p + i] = 1.0;
                }
            } else {
                self.mode.full[i] = true;
                self.put_at_rim(i);
            }
        }
        self.refresh();
        self.drain();
    }

    fn put_at_rim(&mut self, i: usize) {
        let (at, width) = (self.structure.vessels.len() + i * self.width, self.width);
        self.z[i] = self.numbers.height[i];
        self.z[at..at + width].fill(0.0);
        let height = &self.structure.vessels[i].height;
        if let (Some(slot), true) = (height.slot, width > 0) {
            self.z[at + slot] = height.factor;
        }
    }

    /// Slopes of the present state.
    fn refresh(&mut self) {
        let Self { structure, numbers, mode, scratch, width, z, f, .. } = self;
        slopes(structure, numbers, mode, scratch, *width, z, f);
    }

    /// Slopes of the present levels alone, in the first n numbers of `k`.
    fn refresh_levels(&mut self) {
        let n = self.structure.vessels.len();
        let Self { structure, numbers, mode, scratch, z, k, .. } = self;
        slopes(structure, numbers, mode, scratch, 0, &z[..n], &mut k[..n]);
    }

    /// Runs through the record: `visit(row, output, value, derivatives)` for every row and output.
    pub fn run(&mut self, mut visit: impl FnMut(usize, usize, f64, &[f64])) {
        let rows = self.moves.time_s.len();
        let end_s = self.moves.time_s[rows - 1];
        self.show_until(self.time_s, 0.0, &mut visit);
        while self.row < rows {
            let arrives_s = self.next_arrival_s();
            if arrives_s <= self.time_s + SAME_S {
                self.switch();
                continue;
            }
            let left_s = arrives_s.min(end_s) - self.time_s;
            let longest_s = longest_step_s(self.structure, &self.numbers, &self.z, &self.f);
            let pieces = (left_s / longest_s).ceil().clamp(1.0, 1e9);
            self.advance(left_s / pieces, &mut visit);
        }
    }

    fn arrival_s(&self, feed: usize) -> f64 {
        let spec = &self.structure.feeds[feed];
        let moved = self.moves.inputs[spec.pump].get(self.next[feed]);
        moved.map_or(f64::INFINITY, |m| m.0 + spec.delay.at(self.unknowns))
    }

    fn next_arrival_s(&self) -> f64 {
        (0..self.next.len()).map(|feed| self.arrival_s(feed)).fold(f64::INFINITY, f64::min)
    }

    /// Lets every input that arrives now take its place.
    fn switch(&mut self) {
        for feed in 0..self.next.len() {
            while self.arrival_s(feed) <= self.time_s + SAME_S {
                let spec = &self.structure.feeds[feed];
                let (_, input) = self.moves.inputs[spec.pump][self.next[feed]];
                self.next[feed] += 1;
                let flow: Flow = self.structure.pumps[spec.pump].flow(self.unknowns, input);
                self.mode.feeds[feed] = flow;
                self.refresh_levels();
                self.leave_rims();
                if let (Some(slot), true) = (spec.delay.slot, self.width > 0) {
                    let n = self.structure.vessels.len();
                    for j in 0..n {
                        self.z[n + j * self.width + slot] += spec.delay.factor * (self.f[j] - self.k[j]);
                    }
                }
                self.refresh();
            }
        }
    }

    /// Full vessels to which less comes than leaves them are so no longer; wants fresh slopes and leaves fresh ones of the
    /// levels.
    fn leave_rims(&mut self) {
        for _ in 0..self.mode.full.len() {
            let missing = |i: &usize| self.mode.full[*i] && self.scratch.excess[*i] < 0.0;
            let Some(i) = (0..self.mode.full.len()).find(missing) else { return };
            self.mode.full[i] = false;
            self.refresh_levels();
        }
    }

    fn drain(&mut self) {
        self.leave_rims();
        self.refresh();
    }

    /// One step to `z1`, of levels alone or of all.
    fn step(&mut self, h: f64, whole: bool) {
        let n = self.structure.vessels.len();
        let (width, length) = if whole { (self.width, self.z.len()) } else { (0, n) };
        let Self { structure, numbers, mode, scratch, z, f, z1, f1, stage, k, sum, .. } = self;
        let (z, f, z1, stage) = (&z[..length], &f[..length], &mut z1[..length], &mut stage[..length]);
        let (k, sum) = (&mut k[..length], &mut sum[..length]);
        sum.copy_from_slice(f);
        k.copy_from_slice(f);
        for (share, weight) in [(0.5, 2.0), (0.5, 2.0), (1.0, 1.0)] {
            for ((stage, z), k) in stage.iter_mut().zip(z).zip(&*k) {
                *stage = z + share * h * k;
            }
            slopes(structure, numbers, mode, scratch, width, stage, k);
            for (sum, k) in sum.iter_mut().zip(&*k) {
                *sum += weight * k;
            }
        }
        for ((z1, z), sum) in z1.iter_mut().zip(z).zip(&*sum) {
            *z1 = z + h / 6.0 * sum;
        }
        slopes(structure, numbers, mode, scratch, width, z1, &mut f1[..length]);
        self.steps += 1;
    }

    /// How far the vessel that is farthest over its rim is beyond it, or how much the emptiest full one lacks: above 0
    /// when the step has gone past a rim.
    fn beyond(&self) -> (f64, usize) {
        let over = |i: usize| {
            if self.mode.full[i] {
                -self.scratch.excess[i] - MISSING_CM3_S
            } else {
                self.z1[i] - self.numbers.height[i] - OVER_CM
            }
        };
        let all = (0..self.mode.full.len()).map(|i| (over(i), i));
        all.fold((f64::NEG_INFINITY, 0), |most, next| if next.0 > most.0 { next } else { most })
    }

    /// Goes on by `h` seconds, or to the first rim.
    fn advance(&mut self, h: f64, visit: &mut impl FnMut(usize, usize, f64, &[f64])) {
        self.step(h, true);
        let (beyond, _) = self.beyond();
        let at_rim = beyond > 0.0;
        let h = if at_rim { self.time_to_rim(h, beyond) } else { h };
        if at_rim {
            self.step(h, true);
        }
        let (_, vessel) = self.beyond();
        self.show_until(self.time_s + h, h, visit);
        self.time_s += h;
        std::mem::swap(&mut self.z, &mut self.z1);
        std::mem::swap(&mut self.f, &mut self.f1);
        if at_rim {
            self.pass_rim(vessel);
        }
    }

    /// Length of the step at which the first rim is passed, by bisection and the rule of false position.
    fn time_to_rim(&mut self, h: f64, beyond: f64) -> f64 {
        let (mut low, mut high) = (0.0, h);
        let (mut at_low, mut at_high) = (None, beyond);
        for round in 0..60 {
            if high - low <= 1e-12 * h.max(1e-3) || at_high <= 1e-12 {
                break;
            }
            let secant = at_low.map(|l: f64| high - at_high * (high - low) / (at_high - l));
            // A little beyond the crossing, so that the bracket closes from above.
            let middle = secant
                .filter(|_| round % 3 != 2)
                .map_or(0.5 * (low + high), |s: f64| (s + 1e-3 * (high - s)).clamp(low, high));
            self.step(middle, false);
            let (value, _) = self.beyond();
            if value > 0.0 {
                (high, at_high) = (middle, value);
            } else {
                (low, at_low) = (middle, Some(value));
            }
        }
        high
    }

    /// A vessel gets to its rim, or leaves it.
    fn pass_rim(&mut self, i: usize) {
        let n = self.structure.vessels.len();
        if self.mode.full[i] {
            self.mode.full[i] = false;
            self.refresh();
            return;
        }
        self.mode.full[i] = true;
        self.refresh_levels();
        let rises = self.f[i];
        if self.width > 0 && rises > SLOW_CM_S {
            let at = n + i * self.width;
            let height = &self.structure.vessels[i].height;
            let mut shift: Vec<f64> = self.z[at..at + self.width].iter().map(|s| -s / rises).collect();
            if let Some(slot) = height.slot {
                shift[slot] += height.factor / rises;
            }
            for j in (0..n).filter(|j| *j != i) {
                let jump = self.f[j] - self.k[j];
                let row = n + j * self.width;
                self.z[row..row + self.width].iter_mut().zip(&shift).for_each(|(s, d)| *s += jump * d);
            }
        }
        self.put_at_rim(i);
        self.refresh();
    }

    /// Shows the rows up to a time in the step of `h` seconds that ends there.
    #[inline]
    fn show_until(&mut self, end_s: f64, h: f64, visit: &mut impl FnMut(usize, usize, f64, &[f64])) {
        let n = self.structure.vessels.len();
        while let Some(&at_s) = self.moves.time_s.get(self.row).filter(|t| **t <= end_s + SAME_S) {
            let x = if h > 0.0 { ((at_s - self.time_s) / h).clamp(0.0, 1.0) } else { 0.0 };
            // A cubic through both ends with their slopes.
            let rise = x * x * (3.0 - 2.0 * x);
            let (start, end) = (h * x * (1.0 - x) * (1.0 - x), -h * x * x * (1.0 - x));
            let Self { z, f, z1, f1, derivatives, structure, unknowns, width, .. } = self;
            let read = |i: usize| {
                if h > 0.0 { z[i] + rise * (z1[i] - z[i]) + start * f[i] + end * f1[i] } else { z[i] }
            };
            for (output, gauge) in structure.gauges.iter().enumerate() {
                let (level, gain) = (read(gauge.vessel), gauge.gain.at(unknowns));
                let at = n + gauge.vessel * *width;
                for (p, d) in derivatives.iter_mut().enumerate() {
                    *d = gain * read(at + p);
                }
                if *width > 0 {
                    if let Some(slot) = gauge.gain.slot {
                        derivatives[slot] += level * gauge.gain.factor;
                    }
                    if let Some(slot) = gauge.offset.slot {
                        derivatives[slot] += gauge.offset.factor;
                    }
                }
                visit(self.row, output, gain * level + gauge.offset.at(unknowns), derivatives);
            }
            self.row += 1;
        }
    }
}
