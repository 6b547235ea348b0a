//! Conversions between the forms: exact where they exist, refused where they do not. Frequency and time domain.

use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use vasos_engine::control::{
    Form, FormError, FormGains, Mapping, ParallelGains, PidGains, Scale, SeriesGains, ShownGains,
    kc_of_proportional_band, proportional_band_percent, prove, repeats_per_min, repeats_per_s,
};

fn same_everywhere(a: &FormGains, b: &FormGains) {
    for k in -40..=40 {
        let omega = 10f64.powf(f64::from(k) / 10.0);
        let (x, y) = (a.at_omega(omega), b.at_omega(omega));
        assert!((x - y).norm() <= 1e-11 * x.norm(), "{a:?} {b:?} at {omega}: {x} {y}");
    }
    let proof = prove(a, b);
    assert!(proof.relative() < 1e-11, "{a:?} {b:?}: {proof:?}");
}

/// Series to ideal (the same as in the books for N → ∞: Ti' + Td', Ti' Td'/(Ti' + Td')) and all ways back.
#[test]
fn val_every_way_between_the_forms_leads_back() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
    let mut worst = 0.0_f64;
    for _ in 0..300 {
        let series = SeriesGains {
            kc: rng.random_range(0.1..20.0) * if rng.random_bool(0.5) { 1.0 } else { -1.0 },
            ti_s: rng.random_range(5.0..100.0),
            td_s: rng.random_range(0.1..4.9),
            n: rng.random_range(2.0..30.0),
        };
        let source = FormGains::Series(series);
        for form in Form::ALL {
            let there = source.to_form(form).expect("exists");
            same_everywhere(&source, &there);
            worst = worst.max(prove(&source, &there).relative());
            for last in Form::ALL {
                let back = there.to_form(last).expect("exists");
                same_everywhere(&source, &back);
            }
        }
    }
    println!("largest relative difference of a proof run: {worst:e}");
    let book =
        FormGains::Series(SeriesGains { kc: 2.0, ti_s: 8.0, td_s: 2.0, n: 1e9 }).to_ideal().expect("ideal");
    for (value, expected) in [(book.kc, 2.5), (book.ti_s, 10.0), (book.td_s, 1.6)] {
        assert!((value / expected - 1.0).abs() < 1e-8, "{book:?}");
    }
}

/// Spec control.md: at N = 10 the series form exists from Ti/Td = 4.198 on, so Ziegler–Nichols' Ti = 4 Td is refused.
#[test]
fn val_the_series_form_exists_from_a_ratio_on() {
    let gains = |ratio: f64| FormGains::Ideal(PidGains { kc: 1.0, ti_s: ratio, td_s: 1.0, n: 10.0 });
    let refused = gains(4.0).to_form(Form::Series).expect_err("Ziegler-Nichols");
    let FormError::Series { square_s2, least_s2 } = refused else { panic!("{refused}") };
    assert!((square_s2 - 16.81).abs() < 1e-12 && (least_s2 - 17.6).abs() < 1e-12);
    assert!(gains(4.1975).to_form(Form::Series).is_err() && gains(4.1985).to_form(Form::Series).is_ok());
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(12);
    for _ in 0..2000 {
        let n = rng.random_range(0.3..40.0);
        let (ti_s, td_s) = (rng.random_range(0.1..100.0), rng.random_range(0.01..30.0));
        let source = FormGains::Ideal(PidGains { kc: -3.0, ti_s, td_s, n });
        let exists = (ti_s + td_s / n).powi(2) >= 4.0 * ti_s * td_s * (1.0 + 1.0 / n);
        let series = source.to_form(Form::Series);
        assert_eq!(series.is_ok(), exists, "{source:?}");
        if let Ok(series) = series {
            same_everywhere(&source, &series);
        }
    }
}

#[test]
fn controllers_without_one_of_the_actions_convert_too() {
    for ideal in [
        PidGains::p(2.0),
        PidGains::pi(-2.0, 30.0),
        PidGains { ti_s: f64::INFINITY, ..PidGains::pid(2.0, 1.0, 3.0) },
    ] {
        let source = FormGains::Ideal(ideal);
        for form in Form::ALL {
            let there = source.to_form(form).expect("exists");
            same_everywhere(&source, &there);
            same_everywhere(&source, &FormGains::Ideal(there.to_ideal().expect("back")));
        }
    }
}

#[test]
fn what_a_form_cannot_say_is_refused_with_its_numbers() {
    let parallel = |kp, ki, kd, tf_s| FormGains::Parallel(ParallelGains { kp, ki, kd, tf_s }).to_ideal();
    assert_eq!(parallel(0.0, 2.0, 0.0, 0.0), Err(FormError::NoProportional { ki: 2.0, kd: 0.0 }));
    assert_eq!(parallel(1.0, -0.5, 0.0, 0.0), Err(FormError::Time { name: "Ti", value_s: -2.0 }));
    assert_eq!(parallel(1.0, 0.0, -3.0, 0.1), Err(FormError::Time { name: "Td", value_s: -3.0 }));
    assert_eq!(parallel(1.0, 0.0, 3.0, 0.0), Err(FormError::Filter { tf_s: 0.0 }));
    let series = |ti_s, td_s, n| FormGains::Series(SeriesGains { kc: 1.0, ti_s, td_s, n }).to_ideal();
    assert!(matches!(series(1.0, 50.0, 10.0), Err(FormError::Time { name: "Td", .. })));
    assert!(matches!(series(1.0, 5.0, 0.5), Err(FormError::Time { name: "Ti", .. })));
    assert!(matches!(series(f64::NAN, 5.0, 0.5), Err(FormError::Gains(_))));
    for error in FormError::samples() {
        assert!(error.to_string().contains('='), "{error}");
    }
}

/// PB 100 % is Kc 1 on equal spans; 3.5 − 1 V over 24 cm, Kc 1.8 V/cm; 152 s are 0.3947 repeats a minute.
#[test]
fn bands_rates_and_mappings_of_the_user() {
    assert_eq!(proportional_band_percent(1.0, 100.0, 100.0), 100.0);
    let band = proportional_band_percent(1.8, 2.5, 24.0);
    assert!((band - 5.787_037).abs() < 1e-6);
    assert!((kc_of_proportional_band(band, 2.5, 24.0) - 1.8).abs() < 1e-15);
    assert!((repeats_per_min(152.0) - 0.394_736_842).abs() < 1e-9);
    assert_eq!((repeats_per_s(f64::INFINITY), repeats_per_s(4.0)), (0.0, 0.25));
    let legacy = Mapping {
        base: Form::Series,
        gain: Scale::proportional_band(2.5, 24.0),
        integral: Scale::REPEATS_PER_MIN,
        derivative: Scale::MINUTES,
        filter: Scale::PLAIN,
    };
    let gains = FormGains::Ideal(PidGains::pid(1.8, 152.0, 20.0));
    let shown = legacy.validated().expect("usable").shown(&gains).expect("exists");
    same_everywhere(&gains, &legacy.gains(&shown));
    let p = legacy.shown(&FormGains::Ideal(PidGains::p(1.8))).expect("exists");
    assert_eq!((p.integral, p.derivative), (0.0, 0.0));
    assert_eq!(legacy.gains(&p).to_ideal().expect("back").ti_s, f64::INFINITY);
    let nothing = Mapping { gain: Scale::Times(0.0), ..legacy };
    assert!(nothing.validated().is_err());
    let _: ShownGains = shown;
}
