//! Signals: the channels of a run, its samples, and the pyramid that makes a million of them drawable.

mod channel;
mod pyramid;

pub use channel::{Channel, ChannelKind, ChannelSet, SampleBlock};
pub use pyramid::Pyramid;
