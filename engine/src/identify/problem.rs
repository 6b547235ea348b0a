//! What is to be fitted: a stretch of data, checked once and thinned out for the start.

use std::borrow::Cow;

use super::FitError;
use super::known::History;
use super::statistics::{is_even, mean, summed};

/// Fewest rows a fit accepts: the model has five unknowns.
const MIN_ROWS: usize = 10;
/// A gap longer than this many sample times starts a segment with a free state.
const GAP_SAMPLES: f64 = 3.0;
/// Sizes of a column whose sums of squares, and differences of them, stay within what a number can hold.
const SIZES: std::ops::RangeInclusive<f64> = 1e-100..=1e100;
/// Stamps this close to an even grid, in sample times, are taken to lie on it.
const UNIFORM_TOLERANCE: f64 = 1e-7;

/// What is known of the state before the first row.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum InitialState {
    /// Unknown: estimated along, once for each segment.
    #[default]
    Free,
    /// At rest with the MV before the first row. Taken by itself where the MV never moves after it.
    Rest,
}

/// Whether a slow drift of the PV that goes with no input is fitted along.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Drift {
    /// None.
    #[default]
    None,
    /// A straight line.
    Linear,
    /// A straight line where it explains far more than chance would.
    Auto,
}

/// Whether it is looked for something unmeasured that moved the PV once and for all.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Loads {
    /// No.
    #[default]
    None,
    /// Steps, up to three, where each explains far more than chance would.
    Auto,
}

/// What the user may say about a stretch besides its columns.
#[derive(Debug, Clone, PartialEq)]
pub struct FitOptions {
    /// MV before the first row, in MV units; absent: that of the first row.
    pub mv_before: Option<f64>,
    /// What is known of the state before the first row.
    pub initial_state: InitialState,
    /// Slow drift of the PV.
    pub drift: Drift,
    /// Steps of something unmeasured.
    pub loads: Loads,
    /// Name of the time column, for messages.
    pub time_name: String,
    /// Name of the PV column, for messages.
    pub pv_name: String,
    /// Name of the MV column, for messages.
    pub mv_name: String,
    /// Number of the first row as the user counts, for messages.
    pub first_row: usize,
}

impl Default for FitOptions {
    fn default() -> Self {
        Self {
            mv_before: None,
            initial_state: InitialState::Free,
            drift: Drift::None,
            loads: Loads::None,
            time_name: "time".to_owned(),
            pv_name: "PV".to_owned(),
            mv_name: "MV".to_owned(),
            first_row: 1,
        }
    }
}

/// A stretch of data to fit: one MV to one PV, three columns of one length N ≥ 10.
#[derive(Debug, Clone)]
pub struct FitProblem<'a> {
    /// Time stamps in seconds, not decreasing; any start.
    pub time_s: &'a [f64],
    /// Process variable, measured just before its stamp, in PV units.
    pub pv: &'a [f64],
    /// Manipulated variable, applied from its stamp until the next, in MV units.
    pub mv: &'a [f64],
    /// What else is known.
    pub options: FitOptions,
    /// Measured disturbances: further inputs of the same PV, each of N rows.
    pub disturbances: Vec<Disturbance<'a>>,
    /// Rows whose PV counts; absent: all. The MV of the others holds all the same.
    pub keep: Option<Cow<'a, [bool]>>,
    /// The inputs ahead of the first row, where the stretch was cut out of a longer log; of no use with
    /// [`FitOptions::mv_before`].
    pub history: Option<History<'a>>,
}

/// Another input of the PV, with its own dynamics.
#[derive(Debug, Clone)]
pub struct Disturbance<'a> {
    /// Name of the column.
    pub name: String,
    /// Values, applied from their stamp until the next, in their own units.
    pub values: &'a [f64],
}

impl<'a> FitProblem<'a> {
    /// A stretch with default options.
    #[must_use]
    pub fn new(time_s: &'a [f64], pv: &'a [f64], mv: &'a [f64]) -> Self {
        Self {
            time_s,
            pv,
            mv,
            options: FitOptions::default(),
            disturbances: vec![],
            keep: None,
            history: None,
        }
    }

