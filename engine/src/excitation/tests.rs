//! The machines on exact first-order plants, and every way a test can end.

use num_complex::Complex64;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::*;
use crate::control::{Limits, Mode};
use crate::model::{Fopdt, ProcessModel};
use crate::plant::RigError;
use crate::tune::ultimate;

const PV_AT_REST: f64 = 12.0;
const MV_AT_REST: f64 = 2.0;

/// A first-order plant with dead time, exact for an input held from sample to sample.
struct Process {
    model: Fopdt,
    h: f64,
    y: f64,
    pipe: Vec<f64>,
    sample: usize,
    noise_sd: f64,
    rng: Xoshiro256PlusPlus,
}

impl Process {
    fn new(model: Fopdt, h: f64) -> Self {
        let delay = (model.dead_time_s / h).round() as usize;
        assert!((delay as f64 * h - model.dead_time_s).abs() < 1e-9, "whole samples of dead time");
        let rng = Xoshiro256PlusPlus::seed_from_u64(7);
        Self { model, h, y: 0.0, pipe: vec![0.0; delay], sample: 0, noise_sd: 0.0, rng }
    }

    fn noisy(self, noise_sd: f64) -> Self {
        Self { noise_sd, ..self }
    }

    fn measured(&mut self) -> f64 {
        let draw: f64 = StandardNormal.sample(&mut self.rng);
        PV_AT_REST + self.y + self.noise_sd * draw
    }

    /// Holds an output for a sample time.
    fn hold(&mut self, mv: f64) {
        let mut u = mv - MV_AT_REST;
        if !self.pipe.is_empty() {
            let slot = self.sample % self.pipe.len();
            u = std::mem::replace(&mut self.pipe[slot], u);
        }
        self.sample += 1;
        let decay = (-self.h / self.model.time_constant_s).exp();
        self.y = decay * self.y + (1.0 - decay) * self.model.gain * u;
    }
}

fn circumstances(h: f64) -> Circumstances {
    Circumstances {
        tag: "LIC-01".to_owned(),
        time_s: 0.0,
        sample_time_s: h,
        pv: Some(PV_AT_REST),
        pv_range: Limits { low: 0.0, high: 25.0 },
        setpoint: PV_AT_REST,
        mv: MV_AT_REST,
        mv_limits: Limits { low: 0.0, high: 5.0 },
        mode: Mode::Manual,
    }
}

fn fopdt(gain: f64, time_constant_s: f64, dead_time_s: f64) -> Fopdt {
    Fopdt::new(gain, time_constant_s, dead_time_s).expect("a model")
}

/// Runs a test on a process in manual until it ends.
fn run(process: &mut Process, excitation: &Excitation) -> ExcitationReport {
    let mut run = ExcitationRun::start(excitation, circumstances(process.h)).expect("begins");
    let mut mv = MV_AT_REST;
    for k in 0.. {
        let pv = process.measured();
        match run.step(f64::from(k) * process.h, pv, mv) {
            Drive::Leave => {}
            Drive::Output(output) => mv = output,
            Drive::Setpoint(_) => panic!("no controller here"),
        }
        if run.ending().is_some() {
            mv = run.restore().output.unwrap_or(mv);
        }
        assert!((0.0..=5.0).contains(&mv), "{mv}");
        run.applied(PV_AT_REST, mv);
        if run.ending().is_some() {
            return run.into_report();
        }
        process.hold(mv);
    }
    unreachable!("a test ends")
}

fn excitation(signal: Signal) -> Excitation {
    Excitation { listen_s: 4.0, ..Excitation::new(signal) }
}

fn relay(amplitude: f64, hysteresis: f64) -> Relay {
    Relay { hysteresis: Hysteresis::Given(hysteresis), ..Relay::new(amplitude) }
}

fn relay_finding(report: &ExcitationReport) -> RelayFinding {
    assert_eq!(report.ending, Ending::Finished);
    match report.finding {
        Finding::Relay(finding) => finding,
        ref other => panic!("{other:?}"),
    }
}

