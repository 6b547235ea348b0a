//! Logs as plants write them: one test a habit, then the real ones, where they are to be had.

mod logs;

use logs::{for_each_log, read_log, skip};
use vasos_engine::explain::Explain;
use vasos_engine::signal::{LogStart, derived_column};
use vasos_io::log::{
    Decimal, Encoding, ImportError, ImportOptions, ImportedLog, Repair, Separator, TextFormat, TimeKind,
    import_log,
};

fn import(text: &str) -> ImportedLog {
    import_bytes(text.as_bytes())
}

fn import_bytes(bytes: &[u8]) -> ImportedLog {
    import_log("test", bytes, &ImportOptions::default()).expect("a log")
}

/// How a log that came from text is written.
fn written(log: &ImportedLog) -> TextFormat {
    log.report.text().expect("a text")
}

fn refused(bytes: &[u8]) -> ImportError {
    import_log("test", bytes, &ImportOptions::default()).expect_err("refused")
}

/// Rows `k` from 0 to `n`, each made by `row`, under `header`.
fn log(header: &str, n: usize, row: impl Fn(usize) -> String) -> String {
    let rows: Vec<String> = (0..n).map(row).collect();
    format!("{header}{}\n", rows.join("\n"))
}

fn column(log: &ImportedLog, name: &str) -> Vec<f64> {
    log.table.column(name).unwrap_or_else(|| panic!("no {name} in {:?}", log.table.columns)).values.clone()
}

#[test]
fn reads_any_separator() {
    let marks = [
        (",", Separator::Comma),
        (";", Separator::Semicolon),
        ("\t", Separator::Tab),
        ("|", Separator::Bar),
        (" || ", Separator::DoubleBar),
        ("   ", Separator::Blanks),
    ];
    for (mark, separator) in marks {
        let text = log(&["time", "pv", "mv"].join(mark), 0, |_| String::new())
            + &log("", 20, |k| [format!("{k}.0"), format!("2{k}.5"), format!("-{k}e1")].join(mark));
        let log = import(&text);
        assert_eq!(written(&log).separator, separator);
        assert_eq!(written(&log).decimal, Decimal::Point);
        assert_eq!(log.report.header_line, Some(1), "{mark}");
        assert_eq!(column(&log, "pv")[..2], [20.5, 21.5]);
        assert_eq!(column(&log, "mv")[3], -30.0);
        assert!(log.report.repairs.is_empty(), "{:?}", log.report.repairs);
    }
}

#[test]
fn reads_decimal_commas_and_engineering_exponents() {
    for mark in [";", "\t", "  "] {
        let text =
            log("", 12, |k| [format!("{},000000E-3", 100 * k), format!("10,{k}"), "7".to_owned()].join(mark));
        let log = import(&text);
        assert_eq!(written(&log).decimal, Decimal::Comma);
        assert!((log.table.time_s[11] - 1.1).abs() < 1e-12);
        assert_eq!(column(&log, "column 2")[3], 10.3);
    }
}

#[test]
fn a_header_may_use_another_separator_than_the_data() {
    let text = log("t [s] || setpoint level [cm] || command PI (du) [ml.s^-1]\n", 12, |k| {
        format!("{k},0\t10,1\t{k},5")
    });
    let log = import(&text);
    assert_eq!(written(&log).separator, Separator::Tab);
    let names: Vec<_> = log.table.columns.iter().map(|c| (c.name.as_str(), c.unit.as_deref())).collect();
    assert_eq!(names, [("setpoint level", Some("cm")), ("command PI (du)", Some("ml.s^-1"))]);
    assert_eq!(log.report.time_column.as_deref(), Some("t"));
}

#[test]
fn reads_units_from_a_row_of_their_own_and_from_brackets() {
    let log = import(&log("time,level,pump\ns,cm,V\n", 10, |k| format!("{k},1.5,2")));
    assert_eq!(log.table.column("level").and_then(|c| c.unit.as_deref()), Some("cm"));
    assert_eq!(log.report.first_data_line, 3);
    let log = import(&self::log("Time (min);Heater 1 (%)\n", 10, |k| format!("{k};1,5")));
    assert_eq!(log.report.time, TimeKind::Numbers { unit_s: 60.0 });
    assert_eq!(log.table.time_s[2], 120.0);
}

