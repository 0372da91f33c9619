//! The world of an axis in high precision: another hand's reading of the equations of `hpu_plant` and of the wiring around them.
//!
//! Every `f64` that the plant is given (parameters, the clock's period, the hand's knots, a force, the limits of a count) is
//! taken as that very number. The state is stepped from event to event; a step is as good as any other at this precision.

use hpu_cosim::scene::{self, BridgeModel, Datapath, Device, Hand, Scene, Winding};
use hpu_cosim::{COMMAND_BITS, EnergyAudit, Schedule, World};
use hpu_datapath::{LoopIn, LoopOut};
use hpu_signal::Real;

use crate::fixed::Fixed;
use crate::flow::{ANGLE, CURRENT, Flow, SPEED, Vector};
use crate::mean::{Change, Mean};
use crate::shaft::{Friction, Shaft};
use crate::winding::{Bridge, Path};

/// Why a scene is not one of those whose motion is linear from one change of its drive, of what friction does or of what
/// diodes do to the next, if it is not.
pub fn obstacle(scene: &Scene) -> Option<&'static str> {
    let prescribed = matches!(scene.hand, Hand::Prescribed { .. });
    match (&scene.hand, &scene.device, scene.amplifier) {
        (Hand::Capture { .. }, ..) => Some("a recording, without a device"),
        _ if scene.model.datapath == Datapath::Linear => Some("no datapath"),
        _ if !scene.model.solver.is_exact() => Some("steps"),
        _ if scene.model.winding != Winding::Inductive => Some("a winding without inductance"),
        // Of an imposed motion nothing that the electrical side does can be seen.
        _ if prescribed => None,
        _ if matches!(scene.model.friction, scene::Friction::Smoothed { .. }) => Some("smoothed friction"),
        (_, Device::Mass(_), Some(scene::Amplifier { shaper: Some(_), .. })) => Some("an analog shaper"),
        _ => None,
    }
}

#[derive(Clone, Copy)]
enum Drive {
    /// Volts by gates, switching.
    Switching,
    /// Volts by a duty, in the mean of the pulses (see [`Mean`]); without a period at once.
    Averaged { supply_v: f64, full_scale: f64, period: Option<u64> },
    /// Newtons by a command.
    Force { quantum_n: f64 },
    /// Nothing that moves the device.
    None,
}

/// From an edge on the hand means to be at an angle and to move on.
struct Knot {
    edge: u64,
    angle_rad: f64,
    speed_rad_per_s: f64,
}

/// The immutable part.
pub struct Laws<const N: usize> {
    /// Voltage moves the current through none, one or two switches; of a shaft that moves, and of one that is stuck.
    closed: [[Flow<N>; 2]; 3],
    /// The current stays (an open winding, an amplifier), of both.
    still: [Flow<N>; 2],
    bridge: Bridge<N>,
    friction: Friction<N>,
    drive: Drive,
    per_inductance: Fixed<N>,
    torque_per_inertia: Fixed<N>,
    hand_damping_per_inertia: Fixed<N>,
    edge_s: Fixed<N>,
    prescribed: bool,
    knots: Vec<Knot>,
    start: Vector<N>,
    count_rad: f64,
}

