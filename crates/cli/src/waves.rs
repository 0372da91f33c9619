//! The waveform files of a run.

use std::io;

use hpu_cosim::Rig;
use hpu_rtl::wave::{Layout, WaveFile, fst_aside, gtkw, vcd_aside};
use hpu_signal::{Cycle, Observe};

use crate::exit::Failure;
use crate::files::Folder;

const FST: &str = "wave.fst";
const VCD: &str = "wave.vcd";

/// Writes an FST with its GTKWave save file, and a VCD when asked, while it watches a run: each file on a thread of its own.
pub struct Waves {
    fst: Box<dyn WaveFile>,
    vcd: Option<Box<dyn WaveFile>>,
}

impl Waves {
    /// Begins the files.
    pub fn begin(session: &impl Rig, folder: &mut Folder, with_vcd: bool) -> Result<Self, Failure> {
        let clock = session.clock();
        let layout = layout(session);
        let fst_file = folder.create(FST)?;
        let fst = fst_aside(fst_file, &layout, clock).map_err(failed(folder, FST))?;
        let vcd = if with_vcd {
            let vcd_file = folder.create(VCD)?;
            Some(vcd_aside(vcd_file, &layout, clock).map_err(failed(folder, VCD))?)
        } else {
            None
        };
        folder.write("wave.fst.gtkw", gtkw(&layout, FST, clock, Cycle(0)..Cycle(session.edges())))?;
        Ok(Self { fst, vcd })
    }

    /// Completes the files.
    pub fn finish(self, folder: &Folder, end: Cycle) -> Result<(), Failure> {
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
