//! An arm in motion: its anchor, the end of each segment, and its state at a clock edge.

use super::finger::{DEPTH, FORCE, Finger, Press, Touch};
use super::links::Links;
use super::series::{Hold, Series, Start};
use super::{Arm, ArmEnergy, ArmModel};
use crate::Band;
use crate::flow::gauge::{Extent, Gauge, Measured, Pace, Stretch};
use crate::flow::polynomial::{Bounds, Coefficients, Lanes, ORDER, Polynomial, Reach, derivatives, value};

/// The longest duration of a segment, unless all is at rest: rounding then stays that of short times.
const LONGEST_S: f64 = 1.0;
/// The shortest time for which a series is used, even where the equations are singular.
const SHORTEST_S: f64 = 1e-6;
/// The time by which the motion goes on where a condition comes too near to its limit to be decided.
const ONWARD_S: f64 = 1e-9;
/// Distance from its command, in tolerances, at which an amplifier counts as settled.
const SETTLED: f64 = 10.0;

/// The state of an arm.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ArmState {
    /// Angles of the links.
    pub angles_rad: [f64; 3],
    /// Speeds of the links.
    pub speeds_rad_per_s: [f64; 3],
    /// Angles of the motors, as the encoders see them, rounded downward.
    pub motor_angles_rad: [f64; 3],
    /// Speeds of the motors.
    pub motor_speeds_rad_per_s: [f64; 3],
    /// Torques of the motors.
    pub torques_nm: [f64; 3],
    /// Whether friction holds a motor.
    pub stuck: [bool; 3],
    /// Force of the finger on the surface; 0 without a finger.
    pub finger_n: f64,
}

/// The reason for the end of a segment.
#[derive(Clone, Copy, PartialEq)]
enum End {
    /// The truncation of the powers written so far reaches the tolerance.
    Short,
    /// The truncation of the whole series reaches the tolerance.
    Worn,
    /// This joint comes to rest.
    Stop(usize),
    /// Friction does not hold this joint any longer; it moves in this direction.
    Break(usize, f64),
    /// This lane of the touch passes 0, and the finger's situation becomes this one.
    Touch(usize, Touch),
}

/// An arm in motion.
#[derive(Clone)]
pub struct ArmMotion<'a, L: Links = ArmModel> {
    pub(super) arm: &'a Arm<L>,
    /// The anchor: the first edge at or after it, and the time from the anchor to that edge.
    anchor: u64,
    offset_s: f64,
    pub(super) start: Start,
    holds: [Hold; 3],
    /// The target of the finger: an edge, its height there, and its speed from there on.
    target: (u64, f64, f64),
    /// The lane of the touch that is 0 at the anchor, because the segment begins where it passes 0.
    zero: Option<usize>,
    pub(super) series: Series,
    pub(super) work: L::Work,
    /// End of the segment as a time after the anchor, its reason, and the first edge that the segment does not reach.
    end_s: f64,
    end: End,
    end_edge: u64,
    /// Bounds on the errors of angles and speeds at the anchor.
    pub(super) error: [f64; 2],
    energy: ArmEnergy,
    initial_j: f64,
    mode_changes: u64,
    segments: u64,
    /// The motors' torques between rows, if the observer asks for them.
    gauge: Option<Box<Gauge<3>>>,
}

/// The motors' torques along a segment. They follow their commands through a first-order lag and have no turning
/// points: `lag' = -lag / T`, so `∫ lag = T (lag(0) - lag(t))`.
struct Torques<'m, 'a, L: Links>(&'m ArmMotion<'a, L>);

impl<L: Links> Torques<'_, '_, L> {
    fn between(&self, from: Option<u64>, to: Option<u64>) -> [(f64, Lanes); 2] {
        let motion = self.0;
        let times = [from.map_or(0.0, |edge| motion.time_s(edge)), to.map_or(motion.end_s, |edge| motion.time_s(edge))];
        times.map(|t| (t, value(&motion.series.lag[..=motion.series.powers], t)))
    }
}

