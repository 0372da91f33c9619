//! The inverse of Park's transformation: a vector of the rotor, as the stator sees it.
//!
//! - **Equation**: `alpha = d cosine - q sine`, `beta = d sine + q cosine`, each sum exact and rounded once, to the
//!   nearest, ties up.
//! - **Ports**: `d`, `q` (1,WIDTH-1,0), `sine`, `cosine` (1,TRIG_INT,TRIG_FRAC) in; `alpha`, `beta` (1,WIDTH-1,0) out,
//!   in the unit of the inputs.
//! - **Error**: at most 1/2 of the least significant bit for sine and cosine as these words. Where the words are off by
//!   `e`, at most `1/2 + e (|d| + |q|)`.
//! - **Latency**: none, combinational. **Reset**: none.
//! - **Overflow**: saturates. With an exact sine and cosine, no vector does that is at most `2^(WIDTH-1) - 1` long.
//! - **VHDL twin**: `hdl/inverse_park.vhd`.
//! - **Source**: Park 1929.
//! - **Differs from the hardware**: no propagation delay, so no limit on the clock.

use hpu_signal::{Narrowed, Word};

use super::park::{RotationConfig, rotation};
use crate::base::listed::Listed;
use crate::step::in_machine;
use crate::{Block, Combinational, ConfigError, Step};

hpu_signal::ports! {
    /// Inputs of the transformation.
    pub struct In of |block: &InversePark| {
        d: block.config.vector(), "1", "Vector along the rotor's flux";
        q: block.config.vector(), "1", "Vector across the rotor's flux";
        sine: block.config.trig, "1", "Sine of the rotor's electrical angle";
        cosine: block.config.trig, "1", "Cosine of the rotor's electrical angle";
    }
    /// Outputs of the transformation.
    pub struct Out of |block: &InversePark| {
        alpha: block.config.vector(), "1", "Vector along phase a";
        beta: block.config.vector(), "1", "Vector across phase a, a quarter of a turn ahead";
    }
}

rotation! {
    /// The inverse of Park's transformation; the [module](self) describes it.
    InversePark = "inverse_park"
}

impl Combinational for InversePark {
    #[inline]
    fn made<W: Word>(&self, In { d, q, sine, cosine }: In<W>) -> Out<W> {
        let (rule, width) = (self.config.narrowing(), self.config.product_width());
        let alpha = (d * cosine).cut("d_cosine", width) - (q * sine).cut("q_sine", width);
        let beta = (d * sine).cut("d_sine", width) + (q * cosine).cut("q_cosine", width);
        Out { alpha: alpha.narrow(&rule), beta: beta.narrow(&rule) }
    }
}
