//! What the tests across the crates share.

mod screen;
mod skip;
mod sources;

pub use screen::{Frame, Screen, typed_model};
pub use skip::skip;
pub use sources::{root, sources};
