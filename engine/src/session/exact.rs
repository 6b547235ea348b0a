//! Commands as files spell them, exact to the field: what is not asked for is refused, not ignored.

use std::collections::BTreeMap;

use serde::de::Error;
use serde::{Deserialize, Deserializer};

use crate::control::{PidGains, PidTuning};
use crate::plant::{Fault, FaultKind};

/// [`PidTuning`] without room for other fields.
#[derive(Deserialize)]
#[serde(remote = "PidTuning", deny_unknown_fields)]
pub(super) struct ExactTuning {
    #[serde(with = "ExactGains")]
    gains: PidGains,
    b: f64,
    c: f64,
}

/// [`PidGains`] without room for other fields.
#[derive(Deserialize)]
#[serde(remote = "PidGains", deny_unknown_fields)]
struct ExactGains {
    kc: f64,
    ti_s: f64,
    td_s: f64,
    n: f64,
}

/// A tag with a fault beside it, and every size a fault can have.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FaultFields {
    tag: String,
    kind: FaultKind,
    rate_cm_s: Option<f64>,
    height_cm: Option<f64>,
    every_s: Option<f64>,
    share: Option<f64>,
    k_cm2_5_s: Option<f64>,
}

impl FaultFields {
    /// The fault, where exactly its sizes are given.
    fn fault(&self) -> Result<Fault, String> {
        let sizes = [
            ("rate_cm_s", self.rate_cm_s),
            ("height_cm", self.height_cm),
            ("every_s", self.every_s),
            ("share", self.share),
            ("k_cm2_5_s", self.k_cm2_5_s),
        ];
        let mut given: BTreeMap<_, _> = sizes.into_iter().filter_map(|(n, v)| Some((n, v?))).collect();
        let mut missing = Vec::new();
        let mut take = |name| {
            given.remove(name).unwrap_or_else(|| {
                missing.push(name);
                0.0
            })
        };
        let fault = match self.kind {
            FaultKind::Stuck => Fault::Stuck,
            FaultKind::Drift => Fault::Drift { rate_cm_s: take("rate_cm_s") },
            FaultKind::BrokenWire => Fault::BrokenWire,
            FaultKind::Spikes => Fault::Spikes { height_cm: take("height_cm"), every_s: take("every_s") },
            FaultKind::Clogged => Fault::Clogged { share: take("share") },
            FaultKind::Leak => Fault::Leak { k_cm2_5_s: take("k_cm2_5_s") },
            FaultKind::WeakPump => Fault::WeakPump { share: take("share") },
            FaultKind::DryPump => Fault::DryPump,
            FaultKind::PowerCut => Fault::PowerCut,
        };
        let kind = self.kind.key();
        let beyond: Vec<&str> = given.into_keys().collect();
        if !missing.is_empty() {
            Err(format!("the fault {kind} needs {}", missing.join(" and ")))
        } else if !beyond.is_empty() {
            Err(format!("the fault {kind} has no {}", beyond.join(" and no ")))
        } else {
            Ok(fault)
        }
    }
}

/// The fields of [`super::RigCommand::Fault`].
pub(super) fn fault<'de, D: Deserializer<'de>>(from: D) -> Result<(String, Fault), D::Error> {
    let fields = FaultFields::deserialize(from)?;
    let fault = fields.fault().map_err(D::Error::custom)?;
    Ok((fields.tag, fault))
}
