//! Which state acts on which: the graph behind a matrix, from its exact zeros alone.

use nalgebra::DMatrix;

/// Ways from state to state; `reach[j][i]` when state j acts on state i, directly or through others, or is i.
#[derive(Debug, Clone)]
pub(crate) struct Pattern {
    reach: Vec<Vec<bool>>,
}

impl Pattern {
    /// The transitive closure of `a`'s non-zero entries (Warshall's algorithm).
    pub fn of(a: &DMatrix<f64>) -> Self {
        let n = a.nrows();
        let mut reach: Vec<Vec<bool>> =
            (0..n).map(|j| (0..n).map(|i| i == j || a[(i, j)] != 0.0).collect()).collect();
        for k in 0..n {
            let through = reach[k].clone();
            for row in &mut reach {
                if row[k] {
                    for (way, on) in row.iter_mut().zip(&through) {
                        *way |= on;
                    }
                }
            }
        }
        Self { reach }
    }

    /// States that some column of `b` reaches and some row of `c` shows, in rising order.
    pub fn between(&self, b: &DMatrix<f64>, c: &DMatrix<f64>) -> Vec<usize> {
        let n = self.reach.len();
        let driven: Vec<usize> = (0..n).filter(|&i| b.row(i).iter().any(|v| *v != 0.0)).collect();
        let shown: Vec<usize> = (0..n).filter(|&i| c.column(i).iter().any(|v| *v != 0.0)).collect();
        (0..n)
            .filter(|&i| driven.iter().any(|&j| self.reach[j][i]) && shown.iter().any(|&o| self.reach[i][o]))
            .collect()
    }

    /// Groups of states that act on each other: the diagonal blocks of the block-triangular form.
    pub fn blocks(&self) -> Vec<Vec<usize>> {
        let n = self.reach.len();
        let mut blocks: Vec<Vec<usize>> = Vec::new();
        for i in 0..n {
            match blocks.iter_mut().find(|b| self.reach[b[0]][i] && self.reach[i][b[0]]) {
                Some(block) => block.push(i),
                None => blocks.push(vec![i]),
            }
        }
        blocks
    }
}

/// The parts of A, B and C that belong to some of the states.
pub(crate) fn submatrix(
    a: &DMatrix<f64>,
    b: &DMatrix<f64>,
    c: &DMatrix<f64>,
    states: &[usize],
) -> (DMatrix<f64>, DMatrix<f64>, DMatrix<f64>) {
    let n = states.len();
    (
        DMatrix::from_fn(n, n, |i, j| a[(states[i], states[j])]),
        DMatrix::from_fn(n, b.ncols(), |i, j| b[(states[i], j)]),
        DMatrix::from_fn(c.nrows(), n, |i, j| c[(i, states[j])]),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cascade_has_one_block_a_tank_and_a_pair_has_one() {
        let a = DMatrix::from_row_slice(3, 3, &[-1.0, 0.0, 0.0, 1.0, -2.0, 0.5, 0.0, 2.0, -3.0]);
        let pattern = Pattern::of(&a);
        assert_eq!(pattern.blocks(), vec![vec![0], vec![1, 2]]);
        let b = DMatrix::from_row_slice(3, 1, &[0.0, 1.0, 0.0]);
        let c = DMatrix::from_row_slice(1, 3, &[1.0, 0.0, 0.0]);
        assert!(pattern.between(&b, &c).is_empty(), "nothing flows up");
        assert_eq!(pattern.between(&c.transpose(), &b.transpose()), vec![0, 1, 2]);
    }
}
