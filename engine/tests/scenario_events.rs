//! Events of scenario files: what they do not know is refused, and what is written is read back the same.

use std::sync::Arc;

use vasos_engine::control::{Law, LoopOptions, Mode, PidGains, PidTuning};
use vasos_engine::excitation::{Excitation, Hysteresis, Relay, Signal, StepEnd, SteppedSine, UltimateGain};
use vasos_engine::plant::{FaultKind, Measurement, Network};
use vasos_engine::session::RigCommand;
use vasos_engine::sim::{Scenario, ScenarioError, ScenarioEvent, run_scenario};

fn refusal(event: &str) -> toml::de::Error {
    match toml::from_str::<ScenarioEvent>(event) {
        Ok(event) => panic!("{event:?}"),
        Err(error) => error,
    }
}

#[test]
fn a_second_command_of_an_event_was_dropped() {
    let event =
        "at_s = 1.0\nbump = { tag = \"TQ1\", delta_cm = 1.0 }\nvalve = { tag = \"FV01\", angle_deg = 9.0 }";
    let error = refusal(event);
    assert!(error.message().contains("two commands, bump and valve"), "{error}");
    assert_eq!(error.span().map(|s| &event[s]), Some("valve"));
}

#[test]
fn a_misspelt_command_was_refused_without_naming_the_commands() {
    for event in
        ["at_s = 1.0\nbumb = { tag = \"TQ1\" }", "foo = 1\nat_s = 1.0\nseed = { seed = 1 }", "at_s = 1.0"]
    {
        let error = refusal(event);
        for key in RigCommand::KEYS {
            assert!(error.message().contains(key), "{key}: {error}");
        }
    }
    let message = refusal("seed = { seed = 1 }").message().to_owned();
    assert!(message.contains("no at_s"), "{message}");
    let twice = serde_json::from_str::<ScenarioEvent>(r#"{"at_s": 1, "seed": {"seed": 1}, "at_s": 2}"#);
    assert!(twice.expect_err("two times").to_string().contains("duplicate field `at_s`"));
}

/// One event of each command, and of each kind of fault.
fn events() -> Vec<ScenarioEvent> {
    let tag = || "LIC-02".to_owned();
    let tuning =
        PidTuning { gains: PidGains { kc: 2.0, ti_s: f64::INFINITY, td_s: 1.0, n: 8.0 }, b: 0.5, c: 0.25 };
    let mut commands = vec![
        RigCommand::Setpoint { tag: tag(), level_cm: 12.0 },
        RigCommand::Mode { tag: tag(), mode: Mode::Cascade },
        RigCommand::Mv { tag: tag(), value: -1.5 },
        RigCommand::Tuning { tag: tag(), tuning },
        RigCommand::Law { tag: tag(), law: Law::PID_2GL },
        RigCommand::Options { tag: tag(), options: Box::new(LoopOptions::default()) },
        RigCommand::PvFilter { tag: tag(), time_constant_s: 3.0 },
        RigCommand::Valve { tag: tag(), angle_deg: 45.0 },
        RigCommand::Bump { tag: tag(), delta_cm: 1.0 },
        RigCommand::Configuration { id: tag() },
        RigCommand::SteadyAt { tag: tag(), level_cm: 9.0 },
        RigCommand::Measurement { measurement: Measurement::DEFAULT },
        RigCommand::Seed { seed: 7 },
        RigCommand::AbortExcitation { tag: tag() },
        RigCommand::Repair { tag: tag(), kind: None },
        RigCommand::Repair { tag: tag(), kind: Some(FaultKind::Leak) },
    ];
    let step = StepEnd::Stay;
    let relay = Relay { amplitude_down: Some(0.1), hysteresis: Hysteresis::Given(0.2), ..Relay::new(0.3) };
    let signals = [
        Signal::Step { size: 0.2, rest_share: 0.02, end: step },
        Signal::SetpointStep { size: 1.5, rest_share: 0.02, end: step },
        Signal::Relay(relay),
        Signal::Doublet { amplitude: 0.2, hold_s: 30.0 },
        Signal::Prbs { amplitude: 0.2, clock_s: 5.0, register: 7, periods: 2 },
        Signal::SteppedSine(SteppedSine::new(0.2, vec![0.1, 0.2])),
        Signal::UltimateGain(UltimateGain::new(2.0, 0.3)),
    ];
    commands.extend(signals.map(|signal| {
        let excitation = Box::new(Excitation::new(signal));
        RigCommand::Excite { tag: tag(), excitation }
    }));
    commands.extend(FaultKind::ALL.map(|kind| RigCommand::Fault { tag: tag(), fault: kind.usual() }));
    commands.into_iter().map(|command| ScenarioEvent { at_s: 2.5, command }).collect()
}

#[test]
fn every_command_is_read_back_as_it_was_written() {
    let mut keys = std::collections::BTreeSet::new();
    for event in events() {
        let text = toml::to_string(&event).expect("written");
        assert_eq!(toml::from_str::<ScenarioEvent>(&text).expect("read"), event, "{text}");
        if !matches!(event.command, RigCommand::Tuning { .. }) {
            let text = serde_json::to_string(&event).expect("written");
            assert_eq!(serde_json::from_str::<ScenarioEvent>(&text).expect("read"), event, "{text}");
        }
        let value = toml::Value::try_from(&event).expect("written");
        assert!(value.get(event.command.key()).is_some(), "{value}");
        keys.insert(event.command.key());
    }
    assert_eq!(keys, RigCommand::KEYS.into_iter().collect());
    let fault = ScenarioEvent {
        at_s: 1.0,
        command: RigCommand::Fault { tag: "LT02".to_owned(), fault: FaultKind::Drift.usual() },
    };
    let written = serde_json::to_string(&fault).expect("written");
    assert_eq!(written, r#"{"at_s":1.0,"fault":{"tag":"LT02","kind":"drift","rate_cm_s":0.01}}"#);
}

#[test]
fn unknown_fields_inside_a_command_were_ignored() {
    for event in events() {
        let whole = toml::Value::try_from(&event).expect("written");
        let key = event.command.key();
        let mut places = vec![vec![key]];
        match key {
            "tuning" => places.extend([vec![key, "tuning"], vec![key, "tuning", "gains"]]),
            "law" | "options" | "measurement" => places.push(vec![key, key]),
            "excite" => {
                let RigCommand::Excite { excitation, .. } = &event.command else { continue };
                let signal = excitation.signal.key();
                let inside = ["excitation", "signal", signal];
                places.extend(
                    (1..=3)
                        .filter(|n| *n != 2)
                        .map(|n| std::iter::once(key).chain(inside.into_iter().take(n)).collect::<Vec<_>>()),
                );
                places.push(vec![key, "excitation", "limits"]);
            }
            _ => {}
        }
        for place in places {
            let mut wrong = whole.clone();
            let table = place.iter().fold(&mut wrong, |at, key| &mut at[*key]);
            table.as_table_mut().expect("a table").insert("foo".to_owned(), 1.into());
            let error = refusal(&toml::to_string(&wrong).expect("written"));
            // The reader itself looks after the fields of a variant.
            let unknown = ["unknown field `foo`", "unexpected keys in table: foo"];
            assert!(unknown.iter().any(|words| error.message().contains(words)), "{place:?}: {error}");
        }
    }
}

#[test]
fn sizes_of_other_faults_were_ignored() {
    let message = |fields: &str| {
        let error = refusal(&format!("at_s = 1.0\nfault = {{ tag = \"LT02\", {fields} }}"));
        error.message().to_owned()
    };
    assert_eq!(message("kind = \"stuck\", share = 0.5"), "the fault stuck has no share");
    assert_eq!(
        message("kind = \"drift\", rate_cm_s = 0.1, share = 1.0, every_s = 1.0"),
        "the fault drift has no every_s and no share"
    );
    assert_eq!(message("kind = \"spikes\""), "the fault spikes needs height_cm and every_s");
    assert!(message("kind = \"drift\", rate_cm_s = 0.1, rate = 2").contains("unknown field `rate`"));
    assert!(message("kind = \"bent\"").contains("broken_wire"));
}

#[test]
fn a_bad_event_is_found_at_its_line() {
    let head = "schema = 1\nrig = \"stad\"\nduration_s = 9.0\n[[event]]\nat_s = 1.0\nseed = { seed = 1 }\n";
    for (event, at) in [
        ("bumb = { tag = \"TQ1\", delta_cm = 1.0 }", "bumb"),
        ("seed = { seed = 1, foo = 1 }", "foo"),
        ("seed = { seed = 1 }\nvalve = { tag = \"FV01\", angle_deg = 1.0 }", "valve"),
    ] {
        let text = format!("{head}[[event]]\nat_s = 2.0\n{event}\n");
        let error = toml::from_str::<Scenario>(&text).expect_err("must be refused");
        assert_eq!(error.span().map(|s| &text[s]), Some(at), "{error}");
    }
}

fn small_rig() -> Arc<Network> {
    let text = include_str!("../../assets/rigs/simtank1.toml");
    Arc::new(Network::new(toml::from_str(text).expect("a rig")).expect("checked"))
}

fn scenario(more: &str) -> Scenario {
    toml::from_str(&format!("schema = 1\nrig = \"simtank1\"\nduration_s = 5.0\n{more}")).expect("a scenario")
}

#[test]
fn an_event_before_the_start_ran_at_once_and_one_at_infinity_never() {
    for at_s in ["-1.0", "-inf", "inf", "nan"] {
        let event = format!("[[event]]\nat_s = {at_s}\nbump = {{ tag = \"TQ1\", delta_cm = 1.0 }}");
        let error = run_scenario(small_rig(), &scenario(&event)).expect_err(at_s).to_string();
        assert!(error.contains("bump: ") && error.contains("a time of 0 s or more"), "{error}");
    }
}

#[test]
fn a_run_that_keeps_every_zeroth_row_kept_all() {
    let error = run_scenario(small_rig(), &scenario("keep_every = 0")).expect_err("no rows");
    assert_eq!(error, ScenarioError::Keep);
}

#[test]
fn a_refused_event_was_told_by_its_time_alone() {
    let event = "[[event]]\nat_s = 1\nfault = { tag = \"TQ1\", kind = \"stuck\" }";
    let error = run_scenario(small_rig(), &scenario(event)).expect_err("no sensor").to_string();
    assert!(error.starts_with("at 1 s, fault: TQ1 cannot have the fault stuck"), "{error}");
}
