//! Curves of a loop over frequency, dense where they bend: for Nyquist, Bode, Nichols and the gang of four.

use num_complex::Complex64;

use super::OpenLoop;
use super::grid::features;
use super::stability::gain_crossings;

/// A function of the loop that can be drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LoopFunction {
    /// L = G C.
    OpenLoop,
    /// S = 1/(1 + L), from setpoint to error.
    Sensitivity,
    /// T = L/(1 + L), from setpoint to PV.
    ComplementarySensitivity,
    /// G S, from a load at the process input to PV.
    LoadSensitivity,
    /// C S, from measurement noise to MV, up to the sign.
    ControlSensitivity,
    /// G alone.
    Process,
    /// C alone.
    Controller,
}

impl LoopFunction {
    /// Value at ω > 0 in rad/s.
    #[must_use]
    pub fn at_omega(self, open: &OpenLoop, omega_rad_s: f64) -> Complex64 {
        let l = open.at_omega(omega_rad_s);
        match self {
            Self::OpenLoop => l,
            Self::Sensitivity => 1.0 / (1.0 + l),
            Self::ComplementarySensitivity => l / (1.0 + l),
            Self::LoadSensitivity => open.process_at_omega(omega_rad_s) / (1.0 + l),
            Self::ControlSensitivity => open.controller_at_omega(omega_rad_s) / (1.0 + l),
            Self::Process => open.process_at_omega(omega_rad_s),
            Self::Controller => open.controller_at_omega(omega_rad_s),
        }
    }
}

/// Range and fineness of a curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurveOptions {
    /// First and last frequency in rad/s; `None` takes the loop's own range.
    pub range_rad_s: Option<(f64, f64)>,
    /// Largest distance of the drawn polygon from the curve, where the complex plane is squeezed into the unit disk.
    pub tolerance: f64,
    /// Most points.
    pub most_points: usize,
}

impl Default for CurveOptions {
    /// Half a pixel on a disk drawn a thousand pixels wide.
    fn default() -> Self {
        Self { range_rad_s: None, tolerance: 1e-3, most_points: 4000 }
    }
}

/// Decades shown below the loop's lowest and above its highest feature when no range is given.
const DECADES_AROUND: f64 = 1.0;
/// Points per decade before the curve is refined.
const COARSE_PER_DECADE: f64 = 12.0;
/// Coarsest step over the dead time's ripples, a tenth of their period, as a phase in radians.
const RIPPLE_STEP_RAD: f64 = 0.6;
/// Halvings of one coarse interval at most.
const DEEPEST: u32 = 12;

/// Frequencies in rad/s that show all of the loop: a decade beyond its poles, zeros, unit crossings and dead time.
#[must_use]
pub fn frequency_range(open: &OpenLoop) -> (f64, f64) {
    let found = features(open, &gain_crossings(open));
    let around = 10f64.powf(DECADES_AROUND);
    (found[0] / around, found[found.len() - 1] * around)
}

/// Points (ω in rad/s, value) of a function of the loop, rising in ω, closer where the curve bends.
///
/// Values where the loop is infinite are left out; the polygon through the points stays within
/// [`CurveOptions::tolerance`] of the curve as long as [`CurveOptions::most_points`] allows.
#[must_use]
pub fn frequency_curve(
    open: &OpenLoop,
    function: LoopFunction,
    options: &CurveOptions,
) -> Vec<(f64, Complex64)> {
    let (low, high) = options.range_rad_s.unwrap_or_else(|| frequency_range(open));
    if !(low > 0.0 && high > low && high.is_finite()) {
        return Vec::new();
    }
    let ratio = 10f64.powf(1.0 / COARSE_PER_DECADE);
    // The dead time turns L once every 2π/θ: no coarse interval may hide a turn, unless there are too many to draw.
    let ripple = if open.dead_time_s > 0.0 { RIPPLE_STEP_RAD / open.dead_time_s } else { f64::INFINITY };
    let step = ripple.max(2.0 * (high - low) / options.most_points.max(2) as f64);
    let mut points = Vec::with_capacity(512);
    let mut refiner = Refiner { open, function, options, points: &mut points };
    let mut omega = low;
    let mut value = function.at_omega(open, omega);
    refiner.push(omega, value);
    while omega < high {
        let next = (omega * ratio).min(omega + step).min(high);
        let at_next = function.at_omega(open, next);
        refiner.fill((omega, value), (next, at_next), DEEPEST);
        refiner.push(next, at_next);
        (omega, value) = (next, at_next);
    }
    points
}

