//! A sample costs no memory: nothing in it may wait for the allocator.
//!
//! A test binary of its own, since the counting allocator serves the whole program.

use vasos_engine::control::{Action, Clip, Law, LoopOptions, Sends};
use vasos_engine::excitation::{AtRest, Ending, Excitation, StopReason};
use vasos_engine::plant::Measurement;
use vasos_engine::session::RigCommand;
use vasos_engine::sim::ClosedLoop;
use vasos_io::rig::{PRESETS, parse_rig, preset};
use vasos_tests::{root, signals};

#[test]
fn a_sample_allocates_nothing() {
    for p in PRESETS {
        let network = preset(p.id).expect("preset");
        let mut closed = ClosedLoop::simulated(network, 0, Measurement::DEFAULT, 1).expect("starts");
        let mut run = |samples: u32| {
            for _ in 0..samples {
                closed.step();
            }
        };
        // The stream in the air and other buffers find their size.
        run(1000);
        let counted = allocation_counter::measure(|| run(1000));
        assert_eq!((counted.count_total, counted.bytes_total), (0, 0), "{}", p.id);
    }
}

/// Every law with everything around it, and a cascade.
#[test]
fn a_sample_of_any_law_with_every_option_allocates_nothing() {
    let page = std::fs::read_to_string(root().join("assets/SCHEMA.md")).expect("the page");
    let example = page.split("```toml rig\n").nth(1).and_then(|rest| rest.split("```").next());
    let network = parse_rig("SCHEMA.md", example.expect("an example")).expect("a rig");
    let index = network.spec.configurations.iter().position(|c| c.id == "options").expect("there");
    let mut closed = ClosedLoop::simulated(network, index, Measurement::DEFAULT, 1).expect("starts");
    let integral = Law::PidI2gl { clip: Clip::Integral, sends: Sends::Increment };
    for law in [Law::default(), integral, Law::PID_2GL] {
        closed.apply(&RigCommand::Law { tag: "LIC-01".to_owned(), law }).expect("possible");
        let mut run = |samples: u32| {
            for _ in 0..samples {
                closed.step();
            }
        };
        run(1000);
        let counted = allocation_counter::measure(|| run(1000));
        assert_eq!((counted.count_total, counted.bytes_total), (0, 0), "{law:?}");
    }
    let options = Box::new(LoopOptions::default());
    closed.apply(&RigCommand::Options { tag: "LIC-01".to_owned(), options }).expect("possible");
    let on_off = Law::OnOff { gap_cm: 0.1, action: Action::Reverse };
    closed.apply(&RigCommand::Law { tag: "LIC-01".to_owned(), law: on_off }).expect("possible");
    let counted = allocation_counter::measure(|| {
        for _ in 0..1000 {
            closed.step();
        }
    });
    assert_eq!((counted.count_total, counted.bytes_total), (0, 0));
}

/// Every test on a loop, from its first sample to its last: what it needs, it reserves when it is asked for.
#[test]
fn a_sample_of_any_test_on_a_loop_allocates_nothing() {
    for signal in signals() {
        let network = preset("stad").expect("preset");
        let mut closed = ClosedLoop::simulated(network, 0, Measurement::DEFAULT, 1).expect("starts");
        for _ in 0..1000 {
            closed.step();
        }
        let excitation =
            Box::new(Excitation { at_rest: AtRest::NotNeeded, ..Excitation::new(signal.clone()) });
        closed.apply(&RigCommand::Excite { tag: "LIC-02".to_owned(), excitation }).expect("begins");
        let counted = allocation_counter::measure(|| {
            while closed.excitation_progress().is_some() {
                closed.step();
            }
        });
        assert_eq!((counted.count_total, counted.bytes_total), (0, 0), "{signal:?}");
        let report = closed.ended_excitations().next().expect("ended");
        let unheard = matches!(report.ending, Ending::Stopped(StopReason::NoOscillation { .. }));
        assert!(report.ending == Ending::Finished || unheard, "{signal:?}: {:?}", report.ending);
    }
}

#[test]
fn the_counter_counts() {
    let counted = allocation_counter::measure(|| drop(std::hint::black_box(vec![1.0_f64; 10])));
    assert_eq!((counted.count_total, counted.bytes_total), (1, 80));
}
