//! Signals with stamps of their own onto one time axis.

use super::Repair;
use super::order::typical_step;

/// So many stamps more than the busiest signal has are taken as they are; more are joined.
const AS_THEY_ARE: f64 = 1.5;
/// Stamps within this share of the busiest signal's step make one row.
const ONE_ROW: f64 = 0.5;

/// A value of a signal: its time in seconds, the value, the line it stood in.
#[derive(Debug, Clone, Copy)]
pub(super) struct Point {
    pub time_s: f64,
    pub value: f64,
    pub line: u32,
}

/// A signal with its own stamps.
#[derive(Debug, Clone)]
pub(super) struct Series {
    pub name: String,
    pub unit: Option<String>,
    pub states: Vec<String>,
    pub points: Vec<Point>,
}

/// One axis with a column for each signal, in the order given.
#[derive(Debug)]
pub(super) struct Merged {
    pub time_s: Vec<f64>,
    pub lines: Vec<u32>,
    pub columns: Vec<Vec<f64>>,
}

/// Brings signals onto one axis. Where a signal has no value of its own for a row, its last one is held and that is
/// told; a value that is missing in the file (NaN) stays missing.
pub(super) fn merge(series: &mut [Series], repairs: &mut Vec<Repair>) -> Merged {
    for signal in series.iter_mut() {
        signal.points.retain(|p| p.time_s.is_finite());
        if !signal.points.is_sorted_by(|a, b| a.time_s <= b.time_s) {
            signal.points.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
        }
    }
    let ends = row_ends(series, repairs);
    let (mut time_s, mut lines) = (vec![f64::INFINITY; ends.len()], vec![u32::MAX; ends.len()]);
    let columns: Vec<Vec<f64>> =
        series.iter().map(|signal| place(signal, &ends, &mut time_s, &mut lines, repairs)).collect();
    Merged { time_s, lines, columns }
}

/// The last stamp that belongs to each row.
fn row_ends(series: &[Series], repairs: &mut Vec<Repair>) -> Vec<f64> {
    let mut stamps: Vec<f64> = series.iter().flat_map(|s| s.points.iter().map(|p| p.time_s)).collect();
    stamps.sort_unstable_by(f64::total_cmp);
    stamps.dedup();
    let Some(busiest) = series.iter().max_by_key(|s| s.points.len()) else { return stamps };
    if stamps.len() as f64 <= AS_THEY_ARE * busiest.points.len() as f64 {
        return stamps;
    }
    let times: Vec<f64> = busiest.points.iter().map(|p| p.time_s).collect();
    let within_s = ONE_ROW * typical_step(&times).unwrap_or(0.0);
    let mut ends: Vec<f64> = Vec::with_capacity(busiest.points.len());
    let mut start = f64::NEG_INFINITY;
    for t in stamps {
        match ends.last_mut() {
            Some(end) if t - start <= within_s => *end = t,
            _ => {
                ends.push(t);
                start = t;
            }
        }
    }
    repairs.push(Repair::JoinedStamps { within_s, rows: ends.len() });
    ends
}

fn place(
    signal: &Series,
    ends: &[f64],
    time_s: &mut [f64],
    lines: &mut [u32],
    repairs: &mut Vec<Repair>,
) -> Vec<f64> {
    let mut points = signal.points.iter().peekable();
    let mut last: Option<Point> = None;
    let (mut held, mut longest_s) = (0, 0.0_f64);
    let (mut replaced, mut replaced_line) = (0, 0);
    let mut values = Vec::with_capacity(ends.len());
    for (row, &end) in ends.iter().enumerate() {
        let mut own: Option<Point> = None;
        while let Some(point) = points.next_if(|p| p.time_s <= end) {
            if let Some(earlier) = own {
                if replaced == 0 {
                    replaced_line = earlier.line as usize;
                }
                replaced += 1;
            }
            time_s[row] = time_s[row].min(point.time_s);
            lines[row] = lines[row].min(point.line);
            own = Some(*point);
        }
        if own.is_none()
            && let Some(before) = last
        {
            held += 1;
            longest_s = longest_s.max(end - before.time_s);
        }
        last = own.or(last);
        values.push(last.map_or(f64::NAN, |p| p.value));
    }
    let column = || signal.name.clone();
    if replaced > 0 {
        repairs.push(Repair::ReplacedValues { column: column(), count: replaced, line: replaced_line });
    }
    if held > 0 {
        repairs.push(Repair::HeldValues { column: column(), count: held, longest_s });
    }
    values
}
