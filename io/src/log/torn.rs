//! Rows that were cut off while they were written: the end of a file that was copied meanwhile, what stands ahead of the
//! zeros of a crash. Their last number may be a wrong one.

use super::layout::{Layout, is_blank, is_remark};

/// Rows it is compared with.
const ROWS: usize = 400;

/// How the rows before wrote one of their fields.
#[derive(Debug, Default)]
struct Usual {
    /// Fields of the shortest row.
    fields: usize,
    /// Fewest letters, a sign left aside, and the decimals where all have as many.
    letters: usize,
    decimals: Option<usize>,
    rows: usize,
    /// A field begins like the last of the row, and goes on; one is the same.
    goes_on: bool,
    same: bool,
}

/// Whether a row without a line end is cut off, by the rows before it: fewer fields than these, or a last one that is
/// shorter than all theirs, has fewer decimals or is the beginning of a word.
pub(super) fn is_torn<'a>(text: &str, before: impl Iterator<Item = &'a str>, layout: &Layout) -> bool {
    let mut fields = Vec::new();
    layout.dialect.split(text, &mut fields);
    let Some(&last) = fields.last() else { return false };
    // A last line of words was never a row.
    if text.ends_with('\r') || !text.bytes().any(|b| b.is_ascii_digit()) {
        return false;
    }
    let usual = usual(last, fields.len() - 1, before, layout);
    if usual.rows == 0 {
        return false;
    }
    let is_word = last.starts_with(char::is_alphabetic);
    fields.len() < usual.fields
        || letters(last) < usual.letters
        || usual.decimals.is_some_and(|usual| decimals(last) < usual)
        || is_word && usual.goes_on && !usual.same
}

fn usual<'a>(last: &str, at: usize, before: impl Iterator<Item = &'a str>, layout: &Layout) -> Usual {
    let mut usual = Usual { fields: usize::MAX, letters: usize::MAX, ..Usual::default() };
    let mut fields = Vec::new();
    for line in before.filter(|line| !is_remark(line) && !is_blank(line) && !line.contains('\0')).take(ROWS) {
        layout.dialect.split(line, &mut fields);
        usual.fields = usual.fields.min(fields.len());
        let Some(field) = fields.get(at) else { continue };
        let count = decimals(field);
        usual.decimals = if usual.rows == 0 { Some(count) } else { usual.decimals.filter(|d| *d == count) };
        usual.letters = usual.letters.min(letters(field));
        usual.goes_on |= field.len() > last.len() && field.starts_with(last);
        usual.same |= *field == last;
        usual.rows += 1;
    }
    usual
}

fn letters(field: &str) -> usize {
    field.trim_start_matches(['-', '+']).len()
}

fn decimals(field: &str) -> usize {
    let behind = field.rsplit_once(['.', ',']).map_or("", |(_, behind)| behind);
    behind.bytes().take_while(u8::is_ascii_digit).count()
}
