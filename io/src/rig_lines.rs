//! The line of a rig file that an error is about, for errors that name tags and fields instead of places.

use toml::de::{DeTable, DeValue};
use vasos_engine::plant::RigError;

/// The line, from 1, of what `error` complains about in the text of a rig file; `None` where it is about no place.
pub(crate) fn line_of(text: &str, error: &RigError) -> Option<usize> {
    let places = Places::of(text)?;
    let offset = match error {
        // The last two are a command's, not a file's.
        RigError::NoTank
        | RigError::OutOfReach { .. }
        | RigError::NoBalance { .. }
        | RigError::Fault { .. }
        | RigError::Sound { .. } => None,
        RigError::Target { item } | RigError::CascadeCircle { item } | RigError::NoOuterLoop { item } => {
            places.item(item)
        }
        RigError::Schema { .. } => places.field("", "schema"),
        RigError::Name { id } => places.first(|p| p.is_name() && p.text == *id),
        RigError::Duplicate { id } => places.second_of_a_name(id),
        RigError::Unknown { item, reference } => places.reference(item, reference),
        RigError::Value { item, field, value, .. } => places.value(item, field, *value),
        RigError::Curve { item } => places.field(item, "curve").or_else(|| places.item(item)),
        RigError::Feedforward { item, from } => places.reference(item, from),
        RigError::Loop { item, tank } => places.reference(item, tank),
        RigError::SharedPump { first, second, .. } => places.shared_pump(first, second),
        RigError::Water { .. } => places.field("", "water_cm3"),
        RigError::Unreachable { tank, .. } => places.item(tank),
    }?;
    Some(line_at(text, offset))
}

/// The line of a configuration's id.
pub(crate) fn line_of_configuration(text: &str, id: &str) -> Option<usize> {
    let places = Places::of(text)?;
    let offset = places.first(|p| p.key == "id" && p.kind() == "configuration" && p.text == id)?;
    Some(line_at(text, offset))
}

fn line_at(text: &str, offset: usize) -> usize {
    text.get(..offset).map_or(1, |before| before.matches('\n').count() + 1)
}

/// A key with its value.
struct Place {
    offset: usize,
    /// Tables and places in lists on the way here.
    path: Vec<String>,
    /// `id` of the innermost table that has one; that of the rig is empty.
    owner: String,
    key: String,
    /// Value of a string.
    text: String,
    /// Value of a number.
    number: Option<f64>,
}

impl Place {
    /// Name of the list this table is in: `tank`, `pump`, …
    fn kind(&self) -> &str {
        self.path.iter().rev().find(|part| part.parse::<usize>().is_err()).map_or("", |part| part)
    }

    fn is_name(&self) -> bool {
        matches!(self.key.as_str(), "id" | "signal" | "flow_signal")
    }

    /// What a name must be unique among.
    fn scope(&self) -> String {
        match (self.kind(), self.key.as_str()) {
            ("loop", _) => self.path[..self.path.len().saturating_sub(1)].join("."),
            ("configuration", _) => "configuration".to_owned(),
            (_, "id") => "tag".to_owned(),
            _ => "signal".to_owned(),
        }
    }
}

/// All keys of a file in their order.
struct Places(Vec<Place>);

impl Places {
    fn of(text: &str) -> Option<Self> {
        let table = DeTable::parse(text).ok()?;
        let mut places = Vec::new();
        collect(table.get_ref(), &mut Vec::new(), "", &mut places);
        places.sort_by_key(|p| p.offset);
        Some(Self(places))
    }

    fn first(&self, wanted: impl Fn(&Place) -> bool) -> Option<usize> {
        self.0.iter().find(|p| wanted(p)).map(|p| p.offset)
    }

    fn field(&self, owner: &str, key: &str) -> Option<usize> {
        self.first(|p| p.owner == owner && p.key == key)
    }

    fn item(&self, id: &str) -> Option<usize> {
        self.first(|p| p.key == "id" && p.text == id)
    }

