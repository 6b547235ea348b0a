//! The machine behind each signal, and what all of them hear and answer.

use super::listening::Base;
use super::progress::Phase;
use super::relay::RelayMachine;
use super::report::Finding;
use super::sequence::{DoubletMachine, PrbsMachine};
use super::sine::SineMachine;
use super::spec::{Hysteresis, Signal};
use super::step_test::StepMachine;
use super::ultimate_gain::UltimateMachine;

/// A sample as a machine hears it: deviations from the values at rest.
#[derive(Debug, Clone, Copy)]
pub(super) struct Heard {
    /// Time since the first sample of the signal in seconds.
    pub t_s: f64,
    /// PV in PV units.
    pub y: f64,
    /// MV in force since the sample before, in MV units.
    pub u: f64,
}

/// What a machine answers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Order {
    /// The output, or the setpoint, goes to this deviation from its value at rest.
    Move(f64),
    /// All is measured.
    Done,
    /// Nothing can be measured: no gain up to this one, in MV units per PV unit, makes an oscillation.
    NoOscillation(f64),
}

/// How far a machine is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct State {
    pub phase: Phase,
    /// Share of a signal whose length is known.
    pub fraction: Option<f64>,
    /// Number of the cycle, bit, frequency or gain, from 1; 0 before.
    pub cycle: u32,
    /// Cycles, bits or frequencies there are; absent where that depends on the loop.
    pub of: Option<u32>,
    /// Period of the oscillation so far, in seconds.
    pub period_s: Option<f64>,
    /// Amplitude of the oscillation so far, in PV units.
    pub amplitude: Option<f64>,
}

impl State {
    pub fn of(phase: Phase) -> Self {
        Self { phase, fraction: None, cycle: 0, of: None, period_s: None, amplitude: None }
    }
}

/// What a machine is made for.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ground {
    pub base: Base,
    pub sample_time_s: f64,
    /// Deviations that the output may have, in MV units.
    pub room: [f64; 2],
    /// Smallest deviation of the PV that means something where there is no noise, in PV units.
    pub least: f64,
    /// Samples there may be.
    pub rows: usize,
}

#[derive(Debug, Clone)]
pub(super) enum Machine {
    Step(StepMachine),
    Relay(RelayMachine),
    Doublet(DoubletMachine),
    Prbs(PrbsMachine),
    Sine(SineMachine),
    Ultimate(UltimateMachine),
}

macro_rules! each {
    ($self:expr, $machine:ident => $call:expr) => {
        match $self {
            Machine::Step($machine) => $call,
            Machine::Relay($machine) => $call,
            Machine::Doublet($machine) => $call,
            Machine::Prbs($machine) => $call,
            Machine::Sine($machine) => $call,
            Machine::Ultimate($machine) => $call,
        }
    };
}

impl Machine {
    /// The machine of a signal.
    pub fn new(signal: &Signal, ground: &Ground) -> Self {
        match signal {
            Signal::Step { size, rest_share, .. } | Signal::SetpointStep { size, rest_share, .. } => {
                Self::Step(StepMachine::new(*size, *rest_share, ground))
            }
            Signal::Relay(relay) => Self::Relay(RelayMachine::new(relay, ground)),
            Signal::Doublet { amplitude, hold_s } => {
                Self::Doublet(DoubletMachine::new(*amplitude, *hold_s, ground))
            }
            Signal::Prbs { amplitude, clock_s, register, periods } => {
                Self::Prbs(PrbsMachine::new(*amplitude, *clock_s, *register, *periods))
            }
            Signal::SteppedSine(sine) => Self::Sine(SineMachine::new(sine, ground)),
            Signal::UltimateGain(test) => Self::Ultimate(UltimateMachine::new(test, ground)),
        }
    }

    /// Learns what listening told; allocates nothing.
    pub fn learn(&mut self, ground: &Ground) {
        each!(self, machine => machine.learn(ground));
    }

    pub fn step(&mut self, heard: Heard) -> Order {
        each!(self, machine => machine.step(heard))
    }

    pub fn state(&self) -> State {
        each!(self, machine => machine.state())
    }

    /// What was measured, given away once it is done.
    pub fn finding(&mut self) -> Finding {
        each!(self, machine => machine.finding())
    }
}

impl Hysteresis {
    /// ε in PV units, for a loop whose sd(δ) is known.
    pub(super) fn width(self, deviation_sd: f64) -> f64 {
        match self {
            Self::Given(width) => width,
            Self::Noise(factor) => factor * deviation_sd,
        }
    }
}
