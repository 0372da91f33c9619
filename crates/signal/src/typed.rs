//! Words as numbers of the crate `fixed`, whose formats are types, and their bits as slices of the crate `bitvec`. Each
//! is a feature of this crate, for programs that have such numbers or slices already.

#[cfg(feature = "fixed")]
mod numbers {
    use fixed::traits::Fixed;

    use crate::{Format, FormatError};

    impl Format {
        /// Returns the format of a type of the crate `fixed`. In a constant, the compiler compares it with another.
        ///
        /// # Panics
        ///
        /// Panics if the type has more than 64 bits; in a constant that is an error of the compiler.
        ///
        /// ```
        /// use fixed::types::I10F22;
        /// use hpu_signal::Format;
        /// const Q22: Format = Format::of_fixed::<I10F22>();
        /// const _: () = assert!(Q22.is_signed() && Q22.width() == 32 && Q22.frac() == 22);
        /// assert_eq!(Q22.to_string(), "(1,9,22)");
        /// ```
        pub const fn of_fixed<T: Fixed>() -> Self {
            assert!(T::INT_NBITS + T::FRAC_NBITS <= 64, "a word has 1 to 64 bits");
            // The crate counts the sign among the integer bits.
            let int = T::INT_NBITS as i32 - T::IS_SIGNED as i32;
            Self { signed: T::IS_SIGNED, int: int as i8, frac: T::FRAC_NBITS as i8 }
        }

        /// Returns the word of a number.
        ///
        /// # Errors
        ///
        /// Returns [`FormatError::Type`] unless the number's type has this format.
        ///
        /// ```
        /// use fixed::types::{I10F22, U12F4};
        /// use hpu_signal::Format;
        /// let q22: Format = "(1,9,22)".parse().unwrap();
        /// assert_eq!(q22.word(I10F22::from_num(-1.5)), Ok(-6 << 20));
        /// assert_eq!(q22.number::<I10F22>(-6 << 20), Ok(I10F22::from_num(-1.5)));
        /// assert_eq!(q22.word(U12F4::ONE).unwrap_err().to_string(), "a number (0,12,4) is no word (1,9,22)");
        /// ```
        pub fn word<T: Fixed>(self, number: T) -> Result<i64, FormatError> {
            self.agree::<T>()?;
            let exact: i128 = number.to_bits().try_into().unwrap_or_else(|_| unreachable!("64 bits at most"));
            Ok(self.wrap(exact))
        }

        /// Returns the number that a word stands for.
        ///
        /// # Errors
        ///
        /// Returns [`FormatError::Type`] unless the number's type has this format.
        pub fn number<T: Fixed>(self, word: i64) -> Result<T, FormatError> {
            self.agree::<T>()?;
            let bits = self.value(word).try_into().unwrap_or_else(|_| unreachable!("a word of this format"));
            Ok(T::from_bits(bits))
        }

        fn agree<T: Fixed>(self) -> Result<(), FormatError> {
            let (number, word) = (Self::of_fixed::<T>(), self);
            if number == word { Ok(()) } else { Err(FormatError::Type { number, word }) }
        }
    }
}

#[cfg(feature = "bitvec")]
mod slices {
    use std::ops::Deref;

    use bitvec::prelude::{BitArray, BitSlice, BitVec, Lsb0};
    use bitvec::view::BitViewSized;

    use crate::Format;

    /// The bits of a word, the lowest first: a slice of the crate `bitvec`, as long as the word is wide.
    #[derive(Clone, Copy, PartialEq, Eq, Debug)]
    pub struct WordBits {
        bits: BitArray<u64, Lsb0>,
        width: usize,
    }

    impl Deref for WordBits {
        type Target = BitSlice<u64, Lsb0>;

        fn deref(&self) -> &Self::Target {
            &self.bits[..self.width]
        }
    }

    impl Format {
        /// Returns the bits of a word.
        ///
        /// ```
        /// use hpu_signal::Format;
        /// let counter = Format::unsigned(12);
        /// let bits = counter.word_bits(0b1000_0000_0101);
        /// assert_eq!(bits.iter_ones().collect::<Vec<_>>(), [0, 2, 11]);
        /// assert_eq!(counter.of_slice(&bits), 0x805);
        /// // Two lines that cross in the layout: a slice can be cut and joined.
        /// assert_eq!(Format::unsigned(4).of_slice(&bits[8..]), 0b1000);
        /// ```
        pub fn word_bits(self, word: i64) -> WordBits {
            WordBits { bits: self.bits(word).into_bitarray(), width: self.width() as usize }
        }

        /// Returns the word with these bits, the lowest first.
        ///
        /// # Panics
        ///
        /// Panics unless the slice is as long as the word is wide.
        pub fn of_slice(self, bits: &BitSlice<u64, Lsb0>) -> i64 {
            assert_eq!(bits.len(), self.width() as usize, "bits of a word {self}");
            self.from_bits(bits.iter_ones().fold(0, |word, place| word | 1 << place))
        }
    }

    /// Returns the bits of several words, one behind the other: those of a port bundle, or of a row of a trace.
    ///
    /// ```
    /// use hpu_signal::{Format, joined_bits, split_bits};
    /// let formats = [Format::BIT, Format::signed(4), Format::unsigned(3)];
    /// let row = joined_bits(&formats, &[1, -2, 5]);
    /// assert_eq!(row.to_string(), "[1, 0, 1, 1, 1, 1, 0, 1]");
    /// assert_eq!(split_bits(&formats, &row), [1, -2, 5]);
    /// ```
    pub fn joined_bits(formats: &[Format], words: &[i64]) -> BitVec<u64, Lsb0> {
        let mut row = BitVec::new();
        for (format, word) in formats.iter().zip(words) {
            row.extend_from_bitslice(&format.word_bits(*word));
        }
        row
    }

    /// Returns the words that [`joined_bits`] has joined.
    ///
    /// # Panics
    ///
    /// Panics unless the slice is as long as all words together.
    pub fn split_bits(formats: &[Format], mut row: &BitSlice<u64, Lsb0>) -> Vec<i64> {
        let words = formats.iter().map(|format| {
            let (word, rest) = row.split_at(format.width() as usize);
            row = rest;
            format.of_slice(word)
        });
        let words = words.collect();
        assert!(row.is_empty(), "{} bits too many", row.len());
        words
    }
}

#[cfg(feature = "bitvec")]
pub use slices::{WordBits, joined_bits, split_bits};
