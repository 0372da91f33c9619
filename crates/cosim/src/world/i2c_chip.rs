//! An angle sensor on a bus, as its pins show it: AS5600 of ams, a slave of I2C with the address 0x36.
//!
//! SDA is an open drain, so it has two ports: the design releases it by 1 and pulls it down by 0 at `sda_out`, and
//! `sda` is the level of the line, which the chip pulls down too. A level is shown at the clock edge after that of its
//! cause. Bits are taken at the rise of `scl`, as SDA is from that edge on, and change at its fall.
//!
//! | address | register | here |
//! |---|---|---|
//! | 0x00 to 0x08 | ZMCO, ZPOS, MPOS, MANG, CONF | 0, as they are when nothing was programmed |
//! | 0x0B | STATUS | 0x20: a magnet is found, neither too strong nor too weak |
//! | 0x0C, 0x0E | RAW ANGLE, ANGLE: bits 11 to 8, then 7 to 0 | the word of the sensor |
//! | 0x1A, 0x1B | AGC, MAGNITUDE | 0x80 and 0x0800, in the middle of their ranges |
//!
//! The first byte that is written is the address; bytes that are read follow it, and the address grows by 1 after each.
//! From the high byte of an angle or of MAGNITUDE it does not grow: high and low byte come in turn, and the next read
//! begins with the high one again. Both bytes are of the word at the begin of the high one.
//!
//! Source: the data sheet of the AS5600 (ams, v1-06, 2018): address, registers, pointer, 1 MHz of `scl`, no stretching
//! of the clock. **Differs from the hardware**: data bytes are not acknowledged and change nothing; ANGLE has no
//! hysteresis; the low and the high time of `scl` and the time to set data up are not checked. The data sheet does not
//! say whether both bytes are of one word, nor what follows the low byte.

use crate::result::summary::Frames;

/// The chip's address, and the registers whose high byte is read again and again.
const ADDRESS: u8 = 0x36;
const PAIRS: [u8; 3] = [0x0C, 0x0E, 0x1B];
const STATUS: u8 = 0x0B;
const AGC: u8 = 0x1A;
/// The last byte of MAGNITUDE.
const LAST: u8 = 0x1C;

/// The part of a frame that is under way.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Phase {
    /// No frame, or one of another chip.
    Idle,
    Address,
    /// The register's address, or data after it.
    Pointer,
    Data,
    Reading,
}

/// A chip at one clock edge.
#[derive(Clone)]
pub(crate) struct I2cChip {
    /// The least clocks of a period of `scl`.
    least: u64,
    /// The latest word of the angle.
    pub(crate) word: [i64; 3],
    scl: bool,
    released: bool,
    phase: Phase,
    /// The bits of a byte so far, and how many times `scl` has risen since it began.
    byte: u8,
    bits: u32,
    /// Whether the chip pulls SDA down.
    pulls: bool,
    pointer: u8,
    /// Whether the low byte of a pair comes next, and the pair's word.
    is_low: bool,
    pair: u16,
    /// Whether a frame is under way, it went wrong, or its clock was too fast, and the latest rise of `scl` in it.
    is_open: bool,
    is_wrong: bool,
    is_fast: bool,
    rose: Option<u64>,
    level: bool,
    due: Option<u64>,
    frames: Frames,
    /// Nobody can build this chip on a page: no motor there has three phases.
    #[cfg(target_family = "wasm")]
    never: std::convert::Infallible,
}

fn is_register(address: u8) -> bool {
    address <= 0x08 || (STATUS..=0x0F).contains(&address) || (AGC..=LAST).contains(&address) || address == 0xFF
}

impl I2cChip {
    /// Creates a chip on a free bus, whose `scl` has a period of this number of clocks at least.
    #[cfg(not(target_family = "wasm"))]
    pub(crate) fn new(least: u64) -> Self {
        Self {
            least,
            word: [0; 3],
            scl: true,
            released: true,
            phase: Phase::Idle,
            byte: 0,
            bits: 0,
            pulls: false,
            pointer: 0,
            is_low: false,
            pair: 0,
            is_open: false,
            is_wrong: false,
            is_fast: false,
            rose: None,
            level: true,
            due: None,
            frames: Frames::default(),
        }
    }

    /// Returns `scl` and `sda_out` as they are driven.
    pub(crate) fn lines(&self) -> [bool; 2] {
        [self.scl, self.released]
    }