    /// Checks the columns and finds the sample time and the segments.
    pub(super) fn stretch(&self) -> Result<Stretch<'a>, FitError> {
        self.check_columns()?;
        let o = &self.options;
        let names = || (o.pv_name.clone(), o.mv_name.clone());
        if self.time_s.len() < MIN_ROWS {
            return Err(FitError::TooFewSamples { rows: self.time_s.len(), needed: MIN_ROWS });
        }
        if let Some(value) = o.mv_before.filter(|v| !v.is_finite()) {
            return Err(FitError::MvBefore { column: o.mv_name.clone(), value });
        }
        let mv_still = is_constant(self.mv);
        if is_constant(self.pv) {
            return Err(FitError::ConstantPv { column: o.pv_name.clone(), value: self.pv[0] });
        }
        let u_before = o.mv_before.unwrap_or(self.mv[0]);
        if mv_still && u_before == self.mv[0] {
            let (pv_name, mv_name) = names();
            return Err(if o.mv_before.is_some() {
                FitError::ConstantMv { column: mv_name, value: u_before }
            } else {
                FitError::NeedsMvBefore { pv_name, mv_name, value: u_before }
            });
        }
        if self.pv == self.mv {
            let (pv_name, mv_name) = names();
            return Err(FitError::SameColumn { pv_name, mv_name });
        }
        let free = o.initial_state == InitialState::Free && !mv_still;
        let mut stretch = Stretch::new(self.time_s.into(), self.mv.into(), self.pv.into(), u_before, free);
        stretch.others = self.disturbances.iter().map(|d| Other::new(d.values.into())).collect();
        stretch.mv_before_told = o.mv_before.is_some();
        let usable = |h: &&History<'a>| h.fits(self.disturbances.len(), self.time_s[0]);
        stretch.past = self.history.as_ref().filter(usable).cloned();
        if let Some(keep) = self.keep.clone().filter(|keep| keep.len() == stretch.len()) {
            stretch.keep_only(keep);
        }
        if stretch.kept() < MIN_ROWS {
            return Err(FitError::TooFewSamples { rows: stretch.kept(), needed: MIN_ROWS });
        }
        Ok(stretch)
    }

    /// Checks lengths, numbers and the order of time.
    pub(super) fn check_columns(&self) -> Result<(), FitError> {
        let o = &self.options;
        let rows = self.time_s.len();
        if self.pv.len() != rows || self.mv.len() != rows {
            return Err(FitError::LengthMismatch {
                time: rows,
                pv: self.pv.len(),
                mv: self.mv.len(),
                pv_name: o.pv_name.clone(),
                mv_name: o.mv_name.clone(),
            });
        }
        let others = self.disturbances.iter().map(|d| (&d.name, d.values));
        if let Some(other) = self.disturbances.iter().find(|d| d.values.len() != rows) {
            return Err(FitError::LengthMismatch {
                time: rows,
                pv: self.pv.len(),
                mv: other.values.len(),
                pv_name: o.pv_name.clone(),
                mv_name: other.name.clone(),
            });
        }
        let columns = [(&o.time_name, self.time_s), (&o.pv_name, self.pv), (&o.mv_name, self.mv)];
        for (column, values) in columns.into_iter().chain(others) {
            if let Some(i) = first_not_finite(values) {
                return Err(FitError::NotFinite {
                    column: column.clone(),
                    row: o.first_row + i,
                    value: values[i],
                });
            }
        }
        let measured = [(&o.pv_name, self.pv), (&o.mv_name, self.mv)];
        for (column, values) in
            measured.into_iter().chain(self.disturbances.iter().map(|d| (&d.name, d.values)))
        {
            let size = largest(values);
            if size != 0.0 && !SIZES.contains(&size) {
                return Err(FitError::OutOfScale { column: column.clone(), size });
            }
        }
        if let Some(i) = self.time_s.windows(2).position(|w| w[1] < w[0]) {
            return Err(FitError::TimeBackwards {
                column: o.time_name.clone(),
                row: o.first_row + i + 1,
                from_s: self.time_s[i],
                to_s: self.time_s[i + 1],
            });
        }
        if rows > 0 && self.time_s[rows - 1] <= self.time_s[0] {
            return Err(FitError::NoTimeSpan { column: o.time_name.clone() });
        }
        Ok(())
    }
}

/// Size of the largest value, in eight lanes.
fn largest(values: &[f64]) -> f64 {
    let mut lanes = [0.0_f64; 8];
    let chunks = values.chunks_exact(8);
    let rest = chunks.remainder().iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    for chunk in chunks {
        for (lane, value) in lanes.iter_mut().zip(chunk) {
            *lane = lane.max(value.abs());
        }
    }
    lanes.into_iter().fold(rest, f64::max)
}

fn is_constant(values: &[f64]) -> bool {
    values.iter().all(|&v| v == values[0])
}

