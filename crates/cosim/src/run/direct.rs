//! A loop around an axis in steps, without a clock. It is closed by the law in floats, as users of other tools write
//! it, or by the words of its wiring, whose counter is loaded with counts.
//!
//! At a sample instant (one clock after the start and every sample period from there) the controller reads the
//! position; a live spring reads it at every step too. A step ends at a sample instant that would fall inside it.
//!
//! - The law in floats reads the present position, in whole counts or the true one. Its force, limited to what the
//!   actuator gives, is held over the step.
//! - A loop in words reads the position of four edges before, the time that synchroniser, decoder and counter take. Its
//!   wiring then ticks and leaps through the step. A command that changes within the step acts by its mean.
//!
//! The hand's knots, a ramp and an analog shaper take effect at the start of the next step. An averaged bridge gives
//! the mean over the step of its output (see [`Latch`]). Commands that a host hands on within a step act by their mean,
//! those of a latched bridge by what its periods take of them. The rows of the trace lie on the straight line between
//! the ends of a step. Words are shown only at the rows; those of a wiring are the words at the step's end.

use std::collections::VecDeque;
use std::sync::atomic::Ordering;

use hpu_datapath::{Loaded, LoopIn};
use hpu_plant::{Axis, Chord, Device, Drive, Gauge, Method, Pace, REALS, State};
use hpu_signal::{Cycle, Observe};

use crate::result::columns::tell;
use crate::result::contact::share_beyond;
use crate::result::stays::Stays;
use crate::result::stopwatch::Stopwatch;
use crate::result::summary::{EnergyAudit, Summary, Unheld};
use crate::result::trace::{Lines, Trace};
use crate::run::controller::{Asked, Controller, FloatsLaw, LoadedLoop, Reading};
use crate::run::engine::{Control, TURN};
use crate::run::law_loop::LawConfig;
use crate::run::simulation::Direct;
use crate::world::actuator::{Actuator, Latch, Shaping};
use crate::world::encoder::Encoder;
use crate::world::integrator::Integrator;
use crate::world::plant::{Kind, Plant};
use crate::world::stepped::{DIVERGED, FAR};
use hpu_scene::Schedule;
use hpu_scene::method::AxisLoop;

/// The law that an [`AxisDirect`] closes its loop with.
pub(crate) enum Computed<'p> {
    /// A law in floats, and the wall's position if it reads the true position.
    Law(&'p LawConfig, Option<f64>),
    /// A loop in words that is loaded with counts: its wiring, constant inputs, and whether its spring is live.
    Words(&'p AxisLoop, LoopIn<i64>, bool),
}

/// A law in floats or a loop in words, closed around an axis in steps.
pub struct AxisDirect<'p> {
    pub(crate) plant: &'p Plant,
    pub(crate) computed: Computed<'p>,
    pub(crate) schedule: Schedule,
    /// The least angle at which the wall sees penetration.
    pub(crate) touched_rad: f64,
    /// The wall's surface, and the least angle deep inside it.
    pub(crate) wall_rad: [f64; 2],
    /// The stepping method; `None` flows exactly.
    pub(crate) method: Option<Method>,
    /// Clock edges of a step.
    pub(crate) step: u64,
    /// Clock edges of a sample period.
    pub(crate) period: u64,
}

/// The state of one run of an [`AxisDirect`].
struct Course<'d, 'p, C> {
    direct: &'d AxisDirect<'p>,
    axis: &'p Axis,
    edge_s: f64,
    integrator: Integrator<'p>,
    controller: C,
    /// The force, in N, or the duty asked for in the step before.
    asked: f64,
    /// Forces and duties on their way through a host, each with the edge at which the actuator takes it.
    waiting: VecDeque<Asked>,
    /// The force and the duty that the host handed on last.
    taken: [f64; 2],
    drive: Drive,
    latch: Option<Latch>,
    shaping: Option<Shaping>,
    intent_rad_per_s: f64,
    x: State,
    encoder: Encoder,
    start_count: i64,
    output_changes: u64,
    next_sample: u64,
    next_knot: usize,
    /// The edge of the next row, and the edges between rows.
    next_row: u64,
    stride: u64,
    /// Current and speed between rows, if the observer asks for them.
    gauge: Option<Gauge<2>>,
    /// Integrals of current and angle from the start of the verdict's window.
    sums: [f64; 2],
}

/// Returns force and duty that are asked for.
fn asked(asked: &Asked) -> [f64; 2] {
    [asked.force_n, asked.duty]
}

