//! What every law and every piece around it has to hold; spec control.md, "Must hold".

use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use vasos_engine::control::{
    Action, AntiWindup, Bound, Clip, ControlLoop, Deadband, Feedforward, Law, LeadLag, LoopInput,
    LoopOptions, LoopSpec, Mode, OutputRange, PidGains, PidTuning, SchedulePoint, SetpointPath, SmithModel,
    scheduled,
};

const H: f64 = 0.2;
const WIDE: OutputRange = OutputRange { low: -1e9, high: 1e9, rate_per_s: f64::INFINITY };

fn spec(law: Law, tuning: PidTuning) -> LoopSpec {
    let mut spec = LoopSpec {
        id: "LIC-01".to_owned(),
        sensor: "LT01".to_owned(),
        pump: Some("BA01".to_owned()),
        cascade_to: None,
        setpoint_cm: 10.0,
        mode: Mode::Automatic,
        kc: None,
        ti_s: None,
        td_s: 0.0,
        n: 10.0,
        gains: None,
        b: 1.0,
        c: 0.0,
        pv_filter_s: 0.0,
        law,
        options: LoopOptions::default(),
    };
    spec.set_tuning(tuning);
    spec
}

fn laws() -> [Law; 5] {
    let drawn = AntiWindup::BackCalculation { tracking_s: Some(5.0) };
    [
        Law::default(),
        Law::PidI2gl { clip: Clip::Integral, sends: Default::default() },
        Law::PID_2GL,
        Law::Pid2gl { bias: None, anti_windup: drawn },
        Law::OnOff { gap_cm: 4.0, action: Action::Reverse },
    ]
}

fn tuning() -> PidTuning {
    let gains = PidGains { kc: 1.7, ti_s: 12.0, td_s: 1.1, n: 8.0 };
    PidTuning { gains, b: 0.7, c: 0.3 }
}

fn sample(control: &mut ControlLoop, pv_cm: f64) -> f64 {
    let input = LoopInput { pv_cm, disturbance: f64::NAN, actual: control.mode, blocked: None };
    control.update(&input).mv
}

fn control(law: Law, range: OutputRange) -> ControlLoop {
    ControlLoop::new(&spec(law, tuning()), H, range, 2.0)
}

/// Two routes to one PID: the sum of the increments is the positional form, as long as no limit acts.
#[test]
fn the_positional_and_the_incremental_pid_agree_without_limits() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
    let mut positional = control(Law::PID_2GL, WIDE);
    let mut incremental = control(Law::default(), WIDE);
    for k in 0..20_000 {
        if k % 500 == 0 {
            let setpoint_cm = rng.random_range(5.0..25.0);
            (positional.setpoint_cm, incremental.setpoint_cm) = (setpoint_cm, setpoint_cm);
        }
        let y = rng.random_range(5.0..25.0);
        let (a, b) = (sample(&mut positional, y), sample(&mut incremental, y));
        assert!((a - b).abs() <= 1e-12 * (1.0 + a.abs()) * 100.0, "sample {k}: {a} {b}");
    }
}

/// Figure 7 in one sample: K ÷ 10 moves the positional law by ΔK·(b·r − y) and its own integral step, the
/// incremental law by its integral step alone; a change of b likewise.
#[test]
fn val_a_gain_divided_by_ten_moves_the_positional_law_alone() {
    for (law, jumps) in [(Law::PID_2GL, 1.0), (Law::default(), 0.0)] {
        let mut control = control(law, WIDE);
        let (r, y) = (10.0, 3.0);
        let mut before = 0.0;
        for _ in 0..2000 {
            before = sample(&mut control, y);
        }
        let mut new = tuning();
        new.gains.kc /= 10.0;
        control.set_tuning(new);
        let after = sample(&mut control, y);
        let step = new.gains.kc * H / (2.0 * new.gains.ti_s) * 2.0 * (r - y);
        let jump = (new.gains.kc - tuning().gains.kc) * (0.7 * r - y);
        let expected = step + jumps * jump;
        assert!((after - before - expected).abs() < 1e-11, "{law:?}: {} {expected}", after - before);
        let weighted = PidTuning { b: 0.2, ..new };
        control.set_tuning(weighted);
        let moved = sample(&mut control, y) - after;
        let expected = step + jumps * new.gains.kc * (0.2 - 0.7) * r;
        assert!((moved - expected).abs() < 1e-11, "{law:?}: b moved it by {moved}, not {expected}");
    }
}

