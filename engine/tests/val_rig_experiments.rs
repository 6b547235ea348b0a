//! Step tests of the reference rig with a sensor's imperfections, over fixed seeds: what the intervals are worth there.
//!
//! The specification of identification, "Must hold": TQ2 by 0.3 V, TQ3 by 0.1 to 0.3 V, 300 s of rest and 1,200 s
//! after, rows 0.2 s apart, noise of 0.1 cm, a converter of 12 bits. The level is simulated once without noise.

mod records;

use std::sync::Arc;

use rand::SeedableRng;
use rand::rngs::StdRng;
use vasos_engine::control::Mode;
use vasos_engine::identify::{FitError, FitProblem, FitVerdict, ModelFit, Structure, fit_model};
use vasos_engine::plant::{Measurement, Network, Transmitter};
use vasos_engine::session::RigCommand;
use vasos_engine::sim::ClosedLoop;

use records::noise;

const NOISE_CM: f64 = 0.1;
const REST_S: f64 = 300.0;
const LENGTH_S: f64 = 1500.0;
const NAMES: [&str; 3] = ["K", "T_s", "L_s"];

/// A step test without noise, and the sensor it is seen by.
struct StepTest {
    what: String,
    time_s: Vec<f64>,
    level_cm: Vec<f64>,
    mv: Vec<f64>,
    sensor: Transmitter,
    /// Fit of the record without noise.
    clean: ModelFit,
}

impl StepTest {
    /// In configuration 0 TQ2 is measured, in 1 TQ3.
    fn of(configuration: usize, step_v: f64) -> Self {
        let text = include_str!("../../assets/rigs/stad.toml");
        let network = Arc::new(Network::new(toml::from_str(text).expect("a rig")).expect("checked"));
        let mut closed =
            ClosedLoop::simulated(network.clone(), configuration, Measurement::IDEAL, 0).expect("starts");
        let tag = closed.loops()[0].spec.id.clone();
        closed.apply(&RigCommand::Mode { tag: tag.clone(), mode: Mode::Manual }).expect("manual");
        let h = closed.sample_time_s();
        let (rest, rows) = ((REST_S / h).round() as usize, (LENGTH_S / h).round() as usize);
        let (mut time_s, mut level_cm, mut mv) = (vec![], vec![], vec![]);
        for row in 0..rows {
            if row == rest {
                let value = mv[row - 1] + step_v;
                closed.apply(&RigCommand::Mv { tag: tag.clone(), value }).expect("an output");
            }
            // The first slot of a row: setpoint, PV, MV.
            let seen = closed.step();
            level_cm.push(seen[1]);
            mv.push(seen[2]);
            time_s.push(h * row as f64);
        }
        let spec = &network.spec.sensors[closed.loops()[0].sensor];
        let sensor = Transmitter::new(spec, network.spec.converters.as_ref(), h);
        let clean = fit_model(&FitProblem::new(&time_s, &level_cm, &mv), Structure::Fopdt).expect("a fit");
        let what = format!("{} by {step_v} V", spec.tank);
        Self { what, time_s, level_cm, mv, sensor, clean }
    }

    fn fit(&self, seed: u64, resolution: bool) -> ModelFit {
        self.try_fit(seed, resolution).expect("a fit")
    }

    fn try_fit(&self, seed: u64, resolution: bool) -> Result<ModelFit, FitError> {
        let mut rng = StdRng::seed_from_u64(seed);
        let how = Measurement { noise: false, quantisation: true, resolution };
        let mut sensor = self.sensor.clone();
        let noise = noise(&mut rng, self.level_cm.len(), 0.0);
        // The sensor draws from generators that it uses for nothing: its own noise and its spikes are off.
        let (mut idle, mut mishaps) = (StdRng::seed_from_u64(0), StdRng::seed_from_u64(0));
        let mut seen = |y: f64| sensor.measure(y, how, true, &mut idle, &mut mishaps).level_cm;
        let pv: Vec<f64> = self.level_cm.iter().zip(noise).map(|(y, e)| seen(y + NOISE_CM * e)).collect();
        fit_model(&FitProblem::new(&self.time_s, &pv, &self.mv), Structure::Fopdt)
    }

    fn truth(&self, name: &str) -> f64 {
        self.clean.parameter(name).expect("a parameter").value
    }

    /// Standard error that no unbiased estimate falls short of (Cramér and Rao), for white noise of [`NOISE_CM`].
    fn bound(&self, name: &str) -> f64 {
        let fit = &self.clean;
        // What the linear model leaves of the noise-free response is no noise: few of its rows are independent.
        let independent = fit.rows as f64 / fit.tests.rows_per_independent;
        let freedom = (independent - fit.unknowns as f64).max(3.0);
        let used = (fit.mse * fit.rows as f64 / freedom).sqrt();
        fit.parameter(name).expect("a parameter").standard_error / used * NOISE_CM
    }

