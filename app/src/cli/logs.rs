//! Logs on the command line: how commands read them, and `vasos log`, which says what is in them.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use vasos_engine::signal::{LogColumn, LogStart, LogTable};
use vasos_io::log::{
    DateOrder, Decimal, FileFormat, ImportOptions, ImportReport, ImportedLog, Repair, TimeKind, open_log,
    open_logs,
};

use super::json::{self, shown, table};
use super::{Answer, Refusal};

/// Rows of a preview.
const PREVIEW_ROWS: usize = 5;

/// What a user may say about a log that is to be read.
#[derive(Debug, Clone, Default, clap::Args)]
pub(super) struct Reading {
    /// Time column, where the proposal is wrong.
    #[arg(long, value_name = "COL")]
    pub time: Option<String>,
    /// Sample time in seconds, for a log without a time column.
    #[arg(long, value_name = "S")]
    pub sample_time: Option<f64>,
    /// Order of day and month, where dates read both ways: `day-first` or `month-first`.
    #[arg(long, value_name = "ORDER")]
    pub dates: Option<Dates>,
    /// Decimal mark, where numbers read both ways (1.500, 1,500): `point` or `comma`.
    #[arg(long, value_name = "MARK")]
    pub decimal: Option<DecimalMark>,
    /// Sheet of a workbook, where not the one with the most numbers.
    #[arg(long, value_name = "NAME")]
    pub sheet: Option<String>,
}

/// Order of day and month.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum Dates {
    /// 31/12/2024
    DayFirst,
    /// 12/31/2024
    MonthFirst,
}

/// Decimal mark.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum DecimalMark {
    /// 1.5
    Point,
    /// 1,5
    Comma,
}

impl Reading {
    fn options(&self) -> ImportOptions {
        ImportOptions {
            sample_time_s: self.sample_time,
            time_column: self.time.clone(),
            date_order: self.dates.map(|dates| match dates {
                Dates::DayFirst => DateOrder::DayFirst,
                Dates::MonthFirst => DateOrder::MonthFirst,
            }),
            decimal: self.decimal.map(|mark| match mark {
                DecimalMark::Point => Decimal::Point,
                DecimalMark::Comma => Decimal::Comma,
            }),
            sheet: self.sheet.clone(),
        }
    }

    /// Reads one log, or several as one.
    pub fn open<P: AsRef<Path>>(&self, paths: &[P]) -> Result<ImportedLog, Refusal> {
        let read = match paths {
            [one] => {
                let shown = || one.as_ref().display().to_string();
                open_log(one.as_ref(), &self.options()).map_err(|error| (shown(), error))
            }
            several => open_logs(several, &self.options()),
        };
        read.map_err(|(path, error)| Refusal(format!("{path}: {error}")))
    }
}

/// Arguments of `vasos log`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  vasos log step.csv
  vasos log export.xlsx --sheet Trend --json
  vasos log monday.csv tuesday.csv
  vasos log drift.csv --dates month-first
