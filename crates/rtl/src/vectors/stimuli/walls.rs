//! Stimuli for laws: motions into a wall and out again, with consistent coordinates; and stimuli for the shaper behind
//! the laws.

use hpu_cosim::SplitMix64;
use hpu_datapath::{AnyBlock, Generic};
use hpu_signal::{Format, Signal};

use super::{corners, edge, generic, reset};
use crate::Stimulus;

/// Returns whether these are the inputs of a law: they begin with the wall's coordinates.
pub(super) fn is_law(inputs: &[Signal]) -> bool {
    matches!(inputs, [position, delta, ..] if position.name == "position" && delta.name == "delta")
}

/// Sets all inputs to 0 during resets, for blocks where an input may reach an output without a register: the reset of a
/// model sees no inputs.
pub(super) fn grounded(block: &dyn AnyBlock, mut rows: Vec<Stimulus>) -> Vec<Stimulus> {
    let says = |name: &str, value| block.generics().contains(&(name, value));
    let passes_through = match block.name() {
        "axis_front" => true,
        "command_limiter" => says("SETTLING", Generic::Integer(0)),
        "input_shaper" => says("ENABLED", Generic::Boolean(false)),
        "sampled_wall" => says("SPRING_HELD", Generic::Boolean(false)),
        _ => false,
    };
    if passes_through {
        rows.iter_mut().filter(|row| row.rst).for_each(|row| row.words.fill(0));
    }
    rows
}

/// A random motion, in eighths of a count.
pub(super) struct Walker {
    place: i128,
    speed: i128,
    reference: i128,
}

/// Speeds in eighths of a count an edge, and the number of edges of each: into the wall, to and fro within it, a rest,
/// out and far away.
const LEGS: [(i128, usize); 10] =
    [(2, 60), (8, 30), (1, 80), (-3, 60), (0, 90), (5, 40), (-8, 30), (24, 20), (-1, 90), (-16, 40)];

impl Walker {
    /// Returns a walker at the start of the counter.
    pub(super) fn new() -> Self {
        Self { place: 0, speed: 1, reference: 0 }
    }

    /// Writes the wall's coordinates as `displacement` and `unilateral` compute them.
    fn put(&self, inputs: &[Signal], words: &mut [i64]) {
        let position = self.place.div_euclid(8);
        words[0] = inputs[0].format.wrap(position);
        words[1] = inputs[1].format.wrap(position - self.reference);
        words[2] = i64::from(words[1] >= 0);
        words[3] = words[1].max(0);
    }

    /// Moves by a random edge: mostly at the same speed, sometimes at another one, seldom with another wall or a leap.
    pub(super) fn step(&mut self, random: &mut SplitMix64, inputs: &[Signal], words: &mut [i64]) {
        let near = |random: &mut SplitMix64, range: u64| i128::from(random.below(2 * range + 1)) - i128::from(range);
        if random.one_in(50) {
            let range = 1 << random.below(6);
            self.speed = near(random, range);
        }
        if random.one_in(700) {
            self.place = 8 * i128::from(inputs[0].format.from_bits(random.next_u64()));
        }
        if random.one_in(300) {
            self.reference = self.place.div_euclid(8) + near(random, 12);
        }
        self.place += self.speed;
        self.put(inputs, words);
    }
}

/// Returns a random word for another input of a law: periods in which every computation ends, or is too long for the
/// period; gains of all sizes.
pub(super) fn gain(random: &mut SplitMix64, signal: &Signal) -> i64 {
    if signal.name == "period" {
        return signal.format.from_bits(random.below(80));
    }
    let bits = random.below(u64::from(signal.format.width()) + 1);
    signal.format.from_bits(random.below(1 << bits))
}

/// Returns the gains of a directed motion: from soft to hard, then the largest that the word can hold.
fn gains(format: Format, turn: usize) -> i64 {
    let one = 1i128 << format.frac();
    format.wrap([one, 3 * one + 1, format.max() / 3, 0, format.max()][turn])
}

/// Returns steps of the torque, each long enough for a high-pass to decay, then samples further apart.
pub(super) fn steps(inputs: &[Signal]) -> Vec<Stimulus> {
    let torque = inputs[0].format;
    let mut rows = vec![reset(vec![0; inputs.len()])];
    for (period, edges) in [(1, 900), (3, 40)] {
        for level in [torque.max(), torque.max() / 3, 0, torque.min(), 1, torque.max() / 2] {
            rows.extend(vec![edge(vec![torque.wrap(level), period]); edges]);
        }
    }
    rows
}

