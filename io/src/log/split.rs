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

/// Puts the fields of a line into `fields`, which is emptied first.
pub(super) fn split<'a>(line: &'a str, separator: Separator, fields: &mut Vec<&'a str>) {
    fields.clear();
    if line.contains('"') && separator != Separator::Blanks {
        return split_quoted(line, separator, fields);
    }
    match separator {
        Separator::Tab => split_at(line, b'\t', fields),
        Separator::Semicolon => split_at(line, b';', fields),
        Separator::Comma => split_at(line, b',', fields),
        Separator::Bar => split_at(line, b'|', fields),
        Separator::DoubleBar => fields.extend(line.split("||").map(clean)),
        Separator::Blanks => fields.extend(line.split_whitespace().map(clean)),
    }
}

fn split_at<'a>(line: &'a str, mark: u8, fields: &mut Vec<&'a str>) {
    let mut start = 0;
    for (i, b) in line.bytes().enumerate() {
        if b == mark {
            fields.push(clean(&line[start..i]));
            start = i + 1;
        }
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

fn clean(field: &str) -> &str {
    let needs = |b: Option<u8>| b.is_some_and(|b| b <= b' ' || b >= 0x80 || b == b'"' || b == b'\'');
    let bytes = field.as_bytes();
    if !needs(bytes.first().copied()) && !needs(bytes.last().copied()) {
        return field;
    }
    let field = field.trim_matches(|c: char| c.is_whitespace() || c == '\u{feff}' || c == '\u{1a}');
    for quote in ['"', '\''] {
        if field.len() >= 2 && field.starts_with(quote) && field.ends_with(quote) {
            return field[1..field.len() - 1].trim();
        }
    }
    field
}
