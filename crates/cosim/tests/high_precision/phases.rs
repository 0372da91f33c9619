//! A motor of three phases behind field-oriented control, integrated with 57 places.
//!
//! The loop of `foc-wall` is clocked edge by edge around [`Motor`], which shares no code with the engine's plant: the
//! currents stand in the stator's frame, the field's angle as its cosine and sine, and a segment is one Taylor series
//! of order [`ORDER`] from one clock edge to another. Zeros of a phase's current, open terminals that reach a diode,
//! and stick and slip of friction end a segment at instants found to all places. Beside it the engine runs by events.
//! All outputs must be the same at each edge, and all nets at each edge that the engine ticks: then each gate, each
//! start and word of a converter, each word of the angle and each count of the encoder falls on the same clock.

use std::fmt;

use hpu_cosim::scene::{Experiment, FocScene, Hand, Reading, Sampled, SceneFile, SensorKind};
use hpu_cosim::{FocSimulation, Simulation, Wired};
use hpu_signal::{Cycle, Observe};

use crate::fixed::Fixed;

type F = Fixed<4>;

/// The order of the series.
const ORDER: usize = 24;
/// The greatest last term of a series that passes: the terms left out are smaller still.
const LEFT_OUT: f64 = 1e-42;
/// The longest segment, in clock edges.
const LONGEST: u64 = 500;
/// The size below which a condition is taken to begin at 0.
const ZERO: f64 = 1e-30;

/// The path of a terminal: through a switch to the supply or to ground, through the upper or the lower diode, or none.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Path {
    High,
    Low,
    Upper,
    Lower,
    Floats,
}

use Path::{Floats, High, Low, Lower, Upper};

/// Friction: slip in a direction, or stuck.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Rub {
    Slips(i8),
    Sticks,
}

/// The end of a segment.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum End {
    /// The current of a phase behind a diode comes to 0.
    Zero(usize),
    /// An open terminal reaches a diode.
    Opens(usize, Path),
    /// Of three open terminals, the highest and the lowest reach their diodes.
    Both(usize, usize),
    Stops,
    Breaks(i8),
}

type Series = [F; ORDER];

/// The series of a segment, in powers of the share of the segment.
#[derive(Clone)]
struct Terms {
    alpha: Series,
    beta: Series,
    speed: Series,
    angle: Series,
    cosine: Series,
    sine: Series,
    phases: [Series; 3],
    /// Terminals against ground, or of three open ones the rates of their flux.
    terminals: [Series; 3],
    torque: Series,
}

fn at(series: &Series, share: F) -> F {
    series.iter().rev().fold(F::ZERO, |sum, term| sum * share + *term)
}

fn product(one: &Series, other: &Series, order: usize) -> F {
    (0..=order).fold(F::ZERO, |sum, k| sum + one[k] * other[order - k])
}

/// A motor and its inverter with a hand, between two clock edges.
#[derive(Clone)]
struct Motor {
    edge_s: F,
    /// `1 / k` of each order.
    parts: Series,
    half: F,
    third: F,
    root: F,
    pairs: F,
    resistance: F,
    inductance: F,
    /// `1 / L` and `1 / 2 L`.
    by: [F; 2],
    flux: F,
    by_inertia: F,
    viscous: F,
    coulomb: F,
    stiction: F,
    supply: F,
    on: F,
    drop: F,
    stiffness: F,
    damping: F,
    /// Time in edges: a whole number, and the rest.
    edge: u64,
    rest: F,
    currents: [F; 2],
    speed: F,
    angle: F,
    field: [F; 2],
    /// The hand's intention at an edge, and its speed.
    intent: (u64, F, F),
    legs: [Path; 3],
    paths: [Path; 3],
    resting: [bool; 3],
    rub: Rub,
    /// Ends of segments by the circuit and by friction.
    changes: u64,
    rubs: u64,
}