impl<L: Links> Stretch<3> for Torques<'_, '_, L> {
    fn integral(&self, from: Option<u64>, to: Option<u64>) -> [f64; 3] {
        let [(start_s, early), (end_s, late)] = self.between(from, to);
        let lag_s = self.0.arm.joints.amplifier_s;
        std::array::from_fn(|i| self.0.start.u[i] * (end_s - start_s) + lag_s * (early[i] - late[i]))
    }

    fn include(&self, from: Option<u64>, to: Option<u64>, extents: &mut [Extent; 3]) {
        for (_, lag) in self.between(from, to) {
            extents.iter_mut().enumerate().for_each(|(i, extent)| extent.take(self.0.start.u[i] + lag[i]));
        }
    }
}

fn lanes([a, b, c]: [f64; 3]) -> [f64; 4] {
    [a, b, c, 0.0]
}

fn joints([a, b, c, _]: [f64; 4]) -> [f64; 3] {
    [a, b, c]
}

impl<'a, L: Links> ArmMotion<'a, L> {
    /// Creates an arm at edge 0, without torque. Transmissions are relaxed, and locked joints do not move, whatever
    /// their speed.
    pub fn new(arm: &'a Arm<L>, angles_rad: [f64; 3], speeds_rad_per_s: [f64; 3]) -> Self {
        let q = lanes(angles_rad);
        let v = lanes(std::array::from_fn(|i| if arm.joints.free[i] { speeds_rad_per_s[i] } else { 0.0 }));
        let start = Start { q, v, p: q, w: v, ..Start::default() };
        let mut motion = Self {
            arm,
            anchor: 0,
            offset_s: 0.0,
            start,
            holds: [Hold::Locked; 3],
            target: (0, f64::INFINITY, 0.0),
            zero: None,
            series: Series::new(),
            work: arm.links.work(),
            end_s: 0.0,
            end: End::Worn,
            end_edge: 0,
            error: [0.0; 2],
            energy: ArmEnergy::default(),
            initial_j: arm.stored_j(&start),
            mode_changes: 0,
            segments: 0,
            gauge: None,
        };
        motion.begin(0, 0.0, start, None);
        motion.mode_changes = 0;
        motion
    }

    /// Moves to an edge, at or after the last one, and returns the angles that the encoders see there.
    #[inline]
    pub fn step(&mut self, edge: u64) -> [f64; 3] {
        while self.end_edge <= edge {
            self.follow();
        }
        self.encoder_rad(edge)
    }

    /// Returns the angles that the encoders see at an edge from the anchor on and before the segment's end. They are
    /// rounded downward, so that a rounded angle is below a limit exactly if the angle before rounding is.
    #[inline(always)]
    fn encoder_rad(&self, edge: u64) -> [f64; 3] {
        let (whole, part) = self.sum(&self.series.p, 2, self.time_s(edge));
        std::array::from_fn(|i| if part[i] < 0.0 { whole[i].next_down() } else { whole[i] })
    }

    /// Returns one of the four sums of the state, with the part that rounding takes from it: the anchor and the change
    /// since are added without error, and the change is small.
    #[inline(always)]
    pub(super) fn sum(&self, terms: &Coefficients, which: usize, t: f64) -> (Lanes, Lanes) {
        let low = &self.start.low;
        let rate = value(&terms[1..=self.series.powers], t);
        let mut sums = ([0.0; 4], [0.0; 4]);
        for i in 0..4 {
            // Angles also move by the low parts of their speeds.
            let rate = if which.is_multiple_of(2) { rate[i] + low[which + 1][i] } else { rate[i] };
            let (anchor, change) = (terms[0][i], low[which][i] + rate * t);
            let whole = anchor + change;
            let kept = whole - anchor;
            (sums.0[i], sums.1[i]) = (whole, (anchor - (whole - kept)) + (change - kept));
        }
        sums
    }

