//! What the P&ID shows: the snapshot laid out, ready to paint and to test.

use eframe::egui::{Pos2, Rect, pos2, vec2};
use vasos_engine::control::Mode;
use vasos_engine::plant::{FaultKind, FaultyPart, ReadingStatus};
use vasos_engine::session::{Alarm, LoopNow, Snapshot};
use vasos_engine::sim::LoopTarget;

use super::layout::{Frame, Layout, Route};

/// How far an outer loop stands above its inner one, in grid units.
const OUTER_ABOVE: f32 = 0.42;
/// Flows smaller than this are drawn as none, in cm³/s.
pub const STILL_CM3_S: f64 = 0.02;

/// A tank as drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct TankView {
    /// Tag.
    pub tag: String,
    /// Walls.
    pub rect: Rect,
    /// Level in cm.
    pub level_cm: f64,
    /// Rim in cm.
    pub height_cm: f64,
    /// Surface of the water.
    pub surface_y: f32,
    /// Spill in cm³/s.
    pub spill_cm3_s: f64,
    /// Leak to the floor in cm³/s.
    pub leak_cm3_s: f64,
    /// Where the leak falls: from the floor of the tank down.
    pub leak: [Pos2; 2],
    /// Where the spill falls: from the rim down.
    pub spill: [Pos2; 2],
    /// A stream falls in where the reading would stand.
    pub fed_on_the_right: bool,
    /// Setpoint in cm, where a loop holds this tank.
    pub setpoint_cm: Option<f64>,
}

/// A stream as drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct StreamView {
    /// Corners on the screen, in the direction of a positive flow.
    pub pipe: Vec<Pos2>,
    /// Flow in cm³/s; negative against the pipe's direction.
    pub flow_cm3_s: f64,
    /// Where the falling water ends, on the surface of its tank.
    pub falls_to: Option<Pos2>,
    /// It leaves the drawing.
    pub to_outside: bool,
}

impl StreamView {
    /// −1, 0 or 1: against the pipe, at rest, along it.
    #[must_use]
    pub fn direction(&self) -> i8 {
        if self.flow_cm3_s.abs() < STILL_CM3_S {
            0
        } else if self.flow_cm3_s > 0.0 {
            1
        } else {
            -1
        }
    }
}

/// A valve as drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct ValveView {
    /// Tag.
    pub tag: String,
    /// Middle of the symbol.
    pub at: Pos2,
    /// On a pipe that runs down.
    pub vertical: bool,
    /// Its label stands below.
    pub label_below: bool,
    /// Angle in degrees.
    pub angle_deg: f64,
    /// Its stream.
    pub stream: StreamView,
}

/// A pump as drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct PumpView {
    /// Tag.
    pub tag: String,
    /// Middle of the symbol.
    pub at: Pos2,
    /// Input in its unit.
    pub input: f64,
    /// The unit's symbol.
    pub unit: &'static str,
    /// Its tank is empty.
    pub dry: bool,
    /// Water drawn in.
    pub suction: StreamView,
    /// Water on its way to the main tank.
    pub discharge: StreamView,
    /// Water on its way to the other tanks of a pump that splits its stream.
    pub branches: Vec<StreamView>,
    /// All that arrives, in cm³/s.
    pub arriving_cm3_s: f64,
    /// It can be set by hand: no loop in automatic writes it.
    pub by_hand: bool,
}

/// An instrument as drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct BubbleView {
    /// Tag.
    pub tag: String,
    /// Middle of the bubble.
    pub at: Pos2,
    /// Its signal is not to be trusted.
    pub abnormal: bool,
    /// Its mode stands to the left, clear of the pump's pipe.
    pub mode_on_the_left: bool,
    /// Manual (`Some(false)`), automatic (`Some(true)`), or no controller.
    pub automatic: Option<bool>,
    /// It takes its setpoint from another loop.
    pub cascade: bool,
}

/// The drawing.
#[derive(Debug, Clone, PartialEq)]
pub struct PidModel {
    /// Tanks.
    pub tanks: Vec<TankView>,
    /// Valves with their streams.
    pub valves: Vec<ValveView>,
    /// Pumps with their streams.
    pub pumps: Vec<PumpView>,
    /// Sensors, then controllers.
    pub bubbles: Vec<BubbleView>,
    /// Taps from tanks to their sensors.
    pub taps: Vec<[Pos2; 2]>,
    /// Signal lines of the loops in operation.
    pub signals: Vec<Vec<Pos2>>,
    /// Faults: where a badge stands, and what it says.
    pub faults: Vec<(Pos2, FaultKind)>,
    /// Pixels per grid unit.
    pub scale: f32,
}

