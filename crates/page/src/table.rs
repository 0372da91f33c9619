//! Tables with one list of columns for text, JSON, CSV and Parquet.

use std::borrow::Borrow;
use std::io::{self, Write};

use serde_json::{Map, Value as Json};

use crate::cell::Cell;
use crate::put;

/// The type of a column's values. Text stands on the left of its column, numbers on the right.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Kind {
    /// Texts.
    Text,
    /// Whole numbers.
    Integer,
    /// Numbers.
    Number,
    /// Yes or no.
    Flag,
}

/// A rendering in which a column has a place.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Place {
    /// Text.
    Text,
    /// JSON.
    Json,
    /// CSV, and Parquet.
    File,
}

/// A column: its key in JSON and files, its head and unit in text. The texts of the last column may have several lines.
#[derive(Clone, Debug)]
pub struct Column {
    pub(crate) key: String,
    file_key: String,
    head: String,
    unit: String,
    kind: Kind,
    least: usize,
    places: Vec<Place>,
}

impl Column {
    fn new(key: &str, head: &str, kind: Kind) -> Self {
        let places = vec![Place::Text, Place::Json, Place::File];
        Self { key: key.into(), file_key: key.into(), head: head.into(), unit: String::new(), kind, least: 0, places }
    }

    /// Returns a column of texts.
    pub fn text(key: &str, head: &str) -> Self {
        Self::new(key, head, Kind::Text)
    }

    /// Returns a column of numbers.
    pub fn number(key: &str, head: &str) -> Self {
        Self::new(key, head, Kind::Number)
    }

    /// Returns a column of whole numbers.
    pub fn integer(key: &str, head: &str) -> Self {
        Self::new(key, head, Kind::Integer)
    }

    /// Returns a column of flags.
    pub fn flag(key: &str, head: &str) -> Self {
        Self::new(key, head, Kind::Flag)
    }

    /// Says the unit, which follows the head.
    #[must_use]
    pub fn unit(self, unit: &str) -> Self {
        Self { unit: unit.into(), ..self }
    }

    /// Gives the column another name in CSV and Parquet than its key in JSON.
    #[must_use]
    pub fn file(self, key: &str) -> Self {
        Self { file_key: key.into(), ..self }
    }

    /// Makes the column at least so wide in text, so that a table that is shown row by row stays aligned.
    #[must_use]
    pub fn least(self, least: usize) -> Self {
        Self { least, ..self }
    }

    /// Leaves the column out of all renderings but these.
    #[must_use]
    pub fn only(self, places: &[Place]) -> Self {
        Self { places: places.to_vec(), ..self }
    }

    /// Leaves the column out of text.
    #[must_use]
    pub fn data(self) -> Self {
        self.only(&[Place::Json, Place::File])
    }

    /// Leaves the column out of all renderings but text.
    #[must_use]
    pub fn said(self) -> Self {
        self.only(&[Place::Text])
    }

    /// Leaves the column out of all renderings but JSON.
    #[must_use]
    pub fn in_json(self) -> Self {
        self.only(&[Place::Json])
    }

    /// Leaves the column out of all renderings but CSV and Parquet.
    #[must_use]
    pub fn in_files(self) -> Self {
        self.only(&[Place::File])
    }

    /// Joins the column with the function that takes its cell out of a row's item.
    pub fn of<'a, T, C: Into<Cell>>(self, cell: impl Fn(&T) -> C + 'a) -> Field<'a, T> {
        Field { column: self, cell: Box::new(move |item| cell(item).into()) }
    }

    /// Returns the key in JSON.
    pub fn key(&self) -> &str {
        &self.key
    }

    /// Returns the name of the column in CSV and Parquet.
    pub fn file_key(&self) -> &str {
        &self.file_key
    }

    /// Returns the type of the values.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// Returns whether the column has a place in a rendering.
    pub fn is_in(&self, place: Place) -> bool {
        self.places.contains(&place)
    }

    pub(crate) fn heading(&self) -> String {
        format!("{} {}", self.head, self.unit).trim_end().to_string()
    }
}

