//! Shared parts of the tests of the laws: a device at a wall with consistent inputs, and pseudo-random numbers to move
//! it.

use hpu_datapath::{Law, LawIn};

/// Pseudo-random numbers that are the same on every machine (SplitMix64).
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let once = (self.0 ^ self.0 >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let twice = (once ^ once >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        twice ^ twice >> 31
    }

    /// Returns a number of `low..=high`.
    pub fn between(&mut self, low: i64, high: i64) -> i64 {
        low + (self.next() % (high - low + 1) as u64) as i64
    }
}

/// A device with `2^width` counts per turn at a wall, and the words that a law reads there.
#[derive(Clone, Copy)]
pub struct Wall {
    pub width: u32,
    pub position: i64,
    pub reference: i64,
    pub stiffness: i64,
    pub damping: i64,
    pub period: i64,
    pub scale: i64,
}

impl Wall {
    /// Returns a device at the surface of a wall at 0, with all gains 0.
    pub fn new(width: u32, period: i64) -> Self {
        Self { width, position: 0, reference: 0, stiffness: 0, damping: 0, period, scale: 0 }
    }

    pub fn moves(&mut self, motion: i64) {
        self.position += motion;
    }

    pub fn words(&self) -> LawIn<i64> {
        let turn = 1i64 << self.width;
        let delta = (self.position - self.reference + turn / 2).rem_euclid(turn) - turn / 2;
        LawIn {
            position: self.position.rem_euclid(turn),
            delta,
            contact: i64::from(delta >= 0),
            penetration: delta.max(0),
            stiffness: self.stiffness,
            damping: self.damping,
            period: self.period,
            scale: self.scale,
        }
    }
}

/// Runs one sample with the device at rest during the computation. Returns the new torque and memory.
pub fn sampled<L: Law>(law: &mut L, wall: &mut Wall) -> [i64; 2] {
    wall.period = i64::from(law.latency()) + 1;
    let mut shown = law.tick(wall.words());
    for _ in 0..law.latency() {
        shown = law.tick(wall.words());
    }
    [shown.torque, shown.memory]
}

/// Returns a random motion. A series of them creeps, rests, runs and jumps back and forth about the wall's surface.
pub fn motion(random: &mut Random, depth: i64, reach: i64) -> i64 {
    let free = match random.next() % 8 {
        0 | 1 => 0,
        2..=5 => random.between(-2, 2),
        _ => random.between(-reach, reach),
    };
    // The motion is turned back at the ends, so that the counter does not wrap.
    if (depth + free).abs() > 8 * reach { -free.abs() * depth.signum() } else { free }
}
