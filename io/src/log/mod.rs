//! Import of plant logs: files as plants write them become a [`LogTable`] and a list of what was repaired.
//!
//! Text goes bytes → character set (`decode`) → separator, decimal mark, header (`layout`, `header`) → columns (`rows`,
//! line by line; `fast` for those that are as they should be). It is read block by block (`source`): what is in memory
//! is the numbers. Workbooks, Parquet and recordings have readers of their own. From there all go one way: layouts of
//! one row a value or several time columns are turned (`arrange`), the time axis is found and put in order (`axis`,
//! `order`), columns are proposed for PV, SP, MV and mode (`roles`). Several files become one (`join`).
//!
//! An import reads what can be read and says what it left out; only files with nothing to read are refused, with
//! [`ImportError`]. The file itself is never written to.

mod arrange;
mod assemble;
mod axis;
mod behaviour;
mod calendar;
mod commas;
mod corrected;
mod decode;
mod error;
mod fast;
mod fingerprint;
mod header;
mod iec;
mod join;
mod kinds;
mod layout;
mod marks;
mod merge;
mod names;
mod notes;
mod number;
mod open;
mod order;
mod pairs;
mod parquet;
mod parts;
mod pivot;
mod quality;
mod quotes;
mod read;
mod recorded;
mod repair;
mod repair_words;
mod report;
mod role_words;
mod roles;
mod rows;
mod source;
mod split;
mod stamp;
mod stand_ins;
mod text;
mod torn;
mod utf32;
mod workbook;

use vasos_engine::signal::LogTable;

pub use error::ImportError;
pub use fingerprint::sha256_of_file;
pub use open::{import_log, open_log, open_logs};
pub use repair::Repair;
pub use report::{
    Decimal, Encoding, FileFormat, ImportReport, JoinedFile, Roles, Separator, TextFormat, TimeKind,
};
pub use stamp::DateOrder;

/// What the user may say about a file ahead of its import; all of it can be found out.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ImportOptions {
    /// Sample time in seconds, for a file without time; absent: 1 s, and the report says so.
    pub sample_time_s: Option<f64>,
    /// Time column by name, where the proposal is wrong.
    pub time_column: Option<String>,
    /// Order of day and month, where dates read both ways.
    pub date_order: Option<DateOrder>,
    /// Decimal mark, where numbers read both ways.
    pub decimal: Option<Decimal>,
    /// Sheet of a workbook, where not the one with most rows.
    pub sheet: Option<String>,
}

/// A log and how it was read.
#[derive(Debug, Clone, PartialEq)]
pub struct ImportedLog {
    /// The data.
    pub table: LogTable,
    /// How it was read, what was repaired and which columns are proposed.
    pub report: ImportReport,
}
