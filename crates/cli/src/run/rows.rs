//! Writes the rows of a run's trace to disk as they come: `trace.csv`, and `trace.parquet` when asked for.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::ops::Range;
use std::panic::resume_unwind;
use std::path::Path;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{self, JoinHandle};

use hpu_cosim::{AnySimulation, Control, SIGNS, Simulation};
use hpu_page::trace_table::{TraceColumns, TraceTable};
use hpu_rtl::system::free_bytes;
use hpu_signal::{Cycle, Observe, Signal};
use hpu_wave::differs;

use crate::shell::{Failure, Folder, terminal};
use crate::units::si;

const CSV: &str = "trace.csv";
const PARQUET: &str = "trace.parquet";

/// Bytes of CSV for an output of the plant in a row: those of the shipped scenes, and one more.
const REAL_BYTES: u64 = 21;
/// Bytes of CSV for a time, or for a word.
const WORD_BYTES: u64 = 6;

/// The rows and bytes that a run will write, as far as they are known before the run.
pub struct Estimate {
    rows: u64,
    csv_bytes: u64,
    parquet_bytes: Option<u64>,
}

impl Estimate {
    /// Returns the estimate for a run with `nets` nets in its table.
    pub fn of(simulation: &AnySimulation, nets: usize, parquet: bool) -> Self {
        let rows = simulation.edges() / simulation.stride() + 1;
        let reals = (simulation.columns().len() + simulation.commands().len()) as u64;
        let words = nets as u64 + 1;
        Self {
            rows,
            csv_bytes: rows.saturating_mul(reals * REAL_BYTES + words * WORD_BYTES),
            parquet_bytes: parquet.then(|| rows.saturating_mul(8 * (reals + words))),
        }
    }

    /// Reports rows and bytes. Returns an error when the disk of this folder has no room for them.
    pub fn tell(&self, dir: &Path) -> Result<(), Failure> {
        let bytes = |bytes: u64| si(bytes as f64, "B");
        let mut said = format!("{CSV}: {} rows, about {}", self.rows, bytes(self.csv_bytes));
        if let Some(parquet_bytes) = self.parquet_bytes {
            said += &format!("; {PARQUET}: at most about {}", bytes(parquet_bytes));
        }
        let all = self.csv_bytes.saturating_add(self.parquet_bytes.unwrap_or(0));
        if let Some(free) = free_bytes(dir)
            && all > free
        {
            return Err(Failure::file(format!(
                "{}: {said}; {} are free there; lower record.plant_rate or run.duration, or leave out -o",
                dir.display(),
                bytes(free)
            )));
        }
        terminal::tell(&format!("{said}; how much the waveforms take depends on what happens"));
        Ok(())
    }
}

/// Rows that are sent to the writer in one batch, and the most batches that wait.
const BATCH: usize = 1024;
const WAITING: usize = 64;

/// Observes a run, and passes its rows to a thread that writes them. A row that cannot be written ends the run.
pub struct Rows {
    shown: TraceColumns,
    /// The number of values in a row.
    columns: usize,
    /// Rows that have not been sent, one after the other.
    batch: Vec<f64>,
    send: SyncSender<Vec<f64>>,
    writer: JoinHandle<Result<(), Failed>>,
}

/// The files.
struct Files {
    columns: usize,
    csv: BufWriter<File>,
    parquet: Option<TraceTable<File>>,
}

/// The file that could not be written, and the reason.
type Failed = (&'static str, String);

impl Files {
    /// Writes the rows as they come, until the sender is gone.
    fn write(mut self, batches: &Receiver<Vec<f64>>) -> Result<(), Failed> {
        let of_csv = |error: io::Error| (CSV, error.to_string());
        let mut line = Vec::new();
        for batch in batches {
            for row in batch.chunks(self.columns) {
                line.clear();
                for (column, value) in row.iter().enumerate() {
                    let comma = if column > 0 { "," } else { "" };
                    write!(line, "{comma}{value}").expect("a line grows");
                }
                line.push(b'\n');
                self.csv.write_all(&line).map_err(of_csv)?;
                let parquet = self.parquet.as_mut().map_or(Ok(()), |parquet| parquet.add(row.iter().copied()));
                parquet.map_err(|error| (PARQUET, error.to_string()))?;
            }
        }
        self.csv.flush().map_err(of_csv)?;
        let parquet = self.parquet.map_or(Ok(()), TraceTable::finish);
        parquet.map_err(|error| (PARQUET, error.to_string()))
    }
}

impl Rows {
    /// Begins the files with the times, the outputs of the plant, the commands to the actuator, and the nets. Each name
    /// has its unit.
    pub fn begin(
        simulation: &AnySimulation,
        nets: &[Signal],
        command: &str,
        parquet: bool,
        folder: &mut Folder,
        control: &'static Control,
    ) -> Result<Self, Failure> {
        // A run of VHDL also shows the net `differs`.
        let shown = TraceColumns::new(simulation, nets, &[differs()]);
        let told = shown.told();
        let mut csv = BufWriter::new(folder.create(CSV)?);
        let names: Vec<&str> = told.iter().map(|(name, _)| &**name).collect();
        writeln!(csv, "{}", names.join(",")).map_err(|error| Failure::at(&folder.place(CSV), error))?;
        let parquet = match parquet {
            true => {
                let file = folder.create(PARQUET)?;
                let table = TraceTable::new(file, told, SIGNS, command);
                Some(table.map_err(|error| Failure::at(&folder.place(PARQUET), error))?)
            }
            false => None,
        };
        let columns = names.len();
        let files = Files { columns, csv, parquet };
        let (send, batches) = sync_channel(WAITING);
        let writer = thread::spawn(move || {
            let written = files.write(&batches);
            if written.is_err() {
                control.stop.store(true, Ordering::Relaxed);
            }
            written
        });
        let batch = Vec::with_capacity(BATCH * columns);
        Ok(Self { shown, columns, batch, send, writer })
    }

    /// Sends the rows to the writer. The writer is gone only after an error, which [`finish`](Self::finish) reports.
    fn hand_over(&mut self) {
        let next = Vec::with_capacity(BATCH * self.columns);
        let _ = self.send.send(std::mem::replace(&mut self.batch, next));
    }

    /// Completes the files.
    pub fn finish(mut self, folder: &Folder) -> Result<(), Failure> {
        self.hand_over();
        drop(self.send);
        let written = self.writer.join().unwrap_or_else(|panic| resume_unwind(panic));
        written.map_err(|(name, error)| Failure::at(&folder.place(name), error))
    }
}

impl Observe for Rows {
    fn follows(&self, nets: Range<usize>) -> bool {
        self.shown.follows(nets)
    }

    fn measures(&self) -> bool {
        true
    }

    #[inline]
    fn nets(&mut self, _: Cycle, words: &[i64]) {
        self.shown.nets(words);
    }

    fn reals(&mut self, cycle: Cycle, values: &[f64]) {
        self.batch.extend(self.shown.row(cycle, values));
        if self.batch.len() >= BATCH * self.columns {
            self.hand_over();
        }
    }
}
