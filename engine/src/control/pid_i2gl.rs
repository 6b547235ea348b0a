//! PID-I2GL: the incremental PID with two degrees of freedom of the STAD paper (Figure 6, eqs. 8–10).
//!
//! ```text
//! ΔP  = K[(b·r_k − y_k) − (b·r_{k−1} − y_{k−1})]          formed from the signals with the present K, b
//! D_k = a_d D_{k−1} + b_d[(c·r_k − y_k) − (c·r_{k−1} − y_{k−1})],   ΔD = D_k − D_{k−1}
//! ΔI  = K·h/(2Ti)·(e_k + e_{k−1})
//! u_k = sat(u_{k−1} + ΔP + ΔD + ΔI)                       the limiter is the anti-windup
//! a_d = (2Td − N·h)/(2Td + N·h),  b_d = 2·K·N·Td/(2Td + N·h);  backward difference where 2Td < N·h
//! ```
//!
//! P is never stored, so a change of K or b at any error brings no jump. Input that is not finite holds
//! the last output and is reported.
//!
//! With [`Clip::Integral`] the sum of the increments is kept beyond the limit and only ΔI is cut:
//!
//! ```text
//! w = v_{k−1} + ΔP + ΔD,   v_k = max(w, high) where ΔI > 0 leads over the limit (min(w, low) likewise), else w + ΔI
//! u_k = sat(v_k)
//! ```

use super::controller::{ControlInput, ControlOutput, Controller, Limits, Mode, Parts};
use super::derivative::{Sampled, Signals};
use super::law::Clip;
use super::tuning::PidTuning;

/// The controller's state.
#[derive(Debug, Clone, PartialEq)]
pub struct PidI2gl {
    tuning: PidTuning,
    sampled: Sampled,
    pub(super) clip: Clip,
    sample_time_s: f64,
    limits: Limits,
    mv: f64,
    /// Sum of the increments where only the integral is clipped.
    sum: f64,
    pub(super) derivative: f64,
    pub(super) last: Option<Signals>,
    last_feedforward: Option<f64>,
}

impl PidI2gl {
    /// A controller at rest at the output `mv`, limited to `low…high`, sampled every `sample_time_s`.
    #[must_use]
    pub fn new(tuning: PidTuning, sample_time_s: f64, low: f64, high: f64, mv: f64) -> Self {
        let limits = Limits { low, high };
        Self { limits, ..Self::at(tuning, sample_time_s, limits.clamp(mv)) }
    }

    /// A controller at rest at the output `mv` whose limits come with each sample.
    pub(super) fn at(tuning: PidTuning, sample_time_s: f64, mv: f64) -> Self {
        let limits = Limits { low: f64::NEG_INFINITY, high: f64::INFINITY };
        Self {
            tuning,
            sampled: Sampled::of(&tuning.gains, sample_time_s),
            clip: Clip::Output,
            sample_time_s,
            limits,
            mv,
            sum: mv,
            derivative: 0.0,
            last: None,
            last_feedforward: None,
        }
    }

    /// With the choice of what a limit clips.
    #[must_use]
    pub fn clipping(mut self, clip: Clip) -> Self {
        self.set_clip(clip);
        self
    }

    /// Changes what a limit clips; the output goes on from where it is.
    pub fn set_clip(&mut self, clip: Clip) {
        if clip != self.clip {
            (self.clip, self.sum) = (clip, self.mv);
        }
    }

    /// The tuning in use.
    #[must_use]
    pub fn tuning(&self) -> PidTuning {
        self.tuning
    }

    /// The present output in MV units.
    #[must_use]
    pub fn mv(&self) -> f64 {
        self.mv
    }

    /// Takes a new tuning, without a jump of the output. A change of Td or N restarts the derivative from 0.
    pub fn set_tuning(&mut self, tuning: PidTuning) {
        let (old, new) = (self.tuning.gains, tuning.gains);
        if old.td_s != new.td_s || old.n != new.n {
            self.derivative = 0.0;
        }
        if old != new {
            self.sampled = Sampled::of(&new, self.sample_time_s);
        }
        self.tuning = tuning;
    }

