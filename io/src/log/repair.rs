//! What was not taken from a file as it stands, and where.

use serde::{Serialize, Serializer};

use crate::recording::RecordingFlaw;

fn as_words<S: Serializer>(flaw: &RecordingFlaw, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(flaw)
}

/// Something in the file that was not taken as it stands. Lines are counted from 1.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum Repair {
    /// Words or nothing where a number belongs.
    MissingValues {
        /// Column.
        column: String,
        /// How many.
        count: usize,
        /// First line of them.
        line: usize,
        /// What stood there first.
        text: String,
    },
    /// Numbers that stand for none: taken as missing.
    StandIns {
        /// Column.
        column: String,
        /// How many.
        count: usize,
        /// First line of them.
        line: usize,
        /// The number.
        value: f64,
    },
    /// A block of zeros, as a crash leaves it.
    Zeros {
        /// Its bytes; of several blocks, all.
        bytes: usize,
        /// Line that the first is in.
        line: usize,
    },
    /// A row that was cut off while it was written: left out.
    TornRow {
        /// Its line.
        line: usize,
    },
    /// Lines that are no rows of data.
    SkippedLines {
        /// How many.
        count: usize,
        /// First of them.
        line: usize,
    },
    /// Rows with fewer or more fields than the others.
    RaggedRows {
        /// How many.
        count: usize,
        /// First line of them.
        line: usize,
        /// Fields of the other rows.
        fields: usize,
    },
    /// Columns of words that are neither time nor states.
    TextColumn {
        /// Column left out.
        column: String,
    },
    /// Rows without a readable time.
    NoTime {
        /// How many were left out.
        count: usize,
        /// First line of them.
        line: usize,
    },
    /// Rows whose time stamp equals that of the row above.
    DuplicateStamps {
        /// How many were left out.
        count: usize,
        /// First line of them.
        line: usize,
    },
    /// Stamps too coarse for the rows: those of one stamp were spread evenly up to the next.
    SpreadStamps {
        /// Rows that shared a stamp.
        count: usize,
    },
    /// Single rows out of the order of time.
    StrayStamps {
        /// How many were left out.
        count: usize,
        /// First line of them.
        line: usize,
    },
    /// Time jumps back: the file holds several runs, the longest was kept.
    TimeRestart {
        /// Line at which time first jumps back.
        line: usize,
        /// By how many seconds.
        back_s: f64,
        /// First line kept.
        from_line: usize,
        /// Last line kept.
        to_line: usize,
    },
    /// Steps longer than three sample times.
    Gaps {
        /// How many.
        count: usize,
        /// Line after the first.
        line: usize,
        /// The longest, in seconds.
        longest_s: f64,
    },
    /// Rows from the newest to the oldest: turned round.
    FallingTime,
    /// Rows in no order of time, or runs in another order: sorted by their stamps.
    SortedRows {
        /// First line out of order.
        line: usize,
    },
    /// The clock was set back by an hour, as at the end of summer time: what follows was moved on.
    ClockSetBack {
        /// First line after it.
        line: usize,
    },
    /// The clock was corrected: what follows was moved on, to one sample time behind the last row before.
    ClockStepsBack {
        /// How often.
        count: usize,
        /// First line after the first step.
        line: usize,
        /// By how many seconds that goes back.
        back_s: f64,
    },
    /// Rows that stand in the file twice, one run of them behind another.
    RepeatedRows {
        /// How many were left out.
        count: usize,
        /// First line of them.
        line: usize,
    },
    /// Columns of stamps beside the time: left out.
    SpareTime {
        /// Column left out.
        column: String,
    },
    /// One row a value, with the name of its signal: turned into a column a signal.
    LongLayout {
        /// Column of the names.
        column: String,
        /// Signals found.
        signals: usize,
        /// Rows of the file.
        rows: usize,
    },
    /// Values that the file itself calls bad: taken as missing.
    BadQuality {
        /// Column that says so.
        column: String,
        /// How many.
        count: usize,
        /// First line of them.
        line: usize,
    },
    /// Rows about the recorder, not about a signal.
    ServiceRows {
        /// Name they stand under.
        name: String,
        /// How many.
        count: usize,
        /// First line of them.
        line: usize,
    },
    /// Signals stamped apart: stamps close together made one row.
    JoinedStamps {
        /// How close, in seconds.
        within_s: f64,
        /// Rows made.
        rows: usize,
    },
    /// Rows for which a signal has no value of its own: its last one was held.
    HeldValues {
        /// Signal.
        column: String,
        /// How many.
        count: usize,
        /// Longest time held, in seconds.
        longest_s: f64,
    },
    /// Several values of a signal for one row: the last was taken.
    ReplacedValues {
        /// Signal.
        column: String,
        /// How many.
        count: usize,
        /// First line of them.
        line: usize,
    },
    /// Columns with time columns of their own, brought onto one axis.
    OwnTimes {
        /// The time columns.
        columns: String,
    },
    /// A stretch in which a column that moves holds exactly one value: left as it is.
    Frozen {
        /// Column.
        column: String,
        /// First line of them.
        line: usize,
        /// Its rows.
        rows: usize,
        /// Its length in seconds.
        length_s: f64,
    },
    /// A column that changes only every so many rows: left as it is.
    Oversampled {
        /// Column.
        column: String,
        /// Rows between changes.
        rows: usize,
        /// Time between changes, in seconds.
        period_s: f64,
    },
    /// Sheets of a workbook with less in them.
    OtherSheets {
        /// The sheet taken.
        sheet: String,
        /// The others.
        others: String,
    },
    /// Runs of a recording beside the one taken.
    OtherRuns {
        /// The run taken.
        run: String,
        /// How many others.
        others: usize,
    },
    /// Something missing in a recording, or damaged.
    Recording {
        /// What.
        #[serde(serialize_with = "as_words")]
        flaw: RecordingFlaw,
    },
    /// A further file that the log was made of.
    FileJoined {
        /// Its name.
        file: String,
        /// Line of the log's first row from it, counted from 1.
        line: usize,
        /// Its rows.
        rows: usize,
    },
    /// A further file whose columns were put beside the others.
    FileMerged {
        /// Its name.
        file: String,
        /// Its columns.
        columns: usize,
    },
    /// Rows of a further file at times that are already there: left out.
    Overlap {
        /// Its name.
        file: String,
        /// How many.
        count: usize,
        /// Length of the overlap in seconds.
        length_s: f64,
    },
    /// A further file without dates: put behind the one before.
    Appended {
        /// Its name.
        file: String,
        /// Time from the last row before to its first, in seconds.
        step_s: f64,
    },
    /// Marks ahead of three digits: what the file shows elsewhere says that they group thousands.
    GroupedThousands {
        /// The columns.
        columns: String,
        /// The first such number.
        text: String,
        /// What it was read as.
        value: f64,
    },
    /// Marks ahead of three digits that may group thousands or begin decimals.
    ThousandsOrDecimals {
        /// The columns.
        columns: String,
        /// The first such number.
        text: String,
        /// What it was read as.
        value: f64,
        /// What else it reads as.
        other: f64,
    },
    /// Dates that read as day/month and as month/day.
    AmbiguousDates {
        /// Month/day was taken: the clock has AM and PM.
        month_first: bool,
    },
    /// Dates that read both ways, of which another file tells the order.
    DatesByFile {
        /// That file.
        file: String,
        /// Whether the month stands first.
        month_first: bool,
    },
    /// Stamps without a year: time counts from the 1st of January.
    NoYear,
    /// No time in the file.
    NoTimeColumn {
        /// Sample time taken, in seconds.
        sample_time_s: f64,
    },
}
