//! Decimal commas between commas: `0,50,00,30,00` under `time,PV,MV`, as a spreadsheet set to a country writes that the
//! program behind it does not know of.

use super::layout::{is_blank, is_remark};
use super::marks::Shape;
use super::split::Dialect;
use super::{Decimal, ImportError};

/// Rows by which it is told.
const ROWS: usize = 400;
/// Fields ahead of the numbers: a date and a time of day, or a count.
const AHEAD: usize = 2;

/// Whether the rows from `start` on have more fields than their names because numbers and decimals are parted: the fields
/// ahead that are whole, if the others pair up.
///
/// # Errors
/// [`ImportError::CommasInCommas`] where some numbers have decimals and others none: nothing tells which.
pub(super) fn parted(lines: &[&str], start: usize, dialect: Dialect) -> Result<Option<usize>, ImportError> {
    let mut fields = Vec::new();
    let Some(header) = lines[..start].iter().rev().find(|line| !is_blank(line) && !is_remark(line)) else {
        return Ok(None);
    };
    dialect.split(header, &mut fields);
    let names = fields.len();
    let is_name = |field: &&str| field.starts_with(|c: char| c.is_alphabetic());
    if names < 2 || !fields.iter().all(is_name) {
        return Ok(None);
    }
    let rows = || lines[start..].iter().filter(|line| !is_blank(line) && !is_remark(line)).take(ROWS);
    let (mut least, mut most, mut all_whole) = (usize::MAX, 0, true);
    let (mut longer, mut count) = (0, 0);
    for line in rows() {
        dialect.split(line, &mut fields);
        (least, most) = (least.min(fields.len()), most.max(fields.len()));
        count += 1;
        longer += usize::from(fields.len() > names);
        all_whole &= fields.iter().skip(1).all(|field| is_whole(field));
    }
    if !(names..=2 * names).contains(&least) || most > 2 * names || most == names {
        return Ok(None);
    }
    let ahead = 2 * names - most;
    if least == most && ahead <= AHEAD && ahead < names {
        let mut pairs = true;
        for line in rows() {
            dialect.split(line, &mut fields);
            // Who writes decimal points writes no decimal commas.
            let points = fields[..ahead].iter().any(|f| Shape::of(f) == Shape::Decimals(Decimal::Point));
            pairs &=
                !points && fields[ahead..].chunks(2).all(|pair| is_whole(pair[0]) && is_decimals(pair[1]));
        }
        return Ok(pairs.then_some(ahead));
    }
    if all_whole && least < most && 2 * longer > count {
        return Err(ImportError::CommasInCommas { line: start + 1, names, fields: most });
    }
    Ok(None)
}

fn is_decimals(field: &str) -> bool {
    !field.is_empty() && field.bytes().all(|b| b.is_ascii_digit())
}

fn is_whole(field: &str) -> bool {
    is_decimals(field.strip_prefix(['-', '+']).unwrap_or(field))
}
