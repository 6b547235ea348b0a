//! Times as IEC 61131-3 writes them: `DT#2024-06-28-14:35:00`, `TOD#14:35:00`, `T#1h2m3s`.

use super::stamp::{DAY_S, DateOrder, Stamp, clock_s, parse};

/// A literal of IEC 61131-3, long forms and those of Siemens among them. A duration comes out as a time of day.
pub(super) fn iec(field: &str, order: DateOrder) -> Option<Stamp> {
    let (kind, value) = field.split_once('#')?;
    match kind.to_ascii_uppercase().as_str() {
        "DT" | "LDT" | "DTL" | "DATE_AND_TIME" | "LDATE_AND_TIME" | "D" | "LD" | "DATE" | "LDATE"
            if value.starts_with(|c: char| c.is_ascii_digit()) =>
        {
            parse(value, order)
        }
        "TOD" | "LTOD" | "TIME_OF_DAY" | "LTIME_OF_DAY" => Some(Stamp::Clock(clock_s(value)?.0)),
        "T" | "LT" | "TIME" | "LTIME" | "S5T" | "S5TIME" => duration_s(value).map(Stamp::Clock),
        _ => None,
    }
}

/// Seconds of `1d2h3m4s5ms`.
fn duration_s(text: &str) -> Option<f64> {
    let text = text.to_ascii_lowercase().replace('_', "");
    let (mut rest, mut sum_s) = (text.as_str(), 0.0);
    while !rest.is_empty() {
        let digits = rest.find(|c: char| c.is_ascii_alphabetic())?;
        let letters = rest[digits..].find(|c: char| !c.is_ascii_alphabetic()).unwrap_or(rest.len() - digits);
        let value: f64 = rest[..digits].parse().ok().filter(|v: &f64| v.is_finite() && *v >= 0.0)?;
        let unit_s = match &rest[digits..digits + letters] {
            "d" => DAY_S,
            "h" => 3600.0,
            "m" => 60.0,
            "s" => 1.0,
            "ms" => 1e-3,
            "us" => 1e-6,
            "ns" => 1e-9,
            _ => return None,
        };
        sum_s += value * unit_s;
        rest = &rest[digits + letters..];
    }
    (!text.is_empty()).then_some(sum_s)
}
