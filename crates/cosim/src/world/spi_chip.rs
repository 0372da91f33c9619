//! An angle sensor on a bus, as its pins show it: AS5047P of ams, a slave of SPI in mode 1.
//!
//! A frame has 16 bits, the highest first. Data change at the rise of `sck` and are read at its fall, while `csn` is
//! low. A command has even parity in bit 15, 1 for a read in bit 14, and an address; its answer comes in the next
//! frame: even parity, a flag of an error in the frame before, and 14 bits of the register.
//!
//! | address | register | here |
//! |---|---|---|
//! | 0x0000 | NOP | 0 |
//! | 0x0001 | ERRFL: bit 2 parity, bit 1 command, bit 0 frame; a read clears it | as it says |
//! | 0x3FFC | DIAAGC: bit 8 is 1 once offsets are compensated | 0x0180, a gain in the middle |
//! | 0x3FFD | MAG | 0x1000 |
//! | 0x3FFE, 0x3FFF | ANGLEUNC, ANGLECOM | the word of the sensor, with its own latency |
//!
//! The word is taken at the fall of `csn` of the frame that answers. `miso` changes at the clock edge after that of
//! `sck`, and is 0 while `csn` is high.
//!
//! Source: the data sheet of the AS5047P (ams, v1-01, 2016) as public drivers of the chip quote it: mode, frames,
//! addresses, 10 MHz. **Differs from the hardware**: writes are told as wrong commands; times of `csn`, the time to
//! start and the difference of both angle registers could not be looked up, and are not modelled.

use crate::result::summary::Frames;

/// The address of the register of errors, and those of the angle.
const ERRORS: u16 = 0x0001;
const ANGLES: [u16; 2] = [0x3FFE, 0x3FFF];
/// The registers that do not change.
const FIXED: [(u16, u16); 3] = [(0x0000, 0), (0x3FFC, 0x0180), (0x3FFD, 0x1000)];
/// Errors, as their register has them.
const WRONG_FRAME: u16 = 1;
const WRONG_COMMAND: u16 = 2;
const WRONG_PARITY: u16 = 4;

/// The lines that a design drives.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Lines {
    pub csn: bool,
    pub sck: bool,
    pub mosi: bool,
}

/// A chip at one clock edge.
#[derive(Clone)]
pub(crate) struct SpiChip {
    /// The least clocks of a period of `sck`.
    least: u64,
    /// The latest word of the angle.
    pub(crate) word: [i64; 3],
    lines: Lines,
    /// The bits that came and those that are still to go, and how many came.
    taken: u16,
    given: u16,
    bits: u32,
    /// The edge of the latest rise of `sck`, and whether one in this frame came too soon.
    rose: Option<u64>,
    is_fast: bool,
    /// The address that the next frame answers, and whether the frame before was wrong.
    asked: u16,
    errors: u16,
    was_wrong: bool,
    /// The level of `miso`, and the edge at which it is shown.
    level: bool,
    due: Option<u64>,
    frames: Frames,
    /// Nobody can build this chip on a page: no motor there has three phases.
    #[cfg(target_family = "wasm")]
    never: std::convert::Infallible,
}

/// Returns a word with its bit 15 such that the number of ones is even.
fn even(word: u16) -> u16 {
    let word = word & 0x7FFF;
    word | ((word.count_ones() as u16 & 1) << 15)
}

impl SpiChip {
    /// Creates a chip that is not selected, whose `sck` has a period of this number of clocks at least.
    #[cfg(not(target_family = "wasm"))]
    pub(crate) fn new(least: u64) -> Self {
        Self {
            least,
            word: [0; 3],
            lines: Lines { csn: true, sck: false, mosi: false },
            taken: 0,
            given: 0,
            bits: 0,
            rose: None,
            is_fast: false,
            asked: 0,
            errors: 0,
            was_wrong: false,
            level: false,
            due: None,
            frames: Frames::default(),
        }
    }

    /// Returns the lines as they are driven.
    pub(crate) fn lines(&self) -> Lines {
        self.lines
    }

    /// Takes the lines from an edge on.
    pub(crate) fn drive(&mut self, edge: u64, lines: Lines) {
        let before = std::mem::replace(&mut self.lines, lines);
        match (before.csn, lines.csn) {
            (true, false) => self.begin(),
            (false, true) => self.end(),
            _ => {}
        }
        if !lines.csn && before.sck != lines.sck {
            if lines.sck { self.rise(edge) } else { self.fall() }
        }
        let level = !lines.csn && self.level;
        (self.level, self.due) = (level, Some(edge + 1));
    }

    fn begin(&mut self) {
        (self.taken, self.bits, self.rose, self.is_fast, self.level) = (0, 0, None, false, false);
        let fixed = FIXED.iter().find(|(address, _)| *address == self.asked);
        let register = match self.asked {
            ERRORS => std::mem::take(&mut self.errors),
            address if ANGLES.contains(&address) => self.word[0] as u16 & 0x3FFF,
            _ => fixed.map_or(0, |(_, value)| *value),
        };
        self.given = even(register | u16::from(self.was_wrong) << 14);
    }

    fn rise(&mut self, edge: u64) {
        self.is_fast |= self.rose.is_some_and(|rose| edge - rose < self.least);
        self.rose = Some(edge);
        self.level = self.given & 0x8000 != 0;
        self.given <<= 1;
    }

