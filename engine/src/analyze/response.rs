//! Time responses of the linear closed loop to a unit step of the setpoint or of a load at the process input.

use super::absolute_error::{ErrorSums, error_of};
use super::closed_loop::{Inputs, Stepper};
use super::metrics::{Excitation, Metrics, MetricsError, metrics_about};
use super::stability::{gain_crossings, is_stable, typical_omega};
use super::{Analysis, OpenLoop};
use crate::control::PidGains;
use crate::model::ProcessModel;

/// How a response is asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ResponseOptions {
    /// b, weight of the setpoint in the proportional part.
    pub setpoint_weight_b: f64,
    /// c, weight of the setpoint in the derivative part.
    pub setpoint_weight_c: f64,
    /// Length in seconds; `None` runs until the response has settled.
    pub horizon_s: Option<f64>,
    /// Share of the largest deviation under which a response counts as settled when no horizon is given.
    pub settled: f64,
    /// Most samples kept; longer runs keep every second, fourth, … one.
    pub most_points: usize,
}

impl Default for ResponseOptions {
    fn default() -> Self {
        Self {
            setpoint_weight_b: 1.0,
            setpoint_weight_c: 0.0,
            horizon_s: None,
            settled: 1e-5,
            most_points: 20_000,
        }
    }
}

/// Why a response ends where it does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ResponseEnd {
    /// It stays within the settled band for a fifth of its length.
    Settled,
    /// At the horizon asked for, or the longest that is computed.
    Horizon,
    /// The loop is unstable and left every bound.
    Diverged,
}

/// A sampled response: equal steps from t = 0, values just after any jump.
#[derive(Debug, Clone, PartialEq)]
pub struct Response {
    /// What stepped.
    pub excitation: Excitation,
    /// Times in seconds.
    pub time_s: Vec<f64>,
    /// Setpoint in PV units: 1 for a setpoint step, 0 for a load step.
    pub r: Vec<f64>,
    /// PV.
    pub y: Vec<f64>,
    /// MV; for a load step the controller's part alone.
    pub u: Vec<f64>,
    /// Where y comes to rest; `None` for an unstable loop.
    pub final_value: Option<f64>,
    /// ∫ (r − y) dt in PV units times seconds, of every step that was computed; of a response that was let settle with
    /// integral action to the end of time.
    pub ie: f64,
    /// ∫ |r − y| dt likewise.
    pub iae: f64,
    /// Why it ends.
    pub end: ResponseEnd,
}

impl Response {
    /// Performance figures of this response, overshoot and settling about the value where it truly comes to rest; IE and IAE
    /// are [`Self::ie`] and [`Self::iae`], which neither a jump between two samples nor a slow end spoils.
    ///
    /// # Errors
    /// [`MetricsError`] for a response cut off before its second sample.
    pub fn metrics(&self) -> Result<Metrics, MetricsError> {
        let sampled =
            metrics_about(&self.time_s, &self.r, &self.y, &self.u, self.excitation, self.final_value)?;
        Ok(Metrics { ie: self.ie, iae: self.iae, ..sampled })
    }
}

/// Phase per step of the fastest pole and of the last unit crossing, in radians.
///
/// Fourth-order steps keep the error of the figures under 1e-5 with these; the tests compare with closed forms.
const POLE_STEP_RAD: f64 = 0.5;
const CROSSING_STEP_RAD: f64 = 0.02;
/// Steps in one dead time, so that the trapezoids of the figures follow the rise of y …
const STEPS_PER_DEAD_TIME: f64 = 10.0;
/// … unless the dead time is so short that y moves less than this in it, as a phase in radians.
const UNSEEN_PHASE_RAD: f64 = 0.002;
/// Steps of a loop without dead time after which it is run again with steps four times as long.
const STEPS_BEFORE_COARSER: usize = 50_000;
/// Most steps of a loop with dead time.
const MOST_STEPS: usize = 5_000_000;
/// Share by which a response must outlast the last sample outside the settled band.
const OUTLAST: f64 = 1.25;
/// Deviation, in units of the larger of the step and |G(0)|, at which an unstable response is cut off.
const DIVERGED: f64 = 1e3;
/// Length of an unstable response without horizon, in units of the slower of 1/ω_gc and the dead time.
const UNSTABLE_LENGTH: f64 = 100.0;

