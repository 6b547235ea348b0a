//! A time in parts: a column for the year, one for the month, and so on, or fractions of a second beside the time of day.

use super::pivot::normal;
use super::read::{Kind, Read, ReadColumn};
use super::stamp::{midnight, of_year};

/// A part of a time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Part {
    Full,
    Date,
    Clock,
    Year,
    Month,
    Day,
    DayOfYear,
    /// Hours and minutes as one number: 1435.
    HourMinute,
    Hour,
    Minute,
    Second,
    Millisecond,
}

/// Names of parts, without marks and accents and in lower case.
const NAMES: [(Part, &[&str]); 9] = [
    (Part::Year, &["year", "yyyy", "yy", "yr", "ano", "jahr", "annee", "anno", "jaar", "год", "年"]),
    (Part::Month, &["month", "mm", "mon", "mes", "monat", "mois", "mese", "maand", "месяц", "月"]),
    (Part::Day, &["day", "dd", "dia", "tag", "jour", "giorno", "dag", "день", "日"]),
    (Part::DayOfYear, &["doy", "ddd", "jday", "julianday", "julian", "dayofyear", "yearday", "yday"]),
    (Part::HourMinute, &["hhmm", "hourmin", "hourminute", "hrmn"]),
    (Part::Hour, &["hour", "hh", "hr", "hora", "stunde", "heure", "ora", "uur", "час", "时", "時"]),
    (Part::Minute, &["minute", "min", "mi", "minuto", "minuten", "minuut", "мин", "分"]),
    (
        Part::Second,
        &[
            "second", "seconds", "sec", "secs", "ss", "segundo", "segundos", "sekunde", "seconde", "secondo",
            "сек", "秒",
        ],
    ),
    (
        Part::Millisecond,
        &[
            "ms",
            "msec",
            "millisecond",
            "milliseconds",
            "millis",
            "millisec",
            "millitm",
            "mseg",
            "milissegundo",
            "fff",
        ],
    ),
];

/// Puts together the first columns side by side that are parts of one time, where others are left to be measured.
pub(super) fn compose(read: &mut Read) {
    let with_clock = read.columns.iter().any(|c| c.kind == Kind::Clock);
    read.columns.iter_mut().for_each(|column| day_of_year(column, with_clock));
    for first in 0..read.columns.len() {
        let mut found: Vec<Part> = Vec::new();
        for column in &read.columns[first..] {
            match part(column, &found).filter(|part| !found.contains(part)) {
                Some(part) => found.push(part),
                None => break,
            }
        }
        while found.len() > 1 {
            let columns = &read.columns[first..first + found.len()];
            let measures = |(i, c): (usize, &ReadColumn)| {
                c.kind == Kind::Number && !(first..first + found.len()).contains(&i)
            };
            if read.columns.iter().enumerate().any(measures)
                && let Some(kind) = kind_of(&found)
                && let Some(values) = times(columns, &found)
            {
                let names: Vec<&str> = columns.iter().map(|c| c.name.as_str()).collect();
                let mut time = ReadColumn::new(names.join(", "), None, kind, values);
                time.zone_s = columns[0].zone_s;
                read.columns.splice(first..first + found.len(), [time]);
                return;
            }
            found.pop();
        }
    }
}

fn part(column: &ReadColumn, before: &[Part]) -> Option<Part> {
    match column.kind {
        Kind::Full => return Some(Part::Full),
        Kind::Date => return Some(Part::Date),
        Kind::Clock => return Some(Part::Clock),
        Kind::Words => return None,
        Kind::Number => {}
    }
    let name = normal(super::pairs::base(&column.name));
    let (part, _) = NAMES.iter().find(|(_, names)| names.contains(&name.as_str()))?;
    // Behind the hour, mm are minutes.
    let is_minute = *part == Part::Month && name == "mm" && before.contains(&Part::Hour);
    Some(if is_minute { Part::Minute } else { *part })
}

/// What parts make together, if they are those of a time and more than a date with its time of day.
fn kind_of(parts: &[Part]) -> Option<Kind> {
    use Part::{
        Clock, Date, Day, DayOfYear, Full, Hour, HourMinute, Millisecond, Minute, Month, Second, Year,
    };
    let has = |part: Part| parts.contains(&part);
    let is_date = has(Year) && (has(Month) && has(Day) || has(DayOfYear));
    let clocks = [Clock, Hour, HourMinute].into_iter().filter(|&part| has(part)).count();
    let days = [Full, Date, Year].into_iter().filter(|&part| has(part)).count();
    let loose = has(Year) != is_date
        || !has(Year) && (has(Month) || has(Day) || has(DayOfYear))
        || has(Full) && clocks > 0
        || clocks > 1
        || days > 1
        || has(Minute) && !has(Hour)
        || has(Second) && !(clocks > 0 || has(Full))
        || has(Millisecond) && !(clocks > 0 || has(Full));
    if loose || parts == [Date, Clock] || parts == [Clock, Date] {
        return None;
    }
    match (days, clocks) {
        (1, _) => Some(Kind::Full),
        (0, 1) if has(Clock) || has(Minute) => Some(Kind::Clock),
        _ => None,
    }
}

