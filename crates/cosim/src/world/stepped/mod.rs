//! A device that moves in steps while the datapath runs on every clock.
//!
//! A step begins at a clock edge with the outputs of that edge, and holds them to its end: a change of the drive, or of
//! the hand, inside a step takes effect at the next step. Within a step the encoder sees the motion as the straight
//! line between the step's ends: encoder edges fall on the clock edges at which that line crosses them. Most other
//! tools show the encoder nothing before the step is over, which is a coarser model.

use hpu_plant::{
    Axis, Chord, Device, Drive, Energy, Event, Excitation, Gauge, Measured, Method, Pace, Powers, REALS, State, Stepper,
};

/// The stepping of a device.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Stepping {
    /// The method; `None` flows exactly over each step.
    pub(crate) method: Option<Method>,
    /// Clock edges of the first step.
    pub(crate) first: u64,
    /// Clock edges of every other step.
    pub(crate) edges: u64,
}

/// The reason for an early end of a run whose steps are too long for the device.
pub(crate) const DIVERGED: &str = "the solver's steps diverge; write a shorter model.step";

/// The integrator that moves a device over a step.
#[derive(Clone)]
#[allow(clippy::large_enum_variant, reason = "one of them exists a run")]
enum StepIntegrator<'p> {
    /// A stepping method, with the energies up to the start of the step.
    Fixed {
        stepper: Stepper,
        energy: Energy,
        excitation: Excitation,
        /// The excitation's powers at the start of the step, if the excitation is the same as in the step before.
        powers: Option<Powers>,
    },
    /// Exact flow: the device at the start and at the end of the step.
    Exact { now: Device<'p>, then: Device<'p> },
}

/// A device that moves in steps, with the same functions as a [`Device`].
#[derive(Clone)]
pub(crate) struct Stepped<'p> {
    axis: &'p Axis,
    integrator: StepIntegrator<'p>,
    edge_s: f64,
    /// Clock edges of every step after this one.
    stride: u64,
    drive: Drive,
    /// Whether the excitation follows from the drive and the hand's speed alone, whatever the state.
    settled: bool,
    /// The hand's intended angle and speed from an edge on; `None` if the device already knows them.
    intent: Option<(u64, f64, f64)>,
    intent_rad_per_s: f64,
    /// The present step: its first edge, its length, its state at the start, and at the end (`None` until it is
    /// computed).
    start: u64,
    edges: u64,
    from: State,
    to: Option<State>,
    initial_j: f64,
    steps: u64,
    /// Whether a step has left the range that is modelled; the device then stays where it was before.
    lost: bool,
    /// Current and speed between rows, if the observer asks for them.
    gauge: Option<Box<Gauge<2>>>,
}

/// A step that ends beyond this angle in rad, or position in m, is lost.
pub(crate) const FAR: f64 = 1e6;

impl<'p> Stepped<'p> {
    /// Creates a device at edge 0 with initial current, speed and angle, all gates off.
    pub(crate) fn new(axis: &'p Axis, stepping: Stepping, edge_s: f64, start: [f64; 3]) -> Self {
        let [current_a, speed_rad_per_s, angle_rad] = start;
        let now = Device::new(axis, current_a, speed_rad_per_s, angle_rad);
        let from = now.state(0);
        let drive = now.drive_now();
        let integrator = match stepping.method {
            None => StepIntegrator::Exact { then: now.clone(), now },
            Some(method) => StepIntegrator::Fixed {
                stepper: Stepper::new(axis, method, stepping.edges as f64 * edge_s),
                energy: Energy::default(),
                excitation: axis.excitation(drive, &from, 0.0),
                powers: None,
            },
        };
        Self {
            axis,
            integrator,
            edge_s,
            stride: stepping.edges,
            drive,
            settled: false,
            intent: None,
            intent_rad_per_s: 0.0,
            start: 0,
            edges: stepping.first,
            from,
            to: None,
            initial_j: axis.stored_j(&from),
            steps: 0,
            lost: false,
            gauge: None,
        }
    }

    /// Gathers means of current and speed between rows, and extremes where they are read, from edge 0 on.
    pub(crate) fn measure(&mut self, pace: Pace, read: [bool; 2]) {
        self.gauge = Some(Box::new(Gauge::new(pace, read)));
    }

    /// Returns mean and extremes of current and speed for the row at an edge, at which the state is `x`; both are
    /// linear within a step.
    pub(crate) fn measured(&self, edge: u64, x: &State) -> Option<[Measured; 2]> {
        let gauge = self.gauge.as_deref()?;
        let now = if edge == self.start {
            gauge.clone()
        } else {
            gauge.after(self.start, edge, Some(edge), &self.chord(edge, x))
        };
        Some(now.row(edge, self.edge_s, &[x[0], x[1]]))
    }

