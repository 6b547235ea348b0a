//! Rows in the order of time: strays and repeats out, falling order turned round, clocks set back put right, runs
//! sorted where their stamps allow it.

use super::Repair;
use super::corrected::carry_on;
use super::read::Read;

/// A share of repeated stamps above this means stamps coarser than the sampling.
const COARSE_STAMPS: f64 = 0.25;
/// A share of steps back above this means rows in no order at all.
const SHUFFLED: f64 = 0.05;
const HOUR_S: f64 = 3600.0;
/// Steps a typical one is judged by.
const STEPS: usize = 100_000;

/// Rows kept, `None` for all as they are, and their times in seconds.
pub(super) type Ordered = (Option<Vec<u32>>, Vec<f64>);

/// Puts the rows in order. `calendar` says that times are dates, so that runs can be told apart and sorted; `zoned`
/// that they are in UTC.
pub(super) fn ordered(
    mut raw: Vec<f64>,
    read: &Read,
    calendar: bool,
    zoned: bool,
    repairs: &mut Vec<Repair>,
) -> Ordered {
    if raw.windows(2).all(|w| w[1] > w[0]) && raw.iter().all(|t| t.is_finite()) {
        return (None, raw);
    }
    let mut keep: Vec<u32> = (0..raw.len() as u32).filter(|&k| raw[k as usize].is_finite()).collect();
    if keep.len() < raw.len() {
        let first = (0..raw.len()).find(|&k| !raw[k].is_finite()).unwrap_or(0);
        repairs.push(Repair::NoTime { count: raw.len() - keep.len(), line: read.line(first) });
    }
    let rise = |keep: &[u32], raw: &[f64], sign: f64| {
        keep.windows(2).filter(|w| sign * (raw[w[1] as usize] - raw[w[0] as usize]) > 0.0).count()
    };
    let (up, down) = (rise(&keep, &raw, 1.0), rise(&keep, &raw, -1.0));
    if down > 0 && down > 9 * up {
        keep.reverse();
        repairs.push(Repair::FallingTime);
    } else if calendar && down > 1 && down as f64 > SHUFFLED * keep.len() as f64 {
        sort(&raw, &mut keep, read, repairs);
    }
    if calendar && !zoned {
        set_clock_on(&mut raw, &keep, read, repairs);
    }
    drop_strays(&raw, &mut keep, read, repairs);
    carry_on(&mut raw, &mut keep, calendar, read, repairs);
    join_runs(&raw, &mut keep, calendar, read, repairs);
    let time_s = without_repeats(&raw, &mut keep, read, repairs);
    let all = keep.len() == raw.len() && keep.iter().enumerate().all(|(i, &k)| i == k as usize);
    ((!all).then_some(keep), time_s)
}

/// The step that half of all steps exceed.
pub(super) fn typical_step(time_s: &[f64]) -> Option<f64> {
    let stride = time_s.len() / STEPS + 1;
    let mut sizes: Vec<f64> =
        time_s.windows(2).step_by(stride).map(|w| w[1] - w[0]).filter(|s| s.is_finite()).collect();
    if sizes.is_empty() {
        return None;
    }
    let middle = sizes.len() / 2;
    Some(*sizes.select_nth_unstable_by(middle, f64::total_cmp).1)
}

fn sort(raw: &[f64], keep: &mut [u32], read: &Read, repairs: &mut Vec<Repair>) {
    let jump = keep.windows(2).find(|w| raw[w[1] as usize] < raw[w[0] as usize]);
    let line = jump.map_or(0, |w| read.line(w[1] as usize));
    keep.sort_by(|a, b| raw[*a as usize].total_cmp(&raw[*b as usize]));
    repairs.push(Repair::SortedRows { line });
}

