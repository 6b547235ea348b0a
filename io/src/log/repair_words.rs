//! What is said of a repair: the sentence, its key and values for the translations.

use super::Repair;
use crate::recording::RecordingFlaw;
use vasos_engine::explain::{Explain, number};

impl std::fmt::Display for Repair {
    #[allow(clippy::too_many_lines, reason = "a sentence for each kind, and nothing else")]
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::MissingValues { column, count, line, text } => {
                write!(f, "values missing in {column}: {count}, the first in line {line} ('{text}')")
            }
            Self::StandIns { column, count, line, value } => write!(
                f,
                "values of {column} that stand for none were taken as missing: {count} of {}, the first in line {line}",
                number(*value)
            ),
            Self::Zeros { bytes, line } => {
                write!(f, "{bytes} bytes of zero in line {line}, as a crash leaves them: passed over")
            }
            Self::TornRow { line } => {
                write!(f, "the row in line {line} was cut off while it was written: left out")
            }
            Self::SkippedLines { count, line } => {
                write!(f, "lines skipped because they are no rows of data: {count}, the first is line {line}")
            }
            Self::RaggedRows { count, line, fields } => {
                write!(
                    f,
                    "rows that do not have {fields} fields like the others: {count}, the first is line {line}"
                )
            }
            Self::TextColumn { column } => write!(f, "column {column} holds words, not numbers: left out"),
            Self::NoTime { count, line } => {
                write!(
                    f,
                    "rows left out because their time cannot be read: {count}, the first is line {line}"
                )
            }
            Self::DuplicateStamps { count, line } => {
                write!(
                    f,
                    "rows left out because they repeat the time of the row above: {count}, the first is line {line}"
                )
            }
            Self::SpreadStamps { count } => {
                write!(
                    f,
                    "rows that share a time stamp with others: {count}; they were spread evenly up to the next stamp"
                )
            }
            Self::StrayStamps { count, line } => {
                write!(
                    f,
                    "rows left out because they are out of the order of time: {count}, the first is line {line}"
                )
            }
            Self::TimeRestart { line, back_s, from_line, to_line } => write!(
                f,
                "time jumps back by {} s in line {line}: the longest run was kept, lines {from_line} to {to_line}",
                number(*back_s)
            ),
            Self::Gaps { count, line, longest_s } => write!(
                f,
                "gaps of more than three sample times: {count}, the first before line {line}, the longest {} s",
                number(*longest_s)
            ),
            Self::FallingTime => {
                write!(f, "the rows ran from the newest to the oldest: they were turned round")
            }
            Self::SortedRows { line } => write!(
                f,
                "the rows were not in the order of time, first in line {line}: they were sorted by their stamps"
            ),
            Self::ClockSetBack { line } => write!(
                f,
                "the clock goes back by an hour in line {line}, as at the end of summer time: the rows from there on were moved on by an hour"
            ),
            Self::ClockStepsBack { count, line, back_s } => write!(
                f,
                "steps back of the clock: {count}, the first in line {line} by {} s; the rows from there on were moved on to follow one sample time behind",
                number(*back_s)
            ),
            Self::RepeatedRows { count, line } => {
                write!(
                    f,
                    "rows left out because they stand in the file before: {count}, the first is line {line}"
                )
            }
            Self::SpareTime { column } => {
                write!(f, "column {column} holds time stamps beside those of the time axis: left out")
            }
            Self::LongLayout { column, signals, rows } => write!(
                f,
                "one row a value: {rows} rows were turned into {signals} columns by the names in {column}"
            ),
            Self::BadQuality { column, count, line } => write!(
                f,
                "values that {column} calls bad were taken as missing: {count}, the first in line {line}"
            ),
            Self::ServiceRows { name, count, line } => write!(
                f,
                "rows under the name {name}, which is none of a signal, were left out: {count}, the first is line {line}"
            ),
            Self::JoinedStamps { within_s, rows } => write!(
                f,
                "the signals have stamps of their own: those within {} s of each other made one row, {rows} in all",
                number(*within_s)
            ),
            Self::HeldValues { column, count, longest_s } => write!(
                f,
                "values of {column} held from before, because it has none of its own at that time: {count}, the longest for {} s",
                number(*longest_s)
            ),
            Self::ReplacedValues { column, count, line } => write!(
                f,
                "values of {column} left out because a later one falls into the same row: {count}, the first in line {line}"
            ),
            Self::OwnTimes { columns } => {
                write!(f, "the columns have times of their own ({columns}): they were brought onto one axis")
            }
            Self::Frozen { column, line, rows, length_s } => write!(
                f,
                "{column} is frozen for {rows} rows, {} s, from line {line} on: left as it is",
                number(*length_s)
            ),
            Self::Oversampled { column, rows, period_s } => write!(
                f,
                "{column} is oversampled: it changes only every {rows} rows, {} s; left as it is",
                number(*period_s)
            ),
            Self::OtherSheets { sheet, others } => {
                write!(f, "sheet {sheet} was taken; the workbook also has {others}")
            }
            Self::OtherRuns { run, others } => {
                write!(f, "of several runs in the recording the longest was taken: {run}; others: {others}")
            }
            Self::Recording { flaw } => write!(f, "{flaw}"),
            Self::FileJoined { file, line, rows } => {
                write!(f, "{file} was joined on from row {line} on: {rows} rows")
            }
            Self::FileMerged { file, columns } => {
                write!(f, "{columns} columns of {file} were put beside the others by their time")
            }
            Self::Overlap { file, count, length_s } => write!(
                f,
                "rows of {file} left out because the log already covers their time: {count}, {} s",
                number(*length_s)
            ),
            Self::Appended { file, step_s } => {
                write!(f, "{file} has no dates: it was put {} s behind the last row before", number(*step_s))
            }
            Self::GroupedThousands { columns, text, value } => {
                write!(f, "a mark groups the thousands of {columns}: '{text}' was read as {}", number(*value))
            }
            Self::ThousandsOrDecimals { columns, text, value, other } => write!(
                f,
                "'{text}' in {columns} was read as {}; if {} is meant, name the other decimal mark",
                number(*value),
                number(*other)
            ),
            Self::AmbiguousDates { month_first: false } => {
                write!(f, "the dates read as day/month and as month/day: day/month was taken")
            }
            Self::AmbiguousDates { month_first: true } => write!(
                f,
                "the dates read as day/month and as month/day: month/day was taken, as their clock has AM and PM"
            ),
            Self::DatesByFile { file, month_first: false } => write!(
                f,
                "the dates read as day/month and as month/day: day/month was taken, as {file} shows"
            ),
            Self::DatesByFile { file, month_first: true } => write!(
                f,
                "the dates read as day/month and as month/day: month/day was taken, as {file} shows"
            ),
            Self::NoYear => {
                write!(f, "the time stamps have no year: time is counted from the 1st of January")
            }
            Self::NoTimeColumn { sample_time_s } => write!(
                f,
                "the file has no time column: rows were taken to be {} s apart; give the sample time",
                number(*sample_time_s)
            ),
        }
    }
}

