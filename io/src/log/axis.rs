//! The time axis: which column it is, in what unit, and in which order.

use vasos_engine::signal::LogStart;

use super::calendar::{days_from_civil, iso};
use super::order::{ordered, typical_step};
use super::read::{Kind, Read};
use super::stamp::{DAY_S, NO_YEAR_S};
use super::{ImportError, ImportOptions, Repair, TimeKind};

/// 1970-01-01 as a spreadsheet counts days, and as MATLAB does.
const EXCEL_1970: f64 = 25_569.0;
const MATLAB_1970: f64 = 719_529.0;
/// 1970-01-01 as LabVIEW counts seconds.
const LABVIEW_1970_S: f64 = 2_082_844_800.0;
/// 1970-01-01 in Julian days, and in modified ones.
const JULIAN_1970: f64 = 2_440_587.5;
const MODIFIED_JULIAN_1970: f64 = 40_587.0;
/// 1970-01-01 in 100 ns since 1601, as Windows counts, and since the year 1, as .NET does.
const FILETIME_1970: f64 = 116_444_736_000_000_000.0;
const NET_TICKS_1970: f64 = 621_355_968_000_000_000.0;
const TICK_S: f64 = 1e-7;
/// A nameless column needs this many rows to pass for a clock.
const FEWEST_TICKS: usize = 8;

/// The time axis of a log.
#[derive(Debug)]
pub(super) struct Axis {
    pub time_s: Vec<f64>,
    pub start: LogStart,
    pub kind: TimeKind,
    /// Columns the time was made of.
    pub columns: Vec<usize>,
    /// Seconds the stamps' zone is ahead of UTC.
    pub zone_s: Option<f64>,
    /// Rows kept, when not all are.
    pub keep: Option<Vec<u32>>,
}

/// Finds and puts in order the time axis. The values of its columns are taken out of `read`.
///
/// # Errors
/// [`ImportError::NoSuchTimeColumn`] for a column the user named that is not there; [`ImportError::TimeStandsStill`]
/// where the time column holds one value, and no sample time was given.
pub(super) fn find(
    read: &mut Read,
    options: &ImportOptions,
    repairs: &mut Vec<Repair>,
) -> Result<Axis, ImportError> {
    let columns = match &options.time_column {
        Some(name) => vec![named(read, name)?],
        None => choose(read),
    };
    // A PV that rises evenly passes for a clock; a column named as one goes before.
    let by_behaviour = options.time_column.is_none()
        && columns
            .first()
            .is_none_or(|&i| read.columns[i].kind == Kind::Number && !is_time_name(&read.columns[i].name));
    let still = by_behaviour.then(|| still_clock(read)).flatten().or_else(|| {
        let first = *columns.first()?;
        (columns.len() == 1 && stands_still(&read.columns[first].values)).then_some(first)
    });
    if let (Some(column), None) = (still, options.sample_time_s) {
        return Err(ImportError::TimeStandsStill {
            name: read.columns[column].name.clone(),
            rows: read.lines.len(),
        });
    }
    let columns = if still.is_some() { Vec::new() } else { columns };
    let Some(&first) = columns.first() else { return Ok(counted(read, options, repairs)) };
    let is_clock = read.columns[first].kind == Kind::Clock;
    let zone_s = read.columns[first].zone_s;
    let (kind, mut raw) = seconds(read, &columns);
    let no_year = !is_clock && kind == TimeKind::Stamps && go_on_over_the_year(&mut raw);
    if no_year {
        repairs.push(Repair::NoYear);
    }
    let calendar = !is_clock && !matches!(kind, TimeKind::Numbers { .. });
    let (keep, mut time_s) = ordered(raw, read, calendar, zone_s.is_some(), repairs);
    let start_s = time_s.first().copied().unwrap_or(0.0);
    let start = if no_year {
        LogStart::Seconds(start_s - NO_YEAR_S[0])
    } else if calendar {
        LogStart::Calendar(iso(start_s + zone_s.unwrap_or(0.0)))
    } else {
        LogStart::Seconds(start_s)
    };
    for t in &mut time_s {
        *t -= start_s;
    }
    note_gaps(&time_s, keep.as_deref(), read, repairs);
    Ok(Axis { time_s, start, kind, columns, zone_s, keep })
}