impl Motor {
    fn new(scene: &FocScene) -> Self {
        let motor = &*scene.pmsm;
        let (whole, of) = (F::whole, F::of);
        let [direct, across] = motor.inductance_h;
        let is_plain = direct == across && motor.cogging.is_empty() && motor.supply_ohm == 0.0;
        assert!(is_plain && motor.start == [0.0; 2], "this motor is not written here");
        let Hand::SpringDamper { stiffness_nm_per_rad, damping_nm_s_per_rad, .. } = scene.hand else {
            panic!("a hand with a spring")
        };
        let third = whole(3).reciprocal();
        // 1/sqrt(3), by Newton's iteration.
        let half = of(0.5);
        let by_root =
            (0..6).fold(of(1.0 / 3f64.sqrt()), |guess, _| guess * (whole(3) - whole(3) * guess * guess) * half);
        let mut parts = [F::ZERO; ORDER];
        (1..ORDER).for_each(|k| parts[k] = whole(k as u64).reciprocal());
        Self {
            edge_s: of(scene.head.clock.period_s()),
            parts,
            half,
            third,
            root: whole(3) * by_root,
            pairs: whole(motor.pole_pairs.into()),
            resistance: of(motor.resistance_ohm),
            inductance: of(direct),
            by: [of(direct).reciprocal(), (whole(2) * of(direct)).reciprocal()],
            flux: of(motor.flux_wb),
            by_inertia: of(motor.inertia_kg_m2).reciprocal(),
            viscous: of(motor.viscous_nm_s_per_rad),
            coulomb: of(motor.coulomb_nm),
            stiction: of(motor.stiction_nm),
            supply: of(scene.bridge.supply_v),
            on: of(scene.bridge.on_resistance_ohm),
            drop: of(scene.bridge.diode_drop_v),
            stiffness: of(stiffness_nm_per_rad),
            damping: of(damping_nm_s_per_rad),
            edge: 0,
            rest: F::ZERO,
            currents: [F::ZERO; 2],
            speed: F::ZERO,
            angle: F::ZERO,
            field: [whole(1), F::ZERO],
            intent: (0, F::ZERO, F::ZERO),
            legs: [Floats; 3],
            paths: [Floats; 3],
            resting: [true; 3],
            rub: Rub::Sticks,
            changes: 0,
            rubs: 0,
        }
    }

    /// Returns the components of two axes along a phase.
    fn along(&self, phase: usize, [alpha, beta]: [F; 2]) -> F {
        let across = self.half * self.root * beta;
        match phase {
            0 => alpha,
            1 => across - self.half * alpha,
            _ => -across - self.half * alpha,
        }
    }

    /// Returns the two axes of words of the phases.
    fn axes(&self, [a, b, c]: [F; 3]) -> [F; 2] {
        [self.third * (F::whole(2) * a - b - c), self.third * self.root * (b - c)]
    }

    fn joined(&self) -> Vec<usize> {
        (0..3).filter(|x| self.paths[*x] != Floats).collect()
    }

