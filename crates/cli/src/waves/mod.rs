//! The waveform files of a run.

mod chosen;

use std::fs::File;
use std::io::{self, Write};
use std::ops::Range;

use hpu_cosim::{AnySimulation, Mark, PlainName, Simulation, Wired};
use hpu_rtl::Around;
use hpu_signal::{Clock, Cycle, Observe, UNKNOWN};
use hpu_wave::{Layout, WaveFile, fst_aside, gtkw, mismatch_gtkw, mismatch_vcd, sucl, vcd_aside};

use crate::shell::{Failure, Folder};

pub use chosen::Chosen;

const FST: &str = "wave.fst";
const VCD: &str = "wave.vcd";

/// Writes a VCD of the rows around a mismatch, and its GTKWave save file, under this name. Returns the line with their
/// paths; without a folder, the line says which rows a waveform would show.
pub fn waveform(around: &Around, number: u64, name: &str, folder: Option<&mut Folder>) -> Result<String, Failure> {
    let [Some(first), Some(last)] = [around.rows.first(), around.rows.last()] else { return Ok(String::new()) };
    let rows = format!("{}s {} to {}", around.counted, first.number, last.number);
    let Some(folder) = folder else { return Ok(format!("    -o DIR writes a waveform of {rows}\n")) };
    let vcd = format!("{}.vcd", PlainName::near(name));
    let save = format!("{vcd}.gtkw");
    folder.write(&vcd, mismatch_vcd(around))?;
    folder.write(&save, mismatch_gtkw(around, number, &vcd))?;
    Ok(format!("    waveform of {rows}: gtkwave {}\n", folder.place(&save).display()))
}

/// Observes a run and writes an FST, and a VCD when asked for, each with its save file for GTKWave and its commands for
/// Surfer. Each waveform is written on a thread of its own.
pub struct Waves {
    layout: Layout,
    clock: Clock,
    dumps: Vec<Dump>,
    /// The net that shows contact, and the first edge at which it did.
    contact: Option<usize>,
    touched: Option<Cycle>,
    /// The edges that are shown, and the words before the first of them that no file has yet.
    shown: Range<u64>,
    before: Option<Vec<i64>>,
}

/// A waveform, and the files for GTKWave and for Surfer, which are written at its end.
struct Dump {
    name: &'static str,
    file: Box<dyn WaveFile>,
    save: File,
    commands: File,
}

impl Waves {
    /// Begins the files, which show what is `chosen`. A run of VHDL has one net more than the wiring.
    pub fn begin(
        simulation: &AnySimulation,
        folder: &mut Folder,
        (with_vcd, of_vhdl): (bool, bool),
        chosen: &Chosen,
    ) -> Result<Self, Failure> {
        let clock = simulation.clock();
        let shown = chosen.edges(simulation)?;
        let layout = layout(simulation, of_vhdl, chosen).from_edge(Cycle(shown.start));
        let names = || [FST].into_iter().chain(with_vcd.then_some(VCD));
        let begun = names().map(|name| {
            let file = folder.create(name)?;
            let begun = if name == FST { fst_aside(file, &layout, clock) } else { vcd_aside(file, &layout, clock) };
            begun.map_err(failed(folder, name))
        });
        let files = begun.collect::<Result<Vec<_>, Failure>>()?;
        let dumps = names().zip(files).map(|(name, file)| {
            let (save, commands) = (folder.create(&save_name(name))?, folder.create(&commands_name(name))?);
            Ok(Dump { name, file, save, commands })
        });
        let dumps = dumps.collect::<Result<_, Failure>>()?;
        let contact = simulation.contact_net();
        Ok(Self { layout, clock, dumps, contact, touched: None, shown, before: None })
    }