fn first_not_finite(values: &[f64]) -> Option<usize> {
    // A sum is finite only when every term is, bar an overflow, which the search then finds harmless.
    let clean = summed(values, |v| v * 0.0) == 0.0;
    if clean { None } else { values.iter().position(|v| !v.is_finite()) }
}

/// A validated stretch, or a thinned-out copy of one.
#[derive(Debug, Clone)]
pub(super) struct Stretch<'a> {
    /// Time stamps in seconds.
    pub t: Cow<'a, [f64]>,
    /// MV.
    pub u: Cow<'a, [f64]>,
    /// PV.
    pub y: Cow<'a, [f64]>,
    /// MV before the first row.
    pub u_before: f64,
    /// Value taken off the MV: its mean.
    pub u_ref: f64,
    /// Value taken off the PV: its mean.
    pub y_ref: f64,
    /// Typical time between rows, in seconds; > 0.
    pub sample_time_s: f64,
    /// Whether all rows lie on an even grid of that sample time.
    pub uniform: bool,
    /// First row of each segment; the first is 0.
    pub segments: Vec<usize>,
    /// Rows at the start of each segment whose PV answers an MV that is not known; none where absent.
    pub unknown: Vec<usize>,
    /// Whether the first segment starts at rest; the state of every other is estimated.
    pub at_rest: bool,
    /// Whether `u_before` is what the user says, not a guess.
    pub mv_before_told: bool,
    /// Inputs ahead of the first row.
    pub past: Option<History<'a>>,
    /// How many of the rows are history.
    pub history: usize,
    /// Further inputs.
    pub others: Vec<Other<'a>>,
    /// Rows whose PV counts; absent: all.
    pub keep: Option<Cow<'a, [bool]>>,
    /// Stamp of the problem's first row, in seconds: times of loads count from here.
    pub origin_s: f64,
}

/// A further input with the values it is centred with.
#[derive(Debug, Clone)]
pub(super) struct Other<'a> {
    pub values: Cow<'a, [f64]>,
    pub before: f64,
    pub reference: f64,
}

impl<'a> Other<'a> {
    pub fn new(values: Cow<'a, [f64]>) -> Self {
        Self { before: values[0], reference: mean(&values), values }
    }
}

/// An input as a pass reads it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Input<'a> {
    pub values: &'a [f64],
    /// Value before the first row.
    pub before: f64,
    /// Value taken off.
    pub reference: f64,
}

impl Input<'_> {
    /// Value of a row, `None` for the time before the first, less the reference.
    pub fn centred(&self, row: Option<usize>) -> f64 {
        row.map_or(self.before, |k| self.values[k]) - self.reference
    }
}

impl<'a> Stretch<'a> {
    pub fn new(t: Cow<'a, [f64]>, u: Cow<'a, [f64]>, y: Cow<'a, [f64]>, u_before: f64, free: bool) -> Self {
        let rows = t.len();
        let even = (t[rows - 1] - t[0]) / (rows - 1) as f64;
        let tolerance = UNIFORM_TOLERANCE * even;
        let uniform = is_even(&t, even, tolerance);
        let sample_time_s = if uniform { even } else { typical_step(&t, even) };
        let mut segments = vec![0];
        if !uniform {
            let gap_s = gap_s(sample_time_s);
            segments.extend((1..rows).filter(|&k| t[k] - t[k - 1] > gap_s));
            if segments.len() > rows / MIN_ROWS {
                // Rows this scattered have no sample time to speak of: one segment, exact stamps.
                segments.truncate(1);
            }
        }
        let (u_ref, y_ref) = (mean(&u), mean(&y));
        Self {
            origin_s: t[0],
            t,
            u,
            y,
            u_before,
            u_ref,
            y_ref,
            sample_time_s,
            uniform,
            segments,
            unknown: vec![],
            at_rest: !free,
            mv_before_told: false,
            past: None,
            history: 0,
            others: vec![],
            keep: None,
        }
    }

    /// Longest time between two rows of one segment, in seconds.
    pub fn gap_s(&self) -> f64 {
        gap_s(self.sample_time_s)
    }

    /// Lets only the rows marked with `true` count.
    pub fn keep_only(&mut self, keep: Cow<'a, [bool]>) {
        let kept = keep.iter().filter(|k| **k).count();
        let sum: f64 = self.y.iter().zip(keep.iter()).map(|(y, k)| if *k { *y } else { 0.0 }).sum();
        self.y_ref = sum / kept.max(1) as f64;
        self.keep = (kept < keep.len()).then_some(keep);
    }

