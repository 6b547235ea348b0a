//! From which row on the PV of a stretch follows from moves of the MV that the log holds.
//!
//! At time t the PV answers the MV up to t − L. A free state stands for all that came before a segment, except for the
//! moves of the L seconds ahead of it, which arrive only later: rows within L of a segment's start answer an MV that
//! nobody logged. Counted with that MV held at its first value, they pull the fit and its intervals off the truth.

use std::borrow::Cow;
use std::ops::Range;

use super::problem::{Other, Stretch};
use super::statistics::mean;

/// Fits on rows that a new dead time takes or leaves; the first moves it most.
const ROUNDS: usize = 3;
/// The least part of the rows that has to be left for a fit to be made on them.
const LEAST: f64 = 0.25;
/// Fewest rows of a fit.
const ROWS: usize = 10;

/// Rows of the inputs ahead of a stretch; no PV of theirs counts.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct History<'a> {
    /// Time stamps in seconds, not decreasing, none after the stretch's first.
    pub time_s: Cow<'a, [f64]>,
    /// MV, one of each a stamp.
    pub mv: Cow<'a, [f64]>,
    /// The disturbances of the problem in their order, one of each a stamp.
    pub disturbances: Vec<Cow<'a, [f64]>>,
}

impl<'a> History<'a> {
    /// The same columns, borrowed.
    #[must_use]
    pub fn borrowed(&self) -> History<'_> {
        History {
            time_s: Cow::Borrowed(&self.time_s),
            mv: Cow::Borrowed(&self.mv),
            disturbances: self.disturbances.iter().map(|values| Cow::Borrowed(&**values)).collect(),
        }
    }

    fn is_finite(&self, row: usize) -> bool {
        std::iter::once(&self.mv).chain(&self.disturbances).all(|column| column[row].is_finite())
    }

    /// The same with its MV within limits.
    pub(super) fn within(&self, [low, high]: [f64; 2]) -> Self {
        let mv = self.mv.iter().map(|u| u.clamp(low, high)).collect();
        Self { mv: Cow::Owned(mv), ..self.clone() }
    }

    /// The same with every MV one row earlier; `next` is that of the first row behind it.
    pub(super) fn one_row_earlier(&self, next: f64) -> Self {
        let mv = self.mv.iter().skip(1).copied().chain(std::iter::once(next)).collect();
        Self { mv, ..self.clone() }
    }

    /// Whether the MV moves within so many seconds ahead of a time.
    pub(super) fn moves_within(&self, span_s: f64, end_s: f64) -> bool {
        let first = self.time_s.partition_point(|t| *t < end_s - span_s);
        self.mv[first.min(self.mv.len())..].windows(2).any(|w| w[0] != w[1])
    }

    /// Whether it can go ahead of a stretch with so many disturbances that starts then.
    pub(super) fn fits(&self, others: usize, start_s: f64) -> bool {
        let rows = self.time_s.len();
        let columns = || std::iter::once(&self.mv).chain(&self.disturbances);
        rows > 0
            && self.disturbances.len() == others
            && columns().all(|c| c.len() == rows)
            && self.time_s.windows(2).all(|w| w[0] <= w[1])
            && self.time_s[rows - 1] <= start_s
    }
}

impl<'a> Stretch<'a> {
    /// Rows of segment `s` whose PV may count.
    pub fn known(&self, s: usize) -> Range<usize> {
        let rows = self.segment(s);
        rows.start + self.unknown.get(s).copied().unwrap_or(0)..rows.end
    }

    /// Number of the segments that have such rows.
    pub fn live_segments(&self) -> usize {
        (0..self.segments.len()).filter(|s| !self.known(*s).is_empty()).count()
    }

    /// Whether the state at the start of a segment is estimated.
    pub fn is_free(&self, segment: usize) -> bool {
        segment > 0 || !self.at_rest
    }

    /// Whether that of any is.
    pub fn has_free(&self) -> bool {
        !self.at_rest || self.segments.len() > 1
    }

    /// How long an input stands still from the first row on, in seconds.
    pub fn rests_s(&self, input: usize) -> f64 {
        let values = self.input(input).values;
        let moved = values.iter().position(|v| *v != values[0]).unwrap_or(values.len() - 1);
        self.t[moved] - self.t[0]
    }

    /// Whether every row answers an MV that is known.
    fn is_all_known(&self) -> bool {
        self.segments.len() == 1 && (self.at_rest || self.mv_before_told)
    }

    /// The stretch without the rows within `reach_s` of the start of a segment whose past is not known, behind as much
    /// of its history as that takes. `None` where that leaves too little.
    pub fn known_after(&self, reach_s: f64) -> Option<Self> {
        if self.is_all_known() {
            return None;
        }
        let mut out = self.with_history(reach_s);
        let slack_s = 1e-9 * out.sample_time_s;
        let unknown = (0..out.segments.len()).map(|s| {
            let rows = out.segment(s);
            let told = s == 0 && (out.at_rest || out.mv_before_told);
            let reached = if told { f64::NEG_INFINITY } else { out.t[rows.start] + reach_s - slack_s };
            let ahead = rows.clone().take_while(|&k| out.t[k] < reached).count();
            let history = if s == 0 { out.history } else { 0 };
            ahead.max(history)
        });
        out.unknown = unknown.collect();
        let kept = out.kept();
        if kept < ROWS || (kept as f64) < LEAST * self.kept() as f64 {
            return None;
        }
        out.y_ref = out.mean_of_kept();
        Some(out)
    }

