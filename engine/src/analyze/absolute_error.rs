//! The IAE of a loop alone, for searches that ask for it a thousand times.
//!
//! What [`loop_response`](super::loop_response) keeps of every sample is left out, and the steps may be longer. Within 1e-4 of
//! the figure of the response, as the tests hold it. Both integrate the cubics between the samples themselves, and neither
//! waits for an error that only creeps back: with integral action ∫ e dt is known beforehand, and so is what is left of it.

use super::OpenLoop;
use super::closed_loop::{Inputs, Stepper};
use super::metrics::Excitation;
use super::stability::{gain_crossings, is_stable, typical_omega};
use crate::model::realization::Hermite;

/// Phase per step of the fastest pole of the process and of the last unit crossing, in radians; without dead time no step
/// need be shorter than those of a response.
const POLE_STEP_RAD: f64 = 0.3;
const CROSSING_STEP_RAD: f64 = 0.08;
const LEAST_CROSSING_STEP_RAD: f64 = 0.02;
/// Steps in one dead time at least …
const STEPS_PER_DEAD_TIME: f64 = 3.0;
/// … unless the dead time is so short that y moves less than this in it, as a phase in radians.
const UNSEEN_PHASE_RAD: f64 = 0.01;
/// Share of the largest error under which a loop counts as settled, and by how much it must outlast the last that was
/// above: as a response has it.
const SETTLED: f64 = 1e-5;
const OUTLAST: f64 = 1.25;
/// The error creeps when it has kept falling for so many radians of the first unit crossing and so many dead times …
const QUIET_RAD: f64 = 9.0;
const QUIET_DEAD_TIMES: f64 = 2.0;
/// … and along one exponential, whose rate ∫ e dt gives too: the two may differ by so much of the IAE, or by rounding.
const CREEPING: f64 = 3e-5;
const CREEPING_ROUNDING: f64 = 1e-9;
/// Most steps, and those after which a loop without dead time is run again with steps four times as long.
const MOST_STEPS: u32 = 1_000_000;
const STEPS_BEFORE_COARSER: u32 = 20_000;

/// IAE of a unit step of the setpoint with b = 1 and c = 0, in seconds, or of a load at the process input, in PV units
/// times seconds per MV unit; `None` for a loop that is unstable or comes to rest elsewhere than at the setpoint.
pub(crate) fn quick_iae(open: &OpenLoop, excitation: Excitation) -> Option<f64> {
    let crossings = gain_crossings(open);
    if !is_stable(open, &crossings) || open.controller_low().power >= 0 {
        return None;
    }
    let inputs = match excitation {
        Excitation::Load => Inputs { r: 0.0, b: 1.0, c: 0.0, load: 1.0 },
        Excitation::Setpoint => Inputs { r: 1.0, b: 1.0, c: 0.0, load: 0.0 },
    };
    let last_crossing = crossings.last().map_or_else(|| typical_omega(open), |c| c.omega);
    let sums = ErrorSums::new(open, inputs, crossings.first().map_or(last_crossing, |c| c.omega));
    let course = Course { goal: inputs.r, dead_time_s: open.dead_time_s, sums };
    let moduli = || open.poles.iter().map(|p| p.norm());
    let of_poles_s = POLE_STEP_RAD / moduli().fold(0.0, f64::max);
    if open.dead_time_s > 0.0 {
        let moving = moduli().filter(|m| *m > 0.0).fold(f64::INFINITY, f64::min);
        let moving = if moving.is_finite() { moving.max(last_crossing) } else { last_crossing };
        let h = (CROSSING_STEP_RAD / last_crossing)
            .min(of_poles_s)
            .min((open.dead_time_s / STEPS_PER_DEAD_TIME).max(UNSEEN_PHASE_RAD / moving));
        return course.iae(Stepper::new(open, inputs, h), MOST_STEPS);
    }
    let mut h =
        (CROSSING_STEP_RAD / last_crossing).min(of_poles_s.max(LEAST_CROSSING_STEP_RAD / last_crossing));
    while h * last_crossing < f64::from(u16::MAX) {
        let found = course.iae(Stepper::new(open, inputs, h), STEPS_BEFORE_COARSER);
        if found.is_some() {
            return found;
        }
        h *= 4.0;
    }
    None
}

