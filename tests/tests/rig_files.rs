//! Rig files that say what no rig can be are refused when they are read, with the field at fault.

use vasos_engine::plant::RigError;
use vasos_engine::session::CommandError;
use vasos_io::rig::{FileError, PRESETS, parse_rig};

/// The smallest preset with a part of its text replaced.
fn changed(from: &str, to: &str) -> Result<(), FileError> {
    let text = PRESETS.iter().find(|p| p.id == "simtank1").expect("a preset").text;
    assert!(text.contains(from), "the preset holds {from}");
    parse_rig("changed.toml", &text.replacen(from, to, 1)).map(|_| ())
}

fn refused(from: &str, to: &str) -> RigError {
    match changed(from, to) {
        Err(FileError::Rig { error, .. }) => error,
        other => panic!("'{to}' in place of '{from}' gave {other:?}"),
    }
}

fn field(error: &RigError) -> &str {
    match error {
        RigError::Value { field, .. } => field,
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_place_or_width_that_is_no_number_crashed_the_drawing() {
    let place = |text: &str| refused("at = [1.0, 1.0]", text);
    for at in ["[nan, 1.0]", "[1.0, inf]", "[1e4, 1.0]"] {
        assert_eq!(field(&place(&format!("at = {at}"))), "at");
    }
    for width in ["nan", "inf", "0.0", "-1.0", "1001.0"] {
        assert_eq!(field(&place(&format!("width = {width}"))), "width");
    }
}

#[test]
fn sizes_without_bound_overflowed_in_the_plant() {
    for value in ["1e-4", "3601.0", "nan", "inf"] {
        assert_eq!(
            field(&refused("sample_time_s = 0.5", &format!("sample_time_s = {value}"))),
            "sample_time_s"
        );
    }
    for (from, name) in [("area_cm2 = ", "area_cm2"), ("height_cm = ", "height_cm"), ("k90 = ", "k90")] {
        assert_eq!(field(&refused(from, &format!("{from}1e10 # "))), name);
    }
    assert_eq!(field(&refused("curve = [[0.0, 0.0]", "curve = [[0.0, 2e9]")), "curve");
}

#[test]
fn a_delay_of_nanoseconds_took_the_integrator_for_ever() {
    assert_eq!(field(&refused("max = 100.0", "max = 100.0\ndelay_s = 1e-8")), "delay_s");
}

#[test]
fn names_with_commas_quotes_and_blanks_broke_tables() {
    for (from, quote) in
        [("id = \"simtank1\"", "id"), ("signal = \"h1\"", "signal"), ("id = \"LIC-01\"", "id")]
    {
        for name in ["", "a b", "a,b", "a'b", "a;b", "a/b"] {
            let error = refused(from, &format!("{quote} = \"{name}\""));
            assert_eq!(error, RigError::Name { id: name.to_owned() });
        }
        assert!(matches!(refused(from, &format!("{quote} = \"a\\nb\"")), RigError::Name { .. }));
    }
    changed("signal = \"h1\"", "signal = \"Füllstand_1.ä-水\"").expect("letters of any script");
}

#[test]
fn loops_and_configurations_of_one_name_hid_each_other() {
    let text = PRESETS.iter().find(|p| p.id == "simtank2").expect("a preset").text;
    let same = text.replace("id = \"LIC-02\"", "id = \"LIC-01\"");
    let error = parse_rig("same.toml", &same).expect_err("two loops of one name");
    assert!(matches!(error, FileError::Rig { error: RigError::Duplicate { id }, .. } if id == "LIC-01"));
    let stad = PRESETS[0].text.replace("id = \"decoupled\"", "id = \"coupled\"");
    let error = parse_rig("same.toml", &stad).expect_err("two configurations of one name");
    assert!(matches!(error, FileError::Rig { error: RigError::Duplicate { id }, .. } if id == "coupled"));
}

#[test]
fn valves_that_differ_in_capitals_shared_a_column() {
    let text = PRESETS.iter().find(|p| p.id == "simtank2").expect("a preset").text;
    let error =
        parse_rig("same.toml", &text.replacen("id = \"V2\"", "id = \"v1\"", 1)).expect_err("V1 and v1");
    assert!(matches!(error, FileError::Rig { error: RigError::Duplicate { id }, .. } if id == "v1"));
}

fn cannot_start(name: &str, text: &str) -> (String, CommandError) {
    match parse_rig(name, text) {
        Err(FileError::Start { configuration, error, .. }) => (configuration, *error),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_rig_that_cannot_start_was_refused_only_after_the_old_one_was_gone() {
    let simtank = PRESETS.iter().find(|p| p.id == "simtank1").expect("a preset").text;
    let water = simtank.replacen("delta_cm", "water_cm3 = 1e9\nreservoir = \"TQ1\"\ndelta_cm", 1);
    let (configuration, error) = cannot_start("water.toml", &water);
    assert_eq!(configuration, "standard");
    assert!(matches!(error, CommandError::Rig(RigError::Water { .. })), "{error}");
    let bare = &water[..water.find("[[configuration]]").expect("configurations")];
    assert_eq!(cannot_start("bare.toml", bare).0, "simtank1", "a rig without configurations");
    // The second configuration of STAD: its loop cannot hold a level that high.
    let at = PRESETS[0].text.find("id = \"decoupled\"").expect("a configuration");
    let (first, second) = PRESETS[0].text.split_at(at);
    let setpoint = second.lines().find(|l| l.starts_with("setpoint_cm")).expect("a setpoint");
    let stad = format!("{first}{}", second.replacen(setpoint, "setpoint_cm = 26.9", 1));
    let (configuration, error) = cannot_start("stad.toml", &stad);
    assert_eq!(configuration, "decoupled");
    assert!(matches!(error, CommandError::Rig(RigError::Unreachable { .. })), "{error}");
}

/// A bad file is mended where its error points: the line, the field and what was expected.
#[test]
fn errors_name_the_line_and_what_was_expected() {
    let stad = PRESETS[0].text;
    // What is replaced, by what, and what the sentence must hold.
    let cases = [
        ("area_cm2 = 450.0", "area_cm2 = -450.0", "TQ4: area_cm2 = -450 is not possible; it must be"),
        ("exponent = 3.0", "exponent = nan", "FV01: exponent = NaN"),
        (
            "setpoint_cm = 15.0\nmode = \"automatic\"\nkc = 0.9",
            "setpoint_cm = 28.0\nmode = \"automatic\"\nkc = 0.9",
            "it must be 0…27 (rim)",
        ),
        ("sensor = \"LT03\"", "sensor = \"LT09\"", "refers to LT09"),
        ("to = \"TQ2\"", "to = \"TQ9\"", "FV02 refers to TQ9"),
        ("angles_deg = { FV01 = 90.0", "angles_deg = { FV01 = 95.0", "FV01: angle_deg = 95"),
        ("delays_s = { BA01 = 1.3 }", "delays_s = { BA02 = 1.3 }", "decoupled refers to BA02"),
        ("signal = \"q3\"", "signal = \"q1\"", "q1 is used twice"),
        ("id = \"LT03\"", "id = \"LT 3\"", "'LT 3'"),
        ("shunt_ohm = 250.0", "shunt_ohm = 0.0", "shunt_ohm = 0"),
        ("reservoir = \"TQ4\"", "reservoir = \"TQ5\"", "stad refers to TQ5"),
        ("curve = [\n  [1.1, 0], [1.2, 0]", "curve = [\n  [1.1, 0], [1.1, 0]", "curve of pump BA01"),
        (
            "spills_to = \"TQ4\"\nat = [1.0, 2.0]",
            "spills_to = \"TQ3\"\nat = [1.0, 2.0]",
            "TQ3 leads from TQ3",
        ),
        ("schema = 1", "schema = 9", "schema 9"),
        (
            "height_cm = 27.0\ninitial_cm = 26.0",
            "height_cm = \"27\"\ninitial_cm = 26.0",
            "invalid type: string",
        ),
        ("k90 = 60.0", "k9 = 60.0", "unknown field `k9`"),
    ];
    for (from, to, says) in cases {
        let at = stad.find(from).unwrap_or_else(|| panic!("the preset holds {from}"));
        let line = stad[..at].matches('\n').count() + 1;
        let text = stad.replacen(from, to, 1);
        let error = parse_rig("stad.toml", &text).expect_err(to).to_string();
        println!("{error}");
        assert!(error.starts_with(&format!("stad.toml, line {line}: ")), "{to}: line {line}: {error}");
        assert!(error.contains(says), "{to}: {error}");
    }
    // Two loops on one pump: the second one's line.
    let second = "\n[[configuration.loop]]\nid = \"LIC-09\"\nsensor = \"LT02\"\npump = \"BA01\"\nsetpoint_cm = 5.0\nmode = \"manual\"\nkc = 1.0\nti_s = 9.0\n";
    let error = parse_rig("stad.toml", &format!("{stad}{second}")).expect_err("one pump").to_string();
    let line = stad.lines().count() + 5;
    assert!(error.starts_with(&format!("stad.toml, line {line}: the loops LIC-03 and LIC-09")), "{error}");
    // A level no input holds: the configuration's line.
    let from = "setpoint_cm = 15.0\nmode = \"automatic\"\nkc = 0.9";
    let high = stad.replacen(from, &from.replace("15.0", "26.9"), 1);
    let at = stad.find("id = \"decoupled\"").expect("a configuration");
    let line = stad[..at].matches('\n').count() + 1;
    let error = parse_rig("stad.toml", &high).expect_err("too high").to_string();
    assert!(error.starts_with(&format!("stad.toml, line {line}: the rig cannot start")), "{error}");
    assert!(error.contains("between"), "{error}");
}

/// The program reads all presets when it starts.
#[test]
fn presets_are_read_before_anybody_notices() {
    let start = std::time::Instant::now();
    for preset in PRESETS {
        parse_rig(preset.id, preset.text).expect("a preset");
    }
    println!("{:?}", start.elapsed());
    assert!(start.elapsed().as_millis() < 200, "{:?}", start.elapsed());
}

#[test]
fn the_third_number_of_a_pair_was_cut_off() {
    let stad = PRESETS[0].text;
    for (from, to) in [
        ("[1.1, 0]", "[1.1, 0, 1.0]"),
        ("[1.1, 0]", "[1.1]"),
        ("at = [1.0, 2.0]", "at = [1.0, 2.0, 3.0]"),
        ("range_cm = [", "range_cm = [1.0, "),
    ] {
        let at = stad.find(from).unwrap_or_else(|| panic!("the preset holds {from}"));
        let line = stad[..at].matches('\n').count() + 1;
        let error = parse_rig("stad.toml", &stad.replacen(from, to, 1)).expect_err(to).to_string();
        assert!(error.starts_with(&format!("stad.toml, line {line}: expected two numbers")), "{error}");
    }
}

#[test]
fn a_feedforward_from_the_loops_own_pump_was_called_unknown() {
    let with = |from: &str| {
        let options =
            format!("[configuration.loop.options]\nfeedforward = {{ from = \"{from}\", gain = 1.0 }}\n");
        let text = format!("{}\n{options}", PRESETS[0].text.trim_end());
        parse_rig("stad.toml", &text)
    };
    // The last loop of the file is LIC-03 of the sensor LT03, with the pump BA01.
    for from in ["BA01", "LT03", "FV01", "TQ1", "LIC-03"] {
        let error = with(from).expect_err(from);
        let said = error.to_string();
        let FileError::Rig { error: RigError::Feedforward { item, from: named }, .. } = error else {
            panic!("{said}");
        };
        assert_eq!((item.as_str(), named.as_str()), ("LIC-03", from));
        assert!(said.contains("takes another sensor or another pump"), "{said}");
    }
    let missing = with("LT99").expect_err("no such tag");
    assert!(matches!(missing, FileError::Rig { error: RigError::Unknown { .. }, .. }), "{missing}");
    with("LT02").expect("another sensor");
}
