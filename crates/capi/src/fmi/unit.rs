//! Units, without the C interface: parameters, words, states and steps.

use hpu_cosim::scene::{Device, Experiment};
use hpu_cosim::{Control, EnergyAudit, SceneFile};
use hpu_signal::{Real, Signal};

use crate::emulated::Emulated;
use crate::error::{Error, Status};
use crate::plant::Plant;

/// The part of a scene that becomes a unit.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Kind {
    /// Everything outside the FPGA: the importer drives the gates.
    Plant,
    /// The whole loop, with the scene's own blocks.
    Loop,
}

impl Kind {
    /// Returns the name in the archive.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Plant => "plant",
            Self::Loop => "loop",
        }
    }
}

/// The role of a variable.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Causality {
    Time,
    /// A parameter that is set before the start.
    Parameter,
    /// A parameter that is set at any time.
    Tunable,
    Input,
    Output,
}

/// A variable of a unit. Its value reference is its index.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Variable {
    pub name: String,
    pub causality: Causality,
    /// Whether its value is a word, else it is a real number.
    pub is_word: bool,
    pub unit: &'static str,
    pub doc: String,
    /// The value at the start, of parameters and inputs.
    pub start: f64,
}

/// An energy: its name, how it is read, and what it is.
type Energy = (&'static str, fn(&EnergyAudit) -> f64, &'static str);

/// The energies that a plant tells.
const ENERGIES: [Energy; 5] = [
    ("energy.source", |energy| energy.source_j, "Energy from the supply"),
    ("energy.hand", |energy| energy.hand_j, "Energy from the hand"),
    ("energy.stored", |energy| energy.stored_j, "Energy that the device holds"),
    ("energy.dissipated", |energy| energy.dissipated_j, "Energy that has become heat"),
    ("energy.residual", |energy| energy.residual_j, "What the other energies leave over: rounding"),
];

/// A model that a unit moves on.
enum Model {
    Plant(Box<Plant>),
    Loop(Emulated),
}

/// A parameter that was set after the start: the clock edge, the parameter's index, and its value.
type Tuned = (u64, usize, f64);

/// A state to come back to. Of a loop, its edge and what was set on the way are all of it.
pub(super) enum Snapshot {
    Plant(Box<Plant>),
    Loop(u64, Vec<Tuned>),
}

/// A unit: a scene, its parameters and its model.
pub(super) struct Unit {
    pub(super) kind: Kind,
    file: SceneFile,
    set: Vec<(String, String)>,
    model: Model,
    variables: Vec<Variable>,
    tuned: Vec<Tuned>,
}

impl Unit {
    /// Opens a unit of a scene with these overrides.
    pub(super) fn open(kind: Kind, file: SceneFile, set: Vec<(String, String)>) -> Result<Self, Error> {
        let model = Model::open(kind, &file, &set)?;
        let variables = model.variables(&file, &set);
        Ok(Self { kind, file, set, model, variables, tuned: Vec::new() })
    }

    pub(super) fn variables(&self) -> &[Variable] {
        &self.variables
    }

    fn variable(&self, reference: u32, causality: &[Causality], is_word: bool) -> Result<(usize, &Variable), Error> {
        let found = usize::try_from(reference).ok().and_then(|at| Some((at, self.variables.get(at)?)));
        let fits = |variable: &Variable| causality.contains(&variable.causality) && variable.is_word == is_word;
        found.filter(|(_, variable)| fits(variable)).ok_or_else(|| {
            let kind = if is_word { "Int64" } else { "Float64" };
            Error::new(Status::Argument, format!("value reference {reference} is no {kind} that can be used so"))
        })
    }

    /// The first variable of a causality.
    fn first(&self, causality: Causality) -> usize {
        self.variables.iter().position(|variable| variable.causality == causality).unwrap_or(self.variables.len())
    }

    /// Returns the end of the scene in seconds.
    pub(super) fn end_s(&self) -> f64 {
        let (clock, edges) = match &self.model {
            Model::Plant(plant) => (plant.clock(), plant.edges()),
            Model::Loop(emulated) => (emulated.clock(), emulated.edges()),
        };
        clock.seconds(hpu_signal::Cycle(edges))
    }

    /// Returns the time of the present clock edge in seconds.
    pub(super) fn time(&self) -> f64 {
        match &self.model {
            Model::Plant(plant) => plant.seconds(),
            Model::Loop(emulated) => emulated.clock().seconds(hpu_signal::Cycle(emulated.edge())),
        }
    }

    /// Returns a real variable. `time` is the importer's.
    pub(super) fn real(&mut self, reference: u32, time: f64) -> Result<f64, Error> {
        use Causality::{Output, Parameter, Time, Tunable};
        let (at, variable) = self.variable(reference, &[Time, Parameter, Tunable, Output], false)?;
        match variable.causality {
            Time => return Ok(time),
            Parameter => return Ok(variable.start),
            Tunable => {
                let latest = self.tuned.iter().rfind(|(_, tuned, _)| *tuned == at);
                return Ok(latest.map_or(variable.start, |(_, _, value)| *value));
            }
            _ => {}
        }
        let first = self.first(Output);
        let words = self.variables[first..].iter().take_while(|variable| variable.is_word).count();
        let index = at - first - words;
        match &mut self.model {
            Model::Loop(emulated) => emulated.state(index),
            Model::Plant(plant) => {
                let states = plant.states().len();
                if index < states { plant.state(index) } else { Ok(ENERGIES[index - states].1(&plant.energy())) }
            }
        }
    }