/// Period and amplitude of the limit cycle of a FOPDT under a symmetric relay with hysteresis.
///
/// After a switch at y = ε the PV goes on for L towards the value left, then turns: `a = Kd − (Kd − ε) e^(−L/T)`,
/// `Pu = 2 (L + T ln((Kd + a)/(Kd − ε)))`. Both are the first-order
/// answer between two switches.
fn limit_cycle(model: Fopdt, d: f64, width: f64) -> (f64, f64) {
    let (kd, t) = (model.gain.abs() * d, model.time_constant_s);
    let amplitude = kd - (kd - width) * (-model.dead_time_s / t).exp();
    (2.0 * (model.dead_time_s + t * ((kd + amplitude) / (kd - width)).ln()), amplitude)
}

/// The first-order model that a record told.
fn first_order(told: &Identified) -> Fopdt {
    match told.fit().model {
        ProcessModel::Fopdt(model) => model,
        ref other => panic!("{other:?}"),
    }
}

#[test]
fn a_relay_finds_the_limit_cycle_of_its_closed_form() {
    for (model, d, width) in [
        (fopdt(2.0, 10.0, 3.0), 0.5, 0.0),
        (fopdt(2.0, 10.0, 3.0), 0.5, 0.15),
        (fopdt(-1.5, 20.0, 2.0), 0.8, 0.1),
        (fopdt(0.8, 2.0, 8.0), 0.7, 0.05),
    ] {
        let mut process = Process::new(model, 1e-3);
        let found = relay_finding(&run(
            &mut process,
            &Excitation { budget_s: 400.0, ..excitation(Signal::Relay(relay(d, width))) },
        ));
        let (period_s, amplitude) = limit_cycle(model, d, width);
        assert!((found.period_s / period_s - 1.0).abs() < 5e-4, "{model:?}: {found:?}, {period_s}");
        assert!((found.amplitude / amplitude - 1.0).abs() < 5e-4, "{model:?}: {found:?}, {amplitude}");
        let describing = 4.0 * d / (std::f64::consts::PI * amplitude);
        assert!((found.ku.abs() / describing - 1.0).abs() < 1e-3 && found.ku * model.gain > 0.0, "{found:?}");
        assert_eq!(found.static_gain, None, "a symmetric relay does not tell it");
    }
}

#[test]
fn an_asymmetric_relay_tells_the_static_gain() {
    for gain in [2.0, -2.0] {
        let mut process = Process::new(fopdt(gain, 10.0, 3.0), 2e-3);
        let asymmetric = Relay { amplitude_down: Some(0.3), ..relay(0.6, 0.1) };
        let test = Excitation { budget_s: 400.0, ..excitation(Signal::Relay(asymmetric)) };
        let found = relay_finding(&run(&mut process, &test)).static_gain.expect("told");
        assert!((found / gain - 1.0).abs() < 1e-3, "{found}");
    }
}

#[test]
fn the_record_of_a_noisy_relay_gives_the_model_and_its_ultimate_point() {
    let model = fopdt(2.0, 30.0, 4.0);
    let mut process = Process::new(model, 0.2).noisy(0.03);
    let report = run(&mut process, &excitation(Signal::Relay(Relay::new(0.5))));
    let found = relay_finding(&report);
    let deviation_sd = report.deviation_sd.expect("heard");
    assert!((found.hysteresis / (3.0 * deviation_sd) - 1.0).abs() < 1e-12);
    let told = identify_report(&report).expect("a model");
    let exact = ultimate(&ProcessModel::Fopdt(model)).expect("a limit");
    let near = |a: f64, b: f64, share: f64| (a / b - 1.0).abs() < share;
    let found = first_order(&told);
    assert!(near(found.time_constant_s / found.gain, 15.0, 0.05), "{found:?}");
    let of_model = told.ultimate.expect("a limit");
    assert!(near(of_model.ku, exact.ku, 0.05) && near(of_model.pu_s, exact.pu_s, 0.05), "{of_model:?}");
}

#[test]
fn a_wide_hysteresis_is_remarked_on() {
    let mut process = Process::new(fopdt(2.0, 10.0, 1.0), 0.01);
    let report = run(&mut process, &excitation(Signal::Relay(relay(0.5, 0.3))));
    let warnings = report.warnings();
    assert!(
        matches!(warnings[..], [ExcitationWarning::WideHysteresis { ratio, .. }] if ratio > 0.3),
        "{warnings:?}"
    );
}