/// ∫ e dt and ∫ |e| dt as they grow, e = r − y.
#[derive(Debug, Clone, Copy)]
pub(super) struct ErrorSums {
    /// ∫ e dt so far, in PV units times seconds.
    pub ie: f64,
    /// ∫ |e| dt so far.
    pub iae: f64,
    /// ∫ e dt to the end of time, where it is known.
    whole: Option<f64>,
    quiet_s: f64,
    /// Since when |e| has been falling without a zero, and a time and an error since then.
    falls_since_s: f64,
    mark: Option<(f64, f64)>,
}

impl ErrorSums {
    /// Of a stable loop under these inputs; the first unit crossing in rad/s.
    pub(super) fn new(open: &OpenLoop, inputs: Inputs, first_crossing: f64) -> Self {
        Self {
            quiet_s: QUIET_RAD / first_crossing + QUIET_DEAD_TIMES * open.dead_time_s,
            whole: whole_error(open, inputs),
            ..Self::plain()
        }
    }

    /// Of a loop of which nothing is known beforehand.
    pub(super) fn plain() -> Self {
        Self { ie: 0.0, iae: 0.0, whole: None, quiet_s: f64::INFINITY, falls_since_s: 0.0, mark: None }
    }

    /// Takes in the error over a step of h that starts at t.
    pub(super) fn add(&mut self, error: Hermite, t: f64, h: f64) {
        let (whole, absolute) = integrals(error, h);
        (self.ie, self.iae) = (self.ie + whole, self.iae + absolute);
        if error.start * error.end <= 0.0 || error.end.abs() >= error.start.abs() {
            (self.falls_since_s, self.mark) = (t + h, None);
        }
    }

    /// Adds all that comes after now, where the error is down to rounding or what is left of it keeps its sign: a slow mode
    /// too small to be seen may hold as much of the IAE as all before it.
    pub(super) fn close(&mut self) {
        if let Some(whole) = self.whole {
            self.iae += (whole - self.ie).abs();
            self.ie = whole;
        }
    }

    /// Whether the error only creeps back from what it is at t: along one exponential, without another zero.
    pub(super) fn creeps(&mut self, error: f64, t: f64) -> bool {
        let Some(whole) = self.whole else { return false };
        let falling_s = t - self.falls_since_s;
        let Some((mark_s, mark)) = self.mark else {
            if falling_s >= 0.5 * self.quiet_s {
                self.mark = Some((t, error));
            }
            return false;
        };
        let since_s = t - mark_s;
        if since_s < 0.5 * self.quiet_s {
            return false;
        }
        self.mark = Some((t, error));
        let rest = whole - self.ie;
        if rest * error <= 0.0 {
            return false;
        }
        let (seen, expected) = ((mark / error).ln(), error / rest * since_s);
        let allowed = CREEPING * self.iae / rest.abs() * expected;
        (seen - expected).abs() <= allowed + CREEPING_ROUNDING
    }
}

/// ∫ e dt to the end of time of a stable loop with integral action: u = Kp (b r − y) + Ki ∫ e has to come to rest where
/// G(0) u = r − G(0) · load; `None` without.
fn whole_error(open: &OpenLoop, inputs: Inputs) -> Option<f64> {
    let (controller, process) = (open.controller_low(), open.process_low());
    if controller.power >= 0 || process.power > 0 {
        return None;
    }
    let Inputs { r, b, load, .. } = inputs;
    let holding = if process.power == 0 { r / process.coefficient } else { 0.0 };
    Some((holding - load - open.gains().kp * (b - 1.0) * r) / controller.coefficient)
}

/// A run for the IAE alone.
struct Course {
    goal: f64,
    dead_time_s: f64,
    sums: ErrorSums,
}

