//! The time axis: which column it is, in what unit, and in which order.

use vasos_engine::signal::LogStart;

use super::rows::{Kind, Read};
use super::stamp::iso;
use super::{ImportError, ImportOptions, Repair, TimeKind};

const DAY_S: f64 = 86_400.0;
/// 1970-01-01 as a spreadsheet counts days.
const EXCEL_1970: f64 = 25_569.0;
/// A nameless column needs this many rows to pass for a clock.
const FEWEST_TICKS: usize = 8;
/// A share of repeated stamps above this means stamps coarser than the sampling.
const COARSE_STAMPS: f64 = 0.25;

/// The time axis of a log.
#[derive(Debug)]
pub(super) struct Axis {
    pub time_s: Vec<f64>,
    pub start: LogStart,
    pub kind: TimeKind,
    /// Columns the time was made of.
    pub columns: Vec<usize>,
    /// Rows kept, when not all are.
    pub keep: Option<Vec<usize>>,
}

/// Finds and puts in order the time axis.
///
/// # Errors
/// [`ImportError::NoSuchTimeColumn`] for a column the user named that is not there; [`ImportError::TimeStandsStill`]
/// where the time column holds one value, and no sample time was given.
pub(super) fn find(
    read: &Read,
    options: &ImportOptions,
    repairs: &mut Vec<Repair>,
) -> Result<Axis, ImportError> {
    let columns = match &options.time_column {
        Some(name) => {
            let at = read.names.iter().position(|n| n == name);
            let columns = || read.names.join(", ");
            vec![at.ok_or_else(|| ImportError::NoSuchTimeColumn { name: name.clone(), columns: columns() })?]
        }
        None => choose(read),
    };
    // A PV that rises evenly passes for a clock; a column named as one goes before.
    let by_behaviour = options.time_column.is_none()
        && columns
            .first()
            .is_none_or(|&i| read.columns[i].kind == Kind::Number && !is_time_name(&read.names[i]));
    let still = by_behaviour.then(|| still_clock(read)).flatten().or_else(|| {
        let first = *columns.first()?;
        (columns.len() == 1 && stands_still(&read.columns[first].values)).then_some(first)
    });
    if let (Some(column), None) = (still, options.sample_time_s) {
        return Err(ImportError::TimeStandsStill {
            name: read.names[column].clone(),
            rows: read.lines.len(),
        });
    }
    let columns = if still.is_some() { Vec::new() } else { columns };
    let Some(&first) = columns.first() else {
        let sample_time_s = options.sample_time_s.filter(|h| h.is_finite() && *h > 0.0);
        let assumed = sample_time_s.is_none();
        let sample_time_s = sample_time_s.unwrap_or(1.0);
        if assumed {
            repairs.push(Repair::NoTimeColumn { sample_time_s });
        }
        let time_s = (0..read.lines.len()).map(|k| k as f64 * sample_time_s).collect();
        let kind = TimeKind::Missing { sample_time_s, assumed };
        return Ok(Axis { time_s, start: LogStart::Unknown, kind, columns, keep: None });
    };
    let (kind, raw) = seconds(read, &columns);
    let (keep, mut time_s) = ordered(&raw, &read.lines, repairs);
    let start_s = time_s.first().copied().unwrap_or(0.0);
    let start = match kind {
        TimeKind::Stamps if read.columns[first].kind == Kind::Clock => LogStart::Seconds(start_s),
        TimeKind::Stamps | TimeKind::ExcelSerials | TimeKind::Epoch => LogStart::Calendar(iso(start_s)),
        TimeKind::Numbers { .. } | TimeKind::Missing { .. } => LogStart::Seconds(start_s),
    };
    for t in &mut time_s {
        *t -= start_s;
    }
    note_gaps(&time_s, &keep, &read.lines, repairs);
    let all = keep.len() == raw.len();
    Ok(Axis { time_s, start, kind, columns, keep: if all { None } else { Some(keep) } })
}

/// The time column, or a date and a time of day: stamps, else by name, else by behaviour.
fn choose(read: &Read) -> Vec<usize> {
    let of_kind = |kind| read.columns.iter().position(|c| c.kind == kind);
    if let Some(full) = of_kind(Kind::Full) {
        return vec![full];
    }
    match (of_kind(Kind::Date), of_kind(Kind::Clock)) {
        (Some(date), Some(clock)) => return vec![date, clock],
        (None, Some(clock)) => return vec![clock],
        (Some(date), None) if moves_on(&read.columns[date].values) => return vec![date],
        _ => {}
    }
    let numbers = || (0..read.columns.len()).filter(|&i| read.columns[i].kind == Kind::Number);
    let named = numbers().filter(|&i| is_time_name(&read.names[i]));
    let ticking =
        named.filter(|&i| moves_on(&read.columns[i].values) || mostly_moves_on(&read.columns[i].values));
    // A single letter may be a temperature: of several candidates the longer word, the steadier, the first.
    let rank = |&i: &usize| {
        (read.names[i].chars().count() > 1, is_clocklike(&read.columns[i].values), std::cmp::Reverse(i))
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
        let named = is_time_name(&read.names[i]) && read.names[i].chars().count() > 1;
        named && read.columns[i].kind == Kind::Number && stands_still(&read.columns[i].values)
    })
}