#[test]
fn a_step_waits_for_rest_and_tells_the_gain() {
    for (noise_sd, gain) in [(0.0, 2.0), (0.02, 2.0), (0.02, -2.0)] {
        let mut process = Process::new(fopdt(gain, 20.0, 3.0), 0.2).noisy(noise_sd);
        let step = Signal::Step { size: 0.5, rest_share: 0.02, end: StepEnd::Back };
        let report = run(&mut process, &Excitation { listen_s: 20.0, ..excitation(step) });
        let Finding::Step(found) = report.finding else { panic!("{:?}", report.ending) };
        assert!((found.gain / gain - 1.0).abs() < 0.015, "{found:?}");
        assert!((80.0..400.0).contains(&found.settled_after_s), "{found:?}");
        let mv = &report.record.mv;
        assert_eq!((mv[0], mv[mv.len() - 2], mv[mv.len() - 1]), (2.0, 2.5, 2.0), "there and back");
    }
}

#[test]
fn a_step_that_stays_leaves_the_output_where_it_is() {
    let mut process = Process::new(fopdt(2.0, 20.0, 3.0), 0.2);
    let step = Signal::Step { size: -0.5, rest_share: 0.02, end: StepEnd::Stay };
    let report = run(&mut process, &excitation(step));
    assert_eq!((report.ending.clone(), report.record.mv.last()), (Ending::Finished, Some(&1.5)));
}

#[test]
fn a_doublet_returns_exactly_and_waits_for_rest() {
    let mut process = Process::new(fopdt(2.0, 20.0, 3.0), 0.2);
    let report = run(&mut process, &excitation(Signal::Doublet { amplitude: 0.5, hold_s: 30.0 }));
    assert_eq!(report.ending, Ending::Finished);
    let rows = |mv: f64| report.record.mv.iter().filter(|&&v| v == mv).count();
    assert_eq!((rows(2.5), rows(1.5)), (150, 150));
    assert_eq!(rows(2.0) + 300, report.record.mv.len(), "nothing but the three values");
    let last = report.record.pv[report.record.pv.len() - 1];
    assert!((last - PV_AT_REST).abs() < 0.03, "{last}");
}

#[test]
fn a_binary_sequence_is_sent_bit_by_bit() {
    let mut process = Process::new(fopdt(2.0, 20.0, 3.0), 0.2);
    let prbs = Signal::Prbs { amplitude: 0.3, clock_s: 2.0, register: 5, periods: 2 };
    let report = run(&mut process, &excitation(prbs));
    assert_eq!(report.ending, Ending::Finished);
    let first = report.record.mv.iter().position(|&mv| mv != MV_AT_REST).expect("moved");
    let signs = prbs_signs(5);
    for bit in 0..2 * signs.len() {
        for row in &report.record.mv[first + 10 * bit..first + 10 * bit + 10] {
            assert_eq!(*row, MV_AT_REST + 0.3 * signs[bit % signs.len()], "bit {bit}");
        }
    }
    assert_eq!(report.record.mv.len(), first + 10 * 2 * signs.len() + 1);
    let told = first_order(&identify_report(&report).expect("a model"));
    assert!((told.gain - 2.0).abs() < 1e-4 && (told.dead_time_s - 3.0).abs() < 1e-3, "{told:?}");
}

#[test]
fn stepped_sines_give_the_frequency_response() {
    let model = fopdt(2.0, 20.0, 3.0);
    let frequencies = vec![0.02, 0.1, 0.3, 1.0, 2.2];
    for noise_sd in [0.0, 0.02] {
        let mut process = Process::new(model, 0.1).noisy(noise_sd);
        let sine = SteppedSine { cycles: 5, ..SteppedSine::new(0.8, frequencies.clone()) };
        let report =
            run(&mut process, &Excitation { budget_s: 7200.0, ..excitation(Signal::SteppedSine(sine)) });
        let Finding::Frequencies(points) = &report.finding else { panic!("{:?}", report.ending) };
        assert_eq!(points.len(), frequencies.len());
        for point in points {
            let s = Complex64::new(0.0, point.omega_rad_s);
            let exact = 2.0 * (-3.0 * s).exp() / (20.0 * s + 1.0);
            let error = (point.response / exact - 1.0).norm();
            let samples = 5.0 * 2.0 * std::f64::consts::PI / (0.1 * point.omega_rad_s);
            let of_noise = 4.0 * noise_sd * (2.0 / samples).sqrt() / (0.8 * exact.norm());
            assert!(error < 0.01 + of_noise, "{point:?}: {error}");
        }
    }
}

