//! Leaps over whole periods of a modulator.
//!
//! While gates repeat one pulse of `d` edges every `T`, through circuits of the same matrix, the motion is `x' = A x +
//! f(t)` with a periodic `f`: `f_on` first, then `f_on - Δ e`, where `e` is the current's unit. Over a period it comes
//! to `x(T) = e^{AT} x₀ + P(T) f_on - Δ P(T - d) e`. The *smooth* motion `y' = A y + f_on - Δ c` with `c = P(T)⁻¹ P(T -
//! d) e`, begun in the same state, comes to the same: `y(kT) = x(kT)` for every whole `k`. The difference in between,
//! the *ripple* `δ = x - y`, is the same in every period and does not depend on the state: its slope begins with `Δ c`,
//! and falls by `Δ e` when the pulse ends.
//!
//! So any number of periods is one leap of `y`. They contain no count of the encoder and no end of a mode as long as
//! `y` keeps to limits that are narrowed by a bound of the ripple. The search is the same as the search for events.
//!
//! # Energy
//!
//! Let `x̄` and `w̄` be the means of `y` and of its slope at the starts of the periods. `w̄ = P(T)⁻¹ (y(nT) - y(0)) /
//! n`, as `y((k+1)T) - y(kT) = P(T) w(kT)`, and `x̄` follows from `∫ y`. Integrals of states are linear: over `n`
//! periods they are `n` times those of one period from `x̄` and `w̄`, phase by phase. Integrals of squares are `n`
//! times those of that period, plus the excess of `∫ y²` over `n` such smooth periods, because `y` and ripple appear
//! together only in terms that are linear in either.

use std::array::from_fn;
use std::sync::OnceLock;

use super::modes::Check;
use super::{Device, Drive};
use crate::axis::Shaft;
use crate::energy::{Energy, Powers};
use crate::flow::double::{Double, Doubles, Native, Product, versions};
use crate::flow::gauge::{Extent, blur, reach};
use crate::flow::guard::{Guard, MotionPoint, dyadic};
use crate::flow::leap::{Integrals, Quadrature};
use crate::flow::linear::{Linear, Trajectory};
use crate::flow::matrix::{ANGLE, CURRENT, SPEED, State, plus};
use crate::flow::period::Period;
use crate::{Circuit, Gates};

/// Gates that repeat a pulse and a pause.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Pulses {
    /// Edges of a period.
    pub period: u64,
    /// Edges of the pulse, from 1 to one less than the period's.
    pub duty: u64,
    /// The gates of the pause.
    pub pause: Gates,
}

/// Parts of a phase in which the ripple's extent is bounded.
const PARTS: u64 = 4;

/// The least number of periods worth a leap: it costs as much as setting gates about four times.
const LEAST: u64 = 2;

/// Checks with narrowed limits, and a narrowed band of the angle.
type Narrowed<'a> = ([Option<Check<'a>>; 2], (f64, f64));

/// The difference between the switched motion and the smooth one: it depends on mode and pulses alone.
#[derive(Clone, Copy)]
pub(crate) struct Ripple<'a> {
    period: &'a Period,
    duty: u64,
    /// The slope at the beginning, and the fall of the current's slope at the end of the pulse.
    rise: Doubles,
    fall: Double,
    /// Bounds of the angle's ripple, and of the ripple in the function that each check of the mode watches.
    margins: [f64; 3],
}

/// The state of a device while its gates repeat. Its anchor is the beginning of a pulse, and its motion the smooth one.
#[derive(Clone)]
pub(crate) struct Cruise<'a> {
    period: &'a Period,
    duty: u64,
    /// The edge at which the cruise ends.
    end: u64,
    /// Inputs and source voltages of pulse and pause.
    inputs: [Doubles; 2],
    source_v: [f64; 2],
    pause: (Drive, Circuit),
    /// The slope of the ripple at its beginning, and the fall of the current's slope at the end of the pulse.
    rise: State,
    fall: f64,
    /// The phase of the edge last asked for by `at_next`: its first edge, the first edge of the next
    /// phase, and its motion.
    phase: (u64, u64, Trajectory<'a>),
    /// The ripple as rows need it, computed when first asked for.
    shape: OnceLock<Box<Shape>>,
}

/// The ripple of a period, as the rows of a trace need it.
#[derive(Clone)]
pub(super) struct Shape {
    /// Integrals of the ripple over the pulse, and state and slope after it.
    pulse: (State, State, State),
    /// Integrals of the ripple over the period.
    whole: State,
    /// Extents that the ripple of current and speed does not leave.
    pub(super) extents: [Extent; 2],
    /// Bounds of the error of their values in a period.
    pub(super) blurs: [f64; 2],
}

