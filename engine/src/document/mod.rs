//! What the user works on: rig settings, log, models, choices. Plain data, changed only by commands, so that
//! every change can be undone and the same commands serve window, tests and later the project file.
//!
//! A [`Document`] is small and its bulky parts are shared, so history keeps whole versions. What a change means
//! for the running rig is the difference of two versions, [`rig_commands`].

mod command;
mod data;
mod error;
mod history;
mod sync;

pub use command::{Applied, DocumentCommand, NewModel};
pub use data::{
    Candidate, Document, FittedRows, LogRoles, LoopSettings, ModelEntry, ModelOrigin, OptimumSettings,
    RigSettings, SourceChoice, Stretch,
};
pub use error::DocumentError;
pub use history::History;
pub use sync::{Consequence, rig_commands};
