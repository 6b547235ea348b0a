//! Where everything of a rig is drawn: pure geometry from the rig's structure, in grid units.
//!
//! Tanks stand where the rig file puts them; pipes, valves, pumps and instruments follow from what they join.

use eframe::egui::{Pos2, Rect, Vec2, pos2, vec2};
use vasos_engine::plant::Network;
use vasos_engine::plant::spec::ValveDrive;

/// Size of a tank, in grid units.
const TANK: Vec2 = vec2(1.2, 0.62);
/// Height of a tank that gives its own width, such as a reservoir.
const RESERVOIR_HEIGHT: f32 = 0.5;
/// How far above the tanks a pump's pipe runs.
const HEAD_ROOM: f32 = 0.26;

/// A stream's way through the drawing.
#[derive(Debug, Clone, PartialEq)]
pub struct Route {
    /// Corners of the pipe, from its beginning to its end.
    pub pipe: Vec<Pos2>,
    /// Tank into which the stream falls from the pipe's end.
    pub falls_into: Option<usize>,
    /// It leaves the drawing at its end.
    pub to_outside: bool,
}

/// A valve on its pipe.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ValvePlace {
    /// Middle of the symbol.
    pub at: Pos2,
    /// The pipe runs down the drawing.
    pub vertical: bool,
    /// An instrument stands above: the label goes below.
    pub label_below: bool,
}

/// The whole drawing, in grid units.
#[derive(Debug, Clone, PartialEq)]
pub struct Layout {
    /// What it fills.
    pub bounds: Rect,
    /// Tanks in the order of the network.
    pub tanks: Vec<Rect>,
    /// Side to which each tank spills: −1 left, 1 right.
    pub spill_side: Vec<f32>,
    /// Valves in the order of the network.
    pub valves: Vec<ValvePlace>,
    /// Their pipes.
    pub valve_routes: Vec<Route>,
    /// Pumps in the order of the network.
    pub pumps: Vec<Pos2>,
    /// Suction pipes; empty for a pump from outside.
    pub suctions: Vec<Vec<Pos2>>,
    /// Discharge pipes.
    pub discharges: Vec<Route>,
    /// Sensors in the order of the network.
    pub sensors: Vec<Pos2>,
    /// Controller of each pump.
    pub controllers: Vec<Pos2>,
}

impl Layout {
    /// The drawing of a rig.
    #[must_use]
    pub fn of(network: &Network) -> Self {
        let spec = &network.spec;
        let count = spec.tanks.len();
        let tanks: Vec<Rect> = (0..count)
            .map(|i| {
                let tank = &spec.tanks[i];
                let [x, y] = tank.at.unwrap_or([1.0 + 2.0 * i as f64, 1.0]);
                let size = tank.width.map_or(TANK, |w| vec2(w as f32, RESERVOIR_HEIGHT));
                Rect::from_center_size(pos2(x as f32, y as f32), size)
            })
            .collect();
        let all = tanks.iter().fold(Rect::NOTHING, |a, t| a.union(*t));
        let top = all.top() - HEAD_ROOM;
        let middle = all.center().x;
        let spill_side = tanks.iter().map(|t| if t.center().x > middle { 1.0 } else { -1.0 }).collect();
        let (mut valves, valve_routes): (Vec<ValvePlace>, Vec<Route>) =
            network.valves.iter().map(|v| valve(v, &tanks)).unzip();
        let (mut pumps, mut suctions, mut discharges) = (vec![], vec![], vec![]);
        for pump in &network.pumps {
            let (at, suction, discharge) = pump_route(pump, &tanks, all, top);
            pumps.push(at);
            suctions.push(suction);
            discharges.push(discharge);
        }
        let sensors: Vec<Pos2> = network
            .sensors
            .iter()
            .map(|s| pos2(tanks[s.tank].right() + 0.36, tanks[s.tank].center().y))
            .collect();
        let controllers = network
            .pumps
            .iter()
            .zip(&pumps)
            .map(|(pump, at)| match pump.from {
                Some(_) => pos2(at.x - 0.36, at.y - 1.0),
                None => pos2(tanks[pump.to].right() + 0.36, tanks[pump.to].center().y - 0.48),
            })
            .collect();
        let mut bounds = all;
        bounds.extend_with(pos2(all.left() - 0.16, top - 0.2));
        for point in pumps.iter().chain(&sensors) {
            bounds.extend_with(*point + vec2(0.28, 0.2));
        }
        for place in valves.iter_mut().filter(|v| !v.vertical) {
            let above = |s: &Pos2| (s.x - place.at.x).abs() < 0.5 && (0.0..0.5).contains(&(place.at.y - s.y));
            place.label_below = sensors.iter().any(above);
        }
        if network.pumps.iter().any(|p| p.from.is_none()) {
            // Room for the tags above the pumps.
            bounds.extend_with(pos2(all.left() - 0.55, top - 0.3));
            bounds.extend_with(pos2(all.right() + 0.85, top));
        }
        for route in &valve_routes {
            for point in &route.pipe {
                bounds.extend_with(*point);
            }
        }
        bounds.extend_with(bounds.max + vec2(0.0, 0.1));
        Self {
            bounds,
            tanks,
            spill_side,
            valves,
            valve_routes,
            pumps,
            suctions,
            discharges,
            sensors,
            controllers,
        }
    }
}

