//! Files by what is in them, whatever they are called.

use std::fs::File;
use std::io::{Cursor, Read as Input, Seek, SeekFrom};
use std::path::Path;

use super::assemble::assemble;
use super::text::read_text;
use super::{DateOrder, ImportError, ImportOptions, ImportedLog, Repair, join, parquet, recorded, workbook};

/// Bytes a format is told by.
const START: usize = 8;

/// Reads a log that is in memory: text or a workbook.
///
/// `name` is the title of the table, usually the file's name. Time comes out in seconds from the first row, never
/// decreasing; missing values as NaN.
///
/// # Errors
/// [`ImportError`] for bytes that hold nothing to read, with what to do.
pub fn import_log(name: &str, bytes: &[u8], options: &ImportOptions) -> Result<ImportedLog, ImportError> {
    let mut repairs = Vec::new();
    let (read, source) = if workbook::is_workbook(bytes) {
        workbook::read_workbook(Cursor::new(bytes), options, &mut repairs)?
    } else {
        read_text(&mut Cursor::new(bytes), options, &mut repairs)?
    };
    assemble(name, read, source, options, repairs)
}

/// Reads a log from a file: text, a workbook, Parquet or a recording of one's own, told by what is in it.
///
/// Text is read a block at a time: the memory taken is that of the numbers. The file is opened for reading only.
///
/// # Errors
/// [`ImportError`] for a file that holds nothing to read, with what to do.
pub fn open_log(path: &Path, options: &ImportOptions) -> Result<ImportedLog, ImportError> {
    read_file(path, options).map(|(log, _)| log)
}

/// Reads a log, and the order of day and month that its dates show for certain.
fn read_file(path: &Path, options: &ImportOptions) -> Result<(ImportedLog, Option<DateOrder>), ImportError> {
    let name = path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let mut repairs = Vec::new();
    let mut file = File::open(path)?;
    let mut start = Vec::new();
    Input::by_ref(&mut file).take(START as u64).read_to_end(&mut start)?;
    file.seek(SeekFrom::Start(0))?;
    let (read, source) = if workbook::is_workbook(&start) {
        workbook::read_workbook(Cursor::new(std::fs::read(path)?), options, &mut repairs)?
    } else if parquet::is_parquet(&start) {
        parquet::read_parquet(file, &mut repairs)?
    } else if recorded::is_recording(&start) {
        recorded::read_run(path, &mut repairs)?
    } else {
        read_text(&mut file, options, &mut repairs)?
    };
    let order = source.date_order;
    Ok((assemble(&name, read, source, options, repairs)?, order))
}

/// Reads several files as one log: one behind the other where their columns agree, else side by side by their time.
///
/// # Errors
/// The first [`ImportError`] with the path of its file; [`ImportError::NotJoinable`] where files have no clock in common.
pub fn open_logs<P: AsRef<Path>>(
    paths: &[P],
    options: &ImportOptions,
) -> Result<ImportedLog, (String, ImportError)> {
    let named = |path: &P| {
        let path = path.as_ref().display().to_string();
        move |error| (path, error)
    };
    let mut logs = Vec::with_capacity(paths.len());
    let mut told: Vec<(DateOrder, String)> = Vec::new();
    for path in paths {
        let (log, order) = read_file(path.as_ref(), options).map_err(named(path))?;
        told.extend(order.map(|order| (order, log.table.name.clone())));
        logs.push(log);
    }
    // Where all that show an order show the same, the others have it too.
    if let Some((order, file)) =
        told.first().filter(|(first, _)| told.iter().all(|(order, _)| order == first))
    {
        let options = ImportOptions { date_order: Some(*order), ..options.clone() };
        let month_first = *order == DateOrder::MonthFirst;
        for (log, path) in logs.iter_mut().zip(paths) {
            let doubt = |r: &Repair| matches!(r, Repair::AmbiguousDates { .. });
            if log.report.repairs.iter().any(doubt) {
                *log = read_file(path.as_ref(), &options).map_err(named(path))?.0;
                log.report.repairs.push(Repair::DatesByFile { file: file.clone(), month_first });
            }
        }
    }
    let shown = paths.first().map_or_else(String::new, |p| p.as_ref().display().to_string());
    join::join(logs).map_err(|error| (shown, error))
}
