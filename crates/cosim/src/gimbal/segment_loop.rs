//! The wirings of a segment on a gimbal.

use hpu_datapath::gimbal::{GimbalLoop, GimbalLoopConfig, GimbalShearLoop};
use hpu_datapath::{AnyBlock, ConfigError, Instance, Wiring};
use hpu_signal::Signal;

/// The wiring of a segment on a gimbal.
#[derive(Clone)]
#[allow(clippy::large_enum_variant, reason = "one of them exists a run")]
pub enum SegmentLoop {
    /// The tip follows the target.
    Plain(GimbalLoop),
    /// The tip follows a fractional derivative of the target's `x`.
    Shear(GimbalShearLoop),
}

impl SegmentLoop {
    /// Returns the wiring with or without shear.
    ///
    /// # Errors
    ///
    /// When a block refuses its words.
    pub(super) fn new(config: GimbalLoopConfig, has_shear: bool) -> Result<Self, ConfigError> {
        if has_shear { GimbalShearLoop::new(config).map(Self::Shear) } else { GimbalLoop::new(config).map(Self::Plain) }
    }

    /// Returns every wiring in its default configuration.
    pub fn all() -> Vec<Self> {
        vec![Self::Plain(GimbalLoop::default()), Self::Shear(GimbalShearLoop::default())]
    }

    /// Returns the wiring as a block.
    pub fn block(&self) -> &dyn AnyBlock {
        match self {
            Self::Plain(wiring) => wiring,
            Self::Shear(wiring) => wiring,
        }
    }

    /// Returns the nets.
    pub fn nets(&self) -> Vec<Signal> {
        match self {
            Self::Plain(wiring) => wiring.nets(),
            Self::Shear(wiring) => wiring.nets(),
        }
    }

    /// Returns the instances, in the order of the VHDL.
    pub fn instances(&self) -> Vec<Instance> {
        match self {
            Self::Plain(wiring) => wiring.instances(),
            Self::Shear(wiring) => wiring.instances(),
        }
    }
}
