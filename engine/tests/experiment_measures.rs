//! Measures on a run made by hand, and expectations on both of their sides.

use vasos_engine::experiment::{Expectation, Figure, Measure, RunColumn, RunResult};
use vasos_engine::plant::Text;

/// PV 0, 1, 3, 2, 2 at 0, 1, 2, 3, 4 s; setpoint 2, MV 5, 4, 4, 4, 4; a spill in one row.
fn run() -> RunResult {
    let column = |name: &str, values: [f64; 5]| RunColumn {
        name: name.to_owned(),
        unit: String::new(),
        values: values.to_vec(),
    };
    RunResult {
        id: "a".to_owned(),
        label: Text::One("a".to_owned()),
        x_name: "time_s".to_owned(),
        x_unit: "s".to_owned(),
        x: vec![0.0, 1.0, 2.0, 3.0, 4.0],
        columns: vec![
            column("pv", [0.0, 1.0, 3.0, 2.0, 2.0]),
            column("sp", [2.0; 5]),
            column("mv", [5.0, 4.0, 4.0, 4.0, 4.0]),
            column("spill", [0.0, 0.0, 0.1, 0.0, 0.0]),
        ],
        final_value: None,
    }
}

fn text(t: &str) -> String {
    t.to_owned()
}

#[test]
fn each_measure_is_what_its_row_in_the_format_says() {
    let (run_id, column) = (|| text("a"), || text("pv"));
    let (from, to) = (Some(1.0), Some(3.0));
    let cases = [
        (Measure::Value { run: run_id(), column: column(), at: 2.9 }, Some(3.0)),
        (Measure::Value { run: run_id(), column: column(), at: -0.1 }, None),
        (Measure::End { run: run_id(), column: column() }, Some(2.0)),
        (Measure::Max { run: run_id(), column: column(), from: Some(2.5), to: None }, Some(2.0)),
        (Measure::Min { run: run_id(), column: column(), from, to }, Some(1.0)),
        (Measure::Mean { run: run_id(), column: column(), from, to }, Some(2.0)),
        (Measure::Deviation { run: run_id(), column: column(), from, to }, Some((2.0f64 / 3.0).sqrt())),
        (Measure::Variation { run: run_id(), column: column(), from: None, to: None }, Some(4.0)),
        (Measure::Slope { run: run_id(), column: column(), from, to }, Some(0.5)),
        (Measure::Slope { run: run_id(), column: column(), from, to: from }, None),
        (Measure::Jump { run: run_id(), column: column(), at: 2.0 }, Some(2.0)),
        (Measure::Jump { run: run_id(), column: column(), at: 0.0 }, None),
        (Measure::Mean { run: run_id(), column: column(), from: Some(9.0), to: None }, None),
        (Measure::Overflows { run: run_id(), column: text("spill") }, Some(1.0)),
        (Measure::Overflows { run: run_id(), column: text("pv") }, Some(1.0)),
        (Measure::Mse { run: run_id(), column: column(), against: text("sp"), from, to }, Some(2.0 / 3.0)),
        (Measure::Fit { run: run_id(), column: column(), against: column(), from, to }, Some(100.0)),
        (Measure::Fit { run: run_id(), column: column(), against: text("sp"), from, to }, None),
    ];
    for (measure, expected) in cases {
        let found = measure.of(&run(), None);
        let close = match (found, expected) {
            (Some(a), Some(b)) => (a - b).abs() < 1e-12,
            (a, b) => a == b,
        };
        assert!(close, "{measure:?}: {found:?} for {expected:?}");
    }
}

#[test]
fn bands_levels_and_shares() {
    let (run_id, column) = (|| text("a"), || text("pv"));
    let settles = |within, to| {
        let measure =
            Measure::Settles { run: run_id(), column: column(), about: 2.0, within, from: Some(1.0), to };
        measure.of(&run(), None)
    };
    assert_eq!(
        (settles(0.1, None), settles(1.0, None), settles(0.1, Some(2.0))),
        (Some(2.0), Some(0.0), None)
    );
    let reaches = |level, from| {
        Measure::Reaches { run: run_id(), column: column(), level, from, to: None }.of(&run(), None)
    };
    assert_eq!(
        (reaches(2.5, None), reaches(2.5, Some(2.0)), reaches(4.0, None)),
        (Some(2.0), Some(3.0), None)
    );
    let crossings = Measure::Crossings { run: run_id(), column: column(), level: 2.5, from: None, to: None };
    assert_eq!(crossings.of(&run(), None), Some(2.0));
    let share = Measure::Share {
        run: run_id(),
        column: column(),
        low: Some(2.0),
        high: Some(2.5),
        from: None,
        to: None,
    };
    assert_eq!(share.of(&run(), None), Some(40.0));
}

#[test]
fn figures_know_where_a_computed_response_rests() {
    let figure = Measure::Figure {
        run: text("a"),
        figure: Figure::FinalValue,
        excitation: None,
        slot: None,
        from: None,
        to: None,
    };
    assert_eq!(figure.of(&run(), None), Some(2.0));
    let known = RunResult { final_value: Some(2.5), ..run() };
    assert_eq!(figure.of(&known, None), Some(2.5));
}

#[test]
fn distances_need_the_same_rows() {
    let distance = |against: Option<&str>| Measure::Distance {
        run: text("a"),
        column: text("pv"),
        other: text("b"),
        against: against.map(text),
        from: None,
        to: None,
    };
    let other = RunResult { id: text("b"), ..run() };
    assert_eq!(distance(None).of(&run(), Some(&other)), Some(0.0));
    assert_eq!(distance(Some("sp")).of(&run(), Some(&other)), Some(2.0));
    let later = RunResult { x: vec![0.0, 1.0, 2.0, 3.0, 5.0], ..other };
    assert_eq!(distance(None).of(&run(), Some(&later)), None);
}

#[test]
fn expectations_end_where_they_say() {
    let value = Expectation::Value { expected: 2.0, tolerance: 0.5 };
    assert!(value.admits(2.5) && value.admits(1.5) && !value.admits(2.6) && !value.admits(f64::NAN));
    let range = Expectation::Range { low: f64::NEG_INFINITY, high: 1.0 };
    assert!(range.admits(1.0) && range.admits(-1e9) && !range.admits(1.1) && !range.admits(f64::NAN));
    assert!(
        Expectation::Less { than: Some(1.0) }.admits(0.9)
            && !Expectation::Less { than: Some(1.0) }.admits(1.0)
    );
    assert!(!Expectation::Less { than: None }.admits(0.9) && !Expectation::More { than: None }.admits(0.9));
    assert!(Expectation::More { than: Some(1.0) }.admits(1.1));
}
