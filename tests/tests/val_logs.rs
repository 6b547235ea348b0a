//! Logs of real plants that others recorded, file by file: columns, stretch, and the model with its intervals or the
//! reasoned no. The table is kept in val_logs/table.txt; a change of it is a change of what an engineer is told.
//!
//! `UPDATE_LOGS=1 cargo test -p vasos-tests --test val_logs` writes it anew. The logs themselves may not be part of the
//! project; the folder of them is named by `VASOS_TEST_DATA`.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use vasos_engine::identify::{
    Disturbance, Drift, FitProblem, LoopRecord, LoopStudy, ModeColumn, StudyOptions, study_loop,
};
use vasos_engine::retune::{LoopSigns, RetuneOptions, retune};
use vasos_engine::signal::derived_column;
use vasos_io::log::{ImportOptions, import_log};
use vasos_tests::{root, skip};

/// One stretch of a log, columns as `vasos identify` takes them; empty for the proposal.
#[derive(Default)]
struct Case {
    file: &'static str,
    pv: &'static str,
    mv: &'static str,
    disturbance: &'static str,
    mv_before: Option<f64>,
    sample_time_s: Option<f64>,
    to_s: Option<f64>,
}

fn cases() -> Vec<Case> {
    let of = |file| Case { file, ..Case::default() };
    let tank = |file| Case { pv: "tank level", mv: "[initial flow u0]+[command PI (du)]", ..of(file) };
    vec![
        Case { mv_before: Some(0.0), ..of("tclab/kantor_Model_Data.csv") },
        of("tclab/pds_TCLab_data.csv"),
        of("tclab/step_noheader.csv"),
        of("tclab/step_volt_degF.csv"),
        of("tclab/mimo_3s_nonuniform.txt"),
        Case { disturbance: "Heater 2", ..of("tclab/mimo_energy_1s.txt") },
        Case { pv: "T1", mv: "Q1", disturbance: "Q2", ..of("tclab/pid_closed_loop_2ch.csv") },
        Case { pv: "T2", mv: "Q2", disturbance: "Q1", ..of("tclab/pid_closed_loop_2ch.csv") },
        of("tclab/pid_closed_loop_fopdt.txt"),
        Case { mv_before: Some(0.0), ..of("uclouvain_tank_level/open_loop_ultimate.txt") },
        tank("uclouvain_tank_level/exp1_ol3.txt"),
        tank("uclouvain_tank_level/final_PI.txt"),
        Case { mv: "[column 4]+[column 5]", ..of("uclouvain_tank_level/cl-10-0_1_ultimate.txt") },
        of("uclouvain_nmp_circuit/5-3-2-perturbation-non-min-phase.txt"),
        of("uclouvain_nmp_circuit/5-4-4-setpoint-step.txt"),
        Case { pv: "1", mv: "3", mv_before: Some(0.0), ..of("stm32_two_tanks/Open_Loop.csv") },
        Case { pv: "2", mv: "3", mv_before: Some(0.0), ..of("stm32_two_tanks/Open_Loop.csv") },
        of("refinery_loops/stic_2#CDU.7040-312_LIC63001_0628_1642_Stick1=0.070441.txt"),
        of("refinery_loops/stic_2111FIC40102C_0905_0010_Stick1=5.7786E-06.txt"),
        of("refinery_loops/stic_2111LIC31102B_1110_0008_Stick1=0.txt"),
        of("refinery_loops/stic_2111LIC44001_0902_0008_Stick1=0.00027609.txt"),
        of("refinery_loops/stic_2111PIC10201_0903_0006_Stick1=0.txt"),
        of("refinery_loops/stic_2411FIC20102_0823_1527_Stick1=0.84495.txt"),
        of("refinery_loops/stic_2411PDIC10321_0606_0007_Stick1=0.txt"),
        of("refinery_loops/stic_RHT.7050-342_FIC10112_0630_0002_Stick1=1.txt"),
        of("kspice_sim/Step0001_untuned.txt"),
    ]
}

/// The study of a case with the names of its PV and MV, or why there is none.
fn study(folder: &Path, case: &Case) -> Result<(String, LoopStudy), String> {
    study_with_signs(folder, case).map(|(columns, study, _)| (columns, study))
}

