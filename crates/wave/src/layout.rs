//! The variables of a waveform, and their places in the hierarchy.

use hpu_cosim::dut::{DutSimulation, Wire};
use hpu_cosim::{Simulation, Waves, Wired};
use hpu_datapath::{AnyBlock, Instance, Wiring};
use hpu_signal::{Cycle, Format, Real, Signal};

/// The source of a variable's value. Variables with the same source are one signal under several names.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Source {
    /// The clock: 1 from each edge until half a period later.
    Clock,
    /// The reset: 0 after the recording has begun.
    Reset,
    /// A net, by its index in [`Wiring::nets`].
    Net(usize),
    /// An output of the plant, by its index in the list given to [`Layout::new`].
    Real(usize),
    /// An input that is tied to a constant, by its index among those of all instances.
    Tied(usize),
}

/// A variable of a scope.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Var {
    /// Name as GHDL writes it: `clk`, `position[11:0]`.
    pub name: String,
    /// Width in bits; 64 for a real.
    pub width: u32,
    /// The source of its value.
    pub source: Source,
}

/// A level of the hierarchy.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Scope {
    /// Name: the wiring's, an instance's label, or `plant`.
    pub name: String,
    /// Its variables, in order.
    pub vars: Vec<Var>,
    /// The scopes inside.
    pub scopes: Vec<Scope>,
}

/// A real of a waveform, in the rows that a recording observes.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Shown {
    /// The value in this column.
    Value(usize),
    /// The depth in a wall at this position, of the position in this column; 0 outside.
    Depth(usize, f64),
}

impl Shown {
    /// Returns the value in a row; `None` where the row ends before it.
    pub(crate) fn of(self, row: &[f64]) -> Option<f64> {
        match self {
            Self::Value(column) => row.get(column).copied(),
            Self::Depth(column, wall) => row.get(column).map(|position| (position - wall).max(0.0)),
        }
    }
}

/// The variables of a waveform.
#[derive(Clone, PartialEq, Debug)]
pub struct Layout {
    pub(crate) scopes: Vec<Scope>,
    pub(crate) nets: Vec<Signal>,
    pub(crate) reals: Vec<Real>,
    /// The source of each of these in the rows that the recording observes.
    pub(crate) columns: Vec<Shown>,
    /// The nets whose overflows are shown; their bits are the last of `nets`.
    pub(crate) overflows: Vec<usize>,
    /// Words of the inputs that are tied to a constant.
    pub(crate) tied: Vec<i64>,
    pub(crate) waves: Waves,
    /// The nets of a design of the user's own, if it is one.
    pub(crate) own: Option<Vec<OwnNet>>,
    /// The edge at which the waveform begins.
    pub(crate) begin: Cycle,
}

/// A net of a design of the user's own.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct OwnNet {
    /// Whether its words are numbers, which are drawn as curves.
    pub(crate) is_quantity: bool,
    /// Whether it is outside: a port, or the contact.
    pub(crate) is_port: bool,
}

/// The depth in the wall of an axis that turns, and of one that moves along a rail.
const DEPTH_RAD: Real = Real { name: "wall_depth_rad", doc: "Depth in the wall, 0 outside" };
const DEPTH_M: Real = Real { name: "wall_depth_m", doc: "Depth in the wall, 0 outside" };

/// The name of the net that is 1 once the VHDL has differed.
pub(crate) const DIFFERS: &str = "differs";

/// Returns the net that a run of VHDL (`hpu run --driver rtl`) shows after those of the wiring: it is 1 from the first
/// edge at which a net differed from the emulator's.
pub fn differs() -> Signal {
    Signal::bit(DIFFERS, "A net has differed from the emulator's")
}

impl Var {
    fn new(name: &str, format: Format, source: Source) -> Self {
        let width = format.width();
        let name = if width == 1 { name.to_string() } else { format!("{name}[{}:0]", width - 1) };
        Self { name, width, source }
    }

    fn real((index, real): (usize, &Real)) -> Self {
        Self { name: real.name.to_string(), width: 64, source: Source::Real(index) }
    }
}

impl Scope {
    fn new(name: &str, clocked: bool, vars: impl Iterator<Item = Var>) -> Self {
        let reset = clocked.then(|| Var::new("rst", Format::BIT, Source::Reset));
        Self { name: name.to_string(), vars: reset.into_iter().chain(vars).collect(), scopes: Vec::new() }
    }

    /// Returns the inner scope of this name, and makes it when it is missing.
    fn inner(&mut self, name: &str) -> &mut Self {
        let at = self.scopes.iter().position(|scope| scope.name == name).unwrap_or(self.scopes.len());
        if at == self.scopes.len() {
            self.scopes.push(Self::new(name, false, std::iter::empty()));
        }
        &mut self.scopes[at]
    }

