//! Invariant zeros of a state space by orthogonal reduction.

use nalgebra::{ColPivQR, DMatrix};
use num_complex::Complex64;

use super::eigen::eigenvalues;

/// Rank decisions: entries below this many roundings of the system's norm count as none.
const ROUNDINGS: f64 = 100.0;

/// The s at which `[sI − A, B; −C, D]` loses rank: transmission zeros, and decoupling zeros where the system is not
/// minimal. A n×n, B n×m, C p×n, D p×m; none for a system without inputs or outputs.
///
/// The reduction takes out the zeros at infinity until D is square and regular; the zeros are the eigenvalues of
/// A − B D⁻¹ C. Source: Emami-Naeini & Van Dooren, Automatica 18 (1982) 415.
pub(crate) fn invariant_zeros(
    a: DMatrix<f64>,
    b: DMatrix<f64>,
    c: DMatrix<f64>,
    d: DMatrix<f64>,
) -> Vec<Complex64> {
    if b.ncols() == 0 || c.nrows() == 0 {
        return Vec::new();
    }
    let norm = [&a, &b, &c, &d].iter().map(|m| m.norm_squared()).sum::<f64>().sqrt();
    let tolerance = ROUNDINGS * f64::EPSILON * norm;
    let first = System { a, b, c, d }.reduced(tolerance);
    let System { a, b, c, d } = first.dual().reduced(tolerance).dual();
    if a.nrows() == 0 || d.nrows() != d.ncols() {
        return Vec::new();
    }
    if d.nrows() == 0 {
        return eigenvalues(&a);
    }
    match d.lu().solve(&c) {
        Some(x) => eigenvalues(&(a - b * x)),
        None => Vec::new(),
    }
}

struct System {
    a: DMatrix<f64>,
    b: DMatrix<f64>,
    c: DMatrix<f64>,
    d: DMatrix<f64>,
}

impl System {
    fn dual(self) -> Self {
        Self { a: self.a.transpose(), b: self.c.transpose(), c: self.b.transpose(), d: self.d.transpose() }
    }

    /// Takes states and outputs out until D has full row rank, the finite zeros kept.
    fn reduced(self, tolerance: f64) -> Self {
        let Self { mut a, mut b, mut c, mut d } = self;
        loop {
            let (states, outputs) = (a.nrows(), d.nrows());
            let (rotate, rank) = row_compression(&d, tolerance);
            if rank == outputs {
                return Self { a, b, c, d };
            }
            d = (&rotate * d).rows(0, rank).into_owned();
            let mut rotated = rotate * c;
            // What counts as nothing has to be nothing: turned towards a small coupling it would grow with every step.
            rotated.iter_mut().filter(|v| v.abs() <= tolerance).for_each(|v| *v = 0.0);
            let (kept, lower) =
                (rotated.rows(0, rank).into_owned(), rotated.rows(rank, outputs - rank).into_owned());
            // Columns that the outputs without feedthrough show come first.
            let (turn, shown) = row_compression(&lower.transpose(), tolerance);
            if shown == 0 {
                return Self { a, b, c: kept, d };
            }
            if shown == states {
                // No finite zero is left.
                let empty = DMatrix::zeros(0, 0);
                return Self { a: empty.clone(), b: empty.clone(), c: empty.clone(), d: empty };
            }
            let back = turn.transpose();
            a = &turn * a * &back;
            b = &turn * b;
            let kept = kept * back;
            let hidden = states - shown;
            let (m, rows) = (b.ncols(), rank + shown);
            let mut next_c = DMatrix::zeros(rows, hidden);
            next_c.view_mut((0, 0), (rank, hidden)).copy_from(&kept.columns(shown, hidden));
            next_c.view_mut((rank, 0), (shown, hidden)).copy_from(&a.view((0, shown), (shown, hidden)));
            let mut next_d = DMatrix::zeros(rows, m);
            next_d.view_mut((0, 0), (rank, m)).copy_from(&d);
            next_d.view_mut((rank, 0), (shown, m)).copy_from(&b.rows(0, shown));
            a = a.view((shown, shown), (hidden, hidden)).into_owned();
            b = b.rows(shown, hidden).into_owned();
            (c, d) = (next_c, next_d);
        }
    }
}

/// An orthogonal U for which U·M has its rank many independent rows first and none after, and that rank.
fn row_compression(m: &DMatrix<f64>, tolerance: f64) -> (DMatrix<f64>, usize) {
    let rows = m.nrows();
    let mut rotate = DMatrix::identity(rows, rows);
    if rows == 0 || m.ncols() == 0 {
        return (rotate, 0);
    }
    let qr = ColPivQR::new(m.clone());
    let r = qr.r();
    let rank = (0..r.nrows().min(r.ncols())).filter(|&i| r[(i, i)].abs() > tolerance).count();
    qr.q_tr_mul(&mut rotate);
    (rotate, rank)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sorted(a: &[f64], b: &[f64], c: &[f64], d: f64) -> Vec<f64> {
        let n = b.len();
        let mut zeros: Vec<f64> = invariant_zeros(
            DMatrix::from_row_slice(n, n, a),
            DMatrix::from_column_slice(n, 1, b),
            DMatrix::from_row_slice(1, n, c),
            DMatrix::from_element(1, 1, d),
        )
        .iter()
        .map(|z| z.re)
        .collect();
        zeros.sort_by(f64::total_cmp);
        zeros
    }

    #[test]
    fn zeros_of_companion_forms_are_the_roots_of_their_numerators() {
        // (s + 2)(s − 5)/(s³ + 6 s² + 11 s + 6)
        let a = [0.0, 1.0, 0.0, 0.0, 0.0, 1.0, -6.0, -11.0, -6.0];
        let zeros = sorted(&a, &[0.0, 0.0, 1.0], &[-10.0, -3.0, 1.0], 0.0);
        assert!(
            zeros.len() == 2 && (zeros[0] + 2.0).abs() < 1e-12 && (zeros[1] - 5.0).abs() < 1e-12,
            "{zeros:?}"
        );
        // As many zeros as poles: 2 + 1/(s + 1) = (2 s + 3)/(s + 1)
        assert_eq!(sorted(&[-1.0], &[1.0], &[1.0], 2.0), vec![-1.5]);
        // No zero at all.
        assert!(sorted(&a, &[0.0, 0.0, 1.0], &[1.0, 0.0, 0.0], 0.0).is_empty());
    }

    #[test]
    fn a_square_system_has_the_zeros_of_its_determinant() {
        // G = [1/(s+1), 2/(s+3); 1/(s+1), 1/(s+1)]: det = ((s+3) − 2(s+1))/((s+1)²(s+3)), zero at s = 1.
        let a = DMatrix::from_diagonal(&nalgebra::DVector::from_vec(vec![-1.0, -3.0, -1.0]));
        let b = DMatrix::from_row_slice(3, 2, &[1.0, 0.0, 0.0, 1.0, 0.0, 1.0]);
        let c = DMatrix::from_row_slice(2, 3, &[1.0, 2.0, 0.0, 1.0, 0.0, 1.0]);
        let zeros = invariant_zeros(a, b, c, DMatrix::zeros(2, 2));
        assert!(zeros.len() == 1 && (zeros[0] - 1.0).norm() < 1e-12, "{zeros:?}");
    }
}
