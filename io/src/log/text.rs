//! A text file into columns.

use std::io::{Read as Input, Seek};

use super::assemble::Source;
use super::read::Read;
use super::source::Sample;
use super::{FileFormat, ImportError, ImportOptions, Repair, TextFormat, layout, rows};

/// Reads a text from its beginning to its end.
///
/// # Errors
/// [`ImportError`] for a text that holds no log.
pub(super) fn read_text<R: Input + Seek>(
    input: &mut R,
    options: &ImportOptions,
    repairs: &mut Vec<Repair>,
) -> Result<(Read, Source), ImportError> {
    let sample = Sample::take(input)?;
    let mut layout = layout::find(&sample, options)?;
    let read = rows::read(input, &sample, &mut layout, repairs)?;
    let text = TextFormat {
        encoding: sample.charset.found,
        separator: layout.dialect.separator,
        decimal: layout.decimal,
    };
    let source = Source {
        format: FileFormat::Text(text),
        header_line: layout.header_line,
        first_data_line: layout.first_row + 1,
        date_order: layout.order_shown.then_some(layout.date_order),
    };
    Ok((read, source))
}
