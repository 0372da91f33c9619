//! The wirings of an arm.

use hpu_datapath::phantom::{PhantomIo, PhantomLoop, PhantomSharedLoop};
use hpu_datapath::{AnyBlock, Instance, Wiring};
use hpu_signal::Signal;

/// The wiring of an arm.
#[derive(Clone)]
#[allow(clippy::large_enum_variant, reason = "one of them exists a run")]
pub enum ArmLoop {
    /// A PHANToM's loop, every block its own logic.
    Phantom(PhantomLoop),
    /// A PHANToM's loop, one multiplier for all blocks.
    PhantomShared(PhantomSharedLoop),
    /// Counters and DACs around a host.
    PhantomIo(PhantomIo),
}

impl ArmLoop {
    /// Returns every wiring in its default configuration.
    pub fn all() -> Vec<Self> {
        vec![
            Self::Phantom(PhantomLoop::default()),
            Self::PhantomShared(PhantomSharedLoop::default()),
            Self::PhantomIo(PhantomIo::default()),
        ]
    }

    /// Returns the wiring as a block.
    pub fn block(&self) -> &dyn AnyBlock {
        match self {
            Self::Phantom(wiring) => wiring,
            Self::PhantomShared(wiring) => wiring,
            Self::PhantomIo(wiring) => wiring,
        }
    }

    /// Returns the nets.
    pub fn nets(&self) -> Vec<Signal> {
        match self {
            Self::Phantom(wiring) => wiring.nets(),
            Self::PhantomShared(wiring) => wiring.nets(),
            Self::PhantomIo(wiring) => wiring.nets(),
        }
    }

    /// Returns the instances, in the order of the VHDL.
    pub fn instances(&self) -> Vec<Instance> {
        match self {
            Self::Phantom(wiring) => wiring.instances(),
            Self::PhantomShared(wiring) => wiring.instances(),
            Self::PhantomIo(wiring) => wiring.instances(),
        }
    }
}