#[test]
fn skips_titles_remarks_and_blank_lines() {
    let text = "# plant 7\n# run 3, good\n\ntime,pv\n0,1\n1,2\n# operator came in\n\n2,3\n3,4\nend of file\n";
    let log = import(text);
    assert_eq!(column(&log, "pv"), [1.0, 2.0, 3.0, 4.0]);
    assert!(
        log.report.repairs.contains(&Repair::SkippedLines { count: 2, line: 7 }),
        "{:?}",
        log.report.repairs
    );
    let log = import("# time, pv\n0,1\n1,2\n2,3\n");
    assert_eq!(column(&log, "pv"), [1.0, 2.0, 3.0]);
}

#[test]
fn reads_marks_and_character_sets() {
    let text = "tempo;nível\r\n0;1,5\r\n1;2,5\r\n2;3,5\r\n";
    let utf8 = [b"\xEF\xBB\xBF".as_slice(), text.as_bytes()].concat();
    let utf16: Vec<u8> =
        std::iter::once(0xFEFF).chain(text.encode_utf16()).flat_map(u16::to_le_bytes).collect();
    let latin: Vec<u8> = text.chars().map(|c| c as u8).collect();
    for (bytes, encoding) in
        [(utf8, Encoding::Utf8), (utf16, Encoding::Utf16), (latin, Encoding::Windows1252)]
    {
        let log = import_bytes(&bytes);
        assert_eq!(written(&log).encoding, encoding);
        assert_eq!(column(&log, "nível"), [1.5, 2.5, 3.5]);
        assert_eq!(log.report.roles.pv.as_deref(), Some("nível"));
    }
    let mut chinese = b"\xCA\xB1\xBC\xE4,\xCE\xC2\xB6\xC8\n".to_vec();
    chinese.extend(b"0,1\n1,2\n2,3\n");
    let log = import_bytes(&chinese);
    assert_eq!(written(&log).encoding, Encoding::Gb18030);
    assert_eq!(column(&log, "温度"), [1.0, 2.0, 3.0]);
}

#[test]
fn reads_times_of_all_kinds() {
    let cases = [
        ("2024-06-28 14:35:00", "2024-06-28 14:35:10", "2024-06-28T14:35:00"),
        ("2024-06-28T14:35:00Z", "2024-06-28T14:35:10Z", "2024-06-28T14:35:00"),
        ("28/06/2024 14:35:00", "28/06/2024 14:35:10", "2024-06-28T14:35:00"),
        ("06/28/2024 2:35:00 PM", "06/28/2024 2:35:10 PM", "2024-06-28T14:35:00"),
        ("28-Jun-2024 14:35:00", "28-Jun-2024 14:35:10", "2024-06-28T14:35:00"),
        ("28.06.2024 14:35:00.250", "28.06.2024 14:35:10.250", "2024-06-28T14:35:00.250"),
        ("45471.607638888890", "45471.607754629630", "2024-06-28T14:35:00"),
        ("1719585300", "1719585310", "2024-06-28T14:35:00"),
        ("1719585300000", "1719585310000", "2024-06-28T14:35:00"),
    ];
    for (first, second, start) in cases {
        let log = import(&format!("time;pv\n{first};1\n{second};2\n"));
        assert_eq!(log.table.start, LogStart::Calendar(start.to_owned()), "{first}");
        assert!((log.table.time_s[1] - 10.0).abs() < 1e-3, "{first}: {:?}", log.table.time_s);
    }
    let log = import("date,clock,pv\n28/06/2024,23:59:55,1\n29/06/2024,00:00:05,2\n");
    assert_eq!(log.table.time_s, [0.0, 10.0]);
    let log = import("clock,pv\n23:59:55,1\n00:00:05,2\n00:00:15,3\n");
    assert_eq!(log.table.time_s, [0.0, 10.0, 20.0]);
}

