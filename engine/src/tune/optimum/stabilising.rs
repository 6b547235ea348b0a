//! Gains Kp that stabilise with a small Ki, and the Ki that keep them stable.
//!
//! Between two gains at which Kp P(jω) = −1 for some ω the number of unstable poles does not change. At such a gain a pair
//! of poles crosses the axis in the direction of
//!
//! ```text
//! Re ds/dKp = Im P′(ω)/(Kp² |P′(ω)|²),
//! ```
//!
//! so that one exact count tells those of all gains; what it calls stable is tested exactly all the same.
//!
//! At a fixed Kp the same holds for Ki: a pair lies on the axis where Ki = −jω (1/G + Kp F), which is real where
//! r(ω) = Re(1/G + Kp F) passes 0; with Ki rising it becomes unstable where r falls, stable where r rises.

use super::family::Family;
use super::problem::Process;
use super::slice::{Lead, Shaped};
use crate::analyze::{OpenLoop, unstable_loop_poles};

/// Turn of a dead time between two points, in rad, up to which a crossing between them is told.
const RESOLVED_RAD: f64 = 1.6;
/// Gain Ki, relative to Kp times a frequency of the process, that stands for Ki → 0.
const SMALL: f64 = 1e-6;
/// Intervals of Kp that are looked at; those beyond belong to ripples.
const MOST_INTERVALS: usize = 8;

/// A gain at which poles cross the axis.
#[derive(Debug, Clone, Copy)]
struct Break {
    kp: f64,
    /// Unstable poles more above it than below; `None` where poles pass the origin or infinity.
    change: Option<i64>,
}

/// An interval between two breaks.
#[derive(Debug, Clone, Copy)]
struct Piece {
    from: f64,
    to: f64,
    /// A gain inside.
    inside: f64,
    /// Change of the count at its lower end.
    change: Option<i64>,
}

impl Family<'_> {
    /// Intervals of Kp ≥ 0 in which every loop is stable for Ki → 0⁺.
    pub fn stabilising(&self, shaped: &Shaped<'_>) -> Vec<(f64, f64)> {
        let mut common = vec![(0.0, f64::INFINITY)];
        for plant in 0..self.plants.len() {
            let own = self.stabilising_one(shaped, plant);
            common = intersection(&common, &own);
            if common.is_empty() {
                break;
            }
        }
        common
    }

    fn stabilising_one(&self, shaped: &Shaped<'_>, plant: usize) -> Vec<(f64, f64)> {
        let pieces = self.pieces(shaped, plant);
        let omega = self.plants[plant].typical_omega();
        let stable = |piece: &Piece| {
            self.is_one_stable(plant, shaped.lead, piece.inside, SMALL * piece.inside * omega)
        };
        let counted = self.counted(shaped, plant, &pieces, omega);
        let told = |i: usize| counted.as_ref().is_none_or(|c| c[i] == Some(0));
        let mut found: Vec<usize> = (0..pieces.len()).filter(|&i| told(i) && stable(&pieces[i])).collect();
        // A count that the exact test contradicts, or that leaves nothing, is not relied on.
        let relied_on = |c: &Vec<Option<i64>>| {
            !found.is_empty() && found.len() == c.iter().filter(|n| **n == Some(0)).count()
        };
        if counted.as_ref().is_some_and(|c| !relied_on(c)) {
            found = (0..pieces.len()).filter(|&i| stable(&pieces[i])).collect();
        }
        let mut joined: Vec<(f64, f64)> = Vec::new();
        for Piece { from, to, .. } in found.into_iter().map(|i| pieces[i]) {
            match joined.last_mut() {
                Some(last) if last.1 == from => last.1 = to,
                _ => joined.push((from, to)),
            }
        }
        joined
    }

    /// Unstable poles of each piece, as far as they can be counted; `None` for a measured or a resonant one.
    fn counted(
        &self,
        shaped: &Shaped<'_>,
        plant: usize,
        pieces: &[Piece],
        omega: f64,
    ) -> Option<Vec<Option<i64>>> {
        let Process::Model(model) = self.plants[plant].process else { return None };
        if self.plants[plant].resonant {
            return None;
        }
        let exactly = |kp: f64| {
            let gains = self.gains(shaped.lead, kp, SMALL * kp * omega);
            unstable_loop_poles(&OpenLoop::of_parallel(model, &gains)).map(i64::from)
        };
        let mut count = None;
        let told = |piece: &Piece| {
            let next = count.zip(piece.change).map(|(before, change): (i64, i64)| before + change);
            count = next.or_else(|| exactly(piece.inside));
            count
        };
        Some(pieces.iter().map(told).collect())
    }

    /// The intervals of Kp between all breaks.
    fn pieces(&self, shaped: &Shaped<'_>, plant: usize) -> Vec<Piece> {
        let breaks = self.breaks(shaped, plant);
        let p = &self.plants[plant];
        let scale = 1.0 / p.at_omega(p.typical_omega()).norm();
        let mut pieces: Vec<Piece> = Vec::with_capacity(breaks.len() + 1);
        let (mut from, mut change) = (0.0, None);
        for k in 0..=breaks.len() {
            let to = breaks.get(k).map_or(f64::INFINITY, |b| b.kp);
            let inside = match (from == 0.0, to.is_finite()) {
                (true, true) => 0.5 * to,
                (true, false) => scale,
                (false, true) => f64::sqrt(from * to),
                (false, false) => 2.0 * from,
            };
            let next = breaks.get(k).and_then(|b| b.change);
            if to > from * (1.0 + 1e-9) {
                pieces.push(Piece { from, to, inside, change });
                (from, change) = (to, next);
            } else {
                // Two breaks on one spot count as one.
                change = change.zip(next).map(|(a, b)| a + b);
                from = to;
            }
        }
        pieces
    }

    fn breaks(&self, shaped: &Shaped<'_>, plant: usize) -> Vec<Break> {
        let p = &self.plants[plant];
        let mut breaks = vec![];
        let low = self.sign * p.low.coefficient;
        if p.low.power == 0 && low < 0.0 {
            breaks.push(Break { kp: -1.0 / low, change: None });
        }
        let high = self.sign * p.high * shaped.lead.high();
        if high != 0.0 && (high < 0.0 || p.dead_time_s > 0.0) {
            breaks.push(Break { kp: 1.0 / high.abs(), change: None });
        }
        let own = self.own_points(plant);
        for i in own.start + 1..own.end {
            let [(a_re, a_im), (b_re, b_im)] = [i - 1, i].map(|k| shaped.process(k));
            if (a_im > 0.0) != (b_im > 0.0) {
                let re = (b_re * a_im - a_re * b_im) / (a_im - b_im);
                if re < 0.0 {
                    breaks.push(Break { kp: -1.0 / re, change: Some(if b_im > 0.0 { 2 } else { -2 }) });
                }
            }
        }
        breaks.sort_unstable_by(|a, b| a.kp.total_cmp(&b.kp));
        breaks.truncate(MOST_INTERVALS);
        breaks
    }
}

