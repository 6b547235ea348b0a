//! The rows of a text file into columns, line by line.

use std::io::{Read as Input, Seek};

use super::decode::{BLOCK_OF_ZEROS, Charset};
use super::fast::{Slot, Taken, quick_row};
use super::kinds::kinds;
use super::layout::{Layout, is_blank, is_remark};
use super::marks::Marks;
use super::quotes::{FOLD, unfolded};
use super::read::{Kind, Read, ReadColumn};
use super::source::{Block, Blocks, Sample};
use super::stamp::{DateOrder, Stamp, StampReader, parse as parse_stamp};
use super::torn::is_torn;
use super::{ImportError, Repair};

/// Letters of a text that could not be read that are told.
const SHOWN: usize = 24;

/// Why a file has to be read once more: its sample told less than all of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Again {
    /// A date that only reads the other way round.
    Order(DateOrder),
    /// Something in a field that was empty in all lines of the sample.
    Fields,
}

/// Reads all rows below the header; what is no row is skipped and noted.
///
/// # Errors
/// [`ImportError::OneRow`] when fewer than two rows are left, [`ImportError::Read`] when the disk fails.
pub(super) fn read<R: Input + Seek>(
    input: &mut R,
    sample: &Sample,
    layout: &mut Layout,
    repairs: &mut Vec<Repair>,
) -> Result<Read, ImportError> {
    loop {
        let mut reader = Reader::new(sample, layout);
        let mut blocks = Blocks::new(&mut *input, sample)?;
        let again = reader.all(&mut blocks, sample.line_end)?;
        match again {
            Some(Again::Order(order)) => {
                layout.date_order = order;
                layout.ambiguous_dates = false;
                layout.order_shown = true;
            }
            Some(Again::Fields) => {
                let names = std::mem::take(&mut layout.names);
                let mut known = layout.used.iter().copied().zip(names).peekable();
                let named = (0..layout.fields).map(|at| match known.next_if(|(used, _)| *used == at) {
                    Some((_, name)) => name,
                    None => super::names::ColumnName { name: format!("field {}", at + 1), unit: None },
                });
                layout.names = named.collect();
                layout.used = (0..layout.fields).collect();
            }
            None if reader.lines.len() < 2 => return Err(ImportError::OneRow { line: layout.first_row + 1 }),
            None => {
                let shown = layout.ambiguous_dates && reader.shows_order();
                let read = reader.finish(repairs);
                layout.order_shown |= shown;
                return Ok(read);
            }
        }
    }
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

/// Values a column lacks: empty fields, and texts that are none.
#[derive(Debug, Clone, Default)]
struct Missing {
    empty: Tally,
    unread: Tally,
    text: String,
}

/// A line in its block.
#[derive(Debug, Clone, Copy)]
struct Line<'a> {
    /// Counted from 1.
    number: usize,
    block: &'a [u8],
    start: usize,
    end: usize,
    /// Rows ahead of it in the file.
    before: usize,
    /// Whether the file ends with it, without a line end.
    open: bool,
}

struct Reader<'a> {
    sample: &'a Sample,
    layout: &'a Layout,
    charset: Charset,
    columns: Vec<ReadColumn>,
    stamps: Vec<StampReader>,
    /// Unit behind the numbers of each column.
    suffixes: Vec<Option<String>>,
    missing: Vec<Missing>,
    lines: Vec<u32>,
    skipped: Tally,
    ragged: Tally,
    /// What was missing ahead of the first row with too few fields.
    before_short: Option<Vec<Missing>>,
    /// Bytes of zero in blocks, and the lines of rows that were cut off.
    zeros: usize,
    zeros_line: usize,
    torn: Vec<usize>,
    /// What each field of a line goes to, where lines can be read without splitting them.
    slots: Vec<Slot>,
    /// Columns found empty in a line.
    blanks: Vec<usize>,
    again: Option<Again>,
}

