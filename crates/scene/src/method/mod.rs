//! The methods of an axis: the list, and a file for each.
//!
//! A *loop* (hybrid, conventional) is a wiring of its own. A *law* is a published method: a block that
//! [`MethodLoop`](hpu_datapath::MethodLoop) wires between encoder and bridge. The file of a law has its keys, its
//! words, its layers of the map of all methods, and its reference law in floats. The readers, the accepted keys, `hpu
//! keys`, the tables of keys, the JSON Schema, `hpu map --all-methods` and the loops of the simulations are functions
//! of the list.
//!
//! # A new law
//!
//! It has two files of its own: its block in `datapath`, which implements `Listed` and `InLoops` there, and its file
//! here, which implements `Published`. The compiler asks for the lines that name it elsewhere:
//!
//! 1. `datapath/src/lib.rs`: the module, and a line in `laws!`.
//! 2. `scene/src/method/mod.rs`: the module, and a line in `laws!`; in `axis_loop.rs`, the use of its law in floats.
//! 3. `prove/src/linear`: its linear controller, or the reason why it has none.
//! 4. `prove/src/ranges/laws.rs`: the words that its invariant allows.
//!
//! Tests ask for the rest: VHDL, a scene, vectors and a row in the documentation of
//! [`law`](crate::law) (`scene/tests/all/methods.rs`), the least scene that accepts its keys
//! (`scene/tests/all/keys.rs`), and the error of its words against its law in floats (`cosim/tests/all/law_words`).

/// Calls a macro with the list of laws: of each its `method.kind`, which is the name of its file, its block, its
/// parameters, and its reference law in floats. A condition says where its loop is compiled: a page in a browser, which
/// has to be loaded, leaves loops out that have nothing to do with a wall.
macro_rules! laws {
    ($with:ident) => {
        $with! {
            ($)
            sampled_wall: SampledWall, SampledWallMethod, Wall;
            virtual_coupling: VirtualCoupling, CouplingMethod, VirtualCoupling;
            passivity_controller: PassivityController, PassivityMethod, PassivityController;
            energy_bounding: EnergyBounding, BoundingMethod, EnergyBounding;
            passive_spring: PassiveSpring, SpringMethod, PassiveSpring;
            braking_pulse: BrakingPulse, PulseMethod, BrakingPulse;
            table: TorqueTable, TableMethod, TableLaw;
            #[cfg(not(target_family = "wasm"))]
            pid: PositionPid, PidMethod, PidLaw;
        }
    };
}

pub mod braking_pulse;
pub mod energy_bounding;
pub mod passive_spring;
pub mod passivity_controller;
pub mod pid;
pub mod sampled_wall;
pub mod shaper;
pub mod table;
pub mod virtual_coupling;
pub mod wall;

#[macro_use]
mod axis_loop;
pub(crate) mod published;
pub(crate) mod rows;
mod sampled_law;
mod setting;

pub use axis_loop::{AnyLaw, AxisLoop};
use published::Published;
pub use published::{Features, Layer, PASSIVE};
pub use sampled_law::SampledLaw;
pub(crate) use setting::gain;
pub use setting::{Setting, Unmade};

use crate::schema::Group;
use crate::schema::section::Section;
use crate::schema::source::SceneError;

/// The wiring that closes the loop.
#[derive(Clone, Copy, PartialEq, Debug)]
#[allow(clippy::large_enum_variant, reason = "one of them exists a scene")]
pub enum Loop {
    /// Spring path combinational, damping sampled.
    Hybrid,
    /// Both sampled and held.
    Conventional,
    /// A sampled and held law.
    Law(LawMethod),
}

/// The method that is a scene of its own, in `method.kind`: the loop of EPFL's haptic paddle.
pub const PADDLE: &str = "epfl_paddle";

/// The method of a motor with three phases, in `method.kind`: field-oriented control.
pub const FOC: &str = "foc";

/// Returns whether a scene's method is that of the paddle.
pub(crate) fn is_paddle(root: &Section) -> bool {
    root.section("method").is_ok_and(|s| s.get("kind").and_then(|kind| kind.as_str()) == Some(PADDLE))
}

/// The names of the loops in `method.kind`.
pub(crate) const LOOPS: [&str; 2] = ["hybrid", "conventional"];

