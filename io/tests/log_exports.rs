//! Logs as the programs of plants and laboratories export them, a few rows of each, made up after their formats.

use std::path::Path;

use vasos_engine::signal::LogStart;
use vasos_io::log::{
    Decimal, FileFormat, ImportOptions, ImportedLog, Repair, Separator, TimeKind, import_log, open_log,
};

fn import(text: &str) -> ImportedLog {
    import_log("test", text.as_bytes(), &ImportOptions::default()).expect("a log")
}

/// Rows `k` from 0 to `n`, each made by `row`, under `header`.
fn rows(header: &str, n: usize, row: impl Fn(usize) -> String) -> String {
    let rows: Vec<String> = (0..n).map(row).collect();
    format!("{header}{}\n", rows.join("\n"))
}

fn names(log: &ImportedLog) -> Vec<&str> {
    log.table.columns.iter().map(|c| c.name.as_str()).collect()
}

fn column<'a>(log: &'a ImportedLog, name: &str) -> &'a [f64] {
    &log.table.column(name).unwrap_or_else(|| panic!("no {name} in {:?}", names(log))).values
}

fn roles(log: &ImportedLog) -> [Option<&str>; 4] {
    let r = &log.report.roles;
    [r.pv.as_deref(), r.sp.as_deref(), r.mv.as_deref(), r.mode.as_deref()]
}

fn starts(log: &ImportedLog, iso: &str) {
    assert_eq!(log.table.start, LogStart::Calendar(iso.to_owned()));
}

/// Values that wander as those of a loop do.
fn pv(k: usize) -> f64 {
    50.0 + (k as f64 * 0.7).sin() * 3.0
}

fn mv(k: usize) -> f64 {
    40.0 + (k as f64 * 0.7 + 1.0).cos() * 5.0
}

#[test]
fn wincc_archive() {
    let mut text = "\"VarName\";\"TimeString\";\"VarValue\";\"Validity\";\"Time_ms\"\r\n".to_owned();
    text += "\"$RT_OFF$\";\"28.06.2024 14:34:59\";0;2;45471607627,3148\r\n";
    for k in 0..30 {
        for (tag, value) in [("LIC101_PV", pv(k)), ("LIC101_SP", 50.0), ("LIC101_MV", mv(k))] {
            let (validity, value) = if k == 7 && tag.ends_with("PV") { (0, 0.0) } else { (1, value) };
            text += &format!(
                "\"{tag}\";\"28.06.2024 14:35:{k:02}\";{};{validity};45471607638,8889\r\n",
                format!("{value:.4}").replace('.', ",")
            );
        }
    }
    let log = import(&text);
    assert_eq!(names(&log), ["LIC101_PV", "LIC101_SP", "LIC101_MV"]);
    assert_eq!(log.table.len(), 30);
    starts(&log, "2024-06-28T14:35:00");
    assert_eq!(roles(&log), [Some("LIC101_PV"), Some("LIC101_SP"), Some("LIC101_MV"), None]);
    assert!((column(&log, "LIC101_PV")[3] - pv(3)).abs() < 1e-4);
    assert!(column(&log, "LIC101_PV")[7].is_nan());
    let r = &log.report.repairs;
    assert!(r.contains(&Repair::LongLayout { column: "VarName".into(), signals: 3, rows: 91 }), "{r:?}");
    assert!(r.iter().any(|r| matches!(r, Repair::BadQuality { count: 1, line: 24, .. })), "{r:?}");
    assert!(r.iter().any(|r| matches!(r, Repair::ServiceRows { count: 1, line: 2, .. })), "{r:?}");
}

