//! A gain that depends on the level of the MV: does the PV answer a bent input better than a straight one?
//!
//! u + β (u − c)²/R ahead of the linear process, c the middle and R the range of the MV: the gain runs from (1 − β) at the
//! lowest to (1 + β) at the highest of its value in the middle. β is searched by parabolas, the process at its best for
//! each.

use super::{Rival, known};
use crate::identify::ModelFit;
use crate::identify::fit_structure::{free_run, shape_like};
use crate::identify::output_error::refine;
use crate::identify::problem::Stretch;
use crate::identify::statistics::mean;

/// Passes of the process at each β.
const PASSES: usize = 10;
const ROUNDS: usize = 8;
/// Largest β: beyond it the gain all but vanishes at one end.
const MOST: f64 = 0.95;
/// Least β worth a word: a fifth from end to end.
const LEAST: f64 = 0.1;

/// The gain at the ends of the MV's range, and what such a process leaves over.
#[derive(Debug, Clone)]
pub(super) struct Level {
    /// Lowest and highest MV.
    pub levels: [f64; 2],
    /// Gain there.
    pub gains: [f64; 2],
    /// Whether they differ by more than a fifth.
    pub is_worth_a_word: bool,
    pub rival: Rival,
}

/// The best bent input for the structure of a fit.
pub(super) fn look(stretch: &Stretch, fit: &ModelFit) -> Option<Level> {
    let here = known(stretch, fit);
    let shape = shape_like(&here, fit);
    let levels = here.u.iter().fold([here.u_before; 2], |[low, high], u| [low.min(*u), high.max(*u)]);
    let (middle, range) = (0.5 * (levels[0] + levels[1]), levels[1] - levels[0]);
    let at = |beta: f64| {
        let bend = |u: f64| u + beta * (u - middle).powi(2) / range;
        let u: Vec<f64> = here.u.iter().map(|u| bend(*u)).collect();
        let bent = Stretch { u_ref: mean(&u), u: u.into(), u_before: bend(here.u_before), ..here.clone() };
        let found = refine(&bent, &shape, &fit.points(), PASSES, &mut 0)?;
        Some((beta, bent, found))
    };
    let mut tried = vec![at(0.0)?, at(-0.2)?, at(0.2)?];
    for _ in 0..ROUNDS {
        tried.sort_by(|a, b| a.2.rss().total_cmp(&b.2.rss()));
        let [a, b, c] = [0, 1, 2].map(|i| (tried[i].0, tried[i].2.rss()));
        let Some(beta) = lowest_of_parabola(a, b, c) else { break };
        if (beta - tried[0].0).abs() < 1e-7 {
            break;
        }
        tried.push(at(beta)?);
    }
    let (beta, bent, found) = tried.into_iter().min_by(|a, b| a.2.rss().total_cmp(&b.2.rss()))?;
    let gain = found.projected.linear.shared[shape.gains[0]];
    let residuals = free_run(&bent, &shape.without_derivatives(), &found).1;
    let residuals = bent.kept_rows().map(|row| residuals[row]).collect();
    let rival = Rival { residuals, unknowns: fit.unknowns + 1 };
    let gains = [gain * (1.0 - beta), gain * (1.0 + beta)];
    Some(Level { levels, gains, is_worth_a_word: beta.abs() > LEAST, rival })
}

/// Where a parabola through three points is lowest; towards the lower side where it has no lowest point.
fn lowest_of_parabola(a: (f64, f64), b: (f64, f64), c: (f64, f64)) -> Option<f64> {
    let (ab, ac) = (b.0 - a.0, c.0 - a.0);
    let determinant = ab * ac * (ac - ab);
    if determinant == 0.0 {
        return None;
    }
    let (fb, fc) = (b.1 - a.1, c.1 - a.1);
    let square = (fc * ab - fb * ac) / determinant;
    let slope = (fb * ac * ac - fc * ab * ab) / determinant;
    let away = if square > 0.0 { -0.5 * slope / square } else { a.0.signum() * 0.3 };
    Some((a.0 + away.clamp(-0.4, 0.4)).clamp(-MOST, MOST))
}

#[cfg(test)]
mod tests {
    use super::lowest_of_parabola;

    #[test]
    fn three_points_give_the_lowest() {
        let f = |x: f64| (x, 3.0 + 2.0 * (x - 0.17).powi(2));
        let found = lowest_of_parabola(f(0.2), f(0.0), f(-0.2)).expect("a lowest point");
        assert!((found - 0.17).abs() < 1e-12, "{found}");
    }
}
