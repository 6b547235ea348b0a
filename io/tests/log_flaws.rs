//! Logs with flaws of the plant and its loggers in them: clocks that were corrected, values that stand for none, blocks
//! of zeros, rows that were cut off, values that the file itself calls bad.

use vasos_engine::signal::LogStart;
use vasos_io::log::{Encoding, ImportOptions, ImportedLog, Repair, import_log};

fn import(text: &str) -> ImportedLog {
    import_bytes(text.as_bytes())
}

fn import_bytes(bytes: &[u8]) -> ImportedLog {
    import_log("test", bytes, &ImportOptions::default()).expect("a log")
}

/// Rows `k` from 0 to `n`, each made by `row`, under `header`.
fn rows(header: &str, n: usize, row: impl Fn(usize) -> String) -> String {
    let rows: Vec<String> = (0..n).map(row).collect();
    format!("{header}\n{}\n", rows.join("\n"))
}

fn column<'a>(log: &'a ImportedLog, name: &str) -> &'a [f64] {
    &log.table.column(name).unwrap_or_else(|| panic!("no {name} in {:?}", log.report)).values
}

fn says(log: &ImportedLog, repair: &Repair) {
    assert!(log.report.repairs.contains(repair), "{repair:?} is not in {:?}", log.report.repairs);
}

/// Values that wander as those of a loop do.
fn pv(k: usize) -> f64 {
    50.0 + (k as f64 * 0.7).sin() * 3.0
}

fn mv(k: usize) -> f64 {
    40.0 + (k as f64 * 0.7 + 1.0).cos() * 5.0
}

