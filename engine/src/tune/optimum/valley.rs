//! The bottom of a valley in one dimension, for functions with kinks and walls.

/// A place with its height.
pub(super) trait Spot: Copy {
    /// Where.
    fn at(&self) -> f64;
    /// How high; ∞ stands for a wall.
    fn value(&self) -> f64;
}

/// Lowest place found between `a` and `b` about `m`, which is not above either: parabolas where the three are finite and
/// bend, golden sections else; `width` is the relative width of the bracket at which it ends.
pub(super) fn valley<S: Spot>(look: &mut dyn FnMut(f64) -> S, a: S, m: S, b: S, width: f64) -> S {
    const GOLDEN: f64 = 0.381_966_011_250_105;
    const MOST: usize = 60;
    let (mut a, mut m, mut b) = (a, m, b);
    // A start that is not the lowest of the three is replaced by the one that is.
    if a.value() < m.value() {
        m = a;
    }
    if b.value() < m.value() {
        m = b;
    }
    let mut widths = [f64::INFINITY; 2];
    for _ in 0..MOST {
        let whole = b.at() - a.at();
        if whole <= width * b.at().abs().max(a.at().abs()) {
            break;
        }
        let (before, after) = (m.at() - a.at(), b.at() - m.at());
        let slow = whole > 0.4 * widths[1];
        widths = [whole, widths[0]];
        let golden = if after > before { m.at() + GOLDEN * after } else { m.at() - GOLDEN * before };
        let x = if slow { golden } else { vertex(a, m, b).unwrap_or(golden) };
        let found = look(x);
        if found.value() < m.value() {
            if x > m.at() {
                a = m
            } else {
                b = m
            }
            m = found;
        } else if x > m.at() {
            b = found;
        } else {
            a = found;
        }
    }
    m
}

/// Lowest point of the parabola through three places, where it is well inside and all are finite.
fn vertex<S: Spot>(a: S, m: S, b: S) -> Option<f64> {
    if !(a.value().is_finite() && b.value().is_finite()) {
        return None;
    }
    let (before, after) = (m.at() - a.at(), b.at() - m.at());
    let (fall, rise) = ((a.value() - m.value()) / before, (b.value() - m.value()) / after);
    let curvature = (fall + rise) / (before + after);
    let x = m.at() - 0.5 * (rise * before - fall * after) / (before + after) / curvature;
    let edge = 1e-3 * (b.at() - a.at());
    if !(x > a.at() + edge && x < b.at() - edge) {
        return None;
    }
    if (x - m.at()).abs() >= edge {
        return Some(x);
    }
    Some(m.at() + if after > before { edge } else { -edge })
}