    /// Scatter about the noise-free fit, in bounds, and how many intervals hold it.
    fn check(&self, seeds: u64, wanted: &std::ops::RangeInclusive<u64>) {
        let mut squares = [0.0; 3];
        let mut held = [0; 3];
        for seed in 0..seeds {
            let fit = self.fit(seed, false);
            for (i, name) in NAMES.into_iter().enumerate() {
                let p = fit.parameter(name).expect("a parameter");
                let truth = self.truth(name);
                squares[i] += (p.value - truth).powi(2);
                held[i] += u64::from((p.interval_95[0]..=p.interval_95[1]).contains(&truth));
            }
        }
        for (i, name) in NAMES.into_iter().enumerate() {
            let ratio = (squares[i] / seeds as f64).sqrt() / self.bound(name);
            let percent = 100.0 * held[i] as f64 / seeds as f64;
            println!(
                "{}: {name} {:.4}, scatter {ratio:.3} bounds, held {percent:.1} %",
                self.what,
                self.truth(name)
            );
            assert!((0.8..1.2).contains(&ratio), "{}: {name} scatters by {ratio} bounds", self.what);
            assert!(wanted.contains(&held[i]), "{}: {name} held in {} of {seeds}", self.what, held[i]);
        }
    }
}

fn experiments() -> Vec<StepTest> {
    [(0, 0.3), (1, 0.1), (1, 0.2), (1, 0.3)].map(|(configuration, v)| StepTest::of(configuration, v)).into()
}

/// Over 200 seeds an honest 95 % interval holds in 190, sd 3.08: four sd either side.
#[test]
fn val_rig_steps_scatter_as_they_must() {
    for experiment in experiments() {
        experiment.check(200, &(178..=200));
    }
}

#[test]
#[ignore = "release only: cargo test --release -p vasos-engine --test val_rig_experiments -- --ignored"]
fn val_rig_steps_scatter_as_they_must_over_2000() {
    for experiment in experiments() {
        experiment.check(2000, &(1860..=1940));
    }
}

/// Steps of a tenth of the size: the dead time drowns in the noise, its interval is cut at 0 and the verdict says so.
/// The interval of a dead time of nearly 0 clears 0 by chance in a few records of a hundred; one in two thousand shows no
/// answer to the MV at all and is refused.
fn small_steps(seeds: u64, least_percent: u64) {
    for (configuration, step_v) in [(0, 0.03), (1, 0.01)] {
        let experiment = StepTest::of(configuration, step_v);
        let (mut said, mut cut, mut held, mut refused) = (0, 0, 0, 0);
        let truth_s = experiment.truth("L_s");
        for seed in 0..seeds {
            let fit = match experiment.try_fit(seed, false) {
                Ok(fit) => fit,
                Err(FitError::NothingToFit { .. }) => {
                    refused += 1;
                    continue;
                }
                Err(error) => panic!("{seed}: {error}"),
            };
            said += u64::from(fit.verdicts.iter().any(|v| matches!(v, FitVerdict::DeadTimeUnknown { .. })));
            let [low, high] = fit.parameter("L_s").expect("L").interval_95;
            cut += u64::from(low == 0.0);
            held += u64::from((low..=high).contains(&truth_s));
        }
        println!("{}: said {said}, cut {cut}, held {held}, refused {refused} of {seeds}", experiment.what);
        assert!(refused * 500 <= seeds, "{refused} of {seeds} refused");
        assert!(
            said * 100 >= least_percent * seeds && cut >= said,
            "{}: {said}, {cut} of {seeds}",
            experiment.what
        );
    }
}

#[test]
fn val_small_rig_steps_hide_the_dead_time() {
    small_steps(40, 80);
}

#[test]
#[ignore = "release only: cargo test --release -p vasos-engine --test val_rig_experiments -- --ignored"]
fn val_small_rig_steps_hide_the_dead_time_over_2000() {
    small_steps(2000, 90);
}

/// With the sensor's steps of 0.35 cm the verdict names the resolution, not the noise.
fn coarse_sensor(seeds: u64) {
    for experiment in experiments() {
        let limited = (0..seeds)
            .filter(|&seed| {
                let fit = experiment.fit(seed, true);
                fit.verdicts.iter().any(|v| matches!(v, FitVerdict::ResolutionLimited { .. }))
            })
            .count() as u64;
        println!("{}: {limited} of {seeds}", experiment.what);
        assert!(limited == seeds, "{}: {limited} of {seeds}", experiment.what);
    }
}

#[test]
fn val_the_resolution_of_the_sensor_is_named() {
    coarse_sensor(40);
}

#[test]
#[ignore = "release only: cargo test --release -p vasos-engine --test val_rig_experiments -- --ignored"]
fn val_the_resolution_of_the_sensor_is_named_over_2000() {
    coarse_sensor(2000);
}
