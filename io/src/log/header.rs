//! Names and units from the lines above the data.

use super::layout::{Layout, is_blank, is_remark, is_value};
use super::names::{is_tag, is_unit_row, read_names};
use super::split::{Dialect, SEPARATORS, labelled};

/// Fields of one header line, and its index.
type HeaderRow = (usize, Vec<String>);

/// Names the columns of a layout: by a row of tags, else by the topmost of the nearest block of lines with as many
/// fields; units by the row among them that holds units.
pub(super) fn name_columns(lines: &[&str], layout: &mut Layout) {
    if layout.dialect.labelled {
        return name_by_labels(lines, layout);
    }
    if let Some(split) = split_header(lines, layout) {
        layout.header_line = Some(split.line + 1);
        layout.names = read_names(&split.names, split.units.as_deref());
        return;
    }
    let block = header_block(lines, layout);
    let is_units = |row: &HeaderRow| is_unit_row(&row.1);
    let mut named = block.iter().filter(|row| block.len() == 1 || !is_units(row));
    let tags = named.clone().find(|row| is_tag_row(&row.1));
    let Some((line, header)) = tags.or_else(|| named.next()).or(block.first()) else {
        layout.names = read_names(&vec![String::new(); layout.used.len()], None);
        return;
    };
    let units = block.iter().find(|row| row.0 != *line && is_units(row)).map(|(_, fields)| fields);
    layout.header_line = Some(line + 1);
    layout.names = read_names(&under_groups(lines, *line, header, layout), units.map(Vec::as_slice));
}

/// A header of which the line next to the data names the time alone, and lines above it the other columns.
struct SplitHeader {
    /// Line of those names.
    line: usize,
    names: Vec<String>,
    units: Option<Vec<String>>,
}

/// As recorders of Yokogawa write it: `Ch.,,,0001,0002`, `Tag,,,TI1,FI2`, `Unit,,,C,m3/h` over `Date,Time,sec,,`.
fn split_header(lines: &[&str], layout: &Layout) -> Option<SplitHeader> {
    let mut split = Vec::new();
    let mut fields = |line: usize| -> Vec<String> {
        layout.dialect.split(lines[line], &mut split);
        layout.used.iter().map(|&at| split.get(at).copied().unwrap_or("").to_owned()).collect()
    };
    let next = layout.first_row.checked_sub(1)?;
    let time = fields(next);
    let width = time.iter().take_while(|field| !field.is_empty()).count();
    let words = time[..width].iter().all(|f| !is_value(f, layout.decimal));
    if width < 2 || width + 1 > time.len() || !words || time[width..].iter().any(|f| !f.is_empty()) {
        return None;
    }
    let mut names: Option<(usize, Vec<String>, u8)> = None;
    let mut units = None;
    for line in (0..next).rev() {
        let row = fields(line);
        let is_above =
            row[1..width].iter().all(String::is_empty) && row[width..].iter().any(|f| !f.is_empty());
        if !is_above {
            break;
        }
        if is_unit_row(&row) || row[0].to_lowercase().starts_with("unit") {
            units = Some(row);
            continue;
        }
        // Of tags, remarks and channels: what is called a tag and looks like one.
        let whole = row[width..].iter().all(|f| !f.is_empty());
        let called = row[0].to_lowercase().starts_with("tag");
        let rank = 4 * u8::from(whole) + 2 * u8::from(is_tag_row(&row[width..])) + u8::from(called);
        if names.as_ref().is_none_or(|best| rank >= best.2) {
            names = Some((line, row, rank));
        }
    }
    let (line, mut names, _) = names?;
    names[..width].clone_from_slice(&time[..width]);
    if let Some(units) = &mut units {
        units[..width].iter_mut().for_each(String::clear);
    }
    Some(SplitHeader { line, names, units })
}

fn name_by_labels(lines: &[&str], layout: &mut Layout) {
    let plain = Dialect { labelled: false, ..layout.dialect };
    let mut fields = Vec::new();
    plain.split(lines[layout.first_row], &mut fields);
    let name = |&i: &usize| fields.get(i).and_then(|f| labelled(f)).map_or("", |(name, _)| name).to_owned();
    let names: Vec<String> = layout.used.iter().map(name).collect();
    layout.names = read_names(&names, None);
}

