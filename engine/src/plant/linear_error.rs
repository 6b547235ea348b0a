//! Why a rig has no linear model at a point.

use crate::explain::{Explain, number};
use crate::model::StateSpaceError;

/// What stands in the way of a linearisation.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LinearError {
    /// The plain root at zero head.
    #[error("{valve} has no linear model at a head of {} cm: the flow rises without bound there; give delta_cm > 0 or another level", number(*.head_cm))]
    NoSlope {
        /// Tag of the valve.
        valve: String,
        /// Head in cm.
        head_cm: f64,
    },
    /// A characteristic with an infinite slope.
    #[error("the flow of {valve} has no slope with its angle at {}°: its exponent is below 1", number(*.angle_deg))]
    NoAngle {
        /// Tag of the valve.
        valve: String,
        /// Angle in degrees.
        angle_deg: f64,
    },
    /// A pump that draws from one state at once and feeds another later.
    #[error("{pump} draws from a tank at once and delivers {} s later: an input with two delays has no model with one dead time an input; leave that tank out of the outputs, or give the rig water_cm3 and a reservoir", number(*.delay_s))]
    TwoDelays {
        /// Tag of the pump.
        pump: String,
        /// Delay of the delivery in seconds.
        delay_s: f64,
    },
    /// Numbers beyond what a matrix can hold.
    #[error(transparent)]
    StateSpace(#[from] StateSpaceError),
}

impl Explain for LinearError {
    fn key(&self) -> &'static str {
        match self {
            Self::NoSlope { .. } => "linear.no_slope",
            Self::NoAngle { .. } => "linear.no_angle",
            Self::TwoDelays { .. } => "linear.two_delays",
            Self::StateSpace(error) => error.key(),
        }
    }

    fn args(&self) -> Vec<(&'static str, String)> {
        match self {
            Self::NoSlope { valve, head_cm } => {
                vec![("valve", valve.clone()), ("head_cm", number(*head_cm))]
            }
            Self::NoAngle { valve, angle_deg } => {
                vec![("valve", valve.clone()), ("angle_deg", number(*angle_deg))]
            }
            Self::TwoDelays { pump, delay_s } => vec![("pump", pump.clone()), ("delay_s", number(*delay_s))],
            Self::StateSpace(error) => error.args(),
        }
    }
}

impl LinearError {
    /// One of each kind of its own, for the test that compares them with the translation files.
    #[must_use]
    pub fn samples() -> Vec<Self> {
        let text = |t: &str| t.to_owned();
        vec![
            Self::NoSlope { valve: text("FV02"), head_cm: 0.0 },
            Self::NoAngle { valve: text("FV01"), angle_deg: 0.0 },
            Self::TwoDelays { pump: text("BA01"), delay_s: 1.7 },
        ]
    }
}
