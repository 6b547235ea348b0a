//! The fit of a rig to a recording: its simulation against the plant's, its sensitivities against differences, its
//! parameters against those that made the record.

use std::sync::Arc;

use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use vasos_engine::identify::grey_box::{
    FreeParameter, GreyBoxFit, GreyBoxProblem, GreyBoxRecord, GreyBoxVerdict, RecordedInput, RecordedOutput,
    fit_rig, simulate_rig,
};
use vasos_engine::plant::{Network, Plant};
use vasos_io::rig::{PRESETS, preset};

/// A plant in a configuration, from a state it has come to, moved by random steps of its inputs; every level is recorded.
fn recorded(
    network: &Arc<Network>,
    configuration: usize,
    rows: usize,
    hold: usize,
    seed: u64,
) -> GreyBoxRecord {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let spec = &network.spec;
    let mut plant = Plant::new(network.clone()).expect("a plant");
    if let Some(c) = spec.configurations.get(configuration) {
        for (id, &angle) in &c.angles_deg {
            plant.set_angle(network.valve(id).expect("a valve"), angle).expect("an angle");
        }
        for (id, &delay) in &c.delays_s {
            plant.set_delay(network.pump(id).expect("a pump"), delay);
        }
    }
    let h = spec.sample_time_s;
    let pumps = spec.pumps.len();
    let draw = |rng: &mut Xoshiro256PlusPlus, i: usize| {
        let (p, share) = (&spec.pumps[i], rng.random_range(0.25..0.8));
        p.min + share * (p.max - p.min)
    };
    let mut inputs: Vec<f64> = (0..pumps).map(|i| draw(&mut rng, i)).collect();
    let levels: Vec<f64> = spec.tanks.iter().map(|t| 0.3 * t.height_cm).collect();
    let levels = if spec.water_cm3.is_some() {
        // The reservoir takes the rest.
        levels
            .iter()
            .zip(&spec.tanks)
            .map(|(l, t)| if t.initial_cm > 0.0 { t.initial_cm } else { *l })
            .collect()
    } else {
        levels
    };
    plant.set_state(&levels, &inputs).expect("a state");
    let mut record = GreyBoxRecord {
        time_s: vec![],
        inputs: (0..pumps).map(|pump| RecordedInput { pump, values: vec![] }).collect(),
        outputs: (0..spec.tanks.len())
            .map(|tank| RecordedOutput { tank, sensor: None, values: vec![] })
            .collect(),
    };
    for row in 0..rows {
        if row > 0 && row % hold == 0 {
            inputs = (0..pumps).map(|i| draw(&mut rng, i)).collect();
        }
        record.time_s.push(row as f64 * h);
        for (i, &input) in inputs.iter().enumerate() {
            plant.set_input(i, input).expect("a number");
            record.inputs[i].values.push(input);
        }
        for (output, level) in record.outputs.iter_mut().zip(plant.levels_cm()) {
            output.values.push(*level);
        }
        plant.advance(h);
    }
    record
}

fn only(mut record: GreyBoxRecord, tanks: &[usize]) -> GreyBoxRecord {
    record.outputs.retain(|o| tanks.contains(&o.tank));
    record
}

fn problem(
    network: &Arc<Network>,
    configuration: usize,
    train: GreyBoxRecord,
    free: &[(&str, [f64; 2])],
) -> GreyBoxProblem {
    let free =
        free.iter().map(|(n, b)| FreeParameter::new(network, configuration, n, *b).expect("a parameter"));
    GreyBoxProblem { free: free.collect(), network: network.clone(), configuration, train, validate: None }
}

/// Parameters as they are, the initial levels of the tanks in the record, and what is in the air.
fn unknowns(problem: &GreyBoxProblem) -> Vec<f64> {
    let levels = problem.train.outputs.iter().map(|o| o.values[0]);
    let network = &problem.network;
    let delayed = problem.train.inputs.iter().filter(|i| network.spec.pumps[i.pump].delay_s > 0.0);
    let in_air = delayed.map(|i| network.pumps[i.pump].flow_cm3_s(i.values[0]));
    problem.free.iter().map(|f| f.start).chain(levels).chain(in_air).collect()
}

