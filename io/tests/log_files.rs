//! Logs that are no text, and several files as one.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use parquet::arrow::ArrowWriter;
use rerun::external::arrow::array::{
    ArrayRef, BooleanArray, Float64Array, Int32Array, StringArray, TimestampNanosecondArray,
};
use rerun::external::arrow::datatypes::{DataType, Field, Schema, TimeUnit};
use rerun::external::arrow::record_batch::RecordBatch;
use vasos_engine::signal::LogStart;
use vasos_io::log::{FileFormat, ImportError, ImportOptions, ImportedLog, Repair, open_log, open_logs};

fn open(path: &Path) -> ImportedLog {
    open_log(path, &ImportOptions::default()).expect("a log")
}

fn file(folder: &Path, name: &str, text: &str) -> PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, text).expect("a file");
    path
}

/// A column with its values; `None` where the value is missing.
fn values(log: &ImportedLog, name: &str) -> Vec<f64> {
    log.table.column(name).unwrap_or_else(|| panic!("no {name}")).values.clone()
}

#[test]
fn parquet_with_stamps_flags_and_words() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("log.parquet");
    let stamp = DataType::Timestamp(TimeUnit::Nanosecond, Some("+02:00".into()));
    let schema = Arc::new(Schema::new(vec![
        Field::new("level", DataType::Float64, true),
        Field::new("count", DataType::Int32, false),
        Field::new("auto", DataType::Boolean, false),
        Field::new("state", DataType::Utf8, true),
        Field::new("__index_level_0__", stamp, false),
    ]));
    let n = 50_000;
    let columns: Vec<ArrayRef> = vec![
        Arc::new(Float64Array::from_iter((0..n).map(|k| (k != 7).then_some(0.5 * k as f64)))),
        Arc::new(Int32Array::from_iter_values(0..n)),
        Arc::new(BooleanArray::from_iter((0..n).map(|k| Some(k > 10)))),
        Arc::new(StringArray::from_iter((0..n).map(|k| Some(if k < 5 { "open" } else { "closed" })))),
        Arc::new(
            TimestampNanosecondArray::from_iter_values(
                (0..n).map(|k| 1_719_578_100_000_000_000 + i64::from(k) * 500_000_000),
            )
            .with_timezone("+02:00"),
        ),
    ];
    let batch = RecordBatch::try_new(schema.clone(), columns).expect("a batch");
    let out = std::fs::File::create(&path).expect("a file");
    let mut writer = ArrowWriter::try_new(out, schema, None).expect("a writer");
    writer.write(&batch).expect("room");
    writer.close().expect("room");

    let log = open(&path);
    assert_eq!(log.report.format, FileFormat::Parquet);
    assert_eq!(log.table.start, LogStart::Calendar("2024-06-28T14:35:00".to_owned()));
    assert_eq!(log.table.len(), 50_000);
    assert_eq!(log.table.time_s[3], 1.5);
    assert!(values(&log, "level")[7].is_nan());
    assert_eq!(values(&log, "count")[49_999], 49_999.0);
    assert_eq!(log.table.column("state").expect("words").states, ["open", "closed"]);
    let missing = Repair::MissingValues { column: "level".into(), count: 1, line: 8, text: String::new() };
    assert!(log.report.repairs.contains(&missing), "{:?}", log.report.repairs);

    let bytes = std::fs::read(&path).expect("bytes");
    let cut = folder.path().join("cut.parquet");
    std::fs::write(&cut, &bytes[..bytes.len() / 2]).expect("a file");
    assert!(matches!(open_log(&cut, &ImportOptions::default()), Err(ImportError::Read { .. })));
}

fn day(day: usize, from: usize, to: usize, header: &str) -> String {
    let rows: Vec<String> = (from..to)
        .map(|k| format!("2024-06-{day:02} 14:{:02}:{:02},{}.5,{k}", k / 60, k % 60, 10 * day))
        .collect();
    format!("{header}\n{}\n", rows.join("\n"))
}