impl Explain for Repair {
    fn key(&self) -> &'static str {
        match self {
            Self::MissingValues { .. } => "repair.missing_values",
            Self::StandIns { .. } => "repair.stand_ins",
            Self::Zeros { .. } => "repair.zeros",
            Self::TornRow { .. } => "repair.torn_row",
            Self::SkippedLines { .. } => "repair.skipped_lines",
            Self::RaggedRows { .. } => "repair.ragged_rows",
            Self::TextColumn { .. } => "repair.text_column",
            Self::NoTime { .. } => "repair.no_time",
            Self::DuplicateStamps { .. } => "repair.duplicate_stamps",
            Self::SpreadStamps { .. } => "repair.spread_stamps",
            Self::StrayStamps { .. } => "repair.stray_stamps",
            Self::TimeRestart { .. } => "repair.time_restart",
            Self::Gaps { .. } => "repair.gaps",
            Self::FallingTime => "repair.falling_time",
            Self::SortedRows { .. } => "repair.sorted_rows",
            Self::ClockSetBack { .. } => "repair.clock_set_back",
            Self::ClockStepsBack { .. } => "repair.clock_steps_back",
            Self::RepeatedRows { .. } => "repair.repeated_rows",
            Self::SpareTime { .. } => "repair.spare_time",
            Self::LongLayout { .. } => "repair.long_layout",
            Self::BadQuality { .. } => "repair.bad_quality",
            Self::ServiceRows { .. } => "repair.service_rows",
            Self::JoinedStamps { .. } => "repair.joined_stamps",
            Self::HeldValues { .. } => "repair.held_values",
            Self::ReplacedValues { .. } => "repair.replaced_values",
            Self::OwnTimes { .. } => "repair.own_times",
            Self::Frozen { .. } => "repair.frozen",
            Self::Oversampled { .. } => "repair.oversampled",
            Self::OtherSheets { .. } => "repair.other_sheets",
            Self::OtherRuns { .. } => "repair.other_runs",
            Self::Recording { flaw } => flaw.key(),
            Self::FileJoined { .. } => "repair.file_joined",
            Self::FileMerged { .. } => "repair.file_merged",
            Self::Overlap { .. } => "repair.overlap",
            Self::Appended { .. } => "repair.appended",
            Self::GroupedThousands { .. } => "repair.grouped_thousands",
            Self::ThousandsOrDecimals { .. } => "repair.thousands_or_decimals",
            Self::AmbiguousDates { month_first: false } => "repair.ambiguous_dates",
            Self::AmbiguousDates { month_first: true } => "repair.ambiguous_dates_month_first",
            Self::DatesByFile { month_first: false, .. } => "repair.dates_by_file",
            Self::DatesByFile { month_first: true, .. } => "repair.dates_by_file_month_first",
            Self::NoYear => "repair.no_year",
            Self::NoTimeColumn { .. } => "repair.no_time_column",
        }
    }

    #[allow(clippy::too_many_lines, reason = "the arguments of each kind, and nothing else")]
    fn args(&self) -> Vec<(&'static str, String)> {
        match self {
            Self::MissingValues { column, count, line, text } => vec![
                ("column", column.clone()),
                ("count", count.to_string()),
                ("line", line.to_string()),
                ("text", text.clone()),
            ],
            Self::RaggedRows { count, line, fields } => {
                vec![("count", count.to_string()), ("line", line.to_string()), ("fields", fields.to_string())]
            }
            Self::TextColumn { column } => vec![("column", column.clone())],
            Self::StandIns { column, count, line, value } => vec![
                ("column", column.clone()),
                ("count", count.to_string()),
                ("line", line.to_string()),
                ("value", number(*value)),
            ],
            Self::Zeros { bytes, line } => vec![("bytes", bytes.to_string()), ("line", line.to_string())],
            Self::TornRow { line } => vec![("line", line.to_string())],
            Self::ClockStepsBack { count, line, back_s } => {
                vec![("count", count.to_string()), ("line", line.to_string()), ("back_s", number(*back_s))]
            }
            Self::SkippedLines { count, line }
            | Self::RepeatedRows { count, line }
            | Self::NoTime { count, line }
            | Self::DuplicateStamps { count, line }
            | Self::StrayStamps { count, line } => {
                vec![("count", count.to_string()), ("line", line.to_string())]
            }
            Self::SpreadStamps { count } => vec![("count", count.to_string())],
            Self::TimeRestart { line, back_s, from_line, to_line } => vec![
                ("line", line.to_string()),
                ("back_s", number(*back_s)),
                ("from_line", from_line.to_string()),
                ("to_line", to_line.to_string()),
            ],
            Self::Gaps { count, line, longest_s } => vec![
                ("count", count.to_string()),
                ("line", line.to_string()),
                ("longest_s", number(*longest_s)),
            ],
            Self::FallingTime => vec![],
            Self::SortedRows { line } => vec![("line", line.to_string())],
            Self::ClockSetBack { line } => vec![("line", line.to_string())],
            Self::SpareTime { column } => vec![("column", column.clone())],
            Self::LongLayout { column, signals, rows } => {
                vec![("column", column.clone()), ("signals", signals.to_string()), ("rows", rows.to_string())]
            }
            Self::BadQuality { column, count, line } => {
                vec![("column", column.clone()), ("count", count.to_string()), ("line", line.to_string())]
            }
            Self::ServiceRows { name, count, line } => {
                vec![("name", name.clone()), ("count", count.to_string()), ("line", line.to_string())]
            }
            Self::JoinedStamps { within_s, rows } => {
                vec![("within_s", number(*within_s)), ("rows", rows.to_string())]
            }
            Self::HeldValues { column, count, longest_s } => vec![
                ("column", column.clone()),
                ("count", count.to_string()),
                ("longest_s", number(*longest_s)),
            ],
            Self::ReplacedValues { column, count, line } => {
                vec![("column", column.clone()), ("count", count.to_string()), ("line", line.to_string())]
            }
            Self::OwnTimes { columns } => vec![("columns", columns.clone())],
            Self::Frozen { column, line, rows, length_s } => vec![
                ("column", column.clone()),
                ("line", line.to_string()),
                ("rows", rows.to_string()),
                ("length_s", number(*length_s)),
            ],
            Self::Oversampled { column, rows, period_s } => {
                vec![("column", column.clone()), ("rows", rows.to_string()), ("period_s", number(*period_s))]
            }
            Self::OtherSheets { sheet, others } => vec![("sheet", sheet.clone()), ("others", others.clone())],
            Self::OtherRuns { run, others } => vec![("run", run.clone()), ("others", others.to_string())],
            Self::Recording { flaw } => flaw.args(),
            Self::FileJoined { file, line, rows } => {
                vec![("file", file.clone()), ("line", line.to_string()), ("rows", rows.to_string())]
            }
            Self::FileMerged { file, columns } => {
                vec![("file", file.clone()), ("columns", columns.to_string())]
            }
            Self::Overlap { file, count, length_s } => {
                vec![("file", file.clone()), ("count", count.to_string()), ("length_s", number(*length_s))]
            }
            Self::Appended { file, step_s } => vec![("file", file.clone()), ("step_s", number(*step_s))],
            Self::GroupedThousands { columns, text, value } => {
                vec![("columns", columns.clone()), ("text", text.clone()), ("value", number(*value))]
            }
            Self::ThousandsOrDecimals { columns, text, value, other } => vec![
                ("columns", columns.clone()),
                ("text", text.clone()),
                ("value", number(*value)),
                ("other", number(*other)),
            ],
            Self::DatesByFile { file, .. } => vec![("file", file.clone())],
            Self::AmbiguousDates { .. } | Self::NoYear => Vec::new(),
            Self::NoTimeColumn { sample_time_s } => vec![("sample_time_s", number(*sample_time_s))],
        }
    }
}