#[test]
fn the_simulation_is_that_of_the_plant() {
    for p in PRESETS {
        let network = preset(p.id).expect("a preset");
        for configuration in 0..network.spec.configurations.len() {
            let record = recorded(&network, configuration, 3000, 150, 5);
            let problem = problem(&network, configuration, record, &[]);
            let (values, _) = simulate_rig(&problem, &unknowns(&problem)).expect("a simulation");
            let spills = problem.train.outputs.iter().any(|o| {
                let rim = network.tanks[o.tank].height_cm;
                o.values.iter().any(|v| *v >= rim)
            });
            // At a rim the plant takes short steps, this simulation finds the moment.
            let most = if spills { 1e-4 } else { 1e-5 };
            for (output, values) in problem.train.outputs.iter().zip(&values) {
                let off = output.values.iter().zip(values).map(|(a, b)| (a - b).abs());
                let (row, worst) = off.enumerate().fold((0, 0.0), |m, o| if o.1 > m.1 { o } else { m });
                println!("{} {configuration} tank {}: {worst:e} cm at row {row} {spills}", p.id, output.tank);
                assert!(worst < most, "{} {configuration}: {worst:e} cm in row {row}", p.id);
            }
        }
    }
}

/// Preset, configuration, tanks whose levels are recorded, free parameters with their bounds.
type Freed = (&'static str, usize, Vec<usize>, Vec<(&'static str, [f64; 2])>);

/// Free parameters of every kind.
fn of_every_kind() -> Vec<Freed> {
    vec![
        (
            "stad",
            0,
            vec![0, 1, 2],
            vec![
                ("FV01.k90", [50.0, 300.0]),
                ("FV02.k90", [20.0, 150.0]),
                ("FV03.k90", [20.0, 150.0]),
                ("BA01.scale", [0.5, 2.0]),
                ("BA01.delay_s", [0.0, 5.0]),
                ("TQ3.area_cm2", [50.0, 400.0]),
                ("TQ2.leak_cm2_5_s", [0.0, 5.0]),
            ],
        ),
        ("stad", 1, vec![0, 2], vec![("BA01.point_12", [30.0, 90.0]), ("BA01.offset_cm3_s", [-20.0, 20.0])]),
        (
            "cascade",
            0,
            vec![0, 1],
            vec![
                ("V1.k90", [1.0, 20.0]),
                ("V2.k90", [1.0, 20.0]),
                ("TQ1.height_cm", [5.0, 20.0]),
                ("TQ1.spill_share", [0.0, 1.0]),
                ("BA01.scale", [0.5, 2.0]),
                ("LT02.gain", [0.5, 2.0]),
                ("LT02.offset_cm", [-2.0, 2.0]),
            ],
        ),
    ]
}

#[test]
fn sensitivities_are_those_of_differences() {
    for (id, configuration, tanks, free) in of_every_kind() {
        let network = preset(id).expect("a preset");
        let mut record = only(recorded(&network, configuration, 2000, 130, 9), &tanks);
        for output in &mut record.outputs {
            output.sensor =
                network.spec.sensors.iter().position(|s| network.tank(&s.tank) == Some(output.tank));
        }
        let problem = problem(&network, configuration, record, &free);
        let mut at = unknowns(&problem);
        // Off the values at which terms vanish.
        if let Some(i) = free.iter().position(|f| f.0.ends_with("leak_cm2_5_s")) {
            at[i] = 0.7;
        }
        if let Some(i) = free.iter().position(|f| f.0.ends_with("spill_share")) {
            at[i] = 0.6;
        }
        let (_, slopes) = simulate_rig(&problem, &at).expect("a simulation");
        for i in 0..at.len() {
            let step = 2e-5 * at[i].abs().max(1.0);
            let moved = |by: f64| {
                let mut at = at.clone();
                at[i] += by;
                simulate_rig(&problem, &at).expect("a simulation").0
            };
            let (above, below) = (moved(step), moved(-step));
            let all = slopes.iter().flatten().map(|s| s[i].abs());
            let largest = all.fold(0.0, f64::max);
            for output in 0..slopes.len() {
                let numeric = |row: usize| (above[output][row] - below[output][row]) / (2.0 * step);
                let off: Vec<f64> = (0..slopes[output].len())
                    .map(|row| (slopes[output][row][i] - numeric(row)).abs())
                    .collect();
                // A row that lies within a step's width of a kink has no slope.
                let mut sorted = off.clone();
                sorted.sort_by(f64::total_cmp);
                let worst = sorted[sorted.len() - 1 - sorted.len() / 100];
                let name = free.get(i).map_or("initial level", |f| f.0);
                println!("{id} {name} output {output}: {:e} of {largest:e}", worst);
                // To a ten-thousandth of a millimetre for a change of the unknown by its own size.
                let most = 1e-5 * largest.max(1.0 / at[i].abs().max(1.0));
                assert!(worst <= most, "{id} {name} output {output}: {worst:e} of {largest:e}");
            }
        }
    }
}

