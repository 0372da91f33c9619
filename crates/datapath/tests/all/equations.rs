//! A block's equations, read as words of the machine, tick as the block does. So everything that solvers prove of the
//! equations holds for the block.

use hpu_datapath::variants;
use hpu_signal::Signal;

/// Pseudo-random numbers (Vigna's splitmix64).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    /// Returns a word of a signal: small, extreme or any. Periods are short, so that there are many samples.
    fn word(&mut self, signal: &Signal) -> i64 {
        let (format, random) = (signal.format, self.next() >> 4);
        match self.next() % 8 {
            0 | 1 if signal.name != "period" => format.from_bits(random),
            2 if signal.name != "period" => format.wrap(format.min()),
            3 if signal.name != "period" => format.wrap(format.max()),
            4 => 0,
            _ => format.from_bits(random % 6),
        }
    }
}

/// Compares the equations of all variants with their blocks over this many edges each.
fn tick_alike(edges: u64) {
    let mut compared = 0;
    for (label, mut block) in variants() {
        let name = block.name();
        let (inputs, clocked) = (block.inputs(), block.clocked());
        let Some(registers) = block.equations().map(|edge| edge.registers) else { continue };
        let mut random = Random(compared);
        let mut held: Vec<i64> = registers.iter().map(|register| register.reset.unwrap_or(0)).collect();
        let mut words = vec![0; inputs.len()];
        let shown = block.reset();
        let mut of = block.equations().expect("equations").in_words();
        if clocked {
            assert_eq!(of(&held, &words).1, shown, "{name} {label}: after the reset");
        }
        for edge in 0..edges {
            // The inputs stay for a while, then one of them changes, or all.
            match random.next() % 16 {
                0..4 => {
                    let port = random.next() as usize % inputs.len();
                    words[port] = random.word(&inputs[port]);
                }
                4 => words = inputs.iter().map(|signal| random.word(signal)).collect(),
                _ => {}
            }
            held = of(&held, &words).0;
            for (word, register) in held.iter().zip(&registers) {
                let holds = register.format.holds(register.format.value(*word));
                assert!(holds, "{name} {label}: {} is {word} at edge {edge}", register.name);
            }
            let shown = of(&held, &words).1;
            assert_eq!(shown, block.tick(&words), "{name} {label}: edge {edge} of {words:?}");
        }
        compared += 1;
    }
    assert!(compared >= 100, "{compared}");
}

#[test]
fn equations_tick_as_their_block_does() {
    tick_alike(5_000);
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn equations_tick_longer_as_their_block_does() {
    tick_alike(20_000);
}
