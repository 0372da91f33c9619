//! The law in floats, closed around a device in steps: no words, no wiring and no clock. What users of other tools write.
//!
//! At a sample instant, one clock after the start and every sample period from there, the law reads the position, a whole
//! number of counts or the true one; a live spring reads it at every step too. Its force, within what the actuator gives, is
//! held over the step. A step that a sample instant would fall into ends there. The hand's knots, a ramp and an analog shaper
//! are heeded at the next step's start. An averaged bridge gives the mean over a step of what it would give (see [`Latch`]). The rows of the trace lie on the straight line between the ends of a step, and words
//! are shown with them alone.

use std::sync::atomic::Ordering;
use std::time::Instant;

use hpu_plant::{Axis, Device, Drive, Method, State};
use hpu_signal::{Cycle, Observe};

use crate::actuator::{Actuator, Latch, Shaping};
use crate::arm_direct::ArmDirect;
use crate::encoder::Encoder;
use crate::engine::Control;
use crate::law::{AnyLaw, SampledLaw};
use crate::law_loop::{COMMAND, LawConfig, NETS, PENETRATION, POSITION};
use crate::mover::Mover;
use crate::plant::{Kind, Plant};
use crate::schedule::Schedule;
use crate::stepped::{DIVERGED, FAR};
use crate::summary::{EnergyAudit, Summary};
use crate::trace::{Lines, Trace};
use crate::world::Pins;

/// A scene's loop without wiring and clock.
#[allow(clippy::large_enum_variant, reason = "one of them exists a run")]
pub enum Direct<'p> {
    /// An axis's.
    Axis(AxisDirect<'p>),
    /// A PHANToM's.
    Arm(ArmDirect<'p>),
}

impl Direct<'_> {
    /// Runs to edge `end`, or until stopped, or until it cannot go on, and says why in that case.
    pub(crate) fn run(
        &self,
        end: u64,
        stride: u64,
        trace: &mut Trace,
        observer: &mut impl Observe,
        control: &Control,
    ) -> (Summary, Option<&'static str>) {
        match self {
            Self::Axis(direct) => direct.run(end, stride, trace, observer, control),
            Self::Arm(direct) => direct.run(end, stride, trace, observer, control),
        }
    }
}

/// A law in floats, closed around an axis in steps.
pub struct AxisDirect<'p> {
    pub(crate) plant: &'p Plant,
    pub(crate) law: LawConfig,
    pub(crate) schedule: Schedule,
    /// The method; none flows exactly.
    pub(crate) method: Option<Method>,
    /// Clock edges of a step.
    pub(crate) step: u64,
    /// Clock edges of a sample period.
    pub(crate) period: u64,
    /// The wall's position, if the law reads the true position.
    pub(crate) ideal_wall_rad: Option<f64>,
}

/// A run of it.
struct Course<'d, 'p> {
    direct: &'d AxisDirect<'p>,
    axis: &'p Axis,
    edge_s: f64,
    mover: Mover<'p>,
    law: AnyLaw,
    force_n: f64,
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
}