impl Direct for AxisDirect<'_> {
    fn run(
        &self,
        window: (u64, u64),
        stride: u64,
        trace: &mut Trace,
        observer: &mut dyn Observe,
        control: &Control,
    ) -> (Summary, f64, Option<&'static str>) {
        match self.computed {
            Computed::Law(config, ideal) => {
                let law = FloatsLaw::new(config, self.schedule.clone(), ideal);
                self.close(law, window, stride, trace, observer, control)
            }
            Computed::Words(axis_loop, input, live) => hpu_scene::with_axis_loop!(axis_loop, wiring => {
                self.close(self.loaded(wiring, input, live), window, stride, trace, observer, control)
            }),
        }
    }
}

impl AxisDirect<'_> {
    /// Returns the edges of contact, beyond the wall's surface, and deep inside it, in a step that ends in the window,
    /// on a straight line between two angles.
    #[inline(always)]
    fn contact(&self, (edge, next): (u64, u64), from: u64, (before_rad, after_rad): (f64, f64)) -> [f64; 3] {
        let per_edge = (after_rad - before_rad) / (next - edge) as f64;
        let start_rad = before_rad + per_edge * from.saturating_sub(edge) as f64;
        let edges = (next - edge.max(from)) as f64;
        let [surface_rad, deep_rad] = self.wall_rad;
        let limits_rad = [self.touched_rad, surface_rad, deep_rad];
        limits_rad.map(|limit_rad| share_beyond(limit_rad, start_rad, after_rad) * edges)
    }

    /// Returns the loop in words, ready to be loaded.
    fn loaded<W: Loaded + Clone>(&self, wiring: &W, input: LoopIn<i64>, live: bool) -> LoadedLoop<W> {
        let (quantum_n, duty) = match self.plant.actuator {
            Actuator::Amplified { quantum_n, .. } => (quantum_n, 0.0),
            Actuator::Averaged { full_scale, .. } => (0.0, 1.0 / full_scale),
            _ => unreachable!("scenes refuse it: without a clock nothing switches"),
        };
        LoadedLoop::new(wiring.clone(), input, self.schedule.clone(), live, (quantum_n, duty))
    }

    /// Closes the loop with a controller and runs it.
    fn close<C: Controller>(
        &self,
        controller: C,
        (from, end): (u64, u64),
        stride: u64,
        trace: &mut Trace,
        observer: &mut dyn Observe,
        control: &Control,
    ) -> (Summary, f64, Option<&'static str>) {
        let clock = Stopwatch::start();
        let measures = trace.keeps_beyond(REALS.len()) || observer.measures();
        let gauge = measures.then(|| Gauge::new(Pace { stride, period: None }, [true; 2]));
        let mut course = Course { gauge, stride, ..Course::new(self, controller) };
        let initial_j = course.axis.stored_j(&course.x);
        let (mut edge, mut steps) = (0, 0u64);
        let (mut complete, mut over, mut contact) = (true, None, [0.0; 3]);
        let mut unheld = self.plant.places.tally(course.start_count).unheld;
        let mut unheld_before = None;
        while edge < end {
            let next = course.act(edge, end);
            let before = course.x;
            course.x = course.integrator.flow((edge, next), self.plant.edge_s, &before);
            course.show_rows((edge, next), &before, trace, observer);
            course.average(edge, next, from, &before);
            unheld.see(edge, course.encoder.count());
            if next > from {
                unheld_before.get_or_insert_with(|| unheld.edges(from));
                let more = self.contact((edge, next), from, (before[2], course.x[2]));
                contact.iter_mut().zip(more).for_each(|(edges, more)| *edges += more);
            }
            edge = next;
            steps += 1;
            if course.x[2].abs() > FAR || course.x[2].is_nan() {
                over = Some(DIVERGED);
                break;
            }
            over = course.encoder.over();
            if over.is_some() {
                break;
            }
            if steps.is_multiple_of(TURN.into()) && !control.goes_on(edge, steps) {
                complete = false;
                break;
            }
        }
        if over.is_none() && course.next_row == edge {
            course.show_end(edge, trace, observer);
        }
        control.progress.store(edge, Ordering::Relaxed);
        let stored_j = course.axis.stored_j(&course.x) - initial_j;
        let (energy, mode_changes, redecided) = course.integrator.audit(edge);
        let [contact, inside, deep] = contact;
        let summary = Summary {
            complete,
            edges: edge,
            wall_s: clock.seconds(),
            ticks: steps,
            steps,
            encoder_edges: course.encoder.edges,
            output_changes: course.output_changes,
            mode_changes,
            redecided,
            energy: EnergyAudit::of(&energy, stored_j),
            averages: course.averages(edge, from),
            stays: Some(Stays {
                inside: inside.round() as u64,
                deep: deep.round() as u64,
                unheld: unheld_before.map_or(0, |before| unheld.edges(edge) - before),
            }),
            unheld: unheld.first().map(|first| Unheld { first, edges: unheld.edges(edge) }),
            ..Summary::default()
        };
        (summary, contact, over)
    }
}

