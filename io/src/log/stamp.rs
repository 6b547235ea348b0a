//! Dates and times of day as plants write them, in seconds since 1970 on the file's own clock.

/// Which of day and month a date written with slashes begins with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum DateOrder {
    DayFirst,
    MonthFirst,
}

/// A field read as time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Stamp {
    /// Date and time of day: seconds since 1970-01-01.
    Full(f64),
    /// Date alone: seconds of its midnight.
    Date(f64),
    /// Time of day alone: seconds since midnight.
    Clock(f64),
}

const MONTHS: [[&str; 2]; 12] = [
    ["jan", "jan"],
    ["feb", "fev"],
    ["mar", "mar"],
    ["apr", "abr"],
    ["may", "mai"],
    ["jun", "jun"],
    ["jul", "jul"],
    ["aug", "ago"],
    ["sep", "set"],
    ["oct", "out"],
    ["nov", "nov"],
    ["dec", "dez"],
];

/// ISO 8601, dd/mm/yyyy or mm/dd/yyyy with any of `/ - .`, dd-Mon-yyyy, with or without a time of day, zone or AM/PM.
pub(super) fn parse(field: &str, order: DateOrder) -> Option<Stamp> {
    if !field.as_bytes().first()?.is_ascii_digit() || field.len() < 5 || field.len() > 40 {
        return None;
    }
    let cut = field.find(['T', ' ', '\t']).filter(|&i| i >= 6);
    let (date, clock) = match cut {
        Some(i) => (&field[..i], field[i + 1..].trim_start()),
        None => (field, ""),
    };
    match day(date, order) {
        Some(midnight) if clock.is_empty() => Some(Stamp::Date(midnight)),
        Some(midnight) => clock_s(clock).map(|s| Stamp::Full(midnight + s)),
        None => clock_s(field).map(Stamp::Clock),
    }
}

/// Whether a date can only be read with the day, or only with the month, in front.
pub(super) fn order_of(field: &str) -> Option<DateOrder> {
    let date = field.split([' ', 'T', '\t']).next()?;
    let parts: Vec<u32> = date.split(['/', '-', '.']).map_while(|p| p.parse().ok()).collect();
    match parts[..] {
        [a, _, _] if a > 31 => Some(DateOrder::DayFirst),
        [a, b, _] if a > 12 && b <= 12 => Some(DateOrder::DayFirst),
        [a, b, _] if b > 12 && a <= 12 => Some(DateOrder::MonthFirst),
        _ => None,
    }
}

/// ISO 8601 of seconds since 1970.
pub(super) fn iso(seconds: f64) -> String {
    let days = (seconds / 86_400.0).floor();
    let clock = seconds - 86_400.0 * days;
    let millis = (clock * 1000.0).round() as u64;
    let (y, m, d) = civil(days as i64);
    let (h, min, s, ms) = (millis / 3_600_000, millis / 60_000 % 60, millis / 1000 % 60, millis % 1000);
    let fraction = if ms > 0 { format!(".{ms:03}") } else { String::new() };
    format!("{y:04}-{m:02}-{d:02}T{h:02}:{min:02}:{s:02}{fraction}")
}

fn day(date: &str, order: DateOrder) -> Option<f64> {
    let mut parts = date.split(['/', '-', '.']);
    let (a, b, c) = (parts.next()?, parts.next()?, parts.next()?);
    if parts.next().is_some() {
        return None;
    }
    let (first, last): (i64, i64) = (a.parse().ok()?, c.parse().ok()?);
    let (y, m, d) = match (b.parse::<i64>(), a.len(), order) {
        (Ok(b), 4, _) => (first, b, last),
        (Ok(b), _, DateOrder::DayFirst) => (last, b, first),
        (Ok(b), _, DateOrder::MonthFirst) => (last, first, b),
        (Err(_), 4, _) => (first, month(b)?, last),
        (Err(_), _, _) => (last, month(b)?, first),
    };
    let y = if (0..100).contains(&y) { y + 2000 } else { y };
    let sane = (1900..2200).contains(&y) && (1..=12).contains(&m) && (1..=31).contains(&d);
    sane.then(|| days_from_civil(y, m, d) as f64 * 86_400.0)
}

fn month(name: &str) -> Option<i64> {
    let name = name.to_lowercase();
    MONTHS.iter().position(|m| m.iter().any(|short| name.starts_with(short))).map(|i| i as i64 + 1)
}

/// Seconds of a time of day, its zone ignored: a log keeps one clock.
fn clock_s(text: &str) -> Option<f64> {
    let lower = text.trim().to_ascii_lowercase();
    let (lower, afternoon) = if let Some(t) = lower.strip_suffix("pm") {
        (t.trim(), Some(true))
    } else if let Some(t) = lower.strip_suffix("am") {
        (t.trim(), Some(false))
    } else {
        (lower.trim_end_matches('z'), None)
    };
    let zone = lower.find(['+', '-']).unwrap_or(lower.len());
    let mut parts = lower[..zone].trim().split(':');
    let (h, m) = (parts.next()?.parse::<u32>().ok()?, parts.next()?.parse::<u32>().ok()?);
    let s: f64 = match parts.next() {
        Some(s) => s.replace(',', ".").parse().ok().filter(|s| (0.0..61.0).contains(s))?,
        None => 0.0,
    };
    if parts.next().is_some() || h > 24 || m > 59 {
        return None;
    }
    let h = match afternoon {
        Some(true) => h % 12 + 12,
        Some(false) => h % 12,
        None => h,
    };
    Some(f64::from(h) * 3600.0 + f64::from(m) * 60.0 + s)
}

/// Days since 1970-01-01. Source: Hinnant, chrono-compatible low-level date algorithms (2013).
fn days_from_civil(y: i64, m: i64, d: i64) -> i64 {
    let y = if m <= 2 { y - 1 } else { y };
    let era = y.div_euclid(400);
    let year = y.rem_euclid(400);
    let day = (153 * ((m + 9) % 12) + 2) / 5 + d - 1;
    era * 146_097 + year * 365 + year / 4 - year / 100 + day - 719_468
}

fn civil(days: i64) -> (i64, i64, i64) {
    let z = days + 719_468;
    let era = z.div_euclid(146_097);
    let day = z.rem_euclid(146_097);
    let year = (day - day / 1460 + day / 36_524 - day / 146_096) / 365;
    let of_year = day - (365 * year + year / 4 - year / 100);
    let month = (5 * of_year + 2) / 153;
    let m = if month < 10 { month + 3 } else { month - 9 };
    (year + era * 400 + i64::from(m <= 2), m, of_year - (153 * month + 2) / 5 + 1)
}
