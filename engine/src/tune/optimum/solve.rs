//! Solve on points of frequency, check exactly, add what was passed, solve again.

use super::by_simulation;
use super::certificate::{Certificate, Check, MET, Optimum};
use super::error::OptimumError;
use super::family::Family;
use super::floor;
use super::gain_search::{Candidate, Care, Found, GainSearch, Ground};
use super::lead_search::{self, RATIO_RANGE, Steps};
use super::points::{Plant, Points};
use super::problem::{DerivativeFilter, LoopLimits, Objective, OptimumProblem, Process, Wanted};
use super::relax::Relax;
use super::slice::Lead;
use super::slow;

/// Rounds of search and check, and of the last steps at fixed Kp, at most.
const ROUNDS: usize = 14;
const LAST_STEPS: usize = 14;
/// Relative excess up to which gains all but meet the limits, and how much better they must be to be gone back to.
const ALL_BUT: f64 = 0.02;
const DEEPER: f64 = 0.01;
/// Relative loss of Jv for each of that excess.
const COST: f64 = 4.0;
/// Relative loss from one round to the next after which gains are sought afresh.
const LOST: f64 = 0.02;
/// First and last step, as a logarithm, of the walk over Td and N with the search at rest at each.
const WALK: (f64, f64) = (0.16, 0.009);
/// Rounds at fixed Td and Tf; how much stricter the limits get there, and by which factor from round to round.
const ROUNDS_AT_REST: usize = ROUNDS + 22;
const SHORT: f64 = 1e-7;
const SHORTER: f64 = 2.0;
/// Relative excess over a limit from which on Kp, Td and Tf stay as they are.
const CLOSE: f64 = 2e-6;
/// Ms that no optimum passes, whatever the limit: beyond it a loop is all but unstable.
pub(super) const LARGEST_MS: f64 = 8.0;
/// How far above 1 a limit on Mt must lie for a process that integrates.
const LEAST_MT: f64 = 1e-6;
/// Limit on Ms from which on the points lie twice as close.
const LAX_MS: f64 = 2.5;
/// Searches on ever more of the points, and how well they must agree with all of them.
const TRIALS: i32 = 5;
const SEEN: f64 = 1e-6;
/// Points added on each side of a peak, and how far they reach in units of the square root of its excess.
const CLUSTER: i32 = 4;
const WANDER: f64 = 3.0;
/// How much closer the search over gains looks where a first look finds nothing.
const DENSER: u32 = 8;

/// The best gains of a problem, certified.
///
/// # Errors
/// [`OptimumError`]: limits that cannot be used or met, with the floor; a process that the controller does not stabilise;
/// an objective without bound.
pub fn optimum(problem: &OptimumProblem<'_>) -> Result<Optimum, OptimumError> {
    validate(problem)?;
    let sign = Plant::new(&problem.processes[0]).low.coefficient.signum();
    let found = with_sign(problem, sign);
    let not_stabilisable = matches!(found, Err(OptimumError::NotStabilisable { .. }));
    // What holds these gains is not a limit but where the measurement ends.
    let held_by_nothing = found.as_ref().is_ok_and(|f| f.certificate.active.is_empty());
    if not_stabilisable || held_by_nothing || found == Err(OptimumError::Unbounded) {
        for process in problem.processes {
            if let Process::Measured(response) = process {
                response.reaches_half_turn().map_err(OptimumError::Measured)?;
            }
        }
    }
    if !not_stabilisable {
        return found;
    }
    // An unstable process may want the other sign than its static gain has.
    with_sign(problem, -sign)
}

fn with_sign(problem: &OptimumProblem<'_>, sign: f64) -> Result<Optimum, OptimumError> {
    let mut solver = Solver::new(problem, sign);
    let lost = (0..solver.family.plants.len()).find(|&plant| solver.family.own_points(plant).is_empty());
    if let Some(plant) = lost {
        return Err(OptimumError::OutOfRange { gain: solver.family.plants[plant].low.coefficient });
    }
    if let Some(refused) = floor::of_ju(&mut solver) {
        return Err(refused);
    }
    let found = match problem.objective {
        Objective::Jv | Objective::MaxKi => solver.solve(problem.objective),
        Objective::IaeLoad | Objective::IaeSetpoint => by_simulation::solve(&mut solver, problem.objective),
    };
    match found {
        // With derivative action two lags without dead time take any gain: the search runs after it until it gives up.
        Err(OptimumError::NotCertified { .. }) if solver.takes_any_gain() => {
            Err(floor::of_slow(&solver).unwrap_or(OptimumError::Unbounded))
        }
        Ok(found)
            if found.certificate.active.is_empty()
                && solver.takes_any_gain()
                && solver.takes_more(&found) =>
        {
            Err(OptimumError::Unbounded)
        }
        found => found,
    }
}

