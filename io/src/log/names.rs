//! Column names and units from header lines.

/// What a column is called.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct ColumnName {
    pub name: String,
    pub unit: Option<String>,
}

/// Units of process logs, in lower case.
const UNITS: [&str; 84] = [
    "s", "sec", "seconds", "ms", "min", "h", "hr", "hours", "d", "%", "pct", "fract", "frac", "-", "°c",
    "degc", "c", "°f", "degf", "f", "k", "v", "mv", "volts", "a", "ma", "w", "kw", "mw", "bar", "barg",
    "mbar", "pa", "kpa", "mpa", "psi", "psig", "atm", "mmh2o", "mm", "cm", "m", "l", "ml", "m3", "l/s",
    "l/min", "l/h", "ml/s", "cm3/s", "m3/s", "m3/h", "kg", "kg/s", "kg/h", "t/h", "rpm", "hz", "ph", "ppm",
    "m³/h", "m³/s", "m³", "cm³/s", "nm3/h", "nm³/h", "kg/m3", "kg/m³", "mol/l", "us/cm", "µs/cm", "ntu",
    "gpm", "gal/min", "lb/h", "klb/h", "scfh", "scfm", "in", "ft", "inh2o", "mg/l", "deg", "°",
];

/// Whether a word is a unit.
pub(super) fn is_unit(word: &str) -> bool {
    UNITS.contains(&word.to_lowercase().as_str())
}

/// Whether a name is a tag: letters with digits or marks among them, no blanks.
pub(super) fn is_tag(name: &str) -> bool {
    let (name, _) = name_and_unit(name);
    name.contains(char::is_alphabetic)
        && !name.contains(char::is_whitespace)
        && name.contains(|c: char| c.is_ascii_digit() || matches!(c, '.' | '_' | ':' | '/' | '-' | '\\'))
}

/// Whether a line among the names holds their units.
pub(super) fn is_unit_row(fields: &[String]) -> bool {
    let filled: Vec<String> =
        fields.iter().filter(|f| !f.is_empty()).map(|f| bare(f).to_lowercase()).collect();
    let known = filled.iter().filter(|f| UNITS.contains(&f.as_str())).count();
    let title = filled.first().is_some_and(|f| f.starts_with("unit") || f.starts_with("unidade"));
    !filled.is_empty() && (title || known * 2 >= filled.len())
}

/// Names as the header has them, units taken out of brackets or from the row below; empty ones numbered, equal ones
/// told apart.
pub(super) fn read_names(header: &[String], units: Option<&[String]>) -> Vec<ColumnName> {
    let mut names: Vec<ColumnName> = Vec::new();
    let is_export = header.iter().any(|name| name.trim() == "time_s");
    for (i, text) in header.iter().enumerate() {
        let (mut name, mut unit) = name_and_unit(text);
        if let Some(below) = units.and_then(|u| u.get(i)).map(|u| bare(u)).filter(|u| !u.is_empty()) {
            let title = below.to_lowercase();
            if unit.is_none() && !title.starts_with("unit") && !title.starts_with("unidade") {
                unit = Some(below.to_owned());
            }
        }
        if unit.is_none() && is_export {
            unit = exported_unit(&name).map(str::to_owned);
        }
        if name.is_empty() {
            name = format!("column {}", i + 1);
        }
        let taken = |candidate: &str| names.iter().any(|n| n.name == candidate);
        let mut unique = name.clone();
        let mut number = 2;
        while taken(&unique) {
            unique = format!("{name} ({number})");
            number += 1;
        }
        names.push(ColumnName { name: unique, unit });
    }
    names
}

/// Unit at the end of a name in a file of this program's own, such as `h1_cm`.
fn exported_unit(name: &str) -> Option<&'static str> {
    let endings = [("_cm3_s", "cm³/s"), ("_cm", "cm"), ("_v", "V"), ("_percent", "%"), ("_deg", "°")];
    endings.into_iter().find(|(ending, _)| name.ends_with(ending)).map(|(_, unit)| unit)
}

fn bare(text: &str) -> &str {
    text.trim().trim_matches(['[', ']', '(', ')']).trim()
}

/// `tank level [cm]`, `Heater 1 (%)`; brackets that hold a name, as in `command PI (du) [ml/s]`, stay.
fn name_and_unit(text: &str) -> (String, Option<String>) {
    let text = text.trim();
    for (open, close) in [('[', ']'), ('(', ')')] {
        if let Some(start) = text.rfind(open)
            && text.ends_with(close)
            && start > 0
        {
            let unit = text[start + 1..text.len() - 1].trim();
            return (text[..start].trim().to_owned(), Some(unit.to_owned()).filter(|u| !u.is_empty()));
        }
    }
    (text.to_owned(), None)
}
