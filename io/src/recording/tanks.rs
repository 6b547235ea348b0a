//! The tanks as shapes: walls and pipes once, the water whenever a level moves.

use rerun::{Boxes2D, Color, LineStrips2D};
use vasos_engine::plant::Network;

/// Distance of two columns of the rig file's drawing, in the cm of the tanks' height.
const COLUMN: f32 = 34.0;
/// Distance of two rows.
const ROW: f32 = 40.0;
/// Width of a tank that names none, in grid units.
const WIDTH: f32 = 0.62;
/// Outlines that fill a tank's water: the viewer fills no boxes, so that thick outlines are stacked.
const SLICES: usize = 3;
/// Level change in cm that is worth a new frame.
const VISIBLE_CM: f32 = 0.1;

/// Left, top, width and height of a tank; y grows downwards, one unit is 1 cm of level.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Place {
    left: f32,
    top: f32,
    width: f32,
    height: f32,
}

impl Place {
    fn middle(&self) -> f32 {
        self.left + self.width / 2.0
    }

    fn bottom(&self) -> f32 {
        self.top + self.height
    }
}

/// The drawing of a rig.
pub(super) struct Tanks {
    places: Vec<Place>,
    drawn_cm: Vec<f32>,
}

impl Tanks {
    pub fn new(network: &Network) -> Self {
        let places: Vec<Place> = (0..network.tanks.len()).map(|tank| place(network, tank)).collect();
        let drawn_cm = vec![f32::NAN; places.len()];
        Self { places, drawn_cm }
    }

    /// Walls with their tags.
    pub fn walls(&self, network: &Network) -> Boxes2D {
        let mins = self.places.iter().map(|p| [p.left, p.top]);
        let sizes = self.places.iter().map(|p| [p.width, p.height]);
        Boxes2D::from_mins_and_sizes(mins, sizes)
            .with_labels(network.spec.tanks.iter().map(|t| t.id.as_str()))
            .with_show_labels(true)
            .with_colors([Color::from_rgb(200, 205, 215)])
            .with_draw_order(10.0)
    }

    /// Pipes with the tags of their valves and pumps.
    pub fn pipes(&self, network: &Network) -> LineStrips2D {
        let mut strips: Vec<Vec<[f32; 2]>> = Vec::new();
        let mut labels = Vec::new();
        let mut colors = Vec::new();
        for valve in &network.spec.valves {
            let Some(from) = network.tank(&valve.from).map(|i| self.places[i]) else { continue };
            let to = valve.to.as_ref().and_then(|id| network.tank(id)).map(|i| self.places[i]);
            strips.push(valve_pipe(from, to));
            labels.push(valve.id.clone());
            colors.push(Color::from_rgb(130, 140, 155));
        }
        for (pump, spec) in network.pumps.iter().zip(&network.spec.pumps) {
            let from = pump.from.map(|i| self.places[i]);
            for (outlet, &(tank, _)) in pump.outlets.iter().enumerate() {
                strips.push(pump_pipe(from, self.places[tank], outlet));
                labels.push(spec.id.clone());
                colors.push(Color::from_rgb(110, 205, 130));
            }
        }
        LineStrips2D::new(strips).with_labels(labels).with_show_labels(true).with_colors(colors)
    }

    /// Whether there is a frame.
    pub fn is_drawn(&self) -> bool {
        self.drawn_cm.iter().all(|level| level.is_finite())
    }

    /// Whether a level has moved visibly since the last frame.
    pub fn moved(&self, levels_cm: &[f32]) -> bool {
        self.drawn_cm.iter().zip(levels_cm).any(|(a, b)| a.is_nan() || (a - b).abs() >= VISIBLE_CM)
    }

    /// The water of one frame, [`SLICES`] outlines for each tank.
    pub fn frame(&mut self, levels_cm: &[f32]) -> Vec<WaterBox> {
        self.drawn_cm.clear();
        self.drawn_cm.extend_from_slice(levels_cm);
        let mut boxes = Vec::with_capacity(self.places.len() * SLICES);
        for (place, level) in self.places.iter().zip(levels_cm) {
            let level = level.clamp(0.0, place.height);
            let slice = level / SLICES as f32;
            // Lines of half the slice's height, a quarter away from its middle, fill it.
            let radius = (slice / 4.0).max(1e-3);
            for k in 0..SLICES {
                let y = place.bottom() - (k as f32 + 0.5) * slice;
                let half = [place.width / 2.0 - radius, slice / 4.0];
                boxes.push(WaterBox { center: [place.middle(), y], half, radius });
            }
        }
        boxes
    }

    /// What does not change about the water.
    pub fn water_style() -> Boxes2D {
        Boxes2D::update_fields().with_colors([Color::from_rgb(60, 130, 210)]).with_draw_order(0.0)
    }
}

/// One outline of the water.
pub(super) struct WaterBox {
    /// Middle.
    pub center: [f32; 2],
    /// Half its width and height.
    pub half: [f32; 2],
    /// Half the width of its line.
    pub radius: f32,
}

fn place(network: &Network, tank: usize) -> Place {
    let spec = &network.spec.tanks[tank];
    let [column, row] = spec.at.unwrap_or([tank as f64 + 1.0, 1.0]);
    let width = spec.width.map_or(WIDTH, |w| w as f32 - 0.38) * COLUMN;
    let height = spec.height_cm as f32;
    let bottom = row as f32 * ROW;
    Place { left: column as f32 * COLUMN - width / 2.0, top: bottom - height, width, height }
}

/// From a tank, or from outside, over the rim of the one it feeds; pipes of one pump run side by side.
fn pump_pipe(from: Option<Place>, to: Place, outlet: usize) -> Vec<[f32; 2]> {
    let aside = 2.0 * outlet as f32;
    let over = to.top - 8.0 - aside;
    let x = to.left + 0.25 * to.width + aside;
    let mut strip = match from {
        Some(from) => {
            let side = from.left.min(to.left) - 8.0 - aside;
            let y = from.bottom() - 4.0;
            vec![[from.left, y], [side, y], [side, over]]
        }
        None => vec![[to.left - 10.0, over]],
    };
    strip.extend([[x, over], [x, to.top + 1.0]]);
    strip
}

/// From the bottom of a tank into the one below, to its neighbour's side, or out.
fn valve_pipe(from: Place, to: Option<Place>) -> Vec<[f32; 2]> {
    let x = from.left + 0.5 * from.width;
    match to {
        None => vec![[x, from.bottom()], [x, from.bottom() + 8.0]],
        Some(to) if (to.bottom() - from.bottom()).abs() < 1.0 => {
            let y = from.bottom() - 2.0;
            if to.left > from.left {
                vec![[from.left + from.width, y], [to.left, y]]
            } else {
                vec![[from.left, y], [to.left + to.width, y]]
            }
        }
        Some(to) => {
            let x_to = x.clamp(to.left + 1.0, to.left + to.width - 1.0);
            let y = to.top - 4.0;
            vec![[x, from.bottom()], [x, y], [x_to, y], [x_to, to.top + 1.0]]
        }
    }
}