fn named(read: &Read, name: &str) -> Result<usize, ImportError> {
    let at = read.columns.iter().position(|c| c.name == name);
    at.ok_or_else(|| {
        let columns: Vec<&str> = read.columns.iter().map(|c| c.name.as_str()).collect();
        ImportError::NoSuchTimeColumn { name: name.to_owned(), columns: columns.join(", ") }
    })
}

/// The axis of a file without time: rows at even distances.
fn counted(read: &Read, options: &ImportOptions, repairs: &mut Vec<Repair>) -> Axis {
    let given = options.sample_time_s.or(read.stated_sample_time_s).filter(|h| h.is_finite() && *h > 0.0);
    let sample_time_s = given.unwrap_or(1.0);
    if given.is_none() {
        repairs.push(Repair::NoTimeColumn { sample_time_s });
    }
    let time_s = (0..read.lines.len()).map(|k| k as f64 * sample_time_s).collect();
    let kind = TimeKind::Missing { sample_time_s, assumed: given.is_none() };
    Axis { time_s, start: LogStart::Unknown, kind, columns: Vec::new(), zone_s: None, keep: None }
}

/// The column of stamps: of several one that moves, of those one that is named as a time, of those the first.
pub(super) fn stamps(read: &Read) -> Option<usize> {
    let of_kind = (0..read.columns.len()).filter(|&i| read.columns[i].kind == Kind::Full);
    let rank = |&i: &usize| {
        let column = &read.columns[i];
        let moves = !stands_still(&column.values);
        (moves, moves && is_time_name(&column.name), std::cmp::Reverse(i))
    };
    of_kind.max_by_key(rank)
}

/// The time column, or a date and a time of day: stamps, else by name, else by behaviour.
fn choose(read: &Read) -> Vec<usize> {
    let of_kind = |kind| read.columns.iter().position(|c| c.kind == kind);
    if let Some(full) = stamps(read) {
        return vec![full];
    }
    match (of_kind(Kind::Date), of_kind(Kind::Clock)) {
        (Some(date), Some(clock)) => return vec![date, clock],
        (None, Some(clock)) => return vec![clock],
        (Some(date), None)
            if moves_on(&read.columns[date].values) || falls_steadily(&read.columns[date].values) =>
        {
            return vec![date];
        }
        _ => {}
    }
    let numbers = || (0..read.columns.len()).filter(|&i| read.columns[i].kind == Kind::Number);
    let named = numbers().filter(|&i| is_time_name(&read.columns[i].name));
    let ticking = named.filter(|&i| ticks(&read.columns[i].values));
    // A single letter may be a temperature: of several candidates the longer word, the steadier, the first.
    let rank = |&i: &usize| {
        (
            read.columns[i].name.chars().count() > 1,
            is_clocklike(&read.columns[i].values),
            std::cmp::Reverse(i),
        )
    };
    if let Some(named) = ticking.max_by_key(rank) {
        return vec![named];
    }
    let even: Vec<usize> = numbers().filter(|&i| is_clocklike(&read.columns[i].values)).collect();
    match even[..] {
        [] => Vec::new(),
        // A bare row number ahead of another clock is not the time.
        [index, other, ..] if index == 0 && is_row_number(&read.columns[0].values) && other <= 2 => {
            vec![other]
        }
        [first, ..] => vec![first],
    }
}

/// A column of numbers with the name of a time, a word and no letter, that never moves.
fn still_clock(read: &Read) -> Option<usize> {
    (0..read.columns.len()).find(|&i| {
        let named = is_time_name(&read.columns[i].name) && read.columns[i].name.chars().count() > 1;
        named && read.columns[i].kind == Kind::Number && stands_still(&read.columns[i].values)
    })
}

fn stands_still(values: &[f64]) -> bool {
    values.len() > 1 && values.iter().all(|t| *t == values[0])
}

