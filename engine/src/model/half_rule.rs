//! Skogestad's half rule: a transfer function as a low-order model with dead time, by hand arithmetic.

use super::reduce_error::ReduceError;
use super::{Fopdt, Ipdt, ProcessModel, Sopdt, ZeroPoleGain};

/// Number of lags a reduced model keeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReducedOrder {
    /// One lag, or the integrator alone: FOPDT or IPDT.
    First,
    /// Two lags, or the integrator and one lag.
    Second,
}

/// Rounds of the dead time, which the rules for zeros need to be known.
const MOST_ROUNDS: usize = 50;
/// A smaller lag takes a zero where it is this close and closer than the larger one.
const CLOSE: f64 = 1.6;
/// Imaginary part, as a share of the modulus, under which a pair counts as two equal lags: the roots of a polynomial are
/// no better than that where several are equal.
const EQUAL: f64 = 1e-3;
/// Dead times that a zero's lag is compared with.
const DEAD_TIMES: f64 = 5.0;

/// The low-order model of a process with real poles and zeros.
///
/// For `k Π(−Tinv s + 1)/Π(τᵢ s + 1) e^(−L s)`, lags falling: first order `T = τ₁ + τ₂/2`, dead time
/// `θ = L + τ₂/2 + Σ_{i≥3} τᵢ + Σ Tinv`; second order keeps τ₁ and `T₂ = τ₂ + τ₃/2`, `θ = L + τ₃/2 + Σ_{i≥4} τᵢ + Σ Tinv`.
/// A zero `T₀ s + 1` with T₀ > 0 is first cancelled against the neighbouring lag by his rules T1 to T3, the largest
/// first, which changes k; θ in those rules is the final one, found by rounds. With an integrator the lag that is
/// neglected first gives its half to the dead time as well. A model of second order without a second lag is one of
/// first order.
///
/// # Errors
/// [`ReduceError`] for complex or unstable poles, several integrators, no gain, or no lag.
///
/// Source: Skogestad, J. Process Control 13 (2003) 291, sections 2 and 3, eqs. (10) to (14).
pub fn half_rule(process: &ZeroPoleGain, order: ReducedOrder) -> Result<ProcessModel, ReduceError> {
    let parts = Parts::of(process)?;
    let mut theta_s = parts.dead_time_s;
    let mut reduced = parts.without_zeros(theta_s);
    for _ in 0..MOST_ROUNDS {
        let next_s = reduced.dead_time_s(&parts, order);
        if (next_s - theta_s).abs() <= 1e-12 * next_s {
            break;
        }
        theta_s = next_s;
        reduced = parts.without_zeros(theta_s);
    }
    reduced.model(&parts, order)
}

struct Parts {
    gain: f64,
    integrates: bool,
    /// Falling, in seconds.
    lags_s: Vec<f64>,
    /// T₀ of zeros in the left half-plane, falling, in seconds.
    leads_s: Vec<f64>,
    /// L and the zeros in the right half-plane.
    dead_time_s: f64,
}

struct Reduced {
    gain: f64,
    lags_s: Vec<f64>,
}

impl Parts {
    fn of(process: &ZeroPoleGain) -> Result<Self, ReduceError> {
        for (what, roots) in [("pole", &process.poles), ("zero", &process.zeros)] {
            if let Some(root) = roots.iter().find(|r| r.im > EQUAL * r.norm()) {
                return Err(ReduceError::Complex { what, re: root.re, im: root.im });
            }
        }
        if let Some(pole) = process.poles.iter().find(|p| p.re > 0.0) {
            return Err(ReduceError::Unstable { pole: pole.re });
        }
        let integrators = process.poles.iter().filter(|p| p.re == 0.0).count();
        if integrators > 1 {
            return Err(ReduceError::Integrators { integrators });
        }
        if process.gain == 0.0 || process.zeros.iter().any(|z| z.re == 0.0) {
            return Err(ReduceError::NoGain);
        }
        let times = |roots: &[num_complex::Complex64]| {
            let mut times: Vec<f64> = roots.iter().filter(|r| r.re != 0.0).map(|r| -1.0 / r.re).collect();
            times.sort_by(|a, b| b.total_cmp(a));
            times
        };
        let (lags_s, zeros_s) = (times(&process.poles), times(&process.zeros));
        // s − r = −r (1 − s/r), and a real root's −r is 1/T.
        let gain = process.gain * lags_s.iter().product::<f64>() / zeros_s.iter().product::<f64>();
        let inverse: f64 = zeros_s.iter().filter(|t| **t < 0.0).sum();
        Ok(Self {
            gain,
            integrates: integrators == 1,
            lags_s,
            leads_s: zeros_s.into_iter().filter(|t| *t > 0.0).collect(),
            dead_time_s: process.dead_time_s - inverse,
        })
    }

