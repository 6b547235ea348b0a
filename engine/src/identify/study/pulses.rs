//! Excursions of a PV that pulses of the MV explain: the answer of a fast process, no slip of the sensor.

use super::condition::median;

/// Most rows of a pulse: as many as a spike has, and one more.
const ROWS: usize = 4;
/// Rows from a pulse to its answer.
const LAGS: usize = 30;
/// Rows by which answers to different pulses may come sooner or later.
const JITTER: usize = 1;
/// How far the ratio of an answer to its pulse may lie from that of the others.
const RATIO: f64 = 2.0;
/// The inverse of the part of all pulses that has to be answered alike.
const MOST: usize = 2;
/// Part of a pulse's height to which it has to come back.
const BACK: f64 = 0.2;

/// Something that leaves its level for a moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Excursion {
    /// First row away.
    pub first: usize,
    /// How far it goes, with its sign.
    pub height: f64,
}

/// Moves of the MV that are taken back within a few rows.
fn pulses(mv: &[f64]) -> Vec<Excursion> {
    let mut out = Vec::new();
    let mut k = 1;
    while k < mv.len() {
        let level = mv[k - 1];
        let away = |row: usize| mv[row] - level;
        let end = (k + 1..mv.len().min(k + ROWS + 1)).find(|&row| away(row).abs() <= BACK * away(k).abs());
        match end.filter(|_| away(k) != 0.0) {
            Some(end) => {
                let farthest = (k..end).map(away).max_by(|a, b| a.abs().total_cmp(&b.abs()));
                out.push(Excursion { first: k, height: farthest.unwrap_or_default() });
                k = end + 1;
            }
            None => k += 1,
        }
    }
    out
}

/// For each excursion of the PV whether it is the answer to a pulse: after most pulses the PV goes away as many rows later,
/// alike in size. `away` holds for each row how far the PV is from its neighbours' middle.
pub(super) fn answers(mv: &[f64], away: &[f64], excursions: &[Excursion]) -> Vec<bool> {
    let pulses = pulses(mv);
    let none = vec![false; excursions.len()];
    if pulses.is_empty() || excursions.is_empty() {
        return none;
    }
    (0..=LAGS)
        .filter_map(|lag| answers_at(&pulses, away, excursions, lag))
        .max_by_key(|found| found.iter().filter(|found| **found).count())
        .unwrap_or(none)
}

fn answers_at(pulses: &[Excursion], away: &[f64], excursions: &[Excursion], lag: usize) -> Option<Vec<bool>> {
    let answer = |p: &Excursion| {
        let first = (p.first + lag).saturating_sub(JITTER);
        let rows = first.min(away.len())..(p.first + lag + JITTER + 1).min(away.len());
        let farthest = away[rows].iter().copied().max_by(|a, b| a.abs().total_cmp(&b.abs()));
        farthest.map(|a| a / p.height)
    };
    let mut ratios: Vec<f64> = pulses.iter().filter_map(answer).collect();
    let (all, middle) = (ratios.len(), median(&mut ratios));
    let is_alike = |ratio: f64| (1.0 / RATIO..=RATIO).contains(&(ratio / middle));
    let alike = ratios.iter().filter(|ratio| is_alike(**ratio)).count();
    let follows = |e: &Excursion| {
        let near = |p: &&Excursion| e.first.abs_diff(p.first + lag) <= JITTER;
        pulses.iter().find(near).is_some_and(|p| is_alike(e.height / p.height))
    };
    (MOST * alike > all).then(|| excursions.iter().map(follows).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pulse_goes_and_comes_back_and_a_step_does_not() {
        let mut mv = vec![5.0; 100];
        mv[20..22].fill(7.0);
        mv[40] = 4.0;
        mv[60..].fill(9.0);
        let found = pulses(&mv);
        assert_eq!(found, [Excursion { first: 20, height: 2.0 }, Excursion { first: 40, height: -1.0 }]);
    }

    #[test]
    fn answers_come_alike_after_most_pulses() {
        let mut mv = vec![0.0; 1000];
        let at = [100, 250, 430, 700];
        at.iter().for_each(|&row| mv[row..row + 2].fill(1.0));
        let mut away = vec![0.0; 1000];
        let mut seen: Vec<Excursion> =
            at.iter().map(|row| Excursion { first: row + 7, height: 3.0 }).collect();
        // One of the other sign, and one where no pulse was.
        seen.push(Excursion { first: 850, height: 3.0 });
        seen.push(Excursion { first: 257, height: -9.0 });
        seen[..5].iter().for_each(|e| away[e.first] = e.height);
        assert_eq!(answers(&mv, &away, &seen), [true, true, true, true, false, false]);
        // Chance puts a spike behind one pulse of many.
        away[200..].fill(0.01);
        assert_eq!(answers(&mv, &away, &seen[..1]), [false]);
    }
}
