//! What a loop tells before it is moved: noise, values at rest, drift.

/// Order of the moving average, Silva, Bispo, Teixeira & Brandão, CBA 2014.
const ORDER: usize = 4;
/// sd(δ)/σ for white noise: δ = y − ȳ has the weights 3/4 and three times −1/4.
const WHITE: f64 = 0.866_025_403_784_438_6;
/// Share of the sensor's range that a loop at rest may drift by while it is listened to.
const DRIFT_SHARE: f64 = 0.002;
/// Standard errors that noise alone hardly exceeds.
const SURE: f64 = 4.0;

/// Sums over the samples heard so far. PV and MV count from the first sample, so that no digits are lost.
#[derive(Debug, Clone)]
pub(super) struct Listening {
    wanted: usize,
    heard: usize,
    first: (f64, f64),
    recent: [f64; ORDER],
    sum_mv: f64,
    deviation: f64,
    deviation_squares: f64,
    /// Sums of the PV over the first and the second half.
    halves: [f64; 2],
}

/// What listening came to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Base {
    /// Mean PV in PV units.
    pub pv: f64,
    /// Mean MV in MV units.
    pub mv: f64,
    /// sd(δ) in PV units.
    pub deviation_sd: f64,
    /// σ of white noise that has this sd(δ), in PV units.
    pub noise_sd: f64,
    /// Change of the PV from one end to the other, as its halves tell it, in PV units.
    pub moved: f64,
    /// Change that noise alone would explain, in PV units.
    pub noise_band: f64,
}

impl Base {
    /// Change of a PV at rest that does not matter with a sensor of that range, in PV units.
    pub fn rest_band(&self, pv_range: f64) -> f64 {
        self.noise_band + DRIFT_SHARE * pv_range
    }
}

impl Listening {
    /// Listens to `wanted` samples.
    pub fn new(wanted: usize) -> Self {
        Self {
            wanted: wanted.max(2 * ORDER),
            heard: 0,
            first: (0.0, 0.0),
            recent: [0.0; ORDER],
            sum_mv: 0.0,
            deviation: 0.0,
            deviation_squares: 0.0,
            halves: [0.0; 2],
        }
    }

    /// Share heard.
    pub fn fraction(&self) -> f64 {
        self.heard as f64 / self.wanted as f64
    }

    /// Takes a sample; gives the result with the last one.
    pub fn push(&mut self, pv: f64, mv: f64) -> Option<Base> {
        if self.heard == 0 {
            self.first = (pv, mv);
        }
        let (y, u) = (pv - self.first.0, mv - self.first.1);
        self.recent[self.heard % ORDER] = y;
        let second = usize::from(self.heard >= self.wanted / 2);
        self.halves[second] += y;
        self.sum_mv += u;
        self.heard += 1;
        if self.heard >= ORDER {
            let delta = y - self.recent.iter().sum::<f64>() / ORDER as f64;
            self.deviation += delta;
            self.deviation_squares += delta * delta;
        }
        (self.heard == self.wanted).then(|| self.base())
    }

    fn base(&self) -> Base {
        let count = self.wanted as f64;
        let of_deltas = (self.heard - ORDER + 1) as f64;
        let mean = self.deviation / of_deltas;
        let variance = (self.deviation_squares / of_deltas - mean * mean).max(0.0);
        let deviation_sd = (variance * of_deltas / (of_deltas - 1.0)).sqrt();
        let noise_sd = deviation_sd / WHITE;
        let first_half = (self.wanted / 2) as f64;
        let [early, late] = [self.halves[0] / first_half, self.halves[1] / (count - first_half)];
        Base {
            pv: self.first.0 + (self.halves[0] + self.halves[1]) / count,
            mv: self.first.1 + self.sum_mv / count,
            deviation_sd,
            noise_sd,
            // The middles of the halves are half the time apart.
            moved: 2.0 * (late - early),
            noise_band: 2.0 * SURE * noise_sd * (4.0 / count).sqrt(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    #[test]
    fn white_noise_has_the_deviation_of_its_formula() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
        let mut listening = Listening::new(200_000);
        let base = (0..200_000).find_map(|_| {
            let draw: f64 = StandardNormal.sample(&mut rng);
            listening.push(15.0 + 0.03 * draw, 2.5)
        });
        let base = base.expect("heard");
        assert!((base.deviation_sd / (0.866 * 0.03) - 1.0).abs() < 0.01, "{base:?}");
        assert!((base.noise_sd / 0.03 - 1.0).abs() < 0.01, "{base:?}");
        assert!(base.moved.abs() < base.noise_band && (base.pv - 15.0).abs() < 1e-3 && base.mv == 2.5);
    }

    #[test]
    fn a_drift_is_measured_from_end_to_end() {
        let mut listening = Listening::new(150);
        let base = (0..150).find_map(|k| listening.push(10.0 + 0.01 * f64::from(k), 1.0)).expect("heard");
        assert!((base.moved - 1.5).abs() < 1e-9, "{base:?}");
        assert!(base.moved > base.rest_band(24.0));
    }
}
