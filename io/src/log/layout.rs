//! Where the data of a text file begins, what separates its fields and what its columns are called.

use super::commas::parted;
use super::header::name_columns;
use super::marks::{self, Marks, Shape};
use super::names::ColumnName;
use super::source::Sample;
use super::split::{Dialect, SEPARATORS, arrow};
use super::stamp::{DateOrder, Stamp, order_of, parse as parse_stamp};
use super::{Decimal, ImportError, ImportOptions, Separator, number};

/// Lines the format is judged by.
const SAMPLE: usize = 400;
/// What a value is worth less that may as well be none.
const DOUBT: f64 = 1e-3;
/// So many times longer a log becomes when days are read as months.
const TORN: f64 = 3.0;

/// Format of a file.
#[derive(Debug, Clone)]
pub(super) struct Layout {
    pub dialect: Dialect,
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
    /// Whether dates that read both ways are there, and some that show the order.
    pub order_shown: bool,
    /// What the marks of each field are, where any stands ahead of three digits.
    pub marks: Vec<Option<Marks>>,
    /// Sample time that a header states, in seconds.
    pub stated_sample_time_s: Option<f64>,
}

impl Layout {
    /// A field at its place in a row, as a number.
    pub fn number(&self, field: &str, at: usize) -> Option<f64> {
        match self.marks.get(at) {
            Some(Some(marks)) if marks.grouped => number::parse_grouped(field, marks.decimal),
            _ => number::parse(field, self.decimal),
        }
    }

    /// The same with a unit behind.
    pub fn quantity<'a>(&self, field: &'a str, at: usize) -> Option<(f64, &'a str)> {
        match self.marks.get(at) {
            Some(Some(marks)) => number::parse_quantity(field, marks.decimal, marks.grouped),
            _ => number::parse_quantity(field, self.decimal, false),
        }
    }
}

/// Whether a line is a remark.
pub(super) fn is_remark(line: &str) -> bool {
    line.starts_with(['#', '%', '!', '*']) || line.starts_with("//") || line.starts_with("--")
}

pub(super) fn is_blank(line: &str) -> bool {
    line.bytes().all(|b| b.is_ascii_whitespace() || b == 26 || b == 0)
}

/// Whether a field is a number, one that there is none, or a time stamp.
pub(super) fn is_value(field: &str, decimal: Decimal) -> bool {
    number::is_none(field)
        || number::parse_grouped(field, decimal).is_some()
        || number::parse_quantity(field, decimal, true).is_some()
        || parse_stamp(field, DateOrder::DayFirst).is_some()
        || parse_stamp(field, DateOrder::MonthFirst).is_some()
}

/// A row's fields counted: all, filled, and those that are numbers or stamps.
#[derive(Debug, Clone, Copy)]
struct Count {
    all: usize,
    filled: usize,
    values: usize,
    /// Those of them that are values only as a group of thousands, or that a comma between commas makes one.
    doubtful: usize,
}

impl Count {
    fn of(fields: &[&str], decimal: Decimal, separator: Separator) -> Self {
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
        let split = split_stamps.count().min(values);
        let unlikely = |field: &&&str| match Shape::of(field) {
            Shape::Lone(mark) => mark != decimal || separator.byte() == Some(mark.mark()),
            _ => false,
        };
        let doubtful = fields.iter().filter(unlikely).count();
        Self { all: fields.len(), filled: filled - split, values: values - split, doubtful }
    }

    fn is_data(self) -> bool {
        self.values > 0 && self.values * 5 >= self.filled * 2
    }
}

struct Candidate {
    dialect: Dialect,
    decimal: Decimal,
    score: f64,
    fields: usize,
    filled: usize,
}

