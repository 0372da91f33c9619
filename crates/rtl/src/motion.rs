//! What the world that the VHDL drives does, on its way from GHDL's process to ours: words of 8 bytes through a named
//! pipe.
//!
//! Each piece begins with its kind: changed nets (edge, how many, index and word of each), a row of the plant's outputs
//! (edge, values), or the end ([`Totals`]).

use std::ffi::CString;
use std::fs::{File, OpenOptions};
use std::io::{self, BufReader, BufWriter, ErrorKind, Read, Write};
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use hpu_cosim::{Control, EnergyAudit, Mark};
use hpu_signal::{Cycle, Observe, SignalUse, UNKNOWN};

use crate::ghdl::GhdlError;
use crate::side::Totals;

const NETS: u64 = 0;
const REALS: u64 = 1;
const END: u64 = 2;

/// Edges after which what was recorded is handed on: a fraction of a second.
const FLUSH: u64 = 50_000;
/// How long a reader waits where there is nothing to read.
const WAIT: Duration = Duration::from_millis(2);

/// The side that records. What cannot be handed on ends the process: nobody would know of its run.
pub(crate) struct Recorder {
    out: BufWriter<File>,
    /// The words of the nets as they were recorded last.
    words: Vec<i64>,
    flushed: u64,
}

impl Recorder {
    pub(crate) fn open(path: &Path) -> io::Result<Self> {
        let out = BufWriter::with_capacity(1 << 16, OpenOptions::new().write(true).open(path)?);
        Ok(Self { out, words: Vec::new(), flushed: 0 })
    }

    fn put(&mut self, words: impl IntoIterator<Item = u64>) {
        let put = words.into_iter().try_for_each(|word| self.out.write_all(&word.to_le_bytes()));
        put.unwrap_or_else(|error| panic!("the motion cannot be told: {error}"));
    }

    /// The words of all nets after an edge.
    pub(crate) fn nets(&mut self, edge: u64, words: &[i64]) {
        let known = std::mem::take(&mut self.words);
        let changed = || (0..).zip(words).filter(|&(index, word): &(usize, _)| known.get(index) != Some(word));
        self.put([NETS, edge, changed().count() as u64]);
        self.put(changed().flat_map(|(index, word)| [index as u64, word.cast_unsigned()]));
        self.words = known;
        self.words.clear();
        self.words.extend_from_slice(words);
    }

    /// The outputs of the plant at an edge.
    pub(crate) fn reals(&mut self, edge: u64, values: &[f64]) {
        self.put([REALS, edge]);
        self.put(values.iter().map(|value| value.to_bits()));
        if edge >= self.flushed + FLUSH {
            self.flushed = edge;
            self.flush();
        }
    }

    fn flush(&mut self) {
        self.out.flush().unwrap_or_else(|error| panic!("the motion cannot be told: {error}"));
    }

    /// What it has come to.
    pub(crate) fn complete(mut self, totals: &Totals) {
        self.put([END]);
        let Totals {
            edges,
            output_changes,
            encoder_edges,
            mode_changes,
            steps,
            redecided,
            energy,
            faults,
            faults_waiting,
            uses,
            over,
        } = totals;
        self.put([*edges, *output_changes, *encoder_edges, *mode_changes, *steps, *redecided]);
        self.put(flows(&mut energy.clone()).map(|flow| flow.to_bits()));
        self.put([*faults_waiting, faults.len() as u64]);
        self.put(faults.iter().flat_map(|mark| {
            let kind = Mark::KINDS.iter().position(|kind| *kind == mark.what).expect("one of them");
            [mark.edge, kind as u64]
        }));
        self.put([uses.len() as u64]);
        self.put(uses.iter().flat_map(|&SignalUse { min, max, rounded, overflowed }| {
            [min.cast_unsigned(), max.cast_unsigned(), rounded, overflowed]
        }));
        let over = over.as_deref().unwrap_or("").as_bytes();
        self.put([over.len() as u64]);
        self.put(over.iter().map(|&byte| byte.into()));
        self.flush();
    }
}

/// The flows of an audit, in the order in which they are told.
fn flows(energy: &mut EnergyAudit) -> [&mut f64; 12] {
    let EnergyAudit { source_j, hand_j, supplied_j, stored_j, copper_j, diodes_j, .. } = energy;
    let EnergyAudit { viscous_j, coulomb_j, transmission_j, dissipated_j, exchanged_j, residual_j, .. } = energy;
    [
        source_j,
        hand_j,
        supplied_j,
        stored_j,
        copper_j,
        diodes_j,
        viscous_j,
        coulomb_j,
        transmission_j,
        dissipated_j,
        exchanged_j,
        residual_j,
    ]
}

/// The end of a named pipe that is read from.
pub(crate) struct Pipe {
    file: File,
}

/// A motion that was played to its end.
pub(crate) struct Played {
    pub(crate) totals: Totals,
    /// Of each net the least and the greatest word that it had from the first edge on, unknown ones left out.
    pub(crate) ranges: Vec<(i64, i64)>,
}

impl Pipe {
    /// Its name in the folder.
    pub(crate) const NAME: &str = "motion";

