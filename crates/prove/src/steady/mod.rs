//! Up to which stiffness a wall settles at every phase of its contact, for ever.
//!
//! The loop is that of a live spring behind a latched modulator. The search here is in floats: for each word of the
//! stiffness it finds a [`Witness`], and [`certify::check`](crate::certify::check) proves or rejects it.
//!
//! The multiplier of the staircase makes the bound: a command that never falls with the angle cannot feed a motion that
//! climbs against it. The search is over `h`, the weight of the staircase, over the two weights of the pulse's end, and
//! with damping over those of its drag. Each frequency gives the level `λ` that they need. The storage is the solution
//! of the discrete Riccati equation of that level, by Newton's method from the loop without inputs on.

mod levels;
mod search;

use hpu_cosim::scene::Scene;
use toml_edit::Value;

use crate::Error;
use crate::certify::{Bound, CLAIM, Over, Range, Turn, Witness, numbers, of_scene, part_of};
use crate::linear::unit;
pub use search::from_state;
use search::steady;

/// Greatest number of words that are proved.
const MOST_WORDS: usize = 1024;
/// Greatest rms of a wall that has settled, in counts.
pub const SETTLED_COUNTS: f64 = 1.0;

/// Greatest number of times that each of some ranges is halved, and that ranges are halved in all.
const MOST_HALVINGS: [usize; 3] = [0, 4, 5];

/// The words of a stiffness that are proved to settle, from the softest one on.
#[derive(Clone, PartialEq, Debug)]
pub struct SteadySet {
    /// Unit of all stiffnesses.
    pub unit: &'static str,
    /// Stiffness of the softest word of the range.
    pub from: f64,
    /// The words that are proved, one after the other.
    pub proved: Vec<Steady>,
    /// The first word that is not proved, and why; none if the range or the search ends before it.
    pub beyond: Option<(f64, String)>,
    /// The words from that one on of which a half-range is proved, but no rms below one count: in contact they stay
    /// within it for ever. None of ranges.
    pub bounded: Vec<Steady>,
    /// Whether the search ended before the range.
    pub ended: bool,
    /// The numbers of the world that have ranges, and what is told of their parts at the first word that is not proved
    /// everywhere.
    pub over: Vec<Over>,
    /// The parts of the ranges at the word [beyond](Self::beyond), the lowest first; none without ranges.
    pub parts: Vec<Told>,
}

/// A word that settles at every phase, for ever.
#[derive(Clone, PartialEq, Debug)]
pub struct Steady {
    /// Stiffness of the word.
    pub stiffness: f64,
    /// The bounds that are proved, the greatest of all parts.
    pub bound: Bound,
    /// The parts of all ranges, each with the numbers that prove it; one if there are no ranges.
    pub parts: Vec<Part>,
}

/// A part of all ranges in which a word settles, as [`part_of`] makes it.
#[derive(Clone, PartialEq, Debug)]
pub struct Part {
    /// Which part it is.
    pub name: String,
    /// The bounds that are proved.
    pub bound: Bound,
    /// The numbers that prove them.
    pub witness: Witness,
}

/// A part of all ranges with its outcome.
#[derive(Clone, PartialEq, Debug)]
pub struct Told {
    /// Both ends of each range, in SI units.
    pub ends: Vec<[f64; 2]>,
    /// The outcome over this part.
    pub is: Outcome,
}

/// The outcome of a word over a part of all ranges.
#[derive(Clone, PartialEq, Debug)]
pub enum Outcome {
    /// It settles everywhere.
    Proved,
    /// In the middle of the part a run goes on in contact for ever, with so many counts rms.
    Refuted(f64),
    /// It is not told: why it is not proved.
    NotTold(String),
}

/// Runs a scene in contact. Returns the rms in counts of a motion that goes on for ever, if it is one count at least.
pub type Refute<'a> = dyn Fn(&Scene) -> Option<f64> + 'a;

