//! The scenes on which every design of a search is run.

use hpu_cosim::scene::{Experiment, Output};

use super::Device;
use super::knob::Knob;
use super::loops::Loops;
use crate::{Error, Kind};

/// A scene on which every design is run.
pub(super) struct Case {
    /// Its name as given.
    pub name: String,
    pub scene: Experiment,
    /// The outputs that the scene says are to be compared.
    pub outputs: Option<Vec<Output>>,
    /// Whether its stable stiffness is searched. Scenes that differ only in the wall's stiffness have the same one, so
    /// the first of them climbs for all.
    pub climbs: bool,
}

/// The scenes of a search, which take the same hardware, and the loops of their device.
pub(super) struct Cases {
    pub loops: &'static dyn Loops,
    pub all: Vec<Case>,
}

impl Cases {
    /// Reads the scenes of a search.
    ///
    /// # Errors
    ///
    /// When a scene has nothing to search, or when the scenes need different hardware at equal widths.
    pub fn new(named: &[(String, Experiment)]) -> Result<Self, Error> {
        let (_, first) = named.first().ok_or("no scene to search")?;
        let loops = first.loops()?;
        let mut all: Vec<Case> = Vec::new();
        for (name, scene) in named {
            let of = |why: Error| if named.len() > 1 { why.at(name) } else { why };
            if scene.auto {
                return Err(of("model = \"auto\" is chosen for one design; set what hpu fit chooses".into()));
            }
            loops.searchable(scene).map_err(of)?;
            if let Some(first) = all.first()
                && let Some(why) = loops.difference(&first.scene, scene)
            {
                return Err(
                    format!("{} and {name} have {why}: one search takes scenes of one hardware", first.name).into()
                );
            }
            let climbs = !all.iter().any(|before| loops.same_but_for_stiffness(&before.scene, scene));
            let outputs = scene.accuracy.outputs.clone();
            all.push(Case { name: name.clone(), scene: scene.clone(), outputs, climbs });
        }
        Ok(Self { loops, all })
    }

    /// Returns the first scene, which has the widths that no knob varies.
    pub fn base(&self) -> &Experiment {
        &self.all[0].scene
    }

    /// Returns a message about a scene, with its name where there are several.
    pub fn of(&self, case: &Case, why: Error) -> Error {
        if self.all.len() > 1 { why.at(&case.name) } else { why }
    }

    /// Refuses knobs that make no grid; returns the number of designs.
    pub fn grid(&self, knobs: &[Knob]) -> Result<usize, Error> {
        if knobs.is_empty() {
            return Err("nothing to vary".into());
        }
        let loops = self.loops;
        for (index, knob) in knobs.iter().enumerate() {
            if !loops.keys().all.contains(&knob.key) {
                let (device, names) = (loops.keys().device, loops.keys().names());
                let why = format!("this is a scene of {device}, which has no such width; write one of {names}");
                return Err(Error::of(Kind::Usage, why).at(format_args!("--vary {knob}")));
            }
            if knobs[..index].iter().any(|other| other.key == knob.key) {
                return Err(format!("{} is varied twice", knob.key.name).into());
            }
            if let Some(why) = loops.refuses(self.base(), knob) {
                return Err(why.into());
            }
        }
        let designs: u128 = knobs.iter().map(|knob| knob.values() as u128).product();
        let most = loops.keys().most_designs;
        if designs > most {
            return Err(format!("{designs} designs; at most {most} are searched: narrow a range").into());
        }
        Ok(designs as usize)
    }
}
