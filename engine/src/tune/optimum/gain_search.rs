//! The best Kp and Ki for given Td and Tf: every Kp has its best Ki in closed form, and one search over Kp remains.

use super::family::Family;
use super::points::Points;
use super::problem::{LoopLimits, Objective};
use super::relax::Relax;
use super::slice::{Allowed, Lead, LoadEnvelope, Shaped};
use super::stabilising::OverKi;
use super::valley::{Spot, valley};

/// Shares of an interval of Kp at which the search looks first; closer at its ends, where narrow windows lie.
const SHARES: [f64; 24] = [
    1e-4, 1e-3, 0.005, 0.015, 0.03, 0.05, 0.08, 0.12, 0.16, 0.21, 0.26, 0.31, 0.37, 0.43, 0.49, 0.56, 0.63,
    0.7, 0.78, 0.86, 0.92, 0.96, 0.985, 0.997,
];
/// The same for a search that only has to tell one Td from another.
const COARSE_SHARES: [f64; 10] = [1e-3, 0.02, 0.07, 0.14, 0.22, 0.31, 0.42, 0.56, 0.74, 0.92];
/// Gains per decade, and decades about 1/|G|, of an interval without end.
const PER_DECADE: f64 = 3.0;
const DECADES_BELOW: f64 = 4.0;
const DECADES_ABOVE: f64 = 6.0;
/// How far below the first gain of a grid the search goes where it may leave something there, and in which steps.
const BELOW: f64 = 0.1;
const STEPS_BELOW: i32 = 8;
/// Relative width of the bracket of Kp at which the search ends.
const FINE: f64 = 3e-8;
const COARSE: f64 = 3e-4;
/// Half width of the first bracket about a known optimum, relative.
const NEARBY: f64 = 0.03;

/// How carefully a search is done.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Care {
    /// The whole of every interval.
    Full,
    /// The same on a grid `n` times as dense, where a first look found nothing.
    Dense(u32),
    /// Few gains, to tell one Td from another.
    Coarse,
    /// About a known Kp only, to the last digit.
    Near(f64),
    /// About a known Kp, to the precision of [`Care::Coarse`]; the second is the relative half width of its first bracket.
    CoarseNear(f64, f64),
}

/// Gains with what they are worth; smaller is better.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Candidate {
    pub lead: Lead,
    pub kp: f64,
    pub ki: f64,
    /// Jv, −Ki, or how far a limit has to be relaxed.
    pub value: f64,
}

/// What a search came to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Found {
    Best(Candidate),
    /// No gain meets the limits.
    Nothing,
    /// No gain of the controller stabilises the process.
    NotStabilising,
    /// The objective grows with the gain for ever.
    Unbounded,
}

/// Workspace of searches.
#[derive(Debug, Default)]
pub(super) struct GainSearch {
    allowed: Allowed,
    envelope: LoadEnvelope,
    over_ki: OverKi,
}

/// What a search runs on: the processes, the points that count, limits and objective.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ground<'a, 'b> {
    pub family: &'a Family<'b>,
    pub points: &'a Points,
    pub limits: LoopLimits,
    pub objective: Objective,
    /// A limit to be made least in place of the objective.
    pub relax: Option<Relax>,
}

/// One Td and Tf under search.
struct Task<'a, 'b> {
    family: &'a Family<'b>,
    shaped: Shaped<'a>,
    limits: LoopLimits,
    objective: Objective,
    relax: Option<Relax>,
    /// Kp of these intervals stabilises with a small Ki.
    stabilising: Vec<(f64, f64)>,
    /// Kp = 0 does.
    integral_alone: bool,
    /// Any Ki does, however large.
    any_ki: bool,
    /// Only a Ki well above 0 may stabilise: every interval of Ki is tested.
    needs_ki: bool,
}

impl Spot for AtGain {
    fn at(&self) -> f64 {
        self.kp
    }

    fn value(&self) -> f64 {
        self.value
    }
}

impl<'a, 'b> Task<'a, 'b> {
    /// Whether the loops of these gains are stable, by the exact criterion.
    fn is_stable(&self, at: &AtGain) -> bool {
        self.family.is_stable(self.shaped.lead, at.kp, at.ki)
    }