impl<'a> Reader<'a> {
    fn new(sample: &'a Sample, layout: &'a Layout) -> Self {
        let kinds = kinds(sample, layout);
        let separator = layout.dialect.separator;
        // Where one sign is separator and decimal mark, quotes tell them apart.
        let plain = layout.dialect.is_plain()
            && separator != super::Separator::DoubleBar
            && separator.byte() != Some(layout.decimal.mark())
            && !layout.marks.iter().flatten().any(|marks| marks.grouped);
        let slots = if plain {
            let column = |at: usize| layout.used.iter().position(|&used| used == at);
            (0..layout.fields).map(|at| column(at).map_or(Slot::Empty, Slot::Column)).collect()
        } else {
            Vec::new()
        };
        let rows = sample.expected_lines;
        let columns = kinds.iter().zip(&layout.names).map(|(&kind, name)| {
            ReadColumn::new(name.name.clone(), name.unit.clone(), kind, Vec::with_capacity(rows))
        });
        Self {
            sample,
            layout,
            charset: sample.charset,
            columns: columns.collect(),
            stamps: kinds.iter().map(|k| StampReader::new(layout.date_order, *k == Kind::Clock)).collect(),
            suffixes: vec![None; kinds.len()],
            missing: vec![Missing::default(); kinds.len()],
            lines: Vec::with_capacity(rows),
            skipped: Tally::default(),
            ragged: Tally::default(),
            before_short: None,
            zeros: 0,
            zeros_line: 0,
            torn: Vec::new(),
            slots,
            blanks: Vec::new(),
            again: None,
        }
    }

    fn all<R: Input + Seek>(
        &mut self,
        blocks: &mut Blocks<R>,
        line_end: u8,
    ) -> Result<Option<Again>, ImportError> {
        // Rows counted, and lines: a row with a remark of several lines has as many.
        let (mut index, mut number) = (0, 0);
        while let Some(Block { text: block, last }) = blocks.next()? {
            let mut start = 0;
            let folded = memchr::memchr(FOLD, block).is_some();
            while start < block.len() {
                let end = memchr::memchr(line_end, &block[start..]).map_or(block.len(), |i| start + i);
                index += 1;
                number += 1;
                if index > self.layout.first_row {
                    let before = index - 1 - self.layout.first_row;
                    let open = last && end == block.len();
                    self.line(Line { number, block, start, end, before, open });
                }
                if folded {
                    number += memchr::memchr_iter(FOLD, &block[start..end]).count();
                }
                start = end + 1;
            }
            if self.again.is_some() {
                break;
            }
        }
        Ok(self.again)
    }

    fn line(&mut self, line: Line) {
        let Line { number, block, start, end, open, .. } = line;
        let has_return = end > start && block[end - 1] == b'\r';
        let end = if has_return { end - 1 } else { end };
        if start == end {
            return;
        }
        if !self.slots.is_empty() && !open {
            let taken = Taken {
                columns: &mut self.columns,
                stamps: &mut self.stamps,
                blanks: &mut self.blanks,
                separator: self.layout.dialect.separator.byte(),
                mark: self.layout.decimal.mark(),
            };
            if quick_row(taken, &self.slots, block, start, end) {
                self.lines.push(u32::try_from(number).unwrap_or(u32::MAX));
                for column in self.blanks.drain(..) {
                    self.missing[column].empty.add(number);
                }
                return;
            }
            let rows = self.lines.len();
            self.columns.iter_mut().for_each(|c| c.values.truncate(rows));
            self.blanks.clear();
        }
        let charset = self.charset;
        let text = unfolded(charset.text(&block[start..end]));
        if text.contains('\0') {
            self.around_zeros(&text, line);
        } else if open && !has_return && self.is_cut(&text, line) {
            self.torn.push(number);
        } else {
            self.text(number, &text);
        }
    }

