//! One row a value, as historians export it: time, name of the signal, value, and often a quality. Turned into one row
//! a moment with a column a signal.

use std::collections::HashMap;

use super::merge::{Point, Series, merge};
use super::names::is_tag;
use super::read::{Kind, Read, ReadColumn};
use super::{ImportOptions, Repair};

/// Names that columns have in such exports, without marks and in lower case.
const TAG_NAMES: [&str; 34] = [
    "tag",
    "tagname",
    "varname",
    "variable",
    "variablename",
    "name",
    "point",
    "pointname",
    "pointid",
    "signal",
    "signalname",
    "item",
    "itemname",
    "itemid",
    "channel",
    "channelname",
    "sensor",
    "sensorname",
    "tagid",
    "tagpath",
    "messstelle",
    "kanal",
    "parameter",
    "parametername",
    "field",
    "series",
    "metric",
    "node",
    "nodeid",
    "displayname",
    "fullname",
    "variavel",
    "sinal",
    "instrumento",
];
const VALUE_NAMES: [&str; 19] = [
    "value",
    "varvalue",
    "val",
    "vvalue",
    "wert",
    "messwert",
    "valor",
    "reading",
    "floatvalue",
    "doublevalue",
    "numericvalue",
    "avg",
    "average",
    "avgvalue",
    "data",
    "datavalue",
    "pointvalue",
    "measurement",
    "result",
];
const QUALITY_NAMES: [&str; 16] = [
    "quality",
    "validity",
    "confidence",
    "qual",
    "qualitydetail",
    "opcquality",
    "dataintegrity",
    "good",
    "isgood",
    "qualidade",
    "qualitat",
    "gultigkeit",
    "guete",
    "statuscode",
    "qualitycode",
    "q",
];
/// A signal needs this many values on average for names to be those of signals.
const FEWEST_VALUES: usize = 2;
/// OPC: a quality from here on is good; a historian's confidence in percent: from here on.
pub(super) const OPC_GOOD: f64 = 192.0;
const CONFIDENT: f64 = 50.0;

/// The columns of such a layout.
#[derive(Debug, Clone)]
pub(super) struct Long {
    time: Vec<usize>,
    tag: usize,
    value: usize,
    unit: Option<usize>,
    quality: Option<usize>,
}

/// Letters and digits of a name in lower case, without accents.
pub(super) fn normal(name: &str) -> String {
    name.to_lowercase().chars().filter(|c| c.is_alphanumeric()).map(super::roles::plain).collect()
}

/// Whether a name is one of a quality.
pub(super) fn is_quality_name(name: &str) -> bool {
    QUALITY_NAMES.contains(&normal(name).as_str())
}

fn named(read: &Read, names: &[&str], fits: impl Fn(&ReadColumn) -> bool) -> Option<usize> {
    let fitting = || (0..read.columns.len()).filter(|&i| fits(&read.columns[i]));
    names.iter().find_map(|name| fitting().find(|&i| normal(&read.columns[i].name) == *name))
}

/// Recognises the layout: by the names of its columns, or by a column of tags beside a time and one number.
pub(super) fn find(read: &Read, options: &ImportOptions) -> Option<Long> {
    let time = time_columns(read, options)?;
    let is_number = |c: &ReadColumn| c.kind == Kind::Number;
    let quality = named(read, &QUALITY_NAMES, |c| matches!(c.kind, Kind::Number | Kind::Words));
    let unit =
        named(read, &["unit", "units", "engunits", "einheit", "unidade", "uom"], |c| c.kind == Kind::Words);
    let value = named(read, &VALUE_NAMES, is_number);
    let words = |c: &ReadColumn| c.kind == Kind::Words && !c.states.is_empty();
    let tag = named(read, &TAG_NAMES, words).or_else(|| {
        named(read, &["tagid", "pointid", "itemid", "channel"], |c| {
            is_number(c) && few_whole_numbers(&c.values)
        })
    });
    if let (Some(tag), Some(value)) = (tag, value)
        && !time.contains(&tag)
        && !time.contains(&value)
    {
        return Some(Long { time, tag, value, unit, quality });
    }
    // By what the columns hold: one of tags that come again and again, one of numbers.
    let tags = |c: &ReadColumn| {
        let tags = c.states.iter().filter(|s| is_tag(s)).count();
        words(c) && tags * 5 >= c.states.len() * 4 && c.states.len() * FEWEST_VALUES <= c.values.len()
    };
    let mut tagged = (0..read.columns.len()).filter(|&i| tags(&read.columns[i]) && Some(i) != quality);
    let is_other = |i: usize| time.contains(&i) || Some(i) == quality;
    let mut numbers = (0..read.columns.len()).filter(|&i| is_number(&read.columns[i]) && !is_other(i));
    match (tagged.next(), tagged.next(), numbers.next(), numbers.next()) {
        (Some(tag), None, Some(value), None) if comes_again(read, &time, tag) => {
            Some(Long { time, tag, value, unit, quality })
        }
        _ => None,
    }
}

