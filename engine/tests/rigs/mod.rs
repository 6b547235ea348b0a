//! Rigs for the tests: by hand, and at random.

// Not every test uses all of them.
#![allow(dead_code)]

use std::collections::BTreeMap;

use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;
use vasos_engine::plant::spec::{PumpSpec, TankSpec, ValveDrive, ValveLaw, ValveSpec};
use vasos_engine::plant::{InputUnit, Network, RigSpec, Text};

pub fn tank(i: usize, area_cm2: f64, height_cm: f64) -> TankSpec {
    TankSpec {
        id: format!("TQ{i}"),
        signal: format!("h{i}"),
        area_cm2,
        height_cm,
        initial_cm: 0.0,
        spills_to: None,
        spill_share: 1.0,
        at: None,
        width: None,
    }
}

pub fn pump(i: usize, to: usize) -> PumpSpec {
    PumpSpec {
        id: format!("BA{i}"),
        signal: format!("u{i}"),
        flow_signal: format!("q{i}"),
        from: None,
        to: format!("TQ{to}"),
        split: BTreeMap::new(),
        unit: InputUnit::Volt,
        min: 0.0,
        max: 5.0,
        initial: 1.0,
        delay_s: 0.0,
        rate_limit: None,
        curve: vec![[0.0, 0.0], [1.0, 20.0], [2.5, 45.0], [5.0, 70.0]],
    }
}

pub fn valve(id: &str, from: usize, to: Option<usize>, k90: f64) -> ValveSpec {
    ValveSpec {
        id: id.to_owned(),
        signal: format!("q_{id}"),
        from: format!("TQ{from}"),
        to: to.map(|t| format!("TQ{t}")),
        drive: ValveDrive::FreeFall,
        law: ValveLaw::SquareRoot,
        k90,
        exponent: 1.0,
        angle_deg: 90.0,
    }
}

pub fn rig(tanks: Vec<TankSpec>, pumps: Vec<PumpSpec>, valves: Vec<ValveSpec>, delta_cm: f64) -> Network {
    let spec = RigSpec {
        fit: Default::default(),
        schema: 1,
        id: "random".to_owned(),
        title: Text::One("random".to_owned()),
        note: None,
        delta_cm,
        sample_time_s: 0.5,
        water_cm3: None,
        reservoir: None,
        converters: None,
        tanks,
        pumps,
        valves,
        sensors: vec![],
        configurations: vec![],
    };
    Network::new(spec).expect("a rig")
}

/// Tanks in a row, each with an outlet, some joined; streams only flow to tanks of higher number or between neighbours.
pub fn random_rig(rng: &mut Xoshiro256PlusPlus) -> Network {
    let n = rng.random_range(1..=6);
    let tanks = (0..n).map(|i| tank(i, rng.random_range(20.0..300.0), 60.0)).collect();
    let mut valves = vec![];
    for i in 0..n {
        let below = i + 1 < n && rng.random_bool(0.6);
        let mut out = valve(
            &format!("F{i}"),
            i,
            below.then(|| rng.random_range(i + 1..n)),
            rng.random_range(4.0..30.0),
        );
        out.law = if rng.random_bool(0.2) { ValveLaw::Laminar } else { ValveLaw::SquareRoot };
        out.angle_deg = rng.random_range(30.0..90.0);
        out.exponent = rng.random_range(1.0..3.0);
        valves.push(out);
        if i + 1 < n && rng.random_bool(0.4) {
            let mut between = valve(&format!("B{i}"), i, Some(i + 1), rng.random_range(4.0..60.0));
            between.drive = ValveDrive::Between;
            valves.push(between);
        }
    }
    let pumps = (0..rng.random_range(1..=n))
        .map(|i| {
            let mut p = pump(i, i);
            if n > 1 && rng.random_bool(0.4) {
                p.split.insert(format!("TQ{}", (i + 1) % n), rng.random_range(0.1..0.9));
            }
            p.delay_s = rng.random_range(0.1..3.0);
            p
        })
        .collect();
    rig(tanks, pumps, valves, [0.05, 0.3, 1e-3][rng.random_range(0..3)])
}
