//! A step of the output or of the setpoint, held until the PV has come to rest.

use super::progress::Phase;
use super::report::{Finding, StepFinding};
use super::rest::RestDetector;
use super::signal::{Ground, Heard, Order, State};

#[derive(Debug, Clone)]
pub(super) struct StepMachine {
    size: f64,
    detector: RestDetector,
    found: Option<StepFinding>,
}

impl StepMachine {
    pub fn new(size: f64, rest_share: f64, ground: &Ground) -> Self {
        let detector = RestDetector::new(rest_share, ground.base.noise_sd, ground.least, ground.rows);
        Self { size, detector, found: None }
    }

    pub fn learn(&mut self, ground: &Ground) {
        self.detector.learn(ground.base.noise_sd, ground.least);
    }

    pub fn step(&mut self, heard: Heard) -> Order {
        match self.detector.push(heard.y) {
            Some(change) => {
                let gain = change / self.size;
                self.found = Some(StepFinding { size: self.size, change, gain, settled_after_s: heard.t_s });
                Order::Done
            }
            None => Order::Move(self.size),
        }
    }

    pub fn state(&self) -> State {
        State::of(Phase::Settling)
    }

    pub fn finding(&self) -> Finding {
        self.found.map_or(Finding::Nothing, Finding::Step)
    }
}
