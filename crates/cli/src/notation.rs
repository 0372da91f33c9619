//! The notation in which a command writes word formats.

use clap::ValueEnum;
use hpu_signal::{Format, Notation};

/// The option of every command that shows word formats in a table.
#[derive(Default, clap::Args)]
pub struct Written {
    /// How word formats are written [default: triple]
    #[arg(long, value_enum)]
    notation: Option<Name>,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Name {
    /// (S,I,F): sign bit, integer bits, fraction bits
    Triple,
    /// VHDL's sfixed(I downto -F)
    #[value(alias = "sfixed")]
    Vhdl,
    /// C++'s ap_fixed<W,I>
    #[value(alias = "ap_fixed")]
    Cpp,
    /// Q notation, with the width, as TI writes it and as ARM does
    Q,
}

impl Written {
    /// Returns the notation, if one was asked for.
    pub fn asked(&self) -> Option<Notation> {
        self.notation.map(|name| match name {
            Name::Triple => Notation::Triple,
            Name::Vhdl => Notation::Vhdl,
            Name::Cpp => Notation::Cpp,
            Name::Q => Notation::Q,
        })
    }

    /// Returns the notation that was asked for, or the default.
    pub fn get(&self) -> Notation {
        self.asked().unwrap_or(Notation::Triple)
    }
}

/// Returns a format as `[s, i, f]`.
pub fn triple(format: Format) -> [i32; 3] {
    [i32::from(format.is_signed()), format.int(), format.frac()]
}