#[test]
fn manual_to_automatic_brings_no_jump_with_any_law() {
    for law in laws() {
        let mut control = control(law, OutputRange { low: 0.0, high: 5.0, ..WIDE });
        control.mode = Mode::Manual;
        for _ in 0..50 {
            sample(&mut control, 9.0);
        }
        control.set_mv(3.3);
        let before = sample(&mut control, 9.0);
        control.mode = Mode::Automatic;
        let step = if law.is_pid() { 1.7 * H / 12.0 } else { 0.0 };
        let moved = sample(&mut control, 9.0) - before;
        assert!((moved - step).abs() < 1e-12, "{law:?}: {moved}");
    }
}

/// From any PID to any law or other settings, at an error and in motion: the output goes on.
#[test]
fn another_law_or_other_options_bring_no_jump() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(9);
    let everything = LoopOptions {
        deadband: Some(Deadband { half_width_cm: 0.5, factor: 0.2 }),
        schedule: vec![SchedulePoint { level_cm: 5.0, kc: 0.4, ti_s: Some(80.0) }],
        feedforward: Some(Feedforward { from: "LT02".to_owned(), gain: 2.0, lead_s: 1.0, lag_s: 4.0 }),
        smith: Some(SmithModel { gain: 2.0, time_constant_s: 30.0, dead_time_s: 3.1 }),
        ..LoopOptions::default()
    };
    for from in laws() {
        for to in laws() {
            let mut control = control(from, OutputRange { low: 0.0, high: 50.0, ..WIDE });
            control.set_mv(20.0);
            for _ in 0..100 {
                sample(&mut control, rng.random_range(9.5..10.5));
            }
            let (y, before) = (9.9, control.mv());
            control.set_law(to);
            let same = std::mem::discriminant(&from) == std::mem::discriminant(&to);
            let (after, last) = (sample(&mut control, y), *control.last());
            if !same && to.is_pid() {
                let step = 1.7 * H / 12.0 * 0.1;
                assert!((after - before - step).abs() < 1e-12, "{from:?} → {to:?}: {}", after - before);
            } else if !same {
                assert_eq!(after, before, "within the gap: {from:?} → {to:?}");
            }
            assert!(!last.held);
            if !to.is_pid() {
                continue;
            }
            let before = control.mv();
            control.set_options(everything.clone());
            let input = LoopInput { pv_cm: y, disturbance: 7.0, actual: Mode::Automatic, blocked: None };
            let moved = control.update(&input).mv - before;
            let step = 0.4 * H / 80.0 * 0.2 * 0.1;
            assert!((moved - step).abs() < 1e-12, "{to:?}: options on: {moved}");
            for disturbance in [7.5, 8.0, 9.0] {
                control.update(&LoopInput { pv_cm: 9.0, disturbance, ..input });
            }
            let before = control.mv();
            control.set_options(LoopOptions::default());
            let moved = sample(&mut control, 9.0) - before;
            assert!((moved - 1.7 * H / 12.0).abs() < 1e-12, "{to:?}: options off: {moved}");
        }
    }
}

#[test]
fn on_off_switches_at_the_edges_of_its_gap_and_keeps_in_between() {
    let range = OutputRange { low: 1.0, high: 4.0, ..WIDE };
    for (action, sign) in [(Action::Reverse, 1.0), (Action::Direct, -1.0)] {
        let mut gap = control(Law::OnOff { gap_cm: 2.0, action }, range);
        // Errors of a reverse controller; the setpoint is 10 cm.
        let at = |e: f64| 10.0 - sign * e;
        let errors = [0.9, 1.0, 0.5, -0.9, -1.0, -0.5, 0.0, 0.99, 1.01];
        let outputs = errors.map(|e| sample(&mut gap, at(e)));
        assert_eq!(outputs, [2.0, 4.0, 4.0, 4.0, 1.0, 1.0, 1.0, 1.0, 4.0], "{action:?}");
        let mut plain = control(Law::OnOff { gap_cm: 0.0, action }, range);
        let outputs = [0.0, 0.1, 0.0, -0.1, 0.0].map(|e| sample(&mut plain, at(e)));
        assert_eq!(outputs, [2.0, 4.0, 4.0, 1.0, 1.0], "{action:?}");
    }
}