#[test]
fn long_exports_of_historians() {
    let wonderware = rows("DateTime,TagName,Value,QualityDetail\n", 60, |k| {
        let tag = ["FIC200.PV", "FIC200.OP"][k % 2];
        format!("2024-06-28 14:{:02}:{:02}.0000000,{tag},{:.3},192", k / 2 / 60, k / 2 % 60, pv(k))
    });
    let log = import(&wonderware);
    assert_eq!(names(&log), ["FIC200.PV", "FIC200.OP"]);
    assert_eq!(log.table.len(), 30);
    assert_eq!(roles(&log)[0], Some("FIC200.PV"));
    assert_eq!(roles(&log)[2], Some("FIC200.OP"));
    // Sorted by signal, not by time, with a mode in words and times of its own for each signal.
    let mut phd = "Tagname,Timestamp,Value,Confidence\n".to_owned();
    for (tag, shift) in [("21TC105.PV", 0), ("21TC105.MODE", 3)] {
        for k in 0..40 {
            let value = if shift > 0 { ["AUTO", "MAN"][k / 20].to_owned() } else { format!("{:.2}", pv(k)) };
            phd += &format!("{tag},06/28/2024 14:{:02}:{:02},{value},100\n", k / 6, k % 6 * 10 + shift);
        }
    }
    let log = import(&phd);
    assert_eq!(names(&log), ["21TC105.PV", "21TC105.MODE"]);
    let mode = log.table.column("21TC105.MODE").expect("a mode");
    assert_eq!(mode.states, ["AUTO", "MAN"]);
    assert_eq!(mode.values[39], 1.0);
    assert_eq!(roles(&log)[3], Some("21TC105.MODE"));
    let missing = |r: &Repair| matches!(r, Repair::MissingValues { .. });
    assert!(!log.report.repairs.iter().any(missing), "{:?}", log.report.repairs);
    assert_eq!(log.table.len(), 40, "{:?}", log.report.repairs);
    starts(&log, "2024-06-28T14:00:00");
    // Without a header: tags that come again beside one number.
    let bare = rows("", 40, |k| format!("2024-06-28T14:00:{:02}Z;LT-10{};{:.2}", k / 2, k % 2, pv(k)));
    assert_eq!(names(&import(&bare)), ["LT-100", "LT-101"]);
}

#[test]
fn signals_with_stamps_of_their_own() {
    // PI DataLink, compressed data: a time and a value for each tag, of different lengths.
    let text = rows("LIC101.PV\t\tLIC101.OP\t\n", 30, |k| {
        let second = format!("28-Jun-24 14:{:02}:00\t{:.2}", 2 * k, mv(k));
        let second = if k < 20 { second } else { "\t".to_owned() };
        format!("28-Jun-24 14:{k:02}:00\t{:.2}\t{second}", pv(k))
    });
    let log = import(&text);
    assert_eq!(names(&log), ["LIC101.PV", "LIC101.OP"]);
    starts(&log, "2024-06-28T14:00:00");
    assert_eq!(log.table.len(), 35);
    assert_eq!(column(&log, "LIC101.OP")[1], column(&log, "LIC101.OP")[0], "held between");
    let r = &log.report.repairs;
    assert!(r.iter().any(|r| matches!(r, Repair::OwnTimes { .. })), "{r:?}");
    assert!(
        r.iter().any(|r| matches!(r, Repair::HeldValues { column, .. } if column == "LIC101.OP")),
        "{r:?}"
    );
}

#[test]
fn pi_datalink_sampled() {
    let text = rows("Time,SINUSOID,CDT158\n,%,DEG. C\n", 20, |k| {
        format!("28-Jun-24 14:{k:02}:00,{:.4},{:.3}", pv(k), mv(k))
    });
    let log = import(&text);
    assert_eq!(names(&log), ["SINUSOID", "CDT158"]);
    starts(&log, "2024-06-28T14:00:00");
    assert_eq!(log.table.time_s[1], 60.0);
}

