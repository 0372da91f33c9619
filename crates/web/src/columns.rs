//! The columns of a trace, as the page reads them: outputs of the plant, and words of nets.

use std::ops::Range;

use hpu_cosim::{Simulation, Trace, WiredSimulation};
use hpu_signal::{Cycle, Observe, Signal};
use serde_json::{Value, json};

/// The values of a column, one a row.
pub type Column = Vec<f64>;

/// Endings of the names of columns, and the units that they stand for; longer ones first.
const UNITS: [(&str, &str); 9] = [
    ("_rad_per_s", "rad/s"),
    ("_m_per_s", "m/s"),
    ("_rad", "rad"),
    ("_nm", "N.m"),
    ("_pa", "Pa"),
    ("_a", "A"),
    ("_n", "N"),
    ("_m", "m"),
    ("_v", "V"),
];

/// Returns the unit of a net; a single bit is drawn as a lane of 0 and 1.
fn unit_of(net: &Signal) -> &'static str {
    if net.format.width() == 1 { "bit" } else { net.unit }
}

/// The columns that a page asks for.
pub(crate) struct Picked {
    /// Outputs at the instant of a row, as indices into the simulation's row.
    plain: Vec<usize>,
    /// Mean, least and greatest value of an effort between rows.
    between: Vec<[usize; 3]>,
    /// Indices of nets, and the nets.
    nets: Vec<(usize, Signal)>,
    /// Commands to actuators: the net's place in `nets`, the name of the effort that it asks for, and the effort of one
    /// unit of its word.
    commands: Vec<(usize, &'static str, f64)>,
}

impl Picked {
    /// Returns the outputs of a simulation, the commands to its actuators, and those of its nets that have these names.
    /// With `ripple` there are also the efforts between rows and the hand, whose rows take a run about twice as long.
    pub(crate) fn of(simulation: &WiredSimulation, names: &[&str], ripple: bool) -> Self {
        let (outputs, commands) = (simulation.reals().len(), simulation.commands());
        let between = if ripple { simulation.drawn().to_vec() } else { Vec::new() };
        let is_between = |column: &usize| {
            ["_mean_", "_least_", "_greatest_"].iter().any(|part| simulation.row()[*column].name.contains(part))
        };
        let plain =
            simulation.columns().into_iter().filter(|column| (ripple || *column < outputs) && !is_between(column));
        let plain = plain.collect();
        let is_picked = |net: &Signal| names.contains(&net.name) || commands.iter().any(|(name, ..)| *name == net.name);
        let nets: Vec<_> = simulation.nets().into_iter().enumerate().filter(|(_, net)| is_picked(net)).collect();
        let commands = commands.iter().filter_map(|(name, effort, scale)| {
            Some((nets.iter().position(|(_, net)| net.name == *name)?, *effort, *scale))
        });
        Self { plain, between, commands: commands.collect(), nets }
    }

    /// Returns an empty trace of these columns, of limited size.
    pub(crate) fn trace(&self, simulation: &WiredSimulation) -> Trace {
        let nets = self.nets.iter().map(|(index, _)| *index).collect();
        let trace = Trace::new(simulation.clock(), simulation.stride(), self.plain.clone(), nets);
        trace.keeping(&self.between).bounded(Trace::USUAL, &simulation.judged())
    }

    /// Describes the columns, in their order: outputs, then mean, least and greatest values, then commands, then nets.
    pub(crate) fn told(&self, simulation: &WiredSimulation) -> Value {
        let row = simulation.row();
        let named = |name: &str, doc: &str, role: &str| {
            let (end, unit) = UNITS.into_iter().find(|(end, _)| name.ends_with(end)).unwrap_or_default();
            let label = name[..name.len() - end.len()].replace('_', " ");
            json!({ "name": name, "label": label, "unit": unit, "doc": doc, "role": role })
        };
        let real = |&column: &usize, role: &str| named(row[column].name, row[column].doc, role);
        let roles = ["mean", "least", "greatest"];
        let plain = self.plain.iter().map(|column| real(column, "value"));
        let between =
            self.between.iter().flat_map(|columns| columns.iter().zip(roles).map(|(at, role)| real(at, role)));
        let nets = self.nets.iter().map(|(_, net)| {
            let (name, unit) = (net.name, unit_of(net));
            json!({ "name": name, "label": name, "unit": unit, "doc": net.doc, "role": "net" })
        });
        let commands = self.commands.iter().map(|(_, effort, _)| named(effort, "The effort asked for", "command"));
        plain.chain(between).chain(commands).chain(nets).collect()
    }

    /// Returns the columns of a trace.
    pub(crate) fn columns(&self, trace: &Trace) -> Vec<Column> {
        let reals = self.reals().map(|column| trace.real(column).to_vec());
        let of = |value: Shown| trace.words(value.0).iter().map(|&word| value.value(word)).collect();
        reals.chain(self.shown().map(of)).collect()
    }

    /// Returns the columns of words: commands, then nets.
    fn shown(&self) -> impl Iterator<Item = Shown<'_>> {
        let commands = self.commands.iter().map(|&(pick, _, scale)| Shown(pick, &self.nets[pick].1, Some(scale)));
        commands.chain(self.nets.iter().enumerate().map(|(pick, (_, net))| Shown(pick, net, None)))
    }

    fn reals(&self) -> impl Iterator<Item = usize> {
        self.plain.iter().copied().chain(self.between.as_flattened().iter().copied())
    }

    /// Returns an observer that keeps these columns.
    pub(crate) fn kept(&self) -> Kept<'_> {
        let columns = self.reals().count() + self.commands.len() + self.nets.len();
        Kept { picked: self, now: vec![0; self.nets.len()], first: None, columns: vec![Vec::new(); columns] }
    }
}

/// A column of words: the net's place among the picked nets, the net, and the scale of a command.
struct Shown<'p>(usize, &'p Signal, Option<f64>);

impl Shown<'_> {
    fn value(&self, word: i64) -> f64 {
        self.2.map_or_else(|| self.1.shown(word), |scale| 0.0 + scale * self.1.format.value(word) as f64)
    }
}

/// Keeps rows as columns.
pub(crate) struct Kept<'p> {
    picked: &'p Picked,
    now: Vec<i64>,
    /// The edge of the first row.
    pub(crate) first: Option<u64>,
    pub(crate) columns: Vec<Column>,
}

impl Observe for Kept<'_> {
    fn follows(&self, nets: Range<usize>) -> bool {
        self.picked.nets.iter().any(|(index, _)| nets.contains(index))
    }

    fn measures(&self) -> bool {
        true
    }

    fn reads(&self, columns: Range<usize>) -> bool {
        self.picked.reals().any(|column| columns.contains(&column))
    }

    fn nets(&mut self, _: Cycle, words: &[i64]) {
        for (now, (index, _)) in self.now.iter_mut().zip(&self.picked.nets) {
            *now = words[*index];
        }
    }

    fn reals(&mut self, cycle: Cycle, values: &[f64]) {
        self.first.get_or_insert(cycle.0);
        let reals = self.picked.reals().map(|column| values[column]);
        let words = self.picked.shown().map(|shown| shown.value(self.now[shown.0]));
        self.columns.iter_mut().zip(reals.chain(words)).for_each(|(column, value)| column.push(value));
    }

    /// The page draws looks beside the trace of a run, whose rows are those that are judged.
    fn row(&mut self, cycle: Cycle, judged: &[f64], _shown: &[f64]) {
        self.reals(cycle, judged);
    }
}