    /// Returns a word.
    pub(super) fn word(&self, reference: u32) -> Result<i64, Error> {
        use Causality::{Input, Output};
        let (at, variable) = self.variable(reference, &[Input, Output], true)?;
        let index = at - self.first(variable.causality);
        Ok(match &self.model {
            Model::Plant(plant) if variable.causality == Input => plant.driven()[index],
            Model::Plant(plant) => plant.words()[index],
            Model::Loop(emulated) => emulated.words()[index],
        })
    }

    /// Drives inputs: all at once, so that no leg is shorted in between.
    pub(super) fn drive(&mut self, references: &[u32], words: &[i64]) -> Result<(), Error> {
        let mut places = Vec::with_capacity(references.len());
        for reference in references {
            places.push(self.variable(*reference, &[Causality::Input], true)?.0 - self.first(Causality::Input));
        }
        let Model::Plant(plant) = &mut self.model else { unreachable!("a loop has no input") };
        let mut driven = plant.driven().to_vec();
        places.iter().zip(words).for_each(|(place, word)| driven[*place] = *word);
        plant.drive(&driven)
    }

    /// Sets a parameter after the start, from the next clock edge on.
    pub(super) fn tune(&mut self, reference: u32, value: f64) -> Result<(), Error> {
        let (at, _) = self.variable(reference, &[Causality::Tunable], false)?;
        let Model::Loop(emulated) = &self.model else { unreachable!("a plant has no such parameter") };
        self.tune_at((emulated.edge(), at, value))
    }

    fn tune_at(&mut self, tuned: Tuned) -> Result<(), Error> {
        let Model::Loop(emulated) = &mut self.model else { unreachable!("a plant has no such parameter") };
        let all = self.tuned.iter().chain([&tuned]);
        let keys = all.map(|(_, at, value)| (self.variables[*at].name.clone(), format!("{value:?}")));
        emulated.tune(&self.file, &self.set.iter().cloned().chain(keys).collect::<Vec<_>>())?;
        self.tuned.push(tuned);
        Ok(())
    }

    /// Sets a parameter before the start. The model is opened anew.
    pub(super) fn set(&mut self, reference: u32, value: f64) -> Result<(), Error> {
        let (at, variable) = self.variable(reference, &[Causality::Parameter, Causality::Tunable], false)?;
        let mut set = self.set.clone();
        set.push((variable.name.clone(), format!("{value:?}")));
        let driven = if let Model::Plant(plant) = &self.model { plant.driven().to_vec() } else { Vec::new() };
        let mut model = Model::open(self.kind, &self.file, &set)?;
        if let Model::Plant(plant) = &mut model {
            plant.drive(&driven)?;
        }
        (self.set, self.model) = (set, model);
        self.variables[at].start = value;
        Ok(())
    }

    /// Opens the model anew, at the start.
    pub(super) fn reset(&mut self) -> Result<(), Error> {
        self.model = Model::open(self.kind, &self.file, &self.set)?;
        self.tuned.clear();
        Ok(())
    }

    /// Moves on to a time, or, with `stops`, up to the first clock edge at which a word of an output has changed.
    /// Returns whether it stopped there.
    pub(super) fn advance(&mut self, time: f64, stops: bool) -> Result<bool, Error> {
        let edge = |frequency_hz: u64| (time * frequency_hz as f64).round();
        match &mut self.model {
            Model::Plant(plant) => {
                let end = edge(plant.clock().frequency_hz()) as u64;
                if !stops {
                    plant.advance(end.saturating_sub(plant.edge()))?;
                    return Ok(false);
                }
                let before = plant.words().to_vec();
                while plant.edge() < end {
                    let left = end - plant.edge();
                    plant.advance(left.min(plant.quiet().saturating_add(1)))?;
                    if plant.words() != before {
                        return Ok(true);
                    }
                }
                Ok(false)
            }
            Model::Loop(emulated) => {
                let end = edge(emulated.clock().frequency_hz()) as u64;
                let left = end.saturating_sub(emulated.edge());
                if stops {
                    return emulated.step_to_change(left, &Control::new());
                }
                emulated.step(left, &Control::new()).map(|()| false)
            }
        }
    }

    pub(super) fn snapshot(&self) -> Snapshot {
        match &self.model {
            Model::Plant(plant) => Snapshot::Plant(Box::new(plant.copy())),
            Model::Loop(emulated) => Snapshot::Loop(emulated.edge(), self.tuned.clone()),
        }
    }

