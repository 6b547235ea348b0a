//! Check sums, of which Rerun's format has none: every text ends with its own, and every half minute of rows has one.
//!
//! A sum is a CRC-32. That of a text is its last line, which TOML takes for a comment, so that texts with and without
//! one are read alike. Those of rows are texts themselves, on the entity [`CHECKS`].

use std::collections::HashSet;
use std::time::{Duration, Instant};

use crc32fast::Hasher;
use serde::{Deserialize, Serialize};

/// Entity of the check sums of rows.
pub const CHECKS: &str = "checks";
/// Component of [`CHECKS`].
pub(super) const ROWS: &str = "rows";
/// Wall time between two sums.
const INTERVAL: Duration = Duration::from_secs(30);
/// Rows after which a sum is due before its time.
const MOST_ROWS: u64 = 500;
/// What stands before the sum of a text.
const MARK: &str = "# crc32 ";

fn sum(parts: &[&str]) -> String {
    let mut hasher = Hasher::new();
    for part in parts {
        hasher.update(part.as_bytes());
        hasher.update(&[0]);
    }
    format!("{MARK}{:08x}\n", hasher.finalize())
}

/// A text with its sum, which holds for what stands `beside` it as well.
pub(super) fn sealed(text: &str, beside: &[&str]) -> String {
    let mut parts = beside.to_vec();
    parts.push(text);
    format!("{text}{}", sum(&parts))
}

/// Whether a text has a sum.
pub(super) fn has_sum(text: &str) -> bool {
    text.contains(MARK)
}

/// Whether a text, and what stands beside it, is as it was written. One without a sum counts as such where the run's have
/// none (`sums`), as in recordings from before.
pub(super) fn is_whole(text: &str, beside: &[&str], sums: bool) -> bool {
    let Some(at) = text.rfind(MARK) else { return !sums };
    let (text, found) = text.split_at(at);
    let mut parts = beside.to_vec();
    parts.push(text);
    found == sum(&parts)
}

/// The sum of rows and the numbers of the events in between.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Check {
    /// Times of the first and of the last row in nanoseconds of the run.
    pub from_ns: i64,
    pub to_ns: i64,
    pub rows: u64,
    pub crc32: u32,
    /// Numbers of the first event and of the one after the last.
    pub first_event: u64,
    pub next_event: u64,
    /// Whether the run ends here.
    #[serde(default)]
    pub is_last: bool,
}

impl Check {
    /// Whether rows in order of time and events are what was summed up.
    pub fn holds<'a>(
        &self,
        time_ns: &[i64],
        row: impl Fn(usize) -> &'a [f64],
        events: &HashSet<u64>,
    ) -> bool {
        let from = time_ns.partition_point(|&t| t < self.from_ns);
        let to = time_ns.partition_point(|&t| t <= self.to_ns).max(from);
        let mut hasher = Hasher::new();
        for (at, &time_ns) in (from..to).zip(&time_ns[from..to]) {
            add_row(&mut hasher, time_ns, row(at));
        }
        let is_complete = || (self.first_event..self.next_event).all(|n| events.contains(&n));
        let rows_hold = (to - from) as u64 == self.rows && hasher.finalize() == self.crc32;
        (self.rows == 0 || rows_hold) && is_complete()
    }
}

fn add_row(hasher: &mut Hasher, time_ns: i64, row: &[f64]) {
    hasher.update(&time_ns.to_le_bytes());
    for value in row {
        // All that are no numbers are one.
        let value = if value.is_nan() { f64::NAN } else { *value };
        hasher.update(&value.to_bits().to_le_bytes());
    }
}

/// Sums rows up as they are written.
pub(super) struct Sealing {
    hasher: Hasher,
    check: Check,
    begun: Instant,
}

impl Sealing {
    pub fn new() -> Self {
        Self::after(0, 0)
    }

    /// Behind a row and an event.
    fn after(time_ns: i64, number: u64) -> Self {
        let check = Check {
            from_ns: time_ns,
            to_ns: time_ns,
            rows: 0,
            crc32: 0,
            first_event: number,
            next_event: number,
            is_last: false,
        };
        Self { hasher: Hasher::new(), check, begun: Instant::now() }
    }

    pub fn add(&mut self, time_ns: i64, row: &[f64]) {
        if self.check.rows == 0 {
            self.check.from_ns = time_ns;
        }
        self.check.to_ns = time_ns;
        self.check.rows += 1;
        add_row(&mut self.hasher, time_ns, row);
    }

    /// The number of the next event.
    pub fn number_event(&mut self) -> u64 {
        self.check.next_event += 1;
        self.check.next_event - 1
    }

    pub fn is_due(&self) -> bool {
        self.begun.elapsed() >= INTERVAL || self.check.rows >= MOST_ROWS
    }

    /// Forgets what was summed up: not all of it is in the file.
    pub fn restart(&mut self) {
        *self = Self::after(self.check.to_ns, self.check.next_event);
    }

    /// The sum so far; the next one begins. `None` where there is no row and the run goes on.
    pub fn take(&mut self, is_last: bool) -> Option<Check> {
        if self.check.rows == 0 && !is_last {
            return None;
        }
        let done = std::mem::replace(self, Self::after(self.check.to_ns, self.check.next_event));
        Some(Check { crc32: done.hasher.finalize(), is_last, ..done.check })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sealed_text_shows_every_change() {
        let text = "kc = 7.0\n";
        let sealed = sealed(text, &["words"]);
        assert!(
            is_whole(&sealed, &["words"], true) && is_whole(text, &[], false) && is_whole("", &[], false)
        );
        assert!(!is_whole(text, &[], true));
        assert!(!is_whole(&sealed, &["wordt"], true));
        assert_eq!(toml::from_str::<toml::Table>(&sealed), toml::from_str(text));
        for at in 0..text.len() {
            let mut changed = sealed.clone().into_bytes();
            changed[at] ^= 1;
            assert!(!is_whole(&String::from_utf8(changed).expect("ASCII"), &["words"], true), "{at}");
        }
    }

    #[test]
    fn a_sum_of_rows_shows_missing_and_changed_ones() {
        let rows = [[1.0, f64::NAN], [2.0, -0.5], [3.0, 0.0]];
        let time_ns = [5, 10, 15];
        let mut sealing = Sealing::new();
        assert_eq!(sealing.take(false), None);
        assert_eq!(sealing.number_event(), 0);
        for (time, row) in time_ns.iter().zip(&rows) {
            sealing.add(*time, row);
        }
        let check = sealing.take(false).expect("rows");
        let events = HashSet::from([0]);
        let holds = |time_ns: &[i64], rows: &[[f64; 2]]| check.holds(time_ns, |i| &rows[i][..], &events);
        assert!(holds(&time_ns, &rows));
        assert!(!holds(&time_ns[..2], &rows[..2]));
        assert!(!holds(&time_ns, &[[1.0, f64::NAN], [2.0, -0.25], [3.0, 0.0]]));
        assert!(!holds(&[5, 11, 15], &rows));
        assert!(!check.holds(&time_ns, |i| &rows[i][..], &HashSet::new()));
        // Rows beyond it belong to another sum.
        assert!(holds(&[1, 5, 10, 15, 20], &[[9.0; 2], rows[0], rows[1], rows[2], [9.0; 2]]));
        assert_eq!(sealing.number_event(), 1, "numbers go on");
        let last = sealing.take(true).expect("an end");
        assert!(last.is_last && last.rows == 0 && last.holds(&[], |_| &[], &HashSet::from([0, 1])));
    }
}