#[test]
fn the_ultimate_gain_is_found_from_below_and_from_above() {
    let model = fopdt(2.0, 20.0, 3.0);
    let exact = ultimate(&ProcessModel::Fopdt(model)).expect("a limit");
    for (gain, start, noise_sd) in
        [(2.0, 0.5, 0.0), (2.0, 4.0, 0.0), (-2.0, 1.0, 0.0), (2.0, 7.0, 0.0), (2.0, 1.0, 0.005)]
    {
        let mut process = Process::new(fopdt(gain, 20.0, 3.0), 0.02).noisy(noise_sd);
        let test = Signal::UltimateGain(UltimateGain::new(start, 1.0));
        let report = run(&mut process, &Excitation { listen_s: 5.0, ..excitation(test) });
        let Finding::Ultimate(found) = report.finding else { panic!("{:?}", report.ending) };
        let ku = exact.ku * f64::signum(gain);
        assert!((found.ku / ku - 1.0).abs() < 0.03, "from {start}: {found:?}, exact {ku}");
        assert!((found.pu_s / exact.pu_s - 1.0).abs() < 0.03, "from {start}: {found:?}, {}", exact.pu_s);
    }
}

fn stopped(process: &mut Process, excitation: &Excitation) -> StopReason {
    let report = run(process, excitation);
    assert_eq!(report.record.mv.last(), Some(&MV_AT_REST), "put back");
    match report.ending {
        Ending::Stopped(reason) => reason,
        Ending::Finished => panic!("it should not finish"),
    }
}

#[test]
fn limits_and_time_end_it_and_the_output_is_put_back() {
    let step = Signal::Step { size: 1.0, rest_share: 0.02, end: StepEnd::Stay };
    let mut limited = excitation(step);
    limited.limits.pv_high = Some(13.0);
    let reason = stopped(&mut Process::new(fopdt(2.0, 20.0, 3.0), 0.2), &limited);
    assert!(matches!(reason, StopReason::PvLimit { pv, high: 13.0, .. } if pv > 13.0), "{reason}");
    let short = Excitation { budget_s: 30.0, ..excitation(Signal::Relay(relay(0.5, 0.1))) };
    let reason = stopped(&mut Process::new(fopdt(2.0, 20.0, 3.0), 0.2), &short);
    assert_eq!(reason, StopReason::Budget { budget_s: 30.0 });
}

#[test]
fn a_loop_that_moves_is_not_moved_further() {
    let mut process = Process::new(fopdt(2.0, 20.0, 3.0), 0.2);
    process.y = 2.0;
    let relay = Signal::Relay(relay(0.5, 0.1));
    let reason = stopped(&mut process, &excitation(relay.clone()));
    assert!(matches!(reason, StopReason::NotAtRest { moved, .. } if moved < -0.1), "{reason}");
    let mut process = Process::new(fopdt(2.0, 20.0, 3.0), 0.2);
    process.y = 0.1;
    let anyway = Excitation { at_rest: AtRest::NotNeeded, ..excitation(relay) };
    assert_eq!(run(&mut process, &anyway).ending, Ending::Finished);
}

#[test]
fn a_lost_pv_ends_it() {
    let test = excitation(Signal::Relay(relay(0.5, 0.1)));
    let mut run = ExcitationRun::start(&test, circumstances(0.2)).expect("begins");
    for k in 0..40 {
        run.step(0.2 * f64::from(k), PV_AT_REST, MV_AT_REST);
        run.applied(PV_AT_REST, MV_AT_REST);
    }
    assert_eq!(run.step(8.0, f64::NAN, 2.5), Drive::Leave);
    assert_eq!(run.ending(), Some(&Ending::Stopped(StopReason::PvLost)));
    assert_eq!(run.restore(), Restore { output: Some(MV_AT_REST), setpoint: None });
    assert!(run.into_report().record.pv.iter().all(|pv| pv.is_finite()));
}