    /// What stands around the zeros of a crash: a row that was being written ahead of them, rows behind.
    fn around_zeros(&mut self, text: &str, line: Line) {
        let mut piece = 0;
        let mut at = 0;
        for run in text.as_bytes().chunk_by(|a, b| (*a == 0) == (*b == 0)) {
            if run[0] == 0 && run.len() >= BLOCK_OF_ZEROS {
                if self.zeros == 0 {
                    self.zeros_line = line.number;
                }
                self.zeros += run.len();
                let ahead = &text[piece..at];
                if !is_blank(ahead) && self.is_cut(ahead, line) {
                    self.torn.push(line.number);
                } else if !is_blank(ahead) {
                    self.text(line.number, ahead);
                }
                piece = at + run.len();
            }
            at += run.len();
        }
        let behind = &text[piece..];
        if line.open && !is_blank(behind) && self.is_cut(behind, line) {
            self.torn.push(line.number);
        } else {
            self.text(line.number, behind);
        }
    }

    /// Whether the rows before a text say that it is none of theirs, but the beginning of one.
    fn is_cut(&self, text: &str, line: Line) -> bool {
        let end = if self.sample.line_end == b'\n' { '\n' } else { '\r' };
        let above = self.charset.text(&line.block[..line.start]);
        let above: Vec<&str> = above
            .trim_end_matches(end)
            .rsplit(end)
            .take(line.before)
            .map(|row| row.trim_end_matches('\r'))
            .collect();
        let here = above.len() == line.before;
        let sample = if here { &[] } else { self.sample.head.get(self.layout.first_row..).unwrap_or(&[]) };
        // The sample of a short file ends with the very row.
        let sample = sample.iter().map(String::as_str).filter(|row| *row != text);
        is_torn(text, above.into_iter().chain(sample), self.layout)
    }

    fn text(&mut self, number: usize, text: &str) {
        if is_remark(text) {
            self.skipped.add(number);
        } else if !is_blank(text) {
            let mut fields = Vec::new();
            self.layout.dialect.split(text, &mut fields);
            self.row(number, &fields);
        }
    }

    fn row(&mut self, line: usize, fields: &[&str]) {
        let layout = self.layout;
        let rows = self.lines.len();
        let mut found = 0;
        for (i, &at) in layout.used.iter().enumerate() {
            let value = self.value(i, fields.get(at).copied().unwrap_or(""));
            found += usize::from(value.is_some() && self.columns[i].kind != Kind::Words);
            self.columns[i].values.push(value.unwrap_or(f64::NAN));
        }
        if found == 0 {
            self.columns.iter_mut().for_each(|c| c.values.truncate(rows));
            if !fields.iter().all(|f| f.is_empty()) {
                self.skipped.add(line);
            }
            return;
        }
        self.lines.push(u32::try_from(line).unwrap_or(u32::MAX));
        let extra = fields.iter().skip(layout.fields).any(|f| !f.is_empty());
        let short = fields.len() <= layout.used.last().copied().unwrap_or(0);
        if short && self.before_short.is_none() {
            self.before_short = Some(self.missing.clone());
        }
        if extra || short {
            self.ragged.add(line);
        }
        if layout.used.len() < layout.fields
            && fields
                .iter()
                .take(layout.fields)
                .enumerate()
                .any(|(at, f)| !f.is_empty() && !layout.used.contains(&at))
        {
            self.again = Some(Again::Fields);
        }
        for (i, &at) in layout.used.iter().enumerate() {
            if self.columns[i].values[rows].is_nan() {
                self.note_missing(i, line, fields.get(at).copied().unwrap_or(""));
            }
        }
    }

    fn note_missing(&mut self, i: usize, line: usize, field: &str) {
        let missing = &mut self.missing[i];
        if field.is_empty() {
            missing.empty.add(line);
            return;
        }
        if missing.unread.count == 0 {
            missing.text = field.chars().take(SHOWN).collect();
        }
        missing.unread.add(line);
        let column = &mut self.columns[i];
        let row = column.values.len() - 1;
        if column.kind == Kind::Number
            && field.starts_with(char::is_alphabetic)
            && let (Ok(row), Some(state)) = (u32::try_from(row), column.state(field))
        {
            column.strays.push((row, state));
        }
        if column.kind.is_stamp() && self.layout.ambiguous_dates && self.again.is_none() {
            let other = self.layout.date_order.other();
            if parse_stamp(field, other).is_some() {
                self.again = Some(Again::Order(other));
            }
        }
    }

