//! Faults: each does what it says, is an event, and no water is lost but what leaks.

use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use vasos_engine::daq::{RigControls, SimulatedRig, Source};
use vasos_engine::plant::{Fault, FaultKind, FaultyPart, Measurement, Plant, ReadingStatus};
use vasos_engine::session::{CommandError, RigCommand};
use vasos_engine::sim::ClosedLoop;
use vasos_io::rig::{PRESETS, preset};

fn random_fault(kind: FaultKind, rng: &mut Xoshiro256PlusPlus) -> Fault {
    match kind {
        FaultKind::Stuck => Fault::Stuck,
        FaultKind::Drift => Fault::Drift { rate_cm_s: rng.random_range(-0.1..0.1) },
        FaultKind::BrokenWire => Fault::BrokenWire,
        FaultKind::Spikes => Fault::Spikes { height_cm: 5.0, every_s: 3.0 },
        FaultKind::Clogged => Fault::Clogged { share: rng.random_range(0.0..=1.0) },
        FaultKind::Leak => Fault::Leak { k_cm2_5_s: rng.random_range(0.0..5.0) },
        FaultKind::WeakPump => Fault::WeakPump { share: rng.random_range(0.0..=1.0) },
        FaultKind::DryPump => Fault::DryPump,
        FaultKind::PowerCut => Fault::PowerCut,
    }
}

fn tags(rig: &SimulatedRig) -> Vec<String> {
    let spec = &rig.network().spec;
    let ids = (spec.sensors.iter().map(|s| &s.id))
        .chain(spec.valves.iter().map(|v| &v.id))
        .chain(spec.tanks.iter().map(|t| &t.id))
        .chain(spec.pumps.iter().map(|p| &p.id));
    ids.chain([&spec.id]).cloned().collect()
}

/// The issue: conservation under random operation of every valve, pump and fault for 10⁶ samples, to 1e-9 of the
/// total; a leak is booked as such.
#[test]
fn water_is_conserved_over_a_million_samples_of_everything_that_can_be_done() {
    let samples = 1_000_000 / PRESETS.len() + 1;
    for (index, p) in PRESETS.iter().enumerate() {
        let network = preset(p.id).expect("preset");
        let mut rig = SimulatedRig::new(network.clone(), Measurement::DEFAULT, 1).expect("starts");
        let tags = tags(&rig);
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(100 + index as u64);
        let balance = |rig: &SimulatedRig| rig.plant().expect("simulated").balance();
        let total = balance(&rig).total_cm3();
        let (mut worst, mut moved, mut seen) = (0.0_f64, 0.0, std::collections::HashSet::new());
        let mut readings = vec![
            vasos_engine::plant::Reading { level_cm: 0.0, status: ReadingStatus::Good };
            network.sensors.len()
        ];
        for sample in 0..samples {
            if sample % 40 == 0 {
                let tag = &tags[rng.random_range(0..tags.len())];
                if rng.random_bool(0.6) {
                    drop(rig.repair(tag, None));
                } else {
                    let kinds = FaultyPart::find(&network, tag).expect("a tag").possible();
                    let fault = random_fault(kinds[rng.random_range(0..kinds.len())], &mut rng);
                    rig.set_fault(tag, fault).expect("possible");
                    seen.insert(fault.kind().key());
                }
                let shut = rng.random_bool(0.3);
                let angle_deg = if shut { 0.0 } else { rng.random_range(0.0..=90.0) };
                rig.set_angle(rng.random_range(0..network.valves.len()), angle_deg).expect("possible");
            }
            if sample % 1500 == 0 {
                rig.bump(rng.random_range(0..network.tanks.len()), rng.random_range(-9.0..9.0))
                    .expect("finite");
            }
            if sample % 20_000 == 0 {
                // A leak empties a closed circuit in the end: refill it now and then.
                rig.configure(rng.random_range(0..network.spec.configurations.len())).expect("possible");
                let missing = total - balance(&rig).tanks_cm3 - balance(&rig).in_flight_cm3;
                if network.spec.water_cm3.is_some() && missing > 4000.0 {
                    let inputs = rig.plant().expect("simulated").inputs().to_vec();
                    let levels: Vec<f64> = network.tanks.iter().map(|t| 0.1 * t.height_cm).collect();
                    drop(rig.set_state(&levels, &inputs));
                }
            }
            if sample % 7 == 0 {
                let pump = rng.random_range(0..network.pumps.len());
                let range = &network.pumps[pump];
                rig.write(pump, rng.random_range(range.min..=range.max)).expect("finite");
            }
            rig.read(&mut readings);
            rig.advance(network.spec.sample_time_s);
            let plant = rig.plant().expect("simulated");
            moved += network.spec.sample_time_s * plant.pumped_flows_cm3_s().iter().sum::<f64>();
            for (level, tank) in plant.levels_cm().iter().zip(&network.tanks) {
                assert!((0.0..=tank.height_cm * (1.0 + 1e-12)).contains(level), "{}: {level} cm", p.id);
            }
            worst = worst.max((plant.balance().total_cm3() - total).abs());
        }
        let leaked_cm3 = balance(&rig).leaked_cm3;
        println!("{}: {worst:.1e} cm³ of {:.0}, {leaked_cm3:.0} leaked, {seen:?}", p.id, total.max(moved));
        assert!(worst < 1e-9 * total.max(moved), "{}: {worst} cm³", p.id);
        assert!(seen.len() == FaultKind::ALL.len(), "every fault must have been there: {seen:?}");
    }
}