impl<const N: usize> Laws<N> {
    /// Of a scene without an [`obstacle`].
    pub fn new(scene: &Scene) -> Self {
        assert_eq!(obstacle(scene), None);
        let prescribed = matches!(scene.hand, Hand::Prescribed { .. });
        let zero = Fixed::ZERO;
        let [resistance, inductance, constant, inertia, viscous] = match &scene.device {
            Device::Motor(motor) => [
                Fixed::of(motor.resistance_ohm),
                Fixed::of(motor.inductance_h),
                Fixed::of(motor.torque_constant_nm_per_a),
                Fixed::of(motor.inertia_kg_m2()),
                Fixed::of(motor.viscous_friction_nm_s_per_rad),
            ],
            Device::Mass(mass) => {
                [zero, Fixed::whole(1), Fixed::whole(1), Fixed::of(mass.mass_kg), Fixed::of(mass.damping_n_s_per_m)]
            }
        };
        let (torque, grip, grip_damping, path) = match &scene.hand {
            Hand::ConstantTorque { torque_nm } => (Fixed::of(*torque_nm), zero, zero, &[][..]),
            Hand::SpringDamper { stiffness_nm_per_rad, damping_nm_s_per_rad, path } => {
                (zero, Fixed::of(*stiffness_nm_per_rad), Fixed::of(*damping_nm_s_per_rad), &path[..])
            }
            Hand::Prescribed { path } => (zero, zero, zero, &path[..]),
            Hand::None | Hand::Capture { .. } => (zero, zero, zero, &[][..]),
        };
        let (per_inductance, per_inertia) = (inductance.reciprocal(), inertia.reciprocal());
        let winding = |switches| {
            let resistance = resistance + Fixed::whole(switches) * Fixed::of(scene.bridge.on_resistance_ohm);
            [-(resistance * per_inductance), -(constant * per_inductance), zero]
        };
        let shaft = [constant * per_inertia, -((viscous + grip_damping) * per_inertia), -(grip * per_inertia)];
        let shaft = if prescribed { [zero; 3] } else { shaft };
        let angle = [zero, Fixed::whole(1), zero];
        let edge_s = scene.clock.period_s();
        let coulomb = match &scene.device {
            _ if prescribed || scene.model.friction == scene::Friction::None => 0.0,
            Device::Motor(motor) => motor.coulomb_friction_nm,
            Device::Mass(mass) => mass.coulomb_n,
        };
        let start = match &scene.device {
            Device::Motor(motor) => [motor.initial_current_a, motor.initial_speed_rad_per_s, motor.initial_angle_rad],
            Device::Mass(mass) => [0.0, mass.initial_speed_m_per_s, mass.initial_position_m],
        };
        let bits = if scene.model.datapath == Datapath::Law { COMMAND_BITS } else { scene.method.pwm.bits };
        let full_scale = 2f64.powi(bits as i32);
        let supply_v = scene.bridge.supply_v;
        let drive = match (&scene.device, scene.model.bridge) {
            _ if prescribed => Drive::None,
            (Device::Mass(_), _) => {
                let amplifier = scene.amplifier.expect("a mass in words has an amplifier");
                Drive::Force { quantum_n: amplifier.full_scale_n / full_scale }
            }
            (_, BridgeModel::Switching) => Drive::Switching,
            (_, BridgeModel::Averaged) => {
                let period = scene.method.pwm.latched.then(|| 1 << scene.method.pwm.bits);
                Drive::Averaged { supply_v, full_scale, period }
            }
        };
        Self {
            closed: [0, 1, 2]
                .map(|switches| [shaft, [zero; 3]].map(|shaft| Flow::new([winding(switches), shaft, angle], edge_s))),
            still: [shaft, [zero; 3]].map(|shaft| Flow::new([[zero; 3], shaft, angle], edge_s)),
            bridge: Bridge {
                supply_v: Fixed::of(supply_v),
                drop_v: Fixed::of(scene.bridge.diode_drop_v),
                constant,
                plus: None,
                minus: None,
            },
            friction: Friction { row: shaft, least: Fixed::of(coulomb) * per_inertia },
            drive,
            per_inductance,
            torque_per_inertia: torque * per_inertia,
            hand_damping_per_inertia: grip_damping * per_inertia,
            edge_s: Fixed::of(edge_s),
            prescribed,
            knots: knots(path, scene),
            start: start.map(Fixed::of),
            count_rad: scene.encoder.count_rad(),
        }
    }
}

/// Where the path starts, and where its speed changes, on the clock.
fn knots(path: &[scene::PathPoint], scene: &Scene) -> Vec<Knot> {
    let edge = |point: &scene::PathPoint| scene.clock.edges(point.time_s);
    let mut knots = Vec::new();
    if let Some(first) = path.first().filter(|first| edge(first) > 0) {
        knots.push(Knot { edge: 0, angle_rad: first.angle_rad, speed_rad_per_s: 0.0 });
    }
    for (index, point) in path.iter().enumerate() {
        let speed_rad_per_s = path.get(index + 1).filter(|next| edge(next) > edge(point)).map_or(0.0, |next| {
            (next.angle_rad - point.angle_rad) / ((edge(next) - edge(point)) as f64 * scene.clock.period_s())
        });
        knots.push(Knot { edge: edge(point), angle_rad: point.angle_rad, speed_rad_per_s });
    }
    knots
}

/// The state of the axis and its encoder, at a clock edge.
#[derive(Clone)]
pub struct PreciseWorld<'p, const N: usize> {
    laws: &'p Laws<N>,
    flow: &'p Flow<N>,
    bridge: Bridge<N>,
    path: Path,
    shaft: Shaft,
    /// Index of the net that is the command.
    command: usize,
    schedule: Schedule,
    edge: u64,
    /// Current, speed, angle relative to `intent`.
    x: Vector<N>,
    g: Vector<N>,
    /// What drives the current: V/L.
    volts_per_henry: Fixed<N>,
    intent: Fixed<N>,
    intent_speed: Fixed<N>,
    knot: usize,
    duty: f64,
    mean: Mean<N>,
    /// A duty that is given from an edge on.
    waiting: Option<(u64, f64)>,
    count: i64,
    crossings: u64,
    mode_changes: u64,
    /// The least that lay between the angle and a limit at the edges on both sides of a crossing.
    pub nearest: f64,
}