/// Seconds of each row, if all values are such as the parts can have.
fn times(columns: &[ReadColumn], parts: &[Part]) -> Option<Vec<f64>> {
    let of = |part: Part| parts.iter().position(|p| *p == part).map(|i| columns[i].values.as_slice());
    let whole_minutes = of(Part::Clock).or(of(Part::Full)).is_none_or(|v| all(v, |s| s % 60.0 == 0.0));
    let whole_seconds = of(Part::Clock).or(of(Part::Full)).is_none_or(|v| all(v, |s| s.fract() == 0.0));
    for (part, column) in parts.iter().zip(columns) {
        let within =
            |low: f64, high: f64| all(&column.values, |v| v.fract() == 0.0 && (low..=high).contains(&v));
        let fits = match part {
            Part::Full | Part::Date | Part::Clock => true,
            Part::Year => within(0.0, 99.0) || within(1900.0, 2199.0),
            Part::Month => within(1.0, 12.0),
            Part::Day => within(1.0, 31.0),
            Part::DayOfYear => within(1.0, 366.0),
            Part::HourMinute => within(0.0, 2400.0) && all(&column.values, |v| v % 100.0 < 60.0),
            Part::Hour => within(0.0, 24.0),
            Part::Minute => within(0.0, 59.0),
            Part::Second if whole_minutes => all(&column.values, |v| (0.0..61.0).contains(&v)),
            Part::Second => whole_seconds && all(&column.values, |v| (0.0..1.0).contains(&v)),
            Part::Millisecond => whole_seconds && all(&column.values, |v| (0.0..1000.0).contains(&v)),
        };
        if !fits {
            return None;
        }
    }
    let get = |part: Part, row: usize| of(part).map_or(0.0, |values| values[row]);
    let day_s = |row: usize| {
        let year = get(Part::Year, row);
        let two = |y: f64| if y < 100.0 { y + 2000.0 } else { y };
        let date = match (of(Part::DayOfYear), of(Part::Year)) {
            _ if year.is_nan() => None,
            (Some(days), _) => of_year(two(year) as i64, days[row] as i64).filter(|_| days[row].is_finite()),
            (None, Some(_)) => {
                midnight(year as i64, get(Part::Month, row) as i64, get(Part::Day, row) as i64)
            }
            (None, None) => Some(get(Part::Full, row) + get(Part::Date, row)),
        };
        date.unwrap_or(f64::NAN)
    };
    let rows = columns.first()?.values.len();
    let time_s = |row: usize| {
        let hhmm = get(Part::HourMinute, row);
        day_s(row)
            + get(Part::Clock, row)
            + 3600.0 * (get(Part::Hour, row) + (hhmm / 100.0).floor())
            + 60.0 * (get(Part::Minute, row) + hhmm % 100.0)
            + get(Part::Second, row)
            + 1e-3 * get(Part::Millisecond, row)
    };
    Some((0..rows).map(time_s).collect())
}

fn all(values: &[f64], fits: impl Fn(f64) -> bool) -> bool {
    values.iter().filter(|v| v.is_finite()).all(|&v| fits(v))
}

/// Numbers such as 2024.180 under the name of a date, or beside times of day under that of a time, become dates: the day
/// of the year stands behind the point.
fn day_of_year(column: &mut ReadColumn, with_clock: bool) {
    let lower = column.name.to_lowercase();
    let is_date = ["ddd", "doy", "julian", "date"].iter().any(|w| lower.contains(w));
    let named = is_date || with_clock && super::axis::is_time_name(&lower);
    if column.kind != Kind::Number || !named || !column.values.iter().any(|v| v.is_finite()) {
        return;
    }
    let day = |v: f64| (v.fract() * 1000.0).round();
    let is_day = |v: f64| {
        (1900.0..2200.0).contains(&v)
            && (1.0..=366.0).contains(&day(v))
            && (v.floor() + day(v) / 1000.0 - v).abs() < 1e-7
    };
    if !all(&column.values, is_day) {
        return;
    }
    for value in &mut column.values {
        *value = if value.is_finite() {
            of_year(*value as i64, day(*value) as i64).unwrap_or(f64::NAN)
        } else {
            f64::NAN
        };
    }
    column.kind = Kind::Date;
}
