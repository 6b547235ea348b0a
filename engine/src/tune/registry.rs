//! Finding rules and applying all of them.

use super::catalogue::RULES;
use super::{ControllerKind, Rule, RuleError, RuleOptions, Tuning};
use crate::model::ProcessModel;

/// All rules, in the order in which tables show them.
#[must_use]
pub fn registry() -> &'static [Rule] {
    &RULES
}

/// The rule with this id; `isimc` stands for `isimc_pi` or `isimc_pid`, as the controller asks.
#[must_use]
pub fn find_rule(id: &str, kind: ControllerKind) -> Option<&'static Rule> {
    let id = match (id, kind) {
        ("isimc", ControllerKind::Pid) => "isimc_pid",
        ("isimc", _) => "isimc_pi",
        _ => id,
    };
    RULES.iter().find(|rule| rule.id == id)
}

/// Every rule with every controller it gives, applied to a model; what fails says why.
#[must_use]
pub fn tune_all(
    model: &ProcessModel,
    options: &RuleOptions,
) -> Vec<(&'static Rule, ControllerKind, Result<Tuning, RuleError>)> {
    let applied = RULES.iter().flat_map(|rule| {
        rule.controllers.iter().map(move |kind| (rule, *kind, rule.tune(model, *kind, options)))
    });
    applied.collect()
}