impl AxisDirect<'_> {
    /// Runs to edge `end`, or until stopped, or until the steps diverge, and says why in that case.
    fn run(
        &self,
        end: u64,
        stride: u64,
        trace: &mut Trace,
        observer: &mut impl Observe,
        control: &Control,
    ) -> (Summary, Option<&'static str>) {
        let clock = Instant::now();
        let mut course = Course::new(self);
        let initial_j = course.axis.stored_j(&course.x);
        let (mut edge, mut steps, mut next_row) = (0, 0u64, 0);
        let (mut complete, mut over) = (true, None);
        while edge < end {
            let next = course.act(edge, end);
            let before = course.x;
            course.x = course.mover.flow((edge, next), self.plant.edge_s, &before);
            if next_row < next {
                let per_edge = 1.0 / (next - edge).cast_signed() as f64;
                let rate: State = std::array::from_fn(|k| (course.x[k] - before[k]) * per_edge);
                let gone = (next_row - edge).cast_signed() as f64;
                let start = std::array::from_fn(|k| before[k] + rate[k] * gone);
                let change = rate.map(|rate| rate * stride.cast_signed() as f64);
                let rows =
                    i32::try_from((next - 1 - next_row) / stride + 1).expect("a trace fits in memory").cast_unsigned();
                let (start, change) = (course.axis.reals(&start), course.axis.reals(&change));
                course.show(&Lines { first: next_row, stride, rows, start, change }, trace, observer);
                next_row += u64::from(rows) * stride;
            }
            edge = next;
            steps += 1;
            if course.x[2].abs() > FAR || course.x[2].is_nan() {
                over = Some(DIVERGED);
                break;
            }
            if steps % 4096 == 0 {
                control.progress.store(edge, Ordering::Relaxed);
                if control.stop.load(Ordering::Relaxed) {
                    complete = false;
                    break;
                }
            }
        }
        if over.is_none() && next_row == edge {
            let start = course.axis.reals(&course.x);
            course.show(&Lines { first: edge, stride, rows: 1, start, change: [0.0; 4] }, trace, observer);
        }
        control.progress.store(edge, Ordering::Relaxed);
        let stored_j = course.axis.stored_j(&course.x) - initial_j;
        let (energy, mode_changes, redecided) = course.mover.audit(edge);
        let summary = Summary {
            verdict: None,
            aborted: None,
            complete,
            edges: edge,
            motion_s: 0.0,
            wall_s: clock.elapsed().as_secs_f64(),
            ticks: steps,
            steps,
            encoder_edges: course.encoder.edges,
            output_changes: course.output_changes,
            mode_changes,
            redecided,
            energy: EnergyAudit::of(&energy, stored_j),
            nets: Vec::new(),
        };
        (summary, over)
    }
}

impl<'d, 'p> Course<'d, 'p> {
    fn new(direct: &'d AxisDirect<'p>) -> Self {
        let plant = direct.plant;
        let Kind::Axis { axis, current_a, speed_rad_per_s, angle_rad, .. } = &plant.kind else {
            unreachable!("a recording has no steps");
        };
        let device = Device::new(axis, *current_a, *speed_rad_per_s, *angle_rad);
        let (x, drive) = (device.state(0), device.drive_now());
        let mover = Mover::new(axis, device, direct.method, direct.step, plant.edge_s);
        let (shaping, latch) = match plant.actuator {
            Actuator::Amplified { shaping, .. } => (shaping, None),
            Actuator::Averaged { latch, .. } => (None, latch),
            Actuator::Switching => (None, None),
        };
        let encoder = Encoder::new(plant.count_rad, x[2]);
        Self {
            direct,
            axis,
            edge_s: plant.edge_s,
            mover,
            law: direct.law.law.clone(),
            force_n: 0.0,
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
        }
    }

    /// The position beyond the wall's surface, as the law reads it.
    #[inline(always)]
    fn position_m(&mut self, angle_rad: f64) -> f64 {
        if let Some(wall_rad) = self.direct.ideal_wall_rad {
            return angle_rad - wall_rad;
        }
        self.encoder.sense(angle_rad);
        (self.encoder.count() - self.start_count - self.direct.law.surface) as f64 * self.direct.law.count_m
    }

