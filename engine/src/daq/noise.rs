//! A source of Gaussian noise.

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Draws taken at a time: one by one, each would wait for the generator's state to come from memory and go back.
const AHEAD: usize = 16;

/// A seeded source of Gaussian noise, the same numbers in the same order however many are drawn at a time.
#[derive(Debug, Clone)]
pub(crate) struct Noise {
    generator: Xoshiro256PlusPlus,
    ahead: [f64; AHEAD],
    /// How many of them are used up.
    used: usize,
}

impl Noise {
    /// The source of a sensor's noise: one of its own, so that no sensor's noise depends on who reads another.
    pub fn of_sensor(sensor: usize, seed: u64) -> Self {
        // 2⁶⁴ over the golden ratio keeps the seeds of neighbours apart.
        let seed = seed ^ (sensor as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        Self { generator: Xoshiro256PlusPlus::seed_from_u64(seed), ahead: [0.0; AHEAD], used: AHEAD }
    }

    /// The next number, of mean 0 and standard deviation 1.
    #[inline(always)]
    pub fn draw(&mut self) -> f64 {
        if self.used >= AHEAD {
            self.refill();
        }
        let drawn = self.ahead[self.used];
        self.used += 1;
        drawn
    }

    #[inline(never)]
    fn refill(&mut self) {
        // A copy, which stays in registers.
        let mut generator = self.generator.clone();
        for drawn in &mut self.ahead {
            *drawn = StandardNormal.sample(&mut generator);
        }
        (self.generator, self.used) = (generator, 0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_numbers_are_those_of_the_generator_one_by_one() {
        let mut noise = Noise::of_sensor(0, 7);
        let mut generator = Xoshiro256PlusPlus::seed_from_u64(7);
        for _ in 0..100 {
            let one: f64 = StandardNormal.sample(&mut generator);
            assert_eq!(noise.draw().to_bits(), one.to_bits());
        }
    }
}
