//! The √ laws of the streams without roots: what a flow needs of its head, carried on from state to state.
//!
//! A flow is `q = k·h·x^(−¼)` with `x = h² + δ²`. Two roots and a division one after the other are most of what a
//! right-hand side costs, and x changes little from one to the next. From a state where x₀^(−¼) is known,
//!
//! ```text
//! x^(−¼) = x₀^(−¼) (1 − t)^(−¼),   t = 1 − x/x₀,   (1 − t)^(−¼) = 1 + t/4 + 5t²/32 + …
//! ```
//!
//! Each t is formed from the x₀ that the carried root belongs to, so that rounding does not add up. Where a stream is
//! too far from where it was, all get their roots anew. What is not a number is always too far.

use super::lanes::Number;

/// Largest Σt² for which the series is good: its error there is 1.4e-11.
const NEAR: f64 = 1.0 / 600.0;
/// Binomial coefficients of (1 − t)^(−¼).
const SERIES: [f64; 7] =
    [1.0, 1.0 / 4.0, 5.0 / 32.0, 15.0 / 128.0, 195.0 / 2048.0, 663.0 / 8192.0, 4641.0 / 65536.0];

/// What x is made of for every stream: `x = bend·h² + round`.
#[derive(Debug, Clone)]
pub(crate) struct Bends<const S: usize, V> {
    pub bend: [V; S],
    pub round: [V; S],
}

/// x^(−¼) of every stream at some state, and what is left of `t = rest − fall·h²` by then.
#[derive(Debug, Clone)]
pub(crate) struct Roots<const S: usize, V> {
    root: [V; S],
    rest: [V; S],
    fall: [V; S],
}

/// (1 − t)^(−¼) for small t; summed pairwise, which is quicker than one after the other.
#[inline(always)]
fn series<V: Number>(t: V) -> V {
    let pair = |i: usize| V::of(SERIES[i]) + t * SERIES[i + 1];
    let t2 = t * t;
    (pair(0) + pair(2) * t2) + (pair(4) + t2 * SERIES[6]) * (t2 * t2)
}

/// Roots taken anew; apart, so that what runs every time stays short.
#[inline(never)]
fn anew<const S: usize, V: Number>(heads: &[V; S], bends: &Bends<S, V>, count: usize) -> [V; S] {
    let of = |i: usize| heads[i] * heads[i] * bends.bend[i] + bends.round[i];
    let mut roots = [V::of(0.0); S];
    if count == S {
        // Of a length that the compiler knows.
        for (i, root) in roots.iter_mut().enumerate() {
            *root = V::of(1.0) / of(i).sqrt().sqrt();
        }
    } else {
        for (i, root) in roots.iter_mut().enumerate().take(count) {
            *root = V::of(1.0) / of(i).sqrt().sqrt();
        }
    }
    roots
}

impl<const S: usize, V: Number> Roots<S, V> {
    /// Of no state: every other is too far.
    pub fn none() -> Self {
        let nothing = [V::of(f64::NAN); S];
        Self { root: nothing, rest: nothing, fall: nothing }
    }

    /// x^(−¼) of the first `count` streams at these heads in cm.
    #[inline(always)]
    pub fn at(&self, heads: &[V; S], bends: &Bends<S, V>, count: usize) -> [V; S] {
        let (mut roots, mut far) = ([V::of(0.0); S], V::of(0.0));
        for (i, root) in roots.iter_mut().enumerate().take(count) {
            let t = self.rest[i] - heads[i] * heads[i] * self.fall[i];
            far += t * t;
            *root = self.root[i] * series(t);
        }
        if !far.is_below(V::of(NEAR)) {
            roots = anew(heads, bends, count);
        }
        roots
    }

    /// Goes on from these x^(−¼).
    #[inline(always)]
    pub fn keep(&mut self, roots: &[V; S], bends: &Bends<S, V>, count: usize) {
        for (i, &root) in roots.iter().enumerate().take(count) {
            let square = root * root;
            let inverse = square * square;
            self.root[i] = root;
            self.rest[i] = V::of(1.0) - bends.round[i] * inverse;
            self.fall[i] = bends.bend[i] * inverse;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn carried_roots_are_those_taken_anew() {
        let bends = Bends { bend: [1.0, 0.0], round: [0.0025, 1.0] };
        let (mut carried, mut worst) = (Roots::none(), 0.0_f64);
        for i in 0..20_000_i32 {
            let head = 0.3 * (f64::from(i) * 5e-3).sin() + if i % 1000 < 500 { 0.0 } else { 5.0 };
            let roots = carried.at(&[head, head], &bends, 2);
            carried.keep(&roots, &bends, 2);
            worst = worst.max((roots[0] * (head * head + 0.0025).powf(0.25) - 1.0).abs());
            assert!(roots[1] == 1.0, "laminar");
        }
        assert!(worst < 5.5e-11, "{worst:e}");
    }
}
