//! From a log's bytes to a model, on data no one here made, against scipy.
//!
//! assets/golden/fopdt_scipy.json: tests/peers/fopdt_scipy.py, scipy 1.17.1, least_squares on the same model in closed
//! form. Both minimise the same cost, so they agree to the digits of the shallower optimiser, 1e-6; two of
//! scipy's standard errors is what the fit must not leave.

mod logs;

use logs::{read_log, skip};
use serde_json::Value;
use vasos_engine::identify::{FitProblem, fit_fopdt};
use vasos_io::log::{ImportOptions, import_log};

#[test]
fn val_heater_steps_give_the_models_that_scipy_finds() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../assets/golden/fopdt_scipy.json");
    let golden: Value =
        serde_json::from_str(&std::fs::read_to_string(path).expect("golden file")).expect("JSON");
    for name in ["pds_TCLab_data.csv", "step_noheader.csv", "step_volt_degF.csv"] {
        let Some(bytes) = read_log(&format!("tclab/{name}")) else {
            return skip("val_heater_steps_give_the_models_that_scipy_finds", "no VASOS_TEST_DATA");
        };
        let log = import_log(name, &bytes, &ImportOptions::default()).expect("a log");
        let roles = &log.report.roles;
        let column = |role: &Option<String>| {
            log.table.column(role.as_deref().expect("a proposal")).expect("a column").values.clone()
        };
        let (pv, mv) = (column(&roles.pv), column(&roles.mv));
        // scipy's model holds the MV ahead of the log at its first value.
        let mut problem = FitProblem::new(&log.table.time_s, &pv, &mv);
        problem.options.mv_before = Some(mv[0]);
        let fit = fit_fopdt(&problem).expect("a fit");
        let expected = &golden["fits"][name];
        let number = |key: &str| expected[key].as_f64().expect("a number");
        let error = |key: &str| expected["standard_error"][key].as_f64().expect("a number");
        println!("{name}: {:?} ± {:?}", fit.model, fit.standard_error);
        let found = [
            ("K", fit.model.gain, fit.standard_error.gain),
            ("T_s", fit.model.time_constant_s, fit.standard_error.time_constant_s),
            ("L_s", fit.model.dead_time_s, fit.standard_error.dead_time_s),
        ];
        for (key, value, standard_error) in found {
            assert!((value - number(key)).abs() < 2.0 * error(key), "{name} {key}");
            assert!((value / number(key) - 1.0).abs() < 1e-6, "{name} {key}: {value} for {}", number(key));
            assert!((standard_error / error(key) - 1.0).abs() < 1e-3, "{name} {key}: ± {standard_error}");
        }
        assert!((fit.fit_percent - number("fit_percent")).abs() < 1e-6, "{name}");
    }
}
