//! Names in a rig file: they become columns of tables, parts of paths and arguments, so they are plain and unique.

use std::collections::HashSet;

use super::error::RigError;
use super::spec::RigSpec;

/// Checks every id and signal of a description.
///
/// # Errors
/// [`RigError::Name`] for a name that is empty or holds anything but letters, digits, `_`, `-` and `.`;
/// [`RigError::Duplicate`] for one used twice.
pub(super) fn check_names(spec: &RigSpec) -> Result<(), RigError> {
    plain(&spec.id)?;
    let tags = (spec.tanks.iter().map(|t| &t.id))
        .chain(spec.pumps.iter().map(|p| &p.id))
        .chain(spec.valves.iter().map(|v| &v.id))
        .chain(spec.sensors.iter().map(|s| &s.id));
    let signals = (spec.tanks.iter().map(|t| &t.signal))
        .chain(spec.pumps.iter().flat_map(|p| [&p.signal, &p.flow_signal]))
        .chain(spec.valves.iter().map(|v| &v.signal));
    each_once(tags)?;
    each_once(signals)?;
    each_once(spec.configurations.iter().map(|c| &c.id))?;
    // A loop may appear in several configurations under the same tag.
    spec.configurations.iter().try_for_each(|c| each_once(c.loops.iter().map(|l| &l.id)))
}

fn plain(name: &str) -> Result<(), RigError> {
    let usual = |c: char| c.is_alphanumeric() || matches!(c, '_' | '-' | '.');
    if !name.is_empty() && name.chars().all(usual) {
        Ok(())
    } else {
        Err(RigError::Name { id: name.to_owned() })
    }
}

fn each_once<'a>(names: impl Iterator<Item = &'a String>) -> Result<(), RigError> {
    let mut seen = HashSet::new();
    for name in names {
        plain(name)?;
        // Columns of valve angles are in small letters: names that differ in capitals alone would meet there.
        if !seen.insert(name.to_lowercase()) {
            return Err(RigError::Duplicate { id: name.clone() });
        }
    }
    Ok(())
}
