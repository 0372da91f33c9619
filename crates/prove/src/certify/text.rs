//! Certificates as text.

use hpu_cosim::scene::{Device, Hand, Scene};
use toml_edit::{DocumentMut, Item, Table, Value};

use super::check;
use crate::Error;

/// The numbers that a search has found for one word of the stiffness.
#[derive(Clone, PartialEq, Debug)]
pub struct Witness {
    /// The word of the stiffness.
    pub word: i64,
    /// The unit of the current, in A.
    pub unit: f64,
    /// The clock `a` near which pulses end.
    pub act: f64,
    /// The factor by which the root of `x' P x` falls in a period.
    pub decay: f64,
    /// Bounds of current, speed and angle by the root of `x' P x`.
    pub scales: [f64; 3],
    /// The upper triangle of `P`, row by row; states are current, speed, angle.
    pub shape: [f64; 6],
    /// `Y`: bounds of the angle, of its step in a period, and of its distance from the straight line between readings,
    /// in counts.
    pub sizes: [f64; 3],
    /// `L`, the same three where contact ends.
    pub far: [f64; 3],
    /// `λ`.
    pub level: f64,
    /// The multipliers of the staircase, of both parts of the pulse's end, of the stale drag and of its rounding.
    pub weights: [f64; 5],
    /// The upper triangle of `W`, row by row; its last state is the angle of the period before.
    pub storage: [f64; 10],
    /// How `P` and `W` follow each range.
    pub turns: Vec<Turn>,
}

/// By how much the matrices of a witness change from the middle of a range to its upper end.
#[derive(Clone, PartialEq, Debug)]
pub struct Turn {
    /// That of `P`.
    pub shape: [f64; 6],
    /// That of `W`.
    pub storage: [f64; 10],
}

/// The bounds that are proved of a word.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Bound {
    /// Bound of the rms of the angle about its rest in the long run, in counts.
    pub rms_counts: f64,
    /// Bound of the angle's distance from its rest, once the start has died out, in counts.
    pub half_range_counts: f64,
    /// Depth of the rest behind the wall's surface, in counts.
    pub depth_counts: f64,
    /// Duty at rest; of a range that at its middle.
    pub duty: f64,
}

impl Bound {
    /// Returns the greatest bounds of some, and the mean of their rests.
    pub fn greatest(all: impl Iterator<Item = Self> + Clone) -> Self {
        let most = |of: fn(&Self) -> f64| all.clone().map(|bound| of(&bound)).fold(0.0, f64::max);
        let mean = |of: fn(&Self) -> f64| all.clone().map(|bound| of(&bound)).sum::<f64>() / all.clone().count() as f64;
        Self {
            rms_counts: most(|bound| bound.rms_counts),
            half_range_counts: most(|bound| bound.half_range_counts),
            depth_counts: mean(|bound| bound.depth_counts),
            duty: mean(|bound| bound.duty),
        }
    }
}

/// The claim of a certificate.
pub const CLAIM: &str = "settled at every phase, for ever";
/// Keys that may have ranges, unless something else of the scene depends on them.
const KEYS: [&str; 10] = [
    "device.resistance",
    "device.inductance",
    "device.torque_constant",
    "device.rotor_inertia",
    "device.wheel_inertia",
    "device.viscous_friction",
    "bridge.supply",
    "bridge.on_resistance",
    "hand.stiffness",
    "hand.damping",
];
/// A number of a scene's world that is not known: its index among [`numbers`], and the ends between which it is.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Range {
    /// The index.
    pub number: usize,
    /// The least and the greatest value, in SI units.
    pub ends: [f64; 2],
}

/// Returns the numbers of a scene's world that may have ranges, in SI units; none if its kind has no such proof.
pub fn numbers(scene: &mut Scene) -> Vec<&mut f64> {
    let Device::Motor(motor) = &mut scene.device else { return Vec::new() };
    let mut all = vec![&mut motor.resistance_ohm, &mut motor.inductance_h, &mut motor.torque_constant_nm_per_a];
    all.extend([&mut motor.rotor_inertia_kg_m2, &mut motor.wheel_inertia_kg_m2]);
    all.extend([&mut motor.viscous_friction_nm_s_per_rad, &mut scene.bridge.supply_v]);
    all.push(&mut scene.bridge.on_resistance_ohm);
    if let Hand::SpringDamper { stiffness_nm_per_rad, damping_nm_s_per_rad, .. } = &mut scene.hand {
        all.extend([stiffness_nm_per_rad, damping_nm_s_per_rad]);
    }
    all
}

/// Greatest number of times that ranges are halved.
const MOST_HALVINGS: usize = 64;

/// A key of a scene's world, and its least and greatest value as the scene's text writes them.
#[derive(Clone, PartialEq, Debug)]
pub struct Over {
    /// The key.
    pub key: String,
    /// Both values.
    pub ends: [String; 2],
}