/// A column, and the function that takes its cell out of an item.
pub struct Field<'a, T> {
    /// The column.
    pub column: Column,
    cell: Box<dyn Fn(&T) -> Cell + 'a>,
}

impl<T> Field<'_, T> {
    /// Leaves the column out of all renderings but these.
    #[must_use]
    pub fn only(self, places: &[Place]) -> Self {
        Self { column: self.column.only(places), ..self }
    }

    /// Returns the cell of an item.
    pub fn cell(&self, item: &T) -> Cell {
        (self.cell)(item)
    }
}

/// A table.
#[derive(Clone, Debug)]
pub struct Table {
    pub(crate) key: String,
    columns: Vec<Column>,
    pub(crate) rows: Vec<Vec<Cell>>,
    /// The rows that text leaves out.
    pub(crate) untold: Vec<usize>,
    gap: usize,
}

/// The widest cell that makes its column wide, in characters. A longer one, such as a path of many points, would make
/// every other line as long.
const WIDEST: usize = 80;

impl Table {
    /// Returns a table without rows. A table with an empty key has no place in JSON.
    pub fn new(key: &str, columns: impl IntoIterator<Item = Column>) -> Self {
        Self { key: key.into(), columns: columns.into_iter().collect(), rows: Vec::new(), untold: Vec::new(), gap: 2 }
    }

