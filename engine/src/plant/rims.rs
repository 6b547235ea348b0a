//! Rims, empty tanks and dry pumps: what a step would take that is not there, or bring that does not fit, is mended
//! in volumes, so that no water is made or lost.

use super::state::Plant;
use super::streams::Streams;

/// Share of a tank by which rounding may leave it below empty.
const EMPTY_SHARE: f64 = 1e-12;

impl Plant {
    /// Moves the volumes of a step of `step_s` from `work.start` to `work.end`, mended until every tank can hold
    /// and give them. `fed` pumps have had their water.
    pub(super) fn mend(&mut self, step_s: f64, fed: bool) {
        let work = &mut self.work;
        for (i, &flow) in self.commanded.iter().enumerate() {
            work.pumped_volume[i] = if fed { 0.0 } else { step_s * flow };
            work.arriving_volume[i] = step_s * work.arriving[i];
        }
        work.spill_volume.fill(0.0);
        let tanks = self.network.tanks.len();
        for _ in 0..=2 * tanks {
            self.sum_volumes();
            let mut mended = false;
            for i in 0..tanks {
                let tank = &self.network.tanks[i];
                let (most, volume) = (tank.height_cm * tank.area_cm2, self.work.after[i]);
                if volume < -EMPTY_SHARE * most {
                    self.scale_outflows(i, volume);
                    mended = true;
                    break;
                }
                if volume > most * (1.0 + 1e-15) {
                    self.work.spill_volume[i] += volume - most;
                    mended = true;
                    break;
                }
            }
            if !mended {
                break;
            }
        }
        self.book(step_s, fed);
    }

    /// What every node holds after the step, in cm³.
    fn sum_volumes(&mut self) {
        let (work, outside) = (&mut self.work, self.streams.outside());
        for (i, after) in work.after.iter_mut().enumerate() {
            let area = self.network.tanks.get(i).map_or(1.0, |tank| tank.area_cm2);
            *after = work.start[i] * area;
        }
        for (i, tank) in self.network.tanks.iter().enumerate() {
            work.after[i] -= work.spill_volume[i];
            work.after[tank.spills_to.unwrap_or(outside)] += work.spill_volume[i];
        }
        for (i, pump) in self.network.pumps.iter().enumerate() {
            work.after[pump.from.unwrap_or(outside)] -= work.pumped_volume[i];
            for &(to, share) in &pump.outlets {
                work.after[to] += share * work.arriving_volume[i];
            }
        }
        for i in 0..self.streams.len() {
            let (from, to) = self.streams.ends(i);
            work.after[from] -= work.volume[i];
            work.after[to] += work.volume[i];
        }
    }

    /// Shrinks everything that leaves an over-drawn tank so that it ends the step empty.
    fn scale_outflows(&mut self, tank: usize, after_cm3: f64) {
        let (work, network) = (&mut self.work, &self.network);
        let leaves = |streams: &Streams, i: usize, volume: f64| {
            let (from, to) = streams.ends(i);
            (from == tank && volume > 0.0) || (to == tank && volume < 0.0)
        };
        let mut out = work.spill_volume[tank];
        for (i, pump) in network.pumps.iter().enumerate() {
            if pump.from == Some(tank) {
                out += work.pumped_volume[i];
            }
        }
        for i in 0..self.streams.len() {
            if leaves(&self.streams, i, work.volume[i]) {
                out += work.volume[i].abs();
            }
        }
        let keep = ((out + after_cm3) / out).max(0.0);
        work.spill_volume[tank] *= keep;
        for (i, pump) in network.pumps.iter().enumerate() {
            if pump.from == Some(tank) && self.commanded[i] > 0.0 {
                work.pumped_volume[i] *= keep;
                self.dry[i] = true;
                if self.pipes[i].arriving_cm3_s().is_none() {
                    work.arriving_volume[i] *= keep;
                }
            }
        }
        for i in 0..self.streams.len() {
            if leaves(&self.streams, i, work.volume[i]) {
                work.volume[i] *= keep;
            }
        }
    }

    fn book(&mut self, step_s: f64, fed: bool) {
        let work = &mut self.work;
        for (i, (end, after)) in work.end.iter_mut().zip(&work.after).enumerate() {
            *end = match self.network.tanks.get(i) {
                Some(tank) => (after / tank.area_cm2).clamp(0.0, tank.height_cm),
                None => *after,
            };
        }
        for (span, volume) in work.span_spills.iter_mut().zip(&work.spill_volume) {
            *span += volume;
        }
        for (i, pipe) in self.pipes.iter_mut().enumerate() {
            if !fed {
                pipe.feed(step_s, work.pumped_volume[i] / step_s);
                work.span_pumped[i] += work.pumped_volume[i];
            }
            pipe.take(step_s);
            work.span_arriving[i] += work.arriving_volume[i];
        }
        for (span, volume) in work.span_volume.iter_mut().zip(&work.volume[..self.streams.len()]) {
            *span += volume;
        }
    }
}