    /// Rows that count.
    pub fn kept(&self) -> usize {
        let known = (0..self.segments.len()).map(|s| self.known(s));
        match &self.keep {
            None => known.map(|rows| rows.len()).sum(),
            Some(keep) => known.map(|rows| keep[rows].iter().filter(|k| **k).count()).sum(),
        }
    }

    /// Whether a row may count, be it known or not.
    pub fn is_kept(&self, row: usize) -> bool {
        self.keep.as_ref().is_none_or(|keep| keep[row])
    }

    /// The MV as input 0, then the others.
    pub fn input(&self, i: usize) -> Input<'_> {
        match i.checked_sub(1) {
            None => Input { values: &self.u, before: self.u_before, reference: self.u_ref },
            Some(i) => {
                let other = &self.others[i];
                Input { values: &other.values, before: other.before, reference: other.reference }
            }
        }
    }

    /// Rows.
    pub fn len(&self) -> usize {
        self.t.len()
    }

    /// From the first to the last stamp, in seconds.
    pub fn span_s(&self) -> f64 {
        self.t[self.len() - 1] - self.t[0]
    }

    /// Rows of segment `s`.
    pub fn segment(&self, s: usize) -> std::ops::Range<usize> {
        self.segments[s]..self.segments.get(s + 1).copied().unwrap_or(self.len())
    }

    /// Number of unknowns of the FOPDT model on this stretch.
    pub fn unknowns(&self) -> usize {
        4 + self.live_segments() - usize::from(self.at_rest)
    }

    /// A copy with one row for each `factor`: the MV's mean from that row to the next, the PV's mean around it.
    /// Good for a start: dynamics slower than `factor` samples survive.
    pub fn thinned(&self, factor: usize) -> Stretch<'static> {
        let rows = self.len() / factor + self.segments.len();
        let (mut t, mut u, mut y) =
            (Vec::with_capacity(rows), Vec::with_capacity(rows), Vec::with_capacity(rows));
        let mut others = vec![Vec::with_capacity(rows); self.others.len()];
        let mut keep = Vec::with_capacity(rows);
        for s in 0..self.segments.len() {
            let range = self.segment(s);
            for first in range.clone().step_by(factor) {
                let next = (first + factor).min(range.end);
                let half = (factor / 2).min(first - range.start).min(range.end - 1 - first);
                t.push(self.t[first]);
                u.push(self.held_mean(&self.u, first, next));
                for (other, values) in others.iter_mut().zip(&self.others) {
                    other.push(self.held_mean(&values.values, first, next));
                }
                let around = first - half..=first + half;
                if self.keep.is_none() {
                    y.push(mean(&self.y[around]));
                } else {
                    let kept: Vec<f64> = around.filter(|&k| self.is_kept(k)).map(|k| self.y[k]).collect();
                    keep.push(!kept.is_empty());
                    y.push(if kept.is_empty() { self.y_ref } else { mean(&kept) });
                }
            }
        }
        let mut copy = Stretch::new(t.into(), u.into(), y.into(), self.u_before, !self.at_rest);
        copy.origin_s = self.origin_s;
        copy.others = others
            .into_iter()
            .zip(&self.others)
            .map(|(values, other)| Other { before: other.before, ..Other::new(values.into()) })
            .collect();
        if self.keep.is_some() {
            copy.keep_only(keep.into());
        }
        if self.unknown.iter().any(|rows| *rows > 0) && copy.segments.len() == self.segments.len() {
            copy.unknown = self.unknown.iter().map(|rows| rows.div_ceil(factor)).collect();
        }
        copy
    }

    fn held_mean(&self, values: &[f64], first: usize, next: usize) -> f64 {
        if self.uniform {
            return mean(&values[first..next]);
        }
        let last = next.min(self.len() - 1);
        let length = self.t[last] - self.t[first];
        if length <= 0.0 {
            return mean(&values[first..next]);
        }
        (first..last).map(|k| values[k] * (self.t[k + 1] - self.t[k])).sum::<f64>() / length
    }
}

fn gap_s(sample_time_s: f64) -> f64 {
    GAP_SAMPLES * sample_time_s * (1.0 + UNIFORM_TOLERANCE)
}

/// Median of the positive steps; of a sample of them when there are many.
fn typical_step(t: &[f64], fallback: f64) -> f64 {
    let stride = t.len() / 4096 + 1;
    let mut steps: Vec<f64> = (1..t.len()).step_by(stride).map(|k| t[k] - t[k - 1]).collect();
    steps.retain(|&step| step > 0.0);
    if steps.is_empty() {
        return fallback;
    }
    let middle = steps.len() / 2;
    *steps.select_nth_unstable_by(middle, f64::total_cmp).1
}
