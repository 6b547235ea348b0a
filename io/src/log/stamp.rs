//! Dates and times of day as plants write them, in seconds since 1970.
//!
//! A stamp with a zone comes out in UTC, one without on the file's own clock.

use super::calendar::{days_from_civil, month};
use super::iec::iec;

/// Seconds of a day.
pub(super) const DAY_S: f64 = 86_400.0;
/// Decimals of a second that are read.
const DECIMALS: usize = 9;

/// Which of day and month a date written with slashes begins with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum DateOrder {
    /// 31/12/2024
    DayFirst,
    /// 12/31/2024
    MonthFirst,
}

impl DateOrder {
    pub(super) fn other(self) -> Self {
        match self {
            Self::DayFirst => Self::MonthFirst,
            Self::MonthFirst => Self::DayFirst,
        }
    }
}

/// A field read as time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Stamp {
    /// Date and time of day: seconds since 1970-01-01, and the zone's seconds ahead of UTC where there is one.
    Full { time_s: f64, zone_s: Option<f64> },
    /// Date alone: seconds of its midnight.
    Date(f64),
    /// Time of day alone: seconds since midnight.
    Clock(f64),
}

impl Stamp {
    /// The seconds of any of them.
    pub fn seconds(self) -> f64 {
        match self {
            Self::Full { time_s, .. } => time_s,
            Self::Date(s) | Self::Clock(s) => s,
        }
    }
}

/// ISO 8601, dd/mm/yyyy or mm/dd/yyyy with any of `/ - .`, dd-Mon-yyyy, `Jan 2, 2024`, yyyymmdd, with or without a time
/// of day, zone or AM/PM.
pub(super) fn parse(field: &str, order: DateOrder) -> Option<Stamp> {
    let first = field.chars().next()?;
    if field.len() < 4 || field.len() > 48 {
        return None;
    }
    if first.is_alphabetic() {
        return if field.contains('#') { iec(field, order) } else { spelled(field) };
    }
    if !first.is_ascii_digit() {
        return None;
    }
    // Most fields are plain numbers: a look at their marks saves trying every form.
    let marks =
        field.bytes().filter(|b| matches!(b, b':' | b'/' | b'-' | b' ' | b'T' | b'_' | 0x80..)).count();
    let is_spelled_clock =
        || field.contains(['h', 'H']) && field.ends_with(|c: char| c.is_ascii_digit() || c == 's');
    if marks == 0 && field.bytes().filter(|b| *b == b'.').count() < 2 && !is_spelled_clock() {
        return if field.len() >= 8 { compact(field) } else { None };
    }
    if field.contains('年') {
        let plain = field
            .replace(['年', '月'], "-")
            .replace('日', " ")
            .replace(['时', '時', '分'], ":")
            .replace('秒', "");
        return parse(plain.trim(), order);
    }
    // 2024:180:14:35:00
    if let (Some((date, clock)), Some(b':')) = (field.split_at_checked(8), field.as_bytes().get(4))
        && let (Some(midnight), Some(clock)) = (day_of_year(date), clock.strip_prefix(':'))
    {
        return full(midnight, clock);
    }
    let comma = || field.find(", ").filter(|&i| i >= 6);
    let cut = comma()
        .or_else(|| field.find(['T', ' ', '\t']).filter(|&i| i >= 6))
        .or_else(|| joined_by_hyphen(field));
    let (date, clock) = match cut {
        Some(i) => (&field[..i], field[i + 1..].trim_start()),
        None => (field, ""),
    };
    // 28-Jun-2024 and 28 Jun 2024 alike.
    let blanks = || {
        let mut words = field.splitn(4, ' ');
        let date = format!("{}-{}-{}", words.next()?, words.next()?, words.next()?);
        Some((day(&date, order)?, words.next().unwrap_or("").to_owned()))
    };
    match day(date, order) {
        Some(midnight) if clock.is_empty() => Some(Stamp::Date(midnight)),
        Some(midnight) => full(midnight, clock),
        None => match clock_s(field).or_else(|| dotted_clock_s(field).map(|s| (s, None))) {
            Some((seconds, None)) => Some(Stamp::Clock(seconds)),
            Some(_) => None,
            None => match blanks() {
                Some((midnight, clock)) if clock.is_empty() => Some(Stamp::Date(midnight)),
                Some((midnight, clock)) => full(midnight, &clock),
                None => compact(field),
            },
        },
    }
}

fn full(midnight: f64, clock: &str) -> Option<Stamp> {
    let (seconds, zone_s) = clock_s(clock)?;
    Some(Stamp::Full { time_s: midnight + seconds - zone_s.unwrap_or(0.0), zone_s })
}

