//! What is asked of an optimum: processes, controller, objective, limits.

use serde::{Deserialize, Serialize};

use super::error::OptimumError;
use crate::analyze::{
    Analysis, FrequencyResponse, FrequencyResponseError, OpenLoop, analyze_loop, analyze_measured,
};
use crate::control::{ParallelGains, PidGains};
use crate::model::ProcessModel;

/// A process as the optimum sees it.
#[derive(Debug, Clone, PartialEq)]
pub enum Process {
    /// A model, known at every frequency.
    Model(ProcessModel),
    /// A frequency response measured point by point.
    Measured(FrequencyResponse),
}

impl Process {
    /// What gains of the parallel form are worth on it.
    ///
    /// # Errors
    /// [`FrequencyResponseError`] for a measured response that ends too early to tell.
    pub fn analyze(&self, gains: &ParallelGains) -> Result<Analysis, FrequencyResponseError> {
        match self {
            Self::Model(model) => Ok(analyze_loop(&OpenLoop::of_parallel(model, gains))),
            Self::Measured(response) => analyze_measured(response, gains),
        }
    }
}

impl From<ProcessModel> for Process {
    fn from(model: ProcessModel) -> Self {
        Self::Model(model)
    }
}

/// What is to be made best.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Objective {
    /// Least Jv = ‖G S/s‖∞, in PV units times seconds per MV unit (Kristiansson and Lennartson 2006).
    #[default]
    Jv,
    /// Largest Ki (Åström, Panagopoulos and Hägglund 1998, MIGO).
    MaxKi,
    /// Least IAE of a load step at the process input.
    IaeLoad,
    /// Least IAE of a setpoint step with b = 1 and c = 0.
    IaeSetpoint,
}

impl Objective {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Jv, Self::MaxKi, Self::IaeLoad, Self::IaeSetpoint];

    /// Name on the command line and in JSON.
    #[must_use]
    pub fn id(self) -> &'static str {
        match self {
            Self::Jv => "jv",
            Self::MaxKi => "max-ki",
            Self::IaeLoad => "iae-load",
            Self::IaeSetpoint => "iae-setpoint",
        }
    }

    /// The objective of this name.
    #[must_use]
    pub fn from_id(id: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|o| o.id() == id)
    }
}

/// Limits of robustness and of control activity; ∞ where none is set.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LoopLimits {
    /// Largest Ms = ‖S‖∞; > 1. Over 8 it is taken as 8: beyond, a loop is all but unstable.
    pub ms: f64,
    /// Largest Mt = ‖T‖∞; ≥ 1. At 1 it is met to within 1e-9.
    pub mt: f64,
    /// Largest Ju = ‖C S‖∞ in MV units per PV unit; > 0.
    pub ju: f64,
}

impl LoopLimits {
    /// Ms = 1.4, the customary compromise, without limits on Mt and Ju.
    pub const DEFAULT: Self = Self { ms: 1.4, mt: f64::INFINITY, ju: f64::INFINITY };

    /// Checks Ms > 1, Mt ≥ 1, Ju > 0, and that one of them is a limit at all.
    ///
    /// # Errors
    /// [`OptimumError`] with the offending value.
    pub fn validated(self) -> Result<Self, OptimumError> {
        let Self { ms, mt, ju } = self;
        if ms.is_nan() || ms <= 1.0 {
            return Err(OptimumError::Ms { value: ms });
        }
        if mt.is_nan() || mt < 1.0 {
            return Err(OptimumError::Mt { value: mt });
        }
        if ju.is_nan() || ju <= 0.0 {
            return Err(OptimumError::Ju { value: ju });
        }
        let none = ms.is_infinite() && mt.is_infinite() && ju.is_infinite();
        if none { Err(OptimumError::NoLimit) } else { Ok(self) }
    }

    /// Limits of Kristiansson and Lennartson's GMs = max(Ms, α Mt) ≤ C1 with α = C1/Mt's own limit, and Ju ≤ C2.
    #[must_use]
    pub fn generalised(c1: f64, alpha: f64, c2: f64) -> Self {
        Self { ms: c1, mt: c1 / alpha, ju: c2 }
    }
}

/// What becomes of the derivative's filter, whose time constant is Td/N.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DerivativeFilter {
    /// N as given.
    Ratio(f64),
    /// N between 1 and 100, whatever serves the objective best.
    Free,
}

/// Which controller is sought.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Wanted {
    /// Proportional and integral action.
    Pi,
    /// All three actions with their filter.
    Pid(DerivativeFilter),
}

impl Wanted {
    /// A PID controller whose filter is free where Ju is limited, and at the customary N = 10 where nothing holds it.
    #[must_use]
    pub fn pid(limits: &LoopLimits) -> Self {
        let filter = if limits.ju.is_finite() {
            DerivativeFilter::Free
        } else {
            DerivativeFilter::Ratio(PidGains::DEFAULT_N)
        };
        Self::Pid(filter)
    }
}

/// The whole question.
#[derive(Debug, Clone, Copy)]
pub struct OptimumProblem<'a> {
    /// One process, or several of which the worst counts: operating points, draws from a model's uncertainty.
    pub processes: &'a [Process],
    /// Controller.
    pub wanted: Wanted,
    /// Objective.
    pub objective: Objective,
    /// Limits.
    pub limits: LoopLimits,
}
