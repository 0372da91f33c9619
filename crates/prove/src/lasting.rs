//! A proof that no count of the encoder ever arrives again, for a motor at rest under pulses that repeat.
//!
//! Where the latest count has passed through all registers, the command is constant and the modulator's pulses repeat
//! until the next count. Motor and hand are then a linear system under a periodic voltage. Both phases of a period have
//! the same plant if closed switches carry the current in both, so the motion is the periodic one plus a deviation that
//! dies out. Two facts bound it:
//!
//! - The deviation's energy, `L i² + J ω² + k θ²` over two, never grows: winding, friction and the hand's damper
//!   only take from it. So its angle never exceeds the root of twice its energy over the hand's stiffness `k`.
//! - Some power of two of the period at least halves every deviation, which is proved for its map. A state that a
//!   period moves by `r` is then within `2 n |r|` of the periodic one, after `n` periods.
//!
//! So a state is computed in `f64` that a period almost leaves as it is, and all else in intervals: where a period
//! takes it, what angles it passes, and how far the device is from it. If all of that stays inside the count, no count
//! ever arrives. The proof is about the motion of real numbers from the emulator's state on, rounded once.
//!
//! A shaft that friction holds has a current alone, and stays as long as its torque is below friction's.
//!
//! # From the emulator's recurrence to the model's
//!
//! A state that comes back to the last bit is the emulator's, which rounds. Let its rounding in one period move the
//! motion by at most `e`. The motion of real numbers under the same words then has a state that comes back exactly, and
//! it stays within `2 n e` of the emulator's, if `n` periods at least halve every deviation. It has the same words if
//! no decision falls otherwise so near to it. All decisions of the emulator are made in `f64` where the value is
//! farther from the limit than twice a bound of its error, of which 2⁻⁵² of a count is a part; so where none had to be
//! made again in double-double, a deviation of 2⁻⁵³ counts changes none. What `e` is, is tested and not proved: a flow
//! of the device over `t` is taken to err by no more than 2⁻⁹⁵ of its state, and as much for each `1/‖A‖` of `t`. A
//! test of the device holds it to that, against arithmetic of 80 digits (`a_flow_has_thirty_digits`).

use std::array::from_fn;

use hpu_cosim::scene::{Device, Experiment, Friction, Hand, Motor, Scene, Winding};
use hpu_cosim::{Beyond, InContact, Period, Quiet, Rest};
#[cfg(not(target_family = "wasm"))]
use hpu_cosim::{Forever, NotTold, scene::TransferScene};

use hpu_datapath::Instance;
use hpu_signal::{Signal, Word as _};

use crate::Error;
use crate::certify::{Window, until_read};
#[cfg(not(target_family = "wasm"))]
use crate::confined::{Confined, stays_within};
#[cfg(not(target_family = "wasm"))]
use crate::escaping::leaves;
use crate::interval::{Interval, Matrix};
use crate::ranges::affine::Affine;
use crate::ranges::walk::Walk;
#[cfg(not(target_family = "wasm"))]
use crate::recurring::words_recur;
use crate::sampled::solution;
use crate::series::Series;
use crate::steady::from_state;

/// Greatest number of parts of a phase whose angles are enclosed one by one.
const MOST_PARTS: f64 = 4096.0;
/// The greatest power of two of a period that is looked at.
const MOST_DOUBLINGS: i32 = 40;

/// Current, speed and angle, as angles whose sum of squares is twice the energy over the hand's stiffness. The angle is
/// that from where the hand intends to be.
type State = [Interval; 3];
type Flow = [[Interval; 3]; 3];

/// Returns why a scene is not that of an axis under a method.
fn unlike(experiment: &Experiment) -> &'static str {
    match experiment {
        Experiment::Dut(_) => "the logic is a design of yours",
        _ => "the device is no axis",
    }
}

