//! What came of a test: the record, what was measured in it, and the model it tells.

use num_complex::Complex64;

use super::progress::Envelope;
use super::spec::{Excitation, Signal};
use super::stop::StopReason;
use crate::explain::{Explain, number};
use crate::identify::{Choice, FitError, FitProblem, FitVerdict, ModelFit, Structure, choose_from_rest};
use crate::tune::{Ultimate, ultimate};

/// ε/a above which 4d/(πa) and its like are far from the ultimate point: at 0.3 the ultimate gain is 40 % low.
const WIDE_HYSTERESIS: f64 = 0.3;
/// Fit in percent below which the record of a test that ended early tells no model.
const TOLD_PERCENT: f64 = 70.0;

/// Columns of a test, one entry a sample. A row's setpoint and MV apply from its time until the next; its PV was
/// measured just before.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Record {
    /// Time in seconds of the run.
    pub time_s: Vec<f64>,
    /// PV in PV units.
    pub pv: Vec<f64>,
    /// Setpoint in PV units.
    pub setpoint: Vec<f64>,
    /// MV in MV units.
    pub mv: Vec<f64>,
}

impl Record {
    /// Empty, with room.
    pub(super) fn with_rows(rows: usize) -> Self {
        let column = || Vec::with_capacity(rows);
        Self { time_s: column(), pv: column(), setpoint: column(), mv: column() }
    }

    pub(super) fn push(&mut self, time_s: f64, pv: f64, setpoint: f64, mv: f64) {
        if self.time_s.len() < self.time_s.capacity() {
            self.time_s.push(time_s);
            self.pv.push(pv);
            self.setpoint.push(setpoint);
            self.mv.push(mv);
        }
    }
}

/// How a test ended.
#[derive(Debug, Clone, PartialEq)]
pub enum Ending {
    /// All was measured.
    Finished,
    /// Something ended it before.
    Stopped(StopReason),
}

/// Answer to a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepFinding {
    /// Change of MV or setpoint, in its units.
    pub size: f64,
    /// Change of the PV at rest in PV units.
    pub change: f64,
    /// Change of the PV by that of what was moved: K of the process, or 1 where a controller leaves no offset.
    pub gain: f64,
    /// Time from the step until the PV was at rest, in seconds.
    pub settled_after_s: f64,
}

/// Limit cycle of a relay, and the estimates of Åström and Hägglund from it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RelayFinding {
    /// Pu, period of the cycle in seconds.
    pub period_s: f64,
    /// ωu = 2π/Pu in rad/s.
    pub omega_rad_s: f64,
    /// a, half the distance of the PV's extremes in PV units.
    pub amplitude: f64,
    /// ε in PV units.
    pub hysteresis: f64,
    /// Cycles averaged.
    pub cycles: u32,
    /// 4d/(πa) with the sign of the gain, in MV units per PV unit.
    pub ku: f64,
    /// 4d/(π√(a² − ε²)) with the sign of the gain; absent for a ≤ ε.
    pub ku_hysteresis: Option<f64>,
    /// K = ∫(y − y0)/∫(u − u0) over whole cycles, of an asymmetric relay; absent where the mean
    /// output is lost in the noise, as with a process much slower than the cycle.
    pub static_gain: Option<f64>,
    /// Its standard error, as the cycles differ among each other.
    pub static_gain_error: Option<f64>,
}

impl RelayFinding {
    /// ε/a: how far the cycle is from the ultimate point, phase −180° + asin(ε/a).
    #[must_use]
    pub fn hysteresis_ratio(&self) -> f64 {
        self.hysteresis / self.amplitude
    }
}

/// Gain at which proportional control oscillates for ever.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UltimateFinding {
    /// Ku in MV units per PV unit, of the process gain's sign.
    pub ku: f64,
    /// Pu in seconds.
    pub pu_s: f64,
    /// Gains tried.
    pub gains: u32,
    /// Logarithm of the amplitude's change per cycle at the last gain.
    pub growth: f64,
}

/// A point of the frequency response.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrequencyPoint {
    /// ω in rad/s.
    pub omega_rad_s: f64,
    /// G(jω) in PV units per MV unit.
    pub response: Complex64,
}

/// What was measured, by the kind of signal.
#[derive(Debug, Clone, PartialEq)]
pub enum Finding {
    /// Nothing besides the record.
    Nothing,
    /// Of a step.
    Step(StepFinding),
    /// Of a relay.
    Relay(RelayFinding),
    /// Of a stepped sine, in the order of its frequencies.
    Frequencies(Vec<FrequencyPoint>),
    /// Of a test for the ultimate gain.
    Ultimate(UltimateFinding),
}