impl<'p, const N: usize> PreciseWorld<'p, N> {
    /// At edge 0, all gates off.
    pub fn new(laws: &'p Laws<N>, command: usize, schedule: Schedule) -> Self {
        let zero = Fixed::ZERO;
        let mut world = Self {
            laws,
            flow: &laws.still[0],
            bridge: laws.bridge,
            path: Path::Driven,
            shaft: Shaft::Free,
            command,
            schedule,
            edge: 0,
            x: laws.start,
            g: [zero; 3],
            volts_per_henry: zero,
            intent: zero,
            intent_speed: zero,
            knot: 0,
            duty: 0.0,
            mean: Mean::default(),
            waiting: None,
            count: 0,
            crossings: 0,
            mode_changes: 0,
            nearest: f64::INFINITY,
        };
        world.driven();
        world.due();
        // Not before the hand is where it begins.
        world.settle();
        if let Drive::Switching = laws.drive {
            world.path = world.bridge.path(&world.x);
        }
        world.driven();
        world.count();
        world.crossings = 0;
        world
    }

    pub fn angle(&self) -> Fixed<N> {
        self.x[ANGLE] + self.intent
    }

    /// From the angle to the nearer limit of its count; below zero outside of it.
    pub fn gap(&self) -> Fixed<N> {
        let angle = self.angle();
        (angle - self.limit(self.count)).min(self.limit(self.count + 1) - angle)
    }

    fn limit(&self, count: i64) -> Fixed<N> {
        Fixed::of(count as f64 * self.laws.count_rad)
    }

    /// Counts on to where the angle is.
    fn count(&mut self) {
        let angle = self.angle();
        while angle < self.limit(self.count) {
            self.count -= 1;
            self.crossings += 1;
        }
        while angle >= self.limit(self.count + 1) {
            self.count += 1;
            self.crossings += 1;
        }
    }

    /// The part of the shaft's acceleration that neither the state nor friction makes.
    fn pull(&self) -> Fixed<N> {
        let laws = self.laws;
        if laws.prescribed {
            return Fixed::ZERO;
        }
        laws.torque_per_inertia + laws.hand_damping_per_inertia * self.intent_speed
    }

    /// The shaft slips or is stuck by its state.
    fn settle(&mut self) {
        self.shaft = self.laws.friction.shaft(&self.x, self.pull());
    }

    /// What is constant in the motion from here on: `x' = A x + g`.
    fn driven(&mut self) {
        if self.shaft == Shaft::Stuck {
            // It may be torn off.
            self.settle();
            self.mode_changes += u64::from(self.shaft != Shaft::Stuck);
        }
        let flows = match (&self.laws.drive, self.path) {
            (Drive::Force { .. } | Drive::None, _) | (_, Path::Open) => &self.laws.still,
            (Drive::Averaged { .. }, _) => &self.laws.closed[2],
            (Drive::Switching, path) => &self.laws.closed[self.bridge.drive(path).1],
        };
        if let Drive::Switching = self.laws.drive {
            self.volts_per_henry = self.bridge.drive(self.path).0 * self.laws.per_inductance;
        }
        self.flow = &flows[usize::from(self.shaft == Shaft::Stuck)];
        self.g = [self.volts_per_henry, self.laws.friction.push(self.shaft, self.pull()), -self.intent_speed];
    }

    /// The duty and the hand's knots at this edge.
    fn due(&mut self) {
        if let Some((_, duty)) = self.waiting.filter(|waiting| waiting.0 <= self.edge) {
            self.waiting = None;
            self.average(Fixed::of(duty));
            self.driven();
        }
        while let Some(knot) = self.laws.knots.get(self.knot).filter(|knot| knot.edge <= self.edge) {
            self.knot += 1;
            let angle = if self.laws.prescribed { Fixed::of(knot.angle_rad) } else { self.angle() };
            self.intent = Fixed::of(knot.angle_rad);
            self.intent_speed = Fixed::of(knot.speed_rad_per_s);
            self.x[ANGLE] = angle - self.intent;
            if self.laws.prescribed {
                self.x[SPEED] = self.intent_speed;
            }
            self.driven();
            self.count();
        }
    }