    /// Returns the first edge in (`from`, `limit`] at which an encoder's angle leaves its band or a segment has ended;
    /// none has left its band at `from`. After [`ArmMotion::step`] to that edge the angles may lie in the bands again.
    pub fn next_event(&self, from: u64, limit: u64, bands: &[Band; 3]) -> Option<u64> {
        let ended = self.end_edge <= limit;
        // The last edge of this segment to be searched.
        let mut last = if ended { self.end_edge - 1 } else { limit };
        let mut left = false;
        if self.series.powers > 0 && last > from {
            let terms = &self.series.p[..=self.series.powers];
            let (now, bounds) = (derivatives(terms, self.time_s(from)), Bounds::of(terms, self.time_s(last)));
            // Roughly the times at which the encoders leave: after the first event the others do not matter.
            let due = std::array::from_fn::<_, 3, _>(|i| {
                let [x, slope, _] = now.map(|lanes| lanes[i]);
                if slope > 0.0 { (bands[i].high - x) / slope } else { (bands[i].low - x) / slope }
            });
            let mut order = [0, 1, 2];
            order.sort_by(|&a, &b| due[a].total_cmp(&due[b]));
            for joint in order {
                let start = now.map(|lanes| lanes[joint]);
                if let Some(edge) = self.leaves(joint, &bands[joint], from, last, start, &bounds) {
                    left = true;
                    last = edge - 1;
                }
            }
        }
        if left { Some(last + 1) } else { ended.then_some(self.end_edge) }
    }

    /// Returns the first edge in (`from`, `last`] at which the joint's encoder, which is at `now`, is outside its band.
    fn leaves(&self, joint: usize, band: &Band, from: u64, last: u64, now: [f64; 3], bounds: &Bounds) -> Option<u64> {
        let angle = Polynomial::bounded(&self.series.p[..=self.series.powers], joint, bounds);
        let noise = bounds.noise[joint];
        let is_out = |edge| band.left_by(self.encoder_rad(edge)[joint]);
        angle.leaves(now, (band.low, band.high, noise), (from, last), self.arm.edge_s, |edge| self.time_s(edge), is_out)
    }

    /// Commands torques from `edge` on; the motion has already come to that edge.
    pub fn drive(&mut self, edge: u64, torques_nm: [f64; 3]) {
        let u = lanes(std::array::from_fn(|i| if self.arm.joints.free[i] { torques_nm[i] } else { 0.0 }));
        if u == self.start.u {
            return;
        }
        let t = self.time_s(edge);
        self.pass(edge, Some(edge));
        let mut x = self.account(t);
        if self.arm.joints.amplifier_s > 0.0 {
            x.lag = std::array::from_fn(|i| x.lag[i] + (x.u[i] - u[i]));
        }
        x.u = u;
        self.begin(edge, 0.0, x, None);
    }

    /// Tells the finger from `edge` on where its target is and how fast it moves; the motion has already come to that
    /// edge. A finger that was never told is apart.
    pub fn press(&mut self, edge: u64, target_m: f64, speed_m_per_s: f64) {
        let told = (edge, target_m, speed_m_per_s);
        if told == self.target {
            return;
        }
        let t = self.time_s(edge);
        self.pass(edge, Some(edge));
        let mut x = self.account(t);
        self.target = told;
        x.press = Press { target_m, speed_m_per_s, touch: Touch::Apart };
        x.press.touch = self.arm.pushed(joints(x.q), joints(x.v), &x.press).0;
        self.begin(edge, 0.0, x, None);
    }

    /// Returns the state at an edge at which the motion is, or before the next event.
    pub fn state(&self, edge: u64) -> ArmState {
        let t = self.time_s(edge);
        let x = self.at(t);
        let is_pressed = x.press.touch == Touch::Pressed;
        ArmState {
            angles_rad: joints(x.q),
            speeds_rad_per_s: joints(x.v),
            motor_angles_rad: self.encoder_rad(edge),
            motor_speeds_rad_per_s: joints(x.w),
            torques_nm: std::array::from_fn(|i| x.u[i] + x.lag[i]),
            stuck: self.holds.map(|hold| hold == Hold::Stuck),
            finger_n: if is_pressed { value(&self.series.touch[..=self.series.powers], t)[FORCE] } else { 0.0 },
        }
    }

