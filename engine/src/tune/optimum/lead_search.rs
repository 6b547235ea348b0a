//! The best Td and Tf of a PID controller: every pair has its best Kp and Ki by the search over gains.

use super::gain_search::{Candidate, Care, Found, GainSearch, Ground};
use super::problem::DerivativeFilter;
use super::simplex::{Simplex, minimise};
use super::slice::Lead;
use super::valley::{Spot, valley};

/// Td at which the search looks first, in units of 1/ω, ω the frequency at which the loop without derivative action
/// comes nearest to −1.
/// Long dead times have a second valley far out, where the derivative is the controller's main part.
const TDS: [f64; 13] = [0.08, 0.18, 0.35, 0.6, 0.9, 1.3, 2.0, 3.2, 5.5, 9.0, 15.0, 25.0, 40.0];
/// Tf at which it looks as well where Ju is limited, in the same units: there the controller is one of proportional action
/// N + 1 times Kp over most frequencies and of less below, which a limit on C S leaves room for. For Tf → ∞ it is the PI.
const FAR_TFS: [f64; 7] = [2.0, 4.5, 10.0, 22.0, 50.0, 110.0, 250.0];
/// Valleys of Td that are followed to their bottom.
const MOST_VALLEYS: usize = 4;
/// How much worse than the deepest a valley may look that is followed where Ju is not limited: a coarse look misjudges by
/// that much.
const MISJUDGED: f64 = 0.5;
/// N at which it looks first where the filter is free, and its range.
const RATIOS: [f64; 3] = [1.5, 6.0, 25.0];
const RATIOS_HELD: [f64; 4] = [1.0, 1.5, 6.0, 25.0];
pub(super) const RATIO_RANGE: (f64, f64) = (1.0, 100.0);
/// Least and largest relative half width of the first bracket about a Kp known from next to it.
const REACH: (f64, f64) = (2e-3, 0.12);
/// How far a refinement may go from where it starts, as a logarithm of Td.
const FARTHEST: f64 = 1.5;
/// First steps of a refinement, as a logarithm, and relative widths at which it ends: after the first look, and after
/// points have been added; then no finer than a share of what the gains passed a limit by, since they move by as much again.
#[derive(Debug, Clone, Copy)]
pub(super) struct Steps {
    first: f64,
    last: f64,
}

impl Steps {
    const SHARE: f64 = 0.02;
    pub const AFTER_LOOK: Self = Self { first: 0.2, last: 1e-3 };
    pub const NEARBY: Self = Self { first: 0.01, last: 3e-6 };

    /// Of a round after one that passed a limit by a relative excess.
    pub fn after(excess: f64) -> Self {
        let last = (Self::SHARE * excess).clamp(Self::NEARBY.last, Self::AFTER_LOOK.last);
        Self { last, ..Self::NEARBY }
    }

    /// Those of the n-th trial.
    pub fn halved(self, times: i32) -> Self {
        Self { first: self.first * 0.5f64.powi(times), ..self }
    }
}
/// The same in two dimensions, where every step costs more, and the number of steps.
const LAST_OF_TWO: f64 = 1e-4;
const MOST_OF_TWO: usize = 90;

/// The best of a grid of Td, and of N where it is free; where Ju is limited the best of each valley, the lowest first.
///
/// # Errors
/// What it is instead where there is none.
pub(super) fn look(
    search: &mut GainSearch,
    on: &Ground<'_, '_>,
    filter: DerivativeFilter,
    omega: f64,
) -> Result<Vec<Candidate>, Found> {
    let held = on.limits.ju.is_finite() && on.relax.is_none();
    let ratios: &[f64] = match &filter {
        DerivativeFilter::Ratio(n) => std::slice::from_ref(n),
        DerivativeFilter::Free if held => &RATIOS_HELD,
        DerivativeFilter::Free => &RATIOS,
    };
    // Far out few gains meet the limits.
    let care = if held { Care::Full } else { Care::Coarse };
    let mut valleys: Vec<Candidate> = Vec::new();
    for &n in ratios {
        let mut tds: Vec<f64> = TDS.to_vec();
        if held {
            tds.extend(FAR_TFS.iter().map(|tf| n * tf));
            tds.sort_unstable_by(f64::total_cmp);
        }
        let mut seen: Vec<Option<Candidate>> = Vec::with_capacity(tds.len());
        for td in tds {
            let td_s = td / omega;
            match search.run(on, Lead { td_s, tf_s: td_s / n }, care) {
                Found::Best(found) => seen.push(Some(found)),
                Found::Unbounded => return Err(Found::Unbounded),
                Found::Nothing | Found::NotStabilising => seen.push(None),
            }
        }
        let value = |k: Option<usize>| k.and_then(|k| *seen.get(k)?).map_or(f64::INFINITY, |c| c.value);
        let bottom = |i: &usize| {
            let own = value(Some(*i));
            own.is_finite() && own < value(i.checked_sub(1)) && own <= value(Some(i + 1))
        };
        valleys.extend((0..seen.len()).filter(bottom).filter_map(|i| seen[i]));
    }
    valleys.sort_by(|a, b| a.value.total_cmp(&b.value));
    let least = valleys.first().map_or(0.0, |v| v.value);
    valleys.retain(|v| held || v.value <= least + MISJUDGED * least.abs());
    valleys.truncate(MOST_VALLEYS);
    if valleys.is_empty() { Err(Found::Nothing) } else { Ok(valleys) }
}

