//! A section of an FST: the changes during a stretch of time, signal by signal.

use std::io::Write;

use flate2::Compression;
use flate2::write::ZlibEncoder;
use hpu_signal::UNKNOWN;

use super::{CHANGES, numbers};

/// The kind of a signal's values.
#[derive(Clone, Copy)]
pub enum Kind {
    /// Words of this many bits, at most 64.
    Word(u32),
    Real,
}

/// The changes since the end of the last section.
pub struct Section {
    /// The changes of each signal, by slot.
    streams: Vec<Stream>,
    /// Slots and kinds of the signals, in the order of the file.
    signals: Vec<(usize, Kind)>,
    start: u64,
    end: u64,
    /// The time of each instant, as the difference from the instant before.
    times: Vec<u8>,
    /// Whether the times are packed.
    pack_times: bool,
    instants: u64,
    /// All values at the start, as characters and as the bytes of reals.
    frame: Vec<u8>,
    size: usize,
    /// Memory for packed data: for the section, and for one of its streams.
    packed: Vec<u8>,
    stream: Vec<u8>,
}

/// The changes of one signal.
#[derive(Clone, Default)]
struct Stream {
    /// The width of its words, in bits.
    width: u32,
    /// The latest value.
    bits: u64,
    /// The instant of the section in which it last changed.
    changed: u64,
    bytes: Vec<u8>,
}

impl Section {
    /// Returns the first section. Slots that are not signals of the file are not written. The times of a clock
    /// (`clock`) repeat and can be packed to almost nothing. Other times hardly get shorter, and packing them would
    /// take longer than everything else.
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

    /// Returns the size of the changes so far, in bytes.
    pub fn size(&self) -> usize {
        self.size + self.times.len()
    }

    /// Returns the time of the latest instant.
    pub fn end(&self) -> u64 {
        self.end
    }

    /// Begins an instant. Time 0 is not an instant of its own: its values are the initial values of the file.
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

    /// Adds a new word. Bits beyond its width are ignored.
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
                // Copying eight bytes and dropping some is faster than copying only the bytes of the word.
                stream.bytes.truncate(stream.bytes.len() - 8 + stream.width.div_ceil(8) as usize);
            }
        });
    }

    /// Adds a new real.
    #[inline]
    pub fn real(&mut self, slot: usize, value: f64) {
        self.change(slot, value.to_bits(), |stream, later| {
            put_varint(&mut stream.bytes, later << 1 | 1);
            stream.bytes.extend_from_slice(&value.to_le_bytes());
        });
    }

    /// Adds a new value. `put` writes it, and is given the number of instants since the last change.
    #[inline(always)]
    fn change(&mut self, slot: usize, bits: u64, put: impl FnOnce(&mut Stream, u64)) {
        let stream = &mut self.streams[slot];
        stream.bits = bits;
        let Some(later) = stream.later(self.instants) else { return };
        let before = stream.bytes.len();
        put(stream, later);
        self.size += stream.bytes.len() - before;
    }

    /// Returns the section in the form of the file, and begins a new empty one.
    pub fn pack(&mut self) -> &[u8] {
        let unpacked: usize = self.signals.iter().map(|&(slot, _)| self.streams[slot].bytes.len()).sum();
        let packed = &mut self.packed;
        packed.clear();
        packed.push(CHANGES);
        // The length is written last, once it is known.
        packed.extend(numbers([0, self.start, self.end, unpacked as u64]));
        // The frame. Its packed length is the same as the unpacked one, because it is not packed.
        let frame = self.frame.len() as u64;
        [frame, frame, self.signals.len() as u64].iter().for_each(|&number| put_varint(packed, number));
        packed.extend_from_slice(&self.frame);

        put_varint(packed, self.signals.len() as u64);
        // The start of each stream, as the difference from the stream before; the first is counted from this byte. The
        // byte says that the streams are in LZ4.
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
                // The digits of moving reals do not repeat, so they are not packed.
                Kind::Real => bytes.len(),
            };
            if length < bytes.len() {
                put_varint(packed, bytes.len() as u64);
                packed.extend_from_slice(&self.stream[..length]);
            } else {
                // The length 0 says that the stream is not packed.
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
    /// Returns the number of instants from the last change to a change now. Returns `None` before the first instant,
    /// where the frame has the values.
    #[inline]
    fn later(&mut self, instants: u64) -> Option<u64> {
        let now = instants.checked_sub(1)?;
        let later = now - self.changed;
        self.changed = now;
        Some(later)
    }

    /// Writes a word of unknown bits. A single bit is written as its number among the values beyond 0 and 1, several
    /// bits as characters.
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

/// Returns whether these bits stand for unknown ones.
#[inline]
fn is_unknown(width: u32, bits: u64) -> bool {
    bits == UNKNOWN.cast_unsigned() && width < 64
}

/// Writes the number of consecutive signals without changes.
fn put_silent(places: &mut Vec<u8>, silent: &mut u64) {
    if *silent > 0 {
        put_varint(places, *silent << 1);
        *silent = 0;
    }
}

/// Appends a number, seven bits a byte, the least significant bits first. The top bit of the last byte is 0.
#[inline]
pub fn put_varint(bytes: &mut Vec<u8>, mut value: u64) {
    while value > 0x7f {
        bytes.push(value as u8 | 0x80);
        value >>= 7;
    }
    bytes.push(value as u8);
}

/// Appends a signed number in the same way: two's complement, with as many bits as the sign needs.
fn put_signed(bytes: &mut Vec<u8>, mut value: i64) {
    while !(-64..64).contains(&value) {
        bytes.push(value as u8 | 0x80);
        value >>= 7;
    }
    bytes.push(value as u8 & 0x7f);
}
