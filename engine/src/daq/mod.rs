//! Access to a plant: one trait for the simulated rig, live devices and replays.

mod replayed;
mod simulated;
mod source;

pub use replayed::ReplayedRig;
pub use simulated::SimulatedRig;
pub(crate) use simulated::{convert, noise_of};
pub use source::{RigControls, Source};
