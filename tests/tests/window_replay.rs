//! Recordings in the window, driven through its accessible names, without a display.

mod window_harness;

use std::time::Duration;

use egui_kittest::kittest::Queryable;
use vasos_app::action::Action;
use vasos_engine::control::{PidGains, PidTuning};
use vasos_engine::document::{DocumentCommand, SourceChoice, Stretch};
use vasos_engine::plant::Measurement;
use vasos_engine::session::{Rig, RigCommand, Session, SessionCommand};
use vasos_io::recording::{Recording, RecordingOptions};
use window_harness::{Window, act, drop_on, picture, step, wait, window};

/// A recording of three minutes with a step of the setpoint, of the valve and another tuning.
fn recorded(path: &std::path::Path, runs: usize) {
    let network = vasos_io::rig::preset("stad").expect("preset");
    let rig = Rig { network, configuration: 0, measurement: Measurement::DEFAULT, seed: 7 };
    let session = Session::start(&rig, Box::new(|| ())).expect("starts");
    let options = RecordingOptions { serve: false, ..RecordingOptions::default() };
    let (recording, sink) = Recording::start(path, options).expect("records");
    assert!(session.send(SessionCommand::Attach { id: recording.id(), sink }));
    let tag = || "LIC-02".to_owned();
    let samples = |count: u64| {
        let wanted = session.snapshot().samples + count;
        (0..count).for_each(|_| assert!(session.send(SessionCommand::Step)));
        while session.snapshot().samples < wanted {
            std::thread::sleep(Duration::from_millis(2));
        }
    };
    for run in 0..runs as u64 {
        if run > 0 {
            assert!(session.send(SessionCommand::Load(Box::new(rig.clone()))));
            while session.snapshot().run < run {
                std::thread::sleep(Duration::from_millis(2));
            }
        }
        samples(100);
        let tuning = PidTuning::new(PidGains { kc: 4.0, ti_s: 60.0, td_s: 0.0, n: 10.0 });
        for command in [
            RigCommand::Tuning { tag: tag(), tuning },
            RigCommand::Setpoint { tag: tag(), level_cm: 17.0 },
            RigCommand::Valve { tag: "FV03".to_owned(), angle_deg: 70.0 },
        ] {
            assert!(session.send(SessionCommand::Rig(command)));
            samples(250);
        }
    }
    assert!(session.send(SessionCommand::Detach { id: recording.id() }));
    recording.close().expect("closes");
}

/// The issue: Replay as a source with scrub bar and speed. A recording brings its rig and its settings; nothing of it can
/// be changed, and the simulated rig is as it was when it comes back.
#[test]
fn a_recording_is_played_and_scrubbed_through() {
    let mut results = egui_kittest::SnapshotResults::new();
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("lesson.rrd");
    recorded(&path, 1);
    let mut harness = window([1440.0, 900.0]);
    act(&mut harness, Action::OpenPreset("simtank1"));
    step(&mut harness, 30);
    drop_on(&mut harness, path);
    wait(&mut harness, "the recording", |w| w.snapshot().span_s.is_some() && w.run().end_s() > 169.0);
    assert_eq!(harness.state().document().source, SourceChoice::Replay);
    assert_eq!(harness.state().snapshot().network.spec.id, "stad");
    let kc = |h: &Window| h.state().snapshot().loops[0].tuning.gains.kc;
    assert_eq!((kc(&harness), harness.state().snapshot().loops[0].setpoint_cm), (1.8, 15.0));
    act(&mut harness, Action::Seek(100.0));
    wait(&mut harness, "another time", |w| w.snapshot().time_s == 100.0);
    assert_eq!((kc(&harness), harness.state().snapshot().loops[0].setpoint_cm), (4.0, 17.0));
    harness.get_by_label("Time of the recording");
    // What the recording cannot do is said, and nothing has changed.
    act(&mut harness, Action::Document(DocumentCommand::Setpoint("LIC-02".to_owned(), 12.0)));
    let said = harness.state().journal().back().expect("an entry").words.clone();
    assert!(said.contains("recording cannot be changed"), "{said}");
    assert_eq!(harness.state().snapshot().loops[0].setpoint_cm, 17.0);
    harness.run_steps(2);
    harness.get_by_label("OK").click();
    harness.run_steps(2);
    harness.remove_cursor();
    picture(&mut harness, "replay_1440x900");
    // It plays, and its rows are there to identify from.
    act(&mut harness, Action::Speed(1000.0));
    act(&mut harness, Action::ToggleRunning);
    wait(&mut harness, "the end", |w| w.snapshot().time_s > 169.7 && !w.snapshot().running);
    act(
        &mut harness,
        Action::Document(DocumentCommand::Stretch(Some(Stretch { from_s: 10.0, to_s: 169.0 }))),
    );
    act(&mut harness, Action::Identify);
    wait(&mut harness, "a fit", |w| !w.is_busy());
    // Taking the recording back brings the rig before it back.
    for _ in 0..10 {
        if harness.state().document().recording.is_some() {
            act(&mut harness, Action::Undo);
        }
    }
    wait(&mut harness, "the rig before", |w| w.snapshot().span_s.is_none());
    assert_eq!(harness.state().document().rig.network.spec.id, "simtank1");
    wait(&mut harness, "its own rows", |w| w.snapshot().network.spec.id == "simtank1");
    results.extend_harness(&mut harness);

    let several = folder.path().join("several.rrd");
    recorded(&several, 2);
    let mut harness = window([1280.0, 720.0]);
    act(&mut harness, Action::ToggleTheme);
    drop_on(&mut harness, several);
    wait(&mut harness, "a choice", |w| !w.is_busy());
    harness.run_steps(2);
    harness.remove_cursor();
    picture(&mut harness, "replay_choice");
    act(&mut harness, Action::PlayRun(1));
    wait(&mut harness, "the second run", |w| w.snapshot().span_s.is_some() && w.run().end_s() > 169.0);
    act(&mut harness, Action::Seek(40.0));
    wait(&mut harness, "another time", |w| w.snapshot().time_s == 40.0);
    harness.remove_cursor();
    picture(&mut harness, "replay_1280x720");
    act(&mut harness, Action::Document(DocumentCommand::Source(SourceChoice::Simulated)));
    wait(&mut harness, "the simulated rig", |w| w.snapshot().span_s.is_none());
    step(&mut harness, 5);
    results.extend_harness(&mut harness);
}
