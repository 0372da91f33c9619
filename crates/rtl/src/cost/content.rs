//! A cost as one line of text.

use super::{Cost, Counts, Placed, SEEDS};
use crate::engines::entry::Content;

impl Content for Counts {
    const EXTENSION: &'static str = "counts";

    fn line(&self) -> String {
        numbers(self)
    }

    fn from_line(line: &str) -> Option<Self> {
        let mut words = line.split(' ');
        let counts = counted(&mut words)?;
        words.next().is_none().then_some(counts)
    }
}

impl Content for Cost {
    const EXTENSION: &'static str = "cost";

    fn line(&self) -> String {
        let mut line = format!("{} cells={}", numbers(&self.ice40), self.cells);
        if let Some(ecp5) = &self.ecp5 {
            line += &format!(" ecp5 {}", numbers(ecp5));
        }
        for placed in self.placed.iter().flatten() {
            line += &match placed {
                Placed::NoRoom => " no_room".to_string(),
                Placed::NoPath => " no_path".to_string(),
                Placed::Mhz(mhz) => format!(" {mhz}"),
            };
        }
        line
    }

    fn from_line(line: &str) -> Option<Self> {
        let (small, large) = line.split_once(" ecp5 ").map_or((line, None), |(small, large)| (small, Some(large)));
        let mut words = small.split(' ');
        let ice40 = counted(&mut words)?;
        let cells = words.next()?.strip_prefix("cells=")?.parse().ok()?;
        if let Some(large) = large {
            let ecp5 = Some(Counts::from_line(large)?);
            return words.next().is_none().then_some(Self { ice40, cells, ecp5, placed: None });
        }
        let placed = |word: &str| match word {
            "no_room" => Some(Placed::NoRoom),
            "no_path" => Some(Placed::NoPath),
            _ => word.parse().ok().filter(|mhz| *mhz > 0.0 && f64::is_finite(*mhz)).map(Placed::Mhz),
        };
        let all: Option<Vec<_>> = words.map(placed).collect();
        let placed: [Placed; SEEDS.len()] = all?.try_into().ok()?;
        Some(Self { ice40, cells, ecp5: None, placed: Some(placed) })
    }
}

impl Cost {
    /// Returns the cost as one line without a comma.
    pub fn line(&self) -> String {
        Content::line(self)
    }

    /// Reads a cost from its line. Returns `None` when the line is not a cost.
    pub fn from_line(line: &str) -> Option<Self> {
        Content::from_line(line)
    }
}

fn numbers(Counts { lut4, ff, carry, bram, dsp }: &Counts) -> String {
    format!("lut4={lut4} ff={ff} carry={carry} bram={bram} dsp={dsp}")
}

fn counted<'a>(words: &mut impl Iterator<Item = &'a str>) -> Option<Counts> {
    let mut next = |name: &str| words.next()?.strip_prefix(name)?.strip_prefix('=')?.parse().ok();
    let [lut4, ff, carry, bram, dsp] = ["lut4", "ff", "carry", "bram", "dsp"].map(&mut next);
    Some(Counts { lut4: lut4?, ff: ff?, carry: carry?, bram: bram?, dsp: dsp? })
}

#[cfg(test)]
mod tests {
    use crate::cost::{Cost, Counts, Placed};
    use crate::engines::entry::{read, write};

    const SOME: Counts = Counts { lut4: 5, ff: 4, carry: 3, bram: 2, dsp: 0 };

    fn costs() -> [Cost; 2] {
        let placed = Some([Placed::Mhz(27.93), Placed::NoRoom, Placed::NoPath]);
        let small = Cost { ice40: SOME, cells: 12, ecp5: None, placed };
        [small, Cost { ecp5: Some(Counts { dsp: 7, ..SOME }), placed: None, ..small }]
    }

    #[test]
    fn what_was_written_is_read_again() {
        for cost in costs() {
            assert_eq!(read("k", &write("k", "a block", &cost)), Some(cost));
        }
        assert_eq!(read("k", &write("k", "a block", &SOME)), Some(SOME));
    }

    #[test]
    fn an_entry_that_ends_anywhere_before_its_end_is_none() {
        for cost in costs() {
            let whole = write("k", "a block", &cost);
            for length in 0..whole.len() {
                assert_eq!(read::<Cost>("k", &whole[..length]), None, "{length} of {} bytes", whole.len());
            }
        }
    }

    #[test]
    fn an_entry_with_any_bit_flipped_is_none() {
        for cost in costs() {
            let whole = write("k", "a block", &cost);
            for bit in 0..8 * whole.len() {
                let mut bytes = whole.clone().into_bytes();
                bytes[bit / 8] ^= 1 << (bit % 8);
                let read = str::from_utf8(&bytes).ok().and_then(|text| read::<Cost>("k", text));
                assert_eq!(read, None, "bit {bit}: {}", String::from_utf8_lossy(&bytes));
            }
        }
    }

    #[test]
    fn an_entry_of_the_format_without_a_checksum_is_none() {
        let old = format!("hpu cost entry 1\nkey k\nabout a block\n{}\nend\n", costs()[0].line());
        assert_eq!(read::<Cost>("k", &old), None);
    }

    #[test]
    fn an_entry_of_another_key_or_with_more_behind_it_is_none() {
        let whole = write("k", "a block", &SOME);
        assert_eq!(read::<Counts>("other", &whole), None);
        for more in ["more\n", " ", "\n"] {
            assert_eq!(read::<Counts>("k", &format!("{whole}{more}")), None);
        }
        assert_eq!(read::<Cost>("k", &whole), None);
    }

    #[test]
    fn a_clock_that_is_no_frequency_is_none() {
        let line = costs()[0].line();
        assert_eq!(Cost::from_line(&line), Some(costs()[0]));
        for word in ["NaN", "inf", "0", "-3"] {
            assert_eq!(Cost::from_line(&line.replace("27.93", word)), None, "{word}");
        }
    }
}
