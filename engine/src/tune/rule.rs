//! What a rule is, and how it turns a model into gains.

use serde::{Deserialize, Serialize};

use super::formulas::Settings;
use super::formulas::text::formula_text;
use super::shape::{Shape, half_rule};
use super::{ControllerKind, RuleError, RuleWarning, Ultimate, ultimate};
use crate::control::PidGains;
use crate::model::{Fopdt, Ipdt, ProcessModel, Sopdt};

/// What a rule was made to answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Purpose {
    /// Changes of the setpoint.
    Setpoint,
    /// Loads.
    Load,
    /// Both, as a compromise.
    Both,
}

/// What a rule's authors aimed at.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Aim {
    /// Each swing a quarter of the one before.
    QuarterDecay,
    /// The fastest response without overshoot.
    NoOvershoot,
    /// The fastest response with 20 % overshoot.
    Overshoot20,
    /// The least integral of time times absolute error.
    LeastItae,
    /// The most integral gain at a given robustness.
    Robustness,
    /// A first-order closed loop with a chosen time constant.
    ChosenSpeed,
}

/// θ/τ for which a rule was made, ends included.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RatioRange {
    /// Least θ/τ.
    pub low: f64,
    /// Largest θ/τ.
    pub high: f64,
}

/// What the user may set beside the model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RuleOptions {
    /// τc or λ in seconds; `None` takes the rule's default.
    pub tau_c_s: Option<f64>,
    /// Ku and Pu from a test; `None` computes them from the model.
    pub ultimate: Option<Ultimate>,
    /// N of the derivative filter Td/N.
    pub n: f64,
}

impl Default for RuleOptions {
    fn default() -> Self {
        Self { tau_c_s: None, ultimate: None, n: PidGains::DEFAULT_N }
    }
}

/// What a rule gives.
#[derive(Debug, Clone, PartialEq)]
pub struct Tuning {
    /// Gains of the ideal form.
    pub gains: PidGains,
    /// τc or λ in use, in seconds; `None` for a rule without one.
    pub tau_c_s: Option<f64>,
    /// Ku and Pu in use; `None` for a rule from the model's parameters.
    pub ultimate: Option<Ultimate>,
    /// Remarks, those that limit the validity among them.
    pub warnings: Vec<RuleWarning>,
}

impl Tuning {
    /// Whether the rule was used inside its range.
    #[must_use]
    pub fn valid(&self) -> bool {
        !self.warnings.iter().any(RuleWarning::limits_validity)
    }
}

/// A tuning rule: data about it, and its formula.
#[derive(Debug)]
pub struct Rule {
    /// Name on the command line and in JSON.
    pub id: &'static str,
    /// Key of its title in the translation files.
    pub title_key: &'static str,
    /// Where it was published.
    pub source: &'static str,
    /// What it was made to answer.
    pub purpose: Purpose,
    /// What its authors aimed at.
    pub aim: Aim,
    /// Controllers it gives, for at least one structure of model.
    pub controllers: &'static [ControllerKind],
    /// θ/τ it was made for, where its authors say.
    pub range: Option<RatioRange>,
    /// Whether the formula divides by the dead time.
    pub needs_dead_time: bool,
    pub(super) free: Option<Free>,
    pub(super) formula: Formula,
}

