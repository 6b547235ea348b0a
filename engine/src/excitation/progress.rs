//! What goes between a test and the loop it is on: where it begins, what it asks for, how far it is.

use crate::control::{Limits, Mode};

/// The loop at the moment a test is asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct Circumstances {
    /// Its tag.
    pub tag: String,
    /// Time in seconds.
    pub time_s: f64,
    /// Sample time in seconds.
    pub sample_time_s: f64,
    /// PV in PV units; absent before the first sample, NaN when it is lost.
    pub pv: Option<f64>,
    /// Range of its sensor in PV units.
    pub pv_range: Limits,
    /// Setpoint in PV units.
    pub setpoint: f64,
    /// Output in MV units.
    pub mv: f64,
    /// Limits of the output in MV units.
    pub mv_limits: Limits,
    /// Mode that was asked for.
    pub mode: Mode,
}

/// What a test keeps to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Envelope {
    /// Limits of the PV in PV units.
    pub pv: Limits,
    /// Limits of the output in MV units.
    pub mv: Limits,
}

/// What the loop has to do in a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Drive {
    /// Nothing else than it would do by itself.
    Leave,
    /// Give this output in MV units, whatever its law says.
    Output(f64),
    /// Control to this setpoint in PV units.
    Setpoint(f64),
}

/// What a test that has ended leaves to be put back; the rest of the loop it never touched.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Restore {
    /// Output to go on from, in MV units.
    pub output: Option<f64>,
    /// Setpoint in PV units.
    pub setpoint: Option<f64>,
}

/// What a test is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Phase {
    /// It measures noise and values at rest; nothing is moved.
    Listening,
    /// It waits for the answer to a first pulse, which has the sign of the gain.
    FirstPulse,
    /// It waits until the cycles of a relay agree.
    Cycling,
    /// It waits until the answer has settled.
    Settling,
    /// It sends a signal of known length.
    Moving,
    /// It measures a sine's answer.
    Measuring,
    /// It raises the gain.
    Raising,
    /// It has ended.
    Ended,
}

impl Phase {
    /// As the translation files name it under `excitation.phase`.
    #[must_use]
    pub fn key(self) -> &'static str {
        match self {
            Self::Listening => "listening",
            Self::FirstPulse => "first_pulse",
            Self::Cycling => "cycling",
            Self::Settling => "settling",
            Self::Moving => "moving",
            Self::Measuring => "measuring",
            Self::Raising => "raising",
            Self::Ended => "ended",
        }
    }
}

/// How far a test is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// What it is doing.
    pub phase: Phase,
    /// Share of that phase that is done, where its length is known.
    pub fraction: Option<f64>,
    /// Number of the cycle, bit, frequency or gain; 0 before.
    pub cycle: u32,
    /// Cycles, bits or frequencies there are, where that is known.
    pub of: Option<u32>,
    /// Period of the oscillation so far, in seconds.
    pub period_s: Option<f64>,
    /// Amplitude of the oscillation so far, in PV units.
    pub amplitude: Option<f64>,
    /// Time since it was asked for, in seconds.
    pub elapsed_s: f64,
    /// Longest time it may take, in seconds.
    pub budget_s: f64,
}
