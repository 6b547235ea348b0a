//! The figures of a retuning: data and fit, step responses, Nyquist, the trade-off.

use vasos_engine::analyze::{
    CurveOptions, Excitation, LoopFunction, OpenLoop, ResponseOptions, frequency_curve, loop_response,
};
use vasos_engine::identify::ModelFit;
use vasos_engine::model::ProcessModel;
use vasos_engine::retune::{Candidate, CandidateRule, Retuning};
use vasos_engine::tune::optimum::{
    LoopLimits, Objective, OptimumProblem, Process, TradeOff, Wanted, front, on_front,
};
use vasos_engine::tune::{ControllerKind, TuningSpread, tuning_spread};
use vasos_io::report::{Axis, Chart, Ink, Mark};

use super::answer::title;
use super::one::Outcome;
use crate::tr;

fn zipped(x: &[f64], y: &[f64]) -> Vec<(f64, f64)> {
    x.iter().copied().zip(y.iter().copied()).collect()
}

/// PV, setpoint and free run above, MV below.
pub(super) fn data(outcome: &Outcome) -> Vec<Chart> {
    let stretch = &outcome.log.stretch;
    let (rows, columns) = (&stretch.rows, &outcome.log.columns);
    let fit: Option<&ModelFit> = outcome.study.choice.as_ref().ok().map(|c| c.chosen());
    let time = &rows.time_s;
    let axis = || match (time.first(), time.last()) {
        (Some(first), Some(last)) if last > first => Axis::between(tr!("retuning.time"), *first, *last),
        _ => Axis::fitting(tr!("retuning.time")),
    };
    let mut marks = vec![Mark::line(format!("PV {}", columns.pv), zipped(time, &rows.columns[0]), Ink::Data)];
    if let (Some(sp), Some(name)) = (&stretch.sp, &columns.sp) {
        marks.push(Mark::line(
            format!("{} {name}", tr!("retuning.setpoint")),
            zipped(time, sp),
            Ink::Present,
        ));
    }
    if let Some(fit) = fit.filter(|_| outcome.study.has_model()) {
        marks.push(Mark::line(tr!("retuning.free_run"), zipped(time, &fit.simulated), Ink::First));
    }
    let upper = Chart::wide(tr!("retuning.chart_pv"), axis(), Axis::fitting(columns.pv.as_str()), marks);
    let mv = vec![Mark::line(format!("MV {}", columns.mv), zipped(time, &rows.columns[1]), Ink::Third)];
    let mut lower = Chart::wide(tr!("retuning.chart_mv"), axis(), Axis::fitting(columns.mv.as_str()), mv);
    lower.height = 110.0;
    vec![upper, lower]
}

/// Candidates with their colours: the first choice first, the present tuning in its own.
fn inked(retuning: &Retuning) -> Vec<(&Candidate, Ink)> {
    let chosen = retuning.recommended;
    let mut others = 1;
    let mut all: Vec<(usize, &Candidate, Ink)> = Vec::new();
    for (place, one) in retuning.candidates.iter().enumerate() {
        let ink = if one.rule == CandidateRule::Present {
            Ink::Present
        } else if chosen == Some(place) {
            Ink::First
        } else {
            others += 1;
            Ink::of_candidate(others - 1)
        };
        all.push((place, one, ink));
    }
    // What was chosen lies on top of the others.
    all.sort_by_key(|(place, ..)| chosen == Some(*place));
    all.into_iter().map(|(_, one, ink)| (one, ink)).collect()
}

/// Time in which the slowest of the stable candidates has settled to a hundredth.
fn horizon_s(model: &ProcessModel, retuning: &Retuning) -> f64 {
    let options = ResponseOptions { settled: 0.01, ..ResponseOptions::default() };
    let ends: Vec<f64> = retuning
        .candidates
        .iter()
        .filter(|c| c.analysis.stable)
        .filter_map(|c| {
            let open = OpenLoop::of_parallel(model, &c.gains);
            let ends = [Excitation::Setpoint, Excitation::Load]
                .map(|e| loop_response(&open, e, &options).time_s.last().copied().unwrap_or(0.0));
            let end = ends[0].max(ends[1]);
            (end > 0.0).then_some(end)
        })
        .collect();
    let shortest = ends.iter().copied().fold(f64::INFINITY, f64::min);
    let longest = ends.iter().copied().fold(0.0, f64::max);
    // One sluggish tuning must not press the others into a corner.
    if longest > 0.0 { longest.min(4.0 * shortest) } else { 1.0 }
}

/// Setpoint and load steps: PV and MV of each.
pub(super) fn steps(model: &ProcessModel, retuning: &Retuning) -> Vec<Chart> {
    let horizon_s = horizon_s(model, retuning);
    [(Excitation::Setpoint, tr!("retuning.setpoint_step")), (Excitation::Load, tr!("retuning.load_step"))]
        .into_iter()
        .flat_map(|(excitation, name)| step(model, retuning, excitation, &name, horizon_s))
        .collect()
}

