//! Two flip-flops in series on each encoder line.
//!
//! - **Equation**: after edge `n`, `a` and `b` are the pins as sampled at edge `n-1`.
//! - **Ports**: `a_pin`, `b_pin` (0,1,0) in; `a`, `b` (0,1,0) out.
//! - **Latency**: 2 edges.
//! - **Edge**: the old first stage goes out, the pin enters the first stage.
//! - **Reset**: all four flip-flops 0. **Overflow**: none.
//! - **VHDL twin**: `hdl/synchronizer.vhd`.
//! - **Source**: common practice for asynchronous inputs.
//! - **Differs from the hardware**: no flip-flop is ever metastable here: a line that moves at the edge is read as its
//!   value just before it.

use hpu_signal::{Format, Word};

use crate::base::listed::{Configured, Given, Listed};
use crate::{Block, ConfigError, Generic, Register, Step};

hpu_signal::ports! {
    /// Inputs of the synchronizer.
    pub struct In of |_: &Synchronizer| {
        a_pin, "Encoder line A as it arrives at the FPGA";
        b_pin, "Encoder line B as it arrives at the FPGA";
    }
    /// Outputs of the synchronizer.
    pub struct Out of |_: &Synchronizer| {
        a, "Encoder line A, synchronous";
        b, "Encoder line B, synchronous";
    }
}

/// A synchronizer of an encoder's two lines; the [module](self) describes it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Synchronizer {
    stage: In<i64>,
    out: Out<i64>,
}

impl Synchronizer {
    /// Returns a synchronizer in its state after reset.
    pub fn new() -> Self {
        Self { stage: In { a_pin: 0, b_pin: 0 }, out: Out { a: 0, b: 0 } }
    }

    /// Returns the outputs after the next edge.
    #[inline]
    pub(crate) fn coming(&self) -> Out<i64> {
        Out { a: self.stage.a_pin, b: self.stage.b_pin }
    }
}

impl Step for Synchronizer {
    fn registers(&self) -> Vec<Register> {
        ["stage_a", "stage_b", "a", "b"].map(|name| Register::new(name, Format::BIT)).to_vec()
    }

    fn step<W: Word>(&self, registers: &[W], In { a_pin, b_pin }: In<W>) -> (Vec<W>, Out<W>) {
        let [stage_a, stage_b, a, b] = *registers else { unreachable!("four registers") };
        (vec![a_pin, b_pin, stage_a, stage_b], Out { a, b })
    }
}

impl Default for Synchronizer {
    fn default() -> Self {
        Self::new()
    }
}

impl Block for Synchronizer {
    const NAME: &'static str = "synchronizer";
    crate::base::block::clocked!();

    fn reset(&mut self) -> Out<i64> {
        *self = Self::new();
        self.out
    }

    #[inline]
    fn tick(&mut self, input: In<i64>) -> Out<i64> {
        self.out = self.coming();
        self.stage = input;
        self.out
    }

    #[inline]
    fn quiet(&self, input: &In<i64>) -> u64 {
        let shown = In { a_pin: self.out.a, b_pin: self.out.b };
        if self.stage != shown {
            0
        } else if *input != shown {
            1
        } else {
            u64::MAX
        }
    }

    #[inline]
    fn skip(&mut self, edges: u64, input: &In<i64>) {
        debug_assert!(edges <= self.quiet(input));
        if edges > 0 {
            self.stage = *input;
        }
    }
}

impl Synchronizer {
    fn told(&self) -> Vec<(&'static str, Generic)> {
        Vec::new()
    }
}

impl Configured for Synchronizer {
    fn of_generics(_: &Given) -> Result<Self, ConfigError> {
        Ok(Self::new())
    }
}

impl Listed for Synchronizer {}
