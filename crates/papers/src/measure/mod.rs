//! The measures of a study: each takes a scene under overrides and gives named values.

mod drops;
pub mod filter;
mod limits;
mod motion;
mod paddle;
mod segment;
mod velocity;

use std::collections::BTreeMap;

use hpu_cosim::Control;
use hpu_cosim::scene::{Experiment, Scene};

use crate::Error;
use crate::template::{Value, Values};
use hpu_prove::criteria;

pub use motion::{slope, told};
pub use velocity::Velocities;

/// A kind of measure.
#[derive(Clone, Copy)]
pub struct Measure {
    /// Its name in a study's file.
    pub name: &'static str,
    /// The things that it measures, and those that its keys ask for.
    pub about: &'static str,
    /// Whether it takes a scene and overrides.
    pub is_of_scene: bool,
    /// The keys that it takes besides.
    pub keys: &'static [Key],
    /// The names of the values that it gives.
    pub gives: &'static [&'static str],
    run: fn(&Asked, &Control) -> Result<Values, Error>,
}

/// A key of a measure.
#[derive(Clone, Copy)]
pub struct Key {
    /// Its name.
    pub name: &'static str,
    /// The kind of value that it takes.
    pub takes: Takes,
    /// Whether the measure needs it.
    pub is_required: bool,
}

/// The kind of value that a key of a measure takes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Takes {
    /// A number, or a formula in quotes.
    Number,
    /// A text.
    Text,
    /// `true` or `false`.
    Flag,
    /// A list of numbers or of formulas.
    Numbers,
    /// Overrides of the scene, as `--set` takes them.
    Set,
    /// A table of windows, each a list of two times in s.
    Windows,
}

impl Takes {
    /// Returns the text of a refusal.
    pub const fn accepted(self) -> &'static str {
        match self {
            Self::Number => "write a number, or a formula in quotes, as in \"2*pi/10\"",
            Self::Text => "write a text in quotes",
            Self::Flag => "write true or false",
            Self::Numbers => "write a list of numbers, as in [0.5, \"2*pi\"]",
            Self::Set => "write a list of overrides, as in ['wall.stiffness=1.5']",
            Self::Windows => "write a table of windows in s, as in { before = [0, 1], after = [9, 10] }",
        }
    }
}

/// The value of a measure's key.
#[derive(Clone, PartialEq, Debug)]
pub enum Taken {
    /// A number.
    Number(f64),
    /// A text.
    Text(String),
    /// A flag.
    Flag(bool),
    /// A list of numbers.
    Numbers(Vec<f64>),
    /// Overrides of the scene.
    Set(Vec<(String, String)>),
    /// Windows by name, from one time to another, in s.
    Windows(Vec<(String, [f64; 2])>),
}

/// The longest that a measure makes a run, in durations of the scene, so that it tells whether the motion comes to
/// rest.
const LONGEST: f64 = 10.0;

/// Returns a scene, shipped or of the user's own, under overrides.
pub type Load = dyn Fn(&str, &[(String, String)]) -> Result<Experiment, Error> + Send + Sync;

/// A measure that a study asks for.
pub struct Asked<'a> {
    /// Name of the scene.
    pub scene: &'a str,
    /// Overrides of the scene.
    pub set: &'a [(String, String)],
    /// The values of the measure's own keys.
    pub options: &'a BTreeMap<&'static str, Taken>,
    /// Makes the scene.
    pub load: &'a Load,
}

impl Asked<'_> {
    /// Returns the scene under its overrides and further ones.
    fn experiment(&self, more: &[(String, String)]) -> Result<Experiment, Error> {
        (self.load)(self.scene, &[self.set, more].concat())
    }

    /// Returns the scene, which must be of an axis.
    fn axis(&self) -> Result<Scene, Error> {
        self.experiment(&[])?.axis().ok_or_else(|| Error::new(format_args!("{} is no scene of an axis", self.scene)))
    }

    fn number(&self, key: &str) -> Option<f64> {
        match self.options.get(key) {
            Some(Taken::Number(number)) => Some(*number),
            _ => None,
        }
    }

    fn text(&self, key: &str) -> &str {
        match self.options.get(key) {
            Some(Taken::Text(text)) => text,
            _ => "",
        }
    }

    fn numbers(&self, key: &str) -> &[f64] {
        match self.options.get(key) {
            Some(Taken::Numbers(numbers)) => numbers,
            _ => &[],
        }
    }
}

const fn key(name: &'static str, takes: Takes) -> Key {
    Key { name, takes, is_required: true }
}

const fn option(name: &'static str, takes: Takes) -> Key {
    Key { name, takes, is_required: false }
}

/// Returns the measures.
pub fn measures() -> impl Iterator<Item = &'static Measure> {
    [MEASURES, segment::MEASURES, FILTERED].into_iter().flatten()
}

