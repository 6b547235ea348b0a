//! What plants of an ensemble are seen to do, sample by sample.

use super::ensemble::MemberFigures;
use crate::plant::Number;

/// Rows of the bands, at most.
const BAND_ROWS: usize = 500;

/// Watches one plant, or one in each lane.
#[derive(Debug, Clone)]
pub(super) struct Watch<V> {
    stride: u64,
    sample_time_s: f64,
    last_mv: Option<V>,
    iae_cm_s: V,
    tv: V,
    lowest_cm: V,
    highest_cm: V,
    end_cm: V,
    levels_cm: Vec<V>,
}

/// What one plant was seen to do.
#[derive(Debug, Clone)]
pub(super) struct Seen {
    /// Samples from one level to the next.
    pub stride: u64,
    pub figures: MemberFigures,
    /// Level of the loop's tank in cm.
    pub levels_cm: Vec<f64>,
}

impl<V: Number> Watch<V> {
    pub fn new(samples: u64, sample_time_s: f64) -> Self {
        let stride = samples.div_ceil(BAND_ROWS as u64).max(1);
        Self {
            stride,
            sample_time_s,
            last_mv: None,
            iae_cm_s: V::of(0.0),
            tv: V::of(0.0),
            lowest_cm: V::of(f64::INFINITY),
            highest_cm: V::of(f64::NEG_INFINITY),
            end_cm: V::of(f64::NAN),
            levels_cm: Vec::with_capacity(samples.div_ceil(stride) as usize),
        }
    }

    #[inline(always)]
    pub fn see(&mut self, sample: u64, setpoint_cm: f64, pv_cm: V, mv: V, level_cm: V) {
        self.iae_cm_s += (V::of(setpoint_cm) - pv_cm).abs().finite_or_zero() * self.sample_time_s;
        self.tv += self.last_mv.map_or(V::of(0.0), |last| (mv - last).abs());
        self.last_mv = Some(mv);
        self.lowest_cm = self.lowest_cm.smaller(level_cm);
        self.highest_cm = self.highest_cm.larger(level_cm);
        self.end_cm = level_cm;
        if sample.is_multiple_of(self.stride) {
            self.levels_cm.push(level_cm);
        }
    }

    /// What one of the plants did.
    pub fn of_plant(&self, plant: usize) -> Seen {
        Seen {
            stride: self.stride,
            figures: MemberFigures {
                iae_cm_s: self.iae_cm_s.of_plant(plant),
                tv: self.tv.of_plant(plant),
                level_cm: [self.lowest_cm.of_plant(plant), self.highest_cm.of_plant(plant)],
                end_cm: self.end_cm.of_plant(plant),
            },
            levels_cm: self.levels_cm.iter().map(|level| level.of_plant(plant)).collect(),
        }
    }
}