/// Whether a Kp that is stable with a small Ki stays so with a larger one, for many Ki of one Kp.
#[derive(Debug, Default)]
pub(super) struct OverKi {
    /// Ki at which a pair of poles crosses the axis, with its plant and the change of the count.
    crossings: Vec<(usize, f64, i32)>,
    /// Plants whose points do not tell.
    unknown: Vec<usize>,
    /// Whether some have crossings beyond the points that follow them.
    cut: bool,
    lead: Option<Lead>,
    /// F at every point with this lead.
    f_re: Vec<f64>,
    f_im: Vec<f64>,
    kp: f64,
}

impl OverKi {
    /// To be asked about a Kp from now on.
    pub fn at(&mut self, family: &Family<'_>, lead: Lead, kp: f64) {
        self.crossings.clear();
        self.unknown.clear();
        self.cut = false;
        if self.lead != Some(lead) || self.f_re.len() != family.points.len() {
            let shaped = Shaped::new(&family.points, lead);
            (self.f_re, self.f_im) = (shaped.f_re, shaped.f_im);
        }
        (self.lead, self.kp) = (Some(lead), kp);
        for (i, plant) in family.plants.iter().enumerate() {
            let measured = matches!(plant.process, Process::Measured(_));
            // Ripples that do not fade have crossings between the points.
            if measured || plant.resonant || (plant.high != 0.0 && plant.dead_time_s > 0.0) {
                self.unknown.push(i);
            } else {
                self.push(family, i, kp);
            }
        }
    }

    fn push(&mut self, family: &Family<'_>, plant: usize, kp: f64) {
        let points = &family.points;
        let at_point = |i: usize| {
            let (re, im) =
                (points.inverse_re[i] + kp * self.f_re[i], points.inverse_im[i] + kp * self.f_im[i]);
            (re, points.omega[i] * im)
        };
        let own = family.own_points(plant);
        let mut before = f64::NAN;
        // Beyond the points that follow its turns a dead time has any number of crossings between two of them.
        let resolved = RESOLVED_RAD / family.plants[plant].dead_time_s;
        for i in own.clone() {
            if i > own.start && points.omega[i] - points.omega[i - 1] > resolved {
                self.cut = true;
                break;
            }
            let now = points.inverse_re[i] + kp * self.f_re[i];
            if i > own.start && (before > 0.0) != (now > 0.0) {
                let [(r_before, ki_before), (r, ki)] = [i - 1, i].map(at_point);
                let at = ki_before + (ki - ki_before) * r_before / (r_before - r);
                if at > 0.0 {
                    self.crossings.push((plant, at, if r < 0.0 { 2 } else { -2 }));
                }
            }
            before = now;
        }
    }

    /// Whether every loop is stable with this Ki.
    pub fn is_stable(&self, family: &Family<'_>, ki: f64) -> bool {
        let Some(lead) = self.lead else { return false };
        let count = |plant: usize| -> i32 {
            self.crossings.iter().filter(|c| c.0 == plant && c.1 < ki).map(|c| c.2).sum()
        };
        let counted = |plant: usize| self.unknown.contains(&plant) || count(plant) == 0;
        // Crossings between two points are not counted: where the points turned out too far apart, or a lax limit lets loops
        // come close to −1, what is called stable is tested.
        let test = self.cut || !self.unknown.is_empty() || family.is_refined();
        (0..family.plants.len()).all(counted) && (!test || family.is_stable(lead, self.kp, ki))
    }
}

fn intersection(a: &[(f64, f64)], b: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let pairs = a.iter().flat_map(|x| b.iter().map(move |y| (x.0.max(y.0), x.1.min(y.1))));
    pairs.filter(|(low, high)| low < high).collect()
}