    /// Returns the series up to so many seconds from now on.
    fn series(&self, span_s: F) -> Terms {
        let none = [F::ZERO; ORDER];
        let mut t = Terms {
            alpha: none,
            beta: none,
            speed: none,
            angle: none,
            cosine: none,
            sine: none,
            phases: [none; 3],
            terminals: [none; 3],
            torque: none,
        };
        let joined = self.joined();
        [t.alpha[0], t.beta[0]] = if joined.len() < 2 { [F::ZERO; 2] } else { self.currents };
        (t.speed[0], t.angle[0]) = (self.speed, self.angle);
        [t.cosine[0], t.sine[0]] = self.field;
        let pull = self.paths.map(|path| match path {
            High => self.supply,
            Upper => self.supply + self.drop,
            Lower => -self.drop,
            Low | Floats => F::ZERO,
        });
        let on = self.paths.map(|path| if matches!(path, High | Low) { self.on } else { F::ZERO });
        let (told, place, pace) = self.intent;
        let since = (F::whole(self.edge - told) + self.rest) * self.edge_s;
        let mut loop_current = none;
        if let [y, z] = joined[..] {
            let [of_y, of_z] = [y, z].map(|x| self.along(x, self.currents));
            loop_current[0] = self.half * (of_y - of_z);
        }
        for k in 0..ORDER {
            let (first, next) = (k == 0, k + 1 < ORDER);
            let step = if next { span_s * self.parts[k + 1] } else { F::ZERO };
            let turn = self.pairs * product(&t.cosine, &t.speed, k);
            let lean = self.pairs * product(&t.sine, &t.speed, k);
            let induced = [-(self.flux * lean), self.flux * turn];
            let induced = [0, 1, 2].map(|x| self.along(x, induced));
            if let [y, z] = joined[..] {
                let mut of = [F::ZERO; 3];
                (of[y], of[z]) = (loop_current[k], -loop_current[k]);
                [t.alpha[k], t.beta[k]] = self.axes(of);
            }
            let current = [0, 1, 2].map(|x| self.along(x, [t.alpha[k], t.beta[k]]));
            (0..3).for_each(|x| t.phases[x][k] = current[x]);
            let volts = |x: usize| (if first { pull[x] } else { F::ZERO }) - on[x] * current[x];
            match joined[..] {
                [_, _, _] => {
                    let [alpha, beta] =
                        self.axes([0, 1, 2].map(|x| volts(x) - induced[x] - self.resistance * current[x]));
                    if next {
                        t.alpha[k + 1] = alpha * self.by[0] * step;
                        t.beta[k + 1] = beta * self.by[0] * step;
                    }
                }
                [y, z] => {
                    let over = volts(y) - volts(z) - (induced[y] - induced[z]);
                    let rate = (over - F::whole(2) * self.resistance * loop_current[k]) * self.by[1];
                    if next {
                        loop_current[k + 1] = rate * step;
                    }
                    let star = volts(y) - self.resistance * loop_current[k] - self.inductance * rate - induced[y];
                    (0..3).for_each(|x| t.terminals[x][k] = star + induced[x]);
                }
                _ => (0..3).for_each(|x| t.terminals[x][k] = induced[x]),
            }
            let across = product(&t.cosine, &t.beta, k) - product(&t.sine, &t.alpha, k);
            let (intent, its_speed) = match k {
                0 => (place + pace * since, pace),
                1 => (pace * span_s, F::ZERO),
                _ => (F::ZERO, F::ZERO),
            };
            t.torque[k] = F::whole(3) * self.half * self.pairs * self.flux * across
                + self.stiffness * (intent - t.angle[k])
                + self.damping * (its_speed - t.speed[k]);
            if next {
                let slip = match self.rub {
                    Rub::Slips(sign) if first => {
                        if sign > 0 {
                            self.coulomb
                        } else {
                            -self.coulomb
                        }
                    }
                    _ => F::ZERO,
                };
                let net = t.torque[k] - self.viscous * t.speed[k] - slip;
                t.speed[k + 1] = if self.rub == Rub::Sticks { F::ZERO } else { net * self.by_inertia * step };
                t.angle[k + 1] = t.speed[k] * step;
                t.cosine[k + 1] = -(lean * step);
                t.sine[k + 1] = turn * step;
            }
        }
        for series in [&t.alpha, &t.beta, &t.speed, &t.angle, &t.cosine, &t.sine] {
            assert!(series[ORDER - 1].float().abs() < LEFT_OUT, "a segment of {} s is too long", span_s.float());
        }
        t
    }

    /// Returns series that stay positive while the segment lasts, each with what ends it.
    fn conditions(&self, t: &Terms) -> Vec<(Series, End)> {
        let negated = |series: &Series| series.map(|term| -term);
        let from = |begin: F, series: &Series| {
            let mut series = *series;
            series[0] = series[0] + begin;
            series
        };
        let mut all = Vec::new();
        for x in 0..3 {
            match self.paths[x] {
                Lower => all.push((t.phases[x], End::Zero(x))),
                Upper => all.push((negated(&t.phases[x]), End::Zero(x))),
                Floats if self.paths == [Floats; 3] => {
                    for y in (0..3).filter(|y| *y != x) {
                        let mut apart = t.terminals[y];
                        (0..ORDER).for_each(|k| apart[k] = apart[k] - t.terminals[x][k]);
                        all.push((from(self.supply + F::whole(2) * self.drop, &apart), End::Both(x, y)));
                    }
                }
                Floats => {
                    all.push((from(self.drop, &t.terminals[x]), End::Opens(x, Lower)));
                    all.push((from(self.supply + self.drop, &negated(&t.terminals[x])), End::Opens(x, Upper)));
                }
                High | Low => {}
            }
        }
        match self.rub {
            Rub::Sticks => {
                all.push((from(self.stiction, &negated(&t.torque)), End::Breaks(1)));
                all.push((from(self.stiction, &t.torque), End::Breaks(-1)));
            }
            Rub::Slips(1) => all.push((t.speed, End::Stops)),
            Rub::Slips(_) => all.push((negated(&t.speed), End::Stops)),
        }
        all
    }

