//! Processes as points of frequency, side by side, for the passes of the search.

use num_complex::Complex64;

use super::problem::{LoopLimits, Process};
use super::slice::Lead;
use crate::analyze::{Asymptote, OpenLoop, natural_frequencies, resonances};
use crate::control::PidGains;

/// Ratio of neighbouring frequencies, and the largest step as a phase of the dead time in radians.
const RATIO: f64 = 1.12;
const RIPPLE_STEP_RAD: f64 = 0.3;
/// Ratio beyond the ripples that get points of their own.
const RATIO_FAR: f64 = 1.35;
/// Phase of the dead time up to which ripples get points; those beyond come in where the check finds them.
const RIPPLES_RAD: f64 = 20.0;
/// How far below the lowest and above the highest frequency of a process its limits are taken to rule.
const BELOW: f64 = 100.0;
const BELOW_INTEGRATOR: f64 = 1e4;
const ABOVE: f64 = 60.0;

/// Frequencies with what the search needs of G there.
#[derive(Debug, Clone, Default)]
pub(super) struct Points {
    pub omega: Vec<f64>,
    pub g_re: Vec<f64>,
    pub g_im: Vec<f64>,
    pub g_sqr: Vec<f64>,
    /// 1/G.
    pub inverse_re: Vec<f64>,
    pub inverse_im: Vec<f64>,
}

impl Points {
    pub fn push(&mut self, omega: f64, g: Complex64) {
        let sqr = g.norm_sqr();
        if !(omega > 0.0 && sqr > 0.0 && sqr.is_finite()) {
            return;
        }
        self.omega.push(omega);
        self.g_re.push(g.re);
        self.g_im.push(g.im);
        self.g_sqr.push(sqr);
        self.inverse_re.push(g.re / sqr);
        self.inverse_im.push(-g.im / sqr);
    }

    pub fn len(&self) -> usize {
        self.omega.len()
    }

    pub fn extend(&mut self, other: &Self) {
        self.omega.extend(&other.omega);
        self.g_re.extend(&other.g_re);
        self.g_im.extend(&other.g_im);
        self.g_sqr.extend(&other.g_sqr);
        self.inverse_re.extend(&other.inverse_re);
        self.inverse_im.extend(&other.inverse_im);
    }

    /// The points that bear on gains about these: at which a limit, or the objective, is near its largest.
    ///
    /// A search that stays nearby needs no others; the exact check of its result sees all frequencies.
    pub fn near(&self, limits: &LoopLimits, lead: Lead, kp: f64, ki: f64) -> Self {
        /// Share of the way from the limit to where nothing happens, and shares of the limits, within which a point counts.
        const ROOM: f64 = 0.5;
        const SHARE: f64 = 0.6;
        let mut loads = Vec::with_capacity(self.len());
        let mut largest_load = 1.0 / (ki * ki);
        let mut counts = vec![false; self.len()];
        for (i, counted) in counts.iter_mut().enumerate() {
            let omega = self.omega[i];
            let filter = omega * lead.tf_s;
            let im = omega * lead.td_s / (1.0 + filter * filter);
            let c = Complex64::new(kp * (1.0 + im * filter), kp * im - ki / omega);
            let l = Complex64::new(self.g_re[i], self.g_im[i]) * c;
            let n = (1.0 + l).norm_sqr();
            let least = 1.0 / (limits.ms * limits.ms);
            let near_s = n < least + ROOM * (1.0 - least);
            let near_t = l.norm_sqr() > SHARE * limits.mt * limits.mt * n;
            let near_u = c.norm_sqr() > SHARE * limits.ju * limits.ju * n;
            *counted = near_s || near_t || near_u;
            let load = self.g_sqr[i] / (omega * omega * n);
            largest_load = largest_load.max(load);
            loads.push(load);
        }
        let mut chosen = Self::default();
        for i in (0..self.len()).filter(|&i| counts[i] || loads[i] > SHARE * largest_load) {
            chosen.omega.push(self.omega[i]);
            chosen.g_re.push(self.g_re[i]);
            chosen.g_im.push(self.g_im[i]);
            chosen.g_sqr.push(self.g_sqr[i]);
            chosen.inverse_re.push(self.inverse_re[i]);
            chosen.inverse_im.push(self.inverse_im[i]);
        }
        chosen
    }
}