    fn new(on: &Ground<'a, 'b>, lead: Lead) -> Self {
        let plain = |p: &super::points::Plant<'_>| p.excess <= 1 && p.dead_time_s == 0.0;
        let family = on.family;
        Self {
            family,
            shaped: Shaped::new(on.points, lead),
            limits: on.limits,
            objective: on.objective,
            relax: on.relax,
            stabilising: Vec::new(),
            integral_alone: family.plants.iter().all(|p| p.low.power == 0),
            any_ki: family.plants.iter().all(plain),
            // Of a derivative with a slow filter Kp is the least part: an unstable process may take one that is too small
            // on its own.
            needs_ki: lead.td_s > 0.0 && on.limits.ju.is_finite() && family.is_reversed(),
        }
    }
}

/// Best Ki of a gain; ∞ as value where there is none.
#[derive(Debug, Clone, Copy)]
struct AtGain {
    kp: f64,
    ki: f64,
    value: f64,
}

impl GainSearch {
    /// Searches for given Td and Tf.
    pub fn run(&mut self, on: &Ground<'_, '_>, lead: Lead, care: Care) -> Found {
        let mut task = Task::new(on, lead);
        self.allowed.limit(on.points, &on.limits);
        if !matches!(care, Care::Near(_) | Care::CoarseNear(..)) {
            let family = on.family;
            task.stabilising = family.stabilising(&task.shaped);
            task.integral_alone &= task.stabilising.first().is_some_and(|i| i.0 == 0.0);
            if task.needs_ki {
                let last = task.stabilising.last().map_or(f64::INFINITY, |i| i.1);
                task.stabilising = vec![(0.0, last)];
            }
            if task.stabilising.is_empty() {
                return Found::NotStabilising;
            }
        }
        self.search(&task, care)
    }

    /// The best Ki of one gain, taken to stabilise with a small Ki.
    pub fn at_gain(&mut self, on: &Ground<'_, '_>, lead: Lead, kp: f64) -> Option<Candidate> {
        let task = Task::new(on, lead);
        self.allowed.limit(on.points, &on.limits);
        let found = self.at(&task, kp);
        found.value.is_finite().then_some(Candidate { lead, kp, ki: found.ki, value: found.value })
    }

    fn search(&mut self, task: &Task<'_, '_>, care: Care) -> Found {
        let cap = task.family.largest_kp(task.shaped.lead, &task.limits);
        // A look at everything only has to find the right valley; its bottom is sought once more when all points are in.
        match care {
            Care::Near(kp) => return self.nearby(task, kp.min(cap), NEARBY * kp, cap, FINE),
            Care::CoarseNear(kp, reach) => {
                return self.nearby(task, kp.min(cap), reach * kp, cap, COARSE);
            }
            Care::Full | Care::Dense(_) | Care::Coarse => {}
        }
        let mut best = Found::Nothing;
        for &(low, high) in &task.stabilising {
            let bounded = high.min(cap);
            if bounded <= low {
                continue;
            }
            let (mut grid, endless) = gains(task, low, bounded, care);
            // A search that only tells one Td from another is followed by one that walks.
            if !endless && care != Care::Coarse && self.leaves_below(task, &grid, low) {
                let first = grid[usize::from(grid[0] == 0.0)];
                grid.extend((1..=STEPS_BELOW).map(|k| low + (first - low) * BELOW.powi(k)));
                grid.sort_unstable_by(f64::total_cmp);
            }
            match (self.over(task, &grid, endless), best) {
                (Found::Best(new), Found::Best(old)) if new.value >= old.value => {}
                (Found::Nothing | Found::NotStabilising, _) => {}
                (Found::Unbounded, _) => return Found::Unbounded,
                (found, _) => best = found,
            }
        }
        best
    }