fn valve(valve: &vasos_engine::plant::Valve, tanks: &[Rect]) -> (ValvePlace, Route) {
    let from = tanks[valve.from];
    let Some(to) = valve.to else {
        let end = pos2(from.center().x, from.bottom() + 0.6);
        let pipe = vec![from.center_bottom(), end];
        let at = from.center_bottom() + vec2(0.0, 0.34);
        return (
            ValvePlace { at, vertical: true, label_below: false },
            Route { pipe, falls_into: None, to_outside: true },
        );
    };
    let target = tanks[to];
    if valve.drive == ValveDrive::Between {
        let y = from.bottom().min(target.bottom()) - 0.1;
        let (start, end) = if from.center().x < target.center().x {
            (pos2(from.right(), y), pos2(target.left(), y))
        } else {
            (pos2(from.left(), y), pos2(target.right(), y))
        };
        let at = start + (end - start) * 0.5;
        return (
            ValvePlace { at, vertical: false, label_below: false },
            Route { pipe: vec![start, end], falls_into: None, to_outside: false },
        );
    }
    let start = from.center_bottom();
    let mut pipe = vec![start];
    let inside = (target.left() + 0.1..target.right() - 0.1).contains(&start.x);
    let gap = target.top() - start.y;
    if !inside {
        let y = start.y + 0.75 * gap;
        pipe.push(pos2(start.x, y));
        pipe.push(pos2(target.center().x, y));
    }
    let end_x = if inside { start.x } else { target.center().x };
    pipe.push(pos2(end_x, target.top() - 0.06));
    let at = start + vec2(0.0, 0.44 * gap);
    (
        ValvePlace { at, vertical: true, label_below: false },
        Route { pipe, falls_into: Some(to), to_outside: false },
    )
}

fn pump_route(
    pump: &vasos_engine::plant::Pump,
    tanks: &[Rect],
    all: Rect,
    top: f32,
) -> (Pos2, Vec<Pos2>, Route) {
    let target = tanks[pump.to];
    let Some(from) = pump.from else {
        // Off the middle, where the readings leave room.
        let end = pos2(target.center().x + 0.22, target.top() - 0.06);
        let at = pos2(target.left() + 0.06, top);
        let pipe = vec![at, pos2(end.x, top), end];
        return (at, vec![], Route { pipe, falls_into: Some(pump.to), to_outside: false });
    };
    let end = pos2(target.center().x, target.top() - 0.06);
    let source = tanks[from];
    let at = pos2(all.right() + 0.72, source.center().y);
    let suction = vec![pos2(source.right(), at.y + 0.12), pos2(at.x, at.y + 0.12), at];
    let pipe = vec![at, pos2(at.x, top), pos2(end.x, top), end];
    (at, suction, Route { pipe, falls_into: Some(pump.to), to_outside: false })
}

/// Maps grid units into a rectangle of the screen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    from: Rect,
    to: Rect,
}

impl Frame {
    /// A frame that fills `to` with the drawing.
    #[must_use]
    pub fn new(layout: &Layout, to: Rect) -> Self {
        Self { from: layout.bounds, to }
    }

    /// A point on the screen.
    #[must_use]
    pub fn point(&self, p: Pos2) -> Pos2 {
        let share = (p - self.from.min) / self.from.size();
        self.to.min + share * self.to.size()
    }

    /// A rectangle on the screen.
    #[must_use]
    pub fn rect(&self, r: Rect) -> Rect {
        Rect::from_min_max(self.point(r.min), self.point(r.max))
    }

    /// Pixels per grid unit, the smaller of both directions.
    #[must_use]
    pub fn scale(&self) -> f32 {
        (self.to.width() / self.from.width()).min(self.to.height() / self.from.height())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vasos_io::rig::{PRESETS, preset};

    #[test]
    fn nothing_overlaps_in_any_preset() {
        for p in PRESETS {
            let network = preset(p.id).expect("preset");
            let layout = Layout::of(&network);
            for (i, a) in layout.tanks.iter().enumerate() {
                assert!(layout.bounds.contains_rect(*a), "{}: tank {i} is inside", p.id);
                for b in &layout.tanks[i + 1..] {
                    assert!(!a.intersects(*b), "{}: tanks do not overlap", p.id);
                }
                for point in layout.sensors.iter().chain(&layout.controllers).chain(&layout.pumps) {
                    assert!(!a.contains(*point), "{}: {point:?} is outside tank {i}", p.id);
                    assert!(layout.bounds.contains(*point), "{}: {point:?} is in the drawing", p.id);
                }
            }
        }
    }
}