    /// Returns the part of the present step up to an edge, where the state is `x`.
    fn chord(&self, edge: u64, x: &State) -> Chord<2> {
        let Self { start, edge_s, from, .. } = *self;
        Chord { start, edges: edge - start, edge_s, ends: [[from[0], from[1]], [x[0], x[1]]] }
    }

    /// Returns the hand's angle and torque in a state.
    pub(crate) fn felt(&self, x: &State) -> [f64; 2] {
        self.axis.felt(x, self.intent_rad_per_s)
    }

    /// Returns the outputs of a state.
    pub(crate) fn shown(&self, x: &State) -> [f64; REALS.len()] {
        self.axis.reals(x)
    }

    #[inline(never)]
    pub(crate) fn state(&self, edge: u64) -> State {
        let Some(to) = &self.to else {
            return if edge == self.start { self.from } else { self.begun().state(edge) };
        };
        let share = (edge - self.start) as f64 / self.edges as f64;
        std::array::from_fn(|k| self.at(share, k, to))
    }

    /// Returns component `k` of the state at a share of the step. Even with rounding it never moves backwards, nor
    /// beyond the end.
    #[inline(always)]
    fn at(&self, share: f64, k: usize, to: &State) -> f64 {
        let (a, b) = (self.from[k], to[k]);
        if share == 1.0 { b } else { (a + (b - a) * share).clamp(a.min(b), a.max(b)) }
    }

    pub(crate) fn reals(&self, edge: u64) -> [f64; REALS.len()] {
        self.shown(&self.state(edge))
    }

    pub(crate) fn intend(&mut self, edge: u64, angle_rad: f64, speed_rad_per_s: f64) {
        self.intent = Some((edge, angle_rad, speed_rad_per_s));
        self.settled = false;
        self.take();
    }

    #[inline(never)]
    pub(crate) fn driven(&mut self, _: u64, drive: Drive) {
        if self.drive != drive {
            self.drive = drive;
            self.settled = false;
            self.take();
        }
    }

    /// Takes over the present drive and the hand's intention. Called between two steps.
    fn take(&mut self) {
        if self.to.is_none() && !(self.settled && self.axis.takes_alike(self.drive)) {
            self.take_anew();
        }
    }

    fn take_anew(&mut self) {
        let edge = self.start;
        let intent = self.intent.take().map(|(since, angle_rad, speed_rad_per_s)| {
            (angle_rad + speed_rad_per_s * ((edge - since) as f64 * self.edge_s), speed_rad_per_s)
        });
        if let Some((_, speed_rad_per_s)) = intent {
            self.intent_rad_per_s = speed_rad_per_s;
        }
        match &mut self.integrator {
            StepIntegrator::Exact { now, .. } => {
                if let Some((angle_rad, speed_rad_per_s)) = intent {
                    now.intend(edge, angle_rad, speed_rad_per_s);
                }
                now.driven(edge, self.drive);
                self.from = now.state(edge);
            }
            StepIntegrator::Fixed { energy, powers, .. } => {
                let mut x = self.from;
                if let Some((angle_rad, speed_rad_per_s)) = intent {
                    x[3] = angle_rad;
                    if self.axis.is_prescribed() {
                        (x[1], x[2]) = (speed_rad_per_s, angle_rad);
                    }
                }
                x = self.axis.taken(self.drive, &x);
                if x != self.from {
                    self.axis.jumped(energy, &self.from, &x);
                    self.from = x;
                    *powers = None;
                }
            }
        }
    }

    /// Returns the device as it will be once the step has begun.
    #[cold]
    fn begun(&self) -> Self {
        let mut begun = self.clone();
        begun.begin();
        begun
    }

    /// Computes the step that begins at the present edge.
    #[inline(always)]
    fn begin(&mut self) {
        let (from, end) = (self.start, self.start + self.edges);
        let to = match &mut self.integrator {
            StepIntegrator::Fixed { stepper, excitation, powers, .. } => {
                if !self.settled {
                    *excitation = self.axis.excitation(self.drive, &self.from, self.intent_rad_per_s);
                    *powers = None;
                    self.settled = self.axis.feeds_alike(self.drive);
                }
                stepper.step(&self.from, excitation)
            }
            StepIntegrator::Exact { now, then } => {
                then.clone_from(now);
                then.flow(from, end)
            }
        };
        self.lost |= !(to.iter().all(|x| x.is_finite()) && to[2].abs() <= FAR);
        self.to = Some(if self.lost { self.from } else { to });
    }

