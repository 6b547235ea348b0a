//! On/off control, with a differential gap.
//!
//! ```text
//! u = high  from s·e ≥ +gap/2,   low  from s·e ≤ −gap/2,   as it is in between;   s = +1 reverse, −1 direct
//! ```
//!
//! Without a gap e = 0 keeps the output. In between the output stays also where the operator left it, so that
//! automatic brings no jump there. Source: seeds of the project, 003 and 002.

use super::controller::{Bound, ControlInput, ControlOutput, Controller, Parts};
use super::law::Action;
use super::tuning::PidTuning;

/// The controller's state.
#[derive(Debug, Clone, PartialEq)]
pub struct OnOff {
    gap: f64,
    action: Action,
    mv: f64,
    /// The output it switched to last; none before the first switching and after a manual output.
    switched: Option<Bound>,
}

impl OnOff {
    /// A controller at the output `mv` with a gap in PV units.
    #[must_use]
    pub fn new(gap: f64, action: Action, mv: f64) -> Self {
        Self { gap, action, mv, switched: None }
    }

    /// Takes another gap and direction.
    pub fn configure(&mut self, gap: f64, action: Action) {
        (self.gap, self.action) = (gap, action);
    }
}

impl Controller for OnOff {
    fn step(&mut self, input: &ControlInput) -> ControlOutput {
        if !input.setpoint.is_finite() || !input.pv.is_finite() {
            return ControlOutput::held(self.mv);
        }
        let before = self.mv;
        if !input.controlling {
            self.switched = None;
            self.mv = input.limits.clamp(self.mv);
            let wanted_increment = self.mv - before;
            return ControlOutput {
                mv: self.mv,
                wanted_increment,
                held: false,
                cut: None,
                parts: Parts::default(),
            };
        }
        let error = self.action.sign() * (input.setpoint - input.pv);
        let half = 0.5 * self.gap;
        if error >= half && error > -half {
            self.switched = Some(Bound::High);
        } else if error <= -half && error < half {
            self.switched = Some(Bound::Low);
        }
        self.mv = match self.switched {
            Some(Bound::High) => input.limits.high,
            Some(Bound::Low) => input.limits.low,
            None => input.limits.clamp(self.mv),
        };
        let wanted_increment = self.mv - before;
        ControlOutput { mv: self.mv, wanted_increment, held: false, cut: None, parts: Parts::default() }
    }

    fn mv(&self) -> f64 {
        self.mv
    }

    fn set_mv(&mut self, mv: f64) {
        if mv.is_finite() {
            self.mv = mv;
            self.switched = None;
        }
    }

    fn applied(&mut self, mv: f64) {
        if mv.is_finite() {
            self.mv = mv;
        }
    }

    fn rebase(&mut self) {}

    fn set_tuning(&mut self, _: PidTuning) {}
}
