//! When a PV that was moved has come to rest: from its course alone, without a time constant from anywhere.
//!
//! The last third of the time since the move is cut into quarters. The PV is at rest when
//! 1. it has answered at all: its largest deviation D is beyond the noise,
//! 2. the means of the quarters agree, with twice their standard error, within `share · D`,
//! 3. the third holds no more than noise: its standard deviation is that of the noise, or small against D.
//!
//! A third of the time scales with the process: of a first-order answer, a share of 2 % leaves 0.6 % to come. The noise
//! of 3 is the larger of that heard before and that between neighbouring samples (von Neumann's δ², Ann. Math. Stat. 12
//! (1941) 367, of which Cao & Rhinehart, J. Process Control 5 (1995) 363, make the same comparison).

/// Samples in a quarter before anything is said.
const FEWEST: usize = 4;
/// Deviation that counts as an answer, in standard deviations of the noise.
const ANSWER: f64 = 5.0;
/// Samples that are averaged for the largest deviation.
const SMOOTHED: usize = 4;

/// Sums of the deviations since the move, one entry a sample.
#[derive(Debug, Clone)]
pub(super) struct RestDetector {
    share: f64,
    noise_sd: f64,
    least: f64,
    last: f64,
    largest: f64,
    sums: Vec<[f64; 3]>,
}

impl RestDetector {
    /// For at most `rows` samples; `noise_sd` is that of white noise, `least` the smallest deviation that is an answer
    /// where there is no noise, both in PV units.
    pub fn new(share: f64, noise_sd: f64, least: f64, rows: usize) -> Self {
        let mut sums = Vec::with_capacity(rows + 1);
        sums.push([0.0; 3]);
        Self { share, noise_sd, least, last: 0.0, largest: 0.0, sums }
    }

    /// Learns what was not known when it was made.
    pub fn learn(&mut self, noise_sd: f64, least: f64) {
        (self.noise_sd, self.least) = (noise_sd, least);
    }

    /// Takes the deviation from the PV before the move; gives the mean deviation at rest once it is there.
    pub fn push(&mut self, y: f64) -> Option<f64> {
        let [sum, squares, differences] = self.sums[self.sums.len() - 1];
        let step = if self.sums.len() > 1 { y - self.last } else { 0.0 };
        self.last = y;
        if self.sums.len() < self.sums.capacity() {
            self.sums.push([sum + y, squares + y * y, differences + step * step]);
        }
        let smoothed = self.mean(self.count().saturating_sub(SMOOTHED), self.count());
        self.largest = self.largest.max(smoothed.abs());
        self.rest()
    }

    fn count(&self) -> usize {
        self.sums.len() - 1
    }

    fn mean(&self, from: usize, to: usize) -> f64 {
        (self.sums[to][0] - self.sums[from][0]) / (to - from).max(1) as f64
    }

    fn rest(&self) -> Option<f64> {
        let count = self.count();
        let quarter = count / 12;
        if quarter < FEWEST || self.largest <= (ANSWER * self.noise_sd).max(self.least) {
            return None;
        }
        let start = count - 4 * quarter;
        let means = [0, 1, 2, 3].map(|i| self.mean(start + i * quarter, start + (i + 1) * quarter));
        let [low, high] =
            [means.iter().fold(f64::MAX, |a, &b| a.min(b)), means.iter().fold(f64::MIN, |a, &b| a.max(b))];
        let length = (4 * quarter) as f64;
        let [first, last] = [self.sums[start], self.sums[count]];
        let mean = (last[0] - first[0]) / length;
        let variance = ((last[1] - first[1]) / length - mean * mean).max(0.0);
        let neighbours = (0.5 * (last[2] - first[2]) / length).sqrt();
        let noise_sd = self.noise_sd.max(neighbours);
        let error = 2.0 * noise_sd * (2.0 / quarter as f64).sqrt();
        let allowed = self.share * self.largest;
        let quiet = variance.sqrt() <= (1.5 * noise_sd).max(allowed);
        (high - low + error <= allowed && quiet).then_some(means[3])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    /// When and where a first-order answer of 2 with T = 100 s after 10 s of dead time is said to be at rest.
    fn at_rest(noise_sd: f64, seed: u64) -> (f64, f64) {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut detector = RestDetector::new(0.02, noise_sd, 1e-9, 100_000);
        (0..100_000)
            .find_map(|k| {
                let t = 0.2 * f64::from(k);
                let y = 2.0 * (1.0 - (-(t - 10.0).max(0.0) / 100.0).exp());
                let draw: f64 = StandardNormal.sample(&mut rng);
                detector.push(y + noise_sd * draw).map(|rest| (t, rest))
            })
            .expect("comes to rest")
    }

    #[test]
    fn a_first_order_answer_rests_after_five_time_constants() {
        let (t, rest) = at_rest(0.0, 0);
        assert!((450.0..650.0).contains(&t), "{t}");
        assert!((rest / 2.0 - 1.0).abs() < 0.01, "{rest}");
    }

    #[test]
    fn noise_delays_the_word_and_hardly_moves_it() {
        for seed in 0..50 {
            let (t, rest) = at_rest(0.05, seed);
            assert!((450.0..1500.0).contains(&t), "seed {seed}: {t}");
            assert!((rest / 2.0 - 1.0).abs() < 0.015, "seed {seed}: {rest}");
        }
    }

    #[test]
    fn noise_alone_and_a_steady_oscillation_are_no_rest() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
        let mut detector = RestDetector::new(0.02, 0.05, 1e-9, 20_000);
        for _ in 0..20_000 {
            let draw: f64 = StandardNormal.sample(&mut rng);
            assert_eq!(detector.push(0.05 * draw), None);
        }
        let mut detector = RestDetector::new(0.02, 0.0, 1e-9, 20_000);
        for k in 0..20_000 {
            assert_eq!(detector.push(1.0 + (0.05 * f64::from(k)).sin()), None, "{k}");
        }
    }
}
