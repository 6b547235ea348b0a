//! Signals: the channels of a run, its samples, and the pyramid that makes a million of them drawable.

mod channel;
mod derived;
mod log;
mod pyramid;

pub use channel::{Channel, ChannelKind, ChannelSet, SampleBlock};
pub use derived::{ExpressionError, derived_column};
pub use log::{CompleteRows, LogColumn, LogStart, LogTable};
pub use pyramid::Pyramid;
