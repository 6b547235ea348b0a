//! Tests of the running loop: which signal, how far it may go, how far it is, what it measured.

use std::sync::Arc;

use eframe::egui::{self, RichText};
use vasos_engine::document::{DocumentCommand, SourceChoice};
use vasos_engine::excitation::{
    AtRest, Ending, Excitation, ExcitationLimits, ExcitationReport, Finding, Relay, Signal, StepEnd,
    SteppedSine, UltimateGain,
};
use vasos_engine::explain::Explain;
use vasos_engine::session::RigCommand;
use vasos_engine::tune::Ultimate;

use crate::action::Action;
use crate::panes::View;
use crate::{i18n, text, theme, tr};

/// Kinds of test.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Step,
    SetpointStep,
    Relay,
    AsymmetricRelay,
    Doublet,
    Prbs,
    SteppedSine,
    UltimateGain,
}

impl Kind {
    const ALL: [Self; 8] = [
        Self::Step,
        Self::SetpointStep,
        Self::Relay,
        Self::AsymmetricRelay,
        Self::Doublet,
        Self::Prbs,
        Self::SteppedSine,
        Self::UltimateGain,
    ];

    fn name(self) -> String {
        match self {
            Self::Step => tr!("test.step"),
            Self::SetpointStep => tr!("test.setpoint_step"),
            Self::Relay => tr!("test.relay"),
            Self::AsymmetricRelay => tr!("test.asymmetric_relay"),
            Self::Doublet => tr!("test.doublet"),
            Self::Prbs => tr!("test.prbs"),
            Self::SteppedSine => tr!("test.stepped_sine"),
            Self::UltimateGain => tr!("test.ultimate_gain"),
        }
    }

    fn hint(self) -> String {
        match self {
            Self::Step => tr!("test.step_hint"),
            Self::SetpointStep => tr!("test.setpoint_step_hint"),
            Self::Relay => tr!("test.relay_hint"),
            Self::AsymmetricRelay => tr!("test.asymmetric_relay_hint"),
            Self::Doublet => tr!("test.doublet_hint"),
            Self::Prbs => tr!("test.prbs_hint"),
            Self::SteppedSine => tr!("test.stepped_sine_hint"),
            Self::UltimateGain => tr!("test.ultimate_gain_hint"),
        }
    }
}

/// Settings of the next test, and the report of the last.
pub struct Bench {
    kind: Kind,
    /// Move of the MV in MV units.
    size: f64,
    /// Move down of an asymmetric relay in MV units.
    down: f64,
    /// Move of the setpoint in cm.
    setpoint_cm: f64,
    /// Length of half a doublet or a bit in seconds.
    hold_s: f64,
    /// Lowest and highest frequency of the sines in rad/s.
    frequencies_rad_s: [f64; 2],
    /// First gain of the search in MV units per cm.
    start_gain: f64,
    stay: bool,
    at_rest: bool,
    pv_limits_cm: Option<[f64; 2]>,
    /// Report of the last test.
    pub report: Option<Arc<ExcitationReport>>,
}

impl Default for Bench {
    fn default() -> Self {
        Self {
            kind: Kind::Step,
            size: 0.3,
            down: 0.15,
            setpoint_cm: 2.0,
            hold_s: 60.0,
            frequencies_rad_s: [0.02, 0.5],
            start_gain: 2.0,
            stay: false,
            at_rest: true,
            pv_limits_cm: None,
            report: None,
        }
    }
}

impl Bench {
    fn excitation(&self) -> Excitation {
        /// Sines of a frequency response.
        const POINTS: u32 = 8;
        let end = if self.stay { StepEnd::Stay } else { StepEnd::Back };
        let rest_share = 0.02;
        let signal = match self.kind {
            Kind::Step => Signal::Step { size: self.size, rest_share, end },
            Kind::SetpointStep => Signal::SetpointStep { size: self.setpoint_cm, rest_share, end },
            Kind::Relay => Signal::Relay(Relay::new(self.size)),
            Kind::AsymmetricRelay => {
                Signal::Relay(Relay { amplitude_down: Some(self.down), ..Relay::new(self.size) })
            }
            Kind::Doublet => Signal::Doublet { amplitude: self.size, hold_s: self.hold_s },
            Kind::Prbs => {
                Signal::Prbs { amplitude: self.size, clock_s: self.hold_s, register: 6, periods: 1 }
            }
            Kind::SteppedSine => {
                let [low, high] = self.frequencies_rad_s;
                let step = (high / low).ln() / f64::from(POINTS - 1);
                let frequencies = (0..POINTS).map(|k| low * (f64::from(k) * step).exp()).collect();
                Signal::SteppedSine(SteppedSine::new(self.size, frequencies))
            }
            Kind::UltimateGain => Signal::UltimateGain(UltimateGain::new(self.start_gain, self.size)),
        };
        let [pv_low, pv_high] = self.pv_limits_cm.map_or([None, None], |limits| limits.map(Some));
        Excitation {
            limits: ExcitationLimits { pv_low, pv_high, ..ExcitationLimits::default() },
            at_rest: if self.at_rest { AtRest::Required } else { AtRest::NotNeeded },
            ..Excitation::new(signal)
        }
    }
}

