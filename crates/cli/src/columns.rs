//! Tables whose columns stay aligned, however long a cell is.

/// On which side of its column a cell stands, and how wide the column is at least.
#[derive(Clone, Copy)]
pub enum Column {
    /// To the left: words.
    Left(usize),
    /// To the right: numbers.
    Right(usize),
}

/// Pads every cell to the width of its column, which is that of its widest cell.
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