/// A process, its gain's sign turned positive, with the ends of its frequency response.
#[derive(Debug, Clone)]
pub(super) struct Plant<'a> {
    pub process: &'a Process,
    /// G without a controller; `None` for a measured response.
    bare: Option<OpenLoop>,
    /// First term of G for s → 0, sign included.
    pub low: Asymptote,
    /// |G(∞)|, sign included, without its dead time.
    pub high: f64,
    pub dead_time_s: f64,
    /// Poles minus zeros.
    pub excess: usize,
    /// Whether a pole or zero is so lightly damped that G jumps between two points.
    pub resonant: bool,
}

impl<'a> Plant<'a> {
    pub fn new(process: &'a Process) -> Self {
        match process {
            Process::Model(model) => {
                let bare = OpenLoop::new(model, &PidGains::p(1.0));
                let tf = model.transfer_function();
                Self {
                    process,
                    low: bare.process_low(),
                    high: bare.process_high(),
                    dead_time_s: tf.dead_time_s,
                    excess: tf.den.len() - tf.num.len(),
                    resonant: !resonances(&bare).is_empty(),
                    bare: Some(bare),
                }
            }
            Process::Measured(response) => Self {
                process,
                bare: None,
                low: response.low(),
                high: 0.0,
                dead_time_s: 0.0,
                excess: 2,
                resonant: false,
            },
        }
    }

    /// The least Ju of any controller with integral action, 1/|G(0)|; 0 where the process integrates.
    pub fn least_ju(&self) -> f64 {
        if self.low.power == 0 { 1.0 / self.low.coefficient.abs() } else { 0.0 }
    }

    pub fn at_omega(&self, omega: f64) -> Complex64 {
        match (&self.bare, self.process) {
            (Some(bare), _) => bare.process_at_omega(omega),
            (None, Process::Measured(response)) => response.at_omega(omega),
            (None, Process::Model(model)) => model.transfer_function().at_omega(omega),
        }
    }

    /// Largest frequency at which anything is known, in rad/s.
    pub fn known_up_to(&self) -> f64 {
        match self.process {
            Process::Measured(response) => response.last_omega(),
            Process::Model(_) => f64::INFINITY,
        }
    }

    /// A frequency of the process's own, in rad/s.
    pub fn typical_omega(&self) -> f64 {
        let own = self.own_frequencies();
        let log: f64 = own.iter().map(|w| w.ln()).sum();
        (log / own.len() as f64).exp()
    }

    fn own_frequencies(&self) -> Vec<f64> {
        match (&self.bare, self.process) {
            (Some(bare), _) => natural_frequencies(bare),
            (None, Process::Measured(response)) => vec![response.first_omega(), response.last_omega()],
            (None, Process::Model(_)) => vec![1.0],
        }
    }

    /// Appends the plant's points, times `sign`.
    pub fn push_points(&self, sign: f64, to: &mut Points) {
        let own = self.own_frequencies();
        let (first, last) = (own[0], own[own.len() - 1]);
        let theta = self.dead_time_s;
        let ripples_end = if theta > 0.0 { RIPPLES_RAD / theta } else { 0.0 };
        let stop = (last * ABOVE).max(ripples_end).min(self.known_up_to());
        // How slow the loop of an integrator is its gain alone decides.
        let mut omega = first / if self.low.power < 0 { BELOW_INTEGRATOR } else { BELOW };
        let mut omegas = Vec::with_capacity(256);
        while omega < stop {
            omegas.push(omega);
            let near = omega < ripples_end.max(4.0 * last) && omega > 0.25 * first;
            let mut next = omega * if near { RATIO } else { RATIO_FAR };
            if omega < ripples_end {
                next = next.min(omega + RIPPLE_STEP_RAD / theta);
            }
            omega = next;
        }
        omegas.push(stop);
        omegas.extend(self.bare.iter().flat_map(resonances));
        omegas.sort_unstable_by(f64::total_cmp);
        omegas.into_iter().for_each(|omega| to.push(omega, sign * self.at_omega(omega)));
    }
}