fn value(fit: &GreyBoxFit, name: &str) -> f64 {
    fit.parameters.iter().find(|p| p.name == name).expect("a parameter").value
}

/// The record of a rig with other parameters than the file's.
fn changed(
    network: &Arc<Network>,
    configuration: usize,
    free: &[(&str, [f64; 2])],
    truth: &[f64],
) -> Arc<Network> {
    let empty = GreyBoxRecord { time_s: vec![], inputs: vec![], outputs: vec![] };
    let spec = problem(network, configuration, empty, free).spec_with(truth);
    Arc::new(Network::new(spec).expect("a rig"))
}

#[test]
fn a_record_without_noise_gives_back_what_made_it() {
    let network = preset("stad").expect("a preset");
    let free = [
        ("FV01.k90", [50.0, 300.0]),
        ("FV02.k90", [20.0, 150.0]),
        ("FV03.k90", [20.0, 150.0]),
        ("BA01.scale", [0.5, 2.0]),
        ("BA01.delay_s", [0.0, 5.0]),
    ];
    let truth = [121.0, 71.0, 55.0, 0.93, 2.34];
    let real = changed(&network, 0, &free, &truth);
    let record = only(recorded(&real, 0, 6000, 250, 3), &[1, 2]);
    let started = std::time::Instant::now();
    let fit = fit_rig(&problem(&network, 0, record, &free)).expect("a fit");
    println!("{:?} {} runs, rmse {:e}", started.elapsed(), fit.runs, fit.train.rmse);
    for ((name, _), truth) in free.iter().zip(truth) {
        let found = value(&fit, name);
        println!("{name} {found} of {truth}");
        assert!((found / truth - 1.0).abs() < 1e-5, "{name}: {found}, not {truth}");
    }
    assert!(matches!(fit.verdicts[0], GreyBoxVerdict::Good { .. }), "{:?}", fit.verdicts);
}

/// Adds white noise to every output.
fn noisy(mut record: GreyBoxRecord, sigma: f64, seed: u64) -> GreyBoxRecord {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    for value in record.outputs.iter_mut().flat_map(|o| &mut o.values) {
        // Twelve uniform numbers add up to a normal one with variance 1.
        let sum: f64 = (0..12).map(|_| rng.random::<f64>()).sum();
        *value += sigma * (sum - 6.0);
    }
    record
}

#[test]
fn intervals_hold_the_truth_as_often_as_they_say() {
    let network = preset("stad").expect("a preset");
    let free = [
        ("FV01.k90", [50.0, 300.0]),
        ("FV03.k90", [20.0, 150.0]),
        ("BA01.scale", [0.5, 2.0]),
        ("BA01.delay_s", [0.0, 5.0]),
    ];
    let truth = [131.0, 60.0, 1.04, 1.71];
    let real = changed(&network, 1, &free, &truth);
    let exact = only(recorded(&real, 1, 1500, 120, 4), &[2]);
    const SEEDS: u64 = 60;
    let (mut inside, mut rmse) = (0, 0.0);
    for seed in 0..SEEDS {
        let fit = fit_rig(&problem(&network, 1, noisy(exact.clone(), 0.05, seed), &free)).expect("a fit");
        let holds = |(p, t): (&vasos_engine::identify::grey_box::RigParameter, f64)| {
            (p.interval_95[0]..=p.interval_95[1]).contains(&t)
        };
        inside += fit.parameters.iter().zip(truth).filter(|(p, t)| holds((p, *t))).count();
        rmse += fit.train.rmse / SEEDS as f64;
    }
    let share = inside as f64 / (SEEDS as f64 * free.len() as f64);
    println!("{share} of the intervals hold the truth; rmse {rmse}");
    assert!((0.90..=0.99).contains(&share), "{share}");
    assert!((rmse / 0.05 - 1.0).abs() < 0.02, "{rmse}");
}

