//! Min/max pyramid: draws any stretch of a long signal with as many points as there are pixels.

/// Points of level k that make one of level k + 1.
const FAN: usize = 4;

/// Extremes of a stretch of samples, in the order in which they came.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Extremes {
    min: f64,
    max: f64,
    min_first: bool,
}

/// A growing signal over growing time with its min/max pyramid.
///
/// NaN marks a sample without value; it is left out of extremes and of what is drawn.
#[derive(Debug, Clone, Default)]
pub struct Pyramid {
    time_s: Vec<f64>,
    values: Vec<f64>,
    levels: Vec<Vec<Extremes>>,
}

impl Pyramid {
    /// Appends a sample; `time_s` does not decrease.
    pub fn push(&mut self, time_s: f64, value: f64) {
        self.time_s.push(time_s);
        self.values.push(value);
        let mut done = self.values.len();
        let mut level = 0;
        while done.is_multiple_of(FAN) {
            done /= FAN;
            let merged = if level == 0 {
                let start = self.values.len() - FAN;
                merge(self.values[start..].iter().map(|&v| Extremes { min: v, max: v, min_first: true }))
            } else {
                let below = &self.levels[level - 1];
                merge(below[below.len() - FAN..].iter().copied())
            };
            if self.levels.len() == level {
                self.levels.push(Vec::new());
            }
            self.levels[level].push(merged);
            level += 1;
        }
    }

    /// Number of samples.
    #[must_use]
    pub fn len(&self) -> usize {
        self.values.len()
    }

    /// Whether there is no sample.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// Times in seconds.
    #[must_use]
    pub fn time_s(&self) -> &[f64] {
        &self.time_s
    }

    /// Values in the channel's unit.
    #[must_use]
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.time_s.clear();
        self.values.clear();
        self.levels.clear();
    }

    /// Forgets the oldest samples, so that `keep` are left.
    pub fn keep_last(&mut self, keep: usize) {
        let first = self.len().saturating_sub(keep);
        if first == 0 {
            return;
        }
        let mut kept = Self::default();
        for (&time_s, &value) in self.time_s[first..].iter().zip(&self.values[first..]) {
            kept.push(time_s, value);
        }
        *self = kept;
    }

    /// Index of the first sample at or after a time.
    #[must_use]
    pub fn index_at(&self, time_s: f64) -> usize {
        self.time_s.partition_point(|&t| t < time_s)
    }

    /// Points (time, value) that draw the stretch `from_s…to_s` on about `pixels` columns: every sample
    /// when they fit, else the extremes of each column, so that no peak is lost.
    pub fn draw(&self, from_s: f64, to_s: f64, pixels: usize, out: &mut Vec<[f64; 2]>) {
        out.clear();
        let first = self.index_at(from_s).saturating_sub(1);
        let last = (self.index_at(to_s) + 1).min(self.len());
        if first >= last {
            return;
        }
        let wanted = pixels.max(16);
        let (mut size, mut level) = (1, None);
        while (last - first) / size > 2 * wanted && self.levels.len() > level.map_or(0, |l: usize| l + 1) {
            level = Some(level.map_or(0, |l| l + 1));
            size *= FAN;
        }
        // Blocks of the chosen size, then ever smaller ones up to the last sample.
        let mut from = level.map_or(first, |_| first / size * size);
        for level in (0..level.map_or(0, |l| l + 1)).rev() {
            self.draw_blocks(level, size, from / size..last / size, out);
            from = last / size * size;
            size /= FAN;
        }
        out.extend((from..last).map(|i| [self.time_s[i], self.values[i]]).filter(|p| !p[1].is_nan()));
    }

    /// The extremes of some blocks of `size` samples, each inside the time of its block.
    fn draw_blocks(
        &self,
        level: usize,
        size: usize,
        blocks: std::ops::Range<usize>,
        out: &mut Vec<[f64; 2]>,
    ) {
        for block in blocks {
            let e = self.levels[level][block];
            if e.min.is_nan() {
                continue;
            }
            let early = self.time_s[block * size];
            let late = self.time_s[block * size + size / 2];
            let (a, b) = if e.min_first { (e.min, e.max) } else { (e.max, e.min) };
            out.push([early, a]);
            if a != b {
                out.push([late, b]);
            }
        }
    }
}

fn merge(items: impl Iterator<Item = Extremes>) -> Extremes {
    let mut all = Extremes { min: f64::NAN, max: f64::NAN, min_first: true };
    let (mut min_at, mut max_at) = (0, 0);
    for (i, item) in items.enumerate() {
        let position = |first: bool| 2 * i + usize::from(!first);
        if item.min < all.min || all.min.is_nan() {
            all.min = item.min;
            min_at = position(item.min_first);
        }
        if item.max > all.max || all.max.is_nan() {
            all.max = item.max;
            max_at = position(!item.min_first);
        }
    }
    all.min_first = min_at <= max_at;
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_peak_is_lost_at_any_zoom() {
        let mut p = Pyramid::default();
        for i in 0..100_000 {
            let value = if i == 54_321 {
                9.0
            } else if i == 12_345 {
                -9.0
            } else {
                f64::from(i % 7) * 0.1
            };
            p.push(f64::from(i) * 0.2, value);
        }
        let mut out = Vec::new();
        for pixels in [50, 300, 1000, 200_000] {
            p.draw(0.0, 20_000.0, pixels, &mut out);
            let (low, high) = out.iter().fold((0.0_f64, 0.0_f64), |(l, h), q| (l.min(q[1]), h.max(q[1])));
            assert_eq!((low, high), (-9.0, 9.0), "at {pixels} pixels");
            let most = 4 * pixels + 2 * FAN * p.levels.len();
            assert!(out.len() <= most.min(100_000), "{} points for {pixels} pixels", out.len());
            assert!(out.windows(2).all(|w| w[0][0] <= w[1][0]), "time goes forward");
        }
        p.draw(100.0, 110.0, 500, &mut out);
        assert_eq!(out.len(), 52);
    }

    #[test]
    fn no_peak_is_lost_at_any_place_of_a_signal_of_odd_length() {
        let mut out = Vec::new();
        for peak in 0..1003 {
            let mut p = Pyramid::default();
            for i in 0..1003 {
                p.push(f64::from(i), f64::from(u8::from(i == peak)));
            }
            p.draw(0.0, 1003.0, 16, &mut out);
            assert!(out.iter().any(|q| q[1] == 1.0), "peak at {peak}");
            assert!(out.windows(2).all(|w| w[0][0] <= w[1][0]), "time goes forward");
        }
    }

    #[test]
    fn forgetting_the_oldest_keeps_the_newest() {
        let mut p = Pyramid::default();
        for i in 0..1000 {
            p.push(f64::from(i), f64::from(i % 13));
        }
        p.keep_last(300);
        assert_eq!((p.len(), p.time_s()[0], p.values()[299]), (300, 700.0, f64::from(999 % 13)));
        p.keep_last(400);
        assert_eq!(p.len(), 300);
    }
}
