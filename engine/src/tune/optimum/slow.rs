//! What loops about a double integrator come to as they get slower: nothing but k/s² is left of the process then, which
//! has no time scale, so the best of them lie at the end of an endless valley that a search over gains does not walk.
//!
//! A derivative filter of N lifts the phase by φ at most, sin φ = N/(N + 2), and integral action only takes some off. A
//! loop that comes from −180° with |L| = ∞ and goes to |L| = 0 within φ of the negative axis passes −1 at no more than
//! sin φ: neither Ms nor Mt falls below 1 + 2/N, and slow loops with ever less integral action come as near as one likes.

use super::certificate::{Check, Limit};
use super::family::Family;
use super::gain_search::Candidate;
use super::lead_search::RATIO_RANGE;
use super::points::Plant;
use super::problem::{DerivativeFilter, LoopLimits, Objective, Process, Wanted};
use super::simplex::{Simplex, minimise};
use super::slice::Lead;
use super::solve::Solver;
use crate::analyze::{OpenLoop, peaks};
use crate::control::ParallelGains;
use crate::model::ProcessModel;

/// Kp Td² of the least Ms at N = 10.
const START: f64 = 1.515;
const SIMPLEX: Simplex = Simplex { step: 0.3, last_step: 1e-7, most_evaluations: 120 };
/// What an excess over the other limit costs, in units of the limit that is made least.
const PENALTY: f64 = 100.0;
/// Relative distance within which a limit counts as no more than the floor.
const AT_THE_FLOOR: f64 = 1e-6;
/// Steps of Td from the process's own time on, and of Ki Td/Kp from 1 on, at which slow gains are sought.
const SLOWER: f64 = 4.0;
const MOST_SLOWER: i32 = 10;
const LESS: f64 = 0.25;
const MOST_LESS: i32 = 12;

/// Double integrators with their gains, the largest 1, and the filter of the controller.
struct Slow {
    models: Vec<ProcessModel>,
    largest: f64,
    n: f64,
    /// Whether nothing else in the processes lifts the phase, so that no loop is better than slow ones.
    alone: bool,
}

impl Slow {
    /// `None` where a process is no double integrator, or the controller has no derivative.
    fn of(wanted: Wanted, family: &Family<'_>) -> Option<Self> {
        let n = filter(wanted)?;
        let doubly = |p: &&Plant<'_>| matches!(p.process, Process::Model(_)) && p.low.power == -2;
        let gains: Vec<f64> =
            family.plants.iter().filter(doubly).map(|p| family.sign * p.low.coefficient).collect();
        if gains.len() < family.plants.len() || gains.iter().any(|k| *k <= 0.0) {
            return None;
        }
        let largest = gains.iter().copied().fold(0.0, f64::max);
        let bare = |k: &f64| ProcessModel::rational(&[k / largest], &[1.0, 0.0, 0.0], 0.0).ok();
        let alone = family.plants.iter().all(|p| !lifts_phase(p.process));
        Some(Self { models: gains.iter().map(bare).collect::<Option<_>>()?, largest, n, alone })
    }

    /// Ms and Mt, the largest of all, of Kp with Td = 1 and no integral action; ∞ for an unstable loop.
    fn peaks(&self, kp: f64) -> (f64, f64) {
        let gains = ParallelGains { kp, ki: 0.0, kd: kp, tf_s: 1.0 / self.n };
        let of = |model: &ProcessModel| {
            let found = peaks(&OpenLoop::of_parallel(model, &gains));
            found.map_or((f64::INFINITY, f64::INFINITY), |p| (p.s.value, p.t.value))
        };
        self.models.iter().map(of).fold((0.0, 0.0), |a, b| (f64::max(a.0, b.0), f64::max(a.1, b.1)))
    }

    /// The Kp that makes something of (Ms, Mt) least, with what it comes to.
    fn least(&self, of: impl Fn((f64, f64)) -> f64) -> (f64, f64) {
        let (x, value) = minimise(&SIMPLEX, &[START.ln()], &mut |x| of(self.peaks(x[0].exp())));
        (x[0].exp(), value)
    }
}

/// Whether a zero, or a pole in the right half plane, may take the phase above that of the integrators.
fn lifts_phase(process: &Process) -> bool {
    let Process::Model(model) = process else { return true };
    let tf = model.transfer_function();
    tf.num.len() > 1 || tf.den.iter().any(|a| a * tf.den[0] < 0.0)
}

/// N of the filter, the largest where it is free.
pub(super) fn filter(wanted: Wanted) -> Option<f64> {
    match wanted {
        Wanted::Pi => None,
        Wanted::Pid(DerivativeFilter::Ratio(n)) => Some(n),
        Wanted::Pid(DerivativeFilter::Free) => Some(RATIO_RANGE.1),
    }
}

/// The least that a limit on Ms or Mt can be for slow loops, where it is no less than asked
/// and faster loops do no better.
pub(super) fn floor(solver: &Solver<'_>, limit: Limit, given: &LoopLimits) -> Option<f64> {
    let slow = Slow::of(solver.wanted, &solver.family)?;
    let own_and_other = |(ms, mt): (f64, f64)| match limit {
        Limit::Ms => (ms, mt / given.mt),
        Limit::Mt | Limit::Ju => (mt, ms / given.ms),
    };
    let worth = |peaks| {
        let (own, other) = own_and_other(peaks);
        own + PENALTY * (other - 1.0).max(0.0)
    };
    let asked = match limit {
        Limit::Ms => given.ms,
        Limit::Mt => given.mt,
        Limit::Ju => return None,
    };
    let least = slow.least(worth).1;
    // Rounding must not put the floor below what it rules out.
    (slow.alone && least.is_finite() && asked <= least * (1.0 + AT_THE_FLOOR)).then_some(least.max(asked))
}

/// Slow gains that meet the limits by the exact analysis, where a search over gains found none.
pub(super) fn gains(solver: &Solver<'_>, objective: Objective) -> Option<Candidate> {
    let slow = Slow::of(solver.wanted, &solver.family)?;
    let limits = solver.limits;
    let (kp, stretch) = slow.least(|(ms, mt)| (ms / limits.ms).max(mt / limits.mt));
    if stretch >= 1.0 {
        return None;
    }
    let unit = 1.0 / solver.family.plants[0].typical_omega();
    let at = |slower: i32, less: i32| {
        let td_s = unit * SLOWER.powi(slower);
        let lead = Lead { td_s, tf_s: td_s / slow.n };
        let kp = kp / (td_s * td_s * slow.largest);
        Candidate { lead, kp, ki: kp / td_s * LESS.powi(less), value: f64::INFINITY }
    };
    let met = |candidate: &Candidate| -> Option<Candidate> {
        let check = Check::of(&solver.family, &limits, objective, candidate).ok()?;
        let value = if objective == Objective::Jv { check.peaks.v.value } else { -candidate.ki };
        (check.unstable.is_empty() && check.excess <= 0.0).then_some(Candidate { value, ..*candidate })
    };
    // The fastest, and of its speed the most integral action.
    let all = (0..MOST_SLOWER).flat_map(|slower| (0..MOST_LESS).map(move |less| (slower, less)));
    all.map(|(slower, less)| at(slower, less)).find_map(|candidate| met(&candidate))
}
