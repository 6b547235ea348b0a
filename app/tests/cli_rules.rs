//! Rules and gains on the command line: what is refused, and the way on that is named.

use std::process::Command;

use serde_json::Value;

/// Status, standard output, standard error.
fn vasos(arguments: &[&str]) -> (i32, String, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_vasos"));
    let output = command.args(arguments).output().expect("the program starts");
    let text = |bytes| String::from_utf8(bytes).expect("text");
    (output.status.code().expect("a status"), text(output.stdout), text(output.stderr))
}

fn rule(model: &str, rest: &[&str]) -> (i32, String, String) {
    vasos(&[&["tune", "--model", model, "--json", "--rule"], rest].concat())
}

/// --ms and the other limits, --objective, --tau-c and --ultimate were taken and ignored.
#[test]
fn options_that_a_rule_does_not_use_are_refused() {
    for (rest, words) in [
        (&["amigo", "--ms", "1.2"][..], "--ms belongs to --optimal"),
        (&["amigo", "--mt", "1.2"][..], "--mt belongs to --optimal"),
        (&["amigo", "--ju", "3"][..], "--ju belongs to --optimal"),
        (&["all", "--objective", "jv"][..], "--objective belongs to --optimal"),
        (&["amigo", "--filter", "5"][..], "--filter belongs to --optimal"),
        (&["amigo", "--tau-c", "5"][..], "does not use --tau-c: direct_synthesis, lambda, imc, simc"),
        (
            &["amigo", "--ultimate", "Ku=5,Pu=3"][..],
            "does not use --ultimate: zn_closed_loop, relay_astrom, tyreus_luyben",
        ),
    ] {
        let (status, _, said) = rule("K=1,T=10,L=2", rest);
        assert!(status == 2 && said.contains(words), "{rest:?}: {status} {said}");
    }
    for rest in [&["simc", "--tau-c", "5"][..], &["all", "--tau-c", "5", "--ultimate", "Ku=5,Pu=3"][..]] {
        assert_eq!(rule("K=1,T=10,L=2", rest).0, 0, "{rest:?}");
    }
}

/// Kc = 7.1 stabilises e^(−0.2 s)/(s − 1), 7.3 does not, and it was said to have no ultimate gain.
#[test]
fn an_unstable_process_has_an_ultimate_gain() {
    let (status, told, said) = rule("num=1,den=1 -1,L=.2", &["zn_closed_loop", "--controller", "p"]);
    let told: Value = serde_json::from_str(&told).expect("JSON");
    let kc = told["results"][0]["Kc"].as_f64().expect("Kc");
    assert!(status == 0 && kc > 0.5 * 7.1 && kc < 0.5 * 7.3, "{status} {kc} {said}");
}

/// Rules whose PID wants a second-order model gave nothing where no controller was asked for.
#[test]
fn a_rule_without_a_pid_for_the_model_gives_its_pi_and_says_so() {
    for name in ["simc", "direct_synthesis", "lambda"] {
        let (status, told, said) = rule("K=4.9,T=152,L=2", &[name]);
        let told: Value = serde_json::from_str(&told).expect("JSON");
        assert!(status == 0 && told["results"][0]["controller"] == "pi", "{name}: {status} {told}");
        assert!(said.contains("this is its PI"), "{name}: {said}");
        let (status, _, said) = rule("K=4.9,T=152,L=2", &[name, "--controller", "pid"]);
        assert!(status == 1 && said.contains("or take its PI controller"), "{name}: {status} {said}");
    }
    // The model has a dead time: it is the rule that has no variant for it, with and without --tau-c.
    let (status, _, said) = rule("Kv=.03,L=2", &["direct_synthesis", "--controller", "pi"]);
    assert!(status == 1 && said.contains("has no variant for an integrating process"), "{status} {said}");
}

/// 1/(s + 1)³ is e^(−1.5 s)/(1.5 s + 1) by the half rule: what is named can be passed on.
#[test]
fn a_model_of_third_order_is_told_its_reduction() {
    for (model, reduced) in [
        ("num=1,den=1 3 3 1", "K=1,T=1.5,L=1.5"),
        ("num=1,den=1 2 1 0", "Kv=1,L=1.5"),
        ("K=1,T1=10,T2=4,L=1,Tz=4", "K=1,T=10,L=1"),
    ] {
        let (status, _, said) = rule(model, &["amigo", "--controller", "pi"]);
        assert!(status == 1 && said.contains(reduced), "{model}: {status} {said}");
        assert_eq!(rule(reduced, &["amigo", "--controller", "pi"]).0, 0, "{reduced}");
    }
}

/// An optimum with Kc = 0 could not be analysed. For Ki/s on 1/(s + 1): L(jω) = −j Ki/ω/(1 + jω), Ju = 1.
#[test]
fn integral_action_alone_can_be_analysed() {
    let analyze = |gains: &str| vasos(&["analyze", "--model", "K=1,T=1,L=0", "--gains", gains, "--json"]);
    let (status, told, said) = analyze("Kp=0,Ki=.1");
    assert_eq!(status, 0, "{said}");
    let told: Value = serde_json::from_str(&told).expect("JSON");
    let result = &told["result"];
    let near = |key: &str, value: f64| (result[key].as_f64().expect("a number") - value).abs() < 1e-9;
    assert!(near("Kc", 0.0) && near("Ki", 0.1) && near("Jv", 10.0) && near("Ju", 1.0), "{result}");
    assert!(result["Ti_s"].is_null() && result["stable"] == true, "{result}");
    // The parallel form is the ideal form's own loop.
    let (a, b) = (analyze("Kp=2,Ki=.5,Kd=1,Tf=.05"), analyze("Kc=2,Ti=4,Td=.5,N=10"));
    assert!(a.0 == 0 && a.1 == b.1, "{a:?} {b:?}");
    for wrong in ["Kp=0", "Kp=1,Ki=1,Kd=1", "Kp=1,Kd=1,Tf=-1", "Kp=1,Ki=nan", "Kp=1,Ti=5"] {
        assert_eq!(analyze(wrong).0, 2, "{wrong}");
    }
}

/// Twelve points that step over a resonance at 1 rad/s passed in silence.
#[test]
fn a_response_that_is_too_coarse_is_said_to_be() {
    let write = |name: &str, count: i32| {
        let path = std::env::temp_dir().join(format!("vasos_{}_{name}.csv", std::process::id()));
        let mut text = "omega_rad_s,re,im\n".to_owned();
        for k in 0..count {
            let w = 0.02 * 2000f64.powf(f64::from(k) / f64::from(count - 1));
            // 1/(1 − w² + 0.2 j w)/(1 + 0.5 j w), by the conjugate of its denominator.
            let (re, im) = (1.0 - w * w - 0.1 * w * w, 0.2 * w + 0.5 * w * (1.0 - w * w));
            let size = re * re + im * im;
            text.push_str(&format!("{w},{},{}\n", re / size, -im / size));
        }
        std::fs::write(&path, text).expect("a file");
        path
    };
    for (name, count, coarse) in [("coarse", 12, true), ("fine", 400, false)] {
        let path = write(name, count);
        let at = path.display().to_string();
        let (status, told, said) =
            vasos(&["tune", "--response", &at, "--optimal", "--controller", "pid", "--ms", "1.5"]);
        assert_eq!(status, 0, "{said}");
        assert_eq!(told.contains("measure more frequencies between"), coarse, "{name}: {told}");
        std::fs::remove_file(path).expect("removed");
    }
}