    /// Makes the pipe in a folder.
    pub(crate) fn new(dir: &Path) -> Result<Self, GhdlError> {
        let path = dir.join(Self::NAME);
        let failed = |error| GhdlError::Io(path.clone(), error);
        let name = CString::new(path.as_os_str().as_bytes()).map_err(|error| failed(error.into()))?;
        // SAFETY: `mkfifo` reads a string that ends with a zero byte, and nothing else of ours.
        if unsafe { libc::mkfifo(name.as_ptr(), 0o600) } != 0 {
            return Err(failed(io::Error::last_os_error()));
        }
        // To open it would wait otherwise for a writer, which may never come.
        let open = OpenOptions::new().read(true).custom_flags(libc::O_NONBLOCK).open(&path);
        Ok(Self { file: open.map_err(failed)? })
    }

    /// Shows a motion of so many nets and outputs of the plant to an observer as it comes, until who writes has
    /// `ended`, or the control stops it; then who still writes fails. `None` when the motion has no end.
    pub(crate) fn play(
        self,
        ended: &AtomicBool,
        (nets, reals): (usize, usize),
        observer: &mut dyn Observe,
        control: &Control,
    ) -> Option<Played> {
        let from = BufReader::with_capacity(1 << 16, Following { file: self.file, ended, control });
        let mut player = Player { from, words: vec![0; nets], ranges: vec![(i64::MAX, i64::MIN); nets] };
        let mut values = vec![0.0; reals];
        loop {
            match player.word()? {
                NETS => player.nets(observer)?,
                REALS => {
                    let edge = player.word()?;
                    control.progress.store(edge, Ordering::Relaxed);
                    for value in &mut values {
                        *value = f64::from_bits(player.word()?);
                    }
                    observer.reals(Cycle(edge), &values);
                }
                _ => {
                    let totals = player.totals()?;
                    return Some(Played { totals, ranges: player.ranges });
                }
            }
        }
    }
}

/// Reads what is written to a pipe, and waits for more until nobody will write.
struct Following<'a> {
    file: File,
    ended: &'a AtomicBool,
    control: &'a Control,
}

impl Read for Following<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        while !self.control.stop.load(Ordering::Relaxed) {
            // Before the look for more: what was written until then is found by it.
            let ended = self.ended.load(Ordering::Acquire);
            match self.file.read(buffer) {
                Ok(0) if ended => break,
                Err(error) if error.kind() != ErrorKind::WouldBlock => return Err(error),
                Ok(0) | Err(_) => thread::sleep(WAIT),
                read => return read,
            }
        }
        Ok(0)
    }
}

/// Takes pieces of a motion; `None` where it is broken off.
struct Player<R> {
    from: R,
    words: Vec<i64>,
    ranges: Vec<(i64, i64)>,
}

impl<R: Read> Player<R> {
    fn word(&mut self) -> Option<u64> {
        let mut bytes = [0; 8];
        self.from.read_exact(&mut bytes).ok()?;
        Some(u64::from_le_bytes(bytes))
    }

    fn nets(&mut self, observer: &mut dyn Observe) -> Option<()> {
        let (edge, changed) = (self.word()?, self.word()?);
        for _ in 0..changed {
            let (index, word) = (self.word()?, self.word()?);
            *self.words.get_mut(usize::try_from(index).ok()?)? = word.cast_signed();
        }
        if edge > 0 {
            for ((least, greatest), &word) in self.ranges.iter_mut().zip(&self.words) {
                if word != UNKNOWN {
                    (*least, *greatest) = ((*least).min(word), (*greatest).max(word));
                }
            }
        }
        observer.nets(Cycle(edge), &self.words);
        Some(())
    }

    fn totals(&mut self) -> Option<Totals> {
        let mut counts = [0; 6];
        for count in &mut counts {
            *count = self.word()?;
        }
        let [edges, output_changes, encoder_edges, mode_changes, steps, redecided] = counts;
        let mut energy = EnergyAudit::default();
        for flow in flows(&mut energy) {
            *flow = f64::from_bits(self.word()?);
        }
        let faults_waiting = self.word()?;
        let faults = (0..self.word()?).map(|_| {
            let (edge, kind) = (self.word()?, usize::try_from(self.word()?).ok()?);
            Some(Mark { edge, what: Mark::KINDS.get(kind)? })
        });
        let faults = faults.collect::<Option<_>>()?;
        let uses = (0..self.word()?).map(|_| {
            let (min, max) = (self.word()?.cast_signed(), self.word()?.cast_signed());
            Some(SignalUse { min, max, rounded: self.word()?, overflowed: self.word()? })
        });
        let uses = uses.collect::<Option<_>>()?;
        let length = self.word()?;
        let over = (0..length).map(|_| u8::try_from(self.word()?).ok()).collect::<Option<Vec<_>>>()?;
        let over = if length == 0 { None } else { Some(String::from_utf8(over).ok()?) };
        Some(Totals {
            edges,
            output_changes,
            encoder_edges,
            mode_changes,
            steps,
            redecided,
            energy,
            faults,
            faults_waiting,
            uses,
            over,
        })
    }
}