    fn second_of_a_name(&self, name: &str) -> Option<usize> {
        let same =
            |p: &&Place| p.is_name() && !p.path.is_empty() && p.text.to_lowercase() == name.to_lowercase();
        let named: Vec<&Place> = self.0.iter().filter(same).collect();
        let twice =
            named.iter().enumerate().find(|(i, p)| named[..*i].iter().any(|o| o.scope() == p.scope()));
        twice.map(|(_, p)| p.offset)
    }

    /// Where an item, or a table inside it, names another: as a value, or as a key.
    fn reference(&self, item: &str, name: &str) -> Option<usize> {
        let items = self.0.iter().filter(|p| p.key == "id" && p.text == item);
        let named = |item: &Place| {
            let inside = |p: &Place| {
                if item.path.is_empty() { p.path.is_empty() } else { p.path.starts_with(&item.path) }
            };
            self.first(|p| inside(p) && !p.is_name() && (p.text == name || p.key == name))
        };
        items.filter_map(named).next().or_else(|| self.item(item))
    }

    /// Where the second of two loops of one configuration names its pump.
    fn shared_pump(&self, first: &str, second: &str) -> Option<usize> {
        let loops: Vec<&Place> = self.0.iter().filter(|p| p.key == "id" && p.kind() == "loop").collect();
        let beside = |s: &&&Place| loops.iter().any(|f| f.text == first && f.scope() == s.scope());
        let second = loops.iter().filter(|p| p.text == second).find(beside)?;
        self.first(|p| p.path == second.path && p.key == "pump")
    }

    /// Where a number stands: in the item's table, or under its tag in a table such as `angles_deg`.
    fn value(&self, item: &str, field: &str, value: f64) -> Option<usize> {
        let owner = if self.is_rig(item) { "" } else { item };
        let (stem, _) = field.rsplit_once('_').unwrap_or((field, ""));
        let here = |p: &&Place| {
            let own = p.owner == owner && (p.key == field || p.path.last().is_some_and(|t| t == field));
            let by_tag = p.key == item && p.path.last().is_some_and(|table| table.starts_with(stem));
            own || by_tag
        };
        let candidates: Vec<&Place> = self.0.iter().filter(here).collect();
        let is_it = |p: &&&Place| p.number.is_some_and(|n| n == value || n.is_nan() && value.is_nan());
        let found = candidates.iter().find(is_it).or(candidates.first()).map(|p| p.offset);
        found.or_else(|| self.item(item))
    }

    fn is_rig(&self, id: &str) -> bool {
        self.0.iter().any(|p| p.path.is_empty() && p.key == "id" && p.text == id)
    }
}

fn collect(table: &DeTable, path: &mut Vec<String>, owner: &str, places: &mut Vec<Place>) {
    let id = table.iter().find(|(key, _)| key.get_ref() == "id").and_then(|(_, v)| v.get_ref().as_str());
    let owner = if path.is_empty() { "" } else { id.unwrap_or(owner) };
    for (key, value) in table {
        let offset = key.span().start;
        push(key.get_ref(), offset, value.get_ref(), path, owner, places);
    }
}

fn push(
    key: &str,
    offset: usize,
    value: &DeValue,
    path: &mut Vec<String>,
    owner: &str,
    places: &mut Vec<Place>,
) {
    let text = value.as_str().unwrap_or_default().to_owned();
    let number = match value {
        DeValue::Float(float) => float.as_str().parse().ok(),
        DeValue::Integer(integer) => integer.as_str().parse().ok(),
        _ => None,
    };
    let place =
        Place { offset, path: path.clone(), owner: owner.to_owned(), key: key.to_owned(), text, number };
    places.push(place);
    path.push(key.to_owned());
    match value {
        DeValue::Table(table) => collect(table, path, owner, places),
        DeValue::Array(array) => {
            for (i, element) in array.iter().enumerate() {
                path.push(i.to_string());
                match element.get_ref() {
                    DeValue::Table(table) => collect(table, path, owner, places),
                    // Numbers of a list answer to the list's name.
                    other => {
                        path.pop();
                        push(key, element.span().start, other, path, owner, places);
                        path.push(i.to_string());
                    }
                }
                path.pop();
            }
        }
        _ => {}
    }
    path.pop();
}
