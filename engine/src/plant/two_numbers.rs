//! Pairs of numbers in files. An array alone takes the first two of a longer list without a word.

use serde::de::Error;
use serde::{Deserialize, Deserializer};

struct TwoNumbers([f64; 2]);

impl<'de> Deserialize<'de> for TwoNumbers {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let numbers = Vec::<f64>::deserialize(from)?;
        let pair = <[f64; 2]>::try_from(numbers);
        let wrong =
            |found: Vec<f64>| D::Error::custom(format!("expected two numbers, found {}", found.len()));
        pair.map(Self).map_err(wrong)
    }
}

/// A pair that may be left out.
pub(super) fn optional<'de, D: Deserializer<'de>>(from: D) -> Result<Option<[f64; 2]>, D::Error> {
    Ok(Option::<TwoNumbers>::deserialize(from)?.map(|pair| pair.0))
}

/// A list of pairs.
pub(super) fn list<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<[f64; 2]>, D::Error> {
    Ok(Vec::<TwoNumbers>::deserialize(from)?.into_iter().map(|pair| pair.0).collect())
}