fn loop_at_rest() -> ClosedLoop {
    ClosedLoop::simulated(preset("stad").expect("preset"), 0, Measurement::IDEAL, 1).expect("starts")
}

fn fault(tag: &str, fault: Fault) -> RigCommand {
    RigCommand::Fault { tag: tag.to_owned(), fault }
}

fn repair(tag: &str) -> RigCommand {
    RigCommand::Repair { tag: tag.to_owned(), kind: None }
}

fn run(closed: &mut ClosedLoop, samples: usize) -> &Plant {
    for _ in 0..samples {
        closed.step();
    }
    closed.source().plant().expect("simulated")
}

#[test]
fn a_leak_lowers_the_water_of_the_circuit_by_what_is_booked() {
    let mut closed = loop_at_rest();
    let before = closed.source().plant().expect("simulated").balance();
    closed.apply(&fault("TQ3", Fault::Leak { k_cm2_5_s: 2.0 })).expect("possible");
    let plant = run(&mut closed, 500);
    let after = plant.balance();
    assert!(after.leaked_cm3 > 100.0 && plant.leak_flows_cm3_s()[2] > 1.0);
    let gone = before.tanks_cm3 + before.in_flight_cm3 - after.tanks_cm3 - after.in_flight_cm3;
    assert!((gone - after.leaked_cm3).abs() < 1e-9 * before.total_cm3());
    closed.apply(&repair("TQ3")).expect("it leaks");
    let mended = run(&mut closed, 100).balance();
    assert!((mended.leaked_cm3 - after.leaked_cm3).abs() < 1e-9, "nothing more leaks");
}

#[test]
fn a_weak_pump_and_a_clogged_valve_do_as_much_as_they_say() {
    let mut closed = loop_at_rest();
    let flow = run(&mut closed, 5).pumped_flows_cm3_s()[0];
    closed
        .apply(&RigCommand::Mode { tag: "LIC-02".to_owned(), mode: vasos_engine::control::Mode::Manual })
        .expect("loop");
    closed.apply(&fault("BA01", Fault::WeakPump { share: 0.6 })).expect("possible");
    assert!((run(&mut closed, 1).pumped_flows_cm3_s()[0] - 0.6 * flow).abs() < 1e-9);
    closed.apply(&repair("BA01")).expect("weak");
    closed.apply(&fault("BA01", Fault::DryPump)).expect("possible");
    let dry = run(&mut closed, 1);
    assert!(dry.pumped_flows_cm3_s()[0] == 0.0 && dry.dry()[0]);
    closed.apply(&repair("BA01")).expect("dry");
    let k = closed.source().plant().expect("simulated").coefficients()[0];
    closed.apply(&fault("FV01", Fault::Clogged { share: 0.25 })).expect("possible");
    assert!((closed.source().plant().expect("simulated").coefficients()[0] - 0.25 * k).abs() < 1e-12);
    // Turning a clogged valve keeps it clogged; repairing it gives back what the angle allows.
    closed.apply(&RigCommand::Valve { tag: "FV01".to_owned(), angle_deg: 90.0 }).expect("possible");
    assert!((closed.source().plant().expect("simulated").coefficients()[0] - 0.25 * 137.6).abs() < 1e-9);
    closed.apply(&repair("FV01")).expect("clogged");
    assert!((closed.source().plant().expect("simulated").coefficients()[0] - 137.6).abs() < 1e-9);
}

