//! Does the valve stick? The shape of a loop's oscillation tells.
//!
//! Behind a sticking valve the process sees a square wave and the controller integrates it to a triangle; a loop that
//! swings for any other reason shows sines. Each half period is fitted with both and the errors compared.
//!
//! Source: He, Wang, Pottmann & Qin, Ind. Eng. Chem. Res. 46 (2007) 4549; Thornhill, Huang & Zhang, J. Process Control 13
//! (2003) 91 for the regularity of an oscillation.

/// Index above which the shape is that of a sticking valve.
const STICKS: f64 = 0.6;
/// Fewest half periods that make a pattern.
const HALF_PERIODS: usize = 6;
/// Rows of a half period below which its shape cannot be seen.
const ROWS: usize = 5;

/// An oscillation of the loop and what its shape says of the valve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Oscillation {
    /// Median period in seconds.
    pub period_s: f64,
    /// Median of the periods over three times their scatter; above 1 the oscillation is regular.
    pub regularity: f64,
    /// Error of sines over that of sines and triangles together: 0 a sine, 1 a triangle; from 0.6 on stiction.
    pub stiction_index: f64,
    /// Width of the MV–PV loop in the MV's direction, in MV units: what the valve needs to move again.
    pub stiction_band: f64,
}

impl Oscillation {
    /// Whether the oscillation is regular and its shape that of a sticking valve.
    #[must_use]
    pub fn sticks(&self) -> bool {
        self.regularity > 1.0 && self.stiction_index >= STICKS
    }
}

/// Looks for a regular oscillation. The shape is read off the MV, or off the PV where the process integrates.
pub(super) fn oscillation(time_s: &[f64], pv: &[f64], mv: &[f64], integrating: bool) -> Option<Oscillation> {
    let shape = centred(if integrating { pv } else { mv });
    let crossings = crossings(&shape);
    if crossings.len() < HALF_PERIODS + 1 {
        return None;
    }
    // Whole periods: the two halves of one need not be equal.
    let periods: Vec<f64> = crossings.windows(3).map(|w| time_s[w[2]] - time_s[w[0]]).collect();
    let (median, scatter) = median_and_scatter(periods);
    let (mut sine, mut triangle) = (0.0, 0.0);
    let mut counted = 0;
    for w in crossings.windows(2).filter(|w| w[1] - w[0] >= ROWS) {
        let half = &shape[w[0]..w[1]];
        let power: f64 = half.iter().map(|v| v * v).sum();
        if power > 0.0 {
            sine += sine_error(half) / power;
            triangle += triangle_error(half) / power;
            counted += 1;
        }
    }
    (counted >= HALF_PERIODS && median > 0.0).then(|| Oscillation {
        period_s: median,
        regularity: if scatter > 0.0 { median / (3.0 * scatter) } else { f64::INFINITY },
        stiction_index: if sine + triangle > 0.0 { sine / (sine + triangle) } else { 0.5 },
        stiction_band: band(pv, mv),
    })
}

/// Median, and half the range that the middle 68 % take: of a normal distribution its standard deviation. A start-up or a
/// few odd periods, each of which lies in two whole ones, move neither.
fn median_and_scatter(mut values: Vec<f64>) -> (f64, f64) {
    values.sort_by(f64::total_cmp);
    let at = |share: f64| values[(share * (values.len() - 1) as f64).round() as usize];
    (at(0.5), 0.5 * (at(0.84) - at(0.16)))
}

/// Without mean and straight line.
fn centred(values: &[f64]) -> Vec<f64> {
    let n = values.len() as f64;
    let middle = 0.5 * (n - 1.0);
    let mean = values.iter().sum::<f64>() / n;
    let (mut xy, mut xx) = (0.0, 0.0);
    for (k, v) in values.iter().enumerate() {
        let x = k as f64 - middle;
        xy += x * (v - mean);
        xx += x * x;
    }
    let slope = if xx > 0.0 { xy / xx } else { 0.0 };
    values.iter().enumerate().map(|(k, v)| v - mean - slope * (k as f64 - middle)).collect()
}

/// Rows where the signal changes sides; it must go a third of its standard deviation beyond.
fn crossings(values: &[f64]) -> Vec<usize> {
    let sd = (values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64).sqrt();
    let (mut side, mut last, mut out) = (0.0, 0, vec![]);
    for (k, v) in values.iter().enumerate() {
        if v * side <= 0.0 && v.abs() > 0.33 * sd {
            if side != 0.0 {
                // The crossing itself lies back where the sign changed first.
                let at = (last..=k).rev().find(|&i| values[i] * side > 0.0).map_or(k, |i| i + 1);
                out.push(at);
            }
            side = v.signum();
        }
        if v * side > 0.0 {
            last = k;
        }
    }
    out
}

fn sine_error(half: &[f64]) -> f64 {
    let n = half.len() as f64;
    let shape: Vec<f64> =
        (0..half.len()).map(|k| (std::f64::consts::PI * (k as f64 + 0.5) / n).sin()).collect();
    error_of(half, &shape)
}