/// A finished or stopped test.
#[derive(Debug, Clone, PartialEq)]
pub struct ExcitationReport {
    /// Tag of its loop.
    pub tag: String,
    /// What was asked for.
    pub excitation: Excitation,
    /// What it kept to.
    pub envelope: Envelope,
    /// When it was asked for, in seconds of the run.
    pub start_s: f64,
    /// When it moved the loop first, in seconds of the run; absent when it ended before.
    pub moved_at_s: Option<f64>,
    /// How it ended.
    pub ending: Ending,
    /// Mean PV before the first move, in PV units; absent when it ended before.
    pub pv_at_rest: Option<f64>,
    /// Mean MV before the first move, in MV units.
    pub mv_at_rest: Option<f64>,
    /// σ of the noise in PV units, as for white noise.
    pub noise_sd: Option<f64>,
    /// sd(δ) in PV units, δ = y − ȳ with the mean ȳ of four samples.
    pub deviation_sd: Option<f64>,
    /// What was measured.
    pub finding: Finding,
    /// Every sample from when it was asked for until it ended.
    pub record: Record,
}

impl ExcitationReport {
    /// What has to be said about what was measured.
    #[must_use]
    pub fn warnings(&self) -> Vec<ExcitationWarning> {
        let mut warnings = Vec::new();
        if let Finding::Relay(relay) = &self.finding
            && relay.hysteresis_ratio() > WIDE_HYSTERESIS
        {
            let amplitude = self.amplitude_for(relay);
            warnings.push(ExcitationWarning::WideHysteresis { ratio: relay.hysteresis_ratio(), amplitude });
        }
        if let (Signal::Relay(asked), Finding::Relay(relay)) = (&self.excitation.signal, &self.finding)
            && asked.down() != asked.amplitude
            && relay.static_gain.is_none()
        {
            warnings.push(ExcitationWarning::NoStaticGain { cycles: relay.cycles });
        }
        if let (Signal::SteppedSine(sine), Finding::Frequencies(points)) =
            (&self.excitation.signal, &self.finding)
            && points.len() < sine.frequencies_rad_s.len()
        {
            let wanted = sine.frequencies_rad_s.len();
            warnings.push(ExcitationWarning::MissingFrequencies { found: points.len(), wanted });
        }
        warnings
    }
}

impl ExcitationReport {
    /// Amplitude in MV units at which the hysteresis would be narrow: beyond ε the PV goes in proportion to it.
    fn amplitude_for(&self, relay: &RelayFinding) -> f64 {
        let Signal::Relay(asked) = &self.excitation.signal else { return f64::NAN };
        let wanted = relay.hysteresis * (1.0 / WIDE_HYSTERESIS - 1.0);
        asked.amplitude * wanted / (relay.amplitude - relay.hysteresis).max(f64::MIN_POSITIVE)
    }

    /// Sign of the PV's first answer over that of the move it answers, as a relay sees it: where the PV was when the
    /// output moved for the second time. `None` where noise hides it.
    fn first_answer(&self) -> Option<f64> {
        /// Standard deviations of the noise that chance does not reach in a few rows.
        const SURE: f64 = 3.0;
        let (rest_pv, rest_mv) = self.pv_at_rest.zip(self.mv_at_rest)?;
        let first = self.record.time_s.iter().position(|t| Some(*t) >= self.moved_at_s)?;
        let moved = self.record.mv[first] - rest_mv;
        let answer = match self.excitation.signal {
            Signal::Relay(_) => {
                let second = (first + 1..self.record.mv.len())
                    .find(|&k| self.record.mv[k] != self.record.mv[k - 1])?;
                self.record.pv[second] - rest_pv
            }
            _ => return None,
        };
        let beyond = answer.abs() > SURE * self.noise_sd.unwrap_or(0.0);
        (beyond && moved != 0.0).then(|| (answer * moved).signum())
    }
}

/// A remark on what was measured.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ExcitationWarning {
    /// The relay's hysteresis is wide against its cycle.
    #[error(
        "ε/a = {}: above 0.3 the cycle is far from the ultimate point; take an amplitude of about {} or less hysteresis, and the model rather than 4d/(πa)",
        number(*.ratio), number(*.amplitude)
    )]
    WideHysteresis {
        /// ε/a.
        ratio: f64,
        /// Amplitude at which it would be 0.3, in MV units.
        amplitude: f64,
    },
    /// The mean PV of an asymmetric relay does not tell the static gain.
    #[error(
        "no static gain: over {cycles} cycles the mean PV had not settled, or noise hides it; the process is much slower than the cycle, and a step tells its gain"
    )]
    NoStaticGain {
        /// Cycles averaged.
        cycles: u32,
    },
    /// A test that ended early recorded too little for a model.
    #[error(
        "no model: the test ended before it was finished, and a first order explains {} % of what was recorded",
        number(*.fit_percent)
    )]
    NoModel {
        /// Fit in percent.
        fit_percent: f64,
    },
    /// The fitted model turns the other way than the first pulse did.
    #[error(
        "the model of the record has the gain {}, but the first pulse found the other sign: the answer is too small for the noise, or periodic; take a larger amplitude or more hysteresis",
        number(*.gain)
    )]
    OtherSign {
        /// K of the model in PV units per MV unit.
        gain: f64,
    },
    /// Frequencies without an answer.
    #[error("{found} of {wanted} frequencies were measured")]
    MissingFrequencies {
        /// Measured.
        found: usize,
        /// Asked for.
        wanted: usize,
    },
}

