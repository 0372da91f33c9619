//! A scene that comes with the program.

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

macro_rules! scenes {
    ($($name:literal),* $(,)?) => {
        &[$($crate::Shipped {
            name: $name,
            text: const { hpu_assets::text(concat!("testbench/scenes/", $name, ".toml")) },
        }),*]
    };
}
pub(crate) use scenes;
