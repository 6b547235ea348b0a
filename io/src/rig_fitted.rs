//! A rig file with fitted values in place of its own, everything else as it was written: order, comments, blanks.

use toml_edit::{Array, DocumentMut, Item, Table, TableLike, Value, value};
use vasos_engine::plant::RigSpec;

use crate::rig::{FileError, parse, parse_rig};

/// A rig file with other values.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FittedRig {
    /// The file's text; it loads.
    pub text: String,
    /// Configurations that no longer start at rest: with these values the rig cannot hold their setpoints.
    pub no_longer_steady: Vec<String>,
}

/// The text of a rig file with the values of another description of the same rig; `name` stands in errors.
///
/// A configuration that starts at rest and cannot with these values no longer does so. Where the text is written in a way
/// that cannot be followed, it is written anew, without its comments.
///
/// # Errors
/// [`FileError`] when the values make no rig.
pub fn fitted_rig(name: &str, text: &str, fitted: &RigSpec) -> Result<FittedRig, FileError> {
    let own: RigSpec = parse(name, text)?;
    let (mut fitted, mut no_longer_steady) = (fitted.clone(), Vec::new());
    loop {
        let edited =
            edited(text, &own, &fitted).filter(|t| parse::<RigSpec>(name, t).is_ok_and(|s| s == fitted));
        let text = match edited {
            Some(text) => text,
            None => toml_edit::ser::to_string_pretty(&fitted)
                .map_err(|error| FileError::Write { path: name.to_owned(), reason: error.to_string() })?,
        };
        match parse_rig(name, &text) {
            Ok(_) => return Ok(FittedRig { text, no_longer_steady }),
            Err(FileError::Start { configuration, .. }) if !no_longer_steady.contains(&configuration) => {
                let of = fitted.configurations.iter_mut().filter(|c| c.id == configuration);
                of.for_each(|c| c.start_steady = false);
                no_longer_steady.push(configuration);
            }
            Err(error) => return Err(error),
        }
    }
}

/// The text with what differs between two descriptions written into it; `None` where an item is not found.
fn edited(text: &str, own: &RigSpec, fitted: &RigSpec) -> Option<String> {
    let mut file: DocumentMut = text.parse().ok()?;
    let number = |table: &mut dyn TableLike, key: &str, was: f64, is: f64| {
        if was != is {
            set(table, key, Value::from(is));
        }
    };
    for (i, (was, is)) in own.tanks.iter().zip(&fitted.tanks).enumerate() {
        let table = item(&mut file, "tank", i)?;
        number(table, "area_cm2", was.area_cm2, is.area_cm2);
        number(table, "height_cm", was.height_cm, is.height_cm);
        number(table, "initial_cm", was.initial_cm, is.initial_cm);
        number(table, "spill_share", was.spill_share, is.spill_share);
    }
    for (i, (was, is)) in own.pumps.iter().zip(&fitted.pumps).enumerate() {
        let table = item(&mut file, "pump", i)?;
        number(table, "delay_s", was.delay_s, is.delay_s);
        if was.curve != is.curve {
            let points = is.curve.iter().map(|p| Value::from(p.iter().copied().collect::<Array>()));
            set(table, "curve", Value::from(points.collect::<Array>()));
        }
    }
    for (i, (was, is)) in own.valves.iter().zip(&fitted.valves).enumerate() {
        number(item(&mut file, "valve", i)?, "k90", was.k90, is.k90);
    }
    for (i, (was, is)) in own.sensors.iter().zip(&fitted.sensors).enumerate() {
        let table = item(&mut file, "sensor", i)?;
        number(table, "gain", was.gain, is.gain);
        number(table, "offset_cm", was.offset_cm, is.offset_cm);
    }
    for (i, (was, is)) in own.configurations.iter().zip(&fitted.configurations).enumerate() {
        let table = item(&mut file, "configuration", i)?;
        if was.start_steady != is.start_steady {
            set(table, "start_steady", Value::from(is.start_steady));
        }
        for (pump, &delay) in &is.delays_s {
            if was.delays_s.get(pump) != Some(&delay) {
                number(table.get_mut("delays_s")?.as_table_like_mut()?, pump, f64::NAN, delay);
            }
        }
    }
    for valve in &fitted.valves[own.valves.len()..] {
        let mut table = Table::new();
        for (key, text) in [("id", &valve.id), ("signal", &valve.signal), ("from", &valve.from)] {
            table.insert(key, value(text));
        }
        table.insert("drive", value("free_fall"));
        table.insert("k90", value(valve.k90));
        table.insert("angle_deg", value(valve.angle_deg));
        let valves = file.entry("valve").or_insert(Item::ArrayOfTables(toml_edit::ArrayOfTables::new()));
        valves.as_array_of_tables_mut()?.push(table);
    }
    Some(file.to_string())
}

fn item<'a>(file: &'a mut DocumentMut, list: &str, i: usize) -> Option<&'a mut dyn TableLike> {
    Some(file.get_mut(list)?.as_array_of_tables_mut()?.get_mut(i)? as &mut dyn TableLike)
}

/// Sets a value and keeps what is written around the old one.
fn set(table: &mut dyn TableLike, key: &str, mut new: Value) {
    if let Some(old) = table.get(key).and_then(Item::as_value) {
        *new.decor_mut() = old.decor().clone();
    }
    match table.get_mut(key) {
        Some(item) => *item = Item::Value(new),
        None => {
            table.insert(key, Item::Value(new));
        }
    }
}