    /// Finds the paths of all terminals, some of which are known.
    fn settle(&mut self, known: &[(usize, Path)]) {
        if self.resting.iter().filter(|rests| **rests).count() > 1 {
            (self.resting, self.currents) = ([true; 3], [F::ZERO; 2]);
        }
        for x in 0..3 {
            let flows = self.along(x, self.currents);
            self.paths[x] = match self.legs[x] {
                Floats if self.resting[x] => Floats,
                Floats if flows > F::ZERO => Lower,
                Floats => Upper,
                leg => leg,
            };
        }
        known.iter().for_each(|(x, path)| self.paths[*x] = *path);
        for _ in 0..4 {
            if !self.paths.contains(&Floats) {
                return;
            }
            let conditions = self.conditions(&self.series(self.edge_s)).into_iter();
            let circuit = conditions.filter(|(_, end)| matches!(end, End::Opens(..) | End::Both(..)));
            let broken = circuit.filter(|(series, _)| series[0].float() < -ZERO);
            match broken.min_by_key(|(series, _)| series[0]) {
                Some((_, End::Opens(x, path))) => self.paths[x] = path,
                Some((_, End::Both(x, y))) => (self.paths[x], self.paths[y]) = (Upper, Lower),
                _ => return,
            }
        }
    }

    fn rub(&mut self, breaks: Option<i8>) {
        let sign = |number: F| if number > F::ZERO { 1 } else { -1 };
        self.rub = if self.speed != F::ZERO {
            Rub::Slips(sign(self.speed))
        } else if let Some(sign) = breaks {
            Rub::Slips(sign)
        } else {
            self.rub = Rub::Sticks;
            let torque = self.series(self.edge_s).torque[0];
            if torque.abs() > self.stiction { Rub::Slips(sign(torque)) } else { Rub::Sticks }
        };
    }

    /// Moves on to a clock edge.
    fn go(&mut self, until: u64) {
        while self.edge < until {
            let target = until.min(self.edge + LONGEST);
            let edges = F::whole(target - self.edge) - self.rest;
            let terms = self.series(edges * self.edge_s);
            let mut first = (F::whole(1), None);
            for (series, end) in self.conditions(&terms) {
                if let Some(share) = crossing(&series, first.0) {
                    first = (share, Some(end));
                }
            }
            let (share, end) = first;
            self.currents = [at(&terms.alpha, share), at(&terms.beta, share)];
            (self.speed, self.angle) = (at(&terms.speed, share), at(&terms.angle, share));
            self.field = [at(&terms.cosine, share), at(&terms.sine, share)];
            let Some(end) = end else {
                (self.edge, self.rest) = (target, F::ZERO);
                continue;
            };
            self.rest = self.rest + share * edges;
            while self.rest >= F::whole(1) {
                (self.edge, self.rest) = (self.edge + 1, self.rest - F::whole(1));
            }
            self.resting = self.paths.map(|path| path == Floats);
            let (known, breaks): (&[(usize, Path)], _) = match end {
                End::Zero(x) => {
                    self.resting[x] = true;
                    (&[], None)
                }
                End::Opens(x, path) => (&[(x, path)], None),
                End::Both(x, y) => (&[(x, Upper), (y, Lower)], None),
                End::Stops => {
                    self.speed = F::ZERO;
                    (&[], None)
                }
                End::Breaks(sign) => (&[], Some(sign)),
            };
            if matches!(end, End::Stops | End::Breaks(_)) {
                self.rubs += 1;
            } else {
                self.changes += 1;
                self.settle(known);
            }
            self.rub(breaks);
        }
    }