#[test]
fn deltav_and_exaopc() {
    let deltav = rows(
        "Date/Time,FIC-101/PID1/PV.CV,FIC-101/PID1/SP.CV,FIC-101/PID1/OUT.CV,FIC-101/PID1/MODE.ACTUAL\n",
        30,
        |k| {
            format!(
                "6/28/2024 2:35:{k:02} PM,{:.3},50,{:.3},{}",
                pv(k),
                mv(k),
                if k < 9 { "MAN" } else { "AUTO" }
            )
        },
    );
    let log = import(&deltav);
    starts(&log, "2024-06-28T14:35:00");
    assert_eq!(
        roles(&log),
        [
            Some("FIC-101/PID1/PV.CV"),
            Some("FIC-101/PID1/SP.CV"),
            Some("FIC-101/PID1/OUT.CV"),
            Some("FIC-101/PID1/MODE.ACTUAL")
        ]
    );
    let exaopc = rows("Date,Time,FIC100.PV,FIC100.SV,FIC100.MV,FIC100.MODE\n,,M3/H,M3/H,%,\n", 30, |k| {
        format!("2024/06/28,14:35:{k:02},{:.2},50.00,{:.2},AUT", pv(k), mv(k))
    });
    let log = import(&exaopc);
    starts(&log, "2024-06-28T14:35:00");
    assert_eq!(log.table.columns[0].unit.as_deref(), Some("M3/H"));
    assert_eq!(roles(&log), [Some("FIC100.PV"), Some("FIC100.SV"), Some("FIC100.MV"), Some("FIC100.MODE")]);
}

#[test]
fn ignition_writes_changes_only() {
    let text = rows("t_stamp,Area/LIC_101/PV,Area/LIC_101/CV\n", 60, |k| {
        let second = if k % 5 == 0 { format!("{:.1}", mv(k)) } else { String::new() };
        format!("2024-06-28 14:35:{k:02},{:.2},{second}", pv(k))
    });
    let log = import(&text);
    let cv = column(&log, "Area/LIC_101/CV");
    assert_eq!(cv[4], cv[0]);
    assert!(
        log.report.repairs.contains(&Repair::HeldValues {
            column: "Area/LIC_101/CV".into(),
            count: 48,
            longest_s: 4.0
        }),
        "{:?}",
        log.report.repairs
    );
}

#[test]
fn labview_measurement_file() {
    let head = "LabVIEW Measurement\t\nWriter_Version\t2\nReader_Version\t2\nSeparator\tTab\nDecimal_Separator\t.\n\
                Multi_Headings\tNo\nX_Columns\tOne\nTime_Pref\tAbsolute\nOperator\tlab\nDate\t2024/06/28\n\
                Time\t14:35:00.5\n***End_of_Header***\t\t\t\n\t\t\t\nChannels\t2\t\t\nSamples\t30\t30\t\n\
                Y_Unit_Label\tcm\tV\t\nX_Dimension\tTime\tTime\t\nX0\t0.0E+0\t0.0E+0\t\nDelta_X\t0.1\t0.1\t\n\
                ***End_of_Header***\t\t\t\nX_Value\tLevel\tPump\tComment\n";
    let log = import(&rows(head, 30, |k| format!("{:.6}\t{:.6}\t{:.6}\t", 0.1 * k as f64, pv(k), mv(k))));
    assert_eq!(names(&log), ["Level", "Pump"]);
    assert_eq!(log.report.time_column.as_deref(), Some("X_Value"));
    assert!((log.table.time_s[10] - 1.0).abs() < 1e-9);
    assert_eq!(roles(&log), [Some("Level"), None, Some("Pump"), None]);
    let untimed = head.replace("X_Value\t", "").replace("X_Columns\tOne", "X_Columns\tNo");
    let log = import(&rows(&untimed, 30, |k| format!("{:.6}\t{:.6}\t", pv(k), mv(k))));
    assert_eq!(log.report.time, TimeKind::Missing { sample_time_s: 0.1, assumed: false });
}

