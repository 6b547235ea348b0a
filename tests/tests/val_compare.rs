//! Models side by side on recordings, in the manner of the STAD paper's Figures 8 and 9 and Tables 1 and 2.

use vasos_engine::plant::{Measurement, OperatingPoint, SteadyTarget};
use vasos_engine::sim::{
    CompareError, Comparison, InputSeries, LevelResistance, ModelKind, agreement, record_real_rig,
};
use vasos_io::rig::preset;

/// Levels around 15 cm, as in the paper: moves of the pump's voltage, each held for `hold_s`.
fn series(point: &OperatingPoint, moves_v: &[f64], hold_s: f64) -> InputSeries {
    let rows = (hold_s * moves_v.len() as f64 / 0.2).round() as usize;
    let time_s: Vec<f64> = (0..rows).map(|k| 0.2 * k as f64).collect();
    let at = |t: &f64| moves_v[((t / hold_s) as usize).min(moves_v.len() - 1)];
    let column = time_s.iter().map(|t| point.inputs[0] + at(t)).collect();
    InputSeries { time_s, inputs: vec![column], angles_deg: vec![], start: point.clone() }
}

struct Case {
    configuration: &'static str,
    tank: &'static str,
    sensor: &'static str,
    valve: &'static str,
    moves_v: &'static [f64],
    hold_s: f64,
    loss_per_cm: f64,
    /// Non-linear and linear, in cm².
    paper_mse: [f64; 2],
}

const TQ2: Case = Case {
    configuration: "coupled",
    tank: "TQ2",
    sensor: "LT02",
    valve: "FV01",
    moves_v: &[0.0, 0.6, -0.8, 0.3, -0.6, 0.6, -0.4],
    hold_s: 450.0,
    loss_per_cm: 0.0085,
    paper_mse: [0.16, 0.37],
};
const TQ3: Case = Case {
    configuration: "decoupled",
    tank: "TQ3",
    sensor: "LT03",
    valve: "FV03",
    moves_v: &[0.0, -0.46, 0.28, -0.64, 0.37, -0.28, 0.0],
    hold_s: 250.0,
    loss_per_cm: 0.023,
    paper_mse: [0.85, 1.08],
};

fn comparison(case: &Case) -> (Comparison, Vec<f64>) {
    let network = preset("stad").expect("preset");
    let configuration =
        network.spec.configurations.iter().position(|c| c.id == case.configuration).expect("there");
    let tank = network.tank(case.tank).expect("a tank");
    let point = OperatingPoint::of_configuration(&network, configuration)
        .at_levels(&network, &[SteadyTarget { pump: 0, tank, level_cm: 15.0 }])
        .expect("at rest");
    let series = series(&point, case.moves_v, case.hold_s);
    let resistance = LevelResistance {
        valve: network.valve(case.valve).expect("a valve"),
        above_cm: 15.0,
        loss_per_cm: case.loss_per_cm,
    };
    let sensor = network.sensor(case.sensor).expect("a sensor");
    let recording =
        record_real_rig(&network, configuration, &series, sensor, &[resistance], Measurement::DEFAULT, 7)
            .expect("runs");
    (Comparison::new(network, &point, tank, series).expect("comparable"), recording)
}

/// The paper: 0.16 and 0.37 cm² for TQ2, 0.85 and 1.08 cm² for TQ3, non-linear and linear. Its input and its rig are not
/// printed; here the rig is the model with a valve that resists more above 15 cm, noise and converters, and moves and loss
/// are chosen so that the errors have the paper's size. What must come out is the order, for every linear model, and the
/// paper's reason for it: the models part from the rig at high levels.
#[test]
fn val_stad_tables_1_and_2_the_non_linear_model_is_nearer() {
    for case in [TQ2, TQ3] {
        let (comparison, recording) = comparison(&case);
        let trace = |kind| comparison.trace(kind, &recording).expect("a model");
        let traces: Vec<_> = ModelKind::ALL.into_iter().map(trace).collect();
        for t in &traces {
            println!(
                "{} {}: MSE {:.3} cm², fit {:.1} %",
                case.tank,
                t.kind.id(),
                t.mse_cm2,
                t.fit_percent.expect("moves")
            );
        }
        let non_linear = &traces[0];
        for linear in &traces[1..] {
            assert!(non_linear.mse_cm2 < linear.mse_cm2, "{}: {}", case.tank, linear.kind.id());
            assert!(non_linear.fit_percent > linear.fit_percent);
        }
        for (ours, paper) in [(non_linear, case.paper_mse[0]), (&traces[1], case.paper_mse[1])] {
            assert!((0.7..1.4).contains(&(ours.mse_cm2 / paper)), "{}: {}", case.tank, ours.mse_cm2);
        }
        // The non-linear model is nearer below 15 cm and parts from the rig above.
        let part = |high: bool| {
            let rows = recording.iter().zip(&non_linear.level_cm).filter(|(y, _)| (**y > 15.5) == high);
            let (y, model): (Vec<f64>, Vec<f64>) = rows.unzip();
            agreement(&y, &model).0
        };
        assert!(part(true) > 4.0 * part(false), "{} {}", part(true), part(false));
    }
}

