//! `vasos retune` as scripts call it: generated loops of known processes, the answers and their reasons.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;
use vasos_engine::analyze::analyze;
use vasos_engine::control::PidGains;
use vasos_engine::model::{Fopdt, ProcessModel};

fn vasos(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_vasos"));
    // No display: nothing here may need one.
    command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY").args(arguments);
    command.output().expect("the program starts")
}

fn json(arguments: &[&str]) -> (Value, i32) {
    let output = vasos(arguments);
    let text = String::from_utf8(output.stdout).expect("text");
    let value = serde_json::from_str(&text)
        .unwrap_or_else(|error| panic!("{error}: {text}{}", String::from_utf8_lossy(&output.stderr)));
    (value, output.status.code().expect("a status"))
}

/// A folder of its own for a test, empty.
fn scratch(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("retune_{name}"));
    drop(std::fs::remove_dir_all(&folder));
    std::fs::create_dir_all(&folder).expect("a folder");
    folder
}

/// The process of every generated log: K = 2, T = 60 s, L = 8 s.
const TRUTH: (f64, f64, f64) = (2.0, 60.0, 8.0);

/// A loop of a PI controller, sampled every second; `setpoint` by row.
struct Loop {
    kc: f64,
    ti_s: f64,
    setpoint: fn(usize) -> f64,
    head: &'static str,
}

impl Loop {
    fn moved(kc: f64, ti_s: f64) -> Self {
        let setpoint = |k: usize| [50.0, 55.0, 52.0, 58.0][(k / 300).min(3)];
        Self { kc, ti_s, setpoint, head: "time_s,PV,SP,MV" }
    }

