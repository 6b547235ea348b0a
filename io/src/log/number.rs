//! Numbers as plants write them: decimal point or comma, exponents, a percent sign, a unit behind.

use super::Decimal;
use super::marks::Shape;
use super::names::is_unit;

/// Powers of ten that f64 holds exactly.
const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18,
    1e19, 1e20, 1e21, 1e22,
];
const TENS: [u64; 9] = [1, 10, 100, 1000, 10_000, 100_000, 1_000_000, 10_000_000, 100_000_000];
/// Longest text of a number with more digits than a plain one.
const LONGEST: usize = 64;

impl Decimal {
    pub(super) fn mark(self) -> u8 {
        match self {
            Self::Point => b'.',
            Self::Comma => b',',
        }
    }

    pub(super) fn other(self) -> Self {
        match self {
            Self::Point => Self::Comma,
            Self::Comma => Self::Point,
        }
    }
}

/// A trimmed field as a number; `None` for anything else, also for NaN, ∞ and the empty field.
pub(super) fn parse(field: &str, decimal: Decimal) -> Option<f64> {
    match scan(field.as_bytes(), 0, decimal.mark()) {
        Some((value, end)) if end == field.len() => Some(value),
        _ => slow(field, decimal),
    }
}

/// Whether a field says that there is no number, as programs in C print NaN and ∞; those of Windows `1.#QNAN`, `-1.#J`.
pub(super) fn is_none(field: &str) -> bool {
    const WORDS: [&str; 6] = ["nan", "inf", "infinity", "qnan", "nan(ind)", "nan(snan)"];
    let bare = field.trim_start_matches(['-', '+']);
    let is_word = || WORDS.iter().any(|word| bare.eq_ignore_ascii_case(word));
    bare.starts_with("1.#") || bare.starts_with("1,#") || is_word()
}

/// [`parse`] where the mark that is not the decimal one groups thousands: `1.234` beside decimal commas is 1234.
pub(super) fn parse_grouped(field: &str, decimal: Decimal) -> Option<f64> {
    let group = char::from(decimal.other().mark());
    let lone = || matches!(Shape::of(field), Shape::Lone(mark) if mark != decimal);
    parse(field, decimal).or_else(|| {
        if !lone() {
            return None;
        }
        parse(&field.replace(group, ""), decimal)
    })
}

/// A number with a unit behind it, as in `23.5 °C` or `40%`: both. `grouped`: as [`parse_grouped`] reads it.
pub(super) fn parse_quantity(field: &str, decimal: Decimal, grouped: bool) -> Option<(f64, &str)> {
    let starts_unit = |(at, c): (usize, char)| {
        let is_exponent = || {
            let rest = || field[at + 1..].trim_start_matches(['+', '-']);
            matches!(c, 'e' | 'E') && rest().starts_with(|c: char| c.is_ascii_digit())
        };
        (c.is_alphabetic() || matches!(c, '%' | '°')) && !is_exponent()
    };
    let (end, _) = field.char_indices().find(|c| starts_unit(*c))?;
    let read = if grouped { parse_grouped } else { parse };
    let (value, unit) = (read(field[..end].trim_end(), decimal)?, field[end..].trim());
    is_unit(unit).then_some((value, unit))
}

/// A number from `start` on: its value and where it ends. The bytes may go on behind it.
pub(super) fn scan(bytes: &[u8], start: usize, mark: u8) -> Option<(f64, usize)> {
    let sign = *bytes.get(start)?;
    let first = start + usize::from(sign == b'-' || sign == b'+');
    let (mut at, mut mantissa) = (first, 0_u64);
    digits(bytes, &mut at, &mut mantissa);
    let mut count = at - first;
    let mut scale = 0;
    if bytes.get(at) == Some(&mark) {
        at += 1;
        let from = at;
        digits(bytes, &mut at, &mut mantissa);
        count += at - from;
        scale = -i32::try_from(at - from).ok()?;
    }
    if count == 0 {
        return None;
    }
    if matches!(bytes.get(at), Some(b'e' | b'E'))
        && let Some((power, end)) = exponent(bytes, at + 1)
    {
        scale += power;
        at = end;
    }
    // Clinger 1990: a product or quotient of two exact f64 is correctly rounded.
    if count <= 19 && mantissa < (1 << 53) && scale.unsigned_abs() <= 22 {
        let power = POWERS[scale.unsigned_abs() as usize];
        let value = if scale < 0 { mantissa as f64 / power } else { mantissa as f64 * power };
        return Some((if sign == b'-' { -value } else { value }, at));
    }
    let value = long(&bytes[start..at], mark)?;
    value.is_finite().then_some((value, at))
}