/// Whether moments come again under other names: then a row is a value, not a moment.
fn comes_again(read: &Read, time: &[usize], tag: usize) -> bool {
    let times = &read.columns[time[0]].values;
    let tags = &read.columns[tag].values;
    let goes_on = |k: &usize| times[*k] > times[*k - 1];
    let steps = times.len() - 1;
    let rising = (1..times.len()).filter(goes_on).count();
    let changes = tags.windows(2).filter(|w| w[0] != w[1]).count();
    rising < steps && changes > 0
}

fn few_whole_numbers(values: &[f64]) -> bool {
    let mut known: Vec<f64> = Vec::new();
    for &v in values.iter().filter(|v| v.is_finite()) {
        if !known.contains(&v) {
            known.push(v);
        }
        if v.fract() != 0.0 || known.len() > 256 {
            return false;
        }
    }
    known.len() * FEWEST_VALUES <= values.len()
}

fn time_columns(read: &Read, options: &ImportOptions) -> Option<Vec<usize>> {
    if let Some(name) = &options.time_column {
        return read.columns.iter().position(|c| c.name == *name).map(|i| vec![i]);
    }
    let of = |kind| read.columns.iter().position(|c| c.kind == kind);
    if let Some(full) = super::axis::stamps(read) {
        return Some(vec![full]);
    }
    if let (Some(date), Some(clock)) = (of(Kind::Date), of(Kind::Clock)) {
        return Some(vec![date, clock]);
    }
    let names = ["time", "timestamp", "datetime", "tstamp", "ts", "times", "date", "zeit", "tempo", "epoch"];
    of(Kind::Date)
        .map(|date| vec![date])
        .or_else(|| named(read, &names, |c| c.kind == Kind::Number).map(|i| vec![i]))
}

/// Turns the layout.
pub(super) fn turn(mut read: Read, long: &Long, repairs: &mut Vec<Repair>) -> Read {
    let rows = read.lines.len();
    let good = long.quality.map(|q| good_rows(&read.columns[q]));
    let bad: Vec<usize> = good.iter().flat_map(|g| (0..rows).filter(|&r| !g[r])).collect();
    let quality_name = long.quality.map(|q| read.columns[q].name.clone()).unwrap_or_default();
    let (mut series, states) = by_name(&read, long, good.as_deref());
    take_back(&read.columns[long.value].name, states, repairs);
    let service = |name: &str| name.starts_with("$RT_");
    for signal in series.iter().filter(|s| service(&s.name)) {
        let line = signal.points.first().map_or(0, |p| p.line as usize);
        repairs.push(Repair::ServiceRows { name: signal.name.clone(), count: signal.points.len(), line });
    }
    series.retain(|s| !service(&s.name));
    if let Some(&first) = bad.first() {
        repairs.push(Repair::BadQuality { column: quality_name, count: bad.len(), line: read.line(first) });
    }
    let column = read.columns[long.tag].name.clone();
    repairs.push(Repair::LongLayout { column, signals: series.len(), rows });
    let merged = merge(&mut series, repairs);
    let first = &mut read.columns[long.time[0]];
    let kind = if long.time.len() > 1 { Kind::Full } else { first.kind };
    let mut time = ReadColumn::new(first.name.clone(), first.unit.clone(), kind, merged.time_s);
    time.zone_s = first.zone_s;
    let mut columns = vec![time];
    for (signal, values) in series.into_iter().zip(merged.columns) {
        let kind = if signal.states.is_empty() { Kind::Number } else { Kind::Words };
        let mut column = ReadColumn::new(signal.name, signal.unit, kind, values);
        column.states = signal.states;
        columns.push(column);
    }
    Read { columns, lines: merged.lines, stated_sample_time_s: None }
}