/// Unit step of the setpoint, or of a load at the process input, on the loop of a model and a controller.
///
/// The derivative is filtered by Td/N as everywhere; it acts on c·r − y. Dead time is exact.
#[must_use]
pub fn step_response(
    model: &ProcessModel,
    gains: &PidGains,
    excitation: Excitation,
    options: &ResponseOptions,
) -> Response {
    loop_response(&OpenLoop::new(model, gains), excitation, options)
}

/// [`step_response`] of a loop that is already built.
#[must_use]
pub fn loop_response(open: &OpenLoop, excitation: Excitation, options: &ResponseOptions) -> Response {
    let crossings = gain_crossings(open);
    let stable = is_stable(open, &crossings);
    let inputs = match excitation {
        Excitation::Setpoint => {
            Inputs { r: 1.0, b: options.setpoint_weight_b, c: options.setpoint_weight_c, load: 0.0 }
        }
        Excitation::Load => Inputs { r: 0.0, b: 1.0, c: 0.0, load: 1.0 },
    };
    let goal = final_value(open, inputs);
    let last_crossing = crossings.last().map_or_else(|| typical_omega(open), |c| c.omega);
    let unstable_length = UNSTABLE_LENGTH
        * (crossings.first().map_or(1.0 / last_crossing, |c| 1.0 / c.omega)).max(open.dead_time_s);
    let open_ended = stable && options.horizon_s.is_none();
    let run = Run {
        inputs,
        sums: if open_ended {
            ErrorSums::new(open, inputs, crossings.first().map_or(last_crossing, |c| c.omega))
        } else {
            ErrorSums::plain()
        },
        goal,
        horizon_s: options.horizon_s.or((!stable).then_some(unstable_length)),
        bound: (!stable).then_some(DIVERGED * open.process_low().coefficient.abs().max(1.0)),
        settled: options.settled,
        most_points: options.most_points.max(2),
        excitation,
    };
    if open.dead_time_s > 0.0 {
        let fastest_pole = open.poles.iter().map(|p| p.norm()).fold(0.0, f64::max);
        let moving = open.poles.iter().map(|p| p.norm()).filter(|m| *m > 0.0).fold(f64::INFINITY, f64::min);
        let moving = if moving.is_finite() { moving.max(last_crossing) } else { last_crossing };
        let h = (CROSSING_STEP_RAD / last_crossing)
            .min(POLE_STEP_RAD / fastest_pole)
            .min((open.dead_time_s / STEPS_PER_DEAD_TIME).max(UNSEEN_PHASE_RAD / moving));
        return run.through(Stepper::new(open, inputs, h), MOST_STEPS).0;
    }
    let mut h = CROSSING_STEP_RAD / last_crossing;
    let mut finest: Option<(f64, f64)> = None;
    loop {
        let (mut response, closed) = run.through(Stepper::new(open, inputs, h), STEPS_BEFORE_COARSER);
        // A slow end needs long steps to be seen, what comes before it short ones.
        finest = finest.or(closed.then_some((response.ie, response.iae)));
        if let Some((ie, iae)) = finest {
            (response.ie, response.iae) = (ie, iae);
        }
        let complete = response.end != ResponseEnd::Horizon
            || run.horizon_s.is_some_and(|t| h * STEPS_BEFORE_COARSER as f64 >= t);
        if complete || h * last_crossing > f64::from(u16::MAX) {
            return response;
        }
        h *= 4.0;
    }
}

/// Where y of a stable loop comes to rest.
fn final_value(open: &OpenLoop, inputs: Inputs) -> f64 {
    let (g, c) = (open.process_low(), open.controller_low());
    let integrates = c.power < 0;
    match (integrates, g.power.signum()) {
        (true, _) => inputs.r,
        (false, 0) => {
            let l0 = g.coefficient * c.coefficient;
            (l0 * inputs.b * inputs.r + g.coefficient * inputs.load) / (1.0 + l0)
        }
        (false, -1) => inputs.b * inputs.r + inputs.load / c.coefficient,
        (false, _) => 0.0,
    }
}

struct Run {
    inputs: Inputs,
    sums: ErrorSums,
    goal: f64,
    horizon_s: Option<f64>,
    bound: Option<f64>,
    settled: f64,
    most_points: usize,
    excitation: Excitation,
}

