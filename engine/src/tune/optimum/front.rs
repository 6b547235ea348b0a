//! Trade-off fronts: what the objective can be for every value of one limit, the others as they are.

use super::points::Plant;
use super::problem::{LoopLimits, Objective, OptimumProblem};
use super::solve::optimum;
use crate::analyze::{Analysis, OpenLoop, loop_figures};
use crate::control::ParallelGains;

/// Two measures that are bought with each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TradeOff {
    /// Jv against a limit on Ms.
    JvMs,
    /// Jv against a limit on Ju.
    JvJu,
    /// IAE of a load step against a limit on Ms.
    IaeMs,
}

impl TradeOff {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::JvMs, Self::JvJu, Self::IaeMs];
}

/// A point of a front: the best gains for a limit.
#[derive(Debug, Clone, PartialEq)]
pub struct FrontPoint {
    /// The limit that was set.
    pub limit: f64,
    /// The best gains under it.
    pub gains: ParallelGains,
    /// Jv, or the IAE of a load step, of the worst process.
    pub value: f64,
    /// The loop of the first process.
    pub analysis: Analysis,
}

/// Ms between which a front is drawn.
const MS_RANGE: (f64, f64) = (1.03, 3.0);
/// Range of a front over Ju, in units of the Ju that the other limits alone lead to.
const JU_RANGE: (f64, f64) = (0.05, 1.0);

/// The front of a problem, its limit that is traded left open, at `count` values spaced evenly in the logarithm (of
/// Ms − 1 where Ms is traded). Values that cannot be met are left out, so there may be fewer, or none.
///
/// Each point is an optimum with all that certifies one.
#[must_use]
pub fn front(problem: &OptimumProblem<'_>, trade_off: TradeOff, count: usize) -> Vec<FrontPoint> {
    let objective = if trade_off == TradeOff::IaeMs { Objective::IaeLoad } else { Objective::Jv };
    let asked = OptimumProblem { objective, ..*problem };
    let spaced = |(low, high): (f64, f64)| {
        let last = count.saturating_sub(1).max(1) as f64;
        (0..count).map(move |k| low * (high / low).powf(k as f64 / last))
    };
    let with: Vec<LoopLimits> = match trade_off {
        TradeOff::JvMs | TradeOff::IaeMs => spaced((MS_RANGE.0 - 1.0, MS_RANGE.1 - 1.0))
            .map(|above| LoopLimits { ms: 1.0 + above, ..problem.limits })
            .collect(),
        TradeOff::JvJu => {
            let Some(range) = ju_range(&asked) else { return Vec::new() };
            spaced(range).map(|ju| LoopLimits { ju, ..problem.limits }).collect()
        }
    };
    with.into_iter().filter_map(|limits| point(&OptimumProblem { limits, ..asked }, trade_off)).collect()
}

/// From the least Ju of any integral action to the one that the other limits alone lead to.
fn ju_range(problem: &OptimumProblem<'_>) -> Option<(f64, f64)> {
    let limits = LoopLimits { ju: f64::INFINITY, ..problem.limits };
    // Without a limit on robustness the far end would be the verge of instability.
    let limits = if limits.ms.is_infinite() && limits.mt.is_infinite() {
        LoopLimits { ms: MS_RANGE.1, ..limits }
    } else {
        limits
    };
    let far = optimum(&OptimumProblem { limits, objective: Objective::Jv, ..*problem }).ok()?;
    let most = far.certificate.peaks.u.value;
    let least = problem.processes.iter().map(|p| Plant::new(p).least_ju()).fold(JU_RANGE.0 * most, f64::max);
    (most > least).then_some((least * (1.0 + 1e-6), most * JU_RANGE.1))
}

fn point(problem: &OptimumProblem<'_>, trade_off: TradeOff) -> Option<FrontPoint> {
    let found = optimum(problem).ok()?;
    let limit = if trade_off == TradeOff::JvJu { problem.limits.ju } else { problem.limits.ms };
    let analysis = problem.processes.first()?.analyze(&found.gains).ok()?;
    Some(FrontPoint { limit, gains: found.gains, value: found.value, analysis })
}

/// What a controller that is not the optimum has on the axes of a front: (limit's measure, value); `None` where its loop
/// is unstable or the measure does not exist.
#[must_use]
pub fn on_front(open: &OpenLoop, analysis: &Analysis, trade_off: TradeOff) -> Option<(f64, f64)> {
    match trade_off {
        TradeOff::JvMs => Some((analysis.ms?, analysis.jv?)),
        TradeOff::JvJu => Some((analysis.ju?, analysis.jv?)),
        TradeOff::IaeMs => Some((analysis.ms?, loop_figures(open, analysis).iae_load?)),
    }
}
