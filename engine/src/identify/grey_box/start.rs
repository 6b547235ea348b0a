//! Where a search begins: initial levels from the first rows, and other parameters where those of the file lead nowhere.

use super::optimise::{Found, Search};
use super::problem::Record;
use super::structure::Structure;

/// Rows whose mean is the first guess of a measured level.
const FIRST_ROWS: usize = 5;
/// Shares of the rim at which levels that are not measured may begin.
const SHARES: [f64; 5] = [0.02, 0.15, 0.35, 0.6, 0.9];
/// Other starts of the parameters that are looked at, and how many of the best are followed.
const STARTS: usize = 24;
const FOLLOWED: usize = 3;

/// Sets the initial levels among the unknowns by the first rows of a record, the parameters being what they are.
pub(super) fn initial_levels(
    structure: &Structure,
    record: &Record,
    weights: &[f64],
    bounds: &[[f64; 2]],
    rows: usize,
    unknowns: &mut Vec<f64>,
) {
    let first = record.first(rows);
    let p = structure.parameters;
    let free: Vec<bool> = (0..unknowns.len()).map(|i| i >= p).collect();
    let search = Search {
        structure,
        record: &first,
        weights: weights.to_vec(),
        bounds,
        free: &free,
        most_rounds: 25,
        same_cost: 1e-8,
    };
    let rim = |vessel: usize| structure.vessels[vessel].height.at(unknowns);
    let mut guesses = vec![unknowns.clone()];
    for share in SHARES {
        let mut guess = unknowns.clone();
        (0..structure.vessels.len()).for_each(|i| guess[p + i] = share * rim(i));
        for feed in &structure.feeds {
            if let Some(slot) = feed.in_air {
                let input = record.moves.inputs[feed.pump][0].1;
                guess[slot] = structure.pumps[feed.pump].flow(unknowns, input).cm3_s;
            }
        }
        guesses.push(guess);
    }
    for (gauge, values) in structure.gauges.iter().zip(&first.outputs) {
        let known: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).take(FIRST_ROWS).collect();
        let mean = known.iter().sum::<f64>() / known.len().max(1) as f64;
        let level = (mean - gauge.offset.at(unknowns)) / gauge.gain.at(unknowns);
        let level = level.clamp(0.0, rim(gauge.vessel));
        guesses.iter_mut().for_each(|g| g[p + gauge.vessel] = level);
    }
    guesses.dedup();
    let found = guesses.iter().map(|guess| search.descend(guess));
    let best = found.min_by(|a, b| a.sums.cost.total_cmp(&b.sums.cost));
    *unknowns = best.map_or_else(|| unknowns.clone(), |b| b.unknowns);
}

/// Looks for better starts all over the bounds, and gives where the best of them leads.
pub(super) fn elsewhere(search: &Search, from: &Found) -> Found {
    let mut starts: Vec<(f64, Vec<f64>)> = (1..=STARTS)
        .map(|k| {
            let mut start = from.unknowns.clone();
            for (i, x) in start.iter_mut().enumerate().take(search.structure.parameters) {
                let [low, high] = search.bounds[i];
                *x = low + (high - low) * radical_inverse(k, i);
            }
            (search.cost(&start), start)
        })
        .collect();
    starts.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut best = from.clone();
    for (_, start) in starts.iter().take(FOLLOWED) {
        let found = search.descend(start);
        best.runs += found.runs;
        if found.sums.cost < best.sums.cost {
            best = Found { runs: best.runs, ..found };
        }
    }
    best
}

/// Point k of Halton's sequence in one dimension: evenly spread over 0…1, the same every time.
fn radical_inverse(k: usize, dimension: usize) -> f64 {
    const PRIMES: [usize; 16] = [2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53];
    let base = PRIMES[dimension % PRIMES.len()];
    let (mut rest, mut share, mut sum) = (k, 1.0, 0.0);
    while rest > 0 {
        share /= base as f64;
        sum += share * (rest % base) as f64;
        rest /= base;
    }
    sum
}