#[test]
fn says_when_day_and_month_may_be_swapped() {
    let ambiguous = log("time;pv\n", 10, |k| format!("05/06/2024 10:00:{k:02};{k}"));
    assert!(import(&ambiguous).report.repairs.contains(&Repair::AmbiguousDates { month_first: false }));
    let us = log("time;pv\n", 10, |k| format!("05/{}/2024 10:00:00;{k}", 10 + k));
    let log = import(&us);
    assert!(log.report.repairs.is_empty());
    assert_eq!(log.table.start, LogStart::Calendar("2024-05-10T10:00:00".to_owned()));
}

#[test]
fn asks_for_the_sample_time_where_there_is_none() {
    let text = log("level,pump\n", 20, |k| format!("{},3", (k * 7) % 5));
    let log = import(&text);
    assert_eq!(log.report.time, TimeKind::Missing { sample_time_s: 1.0, assumed: true });
    assert!(log.report.repairs.contains(&Repair::NoTimeColumn { sample_time_s: 1.0 }));
    let options = ImportOptions { sample_time_s: Some(0.2), ..ImportOptions::default() };
    let log = import_log("test", text.as_bytes(), &options).expect("a log");
    assert_eq!(log.table.time_s[10], 2.0);
    assert!(log.report.repairs.is_empty());
}

#[test]
fn words_are_states_or_missing_values() {
    let text = log("time,pv,mode\n", 20, |k| {
        let pv = if k == 7 { "Bad".to_owned() } else { format!("{k}.5") };
        format!("{k},{pv},{}", if k < 10 { "AUTO" } else { "MAN" })
    });
    let log = import(&text);
    assert!(column(&log, "pv")[7].is_nan());
    let expected = Repair::MissingValues { column: "pv".into(), count: 1, line: 9, text: "Bad".into() };
    assert_eq!(log.report.repairs, [expected]);
    let mode = log.table.column("mode").expect("states");
    assert_eq!(mode.states, ["AUTO", "MAN"]);
    assert_eq!(mode.values[9..11], [0.0, 1.0]);
    assert_eq!(log.report.roles.mode.as_deref(), Some("mode"));
    let pv = column(&log, "pv");
    let whole = log.table.complete(&[&pv], 0.0, 100.0);
    assert_eq!(whole.left_out, [7]);
    assert_eq!(whole.time_s.len(), 19);
}

#[test]
fn puts_time_in_order_and_says_how() {
    let stamped = |stamps: &[i32]| {
        let rows: Vec<String> = stamps.iter().enumerate().map(|(k, t)| format!("{t},{k}")).collect();
        import(&format!("time,pv\n{}\n", rows.join("\n")))
    };
    let duplicates = stamped(&[0, 1, 2, 2, 3, 4, 5, 6]);
    assert_eq!(duplicates.report.repairs, [Repair::DuplicateStamps { count: 1, line: 5 }]);
    assert_eq!(duplicates.table.lines, [2, 3, 4, 6, 7, 8, 9]);
    let stray = stamped(&[10, 11, 12, 9999, 14, 15, 3, 16, 17]);
    assert_eq!(stray.report.repairs[0], Repair::StrayStamps { count: 2, line: 5 });
    assert_eq!(stray.table.time_s, [0.0, 1.0, 2.0, 4.0, 5.0, 6.0, 7.0]);
    let restart = stamped(&[0, 1, 2, 3, 0, 1, 2, 3, 4, 5]);
    assert_eq!(
        restart.report.repairs,
        [Repair::TimeRestart { line: 6, back_s: 3.0, from_line: 6, to_line: 11 }]
    );
    assert_eq!(column(&restart, "pv")[0], 4.0);
    let gap = stamped(&[0, 1, 2, 3, 4, 60, 61, 62]);
    assert_eq!(gap.report.repairs, [Repair::Gaps { count: 1, line: 7, longest_s: 56.0 }]);
    let coarse = stamped(&[0, 0, 1, 1, 2, 2, 3, 3]);
    assert_eq!(coarse.report.repairs, [Repair::SpreadStamps { count: 4 }]);
    assert_eq!(coarse.table.time_s, [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5]);
}