/// The end of summer time: one step back by an hour, less the time between two rows. What follows is an hour later.
fn set_clock_on(raw: &mut [f64], keep: &[u32], read: &Read, repairs: &mut Vec<Repair>) {
    let back: Vec<usize> =
        (1..keep.len()).filter(|&i| raw[keep[i] as usize] < raw[keep[i - 1] as usize]).collect();
    let [at] = back[..] else { return };
    let kept: Vec<f64> = keep.iter().map(|&k| raw[k as usize]).collect();
    let step = typical_step(&kept).unwrap_or(0.0);
    let true_step = kept[at] - kept[at - 1] + HOUR_S;
    if step <= 0.0 || (true_step - step).abs() > 0.5 * step || step > 0.25 * HOUR_S {
        return;
    }
    // A single row out of place is a stray, not a clock.
    if kept.get(at + 1).is_some_and(|&next| next > kept[at - 1]) {
        return;
    }
    keep[at..].iter().for_each(|&k| raw[k as usize] += HOUR_S);
    repairs.push(Repair::ClockSetBack { line: read.line(keep[at] as usize) });
}

/// Single rows whose stamp lies outside those of both neighbours.
fn drop_strays(raw: &[f64], keep: &mut Vec<u32>, read: &Read, repairs: &mut Vec<Repair>) {
    let mut strays = Vec::new();
    let mut kept: Vec<u32> = Vec::with_capacity(keep.len());
    let at = |k: u32| raw[k as usize];
    for (i, &k) in keep.iter().enumerate() {
        let before = kept.last().map(|&b| at(b));
        let after = keep.get(i + 1).map(|&a| at(a));
        let fits = |t: f64, next: Option<f64>| next.is_none_or(|n| n >= t);
        let stray = match (before, after) {
            // Too early, and the next row goes on from the one before.
            (Some(b), Some(a)) if at(k) < b => a >= b,
            // Too late, and the next row goes on from the one before.
            (Some(b), Some(a)) if at(k) > a => a >= b && fits(a, keep.get(i + 2).map(|&n| at(n))),
            _ => false,
        };
        if stray { strays.push(read.line(k as usize)) } else { kept.push(k) }
    }
    if let Some(&line) = strays.first() {
        repairs.push(Repair::StrayStamps { count: strays.len(), line });
        *keep = kept;
    }
}

/// Several runs in one file: sorted where they are dated and do not overlap, else the longest.
fn join_runs(raw: &[f64], keep: &mut Vec<u32>, calendar: bool, read: &Read, repairs: &mut Vec<Repair>) {
    let at = |k: u32| raw[k as usize];
    let Some(jump) = keep.windows(2).position(|w| at(w[1]) < at(w[0])) else { return };
    let mut runs: Vec<&[u32]> = keep.chunk_by(|&a, &b| at(b) >= at(a)).collect();
    runs.sort_by(|a, b| at(a[0]).total_cmp(&at(b[0])));
    if calendar && runs.windows(2).all(|w| at(w[1][0]) >= at(w[0][w[0].len() - 1])) {
        repairs.push(Repair::SortedRows { line: read.line(keep[jump + 1] as usize) });
        *keep = runs.concat();
        return;
    }
    let (line, back_s) = (read.line(keep[jump + 1] as usize), at(keep[jump]) - at(keep[jump + 1]));
    let longest = keep.chunk_by(|&a, &b| at(b) >= at(a)).max_by_key(|run| run.len()).map(<[u32]>::to_vec);
    if let Some(run) = longest {
        let ends = [run[0], run[run.len() - 1]].map(|k| read.line(k as usize));
        repairs.push(Repair::TimeRestart { line, back_s, from_line: ends[0], to_line: ends[1] });
        *keep = run;
    }
}

fn without_repeats(raw: &[f64], keep: &mut Vec<u32>, read: &Read, repairs: &mut Vec<Repair>) -> Vec<f64> {
    let at = |k: u32| raw[k as usize];
    let repeats = keep.windows(2).filter(|w| at(w[1]) == at(w[0])).count();
    if repeats as f64 > COARSE_STAMPS * keep.len() as f64 {
        repairs.push(Repair::SpreadStamps { count: repeats });
        return spread(&keep.iter().map(|&k| at(k)).collect::<Vec<_>>());
    }
    if repeats > 0 {
        let first = keep.windows(2).find(|w| at(w[1]) == at(w[0])).map_or(0, |w| read.line(w[1] as usize));
        repairs.push(Repair::DuplicateStamps { count: repeats, line: first });
        keep.dedup_by(|a, b| at(*a) == at(*b));
    }
    keep.iter().map(|&k| at(k)).collect()
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