impl Repair {
    /// One value of every variant, for the test that compares sentences and translations.
    #[must_use]
    pub fn samples() -> Vec<Self> {
        let column = "LT-103".to_owned();
        vec![
            Self::MissingValues { column: column.clone(), count: 4, line: 17, text: "Bad".to_owned() },
            Self::StandIns { column: column.clone(), count: 11, line: 23, value: -999.25 },
            Self::Zeros { bytes: 4096, line: 88 },
            Self::TornRow { line: 901 },
            Self::SkippedLines { count: 2, line: 9 },
            Self::RaggedRows { count: 3, line: 31, fields: 5 },
            Self::TextColumn { column: column.clone() },
            Self::NoTime { count: 6, line: 44 },
            Self::DuplicateStamps { count: 7, line: 52 },
            Self::SpreadStamps { count: 80 },
            Self::StrayStamps { count: 1, line: 68 },
            Self::TimeRestart { line: 74, back_s: 23.7, from_line: 75, to_line: 300 },
            Self::Gaps { count: 8, line: 91, longest_s: 120.0 },
            Self::GroupedThousands { columns: "FT1".into(), text: "1.010".into(), value: 1010.0 },
            Self::ThousandsOrDecimals {
                columns: "FT1".into(),
                text: "1.500".into(),
                value: 1.5,
                other: 1500.0,
            },
            Self::AmbiguousDates { month_first: false },
            Self::AmbiguousDates { month_first: true },
            Self::NoYear,
            Self::NoTimeColumn { sample_time_s: 1.0 },
        ]
        .into_iter()
        .chain(Self::samples_of_arrangement())
        .collect()
    }

