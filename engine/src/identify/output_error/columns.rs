//! A model's columns over a piece of the record, and their inner products.

/// Rows a block of columns holds.
pub(in crate::identify) const ROWS: usize = 64;

/// Columns of up to [`ROWS`] rows; unused rows are zero.
#[derive(Debug, Clone)]
pub(in crate::identify) struct Columns {
    /// Values, one array a column.
    pub values: Vec<[f64; ROWS]>,
    /// Columns that hold anything but zeros.
    pub alive: Vec<bool>,
    /// Rows in use.
    pub rows: usize,
}

impl Columns {
    pub fn zero(count: usize) -> Self {
        Self { values: vec![[0.0; ROWS]; count], alive: vec![true; count], rows: 0 }
    }

    /// Takes rows out of every column: those the mask marks with `false`, and those beyond the last.
    pub fn clear(&mut self, keep: Option<&[bool]>) {
        let rows = self.rows;
        for (column, _) in self.values.iter_mut().zip(&self.alive).filter(|(_, alive)| **alive) {
            column[rows..].fill(0.0);
            if let Some(keep) = keep {
                for (value, keep) in column.iter_mut().zip(keep) {
                    if !keep {
                        *value = 0.0;
                    }
                }
            }
        }
    }
}

/// Symmetric inner products of columns.
#[derive(Debug, Clone)]
pub(in crate::identify) struct Gram {
    count: usize,
    products: Vec<f64>,
    arch: pulp::Arch,
}

impl Gram {
    pub fn zero(count: usize) -> Self {
        Self { count, products: vec![0.0; count * count], arch: pulp::Arch::new() }
    }

    /// Adds the rows of a block.
    pub fn add(&mut self, columns: &Columns) {
        self.arch.dispatch(Add { count: self.count, products: &mut self.products, columns });
    }

    pub fn at(&self, i: usize, j: usize) -> f64 {
        self.products[i.min(j) * self.count + i.max(j)]
    }
}

/// A block on its way into the products, in the widest vectors of this computer. Sums are taken in eight lanes whatever
/// the width and nothing is fused, so that every computer gives the same bits.
struct Add<'a> {
    count: usize,
    products: &'a mut [f64],
    columns: &'a Columns,
}

impl pulp::NullaryFnOnce for Add<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Columns { values, alive, .. } = self.columns;
        for i in (0..self.count).filter(|&i| alive[i]) {
            let row = &mut self.products[i * self.count..(i + 1) * self.count];
            let others = values.iter().zip(alive);
            for (sum, (b, _)) in row.iter_mut().zip(others).skip(i).filter(|(_, (_, alive))| **alive) {
                *sum += dot(&values[i], b);
            }
        }
    }
}

/// Σ a b over a block, in eight lanes.
#[inline(always)]
pub(in crate::identify) fn dot(a: &[f64; ROWS], b: &[f64; ROWS]) -> f64 {
    let mut lanes = [0.0; 8];
    for i in (0..ROWS).step_by(8) {
        for (lane, sum) in lanes.iter_mut().enumerate() {
            *sum += a[i + lane] * b[i + lane];
        }
    }
    ((lanes[0] + lanes[1]) + (lanes[2] + lanes[3])) + ((lanes[4] + lanes[5]) + (lanes[6] + lanes[7]))
}
