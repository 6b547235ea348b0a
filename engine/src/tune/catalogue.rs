//! The rules as data, in the order in which tables show them.

use super::ControllerKind::{self, P, Pd, Pi, Pid};
use super::formulas::{Settings, closed_loop, first_order, integrating, second_order};
use super::rule::{COHEN_COON, Check, Formula, Free, ISIMC_PID, SIMC, ZN_REACTION};
use super::shape::Shape;
use super::{Aim, Purpose, RatioRange, Rule};
use crate::model::Fopdt;

/// θ/τ of Ziegler and Nichols' reaction-curve rule (seed 004, after Ziegler and Nichols 1942).
const ZN_RANGE: Option<RatioRange> = Some(RatioRange { low: 0.1, high: 0.3 });
/// θ/τ of Cohen–Coon and of the ITAE rules (seed 003).
const SEED_003_RANGE: Option<RatioRange> = Some(RatioRange { low: 0.1, high: 1.0 });
/// Low θ/τ for Chien, Hrones and Reswick: seed 004 puts them beside Ziegler and Nichols, hence the same upper end.
const CHR_RANGE: Option<RatioRange> = Some(RatioRange { low: 0.0, high: 0.3 });

const P_PI_PID: &[ControllerKind] = &[P, Pi, Pid];
const PI_PID: &[ControllerKind] = &[Pi, Pid];

const ZN: &str = "Ziegler, Nichols, Optimum settings for automatic controllers, Trans. ASME 64, 1942";
const COHEN: &str = "Cohen, Coon, Theoretical consideration of retarded control, Trans. ASME 75, 1953";
const CHR: &str =
    "Chien, Hrones, Reswick, On the automatic control of generalized passive systems, Trans. ASME 74, 1952";
const SMITH: &str = "Smith, Corripio, Principles and Practice of Automatic Process Control, Wiley, 1985";
const AMIGO: &str = "Åström, Hägglund, Advanced PID Control, ISA, 2006";
const SEBORG: &str = "Seborg, Edgar, Mellichamp, Process Dynamics and Control, Wiley, 1989";
const RIVERA: &str = "Rivera, Morari, Skogestad, Internal model control 4: PID controller design, I&EC Process Des. Dev. 25, 1986";
const SKOGESTAD: &str = "Skogestad, Simple analytic rules for model reduction and PID controller tuning, J. Process Control 13, 2003";
const GRIMHOLT_PI: &str =
    "Grimholt, Skogestad, Optimal PI-control and verification of the SIMC tuning rule, IFAC PID'12, 2012";
const GRIMHOLT_PID: &str = "Grimholt, Skogestad, Optimal PI and PID control of first-order plus delay processes and evaluation of the original and improved SIMC rules, J. Process Control 70, 2018";
const RELAY: &str = "Åström, Hägglund, PID Controllers: Theory, Design, and Tuning, ISA, 1995";
const LUYBEN: &str = "Tyreus, Luyben, Tuning PI controllers for integrator/dead time processes, I&EC Research 31, 1992; PID: Luyben, I&EC Research 35, 1996";

/// Direct synthesis: a tenth of the dominant time constant (seed 000).
const DIRECT: Free =
    Free { default: |shape, _| shape.time_constant_s() / 10.0, check: Check::ThirdOfDeadTime };
/// Lambda: the dead time, but not under a third of the time constant.
const LAMBDA: Free = Free {
    default: |shape, _| shape.dead_time_s().max(shape.time_constant_s() / 3.0),
    check: Check::ThirdOfDeadTime,
};
/// IMC: the least λ of Rivera et al. 1986, table 1.
const IMC: Free = Free { default: least_lambda, check: Check::Default };
/// SIMC: the dead time, Skogestad's recommendation for fast and robust control.
const DEAD_TIME: Free = Free { default: |shape, _| shape.dead_time_s(), check: Check::None };

fn least_lambda(shape: &Shape, kind: ControllerKind) -> f64 {
    let dead_times = if kind == Pid { 0.8 } else { 1.7 };
    (dead_times * shape.dead_time_s()).max(0.2 * shape.time_constant_s())
}

/// A rule for first-order models that divides by the dead time; the others say where they differ.
const fn classic(
    id: &'static str,
    title_key: &'static str,
    source: &'static str,
    first_order: fn(&Fopdt, ControllerKind, f64) -> Option<Settings>,
) -> Rule {
    Rule {
        id,
        title_key,
        source,
        purpose: Purpose::Load,
        aim: Aim::QuarterDecay,
        controllers: P_PI_PID,
        range: None,
        needs_dead_time: true,
        free: None,
        formula: Formula::Model { first_order, integrating: None, second_order: None },
    }
}

/// A rule from Ku and Pu.
const fn from_limit(
    id: &'static str,
    title_key: &'static str,
    source: &'static str,
    formula: fn(super::Ultimate, ControllerKind) -> Option<Settings>,
) -> Rule {
    Rule {
        needs_dead_time: false,
        formula: Formula::Ultimate(formula),
        ..classic(id, title_key, source, |_, _, _| None)
    }
}