impl<'d, 'p, C: Controller> Course<'d, 'p, C> {
    fn new(direct: &'d AxisDirect<'p>, controller: C) -> Self {
        let plant = direct.plant;
        let Kind::Axis { axis, current_a, speed_rad_per_s, angle_rad, .. } = &plant.kind else {
            unreachable!("a recording has no steps");
        };
        let device = Device::new(axis, *current_a, *speed_rad_per_s, *angle_rad);
        let (x, drive) = (device.state(0), device.drive_now());
        let integrator = Integrator::new(axis, device, direct.method, direct.step, plant.edge_s);
        let (shaping, latch) = match plant.actuator {
            Actuator::Amplified { shaping, .. } => (shaping, None),
            Actuator::Averaged { latch, .. } => (None, latch),
            _ => (None, None),
        };
        let encoder = Encoder::new(plant.count_rad, x[2]);
        Self {
            direct,
            axis,
            edge_s: plant.edge_s,
            integrator,
            controller,
            asked: 0.0,
            waiting: VecDeque::new(),
            taken: [0.0; 2],
            drive,
            latch,
            shaping,
            intent_rad_per_s: 0.0,
            x,
            start_count: encoder.count(),
            encoder,
            output_changes: 0,
            next_sample: 1,
            next_knot: 0,
            next_row: 0,
            stride: 1,
            gauge: None,
            sums: [0.0; 2],
        }
    }

    /// Returns a position as the controller reads it.
    #[inline(always)]
    fn reading(&mut self, angle_rad: f64) -> Reading {
        if self.controller.counts() {
            self.encoder.sense(angle_rad);
        }
        Reading { count: self.encoder.count() - self.start_count, angle_rad }
    }

    /// Carries out all that is due at the start of a step, which ends at `end` at the latest. Returns the edge at which
    /// it ends.
    #[inline(always)]
    fn act(&mut self, edge: u64, end: u64) -> u64 {
        let knots = match &self.direct.plant.kind {
            Kind::Axis { knots, .. } | Kind::Network { knots, .. } | Kind::Pmsm { knots, .. } => &knots[..],
            Kind::Capture { .. } => &[],
        };
        let mut fed = false;
        while let Some(knot) = knots.get(self.next_knot).filter(|knot| knot.edge <= edge) {
            self.next_knot += 1;
            let angle_rad = knot.angle_rad + knot.speed_rad_per_s * ((edge - knot.edge) as f64 * self.edge_s);
            self.intend(edge, angle_rad, knot.speed_rad_per_s);
            fed = true;
        }
        if edge == self.next_sample {
            self.sample(edge);
        }
        let next = (edge + self.direct.step).min(self.next_sample).min(end);
        if self.controller.is_live() && edge > 0 {
            self.follow(edge, next);
        }
        let drive = if edge == 0 { self.drive } else { self.output(edge, next) };
        if fed || drive != self.drive {
            self.output_changes += u64::from(drive != self.drive);
            self.drive = drive;
            self.x = self.integrator.driven(self.axis, edge, drive, &self.x, self.intent_rad_per_s);
        }
        next
    }

    fn intend(&mut self, edge: u64, angle_rad: f64, speed_rad_per_s: f64) {
        self.intent_rad_per_s = speed_rad_per_s;
        self.x = self.integrator.intend(self.axis, edge, (angle_rad, speed_rad_per_s), &self.x);
    }

    /// Returns the age, in seconds, of a position that is read at an edge.
    #[inline(always)]
    fn late_s(&self, edge: u64) -> f64 {
        C::LATE.min(edge.saturating_sub(1)) as f64 * self.edge_s
    }

    fn sample(&mut self, edge: u64) {
        if edge == 1 {
            // Counts start from the lines' first levels.
            self.reading(self.x[2]);
            self.start_count = self.encoder.count();
        }
        let at = self.reading(self.x[2] - self.x[1] * self.late_s(edge));
        self.controller.sample(edge, at);
        self.next_sample += self.direct.period;
    }

    /// Lets a live spring read the middle of a step: the words there, and the angle extrapolated by the present speed.
    /// The semi-implicit method moves on by the new speed, which already places the reading in the middle.
    #[inline(always)]
    fn follow(&mut self, edge: u64, next: u64) {
        let ahead_s = match self.direct.method {
            Some(Method::SemiImplicit) => 0.0,
            _ => 0.5 * (next - edge) as f64 * self.edge_s,
        };
        let at = self.reading(self.x[2] + self.x[1] * (ahead_s - self.late_s(edge)));
        self.controller.follow(edge + (next - edge) / 2, at);
    }