    /// Takes `scl` and `sda_out` from an edge on.
    pub(crate) fn drive(&mut self, edge: u64, [scl, released]: [bool; 2]) {
        let before = self.released && !self.pulls;
        let was_high = std::mem::replace(&mut self.scl, scl);
        self.released = released;
        let line = released && !self.pulls;
        match (was_high, scl) {
            (true, true) if before && !line => self.begin(),
            (true, true) if !before && line => self.end(Phase::Idle),
            (false, true) => self.rise(edge, line),
            (true, false) => self.fall(),
            _ => {}
        }
        (self.level, self.due) = (self.released && !self.pulls, Some(edge + 1));
    }

    /// Begins a frame, by a start or a repeated one.
    fn begin(&mut self) {
        self.end(Phase::Address);
        (self.is_open, self.is_wrong, self.is_fast, self.rose) = (true, false, false, None);
        (self.byte, self.bits, self.is_low) = (0, 0, false);
    }

    /// Ends a frame, within a byte only if it is wrong.
    fn end(&mut self, phase: Phase) {
        if std::mem::take(&mut self.is_open) {
            // A start or stop comes with a rise of `scl` of its own.
            self.is_wrong |= self.bits > 1 && self.phase != Phase::Idle;
            self.frames.all += 1;
            self.frames.wrong += u64::from(self.is_wrong);
            self.frames.fast += u64::from(self.is_fast);
        }
        (self.phase, self.pulls) = (phase, false);
    }

    fn rise(&mut self, edge: u64, line: bool) {
        self.is_fast |= self.rose.is_some_and(|rose| edge - rose < self.least);
        self.rose = Some(edge);
        self.bits += 1;
        match self.bits {
            1..=8 => self.byte = self.byte << 1 | u8::from(line),
            // The master acknowledges what it reads, but for the last byte.
            9 if self.phase == Phase::Reading && line => self.phase = Phase::Idle,
            _ => {}
        }
    }

    fn fall(&mut self) {
        match (self.phase, self.bits) {
            (Phase::Idle, _) => self.pulls = false,
            // The bits that were sent have gone round.
            (Phase::Reading, 1..=7) => self.pulls = self.byte & 0x80 == 0,
            (Phase::Reading, 8) => self.pulls = false,
            (_, 8) => self.pulls = self.acknowledges(),
            (_, 9) => {
                (self.bits, self.pulls) = (0, false);
                if self.phase == Phase::Reading {
                    self.byte = self.next();
                    self.pulls = self.byte & 0x80 == 0;
                }
            }
            _ => {}
        }
    }

    /// Takes a byte that was written, and returns whether the chip acknowledges it.
    fn acknowledges(&mut self) -> bool {
        match self.phase {
            Phase::Address if self.byte >> 1 != ADDRESS => {
                (self.phase, self.is_wrong) = (Phase::Idle, true);
                false
            }
            Phase::Address => {
                self.phase = if self.byte & 1 == 1 { Phase::Reading } else { Phase::Pointer };
                true
            }
            Phase::Pointer => {
                (self.phase, self.pointer) = (Phase::Data, self.byte);
                self.is_wrong |= !is_register(self.byte);
                is_register(self.byte)
            }
            _ => {
                (self.is_wrong, self.pointer) = (true, self.pointer.wrapping_add(1));
                false
            }
        }
    }

    /// Returns the next byte that is read.
    fn next(&mut self) -> u8 {
        if std::mem::take(&mut self.is_low) {
            return self.pair as u8;
        }
        if PAIRS.contains(&self.pointer) {
            self.pair = if self.pointer == 0x1B { 0x0800 } else { self.word[0] as u16 & 0x0FFF };
            self.is_low = true;
            return (self.pair >> 8) as u8;
        }
        let byte = match self.pointer {
            STATUS => 0x20,
            0x0D | 0x0F => self.word[0] as u8,
            AGC => 0x80,
            _ => 0,
        };
        self.pointer = self.pointer.wrapping_add(1);
        byte
    }

    /// Returns the edge at which `sda` is shown next.
    pub(crate) fn due(&self) -> u64 {
        self.due.unwrap_or(u64::MAX)
    }

    /// Returns the level of `sda` that is shown at an edge, if it is due.
    pub(crate) fn shown(&mut self, edge: u64) -> Option<i64> {
        self.due.take_if(|due| *due <= edge).map(|_| self.level.into())
    }