pub(super) static RULES: [Rule; 18] = [
    Rule {
        range: ZN_RANGE,
        formula: Formula::Model {
            first_order: first_order::zn_reaction,
            integrating: Some(integrating::zn_reaction),
            second_order: None,
        },
        ..classic(ZN_REACTION, "rules.zn_reaction", ZN, first_order::zn_reaction)
    },
    from_limit("zn_closed_loop", "rules.zn_closed_loop", ZN, closed_loop::zn_closed_loop),
    Rule {
        controllers: &[Pid],
        ..from_limit("relay_astrom", "rules.relay_astrom", RELAY, closed_loop::relay_astrom)
    },
    Rule {
        controllers: &[P, Pi, Pd, Pid],
        range: SEED_003_RANGE,
        ..classic(COHEN_COON, "rules.cohen_coon", COHEN, first_order::cohen_coon)
    },
    Rule {
        purpose: Purpose::Setpoint,
        aim: Aim::NoOvershoot,
        range: CHR_RANGE,
        ..classic("chr_setpoint_0", "rules.chr_setpoint_0", CHR, first_order::chr_setpoint_0)
    },
    Rule {
        purpose: Purpose::Setpoint,
        aim: Aim::Overshoot20,
        range: CHR_RANGE,
        ..classic("chr_setpoint_20", "rules.chr_setpoint_20", CHR, first_order::chr_setpoint_20)
    },
    Rule {
        purpose: Purpose::Load,
        aim: Aim::NoOvershoot,
        range: CHR_RANGE,
        ..classic("chr_load_0", "rules.chr_load_0", CHR, first_order::chr_load_0)
    },
    Rule {
        purpose: Purpose::Load,
        aim: Aim::Overshoot20,
        range: CHR_RANGE,
        ..classic("chr_load_20", "rules.chr_load_20", CHR, first_order::chr_load_20)
    },
    Rule {
        aim: Aim::LeastItae,
        range: SEED_003_RANGE,
        ..classic("itae_load", "rules.itae_load", SMITH, first_order::itae_load)
    },
    Rule {
        purpose: Purpose::Setpoint,
        aim: Aim::LeastItae,
        controllers: PI_PID,
        range: SEED_003_RANGE,
        ..classic("itae_setpoint", "rules.itae_setpoint", SMITH, first_order::itae_setpoint)
    },
    Rule {
        aim: Aim::Robustness,
        controllers: PI_PID,
        formula: Formula::Model {
            first_order: first_order::amigo,
            integrating: Some(integrating::amigo),
            second_order: None,
        },
        ..classic("amigo", "rules.amigo", AMIGO, first_order::amigo)
    },
    Rule {
        purpose: Purpose::Setpoint,
        aim: Aim::ChosenSpeed,
        controllers: PI_PID,
        needs_dead_time: false,
        free: Some(DIRECT),
        formula: Formula::Model {
            first_order: first_order::direct_synthesis,
            integrating: None,
            second_order: Some(second_order::direct_synthesis),
        },
        ..classic("direct_synthesis", "rules.direct_synthesis", SEBORG, first_order::direct_synthesis)
    },
    Rule {
        purpose: Purpose::Setpoint,
        aim: Aim::ChosenSpeed,
        controllers: PI_PID,
        needs_dead_time: false,
        free: Some(LAMBDA),
        formula: Formula::Model {
            first_order: first_order::direct_synthesis,
            integrating: Some(integrating::lambda),
            second_order: Some(second_order::direct_synthesis),
        },
        ..classic("lambda", "rules.lambda", SEBORG, first_order::direct_synthesis)
    },
    Rule {
        purpose: Purpose::Setpoint,
        aim: Aim::ChosenSpeed,
        controllers: PI_PID,
        needs_dead_time: false,
        free: Some(IMC),
        ..classic("imc", "rules.imc", RIVERA, first_order::imc)
    },
    Rule {
        purpose: Purpose::Both,
        aim: Aim::ChosenSpeed,
        controllers: PI_PID,
        needs_dead_time: false,
        free: Some(DEAD_TIME),
        formula: Formula::Model {
            first_order: first_order::simc,
            integrating: Some(integrating::simc),
            second_order: Some(second_order::simc),
        },
        ..classic(SIMC, "rules.simc", SKOGESTAD, first_order::simc)
    },
    Rule {
        purpose: Purpose::Both,
        aim: Aim::ChosenSpeed,
        controllers: &[Pi],
        needs_dead_time: false,
        free: Some(DEAD_TIME),
        formula: Formula::Model {
            first_order: first_order::isimc_pi,
            integrating: Some(integrating::simc),
            second_order: None,
        },
        ..classic("isimc_pi", "rules.isimc_pi", GRIMHOLT_PI, first_order::isimc_pi)
    },
    Rule {
        purpose: Purpose::Both,
        aim: Aim::ChosenSpeed,
        controllers: &[Pid],
        needs_dead_time: false,
        free: Some(DEAD_TIME),
        formula: Formula::Model {
            first_order: first_order::isimc_pid,
            integrating: Some(integrating::isimc_pid),
            second_order: None,
        },
        ..classic(ISIMC_PID, "rules.isimc_pid", GRIMHOLT_PID, first_order::isimc_pid)
    },
    Rule {
        aim: Aim::Robustness,
        controllers: PI_PID,
        ..from_limit("tyreus_luyben", "rules.tyreus_luyben", LUYBEN, closed_loop::tyreus_luyben)
    },
];