    fn value(&mut self, i: usize, field: &str) -> Option<f64> {
        let column = &mut self.columns[i];
        match column.kind {
            _ if field.is_empty() => None,
            Kind::Number => self.layout.number(field, self.layout.used[i]).or_else(|| {
                let (value, unit) = self.layout.quantity(field, self.layout.used[i])?;
                let first = self.suffixes[i].get_or_insert_with(|| unit.to_owned());
                // Of a column in V a value in mV is none of its numbers.
                (first == unit).then_some(value)
            }),
            Kind::Words => column.state(field).map(f64::from),
            Kind::Full | Kind::Date | Kind::Clock => {
                let stamp = self.stamps[i].read(field.as_bytes())?;
                if let Stamp::Full { zone_s: Some(zone_s), .. } = stamp {
                    column.zone_s.get_or_insert(zone_s);
                }
                Some(stamp.seconds())
            }
        }
    }

    /// Takes the last row back if it alone of all rows has too few fields: it was cut off.
    fn take_back_short_end(&mut self) {
        let last = self.lines.last().map_or(0, |line| *line as usize);
        if let (1, Some(missing)) = (self.ragged.count, self.before_short.take())
            && self.ragged.line == last
            && self.lines.len() > 2
        {
            self.lines.pop();
            let rows = self.lines.len();
            self.columns.iter_mut().for_each(|c| c.values.truncate(rows));
            self.missing = missing;
            self.ragged = Tally::default();
            self.torn.push(last);
        }
    }

    fn shows_order(&self) -> bool {
        self.stamps.iter().any(|s| s.day_first || s.month_first)
    }

    fn finish(mut self, repairs: &mut Vec<Repair>) -> Read {
        self.take_back_short_end();
        let shows_order = self.shows_order();
        if self.zeros > 0 {
            repairs.push(Repair::Zeros { bytes: self.zeros, line: self.zeros_line });
        }
        repairs.extend(self.torn.iter().map(|&line| Repair::TornRow { line }));
        if self.skipped.count > 0 {
            repairs.push(Repair::SkippedLines { count: self.skipped.count, line: self.skipped.line });
        }
        if self.ragged.count > 0 {
            let Tally { count, line } = self.ragged;
            repairs.push(Repair::RaggedRows { count, line, fields: self.layout.fields });
        }
        for ((column, missing), suffix) in self.columns.iter_mut().zip(self.missing).zip(self.suffixes) {
            if column.unit.is_none() {
                column.unit = suffix;
            }
            let column_name = || column.name.clone();
            if missing.unread.count > 0 {
                let Tally { count, line } = missing.unread;
                repairs.push(Repair::MissingValues {
                    column: column_name(),
                    count,
                    line,
                    text: missing.text,
                });
            }
            if missing.empty.count > 0 && !column.is_text_only() {
                let Tally { count, line } = missing.empty;
                repairs.push(Repair::MissingValues {
                    column: column_name(),
                    count,
                    line,
                    text: String::new(),
                });
            }
        }
        let marked = self.columns.iter().zip(&self.layout.used).filter_map(|(column, &at)| {
            let marks = self.layout.marks.get(at)?.as_ref()?;
            (column.kind == Kind::Number && (marks.grouped || marks.doubtful))
                .then_some((column.name.as_str(), marks))
        });
        repairs.extend(Marks::repairs(marked));
        if self.layout.ambiguous_dates && !shows_order {
            let month_first = self.layout.date_order == DateOrder::MonthFirst;
            repairs.push(Repair::AmbiguousDates { month_first });
        }
        Read {
            columns: self.columns,
            lines: self.lines,
            stated_sample_time_s: self.layout.stated_sample_time_s,
        }
    }
}