#[test]
fn arduino_serial_monitor() {
    let text = rows("", 30, |k| format!("14:35:{k:02}.120 -> {:.2},{:.1}", pv(k), mv(k)));
    let log = import(&text);
    assert_eq!(log.table.columns.len(), 2);
    assert!((log.table.time_s[4] - 4.0).abs() < 1e-9);
    let text = rows("", 30, |k| format!("Temp:{:.2},Setpoint:50.00,Heater:{:.1}", pv(k), mv(k)));
    let log = import(&text);
    assert_eq!(names(&log), ["Temp", "Setpoint", "Heater"]);
    assert_eq!(roles(&log), [Some("Temp"), Some("Setpoint"), Some("Heater"), None]);
    let text = rows("millis,T1,Q1\n", 30, |k| format!("{},{:.2} C,{:.1} %", 1000 + 250 * k, pv(k), mv(k)));
    let log = import(&text);
    assert_eq!(log.table.columns[0].unit.as_deref(), Some("C"));
    assert_eq!(log.table.time_s[4], 1.0, "{:?}", log.report.time);
}

#[test]
fn pandas_and_r_and_matlab() {
    let pandas =
        rows(",time,level,pump\n", 20, |k| format!("{k},{:.1},{:.17},{}", 0.5 * k as f64, pv(k), mv(k)));
    let log = import(&pandas);
    assert_eq!(log.report.time_column.as_deref(), Some("time"));
    assert_eq!(column(&log, "pump")[5], mv(5));
    let indexed =
        rows(",level,pump\n", 20, |k| format!("2024-06-28 14:35:{k:02}.500000+02:00,{},{}", pv(k), mv(k)));
    let log = import(&indexed);
    starts(&log, "2024-06-28T14:35:00.500");
    let r =
        rows("\"time\" \"level\" \"pump\"\n", 20, |k| format!("\"{}\" {} {} {}", k + 1, 2 * k, pv(k), mv(k)));
    let log = import(&r);
    assert_eq!(log.report.time_column.as_deref(), Some("time"));
    let matlab = rows("", 20, |k| format!("{:.10},{},{}", 739_431.5 + k as f64 / 86_400.0, pv(k), mv(k)));
    let log = import(&matlab);
    assert_eq!(log.report.time, TimeKind::MatlabDays);
    starts(&log, "2024-06-28T12:00:00");
}

#[test]
fn spreadsheets_of_germany_and_brazil() {
    let german = rows("Zeit;Füllstand [cm];Sollwert [cm];Stellgröße [%]\r\n", 20, |k| {
        format!(
            "28.06.2024 14:35:{k:02};{};1.050,5;{}\r",
            format!("{:.3}", pv(k)).replace('.', ","),
            format!("{:.1}", mv(k)).replace('.', ",")
        )
    });
    let latin: Vec<u8> = german.chars().map(|c| c as u8).collect();
    let log = import_log("test", &latin, &ImportOptions::default()).expect("a log");
    assert_eq!(column(&log, "Sollwert")[0], 1050.5);
    assert_eq!(
        log.report.text().map(|t| (t.separator, t.decimal)),
        Some((Separator::Semicolon, Decimal::Comma))
    );
    assert_eq!(roles(&log)[..3], [Some("Füllstand"), Some("Sollwert"), Some("Stellgröße")]);
    let brazilian = rows("Data;Hora;Nível (cm);Referência (cm);Vazão (L/min)\n", 20, |k| {
        format!(
            "28/06/2024;14:35:{k:02};{};50,0;{}",
            format!("{:.2}", pv(k)).replace('.', ","),
            format!("{:.2}", mv(k)).replace('.', ",")
        )
    });
    let log = import(&brazilian);
    assert_eq!(roles(&log)[..3], [Some("Nível"), Some("Referência"), Some("Vazão")]);
    starts(&log, "2024-06-28T14:35:00");
    let told = rows("sep=;\nZeit;Druck\n", 20, |k| format!("{k},0;1.0{:02},5", k));
    assert_eq!(names(&import(&told)), ["Druck"]);
    assert_eq!(column(&import(&told), "Druck")[3], 1003.5);
    let serials = rows("Tempo;Nível\n", 20, |k| {
        format!("{};{:.0}", format!("{:.9}", 45471.5 + k as f64 / 86_400.0).replace('.', ","), pv(k))
    });
    assert_eq!(import(&serials).report.time, TimeKind::ExcelSerials);
}