/// Finds the format.
///
/// # Errors
/// [`ImportError::NoNumbers`], [`ImportError::OneRow`].
pub(super) fn find(sample: &Sample, options: &ImportOptions) -> Result<Layout, ImportError> {
    let lines: Vec<&str> = sample.head.iter().map(String::as_str).collect();
    let written: Vec<usize> = (0..lines.len()).filter(|&i| !is_blank(lines[i])).collect();
    let judged: Vec<usize> = written.iter().copied().filter(|&i| !is_remark(lines[i])).take(SAMPLE).collect();
    let none = || ImportError::NoNumbers { lines: written.len() };
    let best = best_candidate(&lines, &judged, options.decimal).ok_or_else(none)?;
    let (mut dialect, mut decimal) = (best.dialect, best.decimal);
    let mut fields = Vec::new();
    let mut count = |i: usize| {
        dialect.split(lines[i], &mut fields);
        Count::of(&fields, decimal, dialect.separator)
    };
    let is_row = |c: Count| c.is_data() && c.all * 3 >= best.fields * 2 && c.filled * 5 >= best.filled * 3;
    let begins = value_in_front(&lines, &judged, dialect, decimal);
    let start = (0..judged.len()).find(|&k| {
        begins(lines[judged[k]])
            && is_row(count(judged[k]))
            && judged.get(k + 1).is_none_or(|&next| is_row(count(next)))
    });
    let start = judged[start.ok_or_else(none)?];
    let rows: Vec<usize> = written.iter().copied().filter(|&i| i >= start).collect();
    if rows.len() < 2 {
        return Err(ImportError::OneRow { line: start + 1 });
    }
    let mut whole_fields = best.fields;
    if dialect.separator == Separator::Comma
        && dialect.is_plain()
        && decimal == Decimal::Point
        && let Some(ahead) = parted(&lines, rows[0], dialect)?
    {
        dialect.parted = Some(ahead);
        decimal = Decimal::Comma;
        whole_fields = usize::midpoint(best.fields, ahead);
    }
    let mut layout = Layout {
        dialect,
        decimal,
        header_line: None,
        first_row: rows[0],
        fields: whole_fields,
        used: Vec::new(),
        names: Vec::new(),
        date_order: DateOrder::DayFirst,
        ambiguous_dates: false,
        order_shown: false,
        marks: Vec::new(),
        stated_sample_time_s: stated_sample_time(&lines[..rows[0]], decimal),
    };
    if numbered_header(&lines, &rows, &layout) {
        layout.first_row = rows[1];
        layout.header_line = Some(rows[0] + 1);
    }
    let all: Vec<&str> =
        lines[layout.first_row..].iter().copied().chain(sample.beyond.iter().map(String::as_str)).collect();
    find_columns(&all, &mut layout);
    marks::settle(&all, &mut layout, options.decimal);
    if let Some(order) = options.date_order {
        layout.date_order = order;
        layout.ambiguous_dates = false;
        layout.order_shown = false;
    }
    name_columns(&lines, &mut layout);
    Ok(layout)
}

fn best_candidate(lines: &[&str], judged: &[usize], told: Option<Decimal>) -> Option<Candidate> {
    // Beside decimal commas, commas can only separate fields that stand in quotes.
    let quoted = judged.iter().any(|&i| lines[i].contains('"'));
    let arrows = judged.iter().filter(|&&i| arrow(lines[i]).is_some()).count();
    let tabbed = judged.iter().filter(|&&i| lines[i].trim().contains('\t')).count() * 10 > judged.len() * 9;
    let mut best: Option<Candidate> = None;
    for labelled in [false, true] {
        for separator in SEPARATORS {
            for decimal in [Decimal::Point, Decimal::Comma] {
                let unquoted = separator == Separator::Comma && decimal == Decimal::Comma && !quoted;
                if unquoted || told.is_some_and(|told| told != decimal) {
                    continue;
                }
                // Blanks beside tabs group thousands or part the words of names.
                if separator == Separator::Blanks && tabbed {
                    continue;
                }
                let dialect = Dialect { separator, arrow: arrows * 2 > judged.len(), labelled, parted: None };
                let candidate = judge(lines, judged, dialect, decimal);
                if candidate.score > best.as_ref().map_or(0.0, |b| b.score * (1.0 + 1e-9)) {
                    best = Some(candidate);
                }
            }
        }
    }
    best
}

/// What tells the first row from lines such as `Delta_X 0.1 0.1` above it: where nearly all lines have a value in front,
/// it has one too.
fn value_in_front<'a>(
    lines: &[&'a str],
    judged: &[usize],
    dialect: Dialect,
    decimal: Decimal,
) -> impl Fn(&'a str) -> bool + use<'a> {
    let has_value = move |line: &'a str| {
        let mut fields = Vec::new();
        dialect.split(line, &mut fields);
        fields.first().is_none_or(|f| f.is_empty() || is_value(f, decimal))
    };
    let half = &judged[judged.len() / 2..];
    let with = half.iter().filter(|&&i| has_value(lines[i])).count();
    let always = with * 10 >= half.len() * 9;
    move |line| !always || has_value(line)
}

