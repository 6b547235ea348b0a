//! Names of columns and forms of time as other countries, PLCs, recorders and operating systems write them.

use vasos_engine::signal::LogStart;
use vasos_io::log::{ImportOptions, ImportedLog, Repair, TimeKind, import_log, open_logs};

/// The time of a row.
type Stamp = fn(usize) -> String;

fn import(text: &str) -> ImportedLog {
    import_log("test", text.as_bytes(), &ImportOptions::default()).expect("a log")
}

/// Rows `k` from 0 to `n`, each made by `row`, under `header`.
fn rows(header: &str, n: usize, row: impl Fn(usize) -> String) -> String {
    let rows: Vec<String> = (0..n).map(row).collect();
    format!("{header}\n{}\n", rows.join("\n"))
}

fn names(log: &ImportedLog) -> Vec<&str> {
    log.table.columns.iter().map(|c| c.name.as_str()).collect()
}

fn roles(log: &ImportedLog) -> [Option<&str>; 4] {
    let r = &log.report.roles;
    [r.pv.as_deref(), r.sp.as_deref(), r.mv.as_deref(), r.mode.as_deref()]
}

fn starts(log: &ImportedLog, iso: &str) {
    assert_eq!(log.table.start, LogStart::Calendar(iso.to_owned()), "{:?}", log.report);
}

/// That rows are `step_s` apart, to what a double of their clock can tell.
fn steps(log: &ImportedLog, n: usize, step_s: f64) {
    assert_eq!(log.table.len(), n, "{:?}", log.report);
    let off = |(k, t): (usize, &f64)| (t - k as f64 * step_s).abs() > 1e-4;
    assert!(!log.table.time_s.iter().enumerate().any(off), "{:?}: {:?}", log.report, &log.table.time_s[..3]);
}

fn pv(k: usize) -> f64 {
    50.0 + (k as f64 * 0.7).sin() * 3.0
}

fn mv(k: usize) -> f64 {
    40.0 + (k as f64 * 0.7 + 1.0).cos() * 5.0
}

#[test]
fn a_flag_is_no_mode() {
    let flags: [(&str, [&str; 2]); 4] = [
        ("PumpOn", ["FALSE", "TRUE"]),
        ("P101.Running", ["false", "true"]),
        ("HighAlarm", ["OFF", "ON"]),
        ("Pump status", ["Stopped", "Running"]),
    ];
    for (name, words) in flags {
        let log = import(&rows(&format!("Time,LIC101.PV,LIC101.OP,{name}"), 60, |k| {
            format!("2024-03-05 14:00:{k:02},{:.4},{:.4},{}", pv(k), mv(k), words[usize::from(k > 20)])
        }));
        assert_eq!(roles(&log), [Some("LIC101.PV"), None, Some("LIC101.OP"), None], "{name}");
    }
    let log = import(&rows("Time,LIC101.PV,LIC101.OP,AlarmOn", 60, |k| {
        format!("2024-03-05 14:00:{k:02},{:.4},{:.4},{}", pv(k), mv(k), u8::from(k > 20))
    }));
    assert_eq!(roles(&log)[3], None);
    let modes: [(&str, [&str; 2]); 6] = [
        ("LIC101.MODE", ["0", "1"]),
        ("State", ["MAN", "AUTO"]),
        ("LIC101.MD", ["Manual", "Automatic"]),
        ("block", ["CAS", "RCAS"]),
        ("Stellung", ["Hand", "Automatik"]),
        ("place", ["LOCAL", "REMOTE"]),
    ];
    for (name, words) in modes {
        let log = import(&rows(&format!("Time,LIC101.PV,LIC101.OP,PumpOn,{name}"), 60, |k| {
            let second = usize::from(k > 20);
            let flag = ["TRUE", "FALSE"][second];
            format!("2024-03-05 14:00:{k:02},{:.4},{:.4},{flag},{}", pv(k), mv(k), words[second])
        }));
        assert_eq!(roles(&log)[3], Some(name));
    }
}