#[test]
fn files_of_the_same_columns_follow_one_another() {
    let folder = tempfile::tempdir().expect("a folder");
    let header = "time,pv,mv";
    let second = file(folder.path(), "b.csv", &day(1, 50, 120, header));
    let first = file(folder.path(), "a.csv", &day(1, 0, 60, header));
    let log = open_logs(&[second, first], &ImportOptions::default()).expect("a log");
    assert_eq!(log.table.len(), 120);
    assert_eq!(log.table.time_s[119], 119.0);
    assert_eq!(values(&log, "mv"), (0..120).map(f64::from).collect::<Vec<_>>());
    let r = &log.report.repairs;
    assert!(r.contains(&Repair::Overlap { file: "b.csv".into(), count: 10, length_s: 9.0 }), "{r:?}");
    assert!(r.contains(&Repair::FileJoined { file: "b.csv".into(), line: 61, rows: 60 }), "{r:?}");
    assert_eq!(log.report.files.len(), 2);
}

#[test]
fn files_without_dates_are_put_one_behind_the_other() {
    let folder = tempfile::tempdir().expect("a folder");
    let run = |k: usize| {
        format!(
            "time,pv,mode\n{}",
            (0..10).map(|t| format!("{}.0,{k}.{t},{}\n", 2 * t, ["AUTO", "MAN"][k % 2])).collect::<String>()
        )
    };
    let paths = [file(folder.path(), "1.csv", &run(0)), file(folder.path(), "2.csv", &run(1))];
    let log = open_logs(&paths, &ImportOptions::default()).expect("a log");
    assert_eq!(log.table.time_s[10], 20.0);
    let mode = log.table.column("mode").expect("a mode");
    assert_eq!(
        (mode.states.as_slice(), mode.values[9], mode.values[10]),
        (["AUTO".to_owned(), "MAN".to_owned()].as_slice(), 0.0, 1.0)
    );
    assert!(log.report.repairs.contains(&Repair::Appended { file: "2.csv".into(), step_s: 2.0 }));
}

#[test]
fn files_of_other_columns_stand_side_by_side() {
    let folder = tempfile::tempdir().expect("a folder");
    let first = file(folder.path(), "pv.csv", &day(1, 0, 60, "time,pv,n"));
    let second = file(folder.path(), "mv.csv", &day(1, 30, 90, "time,mv,m"));
    let log = open_logs(&[first.clone(), second], &ImportOptions::default()).expect("a log");
    let names: Vec<&str> = log.table.columns.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["pv", "n", "mv", "m"]);
    assert_eq!(log.table.len(), 90);
    assert!(values(&log, "mv")[29].is_nan());
    assert_eq!(values(&log, "n")[59], 59.0);
    let held = |r: &Repair| matches!(r, Repair::HeldValues { column, count: 30, .. } if column == "n");
    assert!(log.report.repairs.iter().any(held), "{:?}", log.report.repairs);
    let undated = file(folder.path(), "no.csv", "time,x\n0,1\n1,2\n2,3\n");
    let refused = open_logs(&[first, undated], &ImportOptions::default()).expect_err("no common clock");
    assert!(matches!(refused.1, ImportError::NotJoinable { .. }), "{refused:?}");
}

#[test]
fn a_file_that_is_not_there_says_so() {
    let refused = open_log(Path::new("nowhere/at/all.csv"), &ImportOptions::default()).expect_err("no file");
    assert!(matches!(refused, ImportError::Read { .. }), "{refused}");
}

/// A column goes on in another file only in its own unit.
#[test]
fn centimetres_do_not_go_on_in_millimetres() {
    let folder = tempfile::tempdir().expect("a folder");
    let rows = |from: usize, unit: &str, scale: f64| {
        let row = |k: usize| format!("2024-03-07 10:{:02}:00,{},30\n", from + k, scale * (50.0 + k as f64));
        format!("Time,PV [{unit}],OP [%]\n") + &(0..20).map(row).collect::<String>()
    };
    let paths = [
        file(folder.path(), "a.csv", &rows(0, "cm", 1.0)),
        file(folder.path(), "b.csv", &rows(20, "mm", 10.0)),
    ];
    let log = open_logs(&paths, &ImportOptions::default()).expect("a log");
    assert_eq!(log.table.column("PV").and_then(|c| c.unit.as_deref()), Some("cm"));
    let other =
        log.table.columns.iter().find(|c| c.unit.as_deref() == Some("mm")).expect("a column of its own");
    assert!(other.values.iter().filter(|v| v.is_finite()).all(|v| *v >= 500.0));
    let first = values(&log, "PV");
    assert!(first.iter().filter(|v| v.is_finite()).all(|v| *v < 100.0), "{first:?}");
}
