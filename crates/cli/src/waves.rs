//! The waveform files of a run.

use std::fs::File;
use std::io::{self, Write};

use hpu_cosim::Rig;
use hpu_rtl::wave::{Layout, WaveFile, fst_aside, gtkw, vcd_aside};
use hpu_signal::{Clock, Cycle, Observe};

use crate::exit::Failure;
use crate::files::Folder;

const FST: &str = "wave.fst";
const SAVE: &str = "wave.fst.gtkw";
const VCD: &str = "wave.vcd";

/// Writes an FST with its GTKWave save file, and a VCD when asked, while it watches a run: each file on a thread of its own.
pub struct Waves {
    layout: Layout,
    clock: Clock,
    /// The save file, which is written at the end.
    save: File,
    fst: Box<dyn WaveFile>,
    vcd: Option<Box<dyn WaveFile>>,
}

impl Waves {
    /// Begins the files; a run of VHDL has a net more than the wiring.
    pub fn begin(session: &impl Rig, folder: &mut Folder, with_vcd: bool, of_vhdl: bool) -> Result<Self, Failure> {
        let clock = session.clock();
        let layout = layout(session);
        let layout = if of_vhdl { layout.with_comparison() } else { layout };
        let fst_file = folder.create(FST)?;
        let fst = fst_aside(fst_file, &layout, clock).map_err(failed(folder, FST))?;
        let vcd = if with_vcd {
            let vcd_file = folder.create(VCD)?;
            Some(vcd_aside(vcd_file, &layout, clock).map_err(failed(folder, VCD))?)
        } else {
            None
        };
        let save = folder.create(SAVE)?;
        Ok(Self { layout, clock, save, fst, vcd })
    }

    /// Completes the files of a run of so many edges, with a mark at one of them, if there is one to mark.
    pub fn finish(mut self, folder: &Folder, end: Cycle, mark: Option<Cycle>) -> Result<(), Failure> {
        let save = gtkw(&self.layout, FST, self.clock, Cycle(0)..end, mark);
        self.save.write_all(save.as_bytes()).map_err(failed(folder, SAVE))?;
        self.fst.complete(end).map_err(failed(folder, FST))?;
        self.vcd.map_or(Ok(()), |vcd| vcd.complete(end).map_err(failed(folder, VCD)))
    }
}

fn failed(folder: &Folder, name: &str) -> impl FnOnce(io::Error) -> Failure {
    let place = folder.place(name);
    move |error| Failure::at(&place, error)
}

fn layout(session: &impl Rig) -> Layout {
    let layout = Layout::of(session);
    if session.record().clock { layout.with_clock() } else { layout }
}

impl Observe for Waves {
    #[inline]
    fn nets(&mut self, cycle: Cycle, words: &[i64]) {
        self.fst.nets(cycle, words);
        if let Some(vcd) = &mut self.vcd {
            vcd.nets(cycle, words);
        }
    }

    #[inline]
    fn reals(&mut self, cycle: Cycle, values: &[f64]) {
        self.fst.reals(cycle, values);
        if let Some(vcd) = &mut self.vcd {
            vcd.reals(cycle, values);
        }
    }
}
