//! Products of long columns, some rows at a time.
//!
//! Columns are as long as the recordings, and there are tens of them: taken pair by pair, each would come from memory as often as
//! there are others. Of some rows all columns stay near the processor until every product has been made of them.

use nalgebra::DMatrix;

/// Rows taken at a time: of twenty columns they fill a sixth of the nearest 512 KiB.
const ROWS: usize = 512;

/// Sums kept apart within a product, so that one addition need not wait for another.
const APART: usize = 8;

/// The ranges of rows that are taken at a time.
fn ranges(rows: usize) -> impl Iterator<Item = std::ops::Range<usize>> {
    (0..rows).step_by(ROWS).map(move |from| from..(from + ROWS).min(rows))
}

/// The sum of the products of two columns' rows.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (a, a_rest) = a.as_chunks::<APART>();
    let (b, b_rest) = b.as_chunks::<APART>();
    let mut sums = [0.0; APART];
    for (a, b) in a.iter().zip(b) {
        for ((sum, a), b) in sums.iter_mut().zip(a).zip(b) {
            *sum += a * b;
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f64>() + rest
}

/// Products of all `columns` with each other; each pair is multiplied once.
pub(crate) fn gram(columns: &[&[f64]]) -> DMatrix<f64> {
    let count = columns.len();
    let mut products = DMatrix::zeros(count, count);
    for rows in ranges(columns.first().map_or(0, |column| column.len())) {
        for j in 0..count {
            let right = &columns[j][rows.clone()];
            for i in j..count {
                products[(i, j)] += dot(&columns[i][rows.clone()], right);
            }
        }
    }
    products.fill_upper_triangle_with_lower_triangle();
    products
}

/// `left' right`: one row a column of `left`.
pub(crate) fn products(left: &[&[f64]], right: &[&[f64]]) -> DMatrix<f64> {
    let mut products = DMatrix::zeros(left.len(), right.len());
    for rows in ranges(left.first().or(right.first()).map_or(0, |column| column.len())) {
        for (j, right) in right.iter().enumerate() {
            let right = &right[rows.clone()];
            for (i, left) in left.iter().enumerate() {
                products[(i, j)] += dot(&left[rows.clone()], right);
            }
        }
    }
    products
}

/// Takes `basis along` out of `columns`.
pub(crate) fn take_out(columns: &mut [&mut [f64]], basis: &[&[f64]], along: &DMatrix<f64>) {
    for rows in ranges(columns.first().map_or(0, |column| column.len())) {
        for (j, column) in columns.iter_mut().enumerate() {
            let column = &mut column[rows.clone()];
            for (i, direction) in basis.iter().enumerate() {
                let share = along[(i, j)];
                column.iter_mut().zip(&direction[rows.clone()]).for_each(|(value, part)| *value -= share * part);
            }
        }
    }
}

/// The columns of a matrix, one slice each.
pub(crate) fn slices(matrix: &DMatrix<f64>) -> Vec<&[f64]> {
    let rows = matrix.nrows();
    (0..matrix.ncols()).map(|k| &matrix.as_slice()[k * rows..(k + 1) * rows]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(rows: usize, columns: usize, salt: u32) -> DMatrix<f64> {
        DMatrix::from_fn(rows, columns, |i, j| f64::from((i as u32 * 7_919 + j as u32 * 104_729 + salt) % 1_009) - 500.0)
    }

    #[test]
    fn are_those_of_whole_columns_whatever_their_length() {
        for rows in [0, 1, 7, 8, ROWS - 1, ROWS, ROWS + 1, 3 * ROWS + 5] {
            let (a, b) = (drawn(rows, 5, 1), drawn(rows, 3, 2));
            // Whole numbers: any order of adding gives the same bits.
            assert_eq!(gram(&slices(&a)), a.transpose() * &a, "{rows} rows");
            assert_eq!(products(&slices(&a), &slices(&b)), a.transpose() * &b, "{rows} rows");
            let along = drawn(5, 3, 3);
            let mut left = b.clone();
            let mut columns: Vec<&mut [f64]> = left.as_mut_slice().chunks_mut(rows.max(1)).collect();
            take_out(&mut columns, &slices(&a), &along);
            assert_eq!(left, &b - &a * along, "{rows} rows");
        }
    }
}
