//! From the encoder's pins to the wall's coordinates.
//!
//! - **Equation**: `position` counts the quadrature steps of `a_pin`, `b_pin`; `delta = (position - reference)` modulo
//!   `2^POSITION_WIDTH` as two's complement; `contact` = 1 when `delta >= 0`; `penetration = max(0, delta)`.
//! - **Ports**: `a_pin`, `b_pin` (0,1,0), `reference` (0,POSITION_WIDTH,0) in; `position` (0,POSITION_WIDTH,0), `error`
//!   (0,1,0), `delta` (1,POSITION_WIDTH-1,0), `contact` (0,1,0), `penetration` (0,POSITION_WIDTH,0) out.
//! - **Latency**: 4 edges from a pin to the position; from `reference` on combinational.
//! - **Edge**: as in `synchronizer`, `quadrature_decoder` and `position_counter`, each of which sees what stood before
//!   it.
//! - **Reset**: every register as its block says. **Overflow**: the position wraps, and `delta` reads through it.
//! - **VHDL twin**: `hdl/axis_front.vhd`, instances `sync`, `decoder`, `counter`, `offset`, `wall`.
//! - **Source**: the first five blocks of `hybrid_loop`, Vasudevan et al. 2007.
//! - **Differs from the hardware**: as in synchronizer, quadrature_decoder, position_counter, displacement and
//!   unilateral.

use hpu_signal::Narrowed;

use crate::base::listed::Listed;
use crate::circuit::instance;
use crate::circuit::part::{Part, exact};
use crate::pins::axis::Axis;
use crate::{
    Block, ConfigError, Displacement, Generic, Instance, Parts, Unilateral, arithmetic::unilateral, flatten,
    pins::displacement, pins::synchronizer,
};

hpu_signal::ports! {
    /// Inputs of the front.
    pub struct In of |block: &AxisFront| {
        a_pin = block.axis.sync.inputs().a_pin;
        b_pin = block.axis.sync.inputs().b_pin;
        reference = block.offset.inputs().reference;
    }
    /// Outputs of the front.
    pub struct Out of |block: &AxisFront| {
        position = block.axis.counter.outputs().position;
        error = block.axis.decoder.outputs().error;
        delta = block.offset.outputs().delta;
        contact = block.wall.outputs().contact;
        penetration = block.wall.outputs().penetration;
    }
}

/// See the [module](self).
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct AxisFront {
    width: u32,
    axis: Axis,
    offset: Displacement,
    wall: Unilateral,
    shown: Out<i64>,
}

impl AxisFront {
    /// Returns a front with a counter of `width` bits.
    ///
    /// # Errors
    ///
    /// Returns an error unless `width` is 2 to 62.
    pub fn new(width: u32) -> Result<Self, ConfigError> {
        let shown = Out { position: 0, error: 0, delta: 0, contact: 0, penetration: 0 };
        let (offset, wall) = (Displacement::new(width)?, Unilateral::new(width)?);
        let mut block = Self { width, axis: Axis::new(width)?, offset, wall, shown };
        block.settle(0);
        Ok(block)
    }

    /// Sets the counter to a position.
    #[inline]
    pub(crate) fn load(&mut self, position: i64) {
        self.axis.position = self.axis.counter.load(position);
    }

    /// Lets the outputs settle with this reference and the current registers.
    #[inline]
    pub(crate) fn settle(&mut self, reference: i64) -> Out<i64> {
        let Axis { position, motion, .. } = self.axis;
        let displacement::Out { delta } = self.offset.eval(displacement::In { position, reference });
        let unilateral::Out { contact, penetration } = self.wall.eval(unilateral::In { delta });
        self.shown = Out { position, error: motion.error, delta, contact, penetration };
        self.shown
    }
}

crate::base::listed::configured! {
    AxisFront of |block| {
        "POSITION_WIDTH": u32 = 12, block.width;
    }
}

impl Block for AxisFront {
    const NAME: &'static str = "axis_front";
    const CLOCKED: bool = true;
    crate::base::block::described!();

    fn generics(&self) -> Vec<(&'static str, Generic)> {
        self.told()
    }

    fn counts(&self) -> Option<&'static str> {
        Block::counts(&self.axis.counter)
    }

    fn inside(&self) -> Vec<Instance> {
        let parts = self.parts().into_iter().flat_map(|parts| parts.instances);
        parts.filter(|instance| !instance.model.clocked()).collect()
    }

    fn parts(&self) -> Option<Parts> {
        let [a_pin, b_pin, reference, position, error, delta, contact, penetration, a, b, step] =
            std::array::from_fn(|net| net);
        let mut nets = flatten(&self.inputs());
        nets.extend(flatten(&self.outputs()));
        nets.extend(flatten(&self.axis.decoder.inputs()));
        nets.push(self.axis.decoder.outputs().step);
        let instances = vec![
            instance("sync", &self.axis.sync, &[a_pin, b_pin, a, b]),
            instance("decoder", &self.axis.decoder, &[a, b, step, error]),
            instance("counter", &self.axis.counter, &[step, position]),
            instance("offset", &self.offset, &[position, reference, delta]),
            instance("wall", &self.wall, &[delta, contact, penetration]),
        ];
        Some(Parts { nets, instances })
    }

    fn reset(&mut self) -> Out<i64> {
        self.axis.reset();
        self.settle(0)
    }

    #[inline]
    fn tick(&mut self, input: In<i64>) -> Out<i64> {
        let In { a_pin, b_pin, reference } = input;
        self.axis.tick(synchronizer::In { a_pin, b_pin });
        self.settle(reference)
    }

    #[inline]
    fn quiet(&self, input: &In<i64>) -> u64 {
        let In { a_pin, b_pin, reference } = *input;
        let displacement::Out { delta } =
            self.offset.eval(displacement::In { position: self.axis.position, reference });
        if delta == self.shown.delta { self.axis.quiet(&synchronizer::In { a_pin, b_pin }) } else { 0 }
    }

    #[inline]
    fn skip(&mut self, edges: u64, input: &In<i64>) {
        debug_assert!(edges <= self.quiet(input));
        self.axis.skip(edges, &synchronizer::In { a_pin: input.a_pin, b_pin: input.b_pin });
    }
}

impl Listed for AxisFront {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        Ok(vec![("8_bit", Self::new(8)?), ("32_bit", Self::new(32)?)])
    }
}

impl Part for AxisFront {
    #[inline]
    fn follow(&mut self, input: &Self::In<i64>, _: Self::Out<i64>) -> Self::Out<Narrowed> {
        self.settle(input.reference).map(exact)
    }
}
