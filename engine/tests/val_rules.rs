//! Tuning rules against the golden file, published values and independent routes.

use serde_json::Value;
use vasos_engine::analyze::{analyze, is_closed_loop_stable};
use vasos_engine::control::PidGains;
use vasos_engine::explain::Explain;
use vasos_engine::model::{Fopdt, Ipdt, ProcessModel, Sopdt};
use vasos_engine::tune::{
    ControllerKind, Rule, RuleError, RuleOptions, RuleWarning, Tuning, Ultimate, find_rule, registry,
    tune_all, ultimate,
};

const GOLDEN: &str = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../assets/golden/rules.json"));

/// Ids of spec tune.md section 1, which are an interface.
const IDS: [&str; 18] = [
    "zn_reaction",
    "zn_closed_loop",
    "relay_astrom",
    "cohen_coon",
    "chr_setpoint_0",
    "chr_setpoint_20",
    "chr_load_0",
    "chr_load_20",
    "itae_load",
    "itae_setpoint",
    "amigo",
    "direct_synthesis",
    "lambda",
    "imc",
    "simc",
    "isimc_pi",
    "isimc_pid",
    "tyreus_luyben",
];

fn fopdt(k: f64, t: f64, l: f64) -> ProcessModel {
    ProcessModel::Fopdt(Fopdt::new(k, t, l).expect("a model"))
}

fn ipdt(kv: f64, l: f64) -> ProcessModel {
    ProcessModel::Ipdt(Ipdt::new(kv, l).expect("a model"))
}

fn rule(id: &str) -> &'static Rule {
    find_rule(id, ControllerKind::Pi).expect(id)
}

fn tuned(id: &str, kind: ControllerKind, model: &ProcessModel) -> Tuning {
    rule(id).tune(model, kind, &RuleOptions::default()).unwrap_or_else(|e| panic!("{id} {kind}: {e}"))
}

fn with_tau_c(tau_c_s: f64) -> RuleOptions {
    RuleOptions { tau_c_s: Some(tau_c_s), ..RuleOptions::default() }
}

fn assert_gains(found: &PidGains, expected: [f64; 3], tolerance: f64, what: &str) {
    for (name, value, reference) in
        [("Kc", found.kc, expected[0]), ("Ti", found.ti_s, expected[1]), ("Td", found.td_s, expected[2])]
    {
        let same = value == reference || (value - reference).abs() <= tolerance * reference.abs();
        assert!(same, "{what} {name}: {value}, expected {reference}");
    }
}

/// rules.json is full precision, except the CHR entries setpoint_0, load_0, load_20 (six decimals) and tyreus_luyben
/// (six digits), which are compared to half a unit of their last digit.
#[test]
fn val_rules_agree_with_the_golden_file() {
    let golden: Value = serde_json::from_str(GOLDEN).expect("json");
    let mut compared = 0;
    for (name, entry) in golden["models"].as_object().expect("models") {
        let number = |key: &str| entry[key].as_f64().expect(key);
        let (k, t, l) = (number("K"), number("T_s"), number("L_s"));
        let model = fopdt(k, t, l);
        let limit = ultimate(&model).expect("a limit");
        assert!((limit.ku / number("Ku") - 1.0).abs() < 1e-9, "{name}: {limit:?}");
        assert!((limit.pu_s / number("Pu_s") - 1.0).abs() < 1e-9, "{name}: {limit:?}");
        for (key, kinds) in entry["rules"].as_object().expect("rules") {
            let (id, options) = match key.split_once(' ') {
                Some((id, "(tau_c = L)")) => (id, with_tau_c(l)),
                Some(_) => panic!("unknown key {key}"),
                None => (key.as_str(), RuleOptions::default()),
            };
            let rounded = ["chr_setpoint_0", "chr_load_0", "chr_load_20", "tyreus_luyben"].contains(&id);
            for (kind, values) in kinds.as_object().expect("kinds") {
                let kind = ControllerKind::from_id(kind).expect("a kind");
                let values: Vec<Option<f64>> =
                    values.as_array().expect("gains").iter().map(Value::as_f64).collect();
                let get = |i: usize, missing: f64| values.get(i).copied().flatten().unwrap_or(missing);
                let expected = [get(0, f64::NAN), get(1, f64::INFINITY), get(2, 0.0)];
                let tuning = rule(id).tune(&model, kind, &options).expect(key);
                let tolerance = if rounded { 3e-6 } else { 1e-12 };
                assert_gains(&tuning.gains, expected, tolerance, &format!("{name} {key} {kind}"));
                assert_eq!(ControllerKind::of(&tuning.gains), kind);
                compared += 1;
            }
        }
    }
    assert_eq!(compared, 83, "golden entries");
}

