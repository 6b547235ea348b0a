//! Rows of a PV that leave their neighbours for a moment and come back.

use super::condition::median;
use super::pulses::{Excursion, answers};

/// Rows on each side that a row is compared with.
const REACH: usize = 4;
/// Most rows of a window that are the spike.
const ROWS: usize = 3;
/// Noise standard deviations that chance does not reach in a million rows, with room for tails.
const SIGMAS: f64 = 8.0;
/// Part of the record's own range below which nothing is a spike.
const RANGE: f64 = 0.02;
/// What the rows around a spike may scatter about a straight line: as a part of its height, and in standard deviations
/// of the noise. Around the turning point of a motion they bend with it.
const AROUND: [f64; 2] = [0.1, 1.5];
/// More than one row in so many is a signal of its own.
const SELDOM: usize = 10;

/// Rows that leave their neighbours on both sides for three rows at most, where these lie on a straight line and no pulse of
/// the MV explains it.
pub(super) fn spikes(pv: &[f64], mv: &[f64], keep: &[bool]) -> Vec<usize> {
    let rows: Vec<usize> = (0..pv.len()).filter(|&k| keep[k]).collect();
    if rows.len() < 3 * REACH {
        return vec![];
    }
    let values: Vec<f64> = rows.iter().map(|&k| pv[k]).collect();
    let window = |i: usize| i.saturating_sub(REACH)..(i + REACH + 1).min(values.len());
    let middle: Vec<f64> = (0..values.len()).map(|i| median(&mut values[window(i)].to_vec())).collect();
    let distance: Vec<f64> = values.iter().zip(&middle).map(|(y, m)| (y - m).abs()).collect();
    // On a slope a row is often its window's own median: the bends tell the noise there, the distances that of steps.
    let mut bends: Vec<f64> = values.windows(3).map(|w| (w[0] - 2.0 * w[1] + w[2]).abs()).collect();
    let sigma = 1.4826 * median(&mut distance.clone()).max(median(&mut bends) / 6.0_f64.sqrt());
    let mut sorted = values.clone();
    sorted.sort_by(f64::total_cmp);
    let range = sorted[sorted.len() * 98 / 100] - sorted[sorted.len() * 2 / 100];
    let threshold = (SIGMAS * sigma).max(RANGE * range);
    if threshold <= 0.0 {
        return vec![];
    }
    let stands_out = |i: usize| {
        let around = window(i);
        let inside = around.start < i && i + 1 < around.end;
        inside && distance[i] > threshold && {
            let is_out = |j: &usize| (values[*j] - middle[i]).abs() > 0.5 * distance[i];
            let calm: Vec<usize> = around.clone().filter(|j| !is_out(j)).collect();
            let both = calm.first().is_some_and(|j| *j < i) && calm.last().is_some_and(|j| *j > i);
            // A swing leaves its middle on both sides.
            let side = values[i] - middle[i];
            let mut out = around.clone().filter(is_out);
            let one_side = out.all(|j| (values[j] - middle[i]) * side > 0.0);
            both && one_side && around.len() - calm.len() <= ROWS && leaves_line(&values, &calm, i, sigma)
        }
    };
    let out: Vec<usize> = (0..values.len()).filter(|&i| stands_out(i)).collect();
    let groups: Vec<&[usize]> = out.chunk_by(|a, b| a + 1 == *b).collect();
    let height = |group: &[usize]| {
        let away = group.iter().map(|&i| values[i] - middle[i]);
        away.max_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or_default()
    };
    let excursions: Vec<Excursion> =
        groups.iter().map(|group| Excursion { first: rows[group[0]], height: height(group) }).collect();
    let mut away = vec![0.0; pv.len()];
    rows.iter().zip(values.iter().zip(&middle)).for_each(|(&row, (y, m))| away[row] = y - m);
    let answers = answers(mv, &away, &excursions);
    let left = groups.iter().zip(answers).filter(|(_, answer)| !answer);
    let found: Vec<usize> = left.flat_map(|(group, _)| group.iter().map(|&i| rows[i])).collect();
    if found.len() * SELDOM > rows.len() { vec![] } else { found }
}