impl SteadySet {
    /// Proves words from the softest one of a range on, until one is not proved to stay below one count rms.
    ///
    /// # Errors
    ///
    /// Returns why the proof is not worked out for the scene.
    pub fn new(scene: &Scene, range: [f64; 2]) -> Result<Self, Error> {
        Self::over(scene, &[], range, &|_| None)
    }

    /// Proves words from the softest one of a range on, until one is not proved for all values that numbers of the
    /// world may have. The ranges are halved until each part is proved, refuted by a run, or too small to be halved
    /// again. The words are those of the scene, whatever the numbers are.
    ///
    /// # Errors
    ///
    /// Returns why the proof is not worked out for the scene.
    pub fn over(scene: &Scene, over: &[(Over, Range)], range: [f64; 2], refute: &Refute) -> Result<Self, Error> {
        of_scene(scene)?;
        let ranges: Vec<Range> = over.iter().map(|(_, range)| *range).collect();
        let words = scene.words()?;
        let step = words.realised.torque_quantum_nm / words.realised.count_rad * scene.method.stiffness_format.lsb();
        let word = |stiffness: f64| ((stiffness / step).round() as i128).clamp(1, scene.method.stiffness_format.max());
        let (least, most) = (word(range[0]), word(range[1]));
        let mut set = Self {
            unit: unit(scene),
            from: least as f64 * step,
            proved: vec![],
            beyond: None,
            bounded: vec![],
            ended: false,
            over: over.iter().map(|(over, _)| over.clone()).collect(),
            parts: vec![],
        };
        let mut start = vec![(String::new(), None)];
        for word in least..=most {
            if set.proved.len() == MOST_WORDS {
                set.ended = true;
                break;
            }
            let stiffness = word as f64 * step;
            let (parts, left) = parts(scene, &ranges, word as i64, start);
            let ends = |name: &str| -> Vec<[f64; 2]> {
                part_of(&ranges, name).expect("a part").iter().map(|range| range.ends).collect()
            };
            if let Some((_, why)) = left.first() {
                set.beyond = Some((stiffness, why.clone()));
                if ranges.is_empty() {
                    set.bounded = bounded(scene, word as i64..=most as i64, step);
                } else {
                    let proved = parts.iter().map(|part| (part.name.clone(), Outcome::Proved));
                    let left = left.iter().map(|(name, why)| {
                        let middle = in_middle(scene, &ranges, name, stiffness);
                        let rms = middle.and_then(|scene| refute(&scene));
                        (name.clone(), rms.map_or_else(|| Outcome::NotTold(why.clone()), Outcome::Refuted))
                    });
                    let all = proved.chain(left).map(|(name, is)| Told { ends: ends(&name), is });
                    set.parts = all.collect();
                    set.parts.sort_by(|one, other| one.ends.partial_cmp(&other.ends).expect("numbers"));
                }
                break;
            }
            start = parts.iter().map(|part| (part.name.clone(), Some(part.witness.weights))).collect();
            let bound = Bound::greatest(parts.iter().map(|part| part.bound));
            set.proved.push(Steady { stiffness, bound, parts });
        }
        Ok(set)
    }
}

/// Returns words of which a half-range is proved, up to the first of which none is.
fn bounded(scene: &Scene, words: std::ops::RangeInclusive<i64>, step: f64) -> Vec<Steady> {
    let (mut found, mut start) = (Vec::new(), None);
    for word in words.take(MOST_WORDS) {
        let Ok((witness, bound)) = steady(scene, &[], word, start) else { break };
        start = Some(witness.weights);
        let parts = vec![Part { name: String::new(), bound, witness }];
        found.push(Steady { stiffness: word as f64 * step, bound, parts });
    }
    found
}

/// Parts of ranges, each with multipliers of a word nearby.
type Starts = Vec<(String, Option<[f64; 5]>)>;

