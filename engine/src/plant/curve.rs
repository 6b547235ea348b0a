//! A pump's characteristic curve, taken apart into straight pieces.

/// Flow over input: linear between the points, constant outside.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Curve {
    /// From the lowest input to the highest; together they hold for every number.
    pieces: Vec<Piece>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Piece {
    /// Inputs it holds for: from the lower one to below the upper one.
    low: f64,
    high: f64,
    /// A point of the piece: input, and flow in cm³/s.
    input: f64,
    flow: f64,
    /// cm³/s per unit of the input.
    slope: f64,
}

impl Curve {
    /// The curve through points of input and flow in cm³/s, inputs rising; at least one point.
    pub fn new(points: &[[f64; 2]]) -> Self {
        let mut pieces = vec![];
        let mut low = f64::NEG_INFINITY;
        for (i, &[input, flow]) in points.iter().enumerate() {
            if i == 0 {
                pieces.push(Piece { low, high: input, input, flow, slope: 0.0 });
            }
            let next = points.get(i + 1);
            let slope = next.map_or(0.0, |[to, there]| (there - flow) / (to - input));
            low = input;
            pieces.push(Piece { low, high: next.map_or(f64::INFINITY, |p| p[0]), input, flow, slope });
        }
        Self { pieces }
    }

    /// Flow in cm³/s; the search begins at the piece where the last input lay.
    #[inline]
    pub fn flow_cm3_s(&self, input: f64, last: &mut usize) -> f64 {
        let mut at = (*last).min(self.pieces.len() - 1);
        while input < self.pieces[at].low && at > 0 {
            at -= 1;
        }
        while input >= self.pieces[at].high && at + 1 < self.pieces.len() {
            at += 1;
        }
        *last = at;
        let piece = &self.pieces[at];
        piece.flow + piece.slope * (input - piece.input)
    }
}
