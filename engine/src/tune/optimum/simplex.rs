//! Nelder and Mead's search in a few dimensions, for functions with kinks and walls.

/// Size of the first simplex, the size at which the search ends, and its patience.
#[derive(Debug, Clone, Copy)]
pub(super) struct Simplex {
    /// Edge of the first simplex.
    pub step: f64,
    /// Edge at which it ends.
    pub last_step: f64,
    /// Evaluations at most.
    pub most_evaluations: usize,
}

/// Lowest point found from a start, with its value; ∞ stands for a wall.
///
/// Source: Nelder and Mead, A simplex method for function minimization, Computer Journal 7, 1965; started once more from
/// its result, because a simplex can collapse on a kink.
pub(super) fn minimise(
    simplex: &Simplex,
    start: &[f64],
    value: &mut dyn FnMut(&[f64]) -> f64,
) -> (Vec<f64>, f64) {
    let mut count = 0;
    let mut best = once(simplex, start, value, &mut count);
    let again = once(&Simplex { step: 0.3 * simplex.step, ..*simplex }, &best.0, value, &mut count);
    if again.1 < best.1 {
        best = again;
    }
    best
}

fn once(
    simplex: &Simplex,
    start: &[f64],
    value: &mut dyn FnMut(&[f64]) -> f64,
    count: &mut usize,
) -> (Vec<f64>, f64) {
    let n = start.len();
    let mut of = |x: Vec<f64>, count: &mut usize| {
        *count += 1;
        let v = value(&x);
        (x, if v.is_nan() { f64::INFINITY } else { v })
    };
    let mut corners = vec![of(start.to_vec(), count)];
    for i in 0..n {
        let mut x = start.to_vec();
        x[i] += simplex.step;
        corners.push(of(x, count));
    }
    while *count < simplex.most_evaluations {
        corners.sort_by(|a, b| a.1.total_cmp(&b.1));
        let widest = (1..=n)
            .flat_map(|k| corners[k].0.iter().zip(&corners[0].0).map(|(a, b)| (a - b).abs()))
            .fold(0.0, f64::max);
        if widest < simplex.last_step {
            break;
        }
        let centre: Vec<f64> =
            (0..n).map(|i| corners[..n].iter().map(|c| c.0[i]).sum::<f64>() / n as f64).collect();
        let worst = corners[n].clone();
        let along =
            |t: f64| -> Vec<f64> { centre.iter().zip(&worst.0).map(|(c, w)| c + t * (w - c)).collect() };
        let mirrored = of(along(-1.0), count);
        let replacement = if mirrored.1 < corners[0].1 {
            let far = of(along(-2.0), count);
            if far.1 < mirrored.1 { Some(far) } else { Some(mirrored) }
        } else if mirrored.1 < corners[n - 1].1 || (n == 1 && mirrored.1 < worst.1) {
            Some(mirrored)
        } else {
            let near = of(along(if mirrored.1 < worst.1 { -0.5 } else { 0.5 }), count);
            (near.1 < worst.1.min(mirrored.1)).then_some(near)
        };
        if let Some(corner) = replacement {
            corners[n] = corner;
        } else {
            let lowest = corners[0].0.clone();
            for corner in corners.iter_mut().skip(1) {
                let x = corner.0.iter().zip(&lowest).map(|(a, b)| b + 0.5 * (a - b)).collect();
                *corner = of(x, count);
            }
        }
    }
    corners.sort_by(|a, b| a.1.total_cmp(&b.1));
    corners.swap_remove(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_valley_with_a_kink_and_a_wall_comes_out() {
        let mut f = |x: &[f64]| {
            if x[0] < -0.2 { f64::INFINITY } else { (x[0] - 0.3).abs() + (x[1] + 1.0 - x[0]).powi(2) }
        };
        let simplex = Simplex { step: 0.3, last_step: 1e-7, most_evaluations: 400 };
        let (x, v) = minimise(&simplex, &[1.0, 1.0], &mut f);
        assert!(v < 1e-6 && (x[1] + 0.7).abs() < 1e-3, "{x:?} {v}");
    }
}