impl Explain for ExcitationWarning {
    fn key(&self) -> &'static str {
        match self {
            Self::WideHysteresis { .. } => "excitation_warning.wide_hysteresis",
            Self::NoStaticGain { .. } => "excitation_warning.no_static_gain",
            Self::NoModel { .. } => "excitation_warning.no_model",
            Self::OtherSign { .. } => "excitation_warning.other_sign",
            Self::MissingFrequencies { .. } => "excitation_warning.missing_frequencies",
        }
    }

    fn args(&self) -> Vec<(&'static str, String)> {
        match self {
            Self::WideHysteresis { ratio, amplitude } => {
                vec![("ratio", number(*ratio)), ("amplitude", number(*amplitude))]
            }
            Self::NoStaticGain { cycles } => vec![("cycles", cycles.to_string())],
            Self::NoModel { fit_percent } => vec![("fit_percent", number(*fit_percent))],
            Self::OtherSign { gain } => vec![("gain", number(*gain))],
            Self::MissingFrequencies { found, wanted } => {
                vec![("found", found.to_string()), ("wanted", wanted.to_string())]
            }
        }
    }
}

impl ExcitationWarning {
    /// One of each kind, for the test that compares them with the translation files.
    #[must_use]
    pub fn samples() -> Vec<Self> {
        vec![
            Self::WideHysteresis { ratio: 0.42, amplitude: 0.51 },
            Self::NoStaticGain { cycles: 3 },
            Self::NoModel { fit_percent: 24.0 },
            Self::OtherSign { gain: -0.25 },
            Self::MissingFrequencies { found: 3, wanted: 5 },
        ]
    }
}

/// The model that a record tells.
#[derive(Debug, Clone, PartialEq)]
pub struct Identified {
    /// First order or integrator with dead time, whichever the record speaks for, best first.
    pub choice: Choice,
    /// Whether that model may be used: not where the test ended early and the record says too little.
    pub has_model: bool,
    /// Ku and Pu of that model; absent where no proportional gain brings it to its limit, where its gain has the wrong
    /// sign, and without a model.
    pub ultimate: Option<Ultimate>,
    /// What has to be said about it besides the verdicts of the fit.
    pub warnings: Vec<ExcitationWarning>,
}

impl Identified {
    /// The fit chosen.
    #[must_use]
    pub fn fit(&self) -> &ModelFit {
        self.choice.chosen()
    }
}

/// Fits a first order and an integrator with dead time to the record of a test by output error.
///
/// # Errors
/// [`FitError`] of the record.
pub fn identify_report(report: &ExcitationReport) -> Result<Identified, FitError> {
    let Record { time_s, pv, mv, .. } = &report.record;
    let problem = FitProblem::new(time_s, pv, mv);
    let mut choice = choose_from_rest(&problem, &[Structure::Fopdt, Structure::Ipdt]).0?;
    if let Some(noise_sd) = report.noise_sd {
        choice.weigh_noise(noise_sd);
    }
    let fit = choice.chosen();
    let found = match &report.finding {
        Finding::Relay(relay) => Some(relay.ku),
        Finding::Ultimate(found) => Some(found.ku),
        _ => report.first_answer(),
    };
    let gain = fit.parameters[0].value;
    let turned = found.is_some_and(|ku| ku * gain < 0.0);
    let finished = report.ending == Ending::Finished;
    let known = |v: &FitVerdict| !v.is_objection() || matches!(v, FitVerdict::Noisy { .. });
    let explains = fit.fit_percent > TOLD_PERCENT || fit.verdicts.iter().all(known);
    let useless = !finished && (turned || !fit.is_usable() || !explains);
    let mut warnings = Vec::new();
    if turned {
        warnings.push(ExcitationWarning::OtherSign { gain });
    }
    if useless {
        warnings.push(ExcitationWarning::NoModel { fit_percent: fit.fit_percent });
    }
    let told = !(useless || turned);
    let ultimate = told.then(|| ultimate(&fit.model)).flatten();
    Ok(Identified { ultimate, has_model: !useless, warnings, choice })
}