    /// All that is due at the start of a step, which ends by `end`; returns where.
    #[inline(always)]
    fn act(&mut self, edge: u64, end: u64) -> u64 {
        let knots = match &self.direct.plant.kind {
            Kind::Axis { knots, .. } => &knots[..],
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
        if self.direct.law.live && edge > 0 {
            self.follow(edge, next);
        }
        let drive = if edge == 0 { self.drive } else { self.output(edge, next) };
        if fed || drive != self.drive {
            self.output_changes += u64::from(drive != self.drive);
            self.drive = drive;
            self.x = self.mover.driven(self.axis, edge, drive, &self.x, self.intent_rad_per_s);
        }
        next
    }

    fn intend(&mut self, edge: u64, angle_rad: f64, speed_rad_per_s: f64) {
        self.intent_rad_per_s = speed_rad_per_s;
        self.x = self.mover.intend(self.axis, edge, (angle_rad, speed_rad_per_s), &self.x);
    }

    /// The words that change by themselves, as they are then.
    #[inline(always)]
    fn vary(&mut self, edge: u64) {
        let schedule = self.direct.schedule;
        if schedule != Schedule::default() {
            let [stiffness, scale] = [(schedule.stiffness, 0), (schedule.scale, 1)].map(|(ramp, index)| {
                let start = self.direct.law.start[index];
                ramp.filter(|_| start != 0).map_or(1.0, |ramp| ramp.word(edge) as f64 / start as f64)
            });
            self.law.vary(&self.direct.law.law, stiffness, scale);
        }
    }

    fn sample(&mut self, edge: u64) {
        self.vary(edge);
        let x_m = self.position_m(self.x[2]);
        self.force_n = self.law.sample(x_m);
        self.next_sample += self.direct.period;
    }

    /// The force of a live spring in a step: that at its middle, by the stiffness then and of where the device will be by its
    /// present speed; a method that moves on by the new speed has the middle in itself.
    #[inline(always)]
    fn follow(&mut self, edge: u64, next: u64) {
        self.vary(edge + (next - edge) / 2);
        let ahead_s = match self.direct.method {
            Some(Method::SemiImplicit) => 0.0,
            _ => 0.5 * (next - edge) as f64 * self.edge_s,
        };
        let x_m = self.position_m(self.x[2] + self.x[1] * ahead_s);
        if let AnyLaw::Wall(wall) = &self.law {
            self.force_n = wall.force_n(x_m);
        }
    }

    /// What the actuator makes of the force in a step.
    #[inline(always)]
    fn output(&mut self, edge: u64, next: u64) -> Drive {
        let limit_n = self.direct.law.limit_n;
        let force_n = self.force_n.clamp(-limit_n, limit_n);
        match (self.direct.plant.actuator, &mut self.shaping) {
            (Actuator::Averaged { .. }, _) => {
                let duty = force_n / self.direct.law.full_scale_n;
                Drive::Average(self.latch.as_mut().map_or(duty, |latch| latch.mean(edge, next, duty)))
            }
            (_, None) => Drive::Current(-force_n),
            (_, Some(shaping)) => match shaping.take(edge, force_n) {
                Some(shaped_n) => Drive::Current(-shaped_n),
                None if shaping.next <= edge => Drive::Current(-shaping.hand_on(edge)),
                None => self.drive,
            },
        }
    }

    /// Rows of the trace, and the words at them.
    #[inline(always)]
    fn show(&self, lines: &Lines<4>, trace: &mut Trace, observer: &mut impl Observe) {
        let law = &self.direct.law;
        let command = || law.command(self.force_n);
        let words = |reals: &[f64; 4]| {
            let position = Encoder::new(self.direct.plant.count_rad, reals[2]).count() - self.start_count;
            let pins = Pins::at(position);
            let mut words = [0; NETS];
            (words[0], words[1]) = (pins.a, pins.b);
            words[POSITION] = position;
            words[PENETRATION] = (position - law.surface).max(0);
            words[COMMAND] = command();
            words
        };
        let all = |net| match net {
            0 | 1 | POSITION | PENETRATION => None,
            COMMAND => Some(command()),
            _ => Some(0),
        };
        trace.extend(lines, all, |net, reals| words(reals)[net]);
        let watched = observer.follows(0..NETS);
        for row in 0..lines.rows {
            let (edge, reals) = (Cycle(lines.first + u64::from(row) * lines.stride), lines.at(row));
            if watched {
                observer.nets(edge, &words(&reals));
            }
            observer.reals(edge, &reals);
        }
    }
}