    /// Returns the first edge in (`from`, `to`] at which the step ends or the line leaves the band of angles.
    #[inline(never)]
    pub(crate) fn next_event(&mut self, from: u64, to: u64, (low, high): (f64, f64)) -> Option<Event> {
        if self.to.is_none() {
            self.begin();
        }
        let (there, end) = (self.to?, self.start + self.edges);
        let last = to.min(end);
        let angle = |edge: u64| self.at((edge - self.start) as f64 / self.edges as f64, 2, &there);
        let left = |edge: u64| !(low..high).contains(&angle(edge));
        if left(last) {
            let limit = if there[2] > self.from[2] { high } else { low };
            let guess = (limit - self.from[2]) / (there[2] - self.from[2]) * self.edges as f64;
            let mut edge = self.start.saturating_add(guess as u64).clamp(from + 1, last);
            while edge > from + 1 && left(edge - 1) {
                edge -= 1;
            }
            while !left(edge) {
                edge += 1;
            }
            return Some((edge, self.state(edge)));
        }
        (end <= to).then_some((end, there))
    }

    /// Returns the end of the present step, if it comes by `last` and nothing happens before it: the line stays within
    /// the band.
    #[inline(always)]
    pub(crate) fn passes(&mut self, last: u64, (low, high): (f64, f64)) -> Option<Event> {
        let end = self.start + self.edges;
        if end > last {
            return None;
        }
        if self.to.is_none() {
            self.begin();
        }
        let to = self.to?;
        (!self.lost && to[2] >= low && to[2] < high).then_some((end, to))
    }

    #[inline(always)]
    pub(crate) fn arrive(&mut self, (edge, x): Event) -> State {
        if edge != self.start + self.edges {
            return x;
        }
        if let Some(gauge) = &self.gauge {
            self.gauge = Some(Box::new(gauge.after(self.start, edge, Some(edge), &self.chord(edge, &x))));
        }
        match &mut self.integrator {
            StepIntegrator::Fixed { stepper, energy, excitation, powers } => {
                energy.moved(stepper.step_s(), &self.from, &x);
                let before = powers.unwrap_or_else(|| stepper.powers(&self.from, excitation));
                let after = stepper.powers(&x, excitation);
                stepper.account(energy, stepper.step_s(), &before, &after);
                *powers = self.settled.then_some(after);
            }
            StepIntegrator::Exact { now, then } => now.clone_from(then),
        }
        self.start = edge;
        self.edges = self.stride;
        self.from = x;
        self.to = None;
        self.steps += 1;
        self.take();
        self.from
    }

    #[inline(never)]
    pub(crate) fn step(&mut self, edge: u64) -> State {
        if self.to.is_none() {
            self.begin();
        }
        self.arrive((edge, self.state(edge)))
    }

    pub(crate) fn energy(&self, edge: u64) -> Energy {
        match &self.integrator {
            StepIntegrator::Fixed { stepper, energy, excitation, .. } => {
                let mut energy = *energy;
                let length_s = (edge - self.start) as f64 * self.edge_s;
                energy.moved(length_s, &self.from, &self.state(edge));
                let [from, to] = [self.from, self.state(edge)].map(|x| stepper.powers(&x, excitation));
                stepper.account(&mut energy, length_s, &from, &to);
                energy
            }
            StepIntegrator::Exact { now, .. } => {
                let mut there = now.clone();
                there.flow(self.start, edge);
                there.energy(edge)
            }
        }
    }

    pub(crate) fn stored_j(&self, edge: u64) -> f64 {
        match &self.integrator {
            StepIntegrator::Fixed { .. } => self.axis.stored_j(&self.state(edge)) - self.initial_j,
            StepIntegrator::Exact { now, .. } => {
                let mut there = now.clone();
                self.axis.stored_j(&there.flow(self.start, edge)) - self.initial_j
            }
        }
    }

    /// Returns the number of located changes of mode; a stepping method locates none.
    pub(crate) fn mode_changes(&self) -> u64 {
        match &self.integrator {
            StepIntegrator::Fixed { .. } => 0,
            StepIntegrator::Exact { now, .. } => now.mode_changes(),
        }
    }

    pub(crate) fn steps(&self) -> u64 {
        self.steps
    }

    /// Returns why the motion cannot go on, at the end of the step that was lost.
    pub(crate) fn over(&self) -> Option<&'static str> {
        (self.lost && self.to.is_none()).then_some(DIVERGED)
    }
}

#[cfg(test)]
mod tests;