/// A free time constant: its default and the least value for which the rule still holds, in seconds.
#[derive(Debug)]
pub(super) struct Free {
    pub default: fn(&Shape, ControllerKind) -> f64,
    pub check: Check,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Check {
    /// Any positive value.
    None,
    /// The share of the dead time under which Ms is past 2, see [`least_robust_s`].
    Robust,
    /// The default is the least (Rivera et al. 1986).
    Default,
}

type FirstOrderFormula = fn(&Fopdt, ControllerKind, f64) -> Option<Settings>;
type IntegratingFormula = fn(&Ipdt, ControllerKind, f64) -> Option<Settings>;
type SecondOrderFormula = fn(&Sopdt, ControllerKind, f64) -> Option<Settings>;

#[derive(Debug)]
pub(super) enum Formula {
    Model {
        first_order: FirstOrderFormula,
        integrating: Option<IntegratingFormula>,
        second_order: Option<SecondOrderFormula>,
    },
    Ultimate(fn(Ultimate, ControllerKind) -> Option<Settings>),
}

/// Ids of the rules with a remark of their own.
pub(super) const ZN_REACTION: &str = "zn_reaction";
pub(super) const COHEN_COON: &str = "cohen_coon";
pub(super) const ISIMC_PID: &str = "isimc_pid";
pub(super) const SIMC: &str = "simc";

impl Rule {
    /// The formula for a first-order model, or from Ku and Pu, as it is printed, with a = τ/(K·θ), r = θ/τ and λ for τc; `None`
    /// where the rule gives such a controller for second-order models only, or not at all.
    #[must_use]
    pub fn formula_text(&self, kind: ControllerKind) -> Option<&'static str> {
        formula_text(self.id, kind)
    }

    /// Whether the user may choose τc or λ.
    #[must_use]
    pub fn has_free_time_constant(&self) -> bool {
        self.free.is_some()
    }

    /// Whether the rule starts from Ku and Pu instead of the model's parameters.
    #[must_use]
    pub fn is_closed_loop(&self) -> bool {
        matches!(self.formula, Formula::Ultimate(_))
    }

    /// Gains of the ideal form for a model, in MV units per PV unit and seconds.
    ///
    /// Second-order models are reduced by the half rule where the rule has no formula of its own for them; transfer
    /// functions of first and second order are recognised. Rules from Ku and Pu take any model.
    ///
    /// # Errors
    /// [`RuleError`] when the rule has no such controller, the model is not of its kind, or a number is unusable.
    pub fn tune(
        &self,
        model: &ProcessModel,
        kind: ControllerKind,
        options: &RuleOptions,
    ) -> Result<Tuning, RuleError> {
        if !self.controllers.contains(&kind) {
            return Err(RuleError::NoSuchController { rule: self.id, controller: kind });
        }
        match &self.formula {
            Formula::Ultimate(formula) => {
                let at = match options.ultimate {
                    Some(given) => given.validated()?,
                    None => ultimate(model).ok_or(RuleError::NoUltimate)?,
                };
                let settings = formula(at, kind).ok_or_else(|| self.no_such(kind))?;
                let gains = gains_of(settings, options.n)?;
                Ok(Tuning { gains, tau_c_s: None, ultimate: Some(at), warnings: Vec::new() })
            }
            Formula::Model { first_order, integrating, second_order } => {
                let mut warnings = Vec::new();
                let mut shape = Shape::of(model, &mut warnings).map_err(|error| error.with_way_on(model))?;
                if matches!(shape, Shape::Integrating(_)) && integrating.is_none() {
                    return Err(RuleError::NotForIntegrating { rule: self.id });
                }
                if let Shape::SecondOrder(m) = shape
                    && second_order.is_none_or(|f| f(&m, kind, 1.0).is_none())
                {
                    let reduced = half_rule(&m);
                    warnings.push(RuleWarning::HalfRule {
                        time_constant_s: reduced.time_constant_s,
                        dead_time_s: reduced.dead_time_s,
                    });
                    shape = Shape::FirstOrder(reduced);
                }
                let tau_c = self.time_constant(&shape, kind, options, &mut warnings)?;
                let free = tau_c.unwrap_or_default();
                let settings = match shape {
                    Shape::FirstOrder(m) => first_order(&m, kind, free).ok_or({
                        if second_order.is_some() {
                            RuleError::NeedsSecondOrder { rule: self.id, controller: kind }
                        } else {
                            self.no_such(kind)
                        }
                    })?,
                    Shape::Integrating(m) => {
                        let formula = integrating.ok_or(RuleError::NotForIntegrating { rule: self.id })?;
                        formula(&m, kind, free).ok_or_else(|| self.no_such(kind))?
                    }
                    Shape::SecondOrder(m) => {
                        second_order.and_then(|f| f(&m, kind, free)).ok_or_else(|| self.no_such(kind))?
                    }
                };
                let ratio = shape.ratio().unwrap_or_default();
                let td_usable = settings.td_s >= 0.0 && settings.td_s.is_finite();
                if !(settings.ti_s > 0.0 && td_usable) {
                    return Err(RuleError::OutsideFormula { rule: self.id, ratio });
                }
                self.remark(&shape, settings, &mut warnings);
                Ok(Tuning { gains: gains_of(settings, options.n)?, tau_c_s: tau_c, ultimate: None, warnings })
            }
        }
    }