/// Seed 000, as printed there: TQ2 by AMIGO 7, 15 s, 1 s; TQ3 by direct synthesis with τc = τ/10 0.9, 73 s.
#[test]
fn val_seed_000_published_tunings() {
    let amigo = tuned("amigo", ControllerKind::Pid, &fopdt(4.9, 152.0, 2.0)).gains;
    assert_gains(&amigo, [7.02, 14.2, 0.996], 3e-3, "AMIGO");
    let direct = tuned("direct_synthesis", ControllerKind::Pi, &fopdt(8.7, 73.0, 2.0));
    assert_gains(&direct.gains, [0.902, 73.0, 0.0], 3e-4, "direct synthesis");
    assert_eq!(direct.tau_c_s, Some(7.3));
}

/// Skogestad, J. Process Control 13, 2003, example E1: 1/((s + 1)(0.2 s + 1)) is by the half rule θ = 0.1, τ = 1.1, and
/// SIMC with τc = θ gives Kc = 5.5, Ti = 0.8.
#[test]
fn val_skogestad_2003_half_rule() {
    let model = ProcessModel::Sopdt(Sopdt::new(1.0, 1.0, 0.2, 0.0, 0.0).expect("a model"));
    let tuning = tuned("simc", ControllerKind::Pi, &model);
    assert_gains(&tuning.gains, [5.5, 0.8, 0.0], 1e-12, "SIMC PI");
    assert_eq!(tuning.tau_c_s, Some(0.1));
    assert_eq!(tuning.warnings, [RuleWarning::HalfRule { time_constant_s: 1.1, dead_time_s: 0.1 }]);
    assert!(tuning.valid());
}

/// Spec tune.md section 1, "Formulas of the rest", on Kv = 0.05, θ = 4, by hand.
#[test]
fn val_integrating_variants() {
    let model = ipdt(0.05, 4.0);
    let unit = 1.0 / (0.05 * 4.0);
    for (id, kind, expected) in [
        ("zn_reaction", ControllerKind::P, [unit, f64::INFINITY, 0.0]),
        ("zn_reaction", ControllerKind::Pi, [0.9 * unit, 13.32, 0.0]),
        ("zn_reaction", ControllerKind::Pid, [1.2 * unit, 8.0, 2.0]),
        ("amigo", ControllerKind::Pi, [0.35 * unit, 53.6, 0.0]),
        ("amigo", ControllerKind::Pid, [0.45 * unit, 32.0, 2.0]),
        ("simc", ControllerKind::Pi, [0.5 * unit, 32.0, 0.0]),
        ("isimc_pi", ControllerKind::Pi, [0.5 * unit, 32.0, 0.0]),
        ("lambda", ControllerKind::Pi, [0.75 * unit, 12.0, 0.0]),
        // Ku = π/(2 Kv θ), Pu = 4 θ.
        ("tyreus_luyben", ControllerKind::Pi, [std::f64::consts::PI / 2.0 * unit / 3.2, 35.2, 0.0]),
        ("zn_closed_loop", ControllerKind::Pid, [0.3 * std::f64::consts::PI * unit, 8.0, 2.0]),
    ] {
        assert_gains(&tuned(id, kind, &model).gains, expected, 1e-10, id);
    }
    let series = rule("isimc_pid");
    let pid = find_rule("isimc", ControllerKind::Pid).expect("iSIMC");
    assert_eq!(pid.id, series.id);
    // Series 0.5 unit, 32 s, 4/3 s: f = 1 + (4/3)/32.
    let f = 1.0 + 4.0 / 96.0;
    assert_gains(
        &tuned("isimc_pid", ControllerKind::Pid, &model).gains,
        [0.5 * unit * f, 32.0 * f, 4.0 / 3.0 / f],
        1e-12,
        "iSIMC PID",
    );
}

