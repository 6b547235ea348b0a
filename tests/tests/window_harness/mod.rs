//! A window without a display: opened, driven, waited for, pictured.

#![allow(dead_code, reason = "each test binary uses its part")]

use std::path::PathBuf;
use std::time::{Duration, Instant};

use egui_kittest::Harness;
use vasos_app::action::Action;
use vasos_app::workbench::{Options, Workbench};

/// A window under test.
pub type Window<'a> = Harness<'a, Workbench>;

/// A window of a size, paused at time 0, without settings.
pub fn window<'a>(size: [f32; 2]) -> Window<'a> {
    let options = Options { paused: true, forget: true, ..Options::default() };
    let mut harness = Harness::builder()
        .with_size(size)
        .with_max_steps(12)
        .wgpu()
        .build_eframe(|cc| Workbench::new(&cc.egui_ctx, options).expect("the preset starts"));
    harness.run_steps(3);
    harness
}

/// Carries an action out, and draws a frame.
pub fn act(harness: &mut Window, action: Action) {
    let ctx = harness.ctx.clone();
    harness.state_mut().act(&ctx, action);
    harness.run_steps(1);
}

/// Draws frames until something is so.
pub fn wait(harness: &mut Window, what: &str, mut done: impl FnMut(&Workbench) -> bool) {
    let start = Instant::now();
    while !done(harness.state()) {
        assert!(start.elapsed() < Duration::from_secs(20), "waited in vain for: {what}");
        std::thread::sleep(Duration::from_millis(5));
        harness.run_steps(1);
    }
    harness.run_steps(2);
}

/// Lets the rig take samples.
pub fn step(harness: &mut Window, samples: u64) {
    let wanted = harness.state().snapshot().samples + samples;
    send(harness, samples);
    wait(harness, "samples", |w| w.snapshot().samples >= wanted);
}

/// Asks for samples without drawing a frame for each.
pub fn send(harness: &mut Window, samples: u64) {
    let ctx = harness.ctx.clone();
    for _ in 0..samples {
        harness.state_mut().act(&ctx, Action::Step);
    }
}

/// A file as the system hands it over when it is let go above the window.
#[derive(Debug)]
struct Dropped(PathBuf);

impl eframe::egui::DroppedFile for Dropped {
    fn path(&self) -> &std::path::Path {
        &self.0
    }

    fn bytes(&self) -> Result<Vec<u8>, String> {
        std::fs::read(&self.0).map_err(|e| e.to_string())
    }
}

/// Lets a file go above the window.
pub fn drop_on(harness: &mut Window, path: PathBuf) {
    harness.input_mut().dropped_files.push(std::sync::Arc::new(Dropped(path)));
    harness.run_steps(1);
    assert!(harness.state().is_busy() || !harness.state().journal().is_empty(), "the drop was noticed");
}

/// Compares a picture with the last.
pub fn picture(harness: &mut Window, name: &str) {
    // What panes have asked for is worked out beside the window, one question after the other.
    for _ in 0..3 {
        harness.run_steps(2);
        wait(harness, "answers", |w| !w.is_answering());
    }
    // Software renderers of other versions differ by a little in antialiasing.
    let options = egui_kittest::SnapshotOptions::new().threshold(1.5).max_failed_pixels(1500);
    harness.snapshot_options(name, &options);
}
