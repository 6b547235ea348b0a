//! Small sound logs of many kinds, to be damaged.

/// A log as header and rows of fields.
#[derive(Debug, Clone)]
pub struct Seed {
    pub header: String,
    pub header_lines: usize,
    /// Names of the fields.
    pub names: Vec<String>,
    pub rows: Vec<Vec<String>>,
    separator: &'static str,
    /// Whether a row is a moment.
    pub is_table: bool,
}

impl Seed {
    pub fn bytes(&self) -> Vec<u8> {
        let rows: Vec<String> = self.rows.iter().map(|row| row.join(self.separator)).collect();
        format!("{}{}\n", self.header, rows.join("\n")).into_bytes()
    }

    fn new(names: &[&str], separator: &'static str, row: impl Fn(usize) -> Vec<String>) -> Self {
        Self {
            header: format!("{}\n", names.join(separator)),
            header_lines: 1,
            names: names.iter().map(|n| (*n).to_owned()).collect(),
            rows: (0..40).map(row).collect(),
            separator,
            is_table: true,
        }
    }
}

fn wave(k: usize, shift: f64) -> f64 {
    50.0 + (k as f64 * 0.7 + shift).sin() * 3.0
}

fn comma(text: String) -> String {
    text.replace('.', ",")
}

/// The seeds, always the same.
pub fn log_seeds() -> Vec<Seed> {
    let point = |k: usize, shift: f64| format!("{:.4}", wave(k, shift));
    let mode = |k: usize| if k < 20 { "AUTO" } else { "MAN" }.to_owned();
    let plain = Seed::new(&["time", "level", "pump", "sp"], ",", |k| {
        vec![format!("{:.1}", 0.2 * k as f64), point(k, 0.0), point(k, 1.0), "50".to_owned()]
    });
    let german = Seed::new(&["Zeit", "LIC101.PV", "LIC101.SP", "LIC101.OUT", "LIC101.MODE"], ";", |k| {
        let stamp = format!("28.06.2024 14:35:{k:02}");
        vec![stamp, comma(point(k, 0.0)), "50,0".to_owned(), comma(point(k, 2.0)), mode(k)]
    });
    let tabs = Seed::new(&["Date", "Clock", "PV", "MV"], "\t", |k| {
        vec![
            "2024/06/28".to_owned(),
            format!("14:35:{k:02}.250"),
            point(k, 0.0),
            format!("{:e}", wave(k, 1.0)),
        ]
    });
    let epoch = Seed::new(&["timestamp", "TT1", "Q1"], "|", |k| {
        vec![format!("{}", 1_719_585_300 + 10 * k), point(k, 0.0), point(k, 1.0)]
    });
    let wincc = Seed {
        is_table: false,
        ..Seed::new(&["VarName", "TimeString", "VarValue", "Validity"], ";", |k| {
            let tag = ["LIC_PV", "LIC_MV"][k % 2].to_owned();
            vec![tag, format!("28.06.2024 14:35:{:02}", k / 2), comma(point(k, 0.0)), "1".to_owned()]
        })
    };
    let pairs = Seed {
        is_table: false,
        ..Seed::new(&["Time", "A.PV", "Time", "B.MV"], ",", |k| {
            let stamp = |s: usize| format!("2024-06-28T14:{s:02}:00+02:00");
            vec![stamp(k), point(k, 0.0), stamp(k + 3), point(k, 1.0)]
        })
    };
    let serial = Seed {
        is_table: false,
        ..Seed::new(&[""], ",", |k| {
            vec![format!("14:35:{k:02}.120 -> T1:{}", point(k, 0.0)), format!("Q1:{}", point(k, 1.0))]
        })
    };
    vec![plain, german, tabs, epoch, wincc, pairs, serial]
}