/// Takes the run of digits at `at` into `mantissa`, eight at a time; wraps beyond 19.
fn digits(bytes: &[u8], at: &mut usize, mantissa: &mut u64) {
    while let Some(eight) = bytes.get(*at..*at + 8) {
        let word = u64::from_le_bytes([
            eight[0], eight[1], eight[2], eight[3], eight[4], eight[5], eight[6], eight[7],
        ]) ^ 0x3030_3030_3030_3030;
        // The high bit of each byte that is no digit: above 9, or with a high bit of its own.
        let other = (word.wrapping_add(0x7676_7676_7676_7676) | word) & 0x8080_8080_8080_8080;
        let count = other.trailing_zeros() as usize / 8;
        if count == 0 {
            return;
        }
        *mantissa = mantissa.wrapping_mul(TENS[count]).wrapping_add(eight_digits(word << (64 - 8 * count)));
        *at += count;
        if count < 8 {
            return;
        }
    }
    while let Some(d) = bytes.get(*at).map(|b| b.wrapping_sub(b'0')).filter(|d| *d < 10) {
        *mantissa = mantissa.wrapping_mul(10).wrapping_add(u64::from(d));
        *at += 1;
    }
}

/// Eight digits, the first in the lowest byte, by three multiplications. Source: Lemire, Number parsing at a gigabyte
/// per second (2021), §5.
fn eight_digits(word: u64) -> u64 {
    let pairs = word.wrapping_mul(10).wrapping_add(word >> 8);
    let low = (pairs & 0x0000_00FF_0000_00FF).wrapping_mul(0x000F_4240_0000_0064);
    let high = ((pairs >> 16) & 0x0000_00FF_0000_00FF).wrapping_mul(0x0000_2710_0000_0001);
    low.wrapping_add(high) >> 32
}

fn exponent(bytes: &[u8], start: usize) -> Option<(i32, usize)> {
    let sign = *bytes.get(start)?;
    let first = start + usize::from(sign == b'-' || sign == b'+');
    let (mut at, mut power) = (first, 0_i32);
    while let Some(d) = bytes.get(at).map(|b| b.wrapping_sub(b'0')).filter(|d| *d < 10) {
        power = (power * 10 + i32::from(d)).min(9999);
        at += 1;
    }
    (at > first).then_some((if sign == b'-' { -power } else { power }, at))
}

/// Numbers of more digits or a wider range than the short way takes.
fn long(text: &[u8], mark: u8) -> Option<f64> {
    if mark == b'.' || !text.contains(&mark) {
        return std::str::from_utf8(text).ok()?.parse().ok();
    }
    let mut plain = [0; LONGEST];
    let plain = plain.get_mut(..text.len())?;
    plain.iter_mut().zip(text).for_each(|(to, &b)| *to = if b == mark { b'.' } else { b });
    std::str::from_utf8(plain).ok()?.parse().ok()
}

fn slow(field: &str, decimal: Decimal) -> Option<f64> {
    // Spaces of any width group thousands; a typographer's minus is one.
    if field.contains([' ', '\u{a0}', '\u{2009}', '\u{202f}', '\u{2212}']) {
        let spaces = [' ', '\u{a0}', '\u{2009}', '\u{202f}'];
        let plain = field.trim_end_matches('%').trim_end().replace('\u{2212}', "-").replace(spaces, "'");
        return slow(&plain, decimal);
    }
    let field = field.strip_suffix('%').map_or(field, str::trim_end);
    let sign_ok = |b| matches!(b, b'+' | b'-' | b'.' | b',' | b'e' | b'E' | b'd' | b'D' | b'\'');
    if !field.bytes().all(|b| b.is_ascii_digit() || sign_ok(b)) {
        return None;
    }
    let (group, mark) = match decimal {
        Decimal::Point => (',', '.'),
        Decimal::Comma => ('.', ','),
    };
    let (whole, fraction) = field.split_once(mark).unwrap_or((field, ""));
    let marked = whole.len() < field.len();
    if fraction.contains([group, mark, '\''])
        || !grouped(whole, group, marked) && !grouped(whole, '\'', marked)
    {
        return None;
    }
    let plain: String = field
        .chars()
        .filter(|c| *c != group && *c != '\'')
        .map(|c| match c {
            'd' | 'D' => 'e',
            c if c == mark => '.',
            c => c,
        })
        .collect();
    plain.parse().ok().filter(|v: &f64| v.is_finite())
}

