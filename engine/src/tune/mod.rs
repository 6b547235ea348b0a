//! Tuning rules: from a process model to gains, each rule as data with its formula, source and range of validity.
//!
//! [`registry`] lists the rules, [`Rule::tune`] applies one, [`ultimate`] gives the gain and period that closed-loop
//! rules start from, exactly; [`optimum`] finds the best gains under limits, [`setpoint_side`] weights for a wanted
//! overshoot. All gains are for the ideal (ISA) form; K in PV units per MV unit, seconds. A model of
//! negative gain gets a negative Kc. Nothing non-finite is returned: it is a [`RuleError`].

mod catalogue;
mod detune;
mod error;
mod formulas;
mod kind;
pub mod optimum;
mod registry;
mod rule;
mod setpoint_side;
mod shape;
mod spread;
mod ultimate;
mod warning;

pub use detune::detuned;
pub use error::RuleError;
pub use kind::ControllerKind;
pub use registry::{find_rule, registry, tune_all};
pub use rule::{Aim, Purpose, RatioRange, Rule, RuleOptions, Tuning};
pub use setpoint_side::{SetpointSide, setpoint_side};
pub use spread::{Quantiles, RobustnessSpread, TuningSpread, robustness_spread, tuning_spread};
pub use ultimate::{Ultimate, ultimate};
pub use warning::RuleWarning;