#[test]
fn what_cannot_be_is_refused_with_its_numbers() {
    let begin = |signal: Signal, at: Circumstances| {
        ExcitationRun::start(&excitation(signal), at).map(|_| ()).expect_err("refused")
    };
    let high = Circumstances { mv: 4.8, ..circumstances(0.2) };
    let error = begin(Signal::Relay(relay(0.5, 0.1)), high);
    assert!(matches!(error, ExcitationError::Margin { to, high: 5.0, .. } if (to - 5.3).abs() < 1e-12));
    let lost = Circumstances { pv: Some(f64::NAN), ..circumstances(0.2) };
    assert!(matches!(begin(Signal::Relay(relay(0.5, 0.1)), lost), ExcitationError::NoPv { .. }));
    let outside = Circumstances { pv: Some(26.0), ..circumstances(0.2) };
    assert!(matches!(begin(Signal::Relay(relay(0.5, 0.1)), outside), ExcitationError::PvOutside { .. }));
    let over = Signal::SetpointStep { size: 20.0, rest_share: 0.02, end: StepEnd::Back };
    assert!(matches!(begin(over, circumstances(0.2)), ExcitationError::Setpoint { .. }));
    for signal in [
        Signal::Relay(relay(f64::NAN, 0.1)),
        Signal::Relay(relay(0.5, -0.1)),
        Signal::Relay(Relay { cycles: 1, ..relay(0.5, 0.1) }),
        Signal::Step { size: 0.0, rest_share: 0.02, end: StepEnd::Back },
        Signal::Doublet { amplitude: 0.1, hold_s: 0.1 },
        Signal::Prbs { amplitude: 0.1, clock_s: 1.0, register: 12, periods: 1 },
        Signal::SteppedSine(SteppedSine::new(0.1, vec![])),
        Signal::SteppedSine(SteppedSine::new(0.1, vec![0.1, 100.0])),
        Signal::UltimateGain(UltimateGain::new(-1.0, 0.1)),
    ] {
        let error = begin(signal, circumstances(0.2));
        assert!(matches!(error, ExcitationError::Value(RigError::Value { .. })), "{error}");
    }
}

#[test]
fn a_description_is_read_with_its_defaults_and_refuses_what_it_does_not_know() {
    let read = |text: &str| toml::from_str::<Excitation>(text);
    assert_eq!(
        read("signal = { relay = { amplitude = 0.2 } }"),
        Ok(Excitation::new(Signal::Relay(Relay::new(0.2))))
    );
    let given = read("signal = { relay = { amplitude = 0.2, hysteresis = { given = 0.1 } } }");
    assert_eq!(given, Ok(Excitation::new(Signal::Relay(relay(0.2, 0.1)))));
    for wrong in [
        "signal = { relay = { amplitude = 0.2, size = 1.0 } }",
        "signal = { step = { size = 0.2, amplitude = 1.0 } }",
        "signal = { relay = { amplitude = 0.2 } }\nbudget = 10.0",
        "signal = { wobble = { amplitude = 0.2 } }",
    ] {
        assert!(read(wrong).is_err(), "{wrong}");
    }
}

/// An asymmetric relay on a process much slower than its cycle gave 0.39 ± 0.01 for a gain of 6.49: the mean it averaged had
/// hardly begun to settle.
#[test]
fn a_mean_that_has_not_settled_tells_no_static_gain() {
    for (gain, t_s, dead_s, h, noise_sd) in [
        (6.49, 400.0, 2.0, 0.2, 0.0),
        (6.49, 400.0, 2.0, 0.2, 0.02),
        (6.49, 400.0, 2.0, 0.2, 0.1),
        (2.0, 60.0, 1.0, 0.1, 0.0),
        (2.0, 60.0, 1.0, 0.1, 0.01),
        (-3.0, 100.0, 4.0, 0.2, 0.02),
        (2.0, 10.0, 3.0, 0.1, 0.02),
    ] {
        let mut process = Process::new(fopdt(gain, t_s, dead_s), h).noisy(noise_sd);
        let asymmetric =
            Relay { amplitude_down: Some(0.3), hysteresis: Hysteresis::Noise(3.0), ..Relay::new(0.6) };
        let report = run(&mut process, &excitation(Signal::Relay(asymmetric)));
        let found = relay_finding(&report);
        if let (Some(value), Some(error)) = (found.static_gain, found.static_gain_error) {
            assert!((value - gain).abs() < 2.5 * error, "{value} ± {error} for {gain}, T = {t_s} s");
        } else {
            let said = report.warnings().iter().any(|w| matches!(w, ExcitationWarning::NoStaticGain { .. }));
            assert!(said, "nothing said of T = {t_s} s");
        }
    }
}