#[test]
fn utf16_with_and_without_a_mark() {
    let text = rows("tempo\tnível\n", 40, |k| format!("{k}\t{:.2}", pv(k)));
    for (mark, order) in [(true, true), (true, false), (false, true), (false, false)] {
        let units = mark.then_some(0xFEFF).into_iter().chain(text.encode_utf16());
        let bytes: Vec<u8> =
            units.flat_map(|u: u16| if order { u.to_le_bytes() } else { u.to_be_bytes() }).collect();
        let log = import_log("test", &bytes, &ImportOptions::default()).expect("a log");
        assert_eq!(names(&log), ["nível"], "mark {mark}, little-endian {order}");
        assert_eq!(log.table.len(), 40);
    }
}

#[test]
fn falling_time_and_runs_out_of_order() {
    let falling = rows("time,pv\n", 20, |k| format!("2024-06-28 14:35:{:02},{k}", 59 - k));
    let log = import(&falling);
    assert_eq!(column(&log, "pv")[0], 19.0);
    assert_eq!(log.report.repairs, [Repair::FallingTime]);
    assert_eq!(log.table.lines[0], 21);
    let days =
        rows("time,pv\n", 20, |k| format!("2024-06-{} 14:35:{:02},{k}", if k < 10 { 29 } else { 28 }, k));
    let log = import(&days);
    assert_eq!(log.table.len(), 20);
    assert_eq!(column(&log, "pv")[0], 10.0);
    assert!(log.report.repairs.contains(&Repair::SortedRows { line: 12 }), "{:?}", log.report.repairs);
}

#[test]
fn clocks_change_and_zones_do_not() {
    // 2:00 to 2:50 come twice in the night of 27 October.
    let summer = rows("time;pv\n", 24, |k| {
        let minutes = 60 + 10 * k - if k >= 12 { 60 } else { 0 };
        format!("27.10.2024 {:02}:{:02}:00;{k}", minutes / 60, minutes % 60)
    });
    let log = import(&summer);
    assert_eq!(log.table.len(), 24);
    assert_eq!(log.table.time_s[23], 23.0 * 600.0);
    assert!(
        matches!(log.report.repairs[..], [Repair::ClockSetBack { line: 14 }]),
        "{:?}",
        log.report.repairs
    );
    let zoned = rows("time,pv\n", 4, |k| {
        [
            "2024-10-27T02:40:00+02:00",
            "2024-10-27T02:50:00+02:00",
            "2024-10-27T02:00:00+01:00",
            "2024-10-27T02:10:00+01:00",
        ][k]
            .to_owned()
            + ",1"
    });
    let log = import(&zoned);
    assert_eq!(log.table.time_s, [0.0, 600.0, 1200.0, 1800.0]);
    assert!(log.report.repairs.is_empty(), "{:?}", log.report.repairs);
    starts(&log, "2024-10-27T02:40:00");
}

#[test]
fn month_first_is_told_by_the_length_of_the_log() {
    let us = rows("time,pv\n", 48, |k| format!("0{}/0{}/2024 {:02}:00:00,{k}", 3, 4 + k / 24, k % 24));
    let log = import(&us);
    starts(&log, "2024-03-04T00:00:00");
    assert!(log.report.repairs.is_empty(), "{:?}", log.report.repairs);
}

#[test]
fn headers_of_several_rows() {
    let text = rows("Tank level;Pump speed;Setpoint\nLT-101.PV;SC-101.OUT;LIC-101.SP\ncm;%;cm\n", 20, |k| {
        format!("{:.2};{:.2};50", pv(k), mv(k)).replace('.', ",")
    });
    let log = import(&text);
    assert_eq!(names(&log), ["LT-101.PV", "SC-101.OUT", "LIC-101.SP"]);
    assert_eq!(log.table.columns[1].unit.as_deref(), Some("%"));
    assert_eq!(log.report.first_data_line, 4);
    let grouped = rows("time,TIC1,,TIC2,\n,PV,OP,PV,OP\n", 20, |k| {
        format!("{k},{:.2},{:.2},{:.2},{:.2}", pv(k), mv(k), pv(k + 3), mv(k + 5))
    });
    assert_eq!(names(&import(&grouped)), ["TIC1 PV", "TIC1 OP", "TIC2 PV", "TIC2 OP"]);
}

