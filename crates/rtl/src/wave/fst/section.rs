//! A section of an FST: the changes of a stretch of time, signal by signal.

use std::io::Write;

use flate2::Compression;
use flate2::write::ZlibEncoder;
use hpu_signal::UNKNOWN;

use super::{CHANGES, numbers};

/// What a signal's values are.
#[derive(Clone, Copy)]
pub enum Kind {
    /// Words of so many bits, 64 at most.
    Word(u32),
    Real,
}

/// The changes since the last section.
pub struct Section {
    /// By slot.
    streams: Vec<Stream>,
    /// Slots and kinds of the signals, in the order of the file.
    signals: Vec<(usize, Kind)>,
    start: u64,
    end: u64,
    /// Each instant's time, less that of the one before.
    times: Vec<u8>,
    /// Whether times are packed.
    pack_times: bool,
    instants: u64,
    /// All values at the start, as characters and bytes of reals.
    frame: Vec<u8>,
    size: usize,
    /// Memory for what is packed: the section, and one of its streams.
    packed: Vec<u8>,
    stream: Vec<u8>,
}

/// The changes of one signal.
#[derive(Clone, Default)]
struct Stream {
    /// Of its words.
    width: u32,
    /// The latest value.
    bits: u64,
    /// Which instant of the section changed it last.
    changed: u64,
    bytes: Vec<u8>,
}

impl Section {
    /// The first section. Slots that are no signal of the file are not written. Times of a `clock` repeat themselves
    /// and shrink to nothing; others hardly do, and to pack them would cost more than all else.
    pub fn new(slots: usize, signals: Vec<(usize, Kind)>, clock: bool) -> Self {
        let mut streams = vec![Stream::default(); slots];
        for &(slot, kind) in &signals {
            match kind {
                Kind::Word(width) => streams[slot].width = width,
                Kind::Real => streams[slot].bits = f64::NAN.to_bits(),
            }
        }
        Self {
            streams,
            signals,
            start: 0,
            end: 0,
            times: Vec::new(),
            pack_times: clock,
            instants: 0,
            frame: Vec::new(),
            size: 0,
            packed: Vec::new(),
            stream: Vec::new(),
        }
    }

    /// Bytes of changes so far.
    pub fn size(&self) -> usize {
        self.size + self.times.len()
    }

    /// The time of the latest instant.
    pub fn end(&self) -> u64 {
        self.end
    }

    /// Begins an instant. That of time 0 is no instant of its own: its values are those that the file starts with.
    pub fn begin(&mut self, time: u64) {
        if time == 0 {
            return;
        }
        let before = if self.instants == 0 { 0 } else { self.end };
        if self.instants == 0 {
            self.take_frame();
        }
        put_varint(&mut self.times, time - before);
        self.instants += 1;
        self.end = time;
    }

    fn take_frame(&mut self) {
        self.frame.clear();
        for &(slot, kind) in &self.signals {
            let bits = self.streams[slot].bits;
            match kind {
                Kind::Word(width) if is_unknown(width, bits) => self.frame.extend((0..width).map(|_| UNKNOWN_BIT)),
                Kind::Word(width) => {
                    self.frame.extend((0..width).rev().map(|place| b'0' + (bits >> place & 1) as u8));
                }
                Kind::Real => self.frame.extend(bits.to_le_bytes()),
            }
        }
    }

    /// A new word. Bits beyond its width are not looked at.
    #[inline]
    pub fn word(&mut self, slot: usize, word: i64) {
        self.change(slot, word.cast_unsigned(), |stream, later| {
            if is_unknown(stream.width, stream.bits) {
                stream.put_unknown(later);
            } else if stream.width == 1 {
                put_varint(&mut stream.bytes, later << 2 | (stream.bits & 1) << 1);
            } else {
                put_varint(&mut stream.bytes, later << 1);
                // The most significant bit first in the first byte.
                stream.bytes.extend_from_slice(&(word << (64 - stream.width)).to_be_bytes());
                // To copy eight bytes and drop some is quicker than to copy as many as there are.
                stream.bytes.truncate(stream.bytes.len() - 8 + stream.width.div_ceil(8) as usize);
            }
        });
    }

    /// A new real.
    #[inline]
    pub fn real(&mut self, slot: usize, value: f64) {
        self.change(slot, value.to_bits(), |stream, later| {
            put_varint(&mut stream.bytes, later << 1 | 1);
            stream.bytes.extend_from_slice(&value.to_le_bytes());
        });
    }

    /// A new value, put by what is told how many instants later it is.
    #[inline(always)]
    fn change(&mut self, slot: usize, bits: u64, put: impl FnOnce(&mut Stream, u64)) {
        let stream = &mut self.streams[slot];
        stream.bits = bits;
        let Some(later) = stream.later(self.instants) else { return };
        let before = stream.bytes.len();
        put(stream, later);
        self.size += stream.bytes.len() - before;
    }