/// Without hysteresis the record of an integrating process was taken for a first order far off it.
#[test]
fn a_relay_without_hysteresis_tells_an_integrator() {
    for (noise_sd, dead_s) in [(0.0, 4.0), (0.002, 4.0), (0.01, 6.0)] {
        // 0.05 per second, with a lag no record can tell.
        let mut process = Process::new(fopdt(5000.0, 1e5, dead_s), 0.5).noisy(noise_sd);
        let test = Excitation { listen_s: 10.0, ..excitation(Signal::Relay(relay(0.5, 0.0))) };
        let report = run(&mut process, &test);
        let told = identify_report(&report).expect("a model");
        let exact = ultimate(&ProcessModel::Fopdt(process.model)).expect("a limit");
        let found = told.ultimate.expect("a limit");
        assert!((found.ku / exact.ku - 1.0).abs() < 0.1 && (found.pu_s / exact.pu_s - 1.0).abs() < 0.1);
        assert!(matches!(told.fit().model, ProcessModel::Ipdt(_)), "{:?}", told.fit().model);
    }
}

/// A relay ended early gave Ku and Pu of a poor fit with the wrong sign.
#[test]
fn a_relay_that_ended_early_tells_nothing_it_does_not_know() {
    for noise_sd in [0.1, 0.3, 0.6] {
        for budget_s in [5.0, 8.0, 12.0, 20.0] {
            let model = fopdt(2.0, 60.0, 3.0);
            let mut process = Process::new(model, 0.2).noisy(noise_sd);
            let test = Excitation { budget_s, ..excitation(Signal::Relay(relay(0.5, 0.3))) };
            let report = run(&mut process, &test);
            if report.ending == Ending::Finished || report.moved_at_s.is_none() {
                continue;
            }
            let Ok(told) = identify_report(&report) else { continue };
            assert!(told.has_model || told.ultimate.is_none());
            if let Some(found) = told.ultimate {
                assert!(found.ku > 0.0, "{found:?} from {:?}", told.fit().model);
            } else if !told.has_model {
                assert!(told.warnings.iter().any(|w| matches!(w, ExcitationWarning::NoModel { .. })));
            }
        }
    }
}

/// In noise that an oscillation between the output's limits cannot leave, the search for the ultimate gain went on until its
/// time was up, or found 8.6 for 6.6.
#[test]
fn an_ultimate_gain_in_noise_is_right_or_not_said() {
    let mut found = 0;
    for (model, noise_sd, start, kick) in [
        (fopdt(12.0, 150.0, 3.0), 0.1, 1.0, 0.2),
        (fopdt(12.0, 150.0, 3.0), 0.1, 4.0, 0.2),
        (fopdt(12.0, 150.0, 3.0), 0.03, 1.0, 0.2),
        (fopdt(12.0, 150.0, 3.0), 0.01, 1.0, 0.2),
        (fopdt(2.0, 30.0, 4.0), 0.03, 1.0, 0.5),
        (fopdt(2.0, 30.0, 4.0), 0.1, 1.0, 0.5),
        (fopdt(2.0, 30.0, 4.0), 0.01, 1.0, 0.5),
        (fopdt(2.0, 10.0, 5.0), 0.03, 0.3, 1.0),
    ] {
        let mut process = Process::new(model, 0.2).noisy(noise_sd);
        let report = run(&mut process, &excitation(Signal::UltimateGain(UltimateGain::new(start, kick))));
        let exact = ultimate(&ProcessModel::Fopdt(model)).expect("a limit");
        match (&report.ending, &report.finding) {
            (Ending::Stopped(StopReason::NoOscillation { .. }), _) => {}
            (Ending::Finished, Finding::Ultimate(told)) => {
                // A kick that the limits cut leaves a bracket a few tenths wide.
                assert!((told.ku / exact.ku - 1.0).abs() < 0.2, "{told:?} for {exact:?}, noise {noise_sd}");
                found += 1;
            }
            other => panic!("{other:?}"),
        }
    }
    assert!(found >= 3, "{found} were told");
}
