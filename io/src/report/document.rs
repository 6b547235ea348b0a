//! What a report holds: blocks of words, tables and figures.

use super::chart::Chart;

/// How a block of words is meant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tone {
    /// The answer.
    Answer,
    /// An answer that is a no.
    No,
    /// Something to heed.
    Warning,
}

/// A cell of a table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Cell {
    /// Words or number.
    pub text: String,
    /// Whether it stands to the right, as numbers do.
    pub is_number: bool,
    /// Address it leads to, relative to the report.
    pub link: Option<String>,
}

impl Cell {
    /// Words.
    #[must_use]
    pub fn words(text: impl Into<String>) -> Self {
        Self { text: text.into(), is_number: false, link: None }
    }

    /// A number.
    #[must_use]
    pub fn number(text: impl Into<String>) -> Self {
        Self { text: text.into(), is_number: true, link: None }
    }

    /// Words that lead to another file.
    #[must_use]
    pub fn link(text: impl Into<String>, to: impl Into<String>) -> Self {
        Self { text: text.into(), is_number: false, link: Some(to.into()) }
    }
}

/// A table; a row may be marked as the one that counts.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Table {
    /// Heads of the columns.
    pub head: Vec<String>,
    /// Rows.
    pub rows: Vec<Vec<Cell>>,
    /// Row to stand out.
    pub marked: Option<usize>,
}

/// A part of a report.
#[derive(Debug, Clone, PartialEq)]
pub enum Block {
    /// Heading of a section.
    Heading(String),
    /// Words.
    Paragraph(String),
    /// Words that stand out.
    Note(Tone, String),
    /// Sentences one below the other.
    List(Vec<String>),
    /// A table.
    Table(Table),
    /// Charts side by side as the page allows, with a caption.
    Figure(Vec<Chart>, String),
}

/// A report.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// Language tag, `en` or `pt-BR`.
    pub language: &'static str,
    /// Title.
    pub title: String,
    /// Where the numbers come from: name and value.
    pub provenance: Vec<(String, String)>,
    /// Its parts.
    pub blocks: Vec<Block>,
}
