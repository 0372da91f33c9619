//! The state of a design in GHDL's process.

use std::ffi::{c_int, c_void};
use std::io::{self, Read};
use std::os::fd::FromRawFd;
use std::os::unix::net::UnixStream;
use std::ptr;

use super::vpi::Inside;
use super::{DESCRIPTOR, put, take};

unsafe extern "C" {
    /// Writes out what a stream has buffered (C, `stdio.h`).
    fn fflush(stream: *mut c_void) -> c_int;
}

/// Bits that VHDL passes in one call.
const PART_BITS: u32 = 30;
/// Parts of the widest port.
const PARTS: usize = 3;

/// The simulator's side: the state in GHDL's process, which `hpu_dut_bridge` calls.
pub(crate) struct Served {
    stream: UnixStream,
    drives: Vec<bool>,
    inputs: Vec<u64>,
    /// Parts of the bits that VHDL has reported of each port, -1 for unknown ones.
    told: Vec<[i32; PARTS]>,
    widths: Vec<u32>,
    /// The signals inside the design, if they are asked for. They are numbered after the ports.
    inside: Option<Inside>,
    /// The words after the last edge.
    words: Vec<Option<u64>>,
    /// Whether VHDL has reported anything since.
    is_told: bool,
    /// What is asked for: 0 outputs that drive the device, 1 all outputs, 2 also the signals inside.
    asked: u64,
    done: u64,
    changes: Vec<u64>,
}

impl Served {
    /// Receives the number of ports and their first words from the parent.
    pub(crate) fn open() -> io::Result<Self> {
        // SAFETY: the parent has made this descriptor for this process, and nothing else here uses it.
        let mut stream = unsafe { UnixStream::from_raw_fd(DESCRIPTOR) };
        let ports = take(&mut stream)? as usize;
        let drives = (0..ports).map(|_| Ok(take(&mut stream)? != 0)).collect::<io::Result<_>>()?;
        let inputs = (0..ports).map(|_| take(&mut stream)).collect::<io::Result<_>>()?;
        Ok(Self {
            stream,
            drives,
            inputs,
            told: vec![[-1; PARTS]; ports],
            widths: vec![0; ports],
            inside: Inside::listed(),
            words: vec![None; ports],
            is_told: true,
            asked: 2,
            done: 0,
            changes: Vec::new(),
        })
    }

    /// Returns part of the bits at an input.
    pub(crate) fn input(&self, port: usize, part: usize) -> i32 {
        let bits = self.inputs[port].checked_shr(PART_BITS * part as u32).unwrap_or(0);
        (bits & ((1 << PART_BITS) - 1)) as i32
    }

    /// Takes a part of a port's bits from VHDL, -1 for unknown ones, and the number of bits of the port.
    pub(crate) fn tell(&mut self, port: usize, part: usize, word: i32, width: u32) {
        self.told[port][part] = word;
        self.widths[port] = width;
        self.is_told = true;
    }

    /// Collects the changes after an edge, or after the reset. Returns whether an output that drives the device has
    /// changed.
    pub(crate) fn edge(&mut self, reset: bool) -> bool {
        self.done += u64::from(!reset);
        if self.asked == 2 {
            self.look_inside(reset);
        }
        if !std::mem::take(&mut self.is_told) {
            return false;
        }
        let mut changed = false;
        for port in 0..self.outside() {
            let parts = self.widths[port].div_ceil(PART_BITS) as usize;
            let whole = |bits: u64, &part: &i32| Some(bits << PART_BITS | u64::try_from(part).ok()?);
            let word = if parts == 0 { None } else { self.told[port][..parts].iter().rev().try_fold(0, whole) };
            // A word that is not told stays new for the request that asks for it.
            let is_asked = self.asked > 0 || self.drives[port];
            if is_asked && (word != self.words[port] || reset && parts > 0) {
                self.words[port] = word;
                changed |= self.drives[port];
                let known = u64::from(word.is_some());
                self.changes.extend([self.done, port as u64, word.unwrap_or(0), known]);
            }
        }
        changed
    }

    /// Returns the number of ports, without the signals inside.
    fn outside(&self) -> usize {
        self.words.len() - self.inside.as_ref().map_or(0, |inside| inside.signals.len())
    }

    /// Records the signals inside that have changed; after the reset, all whose bits are known.
    fn look_inside(&mut self, reset: bool) {
        let outside = self.outside();
        let Some(inside) = &self.inside else { return };
        for (signal, known) in self.words[outside..].iter_mut().enumerate() {
            let word = inside.word(signal);
            if word != *known || reset && word.is_some() {
                *known = word;
                let port = (outside + signal) as u64;
                self.changes.extend([self.done, port, word.unwrap_or(0), u64::from(word.is_some())]);
            }
        }
    }

    /// Sends the answer and receives the next request. Returns the number of edges to clock; `None` when the parent is
    /// gone.
    pub(crate) fn next(&mut self) -> Option<i32> {
        // SAFETY: null means all streams of the program, in which GHDL writes what the design says.
        unsafe { fflush(ptr::null_mut()) };
        // A design that ends the run ends GHDL, which then does not come here.
        let head = [self.done, self.changes.len() as u64 / 4, 0];
        put(&mut self.stream, &[&head, &self.changes[..]].concat()).ok()?;
        self.changes.clear();
        self.done = 0;
        let mut request = vec![0; 8 * (2 + self.inputs.len())];
        self.stream.read_exact(&mut request).ok()?;
        let mut request = &request[..];
        let edges = take(&mut request).ok()?;
        let asked = take(&mut request).ok()?;
        self.is_told |= asked > self.asked;
        self.asked = asked;
        for input in &mut self.inputs {
            *input = take(&mut request).ok()?;
        }
        i32::try_from(edges).ok()
    }
}
