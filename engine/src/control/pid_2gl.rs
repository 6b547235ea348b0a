//! PID-2GL: the positional PID with two degrees of freedom; P, PI and PD as well.
//!
//! ```text
//! P_k = K(b·r_k − y_k)
//! I_k = I_{k−1} + K·h/(2Ti)·(e_k + e_{k−1})
//! D_k = a_d D_{k−1} + b_d[(c·r_k − y_k) − (c·r_{k−1} − y_{k−1})]
//! v_k = u0 + P_k + I_k + D_k,   u_k = sat(v_k)
//! ```
//!
//! a_d and b_d as in PID-I2GL. Anti-windup by conditional integration (of an integral step, what leads over
//! the limit is left out) or by back-calculation, I_k += h/Tt·(u_{k−1} − v_{k−1}). P is formed anew at every sample, so a
//! change of K or b moves the output by ΔK·(b·r − y) at once: that is how this law differs from PID-I2GL.
//!
//! In manual I is set so that v = u; with Ti = ∞ it stays there and is the bias that automatic starts with.
//! Input that is not finite holds the last output and is reported. Source: Åström & Hägglund, PID Controllers,
//! 2nd ed., 1995, sections 3.4 to 3.6.

use super::controller::{ControlInput, ControlOutput, Controller, Parts};
use super::derivative::{Sampled, Signals};
use super::law::AntiWindup;
use super::tuning::PidTuning;

/// The controller's state.
#[derive(Debug, Clone, PartialEq)]
pub struct Pid2gl {
    tuning: PidTuning,
    sampled: Sampled,
    anti_windup: AntiWindup,
    sample_time_s: f64,
    bias: Option<f64>,
    mv: f64,
    integral: f64,
    derivative: f64,
    last: Option<Signals>,
    /// v of the last sample, for back-calculation.
    unlimited: f64,
    /// The next sample sets I so that the output goes on from `mv`.
    takes_over: bool,
}

impl Pid2gl {
    /// A controller at the output `mv`. With a bias it starts at `u0 + P`, without one where the output is.
    #[must_use]
    pub fn new(
        tuning: PidTuning,
        sample_time_s: f64,
        mv: f64,
        bias: Option<f64>,
        anti_windup: AntiWindup,
    ) -> Self {
        Self {
            tuning,
            sampled: Sampled::of(&tuning.gains, sample_time_s),
            anti_windup,
            sample_time_s,
            bias,
            mv,
            integral: 0.0,
            derivative: 0.0,
            last: None,
            unlimited: mv,
            takes_over: bias.is_none(),
        }
    }

    /// Takes another bias and anti-windup. A bias moves the output by its change; one that appears or goes
    /// away does not.
    pub fn configure(&mut self, bias: Option<f64>, anti_windup: AntiWindup) {
        if bias.is_some() != self.bias.is_some() {
            self.integral += self.bias.unwrap_or(0.0) - bias.unwrap_or(0.0);
        }
        (self.bias, self.anti_windup) = (bias, anti_windup);
    }

    /// The tuning in use.
    #[must_use]
    pub fn tuning(&self) -> PidTuning {
        self.tuning
    }

    /// What back-calculation adds to I for the sample before.
    fn drawn_back(&self) -> f64 {
        let gains = self.tuning.gains;
        match self.anti_windup {
            AntiWindup::BackCalculation { tracking_s } if gains.ti_s.is_finite() => {
                let usual_s = if gains.td_s > 0.0 { (gains.ti_s * gains.td_s).sqrt() } else { gains.ti_s };
                let share = (self.sample_time_s / tracking_s.unwrap_or(usual_s)).min(1.0);
                share * (self.mv - self.unlimited)
            }
            _ => 0.0,
        }
    }
}

impl Controller for Pid2gl {
    fn step(&mut self, input: &ControlInput) -> ControlOutput {
        let now = Signals { setpoint: input.setpoint, pv: input.pv };
        if !now.setpoint.is_finite() || !now.pv.is_finite() || !input.feedforward.is_finite() {
            return ControlOutput::held(self.mv);
        }
        let last = self.last.unwrap_or(now);
        let PidTuning { gains, b, c } = self.tuning;
        let Sampled { a_d, b_d, integral } = self.sampled;
        let derivative = a_d * self.derivative + b_d * (now.weighted(c) - last.weighted(c));
        let bias = self.bias.unwrap_or(0.0);
        let without_integral = bias + gains.kc * now.weighted(b) + derivative + input.feedforward;
        let mut step = integral * (now.error() + last.error());
        if !(without_integral + step).is_finite() {
            return ControlOutput::held(self.mv);
        }
        let before = self.mv;
        if !input.controlling || self.takes_over {
            self.mv = if input.controlling { self.mv } else { input.limits.clamp(self.mv) };
            self.integral = self.mv - without_integral;
        } else {
            self.integral += self.drawn_back();
        }
        let mut unlimited = without_integral + self.integral;
        let mut cut = None;
        if input.controlling {
            let wanted = unlimited + step;
            if self.anti_windup == AntiWindup::Clamping {
                step = if step > 0.0 {
                    step.min((input.limits.high - unlimited).max(0.0))
                } else {
                    step.max((input.limits.low - unlimited).min(0.0))
                };
            }
            self.integral += step;
            unlimited = without_integral + self.integral;
            self.mv = input.limits.clamp(unlimited);
            cut = input.limits.cuts(wanted);
        }
        self.takes_over = false;
        (self.last, self.derivative, self.unlimited) = (Some(now), derivative, unlimited);
        let parts = Parts {
            p: gains.kc * now.weighted(b),
            i: self.integral,
            d: derivative,
            feedforward: input.feedforward,
            bias,
        };
        ControlOutput { mv: self.mv, wanted_increment: unlimited - before, held: false, cut, parts }
    }

    fn mv(&self) -> f64 {
        self.mv
    }

    fn set_mv(&mut self, mv: f64) {
        if mv.is_finite() {
            (self.mv, self.unlimited, self.takes_over) = (mv, mv, true);
        }
    }

    fn applied(&mut self, mv: f64) {
        if mv.is_finite() {
            self.mv = mv;
        }
    }

    fn rebase(&mut self) {
        (self.last, self.derivative, self.unlimited, self.takes_over) = (None, 0.0, self.mv, true);
    }

    fn set_tuning(&mut self, tuning: PidTuning) {
        self.sampled = Sampled::of(&tuning.gains, self.sample_time_s);
        self.tuning = tuning;
    }
}