    fn switch(&mut self, legs: [Path; 3]) {
        self.resting = self.paths.map(|path| path == Floats);
        if self.currents == [F::ZERO; 2] {
            self.resting = [true; 3];
        }
        self.legs = legs;
        self.settle(&[]);
        self.rub(None);
    }
}

/// Returns the first share of a segment below `most` at which a series becomes negative.
fn crossing(series: &Series, most: F) -> Option<F> {
    const LOOKS: i32 = 24;
    let terms = series.map(Fixed::float);
    let (begin, rest) = (terms[0], terms[1..].iter().map(|term| term.abs()).sum::<f64>());
    let is_small = begin.abs() < ZERO;
    if begin > rest && !is_small {
        return None;
    }
    let value = |share: f64| terms.iter().rev().fold(0.0, |sum, term| sum * share + term);
    let start = if is_small { 1e-6 * most.float() } else { 0.0 };
    // Near its beginning a series that begins at 0 has the sign of its first term that is not.
    if value(start) < 0.0 {
        return Some(F::ZERO);
    }
    let looks = (0..=LOOKS).map(|look| start + (most.float() - start) * f64::from(look) / f64::from(LOOKS));
    let looks: Vec<_> = looks.collect();
    let (mut low, mut high) = looks.windows(2).map(|pair| (pair[0], pair[1])).find(|pair| value(pair.1) < 0.0)?;
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        *(if value(middle) < 0.0 { &mut high } else { &mut low }) = middle;
    }
    let slope = (1..ORDER).rev().fold(0.0, |sum, k| sum * high + k as f64 * terms[k]);
    let by = F::of(1.0 / slope);
    let share = (0..8).fold(F::of(high), |share, _| share - at(series, share) * by);
    (share < most).then_some(share)
}

/// The words of all nets at the latest edge that the engine has ticked.
#[derive(Default)]
struct Ticked {
    edge: u64,
    words: Vec<i64>,
}

impl Observe for Ticked {
    fn nets(&mut self, cycle: Cycle, words: &[i64]) {
        self.edge = cycle.0;
        self.words.clear();
        self.words.extend_from_slice(words);
    }
    fn reals(&mut self, _: Cycle, _: &[f64]) {}
}

/// A sensor that samples words, of which one at the most is on its way.
struct Converter<'s> {
    of: &'s Sampled,
    next: u64,
    waiting: Option<(u64, i64)>,
    shown: i64,
    taken: u64,
}

impl<'s> Converter<'s> {
    fn new(scene: &'s FocScene, sensor: usize) -> Self {
        let SensorKind::Sampled(of) = &scene.pmsm.sensors[sensor].kind else { panic!("a sensor with words") };
        let is_plain = of.inl.is_empty() && of.noise == 1 && of.offset == 0 && of.zero_of == 0 && !of.offset_binary;
        assert!(is_plain && of.lag_rad_per_s.is_none() && of.ready == 0, "this sensor is not written here");
        Self { of, next: if of.triggered { u64::MAX } else { of.phase }, waiting: None, shown: 0, taken: 0 }
    }

    /// Takes a sample of a reading at an edge.
    fn take(&mut self, edge: u64, reading: F) {
        // The greatest whole number of counts below it, found from the `f64` beside it.
        let counts = reading * F::of(self.of.scale / 65536.0);
        let near = counts.float().floor();
        let word =
            (-1..=1).map(|by| near + f64::from(by)).rfind(|word| F::of(*word) <= counts).expect("a count") as i64;
        let half = 1i64 << (self.of.bits - 1);
        let word = match self.of.reading {
            Reading::Position(_) => word & (2 * half - 1),
            _ => word.clamp(-half, half - 1),
        };
        assert!(self.waiting.is_none(), "two samples on their way");
        (self.waiting, self.taken) = (Some((edge + self.of.latency, word)), self.taken + 1);
    }

    fn come(&mut self, edge: u64) {
        if let Some((_, word)) = self.waiting.take_if(|(comes, _)| *comes <= edge) {
            self.shown = word;
        }
    }
}

