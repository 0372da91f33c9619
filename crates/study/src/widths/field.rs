//! The widths of a scene's words; integer bits and fraction bits are separate. Each device lists its own.

use std::fmt;

use crate::Error;
use hpu_cosim::scene::Experiment;
use hpu_signal::Format;

/// A width of a scene's datapath. Each device defines its own as constants of this type (`fields!`).
#[derive(Clone, Copy)]
pub struct Field {
    /// Its name, unique in its device: the scene's key where there is one.
    pub name: &'static str,
    /// The nets whose range tells how many bits of the width are idle: without these bits no word changes.
    pub nets: &'static [&'static str],
    /// The net that stands for the width on a page; a review shows the field at it.
    pub shown_at: &'static str,
    pub(crate) get: fn(&Experiment) -> i32,
    pub(crate) set: fn(&mut Experiment, i32) -> Result<(), Error>,
}

impl Field {
    /// Returns the bits of this width in a scene; 0 for the scene of another device.
    pub fn bits(self, experiment: &Experiment) -> i32 {
        (self.get)(experiment)
    }

    /// Returns the scene with another number of bits.
    ///
    /// # Errors
    ///
    /// When no word has that many.
    pub fn with(self, experiment: &Experiment, bits: i32) -> Result<Experiment, Error> {
        let mut other = experiment.clone();
        (self.set)(&mut other, bits)?;
        Ok(other)
    }
}

impl PartialEq for Field {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl Eq for Field {}

impl fmt::Debug for Field {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(self.name)
    }
}

/// The bits of a word that has at least two.
pub(crate) mod width {
    use super::Error;

    pub fn get(word: &u32) -> i32 {
        word.cast_signed()
    }

    pub fn set(word: &mut u32, bits: i32) -> Result<(), Error> {
        let width = u32::try_from(bits).ok().filter(|bits| *bits >= 2);
        *word = width.ok_or(format!("{bits} bits are no word"))?;
        Ok(())
    }
}

/// The integer bits of a format.
pub(crate) mod int {
    use super::{Error, Format, changed};

    pub fn get(format: &Format) -> i32 {
        format.int()
    }

    pub fn set(format: &mut Format, bits: i32) -> Result<(), Error> {
        changed(format, (bits, format.frac()))
    }
}

/// The fraction bits of a format.
pub(crate) mod frac {
    use super::{Error, Format, changed};

    pub fn get(format: &Format) -> i32 {
        format.frac()
    }

    pub fn set(format: &mut Format, bits: i32) -> Result<(), Error> {
        changed(format, (format.int(), bits))
    }
}

fn changed(format: &mut Format, (int, frac): (i32, i32)) -> Result<(), Error> {
    *format = Format::new(format.is_signed(), int, frac)?;
    Ok(())
}

/// Defines the widths of a device. Before them stand the functions that return the device's scene. Each width has a
/// name, nets, the net of the page, the part of the scene's words, and its place in the scene. A function behind `then`
/// gets the scene, the old and the new bits, and changes what depends on them.
macro_rules! fields {
    ($scene:ident, $scene_mut:ident: $($(#[$doc:meta])* $NAME:ident = $name:literal, $nets:expr, $at:literal,
        $part:ident $($path:ident).+ $(then $then:expr)?;)*) => {
        impl $crate::widths::Field {
            $($(#[$doc])* pub const $NAME: Self = Self {
                name: $name,
                nets: &$nets,
                shown_at: $at,
                get: |experiment| $scene(experiment).map_or(0, |scene| $part::get(&scene.$($path).+)),
                set: |experiment, bits| {
                    let scene = $scene_mut(experiment)?;
                    let _old = $part::get(&scene.$($path).+);
                    $part::set(&mut scene.$($path).+, bits)?;
                    $($then(scene, _old, bits)?;)?
                    Ok(())
                },
            };)*
        }
    };
}
pub(crate) use fields;