    /// Completes the files of a run that ends at `end`. Marks the edge `mark`, if it is given, the first contact, the
    /// edges that are `named`, and the faults.
    pub fn finish(
        mut self,
        folder: &Folder,
        end: Cycle,
        mark: Option<Cycle>,
        named: Vec<(Cycle, String)>,
        faults: &[Mark],
    ) -> Result<(), Failure> {
        if self.shown.start <= end.0 {
            self.come_in();
        }
        let touched = self.touched.map(|edge| (edge, "first contact".to_string()));
        let faults = faults.iter().map(|mark| (Cycle(mark.edge), mark.what.to_string()));
        let named: Vec<_> = touched.into_iter().chain(named).chain(faults).collect();
        for Dump { name, file, mut save, mut commands } in self.dumps {
            let span = Cycle(self.shown.start)..Cycle(end.0.min(self.shown.end));
            let text = gtkw(&self.layout, name, self.clock, span, mark, &named);
            save.write_all(text.as_bytes()).map_err(failed(folder, &save_name(name)))?;
            let text = sucl(&self.layout, name, self.clock, &named);
            commands.write_all(text.as_bytes()).map_err(failed(folder, &commands_name(name)))?;
            file.complete(end.min(Cycle(self.shown.end - 1))).map_err(failed(folder, name))?;
        }
        Ok(())
    }
}

/// Returns the name of a dump's save file.
fn save_name(dump: &str) -> String {
    format!("{dump}.gtkw")
}

/// Returns the name of a dump's commands for Surfer.
fn commands_name(dump: &str) -> String {
    format!("{dump}.sucl")
}

fn failed(folder: &Folder, name: &str) -> impl FnOnce(io::Error) -> Failure {
    let place = folder.place(name);
    move |error| Failure::at(&place, error)
}

/// Returns the signals of the waveforms of a run, with wall and hand and, if the scene asks for them, the overflows and
/// the clock. A run that is compared with another, as one of VHDL, has one net more than the loop, and no overflows.
pub fn layout(simulation: &AnySimulation, is_compared: bool, chosen: &Chosen) -> Layout {
    let layout = match simulation {
        AnySimulation::Ours(ours) if simulation.record().overflows && !is_compared => {
            Layout::of(ours).with_overflows(ours.wiring().block().inputs().len())
        }
        AnySimulation::Ours(ours) => Layout::of(ours),
        AnySimulation::Dut(dut) => Layout::of_design(dut),
    };
    let layout = if chosen.is_by_name() {
        let (top, is_port) = (simulation.closed_by().to_string(), chosen::is_port(simulation));
        layout.with_nets(&|path| chosen.shows(&top, path, is_port(path)))
    } else {
        layout
    };
    let layout = if is_compared { layout.with_comparison() } else { layout };
    let layout = layout.with_wall_and_hand(simulation);
    if simulation.record().clock { layout.with_clock() } else { layout }
}

impl Waves {
    /// Writes the words with which the stretch begins that is shown, once it is reached.
    fn come_in(&mut self) {
        if let Some(words) = self.before.take() {
            self.dumps.iter_mut().for_each(|dump| dump.file.nets(Cycle(self.shown.start), &words));
        }
    }
}

impl Observe for Waves {
    #[inline]
    fn nets(&mut self, cycle: Cycle, words: &[i64]) {
        if self.touched.is_none() && self.contact.is_some_and(|net| words[net] != 0 && words[net] != UNKNOWN) {
            self.touched = Some(cycle);
        }
        if cycle.0 < self.shown.start {
            let before = self.before.get_or_insert_default();
            before.clear();
            before.extend_from_slice(words);
        } else if self.shown.contains(&cycle.0) {
            if cycle.0 > self.shown.start {
                self.come_in();
            }
            self.before = None;
            self.dumps.iter_mut().for_each(|dump| dump.file.nets(cycle, words));
        }
    }

    fn watches_overflows(&self) -> bool {
        self.dumps.iter().any(|dump| dump.file.watches_overflows())
    }

    fn overflows(&mut self, cycle: Cycle, nets: u64) {
        if self.shown.contains(&cycle.0) {
            self.dumps.iter_mut().for_each(|dump| dump.file.overflows(cycle, nets));
        }
    }

    #[inline]
    fn reals(&mut self, cycle: Cycle, values: &[f64]) {
        if self.shown.contains(&cycle.0) {
            if cycle.0 > self.shown.start {
                self.come_in();
            }
            self.dumps.iter_mut().for_each(|dump| dump.file.reals(cycle, values));
        }
    }
}