    /// Whether the best of a grid may lie below its first gain: nothing else meets the limits.
    fn leaves_below(&mut self, task: &Task<'_, '_>, grid: &[f64], low: f64) -> bool {
        let mut above = grid.iter().filter(|kp| **kp > low);
        let first = above.next().map_or(f64::INFINITY, |kp| self.at(task, *kp).value);
        let second = above.next().map_or(f64::INFINITY, |kp| self.at(task, *kp).value);
        first.is_infinite() && second.is_infinite() && !above.any(|kp| self.at(task, *kp).value.is_finite())
            || first < second
    }

    /// Walks downhill from a gain until it stands in a valley, and to its bottom.
    fn nearby(&mut self, task: &Task<'_, '_>, kp: f64, reach: f64, cap: f64, width: f64) -> Found {
        const MOST: usize = 24;
        let at = &mut |kp: f64| self.at(task, kp);
        let (mut a, mut m, mut b) = (at((kp - reach).max(0.0)), at(kp), at((kp + reach).min(cap)));
        let mut step = reach;
        for _ in 0..MOST {
            step *= 1.6;
            if a.value < m.value && a.kp > 0.0 {
                (b, m) = (m, a);
                a = at((m.kp - step).max(0.0));
            } else if b.value < m.value && b.kp < cap {
                (a, m) = (m, b);
                b = at((m.kp + step).min(cap));
            } else {
                break;
            }
        }
        let found = valley(at, a, m, b, width);
        if !found.value.is_finite() {
            return Found::Nothing;
        }
        let AtGain { kp, ki, value } = found;
        Found::Best(Candidate { lead: task.shaped.lead, kp, ki, value })
    }

    /// Looks at every gain of a grid, then about the best of them.
    fn over(&mut self, task: &Task<'_, '_>, grid: &[f64], endless: bool) -> Found {
        let mut seen: Vec<AtGain> = grid.iter().map(|&kp| self.at(task, kp)).collect();
        if seen.iter().any(|s| s.value == f64::NEG_INFINITY) {
            return Found::Unbounded;
        }
        let mut best: Option<AtGain> = None;
        // The points end at a lowest frequency: a loop slower than that is stable on them whatever its Ki.
        while let Some(lowest) = seen.iter_mut().min_by(|a, b| a.value.total_cmp(&b.value))
            && lowest.value.is_finite()
            && !task.is_stable(lowest)
        {
            lowest.value = f64::INFINITY;
        }
        let least = seen.iter().map(|s| s.value).fold(f64::INFINITY, f64::min);
        for (i, middle) in seen.iter().enumerate() {
            let lower =
                |k: Option<usize>| k.and_then(|k| seen.get(k)).is_none_or(|s| middle.value <= s.value);
            // A valley far above the best one holds no better gain between two points this close.
            let worth = middle.value <= least + 0.3 * least.abs();
            if !(middle.value.is_finite() && worth && lower(i.checked_sub(1)) && lower(Some(i + 1))) {
                continue;
            }
            if endless && i + 1 == seen.len() {
                return Found::Unbounded;
            }
            let left = seen[i.saturating_sub(1)];
            let right = seen[(i + 1).min(seen.len() - 1)];
            if !task.is_stable(middle) {
                continue;
            }
            let mut found = valley(&mut |kp| self.at(task, kp), left, *middle, right, COARSE);
            if !task.is_stable(&found) {
                found = *middle;
            }
            if best.is_none_or(|b| found.value < b.value) {
                best = Some(found);
            }
        }
        best.map_or(Found::Nothing, |b| {
            Found::Best(Candidate { lead: task.shaped.lead, kp: b.kp, ki: b.ki, value: b.value })
        })
    }