    /// Leaves out variables by their paths. Returns whether any of a net is left.
    fn keep(&mut self, path: &str, keeps: &dyn Fn(&str) -> bool) -> bool {
        let is_kept = |var: &Var| {
            let name = var.name.rsplit_once('[').filter(|_| var.width > 1).map_or(&*var.name, |(name, _)| name);
            matches!(var.source, Source::Clock | Source::Reset) || keeps(&format!("{path}{name}"))
        };
        self.vars.retain(is_kept);
        self.scopes.retain_mut(|scope| {
            let path = format!("{path}{}.", scope.name);
            scope.keep(&path, keeps)
        });
        !self.scopes.is_empty() || self.vars.iter().any(|var| matches!(var.source, Source::Net(_) | Source::Tied(_)))
    }

    fn add_clock(&mut self) {
        if self.vars.first().is_some_and(|first| first.source == Source::Reset) {
            self.vars.insert(0, Var::new("clk", Format::BIT, Source::Clock));
        }
        self.scopes.iter_mut().for_each(Self::add_clock);
    }

    fn names(&self, path: &str, names: &mut Vec<String>) {
        let path = format!("{path}{}.", self.name);
        names.extend(self.vars.iter().map(|var| format!("{path}{}", var.name)));
        self.scopes.iter().for_each(|scope| scope.names(&path, names));
    }
}

impl Layout {
    /// Returns the hierarchy of a wiring as GHDL shows it, without `clk`, and the plant's outputs in a scope `plant`
    /// beside it.
    pub fn new<W: Wiring>(wiring: &W, reals: &[Real]) -> Self {
        Self::laid((W::NAME, W::CLOCKED), wiring.nets(), wiring.instances(), reals)
    }

    /// Returns the hierarchy of a wiring of this name, which is clocked or not.
    fn laid((name, clocked): (&str, bool), nets: Vec<Signal>, instances: Vec<Instance>, reals: &[Real]) -> Self {
        let net = |(index, signal): (usize, &Signal)| Var::new(signal.name, signal.format, Source::Net(index));
        let mut top = Scope::new(name, clocked, nets.iter().enumerate().map(net));
        let mut tied = Vec::new();
        for Instance { label, model, connections, tied: constants, .. } in instances {
            let ports = [AnyBlock::inputs(&*model), AnyBlock::outputs(&*model)].concat();
            let vars = ports.iter().map(|port| match constants.iter().find(|(name, _)| *name == port.name) {
                Some(&(_, word)) => {
                    tied.push(word);
                    Var::new(port.name, port.format, Source::Tied(tied.len() - 1))
                }
                None => {
                    let connection = connections.iter().find(|connection| connection.port.name == port.name);
                    net((connection.expect("every port is connected or tied").net, port))
                }
            });
            top.scopes.push(Scope::new(label, model.clocked(), vars));
        }
        let mut scopes = vec![top];
        if !reals.is_empty() {
            scopes.push(Scope::new("plant", false, reals.iter().enumerate().map(Var::real)));
        }
        let columns = (0..reals.len()).map(Shown::Value).collect();
        let (overflows, waves) = (Vec::new(), Waves::default());
        Self { scopes, nets, reals: reals.to_vec(), columns, overflows, tied, waves, own: None, begin: Cycle(0) }
    }

    /// Returns the hierarchy of a scene's wiring and world. A recording has no plant.
    pub fn of(simulation: &impl Wired) -> Self {
        let reals = if simulation.has_device() { simulation.reals() } else { &[] };
        let wiring = simulation.wiring();
        let laid = Self::laid((wiring.name(), wiring.block().clocked()), wiring.nets(), wiring.instances(), reals);
        Self { waves: simulation.waves(), ..laid }
    }

    /// Returns the hierarchy of a design of the user's own: its ports in a scope of its name, its signals inside in
    /// scopes of its instances, and its world.
    pub fn of_design(simulation: &DutSimulation) -> Self {
        let nets = simulation.nets();
        let mut top = Scope::new(simulation.closed_by(), true, std::iter::empty());
        for (index, signal) in nets.iter().enumerate() {
            let mut path: Vec<&str> = signal.name.split('.').collect();
            let name = path.pop().unwrap_or_default();
            let scope = path.into_iter().fold(&mut top, Scope::inner);
            scope.vars.push(Var::new(name, signal.format, Source::Net(index)));
        }
        let reals = simulation.reals();
        let scopes = vec![top, Scope::new("plant", false, reals.iter().enumerate().map(Var::real))];
        let columns = (0..reals.len()).map(Shown::Value).collect();
        let (overflows, tied, waves) = (Vec::new(), Vec::new(), Waves::default());
        let of = |wire: &Wire| OwnNet { is_quantity: wire.is_quantity(), is_port: !wire.port.is_inside };
        let contact = OwnNet { is_quantity: false, is_port: true };
        let own = Some(simulation.wires().iter().map(of).chain([contact]).collect());
        Self { scopes, nets, reals: reals.to_vec(), columns, overflows, tied, waves, own, begin: Cycle(0) }
    }

