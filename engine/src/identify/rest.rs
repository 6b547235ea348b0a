//! A start from rest, where the rows ahead of the first move speak for one.

use super::choose::choose_among;
use super::{Choice, FitError, FitOptions, FitProblem, InitialState, Structure};

/// [`choose_among`], from rest where the PV stands still ahead of the first move and the fit does not suffer for it.
///
/// Gives the choice and the start it was made with.
pub fn choose_from_rest(
    problem: &FitProblem,
    structures: &[Structure],
) -> (Result<Choice, FitError>, InitialState) {
    let free = choose_among(problem, structures);
    if starts_at_rest(problem) {
        let at_rest = FitOptions { initial_state: InitialState::Rest, ..problem.options.clone() };
        let rest = choose_among(&FitProblem { options: at_rest, ..problem.clone() }, structures);
        if let (Ok(free), Ok(found)) = (&free, &rest)
            && found.chosen().fit_percent > free.chosen().fit_percent - RESTING_PERCENT
        {
            return (rest, InitialState::Rest);
        }
    }
    (free, problem.options.initial_state)
}

/// What a start at rest may cost in fit, in points, where the rows ahead of the first move stand still.
const RESTING_PERCENT: f64 = 10.0;

/// Whether the PV stands still in the rows ahead of the first move of the MV.
///
/// With a free start least squares may explain a response that begins soon after the first row as the end of an
/// earlier motion, and does so with a better fit where the process is a little non-linear. The rows ahead of the move
/// speak against it.
fn starts_at_rest(problem: &FitProblem) -> bool {
    const ROWS: usize = 5;
    /// Part of the whole movement that counts as standing still.
    const STILL: f64 = 0.01;
    let Some(rest) = problem.mv.windows(2).position(|w| w[0] != w[1]).map(|k| k + 1) else { return false };
    if rest < ROWS
        || problem.options.initial_state == InitialState::Rest
        || problem.options.mv_before.is_some()
    {
        return false;
    }
    // What the MV did ahead of the stretch may still be on its way.
    let span_s = problem.time_s[problem.time_s.len() - 1] - problem.time_s[0];
    if problem.history.as_ref().is_some_and(|history| history.moves_within(span_s, problem.time_s[0])) {
        return false;
    }
    let rows = &problem.pv[..rest];
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    let range = |values: &[f64]| {
        let (low, high) =
            values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)));
        high - low
    };
    // Ends averaged over a third, against what the scatter of that many rows leaves of a trend.
    let third = (rest / 3).max(1);
    let (first, last) = (&rows[..third], &rows[rest - third..]);
    let middle = mean(rows);
    let scatter = (rows.iter().map(|y| (y - middle).powi(2)).sum::<f64>() / rest as f64).sqrt();
    let change = (mean(last) - mean(first)).abs();
    change <= STILL * range(problem.pv) + 2.0 * scatter * (2.0 / third as f64).sqrt()
}
