//! An event of a prepared run, and how files spell it.

use std::fmt;

use serde::de::value::{MapAccessDeserializer, StrDeserializer};
use serde::de::{DeserializeSeed, Error, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

use crate::session::RigCommand;

/// A command at a time.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ScenarioEvent {
    /// Time in seconds; the command acts from the first sample at or after it.
    pub at_s: f64,
    /// What happens.
    #[serde(flatten)]
    pub command: RigCommand,
}

// By hand: a flattened command takes no notice of a second one, nor of fields it does not know.
impl<'de> Deserialize<'de> for ScenarioEvent {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        from.deserialize_map(EventVisitor)
    }
}

struct EventVisitor;

impl<'de> Visitor<'de> for EventVisitor {
    type Value = ScenarioEvent;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "an event: {}", parts())
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<ScenarioEvent, A::Error> {
        let (mut at_s, mut command) = (None, None);
        while let Some(key) = map.next_key_seed(KeyAfter { at_s, command: command.as_ref() })? {
            match key {
                EventKey::Time => at_s = Some(map.next_value()?),
                EventKey::Command(key) => {
                    let entry = Entry { key: Some(key), map: &mut map };
                    command = Some(RigCommand::deserialize(MapAccessDeserializer::new(entry))?);
                }
            }
        }
        let missing = |what: &str| A::Error::custom(format!("the event has no {what}: {}", parts()));
        Ok(ScenarioEvent {
            at_s: at_s.ok_or_else(|| missing("at_s"))?,
            command: command.ok_or_else(|| missing("command"))?,
        })
    }
}

/// What an event consists of.
fn parts() -> String {
    format!("it takes at_s and one command of {}", RigCommand::KEYS.join(", "))
}

enum EventKey {
    Time,
    Command(&'static str),
}

/// A key behind those read already. Refused here, a key is what the error points at.
struct KeyAfter<'a> {
    at_s: Option<f64>,
    command: Option<&'a RigCommand>,
}

impl<'de> DeserializeSeed<'de> for KeyAfter<'_> {
    type Value = EventKey;

    fn deserialize<D: Deserializer<'de>>(self, from: D) -> Result<EventKey, D::Error> {
        from.deserialize_identifier(self)
    }
}

impl Visitor<'_> for KeyAfter<'_> {
    type Value = EventKey;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("at_s or a command")
    }

    fn visit_str<E: Error>(self, key: &str) -> Result<EventKey, E> {
        if key == "at_s" {
            return if self.at_s.is_none() { Ok(EventKey::Time) } else { Err(E::duplicate_field("at_s")) };
        }
        let known = RigCommand::KEYS.into_iter().find(|k| *k == key);
        let known = known.ok_or_else(|| E::custom(format!("an event knows no '{key}': {}", parts())))?;
        match self.command {
            None => Ok(EventKey::Command(known)),
            Some(first) => {
                let first = first.key();
                Err(E::custom(format!(
                    "the event has two commands, {first} and {key}: give {key} an [[event]] of its own"
                )))
            }
        }
    }
}

/// One entry of a map whose key has been read: the variant of a command with its fields.
struct Entry<'a, A> {
    key: Option<&'static str>,
    map: &'a mut A,
}

impl<'de, A: MapAccess<'de>> MapAccess<'de> for Entry<'_, A> {
    type Error = A::Error;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, A::Error> {
        self.key.take().map(|key| seed.deserialize(StrDeserializer::new(key))).transpose()
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, A::Error> {
        self.map.next_value_seed(seed)
    }
}
