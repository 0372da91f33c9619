//! An arm's law in floats, closed around the arm in steps: no words, no wiring and no clock.
//!
//! The law is that of the [host](super::host), also where an FPGA computes it. At its sample instants it reads the
//! counts, or the true angles. Its commands are as late, and the counters' values as old, as they are with a clock. A
//! step ends at an instant of the host that would fall inside it.
//!
//! An FPGA samples far more often than an arm needs steps. Where its period is shorter than a step, the law follows the
//! arm: at every state at which the method asks for slopes, it reads the angles as they were half a period and the
//! datapath's latency before, extrapolated by the present speeds. This is the mean age of the angles behind a sampled
//! and held command. Counts are replaced by their mean too, half a count below the angles, and commands are not
//! rounded.
//!
//! Within a step the angles move on the straight line between its ends; the rows of the trace and the changes of counts
//! are those of that line. Words are shown only at the rows, as with the decoders at rest.

use std::sync::atomic::Ordering;

use hpu_plant::arm::kinematics::{Pose, Sines};
use hpu_signal::{Cycle, Observe};

use super::PhantomPlant;
use super::host::{COUNTING, HostState};
use crate::result::columns::ARM_REALS;
use crate::result::stopwatch::Stopwatch;
use crate::result::summary::Summary;
use crate::result::trace::Trace;
use crate::run::engine::{Control, TURN};
use crate::run::simulation::Direct;
use crate::world::arm::{ArmPlant, ArmState};
use crate::world::arm_body::ArmBody;

/// Nets of the wiring around a host: pins, the host's commands, positions, commands, synchronised lines, the decoders'
/// outputs.
const NETS: usize = 27;

/// An arm's law in floats, closed around the arm in steps.
pub(super) struct ArmDirect<'p> {
    pub(super) plant: &'p PhantomPlant,
    /// Clock edges per step.
    pub(super) step: u64,
    pub(super) edge_s: f64,
    /// Mean age, in seconds, of the angles behind a command, where the law follows the arm and has no sample instants.
    pub(super) follows: Option<f64>,
}

/// The state of one run of an [`ArmDirect`].
struct Course<'d, 'p> {
    direct: &'d ArmDirect<'p>,
    state: ArmState<'p>,
    host: HostState<'p>,
    output_changes: u64,
    /// Whether rows also have means and extremes.
    measures: bool,
}

impl Direct for ArmDirect<'_> {
    fn run(
        &self,
        (from, end): (u64, u64),
        stride: u64,
        trace: &mut Trace,
        observer: &mut dyn Observe,
        control: &Control,
    ) -> (Summary, f64, Option<&'static str>) {
        let clock = Stopwatch::start();
        let mut course = Course::new(self);
        let (mut steps, mut next_row, mut complete, mut contact) = (0u64, 0, true, 0);
        course.measures = trace.keeps_beyond(ARM_REALS.len()) || observer.measures();
        if course.measures {
            course.state.measure(stride);
        }
        while course.state.edge < end && course.state.over.is_none() {
            let edge = course.state.edge;
            let next = course.begin(end);
            if course.state.command[self.plant.axis] != 0 {
                contact += next.max(from) - edge.max(from);
            }
            while next_row < next {
                course.show(next_row, trace, observer);
                next_row += stride;
            }
            course.state.go(next);
            steps += 1;
            if steps.is_multiple_of(TURN.into()) && !control.goes_on(next, steps) {
                complete = false;
                break;
            }
        }
        if next_row == course.state.edge {
            course.show(next_row, trace, observer);
        }
        let state = &course.state;
        control.progress.store(state.edge, Ordering::Relaxed);
        let summary = Summary {
            complete,
            edges: state.edge,
            wall_s: clock.seconds(),
            ticks: steps,
            steps,
            output_changes: course.output_changes,
            ..state.summary()
        };
        (summary, contact as f64, state.over)
    }
}