fn stands_still(values: &[f64]) -> bool {
    values.len() > 1 && values.iter().all(|t| *t == values[0])
}

fn is_time_name(name: &str) -> bool {
    const NAMES: [&str; 22] = [
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
    words.next().is_some_and(|w| NAMES.contains(&w)) || lower.contains("time") || lower.contains("tempo (")
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

/// Nearly always rising, by nearly the same step.
fn is_clocklike(values: &[f64]) -> bool {
    if values.len() < FEWEST_TICKS {
        return false;
    }
    let mut sorted: Vec<f64> = steps(values).filter(|s| s.is_finite()).collect();
    if sorted.is_empty() {
        return false;
    }
    sorted.sort_by(f64::total_cmp);
    let typical = sorted[sorted.len() / 2];
    let near = sorted.iter().filter(|s| (0.3 * typical..=3.0 * typical).contains(*s)).count();
    typical > 0.0 && near * 100 >= values.len().saturating_sub(1) * 90
}

fn is_row_number(values: &[f64]) -> bool {
    let first = values[0];
    (first == 0.0 || first == 1.0) && values.iter().enumerate().all(|(i, &v)| v == first + i as f64)
}

/// The chosen columns in seconds.
fn seconds(read: &Read, columns: &[usize]) -> (TimeKind, Vec<f64>) {
    let first = &read.columns[columns[0]];
    let mut raw = first.values.clone();
    if let Some(&clock) = columns.get(1) {
        raw.iter_mut().zip(&read.columns[clock].values).for_each(|(t, s)| *t += s);
    }
    match first.kind {
        Kind::Clock => {
            unwrap_midnights(&mut raw);
            (TimeKind::Stamps, raw)
        }
        Kind::Full | Kind::Date | Kind::Words => (TimeKind::Stamps, raw),
        Kind::Number => {
            let (kind, unit_s, origin) = numeric_kind(&raw, &unit_of(read, columns[0]));
            raw.iter_mut().for_each(|t| *t = (*t - origin) * unit_s);
            (kind, raw)
        }
    }
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

/// Name and unit of a column: either may say what it counts.
fn unit_of(read: &Read, column: usize) -> String {
    format!("{} {}", read.names[column], read.units[column].as_deref().unwrap_or(""))
}

/// Kind, seconds of a unit, and what to take off first.
fn numeric_kind(raw: &[f64], name: &str) -> (TimeKind, f64, f64) {
    let first = raw.iter().copied().find(|t| t.is_finite()).unwrap_or(0.0);
    let mut sizes: Vec<f64> = steps(raw).filter(|s| *s > 0.0).take(1000).collect();
    sizes.sort_by(f64::total_cmp);
    let step = sizes.get(sizes.len() / 2).copied().unwrap_or(1.0);
    if (20_000.0..80_000.0).contains(&first) && step < 0.5 {
        return (TimeKind::ExcelSerials, DAY_S, EXCEL_1970);
    }
    if (1e9..1e10).contains(&first) {
        return (TimeKind::Epoch, 1.0, 0.0);
    }
    if (1e12..1e13).contains(&first) {
        return (TimeKind::Epoch, 1e-3, 0.0);
    }
    let lower = name.to_lowercase();
    let has = |unit: &str| lower.split(|c: char| !c.is_alphanumeric()).any(|w| w == unit);
    let unit_s = if has("ms") || has("millis") || has("milliseconds") {
        1e-3
    } else if has("min") || has("minutes") || has("minutos") {
        60.0
    } else if has("h") || has("hours") || has("horas") {
        3600.0
    } else {
        1.0
    };
    (TimeKind::Numbers { unit_s }, unit_s, 0.0)
}

/// Rows in order of time and their times: strays and repeats out, of several runs the longest.
fn ordered(raw: &[f64], lines: &[u32], repairs: &mut Vec<Repair>) -> (Vec<usize>, Vec<f64>) {
    let mut keep: Vec<usize> = (0..raw.len()).filter(|&k| raw[k].is_finite()).collect();
    if keep.len() < raw.len() {
        let line = (0..raw.len()).find(|&k| !raw[k].is_finite()).map_or(0, |k| lines[k] as usize);
        repairs.push(Repair::NoTime { count: raw.len() - keep.len(), line });
    }
    drop_strays(raw, &mut keep, lines, repairs);
    keep_longest_run(raw, &mut keep, lines, repairs);
    let repeats = keep.windows(2).filter(|w| raw[w[1]] == raw[w[0]]).count();
    if repeats == 0 {
        let time_s = keep.iter().map(|&k| raw[k]).collect();
        return (keep, time_s);
    }
    if repeats as f64 > COARSE_STAMPS * keep.len() as f64 {
        repairs.push(Repair::SpreadStamps { count: repeats });
        let time_s = spread(&keep.iter().map(|&k| raw[k]).collect::<Vec<_>>());
        return (keep, time_s);
    }
    let first = keep.windows(2).find(|w| raw[w[1]] == raw[w[0]]).map_or(0, |w| lines[w[1]] as usize);
    repairs.push(Repair::DuplicateStamps { count: repeats, line: first });
    keep.dedup_by(|a, b| raw[*a] == raw[*b]);
    let time_s = keep.iter().map(|&k| raw[k]).collect();
    (keep, time_s)
}

/// Single rows whose stamp lies outside those of both neighbours.
fn drop_strays(raw: &[f64], keep: &mut Vec<usize>, lines: &[u32], repairs: &mut Vec<Repair>) {
    let mut strays = Vec::new();
    let mut kept: Vec<usize> = Vec::with_capacity(keep.len());
    for (i, &k) in keep.iter().enumerate() {
        let before = kept.last().map(|&b| raw[b]);
        let after = keep.get(i + 1).map(|&a| raw[a]);
        let fits = |t: f64, next: Option<f64>| next.is_none_or(|n| n >= t);
        let stray = match (before, after) {
            // Too early, and the next row goes on from the one before.
            (Some(b), Some(a)) if raw[k] < b => a >= b,
            // Too late, and the next row goes on from the one before.
            (Some(b), Some(a)) if raw[k] > a => a >= b && fits(a, keep.get(i + 2).map(|&n| raw[n])),
            _ => false,
        };
        if stray { strays.push(lines[k] as usize) } else { kept.push(k) }
    }
    if let Some(&line) = strays.first() {
        repairs.push(Repair::StrayStamps { count: strays.len(), line });
        *keep = kept;
    }
}

fn keep_longest_run(raw: &[f64], keep: &mut Vec<usize>, lines: &[u32], repairs: &mut Vec<Repair>) {
    let Some(jump) = keep.windows(2).position(|w| raw[w[1]] < raw[w[0]]) else { return };
    let (line, back_s) = (lines[keep[jump + 1]] as usize, raw[keep[jump]] - raw[keep[jump + 1]]);
    let longest = keep.chunk_by(|&a, &b| raw[b] >= raw[a]).max_by_key(|run| run.len()).map(<[usize]>::to_vec);
    if let Some(run) = longest {
        let (from_line, to_line) = (lines[run[0]] as usize, lines[run[run.len() - 1]] as usize);
        repairs.push(Repair::TimeRestart { line, back_s, from_line, to_line });
        *keep = run;
    }
}

/// Spreads rows of one stamp evenly up to the next stamp.
fn spread(time_s: &[f64]) -> Vec<f64> {
    let mut even = Vec::with_capacity(time_s.len());
    let groups: Vec<&[f64]> = time_s.chunk_by(|a, b| a == b).collect();
    for (i, group) in groups.iter().enumerate() {
        let here = group[0];
        let next = groups.get(i + 1).map(|g| g[0]);
        let before = i.checked_sub(1).map(|b| groups[b][0]);
        let width = next.map_or_else(|| before.map_or(1.0, |b| here - b), |n| n - here);
        even.extend((0..group.len()).map(|j| here + width * j as f64 / group.len() as f64));
    }
    even
}

fn note_gaps(time_s: &[f64], keep: &[usize], lines: &[u32], repairs: &mut Vec<Repair>) {
    let mut sizes: Vec<f64> = steps(time_s).collect();
    if sizes.len() < 3 {
        return;
    }
    let middle = sizes.len() / 2;
    let typical = *sizes.select_nth_unstable_by(middle, f64::total_cmp).1;
    let gap = |s: f64| s > 3.0 * typical * (1.0 + 1e-9);
    let count = steps(time_s).filter(|&s| gap(s)).count();
    if count > 0 {
        let first = steps(time_s).position(gap).unwrap_or(0);
        let longest_s = steps(time_s).fold(0.0, f64::max);
        repairs.push(Repair::Gaps { count, line: lines[keep[first + 1]] as usize, longest_s });
    }
}
