//! The energy audit of a network: each flow by its own quadrature.

use super::laws::{COPPER, EMF, GRIP, Touch, VISCOUS, position_of, speed_of};
use super::motion::NetworkDevice;
use super::{FeedKind, Link};
use crate::flow::double::Doubles;
use crate::flow::lanes::{Count, Size};
use crate::flow::leap::Integrals;
use crate::flow::matrix::{ANGLE, CURRENT, INTENT, SPEED, State, dot};
use crate::{Circuit, Hand};

impl<const N: usize> NetworkDevice<'_, N>
where
    Count<N>: Size<N>,
{
    /// Accounts for a stretch of the present mode.
    pub(super) fn tally(&mut self, length_s: f64, from: &Doubles<N>, to: &Doubles<N>, done: &Integrals<State<N>>) {
        let flows = self.flows(length_s, from, to, done);
        let shown = [CURRENT, SPEED, ANGLE, INTENT].map(|index| done.states[index]);
        self.energy.passed(&shown, flows);
    }

    /// Returns source, hand, copper, diodes, viscous and Coulomb friction of a stretch.
    fn flows(&self, length_s: f64, from: &Doubles<N>, to: &Doubles<N>, done: &Integrals<State<N>>) -> [f64; 6] {
        let (laws, net) = (self.laws, &self.laws.net);
        let (feed, squares, charge) = (&net.feed, &done.squares, done.states[CURRENT]);
        let moved = |body: usize| to.lane_since(from, position_of(body));
        let ends = [from, to].map(|x| 0.5 * feed.inductance_h * x.hi[CURRENT] * x.hi[CURRENT]);
        let mut copper = feed.resistance_ohm * squares[COPPER];
        let mut diodes = 0.0;
        let source = match (&feed.kind, self.circuit) {
            (FeedKind::Bridge(bridge), Circuit::Closed { supply_share, diodes: in_path, switches, .. }) => {
                copper = laws.path_ohm(switches) * squares[COPPER];
                diodes = f64::from(in_path) * bridge.diode_drop_v * charge.abs();
                bridge.supply_v * supply_share * charge
            }
            (FeedKind::Bridge(_), _) => 0.0,
            (kind, _) if self.key.limited != 0 => f64::from(self.key.limited) * kind.supply_v() * charge,
            (kind, _) if kind.is_ideal() => copper + laws.drive_constant() * from.hi[CURRENT] * moved(net.driven.0),
            _ => copper + (ends[1] - ends[0]) + laws.drive_constant() * squares[EMF],
        };
        let mut coulomb = 0.0;
        for (&body, slips) in laws.rubs.iter().zip(self.key.slips) {
            coulomb += f64::from(slips) * net.bodies[body].coulomb * moved(body);
        }
        let (grip, units) = net.grip;
        let turned = units * moved(grip);
        let hand = match net.hand {
            Hand::Torque(torque) => torque * turned,
            Hand::Spring(push) => {
                // With y = intent - position and y' = v - speed: ∫ y speed = v ∫ y - Δ(y²)/2.
                let v = self.intent_per_s;
                let gap = |x: &Doubles<N>| x.hi[INTENT] - units * x.hi[position_of(grip)];
                let gaps = done.states[INTENT] - units * done.states[position_of(grip)];
                let spring = v * gaps - 0.5 * (gap(to) - gap(from)) * (gap(to) + gap(from));
                push.stiffness_nm_per_rad * spring + push.damping_nm_s_per_rad * (v * turned - squares[GRIP])
            }
            Hand::Prescribed => {
                let speed = from.hi[speed_of(grip)];
                let friction = net.bodies[grip].coulomb * (speed * length_s).abs();
                coulomb += friction;
                // The hand bears all other torques on a body that keeps its speed.
                let force = dot(&self.mode.borne, &done.states) + self.constants[grip].hi * length_s;
                friction - speed * force
            }
        };
        [source, hand, copper, diodes, squares[VISCOUS], coulomb]
    }

    /// Returns the energy stored in a state, in inductance, inertias and springs.
    pub(super) fn stored_at(&self, x: &State<N>) -> f64 {
        let net = &self.laws.net;
        let mut stored = 0.5 * net.feed.inductance_h * x[CURRENT] * x[CURRENT];
        for (b, body) in net.bodies.iter().enumerate() {
            let (speed, position) = (x[speed_of(b)], x[position_of(b)]);
            stored += 0.5 * body.inertia * speed * speed;
            stored += position * (0.5 * body.spring * position - body.constant);
        }
        for Link { ends: [a, b], ways, stiffness, .. } in &net.links {
            let stretch = ways[0] * x[position_of(*a)] - ways[1] * x[position_of(*b)];
            stored += 0.5 * stiffness * stretch * stretch;
        }
        (0..net.stops.len()).fold(stored, |sum, stop| sum + self.pressed_j(stop, x))
    }

    /// Returns the energy of a stop's spring; 0 of a stop that does not press.
    fn pressed_j(&self, stop: usize, x: &State<N>) -> f64 {
        let Touch::Pressed(side) = self.key.touches[stop] else { return 0.0 };
        let stop = &self.laws.net.stops[stop];
        let depth = x[position_of(stop.body)] - if side < 0 { stop.low } else { stop.high };
        0.5 * stop.stiffness * depth * depth
    }

    /// Accounts for what a stop's spring still holds when the body leaves it, which its damper then takes; less than
    /// nothing when it is pressed again while it still stands back.
    pub(super) fn released(&mut self, stop: usize, touch: Touch, x: &State<N>) {
        let before = self.pressed_j(stop, x);
        self.key.touches[stop] = touch;
        let mut flows = [0.0; 6];
        flows[4] = before - self.pressed_j(stop, x);
        self.energy.take(flows);
    }

    /// Accounts for a jump of a prescribed speed, and of an ideal drive's current.
    pub(super) fn jumped(&mut self, before: &State<N>, after: &State<N>) {
        let grip = self.laws.net.grip.0;
        let speeds = [before, after].map(|x| x[speed_of(grip)]);
        self.energy.jerk(self.laws.net.bodies[grip].inertia, speeds[0], speeds[1]);
        self.energy.surge(self.laws.net.feed.inductance_h, before[CURRENT], after[CURRENT]);
        // The springs at the grip take part in a jump of its position.
        let mut still = *before;
        still[position_of(grip)] = after[position_of(grip)];
        let mut flows = [0.0; 6];
        flows[1] = self.stored_at(&still) - self.stored_at(before);
        self.energy.take(flows);
    }
}