/// Formulas of spec tune.md that rules.json does not hold, on K = 2, τ = 10, θ = 3, by hand.
#[test]
fn val_formulas_beyond_the_golden_file() {
    let model = fopdt(2.0, 10.0, 3.0);
    for (id, kind, expected, tau_c) in [
        ("lambda", ControllerKind::Pi, [10.0 / (2.0 * (10.0 / 3.0 + 3.0)), 10.0, 0.0], 10.0 / 3.0),
        ("imc", ControllerKind::Pi, [23.0 / (4.0 * 5.1), 11.5, 0.0], 5.1),
        ("imc", ControllerKind::Pid, [23.0 / (2.0 * 7.8), 11.5, 30.0 / 23.0], 2.4),
        ("isimc_pi", ControllerKind::Pi, [11.0 / 12.0, 11.0, 0.0], 3.0),
        ("isimc_pid", ControllerKind::Pid, [10.0 / 12.0 * 1.1, 11.0, 1.0 / 1.1], 3.0),
    ] {
        let tuning = tuned(id, kind, &model);
        assert_gains(&tuning.gains, expected, 1e-12, id);
        assert!((tuning.tau_c_s.expect("a time constant") - tau_c).abs() < 1e-12);
    }
    let second = ProcessModel::Sopdt(Sopdt::new(2.0, 10.0, 4.0, 0.0, 3.0).expect("a model"));
    assert_gains(
        &tuned("direct_synthesis", ControllerKind::Pid, &second).gains,
        [14.0 / 8.0, 14.0, 40.0 / 14.0],
        1e-12,
        "direct synthesis",
    );
    // Series 10/12, min(10, 24), 4.
    assert_gains(
        &tuned("simc", ControllerKind::Pid, &second).gains,
        [10.0 / 12.0 * 1.4, 14.0, 4.0 / 1.4],
        1e-12,
        "SIMC PID",
    );
    let rational = ProcessModel::rational(&[2.0], &[40.0, 14.0, 1.0], 3.0).expect("a model");
    let same = tuned("simc", ControllerKind::Pid, &rational).gains;
    assert_gains(&same, [10.0 / 12.0 * 1.4, 14.0, 4.0 / 1.4], 1e-12, "SIMC PID of num/den");
}

#[test]
fn the_registry_holds_every_rule_once() {
    let mut ids: Vec<&str> = registry().iter().map(|r| r.id).collect();
    ids.sort_unstable();
    let mut expected = IDS.to_vec();
    expected.sort_unstable();
    assert_eq!(ids, expected);
    for rule in registry() {
        assert!(!rule.source.is_empty() && !rule.controllers.is_empty());
        assert_eq!(rule.title_key, format!("rules.{}", rule.id));
    }
}

/// The mirror image of a process wants the mirror image of its controller.
#[test]
fn a_negative_gain_gives_a_negative_kc() {
    for (positive, negative) in
        [(fopdt(2.0, 10.0, 3.0), fopdt(-2.0, 10.0, 3.0)), (ipdt(0.1, 2.0), ipdt(-0.1, 2.0))]
    {
        let options = RuleOptions::default();
        for ((a, kind, up), (_, _, down)) in
            tune_all(&positive, &options).into_iter().zip(tune_all(&negative, &options))
        {
            match (up, down) {
                (Ok(up), Ok(down)) => {
                    assert_gains(&down.gains, [-up.gains.kc, up.gains.ti_s, up.gains.td_s], 1e-12, a.id);
                }
                (up, down) => assert_eq!(up.map(|t| t.gains), down.map(|t| t.gains), "{} {kind}", a.id),
            }
        }
    }
}

/// Every rule inside its range stabilises its process; the wrong sign never does.
#[test]
fn rules_stabilise_the_processes_they_are_made_for() {
    let mut checked = 0;
    for ratio in [0.1, 0.2, 0.3, 0.6, 1.0] {
        for model in
            [fopdt(3.0, 20.0, 20.0 * ratio), fopdt(-0.5, 20.0, 20.0 * ratio), ipdt(0.02, 20.0 * ratio)]
        {
            for (rule, kind, tuning) in tune_all(&model, &RuleOptions::default()) {
                let Ok(tuning) = tuning else { continue };
                if tuning.valid() {
                    assert!(is_closed_loop_stable(&model, &tuning.gains), "{} {kind} at {ratio}", rule.id);
                    checked += 1;
                }
                let wrong = PidGains { kc: -tuning.gains.kc, ..tuning.gains };
                assert!(tuning.gains.ti_s.is_infinite() || !is_closed_loop_stable(&model, &wrong));
            }
        }
    }
    assert!(checked > 250, "{checked}");
}

/// τc = θ/3 of a cancelling PI is where Ms reaches 2 (2.0 to its first decimals), whatever τ: the flag's threshold.
#[test]
fn val_direct_synthesis_flag_is_where_ms_passes_2() {
    let at = |ratio: f64| {
        let model = fopdt(1.0, 10.0, 10.0 * ratio);
        let tuning = tuned("direct_synthesis", ControllerKind::Pi, &model);
        (analyze(&model, &tuning.gains).ms.expect("Ms"), tuning)
    };
    let (below, ok) = at(0.29);
    let (above, flagged) = at(0.31);
    assert!(ok.valid() && !flagged.valid());
    assert!(below < 2.15 && above > 2.0 && (above - below).abs() < 0.1, "{below} {above}");
}

