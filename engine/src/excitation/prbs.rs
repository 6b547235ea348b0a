//! Pseudo-random binary sequences of maximum length.

/// Lengths of register there are taps for.
pub(super) const REGISTERS: [u32; 2] = [2, 11];

/// Stages fed back for n = 2 to 11, as bits from the first stage: primitive polynomials, so that the register runs
/// through all its states but zero.
///
/// Source: Alfke, XAPP 052 (Xilinx, 1996), table 3; n = 2 is the only polynomial there is.
const TAPS: [u32; 10] = [
    0b11,
    0b110,
    0b1100,
    0b1_0100,
    0b11_0000,
    0b110_0000,
    0b1011_1000,
    0b1_0001_0000,
    0b10_0100_0000,
    0b101_0000_0000,
];

/// A linear feedback shift register.
#[derive(Debug, Clone)]
pub(super) struct ShiftRegister {
    state: u32,
    taps: u32,
    mask: u32,
    last: u32,
}

impl ShiftRegister {
    /// All ones; `length` within [`REGISTERS`].
    pub fn new(length: u32) -> Self {
        let length = length.clamp(REGISTERS[0], REGISTERS[1]);
        let mask = (1 << length) - 1;
        Self { state: mask, taps: TAPS[(length - REGISTERS[0]) as usize], mask, last: 1 << (length - 1) }
    }

    /// The next sign of the sequence, +1 or −1.
    pub fn next_sign(&mut self) -> f64 {
        let sign = if self.state & self.last == 0 { -1.0 } else { 1.0 };
        let fed_back = (self.state & self.taps).count_ones() & 1;
        self.state = ((self.state << 1) | fed_back) & self.mask;
        sign
    }
}

/// Bits of a sequence from a register of `length` stages, 2ⁿ − 1.
#[must_use]
pub fn prbs_length(length: u32) -> usize {
    (1 << length.clamp(REGISTERS[0], REGISTERS[1])) - 1
}

/// One period of the sequence from a register of `length` stages, 2 to 11, as ±1.
///
/// Its autocorrelation over a period of N is 1 at no shift and −1/N at every other.
#[must_use]
pub fn prbs_signs(length: u32) -> Vec<f64> {
    let mut register = ShiftRegister::new(length);
    (0..prbs_length(length)).map(|_| register.next_sign()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_register_gives_a_sequence_of_maximum_length() {
        for length in REGISTERS[0]..=REGISTERS[1] {
            let signs = prbs_signs(length);
            let count = signs.len();
            assert_eq!(count, (1 << length) - 1);
            assert_eq!(signs.iter().sum::<f64>().abs(), 1.0, "one more of one sign, n = {length}");
            for shift in 1..count {
                let product: f64 = (0..count).map(|i| signs[i] * signs[(i + shift) % count]).sum();
                assert_eq!(product, -1.0, "autocorrelation at {shift}, n = {length}");
            }
        }
    }
}
