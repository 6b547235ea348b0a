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
/// How far apart the pipes of several pumps run.
const LANE: f32 = 0.14;

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
    /// Discharge pipes into each pump's main tank.
    pub discharges: Vec<Route>,
    /// Discharge pipes into the other tanks of a pump that splits its stream.
    pub branches: Vec<Vec<Route>>,
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
        let drawing: Vec<usize> =
            (0..network.pumps.len()).filter(|&i| network.pumps[i].from.is_some()).collect();
        let (mut pumps, mut suctions, mut discharges, mut branches) = (vec![], vec![], vec![], vec![]);
        for (i, pump) in network.pumps.iter().enumerate() {
            let lane = drawing.iter().position(|&d| d == i).unwrap_or(0);
            let on_the_left = drawing.len() > 1 && tanks[pump.to].center().x < middle;
            let run = top - LANE * lane as f32;
            let (at, suction) = pump_place(pump, &tanks, all, top, on_the_left);
            let mut routes =
                pump.outlets.iter().map(|&(tank, _)| delivery(at, pump.from.is_some(), tank, &tanks, run));
            discharges.extend(routes.next());
            branches.push(routes.collect());
            pumps.push(at);
            suctions.push(suction);
        }
        let sensors: Vec<Pos2> = network
            .sensors
            .iter()
            .map(|s| pos2(tanks[s.tank].right() + 0.36, tanks[s.tank].center().y))
            .collect();
        let controllers = controllers(network, &tanks, &pumps, &sensors, all);
        let mut bounds = all;
        let lanes = drawing.len().saturating_sub(1) as f32;
        bounds.extend_with(pos2(all.left() - 0.16, top - LANE * lanes - 0.2));
        for point in pumps.iter().chain(&sensors) {
            bounds.extend_with(*point + vec2(0.28, 0.2));
        }
        for point in pumps.iter().filter(|at| at.x < all.left() && at.y > top) {
            bounds.extend_with(*point - vec2(0.28, 0.2));
            // Room for tag and input above the hint.
            bounds.extend_with(*point + vec2(0.0, 0.42));
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
            branches,
            sensors,
            controllers,
        }
    }
}

/// Where the controller of each pump stands: clear of the sensors.
fn controllers(network: &Network, tanks: &[Rect], pumps: &[Pos2], sensors: &[Pos2], all: Rect) -> Vec<Pos2> {
    network
        .pumps
        .iter()
        .zip(pumps)
        .map(|(pump, at)| match pump.from {
            Some(_) => {
                let x = if at.x < all.left() { at.x + 0.36 } else { at.x - 0.36 };
                let free = |p: &Pos2| sensors.iter().all(|s| (*s - *p).length() > 0.35);
                let place = |up: f32| pos2(x, at.y - up);
                [1.0, 0.55, 1.5].map(place).into_iter().find(free).unwrap_or(place(1.0))
            }
            None => pos2(tanks[pump.to].right() + 0.36, tanks[pump.to].center().y - 0.48),
        })
        .collect()
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

/// Where a pump stands, and its suction pipe.
fn pump_place(
    pump: &vasos_engine::plant::Pump,
    tanks: &[Rect],
    all: Rect,
    top: f32,
    on_the_left: bool,
) -> (Pos2, Vec<Pos2>) {
    let target = tanks[pump.to];
    let Some(from) = pump.from else {
        let x = if is_covered(pump.to, tanks) { target.left() - 0.25 } else { target.left() + 0.06 };
        return (pos2(x, top), vec![]);
    };
    let source = tanks[from];
    let (x, mouth) =
        if on_the_left { (all.left() - 0.72, source.left()) } else { (all.right() + 0.72, source.right()) };
    let at = pos2(x, source.center().y);
    (at, vec![pos2(mouth, at.y + 0.12), pos2(at.x, at.y + 0.12), at])
}

/// The pipe from a pump into a tank: over the top, or from the side where another tank stands above.
fn delivery(at: Pos2, from_below: bool, tank: usize, tanks: &[Rect], run: f32) -> Route {
    let target = tanks[tank];
    let (x, y) = if is_covered(tank, tanks) {
        // Clear of the tag on the left; on the right the reading makes room.
        let x = if at.x < target.center().x { target.left() + 0.46 } else { target.right() - 0.1 };
        (x, target.top() - 0.07)
    } else if from_below {
        (target.center().x, run)
    } else {
        // Off the middle, where the readings leave room.
        (target.center().x + 0.22, run)
    };
    let end_y = (target.top() - 0.06).max(y + 0.04);
    let mut pipe = vec![at, pos2(at.x, y), pos2(x, y), pos2(x, end_y)];
    if at.y == y {
        pipe.remove(1);
    }
    Route { pipe, falls_into: Some(tank), to_outside: false }
}

/// Whether another tank stands above.
fn is_covered(tank: usize, tanks: &[Rect]) -> bool {
    let below = tanks[tank];
    tanks.iter().any(|t| t.bottom() < below.top() && t.x_range().contains(below.center().x))
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
            let symbols: Vec<Pos2> =
                layout.sensors.iter().chain(&layout.controllers).chain(&layout.pumps).copied().collect();
            for (i, a) in symbols.iter().enumerate() {
                for b in &symbols[i + 1..] {
                    assert!((*a - *b).length() > 0.3, "{}: {a:?} and {b:?} are apart", p.id);
                }
            }
            for (i, pump) in network.pumps.iter().enumerate() {
                let routes: Vec<&Route> =
                    std::iter::once(&layout.discharges[i]).chain(&layout.branches[i]).collect();
                let ends: Vec<Option<usize>> = routes.iter().map(|r| r.falls_into).collect();
                let outlets: Vec<Option<usize>> = pump.outlets.iter().map(|o| Some(o.0)).collect();
                assert_eq!(ends, outlets, "{}: every outlet has its pipe", p.id);
                for point in routes.iter().flat_map(|r| &r.pipe) {
                    assert!(layout.bounds.contains(*point), "{}: {point:?} is in the drawing", p.id);
                    assert!(layout.tanks.iter().all(|t| !t.contains(*point)), "{}: {point:?}", p.id);
                }
            }
        }
    }
}
