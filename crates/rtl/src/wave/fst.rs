//! GTKWave's compressed format: for long runs.

use std::io::{self, BufWriter, IntoInnerError, Seek, Write};

use fst_writer::{
    FstBodyWriter, FstFileType, FstHeaderWriter, FstInfo, FstScopeType, FstSignalId, FstSignalType, FstVarDirection,
    FstVarType, FstWriteError,
};
use hpu_signal::Clock;

use super::timescale::Timescale;
use super::{Layout, Recording, Scope, Sink, Source, VERSION};

/// A recording in FST, with the variables and values of [`Vcd`](super::Vcd).
pub type Fst<W> = Recording<FstFile<W>>;

/// The FST side of a [`Recording`].
pub struct FstFile<W: Write + Seek> {
    body: FstBodyWriter<BufWriter<W>>,
    ids: Vec<Option<FstSignalId>>,
}

/// Changes are kept in memory up to this size, then packed into a section of the file.
const SECTION_BYTES: usize = 32 << 20;

impl<W: Write + Seek> Fst<W> {
    /// Writes the header and begins the recording. `out` need not be buffered; the file starts at its beginning.
    ///
    /// # Errors
    ///
    /// When writing fails.
    pub fn new(out: W, layout: &Layout, clock: Clock) -> io::Result<Self> {
        let info = FstInfo {
            start_time: 0,
            timescale_exponent: Timescale::of(clock).power() as i8 - 12,
            version: VERSION.to_string(),
            date: String::new(),
            file_type: FstFileType::Vhdl,
        };
        let mut header = FstHeaderWriter::new(BufWriter::with_capacity(1 << 16, out), &info).map_err(plain)?;
        let mut ids = vec![None; layout.slots()];
        for scope in layout.scopes() {
            declare(&mut header, layout, scope, &mut ids).map_err(plain)?;
        }
        let mut body = header.finish().map_err(plain)?;
        // A recording hands over changes alone.
        body.set_deduplicate(false);
        Self::begin(FstFile { body, ids }, layout, clock)
    }
}

fn declare<W: Write + Seek>(
    header: &mut FstHeaderWriter<W>,
    layout: &Layout,
    scope: &Scope,
    ids: &mut [Option<FstSignalId>],
) -> Result<(), FstWriteError> {
    header.scope(&scope.name, "", FstScopeType::Module)?;
    for var in &scope.vars {
        let (signal, kind) = match var.source {
            Source::Real(_) => (FstSignalType::real(), FstVarType::Real),
            _ => (FstSignalType::bit_vec(var.width), FstVarType::Reg),
        };
        let id = &mut ids[layout.slot(var.source)];
        *id = Some(header.var(&var.name, signal, kind, FstVarDirection::Implicit, *id)?);
    }
    for inner in &scope.scopes {
        declare(header, layout, inner, ids)?;
    }
    header.up_scope()
}

fn plain(error: FstWriteError) -> io::Error {
    match error {
        FstWriteError::Io(error) => error,
        other => io::Error::other(other),
    }
}

impl<W: Write + Seek> FstFile<W> {
    fn change(&mut self, slot: usize, value: &[u8]) -> io::Result<()> {
        match self.ids[slot] {
            Some(id) => self.body.signal_change(id, value).map_err(plain),
            None => Ok(()),
        }
    }
}

impl<W: Write + Seek> Sink for FstFile<W> {
    type Out = W;

    fn time(&mut self, time: u64) -> io::Result<()> {
        // A section may only end where a new instant begins.
        if self.body.size() > SECTION_BYTES {
            self.body.flush().map_err(plain)?;
        }
        self.body.time_change(time).map_err(plain)
    }

    fn word(&mut self, slot: usize, digits: &[u8]) -> io::Result<()> {
        self.change(slot, digits)
    }

    fn real(&mut self, slot: usize, value: f64) -> io::Result<()> {
        self.change(slot, &value.to_le_bytes())
    }

    fn finish(self) -> io::Result<W> {
        let out = self.body.finish().map_err(plain)?;
        out.into_inner().map_err(IntoInnerError::into_error)
    }
}
