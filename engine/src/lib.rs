//! The headless engine of Vasos.
//!
//! A tank network ([`plant`]) is driven by controllers ([`control`]) at the sample time, offline in [`sim`] or
//! live in a [`session`] whose one worker thread takes commands and gives snapshots, samples and events.
//! An [`excitation`] moves a running loop so that there is something to tell. Data from a run or from a log is fitted by
//! [`identify`]; [`tune`] turns a [`model`] into gains and [`analyze`] says what they are worth. [`retune`] goes the whole way for a loop at work. An [`experiment`] is a
//! prepared run with what must come of it. Nothing here knows a window, a file format or a recorder.

pub mod analyze;
pub mod control;
pub mod daq;
pub mod document;
pub mod excitation;
pub mod experiment;
pub mod explain;
pub mod identify;
pub mod model;
pub mod plant;
pub mod retune;
pub mod session;
pub mod signal;
pub mod sim;
pub mod tune;