fn validate(problem: &OptimumProblem<'_>) -> Result<(), OptimumError> {
    problem.limits.validated()?;
    if let Wanted::Pid(DerivativeFilter::Ratio(n)) = problem.wanted
        && !(n > 0.0 && n.is_finite())
    {
        return Err(OptimumError::Filter { value: n });
    }
    let measured = problem.processes.iter().any(|p| matches!(p, Process::Measured(_)));
    if measured && matches!(problem.objective, Objective::IaeLoad | Objective::IaeSetpoint) {
        return Err(OptimumError::NeedsModel);
    }
    if problem.processes.is_empty() { Err(OptimumError::NoProcess) } else { Ok(()) }
}

/// What a search is after.
#[derive(Debug, Clone, Copy)]
pub(super) struct Quest {
    pub objective: Objective,
    pub limits: LoopLimits,
    /// A limit to be made least in place of the objective.
    pub relax: Option<Relax>,
}

impl Quest {
    /// The limits that bear on gains: those that they come down to where one is made least.
    fn limits_at(&self, known: &Candidate) -> LoopLimits {
        self.relax.map_or(self.limits, |relax| relax.limits(known.value))
    }

    fn on<'a, 'b>(&self, family: &'a Family<'b>, points: &'a Points) -> Ground<'a, 'b> {
        Ground { family, points, limits: self.limits, objective: self.objective, relax: self.relax }
    }
}

/// The better of two results.
fn better(a: Found, b: Found) -> Found {
    match (a, b) {
        (Found::Best(first), Found::Best(second)) if second.value < first.value => b,
        (Found::Best(_), _) => a,
        _ => b,
    }
}

/// Known gains sought afresh at their Td and some about it: far out in Td the gains that meet the limits are so few that
/// points added meanwhile may have put them elsewhere.
fn afresh(search: &mut GainSearch, on: &Ground<'_, '_>, known: Candidate) -> Candidate {
    let mut best: Option<Candidate> = None;
    for times in [1.0, 0.96, 1.04] {
        let Lead { td_s, tf_s } = known.lead;
        let lead = Lead { td_s: times * td_s, tf_s: times * tf_s };
        if let Found::Best(found) = search.run(on, lead, Care::Full)
            && best.is_none_or(|b| found.value < b.value)
        {
            best = Some(found);
        }
    }
    best.unwrap_or(known)
}

/// A problem with its points and workspace.
pub(super) struct Solver<'a> {
    pub family: Family<'a>,
    pub search: GainSearch,
    pub wanted: Wanted,
    pub limits: LoopLimits,
    /// Bottoms of the valleys of Td that the last look at everything came to, on its points.
    pub valleys: Vec<Candidate>,
}

impl<'a> Solver<'a> {
    fn new(problem: &OptimumProblem<'a>, sign: f64) -> Self {
        let mut family = Family::new(problem.processes, sign);
        let limits = LoopLimits { ms: problem.limits.ms.min(LARGEST_MS), ..problem.limits };
        // The circle that a lax limit forbids is small: points this far apart would step over it.
        if limits.ms > LAX_MS {
            (0..family.plants.len()).for_each(|plant| family.refine(plant));
        }
        Self { family, search: GainSearch::default(), wanted: problem.wanted, limits, valleys: Vec::new() }
    }

    /// Whether nothing in processes and limits holds the gain of a controller with derivative action.
    fn takes_any_gain(&self) -> bool {
        let free = |p: &Plant<'_>| p.dead_time_s == 0.0 && p.excess <= 2;
        let derivative = self.wanted != Wanted::Pi;
        derivative && self.limits.ju.is_infinite() && self.family.plants.iter().all(free)
    }