#[test]
fn a_power_cut_stops_the_pump_and_takes_the_sensors_current_away() {
    let mut closed = loop_at_rest();
    run(&mut closed, 5);
    closed.apply(&fault("stad", Fault::PowerCut)).expect("possible");
    let mv = closed.loops()[0].control.mv();
    let plant = run(&mut closed, 20);
    assert_eq!(plant.pumped_flows_cm3_s()[0], 0.0);
    assert!(closed.readings().iter().all(|r| r.status == ReadingStatus::Broken && r.level_cm.is_nan()));
    assert!(closed.loops()[0].held && closed.loops()[0].control.mv() == mv, "the output is held");
    closed.apply(&repair("stad")).expect("cut");
    assert!(run(&mut closed, 1).pumped_flows_cm3_s()[0] > 0.0);
    assert!(closed.readings()[0].status == ReadingStatus::Good);
}

/// While the wire is broken the output is held; when the PV is back, elsewhere, only the integral moves it.
#[test]
fn a_mended_wire_brings_no_jump() {
    for law in ["pid_i2gl", "pid_2gl"] {
        let mut closed = loop_at_rest();
        run(&mut closed, 5);
        let law = toml::from_str(&format!("kind = \"{law}\"")).expect("a law");
        closed.apply(&RigCommand::Law { tag: "LIC-02".to_owned(), law }).expect("possible");
        run(&mut closed, 5);
        closed.apply(&fault("LT02", Fault::BrokenWire)).expect("possible");
        closed.apply(&RigCommand::Valve { tag: "FV01".to_owned(), angle_deg: 28.0 }).expect("possible");
        run(&mut closed, 500);
        let held = closed.loops()[0].control.mv();
        closed.apply(&repair("LT02")).expect("broken");
        run(&mut closed, 1);
        let now = &closed.loops()[0].control;
        let error_cm = now.setpoint_cm - closed.readings()[0].level_cm;
        assert!(error_cm.abs() > 2.0, "the level has moved: {error_cm} cm");
        let gains = now.tuning().gains;
        let integral = gains.kc * 0.2 / gains.ti_s * error_cm;
        assert!((now.mv() - held - integral).abs() < 1e-12, "{} V, integral {integral} V", now.mv() - held);
    }
}

#[test]
fn what_cannot_break_that_way_is_refused_in_words() {
    let mut closed = loop_at_rest();
    let refusal = |closed: &mut ClosedLoop, command: RigCommand| {
        closed.apply(&command).expect_err("must be refused").to_string()
    };
    let wrong = refusal(&mut closed, fault("FV01", Fault::Stuck));
    assert!(wrong.contains("FV01") && wrong.contains("clogged"), "{wrong}");
    let share = refusal(&mut closed, fault("FV01", Fault::Clogged { share: 1.5 }));
    assert!(share.contains("share") && share.contains("0…1"), "{share}");
    assert!(refusal(&mut closed, fault("FV09", Fault::Stuck)).contains("FV09"));
    assert!(refusal(&mut closed, fault("LT02", Fault::Drift { rate_cm_s: f64::NAN })).contains("rate_cm_s"));
    assert!(refusal(&mut closed, repair("LT02")).contains("LT02"));
    closed.apply(&fault("TQ1", Fault::Leak { k_cm2_5_s: 1.0 })).expect("possible");
    let at_rest = RigCommand::SteadyAt { tag: "LIC-02".to_owned(), level_cm: 12.0 };
    assert!(matches!(closed.apply(&at_rest), Err(CommandError::Faulty { .. })));
}

#[test]
fn a_scenario_file_can_break_and_repair() {
    let text = r#"
        at_s = 10.0
        fault = { tag = "LT02", kind = "drift", rate_cm_s = 0.02 }
    "#;
    let event: vasos_engine::sim::ScenarioEvent = toml::from_str(text).expect("an event");
    assert_eq!(event.command, fault("LT02", Fault::Drift { rate_cm_s: 0.02 }));
    let text = "at_s = 20.0\nrepair = { tag = \"LT02\", kind = \"drift\" }";
    let event: vasos_engine::sim::ScenarioEvent = toml::from_str(text).expect("an event");
    let kind = Some(FaultKind::Drift);
    assert_eq!(event.command, RigCommand::Repair { tag: "LT02".to_owned(), kind });
}
