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

/// The columns that a page asks for.
pub(crate) struct Picked {
    /// Outputs at the instant of a row, as indices into the simulation's row.
    plain: Vec<usize>,
    /// Mean, least and greatest value of an effort between rows.
    between: Vec<[usize; 3]>,
    /// Indices of nets, and the nets.
    nets: Vec<(usize, Signal)>,
}

impl Picked {
    /// Returns all outputs of a simulation, and those of its nets that have these names. Without names, the nets are
    /// the penetration and the commands to the actuators.
    pub(crate) fn of(simulation: &WiredSimulation, names: &[&str]) -> Self {
        let between = simulation.drawn().to_vec();
        let others = simulation.columns().into_iter().filter(|column| !between.as_flattened().contains(column));
        let commands: Vec<_> = simulation.commands().iter().map(|(net, ..)| *net).chain(["penetration"]).collect();
        let names = if names.is_empty() { &commands[..] } else { names };
        let nets = simulation.nets().into_iter().enumerate().filter(|(_, net)| names.contains(&net.name));
        Self { plain: others.collect(), nets: nets.collect(), between }
    }

    /// Returns an empty trace of these columns, of limited size.
    pub(crate) fn trace(&self, simulation: &WiredSimulation) -> Trace {
        let nets = self.nets.iter().map(|(index, _)| *index).collect();
        let trace = Trace::new(simulation.clock(), simulation.stride(), self.plain.clone(), nets);
        trace.keeping(&self.between).bounded(Trace::USUAL, &simulation.judged())
    }

    /// Describes the columns, in their order: outputs, then mean, least and greatest values, then nets.
    pub(crate) fn told(&self, simulation: &WiredSimulation) -> Value {
        let row = simulation.row();
        let real = |&column: &usize, role: &str| {
            let (name, doc) = (row[column].name, row[column].doc);
            let (end, unit) = UNITS.into_iter().find(|(end, _)| name.ends_with(end)).unwrap_or_default();
            let label = name[..name.len() - end.len()].replace('_', " ");
            json!({ "name": name, "label": label, "unit": unit, "doc": doc, "role": role })
        };
        let roles = ["mean", "least", "greatest"];
        let plain = self.plain.iter().map(|column| real(column, "value"));
        let between = self.between.iter().flat_map(|columns| columns.iter().zip(roles).map(|(at, role)| real(at, role)));
        let nets = self.nets.iter().map(|(_, net)| {
            json!({ "name": net.name, "label": net.name, "unit": net.unit, "doc": net.doc, "role": "net" })
        });
        plain.chain(between).chain(nets).collect()
    }

    /// Returns the columns of a trace.
    pub(crate) fn columns(&self, trace: &Trace) -> Vec<Column> {
        let reals = self.reals().map(|column| trace.real(column).to_vec());
        let nets = self.nets.iter().enumerate();
        let words = nets.map(|(pick, (_, net))| trace.words(pick).iter().map(|&word| net.shown(word)).collect());
        reals.chain(words).collect()
    }

    fn reals(&self) -> impl Iterator<Item = usize> {
        self.plain.iter().copied().chain(self.between.as_flattened().iter().copied())
    }

    /// Returns an observer that keeps these columns.
    pub(crate) fn kept(&self) -> Kept<'_> {
        let columns = self.reals().count() + self.nets.len();
        Kept { picked: self, now: vec![0; self.nets.len()], first: None, columns: vec![Vec::new(); columns] }
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

    fn nets(&mut self, _: Cycle, words: &[i64]) {
        for (now, (index, _)) in self.now.iter_mut().zip(&self.picked.nets) {
            *now = words[*index];
        }
    }

    fn reals(&mut self, cycle: Cycle, values: &[f64]) {
        self.first.get_or_insert(cycle.0);
        let reals = self.picked.reals().map(|column| values[column]);
        let words = self.now.iter().zip(&self.picked.nets).map(|(&word, (_, net))| net.shown(word));
        self.columns.iter_mut().zip(reals.chain(words)).for_each(|(column, value)| column.push(value));
    }
}