/// Without noise and changed valves the non-linear model is the rig.
#[test]
fn a_rig_that_is_the_model_leaves_nothing() {
    let network = preset("stad").expect("preset");
    let (comparison, _) = comparison(&TQ2);
    let point = comparison.linearisation().point.clone();
    let series = series(&point, TQ2.moves_v, TQ2.hold_s);
    let y = record_real_rig(&network, 0, &series, 0, &[], Measurement::IDEAL, 0).expect("runs");
    let trace = comparison.trace(ModelKind::NonLinear, &y).expect("runs");
    assert!(trace.mse_cm2 < 1e-18, "{}", trace.mse_cm2);
}

/// All linear models are one near the operating point: they differ by the square of the move, and the FOPDT by its fit.
#[test]
fn near_the_operating_point_all_models_say_the_same() {
    let network = preset("stad").expect("preset");
    for (configuration, tank) in [(0, "TQ2"), (1, "TQ3")] {
        let tank = network.tank(tank).expect("a tank");
        let point = OperatingPoint::of_configuration(&network, configuration)
            .at_levels(&network, &[SteadyTarget { pump: 0, tank, level_cm: 15.0 }])
            .expect("at rest");
        let move_v = 1e-3;
        let comparison =
            Comparison::new(network.clone(), &point, tank, series(&point, &[move_v, -move_v], 300.0))
                .expect("comparable");
        let exact = comparison.run(ModelKind::NonLinear).expect("runs");
        let largest = exact.iter().map(|y| (y - 15.0).abs()).fold(0.0, f64::max);
        for kind in [
            ModelKind::StateSpace,
            ModelKind::StateSpaceBehindCurve,
            ModelKind::TransferFunction,
            ModelKind::Fopdt,
        ] {
            let y = comparison.run(kind).expect("runs");
            let worst = y.iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            println!("{}: {:.1e} of {largest:.1e} cm", kind.id(), worst);
            let limit = if kind == ModelKind::Fopdt { 0.05 } else { 1e-3 };
            assert!(worst < limit * largest, "{}: {worst}", kind.id());
        }
    }
}

/// A start away from the operating point: the state space starts at its levels, transfer functions at rest there.
#[test]
fn a_start_elsewhere_is_a_start_elsewhere() {
    let network = preset("stad").expect("preset");
    let tank = network.tank("TQ3").expect("a tank");
    let at = |level_cm| {
        OperatingPoint::of_configuration(&network, 1)
            .at_levels(&network, &[SteadyTarget { pump: 0, tank, level_cm }])
            .expect("at rest")
    };
    let start = at(15.02);
    let comparison =
        Comparison::new(network.clone(), &at(15.0), tank, series(&start, &[0.0], 100.0)).expect("comparable");
    for kind in [ModelKind::NonLinear, ModelKind::StateSpace, ModelKind::TransferFunction] {
        let y = comparison.run(kind).expect("runs");
        let worst = y.iter().map(|y| (y - 15.02).abs()).fold(0.0, f64::max);
        assert!(worst < 1e-4, "{}: {worst}", kind.id());
    }
    // With FV03 shut TQ3 integrates: every level is a rest, and none other than its own.
    let mut shut = OperatingPoint::of_configuration(&network, 1);
    shut.angles_deg[2] = 0.0;
    let point = shut.at_levels(&network, &[SteadyTarget { pump: 0, tank, level_cm: 12.0 }]).expect("at rest");
    let (mut about, mut moved) = (point.clone(), point);
    about.inputs[0] = 1.45;
    moved.inputs[0] = 1.55;
    let comparison =
        Comparison::new(network, &about, tank, series(&moved, &[0.0], 10.0)).expect("comparable");
    assert_eq!(comparison.run(ModelKind::TransferFunction), Err(CompareError::NoRest));
}
