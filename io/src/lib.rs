//! Io.
pub use rerun as _r;
