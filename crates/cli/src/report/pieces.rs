//! The course of a run, as a report holds it: each signal by its changes, and the device at each change of its drive.
//!
//! Times are clock edges and signals are words, so both are exact. A value of the device is kept to 2^-26 of the
//! greatest of its column. Numbers are written as differences, in bytes of 7 bits each, the whole as gzip in base64.

use std::io::Write;

use flate2::Compression;
use flate2::write::GzEncoder;
use hpu_cosim::scene::Setup;
use hpu_cosim::{AnySimulation, Simulation, Wired, WiredSimulation};
use hpu_signal::{Cycle, Observe, Real, Signal, UNKNOWN};
use serde_json::{Value, json};

use crate::run::Overflows;
use crate::run::drawn_nets;
use crate::shell::Watch;

/// Most changes of a signal that a report holds.
const CHANGES: usize = 60_000;
/// Most points of the device between which its drive does not change.
const ROWS: u64 = 20_000;
/// Most points of the device in all.
const POINTS: usize = 80_000;
/// Steps of a column's greatest value.
const FINE: f64 = (1u64 << 26) as f64;

/// The changes of a signal: edges and words.
#[derive(Default)]
struct Changes {
    edges: Vec<u64>,
    words: Vec<i64>,
    /// All changes, held or not.
    seen: usize,
}

/// The course of a run.
pub(crate) struct Pieces {
    nets: Vec<Signal>,
    changes: Vec<Changes>,
    reals: &'static [Real],
    columns: Vec<usize>,
    contact: Option<usize>,
    outputs: std::ops::Range<usize>,
    /// Edges of the points of the device, and a column of values for each output.
    edges: Vec<u64>,
    values: Vec<Vec<f64>>,
    /// The first edge of contact.
    touched: Option<u64>,
    overflows: Overflows,
    /// The words after the latest edge, and whether an output has just changed.
    now: Vec<i64>,
    driven: bool,
    /// Whether the device's points are the rows of the run.
    by_rows: bool,
    stride: u64,
}

impl Pieces {
    /// Runs a scene from event to event and gathers its course, or from row to row where its loop has no clock or is
    /// closed by a design of the user's own; `None` when stopped. `rows` runs it for an observer.
    pub fn of<E>(
        simulation: &AnySimulation,
        overflows: bool,
        watch: Watch,
        rows: impl FnOnce(Self) -> Result<Option<Self>, E>,
    ) -> Result<Option<Self>, E> {
        let pieces = Self::new(simulation);
        match simulation {
            AnySimulation::Ours(ours) if ours.direct().is_none() => Ok(pieces.run(ours, overflows, watch)),
            _ => rows(Self { by_rows: true, ..pieces }),
        }
    }

    fn new(simulation: &AnySimulation) -> Self {
        let nets = simulation.nets();
        let reals = simulation.reals();
        let columns: Vec<_> = simulation.columns().into_iter().filter(|column| *column < reals.len()).collect();
        let outputs = match simulation {
            AnySimulation::Ours(ours) => {
                let block = ours.wiring().block();
                let inputs = block.inputs().len();
                inputs..inputs + block.outputs().len()
            }
            AnySimulation::Dut(_) => 0..0,
        };
        Self {
            changes: nets.iter().map(|_| Changes::default()).collect(),
            now: vec![0; nets.len()],
            nets,
            reals,
            values: vec![Vec::new(); columns.len()],
            columns,
            contact: simulation.contact_net(),
            outputs,
            edges: Vec::new(),
            touched: None,
            overflows: Overflows::default(),
            driven: false,
            by_rows: false,
            stride: simulation.stride().max(simulation.edges() / ROWS).max(1),
        }
    }