/// Asks how a scene goes on for ever: its states are looked at for so many seconds beyond its end.
pub fn beyond<T>(experiment: &Experiment, seconds: f64, ask: impl FnOnce(&Beyond) -> T) -> T {
    let prove = |rest: &Rest| match experiment {
        Experiment::Axis(scene) => stays(scene, rest).map_err(|why| why.to_string()),
        other => Err(unlike(other).to_string()),
    };
    let follow = |period: &Period| match experiment {
        Experiment::Axis(scene) => follows(scene, period),
        other => Err(unlike(other)),
    };
    #[cfg_attr(target_family = "wasm", allow(unused_variables, reason = "a page has no transfer functions"))]
    let words = |edges: u64| match experiment {
        #[cfg(not(target_family = "wasm"))]
        Experiment::Transfer(scene) => goes_on(scene, edges),
        _ => Err("the device is no transfer function".to_string()),
    };
    let until_read = |rest: &Rest| match experiment {
        Experiment::Axis(scene) => until_read(scene, rest).map_err(|why| format!("no window is bounded: {why}")),
        other => Err(unlike(other).to_string()),
    };
    let window = |rest: &Rest| match experiment {
        Experiment::Axis(scene) => in_contact(scene, rest).map_err(|why| format!("no window is bounded: {why}")),
        other => Err(unlike(other).to_string()),
    };
    let edges = experiment.clock.edges(seconds);
    ask(&Beyond {
        edges,
        live: &live,
        prove: &prove,
        until_read: &until_read,
        window: &window,
        follow: &follow,
        words: &words,
    })
}

/// Looks up to a clock edge how a loop around a transfer function goes on for ever: its words repeat, its plant leaves,
/// or its output is bounded.
#[cfg(not(target_family = "wasm"))]
fn goes_on(scene: &TransferScene, edges: u64) -> Result<Forever, NotTold> {
    let why = match words_recur(scene, edges) {
        Ok(cycle) => return Ok(cycle.forever()),
        Err(why) => why,
    };
    if let Some((from_edge, growth)) = leaves(scene, edges)? {
        return Ok(Forever::Grows { from_edge, growth });
    }
    match stays_within(scene, edges) {
        Ok(Confined { from_edge, ends, off_counts, .. }) => Ok(Forever::Bounded { from_edge, ends, off_counts }),
        Err(unbounded) => Err(format!("{why}, and no bound is proved: {unbounded}")),
    }
}

/// Proves bounds of a wall from a state on, at an edge at which its modulator reads the encoder. The window is as long
/// as that of the verdict, 30 % of the run.
///
/// # Errors
///
/// Returns why that is not proved.
pub fn in_contact(scene: &Scene, rest: &Rest) -> Result<InContact, Error> {
    let edges = scene.clock.edges(0.3 * scene.run.duration_s);
    let found = from_state(scene, rest, edges as f64 / 2f64.powi(scene.method.pwm.bits.cast_signed()))?;
    let Window { rms_counts, half_range_counts, long_run } = found;
    let long_run_counts = long_run.rms_counts;
    Ok(InContact { from_edge: rest.edge, edges, rms_counts, half_range_counts, long_run_counts })
}

/// Returns the nets on which those of a set depend, as [`Beyond::live`] asks. A net whose word is the same whatever
/// the words of all other nets are, as the product with a damping of 0, depends on none.
fn live(instances: &[Instance], fixed: &[Option<i64>], wanted: u64) -> u64 {
    let count = instances.iter().flat_map(|instance| &instance.connections).map(|at| at.net + 1).max().unwrap_or(0);
    let still: u64 = Affine::on_a_sheet(|| {
        let given = fixed.iter().map(|word| word.map(|word| Affine::int(word.into())));
        let nets = given.chain(std::iter::repeat(None)).take(count).collect();
        let mut walk = Walk { nets, moved: &|_| None };
        instances.iter().filter(|instance| !instance.model.clocked()).for_each(|instance| walk.read(instance));
        let is_still = |net: &usize| walk.nets[*net].is_some_and(|word| word.known().span.min == word.known().span.max);
        (0..count).filter(is_still).fold(0, |set, net| set | 1 << net)
    });
    let mut live = wanted;
    loop {
        let before = live;
        for instance in instances {
            let is_output = |port: &Signal| instance.model.outputs().iter().any(|output| output.name == port.name);
            let [inputs, outputs] = instance.connections.iter().fold([0u64; 2], |mut sets, at| {
                sets[usize::from(is_output(&at.port))] |= 1 << at.net;
                sets
            });
            if live & outputs & !still != 0 {
                live |= inputs;
            }
        }
        if live == before {
            return live;
        }
    }
}

