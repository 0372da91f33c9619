//! An experiment: a scene of any kind. This room has the lists: of devices, of all keys, of all shipped scenes.

pub(crate) mod audit;
#[macro_use]
pub(crate) mod devices;
pub(crate) mod groups;
pub(crate) mod resolved;
pub(crate) mod shipped;

use std::ops::Deref;

use crate::axis::read_device::Kind;
use crate::axis::read_hand::Load;
use crate::axis::{self, Scene};
use crate::dut::{self, DutScene};
use crate::foc::FocScene;
use crate::gimbal::{self, GimbalScene};
use crate::head::Head;
use crate::head::setup::Setup;
use crate::head::shipped::Shipped;
use crate::method::is_paddle;
use crate::paddle::PaddleScene;
use crate::phantom::{self, PhantomScene};
use crate::schema::section::Section;
use crate::schema::source::{SceneError, Source};
#[cfg(not(target_family = "wasm"))]
use crate::transfer::{self, TransferScene};
use devices::{DeviceKind, device};
use groups::schema;
use shipped::shipped_file;

/// The reason why a three-phase motor without method and design is refused.
const NO_LOOP: &str = "missing; write a [method] of kind \"foc\", or a [dut] of yours";

macro_rules! experiment {
    (($d:tt) $(#[doc = $meaning:literal] $Device:ident: $module:ident, $Scene:ident, $Simulation:ident;)*) => {
        /// Any experiment.
        #[derive(Clone, PartialEq, Debug)]
        #[allow(clippy::large_enum_variant, reason = "one of them exists a run")]
        pub enum Experiment {
            /// One axis: a motor with a wheel, and a wall.
            Axis(Scene),
            $(#[doc = $meaning] $Device($Scene),)*
            /// Bodies and joints whose loop is that of EPFL's haptic paddle.
            Paddle(PaddleScene),
            /// A motor with three phases behind field-oriented control.
            Foc(FocScene),
            /// One axis whose loop is closed by a design of the user's own.
            Dut(DutScene),
        }

        impl Experiment {
            fn of(name: &str, source: &Source, load: Load) -> Result<Self, SceneError> {
                let kind = match Section::root(source).section("device")?.read(&device::kind)? {
                    $(DeviceKind::$Device => return $module::scene(name, source).map(Self::$Device),)*
                    DeviceKind::Motor => Kind::Motor,
                    DeviceKind::Mass => Kind::Mass,
                    DeviceKind::Network => Kind::Network,
                    DeviceKind::Pmsm => Kind::Pmsm,
                };
                if Section::root(source).has("dut") {
                    // A page loads all code, so it does not read what it cannot run.
                    if cfg!(target_family = "wasm") {
                        let reason = "a design of your own needs its simulator, which a page has not";
                        return Err(Section::root(source).error("dut", reason));
                    }
                    return dut::read::scene(name, source, kind, load).map(Self::Dut);
                }
                match kind {
                    Kind::Pmsm if !Section::root(source).has("method") => {
                        Err(Section::root(source).error("method", NO_LOOP))
                    }
                    Kind::Pmsm => {
                        // A page loads all code, so it has not this loop.
                        if cfg!(target_family = "wasm") {
                            let reason = "a page in a browser has no motor with three phases; use hpu itself";
                            return Err(Section::root(source).error("device.kind", reason));
                        }
                        crate::foc::read::scene(name, source, load).map(Self::Foc)
                    }
                    Kind::Network if is_paddle(&Section::root(source)) => {
                        // A page loads all code, so it has not this loop.
                        if cfg!(target_family = "wasm") {
                            let reason = "a page in a browser has not the loop of the paddle; use hpu itself";
                            return Err(Section::root(source).error("method.kind", reason));
                        }
                        crate::paddle::read::scene(name, source, load).map(Self::Paddle)
                    }
                    _ => axis::read::scene(name, source, kind, load).map(Self::Axis),
                }
            }

            /// Returns the scene as one of any kind.
            pub fn setup(&self) -> &dyn Setup {
                match self {
                    Self::Axis(scene) => scene,
                    $(Self::$Device(scene) => scene,)*
                    Self::Paddle(scene) => scene,
                    Self::Foc(scene) => scene,
                    Self::Dut(scene) => scene,
                }
            }
        }

        impl Deref for Experiment {
            type Target = Head;
            fn deref(&self) -> &Head {
                match self {
                    Self::Axis(scene) => &scene.head,
                    $(Self::$Device(scene) => &scene.head,)*
                    Self::Paddle(scene) => &scene.head,
                    Self::Foc(scene) => &scene.head,
                    Self::Dut(scene) => &scene.head,
                }
            }
        }
    };
}
devices!(experiment);

impl Experiment {
    /// Parses and validates a scene of any kind.
    ///
    /// `name` is the file's name in error messages. `overrides` are keys and values that replace the file's, in order,
    /// as in `("wall.stiffness", "2 N.m/rad")`. A value that is not TOML is a string; missing sections are created; an
    /// inline table replaces a whole section (`("hand", "{ kind = \"none\" }")`). `load` reads a file that the scene
    /// names.
    ///
    /// # Errors
    ///
    /// [`SceneError`] with file, line, column, key, and what is accepted instead.
    pub fn parse(name: &str, text: &str, overrides: &[(String, String)], load: Load) -> Result<Self, SceneError> {
        let source = Source::parse(name, text, overrides, schema())?;
        Self::of(name, &source, load).map_err(|first| audit::with_others(&source, first))
    }

    /// Parses and validates a scene for its plant, which somebody else's logic drives: as [`parse`](Self::parse), but
    /// the scene of a motor may have neither a `[method]` nor a `[dut]`. The plant alone is then returned as a
    /// [`Dut`](Self::Dut) whose design has no files and the [pins](crate::Dut::pins) of a motor.
    ///
    /// # Errors
    ///
    /// [`SceneError`] with file, line, column, key, and what is accepted instead; of a plant alone the first
    /// error, with the keys that are unknown.
    pub fn plant(name: &str, text: &str, overrides: &[(String, String)], load: Load) -> Result<Self, SceneError> {
        let source = Source::parse(name, text, overrides, schema())?;
        let root = Section::root(&source);
        let is_motor = root.section("device").and_then(|device| device.read(&device::kind));
        if is_motor.is_ok_and(|kind| kind == DeviceKind::Motor) && !root.has("method") && !root.has("dut") {
            let read = dut::read::scene(name, &source, Kind::Motor, load).map(Self::Dut);
            return read.map_err(|first| audit::with_others_of_plant(&source, first));
        }
        Self::parse(name, text, overrides, load)
    }

    /// Returns the scene if it is one of an axis.
    pub fn axis(self) -> Option<Scene> {
        if let Self::Axis(scene) = self { Some(scene) } else { None }
    }

    /// Returns the scene if it is one of a PHANToM.
    pub fn phantom(self) -> Option<PhantomScene> {
        if let Self::Phantom(scene) = self { Some(scene) } else { None }
    }
}

impl Scene {
    /// Parses and validates a scene of an axis, as [`Experiment::parse`] does.
    ///
    /// # Errors
    ///
    /// [`SceneError`] with file, line, column, key, and what is accepted instead.
    pub fn parse(name: &str, text: &str, overrides: &[(String, String)], load: Load) -> Result<Self, SceneError> {
        let source = Source::parse(name, text, overrides, schema())?;
        let mut read = || {
            let device = Section::root(&source).section("device")?;
            let kind = match device.read(&device::kind)? {
                DeviceKind::Motor => Kind::Motor,
                DeviceKind::Mass => Kind::Mass,
                DeviceKind::Network => Kind::Network,
                other => {
                    let reason = format!(
                        "\"{}\" is a scene of its own; an axis is a \"motor\", a \"mass\" or a \"network\"",
                        other.name()
                    );
                    return Err(device.error("kind", reason));
                }
            };
            axis::read::scene(name, &source, kind, load)
        };
        read().map_err(|first| audit::with_others(&source, first))
    }
}

impl Shipped {
    /// Parses the scene, with its own data files, under the overrides.
    ///
    /// # Errors
    ///
    /// [`SceneError`] when an override is refused, or names a file that is not shipped.
    pub fn parse(&self, overrides: &[(String, String)]) -> Result<Experiment, SceneError> {
        Experiment::parse(&format!("testbench/scenes/{}.toml", self.name), self.text, overrides, &mut shipped_file)
    }
}