    /// Returns a table with a row for each item.
    pub fn of<'a, T>(
        key: &str,
        items: impl IntoIterator<Item: Borrow<T>>,
        fields: impl IntoIterator<Item = Field<'a, T>>,
    ) -> Self {
        let fields: Vec<Field<T>> = fields.into_iter().collect();
        let mut table = Self::new(key, fields.iter().map(|field| field.column.clone()));
        items.into_iter().for_each(|item| table.add(fields.iter().map(|field| field.cell(item.borrow()))));
        table
    }

    /// Sets the number of blanks between columns of text; two without it.
    #[must_use]
    pub fn gap(self, gap: usize) -> Self {
        Self { gap, ..self }
    }

    /// Leaves rows out of the text; JSON and files have them.
    #[must_use]
    pub fn without(self, untold: impl Fn(usize) -> bool) -> Self {
        Self { untold: (0..self.rows.len()).filter(|row| untold(*row)).collect(), ..self }
    }

    /// Adds a row: a cell for each column.
    ///
    /// # Panics
    ///
    /// Panics if the row has more or fewer cells than there are columns.
    pub fn add(&mut self, row: impl IntoIterator<Item = Cell>) {
        let row: Vec<Cell> = row.into_iter().collect();
        assert_eq!(row.len(), self.columns.len(), "a cell for each column of {}", self.key);
        self.rows.push(row);
    }

    /// Returns the key.
    pub fn key(&self) -> &str {
        &self.key
    }

    /// Returns the rows.
    pub fn rows(&self) -> &[Vec<Cell>] {
        &self.rows
    }

    /// Returns the columns.
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    pub(crate) fn places(&self, place: Place) -> impl Iterator<Item = (usize, &Column)> {
        self.columns.iter().enumerate().filter(move |(_, column)| column.is_in(place))
    }

    /// Returns the table as aligned text. `paint` colours cells that are marked as good or bad.
    pub fn painted(&self, paint: &dyn Fn(&str, bool) -> String) -> String {
        let told = || self.rows.iter().enumerate().filter(|(row, _)| !self.untold.contains(row)).map(|(_, row)| row);
        let least = |(at, column): (usize, &Column)| {
            let cells = told().map(|row| row[at].text().chars().count()).filter(|width| *width <= WIDEST);
            cells.fold(column.least.max(column.heading().chars().count()), usize::max)
        };
        let widths: Vec<usize> = self.columns.iter().enumerate().map(least).collect();
        let heads = self.heads(&widths);
        let lines = told().map(|row| self.line(row, &widths, paint));
        heads.into_iter().chain(lines).collect()
    }

    /// Returns the line of heads for a table that is shown while it grows, with the columns' least widths.
    pub fn head(&self) -> String {
        self.heads(&self.least()).unwrap_or_default()
    }

    /// Returns the last row as a line, for a table that is shown while it grows.
    pub fn last(&self, paint: &dyn Fn(&str, bool) -> String) -> String {
        self.rows.last().map_or(String::new(), |row| self.line(row, &self.least(), paint))
    }

    fn least(&self) -> Vec<usize> {
        self.columns.iter().map(|column| column.least.max(column.heading().chars().count())).collect()
    }

    /// Returns the line of heads; `None` where no column has one.
    fn heads(&self, widths: &[usize]) -> Option<String> {
        let heads: Vec<Cell> = self.columns.iter().map(|column| column.heading().into()).collect();
        let some = self.places(Place::Text).any(|(at, _)| !heads[at].text().is_empty());
        some.then(|| self.line(&heads, widths, &|text, _| text.to_string()))
    }

    fn line(&self, row: &[Cell], widths: &[usize], paint: &dyn Fn(&str, bool) -> String) -> String {
        let mut line = String::new();
        let mut pending = 0;
        for (at, column) in self.places(Place::Text) {
            let text = row[at].text();
            let rest = widths[at].saturating_sub(text.chars().count());
            let painted = row[at].good.map_or(text.clone(), |good| paint(&text, good));
            let before = if matches!(column.kind, Kind::Text | Kind::Flag) { 0 } else { rest };
            if !text.is_empty() {
                // A text that begins on a line of its own leaves no blanks behind.
                line += &" ".repeat(if text.starts_with('\n') { 0 } else { pending + before });
                line += &painted;
                pending = 0;
            } else {
                pending += before;
            }
            pending += rest - before + self.gap;
        }
        line.truncate(line.trim_end().len());
        line + "\n"
    }

    /// Returns the rows as a list of JSON objects.
    pub fn json(&self) -> Json {
        let rows = self.rows.iter().map(|row| {
            let mut object = Map::new();
            self.places(Place::Json).for_each(|(at, column)| put(&mut object, &column.key, row[at].value.json()));
            Json::Object(object)
        });
        Json::Array(rows.collect())
    }

    /// Returns the table as CSV below these comments.
    pub fn csv(&self, comments: &[impl AsRef<str>]) -> String {
        let mut text: String = comments.iter().map(|comment| format!("# {}\n", comment.as_ref())).collect();
        text += &csv_line(self.places(Place::File).map(|(_, column)| column.file_key.clone()));
        for row in &self.rows {
            text += &csv_line(self.places(Place::File).map(|(at, _)| row[at].value.csv()));
        }
        text
    }
}

/// Returns cells as a line of CSV.
pub fn csv_line(cells: impl Iterator<Item = String>) -> String {
    cells.collect::<Vec<_>>().join(",") + "\n"
}

/// Writes CSV item by item, so that memory does not grow with the number of rows.
///
/// # Errors
///
/// Returns the writer's error.
pub fn write_csv<T>(
    mut out: impl Write,
    comments: impl IntoIterator<Item = String>,
    fields: &[Field<T>],
    items: impl IntoIterator<Item = T>,
) -> io::Result<()> {
    for comment in comments {
        writeln!(out, "# {comment}")?;
    }
    let fields: Vec<_> = fields.iter().filter(|field| field.column.is_in(Place::File)).collect();
    out.write_all(csv_line(fields.iter().map(|field| field.column.file_key.clone())).as_bytes())?;
    for item in items {
        out.write_all(csv_line(fields.iter().map(|field| field.cell(&item).value.csv())).as_bytes())?;
    }
    out.flush()
}
