//! Workbooks of spreadsheet programs (.xlsx, .xls, .ods): the sheet becomes text with tabs, and goes the way of text.

use std::io::{Cursor, Read as Input, Seek};

use calamine::{Data, ExcelDateTime, Range, Reader, Sheets, open_workbook_auto_from_rs};

use super::assemble::Source;
use super::calendar::iso;
use super::read::Read;
use super::stamp::DAY_S;
use super::text::read_text;
use super::{FileFormat, ImportError, ImportOptions, Repair};

/// 1970-01-01 as a spreadsheet counts days.
const EPOCH_DAYS: f64 = 25_569.0;

/// Whether a file begins like a workbook.
pub(super) fn is_workbook(start: &[u8]) -> bool {
    start.starts_with(b"PK\x03\x04") || start.starts_with(b"\xD0\xCF\x11\xE0")
}

/// Reads the sheet the user named, or the one with the most numbers.
///
/// # Errors
/// [`ImportError::Foreign`] for an archive that is no workbook, [`ImportError::NoSuchSheet`], and those of a text.
pub(super) fn read_workbook<R: Input + Seek + Clone>(
    input: R,
    options: &ImportOptions,
    repairs: &mut Vec<Repair>,
) -> Result<(Read, Source), ImportError> {
    let foreign = |_| ImportError::Foreign { format: "a damaged workbook, a protected one or an archive" };
    let mut book = open_workbook_auto_from_rs(input).map_err(foreign)?;
    let names = book.sheet_names();
    let (sheet, range) = choose(&mut book, &names, options)?;
    let others: Vec<&str> = names.iter().filter(|n| **n != sheet).map(String::as_str).collect();
    if options.sheet.is_none() && others.iter().any(|name| has_rows(&mut book, name)) {
        repairs.push(Repair::OtherSheets { sheet: sheet.clone(), others: others.join(", ") });
    }
    let text = as_text(&range);
    drop(range);
    let (read, source) = read_text(&mut Cursor::new(text), options, repairs)?;
    Ok((read, Source { format: FileFormat::Workbook { sheet }, ..source }))
}

fn choose<R: Input + Seek>(
    book: &mut Sheets<R>,
    names: &[String],
    options: &ImportOptions,
) -> Result<(String, Range<Data>), ImportError> {
    if let Some(name) = &options.sheet {
        let missing = || ImportError::NoSuchSheet { name: name.clone(), sheets: names.join(", ") };
        let range = book.worksheet_range(name).map_err(|_| missing())?;
        return Ok((name.clone(), range));
    }
    let mut best: Option<(usize, String, Range<Data>)> = None;
    for name in names {
        let Ok(range) = book.worksheet_range(name) else { continue };
        let numbers = range.used_cells().filter(|(_, _, cell)| is_number(cell)).count();
        if best.as_ref().is_none_or(|b| numbers > b.0) {
            best = Some((numbers, name.clone(), range));
        }
    }
    best.map(|(_, name, range)| (name, range)).ok_or(ImportError::Empty)
}

fn is_number(cell: &Data) -> bool {
    matches!(cell, Data::Float(_) | Data::Int(_) | Data::DateTime(_) | Data::DateTimeIso(_))
}

fn has_rows<R: Input + Seek>(book: &mut Sheets<R>, name: &str) -> bool {
    book.worksheet_range(name).is_ok_and(|range| range.used_cells().filter(|c| is_number(c.2)).count() > 3)
}

/// A line a row, so that lines are the rows of the sheet.
fn as_text(range: &Range<Data>) -> Vec<u8> {
    let mut text = String::new();
    let above = range.start().map_or(0, |(row, _)| row);
    (0..above).for_each(|_| text.push('\n'));
    for row in range.rows() {
        for (i, cell) in row.iter().enumerate() {
            if i > 0 {
                text.push('\t');
            }
            push_cell(&mut text, cell);
        }
        text.push('\n');
    }
    text.into_bytes()
}

fn push_cell(text: &mut String, cell: &Data) {
    match cell {
        Data::Empty | Data::Error(_) => {}
        Data::Int(value) => text.push_str(&value.to_string()),
        Data::Float(value) => text.push_str(&value.to_string()),
        Data::Bool(value) => text.push_str(if *value { "TRUE" } else { "FALSE" }),
        Data::DateTime(stamp) => text.push_str(&date_text(stamp)),
        Data::DateTimeIso(words) | Data::DurationIso(words) | Data::String(words) => {
            text.extend(words.chars().map(|c| if matches!(c, '\t' | '\n' | '\r' | '"') { ' ' } else { c }));
        }
    }
}

/// A date with its time, a time of day for what is less than a day, hours and minutes for a duration.
fn date_text(stamp: &ExcelDateTime) -> String {
    let days = stamp.as_f64();
    if stamp.is_duration() || days < 1.0 {
        let millis = (days * DAY_S * 1000.0).round() as u64;
        let (h, m, s) = (millis / 3_600_000, millis / 60_000 % 60, millis / 1000 % 60);
        return if h < 24 {
            format!("{h:02}:{m:02}:{s:02}.{:03}", millis % 1000)
        } else {
            (days * DAY_S).to_string()
        };
    }
    iso((days - EPOCH_DAYS) * DAY_S)
}
