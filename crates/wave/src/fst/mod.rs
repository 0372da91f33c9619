//! FST, GTKWave's compressed format, for long runs.
//!
//! The file has the format that GTKWave's own writer uses and its readers expect: a header, the hierarchy, the signals'
//! kinds, then sections of changes ([`section`]). Optional parts are left out: blackouts, attributes, and aliases found
//! by content.

mod section;

use std::io::{self, Seek, SeekFrom, Write};

use hpu_signal::Clock;

use self::section::{Kind, Section, put_varint};
use crate::timescale::Timescale;
use crate::{Layout, Recording, Scope, Sink, Source, VERSION};

/// A recording in FST, with the variables and values of [`Vcd`](crate::Vcd).
pub type Fst<W> = Recording<FstFile<W>>;

/// The FST side of a [`Recording`].
pub struct FstFile<W: Write + Seek> {
    out: W,
    header: Header,
    section: Section,
}

/// Size in bytes up to which changes are kept in memory before they are packed into a section of the file.
const SECTION_BYTES: usize = 1 << 18;

impl<W: Write + Seek> Fst<W> {
    /// Writes the header and begins the recording. `out` need not be buffered; the file starts at its beginning.
    ///
    /// # Errors
    ///
    /// When writing fails.
    pub fn new(mut out: W, layout: &Layout, clock: Clock) -> io::Result<Self> {
        let mut hierarchy = Hierarchy::default();
        for scope in layout.scopes() {
            hierarchy.declare(layout, scope);
        }
        let Hierarchy { text, signals, scopes, vars } = hierarchy;
        let mut geometry = Vec::new();
        for (_, kind) in &signals {
            // A real has no width, so its width is written as 0.
            put_varint(&mut geometry, if let Kind::Word(width) = *kind { width.into() } else { 0 });
        }
        let count = signals.len() as u64;
        let header = Header { timescale: Timescale::of(clock), end: 0, scopes, vars, signals: count, sections: 0 };
        let mut start = header.block();
        put_block(&mut start, HIERARCHY_LZ4, &[&numbers([text.len() as u64]), &lz4_flex::block::compress(&text)]);
        // The packed length is the same as the unpacked one, because the block is not packed.
        put_block(&mut start, GEOMETRY, &[&numbers([geometry.len() as u64, count]), &geometry]);
        out.write_all(&start)?;
        let section = Section::new(layout.slots(), signals, layout.shows(Source::Clock));
        Self::begin(FstFile { out, header, section }, layout, clock)
    }
}

// Kinds of block. A block is a byte with its kind, then the length of the rest, including the length itself.
const HEADER: u8 = 0;
const GEOMETRY: u8 = 3;
const HIERARCHY_LZ4: u8 = 6;
const CHANGES: u8 = 8;

fn put_block(file: &mut Vec<u8>, kind: u8, parts: &[&[u8]]) {
    file.push(kind);
    let length: usize = 8 + parts.iter().map(|part| part.len()).sum::<usize>();
    file.extend((length as u64).to_be_bytes());
    parts.iter().for_each(|part| file.extend_from_slice(part));
}

/// Returns numbers one after another, in the form of blocks.
fn numbers<const N: usize>(values: [u64; N]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_be_bytes()).collect()
}

/// The contents of the first block. It is written twice, because some of it is known only at the end.
struct Header {
    timescale: Timescale,
    end: u64,
    scopes: u64,
    vars: u64,
    signals: u64,
    sections: u64,
}

impl Header {
    fn block(&self) -> Vec<u8> {
        let (start, writer_memory, time_zero) = (0, 0, 0);
        // This number shows readers the byte order of reals.
        let order = std::f64::consts::E.to_le_bytes();
        let counts = numbers([writer_memory, self.scopes, self.vars, self.signals, self.sections]);
        let exponent = self.timescale.power() as i8 - 12;
        let mut version = [0; 128];
        version[..VERSION.len()].copy_from_slice(VERSION.as_bytes());
        let (date, vhdl) = ([0; 119], 1);
        let kind = [&[exponent.cast_unsigned()][..], &version, &date, &[vhdl]].concat();
        let mut block = Vec::new();
        put_block(&mut block, HEADER, &[&numbers([start, self.end]), &order, &counts, &kind, &numbers([time_zero])]);
        block
    }
}

/// The hierarchy in the form of the file, and the signals in the order in which it first names them.
#[derive(Default)]
struct Hierarchy {
    text: Vec<u8>,
    /// Slot and kind of each signal.
    signals: Vec<(usize, Kind)>,
    scopes: u64,
    vars: u64,
}

impl Hierarchy {
    fn declare(&mut self, layout: &Layout, scope: &Scope) {
        const SCOPE: [u8; 2] = [254, 0];
        const SCOPE_ENDS: u8 = 255;
        const REAL: [u8; 2] = [3, 0];
        const REG: [u8; 2] = [5, 0];
        self.scopes += 1;
        self.text.extend(SCOPE);
        self.text.extend_from_slice(scope.name.as_bytes());
        // The end of the scope's name, and an empty component name.
        self.text.extend([0; 2]);
        for var in &scope.vars {
            let (tag, kind, size) = match var.source {
                Source::Real(_) => (REAL, Kind::Real, 8),
                _ => (REG, Kind::Word(var.width), var.width),
            };
            self.vars += 1;
            self.text.extend(tag);
            self.text.extend_from_slice(var.name.as_bytes());
            self.text.push(0);
            put_varint(&mut self.text, size.into());
            // A signal that already has a name is written as its number, counted from 1.
            let slot = layout.slot(var.source);
            let known = self.signals.iter().position(|&(other, _)| other == slot);
            put_varint(&mut self.text, known.map_or(0, |index| index as u64 + 1));
            if known.is_none() {
                self.signals.push((slot, kind));
            }
        }
        for inner in &scope.scopes {
            self.declare(layout, inner);
        }
        self.text.push(SCOPE_ENDS);
    }
}

impl<W: Write + Seek> FstFile<W> {
    fn pack(&mut self) -> io::Result<()> {
        self.header.sections += 1;
        self.out.write_all(self.section.pack())
    }
}

impl<W: Write + Seek> Sink for FstFile<W> {
    type Out = W;

    fn time(&mut self, time: u64) -> io::Result<()> {
        // A section may end only where a new instant begins.
        if self.section.size() > SECTION_BYTES {
            self.pack()?;
        }
        self.section.begin(time);
        Ok(())
    }

    fn word(&mut self, slot: usize, word: i64) -> io::Result<()> {
        self.section.word(slot, word);
        Ok(())
    }

    fn real(&mut self, slot: usize, value: f64) -> io::Result<()> {
        self.section.real(slot, value);
        Ok(())
    }

    fn finish(mut self) -> io::Result<W> {
        self.pack()?;
        self.header.end = self.section.end();
        self.out.seek(SeekFrom::Start(0))?;
        self.out.write_all(&self.header.block())?;
        self.out.flush()?;
        Ok(self.out)
    }
}
