//! A valve that sticks or has play: it stays where it is until it was asked for more than a band.

use std::borrow::Cow;

use crate::identify::problem::Stretch;
use crate::identify::statistics::mean;

/// Bands tried, as parts of the MV's range.
const BANDS: [f64; 9] = [0.02, 0.04, 0.06, 0.09, 0.13, 0.18, 0.25, 0.35, 0.5];

/// The band that explains the PV best.
#[derive(Debug, Clone, Copy)]
pub(super) struct Valve {
    /// In MV units.
    pub band: f64,
    /// Squared residual with it.
    pub rss: f64,
}

/// Tries bands of both kinds; `cost` fits a copy of the stretch in which every `factor` rows are one.
///
/// Source: Stenman, Gustafsson & Forsman, Int. J. Adapt. Control Signal Process. 17 (2003) 625, for a valve that jumps.
pub(super) fn holding_cost(
    stretch: &Stretch,
    factor: usize,
    cost: impl Fn(&Stretch) -> Option<f64>,
) -> Option<Valve> {
    let (low, high) =
        stretch.u.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), u| (a.min(*u), b.max(*u)));
    let mut best: Option<Valve> = None;
    for band in BANDS.map(|share| share * (high - low)) {
        for follow in [jumping, playing] {
            let u = followed(&stretch.u, |at, u| follow(at, u, band));
            let held = Stretch { u_ref: mean(&u), u: Cow::Owned(u), ..stretch.clone() };
            let held = if factor > 1 { held.thinned(factor) } else { held };
            let Some(rss) = cost(&held) else { continue };
            if best.is_none_or(|b| rss < b.rss) {
                best = Some(Valve { band, rss });
            }
        }
    }
    best
}

/// Stays, then goes all the way.
fn jumping(at: f64, wanted: f64, band: f64) -> f64 {
    if (wanted - at).abs() > band { wanted } else { at }
}

/// Follows at a distance.
fn playing(at: f64, wanted: f64, band: f64) -> f64 {
    at.clamp(wanted - 0.5 * band, wanted + 0.5 * band)
}

fn followed(wanted: &[f64], next: impl Fn(f64, f64) -> f64) -> Vec<f64> {
    let mut at = wanted[0];
    wanted
        .iter()
        .map(|u| {
            at = next(at, *u);
            at
        })
        .collect()
}