#[test]
fn missing_outputs_are_passed_over() {
    let network = preset("stad").expect("a preset");
    let free = [("FV03.k90", [20.0, 150.0]), ("BA01.scale", [0.5, 2.0])];
    let mut record = only(recorded(&network, 1, 1500, 120, 4), &[2]);
    record.outputs[0].values.iter_mut().step_by(3).for_each(|v| *v = f64::NAN);
    record.inputs[0].values[700..705].fill(f64::NAN);
    let fit = fit_rig(&problem(&network, 1, record, &free)).expect("a fit");
    assert!((value(&fit, "FV03.k90") / 63.6 - 1.0).abs() < 1e-5);
}

#[test]
fn what_a_record_cannot_tell_is_said() {
    let network = preset("stad").expect("a preset");
    let exact = only(recorded(&network, 1, 1500, 120, 4), &[2]);
    let verdicts = |free: &[(&str, [f64; 2])]| {
        fit_rig(&problem(&network, 1, noisy(exact.clone(), 0.05, 1), free)).expect("a fit").verdicts
    };
    // FV02 is shut in this configuration.
    let shut = verdicts(&[("FV02.k90", [20.0, 150.0]), ("FV03.k90", [20.0, 150.0])]);
    assert!(shut.contains(&GreyBoxVerdict::NoEffect { name: "FV02.k90".to_owned() }), "{shut:?}");
    // All flows and all areas by one factor give the same levels.
    let scaled = verdicts(&[
        ("FV01.k90", [50.0, 300.0]),
        ("FV03.k90", [20.0, 150.0]),
        ("BA01.scale", [0.5, 2.0]),
        ("TQ1.area_cm2", [50.0, 400.0]),
        ("TQ3.area_cm2", [50.0, 400.0]),
    ]);
    let said =
        |v: &GreyBoxVerdict| matches!(v, GreyBoxVerdict::MakeUp { names } if names.contains("TQ3.area_cm2"));
    assert!(scaled.iter().any(said), "{scaled:?}");
}

#[test]
fn what_is_wrong_is_said() {
    let network = preset("stad").expect("a preset");
    let wrong = |name: &str, bounds: [f64; 2]| {
        FreeParameter::new(&network, 0, name, bounds).expect_err("not possible").to_string()
    };
    assert!(wrong("FV01.q", [0.0, 1.0]).contains("FV01.k90"));
    assert!(wrong("FV01.k90", [2.0, 1.0]).contains("must lie below"));
    assert!(wrong("FV01.k90", [1.0, 2.0]).contains("outside its bounds"));
    assert!(wrong("FV01.k90", [-1.0, 200.0]).contains("not possible"));
    let record = only(recorded(&network, 1, 200, 120, 4), &[2]);
    let said = |p: &GreyBoxProblem| fit_rig(p).expect_err("not possible").to_string();
    let free = [("FV03.k90", [20.0, 150.0])];
    assert!(said(&problem(&network, 1, record.clone(), &[])).contains("[fit]"));
    let mut still = record.clone();
    still.outputs[0].values.fill(3.0);
    assert!(said(&problem(&network, 1, still, &free)).contains("does not move"));
    let mut no_input = record.clone();
    no_input.inputs.clear();
    assert!(said(&problem(&network, 1, no_input, &free)).contains("u=COLUMN"));
    let mut short = record;
    short.time_s.truncate(8);
    short.inputs[0].values.truncate(8);
    short.outputs[0].values.truncate(8);
    assert!(said(&problem(&network, 1, short, &free)).contains("needs at least"));
}
