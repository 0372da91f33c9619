//! The scenes that come with the program, by name.

use std::io;

/// A shipped scene.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Shipped {
    /// Its name, which is also the name of its file in `testbench/scenes`.
    pub name: &'static str,
    /// Its text.
    pub text: &'static str,
}

/// The scene to begin with of a device, for `hpu new`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Begin {
    /// The device in a few words.
    pub device: &'static str,
    /// Its keys beside `about` and the clock, and their values.
    pub keys: &'static [(&'static str, &'static str)],
}

macro_rules! text {
    ($file:expr) => {
        include_str!(concat!("../../../../testbench/scenes/", $file))
    };
}

macro_rules! scenes {
    ($($name:literal),* $(,)?) => {
        &[$($crate::scene::Shipped {
            name: $name,
            text: include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../../testbench/scenes/", $name, ".toml")),
        }),*]
    };
}
pub(super) use scenes;

/// The scenes of an axis.
pub(super) const AXIS: &[Shipped] = scenes![
    "hybrid-wall",
    "hybrid-wall-25mhz",
    "slow-pwm",
    "slow-winding",
    "slow-friction",
    "short-contact",
    "ringing-wall",
    "friction-wall",
    "thrown-hybrid",
    "thrown-conventional",
    "conventional-wall-100hz",
    "conventional-wall-1khz",
    "conventional-wall-10khz",
    "bounded-wall",
    "coupled-wall",
    "observed-wall",
    "dual-rate-wall",
    "levant-wall",
    "levant-chatter",
    "braking-pulse",
    "energy-level-wall",
    "shaped-wall",
    "stiff-hybrid",
    "stiff-conventional-1khz",
    "wrap-product",
    "wrap-saturated",
    "free-motion",
    "prescribed-sweep",
    "replay-capture",
    "replay-motion",
    "qube-arm",
    "rail-drop",
    "impulse-engine",
    "impulse-engine-shaped",
    "bounded-impulse-engine",
    "bounded-wall-1khz",
    "capped-coupling",
    "capped-stiffness",
    "count-cycle",
    "coupled-wall-1khz",
    "dead-spring",
    "dual-rate-velocity",
    "fast-velocity",
    "floating-motor",
    "leak-bounce",
    "negative-damping",
    "one-tick",
    "popc-credit",
    "popc-credit-bounded",
    "popc-held-force",
    "popc-standstill",
    "popc-velocity",
    "power-scaling",
    "scaled-wall",
    "shaped-push",
    "stiffening-wall",
    "weak-wall",
];

static FILES: &[(&str, &str)] = &[
    ("replay-capture.vcd", text!("replay-capture.vcd")),
    ("replay-motion.csv", text!("replay-motion.csv")),
    ("../recordings/qube/arm-start.csv", text!("../recordings/qube/arm-start.csv")),
    ("../recordings/qube/arm-stop.csv", text!("../recordings/qube/arm-stop.csv")),
];

/// Returns a data file that a shipped scene names.
///
/// # Errors
///
/// [`io::ErrorKind::NotFound`] for any other name.
pub fn shipped_file(name: &str) -> io::Result<Vec<u8>> {
    let file = FILES.iter().find(|(file, _)| *file == name);
    file.map(|(_, text)| text.as_bytes().to_vec()).ok_or_else(|| io::Error::from(io::ErrorKind::NotFound))
}
