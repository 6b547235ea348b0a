//! Numbers of one plant, or of several plants side by side.
//!
//! The integrator is written once for both: with `f64` it moves one plant, with [`Pack`] several at a time, whose
//! arithmetic the compiler turns into vector instructions.

use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// What the integrator needs of a number.
pub(crate) trait Number:
    Copy
    + std::fmt::Debug
    + PartialEq
    + Send
    + Sync
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Mul<f64, Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
{
    /// How many plants.
    const PLANTS: usize;
    /// The same in every plant.
    fn of(x: f64) -> Self;
    /// A number for each plant.
    fn each_of(number: impl FnMut(usize) -> f64) -> Self;
    /// The number of one plant.
    fn of_plant(&self, plant: usize) -> f64;
    /// Square root.
    fn sqrt(self) -> Self;
    /// The larger of both, plant by plant; a NaN stays one.
    fn at_least(self, least: f64) -> Self;
    /// Whether it is below a bound in every plant; a NaN is not.
    fn is_below(self, bound: f64) -> bool;
    /// Whether it is at most as large as another in every plant; a NaN is not.
    fn is_at_most(self, most: Self) -> bool;
    /// Smallest over the plants; NaN counts as −∞.
    fn smallest(self) -> f64;
    /// Largest over the plants.
    fn largest(self) -> f64;
}

impl Number for f64 {
    const PLANTS: usize = 1;

    #[inline(always)]
    fn each_of(mut number: impl FnMut(usize) -> f64) -> Self {
        number(0)
    }

    #[inline(always)]
    fn of_plant(&self, _plant: usize) -> f64 {
        *self
    }

    #[inline(always)]
    fn of(x: f64) -> Self {
        x
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }

    #[inline(always)]
    fn at_least(self, least: f64) -> Self {
        if self < least { least } else { self }
    }

    #[inline(always)]
    fn is_below(self, bound: f64) -> bool {
        self < bound
    }

    #[inline(always)]
    fn is_at_most(self, most: Self) -> bool {
        self <= most
    }

    #[inline(always)]
    fn smallest(self) -> f64 {
        if self.is_nan() { f64::NEG_INFINITY } else { self }
    }

    #[inline(always)]
    fn largest(self) -> f64 {
        self
    }
}

/// A number of each of `L` plants.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(align(32))]
pub(crate) struct Pack<const L: usize>(pub [f64; L]);

impl<const L: usize> Pack<L> {
    #[inline(always)]
    fn each(mut self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        // A plain loop: `array::from_fn` is not always taken apart into vector instructions.
        for i in 0..L {
            self.0[i] = f(self.0[i], other.0[i]);
        }
        self
    }

    #[inline(always)]
    fn all(mut self, f: impl Fn(f64) -> f64) -> Self {
        for x in &mut self.0 {
            *x = f(*x);
        }
        self
    }
}

impl<const L: usize> Add for Pack<L> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.each(other, |a, b| a + b)
    }
}

impl<const L: usize> Sub for Pack<L> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.each(other, |a, b| a - b)
    }
}

impl<const L: usize> Mul for Pack<L> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.each(other, |a, b| a * b)
    }
}

impl<const L: usize> Div for Pack<L> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        self.each(other, |a, b| a / b)
    }
}

impl<const L: usize> Mul<f64> for Pack<L> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        self.all(|x| x * factor)
    }
}

impl<const L: usize> Neg for Pack<L> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.all(|x| -x)
    }
}

impl<const L: usize> AddAssign for Pack<L> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<const L: usize> SubAssign for Pack<L> {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl<const L: usize> Number for Pack<L> {
    const PLANTS: usize = L;

    #[inline(always)]
    fn each_of(number: impl FnMut(usize) -> f64) -> Self {
        Self(std::array::from_fn(number))
    }

    #[inline(always)]
    fn of_plant(&self, plant: usize) -> f64 {
        self.0[plant]
    }

    #[inline(always)]
    fn of(x: f64) -> Self {
        Self([x; L])
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        self.all(f64::sqrt)
    }

    #[inline(always)]
    fn at_least(self, least: f64) -> Self {
        self.all(|x| x.at_least(least))
    }

    #[inline(always)]
    fn is_below(self, bound: f64) -> bool {
        let mut below = true;
        for x in self.0 {
            below &= x < bound;
        }
        below
    }

    #[inline(always)]
    fn is_at_most(self, most: Self) -> bool {
        let mut within = true;
        for (x, most) in self.0.iter().zip(&most.0) {
            within &= x <= most;
        }
        within
    }

    #[inline(always)]
    fn smallest(self) -> f64 {
        let mut least = f64::INFINITY;
        for x in self.0 {
            least = least.min(x.smallest());
        }
        least
    }

    #[inline(always)]
    fn largest(self) -> f64 {
        let mut most = f64::NEG_INFINITY;
        for x in self.0 {
            most = most.max(x);
        }
        most
    }
}