/// Whether marks stand only between groups of three digits. A lone `1.234` under a decimal comma, with no decimals
/// behind it, is not taken: it may as well be a decimal point.
fn grouped(whole: &str, mark: char, has_decimals: bool) -> bool {
    let mut groups = whole.trim_start_matches(['-', '+']).split(mark);
    let first = groups.next().unwrap_or("");
    let rest: Vec<&str> = groups.collect();
    rest.is_empty() && !whole.contains([',', '.', '\''])
        || (rest.len() >= if has_decimals { 1 } else { 2 }
            && (1..=3).contains(&first.len())
            && rest.iter().all(|g| g.bytes().all(|b| b.is_ascii_digit()))
            && (rest.iter().all(|g| g.len() == 3) || mark == ',' && in_lakhs(first, &rest)))
}

/// Whether groups are those of India: 2,50,000 is a quarter of a million.
fn in_lakhs(first: &str, rest: &[&str]) -> bool {
    let (last, middle) = rest.split_last().unwrap_or((&"", &[]));
    first.len() <= 2 && last.len() == 3 && !middle.is_empty() && middle.iter().all(|g| g.len() == 2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_the_standard_library_to_the_last_bit() {
        let mut seed = 7_u64;
        let mut next = move || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            seed >> 16
        };
        for _ in 0..200_000 {
            let value = f64::from_bits(next() << 16 | next());
            if !value.is_finite() {
                continue;
            }
            let digits = (next() % 19) as usize;
            for text in
                [format!("{value:e}"), format!("{:.digits$}", value % 1e9), format!("{}", next() % 1000)]
            {
                let expected: f64 = text.parse().expect("a number");
                assert_eq!(parse(&text, Decimal::Point), Some(expected).filter(|v| v.is_finite()), "{text}");
                let comma = text.replace('.', ",");
                if comma.len() < LONGEST {
                    assert_eq!(parse(&comma, Decimal::Comma), Some(expected), "{comma}");
                }
            }
        }
    }

    #[test]
    fn groups_of_thousands_are_read_and_doubtful_ones_are_not() {
        for (text, decimal, value) in [
            ("1.234,5", Decimal::Comma, Some(1234.5)),
            ("1,234,567.25", Decimal::Point, Some(1_234_567.25)),
            ("1'234.5", Decimal::Point, Some(1234.5)),
            ("-12.345.678", Decimal::Comma, Some(-12_345_678.0)),
            ("1.234", Decimal::Comma, None),
            ("12.34,5", Decimal::Comma, None),
            ("1,5", Decimal::Point, None),
            ("1.5", Decimal::Comma, None),
            ("1.2.3", Decimal::Point, None),
            ("40 %", Decimal::Point, Some(40.0)),
            ("1 234,5", Decimal::Comma, Some(1234.5)),
            ("\u{2212}7.5", Decimal::Point, Some(-7.5)),
            ("1 2,5", Decimal::Comma, None),
            ("1 2", Decimal::Point, None),
            ("10 000", Decimal::Point, None),
            ("2,50,000", Decimal::Point, Some(250_000.0)),
            ("2,5,000", Decimal::Point, None),
            ("1.5D-3", Decimal::Point, Some(1.5e-3)),
            ("1e999", Decimal::Point, None),
            ("nan", Decimal::Point, None),
            (".5", Decimal::Point, Some(0.5)),
            ("-", Decimal::Point, None),
        ] {
            assert_eq!(parse(text, decimal), value, "{text}");
        }
    }
}