    /// Cancels the zeros in the left half-plane, for an effective dead time in seconds.
    fn without_zeros(&self, theta_s: f64) -> Reduced {
        let mut reduced = Reduced { gain: self.gain, lags_s: self.lags_s.clone() };
        for &lead in &self.leads_s {
            reduced.cancel(lead, theta_s);
        }
        reduced
    }
}

impl Reduced {
    /// (T₀ s + 1)/(τ₀ s + 1) by the rules T1, T1a, T1b, T2 and T3.
    fn cancel(&mut self, lead: f64, theta: f64) {
        let larger = self.lags_s.iter().rposition(|lag| *lag >= lead);
        let smaller = self.lags_s.iter().position(|lag| *lag < lead);
        let closer = |large: usize, small: usize| {
            let ratio = lead / self.lags_s[small];
            ratio < self.lags_s[large] / lead && ratio < CLOSE * (1.0 - 1e-9)
        };
        let chosen = match (larger, smaller) {
            (Some(l), Some(s)) => Some(if closer(l, s) { s } else { l }),
            (l, s) => l.or(s),
        };
        let Some(chosen) = chosen else { return };
        let lag = self.lags_s.remove(chosen);
        if lead >= lag {
            self.gain *= if lag >= theta {
                lead / lag
            } else if lead >= theta {
                lead / theta
            } else {
                1.0
            };
        } else if lead >= DEAD_TIMES * theta {
            self.gain *= lead / lag;
        } else {
            let kept = lag.min(DEAD_TIMES * theta);
            self.gain *= kept / lag;
            if kept > lead {
                self.lags_s.push(kept - lead);
                self.lags_s.sort_by(|a, b| b.total_cmp(a));
            }
        }
    }

    /// Lags kept, among them half of the first that is not.
    fn kept(parts: &Parts, order: ReducedOrder) -> usize {
        let lags = if order == ReducedOrder::First { 1 } else { 2 };
        lags - usize::from(parts.integrates)
    }

    fn dead_time_s(&self, parts: &Parts, order: ReducedOrder) -> f64 {
        let neglected = self.lags_s.iter().skip(Self::kept(parts, order));
        let lags: f64 = neglected.enumerate().map(|(i, lag)| if i == 0 { 0.5 * lag } else { *lag }).sum();
        parts.dead_time_s + lags
    }

