//! Frequency responses from files: CSV of points, or the JSON that `vasos excite --sine … --json` prints.

use std::f64::consts::PI;
use std::path::Path;

use num_complex::Complex64;
use serde_json::Value;
use vasos_engine::analyze::{FrequencyResponse, FrequencyResponseError};
use vasos_engine::explain::Explain;

/// Largest file that is read: some 10⁵ points.
const MOST_BYTES: u64 = 16 << 20;

/// Why a file is not a frequency response.
#[derive(Debug, thiserror::Error)]
pub enum FrequencyFileError {
    /// It cannot be read.
    #[error("{path} cannot be read: {reason}")]
    Read {
        /// The file.
        path: String,
        /// What the system says.
        reason: String,
    },
    /// The columns are not those of a frequency response.
    #[error(
        "{path} has the columns {columns}: a frequency response needs omega_rad_s (or f_hz), and re and im, or gain (or db) and phase_deg"
    )]
    Columns {
        /// The file.
        path: String,
        /// Those it has.
        columns: String,
    },
    /// A value that is no number.
    #[error("{path}, line {line}: '{text}' is not a number; write decimals with a point")]
    Number {
        /// The file.
        path: String,
        /// Its line, from 1.
        line: usize,
        /// As it stands there.
        text: String,
    },
    /// JSON without points.
    #[error("{path} is JSON, but holds no 'frequencies' as vasos excite --sine --json prints them")]
    NoFrequencies {
        /// The file.
        path: String,
    },
    /// The points cannot be used.
    #[error("{0}")]
    Points(FrequencyResponseError),
}

impl FrequencyFileError {
    /// One of each kind of its own, for the test that compares them with the translation files.
    #[must_use]
    pub fn samples() -> Vec<Self> {
        let path = || "response.csv".to_owned();
        vec![
            Self::Read { path: path(), reason: "no such file".to_owned() },
            Self::Columns { path: path(), columns: "a, b".to_owned() },
            Self::Number { path: path(), line: 3, text: "bad".to_owned() },
            Self::NoFrequencies { path: path() },
        ]
    }
}

impl Explain for FrequencyFileError {
    fn key(&self) -> &'static str {
        match self {
            Self::Read { .. } => "frequency_file.read",
            Self::Columns { .. } => "frequency_file.columns",
            Self::Number { .. } => "frequency_file.number",
            Self::NoFrequencies { .. } => "frequency_file.no_frequencies",
            Self::Points(error) => error.key(),
        }
    }

    fn args(&self) -> Vec<(&'static str, String)> {
        match self {
            Self::Read { path, reason } => vec![("path", path.clone()), ("reason", reason.clone())],
            Self::Columns { path, columns } => vec![("path", path.clone()), ("columns", columns.clone())],
            Self::Number { path, line, text } => {
                vec![("path", path.clone()), ("line", line.to_string()), ("text", text.clone())]
            }
            Self::NoFrequencies { path } => vec![("path", path.clone())],
            Self::Points(error) => error.args(),
        }
    }
}

/// Reads a frequency response; points may come in any order.
///
/// CSV with a header, decimals with a point, or with a comma where commas part no columns: `omega_rad_s` in rad/s or `f_hz` in Hz; `re` and `im`, or `gain` (PV units per MV unit) or `db`, and
/// `phase_deg`. JSON: an array `frequencies` of objects with `omega_rad_s` (or `w_rad_s`), `re`, `im`, wherever it stands.
///
/// # Errors
/// [`FrequencyFileError`] with the file, its line and what is expected.
pub fn read_frequency_response(path: &Path) -> Result<FrequencyResponse, FrequencyFileError> {
    let shown = path.display().to_string();
    let refused = |reason: String| FrequencyFileError::Read { path: shown.clone(), reason };
    let bytes = std::fs::metadata(path).map_err(|e| refused(e.to_string()))?.len();
    if bytes > MOST_BYTES {
        return Err(refused(format!("{bytes} bytes are too many for a frequency response")));
    }
    let text = std::fs::read(path).map_err(|e| refused(e.to_string()))?;
    let text = String::from_utf8_lossy(&text);
    let text = text.trim_start_matches('\u{feff}');
    let mut points = if text.trim_start().starts_with(['{', '[']) {
        of_json(&shown, text)?
    } else {
        of_csv(&shown, text)?
    };
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    FrequencyResponse::new(&points).map_err(FrequencyFileError::Points)
}

fn of_json(path: &str, text: &str) -> Result<Vec<(f64, Complex64)>, FrequencyFileError> {
    let nothing = || FrequencyFileError::NoFrequencies { path: path.to_owned() };
    let whole: Value = serde_json::from_str(text)
        .map_err(|e| FrequencyFileError::Read { path: path.to_owned(), reason: e.to_string() })?;
    let list = frequencies(&whole).ok_or_else(nothing)?;
    let point = |p: &Value| {
        let of = |key: &str| p.get(key).and_then(Value::as_f64);
        Some((of("omega_rad_s").or(of("w_rad_s"))?, Complex64::new(of("re")?, of("im")?)))
    };
    list.iter().map(|p| point(p).ok_or_else(nothing)).collect()
}

fn frequencies(value: &Value) -> Option<&Vec<Value>> {
    match value {
        Value::Object(map) => match map.get("frequencies").and_then(Value::as_array) {
            Some(list) => Some(list),
            None => map.values().find_map(frequencies),
        },
        Value::Array(list) => list.iter().find_map(frequencies),
        _ => None,
    }
}

/// Places of the columns and how they are read.
struct Columns {
    frequency: (usize, f64),
    parts: [usize; 2],
    kind: Kind,
}

#[derive(Clone, Copy)]
enum Kind {
    ReIm,
    GainPhase,
    DecibelPhase,
}

