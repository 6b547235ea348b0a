//! Numbers whose points and commas read both ways.

use vasos_io::log::{Decimal, ImportError, ImportOptions, ImportedLog, Repair, import_log};

fn import_as(text: &str, decimal: Option<Decimal>) -> Result<ImportedLog, ImportError> {
    import_log("test", text.as_bytes(), &ImportOptions { decimal, ..ImportOptions::default() })
}

fn import(text: &str) -> ImportedLog {
    import_as(text, None).expect("a log")
}

fn column<'a>(log: &'a ImportedLog, name: &str) -> &'a [f64] {
    &log.table.column(name).unwrap_or_else(|| panic!("no {name}: {:?}", log.report)).values
}

/// Rows of 0, 1, 2 … seconds, or their like, with the other fields behind.
fn rows(header: &str, n: usize, row: impl Fn(usize) -> String) -> String {
    let rows: Vec<String> = (0..n).map(row).collect();
    format!("{header}\n{}\n", rows.join("\n"))
}

fn doubts(log: &ImportedLog) -> Vec<&Repair> {
    log.report.repairs.iter().filter(|r| matches!(r, Repair::ThousandsOrDecimals { .. })).collect()
}

fn grouped(log: &ImportedLog) -> usize {
    log.report.repairs.iter().filter(|r| matches!(r, Repair::GroupedThousands { .. })).count()
}

/// With `.` and `,` between thousands as a program would print them.
fn group(value: usize, mark: char) -> String {
    if value < 1000 { value.to_string() } else { format!("{}{mark}{:03}", value / 1000, value % 1000) }
}

/// A flow of 1500 beside decimal commas was a flow of 1.5, and nothing said so.
#[test]
fn points_beside_decimal_commas_group_thousands() {
    let log = import(&rows("t;flow;level", 40, |k| {
        format!("{k};{};3{},{}", group(1400 + 7 * k, '.'), k % 10, k % 7)
    }));
    assert_eq!(column(&log, "flow")[10], 1470.0);
    assert_eq!(column(&log, "level")[3], 33.3);
    assert_eq!((grouped(&log), doubts(&log).len()), (1, 0));
    let log =
        import(&rows("t,flow,level", 40, |k| format!("{k}.5,\"{}\",3.{}", group(1400 + 7 * k, ','), k % 7)));
    assert_eq!(column(&log, "flow")[10], 1470.0);
    let log = import(&rows("t\tflow\tlevel", 40, |k| {
        format!("{k}\t{} kg/h\t0.{}", group(1400 + 7 * k, ','), k % 7)
    }));
    assert_eq!(column(&log, "flow")[10], 1470.0);
    assert_eq!(log.table.column("flow").and_then(|c| c.unit.as_deref()), Some("kg/h"));
    let log = import(&rows("t,count,level", 40, |k| format!("{k},\"2,50,0{:02}\",0.{}", k, k % 7)));
    assert_eq!(column(&log, "count")[10], 250_010.0);
}

/// A column that passes 1000 printed `993`, then `1.010`: it fell to 1.
#[test]
fn a_column_that_passes_a_thousand_is_seen_by_its_whole_numbers() {
    for mark in ['.', ','] {
        let log = import(&rows("t;flow", 40, |k| format!("{k};{}", group(950 + 10 * k, mark))));
        let flow = column(&log, "flow");
        assert!((0..40).all(|k| flow[k] == (950 + 10 * k) as f64), "{flow:?}");
        assert_eq!(grouped(&log), 1);
    }
}

/// Three decimals all through are decimals, as nearly every program writes them; the report asks only where nothing tells.
#[test]
fn three_decimals_stay_decimals() {
    let three = |k: usize| format!("{}.{:03}", 12 + k % 5, 37 * k % 1000);
    let log = import(&rows("t;level", 40, |k| format!("{k};{}", three(k))));
    assert_eq!(column(&log, "level")[1], 13.037);
    assert!(
        matches!(doubts(&log)[..], [Repair::ThousandsOrDecimals { value, other, .. }] if value / other < 0.002)
    );
    let told = import_as(&rows("t;level", 40, |k| format!("{k};{}", three(k))), Some(Decimal::Comma))
        .expect("a log");
    assert_eq!(column(&told, "level")[1], 13_037.0);
    assert!(doubts(&told).is_empty());
    // A stamp of 0.200 says what the mark is.
    let log = import(&rows("t;level", 40, |k| format!("{}.{:03};{}", k / 5, k % 5 * 200, three(k))));
    assert!(log.report.repairs.is_empty(), "{:?}", log.report.repairs);
    assert_eq!(column(&log, "level")[1], 13.037);
    // Without trailing zeros: a program that cuts them.
    let cut = ["1.125", "1.25", "2", "1.5", "1.375"];
    let log = import(&rows("t;level", 40, |k| format!("{k};{}", cut[k % 5])));
    assert_eq!(column(&log, "level")[0], 1.125);
    assert!(log.report.repairs.is_empty(), "{:?}", log.report.repairs);
}

/// `0,50,00,30,00` under three names gave 50 and 0 to PV and MV.
#[test]
fn decimal_commas_between_commas() {
    let log = import(&rows("time,PV,MV", 40, |k| format!("{k},5{},{:02},-3{},50", k % 10, k, k % 3)));
    assert!((column(&log, "PV")[21] - 51.21).abs() < 1e-12);
    assert_eq!(column(&log, "MV")[4], -31.5);
    let log = import(&rows("time,PV,MV", 40, |k| {
        format!("2024-03-05 14:00:{k:02},5{},{:02},3{},50", k % 10, k, k % 3)
    }));
    assert!((column(&log, "PV")[21] - 51.21).abs() < 1e-12);
    assert_eq!(log.table.time_s[39], 39.0);
    let cut = rows("time,PV,MV", 40, |k| {
        let decimals = if k % 4 == 0 { String::new() } else { format!(",{}", 25 * (k % 4)) };
        format!("{k},50{decimals},3{},5", k % 3)
    });
    let error = import_as(&cut, None).expect_err("nothing tells");
    assert!(matches!(error, ImportError::CommasInCommas { line: 2, names: 3, .. }), "{error}");
    // Fields without a name are no decimals.
    let log = import(&rows("time,PV,MV", 40, |k| format!("{k}.0,5{},30,1", k % 10)));
    assert!(log.table.columns.iter().flat_map(|c| &c.values).all(|v| v.fract() == 0.0), "{:?}", log.report);
}
