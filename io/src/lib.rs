//! Files and recordings of Vasos: rig presets and scenarios, plant logs, settings, exports, structured text, reports, Rerun.
//!
//! Everything that comes from outside passes here once and leaves as a checked type of the engine, or as
//! an error that says what to do. The original files are never written to.

pub mod experiment;
pub mod export;
pub mod frequency_response;
pub mod log;
pub mod recording;
pub mod report;
pub mod rig;
pub mod rig_fitted;
mod rig_lines;
pub mod settings;
pub mod structured_text;
