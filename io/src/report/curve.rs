//! Curves as SVG paths, thinned to what a screen can show.

/// Most points of a path; more would only make the file long.
const MOST_POINTS: usize = 1600;

/// Points of a curve that is too long: the lowest and the highest of each stretch of rows, in their order.
pub(super) fn thinned(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    if points.len() <= MOST_POINTS {
        return points.to_vec();
    }
    let rows = points.len().div_ceil(MOST_POINTS / 2);
    let mut out = Vec::with_capacity(MOST_POINTS + 2);
    for stretch in points.chunks(rows) {
        let by = |a: &(usize, &(f64, f64)), b: &(usize, &(f64, f64))| a.1.1.total_cmp(&b.1.1);
        let (Some(low), Some(high)) =
            (stretch.iter().enumerate().min_by(by), stretch.iter().enumerate().max_by(by))
        else {
            continue;
        };
        let (first, second) = if low.0 <= high.0 { (low, high) } else { (high, low) };
        out.push(*first.1);
        if second.0 != first.0 {
            out.push(*second.1);
        }
    }
    out
}

/// The `d` of a path through pixels; what is not finite interrupts it.
pub(super) fn path(pixels: impl Iterator<Item = (f64, f64)>) -> String {
    let mut d = String::new();
    let mut pen = 'M';
    for (x, y) in pixels {
        if x.is_finite() && y.is_finite() {
            d.push_str(&format!("{pen}{x:.1} {y:.1}"));
            pen = 'L';
        } else {
            pen = 'M';
        }
    }
    d
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_curve_keeps_its_extremes() {
        let long: Vec<(f64, f64)> =
            (0..100_000).map(|k| (k as f64, if k == 77_777 { 9.0 } else { 0.0 })).collect();
        let short = thinned(&long);
        assert!(short.len() <= MOST_POINTS + 2 && short.contains(&(77_777.0, 9.0)));
        assert!(short.windows(2).all(|w| w[0].0 < w[1].0));
    }

    #[test]
    fn what_is_missing_interrupts_a_path() {
        let points = [(0.0, 1.0), (1.0, 2.0), (2.0, f64::NAN), (3.0, 4.0)];
        assert_eq!(path(points.into_iter()), "M0.0 1.0L1.0 2.0M3.0 4.0");
    }
}