    /// Returns the actuator's drive in a step for the force or duty that the controller asks for.
    #[inline(always)]
    fn output(&mut self, edge: u64, next: u64) -> Drive {
        let now = self.controller.asked(edge, next);
        if self.direct.plant.late > 0 {
            return self.handed_on((edge, next), now);
        }
        let Asked { force_n, duty, from } = now;
        // Before the edge `from` the previous value is asked for.
        let mut mean = |after: f64| {
            let before = std::mem::replace(&mut self.asked, after);
            if from == edge { after } else { before + (after - before) * ((next - from) as f64 / (next - edge) as f64) }
        };
        match (self.direct.plant.actuator, &mut self.shaping) {
            (Actuator::Averaged { .. }, _) => Drive::Average(match &mut self.latch {
                Some(latch) => latch.mean((edge, next), from, duty),
                None => mean(duty),
            }),
            (_, None) => Drive::Current(-mean(force_n)),
            (_, Some(shaping)) => match shaping.take(from, force_n) {
                Some(shaped_n) => Drive::Current(-shaped_n),
                None if shaping.next <= edge => Drive::Current(-shaping.hand_on(edge)),
                None => self.drive,
            },
        }
    }

    /// Returns the actuator's drive in a step behind a host, which takes what is asked for now and hands on what it
    /// took before.
    #[inline(never)]
    fn handed_on(&mut self, (edge, next): (u64, u64), now: Asked) -> Drive {
        if self.waiting.back().map_or(self.taken, asked) != asked(&now) {
            self.waiting.push_back(Asked { from: now.from + self.direct.plant.late, ..now });
        }
        let averaged = matches!(self.direct.plant.actuator, Actuator::Averaged { .. });
        let mut shaped =
            self.shaping.as_mut().filter(|shaping| shaping.next <= edge).map(|shaping| shaping.hand_on(edge));
        let (mut area, mut since) = (0.0, edge);
        while let Some(due) = self.waiting.pop_front_if(|due| due.from < next) {
            area += self.asked * (due.from - since) as f64;
            since = due.from;
            self.taken = asked(&due);
            self.asked = if averaged { due.duty } else { due.force_n };
            if let Some(latch) = &mut self.latch {
                latch.want(edge, due.from, due.duty);
            }
            if let Some(shaping) = &mut self.shaping {
                shaped = shaping.take(due.from, due.force_n).or(shaped);
            }
        }
        let last = self.asked;
        let mean = if since == edge { last } else { (area + last * (next - since) as f64) / (next - edge) as f64 };
        match (averaged, &mut self.latch, &self.shaping) {
            (true, Some(latch), _) => Drive::Average(latch.mean((edge, next), edge, last)),
            (true, None, _) => Drive::Average(mean),
            (false, _, Some(_)) => shaped.map_or(self.drive, |shaped_n| Drive::Current(-shaped_n)),
            (false, ..) => Drive::Current(-mean),
        }
    }

    /// Adds current and angle over a step to the sums, for the part of the step that lies in the window.
    #[inline(always)]
    fn average(&mut self, edge: u64, next: u64, window: u64, before: &State) {
        if next <= window {
            return;
        }
        let from = edge.max(window);
        let share = (from - edge) as f64 / (next - edge) as f64;
        let half_s = 0.5 * (next - from) as f64 * self.edge_s;
        for (sum, of) in self.sums.iter_mut().zip([0, 2]) {
            *sum += half_s * (before[of] + (self.x[of] - before[of]) * share + self.x[of]);
        }
    }

    /// Returns the means of torque and angle from the window's start on; `None` before it.
    fn averages(&self, edge: u64, window: u64) -> Option<[f64; 2]> {
        let length_s = edge.checked_sub(window).filter(|edges| *edges > 0)? as f64 * self.edge_s;
        let [current, angle] = self.sums.map(|sum| sum / length_s);
        Some([self.axis.torque_constant_nm_per_a() * current, angle])
    }

    /// Returns a part of the present step, from its start, as a chord.
    fn chord(&self, start: u64, end: u64, before: &State, x: &State) -> Chord<2> {
        let ends = [before, x].map(|x| [x[0], x[1]]);
        Chord { start, edges: end - start, edge_s: self.edge_s, ends }
    }