#[test]
fn names_in_other_languages() {
    for [pv_name, sp_name, mv_name] in [
        ["Istwert", "Sollwert", "Stellwert"],
        ["Temperatur Ist", "Temperatur Soll", "Stellgröße"],
        ["Isttemperatur", "Solltemperatur", "Reglerausgang"],
        ["Medición", "Consigna", "Salida"],
        ["Medida", "Punto de ajuste", "Salida del controlador"],
        ["测量值", "设定值", "输出"],
        ["温度测量值", "温度设定值", "阀门输出"],
        ["現在値", "目標値", "操作量"],
        ["Mesure", "Consigne", "Sortie"],
        ["Nível", "Ajuste", "Saída"],
        ["Измерение", "Задание", "Выход"],
        ["Температура", "Уставка", "Клапан"],
        ["Meetwaarde", "Setpunt", "Uitgang"],
        ["Misura", "Riferimento", "Uscita"],
        ["Pomiar", "Wartość zadana", "Wyjście"],
    ] {
        // The order of columns must not help.
        let log = import(&rows(&format!("t;{mv_name};{sp_name};{pv_name}"), 60, |k| {
            format!("{k};{:.4};{};{:.4}", mv(k), if k < 30 { 20 } else { 70 }, pv(k))
        }));
        assert_eq!(roles(&log), [Some(pv_name), Some(sp_name), Some(mv_name), None]);
    }
    let log =
        import(&rows("t;Temperatura de salida;Válvula", 60, |k| format!("{k};{:.4};{:.4}", pv(k), mv(k))));
    assert_eq!(roles(&log)[..3], [Some("Temperatura de salida"), None, Some("Válvula")]);
}

#[test]
fn stamps_of_other_systems() {
    let cases: [(&str, Stamp); 14] = [
        ("Windows in Spanish", |k| format!("28/06/2024 02:35:{k:02} p. m.")),
        ("the same with hard blanks", |k| format!("28/06/2024 2:35:{k:02}\u{a0}p.\u{a0}m.")),
        ("the same, narrow", |k| format!("28/06/2024, 2:35:{k:02}\u{202f}p.\u{a0}m.")),
        ("IEC 61131-3", |k| format!("DT#2024-06-28-14:35:{k:02}")),
        ("IEC 61131-3, long", |k| format!("DATE_AND_TIME#2024-06-28-14:35:{k:02}.000")),
        ("Siemens", |k| format!("DTL#2024-06-28-14:35:{k:02}.000000000")),
        ("Codesys", |k| format!("LDT#2024-06-28-14:35:{k:02}.5").replace(".5", "")),
        ("day of the year", |k| format!("2024-180 14:35:{k:02}")),
        ("day of the year, ISO", |k| format!("2024-180T14:35:{k:02}Z")),
        ("day of the year, points", |k| format!("2024.180 14:35:{k:02}")),
        ("day of the year, colons", |k| format!("2024:180:14:35:{k:02}")),
        ("day of the year, slash", |k| format!("2024/180 14:35:{k:02}.000")),
        ("FILETIME", |k| format!("{}", 133_640_589_000_000_000_u64 + 10_000_000 * k as u64)),
        (".NET", |k| format!("{}", 638_551_821_000_000_000_u64 + 10_000_000 * k as u64)),
    ];
    for (name, stamp) in cases {
        let log = import(&rows("Time;PV;MV", 60, |k| format!("{};{:.4};{:.4}", stamp(k), pv(k), mv(k))));
        starts(&log, "2024-06-28T14:35:00");
        steps(&log, 60, 1.0);
        assert!(log.report.repairs.is_empty(), "{name}: {:?}", log.report.repairs);
    }
    let morning = import(&rows("Hora;PV", 60, |k| format!("12:05:{k:02} a. m.;{:.2}", pv(k))));
    assert_eq!(morning.table.start, LogStart::Seconds(300.0));
}

