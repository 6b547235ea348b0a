//! Rows of a log that are no measurements: frozen, repeated, struck by a spike; and an MV at its limits.

use super::finding::RecordFinding;
use super::interpolated::values_kept;
use super::spikes::spikes;
use crate::identify::statistics::resolution;

/// What a look at the columns gives.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Conditioned {
    /// Rows whose PV counts.
    pub keep: Vec<bool>,
    /// Rows at which the MV is at a limit.
    pub saturated: Vec<bool>,
    /// MV with its slips mended; absent without any.
    pub mv: Option<Vec<f64>>,
    /// What was seen.
    pub findings: Vec<RecordFinding>,
}

/// A record of N rows.
#[derive(Debug, Clone)]
pub(super) struct Rows<'a> {
    pub time_s: &'a [f64],
    pub pv: &'a [f64],
    pub mv: &'a [f64],
    /// Rows in which a hand writes the MV, where the log says.
    pub manual: Option<Vec<bool>>,
    /// Number of the first row, for messages.
    pub first_row: usize,
}

/// Looks at a record.
pub(super) fn condition(rows: &Rows) -> Conditioned {
    let Rows { time_s, pv, mv, first_row, .. } = *rows;
    let mut keep = vec![true; pv.len()];
    let mut findings = Vec::new();
    if let Some(kept) = values_kept(time_s, pv, mv) {
        keep.fill(false);
        kept.iter().for_each(|&row| keep[row] = true);
        findings.push(RecordFinding::Interpolated { values: kept.len(), rows: pv.len() });
    }
    let runs = runs(pv);
    let repeated = repeated(pv, &runs);
    if let Some(rows) = repeated {
        for &(first, length) in &runs {
            keep[first + 1..first + length].fill(false);
        }
        findings.push(RecordFinding::Oversampled { rows });
    } else if let Some(frozen) = frozen(time_s, pv, mv, &runs) {
        let rows = frozen.iter().map(|f| f.1 - 1).sum();
        for &(first, length) in &frozen {
            keep[first + 1..first + length].fill(false);
        }
        let (first, length) = frozen[0];
        findings.push(RecordFinding::Frozen {
            rows,
            from_s: time_s[first],
            to_s: time_s[first + length - 1],
            times: frozen.len(),
        });
    }
    let spikes = spikes(pv, mv, &keep);
    if let Some(&first) = spikes.first() {
        for &row in &spikes {
            keep[row] = false;
        }
        findings.push(RecordFinding::Outliers {
            count: spikes.len(),
            row: first_row + first,
            value: pv[first],
        });
    }
    let counted: Vec<f64> = pv.iter().zip(&keep).filter(|(_, keep)| **keep).map(|(y, _)| *y).collect();
    if let Some(step) = resolution(&counted, 0.02) {
        findings.push(RecordFinding::Quantised { step });
    }
    let slips = slips(mv);
    let mended = (!slips.is_empty()).then(|| mended(mv, &slips));
    if let Some(&row) = slips.first() {
        findings.push(RecordFinding::MvSlips { count: slips.len(), row: first_row + row, value: mv[row] });
    }
    let saturated = at_limits(mended.as_deref().unwrap_or(mv), rows.manual.as_deref(), &mut findings);
    Conditioned { keep, saturated, mv: mended, findings }
}

/// Single rows far outside everything else that come back to where they were: a slip of the log, not a move.
pub(super) fn slips(values: &[f64]) -> Vec<usize> {
    /// Ranges of the other rows beyond which no actuator goes and comes back within a row.
    const RANGES: f64 = 3.0;
    if values.len() < 20 {
        return vec![];
    }
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let (low, high) = (sorted[sorted.len() * 5 / 100], sorted[sorted.len() * 95 / 100]);
    // A column that rests but for one move is no measure of what is far, unless that is several times its value.
    let range = (high - low).max(1.5 * low.abs().max(high.abs()) * f64::from(u8::from(high == low)));
    if range <= 0.0 {
        return vec![];
    }
    (1..values.len() - 1)
        .filter(|&k| {
            let (before, now, after) = (values[k - 1], values[k], values[k + 1]);
            let away = (now - before).abs().min((now - after).abs());
            away > RANGES * range && (after - before).abs() < 0.2 * away
        })
        .collect()
}

/// The values with those of some rows replaced by the row before.
pub(super) fn mended(values: &[f64], rows: &[usize]) -> Vec<f64> {
    let mut out = values.to_vec();
    for &row in rows {
        out[row] = out[row - 1];
    }
    out
}

