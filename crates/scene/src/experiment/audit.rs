//! Finds all errors of a scene at once. A reader ends at its first refusal; the rows of the keys then tell which other
//! keys are refused.
//!
//! Conditions between sections are checked only by readers, after every section was read.

use crate::experiment::devices::KINDS;
use crate::experiment::groups::{has_own_kind, kinds_of, schema};
use crate::method::{PADDLE, is_paddle};
use crate::schema::quantity::{Axis, RAIL, SHAFT};
use crate::schema::section::Section;
use crate::schema::source::{SceneError, Source};
use crate::schema::{AnyKey, is_any_name};

/// Returns the first error of a scene with all others that its keys have, each by itself.
pub(crate) fn with_others(source: &Source, first: SceneError) -> SceneError {
    let root = Section::root(source);
    let Some((scene, device, axis)) = kinds(&root) else { return first };
    if device == "network" {
        // Its bodies have units of their own, which its reader alone knows.
        return first;
    }
    // Without a method, nobody knows whether its keys and the wall's were meant to be there: none is missing.
    let misses = scene != "axis" || root.has("method");
    first.with(Audit::of(&root.along(axis), (scene, device), misses))
}

/// Returns the first error of a scene of a plant alone with all unknown keys, those of a `[dut]` apart.
pub(crate) fn with_others_of_plant(source: &Source, first: SceneError) -> SceneError {
    let root = Section::root(source);
    let Some((_, device, axis)) = kinds(&root).filter(|(_, device, _)| *device != "network") else { return first };
    first.with(Audit::of(&root.along(axis), ("dut", device), false))
}

/// Returns the kind of a scene, the kind of its device, and the dimensions of the device's motion.
pub(crate) fn kinds(root: &Section) -> Option<(&'static str, &'static str, &'static Axis)> {
    let device = kind(&root.section("device").ok()?)?;
    let has = |&(scene, of): &(&str, &str)| {
        let is_one = match scene {
            "dut" => root.has("dut"),
            PADDLE => is_paddle(root),
            _ => true,
        };
        of == device && is_one
    };
    let (scene, device) = *KINDS.iter().rfind(|kinds| has(kinds))?;
    Some((scene, device, if device == "mass" { &RAIL } else { &SHAFT }))
}

fn kind<'a>(s: &Section<'a>) -> Option<&'a str> {
    s.get("kind").and_then(|kind| kind.as_str())
}

/// Returns the kind of a section, of the scene itself that of its method.
pub(crate) fn own_kind<'a>(s: &Section<'a>) -> Option<&'a str> {
    if s.path().is_empty() { kind(&s.section("method").ok()?) } else { kind(s) }
}

struct Audit<'a> {
    scene: &'a str,
    device: &'a str,
    errors: Vec<SceneError>,
}

impl<'a> Audit<'a> {
    /// Returns all errors of a scene of these kinds; a key that is missing is one if `misses` says so.
    fn of(root: &Section, (scene, device): (&'a str, &'a str), misses: bool) -> Vec<SceneError> {
        let mut audit = Audit { scene, device, errors: Vec::new() };
        audit.section(root, "", misses);
        audit.errors
    }

    /// Returns the key `kind` of a section of these kinds: of a method that is a scene of its own, its own one.
    fn kind_of(&self, name: &str, kinds: &[&str]) -> Option<&'static dyn AnyKey> {
        let own = |kinds: &[&str]| schema().accepted(name, kinds).find(|key| key.name() == "kind");
        own(kinds).or_else(|| own(&[self.scene])).or_else(|| schema().kind_of(name))
    }

    /// Checks every key of a section and of the sections below. A key is reported as missing only if no unknown key
    /// stands around it, because that key may be the missing one, misspelt.
    fn section(&mut self, s: &Section, name: &str, misses: bool) {
        let kinds = kinds_of(name, self.scene, self.device, own_kind(s));
        if has_own_kind(name, self.scene)
            && let Some(Err(error)) = self.kind_of(name, &kinds).map(|key| key.check(s))
        {
            self.errors.extend((s.has("kind") || misses).then_some(error));
            return;
        }
        let taken: Vec<_> = schema().accepted(name, &kinds).collect();
        let is_free = taken.iter().any(|key| is_any_name(key.name()));
        // A section with free names has its own reader.
        if is_free {
            return;
        }
        let unknown = s.unknown_keys(name, &kinds);
        let misses = misses && unknown.is_empty();
        self.errors.extend(unknown.into_iter().chain(s.alone(name, &kinds)));
        for key in taken.into_iter().filter(|key| s.has(key.name()) || misses && key.is_required()) {
            match s.section(key.name()) {
                Ok(below) if key.is_section() => self.section(&below, &s.key(key.name()), misses),
                Err(error) if key.is_section() => self.errors.push(error),
                _ => self.errors.extend(key.check(s).err()),
            }
        }
    }
}