    /// The best Ki of a gain.
    fn at(&mut self, task: &Task<'_, '_>, kp: f64) -> AtGain {
        let nothing = AtGain { kp, ki: 0.0, value: f64::INFINITY };
        if kp == 0.0 && !task.integral_alone {
            return nothing;
        }
        if let Some(relax) = &task.relax {
            return self.least_at(task, relax, kp);
        }
        self.allowed.at(&task.shaped, kp);
        if self.allowed.intervals.is_empty() {
            return nothing;
        }
        let mut best = nothing;
        let (mut load, mut counted) = (false, false);
        for k in (0..self.allowed.intervals.len()).rev() {
            let (low, high) = self.allowed.intervals[k];
            if high.is_infinite() {
                let ki = 10.0 * low.max(kp * task.family.plants[0].typical_omega());
                if task.any_ki && task.family.is_stable(task.shaped.lead, kp, ki) {
                    return AtGain { kp, ki, value: f64::NEG_INFINITY };
                }
                continue;
            }
            let better_possible = match task.objective {
                Objective::Jv => 1.0 / high < best.value,
                _ => -high < best.value,
            };
            if !better_possible {
                continue;
            }
            // From Ki = 0⁺ on nothing crosses −1; further intervals have to show that they are stable.
            if task.needs_ki {
                if !task.family.is_stable(task.shaped.lead, kp, 0.5 * (low + high)) {
                    continue;
                }
            } else if low > 0.0 {
                if !counted {
                    self.over_ki.at(task.family, task.shaped.lead, kp);
                    counted = true;
                }
                if !self.over_ki.is_stable(task.family, 0.5 * (low + high)) {
                    continue;
                }
            }
            let (ki, value) = if task.objective == Objective::Jv {
                if !load {
                    self.envelope.at(&task.shaped, kp);
                    load = true;
                }
                self.envelope.best(low, high)
            } else {
                (high, -high)
            };
            if value < best.value {
                best = AtGain { kp, ki, value };
            }
        }
        best
    }
}

impl GainSearch {
    /// The least that a limit can be at a gain, with a Ki that comes so far.
    fn least_at(&mut self, task: &Task<'_, '_>, relax: &Relax, kp: f64) -> AtGain {
        /// Ratio of what is met and what is not at which halving ends.
        const RATIO: f64 = 1.0 + 1e-6;
        let mut counted = false;
        let mut met = |above: f64| -> Option<f64> {
            self.allowed.limit(task.shaped.points, &relax.limits(above));
            self.allowed.at(&task.shaped, kp);
            let unit = kp.max(f64::MIN_POSITIVE) * task.family.plants[0].typical_omega();
            self.allowed.intervals.iter().find_map(|&(low, high)| {
                let ki = if high.is_finite() { 0.5 * (low + high) } else { low + unit };
                if low > 0.0 && !counted {
                    self.over_ki.at(task.family, task.shaped.lead, kp);
                    counted = true;
                }
                (low == 0.0 || self.over_ki.is_stable(task.family, ki)).then_some(ki)
            })
        };
        let (mut low, mut high) = relax.range;
        let Some(mut ki) = met(high) else { return AtGain { kp, ki: 0.0, value: f64::INFINITY } };
        if let Some(ki) = met(low) {
            return AtGain { kp, ki, value: low };
        }
        while high > low * RATIO {
            let middle = (low * high).sqrt();
            if let Some(found) = met(middle) { (high, ki) = (middle, found) } else { low = middle }
        }
        AtGain { kp, ki, value: high }
    }
}

/// Gains to look at in an interval, and whether it has no end.
fn gains(task: &Task<'_, '_>, low: f64, high: f64, care: Care) -> (Vec<f64>, bool) {
    let mut grid = Vec::with_capacity(64);
    if low == 0.0 {
        grid.push(0.0);
    }
    let times = if let Care::Dense(n) = care { n } else { 1 };
    if high.is_infinite() {
        let plant = &task.family.plants[0];
        let unit = 1.0 / plant.at_omega(plant.typical_omega()).norm();
        let per_decade = PER_DECADE * f64::from(times);
        let steps = ((DECADES_BELOW + DECADES_ABOVE) * per_decade) as i32;
        let at = |k: i32| unit * 10f64.powf(f64::from(k) / per_decade - DECADES_BELOW);
        grid.extend((0..=steps).map(|k| low + at(k)));
        return (grid, true);
    }
    let shares: &[f64] = if care == Care::Coarse { &COARSE_SHARES } else { &SHARES };
    let mut before = 0.0;
    for &share in shares.iter().chain(&[1.0]) {
        for k in 1..=times {
            let between = before + (share - before) * f64::from(k) / f64::from(times);
            grid.push(low + between * (high - low));
        }
        before = share;
    }
    (grid, false)
}