#[test]
fn frozen_and_oversampled_signals_are_told_and_left() {
    let text = rows("time,LT.PV,TT.PV\n", 400, |k| {
        let frozen = if (200..300).contains(&k) { pv(200) } else { pv(k) };
        format!("{k},{frozen:.3},{:.3}", pv(k / 5 * 5))
    });
    let log = import(&text);
    let r = &log.report.repairs;
    assert!(
        r.contains(&Repair::Frozen { column: "LT.PV".into(), line: 202, rows: 100, length_s: 99.0 }),
        "{r:?}"
    );
    assert!(r.contains(&Repair::Oversampled { column: "TT.PV".into(), rows: 5, period_s: 5.0 }), "{r:?}");
    assert_eq!(log.table.len(), 400);
}

#[test]
fn a_workbook_comes_from_memory_as_well() {
    let Err(error) = import_log("x", b"PK\x03\x04 no workbook", &ImportOptions::default()) else {
        panic!("a log from an archive")
    };
    assert!(error.to_string().contains("workbook"), "{error}");
    assert!(!matches!(import("time,pv\n0,1\n1,2\n").report.format, FileFormat::Workbook { .. }));
}

/// Written by pandas 2 with odfpy, and by xlwt: twelve rows of 10 s below a header, in the `.ods` on the second sheet.
#[test]
fn workbooks_of_other_programs_are_read_as_well() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/workbooks");
    for name in ["trend.ods", "trend.xls"] {
        let log = open_log(&folder.join(name), &ImportOptions::default()).expect(name);
        assert!(matches!(&log.report.format, FileFormat::Workbook { sheet } if sheet == "Trend"), "{name}");
        let table = &log.table;
        assert_eq!((table.len(), table.time_s[11]), (12, 110.0), "{name}");
        assert_eq!(table.start, LogStart::Calendar("2024-03-05T06:00:00".to_owned()), "{name}");
        let column = |i: usize| table.columns[i].values.clone();
        assert!(column(0).iter().enumerate().all(|(i, v)| *v == 50.0 + 0.5 * i as f64), "{name}");
        assert!(column(2).iter().enumerate().all(|(i, v)| *v == 30.0 - 0.25 * i as f64), "{name}");
        assert_eq!(table.columns[3].states, ["AUTO", "MAN"], "{name}");
        assert_eq!(log.report.roles.mode.as_deref(), Some("TIC101.MODE"), "{name}");
    }
}

#[test]
fn decimal_commas_in_quotes_stand_between_commas() {
    let log = import("time,pv,mv\n0,\"1,5\",\"3,25\"\n1,\"1,6\",4\n2,\"1,75\",\"-5,5\"\n3,2,\"6,0\"\n");
    assert_eq!(log.table.columns[0].values, [1.5, 1.6, 1.75, 2.0]);
    assert_eq!(log.table.columns[1].values, [3.25, 4.0, -5.5, 6.0]);
    // Quotes alone change nothing.
    let log = import("time,pv,mv\n0,\"1.5\",\"3.25\"\n1,\"1.6\",4\n2,\"1.75\",\"-5.5\"\n");
    assert_eq!(log.table.columns[0].values, [1.5, 1.6, 1.75]);
    let log = import("time,note,pv,mv\n0,\"a, b\",1.5,3\n1,\"c\",1.6,4\n2,\"d, e\",1.75,5\n");
    assert_eq!(log.table.column("pv").expect("pv").values, [1.5, 1.6, 1.75]);
}

