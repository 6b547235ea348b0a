//! Frequencies at which a loop is looked at, placed by its own poles, zeros, unit crossings and dead time.

use super::OpenLoop;
use super::stability::GainCrossing;

/// Ratio of neighbouring frequencies near a feature of the loop, between features and beyond the last one.
///
/// Peaks are refined from these points, so they only have to separate neighbouring peaks; the tests compare with a
/// grid a hundred times as dense.
const NEAR: f64 = 1.27;
const BETWEEN: f64 = 1.45;
const BEYOND: f64 = 1.6;
/// A frequency within this ratio of a feature is near it.
const REACH: f64 = 3.0;
/// How far below the first and above the last feature the limits at 0 and ∞ are taken to rule.
///
/// Towards a limit a function runs as 1 + a x − b x² with x = (feature/ω)², and x = feature/ω for the envelope of
/// ripples: a maximum beyond these margins lies less than 1e-7 above the limit.
const MARGIN: f64 = 300.0;
const MARGIN_OF_RIPPLES: f64 = 1e4;
/// How far from a lightly damped root, relative to it, its own points go.
const WIDTH: f64 = 0.27;
/// Damping ratio under which a pole or zero gets points across its own width.
const LIGHT_DAMPING: f64 = 0.25;
/// Share of a ripple's period 2π/θ between points, an eighth, as a phase in radians.
pub(super) const RIPPLE_STEP_RAD: f64 = 0.8;
/// Most points of a grid, against models whose features lie absurdly far apart.
const MOST_POINTS: usize = 20_000;

/// Frequencies in rising order, and the one from which on only the envelope of the ripples is needed.
pub(super) struct Grid {
    pub omegas: Vec<f64>,
    /// Frequency from which on |L| < 1 and the dead time has turned L at least twice; ∞ without dead time.
    pub ripples_from: f64,
}

/// Moduli of poles and zeros, unit crossings and 1/θ in rad/s, rising.
pub(super) fn features(open: &OpenLoop, crossings: &[GainCrossing]) -> Vec<f64> {
    let mut found = Vec::with_capacity(16);
    let moduli = open.poles.iter().chain(&open.zeros).map(|r| r.norm());
    found.extend(moduli.chain(crossings.iter().map(|c| c.omega)).filter(|m| *m > 0.0 && m.is_finite()));
    if open.dead_time_s > 0.0 {
        found.extend([1.0 / open.dead_time_s, std::f64::consts::PI / open.dead_time_s]);
    }
    if found.is_empty() {
        found.push(1.0);
    }
    found.sort_unstable_by(f64::total_cmp);
    found
}

impl Grid {
    pub(super) fn new(open: &OpenLoop, crossings: &[GainCrossing]) -> Self {
        let features = features(open, crossings);
        let (first, last) = (features[0], features[features.len() - 1]);
        let dead_time = open.dead_time_s;
        let ripples_from = if dead_time > 0.0 {
            let last_crossing = crossings.last().map_or(0.0, |c| c.omega);
            (4.0 * std::f64::consts::PI / dead_time).max(4.0 * last_crossing)
        } else {
            f64::INFINITY
        };
        let stop = if dead_time > 0.0 { last.max(ripples_from) * MARGIN_OF_RIPPLES } else { last * MARGIN };
        let mut omegas = Vec::with_capacity(256);
        let mut omega = first / MARGIN;
        let mut next_feature = 0;
        while omega < stop && omegas.len() < MOST_POINTS {
            omegas.push(omega);
            while next_feature < features.len() && features[next_feature] * REACH < omega {
                next_feature += 1;
            }
            let ratio = match features.get(next_feature) {
                Some(f) if *f <= omega * REACH => NEAR,
                _ if omega < first || omega > last => BEYOND,
                _ => BETWEEN,
            };
            let mut next = omega * ratio;
            if omega < ripples_from && dead_time > 0.0 {
                next = next.min(omega + RIPPLE_STEP_RAD / dead_time);
            }
            omega = next;
        }
        omegas.push(omega);
        if push_resonances(open, &mut omegas) {
            omegas.sort_unstable_by(f64::total_cmp);
            omegas.dedup();
        }
        Self { omegas, ripples_from }
    }
}

/// Moduli of poles and zeros, 1/θ and π/θ in rad/s, rising; at least one.
pub(crate) fn natural_frequencies(open: &OpenLoop) -> Vec<f64> {
    features(open, &[])
}

/// Frequencies in rad/s across the width of every lightly damped pole and zero.
pub(crate) fn resonances(open: &OpenLoop) -> Vec<f64> {
    let mut omegas = Vec::new();
    push_resonances(open, &mut omegas);
    omegas
}

/// Adds points across the width of every lightly damped pole and zero.
fn push_resonances(open: &OpenLoop, omegas: &mut Vec<f64>) -> bool {
    let before = omegas.len();
    for root in open.poles.iter().chain(&open.zeros) {
        let modulus = root.norm();
        if root.im <= 0.0 || root.re.abs() >= LIGHT_DAMPING * modulus {
            continue;
        }
        let mut offset = 0.5 * (root.re.abs() / modulus).max(1e-7);
        while offset < WIDTH {
            omegas.extend([root.im * (1.0 - offset), root.im * (1.0 + offset)]);
            offset *= 1.5;
        }
        if root.re != 0.0 {
            omegas.push(root.im);
        }
    }
    omegas.len() > before
}