    /// Gathers mean and extremes of the motors' torques between rows from edge 0 on; see [`measured`](Self::measured).
    pub fn measure(&mut self, pace: Pace) {
        self.gauge = Some(Box::new(Gauge::new(pace, [true; 3])));
    }

    /// Returns the exact means and extremes of the motors' torques since the row before the row at this edge; `None`
    /// unless [`measure`](Self::measure) asked for them.
    pub fn measured(&self, edge: u64) -> Option<[Measured; 3]> {
        let gauge = self.gauge.as_deref()?;
        let torques_nm = self.state(edge).torques_nm;
        let now = if self.time_s(edge) == 0.0 {
            gauge.clone()
        } else {
            gauge.after(self.anchor, edge, Some(edge), &Torques(self))
        };
        Some(now.row(edge, self.arm.edge_s, &torques_nm))
    }

    /// Tells the gauge the torques up to an edge on the segment, or up to its end.
    fn pass(&mut self, now: u64, to: Option<u64>) {
        if let Some(gauge) = &self.gauge
            && to.is_none_or(|edge| self.time_s(edge) > 0.0)
        {
            self.gauge = Some(Box::new(gauge.after(self.anchor, now, to, &Torques(self))));
        }
    }

    /// Returns the energy exchanged until an edge.
    pub fn energy(&self, edge: u64) -> ArmEnergy {
        let mut energy = self.energy;
        energy.take(&self.arm.joints, &self.start, &self.series, self.time_s(edge));
        energy
    }

    /// Returns the energy stored at an edge minus that at the start, in J.
    pub fn stored_j(&self, edge: u64) -> f64 {
        self.arm.stored_j(&self.at(self.time_s(edge))) - self.initial_j
    }

    /// Returns how often a joint has begun to stick, to slip, or to slip the other way.
    pub fn mode_changes(&self) -> u64 {
        self.mode_changes
    }

    /// Returns the number of series computed so far.
    pub fn segments(&self) -> u64 {
        self.segments
    }

    /// Returns the time from the anchor to an edge at or after it.
    #[inline(always)]
    pub(super) fn time_s(&self, edge: u64) -> f64 {
        (edge - self.anchor) as f64 * self.arm.edge_s + self.offset_s
    }

    /// Returns the state a time after the anchor.
    fn at(&self, t: f64) -> Start {
        let Series { q, v, p, w, lag, powers, .. } = &self.series;
        let (q, v, p, w) = (self.sum(q, 0, t), self.sum(v, 1, t), self.sum(p, 2, t), self.sum(w, 3, t));
        let lag = value(&lag[..=*powers], t);
        Start {
            q: q.0,
            v: v.0,
            p: p.0,
            w: w.0,
            u: self.start.u,
            lag,
            press: self.start.press,
            low: [q.1, v.1, p.1, w.1],
        }
    }

    /// Accounts for the energy of the first `t` after the anchor and returns the state there.
    fn account(&mut self, t: f64) -> Start {
        self.energy.take(&self.arm.joints, &self.start, &self.series, t);
        self.error = self.error(t);
        self.at(t)
    }

    /// Computes the segment after the present one.
    #[cold]
    fn follow(&mut self) {
        if self.end == End::Short {
            let Self { arm, start, holds, series, work, .. } = self;
            L::extend(arm, series, work, start, holds, ORDER);
            return self.look_ahead(self.end_s);
        }
        self.pass(self.end_edge, None);
        let mut x = self.account(self.end_s);
        let (mut broke, mut zero) = (None, None);
        match self.end {
            End::Short | End::Worn => {}
            End::Stop(joint) => {
                (x.w[joint], x.low[3][joint]) = (0.0, 0.0);
                if self.arm.joints.transmission[joint].is_none() {
                    (x.v[joint], x.low[1][joint]) = (0.0, 0.0);
                }
            }
            End::Break(joint, direction) => broke = Some((joint, direction)),
            End::Touch(lane, next) => {
                let depth_m = value(&self.series.touch[..=self.series.powers], self.end_s)[DEPTH];
                // A pad without damping ends to press where it ends to be deep.
                x.press.touch = if next == Touch::Relaxing && depth_m <= 0.0 { Touch::Apart } else { next };
                self.mode_changes += 1;
                zero = Some(lane);
            }
        }
        let offset_s = (self.time_s(self.end_edge) - self.end_s).max(0.0);
        self.zero = zero;
        self.begin(self.end_edge, offset_s, x, broke);
        self.zero = None;
    }

