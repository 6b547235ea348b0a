//! A first-order model over the time stamps and the MV of a record.

use super::FitError;
use super::gram::Linear;
use super::problem::{FitProblem, Stretch};
use super::response::{Dynamics, residuals};
use crate::model::Fopdt;

/// Free run of a FOPDT over a record, exact for an MV held from stamp to stamp.
///
/// T ẏ = −y + bias + K u(t − L), u = `mv_before` ahead of the first row.
///
/// `time_s` (s, not decreasing) and `mv` (MV units) have N rows; `bias` is the PV that an MV of 0 settles at;
/// `initial_pv` is the PV of the first row, absent: at rest with `mv_before`. Gives N values in PV units.
///
/// # Errors
/// [`FitError::LengthMismatch`], [`FitError::NotFinite`], [`FitError::TimeBackwards`], [`FitError::NoTimeSpan`],
/// [`FitError::TooFewSamples`] below two rows.
pub fn simulate_fopdt(
    model: &Fopdt,
    time_s: &[f64],
    mv: &[f64],
    mv_before: f64,
    bias: f64,
    initial_pv: Option<f64>,
) -> Result<Vec<f64>, FitError> {
    if time_s.len() < 2 {
        return Err(FitError::TooFewSamples { rows: time_s.len(), needed: 2 });
    }
    let zeros = vec![0.0; time_s.len()];
    let problem = FitProblem::new(time_s, &zeros, mv);
    problem.check_columns()?;
    let mut stretch = Stretch::new(time_s.into(), mv.into(), zeros.as_slice().into(), mv_before, true);
    stretch.segments.truncate(1);
    let rest = bias + model.gain * mv_before;
    let linear = Linear {
        bias: bias + model.gain * stretch.u_ref,
        gain: model.gain,
        free: vec![initial_pv.map_or(0.0, |pv| pv - rest)],
    };
    let dynamics = Dynamics { time_constant_s: model.time_constant_s, dead_time_s: model.dead_time_s };
    let mut pv = Vec::with_capacity(time_s.len());
    residuals(&stretch, dynamics, &linear, |_, r| pv.extend(r.iter().map(|r| -r)));
    Ok(pv)
}