#[test]
fn a_file_without_a_log_gets_a_clear_error() {
    assert_eq!(refused(b""), ImportError::Empty);
    assert_eq!(refused(b" \r\n\n"), ImportError::Empty);
    assert_eq!(refused(b"time,pv\n1,2\n"), ImportError::OneRow { line: 2 });
    assert_eq!(refused(b"Dear all,\nthe pump is broken.\n"), ImportError::NoNumbers { lines: 2 });
    assert!(matches!(refused(b"PK\x03\x04rest"), ImportError::Foreign { .. }));
    assert_eq!(refused(&[7, 0, 1, 255, 0, 3, 9, 200]), ImportError::Binary);
    assert!(matches!(
        refused(b"Time\n2024-11-26 12:29:33\n2024-11-26 12:30:33\n"),
        ImportError::OnlyTime { rows: 2 }
    ));
}

/// Any bytes give a log or a typed error.
#[test]
fn garbage_never_panics() {
    let words: [&str; 24] = [
        "1",
        "2.5",
        "-3,7",
        "1e5",
        ",",
        ";",
        "\t",
        "\n",
        "\r\n",
        "||",
        "|",
        " ",
        "\"",
        "'",
        "time",
        "pv",
        "#",
        "[",
        ")",
        "2024-01-02",
        "10:00:00",
        "é",
        "温",
        "NaN",
    ];
    let mut seed = 42_u64;
    let mut next = move || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 33) as usize
    };
    for case in 0..4000 {
        let length = next() % 200;
        let bytes: Vec<u8> = if case % 4 == 0 {
            (0..length).map(|_| (next() % 256) as u8).collect()
        } else {
            (0..length).flat_map(|_| words[next() % words.len()].bytes()).collect()
        };
        if let Ok(log) = import_log("garbage", &bytes, &ImportOptions::default()) {
            assert!(log.table.time_s.windows(2).all(|w| w[1] >= w[0]), "case {case}");
            assert!(log.table.columns.iter().all(|c| c.values.len() == log.table.len()));
            assert_eq!(log.table.lines.len(), log.table.len());
        }
    }
}

#[test]
fn a_column_may_be_an_expression() {
    let log = import(&log("time,u0,du,tank level\n", 10, |k| format!("{k},30,{k}.5,2")));
    let total = derived_column(&log.table, "u0 + du").expect("a sum");
    assert_eq!(total[4], 34.5);
    assert_eq!(derived_column(&log.table, "-(u0 - 2×du) ÷ [tank level] + 1e1").expect("values")[1], -3.5);
    assert!(
        derived_column(&log.table, "u0 + dv").expect_err("unknown").to_string().contains("no column 'dv'")
    );
    assert!(derived_column(&log.table, "u0 +").is_err());
}

#[test]
fn every_sentence_carries_its_numbers() {
    let errors = ImportError::samples().into_iter().map(|e| (e.key(), e.to_string(), e.args()));
    let repairs = Repair::samples().into_iter().map(|r| (r.key(), r.to_string(), r.args()));
    for (key, text, args) in errors.chain(repairs) {
        for (name, value) in args {
            assert!(text.contains(&value), "{key}: {name} = {value} is not in '{text}'");
        }
    }
}