/// A P controller with a bias: u = u0 + Kc·e, offset and all; its bias moves it, its mode does not.
#[test]
fn a_p_controller_has_its_bias_and_manual_sets_another() {
    let law = |bias| Law::Pid2gl { bias: Some(bias), anti_windup: AntiWindup::Clamping };
    let range = OutputRange { low: 0.0, high: 100.0, ..WIDE };
    let mut p = ControlLoop::new(&spec(law(40.0), PidTuning::new(PidGains::p(3.0))), H, range, 0.0);
    assert_eq!(sample(&mut p, 8.0), 46.0);
    assert_eq!(sample(&mut p, 50.0), 0.0);
    assert_eq!(sample(&mut p, 10.0), 40.0, "nothing winds up without integral action");
    p.set_law(law(45.0));
    assert_eq!(sample(&mut p, 10.0), 45.0);
    p.mode = Mode::Manual;
    p.set_mv(70.0);
    sample(&mut p, 12.0);
    p.mode = Mode::Automatic;
    assert_eq!(sample(&mut p, 12.0), 70.0);
    assert_eq!(sample(&mut p, 10.0), 76.0, "the output of manual is the new balance");
}

/// Both ways against windup: back inside the limits as soon as P turns, or after Tt; never the time of a
/// plain integral.
#[test]
fn the_integral_does_not_wind_up() {
    let leaves = |anti_windup| {
        let law = Law::Pid2gl { bias: None, anti_windup };
        let range = OutputRange { low: 0.0, high: 5.0, ..WIDE };
        let mut pi = ControlLoop::new(&spec(law, PidTuning::new(PidGains::pi(1.0, 10.0))), H, range, 2.0);
        for _ in 0..500 {
            assert!(sample(&mut pi, 4.0) <= 5.0);
        }
        assert_eq!((pi.mv(), pi.at_limit()), (5.0, Some(Bound::High)));
        (0..1000).position(|_| sample(&mut pi, 12.0) < 5.0).expect("leaves the limit")
    };
    assert_eq!(leaves(AntiWindup::Clamping), 0);
    // e = 6 for long: v settles where the draw back balances the integral, 6·Tt/Ti above the limit.
    let tt = 4.0;
    assert_eq!(leaves(AntiWindup::BackCalculation { tracking_s: Some(tt) }), 0);
    let law = Law::Pid2gl { bias: None, anti_windup: AntiWindup::BackCalculation { tracking_s: Some(tt) } };
    let range = OutputRange { low: 0.0, high: 5.0, ..WIDE };
    let mut pi = ControlLoop::new(&spec(law, PidTuning::new(PidGains::pi(1.0, 10.0))), H, range, 2.0);
    for _ in 0..2000 {
        sample(&mut pi, 4.0);
    }
    let parts = pi.last().parts;
    assert!((parts.p + parts.i - (5.0 + 6.0 * tt / 10.0)).abs() < 1e-9, "{parts:?}");
}

