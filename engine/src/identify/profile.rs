//! The interval of the dead time by likelihood ratio, where rows lie so far apart that its cost is not a parabola.
//!
//! The cost has a kink wherever L passes a row. With the sample time above the standard error of L the interval spans
//! kinks, and the one from the curvature at the optimum holds the truth a percent or two too seldom.

use super::fopdt::Interval;
use super::optimise::{Bounds, Point, refine_time_constant};
use super::problem::Stretch;

/// Rows above which the passes would be felt.
const MANY_ROWS: usize = 5000;
const SECANTS: usize = 8;

/// Dead times at which the best cost for that dead time reaches RSS (1 + t²/ν); `None` where the curvature will do.
pub(super) fn dead_time_interval(
    stretch: &Stretch,
    best: &Point,
    bounds: &Bounds,
    standard_error_s: f64,
    student: f64,
    passes: &mut usize,
) -> Option<Interval> {
    let found = best.dynamics.dead_time_s;
    let coarse = stretch.sample_time_s > standard_error_s && standard_error_s > 1e-6 * stretch.sample_time_s;
    if !coarse || stretch.len() > MANY_ROWS {
        return None;
    }
    let variance = best.rss() / stretch.kept().saturating_sub(stretch.unknowns()).max(1) as f64;
    // Signed root of the likelihood ratio, close to (L − L̂)/se.
    let ratio = |dead_time_s: f64| {
        let point = refine_time_constant(stretch, best, dead_time_s, bounds, passes)?;
        Some(((point.rss() - best.rss()).max(0.0) / variance).sqrt())
    };
    ends(found, student * standard_error_s, student, SECANTS, ratio)
}

/// Dead times either side of `found_s`, first tried `reach_s` away, at which `ratio` comes to `student`; cut at 0.
///
/// `ratio` is the signed root of the likelihood ratio at a dead time in seconds, `None` where there is no fit.
pub(super) fn ends(
    found_s: f64,
    reach_s: f64,
    student: f64,
    secants: usize,
    mut ratio: impl FnMut(f64) -> Option<f64>,
) -> Option<Interval> {
    let mut end = |side: f64| -> Option<f64> {
        let (mut inside, mut outside) = (found_s, None);
        let mut at = found_s + side * reach_s;
        for _ in 0..secants {
            at = at.max(0.0);
            let reached = ratio(at)?;
            if (reached - student).abs() < 0.01 * student || (at == 0.0 && reached < student) {
                return Some(at);
            }
            if reached < student {
                inside = at;
            } else {
                outside = Some(at);
            }
            at = match outside {
                Some(outside) => 0.5 * (inside + outside),
                None => found_s + (at - found_s) * (student / reached.max(0.2 * student)).min(2.0),
            };
        }
        Some(at)
    };
    Some([end(-1.0)?, end(1.0)?])
}