    /// Returns the frames so far.
    pub(crate) fn frames(&self) -> Frames {
        self.frames
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A master that changes SDA in the middle of `scl` low and reads it in the middle of `scl` high, with this quarter
    /// of a period.
    struct Master {
        chip: I2cChip,
        edge: u64,
        quarter: u64,
        lines: [bool; 2],
    }

    impl Master {
        fn new(quarter: u64) -> Self {
            let mut chip = I2cChip::new(50);
            chip.word = [0xABC, 0, 0];
            Self { chip, edge: 100, quarter, lines: [true; 2] }
        }

        fn put(&mut self, scl: bool, sda: bool) -> bool {
            self.lines = [scl, sda];
            self.chip.drive(self.edge, self.lines);
            self.edge += self.quarter;
            self.chip.shown(self.edge).expect("a level that is due") != 0
        }

        fn start(&mut self) {
            let scl = self.lines[0];
            self.put(scl, true);
            self.put(true, true);
            self.put(true, false);
            self.put(false, false);
        }

        fn stop(&mut self) {
            self.put(false, false);
            self.put(true, false);
            self.put(true, true);
        }

        fn bit(&mut self, sda: bool) -> bool {
            self.put(false, sda);
            self.put(true, sda);
            let level = self.put(true, sda);
            self.put(false, sda);
            level
        }

        /// Writes a byte, and returns whether it is acknowledged.
        fn write(&mut self, byte: u8) -> bool {
            (0..8).rev().for_each(|place| _ = self.bit(byte >> place & 1 != 0));
            !self.bit(true)
        }

        fn read(&mut self, more: bool) -> u8 {
            let byte = (0..8).fold(0, |byte, _| byte << 1 | u8::from(self.bit(true)));
            self.bit(!more);
            byte
        }

        /// Reads bytes from a register on.
        fn register(&mut self, address: u8, count: usize) -> Vec<u8> {
            self.start();
            assert!(self.write(ADDRESS << 1) && self.write(address));
            self.again(count)
        }

        /// Reads bytes from where the pointer is.
        fn again(&mut self, count: usize) -> Vec<u8> {
            self.start();
            assert!(self.write(ADDRESS << 1 | 1));
            let bytes = (1..=count).map(|place| self.read(place < count)).collect();
            self.stop();
            bytes
        }
    }

    #[test]
    fn registers_are_read_from_the_pointer_on() {
        let mut master = Master::new(13);
        assert_eq!(master.register(0x0C, 2), [0x0A, 0xBC]);
        assert_eq!(master.register(0x0B, 2), [0x20, 0x0A], "the pointer goes on from STATUS to RAW ANGLE");
        assert_eq!(master.register(0x0F, 2), [0xBC, 0], "and from the low byte to an address without a register");
        assert_eq!(master.register(0x1A, 3), [0x80, 0x08, 0x00]);
        assert_eq!(master.register(0x00, 9), [0; 9]);
        // Each read has a frame for the pointer and one for the bytes.
        assert_eq!(master.chip.frames(), Frames { all: 10, wrong: 0, fast: 0 });
    }

    #[test]
    fn an_angle_is_read_again_without_its_address_and_both_bytes_are_of_one_word() {
        let mut master = Master::new(13);
        assert_eq!(master.register(0x0E, 1), [0x0A]);
        for word in 0..1 << 12 {
            master.chip.word[0] = word;
            assert_eq!(master.again(2), [(word >> 8) as u8, word as u8]);
        }
        master.chip.word[0] = 0x123;
        assert_eq!(master.again(4), [0x01, 0x23, 0x01, 0x23]);
        master.start();
        assert!(master.write(ADDRESS << 1 | 1));
        assert_eq!(master.read(true), 0x01);
        master.chip.word[0] = 0xFFF;
        assert_eq!(master.read(false), 0x23);
        master.stop();
        assert_eq!(master.chip.frames().wrong, 0);
    }

    #[test]
    fn what_the_chip_does_not_acknowledge_is_told() {
        let mut master = Master::new(13);
        master.start();
        assert!(!master.write(0x37 << 1), "another chip");
        assert!(!master.write(0x0C));
        master.stop();
        master.start();
        assert!(master.write(ADDRESS << 1) && !master.write(0x10), "no register");
        master.stop();
        master.start();
        assert!(master.write(ADDRESS << 1) && master.write(0x07) && !master.write(1), "data");
        master.stop();
        // A stop within a byte.
        master.start();
        (0..3).for_each(|_| _ = master.bit(true));
        master.stop();
        assert_eq!(master.chip.frames(), Frames { all: 4, wrong: 4, fast: 0 });
        assert_eq!(master.register(0x0C, 2), [0x0A, 0xBC]);
        assert_eq!(master.chip.frames().wrong, 4);
    }

    #[test]
    fn a_clock_beyond_the_data_sheet_is_counted() {
        // Fifty clocks are the least period; four times twelve are fewer, four times thirteen are not.
        for (quarter, fast) in [(12, 2), (13, 0)] {
            let mut master = Master::new(quarter);
            master.register(0x0C, 2);
            assert_eq!(master.chip.frames(), Frames { all: 2, wrong: 0, fast });
        }
    }
}