fn step(
    model: &ProcessModel,
    retuning: &Retuning,
    excitation: Excitation,
    name: &str,
    horizon_s: f64,
) -> [Chart; 2] {
    let options =
        ResponseOptions { horizon_s: Some(horizon_s), most_points: 700, ..ResponseOptions::default() };
    let (mut pv, mut mv) = (Vec::new(), Vec::new());
    let spread =
        retuning.choice().and_then(|c| tuning_spread(&retuning.draws, &c.gains, excitation, horizon_s));
    let band = |of: fn(&TuningSpread) -> &Vec<[f64; 3]>| {
        spread.as_ref().map(|s| Mark::Band {
            name: Some(tr!("retuning.models_90")),
            points: s.time_s.iter().zip(of(s)).map(|(t, b)| (*t, b[0], b[2])).collect(),
            ink: Ink::First,
        })
    };
    pv.extend(band(|s| &s.pv));
    mv.extend(band(|s| &s.mv));
    for (one, ink) in inked(retuning) {
        let response = loop_response(&OpenLoop::of_parallel(model, &one.gains), excitation, &options);
        pv.push(Mark::line(title(one), zipped(&response.time_s, &response.y), ink));
        mv.push(Mark::line(title(one), zipped(&response.time_s, &response.u), ink));
    }
    let time = || Axis::between(tr!("retuning.time"), 0.0, horizon_s);
    let fitted = |label: String, marks: &[Mark]| match stable_range(retuning, marks) {
        Some((low, high)) => Axis::between(label, low, high),
        None => Axis::fitting(label),
    };
    let (pv_axis, mv_axis) = (fitted(format!("PV, {name}"), &pv), fitted(format!("MV, {name}"), &mv));
    [
        Chart::half(format!("PV, {name}"), time(), pv_axis, pv),
        Chart::half(format!("MV, {name}"), time(), mv_axis, mv),
    ]
}

/// Range of the stable loops' curves: one that grows without end, or a kick at its start, must not hide the others.
fn stable_range(retuning: &Retuning, marks: &[Mark]) -> Option<(f64, f64)> {
    let stable: Vec<String> = retuning.candidates.iter().filter(|c| c.analysis.stable).map(title).collect();
    let values: Vec<f64> = marks
        .iter()
        .filter_map(|m| match m {
            Mark::Line { name: Some(name), points, .. } if stable.contains(name) => Some(points),
            _ => None,
        })
        .flat_map(|points| points.iter().map(|p| p.1))
        .filter(|v| v.is_finite())
        .collect();
    let (low, high) =
        values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
    let room = 0.08 * (high - low);
    (high > low).then_some((low - room, high + room))
}

/// Nyquist curves round −1, with the circle of the limit.
pub(super) fn nyquist(model: &ProcessModel, retuning: &Retuning, limits: &LoopLimits) -> Chart {
    let mut marks = Vec::new();
    if limits.ms.is_finite() {
        marks.push(Mark::Circle {
            name: Some(format!("Ms {}", limits.ms)),
            centre: (-1.0, 0.0),
            radius: 1.0 / limits.ms,
            ink: Ink::Limit,
        });
    }
    for (one, ink) in inked(retuning) {
        let open = OpenLoop::of_parallel(model, &one.gains);
        let curve = frequency_curve(&open, LoopFunction::OpenLoop, &CurveOptions::default());
        marks.push(Mark::line(title(one), curve.iter().map(|(_, l)| (l.re, l.im)).collect(), ink));
    }
    marks.push(Mark::Point { label: "−1".to_owned(), x: -1.0, y: 0.0, ink: Ink::Limit });
    // Equal lengths on both axes, so that the circle is one.
    let mut chart = Chart::half(
        tr!("retuning.nyquist"),
        Axis::between("Re L", -2.2, 0.6),
        Axis::between("Im L", -2.2, 0.6),
        marks,
    );
    chart.height = chart.width - 72.0;
    chart
}

/// What Jv can be for every Ms, with the candidates on it; absent where there is no front.
pub(super) fn trade_off(
    model: &ProcessModel,
    retuning: &Retuning,
    limits: &LoopLimits,
    kind: ControllerKind,
) -> Option<Chart> {
    const POINTS: usize = 24;
    let processes = [Process::Model(model.clone())];
    let wanted = if kind == ControllerKind::Pid { Wanted::pid(limits) } else { Wanted::Pi };
    let problem = OptimumProblem { processes: &processes, wanted, objective: Objective::Jv, limits: *limits };
    let points = front(&problem, TradeOff::JvMs, POINTS);
    if points.len() < 2 {
        return None;
    }
    let curve: Vec<(f64, f64)> = points.iter().filter_map(|p| Some((p.analysis.ms?, p.value))).collect();
    let mut marks = vec![Mark::line(tr!("retuning.best", controller = kind), curve, Ink::Data)];
    for (one, ink) in inked(retuning) {
        let open = OpenLoop::of_parallel(model, &one.gains);
        if let Some((ms, jv)) = on_front(&open, &one.analysis, TradeOff::JvMs) {
            marks.push(Mark::Point { label: title(one), x: ms, y: jv, ink });
        }
    }
    let mut chart = Chart::half(
        tr!("retuning.trade_off"),
        Axis::fitting(tr!("retuning.ms_axis")),
        Axis::log(tr!("retuning.jv_axis")),
        marks,
    );
    chart.height = chart.width - 72.0;
    Some(chart)
}
