//! Numbers as plants write them: decimal point or comma, exponents, a percent sign.

use super::Decimal;

/// Powers of ten that f64 holds exactly.
const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18,
    1e19, 1e20, 1e21, 1e22,
];

/// A trimmed field as a number; `None` for anything else, also for NaN, ∞ and the empty field.
pub(super) fn parse(field: &str, decimal: Decimal) -> Option<f64> {
    let bytes = field.as_bytes();
    let mark = match decimal {
        Decimal::Point => b'.',
        Decimal::Comma => b',',
    };
    let negative = bytes.first() == Some(&b'-');
    let mut at = usize::from(negative || bytes.first() == Some(&b'+'));
    let (mut mantissa, mut digits, mut scale) = (0_u64, 0_usize, 0_i32);
    let mut fraction = false;
    while let Some(&b) = bytes.get(at) {
        if b.is_ascii_digit() {
            mantissa = mantissa.wrapping_mul(10).wrapping_add(u64::from(b - b'0'));
            digits += 1;
            scale -= i32::from(fraction);
        } else if b == mark && !fraction {
            fraction = true;
        } else {
            break;
        }
        at += 1;
    }
    if digits == 0 {
        return None;
    }
    if at < bytes.len() {
        return slow(field, decimal);
    }
    // Clinger 1990: a product or quotient of two exact f64 is correctly rounded.
    if digits <= 19 && mantissa < (1 << 53) && scale >= -22 {
        let value = mantissa as f64 / POWERS[scale.unsigned_abs() as usize];
        return Some(if negative { -value } else { value });
    }
    slow(field, decimal)
}

/// A plain number of digits and at most one mark, from `at` on: its value and where it ends.
pub(super) fn scan(bytes: &[u8], start: usize, mark: u8) -> Option<(f64, usize)> {
    let negative = bytes.get(start) == Some(&b'-');
    let first = start + usize::from(negative);
    let (mut at, mut mantissa) = (first, 0_u64);
    let mut digit = |at: &mut usize| {
        let from = *at;
        while let Some(d) = bytes.get(*at).map(|b| b.wrapping_sub(b'0')).filter(|d| *d < 10) {
            mantissa = mantissa.wrapping_mul(10).wrapping_add(u64::from(d));
            *at += 1;
        }
        *at - from
    };
    let whole = digit(&mut at);
    let mut decimals = 0;
    if bytes.get(at) == Some(&mark) {
        at += 1;
        decimals = digit(&mut at);
    }
    if whole + decimals == 0 || whole + decimals > 15 {
        return None;
    }
    let value = mantissa as f64 / POWERS[decimals];
    Some((if negative { -value } else { value }, at))
}

fn slow(field: &str, decimal: Decimal) -> Option<f64> {
    let field = field.strip_suffix('%').map_or(field, str::trim_end);
    if !field
        .bytes()
        .all(|b| b.is_ascii_digit() || matches!(b, b'+' | b'-' | b'.' | b',' | b'e' | b'E' | b'd' | b'D'))
    {
        return None;
    }
    let value = match decimal {
        Decimal::Point if field.contains(['d', 'D']) => field.replace(['d', 'D'], "e").parse(),
        Decimal::Point => field.parse(),
        Decimal::Comma if field.contains('.') && !field.contains(',') => return None,
        Decimal::Comma => field.replace('.', "").replace(',', ".").parse(),
    };
    value.ok().filter(|v: &f64| v.is_finite())
}
