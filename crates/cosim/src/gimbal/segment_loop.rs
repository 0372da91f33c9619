//! The wirings of a segment on a gimbal.

use hpu_datapath::gimbal::{GimbalLoop, GimbalLoopConfig, GimbalShearLoop};
use hpu_datapath::{AnyWiring, ConfigError};

/// The wiring of a segment on a gimbal.
#[allow(clippy::large_enum_variant, reason = "one of them exists a run")]
pub(super) enum SegmentLoop {
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

    /// Returns the wiring without its type. Never inlined, as [`AxisLoop::wiring`](crate::AxisLoop::wiring).
    #[inline(never)]
    pub(super) fn wiring(&self) -> &dyn AnyWiring {
        match self {
            Self::Plain(wiring) => wiring,
            Self::Shear(wiring) => wiring,
        }
    }
}