impl<'a> Ripple<'a> {
    /// Creates the ripple of pulses in a mode of the device, by their slope at the beginning and its fall.
    fn new(device: &Device<'a>, period: &'a Period, duty: u64, (rise, fall): (Doubles, Double)) -> Self {
        let angle = &device.mode.angle;
        let [first, second] = device.checks.map(|check| check.map_or(angle, |check| check.guard));
        let mut ripple = Self { period, duty, rise, fall, margins: [0.0; 3] };
        ripple.margins = ripple.bounds(device.motion.system(), [angle, first, second]);
        ripple
    }

    /// Returns bounds of functions of the ripple: from their values in the middle and at the end of either phase, and
    /// the most that they can bulge in between.
    fn bounds(&self, system: &'a Linear, guards: [&Guard; 3]) -> [f64; 3] {
        let mut most = [0.0; 3];
        let mut bulge = [0.0; 3];
        let (mut x, mut w) = ([0.0; 4], self.rise.hi);
        for edges in [self.duty, self.period.edges - self.duty] {
            let phase = Cruise::seen(system, &x, &w);
            let step = edges.div_ceil(2);
            let step_s = step as f64 * system.edge_s();
            for (guard, bulge) in guards.iter().zip(&mut bulge) {
                *bulge = f64::max(*bulge, 0.125 * step_s * step_s * guard.bend(dyadic(edges), &w));
            }
            let middle = phase.at(step);
            (x, w) = phase.at_with_slope(edges);
            for (guard, most) in guards.iter().zip(&mut most) {
                *most = f64::max(*most, guard.value(&middle).abs().max(guard.value(&x).abs()));
            }
            w[CURRENT] -= self.fall.hi;
        }
        // Rounding adds far less than a hundredth of the bulge.
        from_fn(|k| 1.01 * (most[k] + bulge[k]))
    }
}

