//! Columns that say of each value beside them whether it is good: `TIC101.PV, Quality`.

use super::Repair;
use super::pivot::{good_rows, is_bad, is_quality_name, normal};
use super::read::{Kind, Read, ReadColumn};

/// Words that a quality begins with, beside those that [`is_bad`] knows.
const OTHERS: [&str; 9] =
    ["good", "ok", "valid", "true", "uncertain", "questionable", "substituted", "bom", "gut"];
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
    match column.kind {
        Kind::Words => {
            let other = |word: &str| OTHERS.iter().any(|o| word.to_lowercase().starts_with(o));
            let is_flag = |word: &str| ["true", "false", "no"].contains(&word.to_lowercase().as_str());
            let bad = column.states.iter().filter(|s| is_bad(s)).count();
            let flags = column.states.iter().any(|s| is_flag(s));
            bad > 0
                && column.states.iter().all(|s| is_bad(s) || other(s))
                && (!flags || is_quality_name(last_word(&column.name)))
        }
        Kind::Number => is_quality_name(last_word(&column.name)) && column.values.iter().any(|v| *v >= 192.0),
        _ => false,
    }
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
