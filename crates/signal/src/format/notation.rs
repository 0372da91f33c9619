//! Word formats in the notations of other tools, so that a reader need not guess whether the sign bit is counted.

use crate::Format;

/// A notation for a [`Format`].
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum Notation {
    /// `(S,I,F)`: sign bit, integer bits, fraction bits.
    Triple,
    /// The types of VHDL-2008's `fixed_pkg`: `sfixed(I downto -F)` or `ufixed(I-1 downto -F)`. The index of a bit is
    /// the power of two that the bit is worth; the sign bit of `sfixed` is the leftmost.
    Vhdl,
    /// The types of C++ high-level synthesis: `ap_fixed<W,I>` or `ap_ufixed<W,I>`. The whole width comes first; the `I`
    /// of a signed type counts the sign bit.
    Cpp,
    /// Q notation, with the whole width and the name of the convention: TI does not count the sign bit among the
    /// integer bits, ARM does. An unsigned word has no sign bit, so both agree.
    Q,
}

impl Notation {
    /// Every notation, for tests and lists.
    pub const ALL: [Self; 4] = [Self::Triple, Self::Vhdl, Self::Cpp, Self::Q];

    /// Returns the format in this notation.
    ///
    /// # Example
    ///
    /// ```
    /// use hpu_signal::{Format, Notation};
    /// let trig: Format = "(1,9,22)".parse().unwrap();
    /// assert_eq!(Notation::Vhdl.of(trig), "sfixed(9 downto -22)");
    /// assert_eq!(Notation::Cpp.of(trig), "ap_fixed<32,10>");
    /// assert_eq!(Notation::Q.of(trig), "Q9.22 (32 bits, TI) = Q10.22 (32 bits, ARM)");
    /// ```
    pub fn of(self, format: Format) -> String {
        let (int, frac, width) = (format.int(), format.frac(), format.width());
        let bits = if width == 1 { "1 bit".to_string() } else { format!("{width} bits") };
        match (self, format.is_signed()) {
            (Self::Triple, _) => format.to_string(),
            (Self::Vhdl, true) => format!("sfixed({int} downto {})", -frac),
            (Self::Vhdl, false) => format!("ufixed({} downto {})", int - 1, -frac),
            (Self::Cpp, true) => format!("ap_fixed<{width},{}>", int + 1),
            (Self::Cpp, false) => format!("ap_ufixed<{width},{int}>"),
            (Self::Q, true) => format!("Q{int}.{frac} ({bits}, TI) = Q{}.{frac} ({bits}, ARM)", int + 1),
            (Self::Q, false) => format!("UQ{int}.{frac} ({bits})"),
        }
    }
}
