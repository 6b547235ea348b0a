//! Signals whose course is known beforehand: the doublet and the binary sequence.

use super::prbs::{ShiftRegister, prbs_length};
use super::progress::Phase;
use super::report::Finding;
use super::rest::RestDetector;
use super::signal::{Ground, Heard, Order, State};

/// Share of the largest deviation that a PV after a doublet may still move by at rest.
const REST_SHARE: f64 = 0.02;
/// Times are multiples of the sample time up to rounding.
const ROUNDING: f64 = 1e-6;

/// Up, down, back, and watching.
#[derive(Debug, Clone)]
pub(super) struct DoubletMachine {
    amplitude: f64,
    hold_s: f64,
    t_s: f64,
    detector: RestDetector,
}

impl DoubletMachine {
    pub fn new(amplitude: f64, hold_s: f64, ground: &Ground) -> Self {
        let detector = RestDetector::new(REST_SHARE, ground.base.noise_sd, ground.least, ground.rows);
        Self { amplitude, hold_s, t_s: 0.0, detector }
    }

    pub fn learn(&mut self, ground: &Ground) {
        self.detector.learn(ground.base.noise_sd, ground.least);
    }

    pub fn step(&mut self, heard: Heard) -> Order {
        self.t_s = heard.t_s;
        let rest = self.detector.push(heard.y);
        let half = heard.t_s / self.hold_s + ROUNDING;
        if half < 1.0 {
            Order::Move(self.amplitude)
        } else if half < 2.0 {
            Order::Move(-self.amplitude)
        } else if half < 3.0 || rest.is_none() {
            // As long as one half at least: the rest is looked for over the last third.
            Order::Move(0.0)
        } else {
            Order::Done
        }
    }

    pub fn state(&self) -> State {
        let share = self.t_s / (2.0 * self.hold_s);
        if share < 1.0 {
            State { fraction: Some(share), ..State::of(Phase::Moving) }
        } else {
            State::of(Phase::Settling)
        }
    }

    #[expect(clippy::unused_self, reason = "all machines are asked alike")]
    pub fn finding(&self) -> Finding {
        Finding::Nothing
    }
}

/// A sequence of maximum length, bit after bit.
#[derive(Debug, Clone)]
pub(super) struct PrbsMachine {
    amplitude: f64,
    clock_s: f64,
    bits: u64,
    register: ShiftRegister,
    /// Bits begun.
    begun: u64,
    sign: f64,
    fraction: f64,
}

impl PrbsMachine {
    pub fn new(amplitude: f64, clock_s: f64, register: u32, periods: u32) -> Self {
        Self {
            amplitude,
            clock_s,
            bits: prbs_length(register) as u64 * u64::from(periods),
            register: ShiftRegister::new(register),
            begun: 0,
            sign: 0.0,
            fraction: 0.0,
        }
    }

    #[expect(clippy::unused_self, reason = "all machines are told alike")]
    pub fn learn(&mut self, _: &Ground) {}

    pub fn step(&mut self, heard: Heard) -> Order {
        let bit = (heard.t_s / self.clock_s + ROUNDING).floor() as u64;
        if bit >= self.bits {
            return Order::Done;
        }
        while self.begun <= bit {
            self.sign = self.register.next_sign();
            self.begun += 1;
        }
        self.fraction = heard.t_s / (self.clock_s * self.bits as f64);
        Order::Move(self.sign * self.amplitude)
    }

    pub fn state(&self) -> State {
        let count = |bits: u64| u32::try_from(bits).unwrap_or(u32::MAX);
        State {
            fraction: Some(self.fraction),
            cycle: count(self.begun),
            of: Some(count(self.bits)),
            ..State::of(Phase::Moving)
        }
    }

    #[expect(clippy::unused_self, reason = "all machines are asked alike")]
    pub fn finding(&self) -> Finding {
        Finding::Nothing
    }
}
