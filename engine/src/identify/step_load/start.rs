//! Where a process and a load start together, when the fit without the load is no guide.

use super::scan::candidates;
use crate::identify::ModelFit;
use crate::identify::output_error::{Linear, Order, Point, Shape, evaluate};
use crate::identify::problem::Stretch;

/// Rows of the copy on which the dynamics of the process are scanned.
const ROWS: usize = 130;
/// Starts taken.
const STARTS: usize = 8;

/// Loads with the points they start with, from a scan over the dynamics of the process. One of second order starts near
/// what simpler structures have found, or near a scan with a first order in its place.
pub(super) fn starts(
    here: &Stretch,
    shape: &Shape,
    points: &[Point],
    simpler: &[ModelFit],
) -> Vec<(Order, Vec<Point>)> {
    if !matches!(shape.channels[0], Order::Second { .. }) {
        return scanned(here, shape, points);
    }
    let found: Vec<(Order, Vec<Point>)> = simpler
        .iter()
        .filter(|fit| fit.loads.len() == 1 && fit.parameter("T_s").is_some())
        .map(|fit| (fit.loads[0].order, fit.points()))
        .collect();
    if !found.is_empty() {
        return second_orders(shape, &found);
    }
    let mut channels = shape.channels.clone();
    channels[0] = Order::First;
    let first = Shape::new(channels, shape.drift, shape.free);
    second_orders(shape, &scanned(here, &first, points))
}

/// Second orders near first ones, with loads behind a first order and, as at the process's input, behind both lags.
fn second_orders(shape: &Shape, found: &[(Order, Vec<Point>)]) -> Vec<(Order, Vec<Point>)> {
    /// τ and L as parts of T and L of a first order, and ζ.
    const NEAR: [(f64, f64, f64); 3] = [(0.45, 0.6, 1.1), (0.3, 0.8, 2.0), (0.5, 0.6, 0.5)];
    let twice = Order::Second { zero: false };
    let mut out = vec![];
    for (order, points) in found {
        let main = points[0];
        for (tau, lag, zeta) in NEAR {
            let mut with = points.clone();
            with[0] = Point { time_s: tau * main.time_s, zeta, dead_time_s: lag * main.dead_time_s };
            out.push((*order, with.clone()));
            if *order == Order::First && shape.channels[0] == twice {
                let load = with.len() - 1;
                with[load] = Point { dead_time_s: with[load].dead_time_s, ..with[0] };
                out.push((twice, with));
            }
        }
    }
    out
}

fn scanned(here: &Stretch, shape: &Shape, points: &[Point]) -> Vec<(Order, Vec<Point>)> {
    let thin = (here.len() > ROWS).then(|| here.thinned(here.len().div_ceil(ROWS)));
    let short = thin.as_ref().unwrap_or(here);
    let quick = shape.without_derivatives();
    let mut found: Vec<(f64, Order, Vec<Point>)> = vec![];
    for main in dynamics(short, shape.channels[0]) {
        let mut at = points.to_vec();
        at[0] = main;
        let Some(at) = evaluate(short, &quick, at, &Linear::zero(&quick, short)) else { continue };
        // Residuals against the fit itself.
        let Some(at) = evaluate(short, &quick, at.points, &at.projected.linear) else { continue };
        if let Some(best) = candidates(short, &quick, &at).iter().min_by(|a, b| a.left.total_cmp(&b.left)) {
            found.push((best.left, best.order, [&at.points[..], &[best.point]].concat()));
        }
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut out: Vec<(Order, Vec<Point>)> = vec![];
    for (_, order, points) in found {
        let load = points[points.len() - 1];
        let alike = |(_, other): &(Order, Vec<Point>)| {
            let there = other[other.len() - 1];
            (there.dead_time_s - load.dead_time_s).abs() < 0.02 * here.span_s()
                && (other[0].time_s / points[0].time_s).ln().abs() < 1.0
        };
        if out.len() < STARTS && !out.iter().any(alike) {
            out.push((order, points));
        }
    }
    out
}

/// A coarse grid over the dynamics of a process.
fn dynamics(short: &Stretch, order: Order) -> Vec<Point> {
    let (span_s, step_s) = (short.span_s(), short.sample_time_s);
    let mut dead_times = vec![0.0];
    let mut dead_time_s = 2.0 * step_s;
    while dead_time_s < 0.4 * span_s {
        dead_times.push(dead_time_s);
        dead_time_s *= 1.8;
    }
    let mut times = vec![];
    let mut time_s = 1.5 * step_s;
    while time_s < span_s && order != Order::Integrator {
        times.push(time_s);
        time_s *= 2.2;
    }
    if times.is_empty() {
        times.push(short.sample_time_s);
    }
    let with = |time_s: f64| dead_times.iter().map(move |l| Point { time_s, zeta: 1.0, dead_time_s: *l });
    times.into_iter().flat_map(with).collect()
}