    fn run(mut self, simulation: &WiredSimulation, overflows: bool, watch: Watch) -> Option<Self> {
        let end = simulation.edges();
        let mut running = simulation.closed_loop();
        if !simulation.gates_drive() {
            running.wiring_mut().rest_modulator();
        }
        let words = running.wiring().words().to_vec();
        self.nets(Cycle(0), &words);
        let mut row = Vec::new();
        let mut next = 0;
        loop {
            let edge = running.edge();
            // A drive that changed counts at its own edge alone: later the world may be ahead of the datapath.
            let driven = std::mem::take(&mut self.driven) && self.edges.len() < POINTS;
            if edge >= next || driven {
                row.clear();
                running.world().exact(edge, &mut row);
                self.point(edge, &row);
                next = (edge / self.stride + 1) * self.stride;
            }
            if edge >= end || running.world().over().is_some() {
                return Some(self);
            }
            if watch.is_stopped() {
                return None;
            }
            running.leap(next.min(end), &mut self);
            if overflows {
                self.overflows.see(running.wiring(), running.edge());
            }
        }
    }

    fn point(&mut self, edge: u64, row: &[f64]) {
        self.edges.push(edge);
        for (column, at) in self.values.iter_mut().zip(&self.columns) {
            column.push(row[*at]);
        }
    }

    /// Returns what a page draws, and the numbers behind it. `window_s` is the time that is judged.
    pub fn told(&self, simulation: &AnySimulation, window_s: Option<[f64; 2]>) -> (Value, String) {
        let clock = simulation.clock();
        let mut bytes = Vec::new();
        let (mut axes, mut series) = (Vec::new(), Vec::new());
        let mut axis = |bytes: &mut Vec<u8>, edges: &[u64]| {
            let mut before = 0;
            for edge in edges {
                put(bytes, edge - before);
                before = *edge;
            }
            axes.push(edges.len());
            axes.len() - 1
        };
        // A reader takes the edges of an axis before its first series; a recording has no series of a device.
        let of_device = if self.columns.is_empty() { 0 } else { axis(&mut bytes, &self.edges) };
        let judged = simulation.judged();
        for (values, column) in self.values.iter().zip(&self.columns) {
            let (mut name, unit, told) = told_as(simulation, self.reals[*column].name);
            let greatest = values.iter().filter(|value| value.is_finite()).fold(0.0, |most: f64, v| most.max(v.abs()));
            let scale = if greatest > 0.0 { greatest / FINE } else { 1.0 };
            let words: Vec<i64> = values.iter().map(|value| (value / scale).round() as i64).collect();
            differences(&mut bytes, &words);
            if self.nets.iter().any(|net| net.name == name) {
                name += " of the device";
            }
            let doc = self.reals[*column].doc;
            series.push(json!({
                "name": name, "unit": unit, "step": false, "axis": of_device, "scale": told * scale,
                "doc": doc, "hidden": !judged.contains(column),
            }));
        }
        let drawn = drawn_nets(simulation);
        let commands: Vec<_> = simulation.commands().into_iter().map(|(net, ..)| net).collect();
        let mut left_out = Vec::new();
        for (at, (net, changes)) in self.nets.iter().zip(&self.changes).enumerate() {
            if changes.seen > CHANGES {
                left_out.push(net.name);
                continue;
            }
            let is_bit = net.format.width() == 1;
            let is_shown = if is_bit {
                self.outputs.contains(&at) || self.contact == Some(at)
            } else {
                commands.contains(&net.name) || (self.contact == Some(at) && drawn.contains(&net.name))
            };
            // The words that the scene sets stand after the first cycle; the table of signals has them.
            if changes.edges.last().is_none_or(|edge| *edge < 2) && !is_shown {
                continue;
            }
            let of_net = axis(&mut bytes, &changes.edges);
            let scale = 2f64.powi(-net.format.frac());
            // A counter is shown as a signed word, as in traces.
            let words: Vec<i64> = if net.is_counter() {
                changes.words.iter().map(|word| net.shown(*word) as i64).collect()
            } else {
                changes.words.clone()
            };
            differences(&mut bytes, &words);
            series.push(json!({
                "name": net.name, "unit": if is_bit { "bit" } else { net.unit }, "step": true,
                "axis": of_net, "scale": scale, "doc": net.doc, "hidden": !is_shown,
            }));
        }
        let seconds = |edge: u64| clock.seconds(Cycle(edge));
        let first = self.touched.map(|edge| json!({ "x": seconds(edge), "label": "first contact" }));
        let overflow = self.overflows.first().map(
            |(net, edge)| json!({ "x": seconds(edge), "label": format!("first overflow, of {}", self.nets[net].name) }),
        );
        let spans = window_s.map(|[from, to]| json!({ "from": from, "to": to, "label": "judged" }));
        let told = json!({
            "period": clock.period_s(),
            "axes": axes,
            "series": series,
            "markers": first.into_iter().chain(overflow).collect::<Vec<_>>(),
            "spans": spans.into_iter().collect::<Vec<_>>(),
            "left_out": left_out,
        });
        (told, crate::document::base64(&gzip(&bytes)))
    }
}

