//! The program as a user meets it: the real binary on a screen, driven with the keyboard, closed with the window's
//! cross. What it leaves on disk is read back.

#![cfg(target_os = "linux")]

#[path = "end_to_end/desk.rs"]
mod desk;
#[path = "../../tests/src/skip.rs"]
mod skip;

use std::path::{Path, PathBuf};

use desk::{Desk, Window, wait};
use vasos_app::theme;
use vasos_io::recording::read_recording;

/// Rows below the plant: identification, tuning, Nyquist and step plots, which stand still while the rig runs.
const LOWER_PANES: std::ops::Range<usize> = 500..860;

fn desk(test: &str) -> Option<Desk> {
    if let Some(program) = desk::missing() {
        skip::skip(test, &format!("{program} is not installed"));
        return None;
    }
    Some(Desk::new())
}

/// A step of the pump from 2.0 V to 2.2 V at 60 s on a first-order plant.
fn step_log(path: &Path) {
    let mut text = "time,level [cm],pump [V]\n".to_owned();
    for i in 0..600 {
        let t = f64::from(i);
        let level = if t <= 62.0 { 10.0 } else { 10.0 + 0.98 * (1.0 - (-(t - 62.0) / 80.0).exp()) };
        let noise = 0.01 * (t * 12.9898).sin();
        text.push_str(&format!("{t},{:.4},{}\n", level + noise, if t >= 60.0 { 2.2 } else { 2.0 }));
    }
    std::fs::write(path, text).expect("written");
}

/// Recordings, oldest first.
fn recordings(desk: &Desk) -> Vec<PathBuf> {
    let listed = std::fs::read_dir(desk.folder().join("recordings")).expect("listed");
    let mut paths: Vec<PathBuf> = listed.map(|entry| entry.expect("an entry").path()).collect();
    paths.retain(|path| path.extension().is_some_and(|e| e == "rrd"));
    paths.sort();
    paths
}

/// Rows of the loop in a recording, which may still grow.
fn rows(path: &Path) -> usize {
    let columns = read_recording(path).unwrap_or_default();
    columns.iter().filter(|c| c.component == "loop_1").map(|c| c.time_s.len()).sum()
}

/// Starts a recording and waits until so many rows are in its file.
fn record(window: &mut Window, desk: &Desk, least: usize) -> PathBuf {
    let before = recordings(desk);
    window.press("ctrl+r");
    let path = window.wait("a recording", |_| recordings(desk).into_iter().find(|p| !before.contains(p)));
    window.wait("rows", |_| (rows(&path) >= least).then_some(()));
    path
}

fn settings(desk: &Desk) -> serde_json::Value {
    let text = std::fs::read_to_string(desk.folder().join("config/window.json")).expect("saved");
    serde_json::from_str(&text).expect("JSON")
}

#[test]
fn a_log_is_fitted_a_run_recorded_and_the_next_start_remembers() {
    let Some(desk) = desk("a_log_is_fitted_a_run_recorded_and_the_next_start_remembers") else { return };
    step_log(&desk.folder().join("step.csv"));
    let mut window = desk.open(&["step.csv"], "pt_BR.UTF-8");
    // Return says yes to the columns that the import proposes, once they are shown.
    window.wait("the log", |w| {
        w.press("Return");
        (w.title() == "Vasos · step.csv").then_some(())
    });
    let mut before = desk.look();
    wait("the panes to settle", || {
        let now = desk.look();
        let still = now.difference(&before, LOWER_PANES) == 0.0;
        before = now;
        still.then_some(())
    });
    window.press("ctrl+i");
    window.wait("a model in the panes below", |_| {
        (desk.look().difference(&before, LOWER_PANES) > 0.05).then_some(())
    });
    let path = record(&mut window, &desk, 5);
    window.press("ctrl+r");
    let first = desk.look();
    window.wait("the streams to move", |_| (desk.look().difference(&first, 0..900) > 0.0).then_some(()));
    window.press("space");
    window.wait_still();
    window.wait("rest", |w| (w.load() < 0.05).then_some(()));
    window.close();
    assert!(rows(&path) >= 5);

    let kept = settings(&desk);
    assert_eq!(kept["language"], "pt-BR");
    assert_eq!(kept["recent"][0], desk.folder().join("step.csv").to_str().expect("UTF-8"));

    // The system speaks English now; the window remembers that its user did not choose it.
    let mut window = desk.open(&[], "en_US.UTF-8");
    let title = vasos_io::rig::preset("stad").expect("a preset").spec.title.get("pt-BR").to_owned();
    window.wait("the title in Portuguese", |w| (w.title() == format!("Vasos · {title}")).then_some(()));
    // Closed in the middle of a recording.
    let path = record(&mut window, &desk, 5);
    let seen = rows(&path);
    window.close();
    assert!(rows(&path) >= seen);
    assert_eq!(recordings(&desk).len(), 2);
    assert_eq!(settings(&desk)["recent"], kept["recent"]);
}

#[test]
fn rubbish_is_refused_in_red_and_the_window_stays() {
    let Some(desk) = desk("rubbish_is_refused_in_red_and_the_window_stays") else { return };
    std::fs::create_dir(desk.folder().join("a folder")).expect("made");
    std::fs::write(desk.folder().join("words.csv"), "some words\nand more of them\nno numbers here\n")
        .expect("written");
    let [r, g, b, _] = theme::DARK.alarm.to_array();
    for rubbish in ["a folder", "words.csv"] {
        let mut window = desk.open(&[rubbish], "en_US.UTF-8");
        window.wait("the notice", |_| (desk.look().count([r, g, b]) > 3000).then_some(()));
        window.assert_alive();
        window.close();
        assert_eq!(settings(&desk)["recent"], serde_json::json!([]), "what cannot be read is not remembered");
    }
}