/// Whether a name is one of a time.
pub(super) fn is_time_name(name: &str) -> bool {
    const NAMES: [&str; 26] = [
        "jd",
        "mjd",
        "julian",
        "millis",
        "time",
        "t",
        "tempo",
        "hora",
        "horario",
        "date",
        "datetime",
        "timestamp",
        "data",
        "zeit",
        "temps",
        "seconds",
        "sec",
        "segundos",
        "elapsed",
        "ts",
        "tiempo",
        "fecha",
        "clock",
        "时间",
        "日期",
        "secs",
    ];
    let lower = name.to_lowercase();
    let mut words = lower.split(|c: char| !c.is_alphanumeric()).filter(|w| !w.is_empty());
    words.next().is_some_and(|w| NAMES.contains(&w))
        || lower.contains("time")
        || lower == "x_value"
        || lower.contains("tempo (")
}

fn steps(values: &[f64]) -> impl Iterator<Item = f64> + '_ {
    values.windows(2).map(|w| w[1] - w[0])
}

fn moves_on(values: &[f64]) -> bool {
    values.len() > 1
        && steps(values).filter(|s| *s < 0.0).count() * 50 <= values.len()
        && values[0] < values[values.len() - 1]
}

fn mostly_moves_on(values: &[f64]) -> bool {
    let forward = steps(values).filter(|s| *s > 0.0).count();
    forward * 2 > values.len().saturating_sub(1)
}

/// Backwards by nearly the same step, as in files with the newest row first.
fn falls_steadily(values: &[f64]) -> bool {
    let Some(typical) = typical_step(values).filter(|t| *t < 0.0) else { return false };
    let near = steps(values).filter(|s| (3.0 * typical..=0.3 * typical).contains(s)).count();
    near * 10 >= values.len().saturating_sub(1) * 9
}

/// Whether a column named like a time behaves like one.
fn ticks(values: &[f64]) -> bool {
    moves_on(values) || mostly_moves_on(values) || falls_steadily(values)
}

/// Nearly always rising, by nearly the same step.
fn is_clocklike(values: &[f64]) -> bool {
    if values.len() < FEWEST_TICKS {
        return false;
    }
    let Some(typical) = typical_step(values) else { return false };
    let near = steps(values).filter(|s| (0.3 * typical..=3.0 * typical).contains(s)).count();
    typical > 0.0 && near * 100 >= values.len().saturating_sub(1) * 90
}

fn is_row_number(values: &[f64]) -> bool {
    let first = values[0];
    (first == 0.0 || first == 1.0) && values.iter().enumerate().all(|(i, &v)| v == first + i as f64)
}

/// The chosen columns in seconds.
fn seconds(read: &mut Read, columns: &[usize]) -> (TimeKind, Vec<f64>) {
    let mut raw = std::mem::take(&mut read.columns[columns[0]].values);
    if let Some(&clock) = columns.get(1) {
        raw.iter_mut().zip(&read.columns[clock].values).for_each(|(t, s)| *t += s);
    }
    match read.columns[columns[0]].kind {
        Kind::Clock => {
            unwrap_midnights(&mut raw);
            (TimeKind::Stamps, raw)
        }
        Kind::Full | Kind::Date | Kind::Words => (TimeKind::Stamps, raw),
        Kind::Number => {
            if raw.iter().all(|t| !t.is_finite() || from_digits(*t).is_some()) {
                raw.iter_mut().for_each(|t| *t = from_digits(*t).unwrap_or(f64::NAN));
                return (TimeKind::Stamps, raw);
            }
            let stated_s = read.stated_sample_time_s;
            let several_s = read.columns[columns[0]].unit.as_deref().and_then(several);
            let (kind, unit_s, origin) = numeric_kind(&raw, &unit_of(read, columns[0]), stated_s, several_s);
            raw.iter_mut().for_each(|t| *t = (*t - origin) * unit_s);
            (kind, raw)
        }
    }
}

