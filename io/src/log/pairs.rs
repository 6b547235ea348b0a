//! Columns with times of their own: `time, TIC101, time, LIC102`, each pair or group of columns with its own stamps.

use super::merge::{Point, Series, merge};
use super::read::{Kind, Read, ReadColumn};
use super::{ImportOptions, Repair};

/// A time column and the columns that go by it.
#[derive(Debug, Clone)]
pub(super) struct Block {
    time: usize,
    columns: Vec<usize>,
}

/// The name without the number that tells equal names apart.
pub(super) fn base(name: &str) -> &str {
    name.rsplit_once(" (").filter(|(_, n)| n.ends_with(')')).map_or(name, |(base, _)| base)
}

/// Recognises the layout: several columns of stamps, or of numbers of one name that is a time's, the first in front,
/// with other columns behind each, and not all with the same times.
pub(super) fn find(read: &Read, options: &ImportOptions) -> Option<Vec<Block>> {
    if options.time_column.is_some() {
        return None;
    }
    let columns = &read.columns;
    let first = columns.first()?;
    let same_name = |c: &ReadColumn| base(&c.name) == base(&first.name) && super::axis::is_time_name(&c.name);
    let is_time = |c: &ReadColumn| match first.kind {
        Kind::Full => c.kind == Kind::Full,
        Kind::Number => c.kind == Kind::Number && same_name(c),
        _ => false,
    };
    let mut blocks: Vec<Block> = Vec::new();
    for (i, column) in columns.iter().enumerate() {
        if is_time(column) {
            blocks.push(Block { time: i, columns: Vec::new() });
        } else if let Some(block) = blocks.last_mut() {
            block.columns.push(i);
        }
    }
    let equal = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| a == b || (a.is_nan() && b.is_nan()));
    let apart = blocks.iter().any(|b| !equal(&columns[b.time].values, &first.values));
    (blocks.len() > 1 && apart && blocks.iter().all(|b| !b.columns.is_empty())).then_some(blocks)
}

/// Brings the columns onto one axis.
pub(super) fn join(read: Read, blocks: &[Block], repairs: &mut Vec<Repair>) -> Read {
    let names: Vec<&str> = blocks.iter().map(|b| read.columns[b.time].name.as_str()).collect();
    repairs.push(Repair::OwnTimes { columns: names.join(", ") });
    let mut series: Vec<Series> = Vec::new();
    for block in blocks {
        let time = &read.columns[block.time];
        for &i in &block.columns {
            let column = &read.columns[i];
            let points = time.values.iter().zip(&column.values).zip(&read.lines);
            // Beyond the end of a shorter block there is nothing.
            let points = points.filter(|((t, _), _)| t.is_finite());
            let points = points.map(|((&time_s, &value), &line)| Point { time_s, value, line }).collect();
            let name = if is_numbered(&column.name) && !super::axis::is_time_name(&time.name) {
                base(&time.name).to_owned()
            } else {
                column.name.clone()
            };
            let states = if column.kind == Kind::Words { column.states.clone() } else { Vec::new() };
            series.push(Series { name, unit: column.unit.clone(), states, points });
        }
        // Shorter blocks end in blanks, which are no missing times.
        repairs.retain(|r| !is_blank_of(r, &time.name));
        for &i in &block.columns {
            let short =
                read.columns[i].values.iter().zip(&time.values).all(|(v, t)| !v.is_nan() || t.is_nan());
            repairs.retain(|r| !(short && is_blank_of(r, &read.columns[i].name)));
        }
    }
    let merged = merge(&mut series, repairs);
    let first = &read.columns[blocks[0].time];
    let mut time = ReadColumn::new(first.name.clone(), first.unit.clone(), first.kind, merged.time_s);
    if !super::axis::is_time_name(&time.name) {
        time.name = "time".to_owned();
    }
    time.zone_s = first.zone_s;
    let mut columns = vec![time];
    for (signal, values) in series.into_iter().zip(merged.columns) {
        let kind = if signal.states.is_empty() { Kind::Number } else { Kind::Words };
        let mut column = ReadColumn::new(signal.name, signal.unit, kind, values);
        column.states = signal.states;
        columns.push(column);
    }
    Read { columns, lines: merged.lines, stated_sample_time_s: None }
}

/// A name given for want of one.
fn is_numbered(name: &str) -> bool {
    name.strip_prefix("column ").is_some_and(|n| n.bytes().all(|b| b.is_ascii_digit()))
}

fn is_blank_of(repair: &Repair, name: &str) -> bool {
    matches!(repair, Repair::MissingValues { column, text, .. } if column == name && text.is_empty())
}
