//! The mode of a controller as its log writes it.

/// A column of modes, N rows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModeColumn<'a> {
    /// Codes; with words, the index of a row's word.
    pub values: &'a [f64],
    /// Words of a column of words (AUTO, MAN, …); empty for one of numbers.
    pub words: &'a [String],
}

impl<'a> ModeColumn<'a> {
    /// A column of numbers: nothing is known of what each means.
    #[must_use]
    pub fn of_numbers(values: &'a [f64]) -> Self {
        Self { values, words: &[] }
    }

    /// The word of a code, or the code as a number.
    pub(super) fn name(&self, code: f64) -> String {
        let word = (code >= 0.0 && code.fract() == 0.0).then(|| self.words.get(code as usize)).flatten();
        word.map_or_else(|| crate::explain::number(code), |word| word.trim().to_owned())
    }

    /// Whether a code's word says that a hand writes the MV; a number says nothing.
    pub(super) fn is_manual(&self, code: f64) -> bool {
        /// MANUAL, initialisation in manual, by hand, and what other languages write.
        const WORDS: [&str; 11] =
            ["m", "man", "manual", "iman", "rman", "hand", "ma", "manu", "manuell", "manuel", "lo"];
        !self.words.is_empty() && WORDS.contains(&self.name(code).to_lowercase().as_str())
    }

    /// Rows in which a hand writes the MV.
    pub(super) fn manual(&self) -> Vec<bool> {
        self.values.iter().map(|code| self.is_manual(*code)).collect()
    }
}