#[test]
fn proposes_the_columns_of_real_logs() {
    let cases: [(&str, [Option<&str>; 3]); 16] = [
        ("tclab/pds_TCLab_data.csv", [Some("T"), None, Some("Q")]),
        ("tclab/step_noheader.csv", [Some("column 3"), None, Some("column 2")]),
        ("tclab/step_volt_degF.csv", [Some("temperature"), None, Some("voltage")]),
        ("tclab/kantor_Model_Data.csv", [Some("T1"), None, Some("Q1")]),
        ("tclab/mimo_3s_nonuniform.txt", [Some("Temperature 1"), None, Some("Heater 1")]),
        ("tclab/mimo_energy_1s.txt", [Some("Temperature 1"), Some("Set Point 1"), Some("Heater 1")]),
        ("tclab/pid_closed_loop_2ch.csv", [Some("T1"), Some("TSP1"), Some("Q1")]),
        (
            "uclouvain_tank_level/final_PI.txt",
            [Some("tank level"), Some("setpoint level"), Some("command PI (du)")],
        ),
        (
            "uclouvain_tank_level/cl-10-0_1_ultimate.txt",
            [Some("column 3"), Some("column 2"), Some("column 5")],
        ),
        (
            "uclouvain_tank_level/exp1_ol3.txt",
            [Some("tank level"), Some("setpoint level"), Some("initial flow u0")],
        ),
        ("uclouvain_tank_level/open_loop_ultimate.txt", [Some("column 3"), None, Some("column 4")]),
        (
            "uclouvain_nmp_circuit/5-3-2-perturbation-non-min-phase.txt",
            [Some("column 4"), Some("column 2"), Some("column 3")],
        ),
        (
            "uclouvain_nmp_circuit/5-4-4-setpoint-step.txt",
            [Some("column 4"), Some("column 2"), Some("column 3")],
        ),
        ("stm32_two_tanks/Open_Loop.csv", [Some("2"), None, Some("3")]),
        (
            "kspice_sim/Step0001_untuned.txt",
            [
                Some("23LIC0001:Measurement"),
                Some("23LIC0001:InternalSetpoint"),
                Some("23LIC0001:ControllerOutput"),
            ],
        ),
        (
            "refinery_loops/stic_2111PIC10201_0903_0006_Stick1=0.txt",
            [Some("2111PIC10201.PV"), Some("2111PIC10201.SV"), Some("2111PIC10201.MV")],
        ),
    ];
    for (file, expected) in cases {
        let Some(bytes) = read_log(file) else {
            return skip("proposes_the_columns_of_real_logs", "no VASOS_TEST_DATA");
        };
        let roles = import_bytes(&bytes).report.roles;
        assert_eq!([roles.pv.as_deref(), roles.sp.as_deref(), roles.mv.as_deref()], expected, "{file}");
    }
}

#[test]
fn reads_what_is_odd_in_real_logs() {
    let Some(bytes) = read_log("uclouvain_tank_level/exp1_ol3.txt") else {
        return skip("reads_what_is_odd_in_real_logs", "no VASOS_TEST_DATA");
    };
    let log = import_bytes(&bytes);
    assert!(matches!(log.report.repairs[..], [Repair::TimeRestart { line: 240, .. }]));
    assert_eq!(log.table.len(), 3133);
    let bytes = read_log("refinery_loops/stic_RHT.7050-342_FIC10112_0630_0002_Stick1=1.txt").expect("a log");
    let log = import_bytes(&bytes);
    assert_eq!(log.report.header_line, Some(3));
    assert!(matches!(log.report.repairs[..], [Repair::DuplicateStamps { count: 25, line: 36 }]));
    assert_eq!(log.table.start, LogStart::Calendar("2024-06-29T21:54:50".to_owned()));
    let bytes = read_log("tclab/fnr13_openloop_train.mat").expect("a log");
    assert_eq!(refused(&bytes), ImportError::Foreign { format: "a MATLAB file" });
}

#[test]
fn survives_every_file_there_is() {
    let seen = for_each_log(|path, bytes| match import_log(path, bytes, &ImportOptions::default()) {
        Ok(log) => {
            assert!(log.table.len() > 1, "{path}");
            println!("{path}: {:?}", log.report.roles);
        }
        Err(error) => println!("{path}: {error}"),
    });
    if seen == 0 {
        skip("survives_every_file_there_is", "no VASOS_TEST_DATA");
    }
}