#[test]
fn what_a_rule_cannot_do_it_says() {
    let options = RuleOptions::default();
    let lag = fopdt(2.0, 10.0, 0.0);
    let error = |id: &str, kind, model: &ProcessModel, options: &RuleOptions| {
        rule(id).tune(model, kind, options).expect_err(id)
    };
    for id in ["zn_reaction", "cohen_coon", "chr_load_20", "itae_load", "amigo"] {
        let id_of = rule(id).id;
        assert_eq!(error(id, ControllerKind::Pi, &lag, &options), RuleError::NeedsDeadTime { rule: id_of });
    }
    assert_eq!(
        error("simc", ControllerKind::Pi, &lag, &options),
        RuleError::NeedsDeadTimeOrTauC { rule: "simc" }
    );
    assert!(rule("simc").tune(&lag, ControllerKind::Pi, &with_tau_c(2.0)).is_ok());
    assert!(rule("imc").tune(&lag, ControllerKind::Pi, &options).is_ok());
    assert_eq!(error("zn_closed_loop", ControllerKind::Pi, &lag, &options), RuleError::NoUltimate);
    let given = RuleOptions { ultimate: Some(Ultimate { ku: 10.0, pu_s: 6.0 }), ..options };
    let pi = rule("zn_closed_loop").tune(&lag, ControllerKind::Pi, &given).expect("gains");
    assert_gains(&pi.gains, [4.5, 5.0, 0.0], 1e-12, "given limit");
    let late = fopdt(2.0, 10.0, 3.0);
    assert_eq!(
        error("simc", ControllerKind::Pid, &late, &options),
        RuleError::NeedsSecondOrder { rule: "simc", controller: ControllerKind::Pid }
    );
    assert_eq!(
        error("amigo", ControllerKind::P, &late, &options),
        RuleError::NoSuchController { rule: "amigo", controller: ControllerKind::P }
    );
    assert_eq!(error("simc", ControllerKind::Pi, &late, &with_tau_c(-1.0)), RuleError::TauC { value: -1.0 });
    assert_eq!(
        error("imc", ControllerKind::Pi, &ipdt(0.1, 1.0), &options),
        RuleError::NotForIntegrating { rule: "imc" }
    );
    let swinging = ProcessModel::rational(&[1.0], &[1.0, 0.4, 1.0], 1.0).expect("a model");
    assert_eq!(error("zn_reaction", ControllerKind::Pi, &swinging, &options), RuleError::ComplexPoles);
    let runaway = ProcessModel::rational(&[1.0], &[1.0, -1.0], 0.1).expect("a model");
    assert_eq!(error("amigo", ControllerKind::Pi, &runaway, &options), RuleError::UnstableProcess);
    let dead = fopdt(1.0, 1.0, 7.0);
    assert_eq!(
        error("itae_setpoint", ControllerKind::Pi, &dead, &options),
        RuleError::OutsideFormula { rule: "itae_setpoint", ratio: 7.0 }
    );
}

#[test]
fn leaving_the_range_is_flagged() {
    let options = RuleOptions::default();
    let warnings = |id: &str, model: &ProcessModel| tuned(id, ControllerKind::Pi, model);
    let lively = fopdt(4.9, 152.0, 2.0);
    for id in ["zn_reaction", "cohen_coon", "itae_load", "itae_setpoint"] {
        assert!(!warnings(id, &lively).valid(), "{id} at θ/τ = 0.013");
    }
    for id in ["chr_load_0", "amigo", "simc", "lambda", "imc", "direct_synthesis", "tyreus_luyben"] {
        assert!(warnings(id, &lively).valid(), "{id} at θ/τ = 0.013");
    }
    let medium = fopdt(1.0, 10.0, 5.0);
    let cohen = warnings("cohen_coon", &medium);
    assert!(cohen.valid() && cohen.warnings == [RuleWarning::CohenCoonSources { ratio: 0.5 }]);
    assert!(!warnings("zn_reaction", &medium).valid() && !warnings("chr_setpoint_20", &medium).valid());
    assert!(!warnings("direct_synthesis", &medium).valid());
    assert!(!warnings("zn_reaction", &ipdt(0.1, 1.0)).valid());
    let fast = rule("imc").tune(&medium, ControllerKind::Pi, &with_tau_c(5.0)).expect("gains");
    assert_eq!(fast.warnings, [RuleWarning::LambdaTooShort { tau_c_s: 5.0, least_s: 8.5 }]);
    assert!(rule("simc").tune(&medium, ControllerKind::Pi, &options).expect("gains").valid());
}

#[test]
fn every_sentence_has_a_key_of_its_own_and_its_numbers() {
    let errors = RuleError::samples();
    let warnings = RuleWarning::samples();
    let said: Vec<&dyn Explain> =
        errors.iter().map(|e| e as &dyn Explain).chain(warnings.iter().map(|w| w as &dyn Explain)).collect();
    let mut keys: Vec<&str> = said.iter().map(|s| s.key()).collect();
    for sentence in &said {
        for (name, value) in sentence.args() {
            assert!(sentence.to_string().contains(&value), "{name} = {value} is missing in: {sentence}");
        }
    }
    keys.sort_unstable();
    keys.dedup();
    assert_eq!(keys.len(), said.len());
}