    fn csv(&self) -> String {
        let (gain, time_s, dead_s) = TRUTH;
        let decay = (-1.0f64 / time_s).exp();
        let mut sent = vec![40.0; dead_s as usize + 1];
        let (mut level, mut integral) = (50.0, 40.0);
        // A linear congruential generator: twelve of its draws add up to a normal one.
        let mut state = 20_261_123u64;
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        let mut text = format!("{}\n", self.head);
        for k in 0..1200 {
            let noise: f64 = (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
            let (sp, pv) = ((self.setpoint)(k), level + 0.05 * noise);
            integral += self.kc / self.ti_s * (sp - pv);
            let mv = self.kc * (sp - pv) + integral;
            writeln!(text, "{k},{pv:.4},{sp},{mv:.4}").expect("text");
            sent.push(mv);
            let arrives = 50.0 + gain * (sent[sent.len() - 1 - dead_s as usize] - 40.0);
            level = arrives + (level - arrives) * decay;
        }
        text
    }

    fn write(&self, path: &Path) -> String {
        std::fs::write(path, self.csv()).expect("a log");
        path.display().to_string()
    }
}

fn keys(value: &Value) -> Vec<&str> {
    let mut keys: Vec<&str> = value.as_object().expect("an object").keys().map(String::as_str).collect();
    keys.sort_unstable();
    keys
}

#[test]
fn the_recommended_gains_keep_the_limits_on_the_true_process() {
    let log = Loop::moved(1.0, 90.0).write(&scratch("limits").join("loop.csv"));
    let (answer, status) = json(&["retune", &log, "--json"]);
    assert_eq!((status, answer["recommended"].as_str()), (0, Some("optimal")), "{answer:#}");
    assert_eq!(
        keys(&answer),
        [
            "candidates",
            "columns",
            "controller_in_log",
            "draws",
            "findings",
            "gain_measure",
            "gain_percent",
            "limits",
            "log",
            "model",
            "oscillation",
            "present",
            "reason",
            "recommended",
            "recommended_controller",
            "repairs",
            "seed",
            "warnings",
        ]
    );
    // Read off the log: the controller that made it.
    let present = &answer["present"];
    assert!((present["Kc"].as_f64().expect("Kc") - 1.0).abs() < 0.02, "{present}");
    assert!((present["Ti_s"].as_f64().expect("Ti") - 90.0).abs() < 3.0, "{present}");
    assert!(answer["gain_percent"].as_f64().expect("a gain") > 50.0, "{answer:#}");
    let best = &answer["candidates"][0];
    let (gain, time_s, dead_s) = TRUTH;
    let truth = ProcessModel::Fopdt(Fopdt::new(gain, time_s, dead_s).expect("a model"));
    let gains = PidGains::pi(best["Kc"].as_f64().expect("Kc"), best["Ti_s"].as_f64().expect("Ti"));
    let analysis = analyze(&truth, &gains);
    // 1.4 was asked for the fitted model; what the fit misses of the truth moves it a little.
    assert!((analysis.ms.expect("stable") - 1.4).abs() < 0.02, "{analysis:?}");
    assert_eq!(best["unstable_share"].as_f64(), Some(0.0));
    let quantiles = best["ms_quantiles"].as_array().expect("quantiles");
    assert!(quantiles.windows(2).all(|q| q[0].as_f64() <= q[1].as_f64()), "{quantiles:?}");
    let rules: Vec<&str> =
        answer["candidates"].as_array().expect("a list").iter().filter_map(|c| c["rule"].as_str()).collect();
    assert_eq!(rules, ["optimal", "simc", "amigo", "present"]);
}

#[test]
fn limits_and_the_present_tuning_are_taken_from_the_command_line() {
    let log = Loop::moved(1.0, 90.0).write(&scratch("asked").join("loop.csv"));
    let arguments = ["retune", &log, "--ms", "1.25", "--ju", "1.0", "--present", "Kc=1.5,Ti=40", "--json"];
    let (answer, status) = json(&arguments);
    assert_eq!(status, 0, "{answer:#}");
    assert_eq!(answer["present"]["Kc"].as_f64(), Some(1.5));
    let best = &answer["candidates"][0];
    assert!(
        best["Ms"].as_f64().expect("Ms") <= 1.25 + 1e-6 && best["Ju"].as_f64().expect("Ju") <= 1.0 + 1e-6
    );
    // A present tuning that is stable but past the limits is left for robustness, and the price is said.
    assert!(answer["reason"].as_str().expect("words").contains("robustness"), "{answer:#}");
    let (answer, _) = json(&["retune", &log, "--present", "Kc=9,Ti=10", "--json"]);
    assert!(answer["reason"].as_str().expect("words").contains("not stable"), "{}", answer["reason"]);
    assert!(answer["gain_percent"].is_null() && answer["present"]["stable"] == Value::Bool(false));
}

#[test]
fn a_loop_that_is_tuned_well_is_left_alone() {
    let log = Loop::moved(1.087, 28.8).write(&scratch("well").join("loop.csv"));
    let (answer, status) = json(&["retune", &log, "--json"]);
    assert_eq!((status, answer["recommended"].as_str()), (0, Some("present")), "{answer:#}");
    assert!(answer["reason"].as_str().expect("words").starts_with("leave the tuning"));
}

#[test]
fn a_pid_is_shown_beside_the_best_pi() {
    let log = Loop::moved(1.0, 90.0).write(&scratch("pid").join("loop.csv"));
    let (answer, _) = json(&["retune", &log, "--controller", "pid", "--json"]);
    let controllers: Vec<&str> = answer["candidates"]
        .as_array()
        .expect("a list")
        .iter()
        .filter(|c| c["rule"] == "optimal")
        .filter_map(|c| c["controller"].as_str())
        .collect();
    assert_eq!(controllers, ["pid", "pi"]);
    assert_eq!(answer["recommended_controller"].as_str(), Some("pid"));
    assert!(answer["candidates"][0]["Jv"].as_f64() < answer["candidates"][1]["Jv"].as_f64());
}

#[test]
fn pure_feedback_is_a_no_with_its_reason_and_its_report() {
    let folder = scratch("feedback");
    let still = Loop { setpoint: |_| 50.0, ..Loop::moved(1.0, 90.0) };
    let log = still.write(&folder.join("loop.csv"));
    let report = folder.join("report.html");
    let output = vasos(&["retune", &log, "--json", "-o", &report.display().to_string()]);
    assert_eq!(output.status.code(), Some(1));
    let answer: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert!(answer["recommended"].is_null() && answer["model"].is_null());
    let reason = answer["reason"].as_str().expect("words");
    assert!(reason.contains("nothing but feedback moves MV"), "{reason}");
    assert!(String::from_utf8_lossy(&output.stderr).contains(reason));
    assert!(std::fs::read_to_string(report).expect("a report").contains("nothing but feedback moves MV"));
}

#[test]
fn same_log_same_bytes() {
    let folder = scratch("same");
    let log = Loop::moved(1.0, 90.0).write(&folder.join("loop.csv"));
    let once = |name: &str| {
        let report = folder.join(name);
        let output = vasos(&["retune", &log, "--json", "-o", &report.display().to_string()]);
        (output.stdout, std::fs::read(report).expect("a report"))
    };
    assert_eq!(once("a.html"), once("b.html"));
}

#[test]
fn a_report_is_written_in_portuguese_where_that_is_asked_for() {
    let folder = scratch("portuguese");
    let log = Loop::moved(1.0, 90.0).write(&folder.join("loop.csv"));
    let report = folder.join("report.html");
    let of = |language: &str| {
        let output =
            vasos(&["retune", &log, "--json", "--language", language, "-o", &report.display().to_string()]);
        (output.stdout, output.status.code(), std::fs::read_to_string(&report).unwrap_or_default())
    };
    let (english, portuguese) = (of("en"), of("pt-BR"));
    assert_eq!((english.1, portuguese.1), (Some(0), Some(0)));
    assert_eq!(english.0, portuguese.0, "JSON is an interface, not a report");
    assert!(portuguese.2.contains("lang=\"pt-BR\"") && english.2.contains("lang=\"en\""));
    for (words, translated) in [
        ("What to type into your controller", "O que digitar no seu controlador"),
        ("Tunings compared", "Sintonias comparadas"),
        ("Nyquist curves", "Curvas de Nyquist"),
        ("use the optimal", "use o PI ótimo"),
    ] {
        let has = |html: &str, words: &str| html.to_lowercase().contains(&words.to_lowercase());
        assert!(has(&english.2, words) && !has(&portuguese.2, words), "{words}");
        assert!(has(&portuguese.2, translated) || words.starts_with("use"), "{translated}");
    }
    assert!(!portuguese.2.contains("retuning."), "a sentence without its translation");
    assert_eq!(of("fr").1, Some(2));
}

#[test]
fn hostile_names_stay_names() {
    let folder = scratch("hostile");
    let bad = Loop {
        head: "time_s,<script>alert(1)</script> PV,\"\"\"><img src=x> SP\",MV <b>&",
        ..Loop::moved(1.0, 90.0)
    };
    let log = bad.write(&folder.join("loop <i>.csv"));
    let report = folder.join("report.html");
    let output = vasos(&["retune", &log, "-o", &report.display().to_string()]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let html = std::fs::read_to_string(report).expect("a report");
    for tag in ["<script", "<img", "<b>", "<i>"] {
        assert!(!html.contains(tag), "{tag}");
    }
    assert!(html.contains("&lt;script&gt;"));
}

#[test]
fn a_report_never_goes_over_a_log_nor_where_nothing_can_be_written() {
    let folder = scratch("output");
    let log = Loop::moved(1.0, 90.0).write(&folder.join("loop.csv"));
    let before = std::fs::read(&log).expect("the log");
    for (output, reason) in [
        (log.clone(), "never written over"),
        (format!("{}/none/r.html", folder.display()), "cannot be written"),
    ] {
        let refused = vasos(&["retune", &log, "-o", &output]);
        assert_eq!(refused.status.code(), Some(2), "{output}");
        assert!(String::from_utf8_lossy(&refused.stderr).contains(reason), "{output}");
    }
    assert_eq!(std::fs::read(&log).expect("the log"), before);
    for wrong in [["--ms", "1"], ["--mt", "0.5"], ["--ju", "0"], ["--controller", "p"], ["--present", "Kc=0"]]
    {
        assert_eq!(vasos(&["retune", &log, wrong[0], wrong[1]]).status.code(), Some(2), "{wrong:?}");
    }
}

#[test]
fn a_folder_is_ranked_and_one_bad_log_stops_no_other() {
    let folder = scratch("folder");
    let logs = folder.join("logs");
    std::fs::create_dir_all(&logs).expect("a folder");
    Loop::moved(1.0, 90.0).write(&logs.join("b_sluggish.csv"));
    Loop::moved(1.087, 28.8).write(&logs.join("a_well.csv"));
    Loop { setpoint: |_| 50.0, ..Loop::moved(1.0, 90.0) }.write(&logs.join("c_still.csv"));
    std::fs::write(logs.join("d_broken.csv"), "nothing\n").expect("a file");
    std::fs::write(logs.join("notes.md"), "no log").expect("a file");
    let at = logs.display().to_string();
    let reports = folder.join("reports");
    let output = vasos(&["retune", &at, "--json", "--jobs", "3", "-o", &reports.display().to_string()]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let answer: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let of = |key: &str| -> Vec<String> {
        let loops = answer["loops"].as_array().expect("a list").iter();
        loops.filter_map(|l| l[key].as_str().map(str::to_owned)).collect()
    };
    assert_eq!(of("file"), ["b_sluggish.csv", "a_well.csv", "c_still.csv", "d_broken.csv"]);
    assert_eq!(of("verdict"), ["retune", "keep", "no_tuning", "unreadable"]);
    assert!(of("reason").iter().all(|r| !r.is_empty() && !r.contains(&at)), "{:?}", of("reason"));
    for name in ["index.html", "b_sluggish.csv.html", "c_still.csv.html"] {
        assert!(reports.join(name).exists(), "{name}");
    }
    assert!(!reports.join("d_broken.csv.html").exists());
    assert_eq!(vasos(&["retune", &at, "--json", "--jobs", "1"]).stdout, output.stdout);
    assert_eq!(vasos(&["retune", &reports.display().to_string()]).status.code(), Some(2));
}

/// The exit status was 0 where every log was unreadable or told no tuning.
#[test]
fn a_folder_without_one_answer_is_a_no() {
    let folder = scratch("folder_no");
    std::fs::write(folder.join("broken.csv"), "nothing\n").expect("a file");
    let at = folder.display().to_string();
    assert_eq!(vasos(&["retune", &at]).status.code(), Some(1));
    Loop { setpoint: |_| 50.0, ..Loop::moved(1.0, 90.0) }.write(&folder.join("still.csv"));
    assert_eq!(vasos(&["retune", &at, "--json"]).status.code(), Some(1));
    Loop::moved(1.0, 90.0).write(&folder.join("sluggish.csv"));
    assert_eq!(vasos(&["retune", &at]).status.code(), Some(0));
}
