//! Small symmetric matrices.

/// A square matrix, row by row.
pub(super) type Matrix = Vec<Vec<f64>>;

/// Returns the inverse of a positive definite matrix; `None` if it is none, up to rounding.
pub(super) fn inverse(matrix: &Matrix) -> Option<Matrix> {
    let size = matrix.len();
    // In units in which the diagonal is 1, the pivots tell how dependent the columns are.
    let scale: Vec<f64> = (0..size).map(|at| matrix[at][at].sqrt()).collect();
    if scale.iter().any(|scale| !scale.is_normal()) {
        return None;
    }
    let mut left: Matrix = (0..size)
        .map(|row| (0..size).map(|column| matrix[row][column] / (scale[row] * scale[column])).collect())
        .collect();
    let mut right: Matrix =
        (0..size).map(|row| (0..size).map(|column| f64::from(u8::from(row == column))).collect()).collect();
    for pivot in 0..size {
        let by = left[pivot][pivot];
        if by < 1e-12 {
            return None;
        }
        for values in [&mut left, &mut right] {
            values[pivot].iter_mut().for_each(|value| *value /= by);
        }
        for row in (0..size).filter(|row| *row != pivot) {
            let by = left[row][pivot];
            for values in [&mut left, &mut right] {
                let from = values[pivot].clone();
                values[row].iter_mut().zip(from).for_each(|(value, from)| *value -= by * from);
            }
        }
    }
    for (row, values) in right.iter_mut().enumerate() {
        values.iter_mut().enumerate().for_each(|(column, value)| *value /= scale[row] * scale[column]);
    }
    Some(right)
}