/// Draws the tests of the loop in view; nothing for a log.
pub fn ui(ui: &mut egui::Ui, view: &View, bench: &mut Bench, actions: &mut Vec<Action>) {
    let is_log = view.document.source == SourceChoice::Log && view.document.log.is_some();
    let Some(active) = view.snapshot.loops.get(view.focus).filter(|_| !is_log) else { return };
    if let Some(now) = &view.snapshot.excitation {
        running(ui, now, actions);
        return;
    }
    let unit = view.snapshot.network.spec.pumps[active.pump].unit.symbol().to_owned();
    egui::CollapsingHeader::new(tr!("test.title", tag = active.tag)).id_salt("tests").show(ui, |ui| {
        settings(ui, bench, &unit);
        ui.horizontal_wrapped(|ui| {
            let p = theme::palette(ui);
            let start = egui::Button::new(RichText::new(tr!("test.start")).color(p.on_accent)).fill(p.accent);
            if ui.add(start).on_hover_text(tr!("test.start_hint")).clicked() {
                let excitation = Box::new(bench.excitation());
                actions.push(Action::Rig(RigCommand::Excite { tag: active.tag.clone(), excitation }));
            }
        });
        if let Some(report) = &bench.report {
            result(ui, report, &unit, actions);
        }
    });
}

fn running(ui: &mut egui::Ui, now: &vasos_engine::sim::ExcitationNow, actions: &mut Vec<Action>) {
    let p = theme::palette(ui);
    let phase = tr!(&format!("excitation.phase.{}", now.progress.phase.key()));
    let cycle = match (now.progress.cycle, now.progress.of) {
        (0, _) => String::new(),
        (n, Some(of)) => format!(" {n}/{of}"),
        (n, None) => format!(" {n}"),
    };
    ui.horizontal_wrapped(|ui| {
        ui.spinner();
        ui.label(tr!("test.running", tag = now.tag, phase = phase) + &cycle);
        if ui.button(tr!("test.abort")).on_hover_text(tr!("test.abort_hint")).clicked() {
            actions.push(Action::Rig(RigCommand::AbortExcitation { tag: now.tag.clone() }));
        }
    });
    let limits = tr!(
        "test.limits",
        pv_low = text::brief(now.envelope.pv.low),
        pv_high = text::brief(now.envelope.pv.high),
        mv_low = text::brief(now.envelope.mv.low),
        mv_high = text::brief(now.envelope.mv.high),
        elapsed = text::clock(now.progress.elapsed_s),
        budget = text::clock(now.progress.budget_s),
    );
    ui.add(egui::Label::new(RichText::new(limits).color(p.weak).size(theme::SMALL)).wrap());
}

