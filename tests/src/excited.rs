//! A loop of the reference rig on which tests are run.

use vasos_engine::control::Mode;
use vasos_engine::excitation::{
    AtRest, Excitation, ExcitationReport, Hysteresis, Relay, Signal, StepEnd, SteppedSine, UltimateGain,
};
use vasos_engine::plant::Measurement;
use vasos_engine::session::{CommandError, RigCommand};
use vasos_engine::sim::{ActiveLoop, ClosedLoop};
use vasos_io::rig::preset;

/// Its loop.
pub const TAG: &str = "LIC-02";

/// The tag of its loop.
#[must_use]
pub fn tag() -> String {
    TAG.to_owned()
}

/// The rig at rest with its loop in a mode, after a few samples.
///
/// # Panics
/// When it does not start.
#[must_use]
pub fn tested_rig(mode: Mode, measurement: Measurement) -> ClosedLoop {
    let mut closed =
        ClosedLoop::simulated(preset("stad").expect("preset"), 0, measurement, 3).expect("starts");
    closed.apply(&RigCommand::Mode { tag: tag(), mode }).expect("possible");
    for _ in 0..10 {
        closed.step();
    }
    closed
}

/// A test that begins wherever the loop is.
#[must_use]
pub fn excite(signal: Signal) -> Excitation {
    Excitation { at_rest: AtRest::NotNeeded, listen_s: 10.0, ..Excitation::new(signal) }
}

/// Asks for a test on the loop.
///
/// # Errors
/// As the rig refuses it.
pub fn begin(closed: &mut ClosedLoop, excitation: &Excitation) -> Result<(), CommandError> {
    closed.apply(&RigCommand::Excite { tag: tag(), excitation: Box::new(excitation.clone()) })
}

/// A relay that this rig's noise does not switch.
#[must_use]
pub fn relay_test() -> Excitation {
    excite(Signal::Relay(Relay { hysteresis: Hysteresis::Given(0.1), ..Relay::new(0.3) }))
}

/// One of each kind of signal.
#[must_use]
pub fn signals() -> Vec<Signal> {
    vec![
        Signal::Step { size: 0.1, rest_share: 0.05, end: StepEnd::Back },
        Signal::SetpointStep { size: 1.0, rest_share: 0.05, end: StepEnd::Back },
        Signal::Relay(Relay { hysteresis: Hysteresis::Given(0.1), ..Relay::new(0.3) }),
        Signal::Doublet { amplitude: 0.2, hold_s: 60.0 },
        Signal::Prbs { amplitude: 0.2, clock_s: 5.0, register: 5, periods: 1 },
        Signal::SteppedSine(SteppedSine { agreement: 0.05, ..SteppedSine::new(0.3, vec![0.1, 0.3]) }),
        Signal::UltimateGain(UltimateGain::new(4.0, 0.4)),
    ]
}

/// Everything of a loop that an operator sets.
#[must_use]
pub fn loop_settings(active: &ActiveLoop) -> impl PartialEq + std::fmt::Debug + use<> {
    let control = &active.control;
    let law = (*control.law(), control.tuning(), control.options().clone(), control.pv_filter_s());
    (active.spec.clone(), control.mode, control.setpoint_cm, law)
}

/// One sample, in which the output is finite and within its limits.
///
/// # Panics
/// When it is not.
pub fn checked_step(closed: &mut ClosedLoop) {
    closed.step();
    let control = &closed.loops()[0].control;
    let (mv, limits) = (control.mv(), control.limits());
    assert!((limits.low..=limits.high).contains(&mv), "{mv} at {} s", closed.time_s());
}

/// The test that runs, to its end.
///
/// # Panics
/// When an output is out of its limits.
pub fn to_its_end(closed: &mut ClosedLoop) -> ExcitationReport {
    while !closed.has_ended_excitations() {
        checked_step(closed);
    }
    closed.ended_excitations().next().expect("ended")
}