    /// Whether it leaves out all that another copy of the same stretch does, and next to nothing besides.
    fn is_enough(&self, needed: &Self) -> bool {
        /// Part of the rows that may be left out in vain.
        const IN_VAIN: f64 = 0.01;
        let from = |s: &Self, i: usize| s.known(i).start as isize - s.history as isize;
        self.history >= needed.history
            && (0..needed.segments.len()).all(|i| from(self, i) >= from(needed, i))
            && self.kept() as f64 >= (1.0 - IN_VAIN) * needed.kept() as f64
    }

    /// As much of the history ahead of the rows as reaches that far back.
    fn with_history(&self, reach_s: f64) -> Self {
        let plain = || self.clone();
        if self.at_rest || self.mv_before_told {
            return plain();
        }
        let Some(past) = &self.past else { return plain() };
        let start_s = self.t[0];
        let gap_s = self.gap_s();
        let rows = past.time_s.len();
        // Back from the last row to a gap, a row without a number, or the row whose MV is in force at the reach's far end.
        let mut first = rows;
        let mut next_s = start_s;
        while first > 0
            && next_s > start_s - reach_s
            && next_s - past.time_s[first - 1] <= gap_s
            && past.is_finite(first - 1)
        {
            first -= 1;
            next_s = past.time_s[first];
        }
        if first == rows {
            return plain();
        }
        let joined = |ahead: &[f64], rows: &[f64]| -> Cow<'a, [f64]> {
            Cow::Owned(ahead[first..].iter().chain(rows).copied().collect())
        };
        let count = rows - first;
        let y: Vec<f64> = std::iter::repeat_n(self.y[0], count).chain(self.y.iter().copied()).collect();
        let u = joined(&past.mv, &self.u);
        let u_before = u[0];
        let mut out = Self::new(joined(&past.time_s, &self.t), u, y.into(), u_before, true);
        (out.u_ref, out.y_ref, out.origin_s) = (self.u_ref, self.y_ref, self.origin_s);
        let others = self.others.iter().zip(&past.disturbances);
        out.others = others.map(|(o, ahead)| Other::new(joined(ahead, &o.values))).collect();
        out.keep = self
            .keep
            .as_ref()
            .map(|keep| std::iter::repeat_n(false, count).chain(keep.iter().copied()).collect());
        out.history = count;
        out
    }

    /// One value for each row of the problem out of one for each row here: without those of the history, and ahead of the
    /// rows that are known the value of the first that is.
    pub fn filled_back(&self, mut values: Vec<f64>) -> Vec<f64> {
        for s in 0..self.segments.len() {
            let (rows, known) = (self.segment(s), self.known(s));
            let value = if known.is_empty() { self.y_ref } else { values[known.start] };
            values[rows.start..known.start].fill(value);
        }
        values.drain(..self.history);
        values
    }

    /// Mean PV of the rows that count.
    fn mean_of_kept(&self) -> f64 {
        if self.keep.is_none() && self.segments.len() == 1 {
            return mean(&self.y[self.known(0)]);
        }
        let kept: Vec<f64> = self.kept_rows().map(|k| self.y[k]).collect();
        mean(&kept)
    }

    /// The rows that count.
    pub fn kept_rows(&self) -> impl Iterator<Item = usize> + '_ {
        let known = (0..self.segments.len()).flat_map(|s| self.known(s));
        known.filter(|&k| self.keep.as_ref().is_none_or(|keep| keep[k]))
    }
}

/// How far back a fit looks whose dead time and its standard error these are, with and without room for doubt.
pub(super) fn reach_s(dead_time_s: f64, error_s: f64) -> [f64; 2] {
    [if error_s.is_finite() { dead_time_s + error_s } else { dead_time_s }, dead_time_s]
}

/// Fits again on the rows that moves of the log explain, until the dead time moves them no more; with the stretch of the
/// last fit. `here` is that of the first; `reaches_s` gives how far back a fit looks, first with and then without room for
/// doubt.
pub(super) fn settled<'a, F>(
    stretch: &Stretch<'a>,
    here: Stretch<'a>,
    first: F,
    reaches_s: impl Fn(&F) -> [f64; 2],
    mut refit: impl FnMut(&Stretch<'a>, &F) -> Option<F>,
) -> (Stretch<'a>, F) {
    let (mut here, mut fit) = (here, first);
    for _ in 0..ROUNDS {
        let [with_room, without] = reaches_s(&fit);
        let next = stretch.known_after(with_room).or_else(|| stretch.known_after(without));
        let Some(next) = next.filter(|next| !here.is_enough(next)) else { break };
        let Some(again) = refit(&next, &fit) else { break };
        (here, fit) = (next, again);
    }
    (here, fit)
}
