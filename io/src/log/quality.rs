//! Columns that say of each value beside them whether it is good: `TIC101.PV, Quality`.

use super::Repair;
use super::pivot::{OPC_GOOD, good_rows, is_bad, is_quality_name, normal};
use super::read::{Kind, Read, ReadColumn};

/// Words that only a quality begins with, and others that are known beside bad ones.
const CERTAIN: [&str; 3] = ["good", "valid", "gut"];
const OTHERS: [&str; 6] = ["ok", "true", "uncertain", "questionable", "substituted", "yes"];
/// Endings of names behind that of their value: `TIC101.PV Status`.
const ENDINGS: [&str; 4] = ["status", "stat", "qual", "st"];

/// Makes missing values of those that the column beside them calls bad, and says so.
pub(super) fn take_out(read: &mut Read, repairs: &mut Vec<Repair>) {
    let columns = &read.columns;
    let found: Vec<(usize, usize)> = (0..columns.len())
        .filter(|&i| is_quality(&columns[i]))
        .filter_map(|i| value_of(columns, i).map(|value| (i, value)))
        .collect();
    for (quality, value) in found {
        let good = good_rows(&read.columns[quality]);
        let values = &mut read.columns[value].values;
        let bad: Vec<usize> =
            (0..values.len()).filter(|&row| !good[row] && values[row].is_finite()).collect();
        bad.iter().for_each(|&row| values[row] = f64::NAN);
        if let Some(&first) = bad.first() {
            let column = read.columns[quality].name.clone();
            repairs.push(Repair::BadQuality { column, count: bad.len(), line: read.line(first) });
        }
    }
}

/// Words of a quality alone and one that is bad among them, or numbers under the name of one, as OPC counts.
fn is_quality(column: &ReadColumn) -> bool {
    let last = last_word(&column.name);
    match column.kind {
        Kind::Words => {
            let begins =
                |words: &[&str], state: &str| words.iter().any(|w| state.to_lowercase().starts_with(w));
            let bad = column.states.iter().any(|s| is_bad(s));
            let good = column.states.iter().any(|s| begins(&CERTAIN, s));
            let named = is_quality_name(last) || good || ENDINGS.contains(&normal(last).as_str());
            bad && named
                && column.states.iter().all(|s| is_bad(s) || begins(&CERTAIN, s) || begins(&OTHERS, s))
        }
        // A lone Q is heat or a flow.
        Kind::Number => {
            is_quality_name(last) && (last.len() > 1 || last.len() < column.name.len()) && is_opc(column)
        }
        _ => false,
    }
}

/// Whether numbers are qualities of OPC: eight bits, and mostly good.
fn is_opc(column: &ReadColumn) -> bool {
    let known = || column.values.iter().filter(|v| v.is_finite());
    let good = known().filter(|v| **v >= OPC_GOOD).count();
    2 * good > known().count() && known().all(|v| v.fract() == 0.0 && (0.0..256.0).contains(v))
}

fn last_word(name: &str) -> &str {
    let name = super::pairs::base(name);
    name.rsplit([' ', '.', '_', '/', ':', '-']).next().unwrap_or(name)
}

/// The column that a quality speaks of: the one whose name begins its own, else the one ahead of it, else the one behind.
fn value_of(columns: &[ReadColumn], quality: usize) -> Option<usize> {
    let is_value = |i: usize| {
        columns
            .get(i)
            .is_some_and(|c| c.kind == Kind::Number && !is_quality(c) && !super::axis::is_time_name(&c.name))
    };
    let name = &columns[quality].name;
    let last = last_word(name);
    let is_known = is_quality_name(last) || ENDINGS.contains(&normal(last).as_str());
    let stem = name.strip_suffix(last).map(|stem| stem.trim_end_matches([' ', '.', '_', '/', ':', '-']));
    let stem = stem.filter(|stem| is_known && !stem.is_empty());
    let begins = |i: &usize| stem.is_some_and(|stem| columns[*i].name.starts_with(stem));
    let named: Vec<usize> = (0..columns.len()).filter(|&i| is_value(i)).filter(begins).collect();
    let exact = stem.and_then(|stem| named.iter().copied().find(|&i| columns[i].name == stem));
    let beside = || {
        let ahead = quality.checked_sub(1).filter(|&i| is_value(i));
        ahead.or_else(|| Some(quality + 1).filter(|&i| is_value(i)))
    };
    match (exact, &named[..]) {
        (Some(exact), _) => Some(exact),
        (None, [only]) => Some(*only),
        (None, [_, ..]) => beside().filter(|i| named.contains(i)),
        (None, []) => beside(),
    }
}
