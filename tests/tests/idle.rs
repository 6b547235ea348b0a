//! A window in which nothing happens costs nothing: it asks for no further frame.

use std::time::{Duration, Instant};

use eframe::egui::{Event, pos2};
use vasos_app::action::Action;
use vasos_app::panes::PaneKind;
use vasos_engine::document::DocumentCommand;
use vasos_tests::{Screen, typed_model};

/// A next frame further away than this was not asked for.
const NEVER: Duration = Duration::from_secs(3600);

/// Draws frames until the window asks for none, five times in a row; false when that does not come.
fn comes_to_rest(screen: &mut Screen) -> bool {
    let begun = Instant::now();
    let mut quiet = 0;
    while quiet < 5 && begun.elapsed() < Duration::from_secs(10) {
        quiet = if screen.frame(vec![]).next > NEVER { quiet + 1 } else { 0 };
        std::thread::sleep(Duration::from_millis(5));
    }
    quiet == 5
}

#[test]
fn a_paused_window_asks_for_no_frame() {
    let mut screen = Screen::new();
    assert!(comes_to_rest(&mut screen), "after the start");
    screen.act(typed_model());
    assert!(comes_to_rest(&mut screen), "with a model, its rules and curves");
    screen.act(Action::Step);
    assert!(comes_to_rest(&mut screen), "after a sample");
    screen.act(Action::ToggleTheme);
    assert!(comes_to_rest(&mut screen), "in the other theme");
    for kind in PaneKind::ALL {
        screen.act(Action::Maximise(kind));
        assert!(comes_to_rest(&mut screen), "with {kind:?} alone");
        screen.act(Action::Maximise(kind));
    }
}

#[test]
fn a_running_window_asks_for_frames_until_it_is_paused() {
    let mut screen = Screen::new();
    screen.act(Action::ToggleRunning);
    let begun = Instant::now();
    while screen.workbench.snapshot().samples < 3 {
        assert!(begun.elapsed() < Duration::from_secs(20), "the rig runs");
        screen.frame(vec![]);
        std::thread::sleep(Duration::from_millis(5));
    }
    assert!(screen.frame(vec![]).next < Duration::from_millis(100));
    screen.act(Action::ToggleRunning);
    assert!(comes_to_rest(&mut screen));
    let samples = screen.workbench.snapshot().samples;
    assert!(comes_to_rest(&mut screen));
    assert_eq!(screen.workbench.snapshot().samples, samples);
}

#[test]
fn what_waits_for_the_user_asks_for_no_frame() {
    let mut screen = Screen::new();
    screen.act(Action::Document(DocumentCommand::Setpoint("LIC-02".to_owned(), 31.0)));
    assert!(comes_to_rest(&mut screen), "with a notice");
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("log.csv");
    std::fs::write(&path, "time,pv,mv\n0,1,2\n1,1,2\n2,2,3\n3,2,3\n").expect("written");
    screen.act(Action::OpenFile(path));
    let begun = Instant::now();
    while screen.workbench.is_busy() {
        assert!(begun.elapsed() < Duration::from_secs(20), "the log is read");
        screen.frame(vec![]);
    }
    assert!(comes_to_rest(&mut screen), "with an import sheet");
    let mut screen = Screen::new();
    screen.act(typed_model());
    screen.frame(vec![]);
    // Plant, trend, table, Nyquist plot.
    for (x, y) in [(250.0, 250.0), (1150.0, 250.0), (600.0, 620.0), (1000.0, 650.0)] {
        screen.frame(vec![Event::PointerMoved(pos2(x, y))]);
        assert!(comes_to_rest(&mut screen), "with the pointer at {x}, {y}");
    }
}