/// Whether a date can only be read with the day, or only with the month, in front.
pub(super) fn order_of(field: &str) -> Option<DateOrder> {
    let date = field.split([' ', 'T', '\t', ',']).next()?;
    let parts: Vec<u32> = date.split(['/', '-', '.']).map_while(|p| p.parse().ok()).collect();
    match parts[..] {
        [a, _, _] if a > 31 => Some(DateOrder::DayFirst),
        [a, b, _] if a > 12 && b <= 12 => Some(DateOrder::DayFirst),
        [a, b, _] if b > 12 && a <= 12 => Some(DateOrder::MonthFirst),
        _ => None,
    }
}

/// Midnight of `2024-180`, `2024.180`, `2024/180` or `2024:180`: year and day of the year.
fn day_of_year(date: &str) -> Option<f64> {
    let (year, day) = date.split_once(['-', '.', '/', ':'])?;
    if year.len() != 4 || day.len() != 3 {
        return None;
    }
    of_year(i64::from(whole(year)?), i64::from(whole(day)?))
}

/// Midnight of a day of a year, counted from 1.
pub(super) fn of_year(year: i64, day: i64) -> Option<f64> {
    let first = midnight(year, 1, 1)?;
    let length = midnight(year, 12, 31)? / DAY_S - first / DAY_S + 1.0;
    (day >= 1 && day as f64 <= length).then_some(first + (day - 1) as f64 * DAY_S)
}