    /// Whether ten times these gains stabilise as well.
    fn takes_more(&self, found: &Optimum) -> bool {
        const MORE: f64 = 10.0;
        let sign = MORE * self.family.sign;
        self.family.is_stable(Lead::of(&found.gains), sign * found.gains.kp, sign * found.gains.ki)
    }

    pub fn controller(&self) -> &'static str {
        if self.wanted == Wanted::Pi { "PI" } else { "PID" }
    }

    /// The whole range, without a start.
    pub fn look_everywhere(&mut self, quest: &Quest) -> Found {
        let on = quest.on(&self.family, &self.family.points);
        let mut pi = self.search.run(&on, Lead::NONE, Care::Full);
        if pi == Found::Nothing {
            pi = self.search.run(&on, Lead::NONE, Care::Dense(DENSER));
        }
        let Wanted::Pid(filter) = self.wanted else { return pi };
        let omega = match pi {
            Found::Best(found) => self.nearest_omega(&found),
            Found::Unbounded => return Found::Unbounded,
            Found::Nothing | Found::NotStabilising => self.family.plants[0].typical_omega(),
        };
        let mut looked = lead_search::look(&mut self.search, &on, filter, omega);
        if looked == Err(Found::Nothing) {
            // What needs derivative action to be stable at all may be far slower than its own frequencies say.
            looked = lead_search::look(&mut self.search, &on, filter, 0.1 * omega);
        }
        let pid = match looked {
            Ok(valleys) => {
                let mut refine = |known| self.refined(quest, filter, known, Steps::AFTER_LOOK);
                let bottoms: Vec<Found> = valleys.into_iter().map(&mut refine).collect();
                let candidate = |found: &Found| if let Found::Best(c) = found { Some(*c) } else { None };
                self.valleys = bottoms.iter().filter_map(candidate).collect();
                bottoms.into_iter().reduce(better).unwrap_or(Found::Nothing)
            }
            Err(other) => other,
        };
        match (pid, pi) {
            (Found::Best(with), Found::Best(without)) if without.value < with.value => pi,
            (Found::Best(_) | Found::Unbounded, _) => pid,
            _ => pi,
        }
    }

    /// About known gains, on the points that bear on them and on those that turn out to.
    fn refined(&mut self, quest: &Quest, filter: DerivativeFilter, known: Candidate, steps: Steps) -> Found {
        let all = &self.family.points;
        let held = quest.limits.ju.is_finite() && quest.relax.is_none();
        let mut points = all.near(&quest.limits_at(&known), known.lead, known.kp, known.ki);
        let whole = quest.on(&self.family, all);
        let stays = |c: Candidate| c.value <= known.value + LOST * known.value.abs();
        let kept = !held || self.search.at_gain(&whole, known.lead, known.kp).is_some_and(stays);
        let known = if kept { known } else { afresh(&mut self.search, &whole, known) };
        let mut best: Option<Candidate> = None;
        for trial in 0..TRIALS {
            let on = Ground { points: &points, ..whole };
            let start = best.unwrap_or(known);
            let Found::Best(found) =
                lead_search::refine(&mut self.search, &on, filter, start, steps.halved(trial))
            else {
                break;
            };
            // What the other points make of it.
            let seen = self.search.at_gain(&whole, found.lead, found.kp);
            let stable = seen.filter(|seen| self.family.is_stable(seen.lead, seen.kp, seen.ki));
            if let Some(seen) = stable
                && best.is_none_or(|b| seen.value < b.value)
            {
                best = Some(seen);
            }
            if stable.is_some_and(|seen| seen.value - found.value <= SEEN * found.value.abs()) {
                break;
            }
            points.extend(&all.near(&quest.limits_at(&found), found.lead, found.kp, found.ki));
        }
        best.map_or(Found::Best(known), Found::Best)
    }

    /// Where the loop of a candidate comes nearest to −1, in rad/s.
    pub fn nearest_omega(&self, candidate: &Candidate) -> f64 {
        let gains = self.family.gains(candidate.lead, candidate.kp, candidate.ki);
        let typical = self.family.plants[0].typical_omega();
        let peak = self.family.peaks(0, &gains).ok().flatten().map(|p| p.s.omega_rad_s);
        peak.filter(|w| *w > 0.0 && w.is_finite()).unwrap_or(typical)
    }

    /// About known gains, to the last digit.
    pub fn look_nearby(&mut self, quest: &Quest, known: Candidate, steps: Steps) -> Found {
        match self.wanted {
            Wanted::Pid(filter) if known.lead.td_s > 0.0 => self.refined(quest, filter, known, steps),
            _ => {
                let limits = quest.limits_at(&known);
                let points = self.family.points.near(&limits, known.lead, known.kp, known.ki);
                let on = quest.on(&self.family, &points);
                self.search.run(&on, known.lead, Care::Near(known.kp))
            }
        }
    }

    /// The best Ki of given Kp, Td and Tf.
    pub fn at_gain(
        &mut self,
        objective: Objective,
        limits: &LoopLimits,
        lead: Lead,
        kp: f64,
    ) -> Option<Candidate> {
        let on = Quest { objective, limits: *limits, relax: None }.on(&self.family, &self.family.points);
        self.search.at_gain(&on, lead, kp)
    }

    /// Least Jv or largest Ki; where no gains meet the limits, the floor.
    pub fn solve(&mut self, objective: Objective) -> Result<Optimum, OptimumError> {
        match self.within_limits(objective)? {
            Some(found) => Ok(found),
            None => Err(floor::explain(self)),
        }
    }

    /// Least Jv or largest Ki; `None` where no gains meet the limits. A PID is never worse than the PI.
    pub fn within_limits(&mut self, objective: Objective) -> Result<Option<Optimum>, OptimumError> {
        let found = self.sought(objective);
        let open = match &found {
            Ok(_) => true,
            Err(OptimumError::NotCertified { .. }) => !self.takes_any_gain(),
            Err(_) => false,
        };
        if self.wanted == Wanted::Pi || !open {
            return found;
        }
        let wanted = std::mem::replace(&mut self.wanted, Wanted::Pi);
        let simple = self.sought(objective);
        self.wanted = wanted;
        let cost = |o: &Optimum| if objective == Objective::Jv { o.value } else { -o.value };
        match (found, simple) {
            (Ok(Some(with)), Ok(Some(without))) if cost(&without) < cost(&with) => Ok(Some(without)),
            (Ok(Some(with)), _) => Ok(Some(with)),
            (_, Ok(Some(without))) => Ok(Some(without)),
            (found, _) => found,
        }
    }

    /// The same by one search, which may end in a valley that is not the deepest.
    fn sought(&mut self, objective: Objective) -> Result<Option<Optimum>, OptimumError> {
        // Two integrators in the loop: ∫ ln|T|/ω² dω ≥ 0, so |T| passes 1 somewhere.
        let integrates = self.family.plants.iter().any(|p| p.low.power < 0);
        if integrates && self.limits.mt <= 1.0 + LEAST_MT {
            return Ok(None);
        }
        let mut known: Option<Candidate> = None;
        let mut excess = f64::INFINITY;
        let quest = Quest { objective, limits: self.limits, relax: None };
        // The best that all but met the limits: a deep valley may be too narrow to follow from round to round.
        let mut last: Option<Candidate> = None;
        let mut promising: Option<Candidate> = None;
        let mut sought_least = false;
        for round in 1..=ROUNDS {
            let steps = Steps::after(excess);
            let mut found = known.map_or(Found::Nothing, |k| self.look_nearby(&quest, k, steps));
            if found == Found::Nothing {
                found = self.look_everywhere(&quest);
            }
            if found == Found::Nothing && !sought_least {
                // Near the least limits the gains that meet them are too few for a grid.
                sought_least = true;
                let least = self.least(Relax::together(self.limits)).filter(|(stretch, _)| *stretch <= 1.0);
                found = least.map_or(Found::Nothing, |(_, candidate)| Found::Best(candidate));
            }
            if matches!(found, Found::Nothing | Found::NotStabilising)
                && let Some(slow) = slow::gains(self, objective)
            {
                found = Found::Best(slow);
            }
            let candidate = match found {
                Found::Best(candidate) => candidate,
                Found::Unbounded => return Err(OptimumError::Unbounded),
                // Of a PI: derivative action may stabilise, though not within the limits.
                Found::NotStabilising if self.wanted == Wanted::Pi => {
                    return Err(OptimumError::NotStabilisable { controller: self.controller() });
                }
                Found::Nothing | Found::NotStabilising => return Ok(None),
            };
            let check = self.check(objective, &candidate)?;
            if !check.unstable.is_empty() {
                // A window narrower than the points: closer ones everywhere.
                check.unstable.iter().for_each(|plant| self.family.refine(*plant));
                known = None;
                continue;
            }
            last = Some(candidate);
            // What meeting the limits may cost is no depth.
            let held = Candidate { value: check.peaks.v.value * (1.0 + COST * check.excess), ..candidate };
            let all_but = check.excess < ALL_BUT && objective == Objective::Jv;
            if all_but && promising.is_none_or(|p| held.value < p.value) {
                promising = Some(held);
            }
            // The first look is a coarse one.
            if known.is_none() {
                self.add(&check);
                (known, excess) = (Some(candidate), check.excess);
                continue;
            }
            excess = check.excess;
            if let Some(found) = self.accepted(objective, candidate, check, round)? {
                let deeper =
                    promising.filter(|p| p.lead.td_s > 0.0 && p.value < found.value * (1.0 - DEEPER));
                let rest = match deeper {
                    Some(known) => self.walked(&quest, known.lead)?,
                    None => None,
                };
                let best = rest.filter(|rest| rest.value < found.value);
                return Ok(Some(best.unwrap_or(found)));
            }
            known = Some(candidate);
        }
        let rest = match last {
            Some(known) if !self.takes_any_gain() => self.walked(&quest, promising.unwrap_or(known).lead)?,
            _ => None,
        };
        rest.map_or(Err(OptimumError::NotCertified { excess_percent: 100.0 * excess }), |found| {
            Ok(Some(found))
        })
    }

    /// Where every round of the search goes elsewhere: downhill over Td and N from one to the next that [`Self::at_rest`]
    /// answers.
    fn walked(&mut self, quest: &Quest, from: Lead) -> Result<Option<Optimum>, OptimumError> {
        let Some(mut best) = self.at_rest(quest, from)? else { return Ok(None) };
        let Wanted::Pid(filter) = self.wanted else { return Ok(Some(best)) };
        if from.td_s == 0.0 {
            return Ok(Some(best));
        }
        let cost = |o: &Optimum| if quest.objective == Objective::Jv { o.value } else { -o.value };
        let free = filter == DerivativeFilter::Free;
        let directions: &[(f64, f64)] = if free {
            &[(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)]
        } else {
            &[(1.0, 0.0), (-1.0, 0.0)]
        };
        let (mut td_s, mut n) = (from.td_s, from.td_s / from.tf_s);
        let mut step = WALK.0;
        while step > WALK.1 {
            let mut better = false;
            for (of_td, of_n) in directions {
                let next_td = td_s * (step * of_td).exp();
                let next_n =
                    if free { (n * (step * of_n).exp()).clamp(RATIO_RANGE.0, RATIO_RANGE.1) } else { n };
                let lead = Lead { td_s: next_td, tf_s: next_td / next_n };
                if let Some(found) = self.at_rest(quest, lead)?.filter(|found| cost(found) < cost(&best)) {
                    (best, td_s, n, better) = (found, next_td, next_n, true);
                    break;
                }
            }
            if !better {
                step *= 0.4;
            }
        }
        Ok(Some(best))
    }

    /// The best of one Td and Tf, under limits a little stricter than those
    /// that are to be met, and ever more so.
    fn at_rest(&mut self, quest: &Quest, lead: Lead) -> Result<Option<Optimum>, OptimumError> {
        let LoopLimits { ms, mt, ju } = self.limits;
        let mut known: Option<Candidate> = None;
        for round in 0..ROUNDS_AT_REST {
            // The first rounds put the points where they are missing.
            let short =
                if round < ROUNDS { 0.0 } else { (SHORT * SHORTER.powi((round - ROUNDS) as i32)).min(0.5) };
            let within = |limit: f64| 1.0 + (limit - 1.0) * (1.0 - short);
            let floor = self.family.least_ju();
            let strict =
                LoopLimits { ms: within(ms), mt: within(mt), ju: (ju * (1.0 - short)).max(floor.min(ju)) };
            let stricter = Quest { limits: strict, ..*quest };
            let on = stricter.on(&self.family, &self.family.points);
            let near = known.map_or(Found::Nothing, |k| self.search.run(&on, lead, Care::Near(k.kp)));
            let found = if near == Found::Nothing { self.search.run(&on, lead, Care::Full) } else { near };
            let Found::Best(candidate) = found else { return Ok(None) };
            let check = self.check(quest.objective, &candidate)?;
            if !check.unstable.is_empty() {
                check.unstable.iter().for_each(|plant| self.family.refine(*plant));
                known = None;
                continue;
            }
            if check.excess <= MET {
                return Ok(Some(self.certified(quest.objective, &candidate, candidate.value, check, round)));
            }
            if let Some(found) = self.accepted(quest.objective, candidate, check, round)? {
                return Ok(Some(found));
            }
            known = Some(candidate);
        }
        Ok(None)
    }

    pub fn check(&self, objective: Objective, candidate: &Candidate) -> Result<Check, OptimumError> {
        Check::of(&self.family, &self.limits, objective, candidate).map_err(OptimumError::Measured)
    }

    /// Adds the frequencies at which a limit was passed, and some about them: the next gains put the peak elsewhere.
    ///
    /// A peak between two points stands out of them by about the square of their distance, so the square root of the
    /// excess is the distance over which the peak may wander.
    pub fn add(&mut self, check: &Check) {
        for &(plant, omega, excess) in &check.passed {
            let reach = WANDER * excess.sqrt().clamp(1e-6, 0.3);
            for k in -CLUSTER..=CLUSTER {
                let away = f64::from(k) / f64::from(CLUSTER);
                self.family.add(plant, omega * (reach * away).exp());
            }
        }
    }

    /// The candidate made exact, if it is close to the limits; else its frequencies are added.
    fn accepted(
        &mut self,
        objective: Objective,
        candidate: Candidate,
        check: Check,
        round: usize,
    ) -> Result<Option<Optimum>, OptimumError> {
        let seen = candidate.value;
        let hidden = if objective == Objective::Jv { check.peaks.v.value / seen - 1.0 } else { 0.0 };
        self.add(&check);
        if check.excess > CLOSE || hidden > CLOSE {
            return Ok(None);
        }
        let Some((last, check)) = self.last_steps(objective, candidate, check)? else { return Ok(None) };
        Ok(Some(self.certified(objective, &last, seen, check, round)))
    }

    /// A candidate that the exact analysis confirms; `seen` is what the points alone make of the problem.
    fn certified(
        &self,
        objective: Objective,
        last: &Candidate,
        seen: f64,
        check: Check,
        rounds: usize,
    ) -> Optimum {
        let value = if objective == Objective::Jv { check.peaks.v.value } else { last.ki };
        Optimum {
            gains: self.family.gains(last.lead, last.kp, last.ki),
            value,
            certificate: Certificate {
                active: check.active(&self.limits),
                peaks: check.peaks,
                gap: Some((1.0 - seen / if objective == Objective::Jv { value } else { -value }).abs()),
                excess: check.excess.max(0.0),
                rounds,
            },
        }
    }

    /// Ki alone follows the limits down to rounding: at fixed Kp, Td and Tf the points converge quadratically.
    fn last_steps(
        &mut self,
        objective: Objective,
        candidate: Candidate,
        check: Check,
    ) -> Result<Option<(Candidate, Check)>, OptimumError> {
        let (mut last, mut check) = (candidate, check);
        let mut limits = self.limits;
        for _ in 0..LAST_STEPS {
            if check.excess <= MET {
                return Ok(Some((last, check)));
            }
            let next = self.at_gain(objective, &limits, last.lead, last.kp);
            let Some(next) = next else {
                // The limit bears on Kp itself: a little less of it, and of the limit on Ki.
                last.kp *= 1.0 - 2.0 * check.excess.max(MET);
                continue;
            };
            last = next;
            check = self.check(objective, &last)?;
            if !check.unstable.is_empty() {
                return Ok(None);
            }
            self.add(&check);
            if check.excess > MET && check.passed.is_empty() {
                limits.ms *= 1.0 - check.excess;
                limits.ju *= 1.0 - check.excess;
                last.kp *= 1.0 - check.excess;
            }
        }
        Ok(None)
    }
}
