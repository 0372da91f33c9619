//! Value change dumps (IEEE 1364): text that every waveform viewer can read.

use std::io::{self, BufWriter, IntoInnerError, Write};

use hpu_cosim::SIGNS;
use hpu_signal::{Clock, UNKNOWN};
use vcd::{IdCode, TimescaleUnit, VarType, Writer};

use crate::timescale::Timescale;
use crate::{Layout, Recording, Scope, Sink, Source, VERSION};

/// A recording in VCD. Names, kinds and hierarchy are those of GHDL's `--vcd`; ports share the code of their net.
///
/// # Example
///
/// ```
/// # fn record(wiring: &impl hpu_datapath::Wiring, clock: hpu_signal::Clock) -> std::io::Result<()> {
/// use hpu_wave::{Layout, Vcd};
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
    /// The columns by slot.
    vars: Vec<Column>,
}

/// The parts of a variable's lines.
#[derive(Clone, Default)]
struct Column {
    width: u32,
    /// A space, the code of the variable, a line feed.
    end: String,
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
        if !layout.reals.is_empty() {
            header.comment(SIGNS)?;
        }
        let power = Timescale::of(clock).power();
        header.timescale(10u32.pow(power % 3), UNITS[power as usize / 3])?;
        let mut vars = vec![Column::default(); layout.slots()];
        for scope in layout.scopes() {
            declare(&mut header, layout, scope, &mut vars)?;
        }
        header.enddefinitions()?;
        Self::begin(VcdFile { out, vars }, layout, clock)
    }
}

/// The units from a picosecond on, each a thousand times the one before.
const UNITS: [TimescaleUnit; 4] = [TimescaleUnit::PS, TimescaleUnit::NS, TimescaleUnit::US, TimescaleUnit::MS];

fn declare<W: Write>(header: &mut Writer<W>, layout: &Layout, scope: &Scope, vars: &mut [Column]) -> io::Result<()> {
    header.add_module(&scope.name)?;
    for var in &scope.vars {
        let kind = match var.source {
            Source::Real(_) => VarType::Real,
            _ => VarType::Reg,
        };
        let slot = layout.slot(var.source);
        let code = IdCode::from(slot as u64);
        header.var_def(kind, var.width, code, &var.name, None)?;
        vars[slot] = Column { width: var.width, end: format!(" {code}\n") };
    }
    for inner in &scope.scopes {
        declare(header, layout, inner, vars)?;
    }
    header.upscope()
}

// The `vcd` crate formats vectors bit by bit, and writes a tiny real with hundreds of decimals. Lines that are put
// together here are short and are written faster.
impl<W: Write> Sink for VcdFile<W> {
    type Out = W;

    fn time(&mut self, mut time: u64) -> io::Result<()> {
        // The `#`, at most twenty digits, and the line feed.
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

    fn word(&mut self, slot: usize, word: i64) -> io::Result<()> {
        let Column { width, end } = &self.vars[slot];
        let mut text = [b'x'; 64];
        let is_unknown = word == UNKNOWN && *width < 64;
        let digits = if is_unknown { &text[..*width as usize] } else { digits(*width, word, &mut text) };
        let (start, end): (&[u8], _) = if *width == 1 { (b"", &end.as_bytes()[1..]) } else { (b"b", end.as_bytes()) };
        [start, digits, end].iter().try_for_each(|part| self.out.write_all(part))
    }

    fn real(&mut self, slot: usize, value: f64) -> io::Result<()> {
        write!(self.out, "r{value:e}{}", self.vars[slot].end)
    }

    fn finish(self) -> io::Result<W> {
        self.out.into_inner().map_err(IntoInnerError::into_error)
    }
}

/// Returns the word's bits as characters, the most significant first.
fn digits(width: u32, word: i64, text: &mut [u8; 64]) -> &[u8] {
    // The most significant bit first in the first byte.
    let bits = word << (64 - width);
    let chunks = text.chunks_exact_mut(8).zip(bits.to_be_bytes());
    for (chunk, byte) in chunks.take(width.div_ceil(8) as usize) {
        chunk.copy_from_slice(&EIGHT_DIGITS[usize::from(byte)]);
    }
    &text[..width as usize]
}

/// The eight binary digits of each byte, as characters.
static EIGHT_DIGITS: [[u8; 8]; 256] = {
    let mut all = [[b'0'; 8]; 256];
    let mut byte = 0;
    while byte < 256 {
        let mut place = 0;
        while place < 8 {
            all[byte][place] += (byte >> (7 - place)) as u8 & 1;
            place += 1;
        }
        byte += 1;
    }
    all
};
