//! Every file of the folder of real logs: what comes out of it, or why it is no log. The table is kept in
//! log_table/table.txt, each line judged against the raw file; a change of it is a change of what an engineer is shown.
//!
//! `UPDATE_LOGS=1 cargo test -p vasos-io --test log_table` writes it anew. The logs themselves may not be part of the
//! project; the folder of them is named by `VASOS_TEST_DATA`.

mod logs;

use std::fmt::Write;
use std::path::{Path, PathBuf};

use vasos_engine::signal::{LogColumn, LogStart};
use vasos_io::log::{FileFormat, ImportOptions, ImportedLog, open_log};

use logs::{log_paths, skip};

fn cell(column: &LogColumn, row: usize) -> String {
    let value = column.values[row];
    match column.states.get(value as usize).filter(|_| value.is_finite()) {
        Some(state) => state.clone(),
        None => format!("{value}"),
    }
}

fn format(log: &ImportedLog) -> String {
    match &log.report.format {
        FileFormat::Text(t) => format!("{:?}, {:?}, decimal {:?}", t.encoding, t.separator, t.decimal),
        other => format!("{other:?}"),
    }
}

fn entry(name: &str, log: &ImportedLog) -> String {
    let (table, report) = (&log.table, &log.report);
    let mut out = format!("{name}\n");
    let start = match &table.start {
        LogStart::Calendar(iso) => iso.clone(),
        LogStart::Seconds(s) => format!("{s}"),
        LogStart::Unknown => "?".to_owned(),
    };
    let header = report.header_line.map_or("no header".to_owned(), |line| format!("header in line {line}"));
    writeln!(out, "  {}; {header}, data from line {}", format(log), report.first_data_line).expect("text");
    let time = report.time_column.as_deref().unwrap_or("none");
    let end_s = table.time_s.last().copied().unwrap_or(0.0);
    writeln!(out, "  time {time} {:?}: from {start}, {} rows, {end_s:.3} s", report.time, table.len())
        .expect("text");
    let roles = &report.roles;
    for column in &table.columns {
        let parts = [("PV", &roles.pv), ("SP", &roles.sp), ("MV", &roles.mv), ("mode", &roles.mode)];
        let role = parts.iter().find(|(_, name)| name.as_deref() == Some(&column.name)).map_or("-", |p| p.0);
        let unit = column.unit.as_deref().unwrap_or("");
        let ends = format!("{} … {}", cell(column, 0), cell(column, table.len() - 1));
        writeln!(out, "  {role:4} {} [{unit}] {ends}", column.name).expect("text");
    }
    for repair in &report.repairs {
        writeln!(out, "  ! {repair}").expect("text");
    }
    out
}

#[test]
fn every_real_log_comes_out_as_an_engineer_would_say() {
    let Some((folder, paths)) = log_paths() else {
        return skip("every_real_log_comes_out_as_an_engineer_would_say", "no VASOS_TEST_DATA");
    };
    let kept_at = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/log_table/table.txt");
    let kept = std::fs::read_to_string(&kept_at).unwrap_or_default();
    let table = paths.iter().map(|path| {
        let name = path.strip_prefix(&folder).unwrap_or(path).to_string_lossy().into_owned();
        match open_log(path, &ImportOptions::default()) {
            Ok(log) => entry(&name, &log),
            Err(error) => format!("{name}\n  no log: {error}\n"),
        }
    });
    let table = table.collect::<Vec<_>>().join("\n");
    if std::env::var_os("UPDATE_LOGS").is_some() {
        std::fs::write(&kept_at, &table).expect("the table");
        return;
    }
    let entries = |text: &str| text.split("\n\n").map(|e| e.trim().to_owned()).collect::<Vec<_>>();
    let (kept, found) = (entries(&kept), entries(&table));
    // The folder may hold more than what the table knows.
    let known = |name: &str| kept.iter().find(|e| e.lines().next() == Some(name));
    for entry in &found {
        let name = entry.lines().next().unwrap_or("");
        if let Some(kept) = known(name) {
            assert_eq!(kept, entry, "{name}");
        }
    }
    assert!(kept.iter().any(|e| found.contains(e)), "none of the known logs is in {}", folder.display());
}

#[test]
fn no_file_is_written_to() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("log.csv");
    std::fs::write(&path, "time,pv\n0,1\n1,x\n2,3\n").expect("a file");
    let mut permissions = std::fs::metadata(&path).expect("there").permissions();
    permissions.set_readonly(true);
    std::fs::set_permissions(&path, permissions).expect("read-only");
    let before = std::fs::read(&path).expect("bytes");
    let stamp = |path: &Path| std::fs::metadata(path).and_then(|m| m.modified()).expect("a time");
    let written = stamp(&path);
    open_log(&path, &ImportOptions::default()).expect("a log");
    assert_eq!(std::fs::read(&path).expect("bytes"), before);
    assert_eq!(stamp(&path), written);
}
