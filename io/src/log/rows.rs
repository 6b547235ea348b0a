//! The rows of a file into columns of numbers.

use super::layout::{Layout, is_remark};
use super::split::split;
use super::stamp::{Stamp, parse as parse_stamp};
use super::{Decimal, ImportError, Repair, Separator, number};

/// Rows a column's kind is judged by.
const SAMPLE: usize = 200;
/// Most words a column of states has.
const MOST_STATES: usize = 32;

/// What a column holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Number,
    /// Date and time of day, date alone, or time of day alone.
    Full,
    Date,
    Clock,
    Words,
}

/// A column as read: numbers, seconds of stamps, or indices into `states`.
#[derive(Debug, Clone)]
pub(super) struct ReadColumn {
    pub kind: Kind,
    pub values: Vec<f64>,
    pub states: Vec<String>,
}

impl ReadColumn {
    /// Whether its words are too many to be states.
    pub fn is_text_only(&self) -> bool {
        self.kind == Kind::Words
            && (self.states.len() > MOST_STATES || self.states.len() * 2 > self.values.len())
    }
}

/// All columns, and the line of each row, counted from 1.
#[derive(Debug, Clone)]
pub(super) struct Read {
    pub columns: Vec<ReadColumn>,
    pub names: Vec<String>,
    pub units: Vec<Option<String>>,
    pub lines: Vec<u32>,
}

/// Reads all rows below the header; what is no row is skipped and noted.
///
/// # Errors
/// [`ImportError::OneRow`] when fewer than two rows are left.
pub(super) fn read(lines: &[&str], layout: &Layout, repairs: &mut Vec<Repair>) -> Result<Read, ImportError> {
    let kinds = kinds(lines, layout);
    let rows = lines.len() - layout.first_row;
    let only_numbers = layout.used.len() == layout.fields && kinds.iter().all(|k| *k == Kind::Number);
    let plain = plain_marks(layout).filter(|_| only_numbers);
    let mut reader = Reader {
        layout,
        columns: kinds
            .into_iter()
            .map(|kind| ReadColumn { kind, values: Vec::with_capacity(rows), states: Vec::new() })
            .collect(),
        missing: vec![Missing::default(); layout.used.len()],
        lines: Vec::with_capacity(rows),
        skipped: Tally::default(),
        ragged: Tally::default(),
        plain,
    };
    let mut fields = Vec::new();
    for (i, &line) in lines.iter().enumerate().skip(layout.first_row) {
        if line.is_empty() {
            continue;
        }
        if is_remark(line) {
            reader.skipped.add(i + 1);
            continue;
        }
        if !reader.plain_row(i + 1, line.as_bytes()) {
            split(line, layout.separator, &mut fields);
            reader.row(i + 1, &fields);
        }
    }
    if reader.lines.len() < 2 {
        return Err(ImportError::OneRow { line: layout.first_row + 1 });
    }
    Ok(reader.finish(repairs))
}

fn plain_marks(layout: &Layout) -> Option<(u8, u8)> {
    let mark = match layout.decimal {
        Decimal::Point => b'.',
        Decimal::Comma => b',',
    };
    let separator = match layout.separator {
        Separator::Tab => b'\t',
        Separator::Semicolon => b';',
        Separator::Comma => b',',
        Separator::Bar => b'|',
        Separator::DoubleBar | Separator::Blanks => return None,
    };
    Some((mark, separator))
}

#[derive(Debug, Clone, Copy, Default)]
struct Tally {
    count: usize,
    line: usize,
}

impl Tally {
    fn add(&mut self, line: usize) {
        if self.count == 0 {
            self.line = line;
        }
        self.count += 1;
    }
}

#[derive(Debug, Clone, Default)]
struct Missing {
    tally: Tally,
    text: String,
}

struct Reader<'a> {
    layout: &'a Layout,
    columns: Vec<ReadColumn>,
    missing: Vec<Missing>,
    lines: Vec<u32>,
    skipped: Tally,
    ragged: Tally,
    /// Decimal mark and separator, where rows can be nothing but numbers.
    plain: Option<(u8, u8)>,
}