fn day(date: &str, order: DateOrder) -> Option<f64> {
    if let Some(midnight) = day_of_year(date) {
        return Some(midnight);
    }
    let mut parts = date.split(['/', '-', '.']);
    let (a, b, c) = (parts.next()?, parts.next()?, parts.next()?);
    if parts.next().is_some() || a.len() > 4 || c.len() > 4 {
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
    midnight(y, m, d)
}

/// Seconds of a date; a year of two digits is one of this century.
pub(super) fn midnight(y: i64, m: i64, d: i64) -> Option<f64> {
    let y = if (0..100).contains(&y) { y + 2000 } else { y };
    let sane = (1900..2200).contains(&y) && (1..=12).contains(&m) && (1..=31).contains(&d);
    let days = days_from_civil(y, m, d);
    // The 31st of a month of thirty days would come out as the first of the next.
    let there = sane && (d <= 28 || super::calendar::civil(days) == (y, m, d));
    there.then_some(days as f64 * DAY_S)
}

/// Seconds at which years begin and end that stamps without one are put into: a leap year before all others that are
/// read.
pub(super) const NO_YEAR_S: [f64; 2] = [-27_028.0 * DAY_S, -26_662.0 * DAY_S];

fn midnight_without_year(m: i64, d: i64) -> Option<f64> {
    // The lengths of months are those of the leap year 2000.
    midnight(2000, m, d).map(|s| s - 10_957.0 * DAY_S + NO_YEAR_S[0])
}

/// `2024-06-28-14:35:00` and `2024/06/28-14:35:00`.
fn joined_by_hyphen(field: &str) -> Option<usize> {
    let colon = field.find(':')?;
    field[..colon].rfind('-').filter(|&i| i >= 8)
}

/// `Jun 28, 2024 2:35:00 PM` and `Fri Jun 28 14:35:00 2024`, with or without a zone's letters ahead of the year.
fn spelled(field: &str) -> Option<Stamp> {
    if field.len() < 10 || !field.contains(' ') || !field.ends_with(|c: char| c.is_ascii_alphanumeric()) {
        return None;
    }
    let mut words: Vec<&str> = field.split([' ', ',']).filter(|w| !w.is_empty()).collect();
    if words.first().is_some_and(|w| month(w).is_none()) {
        words.remove(0);
    }
    if words.len() < 3 || words[0].len() < 3 {
        return None;
    }
    let (m, d): (i64, i64) = (month(words[0])?, words[1].parse().ok()?);
    if words[2].contains(':') && words.len() == 3 {
        return full(midnight_without_year(m, d)?, words[2]);
    }
    if words[2].contains(':') {
        let y: i64 = words.last()?.parse().ok()?;
        return full(midnight(y, m, d)?, words[2]);
    }
    let midnight = midnight(words[2].parse().ok()?, m, d)?;
    if words.len() == 3 { Some(Stamp::Date(midnight)) } else { full(midnight, &words[3..].join(" ")) }
}

/// 20240628, 20240628T143500, 20240628143500.123 and the like.
fn compact(field: &str) -> Option<Stamp> {
    let (whole, decimals) = field.split_once(['.', ',']).unwrap_or((field, ""));
    if whole.len() < 8 {
        return None;
    }
    let digits: String =
        whole.trim_end_matches('Z').chars().filter(|c| !matches!(c, 'T' | '-' | ' ' | '_')).collect();
    if !digits.bytes().all(|b| b.is_ascii_digit()) || !matches!(digits.len(), 8 | 12 | 14) {
        return None;
    }
    let at = |from: usize, to: usize| digits.get(from..to).map_or(Some(0), |d| d.parse::<i64>().ok());
    if digits.len() == 8 && whole.len() > 8 {
        return None;
    }
    let midnight = midnight(at(0, 4)?, at(4, 6)?, at(6, 8)?)?;
    if digits.len() == 8 {
        return Some(Stamp::Date(midnight));
    }
    let (h, m, s) = (at(8, 10)?, at(10, 12)?, at(12, 14)?);
    let decimals: f64 = format!("0.{decimals}0").parse().ok()?;
    let sane = h < 24 && m < 60 && s < 61;
    let zone_s = whole.ends_with('Z').then_some(0.0);
    sane.then(|| Stamp::Full { time_s: midnight + (h * 3600 + m * 60 + s) as f64 + decimals, zone_s })
}

/// Seconds of a time of day with points between, as in Finland and Italy: `23.59.00`. Some read as dates, too.
fn dotted_clock_s(text: &str) -> Option<f64> {
    let parts: Vec<&str> = text.split('.').collect();
    let is_two_digits = |part: &&str| part.len() == 2 && part.bytes().all(|b| b.is_ascii_digit());
    let is_clock = parts.len() == 3 && parts[1..].iter().all(is_two_digits) && parts[0].len() <= 2;
    is_clock.then(|| clock_s(&parts.join(":")))?.map(|(seconds, _)| seconds)
}

/// Seconds of a time of day, and the seconds its zone is ahead of UTC.
pub(super) fn clock_s(text: &str) -> Option<(f64, Option<f64>)> {
    let mut lower = text.trim().to_ascii_lowercase();
    // 14h05, 14h05m30s
    if !lower.contains(':') && lower.split('h').next().is_some_and(|h| whole(h).is_some()) {
        lower = lower.replace(['h', 'm'], ":").trim_end_matches(['s', ':']).to_owned();
    }
    let (clock, zone) = split_zone(&lower)?;
    let (clock, afternoon) = split_afternoon(clock);
    let mut parts = clock.split(':');
    let (first, second) = (parts.next()?, parts.next()?);
    let third = parts.next();
    let fourth = parts.next();
    if parts.next().is_some() {
        return None;
    }
    // A spreadsheet shows minutes and seconds alone, with decimals.
    if third.is_none() && second.contains(['.', ',']) {
        let minutes: u32 = whole(first)?;
        return Some((f64::from(minutes) * 60.0 + seconds(second)?, zone));
    }
    let (h, m): (u32, u32) = (whole(first)?, whole(second)?);
    let mut s = third.map_or(Some(0.0), seconds)?;
    if let Some(thousandths) = fourth {
        s += f64::from(whole(thousandths).filter(|_| thousandths.len() == 3)?) * 1e-3;
    }
    if h > 24 || m > 59 {
        return None;
    }
    let h = match afternoon {
        Some(true) => h % 12 + 12,
        Some(false) => h % 12,
        None => h,
    };
    Some((f64::from(h) * 3600.0 + f64::from(m) * 60.0 + s, zone))
}

/// A time of day without `am`, `p.m.`, `p. m.` behind it, and whether it is one of the afternoon.
fn split_afternoon(clock: &str) -> (&str, Option<bool>) {
    let digits = clock.trim_end_matches(|c: char| matches!(c, 'a' | 'p' | 'm' | '.') || c.is_whitespace());
    match clock[digits.len()..].chars().filter(|c| c.is_alphabetic()).collect::<String>().as_str() {
        "am" => (digits, Some(false)),
        "pm" => (digits, Some(true)),
        _ => (clock, None),
    }
}

fn whole(text: &str) -> Option<u32> {
    text.bytes().all(|b| b.is_ascii_digit()).then(|| text.parse().ok())?
}

fn seconds(text: &str) -> Option<f64> {
    let plain = text.bytes().all(|b| b.is_ascii_digit() || b == b'.' || b == b',');
    text.replace(',', ".").parse().ok().filter(|s| plain && (0.0..61.0).contains(s))
}

/// A time of day without its zone, and the zone: `Z`, `+02:00`, `-0300`, `utc`; other names of zones say nothing here.
fn split_zone(lower: &str) -> Option<(&str, Option<f64>)> {
    for name in ["z", "utc", "gmt"] {
        if let Some(clock) = lower.strip_suffix(name) {
            return Some((clock.trim_end(), Some(0.0)));
        }
    }
    if let Some(i) = lower.rfind(['+', '-']) {
        let clock = lower[..i].trim_end().trim_end_matches("utc").trim_end_matches("gmt").trim_end();
        return Some((clock, Some(offset_s(&lower[i..])?)));
    }
    // A name such as CEST holds for every row alike.
    let named = lower.rsplit_once(' ').filter(|(_, zone)| {
        (3..=4).contains(&zone.len()) && zone.ends_with('t') && zone.bytes().all(|b| b.is_ascii_alphabetic())
    });
    Some((named.map_or(lower, |(clock, _)| clock), None))
}

fn offset_s(text: &str) -> Option<f64> {
    let sign = if text.starts_with('-') { -1.0 } else { 1.0 };
    let digits: String = text[1..].chars().filter(|c| *c != ':').collect();
    if !digits.bytes().all(|b| b.is_ascii_digit()) || !matches!(digits.len(), 1 | 2 | 4) {
        return None;
    }
    let cut = digits.len().min(2);
    let (h, m): (f64, f64) = (digits[..cut].parse().ok()?, format!("0{}", &digits[cut..]).parse().ok()?);
    (h <= 14.0 && m < 60.0).then_some(sign * (h * 3600.0 + m * 60.0))
}

/// Reads the stamps of a column: those that begin with the day of the one before by their digits alone.
#[derive(Debug, Clone)]
pub(super) struct StampReader {
    order: DateOrder,
    clock: bool,
    day: [u8; 11],
    midnight_s: f64,
    /// Orders of day and month that dates so far could only be read in.
    pub day_first: bool,
    pub month_first: bool,
}

impl StampReader {
    /// A reader of stamps, or of times of day alone.
    pub fn new(order: DateOrder, clock: bool) -> Self {
        Self { order, clock, day: [0; 11], midnight_s: 0.0, day_first: false, month_first: false }
    }

    /// A field that has been trimmed.
    pub fn read(&mut self, field: &[u8]) -> Option<Stamp> {
        if let Some(stamp) = self.same_day(field) {
            return Some(stamp);
        }
        let text = std::str::from_utf8(field).ok()?;
        if self.clock {
            let spelled = || iec(text, self.order).filter(|stamp| matches!(stamp, Stamp::Clock(_)));
            let plain = dotted_clock_s(text).or_else(|| clock_s(text).map(|(s, _)| s));
            return plain.map(Stamp::Clock).or_else(spelled);
        }
        let stamp = parse(text, self.order);
        if !matches!(stamp, Some(Stamp::Clock(_))) && text.contains(['/', '-', '.']) {
            let order = order_of(text);
            // A year in front says nothing of the others.
            if text.as_bytes().get(..4).is_none_or(|y| !y.iter().all(u8::is_ascii_digit)) {
                self.day_first |= order == Some(DateOrder::DayFirst);
                self.month_first |= order == Some(DateOrder::MonthFirst);
            }
        }
        if field.len() >= 19
            && matches!(field[10], b' ' | b'T')
            && matches!(stamp, Some(Stamp::Full { .. }))
            && let Some(Stamp::Date(midnight_s)) = text.get(..10).and_then(|day| parse(day, self.order))
        {
            self.day.copy_from_slice(&field[..11]);
            self.midnight_s = midnight_s;
        }
        stamp
    }

    fn same_day(&self, field: &[u8]) -> Option<Stamp> {
        if field.get(..11)? != self.day {
            return None;
        }
        let clock: &[u8; 8] = field.get(11..19)?.try_into().ok()?;
        let two = |i: usize| {
            let (a, b) = (clock[i].wrapping_sub(b'0'), clock[i + 1].wrapping_sub(b'0'));
            (a < 10 && b < 10).then(|| u32::from(a) * 10 + u32::from(b))
        };
        let (h, m, s) = (two(0)?, two(3)?, two(6)?);
        if clock[2] != b':' || clock[5] != b':' || h > 23 || m > 59 || s > 60 {
            return None;
        }
        let mut time_s = self.midnight_s + f64::from(h * 3600 + m * 60 + s);
        let mut rest = &field[19..];
        if let [b'.' | b',', decimals @ ..] = rest {
            let count = decimals.iter().take_while(|b| b.is_ascii_digit()).count();
            if count == 0 || count > DECIMALS {
                return None;
            }
            let digits = decimals[..count].iter().fold(0_u32, |sum, b| sum * 10 + u32::from(b - b'0'));
            time_s += f64::from(digits) / 10_f64.powi(count as i32);
            rest = &decimals[count..];
        }
        let zone_s = match rest {
            [] => None,
            b"Z" => Some(0.0),
            [b'+' | b'-', ..] => Some(offset_s(std::str::from_utf8(rest).ok()?)?),
            _ => return None,
        };
        Some(Stamp::Full { time_s: time_s - zone_s.unwrap_or(0.0), zone_s })
    }
}
