//! A row that is as it should be, read straight from the bytes of the file, without a look at its fields first.

use super::number;
use super::read::{Kind, ReadColumn};
use super::stamp::{Stamp, StampReader};

/// What a field of a line goes to.
#[derive(Debug, Clone, Copy)]
pub(super) enum Slot {
    Column(usize),
    /// Nothing: it is always empty.
    Empty,
}

/// What a row is read into.
pub(super) struct Taken<'a> {
    pub columns: &'a mut [ReadColumn],
    pub stamps: &'a mut [StampReader],
    /// Columns whose field was empty.
    pub blanks: &'a mut Vec<usize>,
    /// Absent: blanks separate.
    pub separator: Option<u8>,
    /// Decimal mark.
    pub mark: u8,
}

/// Reads the row from `start` to `end` of `bytes`: a value to each column, or NaN and a note where its field is empty.
///
/// False for a row that needs a closer look; columns may have got values of it.
pub(super) fn quick_row(mut to: Taken, slots: &[Slot], bytes: &[u8], start: usize, end: usize) -> bool {
    let mut at = start;
    let (last, mut found) = (slots.len() - 1, false);
    for (i, slot) in slots.iter().enumerate() {
        while at < end && bytes[at] == b' ' {
            at += 1;
        }
        let Slot::Column(column) = *slot else {
            match to.pass_separator(bytes, at, end, i == last) {
                Some(next) => at = next,
                None => return false,
            }
            continue;
        };
        let Some((value, after)) = to.field(column, bytes, at, end) else { return false };
        to.columns[column].values.push(value);
        if value.is_nan() {
            to.blanks.push(column);
        } else {
            found |= to.columns[column].kind != Kind::Words;
        }
        match to.pass_separator(bytes, after, end, i == last) {
            Some(next) => at = next,
            None => return false,
        }
    }
    found
}

impl Taken<'_> {
    /// Where the next field begins; behind the last one, the end of the line.
    fn pass_separator(&self, bytes: &[u8], mut at: usize, end: usize, last: bool) -> Option<usize> {
        let from = at;
        while at < end && bytes[at] == b' ' {
            at += 1;
        }
        match self.separator {
            _ if last => (at == end).then_some(at),
            Some(separator) => (at < end && bytes[at] == separator).then_some(at + 1),
            None => (at > from && at < end).then_some(at),
        }
    }

    /// Value of the field at `at` and where it ends; NaN for an empty one.
    fn field(&mut self, column: usize, bytes: &[u8], at: usize, end: usize) -> Option<(f64, usize)> {
        if at == end || self.separator == Some(bytes[at]) {
            return self.separator.map(|_| (f64::NAN, at));
        }
        let quoted = bytes[at] == b'"';
        let kind = self.columns[column].kind;
        if kind == Kind::Number && !quoted {
            return number::scan(bytes, at, self.mark).filter(|(_, after)| *after <= end);
        }
        let (from, to, after) = if quoted {
            let close = at + 1 + memchr::memchr(b'"', &bytes[at + 1..end])?;
            (at + 1, close, close + 1)
        } else {
            let close = match self.separator {
                Some(separator) => memchr::memchr(separator, &bytes[at..end]),
                None => memchr::memchr(b' ', &bytes[at..end]),
            };
            let close = close.map_or(end, |i| at + i);
            (at, close, close)
        };
        Some((self.value(column, kind, bytes, from, to)?, after))
    }

    fn value(&mut self, column: usize, kind: Kind, bytes: &[u8], from: usize, to: usize) -> Option<f64> {
        let field = &bytes[from..to];
        // What is trimmed elsewhere is left to the closer look.
        if field.is_empty() || field[0] <= b' ' || field[field.len() - 1] <= b' ' {
            return None;
        }
        match kind {
            Kind::Number => {
                number::scan(bytes, from, self.mark).filter(|(_, after)| *after == to).map(|v| v.0)
            }
            Kind::Words => self.columns[column].known_state(field).map(f64::from),
            Kind::Full | Kind::Date | Kind::Clock => {
                let stamp = self.stamps[column].read(field)?;
                if let Stamp::Full { zone_s: Some(zone_s), .. } = stamp {
                    self.columns[column].zone_s.get_or_insert(zone_s);
                }
                Some(stamp.seconds())
            }
        }
    }
}