/// The same with what a retuning needs of the signals.
fn study_with_signs(folder: &Path, case: &Case) -> Result<(String, LoopStudy, LoopSigns), String> {
    let bytes = std::fs::read(folder.join(case.file)).expect("a log");
    let name =
        Path::new(case.file).file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let options = ImportOptions { sample_time_s: case.sample_time_s, ..ImportOptions::default() };
    let log = import_log(&name, &bytes, &options).map_err(|e| e.to_string())?;
    let roles = &log.report.roles;
    let pick = |given: &str, proposed: &Option<String>| -> Result<String, String> {
        if given.is_empty() {
            proposed.clone().ok_or("no column proposed".to_owned())
        } else {
            Ok(given.to_owned())
        }
    };
    let (pv_name, mv_name) = (pick(case.pv, &roles.pv)?, pick(case.mv, &roles.mv)?);
    let column = |name: &str| derived_column(&log.table, name).map_err(|e| e.to_string());
    let (pv, mv) = (column(&pv_name)?, column(&mv_name)?);
    let mut columns: Vec<&[f64]> = vec![&pv, &mv];
    let other = (!case.disturbance.is_empty()).then(|| column(case.disturbance)).transpose()?;
    columns.extend(other.as_deref());
    let to_s = case.to_s.unwrap_or(f64::INFINITY);
    let rows = log.table.complete(&columns, 0.0, to_s);
    let beside = |role: &Option<String>| -> Option<Vec<f64>> {
        let values = column(role.as_deref()?).ok()?;
        let values: Vec<f64> = rows.taken.iter().map(|&i| values[i]).collect();
        values.iter().all(|v| v.is_finite()).then_some(values)
    };
    let (sp, mode) = (beside(&roles.sp), beside(&roles.mode));
    let mut problem = FitProblem::new(&rows.time_s, &rows.columns[0], &rows.columns[1]);
    problem.options.mv_before = case.mv_before;
    problem.options.drift = Drift::Auto;
    (problem.options.pv_name, problem.options.mv_name) = (pv_name.clone(), mv_name.clone());
    if other.is_some() {
        let name = case.disturbance.to_owned();
        problem.disturbances = vec![Disturbance { name, values: &rows.columns[2] }];
    }
    let words = roles.mode.as_deref().and_then(|name| log.table.columns.iter().find(|c| c.name == name));
    let words = words.map_or(&[][..], |column| &column.states);
    let mode = mode.as_deref().map(|values| ModeColumn { values, words });
    let record = LoopRecord { problem, sp: sp.as_deref(), mode };
    let study = study_loop(&record, &StudyOptions::default()).map_err(|e| e.to_string())?;
    let signs = LoopSigns::of(&rows.time_s, &rows.columns[1], sp.as_deref());
    Ok((format!("{pv_name} from {mv_name}"), study, signs))
}

/// Three digits: the table is to change when what it says does, not with the last bits.
fn three(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let digits = (2 - value.abs().log10().floor() as i32).max(0) as usize;
    if value.abs() >= 1e6 || value.abs() < 1e-4 {
        format!("{value:.2e}")
    } else {
        format!("{value:.digits$}")
    }
}

fn row(case: &Case, found: &Result<(String, LoopStudy), String>) -> String {
    let mut out = format!("{}\n", case.file);
    match found {
        Err(reason) => writeln!(out, "  no: {reason}").expect("text"),
        Ok((columns, study)) => {
            writeln!(out, "  {columns}").expect("text");
            match &study.choice {
                Err(reason) => writeln!(out, "  no: {reason}").expect("text"),
                Ok(choice) if !study.has_model() => {
                    writeln!(out, "  no: {}", choice.chosen().verdict()).expect("text");
                }
                Ok(choice) => {
                    let fit = choice.chosen();
                    write!(out, "  {} fit {} %:", fit.structure.key(), three(fit.fit_percent)).expect("text");
                    let others = fit.disturbances.iter().flat_map(|d| &d.parameters);
                    for p in fit.parameters.iter().chain(others) {
                        let [low, high] = p.interval_95.map(three);
                        write!(out, " {} {} [{low}, {high}]", p.name, three(p.value)).expect("text");
                    }
                    writeln!(out, "\n  {}", fit.verdict().to_string().split(':').next().unwrap_or(""))
                        .expect("text");
                }
            }
            if let Some(c) = &study.controller {
                let ti = c.ti_s.map_or("none".to_owned(), three);
                writeln!(out, "  controller Kc {} Ti {ti}, explains {} %", three(c.kc), three(100.0 * c.r2))
                    .expect("text");
            }
            for finding in &study.findings {
                writeln!(out, "  {finding}").expect("text");
            }
        }
    }
    out
}

fn folder() -> Option<PathBuf> {
    std::env::var_os("VASOS_TEST_DATA").map(PathBuf::from).filter(|f| f.join("tclab").is_dir())
}

#[test]
fn val_logs_of_real_plants_say_what_the_table_keeps() {
    let Some(folder) = folder() else {
        return skip("val_logs_of_real_plants_say_what_the_table_keeps", "no VASOS_TEST_DATA");
    };
    let table: String =
        cases().iter().map(|case| row(case, &study(&folder, case))).collect::<Vec<_>>().join("\n");
    compare_with_kept(&table, "table.txt");
}