/// Whether a row leaves the straight line through others, which lie close to it.
fn leaves_line(values: &[f64], others: &[usize], row: usize, sigma: f64) -> bool {
    let n = others.len() as f64;
    let x = |j: usize| j as f64 - row as f64;
    let (mx, my) = others.iter().fold((0.0, 0.0), |(a, b), &j| (a + x(j) / n, b + values[j] / n));
    let (xx, xy) = others
        .iter()
        .fold((0.0, 0.0), |(a, b), &j| (a + (x(j) - mx).powi(2), b + (x(j) - mx) * (values[j] - my)));
    let slope = if xx > 0.0 { xy / xx } else { 0.0 };
    let off = |j: usize| values[j] - my - slope * (x(j) - mx);
    let scatter = (others.iter().map(|&j| off(j).powi(2)).sum::<f64>() / n).sqrt();
    scatter <= (AROUND[0] * off(row).abs()).max(AROUND[1] * sigma)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::Distribution;

    fn noise(rows: usize, sd: f64, seed: u64) -> Vec<f64> {
        let mut rng = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut normal = || -> f64 { rand_distr::StandardNormal.sample(&mut rng) };
        (0..rows).map(|_| sd * normal()).collect()
    }

    fn found(pv: &[f64]) -> Vec<usize> {
        spikes(pv, &vec![0.0; pv.len()], &vec![true; pv.len()])
    }

    /// Short pulses of the MV on a fast process were left out of the PV as spikes, and with them all that told the process.
    #[test]
    fn the_answer_to_a_pulse_is_no_spike() {
        for seed in 0..4 {
            for (lag, share) in [(1, 0.9), (3, 0.7), (12, 0.95)] {
                for pulses in [vec![400], vec![200, 455, 620, 900], (1..20).map(|i| 60 * i).collect()] {
                    let noise = noise(1200, 0.02, seed);
                    let mv: Vec<f64> = (0..1200)
                        .map(|k| if pulses.iter().any(|p| (*p..p + 2).contains(&k)) { 6.0 } else { 1.0 })
                        .collect();
                    let mut y = 1.0;
                    let mut pv = vec![];
                    for k in 0..1200_usize {
                        pv.push(y + noise[k]);
                        y += share * (mv[k.saturating_sub(lag)] - y);
                    }
                    let keep = vec![true; 1200];
                    assert_eq!(spikes(&pv, &mv, &keep), [0; 0], "lag {lag}, share {share}, seed {seed}");
                    // A spike of the sensor among them is one.
                    pv[777] += 8.0;
                    assert_eq!(spikes(&pv, &mv, &keep), [777], "lag {lag}, share {share}, seed {seed}");
                }
            }
        }
    }

    /// A median of nine rows lies below the top of any swing: turning points were left out as spikes.
    #[test]
    fn turning_points_of_a_fast_pv_are_kept() {
        for seed in 0..4 {
            let noise = noise(1200, 0.02, seed);
            for period in [4.0, 5.0, 6.0, 7.0, 9.0, 12.0, 17.0] {
                // A swing throughout, one for a while, and one that dies out again and again.
                let swing = |k: usize| (std::f64::consts::TAU * k as f64 / period).sin();
                let burst = |k: usize| swing(k) * (-((k as f64 - 530.0) / 15.0).powi(2)).exp();
                let ring = |k: usize| swing(k % 150) * (-((k % 150) as f64) / 15.0).exp();
                for (name, shape) in
                    [("swing", &swing as &dyn Fn(usize) -> f64), ("burst", &burst), ("ring", &ring)]
                {
                    let pv: Vec<f64> =
                        noise.iter().enumerate().map(|(k, e)| 40.0 + 5.0 * shape(k) + e).collect();
                    assert_eq!(found(&pv), [0; 0], "{name} of {period} rows, seed {seed}");
                }
            }
            // The answer of a fast process to pulses: up within two rows, and down over three.
            let mut y = 0.0;
            let pv: Vec<f64> = noise
                .iter()
                .enumerate()
                .map(|(k, e)| {
                    y += 0.5 * (if k % 60 < 3 { 5.0 } else { 0.0 } - y);
                    y + e
                })
                .collect();
            assert_eq!(found(&pv), [0; 0], "pulses, seed {seed}");
        }
    }

    #[test]
    fn spikes_on_a_swing_and_on_a_slope_are_taken() {
        for seed in 0..4 {
            let noise = noise(1200, 0.05, seed);
            for (period, rows) in [(60.0, [201, 433, 434, 700]), (200.0, [300, 301, 302, 877])] {
                let mut pv: Vec<f64> = noise
                    .iter()
                    .enumerate()
                    .map(|(k, e)| {
                        5.0 * (std::f64::consts::TAU * k as f64 / period).sin() + 0.01 * k as f64 + e
                    })
                    .collect();
                for row in rows {
                    pv[row] += 6.0;
                }
                assert_eq!(found(&pv), rows, "period {period}, seed {seed}");
            }
        }
    }
}
