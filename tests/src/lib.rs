//! What the tests across the crates share.

mod cascade;
mod excited;
mod screen;
mod skip;
mod sources;

pub use cascade::{CASCADE, three_tanks};
pub use excited::{
    TAG, begin, checked_step, excite, loop_settings, relay_test, signals, tag, tested_rig, to_its_end,
};
pub use screen::{Frame, Screen, typed_model};
pub use skip::skip;
pub use sources::{root, sources};
