//! Prints two hashes of the run of each shipped scene: of all rows of its trace, and of its summary.
//!
//! `testbench/record/hashes.txt` is what it prints. A test of this crate holds each build to the record, and
//! `testbench/systems.sh` the builds for other systems.

use std::fmt::Write as _;
use std::io::{self, Write as _};

use hpu_cosim::scene::{Experiment, shipped};
use hpu_cosim::{Control, Simulation, Wired, WiredSimulation};
use hpu_signal::{Cycle, Observe};
use sha2::{Digest, Sha256};

/// The first line of the record.
const HEAD: &str =
    "# SHA-256 of rows and summary of each shipped scene, by cargo run --release --example bits -p hpu-cosim.";

/// Hashes the rows of a run: the bits of the plant's outputs, with their means and extremes between rows, and the words
/// of all nets.
#[derive(Default)]
struct Rows {
    hash: Sha256,
    words: Vec<i64>,
    row: Vec<u8>,
}

impl Observe for Rows {
    fn measures(&self) -> bool {
        true
    }
    fn nets(&mut self, _: Cycle, words: &[i64]) {
        words.clone_into(&mut self.words);
    }
    fn reals(&mut self, cycle: Cycle, values: &[f64]) {
        self.row.clear();
        self.row.extend(cycle.0.to_le_bytes());
        self.row.extend(values.iter().flat_map(|value| value.to_bits().to_le_bytes()));
        self.row.extend(self.words.iter().flat_map(|word| word.to_le_bytes()));
        self.hash.update(&self.row);
    }
}

/// Returns a hash in hexadecimal digits.
fn hexadecimal(hash: impl AsRef<[u8]>) -> String {
    hash.as_ref().iter().fold(String::new(), |mut text, byte| {
        write!(text, "{byte:02x}").expect("a text grows");
        text
    })
}

/// Runs each shipped scene to its end, by the driver that the scene asks for. Returns a line a scene: its name, the
/// SHA-256 of its rows, and that of its summary without the wall time, as `Debug` prints it: two numbers have the same
/// text only if they have the same bits. A scene with a design of somebody else needs a simulator, and is left out.
///
/// # Panics
///
/// If a shipped scene does not run.
pub fn table() -> String {
    let mut table = format!("{HEAD}\n");
    for shipped in shipped() {
        let scene = shipped.parse(&[]).unwrap_or_else(|error| panic!("{error}"));
        if matches!(scene, Experiment::Dut(_)) {
            continue;
        }
        let simulation = WiredSimulation::new(&scene).unwrap_or_else(|error| panic!("{error}"));
        let (mut trace, mut rows) = (simulation.verdict_trace(), Rows::default());
        let mut summary = simulation.run(simulation.driver(), &mut trace, &mut rows, &Control::new());
        summary.wall_s = 0.0;
        let [rows, summary] = [rows.hash.finalize(), Sha256::digest(format!("{summary:?}"))].map(hexadecimal);
        writeln!(table, "{} {rows} {summary}", shipped.name).expect("a text grows");
    }
    table
}

#[allow(dead_code, reason = "the test has a main of its own")]
fn main() -> io::Result<()> {
    io::stdout().write_all(table().as_bytes())
}
