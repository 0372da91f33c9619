//! Tables whose columns stay aligned, whatever the length of the cells.

/// The side of its column on which a cell stands, and the least width of the column.
#[derive(Clone, Copy)]
pub enum Column {
    /// On the left: words.
    Left(usize),
    /// On the right: numbers.
    Right(usize),
}

/// Pads every cell to the width of its column: that of the widest cell, but at least that of the [`Column`].
pub fn aligned<const N: usize>(columns: [Column; N], mut rows: Vec<[String; N]>) -> Vec<[String; N]> {
    for (index, column) in columns.into_iter().enumerate() {
        let (Column::Left(least) | Column::Right(least)) = column;
        let width = rows.iter().map(|row| row[index].chars().count()).fold(least, usize::max);
        for row in &mut rows {
            row[index] = match column {
                Column::Left(_) => format!("{:<width$}", row[index]),
                Column::Right(_) => format!("{:>width$}", row[index]),
            };
        }
    }
    rows
}
