//! Right-hand side of the levels and of their sensitivities to the unknowns.
//!
//! ```text
//! A_i dh_i/dt = Σ feeds + Σ streams in − Σ streams out (+ what full vessels hand on),   dh_i/dt = 0 for a full one
//! d/dt ∂h/∂p  = ∂f/∂h · ∂h/∂p + ∂f/∂p,   by the chain rule term by term: exact, no differences
//! ```
//!
//! A state is one array: the n levels in cm, then for every vessel its derivatives by the P unknowns. With P = 0 the
//! levels alone are worked out.

use super::structure::{PumpCurve, Quantity, Structure};
use crate::plant::spec::ValveLaw;

/// Unknowns that the flow of a pump depends on: scale, offset and two points of the curve.
const FLOW_SLOTS: usize = 4;

/// Flow of a pump with its slopes by the unknowns.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Flow {
    pub cm3_s: f64,
    slopes: [(usize, f64); FLOW_SLOTS],
    count: usize,
}

impl Flow {
    fn push(&mut self, quantity: &Quantity, slope: f64) {
        if let Some(slot) = quantity.slot {
            self.slopes[self.count] = (slot, slope * quantity.factor);
            self.count += 1;
        }
    }
}

impl Flow {
    /// A flow that is an unknown itself.
    pub fn unknown(unknowns: &[f64], slot: usize) -> Self {
        let mut flow = Self { cm3_s: unknowns[slot], ..Self::default() };
        flow.push(&Quantity { value: 0.0, factor: 1.0, slot: Some(slot) }, 1.0);
        flow
    }
}

impl PumpCurve {
    /// `max(0, scale · curve(u) + offset)` with its slopes.
    pub fn flow(&self, unknowns: &[f64], input: f64) -> Flow {
        let last = self.points.len() - 1;
        let after = self.points.partition_point(|p| p.0 <= input);
        let (low, high) = (after.saturating_sub(1).min(last), after.min(last));
        let share = if low == high {
            0.0
        } else {
            (input - self.points[low].0) / (self.points[high].0 - self.points[low].0)
        };
        let (below, above) = (&self.points[low].1, &self.points[high].1);
        let on_curve = below.at(unknowns) * (1.0 - share) + above.at(unknowns) * share;
        let scale = self.scale.at(unknowns);
        let cm3_s = scale * on_curve + self.offset.at(unknowns);
        let mut flow = Flow::default();
        if cm3_s > 0.0 {
            flow.cm3_s = cm3_s;
            flow.push(&self.scale, on_curve);
            flow.push(&self.offset, 1.0);
            flow.push(below, scale * (1.0 - share));
            if high != low {
                flow.push(above, scale * share);
            }
        }
        flow
    }
}

/// The numbers of a structure at one set of unknowns.
#[derive(Debug, Clone)]
pub(super) struct Numbers {
    pub k: Vec<f64>,
    pub area: Vec<f64>,
    pub height: Vec<f64>,
    share: Vec<f64>,
    /// 1/A of both ends of every stream's head.
    steepness: Vec<f64>,
}

impl Numbers {
    pub fn new(structure: &Structure, unknowns: &[f64]) -> Self {
        let vessels = &structure.vessels;
        let area: Vec<f64> = vessels.iter().map(|v| v.area.at(unknowns)).collect();
        let steepness =
            structure.streams.iter().map(|s| 1.0 / area[s.from] + s.against.map_or(0.0, |a| 1.0 / area[a]));
        Self {
            k: structure.streams.iter().map(|s| s.k.at(unknowns)).collect(),
            height: vessels.iter().map(|v| v.height.at(unknowns)).collect(),
            share: vessels.iter().map(|v| v.spills_to.map_or(0.0, |(_, s)| s.at(unknowns))).collect(),
            steepness: steepness.collect(),
            area,
        }
    }
}

/// What stands for the time of a step: feeds as they arrive, vessels that are full.
#[derive(Debug, Clone)]
pub(super) struct Mode {
    pub feeds: Vec<Flow>,
    pub full: Vec<bool>,
}

/// Buffers of the right-hand side.
#[derive(Debug, Clone)]
pub(super) struct Scratch {
    row: Vec<f64>,
    /// What full vessels hand on, in cm³/s.
    pub excess: Vec<f64>,
}

impl Scratch {
    pub fn new(structure: &Structure) -> Self {
        Self { row: vec![0.0; structure.unknowns()], excess: vec![0.0; structure.vessels.len()] }
    }
}

/// Flow per k of a head in cm, and its slope: 0 below 0 for a free fall.
#[inline(always)]
fn law(law: ValveLaw, head: f64, falls: bool, delta2: f64) -> (f64, f64) {
    if falls && head < 0.0 {
        return (0.0, 0.0);
    }
    match law {
        ValveLaw::Laminar => (head, 1.0),
        ValveLaw::SquareRoot => {
            let square = head * head + delta2;
            let root = square.sqrt().sqrt();
            (head / root, (0.5 * head * head + delta2) / (square * root))
        }
    }
}

/// Adds `factor` times a row to the row of a vessel.
#[inline(always)]
fn add(out: &mut [f64], at: usize, row: &[f64], factor: f64) {
    for (o, r) in out[at..at + row.len()].iter_mut().zip(row) {
        *o += factor * r;
    }
}

