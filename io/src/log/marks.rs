//! Points and commas ahead of three digits: decimals, or groups of thousands.
//!
//! A program that writes `0.5` groups no thousands with points, and one that writes `1.250` beside `980` would have cut a
//! decimal's zero: what the file shows elsewhere decides, and where nothing does the report says so.

use super::layout::{Layout, is_remark};
use super::{Decimal, Repair, Separator, number};

/// So many different numbers of exactly three decimals, beside whole ones, are no decimals.
const ENOUGH: usize = 5;

/// How a field is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Shape {
    /// Digits alone; whether they are so many that a program that groups would have grouped them.
    Whole { long: bool },
    /// `1.234`: one mark, three digits behind it.
    Lone(Decimal),
    /// A decimal mark for certain.
    Decimals(Decimal),
    /// No number.
    Other,
}

impl Shape {
    /// The shape of a field, a sign ahead and a unit behind left aside.
    pub fn of(field: &str) -> Self {
        let digits = field.trim_start_matches(['-', '+', '\u{2212}']);
        let end =
            digits.find(|c: char| !c.is_ascii_digit() && !matches!(c, '.' | ',')).unwrap_or(digits.len());
        let (digits, rest) = digits.split_at(end);
        let is_power = rest.len() > 1 && rest.starts_with(['e', 'E']);
        if !rest.trim_start().is_empty() && !is_power && !rest.trim_start().starts_with(is_unit_start) {
            return Self::Other;
        }
        let mark = |c: u8| if c == b'.' { Decimal::Point } else { Decimal::Comma };
        let mut marks = digits.bytes().filter(|b| !b.is_ascii_digit());
        match (marks.next(), marks.next_back()) {
            (None, _) if digits.is_empty() => Self::Other,
            (None, _) => Self::Whole { long: digits.len() > 3 },
            (Some(one), None) => {
                let (whole, behind) = digits.split_once(char::from(one)).unwrap_or((digits, ""));
                if whole.is_empty() && behind.is_empty() {
                    Self::Other
                } else if behind.len() == 3 && is_first_group(whole) && !is_power {
                    Self::Lone(mark(one))
                } else {
                    Self::Decimals(mark(one))
                }
            }
            (Some(first), Some(last)) if first != last => Self::Decimals(mark(last)),
            (Some(first), Some(_)) => {
                let mut groups = digits.split(char::from(first));
                let whole = groups.next().is_some_and(is_first_group) && groups.all(|g| g.len() == 3);
                if whole { Self::Decimals(mark(first).other()) } else { Self::Other }
            }
        }
    }
}

fn is_unit_start(c: char) -> bool {
    c.is_alphabetic() || matches!(c, '%' | '°')
}

fn is_first_group(digits: &str) -> bool {
    (1..=3).contains(&digits.len()) && !digits.starts_with('0')
}

/// How the marks of a column are read, where it has any ahead of three digits.
#[derive(Debug, Clone)]
pub(super) struct Marks {
    /// The decimal mark of the column.
    pub decimal: Decimal,
    /// Whether the other mark groups thousands, also where it stands alone.
    pub grouped: bool,
    /// Whether nothing in the file tells.
    pub doubtful: bool,
    /// The first such field.
    pub text: String,
}

/// What the fields of a column show.
#[derive(Debug, Clone, Default)]
struct Seen {
    short: bool,
    long: bool,
    /// By decimal mark.
    decimals: [bool; 2],
    lone: [Vec<String>; 2],
    /// One of the lone groups ends in a zero.
    zero: bool,
}

impl Seen {
    fn add(&mut self, field: &str) {
        match Shape::of(field) {
            Shape::Whole { long } => {
                self.long |= long;
                self.short |= !long;
            }
            Shape::Decimals(mark) => self.decimals[mark as usize] = true,
            Shape::Lone(mark) => {
                let lone = &mut self.lone[mark as usize];
                if lone.len() < ENOUGH && !lone.iter().any(|other| other == field) {
                    lone.push(field.to_owned());
                }
                self.zero |= field.trim_end_matches(|c: char| !c.is_ascii_digit()).ends_with('0');
            }
            Shape::Other => {}
        }
    }
}