    /// The section as the file has it. The next begins empty.
    pub fn pack(&mut self) -> &[u8] {
        let unpacked: usize = self.signals.iter().map(|&(slot, _)| self.streams[slot].bytes.len()).sum();
        let packed = &mut self.packed;
        packed.clear();
        packed.push(CHANGES);
        // Its length comes last.
        packed.extend(numbers([0, self.start, self.end, unpacked as u64]));
        // The frame, as long here as unpacked: it is not packed.
        let frame = self.frame.len() as u64;
        [frame, frame, self.signals.len() as u64].iter().for_each(|&number| put_varint(packed, number));
        packed.extend_from_slice(&self.frame);

        put_varint(packed, self.signals.len() as u64);
        // Where each stream starts, counted from the one before it, the first from this byte: that streams are in LZ4.
        let mut places = Vec::new();
        let (mut before, mut silent) = (packed.len(), 0);
        packed.push(b'4');
        for &(slot, kind) in &self.signals {
            let Stream { changed, bytes, .. } = &mut self.streams[slot];
            if bytes.is_empty() {
                silent += 1;
                continue;
            }
            put_silent(&mut places, &mut silent);
            put_signed(&mut places, ((packed.len() - before) as i64) << 1 | 1);
            before = packed.len();
            let length = match kind {
                Kind::Word(_) => {
                    self.stream.resize(lz4_flex::block::get_maximum_output_size(bytes.len()).max(self.stream.len()), 0);
                    lz4_flex::block::compress_into(bytes, &mut self.stream).expect("as much room as it may need")
                }
                // Digits of reals that move do not repeat themselves.
                Kind::Real => bytes.len(),
            };
            if length < bytes.len() {
                put_varint(packed, bytes.len() as u64);
                packed.extend_from_slice(&self.stream[..length]);
            } else {
                // Not packed.
                packed.push(0);
                packed.extend_from_slice(bytes);
            }
            bytes.clear();
            *changed = 0;
        }
        put_silent(&mut places, &mut silent);
        packed.extend_from_slice(&places);
        packed.extend(numbers([places.len() as u64]));

        let place = packed.len();
        if self.pack_times {
            let mut deflated = ZlibEncoder::new(&mut *packed, Compression::fast());
            deflated.write_all(&self.times).and_then(|()| deflated.finish().map(drop)).expect("memory takes all");
        }
        if !self.pack_times || packed.len() - place >= self.times.len() {
            packed.truncate(place);
            packed.extend_from_slice(&self.times);
        }
        packed.extend(numbers([self.times.len() as u64, (packed.len() - place) as u64, self.instants]));
        let length = packed.len() as u64 - 1;
        packed[1..9].copy_from_slice(&length.to_be_bytes());

        self.start = self.end;
        self.times.clear();
        self.instants = 0;
        self.size = 0;
        packed
    }
}

impl Stream {
    /// Instants since the last change, when one is put now; `None` before the first instant, where values are the
    /// frame's.
    #[inline]
    fn later(&mut self, instants: u64) -> Option<u64> {
        let now = instants.checked_sub(1)?;
        let later = now - self.changed;
        self.changed = now;
        Some(later)
    }

    /// Puts a word of unknown bits: one bit is told by its number among the values beyond 0 and 1, several as
    /// characters.
    #[cold]
    fn put_unknown(&mut self, later: u64) {
        if self.width == 1 {
            put_varint(&mut self.bytes, later << 4 | 1);
        } else {
            put_varint(&mut self.bytes, later << 1 | 1);
            self.bytes.extend((0..self.width).map(|_| UNKNOWN_BIT));
        }
    }
}

/// The character of an unknown bit.
const UNKNOWN_BIT: u8 = b'x';

/// Whether bits are in the place of unknown ones.
#[inline]
fn is_unknown(width: u32, bits: u64) -> bool {
    bits == UNKNOWN.cast_unsigned() && width < 64
}

/// Signals without changes, so many in a row.
fn put_silent(places: &mut Vec<u8>, silent: &mut u64) {
    if *silent > 0 {
        put_varint(places, *silent << 1);
        *silent = 0;
    }
}

/// Seven bits a byte, the least significant first; the last byte's top bit is 0.
#[inline]
pub fn put_varint(bytes: &mut Vec<u8>, mut value: u64) {
    while value > 0x7f {
        bytes.push(value as u8 | 0x80);
        value >>= 7;
    }
    bytes.push(value as u8);
}

/// The same of two's complement, as many bits as tell the sign.
fn put_signed(bytes: &mut Vec<u8>, mut value: i64) {
    while !(-64..64).contains(&value) {
        bytes.push(value as u8 | 0x80);
        value >>= 7;
    }
    bytes.push(value as u8 & 0x7f);
}