/// Slopes of a state: levels in cm/s, derivatives by `width` unknowns.
#[inline]
pub(super) fn slopes(
    structure: &Structure,
    numbers: &Numbers,
    mode: &Mode,
    scratch: &mut Scratch,
    width: usize,
    z: &[f64],
    out: &mut [f64],
) {
    let n = structure.vessels.len();
    let row_at = |vessel: usize| n + vessel * width;
    out.fill(0.0);
    for (stream, &k) in structure.streams.iter().zip(&numbers.k) {
        let head = z[stream.from] - stream.against.map_or(0.0, |a| z[a]);
        let (per_k, slope_per_k) = law(stream.law, head, stream.against.is_none(), structure.delta2);
        let (flow, slope) = (k * per_k, k * slope_per_k);
        out[stream.from] -= flow;
        if let Some(to) = stream.to {
            out[to] += flow;
        }
        if width == 0 {
            continue;
        }
        let row = &mut scratch.row[..width];
        let from = row_at(stream.from);
        for (r, s) in row.iter_mut().zip(&z[from..from + width]) {
            *r = slope * s;
        }
        if let Some(against) = stream.against {
            let against = row_at(against);
            for (r, s) in row.iter_mut().zip(&z[against..against + width]) {
                *r -= slope * s;
            }
        }
        if let Some(slot) = stream.k.slot {
            row[slot] += stream.k.factor * per_k;
        }
        add(out, from, row, -1.0);
        if let Some(to) = stream.to {
            add(out, row_at(to), row, 1.0);
        }
    }
    for (feed, flow) in structure.feeds.iter().zip(&mode.feeds) {
        for &(to, share) in &feed.outlets {
            out[to] += share * flow.cm3_s;
            if width > 0 {
                for &(slot, slope) in &flow.slopes[..flow.count] {
                    out[row_at(to) + slot] += share * slope;
                }
            }
        }
    }
    hand_on(structure, numbers, mode, scratch, width, out);
    for (i, vessel) in structure.vessels.iter().enumerate() {
        let per_area = 1.0 / numbers.area[i];
        out[i] *= per_area;
        let at = row_at(i);
        out[at..at + width].iter_mut().for_each(|s| *s *= per_area);
        if let (Some(slot), true) = (vessel.area.slot, width > 0) {
            out[at + slot] -= out[i] * vessel.area.factor * per_area;
        }
    }
}

/// Lets full vessels hand on what comes to them, down the spills.
#[inline(always)]
fn hand_on(
    structure: &Structure,
    numbers: &Numbers,
    mode: &Mode,
    scratch: &mut Scratch,
    width: usize,
    out: &mut [f64],
) {
    let n = structure.vessels.len();
    scratch.excess.fill(0.0);
    if !mode.full.iter().any(|f| *f) {
        return;
    }
    // A chain of spills is at most as long as there are vessels.
    for _ in 0..n {
        let mut handed = false;
        for i in 0..n {
            if !mode.full[i] || out[i] == 0.0 {
                continue;
            }
            handed = true;
            let excess = std::mem::take(&mut out[i]);
            scratch.excess[i] += excess;
            let at = n + i * width;
            scratch.row[..width].copy_from_slice(&out[at..at + width]);
            out[at..at + width].fill(0.0);
            if let Some((to, share)) = structure.vessels[i].spills_to {
                out[to] += numbers.share[i] * excess;
                add(out, n + to * width, &scratch.row[..width], numbers.share[i]);
                if let (Some(slot), true) = (share.slot, width > 0) {
                    out[n + to * width + slot] += share.factor * excess;
                }
            }
        }
        if !handed {
            return;
        }
    }
}

/// Largest λ·h of a step: the sensitivity of a fast stream moves while its level rests.
const RATE: f64 = 0.2;
/// Largest change of a head within a step, as a share of √(δ² + head²).
const CURVATURE: f64 = 0.15;
/// Largest (λ·h)⁴ times the change of a head within a step, in cm.
const ERROR_CM: f64 = 1e-5;

/// Longest step in seconds that resolves every stream at a state with these slopes of its levels.
#[inline]
pub(super) fn longest_step_s(structure: &Structure, numbers: &Numbers, z: &[f64], f: &[f64]) -> f64 {
    let mut longest = f64::INFINITY;
    for ((stream, &k), steep) in structure.streams.iter().zip(&numbers.k).zip(&numbers.steepness) {
        let (mut head, mut speed) = (z[stream.from], f[stream.from]);
        if let Some(against) = stream.against {
            head -= z[against];
            speed -= f[against];
        }
        let r = (head * head + structure.delta2).sqrt();
        let rate = match stream.law {
            ValveLaw::SquareRoot => k * steep / r.sqrt(),
            ValveLaw::Laminar => k * steep,
        };
        let speed = speed.abs();
        longest = longest.min(RATE / rate);
        if speed * longest > CURVATURE * r && stream.law == ValveLaw::SquareRoot {
            longest = CURVATURE * r / speed;
        }
        let rate2 = rate * rate * longest * longest;
        if rate2 * rate2 * speed * longest > ERROR_CM {
            longest = (ERROR_CM / (rate * rate * rate * rate * speed)).powf(0.2);
        }
    }
    longest
}
