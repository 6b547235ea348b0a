//! Where the data of a text file begins, what separates its fields and what its columns are called.

use super::names::{ColumnName, is_unit_row, read_names};
use super::split::{SEPARATORS, split};
use super::stamp::{DateOrder, Stamp, order_of, parse as parse_stamp};
use super::{Decimal, ImportError, Separator, number};

/// Lines the format is judged by.
const SAMPLE: usize = 400;

/// Format of a file.
#[derive(Debug, Clone)]
pub(super) struct Layout {
    pub separator: Separator,
    pub decimal: Decimal,
    /// Line of the names, counted from 1.
    pub header_line: Option<usize>,
    /// Index of the first line of data.
    pub first_row: usize,
    /// Fields of an ordinary row.
    pub fields: usize,
    /// Fields that ever hold something, in order; the columns.
    pub used: Vec<usize>,
    /// Name and unit of each column.
    pub names: Vec<ColumnName>,
    pub date_order: DateOrder,
    /// Whether the order of day and month is a guess.
    pub ambiguous_dates: bool,
}

impl Layout {
    /// First line of data, counted from 1.
    pub fn first_data_line(&self, lines: &[&str]) -> usize {
        self.first_row.min(lines.len().saturating_sub(1)) + 1
    }
}

/// Lines of a text with any of the three line ends.
pub(super) fn lines(text: &str) -> Vec<&str> {
    if text.contains('\n') {
        text.split('\n').map(|line| line.strip_suffix('\r').unwrap_or(line)).collect()
    } else {
        text.split('\r').collect()
    }
}

/// Whether a line is blank or a remark.
pub(super) fn is_remark(line: &str) -> bool {
    line.starts_with(['#', '%', '!', '*']) || line.starts_with("//") || line.starts_with("--")
}

fn is_blank(line: &str) -> bool {
    line.bytes().all(|b| b.is_ascii_whitespace() || b == 26)
}

/// Whether a field is a number or a time stamp.
fn is_value(field: &str, decimal: Decimal) -> bool {
    number::parse(field, decimal).is_some() || parse_stamp(field, DateOrder::DayFirst).is_some() || {
        parse_stamp(field, DateOrder::MonthFirst).is_some()
    }
}

/// A row's fields counted: all, filled, and those that are numbers or stamps.
#[derive(Debug, Clone, Copy)]
struct Count {
    all: usize,
    filled: usize,
    values: usize,
}

impl Count {
    fn of(fields: &[&str], decimal: Decimal) -> Self {
        let filled = fields.iter().filter(|f| !f.is_empty()).count();
        let values = fields.iter().filter(|f| is_value(f, decimal)).count();
        // A date and a time of day side by side are one value: otherwise blanks would seem to separate best.
        let split_stamps = fields.windows(2).filter(|w| {
            let order = DateOrder::DayFirst;
            matches!(
                (parse_stamp(w[0], order), parse_stamp(w[1], order)),
                (Some(Stamp::Date(_)), Some(Stamp::Clock(_)))
            )
        });
        Self { all: fields.len(), filled, values: values - split_stamps.count().min(values) }
    }

    fn is_data(self) -> bool {
        self.values > 0 && self.values * 5 >= self.filled * 2
    }
}

struct Candidate {
    separator: Separator,
    decimal: Decimal,
    score: f64,
    fields: usize,
    filled: usize,
}

/// Finds the format.
///
/// # Errors
/// [`ImportError::NoNumbers`], [`ImportError::OneRow`].
pub(super) fn find(lines: &[&str]) -> Result<Layout, ImportError> {
    let written: Vec<usize> = (0..lines.len()).filter(|&i| !is_blank(lines[i])).collect();
    let sample: Vec<usize> = written.iter().copied().filter(|&i| !is_remark(lines[i])).take(SAMPLE).collect();
    let mut best: Option<Candidate> = None;
    for separator in SEPARATORS {
        for decimal in [Decimal::Point, Decimal::Comma] {
            if separator == Separator::Comma && decimal == Decimal::Comma {
                continue;
            }
            let candidate = judge(lines, &sample, separator, decimal);
            if candidate.score > best.as_ref().map_or(0.0, |b| b.score * (1.0 + 1e-9)) {
                best = Some(candidate);
            }
        }
    }
    let best = best.ok_or(ImportError::NoNumbers { lines: written.len() })?;
    let (separator, decimal) = (best.separator, best.decimal);
    let mut fields = Vec::new();
    let mut count = |i: usize| {
        split(lines[i], separator, &mut fields);
        Count::of(&fields, decimal)
    };
    let is_row = |c: Count| c.is_data() && c.all * 3 >= best.fields * 2 && c.filled * 5 >= best.filled * 3;
    let start = (0..sample.len())
        .find(|&k| is_row(count(sample[k])) && sample.get(k + 1).is_none_or(|&next| is_row(count(next))));
    let start = start.ok_or(ImportError::NoNumbers { lines: written.len() })?;
    let rows: Vec<usize> = written.iter().copied().filter(|&i| i >= sample[start]).collect();
    if rows.len() < 2 {
        return Err(ImportError::OneRow { line: sample[start] + 1 });
    }
    let mut layout = Layout {
        separator,
        decimal,
        header_line: None,
        first_row: rows[0],
        fields: best.fields,
        used: Vec::new(),
        names: Vec::new(),
        date_order: DateOrder::DayFirst,
        ambiguous_dates: false,
    };
    if numbered_header(lines, &rows, separator, decimal) {
        layout.first_row = rows[1];
        layout.header_line = Some(rows[0] + 1);
    }
    find_columns(lines, &rows, &mut layout);
    name_columns(lines, &mut layout);
    Ok(layout)
}

