//! `vasos simulate --runs`: a scenario on many rigs that differ a little from their file.

use std::sync::Arc;

use serde_json::{Value, json};
use vasos_engine::plant::Network;
use vasos_engine::sim::{EnsembleRun, MemberFigures, Scenario, Spread, quantile, run_ensemble};

use super::json::{self, shown, table};
use super::{Answer, Refusal};

/// Least, 5 %, median, 95 % and most of a figure over the plants.
fn spread_of(run: &EnsembleRun, figure: impl Fn(&MemberFigures) -> f64) -> [f64; 5] {
    let mut values: Vec<f64> = run.members.iter().map(figure).collect();
    values.sort_by(f64::total_cmp);
    [0.0, 0.05, 0.5, 0.95, 1.0].map(|share| quantile(&values, share))
}

/// Runs the rigs and says how their figures spread.
pub(super) fn run(
    network: &Arc<Network>,
    scenario: &Scenario,
    count: usize,
    spread: f64,
    as_json: bool,
) -> Result<Answer, Refusal> {
    let spread = Spread { valves: spread, areas: spread, pumps: spread };
    let run = run_ensemble(network, scenario, count, spread).map_err(Refusal::of)?;
    let figures = [
        ("iae_cm_s", spread_of(&run, |m| m.iae_cm_s)),
        ("tv", spread_of(&run, |m| m.tv)),
        ("lowest_cm", spread_of(&run, |m| m.level_cm[0])),
        ("highest_cm", spread_of(&run, |m| m.level_cm[1])),
        ("end_cm", spread_of(&run, |m| m.end_cm)),
    ];
    if as_json {
        let named = |values: &[f64; 5]| {
            let [least, p5, median, p95, most] = values;
            json!({"least": least, "p5": p5, "median": median, "p95": p95, "most": most})
        };
        let figures: serde_json::Map<String, Value> =
            figures.iter().map(|(name, values)| ((*name).to_owned(), named(values))).collect();
        let whole = json!({
            "rig": scenario.rig, "loop": run.loop_tag, "runs": run.members.len(), "in_lanes": run.in_lanes,
            "figures": figures,
            "bands": {"time_s": run.time_s, "level_cm": run.bands_cm},
        });
        return Ok(Answer::done(json::text(&whole)));
    }
    let head = ["", "least", "5 %", "median", "95 %", "most"].map(str::to_owned).to_vec();
    let rows = figures.iter().map(|(name, values)| {
        std::iter::once((*name).to_owned()).chain(values.iter().map(|v| shown(Some(*v)))).collect()
    });
    let rows: Vec<Vec<String>> = std::iter::once(head).chain(rows).collect();
    let text = format!(
        "{} rigs, {} of them side by side; {}:\n{}",
        run.members.len(),
        run.in_lanes,
        run.loop_tag,
        table(&rows)
    );
    Ok(Answer::done(text))
}