    fn model(self, parts: &Parts, order: ReducedOrder) -> Result<ProcessModel, ReduceError> {
        let kept = Self::kept(parts, order);
        let dead_time_s = self.dead_time_s(parts, order);
        let mut lags: Vec<f64> = self.lags_s.iter().take(kept).copied().collect();
        if let (Some(last), Some(next)) = (lags.last_mut(), self.lags_s.get(kept)) {
            *last += 0.5 * next;
        }
        let gain = self.gain;
        Ok(match (parts.integrates, lags.as_slice()) {
            (true, []) => ProcessModel::Ipdt(Ipdt { velocity_gain: gain, dead_time_s }),
            (true, &[lag, ..]) => ProcessModel::Rational(super::TransferFunction {
                num: vec![gain],
                den: vec![lag, 1.0, 0.0],
                dead_time_s,
            }),
            (false, []) => return Err(ReduceError::NoLag),
            (false, &[time_constant_s]) => ProcessModel::Fopdt(Fopdt { gain, time_constant_s, dead_time_s }),
            (false, &[first, second, ..]) => ProcessModel::Sopdt(Sopdt {
                gain,
                time_constant_1_s: first.max(second),
                time_constant_2_s: first.min(second),
                zero_time_constant_s: 0.0,
                dead_time_s,
            }),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::TransferFunction;

    /// Π(T s + 1) of the leads over that of the lags, in seconds.
    fn reduced(leads_s: &[f64], lags_s: &[f64], order: ReducedOrder) -> ProcessModel {
        let roots =
            |times: &[f64]| times.iter().map(|t| num_complex::Complex64::new(-1.0 / t, 0.0)).collect();
        let gain = leads_s.iter().product::<f64>() / lags_s.iter().product::<f64>();
        let process = ZeroPoleGain { zeros: roots(leads_s), poles: roots(lags_s), gain, dead_time_s: 0.0 };
        half_rule(&process, order).expect("reducible")
    }

    fn near(model: &ProcessModel, gain: f64, lags: &[f64], dead_time_s: f64) {
        let (k, found): (f64, Vec<f64>) = match model {
            ProcessModel::Fopdt(m) => (m.gain, vec![m.time_constant_s]),
            ProcessModel::Sopdt(m) => (m.gain, vec![m.time_constant_1_s, m.time_constant_2_s]),
            other => panic!("{other:?}"),
        };
        assert_eq!(found.len(), lags.len(), "{model:?}");
        let pairs = std::iter::once((k, gain)).chain(found.into_iter().zip(lags.iter().copied()));
        for (ours, expected) in pairs.chain([(model.dead_time_s(), dead_time_s)]) {
            assert!((ours - expected).abs() < 1e-9 * (1.0 + expected), "{model:?}: {ours} for {expected}");
        }
    }

    /// Skogestad (2003), Example E1: 1/((s + 1)(0.2 s + 1)) gives T 1.1, θ 0.1.
    #[test]
    fn val_skogestad_e1() {
        near(&reduced(&[], &[1.0, 0.2], ReducedOrder::First), 1.0, &[1.1], 0.1);
        near(&reduced(&[], &[1.0, 0.2], ReducedOrder::Second), 1.0, &[1.0, 0.2], 0.0);
    }

    /// Skogestad (2003), Example E2: (−0.3 s + 1)(0.08 s + 1)/((2 s + 1)(s + 1)(0.4 s + 1)(0.2 s + 1)(0.05 s + 1)³)
    /// gives θ 1.47, T 2.5 and θ 0.77, T 2, 1.2.
    #[test]
    fn val_skogestad_e2() {
        let leads = [-0.3, 0.08];
        let lags = [2.0, 1.0, 0.4, 0.2, 0.05, 0.05, 0.05];
        near(&reduced(&leads, &lags, ReducedOrder::First), 1.0, &[2.5], 1.47);
        near(&reduced(&leads, &lags, ReducedOrder::Second), 1.0, &[2.0, 1.2], 0.77);
    }

    #[test]
    fn equal_lags_out_of_a_polynomial_are_lags() {
        let den = [0.5; 4].iter().fold(vec![1.0], |c, t| crate::model::roots::product(&c, &[*t, 1.0]));
        let tf = TransferFunction { num: vec![2.0], den, dead_time_s: 0.0 };
        let model = half_rule(&ZeroPoleGain::of(&tf), ReducedOrder::First).expect("reducible");
        let ProcessModel::Fopdt(m) = model else { panic!("{model:?}") };
        assert!((m.time_constant_s - 0.75).abs() < 1e-3 && (m.dead_time_s - 1.25).abs() < 2e-3, "{m:?}");
    }

    #[test]
    fn an_integrator_stays_one() {
        let tf = TransferFunction { num: vec![0.5], den: vec![12.0, 8.0, 1.0, 0.0], dead_time_s: 1.0 };
        let model = half_rule(&ZeroPoleGain::of(&tf), ReducedOrder::First).expect("reducible");
        // Lags 6 and 2 s.
        assert!(
            matches!(model, ProcessModel::Ipdt(m) if (m.velocity_gain - 0.5).abs() < 1e-12 && (m.dead_time_s - 6.0).abs() < 1e-9)
        );
    }

    #[test]
    fn what_has_no_lags_is_refused() {
        let refuse = |num: &[f64], den: &[f64]| {
            let tf = TransferFunction { num: num.to_vec(), den: den.to_vec(), dead_time_s: 0.0 };
            half_rule(&ZeroPoleGain::of(&tf), ReducedOrder::First).expect_err("not reducible")
        };
        assert!(matches!(refuse(&[1.0], &[1.0, 0.2, 1.0]), ReduceError::Complex { what: "pole", .. }));
        assert_eq!(refuse(&[1.0], &[1.0, -0.5]), ReduceError::Unstable { pole: 0.5 });
        assert_eq!(refuse(&[1.0, 0.0], &[1.0, 1.0]), ReduceError::NoGain);
        assert_eq!(refuse(&[2.0], &[1.0]), ReduceError::NoLag);
        assert_eq!(refuse(&[2.0], &[1.0, 0.0, 0.0]), ReduceError::Integrators { integrators: 2 });
    }
}