impl Over {
    /// Returns the number of the scene that the key is, and its range. `at` makes the scene with another value.
    ///
    /// # Errors
    ///
    /// Returns why there is no such scene, or why the key is no number of the world that may have a range.
    pub fn range(&self, scene: &Scene, at: impl Fn(&str, &str) -> Result<Scene, Error>) -> Result<Range, Error> {
        let [mut low, mut high] = [at(&self.key, &self.ends[0])?, at(&self.key, &self.ends[1])?];
        let mut own = scene.clone();
        let ends = numbers(&mut low).into_iter().zip(numbers(&mut high)).zip(numbers(&mut own)).enumerate();
        let (mut found, mut count) = (Range { number: 0, ends: [0.0; 2] }, 0);
        for (number, ((low, high), own)) in ends {
            if low != high {
                (found, count) = (Range { number, ends: [*low, *high] }, count + 1);
            }
            (*low, *high) = (*own, *own);
        }
        // Nothing else of the scene may depend on the key. The head keeps where each value comes from.
        let is_clock = low.clock == scene.clock && high.clock == scene.clock;
        (low.head, high.head) = (scene.head.clone(), scene.head.clone());
        if !is_clock || count != 1 || low != *scene || high != *scene {
            let [from, to] = &self.ends;
            let key = &self.key;
            let said =
                format_args!("{key} from {from} to {to} is no range of one number; such are {}", KEYS.join(", "));
            return Err(Error::new(said));
        }
        Ok(found)
    }
}

/// Returns the part of ranges that is left when they are halved in turn: `a` and `b` are the lower halves of the first
/// and of the second range, `A` and `B` the upper halves. Returns `None` if it is no such part.
pub fn part_of(ranges: &[Range], part: &str) -> Option<Vec<Range>> {
    let mut ranges = ranges.to_vec();
    for letter in part.bytes() {
        let range = ranges.get_mut(usize::from(letter.to_ascii_lowercase().checked_sub(b'a')?))?;
        let [low, high] = &mut range.ends;
        let middle = 0.5 * *low + 0.5 * *high;
        *(if letter.is_ascii_lowercase() { high } else { low }) = middle;
    }
    (part.len() <= MOST_HALVINGS).then_some(ranges)
}

/// Whether parts that have the first halvings in common are all of it: one part, or the parts of both halves.
fn is_whole(parts: &[&[u8]], common: usize) -> bool {
    if parts.len() == 1 || common == MOST_HALVINGS {
        return parts.len() == 1 && parts[0].len() == common;
    }
    let Some(lower) = parts.first().and_then(|part| part.get(common)).map(u8::to_ascii_lowercase) else { return false };
    let half =
        |letter: u8| -> Vec<&[u8]> { parts.iter().copied().filter(|part| part.get(common) == Some(&letter)).collect() };
    let [low, high] = [half(lower), half(lower.to_ascii_uppercase())];
    low.len() + high.len() == parts.len() && is_whole(&low, common + 1) && is_whole(&high, common + 1)
}

/// The checker's verdict on a certificate.
#[derive(Debug)]
pub enum Checked {
    /// The certificate proves its claim.
    Accepted {
        /// The stiffness of each word in SI units, and what is proved of it: of ranges the greatest of its parts.
        words: Vec<(f64, Bound)>,
        /// The ranges.
        over: Vec<Over>,
    },
    /// A word, and what of it does not hold.
    Rejected(Error),
}

