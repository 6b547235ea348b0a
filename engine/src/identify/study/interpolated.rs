//! A PV that a historian filled in by straight lines between the values it kept.

use super::condition::median;

/// Fewest lines that make a pattern.
const LINES: usize = 20;
/// Fewest steps of a line.
const STEPS: usize = 3;
/// Part of the rows that has to lie on such lines.
const ON_LINES: f64 = 0.8;
/// Part of a typical step that counts as no bend.
const STRAIGHT: f64 = 1e-6;

/// Rows that hold a value of the PV, where the others lie on straight lines between them.
///
/// An integrator without noise goes straight as well, from one move of its MV to the next: lines as many as those moves are
/// no historian's.
pub(super) fn values_kept(time_s: &[f64], pv: &[f64], mv: &[f64]) -> Option<Vec<usize>> {
    let rows = pv.len();
    if rows < LINES * STEPS {
        return None;
    }
    let slopes: Vec<f64> =
        (1..rows).map(|k| (pv[k] - pv[k - 1]) / (time_s[k] - time_s[k - 1]).max(f64::MIN_POSITIVE)).collect();
    let mut moving: Vec<f64> = slopes.iter().map(|s| s.abs()).filter(|s| *s > 0.0).collect();
    let typical = median(&mut moving);
    if typical <= 0.0 || !typical.is_finite() {
        return None;
    }
    let bends = |k: &usize| (slopes[*k] - slopes[*k - 1]).abs() > STRAIGHT * typical;
    let inner: Vec<usize> = (1..rows - 1).filter(bends).collect();
    let kept: Vec<usize> = [vec![0], inner, vec![rows - 1]].concat();
    let is_line = |w: &&[usize]| w[1] - w[0] >= STEPS && slopes[w[0]].abs() > STRAIGHT * typical;
    let (lines, on_lines) =
        kept.windows(2).filter(is_line).fold((0, 0), |(lines, on), w| (lines + 1, on + w[1] - w[0]));
    let moves = mv.windows(2).filter(|w| w[0] != w[1]).count();
    let of_the_mv = 2 * moves > kept.len() && moves < 2 * kept.len();
    (lines >= LINES && on_lines as f64 >= ON_LINES * rows as f64 && !of_the_mv).then_some(kept)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::Distribution;

    /// Rows filled in by a historian passed for measurements: noise looked like slow swings, and intervals were too narrow.
    #[test]
    fn straight_lines_between_values_are_seen_and_a_clean_response_is_not() {
        let mut rng = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(3);
        let time_s: Vec<f64> = (0..1201).map(f64::from).collect();
        let mv: Vec<f64> = (0..1201).map(|k| f64::from(u8::from(k % 400 > 200))).collect();
        let read: Vec<f64> = (0..121)
            .map(|_| {
                let e: f64 = rand_distr::StandardNormal.sample(&mut rng);
                30.0 + e
            })
            .collect();
        let pv: Vec<f64> = (0..1201)
            .map(|k| {
                let share = (k % 10) as f64 / 10.0;
                read[k / 10] + share * (read[(k / 10 + 1).min(120)] - read[k / 10])
            })
            .collect();
        let kept = values_kept(&time_s, &pv, &mv).expect("lines");
        assert_eq!(kept, (0..121).map(|i| 10 * i).collect::<Vec<_>>());
        let clean: Vec<f64> = time_s.iter().map(|t| (t / 30.0).sin()).collect();
        assert_eq!(values_kept(&time_s, &clean, &mv), None);
        let noisy: Vec<f64> = pv.iter().zip(&read).map(|(a, b)| a + b).collect();
        assert_eq!(values_kept(&time_s[..121], &noisy, &mv[..121]), None);
        // An integrator between moves of its MV.
        let binary: Vec<f64> = (0..1201).map(|k| f64::from(u8::from((k / 12) % 3 == 1))).collect();
        let mut level = 0.0;
        let integrated: Vec<f64> = binary
            .iter()
            .map(|u| {
                level += u - 0.3;
                level
            })
            .collect();
        assert_eq!(values_kept(&time_s, &integrated, &binary), None);
    }
}