    fn samples_of_arrangement() -> Vec<Self> {
        let column = "LT-103".to_owned();
        let file = "day2.csv".to_owned();
        vec![
            Self::FallingTime,
            Self::SortedRows { line: 12 },
            Self::ClockSetBack { line: 180 },
            Self::ClockStepsBack { count: 3, line: 702, back_s: 44.5 },
            Self::RepeatedRows { count: 30, line: 152 },
            Self::SpareTime { column: column.clone() },
            Self::LongLayout { column: "VarName".to_owned(), signals: 3, rows: 900 },
            Self::BadQuality { column: "Validity".to_owned(), count: 5, line: 31 },
            Self::ServiceRows { name: "$RT_OFF$".to_owned(), count: 2, line: 77 },
            Self::JoinedStamps { within_s: 0.5, rows: 240 },
            Self::HeldValues { column: column.clone(), count: 14, longest_s: 60.0 },
            Self::ReplacedValues { column: column.clone(), count: 3, line: 15 },
            Self::OwnTimes { columns: "Time, Time (2)".to_owned() },
            Self::Frozen { column: column.clone(), line: 400, rows: 120, length_s: 1200.0 },
            Self::Oversampled { column, rows: 5, period_s: 2.5 },
            Self::OtherSheets { sheet: "Data".to_owned(), others: "Notes".to_owned() },
            Self::OtherRuns { run: "stad 2".to_owned(), others: 1 },
            Self::Recording { flaw: RecordingFlaw::Cut { path: file.clone(), at: 12_000 } },
            Self::DatesByFile { file: file.clone(), month_first: false },
            Self::DatesByFile { file: file.clone(), month_first: true },
            Self::FileJoined { file: file.clone(), line: 801, rows: 700 },
            Self::FileMerged { file: file.clone(), columns: 2 },
            Self::Appended { file: file.clone(), step_s: 0.2 },
            Self::Overlap { file, count: 9, length_s: 90.0 },
        ]
    }
}
