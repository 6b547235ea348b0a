//! What a frame of the whole window costs the processor: layout, all panes, and the triangles for the graphics card.

use std::hint::black_box;
use std::sync::Arc;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use vasos_app::action::Action;
use vasos_app::workbench::Workbench;
use vasos_engine::signal::{ChannelKind, ChannelSet, SampleBlock};
use vasos_tests::{Screen, typed_model};

/// What the trend shows at the first start.
const IN_VIEW_S: f64 = 300.0;
/// Rows of one delivery.
const BLOCK: usize = 10_000;

/// A window with a model, its rules compared, and samples that all lie in the trend's view.
fn screen(samples: usize) -> Screen {
    let mut screen = Screen::new();
    screen.frame(vec![]);
    screen.act(typed_model());
    preload(&mut screen.workbench, samples);
    // Sizes of texts and panes settle, pictures of letters are made.
    for _ in 0..10 {
        screen.frame(vec![]);
    }
    assert!(screen.workbench.tuning().rows.len() > 15);
    assert!(samples == 0 || screen.workbench.run().end_s() > 0.99 * IN_VIEW_S);
    screen
}

/// A loop that swings, with noise: no two neighbours are equal, as in a plant.
fn preload(workbench: &mut Workbench, samples: usize) {
    let snapshot = workbench.snapshot();
    let channels = Arc::new(ChannelSet::of(&snapshot.network));
    for first in (0..samples).step_by(BLOCK) {
        let mut block =
            SampleBlock { run: snapshot.run, channels: channels.clone(), time_s: vec![], values: vec![] };
        for k in first..(first + BLOCK).min(samples) {
            let time_s = k as f64 * IN_VIEW_S / samples as f64;
            let noise = 0.05 * (k as f64 * 12.9898).sin();
            block.time_s.push(time_s);
            block.values.extend(channels.channels.iter().map(|channel| match channel.kind {
                ChannelKind::Setpoint(_) => 15.0 + f64::from(u8::from(time_s > 60.0)),
                ChannelKind::Pv(_) => 15.0 + (time_s / 20.0).sin() + noise,
                ChannelKind::Mv(_) => 2.5 + 0.3 * (time_s / 20.0).cos() + noise,
                _ => 10.0,
            }));
        }
        workbench.preload(&block);
    }
}

fn frame(c: &mut Criterion) {
    let mut group = c.benchmark_group("frame_of_1440x900");
    for samples in [10_000, 1_000_000] {
        let mut screen = screen(samples);
        group.bench_function(BenchmarkId::new("samples_in_view", samples), |b| {
            b.iter(|| black_box(screen.frame(vec![])));
        });
    }
    // Readings, streams and clocks change from frame to frame.
    let mut screen = screen(0);
    screen.act(Action::Speed(100.0));
    screen.act(Action::ToggleRunning);
    group.bench_function("running_100_times_as_fast", |b| b.iter(|| black_box(screen.frame(vec![]))));
    group.finish();
}

criterion_group!(benches, frame);
criterion_main!(benches);