    /// Tells the gauge the current and speed over the present step.
    fn pass(&mut self, (edge, next): (u64, u64), before: &State) {
        if let Some(gauge) = &self.gauge {
            self.gauge = Some(gauge.after(edge, next, Some(next), &self.chord(edge, next, before, &self.x)));
        }
    }

    /// Shows the rows in the present step, which began in the state `before`.
    #[inline(always)]
    fn show_rows(&mut self, (edge, next): (u64, u64), before: &State, trace: &mut Trace, observer: &mut dyn Observe) {
        let (first, stride) = (self.next_row, self.stride);
        if self.gauge.is_some() {
            while self.next_row < next {
                self.show_measured(self.next_row, (edge, next), before, trace, observer);
                self.next_row += stride;
            }
            self.pass((edge, next), before);
        } else if first < next {
            let per_edge = 1.0 / (next - edge).cast_signed() as f64;
            let rate: State = std::array::from_fn(|k| (self.x[k] - before[k]) * per_edge);
            let gone = (first - edge).cast_signed() as f64;
            let start = std::array::from_fn(|k| before[k] + rate[k] * gone);
            let change = rate.map(|rate| rate * stride.cast_signed() as f64);
            let (start, change) = (self.axis.reals(&start), self.axis.reals(&change));
            let rows = (next - 1 - first) / stride + 1;
            // One pass is enough for nearly all steps.
            for part in (0..rows).step_by(1 << 20) {
                let gone = |k: usize| start[k] + change[k] * part as f64;
                let start = if part == 0 { start } else { std::array::from_fn(gone) };
                let (first, rows) = (first + part * stride, (rows - part).min(1 << 20) as u32);
                self.show(&Lines { first, stride, rows, start, change }, trace, observer);
            }
            self.next_row += rows * stride;
        }
    }

    /// Shows the row at the edge at which the run ends.
    fn show_end(&self, edge: u64, trace: &mut Trace, observer: &mut dyn Observe) {
        if self.gauge.is_some() {
            self.show_measured(edge, (edge, edge), &self.x, trace, observer);
        } else {
            let (start, stride) = (self.axis.reals(&self.x), self.stride);
            self.show(&Lines { first: edge, stride, rows: 1, start, change: [0.0; 4] }, trace, observer);
        }
    }

    /// Shows a row, with means and extremes, at an edge of the present step, which began in the state `before`.
    fn show_measured(
        &self,
        row: u64,
        (edge, next): (u64, u64),
        before: &State,
        trace: &mut Trace,
        observer: &mut dyn Observe,
    ) {
        let Some(gauge) = &self.gauge else { return };
        let share = if row == edge { 0.0 } else { (row - edge) as f64 / (next - edge) as f64 };
        let x: State = std::array::from_fn(|k| before[k] + (self.x[k] - before[k]) * share);
        let now = match row == edge {
            true => gauge.clone(),
            false => gauge.after(edge, row, Some(row), &self.chord(edge, row, before, &x)),
        };
        let mut reals = self.axis.reals(&x).to_vec();
        let measured = now.row(row, self.edge_s, &[x[0], x[1]]);
        tell(self.axis.torque_constant_nm_per_a(), &measured, self.axis.felt(&x, self.intent_rad_per_s), &mut reals);
        let controller = &self.controller;
        let count = Encoder::new(self.direct.plant.count_rad, x[2]).count() - self.start_count;
        let word = |net| controller.word(net).unwrap_or_else(|| controller.word_at(net, count));
        let (cycle, words) = (Cycle(row), (0..controller.nets()).map(word).collect::<Vec<_>>());
        trace.nets(cycle, &words);
        trace.reals(cycle, &reals);
        observer.nets(cycle, &words);
        observer.reals(cycle, &reals);
    }

    /// Shows rows of the trace, and the words at them.
    #[inline(always)]
    fn show(&self, lines: &Lines<4>, trace: &mut Trace, observer: &mut dyn Observe) {
        let controller = &self.controller;
        let count = |reals: &[f64; 4]| Encoder::new(self.direct.plant.count_rad, reals[2]).count() - self.start_count;
        trace.extend(lines, |net| controller.word(net), |net, reals| controller.word_at(net, count(reals)));
        let watched = observer.follows(0..controller.nets());
        for row in 0..lines.rows {
            let (edge, reals) = (Cycle(lines.first + u64::from(row) * lines.stride), lines.at(row));
            if watched {
                let count = count(&reals);
                let word = |net| controller.word(net).unwrap_or_else(|| controller.word_at(net, count));
                observer.nets(edge, &(0..controller.nets()).map(word).collect::<Vec<_>>());
            }
            observer.reals(edge, &reals);
        }
    }
}