static MEASURES: &[Measure] = &[
    Measure {
        name: "run",
        about: "One run: its verdict, its energies, how it moved. `swing` asks for half of the range of \
                positions in windows, `press` for the stiffness felt in one, `after` for when the device first \
                leaves the wall after that time.",
        is_of_scene: true,
        keys: &[option("swing", Takes::Windows), option("press", Takes::Numbers), option("after", Takes::Number)],
        gives: motion::RUN_GIVES,
        run: motion::run,
    },
    Measure {
        name: "apart",
        about: "The greatest distance between the motions of two runs: until one of them leaves the wall, and to \
                the end.",
        is_of_scene: true,
        keys: &[key("other", Takes::Set), key("after", Takes::Number)],
        gives: &["until", "to_the_end", "leaves"],
        run: motion::apart,
    },
    Measure {
        name: "paddle",
        about: "One run of the paddle's loop: the angle that it reads, in degrees, and the encoder beside the log that \
                `expect.recording` names.",
        is_of_scene: true,
        keys: &[],
        gives: paddle::GIVES,
        run: paddle::paddle,
    },
    Measure {
        name: "ladder",
        about: "One run for each value of a key, the least first: up to where the motion settles. Runs that are too \
                short to tell are made longer as those of `stable`.",
        is_of_scene: true,
        keys: &[key("key", Takes::Text), key("values", Takes::Numbers), key("unit", Takes::Text)],
        gives: &["text", "below", "at", "frequency"],
        run: motion::ladder,
    },
    Measure {
        name: "scene",
        about: "The numbers that the scene's words and its device have, without a run.",
        is_of_scene: true,
        keys: &[],
        gives: limits::SCENE_GIVES,
        run: limits::scene,
    },
    Measure {
        name: "linear",
        about: "The stiffness up to which the linear loop with an ideal drive settles; with `every`, of the \
                loop whose velocity is that much slower.",
        is_of_scene: true,
        keys: &[option("every", Takes::Number)],
        gives: &["limit"],
        run: limits::linear,
    },
    Measure {
        name: "criterion",
        about: "The limit by one criterion.",
        is_of_scene: true,
        keys: &[key("name", Takes::Text)],
        gives: &["limit"],
        run: limits::criterion,
    },
    Measure {
        name: "limits",
        about: "The limits by all criteria beside the scene in words, as texts; with `words`, as `hpu limits --words`.",
        is_of_scene: true,
        keys: &[option("words", Takes::Number)],
        gives: &criteria_and_words(),
        run: limits::limits,
    },
    Measure {
        name: "stable",
        about: "The stable stiffness of the scene in words, over eight phases of its contact, by a brief search; with \
                `words`, at the stiffnesses that `hpu limits --words` runs. With `felt`, the stiffness that is felt of \
                the stiffest wall up to which all settle. Runs that are too short to tell are made up to ten times as \
                long; where they still do not tell, no figure is given.",
        is_of_scene: true,
        keys: &[option("words", Takes::Number), option("felt", Takes::Flag)],
        gives: &["all", "some", "failed", "settled", "runs", "felt"],
        run: limits::stable,
    },
    Measure {
        name: "least_damping",
        about: "The least virtual damping with which the wall settles, by the linear loop with an ideal drive or by \
                runs in words, which are made longer as those of `stable`.",
        is_of_scene: true,
        keys: &[key("by", Takes::Text)],
        gives: &["text", "fails", "holds"],
        run: limits::least_damping,
    },
    Measure {
        name: "velocity",
        about: "The error of the velocity that a `sampled_wall` estimates against the speed of the device: rms, \
                greatest, rms where the speed is at most `rest`; the lag at which its rms is least, this rms, and the \
                greatest speed. The speed is its mean over the time `over` around each row, which smooths the corners \
                of a recorded motion. `shown` is the time that a picture shows.",
        is_of_scene: true,
        keys: &[key("rest", Takes::Number), option("over", Takes::Number), option("shown", Takes::Numbers)],
        gives: velocity::GIVES,
        run: velocity::velocity,
    },
    Measure {
        name: "fitting",
        about: "Drops of a PHANToM onto three `walls`, the softest first: the values of a key with which the first is \
                passive in all `trials` along all `axes` and the second is not (`narrow`), or the third is not \
                (`wide`).",
        is_of_scene: true,
        keys: &[
            key("key", Takes::Text),
            key("values", Takes::Numbers),
            key("unit", Takes::Text),
            key("axes", Takes::Text),
            key("walls", Takes::Numbers),
            key("trials", Takes::Number),
        ],
        gives: &["narrow", "wide"],
        run: drops::fitting,
    },
];

static FILTERED: &[Measure] = &[
    Measure {
        name: "shaper_gain",
        about: "The gain of an input shaper without its rectifiers at a frequency.",
        is_of_scene: false,
        keys: &[key("frequency", Takes::Number)],
        gives: &["exact", "analog", "bilinear", "words"],
        run: filter::gains,
    },
    Measure {
        name: "shaper_step",
        about: "The greatest value of such a shaper's answer to a step.",
        is_of_scene: false,
        keys: &[],
        gives: &["exact", "analog", "words"],
        run: filter::step,
    },
];

/// Returns the names of the criteria, and `words`.
const fn criteria_and_words() -> [&'static str; criteria::NAMES.len() + 1] {
    let mut names = ["words"; criteria::NAMES.len() + 1];
    let mut at = 0;
    while at < criteria::NAMES.len() {
        names[at] = criteria::NAMES[at];
        at += 1;
    }
    names
}

impl Measure {
    /// Returns the values; those of a measure that failed are missing, with its reason.
    pub fn values(&self, asked: &Asked, control: &Control) -> Values {
        (self.run)(asked, control).unwrap_or_else(|reason| {
            let windows = match asked.options.get("swing") {
                Some(Taken::Windows(windows)) => windows.as_slice(),
                _ => &[],
            };
            let names = self.gives.iter().copied().chain(windows.iter().map(|(name, _)| name.as_str()));
            names.map(|name| (name.to_string(), Err(reason.clone()))).collect()
        })
    }
}

fn numbers<const N: usize>(values: [(&str, f64); N]) -> Values {
    values.into_iter().map(|(name, value)| (name.to_string(), Ok(Value::Number(value)))).collect()
}

fn text(name: &str, text: String) -> (String, Result<Value, Error>) {
    (name.to_string(), Ok(Value::Text(text)))
}
