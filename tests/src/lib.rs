//! What the tests across the crates share.

mod skip;

pub use skip::skip;