Reads text with any separator, decimal mark, header and character set; workbooks (.xlsx, .xls, .ods), Parquet, and own
recordings (.rrd). Rows may be moments or single values with the name of their signal; columns may have times of their
own. Several files are put one behind the other where their columns agree, else side by side by their time.
The files are not written to. Exit status 2: there is no log in it, with the reason.
JSON: {name, rows, length_s, start, time: {column, kind}, format, header_line, first_data_line, columns: [{name, unit,
states, missing, lowest, highest}], roles: {pv, sp, mv, mode}, repairs: [{says, kind, …}], files: [{name, rows,
repairs}], preview: {time_s, rows}}.")]
pub struct Arguments {
    /// Log files; several become one log.
    #[arg(required = true, value_name = "FILE")]
    logs: Vec<PathBuf>,
    #[command(flatten)]
    reading: Reading,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<Answer, Refusal> {
    let log = arguments.reading.open(&arguments.logs)?;
    Ok(Answer::done(if arguments.json { json::text(&whole(&log)) } else { text(&log) }))
}

/// What was repaired, in words, with the file it was in where there are several.
pub(super) fn repairs(report: &ImportReport) -> Vec<String> {
    let of_files = report
        .files
        .iter()
        .flat_map(|file| file.repairs.iter().map(move |repair| format!("{}: {repair}", file.name)));
    of_files.chain(report.repairs.iter().map(ToString::to_string)).collect()
}

/// Lowest and highest value of a column, and how many are missing.
fn extent(column: &LogColumn) -> (Option<f64>, Option<f64>, usize) {
    let finite = || column.values.iter().copied().filter(|v| v.is_finite());
    (finite().reduce(f64::min), finite().reduce(f64::max), column.values.len() - finite().count())
}

fn whole(log: &ImportedLog) -> Value {
    let (table, report) = (&log.table, &log.report);
    let columns = table.columns.iter().map(|column| {
        let (lowest, highest, missing) = extent(column);
        json!({
            "name": column.name, "unit": column.unit, "states": column.states, "missing": missing,
            "lowest": lowest, "highest": highest,
        })
    });
    let said = |repairs: &[Repair]| -> Vec<Value> {
        let one = |repair: &Repair| {
            let mut value = json!(repair);
            if let Value::Object(fields) = &mut value {
                fields.insert("says".into(), json!(repair.to_string()));
            }
            value
        };
        repairs.iter().map(one).collect()
    };
    let preview: Vec<Vec<Value>> = (0..PREVIEW_ROWS.min(table.len()))
        .map(|row| table.columns.iter().map(|column| cell(column, row)).collect())
        .collect();
    json!({
        "name": table.name,
        "rows": table.len(),
        "length_s": length_s(table),
        "start": table.start,
        "time": { "column": report.time_column, "kind": report.time },
        "format": report.format,
        "header_line": report.header_line,
        "first_data_line": report.first_data_line,
        "columns": columns.collect::<Vec<_>>(),
        "roles": report.roles,
        "repairs": said(&report.repairs),
        "files": report.files.iter().map(|file| json!({
            "name": file.name, "rows": file.rows, "repairs": said(&file.repairs),
        })).collect::<Vec<_>>(),
        "preview": { "time_s": &table.time_s[..PREVIEW_ROWS.min(table.len())], "rows": preview },
    })
}

fn cell(column: &LogColumn, row: usize) -> Value {
    let value = column.values[row];
    match column.states.get(value as usize).filter(|_| value.is_finite()) {
        Some(state) => json!(state),
        None => json!(value),
    }
}

fn length_s(table: &LogTable) -> f64 {
    table.time_s.last().copied().unwrap_or(0.0)
}

fn text(log: &ImportedLog) -> String {
    let (log_table, report) = (&log.table, &log.report);
    let mut out = format!(
        "{}: {}, {} rows, {} s\n",
        log_table.name,
        format_words(&report.format),
        log_table.len(),
        shown(Some(length_s(log_table)))
    );
    out.push_str(&format!("time: {}\n\n", time_words(log)));
    let roles = &report.roles;
    let role = |name: &str| {
        let parts = [("PV", &roles.pv), ("SP", &roles.sp), ("MV", &roles.mv), ("mode", &roles.mode)];
        parts.iter().find(|(_, column)| column.as_deref() == Some(name)).map_or("", |(part, _)| part)
    };
    let mut rows =
        vec![["column", "unit", "proposed", "lowest", "highest", "missing"].map(str::to_owned).to_vec()];
    for column in &log_table.columns {
        let (lowest, highest, missing) = extent(column);
        let ends = if column.states.is_empty() {
            [shown(lowest), shown(highest)]
        } else {
            [column.states.join("/"), String::new()]
        };
        let unit = column.unit.clone().unwrap_or_default();
        let [lowest, highest] = ends;
        rows.push(vec![
            column.name.clone(),
            unit,
            role(&column.name).to_owned(),
            lowest,
            highest,
            missing.to_string(),
        ]);
    }
    out.push_str(&table(&rows));
    let repairs = repairs(report);
    out.push_str(if repairs.is_empty() {
        "\nnothing had to be repaired\n"
    } else {
        "\nrepaired or worth knowing:\n"
    });
    for repair in repairs {
        out.push_str(&format!("  {repair}\n"));
    }
    out
}

fn format_words(format: &FileFormat) -> String {
    match format {
        FileFormat::Text(text) => {
            let name = |value: Value| value.as_str().unwrap_or_default().replace('_', " ");
            format!(
                "text in {}, separated by {}, decimal {}",
                name(json!(text.encoding)),
                name(json!(text.separator)),
                name(json!(text.decimal))
            )
        }
        FileFormat::Workbook { sheet } => format!("workbook, sheet {sheet}"),
        FileFormat::Parquet => "Parquet".to_owned(),
        FileFormat::Recording => "recording".to_owned(),
    }
}

fn time_words(log: &ImportedLog) -> String {
    let kind = match log.report.time {
        TimeKind::Numbers { unit_s: 1.0 } => "seconds".to_owned(),
        TimeKind::Numbers { unit_s } => format!("numbers of {} s", shown(Some(unit_s))),
        TimeKind::Stamps => "stamps".to_owned(),
        TimeKind::ExcelSerials => "days as a spreadsheet counts".to_owned(),
        TimeKind::MatlabDays => "days as MATLAB counts".to_owned(),
        TimeKind::JulianDays => "Julian days".to_owned(),
        TimeKind::Epoch => "seconds since 1970".to_owned(),
        TimeKind::Missing { sample_time_s, assumed } => {
            let given = if assumed { "assumed; give it with --sample-time" } else { "given" };
            return format!("none; {} s from row to row ({given})", shown(Some(sample_time_s)));
        }
    };
    let start = match &log.table.start {
        LogStart::Calendar(start) => format!(", from {start}"),
        LogStart::Seconds(start) => format!(", from {}", shown(Some(*start))),
        LogStart::Unknown => String::new(),
    };
    format!("{} ({kind}{start})", log.report.time_column.as_deref().unwrap_or("–"))
}