/// A setpoint step to the limit and back: the paper's law loses what the limit cut off, the option does not.
#[test]
fn clipping_the_integral_alone_gives_back_what_p_lost_at_the_limit() {
    for (clip, expected) in [(Clip::Output, 2.0 - 7.0), (Clip::Integral, 2.0)] {
        let law = Law::PidI2gl { clip, sends: Default::default() };
        let range = OutputRange { low: -100.0, high: 5.0, ..WIDE };
        let mut pi = ControlLoop::new(&spec(law, PidTuning::new(PidGains::pi(1.0, 1e12))), H, range, 2.0);
        sample(&mut pi, 10.0);
        pi.setpoint_cm = 20.0;
        assert_eq!(sample(&mut pi, 10.0), 5.0);
        assert_eq!(pi.last().cut, Some(Bound::High));
        pi.setpoint_cm = 10.0;
        assert!((sample(&mut pi, 10.0) - expected).abs() < 1e-9, "{clip:?}");
    }
    // The integral itself stops at the limit and leaves it in the sample in which the increment turns.
    let law = Law::PidI2gl { clip: Clip::Integral, sends: Default::default() };
    let range = OutputRange { low: 0.0, high: 5.0, ..WIDE };
    let mut pi = ControlLoop::new(&spec(law, PidTuning::new(PidGains::pi(1.0, 10.0))), H, range, 2.0);
    for _ in 0..1000 {
        sample(&mut pi, 9.0);
    }
    assert_eq!(pi.mv(), 5.0);
    assert!(sample(&mut pi, 9.5) < 5.0);
}

/// With a model that is true, the loop with predictor answers as the loop without dead time, L later.
#[test]
fn the_smith_predictor_takes_the_dead_time_out_of_the_loop() {
    let (gain, time_constant_s) = (2.0, 20.0);
    let response = |late: usize, predictor: bool| -> Vec<f64> {
        let mut spec = spec(Law::default(), PidTuning::new(PidGains::pi(1.5, 15.0)));
        let dead_time_s = late as f64 * H;
        spec.options.smith = predictor.then_some(SmithModel { gain, time_constant_s, dead_time_s });
        let mut pi = ControlLoop::new(&spec, H, WIDE, 0.0);
        pi.setpoint_cm = 0.0;
        let (mut x, mut coming) = (0.0, std::collections::VecDeque::from(vec![0.0; late]));
        let decay = (-H / time_constant_s).exp();
        (0..600)
            .map(|k| {
                coming.push_back(x);
                let y = coming.pop_front().expect("one");
                let mv = sample(&mut pi, y);
                x = gain * mv + decay * (x - gain * mv);
                pi.setpoint_cm = if k > 2 { 5.0 } else { 0.0 };
                y
            })
            .collect()
    };
    let (late, without) = (response(40, true), response(0, false));
    for k in 40..600 {
        assert!((late[k] - without[k - 40]).abs() < 1e-9, "sample {k}: {} {}", late[k], without[k - 40]);
    }
    let plain = response(40, false);
    let peak = |y: &[f64]| y.iter().fold(0.0_f64, |m, v| m.max(*v));
    assert!(peak(&plain) > 1.3 * peak(&late), "the dead time costs without the predictor");
}

/// A dead time between two samples: the delayed model is the exponential itself.
#[test]
fn the_predictor_is_exact_between_samples() {
    let model = SmithModel { gain: 2.0, time_constant_s: 7.0, dead_time_s: 3.33 };
    let mut predictor = vasos_engine::control::SmithPredictor::new(model, H, 1.0);
    let x = |t: f64| if t > 0.0 { 2.0 * (1.0 - (-t / 7.0).exp()) } else { 0.0 };
    for k in 0..200 {
        let t = f64::from(k) * H;
        assert!((predictor.correction() - (x(t) - x(t - 3.33))).abs() < 1e-12, "{t}");
        predictor.advance(2.0);
    }
}

/// Step responses: gain·(1 + (lead/lag − 1)e^(−t/lag)), and what Tustin leaves of it at a fast sampling.
#[test]
fn the_feed_forward_is_a_lead_and_lag() {
    let path = Feedforward { from: "LT02".to_owned(), gain: -1.5, lead_s: 6.0, lag_s: 2.0 };
    let mut filter = LeadLag::default();
    let h = 1e-3;
    assert_eq!(filter.step(&path, 4.0, h), 0.0, "a level that was there from the start changes nothing");
    for k in 1..20_000 {
        let t = (f64::from(k) - 0.5) * h;
        let u = filter.step(&path, 5.0, h);
        let expected = -1.5 * (1.0 + 2.0 * (-t / 2.0).exp());
        assert!((u - expected).abs() < 2e-3, "{t}: {u} {expected}");
    }
    let held = filter.step(&path, f64::NAN, h);
    assert!((held + 1.5).abs() < 1e-3, "{held}");
    // A lag shorter than half a sample must not ring.
    let fast = Feedforward { lead_s: 0.0, lag_s: 0.01, gain: 1.0, ..path };
    let mut filter = LeadLag::default();
    filter.step(&fast, 0.0, 1.0);
    let steps: Vec<f64> = (0..5).map(|_| filter.step(&fast, 1.0, 1.0)).collect();
    assert!(steps.windows(2).all(|w| w[1] >= w[0]) && steps[4] <= 1.0, "{steps:?}");
}