/// A stamp written as one number: yyyymmddhhmmss.
fn from_digits(number: f64) -> Option<f64> {
    if !(1.9e13..2.2e13).contains(&number) || number.fract() != 0.0 {
        return None;
    }
    let digits = number as i64;
    let part = |unit: i64, size: i64| digits / unit % size;
    let (y, month, d) = (part(10_000_000_000, 10_000), part(100_000_000, 100), part(1_000_000, 100));
    let (h, m, s) = (part(10_000, 100), part(100, 100), part(1, 100));
    let sane = (1..=12).contains(&month) && (1..=31).contains(&d) && h < 24 && m < 60 && s < 61;
    sane.then(|| days_from_civil(y, month, d) as f64 * DAY_S + (h * 3600 + m * 60 + s) as f64)
}

fn unwrap_midnights(raw: &mut [f64]) {
    let (mut days, mut last) = (0.0, f64::NAN);
    for t in raw.iter_mut() {
        if *t - last < -0.5 * DAY_S {
            days += DAY_S;
        }
        last = *t;
        *t += days;
    }
}

/// Whether stamps have no year; then they go on over its turn, and February has 29 days only where it shows one.
fn go_on_over_the_year(raw: &mut [f64]) -> bool {
    const MARCH_S: f64 = NO_YEAR_S[0] + 60.0 * DAY_S;
    let in_it = |t: &f64| (NO_YEAR_S[0]..NO_YEAR_S[1]).contains(t);
    let mut finite = raw.iter().filter(|t| t.is_finite()).peekable();
    if finite.peek().is_none() || !finite.all(in_it) {
        return false;
    }
    let leap = raw.iter().any(|t| (MARCH_S - DAY_S..MARCH_S).contains(t));
    let (less_s, year_s) = if leap { (0.0, 366.0 * DAY_S) } else { (DAY_S, 365.0 * DAY_S) };
    let (mut years_s, mut last_s) = (0.0, f64::NAN);
    for t in raw.iter_mut() {
        let here_s = if *t >= MARCH_S { *t - less_s } else { *t };
        if here_s - last_s < -0.5 * year_s {
            years_s += year_s;
        }
        last_s = here_s;
        *t = here_s + years_s;
    }
    true
}

/// Name and unit of a column: either may say what it counts.
fn unit_of(read: &Read, column: usize) -> String {
    format!("{} {}", read.columns[column].name, read.columns[column].unit.as_deref().unwrap_or(""))
}

/// Words of units of time in lower case, and their seconds.
const UNITS: [(f64, &[&str]); 7] = [
    (1e-9, &["ns", "nanoseconds"]),
    (1e-6, &["us", "µs", "μs", "usec", "micros", "microseconds"]),
    (1e-3, &["ms", "msec", "msecs", "millis", "milliseconds", "millisecond", "milissegundos"]),
    (60.0, &["min", "mins", "minute", "minutes", "minuten", "minuto", "minutos"]),
    (3600.0, &["h", "hr", "hrs", "hour", "hours", "stunden", "heures", "hora", "horas"]),
    (DAY_S, &["d", "day", "days", "tage", "jours", "dia", "dias"]),
    (1.0, &["s", "sec", "secs", "second", "seconds", "sekunden", "segundos", "secondes"]),
];

/// Seconds of a unit of several at once: `100ms`, `0.1 s`, `x 10 ms`.
fn several(unit: &str) -> Option<f64> {
    let lower = unit.to_lowercase();
    let text = lower.trim_start_matches(['x', '×', '*', ' ']);
    let digits = text.find(|c: char| !c.is_ascii_digit() && !matches!(c, '.' | ','))?;
    let (count, word) = text.split_at(digits);
    let count: f64 = count.replace(',', ".").parse().ok().filter(|n: &f64| n.is_finite() && *n > 0.0)?;
    // A clock of 24 hours is no unit.
    if [12.0, 24.0].contains(&count) && word.trim() == "h" {
        return Some(3600.0);
    }
    let word = word.trim_matches(['x', '×', '*', '·', ' ']);
    UNITS.iter().find(|(_, words)| words.contains(&word)).map(|(unit_s, _)| count * unit_s)
}

