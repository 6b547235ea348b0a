//! What comes with an optimum: the exact analysis of its loops, which the search has no part in.

use serde::Serialize;

use super::family::Family;
use super::gain_search::Candidate;
use super::problem::{LoopLimits, Objective};
use crate::analyze::{FrequencyResponseError, Peak, Peaks};
use crate::control::{FormGains, ParallelGains, PidGains};

/// Relative excess over a limit that counts as met: rounding of the analysis.
pub(super) const MET: f64 = 1e-9;
/// Relative distance to a limit within which it is called active.
const ACTIVE: f64 = 1e-4;

/// A limit of the problem.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "PascalCase")]
pub enum Limit {
    /// On Ms.
    Ms,
    /// On Mt.
    Mt,
    /// On Ju.
    Ju,
}

impl std::fmt::Display for Limit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Ms => "Ms",
            Self::Mt => "Mt",
            Self::Ju => "Ju",
        })
    }
}

/// Proof that comes with an optimum.
#[derive(Debug, Clone, PartialEq)]
pub struct Certificate {
    /// Peaks by the exact analysis, the largest of all processes each.
    pub peaks: Peaks,
    /// Limits that hold the optimum where it is.
    pub active: Vec<Limit>,
    /// How much better, relative, the same problem comes out on the points of frequency of the search alone: the true
    /// optimum lies between. `None` for an objective that is simulated.
    pub gap: Option<f64>,
    /// Largest relative excess over a limit, ≤ 1e-9.
    pub excess: f64,
    /// Rounds of search and check.
    pub rounds: usize,
}

/// The best gains.
#[derive(Debug, Clone, PartialEq)]
pub struct Optimum {
    /// Gains of the parallel form, with the process gain's sign; Kp = 0 for a pure integrator.
    pub gains: ParallelGains,
    /// The objective: Jv, Ki or IAE, of the worst process.
    pub value: f64,
    /// Proof.
    pub certificate: Certificate,
}

impl Optimum {
    /// The same gains in the ideal form; `None` for a pure integrator, which has none.
    #[must_use]
    pub fn ideal(&self) -> Option<PidGains> {
        FormGains::Parallel(self.gains).to_ideal().ok()
    }
}

/// Candidate under the exact analysis.
pub(super) struct Check {
    pub peaks: Peaks,
    /// Largest relative excess over a limit.
    pub excess: f64,
    /// Process, frequency and relative excess of every limit passed, and of a larger Jv than the search saw.
    pub passed: Vec<(usize, f64, f64)>,
    /// Processes whose loop is unstable.
    pub unstable: Vec<usize>,
}

impl Check {
    pub fn of(
        family: &Family<'_>,
        limits: &LoopLimits,
        objective: Objective,
        candidate: &Candidate,
    ) -> Result<Self, FrequencyResponseError> {
        let nothing = Peak { value: 0.0, omega_rad_s: 0.0 };
        let mut check = Self {
            peaks: Peaks { s: nothing, t: nothing, v: nothing, u: nothing },
            excess: 0.0,
            passed: Vec::new(),
            unstable: Vec::new(),
        };
        let gains = family.gains(candidate.lead, candidate.kp, candidate.ki);
        for plant in 0..family.plants.len() {
            let Some(peaks) = family.peaks(plant, &gains)? else {
                check.unstable.push(plant);
                continue;
            };
            check.take(plant, &peaks, limits, objective, candidate.value);
        }
        Ok(check)
    }

    fn take(&mut self, plant: usize, peaks: &Peaks, limits: &LoopLimits, objective: Objective, value: f64) {
        let with_limits = [(peaks.s, limits.ms), (peaks.t, limits.mt), (peaks.u, limits.ju)];
        for (peak, limit) in with_limits {
            let over = peak.value / limit - 1.0;
            self.excess = self.excess.max(over);
            if over > MET && peak.omega_rad_s > 0.0 && peak.omega_rad_s.is_finite() {
                self.passed.push((plant, peak.omega_rad_s, over));
            }
        }
        let hidden = peaks.v.value / value - 1.0;
        if objective == Objective::Jv && hidden > MET && peaks.v.omega_rad_s > 0.0 {
            self.passed.push((plant, peaks.v.omega_rad_s, hidden));
        }
        let worst = &mut self.peaks;
        for (own, of) in [
            (&mut worst.s, peaks.s),
            (&mut worst.t, peaks.t),
            (&mut worst.v, peaks.v),
            (&mut worst.u, peaks.u),
        ] {
            if of.value > own.value {
                *own = of;
            }
        }
    }

    /// Limits that the peaks touch.
    pub fn active(&self, limits: &LoopLimits) -> Vec<Limit> {
        let of = [
            (Limit::Ms, self.peaks.s.value, limits.ms),
            (Limit::Mt, self.peaks.t.value, limits.mt),
            (Limit::Ju, self.peaks.u.value, limits.ju),
        ];
        of.iter().filter(|(_, value, limit)| *value >= limit * (1.0 - ACTIVE)).map(|l| l.0).collect()
    }
}