fn columns_of(path: &str, header: &csv::StringRecord) -> Result<Columns, FrequencyFileError> {
    let names: Vec<String> = header.iter().map(|n| n.trim().to_lowercase()).collect();
    let at = |wanted: &[&str]| names.iter().position(|n| wanted.contains(&n.as_str()));
    let frequency = at(&["omega_rad_s", "omega", "w", "w_rad_s"])
        .map(|i| (i, 1.0))
        .or_else(|| at(&["f_hz", "f", "frequency_hz", "hz"]).map(|i| (i, 2.0 * PI)));
    let both = |a: &[&str], b: &[&str]| at(a).zip(at(b)).map(|(a, b)| [a, b]);
    let phase = ["phase_deg", "phase", "arg_deg"];
    let parts = both(&["re", "real"], &["im", "imag"])
        .map(|p| (p, Kind::ReIm))
        .or_else(|| both(&["gain", "magnitude", "abs"], &phase).map(|p| (p, Kind::GainPhase)))
        .or_else(|| both(&["db", "gain_db", "magnitude_db"], &phase).map(|p| (p, Kind::DecibelPhase)));
    match (frequency, parts) {
        (Some(frequency), Some((parts, kind))) => Ok(Columns { frequency, parts, kind }),
        _ => Err(FrequencyFileError::Columns { path: path.to_owned(), columns: names.join(", ") }),
    }
}

fn of_csv(path: &str, text: &str) -> Result<Vec<(f64, Complex64)>, FrequencyFileError> {
    let first = text.lines().find(|line| !line.starts_with('#')).unwrap_or_default();
    let separator = [b';', b'\t', b','].into_iter().find(|s| first.as_bytes().contains(s)).unwrap_or(b',');
    let mut reader = csv::ReaderBuilder::new()
        .delimiter(separator)
        .flexible(true)
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes());
    let refused = |e: csv::Error| FrequencyFileError::Read { path: path.to_owned(), reason: e.to_string() };
    let columns = columns_of(path, reader.headers().map_err(refused)?)?;
    let mut points = Vec::new();
    for (k, row) in reader.records().enumerate() {
        let row = row.map_err(refused)?;
        let number = |column: usize| {
            let text = row.get(column).unwrap_or_default();
            let point = if separator == b',' { text.to_owned() } else { text.replace(',', ".") };
            point.parse::<f64>().map_err(|_| FrequencyFileError::Number {
                path: path.to_owned(),
                line: k + 2,
                text: text.to_owned(),
            })
        };
        let omega = number(columns.frequency.0)? * columns.frequency.1;
        let (a, b) = (number(columns.parts[0])?, number(columns.parts[1])?);
        let value = match columns.kind {
            Kind::ReIm => Complex64::new(a, b),
            Kind::GainPhase => Complex64::from_polar(a, b.to_radians()),
            Kind::DecibelPhase => Complex64::from_polar(10f64.powf(a / 20.0), b.to_radians()),
        };
        points.push((omega, value));
    }
    Ok(points)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<FrequencyResponse, FrequencyFileError> {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("r.csv");
        std::fs::write(&path, text).expect("written");
        read_frequency_response(&path)
    }

    #[test]
    fn the_same_points_in_any_writing_are_the_same_response() {
        let cartesian = read("omega_rad_s,re,im\n0.1,1,-0.5\n0.2,0.5,-0.6\n1,0.01,-0.1\n").expect("points");
        let hertz = format!(
            "f_hz;db;phase_deg\n{};{};{}\n{};{};{}\n{};{};{}\n",
            1.0 / (2.0 * PI),
            20.0 * (0.01f64.hypot(0.1)).log10(),
            (-0.1f64).atan2(0.01).to_degrees(),
            0.1 / (2.0 * PI),
            20.0 * 1f64.hypot(0.5).log10(),
            (-0.5f64).atan2(1.0).to_degrees(),
            0.2 / (2.0 * PI),
            20.0 * 0.5f64.hypot(0.6).log10(),
            (-0.6f64).atan2(0.5).to_degrees(),
        );
        let polar = read(&hertz).expect("points, in another order");
        let comma = read(&format!("# of the bench\n{}", hertz.replace('.', ","))).expect("points");
        let json = read(
            r#"{"a": {"frequencies": [{"omega_rad_s": 0.1, "re": 1, "im": -0.5},
            {"omega_rad_s": 0.2, "re": 0.5, "im": -0.6}, {"omega_rad_s": 1, "re": 0.01, "im": -0.1}]}}"#,
        )
        .expect("points");
        for omega in [0.05, 0.1, 0.15, 0.7] {
            let of = cartesian.at_omega(omega);
            assert!((of - polar.at_omega(omega)).norm() < 1e-12 * of.norm());
            assert_eq!(comma.at_omega(omega), polar.at_omega(omega));
            assert!((of - json.at_omega(omega)).norm() < 1e-12 * of.norm());
        }
    }

    #[test]
    fn what_is_wrong_is_named() {
        for (text, words) in [
            ("t,y\n1,2\n", "has the columns t, y"),
            ("omega,re,im\n1,2,x\n", "line 2: 'x' is not a number"),
            ("omega,re,im\n1,2\n", "line 2: '' is not a number"),
            ("omega,re,im\n1,2,3\n", "3 are needed"),
            ("omega,re,im\n1,2,3\n1,2,3\n2,1,1\n", "point 2"),
            ("{\"x\": 1}", "holds no 'frequencies'"),
            ("{", "cannot be read"),
            ("", "has the columns"),
        ] {
            let error = read(text).expect_err(text).to_string();
            assert!(error.contains(words), "{text}: {error}");
        }
    }
}