/// Kind, seconds of a unit, and what to take off first; `several_s`, where the unit is so many seconds for certain.
fn numeric_kind(
    raw: &[f64],
    name: &str,
    stated_s: Option<f64>,
    several_s: Option<f64>,
) -> (TimeKind, f64, f64) {
    let first = raw.iter().copied().find(|t| t.is_finite()).unwrap_or(0.0);
    let mut sizes: Vec<f64> = steps(raw).map(f64::abs).filter(|s| *s > 0.0).take(1000).collect();
    sizes.sort_by(f64::total_cmp);
    let step = sizes.get(sizes.len() / 2).copied().unwrap_or(1.0);
    let lower = name.to_lowercase();
    let has = |unit: &str| lower.split(|c: char| !c.is_alphanumeric()).any(|w| w == unit);
    if let Some(unit_s) = several_s {
        return (TimeKind::Numbers { unit_s }, unit_s, 0.0);
    }
    if let Some((kind, origin)) = days(first, step, &lower) {
        return (kind, DAY_S, origin);
    }
    if (3.2e9..4.5e9).contains(&first) {
        return (TimeKind::Epoch, 1.0, LABVIEW_1970_S);
    }
    // Ticks of 100 ns, from 1990 to 2150.
    for origin in [FILETIME_1970, NET_TICKS_1970] {
        if (origin + 6.3e15..origin + 5.7e16).contains(&first) {
            return (TimeKind::Epoch, TICK_S, origin);
        }
    }
    // Seconds, milliseconds, microseconds and nanoseconds since 1970, from 2001 on.
    for (seconds_at_least, unit_s) in [(1e9, 1.0), (1e12, 1e-3), (1e15, 1e-6), (1e18, 1e-9)] {
        if (seconds_at_least..3.2 * seconds_at_least).contains(&first) {
            return (TimeKind::Epoch, unit_s, 0.0);
        }
    }
    // A single `s` may stand for anything; seconds are what is taken without a unit.
    let named = UNITS[..6].iter().find(|(_, words)| words.iter().any(|word| has(word)));
    let unit_s = if let Some((unit_s, _)) = named {
        *unit_s
    } else {
        // A step that is the sample time above the rows in another unit tells that unit.
        let is_it = |unit_s: &f64| stated_s.is_some_and(|h| (step * unit_s / h - 1.0).abs() < 0.01);
        [1.0, 1e-3, 60.0, 3600.0].into_iter().find(is_it).unwrap_or(1.0)
    };
    (TimeKind::Numbers { unit_s }, unit_s, 0.0)
}

/// Kind and origin of numbers that count days since long ago.
fn days(first: f64, step: f64, name: &str) -> Option<(TimeKind, f64)> {
    let named = name.contains("julian") || name.split(|c: char| !c.is_alphanumeric()).any(|w| w == "jd");
    if (2_400_000.0..2_500_000.0).contains(&first) && (step < 0.5 || named && step <= 1.0) {
        return Some((TimeKind::JulianDays, JULIAN_1970));
    }
    if name.contains("mjd") && (40_000.0..100_000.0).contains(&first) && step <= 1.0 {
        return Some((TimeKind::JulianDays, MODIFIED_JULIAN_1970));
    }
    if (20_000.0..80_000.0).contains(&first) && step < 0.5 {
        return Some((TimeKind::ExcelSerials, EXCEL_1970));
    }
    let is_matlab = (700_000.0..800_000.0).contains(&first) && step < 0.5;
    is_matlab.then_some((TimeKind::MatlabDays, MATLAB_1970))
}

fn note_gaps(time_s: &[f64], keep: Option<&[u32]>, read: &Read, repairs: &mut Vec<Repair>) {
    let Some(typical) = typical_step(time_s).filter(|_| time_s.len() > 3) else { return };
    let gap = |s: f64| s > 3.0 * typical * (1.0 + 1e-9);
    let count = steps(time_s).filter(|&s| gap(s)).count();
    if count > 0 {
        let first = steps(time_s).position(gap).unwrap_or(0) + 1;
        let longest_s = steps(time_s).fold(0.0, f64::max);
        let row = keep.map_or(first, |keep| keep[first] as usize);
        repairs.push(Repair::Gaps { count, line: read.line(row), longest_s });
    }
}
