//! A line into its fields, trimmed and without quotes.

use super::Separator;

/// All separators, those that also occur inside fields last.
pub(super) const SEPARATORS: [Separator; 6] = [
    Separator::Tab,
    Separator::Semicolon,
    Separator::DoubleBar,
    Separator::Bar,
    Separator::Comma,
    Separator::Blanks,
];

impl Separator {
    /// The byte it is, where it is a single one.
    pub(super) fn byte(self) -> Option<u8> {
        match self {
            Self::Tab => Some(b'\t'),
            Self::Semicolon => Some(b';'),
            Self::Comma => Some(b','),
            Self::Bar => Some(b'|'),
            Self::DoubleBar | Self::Blanks => None,
        }
    }
}

/// How lines fall into fields.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Dialect {
    pub separator: Separator,
    /// A serial monitor's stamp and arrow stand before the row: `12:30:05.250 -> 23.5,40`.
    pub arrow: bool,
    /// Each field has its name: `T1:23.5` or `T1=23.5`.
    pub labelled: bool,
    /// Behind so many fields each two are a number and its decimals: `0,50,00,30,00`.
    pub parted: Option<usize>,
}

impl Dialect {
    /// Whether rows are nothing but fields and separators.
    pub fn is_plain(self) -> bool {
        !self.arrow && !self.labelled && self.parted.is_none()
    }

    /// Puts the fields of a line into `fields`, which is emptied first.
    pub fn split<'a>(self, line: &'a str, fields: &mut Vec<&'a str>) {
        fields.clear();
        let mut rest = line;
        if self.arrow
            && let Some((stamp, row)) = arrow(line)
        {
            fields.push(clean(stamp));
            rest = row;
        }
        if rest.contains('"') && self.separator != Separator::Blanks {
            split_quoted(rest, self.separator, fields);
        } else {
            match self.separator {
                Separator::DoubleBar => fields.extend(rest.split("||").map(clean)),
                Separator::Blanks => fields.extend(rest.split_whitespace().map(clean)),
                other => split_at(rest, other.byte().unwrap_or(b','), fields),
            }
        }
        if let Some(ahead) = self.parted {
            put_together(rest, ahead, fields);
        }
        if self.labelled {
            fields.iter_mut().for_each(|field| *field = labelled(field).map_or(*field, |(_, value)| value));
        }
    }
}

/// A serial monitor's stamp and the row behind its arrow.
pub(super) fn arrow(line: &str) -> Option<(&str, &str)> {
    line.split_once("->").filter(|(stamp, _)| stamp.len() <= 32 && stamp.contains(':'))
}

/// Name and value of a field that has both.
pub(super) fn labelled(field: &str) -> Option<(&str, &str)> {
    let (name, value) = field.rsplit_once([':', '='])?;
    let (name, value) = (name.trim(), value.trim());
    let numeric = value.starts_with(|c: char| c.is_ascii_digit() || matches!(c, '-' | '+' | '.'));
    (name.starts_with(char::is_alphabetic) && numeric).then_some((name, value))
}

/// Makes one field of each two behind the first `ahead`, all of them parts of `line`.
fn put_together<'a>(line: &'a str, ahead: usize, fields: &mut Vec<&'a str>) {
    let place = |field: &str| field.as_ptr() as usize - line.as_ptr() as usize;
    let mut kept = ahead.min(fields.len());
    for at in (kept..fields.len()).step_by(2) {
        let last = fields[(at + 1).min(fields.len() - 1)];
        fields[kept] = &line[place(fields[at])..place(last) + last.len()];
        kept += 1;
    }
    fields.truncate(kept);
}

fn split_at<'a>(line: &'a str, mark: u8, fields: &mut Vec<&'a str>) {
    let mut start = 0;
    for i in memchr::memchr_iter(mark, line.as_bytes()) {
        fields.push(clean(&line[start..i]));
        start = i + 1;
    }
    fields.push(clean(&line[start..]));
}

fn split_quoted<'a>(line: &'a str, separator: Separator, fields: &mut Vec<&'a str>) {
    let mark = match separator {
        Separator::Tab => "\t",
        Separator::Semicolon => ";",
        Separator::Comma => ",",
        Separator::Bar => "|",
        Separator::DoubleBar | Separator::Blanks => "||",
    };
    let (mut start, mut at, mut inside) = (0, 0, false);
    while at < line.len() {
        let rest = &line.as_bytes()[at..];
        if rest[0] == b'"' {
            inside = !inside;
        } else if !inside && rest.starts_with(mark.as_bytes()) {
            fields.push(clean(&line[start..at]));
            at += mark.len();
            start = at;
            continue;
        }
        at += 1;
    }
    fields.push(clean(&line[start..]));
}

/// A field without blanks, marks and quotes around it.
pub(super) fn clean(field: &str) -> &str {
    let needs = |b: Option<u8>| b.is_some_and(|b| b <= b' ' || b >= 0x80 || matches!(b, b'"' | b'\'' | b'='));
    let bytes = field.as_bytes();
    if !needs(bytes.first().copied()) && !needs(bytes.last().copied()) {
        return field;
    }
    let blank = |c: char| c.is_whitespace() || matches!(c, '\u{feff}' | '\u{1a}' | '\0');
    let field = field.trim_matches(blank);
    // ="0012" keeps a spreadsheet from reading a number.
    let field = field.strip_prefix('=').filter(|f| f.starts_with('"')).unwrap_or(field);
    for quote in ['"', '\''] {
        if field.len() >= 2 && field.starts_with(quote) && field.ends_with(quote) {
            return field[1..field.len() - 1].trim_matches(blank);
        }
    }
    field
}
