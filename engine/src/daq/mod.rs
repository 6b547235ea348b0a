//! Access to a plant: one trait for the simulated rig, live devices and replays.

mod noise;
mod replayed;
mod simulated;
mod source;

pub(crate) use noise::Noise;
pub use replayed::ReplayedRig;
pub use simulated::SimulatedRig;
pub(crate) use simulated::convert;
pub use source::{RigControls, Source};