impl Observe for Pieces {
    fn nets(&mut self, Cycle(edge): Cycle, words: &[i64]) {
        let is_first = self.changes.first().is_some_and(|changes| changes.edges.is_empty());
        for (at, (&word, changes)) in words.iter().zip(&mut self.changes).enumerate() {
            let word = if word == UNKNOWN { 0 } else { word };
            if !is_first && word == self.now[at] {
                continue;
            }
            self.now[at] = word;
            changes.seen += 1;
            self.driven |= self.outputs.contains(&at);
            if changes.seen <= CHANGES {
                changes.edges.push(edge);
                changes.words.push(word);
            }
        }
        if self.touched.is_none() && self.contact.is_some_and(|net| self.now[net] != 0) {
            self.touched = Some(edge);
        }
    }

    fn reals(&mut self, Cycle(edge): Cycle, values: &[f64]) {
        // In a run from event to event the points are taken at the events.
        if self.by_rows && edge.is_multiple_of(self.stride) {
            self.point(edge, values);
        }
    }
}

/// Returns an output's name without its unit, the unit in which it is told, and how many of that one of the trace is.
fn told_as(simulation: &AnySimulation, name: &str) -> (String, &'static str, f64) {
    let (name, unit) = unit_of(name);
    let AnySimulation::Ours(WiredSimulation::Axis(axis)) = simulation else { return (name, unit, 1.0) };
    let (units, scale) = (axis.scene().units(), axis.scene().scale());
    match unit {
        "rad" | "m" => (name, units.position, scale),
        "rad/s" | "m/s" => (name, if units.position == "m" { "m/s" } else { "rad/s" }, scale),
        "N.m" | "N" => (name, units.effort, 1.0 / scale),
        _ => (name, unit, 1.0),
    }
}

/// Returns an output's name without its unit, and the unit.
fn unit_of(name: &str) -> (String, &'static str) {
    const UNITS: [(&str, &str); 7] = [
        ("_rad_per_s", "rad/s"),
        ("_m_per_s", "m/s"),
        ("_rad", "rad"),
        ("_nm", "N.m"),
        ("_a", "A"),
        ("_n", "N"),
        ("_m", "m"),
    ];
    let found = UNITS.iter().find_map(|(end, unit)| Some((name.strip_suffix(end)?, *unit)));
    let (name, unit) = found.unwrap_or((name, ""));
    (name.replace('_', " "), unit)
}

/// Appends a number in bytes of 7 bits, the least first; the eighth bit says that more follow.
fn put(bytes: &mut Vec<u8>, mut number: u64) {
    while number >= 0x80 {
        bytes.push(number as u8 | 0x80);
        number >>= 7;
    }
    bytes.push(number as u8);
}

/// Appends the differences between words; their signs are in the lowest bits.
fn differences(bytes: &mut Vec<u8>, words: &[i64]) {
    let mut before = 0i64;
    for word in words {
        let change = word.wrapping_sub(before);
        put(bytes, ((change << 1) ^ (change >> 63)) as u64);
        before = *word;
    }
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut out = GzEncoder::new(Vec::new(), Compression::best());
    out.write_all(bytes).and_then(|()| out.finish()).expect("a vector takes all bytes")
}
