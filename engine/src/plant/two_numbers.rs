//! Pairs of numbers in files. An array alone takes the first two of a longer list without a word.

use std::collections::BTreeMap;
use std::fmt;

use serde::de::{Error, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

struct TwoNumbers([f64; 2]);

impl<'de> Deserialize<'de> for TwoNumbers {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        from.deserialize_seq(PairVisitor)
    }
}

/// Refuses within the list, so that the error points at this pair and not at the list of pairs.
struct PairVisitor;

impl<'de> Visitor<'de> for PairVisitor {
    type Value = TwoNumbers;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("two numbers")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<TwoNumbers, A::Error> {
        let mut numbers = Vec::with_capacity(2);
        while let Some(number) = list.next_element::<f64>()? {
            numbers.push(number);
        }
        let wrong =
            |found: Vec<f64>| A::Error::custom(format!("expected two numbers, found {}", found.len()));
        <[f64; 2]>::try_from(numbers).map(TwoNumbers).map_err(wrong)
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

/// Pairs by tag and field.
pub(super) type ByTag = BTreeMap<String, BTreeMap<String, [f64; 2]>>;

/// Pairs by tag and field.
pub(super) fn by_tag<'de, D: Deserializer<'de>>(from: D) -> Result<ByTag, D::Error> {
    let read = BTreeMap::<String, BTreeMap<String, TwoNumbers>>::deserialize(from)?;
    let fields = |fields: BTreeMap<String, TwoNumbers>| fields.into_iter().map(|(k, v)| (k, v.0)).collect();
    Ok(read.into_iter().map(|(tag, of)| (tag, fields(of))).collect())
}