/// The encoder beside the absolute sensor.
struct Encoder {
    step: F,
    count: i64,
    /// The edge up to which the count is that of now, unless something acts on the motor before.
    known: u64,
    counted: u64,
}

impl Encoder {
    /// Returns the count at an edge at which the motor has not come yet.
    fn ahead(&self, motor: &Motor, edge: u64) -> i64 {
        let (mut motor, mut count) = (motor.clone(), self.count);
        motor.go(edge);
        while motor.angle < F::of(count as f64) * self.step {
            count -= 1;
        }
        while motor.angle >= F::of((count + 1) as f64) * self.step {
            count += 1;
        }
        count
    }

    /// Finds the count at an edge. Nothing acts on the motor before that edge, nor before the edge `until` but a gate.
    /// The first edge with another count lies in a segment whose end has another one.
    fn follow(&mut self, motor: &Motor, edge: u64, until: u64) {
        while self.known < edge {
            let target = (self.known + LONGEST).min(until).max(edge);
            if self.ahead(motor, target) == self.count {
                self.known = target;
                continue;
            }
            let count = self.ahead(motor, edge);
            self.counted += u64::from(count != self.count);
            (self.count, self.known) = (count, edge);
        }
    }
}

/// The figures of a comparison.
#[derive(Debug, Default)]
pub struct Agreed {
    pub edges: u64,
    pub ticks: u64,
    pub gates: u64,
    pub currents: u64,
    pub angles: u64,
    pub counts: u64,
    pub circuit: u64,
    pub friction: u64,
    /// The number of states compared, one a millisecond, and the greatest differences of angle, speed and current
    /// across the field.
    pub states: u64,
    pub off: [f64; 3],
}

impl fmt::Display for Agreed {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { edges, ticks, gates, currents, angles, counts, circuit, friction, states, off } = self;
        writeln!(f, "{edges:>12} clock edges, at each of which all outputs are the same")?;
        writeln!(f, "{ticks:>12} edges that the engine ticks, at each of which all nets are the same")?;
        writeln!(f, "{gates:>12} switchings of legs\n{currents:>12} samples of currents")?;
        writeln!(f, "{angles:>12} samples of the angle\n{counts:>12} counts of the encoder")?;
        writeln!(f, "{circuit:>12} changes of the circuit, {friction} of friction, at instants between clock edges")?;
        let [angle, speed, current] = off;
        write!(
            f,
            "{states:>12} states, one a millisecond, within {angle:.1e} rad, {speed:.1e} rad/s and {current:.1e} A"
        )
    }
}