macro_rules! methods {
    (($d:tt) $($(#[$on:meta])? $kind:ident: $Law:ident, $Method:ident, $float:ident;)*) => {
        $(pub use $kind::$Method;)*

        /// A law, with its parameters beyond the wall's, in SI units.
        #[derive(Clone, Copy, PartialEq, Debug)]
        #[allow(clippy::large_enum_variant, reason = "one of them exists a scene")]
        pub enum LawMethod {
            $(#[doc = concat!("The parameters of `", stringify!($kind), "`.")] $Law($Method),)*
        }

        /// Evaluates an expression with the parameters of a law bound to a name, whatever its type.
        macro_rules! with_parameters {
            ($d law:expr, $d method:ident => $d call:expr) => {
                match $d law { $(LawMethod::$Law($d method) => $d call,)* }
            };
        }

        /// The names of all methods in `method.kind`: the loops, then the laws.
        pub(crate) const METHODS: &[&str] = &[LOOPS[0], LOOPS[1], $(stringify!($kind)),*];

        /// The keys of the laws, in the order of the list.
        pub(crate) static KEYS: &[&Group] = &[$(<$Method>::KEYS),*];

        /// Of each method its name, and whether it has a scale.
        const SCALES: &[(&str, bool)] =
            &[(LOOPS[0], true), (LOOPS[1], true), $((stringify!($kind), <$Method>::SCALE_KEY.is_some())),*];

        /// Returns the layers of all laws in the map of all methods: of each the name in `method.kind` and the layer.
        pub fn layers() -> impl Iterator<Item = (&'static str, &'static Layer)> {
            let of_a_law: &[(&'static str, &'static [Layer])] = &[$((stringify!($kind), <$Method>::LAYERS)),*];
            of_a_law.iter().flat_map(|(kind, layers)| layers.iter().map(|layer| (*kind, layer)))
        }

        impl LawMethod {
            /// Returns its name in `method.kind`.
            pub fn name(&self) -> &'static str {
                match self { $(Self::$Law(_) => stringify!($kind),)* }
            }

            /// Reads the keys of a law; returns `None` if `kind` is not a law.
            pub(crate) fn read(s: &Section, kind: &str) -> Result<Option<Self>, SceneError> {
                Ok(match kind { $(stringify!($kind) => Some(Self::$Law(<$Method>::read(s)?)),)* _ => None })
            }

            fn scale_key(&self) -> Option<&'static str> {
                match self { $(Self::$Law(_) => <$Method>::SCALE_KEY,)* }
            }

            /// Returns its reference law in floats.
            fn float(&self, setting: &Setting) -> Result<AnyLaw, SceneError> {
                Ok(match self { $(Self::$Law(method) => AnyLaw::$Law(method.float(setting)?),)* })
            }
        }
    };
}
laws!(methods);

/// The name of the method that follows a target; all others render a wall.
pub const FOLLOWS: [&str; 1] = ["pid"];

/// The names of the methods that render a wall.
pub(crate) const WALLED: &[&str] = {
    let (walled, follows) = METHODS.split_at(METHODS.len() - FOLLOWS.len());
    assert!(follows[0].len() == FOLLOWS[0].len(), "it is the last of the list");
    walled
};

/// The names of the laws in `method.kind`.
pub(crate) const LAWS: &[&str] = METHODS.split_at(LOOPS.len()).1;

const fn scaled<const N: usize>() -> (usize, [&'static str; N]) {
    let (mut kinds, mut found, mut at) = ([""; N], 0, 0);
    while at < SCALES.len() {
        let (kind, has_scale) = SCALES[at];
        if has_scale && found < N {
            kinds[found] = kind;
        }
        found += has_scale as usize;
        at += 1;
    }
    (found, kinds)
}

/// The methods that have a scale: the loops that of a rescaled velocity, some laws that of the force.
pub(crate) const SCALED: [&str; scaled::<0>().0] = scaled().1;

impl LawMethod {
    /// Returns the quantities in newton metres, or newtons, that are its own.
    pub(crate) fn efforts(&mut self) -> Vec<&mut f64> {
        with_parameters!(self, method => method.efforts())
    }
}

impl Loop {
    /// Returns its name in `method.kind`.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Hybrid => LOOPS[0],
            Self::Conventional => LOOPS[1],
            Self::Law(law) => law.name(),
        }
    }

    /// Returns the features that distinguish it from a plain sampled wall.
    pub fn features(&self) -> Features {
        match self {
            Self::Hybrid => Features { live: true, ..Features::default() },
            Self::Conventional => Features::default(),
            Self::Law(law) => with_parameters!(law, method => method.features()),
        }
    }

    /// Returns those of its own keys, as `method.key`, that have no meaning with its other values.
    pub(crate) fn unused(&self) -> Vec<&'static str> {
        match self {
            Self::Hybrid | Self::Conventional => Vec::new(),
            Self::Law(law) => with_parameters!(law, method => method.unused()),
        }
    }

    /// Returns whether the spring reads the position at once.
    pub fn is_live(&self) -> bool {
        self.features().live
    }

    /// Returns the scale of its force, if it has one: the key and the value.
    pub fn scale(&self) -> Option<(&'static str, f64)> {
        match self {
            Self::Law(law) => law.scale_key().map(|key| (key, self.features().scale)),
            Self::Hybrid | Self::Conventional => None,
        }
    }

    /// Returns its reference law in floats.
    pub fn float(&self, setting: &Setting) -> Result<AnyLaw, SceneError> {
        let law = match self {
            Self::Hybrid | Self::Conventional => AnyLaw::Wall(setting.wall(1)),
            Self::Law(law) => law.float(setting)?,
        };
        Ok(match setting.shaper_hz {
            Some(cutoff_hz) => AnyLaw::Shaped(Box::new(shaper::InputShaper::new(law, cutoff_hz, setting.period_s))),
            None => law,
        })
    }
}