/// A remark that an operator typed with line ends in it: one field, one row, and the lines counted on.
#[test]
fn remarks_of_several_lines_are_one_field() {
    let text = "time,pv,note,mv\n0,1.5,\"first\nline, two\",3\n1,1.6,plain,4\n2,1.7,\"again\r\n\r\nthree\",5\n3,bad,,6\n";
    let log = import(text);
    assert_eq!(column(&log, "mv"), [3.0, 4.0, 5.0, 6.0]);
    assert_eq!(column(&log, "pv")[..3], [1.5, 1.6, 1.7]);
    assert_eq!(log.table.lines, [2, 4, 5, 8]);
    let missing = |r: &Repair| matches!(r, Repair::MissingValues { column, line: 8, .. } if column == "pv");
    assert!(log.report.repairs.iter().any(missing), "{:?}", log.report.repairs);
    // Through many blocks of a long file as well.
    let row = |k: usize| match k % 97 {
        0 => format!("{k},{:.3},\"a remark\nof {k}, in two lines\",{:.3}", pv(k), mv(k)),
        _ => format!("{k},{:.3},,{:.3}", pv(k), mv(k)),
    };
    let log = import(&rows("time,pv,note,mv\n", 60_000, row));
    assert_eq!(log.table.len(), 60_000, "{:?}", log.report.repairs);
    assert!(log.table.time_s.iter().enumerate().all(|(k, t)| *t == k as f64));
    assert_eq!(log.table.lines[59_999], 60_001 + 59_999_u32.div_ceil(97));
}

/// Flux writes the bounds of its query, which are stamps too, ahead of the time of each value.
#[test]
fn influx_annotated() {
    let mut text = "#group,false,false,true,true,false,false,true,true\n\
        #datatype,string,long,dateTime:RFC3339,dateTime:RFC3339,dateTime:RFC3339,double,string,string\n\
        #default,mean,,,,,,,\n,result,table,_start,_stop,_time,_value,_field,_measurement\n"
        .to_owned();
    for (table, field) in ["FIC101.PV", "FIC101.OP"].into_iter().enumerate() {
        for k in 0..40 {
            let value = if table == 0 { pv(k) } else { mv(k) };
            text += &format!(
                ",,{table},2024-03-05T13:00:00Z,2024-03-05T16:00:00Z,2024-03-05T14:00:{k:02}Z,{value},{field},plant\n"
            );
        }
    }
    let log = import(&text);
    assert_eq!((names(&log), log.table.len()), (vec!["FIC101.PV", "FIC101.OP"], 40));
    starts(&log, "2024-03-05T14:00:00");
    assert_eq!(column(&log, "FIC101.OP")[7], mv(7));
}

/// Times in milliseconds of which only a line above the rows tells the unit.
#[test]
fn twincat_scope() {
    let head = "Name\tScope Project\nFile\tC:\\x.tcscopex\n\nName\tPV\tName\tMV\n\
        SymbolName\tMAIN.fPV\tSymbolName\tMAIN.fMV\nSampleTime[ms]\t200\tSampleTime[ms]\t200\n\n";
    let log = import(&rows(head, 50, |k| format!("{}\t{}\t{}\t{}", 200 * k, pv(k), 200 * k, mv(k))));
    assert_eq!(log.report.time, TimeKind::Numbers { unit_s: 1e-3 });
    assert!((log.table.time_s[49] - 9.8).abs() < 1e-12);
    assert_eq!(column(&log, "MAIN.fMV")[3], mv(3));
}