fn judge(lines: &[&str], sample: &[usize], separator: Separator, decimal: Decimal) -> Candidate {
    let mut fields = Vec::new();
    let mut counts: Vec<Count> = Vec::new();
    for &i in sample {
        split(lines[i], separator, &mut fields);
        let count = Count::of(&fields, decimal);
        if count.is_data() {
            counts.push(count);
        }
    }
    let mut sizes: Vec<usize> = counts.iter().map(|c| c.all).collect();
    sizes.sort_unstable();
    let mut most = (0, 0);
    for group in sizes.chunk_by(|a, b| a == b) {
        if group.len() * group[0] > most.0 * most.1 {
            most = (group.len(), group[0]);
        }
    }
    let alike = counts.iter().filter(|c| c.all == most.1);
    let (values, filled) = alike.fold((0, 0), |(v, f), c| (v + c.values, f + c.filled));
    let purity = if filled > 0 { values as f64 / filled as f64 } else { 0.0 };
    // Blanks also stand inside dates and names: they separate only where nothing else does.
    let trust = if separator == Separator::Blanks { 0.6 } else { 1.0 };
    let score = values as f64 * purity.min(1.0).powi(3) * trust;
    Candidate { separator, decimal, score, fields: most.1, filled: filled / most.0.max(1) }
}

/// A first row of small whole numbers in turn, one of them left out: names of columns that have none.
fn numbered_header(lines: &[&str], rows: &[usize], separator: Separator, decimal: Decimal) -> bool {
    let (mut first, mut second) = (Vec::new(), Vec::new());
    split(lines[rows[0]], separator, &mut first);
    split(lines[rows[1]], separator, &mut second);
    let filled: Vec<f64> = first.iter().filter_map(|f| number::parse(f, decimal)).collect();
    let counts_up = filled.iter().enumerate().all(|(i, &v)| v == i as f64);
    first.len() == second.len()
        && first.first().is_some_and(|f| f.is_empty())
        && second.first().is_some_and(|f| !f.is_empty())
        && filled.len() + 1 == first.len()
        && counts_up
}

fn find_columns(lines: &[&str], rows: &[usize], layout: &mut Layout) {
    let stride = rows.len() / SAMPLE + 1;
    let mut filled = vec![false; layout.fields];
    let mut fields = Vec::new();
    let (mut day, mut month, mut dates) = (false, false, false);
    for &i in rows.iter().filter(|&&i| i >= layout.first_row).step_by(stride) {
        split(lines[i], layout.separator, &mut fields);
        for (seen, field) in filled.iter_mut().zip(&fields) {
            *seen |= !field.is_empty();
            if field.contains('/') || field.matches(['.', '-']).count() > 1 {
                let stamp =
                    parse_stamp(field, DateOrder::DayFirst).or(parse_stamp(field, DateOrder::MonthFirst));
                if matches!(stamp, Some(Stamp::Full(_) | Stamp::Date(_))) {
                    dates = true;
                    day |= order_of(field) == Some(DateOrder::DayFirst);
                    month |= order_of(field) == Some(DateOrder::MonthFirst);
                }
            }
        }
    }
    layout.used = (0..layout.fields).filter(|&i| filled[i]).collect();
    layout.date_order = if month && !day { DateOrder::MonthFirst } else { DateOrder::DayFirst };
    layout.ambiguous_dates = dates && !day && !month;
}

/// Names from the lines above the data: the topmost of the nearest block of lines with as many fields.
fn name_columns(lines: &[&str], layout: &mut Layout) {
    let mut block: Vec<(usize, Vec<String>)> = Vec::new();
    if let Some(line) = layout.header_line {
        let mut fields = Vec::new();
        split(lines[line - 1], layout.separator, &mut fields);
        block.push((line - 1, layout.used.iter().map(|&i| fields[i].to_owned()).collect()));
    } else {
        for i in (0..layout.first_row).rev() {
            match header_fields(lines[i], layout) {
                Some(fields) => block.insert(0, (i, fields)),
                None if block.is_empty() => {}
                None => break,
            }
            if layout.used.len() == 1 {
                break;
            }
        }
    }
    let Some((line, header)) = block.first() else {
        layout.names = read_names(&vec![String::new(); layout.used.len()], None);
        return;
    };
    let units = block.get(1).map(|(_, fields)| fields).filter(|fields| is_unit_row(fields));
    layout.header_line = Some(line + 1);
    layout.names = read_names(header, units.map(Vec::as_slice));
}

/// Fields of a header line, one a column, by the separator of the data or another.
fn header_fields(line: &str, layout: &Layout) -> Option<Vec<String>> {
    let line = line.trim_start_matches(['\u{feff}', ' ']);
    let line = if is_remark(line) { line.trim_start_matches(['#', '%', '!', '*', '/', '-']) } else { line };
    if is_blank(line) {
        return None;
    }
    let mut fields = Vec::new();
    let others = SEPARATORS.into_iter().filter(|&s| s != layout.separator);
    for separator in std::iter::once(layout.separator).chain(others) {
        split(line, separator, &mut fields);
        let words = fields.iter().filter(|f| !f.is_empty() && !is_value(f, layout.decimal)).count();
        let filled: Vec<&str> = fields.iter().copied().filter(|f| !f.is_empty()).collect();
        if words * 2 < filled.len() || words == 0 {
            continue;
        }
        if filled.len() == layout.used.len() && fields.len() != layout.fields {
            return Some(filled.iter().map(|f| (*f).to_owned()).collect());
        }
        if fields.len() >= layout.fields
            && filled.len() + 1 >= layout.used.len()
            && fields.len() <= layout.fields + 1
        {
            return Some(layout.used.iter().map(|&i| fields[i].to_owned()).collect());
        }
    }
    None
}