/// Returns the parts of all ranges in which a word is proved, and the others with the reason. The parts of a word
/// nearby are tried first.
fn parts(scene: &Scene, ranges: &[Range], word: i64, mut todo: Starts) -> (Vec<Part>, Vec<(String, String)>) {
    let (mut proved, mut left) = (Vec::new(), Vec::new());
    todo.reverse();
    while let Some((name, start)) = todo.pop() {
        let part = part_of(ranges, &name).expect("a part");
        let why = match steady(scene, &part, word, start) {
            Ok((witness, bound)) if bound.rms_counts < SETTLED_COUNTS => {
                proved.push(Part { name, bound, witness });
                continue;
            }
            Ok((_, bound)) => format!("the rms is bounded by {:.2} counts", bound.rms_counts),
            Err(why) => why,
        };
        if name.len() == MOST_HALVINGS[ranges.len()] {
            left.push((name, why));
            continue;
        }
        // The range that is widest by its values is halved.
        let share = |range: &Range| range.ends[1] / range.ends[0];
        let widest = (1..part.len()).fold(0, |most, at| if share(&part[at]) > share(&part[most]) { at } else { most });
        let letter = char::from(b'a' + widest as u8);
        for letter in [letter.to_ascii_uppercase(), letter] {
            todo.push((format!("{name}{letter}"), start));
        }
    }
    (proved, left)
}

/// Returns a scene with a stiffness and with the middle values of a part of all ranges, and with its own words.
fn in_middle(scene: &Scene, ranges: &[Range], part: &str, stiffness: f64) -> Option<Scene> {
    let mut nominal = scene.clone();
    nominal.wall.stiffness_nm_per_rad = stiffness;
    let mut world = nominal.clone();
    let mut all = numbers(&mut world);
    for Range { number, ends: [low, high] } in part_of(ranges, part)? {
        *all[number] = 0.5 * (low + high);
    }
    world.with_words_of(&nominal).ok()
}

/// Returns the text of a certificate that [`certify`](crate::certify::certify) checks: the scene's text, what replaces
/// its keys, the ranges, and the witnesses. A certificate of a scene that reads files is rejected.
pub fn certificate(set: &SteadySet, name: &str, text: &str, overrides: &[(String, String)]) -> String {
    let quoted = |text: &str| Value::from(text).to_string();
    let list = |numbers: &[f64]| numbers.iter().map(|number| format!("{number:e}")).collect::<Vec<_>>().join(", ");
    let pairs: Vec<String> =
        overrides.iter().map(|(key, value)| format!("[{}, {}]", quoted(key), quoted(value))).collect();
    let over: Vec<String> = set
        .over
        .iter()
        .map(|Over { key, ends: [from, to] }| format!("[{}, {}, {}]", quoted(key), quoted(from), quoted(to)))
        .collect();
    let mut certificate = format!(
        "# `hpu certify` checks this file. It holds for every start from which the wall stays in contact.\n\
         claim = {}\nname = {}\nset = [{}]\nover = [{}]\nscene = {}\n",
        quoted(CLAIM),
        quoted(name),
        pairs.join(", "),
        over.join(", "),
        quoted(text)
    );
    let all = set.proved.iter().flat_map(|word| word.parts.iter().map(move |part| (word.stiffness, part)));
    for (stiffness, Part { name, bound, witness }) in all {
        let Witness { word, unit, act, decay, scales, shape, sizes, far, level, weights, storage, turns } = witness;
        let Bound { rms_counts, duty, .. } = bound;
        certificate += &format!(
            "\n[[word]]\nword = {word}\npart = {}\nstiffness = {stiffness:e}\nduty = {duty:e}\n\
             rms_counts = {rms_counts:e}\nunit = {unit:e}\nact = {act:e}\ndecay = {decay:e}\nscales = [{}]\n\
             shape = [{}]\nsizes = [{}]\nfar = [{}]\nlevel = {level:e}\nweights = [{}]\nstorage = [{}]\n",
            quoted(name),
            list(scales),
            list(shape),
            list(sizes),
            list(far),
            list(weights),
            list(storage)
        );
        for Turn { shape, storage } in turns {
            certificate += &format!("[[word.turn]]\nshape = [{}]\nstorage = [{}]\n", list(shape), list(storage));
        }
    }
    certificate
}

#[cfg(test)]
mod tests;