/// Proves that a scene's device stays at rest for ever.
///
/// # Errors
///
/// Returns why that is not proved.
pub fn stays(scene: &Scene, rest: &Rest) -> Result<Quiet, Error> {
    let (motor, ohm) = single(scene)?;
    let exact = Interval::exact;
    let (grip, _) = scene.hand.grip();
    if rest.standing.is_stuck {
        let hand = match scene.hand {
            Hand::None => Interval::ZERO,
            Hand::ConstantTorque { torque_nm } => exact(torque_nm),
            Hand::SpringDamper { .. } => exact(grip).times(bent(rest)),
            Hand::Prescribed { .. } | Hand::Capture { .. } => return Err("a hand imposes the motion".into()),
        };
        let (rate, push) = (ohm.over(motor.inductance_h), exact(scene.bridge.supply_v).divided(ohm));
        let (torque, friction) = (exact(motor.torque_constant_nm_per_a), motor.coulomb_friction_nm);
        return Held { rate, push, torque, hand, friction, hertz: scene.clock.frequency_hz() as f64 }.stays(rest);
    }
    Plant::of(scene)?.stays(rest)
}

/// Returns the distance in counts within which the motion of real numbers repeats as the emulator's does.
///
/// # Errors
///
/// Returns why none is told.
pub fn follows(scene: &Scene, period: &Period) -> Result<f64, &'static str> {
    let plant = Plant::of(scene)?;
    let pwm = scene.method.pwm;
    if pwm.floating || pwm.dead_time_s > 0.0 {
        return Err("in some phases of its bridge the winding is open");
    }
    if period.mode_changes > 0 {
        return Err("a mode ends in it");
    }
    if period.redecided > 0 {
        return Err("a count arrives so near to a clock edge that rounding may decide");
    }
    let count_rad = scene.encoder.count_rad();
    // The modulator's pulses, also those that the emulator passes without an event of its own.
    let segments = 2.0 * period.events as f64 + 4.0 * (period.edges >> pwm.bits) as f64;
    let within = plant.rounding(period, segments)? / count_rad;
    // Written so that a number that is none proves nothing.
    if within < 2f64.powi(-53) { Ok(within) } else { Err("rounding in a period may move a count") }
}

/// Returns the motor of a scene that has no other device, with the resistance of its circuit.
fn single(scene: &Scene) -> Result<(&Motor, Interval), &'static str> {
    let Device::Motor(motor) = &scene.device else { return Err("the device is no motor") };
    if scene.network.is_some() || scene.model.winding == Winding::Resistive {
        return Err("the device is no single motor with an inductance");
    }
    let switches = Interval::exact(2.0 * scene.bridge.on_resistance_ohm);
    Ok((motor, Interval::exact(motor.resistance_ohm).plus(switches)))
}

/// Returns how far the hand's spring is bent.
fn bent(rest: &Rest) -> Interval {
    Interval::exact(rest.standing.intent_rad).minus(Interval::exact(rest.standing.angle_rad))
}

/// Motor and hand in scaled states.
struct Plant {
    rates: Flow,
    /// The scales of current, speed and angle.
    scales: State,
    /// The current and the angle at which a steady full supply holds motor and hand, scaled.
    push: Interval,
    bend: Interval,
    hertz: f64,
}

/// The least and the greatest angle passed.
#[derive(Clone, Copy)]
struct Range {
    lo: f64,
    hi: f64,
}

