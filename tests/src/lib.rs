//! What the tests across the crates share.

mod screen;
mod skip;

pub use screen::{Frame, Screen, typed_model};
pub use skip::skip;