    /// The next edge at which something outside the motion is due.
    fn next_due(&self) -> u64 {
        let knot = self.laws.knots.get(self.knot).map(|knot| knot.edge);
        let duty = self.waiting.map(|waiting| waiting.0);
        knot.into_iter().chain(duty).chain(self.schedule.next(self.edge)).min().unwrap_or(u64::MAX)
    }

    fn average(&mut self, duty: Fixed<N>) {
        let Drive::Averaged { supply_v, .. } = self.laws.drive else { return };
        self.mean.given.push((self.edge, duty));
        self.volts_per_henry = -(Fixed::of(supply_v) * duty * self.laws.per_inductance);
    }

    /// State and intent so many edges on.
    fn ahead(&self, edges: u64) -> (Vector<N>, Fixed<N>) {
        let x = self.flow.after(edges, self.x, &self.g);
        (x, self.intent + self.intent_speed * (Fixed::whole(edges) * self.laws.edge_s))
    }

    fn go(&mut self, edges: u64) {
        (self.x, self.intent) = self.ahead(edges);
        self.edge += edges;
    }

    /// Goes on by the edge in which a mode ends, of the shaft or of the winding, and maybe the next ones too.
    fn turn(&mut self) {
        let mut left = self.laws.edge_s;
        for _ in 0..8 {
            let (pull, friction, bridge) = (self.pull(), self.laws.friction, self.bridge);
            let (shaft, path) = (self.shaft, self.path);
            let end = self.flow.part(left, &self.x, &self.g);
            let rubs = |x: &Vector<N>| friction.margin(shaft, x, pull);
            let leads = |x: &Vector<N>| bridge.margin(path, x);
            let shaft_ends = rubs(&end).is_negative().then(|| self.flow.end(&self.x, &self.g, left, rubs));
            let path_ends = leads(&end).is_negative().then(|| self.flow.end(&self.x, &self.g, left, leads));
            let Some(time) = shaft_ends.into_iter().chain(path_ends).min() else {
                self.x = end;
                self.intent = self.intent + self.intent_speed * left;
                self.edge += 1;
                return;
            };
            self.x = self.flow.part(time, &self.x, &self.g);
            self.intent = self.intent + self.intent_speed * time;
            left = left - time;
            self.mode_changes += 1;
            if shaft_ends == Some(time) {
                self.x[SPEED] = Fixed::ZERO;
                if shaft == Shaft::Stuck {
                    self.shaft = friction.torn_off(&self.x, pull);
                } else {
                    self.settle();
                }
            } else {
                if path != Path::Open {
                    self.x[CURRENT] = Fixed::ZERO;
                }
                self.path = bridge.next(path, &self.x);
            }
            self.driven();
        }
        panic!("modes change without end at edge {}", self.edge);
    }

    fn outside(&self, (x, intent): &(Vector<N>, Fixed<N>)) -> bool {
        let angle = x[ANGLE] + *intent;
        angle < self.limit(self.count) || angle >= self.limit(self.count + 1)
    }

    /// Goes on by so many edges, or to the first of them at which the angle is outside of its count; says whether it is.
    ///
    /// The angle's path is between the parabolas of the greatest acceleration. If neither leaves the count there is no crossing; if
    /// the speed keeps its sign the angle is monotone, so that its end tells, and halving finds the edge. Else the time is halved:
    /// an edge at the last.
    fn cross(&mut self, edges: u64) -> bool {
        let x = self.x.map(Fixed::float);
        // The angle's own speed, relative to nothing.
        let speed = x[SPEED];
        let time_s = self.flow.at_most_s(edges);
        let [surge, bend] = self.flow.fastest(edges, &x, &self.g.map(Fixed::float)).map(|most| most * time_s);
        let angle = self.angle();
        let below = (angle - self.limit(self.count)).float();
        let above = (self.limit(self.count + 1) - angle).float();
        let (slowest, fastest) = (speed - bend, speed + bend);
        let reach = |most: f64| (most.max(0.0) * time_s) * (1.0 + 1e-9);
        let own = if let Shaft::Slips { forward: false } = self.shaft { -fastest } else { slowest };
        let rate = self.flow.rate(&self.x, &self.g);
        let lasts = self.laws.friction.lasts(self.shaft, &self.x, &rate, self.pull(), time_s, own)
            && self.bridge.lasts(self.path, &self.x, surge, bend);
        if lasts && reach(fastest) < above && reach(-slowest) <= below {
            self.go(edges);
            return false;
        }
        if edges == 1 || lasts && (slowest > speed.abs() * 1e-9 || fastest < -speed.abs() * 1e-9) {
            let end = self.ahead(edges);
            let margins =
                [self.laws.friction.margin(self.shaft, &end.0, self.pull()), self.bridge.margin(self.path, &end.0)];
            if margins.iter().any(|margin| margin.is_negative()) {
                let gap = self.gap();
                self.turn();
                let crossed = self.gap().is_negative() || self.angle() == self.limit(self.count + 1);
                if crossed {
                    self.nearest = self.nearest.min(gap.float()).min(self.gap().abs().float());
                }
                return crossed;
            }
            if !self.outside(&end) {
                (self.x, self.intent) = end;
                self.edge += edges;
                return false;
            }
            // Inside here, outside `left` edges on.
            let mut left = edges;
            while left > 1 {
                let half = left / 2;
                let middle = self.ahead(half);
                if self.outside(&middle) {
                    left = half;
                } else {
                    (self.x, self.intent) = middle;
                    self.edge += half;
                    left -= half;
                }
            }
            let gap = self.gap();
            self.go(1);
            self.nearest = self.nearest.min(gap.float()).min(self.gap().abs().float());
            return true;
        }
        self.cross(edges / 2) || self.cross(edges - edges / 2)
    }
}