/// `14:00:00` and so many seconds.
fn clock(s: usize) -> String {
    let s = 14 * 3600 + s;
    format!("{:02}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60)
}

/// A correction from the network halved the log: only the longer run was kept.
#[test]
fn a_clock_set_back_a_little_goes_on() {
    for back in [3, 45, 400] {
        let log = import(&rows("Time,TIC101.PV,TIC101.OP", 1200, |k| {
            let s = if k < 700 { k } else { k - back };
            format!("2024-03-05 {},{:.3},{:.2}", clock(s), pv(k), mv(k))
        }));
        assert_eq!(log.table.len(), 1200, "{back} s: {:?}", log.report.repairs);
        assert_eq!(log.table.time_s[1199], 1199.0, "{back} s");
        let expected = Repair::ClockStepsBack { count: 1, line: 702, back_s: (back - 1) as f64 };
        assert_eq!(log.report.repairs, [expected], "{back} s");
        assert_eq!(log.table.start, LogStart::Calendar("2024-03-05T14:00:00".to_owned()));
    }
    // Twice, with times that a program counts itself.
    let log = import(&rows("t [s],PV,MV", 900, |k| {
        let back = 5.0 * (k / 300) as f64;
        format!("{:.1},{:.3},{:.2}", 0.5 * k as f64 - back, pv(k), mv(k))
    }));
    assert_eq!((log.table.len(), log.table.time_s[899]), (900, 449.5), "{:?}", log.report.repairs);
    says(&log, &Repair::ClockStepsBack { count: 2, line: 302, back_s: 4.5 });
    // Stamps of whole seconds over rows of fifths.
    let log = import(&rows("Time;PV;MV", 600, |k| {
        let s = if k < 303 { k / 5 } else { k / 5 - 7 };
        format!("05.03.2024 {};{:.3};{:.2}", clock(s), pv(k), mv(k))
    }));
    assert_eq!(log.table.len(), 600, "{:?}", log.report.repairs);
    assert!((log.table.time_s[599] - 119.8).abs() < 1.5, "{}", log.table.time_s[599]);
}

/// A log that was copied behind another with its last rows in both.
#[test]
fn rows_that_come_twice_are_left_out() {
    let row = |k: usize| format!("2024-03-05 {},{:.3},{:.2}", clock(10 * k), pv(k), mv(k));
    let log = import(&rows("Time,PV,MV", 260, |k| row(if k < 150 { k } else { k - 30 })));
    assert_eq!(log.table.len(), 230, "{:?}", log.report.repairs);
    assert_eq!(log.report.repairs, [Repair::RepeatedRows { count: 30, line: 152 }]);
    assert_eq!(log.table.time_s[229], 2290.0);
    assert_eq!(column(&log, "PV")[200], (pv(200) * 1e3).round() / 1e3);
}

/// A run that begins anew is no clock that was corrected.
#[test]
fn a_run_that_begins_anew_is_none_of_the_one_before() {
    let log = import(&rows("time,PV,MV", 500, |k| {
        format!("{},{:.3},{:.2}", if k < 200 { k } else { k - 200 }, pv(k), mv(k))
    }));
    assert_eq!(log.table.len(), 300);
    says(&log, &Repair::TimeRestart { line: 202, back_s: 199.0, from_line: 202, to_line: 501 });
}

#[test]
fn numbers_that_stand_for_none_are_missing() {
    let cases = [
        ("-9999", -9999.0),
        ("-999.25", -999.25),
        ("-999.2500", -999.25),
        ("9.9e37", 9.9e37),
        ("1.00E+38", 1e38),
        ("3.402823E+38", 3.402823e38),
        ("-3.402823E+38", -3.402823e38),
        ("9.96921e36", 9.96921e36),
        ("1.79769313486231E+308", 1.79769313486231E+308),
        ("-99999.00", -99999.0),
    ];
    for (text, value) in cases {
        let log = import(&rows("Date Time,FT101,TT101,FV101", 80, |k| {
            let flow = if [12, 40, 41, 42].contains(&k) { text.to_owned() } else { format!("{:.3}", pv(k)) };
            format!("2024-03-05 {},{flow},{:.2},{:.2}", clock(10 * k), 300.0 + pv(k), mv(k))
        }));
        let flow = column(&log, "FT101");
        assert!([12, 40, 41, 42].iter().all(|&k| flow[k].is_nan()), "{text}");
        assert_eq!(flow.iter().filter(|v| v.is_finite()).count(), 76, "{text}");
        let column = "FT101".to_owned();
        assert_eq!(log.report.repairs, [Repair::StandIns { column, count: 4, line: 14, value }], "{text}");
    }
    // One alone, beside flows of thousands, from a logger of 16 bits as well.
    for (text, base) in [("-9999", 4000.0), ("-32768", 20.0), ("-999", 600.0)] {
        let log = import(&rows("t;flow;valve", 60, |k| {
            let flow = if k == 30 { text.to_owned() } else { format!("{:.1}", base + pv(k)) };
            format!("{k};{flow};{:.1}", mv(k))
        }));
        assert!(column(&log, "flow")[30].is_nan(), "{text}: {:?}", log.report.repairs);
    }
}

/// What the C library of Windows prints for what is no number.
#[test]
fn words_of_windows_for_no_number_are_missing() {
    for word in ["1.#QNAN", "-1.#IND", "1.#INF", "1.#R", "1.#J", "nan", "-nan(ind)", "Infinity"] {
        let log = import(&rows("t,PV,MV,spare", 40, |k| {
            let lost = k < 4 || k == 20;
            let [a, b] = [pv(k), mv(k)].map(|v| if lost { word.to_owned() } else { format!("{v:.3}") });
            format!("{k},{a},{b},{word}")
        }));
        assert_eq!(log.table.len(), 40, "{word}: {:?}", log.report);
        assert_eq!(log.report.header_line, Some(1), "{word}");
        assert_eq!(column(&log, "PV").iter().filter(|v| v.is_nan()).count(), 5, "{word}");
        let text = word.to_owned();
        says(&log, &Repair::MissingValues { column: "PV".into(), count: 5, line: 2, text });
        assert_eq!(log.report.roles.mode, None, "{word}");
        assert!(log.table.column("spare").is_none_or(|c| c.states.is_empty()), "{word}");
    }
}

#[test]
fn a_column_that_runs_there_keeps_its_numbers() {
    let log = import(&rows("t,position,level", 200, |k| {
        format!("{k},{},{:.2}", -9999 + 90 * (k as i64 - 100).abs(), pv(k))
    }));
    assert!(column(&log, "position").iter().all(|v| v.is_finite()), "{:?}", log.report.repairs);
    assert!(column(&log, "position").contains(&-9999.0));
    // Pulses, powers of ten and a limit that is reached now and then.
    for text in ["1000,9999", "-500,-999", "0.5,1e12", "30000,32767"] {
        let (low, high) = text.split_once(',').expect("two");
        let log = import(&rows("t,x,level", 100, |k| {
            let base: f64 = low.parse().expect("a number");
            let x = if k % 10 == 9 { high.to_owned() } else { format!("{}", base * (1 + k % 9) as f64) };
            format!("{k},{x},{:.2}", pv(k))
        }));
        assert!(column(&log, "x").iter().all(|v| v.is_finite()), "{text}: {:?}", log.report.repairs);
    }
}

/// What a crash of the computer leaves: the row that was being written is cut off, zeros fill the block of the disk.
#[test]
fn a_block_of_zeros_takes_no_rows_with_it() {
    let row = |k: usize| format!("2024-03-05 {};{:.3};{:.3};AUTO\r\n", clock(5 * k), pv(k), mv(k));
    for torn in [0, 12, 30, 36] {
        let mut bytes = b"Time;LIC101.PV;LIC101.OP;LIC101.MODE\r\n".to_vec();
        (0..120).for_each(|k| bytes.extend(row(k).bytes()));
        bytes.extend(&row(120).as_bytes()[..torn]);
        bytes.extend([0; 3000]);
        (140..260).for_each(|k| bytes.extend(row(k).bytes()));
        let log = import_bytes(&bytes);
        let r = &log.report.repairs;
        assert_eq!(log.table.len(), 240, "{torn}: {r:?}");
        assert_eq!(log.table.time_s[120], 700.0, "{torn}");
        assert_eq!(log.table.column("LIC101.MODE").map(|c| c.states.len()), Some(1), "{torn}");
        says(&log, &Repair::Zeros { bytes: 3000, line: 122 });
        let cut = |r: &Repair| matches!(r, Repair::TornRow { line: 122 });
        assert_eq!(r.iter().any(cut), torn > 0, "{torn}: {r:?}");
        assert_eq!(column(&log, "LIC101.PV")[119], (pv(119) * 1e3).round() / 1e3);
        assert_eq!(column(&log, "LIC101.PV")[120], (pv(140) * 1e3).round() / 1e3);
    }
    // At the end of the file, a row cut off ahead of them and one behind.
    for behind in ["", "2024-03-05 14:20:00;51.2"] {
        let mut bytes = b"Time;LIC101.PV;LIC101.OP;LIC101.MODE\r\n".to_vec();
        (0..60).for_each(|k| bytes.extend(row(k).bytes()));
        bytes.extend(b"2024-03-05 14:05:00;5");
        bytes.extend([0; 512]);
        bytes.extend(behind.bytes());
        let log = import_bytes(&bytes);
        let cut = log.report.repairs.iter().filter(|r| matches!(r, Repair::TornRow { line: 62 })).count();
        assert_eq!(
            (log.table.len(), cut),
            (60, 1 + usize::from(!behind.is_empty())),
            "{:?}",
            log.report.repairs
        );
        says(&log, &Repair::Zeros { bytes: 512, line: 62 });
    }
    // In a file longer than the stretch by which it is judged, and more zeros than a line may have letters.
    let mut bytes = b"t,PV,MV\n".to_vec();
    let row = |k: usize| format!("{k}.0,{:.3},{:.3}\n", pv(k), mv(k));
    (0..60_000).for_each(|k| bytes.extend(row(k).bytes()));
    bytes.extend(vec![0; 2_500_000]);
    (60_010..90_000).for_each(|k| bytes.extend(row(k).bytes()));
    let log = import_bytes(&bytes);
    assert_eq!(log.table.len(), 89_990, "{:?}", log.report.repairs);
    says(&log, &Repair::Zeros { bytes: 2_500_000, line: 60_002 });
}

#[test]
fn a_file_of_bytes_is_still_no_text() {
    let bytes: Vec<u8> = (0..4000_u32).map(|k| (k * k % 251) as u8).chain([0; 64]).chain([7; 64]).collect();
    assert!(import_log("test", &bytes, &ImportOptions::default()).is_err());
}

/// Copied while it was being written: whatever is left of the last row, no number of it is a wrong one.
#[test]
fn a_row_that_is_cut_off_gives_no_wrong_number() {
    let text = rows("Time,PV,SP,MV", 60, |k| {
        format!("2024-03-05 {},{:.4},50.0000,{:.4}", clock(5 * k), pv(k), mv(k))
    });
    let whole = import(&text);
    let begin = text.trim_end().rfind('\n').expect("rows") + 1;
    for end in begin + 1..text.len() - 1 {
        let log = import(&text[..end]);
        assert_eq!(log.table.len(), 59, "'{}': {:?}", &text[begin..end], log.report.repairs);
        assert_eq!(log.report.repairs, [Repair::TornRow { line: 61 }], "'{}'", &text[begin..end]);
    }
    // Whole, but for its line end.
    assert_eq!(import(&text[..text.len() - 1]).table, whole.table);
    let crlf = text.replace('\n', "\r\n");
    let log = import(&crlf[..crlf.len() - 1]);
    assert_eq!((log.table.len(), log.report.repairs.len()), (60, 0));
    // Numbers as short as they come: only what is shorter than all others is doubtful.
    let short = rows("t,PV,n", 40, |k| format!("{k},{},{}", pv(k), 100 + k));
    assert_eq!(import(short.trim_end()).table.len(), 40);
    assert_eq!(import(&short.trim_end()[..short.len() - 3]).report.repairs, [Repair::TornRow { line: 41 }]);
    // A word that is the beginning of another.
    let words = rows("t,PV,mode", 40, |k| format!("{k},{:.4},{}", pv(k), ["MAN", "AUTO"][k / 20]));
    let log = import(&words[..words.len() - 2]);
    assert_eq!(log.report.repairs, [Repair::TornRow { line: 41 }]);
    assert_eq!(log.table.column("mode").map(|c| c.states.len()), Some(2));
}

#[test]
fn values_called_bad_beside_them_are_missing() {
    let bad = |k: usize| if (30..35).contains(&k) { "Bad" } else { "Good" };
    let spoilt = |k: usize| if (30..35).contains(&k) { 0.0 } else { pv(k) };
    let wide = rows("Time,TIC101.PV,Quality,FIC102.PV,Quality", 80, |k| {
        format!("2024-03-05 {},{:.3},{},{:.3},Good", clock(5 * k), spoilt(k), bad(k), mv(k))
    });
    let named = rows("Time;TIC101.PV;FIC102.PV;TIC101.PV Status;FIC102.PV Status", 80, |k| {
        format!("2024-03-05 {};{:.3};{:.3};{};Good", clock(5 * k), spoilt(k), mv(k), bad(k))
    });
    let words = rows("Time\tTIC101.PV\tTIC101.Q\tFIC102.PV\tFIC102.Q", 80, |k| {
        let q = if bad(k) == "Bad" { "Bad, Not Connected" } else { "Good, Non-specific" };
        format!("2024-03-05 {}\t{:.3}\t{q}\t{:.3}\tGood, Non-specific", clock(5 * k), spoilt(k), mv(k))
    });
    let opc = rows("Time,TIC101.PV,TIC101.Quality,FIC102.PV,FIC102.Quality", 80, |k| {
        let q = if bad(k) == "Bad" { 24 } else { 192 };
        format!("2024-03-05 {},{:.3},{q},{:.3},192", clock(5 * k), spoilt(k), mv(k))
    });
    for text in [wide, named, words, opc] {
        let log = import(&text);
        let header = text.lines().next();
        let values = column(&log, "TIC101.PV");
        assert!((30..35).all(|k| values[k].is_nan()), "{header:?}: {:?}", log.report.repairs);
        assert_eq!(values.iter().filter(|v| v.is_nan()).count(), 5, "{header:?}");
        assert!(column(&log, "FIC102.PV").iter().all(|v| v.is_finite()), "{header:?}");
        let told = |r: &Repair| matches!(r, Repair::BadQuality { count: 5, line: 32, .. });
        assert_eq!(log.report.repairs.iter().filter(|r| told(r)).count(), 1, "{:?}", log.report.repairs);
        assert_eq!((log.report.repairs.len(), &log.report.roles.mode), (1, &None), "{header:?}");
    }
}

/// Heat in watts and states of a plant say nothing of the values beside them.
#[test]
fn what_is_no_quality_spoils_no_values() {
    for (name, words) in [
        ("Q", ["192", "20"]),
        ("Plant", ["Normal", "No flow"]),
        ("Pump", ["OK", "Bad"]),
        ("Valve", ["TRUE", "FALSE"]),
        ("Alarm", ["NO", "YES"]),
    ] {
        let log = import(&rows(&format!("t,PV,{name},MV"), 80, |k| {
            format!("{k},{:.4},{},{:.4}", pv(k), words[usize::from(k % 20 > 12)], mv(k))
        }));
        let whole = |name: &str| column(&log, name).iter().all(|v| v.is_finite());
        assert!(whole("PV") && whole("MV"), "{name}: {:?}", log.report.repairs);
    }
}

/// As a text editor of Unix or an export for statistics writes it.
#[test]
fn utf32_with_a_mark() {
    let text = rows("tempo\tnível\tvazão", 500, |k| format!("{k}\t{:.3}\t{:.3}", pv(k), mv(k)));
    let plain = import(&text);
    for big in [false, true] {
        let bytes = |c: u32| if big { c.to_be_bytes() } else { c.to_le_bytes() };
        let bytes: Vec<u8> =
            std::iter::once(0xFEFF).chain(text.chars().map(u32::from)).flat_map(bytes).collect();
        let log = import_bytes(&bytes);
        assert_eq!(log.table, plain.table);
        assert_eq!(log.report.text().map(|t| t.encoding), Some(Encoding::Utf32));
        // A letter cut in two, and one that does not exist.
        let log = import_bytes(&bytes[..bytes.len() - 3]);
        assert_eq!(log.table.len(), 500);
    }
}