impl Run {
    /// The response, and whether its integrals reach to the end of time.
    fn through(&self, mut stepper: Stepper, most_steps: usize) -> (Response, bool) {
        let h = stepper.h();
        let dead_time = if let Stepper::Delayed(loop_) = &stepper { loop_.dead_time_s() } else { 0.0 };
        let shortest = 3.0 * dead_time + 50.0 * h;
        let (mut time_s, mut y, mut u) = (Vec::new(), Vec::new(), Vec::new());
        let (mut stride, mut largest, mut last_outside) = (1usize, 0.0f64, 0.0f64);
        let mut end = ResponseEnd::Horizon;
        let (mut sums, mut closed) = (self.sums, false);
        for k in 0..most_steps {
            let t = k as f64 * h;
            let (arc, u_now) = stepper.step();
            let y_now = arc.start;
            if k % stride == 0 {
                if time_s.len() == self.most_points {
                    for column in [&mut time_s, &mut y, &mut u] {
                        keep_every_second(column);
                    }
                    stride *= 2;
                }
                if k % stride == 0 {
                    time_s.push(t);
                    y.push(y_now);
                    u.push(u_now);
                }
            }
            let deviation = (y_now - self.goal).abs();
            largest = largest.max(deviation);
            if deviation > self.settled * largest {
                last_outside = t;
            }
            if self.bound.is_some_and(|b| y_now.abs() > b) || !y_now.is_finite() {
                end = ResponseEnd::Diverged;
                break;
            }
            match self.horizon_s {
                Some(horizon) if t >= horizon => break,
                None if t >= shortest && t >= OUTLAST * last_outside + 4.0 * dead_time => {
                    end = ResponseEnd::Settled;
                    break;
                }
                _ => {}
            }
            let error = error_of(arc, self.inputs.r);
            if !closed && t >= shortest && sums.creeps(error.start, t) {
                sums.close();
                closed = true;
            }
            if !closed {
                sums.add(error, t, h);
            }
        }
        if !closed && end == ResponseEnd::Settled {
            sums.close();
            closed = true;
        }
        let r = vec![self.inputs.r; time_s.len()];
        let response = Response {
            excitation: self.excitation,
            time_s,
            r,
            y,
            u,
            final_value: self.bound.is_none().then_some(self.goal),
            ie: sums.ie,
            iae: sums.iae,
            end,
        };
        (response, closed)
    }
}

fn keep_every_second(column: &mut Vec<f64>) {
    let mut index = 0;
    column.retain(|_| {
        index += 1;
        index % 2 == 1
    });
}

/// The figures of the time responses that stand beside an [`Analysis`] in tables and in JSON.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct StepFigures {
    /// IAE of a unit load step at the process input, in PV units times seconds per MV unit.
    pub iae_load: Option<f64>,
    /// IAE of a unit setpoint step with b = 1 and c = 0, in seconds.
    pub iae_setpoint: Option<f64>,
    /// Overshoot of that setpoint step in percent.
    pub overshoot_percent: Option<f64>,
}

/// [`StepFigures`] of a loop; all `None` when `analysis` calls it unstable, an IAE also where it is infinite.
#[must_use]
pub fn step_figures(model: &ProcessModel, gains: &PidGains, analysis: &Analysis) -> StepFigures {
    loop_figures(&OpenLoop::new(model, gains), analysis)
}

/// [`step_figures`] of a loop that is already built.
#[must_use]
pub fn loop_figures(open: &OpenLoop, analysis: &Analysis) -> StepFigures {
    if !analysis.stable {
        return StepFigures::default();
    }
    let options = ResponseOptions::default();
    let figures = |excitation| {
        let response = loop_response(open, excitation, &options);
        let settled = response.end == ResponseEnd::Settled;
        response.metrics().ok().filter(|_| settled)
    };
    let returns = |m: &Metrics| m.steady_error.abs() <= 100.0 * options.settled * m.peak_error;
    let (load, setpoint) = (figures(Excitation::Load), figures(Excitation::Setpoint));
    StepFigures {
        iae_load: load.filter(returns).map(|m| m.iae),
        iae_setpoint: setpoint.filter(returns).map(|m| m.iae),
        overshoot_percent: setpoint.and_then(|m| m.overshoot_percent),
    }
}