/// Runs of equal values: (first row, length).
fn runs(values: &[f64]) -> Vec<(usize, usize)> {
    let mut out: Vec<(usize, usize)> = Vec::new();
    for (k, value) in values.iter().enumerate() {
        match out.last_mut() {
            Some((first, length)) if values[*first] == *value => *length += 1,
            _ => out.push((k, 1)),
        }
    }
    out
}

pub(super) fn median(values: &mut [f64]) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Whether a value seldom comes back: a signal of many levels.
fn is_fine(pv: &[f64], runs: &[(usize, usize)]) -> bool {
    let mut levels: Vec<f64> = runs.iter().map(|(first, _)| pv[*first]).collect();
    levels.sort_by(f64::total_cmp);
    levels.dedup();
    2 * levels.len() > runs.len()
}

/// Rows a value is held for, where the log was written faster than the PV was read.
fn repeated(pv: &[f64], runs: &[(usize, usize)]) -> Option<usize> {
    /// Fewer values than this are no pattern.
    const RUNS: usize = 20;
    if runs.len() < RUNS || !is_fine(pv, runs) {
        return None;
    }
    let mut lengths: Vec<f64> = runs.iter().map(|r| r.1 as f64).collect();
    let typical = median(&mut lengths) as usize;
    let alike = runs.iter().filter(|r| r.1.abs_diff(typical) <= typical / 4).count();
    (typical >= 2 && 10 * alike >= 7 * runs.len()).then_some(typical)
}

/// Long runs of one value in a PV that otherwise shows noise.
fn frozen(time_s: &[f64], pv: &[f64], mv: &[f64], runs: &[(usize, usize)]) -> Option<Vec<(usize, usize)>> {
    /// A PV that stands still this long is suspect.
    const ROWS: usize = 10;
    if runs.len() < 20 {
        return None;
    }
    let mut lengths: Vec<f64> = runs.iter().map(|r| r.1 as f64).collect();
    let usual = lengths.len() * 95 / 100;
    let usual = *lengths.select_nth_unstable_by(usual, f64::total_cmp).1;
    let least = (8.0 * usual).max(ROWS as f64) as usize;
    // Noise turns back and forth; a clean response between two rests does not.
    let values: Vec<f64> = runs.iter().map(|r| pv[r.0]).collect();
    let turns = values.windows(3).filter(|w| (w[1] - w[0]) * (w[2] - w[1]) < 0.0).count();
    if 4 * turns < values.len() || time_s.is_empty() {
        return None;
    }
    // A PV at the end of its range, with the MV at rest, may truly stand still.
    let long: Vec<(usize, usize)> = runs
        .iter()
        .copied()
        .filter(|&(first, length)| {
            let still = mv[first..first + length].iter().all(|u| *u == mv[first]);
            length > least && (!still || is_fine(pv, runs))
        })
        .collect();
    (!long.is_empty()).then_some(long)
}

