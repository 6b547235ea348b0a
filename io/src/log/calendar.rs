//! Days since 1970 and dates.

const MONTHS: [[&str; 3]; 12] = [
    ["jan", "jan", "jän"],
    ["feb", "fev", "fév"],
    ["mar", "mar", "mär"],
    ["apr", "abr", "avr"],
    ["may", "mai", "mag"],
    ["jun", "jun", "giu"],
    ["jul", "jul", "lug"],
    ["aug", "ago", "aoû"],
    ["sep", "set", "sep"],
    ["oct", "out", "okt"],
    ["nov", "nov", "nov"],
    ["dec", "dez", "déc"],
];

/// Number of a month by its name or the beginning of it, in the languages of plants.
pub(super) fn month(name: &str) -> Option<i64> {
    let name = name.to_lowercase();
    MONTHS.iter().position(|m| m.iter().any(|short| name.starts_with(short))).map(|i| i as i64 + 1)
}

/// Days since 1970-01-01. Source: Hinnant, chrono-compatible low-level date algorithms (2013).
pub(super) fn days_from_civil(y: i64, m: i64, d: i64) -> i64 {
    let y = if m <= 2 { y - 1 } else { y };
    let era = y.div_euclid(400);
    let year = y.rem_euclid(400);
    let day = (153 * ((m + 9) % 12) + 2) / 5 + d - 1;
    era * 146_097 + year * 365 + year / 4 - year / 100 + day - 719_468
}

/// Year, month and day of days since 1970-01-01, by the same source.
pub(super) fn civil(days: i64) -> (i64, i64, i64) {
    let z = days + 719_468;
    let era = z.div_euclid(146_097);
    let day = z.rem_euclid(146_097);
    let year = (day - day / 1460 + day / 36_524 - day / 146_096) / 365;
    let of_year = day - (365 * year + year / 4 - year / 100);
    let month = (5 * of_year + 2) / 153;
    let m = if month < 10 { month + 3 } else { month - 9 };
    (year + era * 400 + i64::from(m <= 2), m, of_year - (153 * month + 2) / 5 + 1)
}

/// ISO 8601 of seconds since 1970.
pub(super) fn iso(seconds: f64) -> String {
    let millis = (seconds * 1000.0).round();
    let days = (millis / 86_400_000.0).floor();
    let clock = (millis - 86_400_000.0 * days) as u64;
    let (y, m, d) = civil(days as i64);
    let (h, min, s, ms) = (clock / 3_600_000, clock / 60_000 % 60, clock / 1000 % 60, clock % 1000);
    let fraction = if ms > 0 { format!(".{ms:03}") } else { String::new() };
    format!("{y:04}-{m:02}-{d:02}T{h:02}:{min:02}:{s:02}{fraction}")
}