impl PidModel {
    /// Lays the snapshot out in a rectangle of the screen.
    #[must_use]
    pub fn new(snapshot: &Snapshot, layout: &Layout, rect: Rect) -> Self {
        let frame = Frame::new(layout, rect);
        let tanks: Vec<TankView> =
            (0..snapshot.tanks.len()).map(|i| tank(snapshot, layout, &frame, i)).collect();
        let stream = |route: &Route, flow: f64| StreamView {
            pipe: route.pipe.iter().map(|p| frame.point(*p)).collect(),
            flow_cm3_s: flow,
            falls_to: route.falls_into.and_then(|t| {
                let x = frame.point(*route.pipe.last()?).x;
                Some(pos2(x, tanks[t].surface_y))
            }),
            to_outside: route.to_outside,
        };
        let spec = &snapshot.network.spec;
        let valves = (0..snapshot.valves.len())
            .map(|i| ValveView {
                tag: spec.valves[i].id.clone(),
                at: frame.point(layout.valves[i].at),
                vertical: layout.valves[i].vertical,
                label_below: layout.valves[i].label_below,
                angle_deg: snapshot.valves[i].angle_deg,
                stream: stream(&layout.valve_routes[i], snapshot.valves[i].flow_cm3_s),
            })
            .collect();
        let pumps = (0..snapshot.pumps.len())
            .map(|i| {
                let now = &snapshot.pumps[i];
                let share = |outlet: usize| snapshot.network.pumps[i].outlets[outlet].1;
                let suction = Route { pipe: layout.suctions[i].clone(), falls_into: None, to_outside: false };
                let automatic = snapshot.loops.iter().any(|l| l.pump == i && l.mode.is_controlling());
                PumpView {
                    tag: spec.pumps[i].id.clone(),
                    at: frame.point(layout.pumps[i]),
                    input: now.input,
                    unit: spec.pumps[i].unit.symbol(),
                    dry: now.dry,
                    suction: stream(&suction, now.pumped_cm3_s),
                    discharge: stream(&layout.discharges[i], share(0) * now.arriving_cm3_s),
                    branches: layout.branches[i]
                        .iter()
                        .enumerate()
                        .map(|(k, route)| stream(route, share(k + 1) * now.arriving_cm3_s))
                        .collect(),
                    arriving_cm3_s: now.arriving_cm3_s,
                    by_hand: !automatic,
                }
            })
            .collect();
        let (bubbles, signals) = instruments(snapshot, layout, &frame);
        let taps = layout.sensors.iter().zip(&snapshot.network.sensors);
        let taps = taps
            .map(|(at, s)| [pos2(layout.tanks[s.tank].right(), at.y), *at].map(|q| frame.point(q)))
            .collect();
        let mut made =
            Self { tanks, valves, pumps, bubbles, taps, signals, faults: vec![], scale: frame.scale() };
        made.place_faults(snapshot, rect);
        made
    }

    /// A badge at every part that is broken; several of one part stand below each other.
    fn place_faults(&mut self, snapshot: &Snapshot, rect: Rect) {
        let mut taken: Vec<&str> = vec![];
        for active in &snapshot.faults {
            let at = match FaultyPart::find(&snapshot.network, &active.tag) {
                Some(FaultyPart::Sensor(i)) => self.bubbles[i].at + vec2(0.0, 0.27 * self.scale.min(100.0)),
                Some(FaultyPart::Valve(i)) => self.valves[i].at + vec2(0.0, -0.24 * self.scale.min(100.0)),
                Some(FaultyPart::Tank(i)) => self.tanks[i].rect.center_bottom() - vec2(0.0, 14.0),
                Some(FaultyPart::Pump(i)) => self.pumps[i].at + vec2(0.0, 0.27 * self.scale.min(100.0)),
                Some(FaultyPart::Rig) | None => rect.center_top() + vec2(0.0, 10.0),
            };
            let below = taken.iter().filter(|tag| **tag == active.tag).count() as f32 * 18.0;
            taken.push(&active.tag);
            self.faults.push((at + vec2(0.0, below), active.fault.kind()));
        }
    }
}