    /// Leaves out the nets whose paths below the topmost scope `keeps` does not take, as in `decoder.count`, and the
    /// scopes that are empty then. The outputs of the plant stay.
    #[must_use]
    pub fn with_nets(mut self, keeps: &dyn Fn(&str) -> bool) -> Self {
        if let Some(top) = self.scopes.first_mut() {
            top.keep("", keeps);
        }
        self
    }

    /// Begins the waveform at an edge; the clock stands still before.
    #[must_use]
    pub fn from_edge(self, begin: Cycle) -> Self {
        Self { begin, ..self }
    }

    /// Adds `clk` in front of every `rst`. The writers toggle it between the changes that they observe: it costs two
    /// entries an edge in the file, but no step of the engine.
    #[must_use]
    pub fn with_clock(mut self) -> Self {
        self.scopes.iter_mut().for_each(Scope::add_clock);
        self
    }

    /// Adds to the plant's outputs the depth in the wall of an axis, and the hand's position, its effort and the
    /// sensors of a network where the rows of a simulation have them. A recording shows the last three if its rows are
    /// measured ([`Observe::measures`](hpu_signal::Observe::measures)).
    #[must_use]
    pub fn with_wall_and_hand(mut self, simulation: &impl Simulation) -> Self {
        let Some(plant) = self.scopes.iter_mut().find(|scope| scope.name == "plant") else { return self };
        if let Some((column, wall)) = simulation.wall() {
            let is_length = simulation.row()[column].name.ends_with("_m");
            let real = if is_length { DEPTH_M } else { DEPTH_RAD };
            plant.vars.push(Var::real((self.reals.len(), &real)));
            self.reals.push(real);
            self.columns.push(Shown::Depth(column, wall));
        }
        for column in simulation.columns() {
            let real = simulation.row()[column];
            if ["hand_", "sensor_"].iter().any(|of| real.name.starts_with(of)) && column >= simulation.reals().len() {
                plant.vars.push(Var::real((self.reals.len(), &real)));
                self.reals.push(real);
                self.columns.push(Shown::Value(column));
            }
        }
        self
    }

    /// Adds a bit for each word that a wiring computes, in a scope `overflows`: it is 1 while the word has lost upper
    /// bits ([`Observe::overflows`](hpu_signal::Observe::overflows)). Inputs and single bits cannot.
    #[must_use]
    pub fn with_overflows(mut self, inputs: usize) -> Self {
        let can = |index: &usize| self.nets[*index].format != Format::BIT;
        self.overflows = (inputs..self.nets.len()).filter(can).collect();
        let first = self.nets.len();
        let bits: Vec<_> = self.overflows.iter().map(|&net| self.nets[net].clone()).collect();
        let var = |(at, net): (usize, &Signal)| {
            Var::new(&format!("{}_overflow", net.name), Format::BIT, Source::Net(first + at))
        };
        self.scopes.push(Scope::new("overflows", false, bits.iter().enumerate().map(var)));
        self.nets.extend(bits.iter().map(|net| Signal::bit(net.name, "Its word has lost upper bits")));
        self
    }

    /// Adds the net that a run of VHDL (`hpu run --driver rtl`) has beyond those of the wiring, in a scope
    /// `comparison`: it is 1 from the first edge at which a net differed from the emulator's.
    #[must_use]
    pub fn with_comparison(mut self) -> Self {
        let var = Var::new(DIFFERS, Format::BIT, Source::Net(self.nets.len()));
        self.nets.push(differs());
        self.scopes.push(Scope::new("comparison", false, [var].into_iter()));
        self
    }

    /// Returns the topmost scopes.
    pub fn scopes(&self) -> &[Scope] {
        &self.scopes
    }

    /// Returns the full names of all variables in the order of the file, as in `hybrid_loop.counter.position[11:0]`.
    pub fn names(&self) -> Vec<String> {
        let mut names = Vec::new();
        self.scopes.iter().for_each(|scope| scope.names("", &mut names));
        names
    }

    /// Returns whether any variable shows this source.
    pub fn shows(&self, source: Source) -> bool {
        fn has(scope: &Scope, source: Source) -> bool {
            scope.vars.iter().any(|var| var.source == source) || scope.scopes.iter().any(|inner| has(inner, source))
        }
        self.scopes.iter().any(|scope| has(scope, source))
    }

    /// Returns the number of a source. The numbers are dense, and below [`slots`](Self::slots).
    pub(crate) fn slot(&self, source: Source) -> usize {
        match source {
            Source::Net(index) => index,
            Source::Real(index) => self.nets.len() + index,
            Source::Clock => self.nets.len() + self.reals.len(),
            Source::Reset => self.nets.len() + self.reals.len() + 1,
            Source::Tied(index) => self.nets.len() + self.reals.len() + 2 + index,
        }
    }

    /// Returns the number of slots.
    pub(crate) fn slots(&self) -> usize {
        self.nets.len() + self.reals.len() + 2 + self.tied.len()
    }
}
