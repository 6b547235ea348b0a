//! What a log shows of its recording: stretches in which a signal is frozen, signals that are written more often than
//! they are measured. Nothing of it is changed.

use vasos_engine::signal::{LogColumn, LogTable};

use super::Repair;

/// A column that changes in this share of its rows moves.
const MOVES: f64 = 0.3;
/// Rows, and share of the log, that a moving signal may rest.
const REST_ROWS: usize = 50;
const REST_SHARE: f64 = 0.02;
/// Changes that tell a rhythm, and the share of them that keep it.
const FEWEST_CHANGES: usize = 20;
const IN_RHYTHM: f64 = 0.98;
const EVERY_TIME: f64 = 0.7;
/// Longest rhythm looked for, in rows.
const LONGEST_RHYTHM: usize = 64;

pub(super) fn note(table: &LogTable, repairs: &mut Vec<Repair>) {
    for column in table.columns.iter().filter(|c| c.states.is_empty()) {
        if let Some(found) = oversampled(column, table).or_else(|| frozen(column, table)) {
            repairs.push(found);
        }
    }
}

/// Lengths of the runs of one value, in rows.
fn runs(values: &[f64]) -> impl Iterator<Item = usize> + '_ {
    values.chunk_by(|a, b| a == b).map(<[f64]>::len)
}

fn frozen(column: &LogColumn, table: &LogTable) -> Option<Repair> {
    let values = &column.values;
    let (mut changes, mut longest, mut at, mut row) = (0_usize, 0, 0, 0);
    for length in runs(values) {
        if length > longest {
            (longest, at) = (length, row);
        }
        changes += 1;
        row += length;
    }
    let allowed = REST_ROWS.max((REST_SHARE * values.len() as f64) as usize);
    let elsewhere = values.len() - longest;
    let moves = elsewhere > longest && changes as f64 >= MOVES * elsewhere as f64;
    // An output at its limit rests, but is not frozen.
    let at_limit = || !values.iter().any(|v| *v < values[at]) || !values.iter().any(|v| *v > values[at]);
    (longest >= allowed && moves && !at_limit()).then(|| Repair::Frozen {
        column: column.name.clone(),
        line: table.lines.get(at).map_or(0, |l| *l as usize),
        rows: longest,
        length_s: table.time_s[at + longest - 1] - table.time_s[at],
    })
}

fn oversampled(column: &LogColumn, table: &LogTable) -> Option<Repair> {
    let mut counts = [0_usize; LONGEST_RHYTHM + 1];
    let mut changes = 0;
    // The first and the last run are cut off by the log's ends.
    for length in runs(&column.values).skip(1) {
        counts[length.min(LONGEST_RHYTHM)] += 1;
        changes += 1;
    }
    if changes < FEWEST_CHANGES {
        return None;
    }
    let (rhythm, &often) = counts.iter().enumerate().max_by_key(|(_, n)| **n)?;
    if !(2..LONGEST_RHYTHM).contains(&rhythm) || (often as f64) < EVERY_TIME * changes as f64 {
        return None;
    }
    let kept = runs(&column.values).skip(1).filter(|length| length.is_multiple_of(rhythm)).count();
    (kept as f64 >= IN_RHYTHM * (changes - 1) as f64).then(|| Repair::Oversampled {
        column: column.name.clone(),
        rows: rhythm,
        period_s: table.time_s.last().copied().unwrap_or(0.0) / (table.len() - 1) as f64 * rhythm as f64,
    })
}