impl Range {
    const NOTHING: Self = Self { lo: f64::INFINITY, hi: f64::NEG_INFINITY };

    fn with(self, angle: Interval) -> Self {
        Self { lo: self.lo.min(angle.lo), hi: self.hi.max(angle.hi) }
    }
}

impl Plant {
    /// Returns motor and hand of a scene.
    fn of(scene: &Scene) -> Result<Self, &'static str> {
        let (motor, ohm) = single(scene)?;
        if motor.coulomb_friction_nm > 0.0 && scene.model.friction != Friction::None {
            return Err("friction has not caught the shaft");
        }
        let (grip, grip_damping) = scene.hand.grip();
        if grip <= 0.0 {
            return Err("no hand's spring brings the device to rest");
        }
        let exact = Interval::exact;
        let (l, j, k) = (motor.inductance_h, motor.inertia_kg_m2(), motor.torque_constant_nm_per_a);
        let push = exact(scene.bridge.supply_v).divided(ohm);
        let root = |x: Interval| Interval { lo: x.lo.sqrt().next_down(), hi: x.hi.sqrt().next_up() };
        let negative = |x: Interval| Interval::ZERO.minus(x);
        let viscous = exact(motor.viscous_friction_nm_s_per_rad).plus(exact(grip_damping));
        let coupling = exact(k).divided(root(exact(l).times(exact(j))));
        let turn = root(exact(grip).over(j));
        Ok(Self {
            rates: [
                [negative(ohm.over(l)), negative(coupling), Interval::ZERO],
                [coupling, negative(viscous.over(j)), negative(turn)],
                [Interval::ZERO, turn, Interval::ZERO],
            ],
            scales: [root(exact(l).over(grip)), root(exact(j).over(grip)), exact(1.0)],
            push: push.times(root(exact(l).over(grip))),
            bend: push.times(exact(k).over(grip)),
            hertz: scene.clock.frequency_hz() as f64,
        })
    }

    /// Returns a bound of the distance in rad of the emulator's motion from that of real numbers, in a period of so
    /// many flows that repeats.
    fn rounding(&self, period: &Period, segments: f64) -> Result<f64, &'static str> {
        let period_s = self.time_s(period.edges);
        // Each such time at least halves the motion, and the supply adds at most so much. So a motion that repeats is
        // smaller than three times that: four of them are at least current, speed, angle and the hand's intent.
        let decay_s = self.halves(Interval::exact(1e-5))? * 1e-5;
        let added = decay_s * self.push.size() * self.rates[0][0].size();
        let size = 2.0 * period.angle_rad.abs() + 4.0 * 3.0 * added;
        let flows = segments + self.norm() * period_s.hi;
        Ok(2.0 * self.halves(period_s)? * flows * size * 2f64.powi(-95))
    }

    /// Returns a power of two of a time after which every deviation is at least halved.
    fn halves(&self, time_s: Interval) -> Result<f64, &'static str> {
        let halved = |times: &f64| {
            let flow = self.flow(time_s.scaled(*times));
            let squares = flow.iter().flatten().fold(0.0, |sum: f64, cell| (sum + cell.size().powi(2)).next_up());
            // Twice the cells' squares below a half: rounding cannot matter.
            squares < 0.24
        };
        let times = (0..MOST_DOUBLINGS).map(|doublings| 2f64.powi(doublings)).find(halved);
        times.ok_or("no deviation is proved to die out")
    }

    /// Returns a bound of the rates, in 1/s.
    fn norm(&self) -> f64 {
        self.rates.iter().map(|row| row.iter().map(|rate| rate.size()).sum::<f64>()).fold(0.0, f64::max)
    }

    fn stays(&self, rest: &Rest) -> Result<Quiet, Error> {
        let at = &rest.standing;
        let numbers = [at.current_a, at.speed_rad_per_s].map(Interval::exact);
        let scaled = |index: usize| numbers[index].times(self.scales[index]);
        let mut state = [scaled(0), scaled(1), Interval::ZERO.minus(bent(rest))];
        let mut passed = Range::NOTHING.with(state[2]);
        for phase in &rest.lead {
            state = self.passes(state, *phase, &mut passed);
        }
        let (orbit, ripple, error) = self.orbit(&rest.cycle)?;
        let off: State = from_fn(|index| state[index].minus(orbit[index]));
        let reach = (size(&off) + error).next_up();
        let all = Range {
            lo: passed.lo.min((ripple.lo - error - reach).next_down().next_down()),
            hi: passed.hi.max((ripple.hi + error + reach).next_up().next_up()),
        };
        let [low, high] = rest.band_rad.map(|end| Interval::exact(end).minus(Interval::exact(at.intent_rad)));
        let count = rest.band_rad[1] - rest.band_rad[0];
        let margin = (all.lo - low.hi).min(high.lo - all.hi);
        // Written so that a number that is none proves nothing.
        if margin > 0.0 {
            let ripple_counts = 0.5 * (ripple.hi - ripple.lo) / count;
            Ok(Quiet { from_edge: rest.edge, is_stuck: false, margin: margin / count, ripple_counts })
        } else {
            Err("the motion may reach the next count".into())
        }
    }

    /// Returns a state at the beginning of a cycle that is close to the periodic one, the angles that the motion from
    /// it passes in one cycle, and a bound of its distance from the periodic one.
    fn orbit(&self, cycle: &[(f64, u64)]) -> Result<(State, Range, f64), Error> {
        if let [(share, u64::MAX)] = cycle {
            let still = self.still(*share);
            return Ok((still, Range::NOTHING.with(still[2]), 0.0));
        }
        let clocks: u64 = cycle.iter().map(|(_, clocks)| clocks).sum();
        let whole = self.flow(self.time_s(clocks));
        let nothing = [Interval::ZERO; 3];
        let moved = cycle.iter().fold(nothing, |state, &(share, clocks)| self.after(state, share, clocks));
        let row = |row: usize| {
            let own = (0..3).map(|of| f64::from(u8::from(of == row)) - whole[row][of].middle());
            own.chain([moved[row].middle()]).collect()
        };
        let found = solution((0..3).map(row).collect()).ok_or("the motion has no periodic one")?;
        let start: State = from_fn(|index| Interval::exact(found[index]));
        let mut passed = Range::NOTHING.with(start[2]);
        let end = cycle.iter().fold(start, |state, phase| self.passes(state, *phase, &mut passed));
        let residue = size(&from_fn(|index| end[index].minus(start[index])));
        let times = self.halves(self.time_s(clocks))?;
        Ok((start, passed, (2.0 * times * residue * (1.0 + 1e-12)).next_up()))
    }

    fn time_s(&self, clocks: u64) -> Interval {
        Interval::exact(clocks as f64).over(self.hertz)
    }

    fn flow(&self, time_s: Interval) -> Flow {
        let change = self.change(time_s);
        from_fn(|row| {
            from_fn(|of| if row == of { change[row][of].plus(Interval::exact(1.0)) } else { change[row][of] })
        })
    }

    /// Returns the flow over a time less the identity.
    fn change(&self, time_s: Interval) -> Flow {
        let rows: Vec<Vec<Interval>> =
            self.rates.iter().map(|row| row.map(|rate| rate.times(time_s)).to_vec()).collect();
        let Matrix(change) = Series::new(&[&rows]).exponential_change().into_parts().swap_remove(0);
        from_fn(|row| from_fn(|of| change[row][of]))
    }

    /// Returns the state that a steady voltage leaves as it is.
    fn still(&self, share: f64) -> State {
        let by = Interval::exact(share);
        [self.push.times(by), Interval::ZERO, self.bend.times(by)]
    }

    /// Returns the state after a phase.
    fn after(&self, state: State, share: f64, clocks: u64) -> State {
        self.moved(state, share, &self.change(self.time_s(clocks)))
    }

    fn moved(&self, state: State, share: f64, change: &Flow) -> State {
        let still = self.still(share);
        let off: State = from_fn(|index| state[index].minus(still[index]));
        let dot = |row: &State| row.iter().zip(&off).fold(Interval::ZERO, |sum, (a, b)| sum.plus(a.times(*b)));
        from_fn(|index| state[index].plus(dot(&change[index])))
    }

    /// Returns the state after a phase, and adds the angles that it passes.
    fn passes(&self, state: State, (share, clocks): (f64, u64), passed: &mut Range) -> State {
        let whole_s = self.time_s(clocks);
        let parts = (64.0 * self.norm() * whole_s.hi).ceil().clamp(1.0, MOST_PARTS);
        let part_s = whole_s.over(parts);
        let [part, within] = [part_s, Interval { lo: 0.0, hi: part_s.hi }].map(|time_s| self.change(time_s));
        let mut at = state;
        for _ in 0..parts as u32 {
            *passed = passed.with(self.moved(at, share, &within)[2]);
            at = self.moved(at, share, &part);
        }
        self.after(state, share, clocks)
    }
}

