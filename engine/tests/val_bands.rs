//! Bands on the step response and on the Nyquist curve hold the truth as often as they say.

use rand::SeedableRng;
use rand::rngs::StdRng;
use rand_distr::{Distribution, StandardNormal};
use vasos_engine::identify::{FitProblem, Structure, fit_model, simulate_fopdt};
use vasos_engine::model::{Fopdt, ProcessModel};

const SEEDS: u64 = 300;

/// Of 300 honest 95 % bands 285 hold the truth, standard deviation 3.8: 270 to 300 is four of them either side.
const HELD: std::ops::RangeInclusive<u64> = 270..=300;

#[test]
fn val_bands_hold_the_true_curves_about_95_times_in_100() {
    let truth = Fopdt { gain: 2.0, time_constant_s: 10.0, dead_time_s: 3.3 };
    let time_s: Vec<f64> = (0..300).map(|k| 0.5 * f64::from(k)).collect();
    let mv: Vec<f64> = time_s.iter().map(|t| if (15.0..75.0).contains(t) { 1.0 } else { 0.0 }).collect();
    let clean = simulate_fopdt(&truth, &time_s, &mv, 0.0, 5.0, None).expect("a run");
    // Times off the dead time: within a band of L the response has a corner, and a slope says little of it.
    let at_s = [0.0, 7.0, 12.0, 25.0, 60.0];
    let step = |t: f64| if t > 3.3 { -2.0 * (-(t - 3.3) / 10.0).exp_m1() } else { 0.0 };
    let omega = [0.02, 0.1, 0.4];
    let (mut on_step, mut on_nyquist) = ([0; 5], [0; 3]);
    for seed in 0..SEEDS {
        let mut rng = StdRng::seed_from_u64(seed);
        let noise = |y: &f64| {
            let e: f64 = StandardNormal.sample(&mut rng);
            y + 0.09 * e
        };
        let pv: Vec<f64> = clean.iter().map(noise).collect();
        let fit = fit_model(&FitProblem::new(&time_s, &pv, &mv), Structure::Fopdt).expect("a fit");
        for ((count, [low, _, high]), t) in on_step.iter_mut().zip(fit.step_band(&at_s)).zip(at_s) {
            *count += u64::from(low <= step(t) && step(t) <= high);
        }
        let exact = ProcessModel::Fopdt(truth).transfer_function();
        for (count, band) in on_nyquist.iter_mut().zip(fit.nyquist_band(&omega)) {
            // Into the axes of the ellipse.
            let off = exact.at_omega(band.omega_rad_s) - band.value;
            let (sine, cosine) = band.angle_rad.sin_cos();
            let along = (off.re * cosine + off.im * sine) / band.semi_axes[0];
            let across = (off.im * cosine - off.re * sine) / band.semi_axes[1];
            *count += u64::from(along * along + across * across <= 1.0);
        }
    }
    println!("step {on_step:?}, Nyquist {on_nyquist:?} of {SEEDS}");
    // Before the dead time the response is 0 whatever the parameters.
    assert_eq!(on_step[0], SEEDS);
    assert!(on_step[1..].iter().chain(&on_nyquist).all(|count| HELD.contains(count)));
}
