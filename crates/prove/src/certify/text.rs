//! Certificates as text.

use hpu_cosim::scene::Scene;
use toml_edit::{DocumentMut, Item, Table, Value};

use super::check;
use crate::Error;

/// The numbers that a search has found for one word of the stiffness.
#[derive(Clone, PartialEq, Debug)]
pub struct Witness {
    /// The word of the stiffness.
    pub word: i64,
    /// The clock `a` near which pulses end.
    pub act: f64,
    /// The factor by which the root of `x' P x` falls in a period.
    pub decay: f64,
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
    /// Duty at rest.
    pub duty: f64,
}

/// The claim of a certificate.
pub const CLAIM: &str = "settled at every phase, for ever";

/// The checker's verdict on a certificate.
#[derive(Debug)]
pub enum Checked {
    /// The stiffness of each word in SI units, and what is proved of it.
    Accepted(Vec<(f64, Bound)>),
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
    let none = &mut |file: &str| Err(std::io::Error::other(format!("a certificate carries no file {file}")));
    let scene = Scene::parse(said("name")?, said("scene")?, &set(&document).ok_or_else(|| missing("set"))?, none)?;
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
            act: number("act")?,
            decay: number("decay")?,
            shape: numbers(table, "shape").ok_or_else(|| missing("shape"))?,
            sizes: numbers(table, "sizes").ok_or_else(|| missing("sizes"))?,
            far: numbers(table, "far").ok_or_else(|| missing("far"))?,
            level: number("level")?,
            weights: numbers(table, "weights").ok_or_else(|| missing("weights"))?,
            storage: numbers(table, "storage").ok_or_else(|| missing("storage"))?,
        };
        Ok((witness, number("stiffness")?, number("duty")?, number("rms_counts")?))
    };
    let holds = |(witness, stiffness, duty, rms): (Witness, f64, f64, f64)| {
        let word = witness.word;
        let rejected = |why: &dyn std::fmt::Display| Error::new(format_args!("word {word}: {why}"));
        let bound = check(&scene, &witness).map_err(|error| rejected(&error))?;
        if !((stiffness / (word as f64 * step) - 1.0).abs() < 1e-9 && (duty - bound.duty).abs() < 1e-6) {
            return Err(rejected(&"its stiffness or its duty is that of another scene"));
        }
        if !(bound.rms_counts <= rms && rms < 1.0) {
            return Err(rejected(&format_args!("{rms} counts rms are claimed, {} are proved", bound.rms_counts)));
        }
        Ok((stiffness, bound))
    };
    let claims = tables.iter().map(read).collect::<Result<Vec<_>, Error>>()?;
    let checked: Result<Vec<_>, Error> = claims.into_iter().map(holds).collect();
    Ok(checked.map_or_else(Checked::Rejected, Checked::Accepted))
}

/// Returns keys and values that replace those of the scene's text: the list `set` of pairs; `None` if it is none.
pub fn set(document: &DocumentMut) -> Option<Vec<(String, String)>> {
    let pair = |pair: &Value| {
        let [key, value] = [0, 1].map(|at| pair.as_array().and_then(|pair| pair.get(at)).and_then(Value::as_str));
        Some((key?.to_string(), value?.to_string()))
    };
    document.get("set")?.as_array()?.iter().map(pair).collect()
}

fn numbers<const N: usize>(table: &Table, key: &str) -> Option<[f64; N]> {
    let all: Option<Vec<f64>> = table.get(key)?.as_array()?.iter().map(Value::as_float).collect();
    all?.try_into().ok()
}
