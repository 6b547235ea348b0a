//! A sample costs no memory: nothing in it may wait for the allocator.
//!
//! A test binary of its own, since the counting allocator serves the whole program.

use vasos_engine::plant::Measurement;
use vasos_engine::sim::ClosedLoop;
use vasos_io::rig::{PRESETS, preset};

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

#[test]
fn the_counter_counts() {
    let counted = allocation_counter::measure(|| drop(std::hint::black_box(vec![1.0_f64; 10])));
    assert_eq!((counted.count_total, counted.bytes_total), (1, 80));
}
