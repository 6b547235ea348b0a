//! Numbers that stand for none: -9999, -999.25, 1e38 and their like, as historians, loggers and archives of wells and
//! weather write them.
//!
//! One of them is taken as missing only where it lies far outside all other values of its column: a column that really
//! runs to -9999 keeps its numbers.

use super::Repair;
use super::read::{Kind, ReadColumn};

/// Numbers below all measurements; -999.25 is that of the LAS files of wells.
const BELOW: [f64; 5] = [-999.0, -999.25, -9999.0, -9999.25, -99_999.0];
/// Numbers that may as well be counts, the ends of 16 bits among them.
const ENDS: [f64; 5] = [9999.0, 99_999.0, 999_999.0, 32_767.0, -32_768.0];
/// The nearest to zero of either sign.
const NEAREST: [f64; 2] = [-999.0, 9999.0];
/// No plant measures so much; what it measures beside that is below `MEASURED`.
const HUGE: f64 = 1e30;
const MEASURED: f64 = 1e15;
/// Distance from all other values, in ranges of these: of numbers below zero beside values above it, below others, of
/// those that may be counts.
const APART: [f64; 3] = [0.3, 1.0, 10.0];
/// The range of values that hold still, as a share of them.
const STILL: f64 = 0.1;
/// Other values that a column needs.
const FEWEST: usize = 3;

/// What a column holds beside numbers that may stand for none.
#[derive(Debug, Clone, Copy)]
struct Rest {
    low: f64,
    high: f64,
    count: usize,
}

/// Makes missing values of numbers that stand for none, and says so.
pub(super) fn take_out(column: &mut ReadColumn, lines: &[u32], repairs: &mut Vec<Repair>) {
    if column.kind != Kind::Number || lies_within(&column.values, NEAREST) {
        return;
    }
    let rest = extent(&column.values, |v| !is_candidate(v));
    if rest.count < FEWEST {
        return;
    }
    let mut found: Vec<(f64, usize, usize)> = Vec::new();
    for (row, value) in column.values.iter_mut().enumerate() {
        if !is_candidate(*value) || !stands_for_none(*value, rest) {
            continue;
        }
        match found.iter_mut().find(|f| f.0 == *value) {
            Some(known) => known.1 += 1,
            None => found.push((*value, 1, row)),
        }
        *value = f64::NAN;
    }
    repairs.extend(found.into_iter().map(|(value, count, row)| Repair::StandIns {
        column: column.name.clone(),
        count,
        line: lines.get(row).map_or(0, |line| *line as usize),
        value,
    }));
}

/// Whether all values lie between two others; without a branch, as it looks at every number of a log.
fn lies_within(values: &[f64], [low, high]: [f64; 2]) -> bool {
    values.chunks(4096).all(|chunk| !chunk.iter().fold(false, |out, &v| out | (v <= low) | (v >= high)))
}

fn extent(values: &[f64], of: impl Fn(f64) -> bool) -> Rest {
    let mut rest = Rest { low: f64::INFINITY, high: f64::NEG_INFINITY, count: 0 };
    for &v in values.iter().filter(|v| v.is_finite() && of(**v)) {
        rest.low = rest.low.min(v);
        rest.high = rest.high.max(v);
        rest.count += 1;
    }
    rest
}

fn is_candidate(value: f64) -> bool {
    value.abs() >= HUGE || BELOW.contains(&value) || ENDS.contains(&value)
}

fn stands_for_none(value: f64, rest: Rest) -> bool {
    let largest = rest.low.abs().max(rest.high.abs());
    if value.abs() >= HUGE {
        return largest < MEASURED;
    }
    let range = (rest.high - rest.low).max(STILL * largest);
    let distance = (rest.low - value).max(value - rest.high);
    let apart = match () {
        () if ENDS.contains(&value) => APART[2],
        () if rest.low >= 0.0 => APART[0],
        () => APART[1],
    };
    distance > apart * range
}