struct Refiner<'a> {
    open: &'a OpenLoop,
    function: LoopFunction,
    options: &'a CurveOptions,
    points: &'a mut Vec<(f64, Complex64)>,
}

impl Refiner<'_> {
    fn push(&mut self, omega: f64, value: Complex64) {
        if value.is_finite() && self.points.len() < self.options.most_points {
            self.points.push((omega, value));
        }
    }

    /// Adds points between two known ones until the middle of each piece lies on its chord.
    fn fill(&mut self, a: (f64, Complex64), b: (f64, Complex64), depth: u32) {
        if depth == 0 || self.points.len() >= self.options.most_points {
            return;
        }
        let middle = (a.0 * b.0).sqrt();
        let value = self.function.at_omega(self.open, middle);
        // A second probe off the middle, so that an S-shaped piece does not pass for a straight one.
        let off_chord = |v: Complex64| {
            let (from, to) = (squeezed(a.1), squeezed(b.1));
            let (chord, offset) = (to - from, squeezed(v) - from);
            let length_sqr = chord.norm_sqr();
            let along = if length_sqr > 0.0 {
                ((offset * chord.conj()).re / length_sqr).clamp(0.0, 1.0)
            } else {
                0.0
            };
            (offset - chord * along).norm()
        };
        let third = (a.0 * middle).sqrt();
        let bends = off_chord(value).max(off_chord(self.function.at_omega(self.open, third)));
        if bends.is_nan() || bends > self.options.tolerance {
            self.fill(a, (middle, value), depth - 1);
            self.push(middle, value);
            self.fill((middle, value), b, depth - 1);
        }
    }
}

/// z/(1 + |z|): the plane drawn on the unit disk, so that a branch running to infinity has an end.
fn squeezed(z: Complex64) -> Complex64 {
    z / (1.0 + z.norm())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::PidGains;
    use crate::model::{Fopdt, ProcessModel};

    #[test]
    fn the_polygon_stays_near_the_curve() {
        let model = ProcessModel::Fopdt(Fopdt::new(4.9, 152.0, 2.0).expect("a model"));
        let open = OpenLoop::new(&model, &PidGains::pid(7.0, 15.0, 1.0));
        let options = CurveOptions::default();
        for function in [LoopFunction::OpenLoop, LoopFunction::Sensitivity, LoopFunction::ControlSensitivity]
        {
            let curve = frequency_curve(&open, function, &options);
            assert!(curve.len() > 40 && curve.len() < 1500, "{function:?}: {} points", curve.len());
            assert!(curve.windows(2).all(|p| p[0].0 < p[1].0));
            for pair in curve.windows(2) {
                for share in [0.2, 0.4, 0.6, 0.8] {
                    let omega = pair[0].0 * (pair[1].0 / pair[0].0).powf(share);
                    let (from, to) = (squeezed(pair[0].1), squeezed(pair[1].1));
                    let offset = squeezed(function.at_omega(&open, omega)) - from;
                    let along = ((offset * (to - from).conj()).re / (to - from).norm_sqr()).clamp(0.0, 1.0);
                    let distance = (offset - (to - from) * along).norm();
                    assert!(distance < 2.0 * options.tolerance, "{function:?} at {omega}: {distance}");
                }
            }
        }
    }
}