impl Course {
    /// `None` where the error does not settle in so many steps.
    fn iae(&self, mut stepper: Stepper, most_steps: u32) -> Option<f64> {
        let h = stepper.h();
        let shortest_s = 3.0 * self.dead_time_s + 50.0 * h;
        let mut sums = self.sums;
        let (mut largest, mut last_outside_s) = (0.0f64, 0.0);
        for k in 0..most_steps {
            let t = f64::from(k) * h;
            let error = error_of(stepper.step().0, self.goal);
            let now = error.start.abs();
            if !now.is_finite() {
                return None;
            }
            largest = largest.max(now);
            if now > SETTLED * largest {
                last_outside_s = t;
            }
            let settled = t >= OUTLAST * last_outside_s + 4.0 * self.dead_time_s;
            if t >= shortest_s && (settled || sums.creeps(error.start, t)) {
                sums.close();
                return Some(sums.iae);
            }
            sums.add(error, t, h);
        }
        None
    }
}

/// r − y over a step.
pub(super) fn error_of(y: Hermite, r: f64) -> Hermite {
    Hermite { start: r - y.start, end: r - y.end, start_slope: -y.start_slope, end_slope: -y.end_slope }
}

/// ∫ e and ∫ |e| over a step, the latter cut at its zero where the ends differ in sign.
fn integrals(error: Hermite, h: f64) -> (f64, f64) {
    let whole = error.integral(h);
    if error.start * error.end >= 0.0 {
        return (whole, whole.abs());
    }
    // The secant's zero, made exact by a step of Newton's method on the cubic.
    let mut share = error.start / (error.start - error.end);
    let (value, slope) = error.at(share, h);
    if slope * (error.end - error.start) > 0.0 {
        share = (share - value / (slope * h)).clamp(0.0, 1.0);
    }
    let (end, end_slope) = error.at(share, h);
    let before = Hermite { end, end_slope, ..error }.integral(share * h);
    (whole, before.abs() + (whole - before).abs())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analyze::{ResponseOptions, loop_response};
    use crate::control::PidGains;
    use crate::model::ProcessModel;

    #[test]
    fn it_is_the_figure_of_the_response() {
        let loops = [
            (ProcessModel::rational(&[4.9], &[152.0, 1.0], 2.0), PidGains::pid(7.0, 15.0, 1.0)),
            (ProcessModel::rational(&[4.9], &[152.0, 1.0], 2.0), PidGains::pi(1.9, 152.0)),
            (ProcessModel::rational(&[1.0], &[1.0, 1.0], 1.0), PidGains::pid(0.9, 1.2, 0.3)),
            (ProcessModel::rational(&[1.0], &[1.0, 3.0, 3.0, 1.0], 0.0), PidGains::pid(3.0, 2.0, 0.6)),
            (ProcessModel::rational(&[1.0], &[1.0, 3.0, 3.0, 1.0], 15.0), PidGains::pi(0.2, 5.0)),
            (ProcessModel::rational(&[-2.0, 1.0], &[1.0, 3.0, 3.0, 1.0], 0.0), PidGains::pid(0.3, 2.2, 0.8)),
            (ProcessModel::rational(&[9.0], &[1.0, 3.0, 11.0, 9.0], 0.0), PidGains::pid(1.0, 0.5, 0.4)),
            (ProcessModel::rational(&[0.05], &[1.0, 0.0], 2.0), PidGains::pid(4.0, 14.0, 1.0)),
            (
                ProcessModel::rational(&[1.0], &[1.0, 8.0, 28.0, 56.0, 70.0, 56.0, 28.0, 8.0, 1.0], 0.0),
                PidGains::pid(0.8, 4.5, 1.8),
            ),
        ];
        for (model, gains) in loops {
            let open = OpenLoop::new(&model.expect("a model"), &gains);
            for excitation in [Excitation::Setpoint, Excitation::Load] {
                let exact = loop_response(&open, excitation, &ResponseOptions::default());
                let exact = exact.metrics().expect("figures").iae;
                let quick = quick_iae(&open, excitation).expect("stable");
                let off = quick / exact - 1.0;
                assert!(off.abs() < 1e-4, "{gains:?} {excitation:?}: {quick} {exact} {off:e}");
            }
        }
    }
}