    /// Moves a loop to a clock edge.
    fn go_on_to(&mut self, edge: u64) -> Result<(), Error> {
        let Model::Loop(emulated) = &mut self.model else { unreachable!("the state is of this unit") };
        emulated.step(edge - emulated.edge(), &Control::new())
    }

    /// Comes back to a state of this unit with the same parameters.
    pub(super) fn restore(&mut self, snapshot: &Snapshot) -> Result<(), Error> {
        match snapshot {
            Snapshot::Plant(plant) => self.model = Model::Plant(Box::new(plant.copy())),
            Snapshot::Loop(edge, tuned) => {
                self.reset()?;
                for one in tuned {
                    self.go_on_to(one.0)?;
                    self.tune_at(*one)?;
                }
                self.go_on_to(*edge)?;
            }
        }
        Ok(())
    }
}

impl Model {
    fn open(kind: Kind, file: &SceneFile, set: &[(String, String)]) -> Result<Self, Error> {
        Ok(match kind {
            Kind::Plant => Self::Plant(Box::new(Plant::open(file, set)?)),
            Kind::Loop => Self::Loop(Emulated::open(file, set)?),
        })
    }

    fn variables(&self, file: &SceneFile, set: &[(String, String)]) -> Vec<Variable> {
        let time = Variable {
            name: "time".into(),
            causality: Causality::Time,
            is_word: false,
            unit: "s",
            doc: "Simulation time".into(),
            start: 0.0,
        };
        let mut all = vec![time];
        all.extend(parameters(file, set, matches!(self, Self::Loop(_))));
        let word = |signal: &Signal, causality: Causality, start: i64| Variable {
            name: signal.name.to_string(),
            causality,
            is_word: true,
            unit: signal.unit,
            doc: signal.doc.to_string(),
            start: start as f64,
        };
        let real = |name: String, unit: &'static str, doc: &str| Variable {
            name,
            causality: Causality::Output,
            is_word: false,
            unit,
            doc: doc.into(),
            start: 0.0,
        };
        let of = |state: &Real| real(state.name.to_string(), unit_of(state.name), state.doc);
        match self {
            Self::Plant(plant) => {
                let driven = plant.driven();
                all.extend(plant.outputs().iter().zip(driven).map(|(net, at)| word(net, Causality::Input, *at)));
                all.extend(plant.inputs().iter().map(|net| word(net, Causality::Output, 0)));
                all.extend(plant.states().map(|state| of(&state)));
                all.extend(ENERGIES.iter().map(|(name, _, doc)| real((*name).to_string(), "J", doc)));
            }
            Self::Loop(emulated) => {
                all.extend(emulated.nets().iter().map(|net| word(net, Causality::Output, 0)));
                all.extend(emulated.states().iter().map(of));
            }
        }
        // A net and a state may have one name, but variables may not.
        for at in 1..all.len() {
            if all[..at].iter().any(|before| before.name == all[at].name) {
                all[at].name.insert_str(0, "state.");
            }
        }
        all
    }
}

/// Returns the unit that ends a name, as in `angle_rad`.
fn unit_of(name: &str) -> &'static str {
    const ENDS: [(&str, &str); 8] = [
        ("_rad_per_s", "rad/s"),
        ("_m_per_s", "m/s"),
        ("_rad", "rad"),
        ("_nm", "N.m"),
        ("_m", "m"),
        ("_n", "N"),
        ("_a", "A"),
        ("_v", "V"),
    ];
    ENDS.iter().find(|(end, _)| name.ends_with(end)).map_or("", |(_, unit)| unit)
}

/// Returns the keys of a wall on a motor or a mass, as parameters. A loop takes its stiffness and its damping at any
/// time, but for a wall that changes by itself.
fn parameters(file: &SceneFile, set: &[(String, String)], is_loop: bool) -> Vec<Variable> {
    let Ok(Experiment::Axis(scene)) = file.plant(set) else { return Vec::new() };
    if scene.network.is_some() || !matches!(scene.device, Device::Motor(_) | Device::Mass(_)) {
        return Vec::new();
    }
    let (units, wall) = (scene.device.units(), &scene.wall);
    let tunes = is_loop && wall.ramp.is_none();
    let all = [
        ("wall.position", units.position, wall.position_rad, "Position of the wall"),
        ("wall.stiffness", units.stiffness, wall.stiffness_nm_per_rad, "Stiffness of the wall"),
        ("wall.damping", units.damping, wall.damping_nm_s_per_rad, "Damping of the wall"),
    ];
    let takes = |key: &str, value: f64| {
        let changed = [set, &[(key.to_string(), format!("{value:?}"))]].concat();
        file.plant(&changed).is_ok()
    };
    let known = all.into_iter().filter(|(key, _, value, _)| takes(key, *value));
    known
        .map(|(name, unit, start, doc)| Variable {
            name: name.into(),
            causality: if tunes && name != "wall.position" { Causality::Tunable } else { Causality::Parameter },
            is_word: false,
            unit,
            doc: doc.into(),
            start,
        })
        .collect()
}
