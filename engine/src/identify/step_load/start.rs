//! Where a process and a load start together, when the fit without the load is no guide.

use super::scan::candidates;
use crate::identify::ModelFit;
use crate::identify::output_error::{Linear, Order, Point, Shape, evaluate};
use crate::identify::problem::Stretch;

/// Rows of the copy on which the dynamics of the process are scanned.
const ROWS: usize = 300;
/// Starts taken.
const STARTS: usize = 4;

/// Loads with the points they start with: for a process of first order or integrating from a scan over its dynamics, for
/// one of second order from what simpler structures have found.
pub(super) fn starts(
    here: &Stretch,
    shape: &Shape,
    points: &[Point],
    simpler: &[ModelFit],
) -> Vec<(Order, Vec<Point>)> {
    match shape.channels[0] {
        Order::Second { .. } => near_simpler(shape, points, simpler),
        _ => scanned(here, shape, points),
    }
}

/// Second orders near the loaded fits of the others.
fn near_simpler(shape: &Shape, points: &[Point], simpler: &[ModelFit]) -> Vec<(Order, Vec<Point>)> {
    let mut out = vec![];
    for fit in simpler.iter().filter(|fit| fit.loads.len() == 1 && fit.points().len() == points.len() + 1) {
        let mut with = fit.points();
        let main = with[0];
        let load = &fit.loads[0];
        if fit.parameter("Kv").is_some() {
            continue;
        }
        let second = fit.parameter("T2_s").is_some() || fit.parameter("zeta").is_some();
        let shares: &[(f64, f64)] =
            if second { &[(1.0, main.zeta)] } else { &[(0.5, 1.0), (0.3, 2.0), (0.4, 0.5)] };
        for (share, zeta) in shares {
            let (time_s, dead_time_s) =
                (share * main.time_s, if second { 1.0 } else { 0.6 } * main.dead_time_s);
            with[0] = Point { time_s, zeta: *zeta, dead_time_s };
            out.push((load.order, with.clone()));
            if load.order == Order::First && shape.channels[0] == (Order::Second { zero: false }) {
                let mut alike = with.clone();
                let last = alike.len() - 1;
                (alike[last].time_s, alike[last].zeta) = (time_s, *zeta);
                out.push((Order::Second { zero: false }, alike));
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