/// The best triangle of any peak within the middle of the half period.
fn triangle_error(half: &[f64]) -> f64 {
    const PEAKS: u32 = 13;
    let n = half.len() as f64;
    (0..PEAKS)
        .map(|i| {
            let peak = 0.2 + 0.6 * f64::from(i) / f64::from(PEAKS - 1);
            let shape: Vec<f64> = (0..half.len())
                .map(|k| {
                    let x = (k as f64 + 0.5) / n;
                    if x < peak { x / peak } else { (1.0 - x) / (1.0 - peak) }
                })
                .collect();
            error_of(half, &shape)
        })
        .fold(f64::INFINITY, f64::min)
}

/// What is left of `values` once the best multiple of `shape` is taken out.
fn error_of(values: &[f64], shape: &[f64]) -> f64 {
    let (mut xy, mut xx, mut yy) = (0.0, 0.0, 0.0);
    for (y, x) in values.iter().zip(shape) {
        xy += x * y;
        xx += x * x;
        yy += y * y;
    }
    if xx > 0.0 { yy - xy * xy / xx } else { yy }
}

/// Median distance in MV between the rising and the falling branch at the same PV.
fn band(pv: &[f64], mv: &[f64]) -> f64 {
    const LEVELS: usize = 9;
    let mut sorted = pv.to_vec();
    sorted.sort_by(f64::total_cmp);
    let mut widths = Vec::new();
    for i in 1..=LEVELS {
        let level = sorted[(sorted.len() - 1) * (i + 3) / (LEVELS + 7)];
        let (mut up, mut down) = (vec![], vec![]);
        for k in 1..pv.len() {
            let (a, b) = (pv[k - 1], pv[k]);
            if (a - level) * (b - level) < 0.0 {
                let share = (level - a) / (b - a);
                let at = mv[k - 1] + share * (mv[k] - mv[k - 1]);
                if b > a { up.push(at) } else { down.push(at) }
            }
        }
        if !up.is_empty() && !down.is_empty() {
            let middle = |v: &mut Vec<f64>| {
                let m = v.len() / 2;
                *v.select_nth_unstable_by(m, f64::total_cmp).1
            };
            widths.push((middle(&mut up) - middle(&mut down)).abs());
        }
    }
    let m = widths.len() / 2;
    if widths.is_empty() { 0.0 } else { *widths.select_nth_unstable_by(m, f64::total_cmp).1 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A flow loop with a valve that sticks (one-parameter model of Stenman) and one that does not but is tuned to swing.
    fn flow_loop(stick: f64, kc: f64, ti: f64) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
        let (mut u, mut valve, mut y, mut last) = (50.0, 50.0, 50.0, 0.0);
        let mut delayed = std::collections::VecDeque::from(vec![50.0; 4]);
        let (mut t, mut pv, mut mv) = (vec![], vec![], vec![]);
        for k in 0..2000 {
            let e = if k < 3 { 3.0 } else { 52.0 - y };
            u += kc * (e - last) + kc / ti * e;
            last = e;
            if f64::abs(u - valve) > stick {
                valve = u;
            }
            delayed.push_back(valve);
            let input = delayed.pop_front().expect("an input");
            y += 0.4 * (input - y);
            if k >= 600 {
                t.push(k as f64);
                pv.push(y);
                mv.push(u);
            }
        }
        (t, pv, mv)
    }

    #[test]
    fn a_sticking_valve_is_told_from_a_tight_tuning() {
        let (t, pv, mv) = flow_loop(2.0, 0.15, 3.0);
        let found = oscillation(&t, &pv, &mv, false).expect("an oscillation");
        assert!(found.sticks(), "{found:?}");
        assert!(found.stiction_band > 0.3 && found.stiction_band < 8.0, "{found:?}");
        let sine: Vec<f64> = t.iter().map(|t| 50.0 + 3.0 * (t / 7.0).sin()).collect();
        let lag: Vec<f64> = t.iter().map(|t| 50.0 + 2.0 * (t / 7.0 - 1.2).sin()).collect();
        let found = oscillation(&t, &lag, &sine, false).expect("an oscillation");
        assert!(!found.sticks() && found.stiction_index < 0.4, "{found:?}");
    }

    /// One long period at the start made mean/(3 sd) of 60 half-overlapping periods 0.5, and a sticking valve none.
    #[test]
    fn one_odd_period_hides_no_sticking_valve() {
        const LONG: usize = 150;
        const PERIOD: usize = 28;
        let place = |k: usize| if k < LONG { 0.25 } else { ((k - LONG) % PERIOD) as f64 / PERIOD as f64 };
        let t: Vec<f64> = (0..LONG + 30 * PERIOD).map(|k| k as f64).collect();
        let mv: Vec<f64> = (0..t.len())
            .map(|k| {
                let x = place(k);
                50.0 + 3.0 * if x < 0.5 { 1.0 - (4.0 * x - 1.0).abs() } else { (4.0 * x - 3.0).abs() - 1.0 }
            })
            .collect();
        let pv: Vec<f64> = (0..t.len()).map(|k| if place(k) < 0.5 { 51.0 } else { 49.0 }).collect();
        let found = oscillation(&t, &pv, &mv, false).expect("an oscillation");
        assert!(found.sticks() && found.period_s == 28.0, "{found:?}");
    }
}