/// `T#1h2m3s` counts from a start of its own; days and thousandths are in it.
#[test]
fn durations_of_iec_61131() {
    let spelled = |ms: usize| {
        let (d, h, m, s) = (ms / 86_400_000, ms / 3_600_000 % 24, ms / 60_000 % 60, ms / 1000 % 60);
        let mut text = "T#".to_owned();
        for (value, unit) in [(d, "d"), (h, "h"), (m, "m"), (s, "s"), (ms % 1000, "ms")] {
            if value > 0 {
                text += &format!("{value}{unit}");
            }
        }
        if text.len() == 2 { "T#0ms".to_owned() } else { text }
    };
    let log = import(&rows("Time,PV,MV", 200, |k| format!("{},{:.4},{:.4}", spelled(700 * k), pv(k), mv(k))));
    steps(&log, 200, 0.7);
    let log = import(&rows("Time,PV,MV", 50, |k| {
        format!("{},{:.4},{:.4}", spelled(3_600_000 * (20 + k)), pv(k), mv(k))
    }));
    steps(&log, 50, 3600.0);
    let upper = rows("Time,PV,MV", 50, |k| format!("TIME#{k}.5S,{:.4},{:.4}", pv(k), mv(k)));
    steps(&import(&upper), 50, 1.0);
    let clock = rows("Time,PV,MV", 50, |k| format!("TOD#23:59:{k:02},{:.4},{:.4}", pv(k), mv(k)));
    steps(&import(&clock), 50, 1.0);
}

/// The clock of a log of Unix has no year: none is made up.
#[test]
fn syslog_stamps_have_no_year() {
    let log = import(&rows("time,PV,MV", 60, |k| format!("Jan  5 12:00:{k:02},{:.4},{:.4}", pv(k), mv(k))));
    steps(&log, 60, 1.0);
    assert_eq!(log.table.start, LogStart::Seconds(4.0 * 86_400.0 + 12.0 * 3600.0));
    assert_eq!(log.report.repairs, [Repair::NoYear]);
    // Over the turn of the year, and over a February that may have had 28 days.
    let turn = |k: usize| {
        if k < 30 { format!("Dec 31 23:59:{:02}", 30 + k) } else { format!("Jan  1 00:00:{:02}", k - 30) }
    };
    let log = import(&rows("time;PV;MV", 60, |k| format!("{};{:.4};{:.4}", turn(k), pv(k), mv(k))));
    steps(&log, 60, 1.0);
    let turn = |k: usize| {
        if k < 30 {
            format!("Feb 28 23:59:{:02}.500", 30 + k)
        } else {
            format!("Mar  1 00:00:{:02}.500", k - 30)
        }
    };
    let log = import(&rows("time;PV;MV", 60, |k| format!("{};{:.4};{:.4}", turn(k), pv(k), mv(k))));
    steps(&log, 60, 1.0);
}

