//! The rows of a run: their columns, and their form as Parquet.

use std::io::Write;
use std::ops::Range;

use hpu_cosim::Simulation;
use hpu_signal::{Clock, Cycle, Signal};
use parquet::errors::ParquetError;

use crate::{Column, Parquet, Value};

/// Number of rows in a group, and so in memory at a time.
const GROUP_ROWS: usize = 1 << 16;

/// A column of words: its name with the unit, a line about it, and the net.
struct Word {
    name: String,
    doc: String,
    /// The net's index among the picked nets.
    pick: usize,
    net: Signal,
    /// The value of one LSB where the column's unit is not the net's own.
    scale: Option<f64>,
}

impl Word {
    /// Returns the value of a word, never a negative zero; NaN for a word with an unknown bit.
    fn value(&self, word: i64) -> f64 {
        match self.scale {
            _ if self.net.format.is_unknown(word) => f64::NAN,
            None => self.net.shown(word),
            Some(scale) => 0.0 + scale * self.net.format.value(word) as f64,
        }
    }
}

/// The columns of a run's rows: the time, the outputs of the plant, the commands to the actuator, and the nets, each in
/// the unit at the end of its name. An observer that keeps or writes rows passes on what it sees.
pub struct TraceColumns {
    clock: Clock,
    /// The indices of the plant's columns in a row.
    reals: Vec<usize>,
    words: Vec<Word>,
    /// The indices of the nets among all nets.
    picks: Vec<usize>,
    /// The present words of these nets.
    now: Vec<i64>,
    told: Vec<(String, String)>,
}

impl TraceColumns {
    /// Returns the columns of a simulation, with these of its nets. `beside` are nets that the run shows after those of
    /// the simulation.
    pub fn new(simulation: &dyn Simulation, nets: &[Signal], beside: &[Signal]) -> Self {
        let all = [&simulation.nets(), beside].concat();
        let picks = nets.iter().filter_map(|net| all.iter().position(|other| other.name == net.name)).collect();
        let (row, reals, words) = (simulation.row(), simulation.columns(), words(simulation, nets));
        let time = ("time_s".to_string(), "Time since the reset".to_string());
        let of_plant = reals.iter().map(|&column| (row[column].name.into(), row[column].doc.into()));
        let of_words = words.iter().map(|word| (word.name.clone(), word.doc.clone()));
        let told = [time].into_iter().chain(of_plant).chain(of_words).collect();
        Self { clock: simulation.clock(), reals, words, picks, now: vec![0; nets.len()], told }
    }

    /// Returns name and meaning of each column.
    pub fn told(&self) -> &[(String, String)] {
        &self.told
    }

    /// Returns whether a column shows one of these nets.
    pub fn follows(&self, nets: Range<usize>) -> bool {
        self.picks.iter().any(|pick| nets.contains(pick))
    }

    /// Takes the words of all nets.
    #[inline]
    pub fn nets(&mut self, words: &[i64]) {
        for (now, &pick) in self.now.iter_mut().zip(&self.picks) {
            *now = words[pick];
        }
    }

    /// Returns the values of a row, in the order of the columns. `values` are the outputs of the plant at this edge.
    #[inline]
    pub fn row(&self, cycle: Cycle, values: &[f64]) -> impl Iterator<Item = f64> {
        let of_plant = self.reals.iter().map(|&column| values[column]);
        let of_words = self.words.iter().map(|word| word.value(self.now[word.pick]));
        [self.clock.seconds(cycle)].into_iter().chain(of_plant).chain(of_words)
    }
}

/// Returns the columns of words: first the commands to the actuators, in the plant's units, then the nets in their own.
fn words(simulation: &dyn Simulation, nets: &[Signal]) -> Vec<Word> {
    let commands = simulation.commands().into_iter().filter_map(|(net, name, scale)| {
        let pick = nets.iter().position(|other| other.name == net)?;
        let doc = format!("What the datapath asks of the actuator: the word {net} by {scale:e}");
        Some(Word { name: name.to_string(), doc, pick, net: nets[pick].clone(), scale: Some(scale) })
    });
    let own = nets.iter().enumerate().map(|(pick, net)| {
        let read = if net.is_counter() { ", read as signed" } else { "" };
        let doc = format!("{}: a word of format {}{read}", net.doc, net.format);
        Word { name: named(net), doc, pick, net: net.clone(), scale: None }
    });
    commands.chain(own).collect()
}

/// Returns a net's name with its unit: `velocity` in `count/sample` is `velocity_count_per_sample`.
fn named(net: &Signal) -> String {
    let unit = net.unit.replace('/', "_per_").replace([' ', '.', '*'], "_").to_lowercase();
    if unit == "1" { net.name.into() } else { format!("{}_{unit}", net.name) }
}

/// A Parquet file that rows are added to; each value is a column of doubles whose name ends in its unit. The metadata
/// hold the command, the convention of signs, and a line about each column.
pub struct TraceTable<W: Write + Send>(Parquet<W>);

impl<W: Write + Send> TraceTable<W> {
    /// Begins the file. Each column is a name that ends in its unit, and a line about it.
    ///
    /// # Errors
    ///
    /// Returns the writer's error.
    pub fn new(out: W, columns: &[(String, String)], signs: &str, command: &str) -> Result<Self, ParquetError> {
        let metadata = [("command".into(), command.into()), ("signs".into(), signs.into())];
        let numbers: Vec<Column> = columns.iter().map(|(name, _)| Column::number(name, "")).collect();
        let metadata = metadata.into_iter().chain(columns.iter().cloned());
        Parquet::new(out, "trace", &numbers, metadata, GROUP_ROWS).map(Self)
    }

    /// Adds a row: a value for each column, in the columns' order.
    ///
    /// # Errors
    ///
    /// Returns the writer's error.
    pub fn add(&mut self, row: impl IntoIterator<Item = f64>) -> Result<(), ParquetError> {
        self.0.add(row.into_iter().map(Value::Number))
    }

    /// Writes the remaining rows and the end of the file.
    ///
    /// # Errors
    ///
    /// Returns the writer's error.
    pub fn finish(self) -> Result<(), ParquetError> {
        self.0.finish()
    }
}