/// Returns, from reset, the same motion at several periods and gains; then corners of all words, which need not be
/// consistent.
pub(super) fn motions(inputs: &[Signal]) -> Vec<Stimulus> {
    let mut rows = Vec::new();
    for (turn, period) in [1, 43, 77, 4, 61].into_iter().enumerate() {
        let mut words: Vec<_> = inputs
            .iter()
            .map(|signal| match signal.name {
                "period" => signal.format.from_bits(period),
                // The harder the wall, the softer the damping.
                "damping" => gains(signal.format, 4 - turn),
                _ => gains(signal.format, turn),
            })
            .collect();
        rows.push(reset(words.clone()));
        // The surface is a few counts before the counter's end, so that the motion wraps inside the wall.
        let mut walker = Walker { place: -80, speed: 0, reference: -4 };
        for (speed, edges) in LEGS {
            for _ in 0..edges {
                walker.place += speed;
                walker.put(inputs, &mut words);
                rows.push(edge(words.clone()));
            }
        }
    }
    let lists: Vec<_> = inputs.iter().map(|signal| corners(signal.format)).collect();
    for turn in 0..40 {
        let corner = |(index, list): (usize, &Vec<i64>)| match inputs[index].name {
            "period" => 1,
            _ => list[(turn * (index + 1) + turn / 7) % list.len()],
        };
        let row: Vec<_> = lists.iter().enumerate().map(corner).collect();
        rows.extend(vec![edge(row); 45]);
    }
    rows
}

/// Returns a motion deep inside the hardest wall, on which the counter turns forward: every capture adds the work of
/// the greatest torque over almost half a turn, until the energy's word is at its greatest.
pub(super) fn haul(block: &dyn AnyBlock, inputs: &[Signal]) -> Vec<Stimulus> {
    let [root, energy, torque] =
        ["ROOT_WIDTH", "ENERGY_WIDTH", "TORQUE_WIDTH"].map(|name| generic(block, name).expect("a generic of the law"));
    let mut words: Vec<_> = inputs.iter().map(|signal| signal.format.max() as i64).collect();
    for (word, signal) in words.iter_mut().zip(inputs) {
        *word = if signal.name == "period" { 1 } else { *word };
    }
    // Edges from one capture to the next, which is at the edge after the load.
    let between = root / 2 + 3;
    let stride = i128::from(words[1] / between);
    // A torque is slightly less than 2^torque, and a motion slightly less than 2^motion. An eighth more captures, and
    // two, make up for it.
    let motion = i64::from(inputs[1].format.width()) - 1;
    let captures = (1 << (energy - torque - motion).clamp(0, 12)) * 9 / 8 + 2;
    let rows = (0..between * captures).map(|turn| {
        words[0] = inputs[0].format.wrap(i128::from(turn) * stride);
        edge(words.clone())
    });
    [reset(vec![0; inputs.len()])].into_iter().chain(rows).collect()
}

/// Returns a motion deep inside the hardest wall: half a turn back and then as far forward, with a capture for each
/// move. The torque is back at its greatest before each move out, which takes as much energy as possible, until the
/// energy's word is at its least.
pub(super) fn drain(block: &dyn AnyBlock, inputs: &[Signal]) -> Vec<Stimulus> {
    let energy = generic(block, "ENERGY_WIDTH").expect("a generic of the law");
    let mut words: Vec<_> = inputs.iter().map(|signal| signal.format.max() as i64).collect();
    for (word, signal) in words.iter_mut().zip(inputs) {
        match signal.name {
            "period" => *word = 1,
            "damping" => *word = 0,
            _ => {}
        }
    }
    let half = 1i128 << (inputs[0].format.width() - 1);
    let rows = (0..10).flat_map(|capture: i128| {
        words[0] = inputs[0].format.wrap(-(capture % 2) * half - capture / 2);
        // Edges from one capture to the next, which is at the edge after the load.
        vec![edge(words.clone()); energy as usize + 3]
    });
    [reset(vec![0; inputs.len()])].into_iter().chain(rows).collect()
}