fn compare_with_kept(table: &str, file: &str) {
    let path = root().join("tests/tests/val_logs").join(file);
    if std::env::var_os("UPDATE_LOGS").is_some() {
        std::fs::write(&path, table).expect("written");
    }
    let kept = std::fs::read_to_string(&path).expect("the table");
    for (new, old) in table.lines().zip(kept.lines()) {
        assert_eq!(new, old, "a line of {} has changed", path.display());
    }
    assert_eq!(table.lines().count(), kept.lines().count());
}

/// What a retuning of each log comes to: the tuning with its gains and what it is worth, or the reasoned no.
///
/// Kept in val_logs/retune.txt. What must hold of any of them: gains that are recommended keep Ms 1.4 with the model, or are
/// the present ones.
#[test]
fn val_retuning_of_real_loops_says_what_the_table_keeps() {
    let Some(folder) = folder() else {
        return skip("val_retuning_of_real_loops_says_what_the_table_keeps", "no VASOS_TEST_DATA");
    };
    let mut table = String::new();
    for case in cases() {
        writeln!(table, "{}", case.file).expect("text");
        let (columns, study, signs) = match study_with_signs(&folder, &case) {
            Ok(found) => found,
            Err(reason) => {
                writeln!(table, "  no: {reason}").expect("text");
                continue;
            }
        };
        let found = retune(&study, &signs, &RetuneOptions::default()).expect("limits that can be asked for");
        writeln!(table, "  {columns}").expect("text");
        if let Some(choice) = found.choice() {
            let g = choice.gains;
            let ms = choice.analysis.ms.expect("a stable loop");
            let kept =
                choice.rule.id() == "present" || ms <= 1.4 * (1.0 + 1e-6) || found.candidates.len() < 2;
            assert!(kept || choice.rule.id() == "optimal_family", "{}: Ms {ms}", case.file);
            let two = |v: f64| format!("{v:.1e}");
            let name = format!("{} {}", choice.rule.id(), choice.controller);
            writeln!(table, "  {name}: Kp {} Ki {} Ms {}", two(g.kp), two(g.ki), three(ms)).expect("text");
        }
        for advice in &found.advice {
            let said = advice.to_string();
            writeln!(table, "  {}", said.split([':', ';']).next().unwrap_or("")).expect("text");
        }
    }
    compare_with_kept(&table, "retune.txt");
}

fn model_of(folder: &Path, file: &'static str, case: Case) -> LoopStudy {
    study(folder, &Case { file, ..case }).expect("a study").1
}

/// What is known of these plants from elsewhere.
#[test]
fn val_logs_of_known_plants_give_what_is_known() {
    let Some(folder) = folder() else {
        return skip("val_logs_of_known_plants_give_what_is_known", "no VASOS_TEST_DATA");
    };
    // UCLouvain, lab 3, report: G = (−0.9091 s + 0.08792)/(s² + 1.161 s + 0.09353), that is K 0.940, Tz −10.34 s,
    // T1 11.49 s, T2 0.931 s, of parts with 5 and 10 % tolerance; the log's units are percent of two ranges.
    let study = model_of(&folder, "uclouvain_nmp_circuit/5-4-4-setpoint-step.txt", Case::default());
    let fit = study.choice.as_ref().expect("a model").chosen();
    for (name, known) in [("K", 0.940), ("Tz_s", -10.34), ("T_s", 11.49), ("T2_s", 0.931)] {
        let p = fit.parameter(name).unwrap_or_else(|| panic!("{name} in {:?}", fit.parameters));
        assert!((p.value / known - 1.0).abs() < 0.1, "{name} {} for {known}", p.value);
    }
    // The file is named for Kp = 10 and 1/Ti = 0.1.
    let case = Case { mv: "[column 4]+[column 5]", ..Case::default() };
    let study = model_of(&folder, "uclouvain_tank_level/cl-10-0_1_ultimate.txt", case);
    let controller = study.controller.as_ref().expect("a controller");
    assert!((controller.kc - 10.0).abs() < 0.02, "{controller:?}");
    assert!((controller.ti_s.expect("Ti") - 10.0).abs() < 0.05, "{controller:?}");
    // Nothing but an unmeasured valve and feedback moves it: no model.
    assert!(!study.has_model());
    // TCLab: textbooks give a first heater K of 0.5 to 0.7 °C/% and T of 120 to 190 s, with a second, faster lag.
    let case = Case { mv_before: Some(0.0), ..Case::default() };
    let study = model_of(&folder, "tclab/kantor_Model_Data.csv", case);
    let fit = study.choice.as_ref().expect("a model").chosen();
    let value = |name: &str| fit.parameter(name).map_or(0.0, |p| p.value);
    assert!(
        (0.5..0.7).contains(&value("K")) && (120.0..190.0).contains(&value("T_s")),
        "{:?}",
        fit.parameters
    );
}
