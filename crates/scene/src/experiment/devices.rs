//! The devices that scenes can have: the list, and what is known of all of them.
//!
//! # A new device
//!
//! Its scene is a module of its own here, with a reader, its keys (`rows.rs`), its shipped scenes and the scene to
//! begin with (`shipped.rs`). Its simulation is a module of the crate. It is a line in `devices!`, its value of
//! `device.kind` below, and the two modules with what other crates see of them (`scene/mod.rs`, `lib.rs`). Kinds of
//! scene, readers, keys, simulations and `hpu new` follow.

use crate::axis::shipped::AXIS;
use crate::head::shipped::{Begin, Shipped};
use crate::joined::{joined, length};
use crate::schema::{Choice, DeviceKeys, Group, Key, Otherwise::Required, keys};

/// Calls a macro with the list of devices beside an axis: of each its meaning, its name in code, its `device.kind`,
/// which is also its kind of scene and the name of its module, its scene, and its simulation.
#[cfg(not(target_family = "wasm"))]
#[doc(hidden)]
#[macro_export]
macro_rules! devices {
    ($with:ident) => {
        $with! {
            ($)
            /// The three axes of a PHANToM.
            Phantom: phantom, PhantomScene, PhantomSimulation;
            /// A segment on a gimbal, raised by a crank.
            Gimbal: gimbal, GimbalScene, GimbalSimulation;
            /// A plant as a transfer function.
            Transfer: transfer, TransferScene, TransferSimulation;
        }
    };
}

/// The list of a page, which loads all code, so it has no transfer functions.
#[cfg(target_family = "wasm")]
#[doc(hidden)]
#[macro_export]
macro_rules! devices {
    ($with:ident) => {
        $with! {
            ($)
            /// The three axes of a PHANToM.
            Phantom: phantom, PhantomScene, PhantomSimulation;
            /// A segment on a gimbal, raised by a crank.
            Gimbal: gimbal, GimbalScene, GimbalSimulation;
        }
    };
}

keys! { device: "device" of [];
    /// Kind of the device: a motor with a wheel, a mass on a rail, bodies on joints, a motor with
    /// three phases, the arm of a PHANToM, a segment on
    /// a gimbal, or a plant as a transfer function.
    kind: Choice<DeviceKind> = Choice::new(|| DeviceKind::ALL.to_vec(), Required);
}

macro_rules! listed {
    (($d:tt) $(#[doc = $meaning:literal] $Device:ident: $module:ident, $Scene:ident, $Simulation:ident;)*) => {
        /// The kind of a scene's device, by `device.kind`.
        #[derive(Clone, Copy, PartialEq)]
        pub(crate) enum DeviceKind {
            Motor,
            Mass,
            Network,
            Pmsm,
            $($Device,)*
        }

        impl DeviceKind {
            /// Every kind with its name.
            const ALL: &[(&str, Self)] =
                &[
                ("motor", Self::Motor), ("mass", Self::Mass), ("network", Self::Network),
                ("pmsm", Self::Pmsm),
                $((stringify!($module), Self::$Device)),*
            ];
        }

        /// Every kind of scene with every kind of device that it can have, as rows of keys call them.
        pub const KINDS: &[(&str, &str)] = &[
            ("axis", "motor"),
            ("axis", "mass"),
            ("axis", "network"),
            ("foc", "pmsm"),
            ("dut", "motor"),
            ("dut", "mass"),
            ("dut", "network"),
            ("dut", "pmsm"),
            ("epfl_paddle", "network"),
            $((stringify!($module), stringify!($module))),*
        ];

        /// The keys of each device beside an axis, with its kind of scene.
        pub(crate) static KEYS: &[(&str, DeviceKeys)] = &[$((stringify!($module), crate::$module::rows::KEYS)),*];

        /// The scenes to begin with, of each device that has one for all its scenes, with its `device.kind`.
        pub static BEGINNINGS: &[(&str, Begin)] = &[
            #[cfg(not(target_family = "wasm"))]
            ("pmsm", crate::foc::shipped::BEGIN),
            $((stringify!($module), crate::$module::shipped::BEGIN)),*
        ];

        const SHIPPED: &[&[Shipped]] = &[AXIS, $(super::$module::shipped::SCENES),*];
    };
}
devices!(listed);

impl DeviceKind {
    /// Returns its name in `device.kind`.
    pub(crate) fn name(self) -> &'static str {
        Self::ALL.iter().find(|(_, kind)| *kind == self).map_or("", |(name, _)| name)
    }
}

/// Returns the shipped scenes.
pub fn shipped() -> &'static [Shipped] {
    static ALL: [Shipped; length(SHIPPED)] = joined(SHIPPED);
    &ALL
}
