//! A pump's characteristic curve, taken apart into straight pieces.

/// Flow over input: linear between the points, constant outside.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Curve {
    /// From the lowest input to the highest; together they hold for every number.
    pieces: Vec<Piece>,
    /// Lowest input, and pieces per unit of the input where all are about as long: an input's piece is no search then.
    even: Option<(f64, f64)>,
}

/// How much the pieces of a curve may differ in length to count as equally long, as a share of it.
const EVEN: f64 = 1e-3;

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
        let span = points[points.len() - 1][0] - points[0][0];
        let length = span / (points.len() - 1).max(1) as f64;
        let even = points.windows(2).all(|w| (w[1][0] - w[0][0] - length).abs() <= EVEN * length);
        Self { pieces, even: (even && length > 0.0).then(|| (points[0][0], 1.0 / length)) }
    }

    /// Flow in cm³/s; the search begins where the piece must be about, or at the piece where the last input lay.
    #[inline]
    pub fn flow_cm3_s(&self, input: f64, last: &mut usize) -> f64 {
        let about = match self.even {
            // The conversion stops at both ends of its range.
            Some((low, per_input)) => (((input - low) * per_input + 1.0) as i32).max(0) as usize,
            None => *last,
        };
        let mut at = about.min(self.pieces.len() - 1);
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
