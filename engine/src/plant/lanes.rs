//! Numbers of one plant, or of several plants side by side.
//!
//! The integrator is written once for both: with `f64` it moves one plant, with [`Pack`] several at a time, whose
//! arithmetic is that of vector registers.

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
    /// The larger of two, plant by plant.
    fn larger(self, other: Self) -> Self;
    /// The smaller of two, plant by plant.
    fn smaller(self, other: Self) -> Self;
    /// |x|.
    fn abs(self) -> Self;
    /// 0 where it is not finite.
    fn finite_or_zero(self) -> Self;
    /// Whether it is below another in every plant; a NaN is not.
    fn is_below(self, bound: Self) -> bool;
    /// Whether it is at most as large as another in every plant; a NaN is not.
    fn is_at_most(self, most: Self) -> bool;
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
    fn larger(self, other: Self) -> Self {
        if self < other { other } else { self }
    }

    #[inline(always)]
    fn smaller(self, other: Self) -> Self {
        if self > other { other } else { self }
    }

    #[inline(always)]
    fn abs(self) -> Self {
        f64::abs(self)
    }

    #[inline(always)]
    fn finite_or_zero(self) -> Self {
        if self.is_finite() { self } else { 0.0 }
    }

    #[inline(always)]
    fn is_below(self, bound: Self) -> bool {
        self < bound
    }

    #[inline(always)]
    fn is_at_most(self, most: Self) -> bool {
        self <= most
    }

    #[inline(always)]
    fn largest(self) -> f64 {
        self
    }
}

/// Plants of a pack: two of the widest registers that are in use, so that one works while the other waits.
const PLANTS: usize = 8;

/// A number of each of as many plants.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(align(64))]
pub(crate) struct Pack([f64; PLANTS]);

impl Pack {
    // Plain loops: `array::from_fn` is not always taken apart into vector instructions.
    #[inline(always)]
    fn each(mut self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        for i in 0..PLANTS {
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

    #[inline(always)]
    fn holds(self, other: Self, f: impl Fn(f64, f64) -> bool) -> bool {
        let mut all = true;
        for i in 0..PLANTS {
            all &= f(self.0[i], other.0[i]);
        }
        all
    }
}

impl Add for Pack {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.each(other, |a, b| a + b)
    }
}

impl Sub for Pack {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.each(other, |a, b| a - b)
    }
}

impl Mul for Pack {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.each(other, |a, b| a * b)
    }
}

impl Div for Pack {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        self.each(other, |a, b| a / b)
    }
}

impl Mul<f64> for Pack {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        self.all(|x| x * factor)
    }
}

impl Neg for Pack {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.all(|x| -x)
    }
}

impl AddAssign for Pack {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl SubAssign for Pack {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl Number for Pack {
    const PLANTS: usize = PLANTS;

    #[inline(always)]
    fn each_of(mut number: impl FnMut(usize) -> f64) -> Self {
        let mut made = [0.0; PLANTS];
        for (plant, x) in made.iter_mut().enumerate() {
            *x = number(plant);
        }
        Self(made)
    }

    #[inline(always)]
    fn of_plant(&self, plant: usize) -> f64 {
        self.0[plant]
    }

    #[inline(always)]
    fn of(x: f64) -> Self {
        Self([x; PLANTS])
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
    fn larger(self, other: Self) -> Self {
        self.each(other, f64::larger)
    }

    #[inline(always)]
    fn smaller(self, other: Self) -> Self {
        self.each(other, f64::smaller)
    }

    #[inline(always)]
    fn abs(self) -> Self {
        self.all(f64::abs)
    }

    #[inline(always)]
    fn finite_or_zero(self) -> Self {
        self.all(f64::finite_or_zero)
    }

    #[inline(always)]
    fn is_below(self, bound: Self) -> bool {
        self.holds(bound, |x, bound| x < bound)
    }

    #[inline(always)]
    fn is_at_most(self, most: Self) -> bool {
        self.holds(most, |x, most| x <= most)
    }

    #[inline(always)]
    fn largest(self) -> f64 {
        self.0.iter().fold(f64::NEG_INFINITY, |most, &x| most.max(x))
    }
}