#[test]
fn a_column_for_each_part_of_the_time() {
    let cases: [(&str, Stamp); 9] = [
        ("Year,Month,Day,Hour,Minute,Second", |k| format!("2024,6,28,14,35,{k}")),
        ("YYYY,MM,DD,hh,mm,ss,ms", |k| format!("2024,06,28,14,35,{k:02},000")),
        ("Day,Month,Year,Hour,Min,Sec", |k| format!("28,6,2024,14,35,{k}")),
        ("Año,Mes,Día,Hora,Minuto,Segundo", |k| format!("2024,6,28,14,35,{k}.0")),
        ("Ano,Mês,Dia,Hora,Minuto,Segundo", |k| format!("24,6,28,14,35,{k}")),
        ("Jahr,Monat,Tag,Stunde,Minute,Sekunde", |k| format!("2024,6,28,14,35,{k}")),
        ("Date,Hour,Minute,Second", |k| format!("2024-06-28,14,35,{k}")),
        ("Year,DOY,Hour,Minute,Second", |k| format!("2024,180,14,35,{k}")),
        ("Year,Julian Day,HHMM,Seconds", |k| format!("2024,180,1435,{k}")),
    ];
    for (header, stamp) in cases {
        let header = format!("{header},PV,MV");
        let log = import(&rows(&header, 60, |k| format!("{},{:.4},{:.4}", stamp(k), pv(k), mv(k))));
        starts(&log, "2024-06-28T14:35:00");
        steps(&log, 60, 1.0);
        assert_eq!(names(&log), ["PV", "MV"], "{header}");
        assert!(log.report.repairs.is_empty(), "{header}: {:?}", log.report.repairs);
    }
    // Through midnight, the month and the year.
    let log = import(&rows("year;month;day;hour;PV", 60, |k| {
        let (day, hour) = (29 + k / 24, k % 24);
        let (y, m, d) = if day < 32 { (2023, 12, day) } else { (2024, 1, day - 31) };
        format!("{y};{m};{d};{hour};{:.4}", pv(k))
    }));
    starts(&log, "2023-12-29T00:00:00");
    steps(&log, 60, 3600.0);
}

/// A day of the year behind a point is a number to look at, and so are days since noon of 1 January 4713 BC.
#[test]
fn days_that_are_numbers() {
    let log = import(&rows("Date,Time,PV", 60, |k| format!("2024.{:03},14:35:{k:02},{:.4}", 180, pv(k))));
    starts(&log, "2024-06-28T14:35:00");
    steps(&log, 60, 1.0);
    let log = import(&rows("YYYY.DDD,PV", 60, |k| format!("2024.{:03},{:.4}", 100 + k, pv(k))));
    starts(&log, "2024-04-09T00:00:00");
    steps(&log, 60, 86_400.0);
    let log = import(&rows("JD,PV,MV", 60, |k| {
        format!("{:.8},{:.4},{:.4}", 2_459_580.5 + k as f64 / 1440.0, pv(k), mv(k))
    }));
    assert_eq!(log.report.time, TimeKind::JulianDays);
    starts(&log, "2022-01-01T00:00:00");
    assert!((log.table.time_s[59] - 59.0 * 60.0).abs() < 2e-3, "{:?}", log.table.time_s);
    let log = import(&rows("MJD,PV,MV", 60, |k| {
        format!("{:.8},{:.4},{:.4}", 59_580.0 + k as f64 / 1440.0, pv(k), mv(k))
    }));
    starts(&log, "2022-01-01T00:00:00");
}

/// Columns with the names of parts that measure something.
#[test]
fn what_is_no_part_of_the_time_stays() {
    let log = import(&rows("Time,ms", 60, |k| format!("2024-06-28 14:35:{k:02},{}", 20 + k * 7 % 31)));
    assert_eq!(names(&log), ["ms"]);
    let log =
        import(&rows("Time,Min,Max", 60, |k| format!("2024-06-28 14:35:{k:02},{},{}", k % 7, 50 + k % 9)));
    assert_eq!(names(&log), ["Min", "Max"]);
    let log = import(&rows("t,PV", 200, |k| format!("{:.3},{:.4}", 2000.001 + 1e-3 * k as f64, pv(k))));
    steps(&log, 200, 1e-3);
    assert_eq!(log.table.start, LogStart::Seconds(2000.001));
}

#[test]
fn units_of_several_at_once() {
    for (name, unit_s) in [
        ("Time [100ms]", 0.1),
        ("t [0.1 s]", 0.1),
        ("t [0,1s]", 0.1),
        ("Time (10 ms)", 0.01),
        ("Zeit [x 100 ms]", 0.1),
        ("time [5min]", 300.0),
        ("Time (24h)", 3600.0),
        ("Time [100 µs]", 1e-4),
    ] {
        let log = import(&rows(&format!("{name};PV;MV"), 60, |k| format!("{k};{:.4};{:.4}", pv(k), mv(k))));
        steps(&log, 60, unit_s);
        assert!(matches!(log.report.time, TimeKind::Numbers { .. }), "{name}");
    }
}

