//! The waveform files of a run.

use std::fs::File;
use std::io;

use hpu_cosim::Rig;
use hpu_rtl::wave::{Aside, Fst, FstFile, Layout, Recording, Vcd, VcdFile, gtkw};
use hpu_signal::{Cycle, Observe};

use crate::exit::Failure;
use crate::files::Folder;

const FST: &str = "wave.fst";
const VCD: &str = "wave.vcd";

/// Writes an FST with its GTKWave save file, and a VCD when asked, while it watches a run: each file on a thread of its own.
pub struct Waves {
    fst: Recording<Aside<FstFile<File>>>,
    vcd: Option<Recording<Aside<VcdFile<File>>>>,
}

impl Waves {
    /// Begins the files.
    pub fn begin(session: &impl Rig, folder: &mut Folder, with_vcd: bool) -> Result<Self, Failure> {
        let clock = session.clock();
        let layout = layout(session);
        let fst_file = folder.create(FST)?;
        let fst = Fst::new(fst_file, &layout, clock).map_err(failed(folder, FST))?.aside();
        let vcd = if with_vcd {
            let vcd_file = folder.create(VCD)?;
            Some(Vcd::new(vcd_file, &layout, clock).map_err(failed(folder, VCD))?.aside())
        } else {
            None
        };
        folder.write("wave.fst.gtkw", gtkw(&layout, FST, clock, Cycle(0)..Cycle(session.edges())))?;
        Ok(Self { fst, vcd })
    }

    /// Completes the files.
    pub fn finish(self, folder: &Folder, end: Cycle) -> Result<(), Failure> {
        self.fst.finish(end).map_err(failed(folder, FST))?;
        self.vcd.map_or(Ok(()), |vcd| vcd.finish(end).map(drop).map_err(failed(folder, VCD)))
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