/// Rows at the lowest or highest MV, where it stays there again and again while it moves elsewhere; what a hand set is no
/// limit.
fn at_limits(mv: &[f64], manual: Option<&[bool]>, findings: &mut Vec<RecordFinding>) -> Vec<bool> {
    /// A controller's output takes more values than this; a relay, a binary sequence or a hand takes fewer.
    const LEVELS: usize = 12;
    let mut saturated = vec![false; mv.len()];
    let automatic: Vec<usize> = (0..mv.len()).filter(|&k| manual.is_none_or(|manual| !manual[k])).collect();
    let written: Vec<f64> = automatic.iter().map(|&k| mv[k]).collect();
    let runs = runs(&written);
    let moving = runs.iter().filter(|r| r.1 == 1).count();
    let mut levels = written.clone();
    levels.sort_by(f64::total_cmp);
    levels.dedup();
    let few = runs.len() < 20 || 3 * runs.len() < written.len();
    if levels.len() <= LEVELS || few && moving < 20 {
        return saturated;
    }
    for limit in [levels[0], levels[levels.len() - 1]] {
        let held = |length: usize| -> usize {
            runs.iter().filter(|r| written[r.0] == limit && r.1 >= length).map(|r| r.1).sum()
        };
        // A kick of the setpoint holds it there for a row or two: too short to tell of, long enough to spoil the
        // controller's gains.
        if held(2) >= 2 {
            for &k in automatic.iter().filter(|&&k| mv[k] == limit) {
                saturated[k] = true;
            }
        }
        let rows = held(3);
        if rows >= 5 && 200 * rows >= written.len() {
            findings.push(RecordFinding::MvAtLimit { limit, rows });
        }
    }
    saturated
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::Distribution;

    fn look(time_s: &[f64], pv: &[f64], mv: &[f64], first_row: usize) -> Conditioned {
        condition(&Rows { time_s, pv, mv, manual: None, first_row })
    }

    fn noisy(rows: usize) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
        let mut rng = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(1);
        let time_s: Vec<f64> = (0..rows).map(|k| k as f64).collect();
        let mv: Vec<f64> = (0..rows).map(|k| if k > rows / 3 { 60.0 } else { 50.0 }).collect();
        let pv = time_s
            .iter()
            .map(|t| {
                let e: f64 = rand_distr::StandardNormal.sample(&mut rng);
                let since = t - rows as f64 / 3.0;
                10.0 + 0.1 * e + if since > 0.0 { -5.0 * (-since / 40.0).exp_m1() } else { 0.0 }
            })
            .collect();
        (time_s, pv, mv)
    }

    #[test]
    fn a_clean_record_is_left_alone() {
        let (t, pv, mv) = noisy(900);
        let found = look(&t, &pv, &mv, 1);
        assert!(found.keep.iter().all(|k| *k) && found.findings.is_empty(), "{:?}", found.findings);
        // Without noise, too: a rest ahead of a step is no frozen sensor.
        let clean: Vec<f64> =
            t.iter().map(|t| if *t > 300.0 { -5.0 * (-(t - 300.0) / 40.0).exp_m1() } else { 0.0 }).collect();
        let found = look(&t, &clean, &mv, 1);
        assert!(found.keep.iter().all(|k| *k), "{:?}", found.findings);
    }

    #[test]
    fn spikes_are_left_out_and_a_step_is_not() {
        let (t, mut pv, mv) = noisy(900);
        for row in [100, 101, 500, 777] {
            pv[row] += 6.0;
        }
        let found = look(&t, &pv, &mv, 2);
        let out: Vec<usize> = (0..900).filter(|&k| !found.keep[k]).collect();
        assert_eq!(out, [100, 101, 500, 777]);
        assert!(matches!(found.findings[0], RecordFinding::Outliers { count: 4, row: 102, .. }));
        let step: Vec<f64> =
            pv.iter().enumerate().map(|(k, y)| if k > 600 { y + 50.0 } else { *y }).collect();
        assert!((597..606).all(|k| look(&t, &step, &mv, 1).keep[k]));
    }

    #[test]
    fn a_slip_of_the_mv_is_mended_and_a_pulse_is_not() {
        let (t, pv, mut mv) = noisy(900);
        mv[500] = 500.0;
        let found = look(&t, &pv, &mv, 1);
        assert!(matches!(found.findings[..], [RecordFinding::MvSlips { count: 1, row: 501, .. }]));
        assert_eq!(found.mv.expect("mended")[500], 60.0);
        let (t, pv, mut mv) = noisy(900);
        mv[500] = 70.0;
        assert!(look(&t, &pv, &mv, 1).findings.is_empty());
        // A pulse of one row is all that some records have.
        let pulse: Vec<f64> = (0..900).map(|k| if k == 300 { 1.0 } else { 0.0 }).collect();
        assert!(slips(&pulse).is_empty());
    }

    #[test]
    fn a_frozen_stretch_and_an_oversampled_log_are_seen() {
        let (t, mut pv, mv) = noisy(900);
        let held = pv[310];
        pv[310..370].fill(held);
        let found = look(&t, &pv, &mv, 1);
        assert!(
            matches!(found.findings[..], [RecordFinding::Frozen { rows: 59, times: 1, .. }]),
            "{:?}",
            found.findings
        );
        let (t, pv, mv) = noisy(900);
        let slow: Vec<f64> = (0..900).map(|k| pv[k - k % 4]).collect();
        let found = look(&t, &slow, &mv, 1);
        assert!(
            matches!(found.findings[..], [RecordFinding::Oversampled { rows: 4 }]),
            "{:?}",
            found.findings
        );
        assert_eq!(found.keep.iter().filter(|k| **k).count(), 225);
    }

    #[test]
    fn an_mv_at_its_limit_is_seen() {
        let (t, pv, _) = noisy(900);
        let mv: Vec<f64> = t.iter().map(|t| (50.0 + 80.0 * (t / 50.0).sin()).clamp(0.0, 100.0)).collect();
        let found = look(&t, &pv, &mv, 1);
        let limits: Vec<f64> = found
            .findings
            .iter()
            .filter_map(|f| if let RecordFinding::MvAtLimit { limit, .. } = f { Some(*limit) } else { None })
            .collect();
        assert_eq!(limits, [0.0, 100.0]);
        assert_eq!(
            found.saturated.iter().filter(|s| **s).count(),
            mv.iter().filter(|u| **u == 0.0 || **u == 100.0).count()
        );
    }
}
