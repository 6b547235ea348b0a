//! The running loop on its own worker thread: commands in, snapshots, samples and events out.

mod command;

pub use command::{CommandError, RigCommand};
