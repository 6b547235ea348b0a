//! Columns as they come out of a file of any format, before their time axis is found.

use std::collections::HashMap;

/// Most words a column of states has.
const MOST_STATES: usize = 32;
/// Most different words of a column that are told apart.
const MOST_WORDS: usize = 8192;

/// What a column holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Number,
    /// Date and time of day, date alone, or time of day alone.
    Full,
    Date,
    Clock,
    Words,
}

impl Kind {
    pub fn is_stamp(self) -> bool {
        matches!(self, Self::Full | Self::Date | Self::Clock)
    }
}

/// A column as read: numbers, seconds of stamps, or indices into `states`.
#[derive(Debug, Clone)]
pub(super) struct ReadColumn {
    pub name: String,
    pub unit: Option<String>,
    pub kind: Kind,
    pub values: Vec<f64>,
    pub states: Vec<String>,
    /// Seconds the stamps' zone is ahead of UTC.
    pub zone_s: Option<f64>,
    /// Row and word of each text in a column of numbers.
    pub strays: Vec<(u32, u32)>,
    index: HashMap<Box<[u8]>, u32>,
    last: u32,
}

impl ReadColumn {
    pub fn new(name: String, unit: Option<String>, kind: Kind, values: Vec<f64>) -> Self {
        let (states, strays) = (Vec::new(), Vec::new());
        Self { name, unit, kind, values, states, zone_s: None, strays, index: HashMap::new(), last: 0 }
    }

    /// Whether its words are too many to be states.
    pub fn is_text_only(&self) -> bool {
        self.kind == Kind::Words
            && (self.states.len() > MOST_STATES || self.states.len() * 2 > self.values.len())
    }

    /// The index of a word, which is remembered; `None` beyond the most a column can have.
    pub fn state(&mut self, word: &str) -> Option<u32> {
        if let Some(known) = self.known_state(word.as_bytes()) {
            return Some(known);
        }
        let next = u32::try_from(self.states.len()).ok().filter(|n| (*n as usize) < MOST_WORDS)?;
        self.states.push(word.to_owned());
        self.index.insert(word.as_bytes().into(), next);
        self.last = next;
        Some(next)
    }

    /// The index of a word that came before.
    pub fn known_state(&mut self, word: &[u8]) -> Option<u32> {
        if self.states.get(self.last as usize).is_some_and(|s| s.as_bytes() == word) {
            return Some(self.last);
        }
        self.last = *self.index.get(word)?;
        Some(self.last)
    }
}

/// All columns, and the line of each row, counted from 1.
#[derive(Debug, Clone)]
pub(super) struct Read {
    pub columns: Vec<ReadColumn>,
    pub lines: Vec<u32>,
    /// Sample time that the file states, in seconds.
    pub stated_sample_time_s: Option<f64>,
}

impl Read {
    /// Line of a row, counted from 1.
    pub fn line(&self, row: usize) -> usize {
        self.lines.get(row).map_or(0, |line| *line as usize)
    }
}