/// Of daily files only the later ones show which of day and month stands first.
#[test]
fn the_order_of_dates_is_told_by_another_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let day = |day: usize, us: bool| {
        let date = if us { format!("02/{day:02}/2024") } else { format!("{day:02}/02/2024") };
        let path = folder.path().join(format!("{}{day:02}.csv", if us { "us" } else { "eu" }));
        let text = rows("Time,PV,MV", 48, |k| {
            let minutes = 30 * k;
            format!("{date} {:02}:{:02}:00,{:.4},{:.4}", minutes / 60, minutes % 60, pv(k), mv(k))
        });
        std::fs::write(&path, text).expect("a file");
        path
    };
    for us in [true, false] {
        let files: Vec<_> = [11, 12, 13].map(|d| day(d, us)).to_vec();
        let log = open_logs(&files, &ImportOptions::default()).expect("a log");
        starts(&log, "2024-02-11T00:00:00");
        steps(&log, 144, 1800.0);
        let told = |r: &Repair| matches!(r, Repair::DatesByFile { month_first, .. } if *month_first == us);
        let files = &log.report.files;
        assert_eq!(files.iter().filter(|f| f.repairs.iter().any(told)).count(), 2, "{files:?}");
        let doubt = |r: &Repair| matches!(r, Repair::AmbiguousDates { .. });
        assert!(!files.iter().any(|f| f.repairs.iter().any(doubt)), "{files:?}");
    }
}

/// Recorders of Yokogawa have tags and units above the names of date and time, in rows that begin with what they hold.
#[test]
fn yokogawa_recorders() {
    let above = "Device Type,GX10\nSerial No.,S5M600123\nFile Message,\nTime Correction,None\n\
        Starting Condition,Auto\nDividing Condition,Manual\nStarted by,\nStopped by,User\nData Count,60\n\
        Sampling Interval,500,msec\nStart Time,2024/06/28 14:35:00,0\nTrigger Time,2024/06/28 14:35:30,0\n\n\
        Ch.,,,0001,0002,0003\nTag No.,,,TIC101.PV,TIC101.SP,TIC101.MV\nTag,,,Reactor,Setpoint,Steam\n\
        Unit,,,C,C,%\n";
    for (third, fraction) in [("sec", ["0.000", "0.500"]), ("msec", ["0", "500"])] {
        let header = format!("{above}Date,Time,{third},,,");
        let log = import(&rows(&header, 60, |k| {
            format!("2024/06/28,14:35:{:02},{},{:.2},50.0,{:.2}", k / 2, fraction[k % 2], pv(k), mv(k))
        }));
        starts(&log, "2024-06-28T14:35:00");
        steps(&log, 60, 0.5);
        assert_eq!(names(&log), ["TIC101.PV", "TIC101.SP", "TIC101.MV"]);
        let units: Vec<_> = log.table.columns.iter().map(|c| c.unit.as_deref()).collect();
        assert_eq!(units, [Some("C"), Some("C"), Some("%")]);
        assert_eq!(roles(&log), [Some("TIC101.PV"), Some("TIC101.SP"), Some("TIC101.MV"), None]);
        assert!(log.report.repairs.is_empty(), "{:?}", log.report.repairs);
    }
    // Units alone above the row of names.
    let log = import(&rows(",,,degC,m3/h\nDate,Time,sec,TI101,FI102", 60, |k| {
        format!("2024/06/28,14:35:{k:02},0.0,{:.2},{:.2}", pv(k), mv(k))
    }));
    assert_eq!(names(&log), ["TI101", "FI102"]);
    assert_eq!(log.table.columns[1].unit.as_deref(), Some("m3/h"));
    steps(&log, 60, 1.0);
}