impl<'a> Cruise<'a> {
    /// Returns a motion of this system in `f64`.
    fn seen(system: &'a Linear, x: &State, w: &State) -> Trajectory<'a> {
        Trajectory { system, x: (*x).into(), f: Doubles::ZERO, w: (*w).into() }
    }

    /// Returns the phase that contains this number of edges after the anchor: its first edge, the first edge of the
    /// next phase, and state and slope at its start.
    #[inline(always)]
    fn phase<P: Product>(&self, smooth: &Trajectory<'a>, edges: u64) -> (u64, u64, State, State) {
        let begun = edges - edges % self.period.edges;
        let ended = begun + self.duty;
        let (x, w) = smooth.system.after::<P>(&smooth.x.hi, &smooth.w.hi, begun);
        let w = plus(&w, &self.rise);
        if edges < ended {
            return (begun, ended, x, w);
        }
        let (x, mut w) = smooth.system.after::<P>(&x, &w, self.duty);
        w[CURRENT] -= self.fall;
        (ended, begun + self.period.edges, x, w)
    }

    versions! {
        /// Returns the state this number of edges after the anchor.
        pub(crate) fn at[at_fused, at_native, at_with](self: &Self, smooth: &Trajectory<'a>, edges: u64) -> State
    }

    #[inline(always)]
    fn at_with<P: Product>(&self, smooth: &Trajectory<'a>, edges: u64) -> State {
        let (begun, _, x, w) = self.phase::<P>(smooth, edges);
        smooth.system.state_after::<P>(&x, &w, edges - begun)
    }

    versions! {
        fn turn[turn_fused, turn_native, turn_with](self: &mut Self, smooth: &Trajectory<'a>, edges: u64)
    }

    #[inline(always)]
    fn turn_with<P: Product>(&mut self, smooth: &Trajectory<'a>, edges: u64) {
        let (begun, ended, x, w) = self.phase::<P>(smooth, edges);
        self.phase = (begun, ended, Self::seen(smooth.system, &x, &w));
    }

    /// Returns the same state, for edges that are asked one after the other.
    #[inline(always)]
    pub(crate) fn at_next(&mut self, smooth: &Trajectory<'a>, edges: u64, cache: &mut (u64, (State, State))) -> State {
        if !(self.phase.0..self.phase.1).contains(&edges) {
            self.turn(smooth, edges);
            cache.0 = u64::MAX;
        }
        self.phase.2.at_next(edges - self.phase.0, cache)
    }

    /// Returns the state this number of edges after the anchor in double-double: the smooth motion up to the period's
    /// begin, and the switched motion from there.
    #[inline(always)]
    pub(crate) fn flow<P: Product>(&self, smooth: &Trajectory<'a>, edges: u64) -> Doubles {
        let mut rest = edges % self.period.edges;
        let mut x = smooth.flow::<P>(edges - rest);
        for (&f, most) in self.inputs.iter().zip([self.duty, u64::MAX]) {
            let edges = rest.min(most);
            rest -= edges;
            if edges == 0 {
                break;
            }
            x = Trajectory::exact_with::<P>(smooth.system, x, f).flow::<P>(edges);
        }
        x
    }

    /// Returns the edges of a period.
    pub(crate) fn period_edges(&self) -> u64 {
        self.period.edges
    }

    /// Returns the pulse or pause that contains this number of edges after the anchor: its first edge, the first edge
    /// of the next one, and its motion.
    pub(crate) fn pulse(&self, smooth: &Trajectory<'a>, edges: u64) -> (u64, u64, Trajectory<'a>) {
        let (begun, ended, x, w) = self.phase::<Native>(smooth, edges);
        (begun, ended, Self::seen(smooth.system, &x, &w))
    }

    /// Returns the ripple of a period, with the guards of current and speed.
    pub(super) fn shape(&self, smooth: &Trajectory<'a>, guards: [&Guard; 2]) -> &Shape {
        self.shape.get_or_init(|| Box::new(self.shaped(smooth.system, guards)))
    }

    #[cold]
    fn shaped(&self, system: &'a Linear, guards: [&Guard; 2]) -> Shape {
        let (pulse, middle, mut falling) = system.glide::<Native>(&[0.0; 4], &self.rise, self.duty);
        falling[CURRENT] -= self.fall;
        let pulse = (pulse.states, middle, falling);
        let whole = self.ripple_in_period(system, &pulse, self.period.edges);
        let phases = [([0.0; 4], self.rise, self.duty), (middle, falling, self.period.edges - self.duty)];
        let phases = phases.map(|(x, w, edges)| (Self::seen(system, &x, &w), edges));
        let mut extents = [Extent::NONE; 2];
        for (phase, edges) in &phases {
            let mut a = MotionPoint::of(phase, 0);
            while a.edge < *edges {
                let b = MotionPoint::of(phase, (a.edge + edges.div_ceil(PARTS)).min(*edges));
                let length_s = (b.edge - a.edge) as f64 * system.edge_s();
                for (guard, extent) in guards.iter().zip(&mut extents) {
                    let ends = [&a, &b];
                    let (values, slopes) = (ends.map(|end| guard.value(&end.x)), ends.map(|end| guard.value(&end.w)));
                    extent.join(&reach(values, slopes, guard.bend(dyadic(b.edge - a.edge), &a.w), length_s));
                }
                a = b;
            }
        }
        let blurs = guards.map(|guard| phases.iter().map(|(phase, edges)| blur(phase, guard, *edges)).sum());
        Shape { pulse, whole, extents, blurs }
    }

    /// Returns the integrals of the ripple over this number of edges, at most a period.
    fn ripple_in_period(&self, system: &Linear, (pulse, middle, falling): &(State, State, State), edges: u64) -> State {
        if edges <= self.duty {
            return system.path(&[0.0; 4], &self.rise, edges);
        }
        plus(pulse, &system.path(middle, falling, edges - self.duty))
    }

    /// Returns the integrals of the ripple in current and speed over this number of edges after the anchor.
    pub(super) fn ripple_until(&self, system: &Linear, shape: &Shape, edges: u64) -> [f64; 2] {
        let (whole, part) = (edges / self.period.edges, edges % self.period.edges);
        let rest = self.ripple_in_period(system, &shape.pulse, part);
        [CURRENT, SPEED].map(|k| whole as f64 * shape.whole[k] + rest[k])
    }

    /// Returns whether the gates are those of the pulse, as at the anchor, this number of edges after it.
    fn is_pulse(&self, edges: u64) -> bool {
        edges % self.period.edges < self.duty
    }

    /// Accounts for a number of periods of a device and returns the state after them.
    #[inline(always)]
    fn pass<P: Product>(&self, device: &Device, periods: u64, energy: &mut Energy) -> Doubles {
        let (motion, system, duty) = (&device.motion, device.motion.system, self.duty);
        let (n, edges) = (periods as f64, self.period.edges);
        let period_s = edges as f64 * system.edge_s();
        let (smooth, end) = motion.integrals::<P>(periods * edges);
        let smooth = Quadrature::<4>::in_memory::<P::Lanes>(&smooth);
        let change = end.since::<P>(&motion.x);
        let w = self.period.inverse.hi.times(&change).map(|sum| sum / n);
        let (path, ..) = system.glide::<P>(&[0.0; 4], &w, edges);
        let x: State = from_fn(|k| (smooth.states[k] / n - path.states[k]) / period_s);

        let (pulse, middle, mut falling) = system.glide::<P>(&x, &plus(&w, &self.rise), duty);
        falling[CURRENT] -= self.fall;
        let (pause, ..) = system.glide::<P>(&middle, &falling, edges - duty);
        let done = Integrals {
            states: from_fn(|k| n * (pulse.states[k] + pause.states[k])),
            squares: from_fn(|k| {
                let even = x[k] * (x[k] * period_s + 2.0 * path.states[k]) + path.squares[k];
                smooth.squares[k] + n * (pulse.squares[k] + pause.squares[k] - even)
            }),
        };
        let source_j = n * (self.source_v[0] * pulse.states[CURRENT] + self.source_v[1] * pause.states[CURRENT]);
        let turned = (change[ANGLE], change[ANGLE].abs());
        energy.spent(&device.powers, source_j, n * period_s, turned, &motion.x.hi, &end.hi, &done);
        end
    }

    /// Returns the energy that a device has exchanged until this number of edges after its anchor, and the state there.
    #[inline(always)]
    pub(crate) fn tallied<P: Product>(&self, device: &Device, edges: u64) -> (Energy, Doubles) {
        let (periods, mut rest) = (edges / self.period.edges, edges % self.period.edges);
        let (mut energy, mut x, system) = (device.energy, device.motion.x, device.motion.system);
        if periods > 0 {
            x = self.pass::<P>(device, periods, &mut energy);
        }
        let lengths = [self.duty, u64::MAX];
        for ((&f, &source_v), most) in self.inputs.iter().zip(&self.source_v).zip(lengths) {
            let edges = rest.min(most);
            rest -= edges;
            if edges == 0 {
                break;
            }
            let (done, end) = Trajectory::exact_with::<P>(system, x, f).integrals::<P>(edges);
            let powers = Powers { source_v, ..device.powers };
            energy.add(&powers, edges as f64 * system.edge_s(), &x, &end, &done);
            x = end;
        }
        (energy, x)
    }
}

impl<'a> Device<'a> {
    versions! {
        /// Begins a cruise, if the device can go on by itself for two periods or more. Its gates must just have been
        /// set to begin a pulse, and will repeat it as `pulses` says until the edge `last`. Returns the edge at which
        /// the cruise ends: before it no mode ends, and the angle stays in `[low_rad, high_rad)`. Until then the device
        /// ignores gates, unless they differ from those foreseen.
        pub fn cruise[cruise_fused, cruise_native, cruise_with](
            self: &mut Self, edge: u64, last: u64, band_rad: (f64, f64), pulses: &Pulses
        ) -> Option<u64>
    }

    #[inline(always)]
    fn cruise_with<P: Product>(&mut self, edge: u64, last: u64, band_rad: (f64, f64), pulses: &Pulses) -> Option<u64> {
        let &Pulses { period, duty, pause } = pulses;
        // The tables hold for leaps of less than a power of two.
        let reach = (last - edge).min((1 << (self.motion.system().dyadic() - 1).min(62)) - 1);
        if reach < LEAST * period || edge < self.leaves || edge != self.anchor {
            return None;
        }
        let x = self.motion.x;
        // At its present speed, the next count must be some time away.
        let way_rad = x.hi[SPEED] * (LEAST * period) as f64 * self.motion.system().edge_s();
        let ahead_rad = x.hi[ANGLE] + way_rad;
        if self.shaft != Shaft::Stuck && !(band_rad.0..band_rad.1).contains(&ahead_rad) {
            return None;
        }
        let circuit = self.axis.bridge.circuit(pause, x.hi[CURRENT], 0.0);
        let (
            Circuit::Closed { direction: 0, switches, .. },
            Circuit::Closed { direction: 0, switches: others, supply_share, .. },
        ) = (self.circuit, circuit)
        else {
            return None;
        };
        let system = &self.mode.system;
        let known = self.mode.period.get_or_init(|| Period::new(system, period)).as_ref();
        let known = known.filter(|known| known.edges == period && switches == others)?;

        let pulse = self.motion.f;
        let volts = self.axis.constants.supply.times::<P>(supply_share);
        let fall = pulse.lane(CURRENT) - volts;
        let mut paused = pulse;
        paused.set(CURRENT, volts);
        // The same pulses are tried again and again while friction turns the shaft to and fro.
        let ripple = match self.ripple {
            Some(ripple) if std::ptr::eq(ripple.period, known) && ripple.duty == duty && ripple.fall == fall => ripple,
            _ => Ripple::new(self, known, duty, (known.share::<P>(system, duty).scaled::<P>(fall), fall)),
        };
        self.ripple = Some(ripple);

        let (checks, band_rad) = self.narrowed(&ripple.margins, band_rad)?;
        let before = (self.motion, self.checks, self.redecided);
        let smooth = Trajectory::exact_with::<P>(system, x, pulse.plus::<P>(&ripple.rise.negated()));
        (self.motion, self.checks) = (smooth, checks);
        self.known.forget();
        let left = self.next_event(edge, edge + reach, band_rad);
        self.leaves = left.map_or(0, |event| event.0);
        let last = left.map_or(edge + reach, |event| event.0 - 1);
        let end = (last - edge >= LEAST * period).then_some(last);
        (self.checks, self.redecided) = (before.1, before.2);
        self.known.forget();
        match end {
            Some(end) => {
                self.cruise = Some(Cruise {
                    period: known,
                    duty,
                    end,
                    inputs: [pulse, paused],
                    source_v: [self.powers.source_v, self.axis.bridge.supply_v * supply_share],
                    pause: (Drive::Gates(pause), circuit),
                    rise: ripple.rise.hi,
                    fall: fall.hi,
                    phase: (0, 0, self.motion),
                    shape: OnceLock::new(),
                });
            }
            None => self.motion = before.0,
        }
        end
    }

    /// Returns the checks and the band of the angle, with their limits narrowed by the bounds of the ripple, if the
    /// state is within all of them.
    #[inline(always)]
    fn narrowed(&self, margins: &[f64; 3], (low_rad, high_rad): (f64, f64)) -> Option<Narrowed<'a>> {
        let x = self.motion.x.hi;
        let mut checks = self.checks;
        for (check, margin) in checks.iter_mut().zip(&margins[1..]) {
            let Some(check) = check else { continue };
            check.limits = check.limits.narrowed(*margin);
            let value = check.guard.value(&x);
            if value <= check.limits.low.hi || value >= check.limits.high.hi {
                return None;
            }
        }
        let (low_rad, high_rad) = (low_rad + margins[0], high_rad - margins[0]);
        let is_within = self.shaft == Shaft::Stuck || x[ANGLE] > low_rad && x[ANGLE] < high_rad;
        is_within.then_some((checks, (low_rad, high_rad)))
    }

    /// Returns the edge at which the present cruise ends; `None` without a cruise.
    #[inline(always)]
    pub(crate) fn cruise_end(&self) -> Option<u64> {
        self.cruise.as_ref().map(|cruise| cruise.end)
    }

    /// Returns whether a drive from `edge` on equals the one that the cruise foresees there.
    pub(crate) fn foresees(&self, cruise: &Cruise<'a>, edge: u64, drive: Drive) -> bool {
        let foreseen = if cruise.is_pulse(edge - self.anchor) { self.drive } else { cruise.pause.0 };
        edge < cruise.end && drive == foreseen
    }

    versions! {
        /// Moves to the end of a cruise.
        pub(crate) fn land[land_fused, land_native, land_with](self: &mut Self, edge: u64)
    }

    #[inline(always)]
    fn land_with<P: Product>(&mut self, edge: u64) {
        let x = self.account::<P>(edge);
        self.redrive::<P>(edge, x);
    }

    /// Ends a cruise at an edge, before the gates are set there, and returns the state. All else but the motion is left
    /// as if there had been no cruise.
    #[inline(always)]
    pub(crate) fn leave<P: Product>(&mut self, cruise: &Cruise<'a>, edge: u64) -> Doubles {
        let edges = edge - self.anchor;
        let (energy, x) = cruise.tallied::<P>(self, edges);
        self.energy = energy;
        self.motion.f = cruise.inputs[0];
        // A pulse drives up to the edge at which the gates show that it is over.
        if edges == 0 || !cruise.is_pulse(edges - 1) {
            (self.drive, self.circuit) = cruise.pause;
        }
        x
    }
}