#[test]
fn schedule_and_deadband_are_piecewise_straight() {
    let table = [
        SchedulePoint { level_cm: 5.0, kc: 1.0, ti_s: None },
        SchedulePoint { level_cm: 15.0, kc: 3.0, ti_s: Some(52.0) },
    ];
    let at = |level| scheduled(&table, tuning(), level).gains;
    assert_eq!((at(0.0).kc, at(5.0).kc, at(10.0).kc, at(15.0).kc, at(99.0).kc), (1.0, 1.0, 2.0, 3.0, 3.0));
    assert_eq!((at(0.0).ti_s, at(10.0).ti_s, at(20.0).ti_s), (12.0, 32.0, 52.0));
    assert_eq!(scheduled(&[], tuning(), 7.0), tuning());
    let band = Deadband { half_width_cm: 2.0, factor: 0.25 };
    assert_eq!([-3.0, -2.0, 0.0, 1.0, 2.0, 4.0].map(|e| band.error(e)), [-1.5, -0.5, 0.0, 0.25, 0.5, 2.5]);
    // Inside a pure deadband the output of a PI stands still.
    let mut spec = spec(Law::default(), tuning());
    spec.options.deadband = Some(Deadband { half_width_cm: 2.0, factor: 0.0 });
    let mut pi = ControlLoop::new(&spec, H, WIDE, 2.0);
    let outputs: Vec<f64> = (0..50).map(|k| sample(&mut pi, 10.0 + (f64::from(k)).sin())).collect();
    assert!(outputs.iter().all(|&u| (u - 2.0).abs() < 1e-12), "{outputs:?}");
}

#[test]
fn setpoint_and_output_go_no_faster_than_told() {
    let mut spec = spec(Law::PID_2GL, PidTuning::new(PidGains::p(10.0)));
    spec.options.setpoint = SetpointPath { ramp_cm_s: Some(0.5), filter_s: 0.0 };
    spec.options.output.rate_per_s = Some(2.0);
    let mut control = ControlLoop::new(&spec, H, OutputRange { low: 0.0, high: 100.0, ..WIDE }, 2.0);
    sample(&mut control, 10.0);
    control.setpoint_cm = 11.0;
    let mut last = control.mv();
    for k in 1..=40 {
        let mv = sample(&mut control, 10.0);
        assert!(mv - last <= 2.0 * H + 1e-12, "{mv} after {last}");
        last = mv;
        let way = (0.5 * H * f64::from(k)).min(1.0);
        assert!((control.working_setpoint_cm() - 10.0 - way).abs() < 1e-12);
    }
    assert!((last - 12.0).abs() < 1e-9, "no windup behind the rate limit: {last}");
    spec.options.setpoint = SetpointPath { ramp_cm_s: None, filter_s: 3.0 };
    let mut control = ControlLoop::new(&spec, H, WIDE, 2.0);
    sample(&mut control, 10.0);
    control.setpoint_cm = 11.0;
    for k in 1..100 {
        sample(&mut control, 10.0);
        let expected = 11.0 - (-H * f64::from(k) / 3.0).exp();
        assert!((control.working_setpoint_cm() - expected).abs() < 1e-12);
    }
}

#[test]
fn input_that_is_no_number_holds_the_output_of_every_law() {
    for law in laws() {
        let mut control = control(law, OutputRange { low: 0.0, high: 50.0, ..WIDE });
        for _ in 0..10 {
            sample(&mut control, 9.0);
        }
        let before = control.mv();
        for odd in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert_eq!(sample(&mut control, odd), before, "{law:?}");
            assert!(control.last().held);
        }
        assert!(sample(&mut control, 9.0).is_finite() && !control.last().held);
    }
}