/// Checks the text of a certificate.
///
/// # Errors
///
/// Returns why the text is no certificate.
pub fn certify(text: &str) -> Result<Checked, Error> {
    let document: DocumentMut = text.parse().map_err(|error| Error::new(format_args!("no TOML: {error}")))?;
    let missing = |key: &str| Error::new(format_args!("`{key}` is missing, or of another kind"));
    let said = |key: &str| document.get(key).and_then(Item::as_str).ok_or_else(|| missing(key));
    if said("claim")? != CLAIM {
        return Err(Error::new(format_args!("another claim than \"{CLAIM}\"")));
    }
    let (name, text, set) = (said("name")?, said("scene")?, set(&document).ok_or_else(|| missing("set"))?);
    let parsed = |set: &[(String, String)]| {
        let none = &mut |file: &str| Err(std::io::Error::other(format!("a certificate carries no file {file}")));
        Scene::parse(name, text, set, none).map_err(Error::from)
    };
    let scene = parsed(&set)?;
    let at = |key: &str, value: &str| parsed(&[&set[..], &[(key.to_string(), value.to_string())]].concat());
    let over = over(&document).ok_or_else(|| missing("over"))?;
    let ranges = over.iter().map(|over| over.range(&scene, at)).collect::<Result<Vec<_>, Error>>()?;
    if ranges.iter().enumerate().any(|(at, range)| ranges[..at].iter().any(|other| other.number == range.number)) {
        return Err("two of its ranges are of one number".into());
    }
    let words = scene.words()?.realised;
    let step = words.torque_quantum_nm / words.count_rad * scene.method.stiffness_format.lsb();
    let tables = document.get("word").and_then(Item::as_array_of_tables).ok_or_else(|| missing("word"))?;
    if tables.is_empty() {
        return Err("it has no word of a stiffness".into());
    }
    let read = |table: &Table| {
        let number = |key: &str| table.get(key).and_then(Item::as_float).ok_or_else(|| missing(key));
        let word = table.get("word").and_then(Item::as_integer).ok_or_else(|| missing("word"))?;
        let witness = Witness {
            word,
            unit: number("unit")?,
            act: number("act")?,
            decay: number("decay")?,
            scales: numbers_of(table, "scales").ok_or_else(|| missing("scales"))?,
            shape: numbers_of(table, "shape").ok_or_else(|| missing("shape"))?,
            sizes: numbers_of(table, "sizes").ok_or_else(|| missing("sizes"))?,
            far: numbers_of(table, "far").ok_or_else(|| missing("far"))?,
            level: number("level")?,
            weights: numbers_of(table, "weights").ok_or_else(|| missing("weights"))?,
            storage: numbers_of(table, "storage").ok_or_else(|| missing("storage"))?,
            turns: turns(table).ok_or_else(|| missing("turn"))?,
        };
        let part = table.get("part").map_or(Some(""), Item::as_str).ok_or_else(|| missing("part"))?;
        Ok((witness, part.to_string(), number("stiffness")?, number("duty")?, number("rms_counts")?))
    };
    let claims = tables.iter().map(read).collect::<Result<Vec<_>, Error>>()?;
    let holds = |(witness, part, stiffness, duty, rms): &(Witness, String, f64, f64, f64)| {
        let word = witness.word;
        let rejected = |why: &dyn std::fmt::Display| Error::new(format_args!("word {word}: {why}"));
        let ranges = part_of(&ranges, part).ok_or_else(|| rejected(&"its part is none of the ranges"))?;
        let bound = check(&scene, &ranges, witness).map_err(|error| rejected(&error))?;
        if !((stiffness / (word as f64 * step) - 1.0).abs() < 1e-9 && (duty - bound.duty).abs() < 1e-6) {
            return Err(rejected(&"its stiffness or its duty is that of another scene"));
        }
        if !(bound.rms_counts <= *rms && *rms < 1.0) {
            return Err(rejected(&format_args!("{rms} counts rms are claimed, {} are proved", bound.rms_counts)));
        }
        Ok((*stiffness, bound))
    };
    let word = |claims: &[(Witness, String, f64, f64, f64)]| {
        let parts: Vec<&[u8]> = claims.iter().map(|(_, part, ..)| part.as_bytes()).collect();
        if !is_whole(&parts, 0) {
            let word = claims[0].0.word;
            return Err(Error::new(format_args!("word {word}: its parts are not all of the ranges, once")));
        }
        let proved = claims.iter().map(holds).collect::<Result<Vec<_>, Error>>()?;
        Ok((proved[0].0, Bound::greatest(proved.iter().map(|(_, bound)| *bound))))
    };
    let words: Result<Vec<_>, Error> = claims.chunk_by(|one, next| one.0.word == next.0.word).map(word).collect();
    Ok(words.map_or_else(Checked::Rejected, |words| Checked::Accepted { words, over }))
}

/// Returns the ranges of a certificate: the list `over` of keys with two values each; `None` if it is none.
fn over(document: &DocumentMut) -> Option<Vec<Over>> {
    let Some(all) = document.get("over") else { return Some(Vec::new()) };
    let read = |side: &Value| {
        let text = |at: usize| side.as_array()?.get(at)?.as_str().map(str::to_string);
        Some(Over { key: text(0)?, ends: [text(1)?, text(2)?] })
    };
    all.as_array()?.iter().map(read).collect()
}

/// Returns how the matrices of a witness follow each range.
fn turns(table: &Table) -> Option<Vec<Turn>> {
    let Some(all) = table.get("turn") else { return Some(Vec::new()) };
    let read =
        |table: &Table| Some(Turn { shape: numbers_of(table, "shape")?, storage: numbers_of(table, "storage")? });
    all.as_array_of_tables()?.iter().map(read).collect()
}

/// Returns keys and values that replace those of the scene's text: the list `set` of pairs; `None` if it is none.
pub fn set(document: &DocumentMut) -> Option<Vec<(String, String)>> {
    let pair = |pair: &Value| {
        let [key, value] = [0, 1].map(|at| pair.as_array().and_then(|pair| pair.get(at)).and_then(Value::as_str));
        Some((key?.to_string(), value?.to_string()))
    };
    document.get("set")?.as_array()?.iter().map(pair).collect()
}

fn numbers_of<const N: usize>(table: &Table, key: &str) -> Option<[f64; N]> {
    let all: Option<Vec<f64>> = table.get(key)?.as_array()?.iter().map(Value::as_float).collect();
    all?.try_into().ok()
}