/// Settles what the marks of each field of a layout are, by the rows of its sample.
pub(super) fn settle(rows: &[&str], layout: &mut Layout, told: Option<Decimal>) {
    let mut seen = vec![Seen::default(); layout.fields];
    let mut fields = Vec::new();
    for line in rows.iter().filter(|line| !is_remark(line)) {
        layout.dialect.split(line, &mut fields);
        seen.iter_mut().zip(&fields).for_each(|(seen, field)| seen.add(field));
    }
    let certain = [0, 1].map(|mark| {
        told.map_or_else(
            || seen.iter().any(|column| column.decimals[mark]),
            |decimal| decimal as usize == mark,
        )
    });
    let separator = layout.dialect.separator;
    layout.marks = seen.iter().map(|column| marks_of(column, layout.decimal, certain, separator)).collect();
    // A file of nothing but numbers with three decimals has that many by its format.
    if !seen.iter().any(|column| column.short || column.long) {
        layout.marks.iter_mut().flatten().filter(|m| !m.grouped).for_each(|marks| marks.doubtful = false);
    }
}

fn marks_of(seen: &Seen, decimal: Decimal, certain: [bool; 2], separator: Separator) -> Option<Marks> {
    let (own, other) = (decimal as usize, decimal.other() as usize);
    // Numbers of four digits and more without a mark: nothing is grouped here.
    if let Some(text) = seen.lone[other].first().filter(|_| !seen.long) {
        // A comma that separates fields as well is the less likely decimal mark, but may be one.
        let doubtful = !certain[own] && !seen.short && separator == Separator::Comma;
        return Some(Marks { decimal, grouped: true, doubtful, text: text.clone() });
    }
    let text = seen.lone[own].first().filter(|_| !seen.decimals[own] && !seen.long)?;
    if certain[own] {
        return None;
    }
    let beside_whole = seen.short && (seen.zero || seen.lone[own].len() >= ENOUGH);
    let grouped = certain[other] || beside_whole;
    let decimal = if grouped { decimal.other() } else { decimal };
    Some(Marks { decimal, grouped, doubtful: !grouped, text: text.clone() })
}

impl Marks {
    /// What to say of columns of these marks.
    pub fn repairs<'a>(columns: impl Iterator<Item = (&'a str, &'a Self)>) -> Vec<Repair> {
        let (mut grouped, mut doubtful): (Vec<_>, Vec<_>) = (Vec::new(), Vec::new());
        for one in columns {
            if one.1.doubtful { &mut doubtful } else { &mut grouped }.push(one);
        }
        let names = |of: &[(&str, &Self)]| of.iter().map(|one| one.0).collect::<Vec<_>>().join(", ");
        let mut out = Vec::new();
        if let Some((_, first)) = grouped.first() {
            out.extend(first.value().map(|value| Repair::GroupedThousands {
                columns: names(&grouped),
                text: first.text.clone(),
                value,
            }));
        }
        if let Some((_, first)) = doubtful.first() {
            let mut swapped = (*first).clone();
            swapped.grouped = !first.grouped;
            swapped.decimal = first.decimal.other();
            if let (Some(value), Some(other)) = (first.value(), swapped.value()) {
                let (columns, text) = (names(&doubtful), first.text.clone());
                out.push(Repair::ThousandsOrDecimals { columns, text, value, other });
            }
        }
        out
    }

    fn value(&self) -> Option<f64> {
        let read = if self.grouped { number::parse_grouped } else { number::parse };
        read(&self.text, self.decimal).or_else(|| {
            number::parse_quantity(&self.text, self.decimal, self.grouped).map(|(value, _)| value)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_field_shows_what_its_marks_are() {
        use Decimal::{Comma, Point};
        for (field, shape) in [
            ("12", Shape::Whole { long: false }),
            ("-1200", Shape::Whole { long: true }),
            ("1.234", Shape::Lone(Point)),
            ("-12,345 kg/h", Shape::Lone(Comma)),
            ("0.234", Shape::Decimals(Point)),
            ("1234,567", Shape::Decimals(Comma)),
            ("1.234,5", Shape::Decimals(Comma)),
            ("1,234,567", Shape::Decimals(Point)),
            ("1.234e5", Shape::Decimals(Point)),
            (".5", Shape::Decimals(Point)),
            ("1.2.24", Shape::Other),
            ("12:30:05.250", Shape::Other),
            ("Bad", Shape::Other),
            ("", Shape::Other),
            (".", Shape::Other),
        ] {
            assert_eq!(Shape::of(field), shape, "{field}");
        }
    }
}
