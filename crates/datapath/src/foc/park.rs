//! Park's transformation: a vector of the stator, as the rotor sees it.
//!
//! - **Equation**: `d = alpha cosine + beta sine`, `q = beta cosine - alpha sine`, each sum exact and rounded once, to
//!   the nearest, ties up.
//! - **Ports**: `alpha`, `beta` (1,WIDTH-1,0), `sine`, `cosine` (1,TRIG_INT,TRIG_FRAC) in; `d`, `q` (1,WIDTH-1,0) out,
//!   in the unit of the inputs.
//! - **Error**: at most 1/2 of the least significant bit for sine and cosine as these words. Where the words are off by
//!   `e`, at most `1/2 + e (|alpha| + |beta|)`.
//! - **Latency**: none, combinational. **Reset**: none.
//! - **Overflow**: saturates. With an exact sine and cosine, no vector does that is at most `2^(WIDTH-1) - 1` long.
//! - **VHDL twin**: `hdl/park.vhd`.
//! - **Source**: Park 1929.
//! - **Differs from the hardware**: no propagation delay, so no limit on the clock.

use hpu_signal::{Format, Narrowed, Narrowing, Overflow, Rounding, Word};

use crate::base::config::within;
use crate::base::listed::Listed;
use crate::base::words::accept_trig;
use crate::step::in_machine;
use crate::{Block, Combinational, ConfigError, Step};

hpu_signal::ports! {
    /// Inputs of the transformation.
    pub struct In of |block: &Park| {
        alpha: block.config.vector(), "1", "Vector along phase a";
        beta: block.config.vector(), "1", "Vector across phase a";
        sine: block.config.trig, "1", "Sine of the rotor's electrical angle";
        cosine: block.config.trig, "1", "Cosine of the rotor's electrical angle";
    }
    /// Outputs of the transformation.
    pub struct Out of |block: &Park| {
        d: block.config.vector(), "1", "Vector along the rotor's flux";
        q: block.config.vector(), "1", "Vector across the rotor's flux, a quarter of a turn ahead";
    }
}

crate::base::listed::configuration! {
    /// The words of Park's transformation and of its inverse.
    pub struct RotationConfig {
        /// Width of the vectors' words, in bits.
        width: u32 = 16, ["WIDTH"];
        /// Format of sine and cosine.
        trig: Format = Format::new(true, 1, 14).expect("16 bits"), ["TRIG_INT", "TRIG_FRAC"];
    }
}

impl RotationConfig {
    /// Refuses words that a rotation cannot have.
    pub(super) fn accept(self, block: &'static str) -> Result<(), ConfigError> {
        within(block, "WIDTH", self.width, 2..=32)?;
        accept_trig(block, self.trig)
    }

    /// Returns the format of a vector's words.
    pub(super) fn vector(self) -> Format {
        Format::signed(self.width)
    }

    /// Returns the rule that makes a vector's word of products with sine and cosine.
    pub(super) fn narrowing(self) -> Narrowing {
        Narrowing {
            from_frac: self.trig.frac(),
            to: self.vector(),
            rounding: Rounding::NearestUp,
            overflow: Overflow::Saturate,
        }
    }

    /// Returns the width of a product with sine or cosine.
    pub(super) fn product_width(self) -> u32 {
        self.width + self.trig.width()
    }

    /// Returns the configurations in which a rotation is tested.
    pub(super) fn variants() -> [(&'static str, Self); 3] {
        let of = |width, int, frac| Self { width, trig: Format::new(true, int, frac).expect("at most 32 bits") };
        [("narrow", of(4, 1, 4)), ("as_phantom", of(16, 9, 22)), ("wide", of(32, 1, 30))]
    }
}

/// Defines a rotation: a block of these words with an `impl Combinational`.
macro_rules! rotation {
    ($(#[$about:meta])* $block:ident = $name:literal) => {
        $(#[$about])*
        #[derive(Clone, PartialEq, Eq, Debug)]
        pub struct $block {
            config: RotationConfig,
            fits_64: bool,
        }

        impl $block {
            /// Returns a transformation of these words.
            ///
            /// # Errors
            ///
            /// Returns an error unless a vector's word has 2 to 32 bits, and sines have 1 to 35 integer bits, 4 to 30
            /// fraction bits and at most 40 bits.
            pub fn new(config: RotationConfig) -> Result<Self, ConfigError> {
                config.accept(Self::NAME)?;
                let mut block = Self { config, fits_64: false };
                block.fits_64 = Step::fits_64(&block);
                Ok(block)
            }

            /// Returns the outputs for these inputs, and which bits were lost to make them.
            #[inline]
            pub fn eval(&self, input: In<i64>) -> Out<Narrowed> {
                in_machine!(self.fits_64, input, |input| self.made(input))
            }
        }

        crate::base::listed::configured!($block: RotationConfig);

        impl Block for $block {
            const NAME: &'static str = $name;

            crate::base::block::combinational!(self, input => self.eval(input).map(|port| port.word));
        }

        crate::circuit::part::telling!($block);

        impl Listed for $block {
            fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
                RotationConfig::variants().into_iter().map(|(label, config)| Ok((label, Self::new(config)?))).collect()
            }
        }
    };
}
pub(super) use rotation;

rotation! {
    /// Park's transformation; the [module](self) describes it.
    Park = "park"
}

impl Combinational for Park {
    #[inline]
    fn made<W: Word>(&self, In { alpha, beta, sine, cosine }: In<W>) -> Out<W> {
        let (rule, width) = (self.config.narrowing(), self.config.product_width());
        let d = (alpha * cosine).cut("alpha_cosine", width) + (beta * sine).cut("beta_sine", width);
        let q = (beta * cosine).cut("beta_cosine", width) - (alpha * sine).cut("alpha_sine", width);
        Out { d: d.narrow(&rule), q: q.narrow(&rule) }
    }
}