impl Reader<'_> {
    /// A row of nothing but plain numbers, read in one go; otherwise leaves no trace and says so.
    fn plain_row(&mut self, line: usize, bytes: &[u8]) -> bool {
        let Some((mark, separator)) = self.plain else { return false };
        let (mut at, last) = (0, self.columns.len() - 1);
        for i in 0..=last {
            let read = number::scan(bytes, at, mark);
            match read {
                Some((value, end)) if bytes.get(end) == if i == last { None } else { Some(&separator) } => {
                    self.columns[i].values.push(value);
                    at = end + 1;
                }
                _ => {
                    self.columns[..i].iter_mut().for_each(|c| {
                        c.values.pop();
                    });
                    return false;
                }
            }
        }
        self.lines.push(u32::try_from(line).unwrap_or(u32::MAX));
        true
    }

    fn row(&mut self, line: usize, fields: &[&str]) {
        let layout = self.layout;
        let mut found = 0;
        for (column, &at) in self.columns.iter_mut().zip(&layout.used) {
            let field = fields.get(at).copied().unwrap_or("");
            let value = value(field, column, layout);
            found += usize::from(value.is_some() && column.kind != Kind::Words);
            column.values.push(value.unwrap_or(f64::NAN));
        }
        if found == 0 {
            self.columns.iter_mut().for_each(|c| {
                c.values.pop();
            });
            if !fields.iter().all(|f| f.is_empty()) {
                self.skipped.add(line);
            }
            return;
        }
        self.lines.push(u32::try_from(line).unwrap_or(u32::MAX));
        let extra = fields.iter().skip(layout.fields).any(|f| !f.is_empty());
        let short = fields.len() <= layout.used.last().copied().unwrap_or(0);
        if extra || short {
            self.ragged.add(line);
        }
        if found < self.columns.len() {
            for ((column, missing), &at) in self.columns.iter().zip(&mut self.missing).zip(&layout.used) {
                if column.kind != Kind::Words && column.values.last().is_some_and(|v| v.is_nan()) {
                    if missing.tally.count == 0 {
                        missing.text = fields.get(at).copied().unwrap_or("").chars().take(24).collect();
                    }
                    missing.tally.add(line);
                }
            }
        }
    }

    fn finish(self, repairs: &mut Vec<Repair>) -> Read {
        let names: Vec<String> = self.layout.names.iter().map(|n| n.name.clone()).collect();
        if self.skipped.count > 0 {
            repairs.push(Repair::SkippedLines { count: self.skipped.count, line: self.skipped.line });
        }
        if self.ragged.count > 0 {
            let Tally { count, line } = self.ragged;
            repairs.push(Repair::RaggedRows { count, line, fields: self.layout.fields });
        }
        for ((column, missing), name) in self.columns.iter().zip(self.missing).zip(&names) {
            if column.is_text_only() {
                repairs.push(Repair::TextColumn { column: name.clone() });
            } else if missing.tally.count > 0 {
                let Tally { count, line } = missing.tally;
                repairs.push(Repair::MissingValues { column: name.clone(), count, line, text: missing.text });
            }
        }
        if self.layout.ambiguous_dates {
            repairs.push(Repair::AmbiguousDates);
        }
        let units = self.layout.names.iter().map(|n| n.unit.clone()).collect();
        Read { columns: self.columns, names, units, lines: self.lines }
    }
}

fn value(field: &str, column: &mut ReadColumn, layout: &Layout) -> Option<f64> {
    match column.kind {
        Kind::Number => number::parse(field, layout.decimal),
        Kind::Words => {
            if field.is_empty() {
                return None;
            }
            if let Some(i) = column.states.iter().position(|s| s == field) {
                return Some(i as f64);
            }
            if column.states.len() <= MOST_STATES {
                column.states.push(field.to_owned());
            }
            Some(column.states.len() as f64 - 1.0)
        }
        Kind::Full | Kind::Date | Kind::Clock => match parse_stamp(field, layout.date_order)? {
            Stamp::Full(s) | Stamp::Date(s) | Stamp::Clock(s) => Some(s),
        },
    }
}

fn kinds(lines: &[&str], layout: &Layout) -> Vec<Kind> {
    let stride = (lines.len() - layout.first_row) / SAMPLE + 1;
    let mut fields = Vec::new();
    let mut seen = vec![[0_usize; 5]; layout.used.len()];
    for line in lines[layout.first_row..].iter().step_by(stride).filter(|line| !is_remark(line)) {
        split(line, layout.separator, &mut fields);
        for (counts, &at) in seen.iter_mut().zip(&layout.used) {
            let Some(field) = fields.get(at).filter(|f| !f.is_empty()) else { continue };
            let kind = if number::parse(field, layout.decimal).is_some() {
                Kind::Number
            } else {
                match parse_stamp(field, layout.date_order) {
                    Some(Stamp::Full(_)) => Kind::Full,
                    Some(Stamp::Date(_)) => Kind::Date,
                    Some(Stamp::Clock(_)) => Kind::Clock,
                    None => Kind::Words,
                }
            };
            counts[kind as usize] += 1;
        }
    }
    seen.iter().map(|counts| judge(*counts)).collect()
}

/// A column with any fair share of numbers is one of numbers; its words ("Bad") are missing values.
fn judge(counts: [usize; 5]) -> Kind {
    let total: usize = counts.iter().sum();
    let order = [Kind::Full, Kind::Date, Kind::Clock];
    let most = order.into_iter().max_by_key(|k| counts[*k as usize]).unwrap_or(Kind::Full);
    if counts[Kind::Number as usize] * 5 >= total {
        Kind::Number
    } else if counts[most as usize] * 2 > total {
        // A midnight written without its time of day is still a full stamp among others.
        if most == Kind::Date && counts[Kind::Full as usize] > 0 { Kind::Full } else { most }
    } else {
        Kind::Words
    }
}