/// Where the clock has AM and PM the month stands first, unless a date says otherwise; a remark here and there is no mode.
#[test]
fn a_clock_of_twelve_hours_goes_with_the_month_first() {
    let row = |day: &str, k: usize| {
        let note = if k == 0 { "B" } else { "" };
        format!("{day} 2:{k:02}:00 PM,{},{},{note}", pv(k), mv(k))
    };
    let log = import(&rows("Timestamp,FIC101.PV,FIC101.OP,Marker\n", 50, |k| row("3/5/2024", k)));
    starts(&log, "2024-03-05T14:00:00");
    assert!(log.report.repairs.contains(&Repair::AmbiguousDates { month_first: true }));
    assert_eq!(roles(&log)[3], None);
    let log = import(&rows("Timestamp,FIC101.PV,FIC101.OP,Marker\n", 50, |k| row("25/3/2024", k)));
    starts(&log, "2024-03-25T14:00:00");
}

/// Times of day with points, or with letters, between; units with digits in them behind grouped numbers.
#[test]
fn times_and_numbers_of_other_countries() {
    let clock = |k: usize, parts: [&str; 3]| {
        let s = 23 * 3600 + 59 * 60 + k;
        format!("{:02}{}{:02}{}{:02}{}", s / 3600 % 24, parts[0], s / 60 % 60, parts[1], s % 60, parts[2])
    };
    let day = |k: usize| if k < 60 { "05.03.24" } else { "06.03.24" };
    let dotted = |k: usize| format!("{};{};{};{}", day(k), clock(k, [".", ".", ""]), pv(k), mv(k));
    let log = import(&rows("Date;Time;PV;MV\n", 700, dotted));
    assert!((log.table.time_s[699] - 699.0).abs() < 1e-6, "{:?}", log.report.repairs);
    starts(&log, "2024-03-05T23:59:00");
    let spelled = |k: usize| format!("{};{};{}", clock(k, ["h", "m", "s"]), pv(k), mv(k));
    let log = import(&rows("Hora;PV;MV\n", 100, spelled));
    assert!((log.table.time_s[99] - 99.0).abs() < 1e-6, "{:?}", log.report.repairs);
    let grouped = |k: usize| format!("{k},\"1,{:.1} m3/h\",{:.1} %", 200.0 + pv(k), mv(k));
    let text = rows("Time,Flow,Valve\n", 50, grouped) + "Average,\"1,250.0 m3/h\",42 %\n";
    let log = import(&text);
    assert!((column(&log, "Flow")[3] - (1200.0 + pv(3))).abs() < 0.06, "{:?}", log.report.repairs);
    assert_eq!(log.table.column("Flow").and_then(|c| c.unit.as_deref()), Some("m3/h"));
    assert_eq!(log.table.len(), 50);
}

/// Whatever unit the time has in its name, the log is as long as it was.
#[test]
fn units_of_time() {
    for (name, unit_s) in [
        ("Time [µs]", 1e-6),
        ("time_us", 1e-6),
        ("Time [msec]", 1e-3),
        ("Time [Minuten]", 60.0),
        ("Time (mins)", 60.0),
        ("Time (hrs)", 3600.0),
        ("Temps (heures)", 3600.0),
        ("Time [days]", 86_400.0),
        ("Time [s]", 1.0),
    ] {
        let row = |k: usize| format!("{},{},{}", k as f64 / unit_s, pv(k), mv(k));
        let log = import(&rows(&format!("{name},PV,MV\n"), 60, row));
        let end_s = log.table.time_s[59];
        assert!((end_s - 59.0).abs() < 1e-6, "{name}: {end_s}");
    }
}

/// Tabs part the columns where there are any; thin spaces group thousands, and a column of qualities is no mode.
#[test]
fn tabs_and_thin_spaces() {
    for space in ['\u{2009}', '\u{202f}'] {
        let row = |k: usize| {
            format!("{k}\t1{space}{:.1}\t2{space}{:.1}\tGood", 500.0 + pv(k), 600.0 + mv(k)).replace('.', ",")
        };
        let log = import(&rows("Temps (s)\tNiveau cuve (mm)\tVanne (mm)\tQuality\n", 40, row));
        let level = column(&log, "Niveau cuve");
        assert!((level[3] - (1500.0 + pv(3))).abs() < 0.06, "{:?}", log.report.repairs);
        assert_eq!(roles(&log)[3], None);
    }
}