    /// Puts the output to a value, for manual operation.
    pub fn set_mv(&mut self, mv: f64) {
        if mv.is_finite() {
            self.mv = self.limits.clamp(mv);
            self.sum = self.mv;
        }
    }

    /// a_d and b_d of the derivative filter for the present tuning.
    #[must_use]
    pub fn derivative_coefficients(&self) -> (f64, f64) {
        (self.sampled.a_d, self.sampled.b_d)
    }

    /// One sample: setpoint and PV in PV units. In manual only r, y and D are kept up to date.
    pub fn update(&mut self, setpoint: f64, pv: f64, mode: Mode) -> ControlOutput {
        let (limits, controlling) = (self.limits, mode.is_controlling());
        self.step(&ControlInput { setpoint, pv, feedforward: 0.0, limits, controlling })
    }

    /// Adds the increments to the output; gives what they led to before the limiter.
    fn add(&mut self, increments: &Parts, limits: Limits) -> f64 {
        let others = increments.p + increments.d + increments.feedforward;
        let sum = match self.clip {
            Clip::Output => self.mv + (others + increments.i),
            Clip::Integral => {
                let without = self.sum + others;
                let whole = without + increments.i;
                self.sum = if increments.i > 0.0 && whole > limits.high {
                    without.max(limits.high)
                } else if increments.i < 0.0 && whole < limits.low {
                    without.min(limits.low)
                } else {
                    whole
                };
                whole
            }
        };
        self.mv = limits.clamp(if self.clip == Clip::Output { sum } else { self.sum });
        sum
    }
}

impl Controller for PidI2gl {
    #[inline(always)]
    fn step(&mut self, input: &ControlInput) -> ControlOutput {
        let now = Signals { setpoint: input.setpoint, pv: input.pv };
        if !now.setpoint.is_finite() || !now.pv.is_finite() || !input.feedforward.is_finite() {
            return ControlOutput::held(self.mv);
        }
        let last = self.last.unwrap_or(now);
        let PidTuning { gains, b, c } = self.tuning;
        let Sampled { a_d, b_d, integral } = self.sampled;
        let derivative = a_d * self.derivative + b_d * (now.weighted(c) - last.weighted(c));
        let parts = Parts {
            p: gains.kc * (now.weighted(b) - last.weighted(b)),
            i: integral * (now.error() + last.error()),
            d: derivative - self.derivative,
            feedforward: input.feedforward - self.last_feedforward.unwrap_or(input.feedforward),
            bias: 0.0,
        };
        let wanted_increment = parts.p + parts.d + parts.i + parts.feedforward;
        if !wanted_increment.is_finite() {
            return ControlOutput::held(self.mv);
        }
        self.last = Some(now);
        self.last_feedforward = Some(input.feedforward);
        self.derivative = derivative;
        let mut cut = None;
        if input.controlling {
            cut = input.limits.cuts(self.add(&parts, input.limits));
        } else {
            self.mv = input.limits.clamp(self.mv);
            self.sum = self.mv;
        }
        ControlOutput { mv: self.mv, wanted_increment, held: false, cut, parts }
    }

    fn mv(&self) -> f64 {
        self.mv
    }

    fn set_mv(&mut self, mv: f64) {
        Self::set_mv(self, mv);
    }

    fn applied(&mut self, mv: f64) {
        if mv.is_finite() {
            self.mv = mv;
            if self.clip == Clip::Output {
                self.sum = mv;
            }
        }
    }

    fn rebase(&mut self) {
        (self.last, self.last_feedforward, self.derivative) = (None, None, 0.0);
        self.sum = self.mv;
    }

    fn set_tuning(&mut self, tuning: PidTuning) {
        Self::set_tuning(self, tuning);
    }
}
