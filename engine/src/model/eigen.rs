//! Eigenvalues of small real matrices.

use nalgebra::linalg::balancing::balance_parlett_reinsch;
use nalgebra::{DMatrix, Schur};
use num_complex::Complex64;

use super::roots::push_roots;
use super::structure::Pattern;

/// Steps of the QR iteration for each row of a block; some three suffice in practice.
const STEPS_PER_ROW: usize = 200;

/// All eigenvalues of a square matrix, in no order.
///
/// Each diagonal block of the block-triangular form that the zeros of `a` allow is solved by itself: one and two rows
/// in closed form, more by the balanced QR iteration, or by the characteristic polynomial where that does not settle.
pub(crate) fn eigenvalues(a: &DMatrix<f64>) -> Vec<Complex64> {
    let mut found = Vec::with_capacity(a.nrows());
    for block in Pattern::of(a).blocks() {
        match *block.as_slice() {
            [i] => found.push(Complex64::new(a[(i, i)], 0.0)),
            [i, j] => found.extend(of_two([[a[(i, i)], a[(i, j)]], [a[(j, i)], a[(j, j)]]])),
            _ => found
                .extend(of_block(DMatrix::from_fn(block.len(), block.len(), |i, j| a[(block[i], block[j])]))),
        }
    }
    found
}

fn of_two([[a, b], [c, d]]: [[f64; 2]; 2]) -> [Complex64; 2] {
    let (mean, half) = (0.5 * (a + d), 0.5 * (a - d));
    let square = half * half + b * c;
    if square < 0.0 {
        let root = Complex64::new(mean, (-square).sqrt());
        return [root, root.conj()];
    }
    let root = square.sqrt();
    let large = mean + root.copysign(mean);
    // The product of both is the determinant; the sum would cancel.
    let small = if large == 0.0 { 0.0 } else { (a * d - b * c) / large };
    [Complex64::new(large, 0.0), Complex64::new(small, 0.0)]
}

fn of_block(a: DMatrix<f64>) -> Vec<Complex64> {
    let mut balanced = a.clone();
    balance_parlett_reinsch(&mut balanced);
    match Schur::try_new(balanced, f64::EPSILON, STEPS_PER_ROW * a.nrows()) {
        Some(schur) => schur.complex_eigenvalues().iter().copied().collect(),
        None => {
            let mut roots = Vec::with_capacity(a.nrows());
            push_roots(&characteristic(&a), &mut roots);
            roots
        }
    }
}

/// det(λI − A) in falling powers, by Faddeev and Le Verrier.
fn characteristic(a: &DMatrix<f64>) -> Vec<f64> {
    let n = a.nrows();
    let mut coefficients = vec![1.0];
    let mut m = DMatrix::identity(n, n);
    for k in 1..=n {
        let am = a * &m;
        let c = -am.trace() / k as f64;
        coefficients.push(c);
        m = am + DMatrix::identity(n, n) * c;
    }
    coefficients
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_tanks_in_a_row_have_equal_poles_to_the_last_digit() {
        let a = DMatrix::from_row_slice(3, 3, &[-0.1, 0.0, 0.0, 0.1, -0.1, 0.0, 0.0, 0.1, -0.1]);
        assert!(eigenvalues(&a).iter().all(|p| *p == Complex64::new(-0.1, 0.0)));
    }

    #[test]
    fn both_ways_agree_on_a_full_matrix() {
        let a = DMatrix::from_fn(5, 5, |i, j| ((3 * i + 5 * j + i * j) % 7) as f64 - 3.0);
        let mut polynomial = Vec::new();
        push_roots(&characteristic(&a), &mut polynomial);
        for value in eigenvalues(&a) {
            let nearest = polynomial.iter().map(|r| (r - value).norm()).fold(f64::INFINITY, f64::min);
            assert!(nearest < 1e-9, "{value} missed by {nearest}");
        }
    }
}
