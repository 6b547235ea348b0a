//! The formulas, one file per structure they are written for.
//!
//! Notation of the sources: K (or Kv), τ, θ, r = θ/τ; all results for the ideal form. A formula returns `None` for a
//! kind of controller that its authors do not give.

pub(super) mod closed_loop;
pub(super) mod first_order;
pub(super) mod integrating;
pub(super) mod second_order;
pub(super) mod text;

/// Kc in MV units per PV unit, Ti and Td in seconds; Ti = ∞ without integral, Td = 0 without derivative action.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Settings {
    pub kc: f64,
    pub ti_s: f64,
    pub td_s: f64,
}

impl Settings {
    pub(super) fn p(kc: f64) -> Option<Self> {
        Some(Self { kc, ti_s: f64::INFINITY, td_s: 0.0 })
    }

    pub(super) fn pi(kc: f64, ti_s: f64) -> Option<Self> {
        Some(Self { kc, ti_s, td_s: 0.0 })
    }

    pub(super) fn pd(kc: f64, td_s: f64) -> Option<Self> {
        Some(Self { kc, ti_s: f64::INFINITY, td_s })
    }

    pub(super) fn pid(kc: f64, ti_s: f64, td_s: f64) -> Option<Self> {
        Some(Self { kc, ti_s, td_s })
    }

    /// From the series form Kc′ (1 + 1/(Ti′ s))(1 + Td′ s): with f = 1 + Td′/Ti′, Kc = Kc′ f, Ti = Ti′ f, Td = Td′/f.
    ///
    /// Exact for the unfiltered controllers; the derivative filter is the ideal form's Td/N.
    pub(super) fn from_series(kc: f64, ti_s: f64, td_s: f64) -> Option<Self> {
        let factor = 1.0 + td_s / ti_s;
        Self::pid(kc * factor, ti_s * factor, td_s / factor)
    }
}
