//! Value change dumps (IEEE 1364): text that every waveform viewer reads.

use std::io::{self, BufWriter, IntoInnerError, Write};

use hpu_signal::Clock;
use vcd::{IdCode, TimescaleUnit, VarType, Writer};

use super::timescale::Timescale;
use super::{Layout, Recording, Scope, Sink, Source, VERSION};

/// A recording in VCD. Names, kinds and hierarchy are those of GHDL's `--vcd`; ports share the code of their net.
///
/// # Example
///
/// ```
/// # fn record(wiring: &impl hpu_datapath::Wiring, clock: hpu_signal::Clock) -> std::io::Result<()> {
/// use hpu_rtl::wave::{Layout, Vcd};
/// use hpu_signal::{Cycle, Observe};
/// let layout = Layout::new(wiring, &[]).with_clock();
/// let mut vcd = Vcd::new(Vec::new(), &layout, clock)?;
/// vcd.nets(Cycle(0), wiring.words());
/// let text = vcd.finish(Cycle(100))?;
/// # Ok(()) }
/// ```
pub type Vcd<W> = Recording<VcdFile<W>>;

/// The VCD side of a [`Recording`].
pub struct VcdFile<W: Write> {
    out: BufWriter<W>,
    /// By slot, what ends a line: a space, the code of the variable, a line feed.
    ends: Vec<String>,
}

impl<W: Write> Vcd<W> {
    /// Writes the header and begins the recording. `out` need not be buffered.
    ///
    /// # Errors
    ///
    /// When writing fails.
    pub fn new(out: W, layout: &Layout, clock: Clock) -> io::Result<Self> {
        let mut out = BufWriter::with_capacity(1 << 16, out);
        let mut header = Writer::new(&mut out);
        header.version(VERSION)?;
        if let Some(channels) = layout.channels {
            let frequency_mhz = clock.frequency_hz() as f64 / 1e6;
            header.comment(&format!("Acquisition with {channels}/{channels} channels at {frequency_mhz} MHz"))?;
        }
        let power = Timescale::of(clock).power();
        header.timescale(10u32.pow(power % 3), UNITS[power as usize / 3])?;
        for scope in layout.scopes() {
            declare(&mut header, layout, scope)?;
        }
        header.enddefinitions()?;
        let ends = (0..layout.slots()).map(|slot| format!(" {}\n", code(slot))).collect();
        Self::begin(VcdFile { out, ends }, layout, clock)
    }
}

/// From a picosecond, by the thousand.
const UNITS: [TimescaleUnit; 4] = [TimescaleUnit::PS, TimescaleUnit::NS, TimescaleUnit::US, TimescaleUnit::MS];

fn code(slot: usize) -> IdCode {
    IdCode::from(slot as u64)
}

fn declare<W: Write>(header: &mut Writer<W>, layout: &Layout, scope: &Scope) -> io::Result<()> {
    header.add_module(&scope.name)?;
    for var in &scope.vars {
        let kind = match var.source {
            Source::Real(_) => VarType::Real,
            _ if layout.channels.is_some() => VarType::Wire,
            _ => VarType::Reg,
        };
        header.var_def(kind, var.width, code(layout.slot(var.source)), &var.name, None)?;
    }
    for inner in &scope.scopes {
        declare(header, layout, inner)?;
    }
    header.upscope()
}

// The `vcd` crate formats vectors bit by bit and writes a tiny real with hundreds of decimals: lines put together here
// are faster to write, and short.
impl<W: Write> Sink for VcdFile<W> {
    type Out = W;

    fn time(&mut self, mut time: u64) -> io::Result<()> {
        // The sign, at most twenty digits, the line feed.
        let mut line = [b'\n'; 22];
        let mut start = line.len() - 1;
        loop {
            start -= 1;
            line[start] = b'0' + (time % 10) as u8;
            time /= 10;
            if time == 0 {
                break;
            }
        }
        start -= 1;
        line[start] = b'#';
        self.out.write_all(&line[start..])
    }

    fn word(&mut self, slot: usize, digits: &[u8]) -> io::Result<()> {
        let end = self.ends[slot].as_bytes();
        let (start, end): (&[u8], _) = if digits.len() == 1 { (b"", &end[1..]) } else { (b"b", end) };
        [start, digits, end].iter().try_for_each(|part| self.out.write_all(part))
    }

    fn real(&mut self, slot: usize, value: f64) -> io::Result<()> {
        write!(self.out, "r{value:e}{}", self.ends[slot])
    }

    fn finish(self) -> io::Result<W> {
        self.out.into_inner().map_err(IntoInnerError::into_error)
    }
}
