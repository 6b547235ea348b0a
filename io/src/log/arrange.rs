//! Layouts other than one row a moment: one row a value, and columns with times of their own.

use super::read::Read;
use super::{ImportOptions, Repair, pairs, pivot};

/// Turns such a layout into one row a moment; leaves others as they are.
pub(super) fn arrange(read: Read, options: &ImportOptions, repairs: &mut Vec<Repair>) -> Read {
    if let Some(long) = pivot::find(&read, options) {
        return pivot::turn(read, &long, repairs);
    }
    match pairs::find(&read, options) {
        Some(blocks) => pairs::join(read, &blocks, repairs),
        None => read,
    }
}
