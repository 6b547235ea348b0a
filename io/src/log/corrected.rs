//! Clocks that were corrected while a log was written, and rows that stand in it twice.

use super::Repair;
use super::order::typical_step;
use super::read::{Kind, Read};

/// More steps back than this share of the rows are no corrections of a clock.
const CORRECTIONS: f64 = 0.01;
/// Times counted by a program begin anew where they fall below this share of the run before.
const ANEW: f64 = 0.5;
/// Share of the rows of an overlap that must be there already for it to be a copy.
const SAME: f64 = 0.9;

/// What was found, with the first line of it.
#[derive(Debug, Default)]
struct Found {
    back: Option<(usize, f64)>,
    corrections: usize,
    repeated: usize,
    repeated_line: usize,
}

/// Lets the rows behind a small step back follow those before: moved on, so that the first comes one sample time behind
/// the last row before, or, where an overlap holds the same rows again, without those. Runs that begin anew are left.
///
/// The time that went by at the step cannot be told from the clock: t' = t + (t_last − t_first + h), in seconds, with h the
/// typical step.
pub(super) fn carry_on(
    raw: &mut [f64],
    keep: &mut Vec<u32>,
    calendar: bool,
    read: &Read,
    repairs: &mut Vec<Repair>,
) {
    let runs: Vec<&[u32]> = keep.chunk_by(|&a, &b| raw[b as usize] >= raw[a as usize]).collect();
    let most = (CORRECTIONS * keep.len() as f64).max(1.0);
    if runs.len() < 2 || (runs.len() - 1) as f64 > most || calendar && stand_apart(raw, &runs) {
        return;
    }
    let mut found = Found::default();
    let mut kept: Vec<u32> = runs[0].to_vec();
    // Where in `kept` the run begins that goes on, and what its rows were moved by.
    let (mut begin, mut moved_s) = (0, 0.0);
    for run in &runs[1..] {
        let at = |k: u32| raw[k as usize];
        let (start_s, end_s) = (at(kept[begin]), at(kept[kept.len() - 1]));
        let first_s = at(run[0]) + moved_s;
        let again = copies(raw, &kept[begin..], run, moved_s, read);
        let goes_on = first_s > start_s + if calendar { 0.0 } else { ANEW * (end_s - start_s) };
        let line = read.line(run[0] as usize);
        let run = &run[again..];
        if again > 0 {
            found.repeated_line = if found.repeated == 0 { line } else { found.repeated_line };
            found.repeated += again;
        } else if goes_on && first_s < end_s {
            found.back.get_or_insert((line, end_s - first_s));
            found.corrections += 1;
            moved_s += end_s - first_s + step(raw, &kept[begin..]);
        } else if !goes_on {
            (begin, moved_s) = (kept.len(), 0.0);
        }
        run.iter().for_each(|&k| raw[k as usize] += moved_s);
        kept.extend(run);
    }
    if let Some((line, back_s)) = found.back {
        repairs.push(Repair::ClockStepsBack { count: found.corrections, line, back_s });
    }
    if found.repeated > 0 {
        repairs.push(Repair::RepeatedRows { count: found.repeated, line: found.repeated_line });
    }
    *keep = kept;
}

/// Whether runs only need sorting: none holds times of another.
fn stand_apart(raw: &[f64], runs: &[&[u32]]) -> bool {
    let mut ends: Vec<[f64; 2]> =
        runs.iter().map(|run| [raw[run[0] as usize], raw[run[run.len() - 1] as usize]]).collect();
    ends.sort_by(|a, b| a[0].total_cmp(&b[0]));
    ends.windows(2).all(|w| w[1][0] >= w[0][1])
}

/// The typical step of a run, of those that move where stamps are coarser than rows.
fn step(raw: &[f64], run: &[u32]) -> f64 {
    let mut time_s: Vec<f64> = run.iter().map(|&k| raw[k as usize]).collect();
    let all = typical_step(&time_s).unwrap_or(0.0);
    time_s.dedup();
    if all > 0.0 { all } else { typical_step(&time_s).unwrap_or(0.0) }
}

/// How many rows a run begins with that are in the one before: same stamps, same values, and not all alike.
fn copies(raw: &[f64], before: &[u32], run: &[u32], moved_s: f64, read: &Read) -> usize {
    let at = |k: u32| raw[k as usize];
    let end_s = at(before[before.len() - 1]);
    let overlap = run.iter().take_while(|&&k| at(k) + moved_s <= end_s).count();
    let measured: Vec<&[f64]> = read
        .columns
        .iter()
        .filter(|c| !c.kind.is_stamp() && c.values.len() == raw.len())
        .filter(|c| c.kind != Kind::Words || !c.is_text_only())
        .map(|c| c.values.as_slice())
        .collect();
    let equal = |a: u32, b: u32| {
        measured
            .iter()
            .all(|c| c[a as usize] == c[b as usize] || c[a as usize].is_nan() && c[b as usize].is_nan())
    };
    let is_there = |k: u32| {
        let from = before.partition_point(|&b| at(b) < at(k) + moved_s);
        before[from..].iter().take_while(|&&b| at(b) == at(k) + moved_s).any(|&b| equal(b, k))
    };
    let overlapping = &run[..overlap];
    if !overlapping.windows(2).any(|w| !equal(w[0], w[1])) {
        return 0;
    }
    let there = overlapping.iter().filter(|&&k| is_there(k)).count();
    if there as f64 >= SAME * overlap as f64 { overlap } else { 0 }
}
