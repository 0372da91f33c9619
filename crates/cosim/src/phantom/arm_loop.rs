//! The wirings of an arm.

use hpu_datapath::AnyWiring;
use hpu_datapath::phantom::{PhantomIo, PhantomLoop, PhantomSharedLoop};

/// The wiring of an arm.
#[allow(clippy::large_enum_variant, reason = "one of them exists a run")]
pub(super) enum ArmLoop {
    /// A PHANToM's loop, every block its own logic.
    Phantom(PhantomLoop),
    /// A PHANToM's loop, one multiplier for all blocks.
    PhantomShared(PhantomSharedLoop),
    /// Counters and DACs around a host.
    PhantomIo(PhantomIo),
}

impl ArmLoop {
    /// Returns the wiring without its type. Never inlined, as [`AxisLoop::wiring`](crate::AxisLoop::wiring).
    #[inline(never)]
    pub(super) fn wiring(&self) -> &dyn AnyWiring {
        match self {
            Self::Phantom(wiring) => wiring,
            Self::PhantomShared(wiring) => wiring,
            Self::PhantomIo(wiring) => wiring,
        }
    }
}