impl<'d, 'p> Course<'d, 'p> {
    fn new(direct: &'d ArmDirect<'p>) -> Self {
        let host = direct.plant.host.as_ref().expect("a law in floats is a host's");
        Self {
            direct,
            state: ArmState::new(&direct.plant.arm),
            host: HostState::new(host),
            output_changes: 0,
            measures: false,
        }
    }

    /// Begins a step, which ends at `end` at the latest, and returns the edge at which it ends.
    fn begin(&mut self, end: u64) -> u64 {
        let ArmDirect { plant, step, edge_s, follows } = *self.direct;
        let Self { state, host, output_changes, .. } = self;
        let (edge, before, law) = (state.edge, state.command, host.host());
        let ArmBody::Stepped(arm) = &mut state.motion else { unreachable!("an arm without a clock is stepped") };
        let counting_s = COUNTING as f64 * edge_s;
        if follows.is_none() {
            while host.due() <= edge {
                let (angles_rad, speeds) = (*arm.motor_angles_rad(), *arm.motor_speeds_rad_per_s());
                host.act(edge, || counted_rad(&plant.arm, earlier(&angles_rad, &speeds, counting_s)), || angles_rad);
            }
            state.command = host.command();
        }
        let due = if follows.is_some() { end } else { host.due() };
        let next = (edge + step).min(due).min(end);
        if let Some(age_s) = follows {
            let lower = if law.ideal { 0.0 } else { 0.5 };
            let read = |p: &[f64; 3], w: &[f64; 3]| {
                let old_rad = earlier(p, w, age_s);
                [0, 1, 2].map(|i| old_rad[i] - lower * plant.arm.count_rad[i])
            };
            let near = Sines::of(read(arm.motor_angles_rad(), arm.motor_speeds_rad_per_s()));
            let followed = |p: &[f64; 3], w: &[f64; 3]| {
                law.within(law.torques_nm(&Pose::by(law.lengths_m, near.near(read(p, w)))))
            };
            let torques_nm = followed(arm.motor_angles_rad(), arm.motor_speeds_rad_per_s());
            state.command = law.words(torques_nm);
            arm.plan(next - edge, torques_nm, followed);
        } else {
            let torques_nm = [0, 1, 2].map(|i| state.command[i] as f64 * plant.arm.command_nm[i]);
            arm.plan(next - edge, torques_nm, |_, _| torques_nm);
        }
        *output_changes += u64::from(state.command != before);
        next
    }

    /// Moves to a row of the trace within the step, and shows the row.
    fn show(&mut self, row: u64, trace: &mut Trace, observer: &mut dyn Observe) {
        let (mut reals, at) = (self.state.pass(row).to_vec(), Cycle(row));
        if self.measures {
            self.state.measured(row, &mut reals);
        }
        if trace.follows(0..NETS) || observer.follows(0..NETS) {
            let words = self.words();
            trace.nets(at, &words);
            observer.nets(at, &words);
        }
        trace.reals(at, &reals);
        observer.reals(at, &reals);
    }

    fn words(&self) -> [i64; NETS] {
        let (pins, command) = (self.state.pins(), self.state.command);
        let width = self.host.host().position.width();
        let positions = self.state.counts().map(|count| count & ((1 << width) - 1));
        let mut words = [0; NETS];
        let groups = [&pins[..], &command, &positions, &command, &pins];
        for (word, shown) in words.iter_mut().zip(groups.into_iter().flatten()) {
            *word = *shown;
        }
        words
    }
}

/// Returns the motor angles of `age_s` ago, extrapolated by the present speeds.
fn earlier(angles_rad: &[f64; 3], speeds_rad_per_s: &[f64; 3], age_s: f64) -> [f64; 3] {
    [0, 1, 2].map(|i| angles_rad[i] - speeds_rad_per_s[i] * age_s)
}

/// Returns angles rounded down to whole counts, as counters read them.
fn counted_rad(arm: &ArmPlant, angles_rad: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|joint| (angles_rad[joint] / arm.count_rad[joint]).floor() * arm.count_rad[joint])
}