    fn fall(&mut self) {
        self.taken = self.taken << 1 | u16::from(self.lines.mosi);
        self.bits += 1;
    }

    fn end(&mut self) {
        let address = self.taken & 0x3FFF;
        let is_known =
            address == ERRORS || ANGLES.contains(&address) || FIXED.iter().any(|(known, _)| *known == address);
        // The command NOP is all zeros.
        let is_read = self.taken & 0x4000 != 0 || self.taken == 0;
        let error = if self.bits != 16 {
            WRONG_FRAME
        } else if even(self.taken) != self.taken {
            WRONG_PARITY
        } else if !(is_known && is_read) {
            WRONG_COMMAND
        } else {
            0
        };
        self.errors |= error;
        self.was_wrong = error != 0;
        self.asked = if error == 0 { address } else { 0 };
        self.frames.all += 1;
        self.frames.wrong += u64::from(error != 0);
        self.frames.fast += u64::from(self.is_fast);
    }

    /// Returns the edge at which `miso` is shown next.
    pub(crate) fn due(&self) -> u64 {
        self.due.unwrap_or(u64::MAX)
    }

    /// Returns the level of `miso` that is shown at an edge, if it is due.
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

    /// The commands as public drivers of the chip have them: read ANGLECOM, ANGLEUNC and ERRFL.
    const READ_ANGLE: u16 = 0xFFFF;
    const READ_PLAIN: u16 = 0x7FFE;
    const READ_ERRORS: u16 = 0x4001;

    /// A master of mode 1 that reads each bit at the fall of its clock, with this half period.
    struct Master {
        chip: SpiChip,
        edge: u64,
        half: u64,
    }

    impl Master {
        fn new(half: u64) -> Self {
            let mut chip = SpiChip::new(5);
            chip.word = [0x1234, 0, 0];
            Self { chip, edge: 0, half }
        }

        fn drive(&mut self, csn: bool, sck: bool, mosi: bool) -> i64 {
            self.chip.drive(self.edge, Lines { csn, sck, mosi });
            self.edge += self.half;
            self.chip.shown(self.edge).expect("a level that is due")
        }

        fn frame(&mut self, command: u32, bits: u32) -> u32 {
            self.drive(false, false, false);
            let mut answer = 0;
            for bit in (0..bits).rev() {
                let mosi = command >> bit & 1 != 0;
                let level = self.drive(false, true, mosi);
                answer = answer << 1 | level as u32;
                self.drive(false, false, mosi);
            }
            assert_eq!(self.drive(true, false, false), 0);
            answer
        }

        fn word(&mut self, command: u16) -> u16 {
            self.frame(command.into(), 16) as u16
        }
    }

    #[test]
    fn a_register_comes_in_the_frame_after_its_command() {
        let mut master = Master::new(3);
        assert_eq!(master.word(READ_ANGLE), 0);
        // 0x1234 has five ones, so the parity is 1.
        assert_eq!(master.word(READ_PLAIN), 0x9234);
        master.chip.word[0] = 0x3FFF;
        assert_eq!(master.word(0x0000), 0x3FFF);
        assert_eq!(master.word(0xFFFC), 0, "the register NOP");
        assert_eq!(master.word(0x7FFD), 0x0180, "DIAAGC");
        assert_eq!(master.chip.frames(), Frames { all: 5, wrong: 0, fast: 0 });
    }

    #[test]
    fn every_word_of_the_angle_has_an_even_number_of_ones() {
        let mut master = Master::new(3);
        master.word(READ_ANGLE);
        for angle in 0..1 << 14 {
            master.chip.word[0] = angle;
            let answer = master.word(READ_ANGLE);
            assert_eq!(i64::from(answer & 0x7FFF), angle);
            assert_eq!(answer.count_ones() % 2, 0, "{angle}");
        }
    }

    #[test]
    fn wrong_frames_are_flagged_once_and_their_register_is_cleared_by_a_read() {
        let mut master = Master::new(3);
        // A wrong parity, 15 bits, a write, an address that is not there: the answer is 0 with the flag and its parity.
        master.word(READ_ANGLE ^ 0x8000);
        assert_eq!(master.word(READ_ERRORS), 0xC000);
        // Bit 2 alone, with its parity.
        assert_eq!(master.word(READ_ERRORS), 0x8004);
        assert_eq!(master.word(0), 0, "read and cleared");
        master.frame(READ_ANGLE.into(), 15);
        assert_eq!(master.word(0x3FFF), 0xC000, "and this is a write with even parity");
        assert_eq!(master.word(READ_ERRORS), 0xC000);
        // Bits 0 and 1.
        assert_eq!(master.word(0x4002), 0x0003, "and this is an address that is not there");
        assert_eq!(master.word(0), 0xC000);
        assert_eq!(master.chip.frames(), Frames { all: 9, wrong: 4, fast: 0 });
    }

    #[test]
    fn a_clock_beyond_the_data_sheet_is_counted() {
        // Five clocks are the least period; two times two are fewer, two times three are not.
        for (half, fast) in [(2, 1), (3, 0)] {
            let mut master = Master::new(half);
            master.word(READ_ANGLE);
            assert_eq!(master.chip.frames(), Frames { all: 1, wrong: 0, fast });
        }
    }
}
