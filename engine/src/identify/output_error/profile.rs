//! The interval of a dead time by likelihood ratio, where its cost is not a parabola.
//!
//! The cost has a kink wherever L passes a row after a move. With the sample time above the standard error of L the
//! interval spans kinks, and the one from the curvature at the optimum holds the truth too seldom: one to six percent,
//! most where the response starts steeply. The dead time of a first order that noise all but hides has an interval so
//! wide that the response bends within it: the curvature at the optimum cleared 0 in one record of nine there.

use super::descend::{Found, Refinement};
use super::shape::{Order, Shape};
use crate::identify::fopdt::Interval;
use crate::identify::problem::Stretch;
use crate::identify::profile::ends;

/// Rows above which the passes would be felt, and where kinks ask for more of them.
const MANY_ROWS: usize = 20_000;
const MANY_COARSE_ROWS: usize = 5000;
/// Half width, in time constants, over which a response bends.
const WIDE: f64 = 0.2;
const SECANTS: usize = 10;
/// Passes for the other unknowns at each dead time.
const PASSES: usize = 8;

/// What the interval of one channel's dead time starts from.
#[derive(Debug, Clone, Copy)]
pub(in crate::identify) struct Around {
    pub channel: usize,
    /// Standard error by the curvature, in seconds.
    pub standard_error_s: f64,
    /// How many of them the interval has to each side.
    pub student: f64,
    /// Variance of the residuals, correlation allowed for.
    pub variance: f64,
}

/// Whether the dead time of a first order has an interval so wide that its cost is no parabola.
pub(in crate::identify) fn is_wide(stretch: &Stretch, shape: &Shape, best: &Found, around: Around) -> bool {
    let half_s = around.student * around.standard_error_s;
    let response_s = best.points[around.channel].time_s;
    shape.channels[around.channel] == Order::First
        && half_s.is_finite()
        && half_s > WIDE * response_s
        && response_s < stretch.span_s()
        && stretch.len() <= MANY_ROWS
}

/// Dead times at which the best cost for that dead time reaches RSS + variance · t²; `None` where the curvature will do.
pub(in crate::identify) fn dead_time_interval(
    stretch: &Stretch,
    shape: &Shape,
    best: &Found,
    around: Around,
    passes: &mut usize,
) -> Option<Interval> {
    let Around { channel, standard_error_s, student, variance } = around;
    let h = stretch.sample_time_s;
    let coarse = h > standard_error_s && standard_error_s > 1e-6 * h && stretch.len() <= MANY_COARSE_ROWS;
    if !coarse && !is_wide(stretch, shape, best, around) {
        return None;
    }
    let unknown = shape.first_unknown(channel) + shape.channels[channel].unknowns() - 1;
    let found_s = best.points[channel].dead_time_s;
    let refinement = Refinement { stretch, shape, passes: PASSES, fixed: Some(unknown), known: None };
    // Signed root of the likelihood ratio, close to (L − L̂)/se.
    let ratio = |dead_time_s: f64| {
        let mut points = best.points.clone();
        points[channel].dead_time_s = dead_time_s;
        let at = refinement.from(&points, passes)?;
        Some(((at.rss() - best.rss()).max(0.0) / variance).sqrt())
    };
    ends(found_s, student * standard_error_s, student, SECANTS, ratio)
}
