//! The waveform files of a run.

use std::fs::File;
use std::io::{self, Write};

use hpu_cosim::{AnySimulation, Mark, PlainName, Simulation, Wired};
use hpu_rtl::Around;
use hpu_signal::{Clock, Cycle, Observe, UNKNOWN};
use hpu_wave::{Layout, WaveFile, fst_aside, gtkw, mismatch_gtkw, mismatch_vcd, sucl, vcd_aside};

use crate::shell::{Failure, Folder};

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
}

/// A waveform, and the files for GTKWave and for Surfer, which are written at its end.
struct Dump {
    name: &'static str,
    file: Box<dyn WaveFile>,
    save: File,
    commands: File,
}

impl Waves {
    /// Begins the files. A run of VHDL has one net more than the wiring.
    pub fn begin(
        simulation: &AnySimulation,
        folder: &mut Folder,
        with_vcd: bool,
        of_vhdl: bool,
    ) -> Result<Self, Failure> {
        let clock = simulation.clock();
        let layout = layout(simulation, of_vhdl);
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
        Ok(Self { layout, clock, dumps, contact: simulation.contact_net(), touched: None })
    }

    /// Completes the files of a run that ends at `end`. Marks the edge `mark`, if it is given, the first contact, the
    /// edges that are `named`, and the faults.
    pub fn finish(
        self,
        folder: &Folder,
        end: Cycle,
        mark: Option<Cycle>,
        named: Vec<(Cycle, String)>,
        faults: &[Mark],
    ) -> Result<(), Failure> {
        let touched = self.touched.map(|edge| (edge, "first contact".to_string()));
        let faults = faults.iter().map(|mark| (Cycle(mark.edge), mark.what.to_string()));
        let named: Vec<_> = touched.into_iter().chain(named).chain(faults).collect();
        for Dump { name, file, mut save, mut commands } in self.dumps {
            let text = gtkw(&self.layout, name, self.clock, Cycle(0)..end, mark, &named);
            save.write_all(text.as_bytes()).map_err(failed(folder, &save_name(name)))?;
            let text = sucl(&self.layout, name, self.clock, &named);
            commands.write_all(text.as_bytes()).map_err(failed(folder, &commands_name(name)))?;
            file.complete(end).map_err(failed(folder, name))?;
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
pub fn layout(simulation: &AnySimulation, is_compared: bool) -> Layout {
    let layout = match simulation {
        AnySimulation::Ours(ours) if simulation.record().overflows && !is_compared => {
            Layout::of(ours).with_overflows(ours.wiring().block().inputs().len())
        }
        AnySimulation::Ours(ours) => Layout::of(ours),
        AnySimulation::Dut(dut) => Layout::of_design(dut),
    };
    let layout = if is_compared { layout.with_comparison() } else { layout };
    let layout = layout.with_wall_and_hand(simulation);
    if simulation.record().clock { layout.with_clock() } else { layout }
}

impl Observe for Waves {
    #[inline]
    fn nets(&mut self, cycle: Cycle, words: &[i64]) {
        if self.touched.is_none() && self.contact.is_some_and(|net| words[net] != 0 && words[net] != UNKNOWN) {
            self.touched = Some(cycle);
        }
        self.dumps.iter_mut().for_each(|dump| dump.file.nets(cycle, words));
    }

    fn watches_overflows(&self) -> bool {
        self.dumps.iter().any(|dump| dump.file.watches_overflows())
    }

    fn overflows(&mut self, cycle: Cycle, nets: u64) {
        self.dumps.iter_mut().for_each(|dump| dump.file.overflows(cycle, nets));
    }

    #[inline]
    fn reals(&mut self, cycle: Cycle, values: &[f64]) {
        self.dumps.iter_mut().for_each(|dump| dump.file.reals(cycle, values));
    }
}
