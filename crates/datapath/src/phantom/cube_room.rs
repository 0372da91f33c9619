//! Three pairs of walls, each of which can be removed. Beyond each wall a spring pushes, up to a greatest force.
//!
//! - **Equation**: for each axis, `depth = x - x_high` if `x > x_high`, else `x - x_low` if `x < x_low`, else 0, exact
//!   in one bit more than a position; `force = clamp(round(-stiffness depth))` to `FORCE_FRAC` bits, nearest, ties up,
//!   and to `-FORCE_LIMIT..=FORCE_LIMIT`. Without its pair, an axis has neither force nor contact.
//! - **Ports**: `x` `y` `z` `x_low` `x_high` `y_low` `y_high` `z_low` `z_high` (1,POSITION_INT,POSITION_FRAC) in
//!   metres, `room` (0,3,0): bits 0, 1, 2 put the pairs of x, y, z in, `stiffness` (0,STIFFNESS_INT,STIFFNESS_FRAC) in
//!   N/m, in; `force_x` `force_y` `force_z` (1,FORCE_INT,FORCE_FRAC) in newtons on the tip, `contact` (0,3,0): bit per
//!   axis, set beyond a wall, out.
//! - **Latency**: none, combinational. **Reset**: none.
//! - **Overflow**: saturates at the limit. [`eval`](CubeRoom::eval) tells it as overflow.
//! - **VHDL twin**: `hdl/cube_room.vhd`.
//! - **Source**: the cube of Sevcik et al. 2009.
//! - **Differs from the hardware**: no propagation delay, so no limit on the clock.

use hpu_signal::{Format, Narrowed, Word};

use super::Formats;
use super::variants::paths;
use crate::base::config::{NATURAL, within};
use crate::base::listed::{Configured, Given, Listed};
use crate::base::words::{accept, limited, natural, parts};
use crate::step::in_machine;
use crate::{Block, Combinational, ConfigError, Generic, Step};

hpu_signal::ports! {
    /// Inputs of the room.
    pub struct In of |block: &CubeRoom| {
        x: block.position, "m", "Tip to the right of the origin";
        y: block.position, "m", "Tip above the origin";
        z: block.position, "m", "Tip before the origin";
        x_low: block.position, "m", "Left wall";
        x_high: block.position, "m", "Right wall";
        y_low: block.position, "m", "Floor";
        y_high: block.position, "m", "Ceiling";
        z_low: block.position, "m", "Far wall";
        z_high: block.position, "m", "Near wall";
        room: Format::unsigned(3), "1", "Pairs of walls that are there: bit 0 x, 1 y, 2 z";
        stiffness: block.stiffness, "N/m", "Stiffness of the walls";
    }
    /// Outputs of the room.
    pub struct Out of |block: &CubeRoom| {
        force_x: block.force, "N", "Force on the tip to the right";
        force_y: block.force, "N", "Force on the tip upwards";
        force_z: block.force, "N", "Force on the tip towards the user";
        contact: Format::unsigned(3), "1", "Beyond a wall: bit 0 x, 1 y, 2 z";
    }
}

/// See the [module](self).
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct CubeRoom {
    position: Format,
    stiffness: Format,
    force: Format,
    limit: u32,
    fits_64: bool,
}

impl CubeRoom {
    /// Returns a room with these words. It uses only those `formats` that its ports have.
    ///
    /// # Errors
    ///
    /// Returns an error unless the words have 2 to 40 bits with 0 to 30 fraction bits, positions and forces are signed
    /// and the stiffness unsigned, and the limit is a positive VHDL `natural` and a word of the force's format.
    pub fn new(formats: &Formats, limit: u32) -> Result<Self, ConfigError> {
        let Formats { position, stiffness, force, .. } = *formats;
        accept(Self::NAME, "POSITION", position, true)?;
        accept(Self::NAME, "STIFFNESS", stiffness, false)?;
        accept(Self::NAME, "FORCE", force, true)?;
        let most = u32::try_from(force.max()).map_or(NATURAL, |most| most.min(NATURAL));
        within(Self::NAME, "FORCE_LIMIT", limit, 1..=most)?;
        let mut block = Self { position, stiffness, force, limit, fits_64: false };
        block.fits_64 = Step::fits_64(&block);
        Ok(block)
    }

    /// Returns force and contact, and which bits were lost to make them.
    #[inline]
    pub fn eval(&self, input: In<i64>) -> Out<Narrowed> {
        in_machine!(self.fits_64, input, |input| self.made(input))
    }

    /// Returns the force of a wall on a tip that is `depth` beyond it.
    #[inline]
    fn force<W: Word>(&self, stiffness: W, depth: W) -> W {
        let drop = self.position.frac() + self.stiffness.frac() - self.force.frac();
        let limit = i128::from(self.limit);
        limited(-(stiffness * depth), drop, [-limit, limit])
    }
}

impl Combinational for CubeRoom {
    #[inline]
    fn made<W: Word>(&self, input: In<W>) -> Out<W> {
        let In { x, y, z, x_low, x_high, y_low, y_high, z_low, z_high, room, stiffness } = input;
        let beyond = self.position.width() + 1;
        let pushed = |pair: u32, name: &str, at: W, low: W, high: W| {
            let is_there = room.bit(pair);
            let push = || {
                let depth = depth(at, low, high);
                [self.force(stiffness, depth.cut(name, beyond)), W::of_bit(depth.is_set()).shl(pair)]
            };
            W::branch(is_there, push, || [W::int(0); 2])
        };
        let [force_x, beyond_x] = pushed(0, "depth_x", x, x_low, x_high);
        let [force_y, beyond_y] = pushed(1, "depth_y", y, y_low, y_high);
        let [force_z, beyond_z] = pushed(2, "depth_z", z, z_low, z_high);
        Out { force_x, force_y, force_z, contact: beyond_x + beyond_y + beyond_z }
    }
}

/// Returns how far a coordinate is beyond one of two walls. If the walls are crossed, the upper one counts first.
#[inline]
fn depth<W: Word>(at: W, low: W, high: W) -> W {
    let below = || W::branch(low.above(at), || [at - low], || [W::int(0)]);
    let [depth] = W::branch(at.above(high), || [at - high], below);
    depth
}

crate::base::block::data_sheet!(CubeRoom = Self::new(&Formats::default(), 557_056));

impl Block for CubeRoom {
    const NAME: &'static str = "cube_room";

    crate::base::block::combinational!(self, input => self.eval(input).map(|port| port.word));
}

crate::circuit::part::telling!(CubeRoom);

impl CubeRoom {
    fn told(&self) -> Vec<(&'static str, Generic)> {
        let mut all = parts("POSITION_INT", "POSITION_FRAC", self.position).to_vec();
        all.extend(parts("STIFFNESS_INT", "STIFFNESS_FRAC", self.stiffness));
        all.extend(parts("FORCE_INT", "FORCE_FRAC", self.force));
        all.push(natural("FORCE_LIMIT", self.limit));
        all
    }
}

impl Configured for CubeRoom {
    fn of_generics(given: &Given) -> Result<Self, ConfigError> {
        Self::new(&Formats::given(given)?, given.natural("FORCE_LIMIT")?)
    }
}

impl Listed for CubeRoom {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        // The Premium 1.5 differs from the default in geometry, which does not affect the room.
        let others = paths().into_iter().filter(|(label, _)| *label != "premium_1_5");
        others.map(|(label, config)| Ok((label, Self::new(&config.formats, config.force_limit)?))).collect()
    }
}
