//! What the columns of a text file hold, judged by rows from all over it.

use super::layout::{Layout, is_remark};
use super::number::is_none;
use super::read::Kind;
use super::source::Sample;
use super::stamp::{Stamp, parse as parse_stamp};

/// Rows a column's kind is judged by, and of a column that is often empty.
const ROWS: usize = 1000;

pub(super) fn kinds(sample: &Sample, layout: &Layout) -> Vec<Kind> {
    let rows: Vec<&String> = sample.head[layout.first_row..].iter().chain(&sample.beyond).collect();
    let stride = rows.len() / ROWS + 1;
    let mut fields = Vec::new();
    let mut seen = vec![[0_usize; 5]; layout.used.len()];
    for line in rows.into_iter().step_by(stride).filter(|line| !is_remark(line)) {
        layout.dialect.split(line, &mut fields);
        for (counts, &at) in seen.iter_mut().zip(&layout.used) {
            if let Some(field) = fields.get(at).filter(|f| !f.is_empty() && !is_none(f)) {
                counts[kind(field, at, layout) as usize] += 1;
            }
        }
    }
    seen.iter().map(|counts| judge(*counts)).collect()
}

fn kind(field: &str, at: usize, layout: &Layout) -> Kind {
    if layout.number(field, at).is_some() {
        return Kind::Number;
    }
    match parse_stamp(field, layout.date_order).or_else(|| parse_stamp(field, layout.date_order.other())) {
        Some(Stamp::Full { .. }) => Kind::Full,
        Some(Stamp::Date(_)) => Kind::Date,
        Some(Stamp::Clock(_)) => Kind::Clock,
        None if layout.quantity(field, at).is_some() => Kind::Number,
        None => Kind::Words,
    }
}

/// A column with any fair share of numbers is one of numbers; its words ("Bad") are missing values.
fn judge(counts: [usize; 5]) -> Kind {
    let total: usize = counts.iter().sum();
    // Of times of day with points between some read as dates as well: 10.11.12.
    let (dates, clocks) = (counts[Kind::Date as usize], counts[Kind::Clock as usize]);
    if 5 * clocks >= dates && 2 * (dates + clocks) > total && clocks > 0 {
        return Kind::Clock;
    }
    let order = [Kind::Full, Kind::Date, Kind::Clock];
    let most = order.into_iter().max_by_key(|k| counts[*k as usize]).unwrap_or(Kind::Full);
    if counts[Kind::Number as usize] * 5 >= total {
        Kind::Number
    } else if counts[most as usize] * 2 > total {
        // A midnight written without its time of day is still a full stamp among others.
        if most == Kind::Date && counts[Kind::Full as usize] > 0 { Kind::Full } else { most }
    } else {
        Kind::Words
    }
}