    fn no_such(&self, controller: ControllerKind) -> RuleError {
        RuleError::NoSuchController { rule: self.id, controller }
    }

    /// τc in use, after the checks that concern it and the dead time.
    fn time_constant(
        &self,
        shape: &Shape,
        kind: ControllerKind,
        options: &RuleOptions,
        warnings: &mut Vec<RuleWarning>,
    ) -> Result<Option<f64>, RuleError> {
        let theta = shape.dead_time_s();
        let Some(free) = &self.free else {
            let missing = self.needs_dead_time && theta == 0.0;
            return if missing { Err(RuleError::NeedsDeadTime { rule: self.id }) } else { Ok(None) };
        };
        let default = (free.default)(shape, kind);
        let tau_c_s = match options.tau_c_s {
            Some(value) if value > 0.0 && value.is_finite() => value,
            Some(value) => return Err(RuleError::TauC { value }),
            None if default > 0.0 => default,
            None => return Err(RuleError::NeedsDeadTimeOrTauC { rule: self.id }),
        };
        match free.check {
            Check::Robust if tau_c_s < least_robust_s(shape) => {
                warnings.push(RuleWarning::LittleRobust { tau_c_s, least_s: least_robust_s(shape) });
            }
            Check::Default if tau_c_s < default => {
                warnings.push(RuleWarning::LambdaTooShort { tau_c_s, least_s: default });
            }
            Check::None | Check::Robust | Check::Default => {}
        }
        Ok(Some(tau_c_s))
    }

    fn remark(&self, shape: &Shape, settings: Settings, warnings: &mut Vec<RuleWarning>) {
        if let (Some(range), Some(ratio)) = (self.range, shape.ratio())
            && !(range.low..=range.high).contains(&ratio)
        {
            warnings.push(RuleWarning::RatioOutside { ratio, range });
        }
        match (self.id, shape) {
            (ZN_REACTION, Shape::Integrating(_)) => warnings.push(RuleWarning::Integrating),
            (COHEN_COON, _) => {
                warnings.push(RuleWarning::CohenCoonSources { ratio: shape.ratio().unwrap_or_default() });
            }
            (ISIMC_PID | SIMC, _) if settings.td_s > 0.0 => warnings.push(RuleWarning::FromSeries),
            _ => {}
        }
    }
}

/// Least τc or λ of direct synthesis and lambda tuning that leaves a robust loop, in seconds.
///
/// With the lag cancelled L = e^(−θs)/((τc + θ)s): θ/3 is direct synthesis' default at θ/τ = 0.3, the limit of spec
/// tune.md, where Ms = 2.129. Lambda tuning of an integrator has Ms = 2 at λ = 1.92 θ by our own analysis.
fn least_robust_s(shape: &Shape) -> f64 {
    match shape {
        Shape::FirstOrder(m) => m.dead_time_s / 3.0,
        Shape::SecondOrder(m) => m.dead_time_s / 3.0,
        Shape::Integrating(m) => 1.92 * m.dead_time_s,
    }
}

fn gains_of(settings: Settings, n: f64) -> Result<PidGains, RuleError> {
    let Settings { kc, ti_s, td_s } = settings;
    Ok(PidGains { kc, ti_s, td_s, n }.validated()?)
}