impl<const N: usize> World for PreciseWorld<'_, N> {
    type In = LoopIn<i64>;
    type Out = LoopOut<i64>;
    type Row = [f64; 3];
    const REALS: &'static [Real] = &[
        Real { name: "current_a", doc: "Motor current" },
        Real { name: "speed_rad_per_s", doc: "Speed of the shaft" },
        Real { name: "angle_rad", doc: "Angle of the shaft" },
    ];

    fn edge(&self) -> u64 {
        self.edge
    }

    fn place(&self, input: &mut LoopIn<i64>) {
        // Forward, line B leads.
        [input.a_pin, input.b_pin] = [[0, 0], [0, 1], [1, 1], [1, 0]][self.count.rem_euclid(4) as usize];
        if let Some(ramp) = self.schedule.stiffness {
            input.stiffness = ramp.word(self.edge);
        }
        if let Some(ramp) = self.schedule.scale {
            input.scale = ramp.word(self.edge);
        }
    }

    fn sense(&mut self) {
        self.advance(self.edge + 1, |_, _| {});
    }

    fn advance(&mut self, limit: u64, before: impl FnOnce(&Self, u64)) {
        let last = self.next_due().min(limit);
        let mut next = self.clone();
        let mut crossed = false;
        while !crossed && next.edge < last {
            crossed = next.cross(self.flow.window().min(last - next.edge));
        }
        before(self, next.edge);
        *self = next;
        if crossed {
            self.count();
        }
        self.due();
    }

    fn drive(&mut self, out: LoopOut<i64>, words: &[i64]) {
        let laws = self.laws;
        match laws.drive {
            Drive::None => return,
            Drive::Force { quantum_n } => self.x[CURRENT] = -Fixed::of(words[self.command] as f64 * quantum_n),
            Drive::Averaged { full_scale, period, .. } => {
                let duty = words[self.command] as f64 / full_scale;
                if duty == self.duty {
                    return;
                }
                self.duty = duty;
                let Some(period) = period else {
                    self.average(Fixed::of(duty));
                    self.driven();
                    return;
                };
                self.waiting = None;
                match self.mean.change(self.edge, period, duty) {
                    Change::At(edge) => self.waiting = Some((edge, duty)),
                    Change::Now(given, end) => {
                        self.waiting = Some((end, duty));
                        self.average(given);
                    }
                }
            }
            Drive::Switching => {
                // Leg B feeds the motor's plus terminal.
                let leg = |high, low| match (high, low) {
                    (1, 0) => Some(true),
                    (0, 1) => Some(false),
                    (0, 0) => None,
                    both => panic!("gates {both:?} of a leg"),
                };
                (self.bridge.plus, self.bridge.minus) = (leg(out.b_high, out.b_low), leg(out.a_high, out.a_low));
                self.path = self.bridge.path(&self.x);
            }
        }
        self.driven();
    }

    fn reals(&self, edge: u64) -> [f64; 3] {
        let (x, intent) = self.ahead(edge - self.edge);
        [x[CURRENT], x[SPEED], x[ANGLE] + intent].map(Fixed::float)
    }

    fn audit(&self) -> EnergyAudit {
        EnergyAudit::default()
    }

    fn encoder_edges(&self) -> u64 {
        self.crossings
    }

    fn mode_changes(&self) -> u64 {
        self.mode_changes
    }
}