fn settings(ui: &mut egui::Ui, bench: &mut Bench, unit: &str) {
    let drag = |ui: &mut egui::Ui, name: &str, value: &mut f64, suffix: &str| {
        let label = ui.label(name);
        ui.add(egui::DragValue::new(value).speed(0.02).max_decimals(4).suffix(format!(" {suffix}")))
            .labelled_by(label.id);
    };
    ui.horizontal_wrapped(|ui| {
        let label = ui.label(tr!("test.kind"));
        egui::ComboBox::from_id_salt("test kind")
            .selected_text(bench.kind.name())
            .show_ui(ui, |ui| {
                for kind in Kind::ALL {
                    ui.selectable_value(&mut bench.kind, kind, kind.name()).on_hover_text(kind.hint());
                }
            })
            .response
            .labelled_by(label.id)
            .on_hover_text(bench.kind.hint());
    });
    ui.horizontal_wrapped(|ui| match bench.kind {
        Kind::Step => {
            drag(ui, &tr!("test.size"), &mut bench.size, unit);
            ui.checkbox(&mut bench.stay, tr!("test.stay"));
        }
        Kind::SetpointStep => {
            drag(ui, &tr!("test.size"), &mut bench.setpoint_cm, "cm");
            ui.checkbox(&mut bench.stay, tr!("test.stay"));
        }
        Kind::Relay => drag(ui, &tr!("test.amplitude"), &mut bench.size, unit),
        Kind::AsymmetricRelay => {
            drag(ui, &tr!("test.up"), &mut bench.size, unit);
            drag(ui, &tr!("test.down"), &mut bench.down, unit);
        }
        Kind::Doublet | Kind::Prbs => {
            drag(ui, &tr!("test.amplitude"), &mut bench.size, unit);
            let hold = if bench.kind == Kind::Prbs { tr!("test.clock") } else { tr!("test.hold") };
            drag(ui, &hold, &mut bench.hold_s, "s");
        }
        Kind::SteppedSine => {
            drag(ui, &tr!("test.amplitude"), &mut bench.size, unit);
            drag(ui, &tr!("test.from"), &mut bench.frequencies_rad_s[0], "rad/s");
            drag(ui, &tr!("test.to"), &mut bench.frequencies_rad_s[1], "rad/s");
        }
        Kind::UltimateGain => {
            drag(ui, &tr!("test.start_gain"), &mut bench.start_gain, &format!("{unit}/cm"));
            drag(ui, &tr!("test.kick"), &mut bench.size, unit);
        }
    });
    ui.horizontal_wrapped(|ui| {
        ui.checkbox(&mut bench.at_rest, tr!("test.at_rest")).on_hover_text(tr!("test.at_rest_hint"));
        let mut limited = bench.pv_limits_cm.is_some();
        ui.checkbox(&mut limited, tr!("test.pv_limits")).on_hover_text(tr!("test.pv_limits_hint"));
        let mut limits = bench.pv_limits_cm.unwrap_or([5.0, 25.0]);
        if limited {
            for value in &mut limits {
                ui.add(egui::DragValue::new(value).speed(0.1).suffix(" cm"));
            }
        }
        bench.pv_limits_cm = limited.then_some(limits);
    });
}

/// What the last test measured.
fn result(ui: &mut egui::Ui, report: &ExcitationReport, unit: &str, actions: &mut Vec<Action>) {
    let p = theme::palette(ui);
    let mut say = |words: String, colour| {
        ui.add(egui::Label::new(RichText::new(words).color(colour)).wrap());
    };
    if let Ending::Stopped(reason) = &report.ending {
        say(
            format!("! {}", tr!("event.excitation_stopped", tag = report.tag, reason = i18n::say(reason))),
            p.caution,
        );
    }
    let n = text::brief;
    match &report.finding {
        Finding::Nothing => {}
        Finding::Step(step) => {
            say(tr!("test.found_step", gain = n(step.gain), settled = n(step.settled_after_s)), p.text);
        }
        Finding::Relay(relay) => {
            let ku = format!("{} {unit}/cm", n(relay.ku));
            let words = tr!(
                "test.found_relay",
                period = n(relay.period_s),
                amplitude = n(relay.amplitude),
                ratio = n(relay.hysteresis_ratio()),
                ku = ku,
            );
            say(words, p.text);
            if let (Some(gain), Some(error)) = (relay.static_gain, relay.static_gain_error) {
                say(tr!("test.found_static", gain = n(gain), error = text::rough(error)), p.text);
            }
        }
        Finding::Ultimate(found) => {
            let ku = format!("{} {unit}/cm", n(found.ku));
            say(tr!("test.found_ultimate", ku = ku, period = n(found.pu_s)), p.text);
        }
        Finding::Frequencies(points) => {
            for point in points {
                let words = tr!(
                    "test.found_frequency",
                    omega = n(point.omega_rad_s),
                    gain = n(point.response.norm()),
                    phase = text::fixed(point.response.arg().to_degrees(), 1),
                );
                say(words, p.text);
            }
        }
    }
    for warning in report.warnings() {
        let words: &dyn Explain = &warning;
        say(format!("! {}", i18n::say(words)), p.caution);
    }
    let measured = match &report.finding {
        Finding::Relay(relay) => Some(Ultimate { ku: relay.ku, pu_s: relay.period_s }),
        Finding::Ultimate(found) => Some(Ultimate { ku: found.ku, pu_s: found.pu_s }),
        _ => None,
    };
    if let Some(measured) = measured
        && ui.button(tr!("test.use_ultimate")).on_hover_text(tr!("test.use_ultimate_hint")).clicked()
    {
        actions.push(Action::Document(DocumentCommand::Ultimate(Some(measured))));
    }
}