fn header_block(lines: &[&str], layout: &Layout) -> Vec<HeaderRow> {
    if let Some(line) = layout.header_line {
        let mut fields = Vec::new();
        layout.dialect.split(lines[line - 1], &mut fields);
        let names = layout.used.iter().map(|&i| fields.get(i).copied().unwrap_or("").to_owned());
        return vec![(line - 1, names.collect())];
    }
    let mut block: Vec<HeaderRow> = Vec::new();
    for i in (0..layout.first_row).rev() {
        match header_fields(lines[i], layout, block.is_empty()) {
            Some(fields) => block.insert(0, (i, fields)),
            None if block.is_empty() => {}
            None => break,
        }
        if layout.used.len() == 1 {
            break;
        }
    }
    block
}

/// Most of its cells are tags: a letter and a digit or a mark, no blanks.
fn is_tag_row(fields: &[String]) -> bool {
    let filled = fields.iter().filter(|f| !f.is_empty()).count();
    let tags = fields.iter().filter(|f| is_tag(f)).count();
    tags * 2 >= filled && tags > 0
}

/// Names that repeat below a row of groups (`TANK1,,TANK2` over `PV,SP,PV,SP`) get their group in front.
fn under_groups(lines: &[&str], line: usize, header: &[String], layout: &Layout) -> Vec<String> {
    let twice = |i: usize| !header[i].is_empty() && header.iter().filter(|h| **h == header[i]).count() > 1;
    if line == 0 || !(0..header.len()).any(twice) {
        return header.to_vec();
    }
    let mut fields = Vec::new();
    layout.dialect.split(lines[line - 1], &mut fields);
    let words = fields.iter().filter(|f| !f.is_empty() && !is_value(f, layout.decimal)).count();
    if words < 2 || fields.len() > layout.fields + 1 {
        return header.to_vec();
    }
    let mut group = "";
    let mut names = header.to_vec();
    for (i, &at) in layout.used.iter().enumerate() {
        group = fields.get(at).copied().filter(|f| !f.is_empty()).unwrap_or(group);
        if twice(i) && !group.is_empty() {
            names[i] = format!("{group} {}", header[i]);
        }
    }
    names
}

/// Fields of a header line, one a column, by the separator of the data or another. The line `nearest` to the data may
/// leave out every other name, as over pairs of a time and a value.
fn header_fields(line: &str, layout: &Layout, nearest: bool) -> Option<Vec<String>> {
    let line = line.trim_start_matches(['\u{feff}', ' ']);
    let line = if is_remark(line) { line.trim_start_matches(['#', '%', '!', '*', '/', '-']) } else { line };
    if is_blank(line) {
        return None;
    }
    let mut fields = Vec::new();
    let own = layout.dialect.separator;
    let others = SEPARATORS.into_iter().filter(|&s| s != own);
    for separator in std::iter::once(own).chain(others) {
        let dialect = Dialect { separator, parted: None, ..layout.dialect };
        dialect.split(line, &mut fields);
        let words = fields.iter().filter(|f| !f.is_empty() && !is_value(f, layout.decimal)).count();
        let filled: Vec<&str> = fields.iter().copied().filter(|f| !f.is_empty()).collect();
        if words * 2 < filled.len() || words == 0 {
            continue;
        }
        if filled.len() == layout.used.len() && fields.len() != layout.fields {
            return Some(filled.iter().map(|f| (*f).to_owned()).collect());
        }
        let in_pairs = nearest
            && words == filled.len()
            && words > 1
            && fields.chunks(2).all(|pair| pair.iter().any(|f| !f.is_empty()));
        let units = is_unit_row(&fields.iter().map(|f| (*f).to_owned()).collect::<Vec<_>>());
        if fields.len() >= layout.fields
            && (filled.len() + 1 >= layout.used.len() && (nearest || filled.len() > 1) || in_pairs || units)
            && fields.len() <= layout.fields + 1
        {
            return Some(layout.used.iter().map(|&i| fields[i].to_owned()).collect());
        }
        // Row numbers without a name in front.
        let one_less = fields.len() + 1 == layout.fields && layout.used.len() == layout.fields;
        if one_less && separator == own && filled.len() == fields.len() && fields.len() > 1 {
            return Some(std::iter::once("").chain(filled).map(str::to_owned).collect());
        }
    }
    None
}