/// The rows of each name, in the order in which the names come, and how many words among them are states.
fn by_name(read: &Read, long: &Long, good: Option<&[bool]>) -> (Vec<Series>, usize) {
    let (tags, values) = (&read.columns[long.tag], &read.columns[long.value]);
    let time_s = |row: usize| long.time.iter().map(|&i| read.columns[i].values[row]).sum::<f64>();
    let mut order: HashMap<u64, usize> = HashMap::new();
    let mut series: Vec<Series> = Vec::new();
    let mut words: Vec<usize> = Vec::new();
    let mut strays = values.strays.iter().peekable();
    for row in 0..read.lines.len() {
        let word = strays.next_if(|(at, _)| *at as usize == row).is_some();
        let tag = tags.values[row];
        if !tag.is_finite() {
            continue;
        }
        let at = *order.entry(tag.to_bits()).or_insert_with(|| {
            let name =
                tags.states.get(tag as usize).cloned().unwrap_or_else(|| format!("{} {tag}", tags.name));
            let unit = long.unit.and_then(|u| {
                let units = &read.columns[u];
                units
                    .states
                    .get(units.values[row] as usize)
                    .filter(|_| units.values[row].is_finite())
                    .cloned()
            });
            series.push(Series { name, unit, states: Vec::new(), points: Vec::new() });
            words.push(0);
            series.len() - 1
        });
        words[at] += usize::from(word);
        let is_good = good.is_none_or(|g| g[row]);
        // A word stands for a value until it is known whether its signal is one of words.
        let value = if word { 0.0 } else { values.values[row] };
        let point = Point {
            time_s: time_s(row),
            value: if is_good { value } else { f64::NAN },
            line: read.lines[row],
        };
        series[at].points.push(point);
    }
    let states = settle_words(read, long, &mut series, &words);
    (series, states)
}

/// Words that turned out to be states are no missing values.
fn take_back(value_column: &str, states: usize, repairs: &mut Vec<Repair>) {
    for repair in repairs.iter_mut() {
        if let Repair::MissingValues { column, count, text, .. } = repair
            && column == value_column
            && !text.is_empty()
        {
            *count -= states.min(*count);
        }
    }
    repairs.retain(|r| !matches!(r, Repair::MissingValues { count: 0, .. }));
}

/// Signals whose values are mostly words become states; words among numbers become missing values. Gives how many words
/// became states.
fn settle_words(read: &Read, long: &Long, series: &mut [Series], words: &[usize]) -> usize {
    let values = &read.columns[long.value];
    let mut states = 0;
    if values.strays.is_empty() {
        return states;
    }
    let stray_lines: HashMap<u32, u32> =
        values.strays.iter().map(|(row, word)| (read.lines[*row as usize], *word)).collect();
    for (signal, &count) in series.iter_mut().zip(words) {
        let of_words = count * 2 > signal.points.len();
        for point in signal.points.iter_mut() {
            let word = stray_lines.get(&point.line).filter(|_| point.value.is_finite());
            point.value = match (of_words, word) {
                (true, Some(&word)) => {
                    states += 1;
                    let word = &values.states[word as usize];
                    let known = signal.states.iter().position(|s| s == word).unwrap_or_else(|| {
                        signal.states.push(word.clone());
                        signal.states.len() - 1
                    });
                    known as f64
                }
                (false, None) => point.value,
                _ => f64::NAN,
            };
        }
    }
    states
}

/// Which rows a column of qualities calls good.
pub(super) fn good_rows(column: &ReadColumn) -> Vec<bool> {
    if column.kind == Kind::Words {
        let bad: Vec<bool> = column.states.iter().map(|s| is_bad(s)).collect();
        return column.values.iter().map(|v| !v.is_finite() || !bad[*v as usize]).collect();
    }
    let largest = column.values.iter().copied().filter(|v| v.is_finite()).fold(0.0, f64::max);
    let least = match largest {
        l if l >= OPC_GOOD => OPC_GOOD,
        l if l >= CONFIDENT => CONFIDENT,
        l if l >= 1.0 => 1.0,
        // Zero throughout is how an OPC UA status says good.
        _ => 0.0,
    };
    column.values.iter().map(|v| !v.is_finite() || *v >= least).collect()
}

/// Whether a word calls a value bad.
pub(super) fn is_bad(word: &str) -> bool {
    let word = word.to_lowercase();
    let none = word == "no" || word.starts_with("no ") || word.starts_with("not ");
    none || ["bad", "false", "invalid", "ruim", "schlecht", "ungültig", "comm"]
        .iter()
        .any(|b| word.starts_with(b))
}