/// Returns a bound of the root of the sum of squares.
fn size(state: &State) -> f64 {
    let squares = state.iter().fold(0.0, |sum: f64, x| (sum + (x.size() * x.size()).next_up()).next_up());
    squares.sqrt().next_up()
}

/// The current through a shaft that stands still.
struct Held {
    /// The current's decay in 1/s, and the steady current of a full supply.
    rate: Interval,
    push: Interval,
    /// Torque of 1 A, of the hand, and of friction.
    torque: Interval,
    hand: Interval,
    friction: f64,
    hertz: f64,
}

impl Held {
    fn stays(&self, rest: &Rest) -> Result<Quiet, Error> {
        let mut at = Interval::exact(rest.standing.current_a);
        let mut passed = Range::NOTHING.with(at);
        let after = |at: Interval, &(share, clocks): &(f64, u64)| {
            let still = self.push.times(Interval::exact(share));
            still.plus(self.fall(clocks).times(at.minus(still)))
        };
        // A current moves one way within a phase, so it is farthest at ends of phases; and its distance from the
        // periodic one shrinks and keeps its sign.
        for phase in &rest.lead {
            at = after(at, phase);
            passed = passed.with(at);
        }
        let ends: Vec<Interval> = match rest.cycle.as_slice() {
            [(share, u64::MAX)] => vec![self.push.times(Interval::exact(*share))],
            cycle => {
                let clocks = cycle.iter().map(|(_, clocks)| clocks).sum();
                let moved = cycle.iter().fold(Interval::ZERO, after);
                let start = moved.divided(Interval::exact(1.0).minus(self.fall(clocks)));
                let ends = cycle.iter().scan(start, |at, phase| {
                    *at = after(*at, phase);
                    Some(*at)
                });
                [start].into_iter().chain(ends).collect()
            }
        };
        let Interval { lo, hi } = at.minus(ends[0]);
        let off = Interval { lo: lo.min(0.0), hi: hi.max(0.0) };
        for end in ends {
            passed = passed.with(end.plus(off));
        }
        let torque = self.torque.times(Interval { lo: passed.lo, hi: passed.hi }).plus(self.hand);
        let margin = self.friction - torque.size();
        if margin > 0.0 {
            let margin = margin / self.friction;
            Ok(Quiet { from_edge: rest.edge, is_stuck: true, margin, ripple_counts: 0.0 })
        } else {
            Err("the pulses may overcome friction".into())
        }
    }

    /// Returns the share of a current that is left after so many clocks.
    fn fall(&self, clocks: u64) -> Interval {
        let over = self.rate.times(Interval::exact(clocks as f64).over(self.hertz));
        let rows = [vec![Interval::ZERO.minus(over)]];
        let Matrix(change) = Series::new(&[&rows]).exponential_change().into_parts().swap_remove(0);
        change[0][0].plus(Interval::exact(1.0))
    }
}
