//! Sets of small numbers.

/// A set of numbers below a limit, as bits.
#[derive(Clone, Default, Debug)]
pub(crate) struct IndexSet(Vec<u64>);

impl IndexSet {
    /// Returns an empty set for the numbers below `limit`.
    pub(crate) fn new(limit: usize) -> Self {
        Self(vec![0; limit.div_ceil(64)])
    }

    #[inline]
    pub(crate) fn insert(&mut self, index: usize) {
        self.0[index / 64] |= 1 << (index % 64);
    }

    /// Inserts the numbers of these bits into word `at` of the set, of 64 numbers each.
    #[inline]
    pub(crate) fn insert_into(&mut self, at: usize, bits: u64) {
        self.0[at] |= bits;
    }

    /// Inserts the numbers of another set, which has the same limit.
    #[inline]
    pub(crate) fn extend(&mut self, other: &Self) {
        self.0.iter_mut().zip(&other.0).for_each(|(own, other)| *own |= other);
    }

    #[inline]
    pub(crate) fn set(&mut self, index: usize, is_in: bool) {
        let (word, at) = (&mut self.0[index / 64], index % 64);
        *word = *word & !(1 << at) | u64::from(is_in) << at;
    }

    #[inline]
    pub(crate) fn contains(&self, index: usize) -> bool {
        self.0[index / 64] >> (index % 64) & 1 != 0
    }

    #[inline]
    pub(crate) fn is_empty(&self) -> bool {
        self.0.iter().all(|bits| *bits == 0)
    }

    /// Returns whether every number of this set is in the other one, which has the same limit.
    #[inline]
    pub(crate) fn is_within(&self, other: &Self) -> bool {
        self.0.iter().zip(&other.0).all(|(own, other)| own & !other == 0)
    }

    /// Returns whether a number is in both sets, which have the same limit.
    #[inline]
    pub(crate) fn meets(&self, other: &Self) -> bool {
        self.0.iter().zip(&other.0).any(|(own, other)| own & other != 0)
    }

    /// Removes the numbers in word `at` of the set, of 64 numbers each, and returns them as bits.
    #[inline]
    pub(crate) fn take(&mut self, at: usize) -> u64 {
        std::mem::take(&mut self.0[at])
    }

    /// Returns word `at` of the set, of 64 numbers each.
    #[inline]
    pub(crate) fn part(&self, at: usize) -> u64 {
        self.0[at]
    }

    /// Returns word `at` of the set, of 64 numbers each, if it has so many.
    #[inline]
    pub(crate) fn part_mut(&mut self, at: usize) -> Option<&mut u64> {
        self.0.get_mut(at)
    }

    /// Returns how many words of 64 numbers each the set has.
    #[inline]
    pub(crate) fn parts(&self) -> usize {
        self.0.len()
    }

    /// Returns the numbers of the set, in order.
    #[inline]
    pub(crate) fn iter(&self) -> impl Iterator<Item = usize> + '_ {
        self.0.iter().enumerate().flat_map(|(at, &bits)| {
            let mut left = bits;
            std::iter::from_fn(move || take_lowest(&mut left, at))
        })
    }
}

/// Removes the least number from word `at` of a set, and returns it.
#[inline]
pub(crate) fn take_lowest(bits: &mut u64, at: usize) -> Option<usize> {
    if *bits == 0 {
        return None;
    }
    let index = bits.trailing_zeros() as usize;
    *bits &= *bits - 1;
    Some(64 * at + index)
}