/// The best about known gains.
pub(super) fn refine(
    search: &mut GainSearch,
    on: &Ground<'_, '_>,
    filter: DerivativeFilter,
    known: Candidate,
    steps: Steps,
) -> Found {
    let (mut kp, mut before) = (known.kp, known.lead);
    let start = known.lead.td_s.ln();
    let mut at = |x: f64, n: f64| -> AtLead {
        if (x - start).abs() > FARTHEST {
            return AtLead { x, found: None };
        }
        let td_s = x.exp();
        let lead = Lead { td_s, tf_s: td_s / n };
        // Kp moves by about as much as they do.
        let moved = (td_s / before.td_s).ln().abs() + (lead.tf_s / before.tf_s).ln().abs();
        let reach = moved.clamp(REACH.0, REACH.1);
        let mut found = search.run(on, lead, Care::CoarseNear(kp, reach));
        if found == Found::Nothing {
            // Where the derivative is the controller's main part it is Kp Td that stays.
            found = search.run(on, lead, Care::CoarseNear(kp * before.td_s / td_s, REACH.1));
        }
        match found {
            Found::Best(found) => {
                (kp, before) = (found.kp, lead);
                AtLead { x, found: Some(found) }
            }
            _ => AtLead { x, found: None },
        }
    };
    let Steps { first: step, last } = steps;
    let ratio = known.lead.td_s / known.lead.tf_s;
    let best = match (filter, at_end(ratio)) {
        (DerivativeFilter::Ratio(n), _) => along(&mut |x| at(x, n), start, step, last),
        // There N stays, unless a little less far out is better.
        (DerivativeFilter::Free, Some((end, inside))) => {
            let best = along(&mut |x| at(x, end), start, step, last);
            let td = |best: Candidate| best.lead.td_s.ln();
            let beside = best.and_then(|best| at(td(best), inside).found);
            match (best, beside) {
                (Some(best), Some(beside)) if beside.value < best.value => {
                    over_both(&mut at, [td(beside), inside.ln()], steps)
                }
                _ => best,
            }
        }
        (DerivativeFilter::Free, None) => over_both(&mut at, [start, ratio.ln()], steps),
    };
    best.map_or(Found::Nothing, Found::Best)
}

/// The end of the range of N that it stands at, with a place a little inside.
fn at_end(n: f64) -> Option<(f64, f64)> {
    const NEAR: f64 = 1.02;
    const INSIDE: f64 = 1.07;
    let (low, high) = RATIO_RANGE;
    if n <= low * NEAR {
        Some((low, low * INSIDE))
    } else {
        (n >= high / NEAR).then_some((high, high / INSIDE))
    }
}

/// Downhill over ln Td and ln N.
fn over_both(
    at: &mut dyn FnMut(f64, f64) -> AtLead,
    start: [f64; 2],
    Steps { first: step, last }: Steps,
) -> Option<Candidate> {
    let mut best: Option<Candidate> = None;
    let mut value = |x: &[f64]| {
        let here = at(x[0], x[1].exp().clamp(RATIO_RANGE.0, RATIO_RANGE.1));
        if here.value() < best.map_or(f64::INFINITY, |b| b.value) {
            best = here.found;
        }
        here.value()
    };
    let simplex = Simplex { step, last_step: last.max(LAST_OF_TWO), most_evaluations: MOST_OF_TWO };
    minimise(&simplex, &start, &mut value);
    best
}

/// Walks downhill along ln Td until it stands in a valley, and to its bottom.
fn along(at: &mut dyn FnMut(f64) -> AtLead, x: f64, step: f64, last: f64) -> Option<Candidate> {
    const MOST: usize = 16;
    let (mut a, mut m, mut b) = (at(x - step), at(x), at(x + step));
    for _ in 0..MOST {
        if a.value() < m.value() {
            (b, m) = (m, a);
            a = at(m.x - 1.6 * (b.x - m.x));
        } else if b.value() < m.value() {
            (a, m) = (m, b);
            b = at(m.x + 1.6 * (m.x - a.x));
        } else {
            break;
        }
    }
    // The width is that of a logarithm: absolute here, relative to Td.
    let unit = a.x.abs().max(b.x.abs()).max(1e-3);
    valley(at, a, m, b, last / unit).found
}

/// Best gains of a ln Td.
#[derive(Clone, Copy)]
struct AtLead {
    x: f64,
    found: Option<Candidate>,
}

impl Spot for AtLead {
    fn at(&self) -> f64 {
        self.x
    }

    fn value(&self) -> f64 {
        self.found.map_or(f64::INFINITY, |f| f.value)
    }
}
