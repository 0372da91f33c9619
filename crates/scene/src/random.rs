//! Random numbers of stimuli and of trials: the same on every platform, for ever.

/// SplitMix64 (Steele, Lea, Flood 2014): a counter in steps of the golden ratio, its bits mixed.
///
/// ```
/// // The first numbers of seed 1234567, as published with the algorithm.
/// let mut random = hpu_scene::SplitMix64::new(1_234_567);
/// assert_eq!(random.next_u64(), 6_457_827_717_110_365_317);
/// assert_eq!(random.next_u64(), 3_203_168_211_198_807_973);
/// ```
#[derive(Clone, Debug)]
pub struct SplitMix64 {
    state: u64,
}

impl SplitMix64 {
    /// Creates a sequence; every seed is a good one.
    pub const fn new(seed: u64) -> Self {
        Self { state: seed }
    }

    /// Returns the next 64 bits.
    pub const fn next_u64(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut mixed = self.state;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    /// Returns a number below `bound`, which must not be 0. (A bias of `bound / 2^64` does not matter to stimuli.)
    pub const fn below(&mut self, bound: u64) -> u64 {
        ((self.next_u64() as u128 * bound as u128) >> 64) as u64
    }

    /// Returns true once in `odds` times on average.
    pub const fn one_in(&mut self, odds: u64) -> bool {
        self.below(odds) == 0
    }
}