fn tank(snapshot: &Snapshot, layout: &Layout, frame: &Frame, i: usize) -> TankView {
    let rect = frame.rect(layout.tanks[i]);
    let now = &snapshot.tanks[i];
    let height_cm = snapshot.network.tanks[i].height_cm;
    let share = (now.level_cm / height_cm).clamp(0.0, 1.0) as f32;
    let side = layout.spill_side[i];
    let x = if side < 0.0 { rect.left() - 5.0 } else { rect.right() + 5.0 };
    let bottom = match snapshot.network.tanks[i].spills_to {
        Some(to) => frame.rect(layout.tanks[to]).top(),
        None => rect.bottom() + 14.0,
    };
    let loops = snapshot.loops.iter().filter(|l| l.mode.is_controlling());
    let held = loops.into_iter().find(|l| snapshot.network.sensors[l.sensor].tank == i);
    TankView {
        tag: snapshot.network.spec.tanks[i].id.clone(),
        surface_y: rect.bottom() - share * rect.height(),
        rect,
        level_cm: now.level_cm,
        height_cm,
        spill_cm3_s: now.spill_cm3_s,
        leak_cm3_s: now.leak_cm3_s,
        leak: [0.0, 13.0].map(|down| pos2(rect.left() + 0.22 * rect.width(), rect.bottom() + down)),
        spill: [pos2(x, rect.top()), pos2(x, bottom)],
        fed_on_the_right: layout.discharges.iter().chain(layout.branches.iter().flatten()).any(|route| {
            let end = route.pipe.last().filter(|_| route.falls_into == Some(i));
            end.is_some_and(|end| end.x > layout.tanks[i].center().x + 0.1)
        }),
        setpoint_cm: held.map(|l| l.setpoint_cm),
    }
}

/// How many loops there are between this one and its pump.
fn depth(snapshot: &Snapshot, now: &LoopNow) -> usize {
    let mut target = now.target;
    let mut depth = 0;
    while let LoopTarget::Loop(inner) = target
        && depth < snapshot.loops.len()
    {
        target = snapshot.loops[inner].target;
        depth += 1;
    }
    depth
}

fn instruments(snapshot: &Snapshot, layout: &Layout, frame: &Frame) -> (Vec<BubbleView>, Vec<Vec<Pos2>>) {
    let spec = &snapshot.network.spec;
    let mut bubbles: Vec<BubbleView> = (0..spec.sensors.len())
        .map(|i| {
            let now = snapshot.loops.iter().find(|l| l.sensor == i);
            let alarmed = snapshot.alarms.iter().any(|a| {
                matches!(a, Alarm::SensorFault { .. } | Alarm::AboveRange { .. } | Alarm::BelowRange { .. })
                    && a.tag() == spec.sensors[i].id
            });
            BubbleView {
                tag: spec.sensors[i].id.clone(),
                at: frame.point(layout.sensors[i]),
                abnormal: alarmed || now.is_some_and(|l| l.status == ReadingStatus::Broken),
                mode_on_the_left: false,
                automatic: None,
                cascade: false,
            }
        })
        .collect();
    let mut signals = vec![];
    for now in &snapshot.loops {
        // The outer loop of a cascade stands above the loop whose setpoint it writes.
        let above = |depth: usize| layout.controllers[now.pump] - vec2(0.0, OUTER_ABOVE * depth as f32);
        let depth = depth(snapshot, now);
        let (sensor, controller) = (layout.sensors[now.sensor], above(depth));
        let pump = layout.pumps[now.pump];
        bubbles.push(BubbleView {
            tag: now.tag.clone(),
            at: frame.point(controller),
            abnormal: false,
            mode_on_the_left: snapshot.network.pumps[now.pump].from.is_some() && controller.x < pump.x,
            automatic: Some(now.mode.is_controlling()),
            cascade: now.mode == Mode::Cascade,
        });
        if depth > 0 {
            let corner = pos2(controller.x, sensor.y);
            let line = [sensor, corner, controller, above(depth - 1)];
            signals.push(line.into_iter().map(|p| frame.point(p)).collect());
            continue;
        }
        let down = snapshot.network.pumps[now.pump].from.is_some();
        let corner = if down { pos2(controller.x, pump.y - 0.06) } else { pos2(controller.x, pump.y - 0.14) };
        let end = pos2(pump.x, corner.y);
        let mut line = vec![sensor];
        let across = Rect::from_two_pos(sensor, pos2(controller.x, sensor.y)).expand2(vec2(0.0, 0.01));
        if layout.tanks.iter().any(|t| t.intersects(across)) {
            // Under the tanks of that row instead of through them.
            let row = layout.tanks.iter().filter(|t| t.y_range().contains(sensor.y)).map(Rect::bottom);
            let y = row.fold(sensor.y, f32::max) + 0.06;
            line.extend([pos2(sensor.x, y), pos2(controller.x, y)]);
        } else if sensor.x != controller.x && sensor.y != controller.y {
            line.push(pos2(controller.x, sensor.y));
        }
        line.extend([controller, corner, end]);
        if !down {
            line.push(pump);
        }
        signals.push(line.into_iter().map(|p| frame.point(p)).collect());
    }
    (bubbles, signals)
}