fn judge(lines: &[&str], judged: &[usize], dialect: Dialect, decimal: Decimal) -> Candidate {
    let mut fields = Vec::new();
    let mut counts: Vec<Count> = Vec::new();
    for &i in judged {
        dialect.split(lines[i], &mut fields);
        let count = Count::of(&fields, decimal, dialect.separator);
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
    let (values, filled, doubtful) =
        alike.fold((0, 0, 0), |(v, f, d), c| (v + c.values, f + c.filled, d + c.doubtful));
    let purity = if filled > 0 { values as f64 / filled as f64 } else { 0.0 };
    // Blanks also stand inside dates and names: they separate only where nothing else does.
    let trust = if dialect.separator == Separator::Blanks { 0.6 } else { 1.0 };
    let trust = if dialect.labelled { 0.95 * trust } else { trust };
    let score = (values as f64 - DOUBT * doubtful as f64) * purity.min(1.0).powi(3) * trust;
    Candidate { dialect, decimal, score, fields: most.1, filled: filled / most.0.max(1) }
}

/// A first row of small whole numbers in turn, one of them left out: names of columns that have none.
fn numbered_header(lines: &[&str], rows: &[usize], layout: &Layout) -> bool {
    let (mut first, mut second) = (Vec::new(), Vec::new());
    layout.dialect.split(lines[rows[0]], &mut first);
    layout.dialect.split(lines[rows[1]], &mut second);
    let filled: Vec<f64> = first.iter().filter_map(|f| number::parse(f, layout.decimal)).collect();
    let counts_up = filled.iter().enumerate().all(|(i, &v)| v == i as f64);
    first.len() == second.len()
        && first.first().is_some_and(|f| f.is_empty())
        && second.first().is_some_and(|f| !f.is_empty())
        && filled.len() + 1 == first.len()
        && counts_up
}

/// The sample time in seconds that a recorder writes above its rows: `Delta_X 0.1`, `Sample time [s]: 0.2`,
/// `SampleTime[ms] 200`.
fn stated_sample_time(above: &[&str], decimal: Decimal) -> Option<f64> {
    const NAMES: [&str; 7] =
        ["delta_x", "sample time", "sampletime", "sampling time", "abtastzeit", "dt", "ts"];
    above.iter().find_map(|line| {
        let lower = line.trim_start_matches(['#', '%', ' ', '"']).to_lowercase();
        let rest = NAMES.iter().find_map(|name| lower.strip_prefix(name))?;
        let stands_alone = rest.starts_with([' ', '\t', ':', '=', ';', ',', '[', '(']);
        let says = |unit: &str| rest.split(|c: char| !c.is_alphabetic()).any(|word| word == unit);
        let unit_s = match () {
            () if says("ms") => 1e-3,
            () if says("min") => 60.0,
            () => 1.0,
        };
        let mut words = rest.split([' ', '\t', ':', '=', ';']).filter(|w| !w.is_empty());
        let value = words.find_map(|word| number::parse(word, decimal))?;
        (stands_alone && value > 0.0).then_some(value * unit_s)
    })
}

fn find_columns(rows: &[&str], layout: &mut Layout) {
    let stride = rows.len() / (4 * SAMPLE) + 1;
    let mut filled = vec![false; layout.fields];
    let mut fields = Vec::new();
    let mut dates = Dates::default();
    for line in rows.iter().step_by(stride).filter(|line| !is_remark(line)) {
        layout.dialect.split(line, &mut fields);
        for (seen, field) in filled.iter_mut().zip(&fields) {
            *seen |= !field.is_empty();
            dates.look_at(field);
        }
    }
    layout.used = (0..layout.fields).filter(|&i| filled[i]).collect();
    (layout.date_order, layout.ambiguous_dates) = dates.order();
    layout.order_shown = dates.any && !layout.ambiguous_dates;
}

/// What the dates of a file tell of their order: those that read one way only, and how long a log they make.
#[derive(Debug, Default)]
struct Dates {
    day_first: bool,
    month_first: bool,
    any: bool,
    /// A clock with AM and PM, as where the month stands first.
    twelve_hours: bool,
    /// Earliest and latest by either order, in seconds.
    ends_s: [Option<[f64; 2]>; 2],
}

impl Dates {
    fn look_at(&mut self, field: &str) {
        let is_date = field.contains('/') || field.matches(['.', '-']).count() > 1;
        if !is_date || names_its_order(field) {
            return;
        }
        for (k, order) in [DateOrder::DayFirst, DateOrder::MonthFirst].into_iter().enumerate() {
            let Some(stamp @ (Stamp::Full { .. } | Stamp::Date(_))) = parse_stamp(field, order) else {
                continue;
            };
            let s = stamp.seconds();
            let [from, to] = self.ends_s[k].unwrap_or([s, s]);
            self.ends_s[k] = Some([from.min(s), to.max(s)]);
            self.any = true;
            let lower = field.to_ascii_lowercase();
            self.twelve_hours |= field.contains('/') && (lower.ends_with("am") || lower.ends_with("pm"));
            self.day_first |= order_of(field) == Some(DateOrder::DayFirst);
            self.month_first |= order_of(field) == Some(DateOrder::MonthFirst);
        }
    }

    /// The order, and whether it is a guess. A month read as a day tears a log of days apart into one of months.
    fn order(&self) -> (DateOrder, bool) {
        let length = |k: usize| self.ends_s[k].map_or(f64::INFINITY, |[from, to]| to - from);
        match (self.day_first, self.month_first) {
            (true, _) => (DateOrder::DayFirst, false),
            (false, true) => (DateOrder::MonthFirst, false),
            _ if length(0) > TORN * length(1) => (DateOrder::MonthFirst, false),
            _ if self.twelve_hours => (DateOrder::MonthFirst, true),
            _ => (DateOrder::DayFirst, self.any && length(1) <= TORN * length(0)),
        }
    }
}

/// Whether the year stands first, the month has a name or dots stand between, as where the day comes first: then nothing
/// is to be guessed.
fn names_its_order(date: &str) -> bool {
    date.as_bytes().get(..4).is_some_and(|y| y.iter().all(u8::is_ascii_digit))
        || date
            .split([' ', 'T', ','])
            .next()
            .is_some_and(|d| d.contains(char::is_alphabetic) || d.matches('.').count() == 2)
}