/// Clocks the loop of `foc-wall` around the motor beside the engine, for so many milliseconds.
pub fn foc_wall(milliseconds: u64) -> Agreed {
    let set = [("run.duration".to_string(), format!("{milliseconds} ms"))];
    let Experiment::Foc(scene) = SceneFile::find("foc-wall").unwrap().parse(&set).unwrap() else { panic!("a FOC") };
    let simulation = FocSimulation::new(&scene).unwrap();
    let mut engine = simulation.closed_loop();
    let (mut wiring, constants) = (engine.wiring_copy(), engine.constants());
    let nets = simulation.nets();
    let net = |name: &str| nets.iter().position(|net| net.name == name).unwrap();
    let [a_pin, b_pin, code, enable, i_a, i_b] = ["a_pin", "b_pin", "code", "enable", "i_a", "i_b"].map(net);
    let gates = ["a_high", "a_low", "b_high", "b_low", "c_high", "c_low"].map(net);
    let (trigger, outputs) = (net("trigger"), net("a_high")..net("trigger") + 1);

    let mut motor = Motor::new(&scene);
    let position = scene.method.position.expect("an absolute sensor");
    let mut phases = scene.method.currents.map(|sensor| Converter::new(&scene, sensor));
    let mut absolute = Converter::new(&scene, position);
    let enabled = scene.head.clock.edges(scene.method.enable_after_s);
    let path = scene.hand.path();
    let turns: Vec<_> = path.iter().map(|(time_s, _)| scene.head.clock.edges(*time_s)).collect();
    let mut encoder = Encoder { step: F::of(scene.encoder.count_rad()), count: 0, known: 0, counted: 0 };
    let (mut agreed, mut ticked, mut before) = (Agreed::default(), Ticked::default(), Ticked::default());
    let mut input = constants;
    let (mut legs, mut started) = ([Floats; 3], 0);
    before.words = wiring.words().to_vec();
    let end = simulation.edges();
    let row_edges = scene.head.clock.edges(1e-3);
    for edge in 0..=end {
        if let Some(at) = turns.iter().position(|turn| *turn == edge) {
            motor.go(edge);
            let pace = path.get(at + 1).map_or(0.0, |(time_s, angle)| (angle - path[at].1) / (time_s - path[at].0));
            motor.intent = (edge, F::of(path[at].1), F::of(pace));
            motor.rub(None);
            encoder.known = edge;
        }
        if edge == absolute.next {
            motor.go(edge);
            absolute.take(edge, motor.angle);
            absolute.next += absolute.of.period;
        }
        for converter in phases.iter_mut().chain([&mut absolute]) {
            converter.come(edge);
        }
        if edge == 0 {
            continue;
        }
        let turn = turns.iter().copied().find(|turn| *turn >= edge).unwrap_or(end);
        encoder.follow(&motor, edge, absolute.next.min(turn).min(end));
        let count = encoder.count;
        (input[a_pin], input[b_pin]) = ((count & 3) >> 1, (count & 3) >> 1 ^ count & 1);
        (input[i_a], input[i_b], input[code]) = (phases[0].shown, phases[1].shown, absolute.shown);
        input[enable] = i64::from(edge >= enabled);
        wiring.step(&input);

        while ticked.edge < edge && engine.edge() < end {
            std::mem::swap(&mut before, &mut ticked);
            ticked.edge = before.edge;
            ticked.words.clone_from(&before.words);
            engine.leap(end, &mut ticked);
        }
        let words = wiring.words();
        let expected = if ticked.edge == edge { &ticked } else { &before };
        assert_eq!(words[outputs.clone()], expected.words[outputs.clone()], "outputs at edge {edge}");
        if ticked.edge == edge {
            let off = words.iter().zip(&ticked.words).position(|(one, other)| one != other);
            let off = off.map(|net| (nets[net].name, words[net], ticked.words[net]));
            assert_eq!(off, None, "a net at edge {edge}, here and in the engine");
            agreed.ticks += 1;
        }

        let now = [0, 1, 2].map(|x| match [words[gates[2 * x]], words[gates[2 * x + 1]]] {
            [0, 0] => Floats,
            [1, 0] => High,
            _ => Low,
        });
        if now != legs {
            agreed.gates += (0..3).filter(|x| now[*x] != legs[*x]).count() as u64;
            motor.go(edge);
            motor.switch(now);
            (legs, encoder.known) = (now, edge);
        }
        if words[trigger] > std::mem::replace(&mut started, words[trigger]) {
            motor.go(edge);
            for (x, converter) in phases.iter_mut().enumerate() {
                converter.take(edge, motor.along(x, motor.currents));
            }
        }
        if edge % row_edges == 0 && engine.world().edge() >= edge {
            agreed.states += 1;
            motor.go(edge);
            let mut row = Vec::new();
            engine.world().exact(edge, &mut row);
            let [cosine, sine] = motor.field;
            let across = cosine * motor.currents[1] - sine * motor.currents[0];
            let column = |name: &str| simulation.reals().iter().position(|real| real.name == name).unwrap();
            let columns = ["angle_rad", "speed_rad_per_s", "current_a"].map(column);
            for ((off, own), column) in agreed.off.iter_mut().zip([motor.angle, motor.speed, across]).zip(columns) {
                *off = off.max((own.float() - row[column]).abs());
            }
        }
    }
    Agreed {
        edges: end,
        currents: phases.iter().map(|converter| converter.taken).sum(),
        angles: absolute.taken,
        counts: encoder.counted,
        circuit: motor.changes,
        friction: motor.rubs,
        ..agreed
    }
}