    /// Sets the anchor at `x`, `offset_s` before `edge`.
    fn begin(&mut self, edge: u64, offset_s: f64, mut x: Start, broke: Option<(usize, f64)>) {
        if x.lag.iter().all(|lag| lag.abs() < SETTLED * self.arm.tolerance) {
            x.lag = [0.0; 4];
        }
        if self.arm.finger.is_some() {
            let (told, target_m, speed_m_per_s) = self.target;
            x.press.target_m = target_m + speed_m_per_s * ((edge - told) as f64 * self.arm.edge_s - offset_s);
        }
        self.segments += 1;
        (self.anchor, self.offset_s, self.start) = (edge, offset_s, x);
        let holds = self.arm.holds(&x, broke);
        self.mode_changes += holds.iter().zip(&self.holds).filter(|(now, before)| now != before).count() as u64;
        self.holds = holds;
        self.arm.write(&mut self.series, &mut self.work, &x, &self.holds);
        self.look_ahead(0.0);
    }

    /// Finds the end of the segment, which lasts until `from` at least.
    fn look_ahead(&mut self, from: f64) {
        let Series { good_s, powers, .. } = self.series;
        if powers == 0 || good_s.is_nan() {
            // At rest, or lost in a singular pose: the state does not change any more.
            self.end_edge = u64::MAX;
            return;
        }
        self.end_s = good_s.clamp(SHORTEST_S, LONGEST_S).max(from);
        self.end = if powers < ORDER { End::Short } else { End::Worn };
        for joint in 0..3 {
            self.watch(joint, from);
        }
        if let Some(finger) = &self.arm.finger {
            for (lane, sign, next) in Finger::ends(self.start.press.touch) {
                let watched =
                    finger.watched(&self.series.touch[..=self.series.powers], (*lane, *sign), self.zero, self.end_s);
                self.shorten(watched.keeps(0.0, 1.0, from), End::Touch(*lane, *next));
            }
        }
        let edges = ((self.end_s - self.offset_s) / self.arm.edge_s) as u64;
        self.end_edge = self.anchor + edges.saturating_sub(1);
        while self.time_s(self.end_edge) < self.end_s {
            self.end_edge += 1;
        }
    }

    /// Ends the segment where this joint's mode ends, if that comes first.
    fn watch(&mut self, joint: usize, from: f64) {
        let terms = ..=self.series.powers;
        match self.holds[joint] {
            Hold::Slip(sign) if sign != 0.0 => {
                // From rest, the first term only gives the direction of the start.
                let skip = usize::from(self.start.w[joint] == 0.0);
                let speed = Polynomial::new(&self.series.w[terms], joint, sign, skip, self.end_s);
                self.shorten(speed.keeps(0.0, 1.0, from), End::Stop(joint));
            }
            Hold::Stuck => {
                let torque = Polynomial::new(&self.series.hold[terms], joint, 1.0, 0, self.end_s);
                // Rounding may have put the torque beyond its limit already; the joint then breaks away when the torque
                // grows further.
                let beyond_nm = torque.start().abs() * (1.0 + 4.0 * f64::EPSILON);
                let limit_nm = self.arm.joints.coulomb_nm[joint].max(beyond_nm);
                for direction in [1.0, -1.0] {
                    self.shorten(torque.keeps(limit_nm, -direction, from), End::Break(joint, direction));
                }
            }
            _ => {}
        }
    }

    /// Ends the segment where a condition ceases to hold, if that comes first.
    fn shorten(&mut self, reach: Reach, end: End) {
        match reach {
            Reach::At(t) if t < self.end_s => (self.end_s, self.end) = (t, end),
            Reach::Until(t) if t < self.end_s => (self.end_s, self.end) = (t.max(ONWARD_S), End::Worn),
            _ => {}
        }
    }
}
