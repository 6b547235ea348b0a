//! Descent with Levenberg–Marquardt damping, the same for every problem.
//!
//! Source: Marquardt, J. Soc. Indust. Appl. Math. 11 (1963) 431.

const START: f64 = 1e-6;
const LARGEST: f64 = 1e7;

/// Goes down from a start in at most `passes` passes, that of the start among them; counts them in `count`.
///
/// `rss` is the squared residual of a point; `step` gives the target from a point with a damping, `None` where it lies too close to matter; `evaluate` takes a pass
/// at a target, with the best point so far as its reference.
pub(super) fn descend<P, T>(
    start: P,
    passes: usize,
    count: &mut usize,
    rss: impl Fn(&P) -> f64,
    step: impl Fn(&P, f64) -> Option<T>,
    evaluate: impl Fn(T, &P) -> Option<P>,
) -> P {
    let (mut best, mut damping) = (start, START);
    for _ in 1..passes {
        let Some(target) = step(&best, damping) else { break };
        *count += 1;
        match evaluate(target, &best) {
            Some(trial) if rss(&trial) <= rss(&best) => {
                damping = (damping * 0.1).max(1e-12);
                best = trial;
            }
            _ => damping = (damping * 30.0).max(1e-3),
        }
        if damping > LARGEST {
            break;
        }
    }
    best
}
