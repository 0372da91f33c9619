//! The nets of the two PHANToM loops, and the blocks that are connected to them.

use hpu_signal::Signal;

use super::encoders::Encoders;
use super::force_path::ForcePath;
use super::{CommandRegister, PhantomConfig, PhantomEngine, SampleRegister, TrigTable};
use crate::circuit::instance;
use crate::{Block, ConfigError, Instance, flatten};

hpu_signal::ports! {
    /// Inputs of a PHANToM loop: the encoders' pins and the words that the scene sets.
    pub struct PhantomIn {
        a_pin1, b_pin1, a_pin2, b_pin2, a_pin3, b_pin3,
        x_low, x_high, y_low, y_high, z_low, z_high, room, stiffness, period,
    }
}

hpu_signal::ports! {
    /// Outputs of a PHANToM loop: the motors' commands.
    pub struct PhantomOut { command1, command2, command3 }
}

/// The first net of each group, in order; the pins come before all groups.
pub(crate) const X_LOW: usize = 6;
pub(crate) const PERIOD: usize = 14;
pub(crate) const COMMANDS: usize = 15;
pub(crate) const LINES: usize = 18;
pub(crate) const POSITIONS: usize = LINES + Encoders::LINES;
pub(crate) const COUNTS: usize = POSITIONS + 3;
pub(crate) const SINES: usize = COUNTS + 3;
pub(crate) const X: usize = SINES + 9;
pub(crate) const FORCES: usize = X + 4;
pub(crate) const CONTACT: usize = FORCES + 3;
pub(crate) const TORQUES: usize = CONTACT + 1;
/// This group exists only in the parallel loop.
pub(crate) const SCALED: usize = TORQUES + 3;
/// The number of nets of the parallel loop.
pub(crate) const MOST: usize = SCALED + 3;

/// The blocks of a loop by instance label: the shared loop has no `hold`, the parallel loop no `engine`.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Blocks {
    pub(crate) encoders: Encoders,
    pub(crate) sample: SampleRegister,
    pub(crate) trig: [TrigTable; 3],
    pub(crate) path: ForcePath,
    pub(crate) hold: CommandRegister,
    pub(crate) engine: PhantomEngine,
}

impl Blocks {
    pub(crate) fn new(config: &PhantomConfig) -> Result<Self, ConfigError> {
        let PhantomConfig { position_width, period_width, depth_width, turns, formats, .. } = *config;
        let table = |joint: usize| TrigTable::new(position_width, depth_width, turns[joint], formats.trig);
        let second = table(1)?;
        let third = if turns[2] == turns[1] { second.clone() } else { table(2)? };
        Ok(Self {
            encoders: Encoders::new(position_width)?,
            sample: SampleRegister::new(position_width, period_width)?,
            trig: [table(0)?, second, third],
            path: ForcePath::new(config)?,
            hold: CommandRegister::new(config.command_width, period_width, config.delay)?,
            engine: PhantomEngine::new(*config)?,
        })
    }

    /// Resets every clocked block for one edge; all their outputs are then 0.
    pub(crate) fn reset(&mut self) {
        self.encoders.reset();
        self.sample.reset();
        self.trig.iter_mut().for_each(|table| _ = table.reset());
        self.hold.reset();
        self.engine.reset();
    }

    /// Returns the inputs of a loop, each as described by the block that it goes to.
    pub(crate) fn inputs(&self) -> PhantomIn<Signal> {
        let [a_pin1, b_pin1, a_pin2, b_pin2, a_pin3, b_pin3] = self.encoders.pins();
        let super::cube_room::In { x_low, x_high, y_low, y_high, z_low, z_high, room, stiffness, .. } =
            self.path.room_walls.inputs();
        let super::sample_register::In { period, .. } = self.sample.inputs();
        PhantomIn {
            a_pin1,
            b_pin1,
            a_pin2,
            b_pin2,
            a_pin3,
            b_pin3,
            x_low,
            x_high,
            y_low,
            y_high,
            z_low,
            z_high,
            room,
            stiffness,
            period,
        }
    }

    pub(crate) fn outputs(&self) -> PhantomOut<Signal> {
        let super::phantom_engine::Out { command1, command2, command3, .. } = self.engine.outputs();
        PhantomOut { command1, command2, command3 }
    }

    /// Returns the architecture signals, each as described by the block that drives it.
    pub(crate) fn nets(&self, shared: bool) -> Vec<Signal> {
        let mut all = self.encoders.nets();
        all.extend(self.encoders.outputs());
        all.extend(flatten(&self.sample.outputs()));
        let sines = flatten(&self.path.forward.inputs());
        let valid = flatten(&self.path.scale[0].inputs()).split_off(1);
        for (pair, valid) in sines.chunks(2).zip(valid) {
            all.extend_from_slice(pair);
            all.push(valid);
        }
        all.extend(flatten(&self.engine.outputs()).into_iter().take(SCALED - X));
        if !shared {
            let commands = flatten(&self.outputs());
            let scaled = ["scaled1", "scaled2", "scaled3"].into_iter().zip(commands);
            all.extend(scaled.map(|(name, command)| Signal { name, ..command }));
        }
        all
    }

    /// Returns the instances, in the order of the VHDL.
    pub(crate) fn instances(&self, shared: bool) -> Vec<Instance> {
        let row = |first: usize, count: usize| first..first + count;
        let triple = |first: usize| row(first, 3);
        let nets = |groups: &[std::ops::Range<usize>]| -> Vec<usize> { groups.iter().cloned().flatten().collect() };
        let sines = [row(SINES, 2), row(SINES + 3, 2), row(SINES + 6, 2)];
        let valid: [_; 3] = std::array::from_fn(|joint| row(SINES + 3 * joint + 2, 1));
        let period = row(PERIOD, 1);

        let mut all = self.encoders.instances(LINES, POSITIONS);
        let sample = nets(&[triple(POSITIONS), period.clone(), triple(COUNTS)]);
        all.push(instance("sample", &self.sample, &sample));
        for (joint, label) in ["trig1", "trig2", "trig3"].into_iter().enumerate() {
            all.push(instance(label, &self.trig[joint], &nets(&[row(COUNTS + joint, 1), triple(SINES + 3 * joint)])));
        }
        if shared {
            let scene = [row(X_LOW, PERIOD - X_LOW), period, row(X, SCALED - X), triple(COMMANDS)];
            all.push(instance("engine", &self.engine, &nets(&[&sines[..], &valid, &scene].concat())));
            return all;
        }
        let scene = row(X_LOW, PERIOD - X_LOW);
        all.extend(path(&self.path, &nets(&sines), &nets(&valid), &nets(&[scene]), &nets(&[row(X, MOST - X)])));
        let hold = nets(&[triple(SCALED), period, triple(COMMANDS)]);
        all.push(instance("hold", &self.hold, &hold));
        all
    }
}

/// Returns the instances of the path from sines to commands. The arguments are the nets of the sines, of their
/// validity, of the scene's words without the period, and the nets that the path drives.
pub(crate) fn path(
    path: &ForcePath,
    sines: &[usize],
    valid: &[usize],
    scene: &[usize],
    driven: &[usize],
) -> Vec<Instance> {
    let (tip, forces) = (&driven[..4], &driven[FORCES - X..=CONTACT - X]);
    let (torques, scaled) = (&driven[TORQUES - X..SCALED - X], &driven[SCALED - X..]);
    let pushed = [&[tip[0], tip[2]], &forces[..3], torques].concat();
    let mut all = vec![
        instance("forward", &path.forward, &[sines, tip].concat()),
        instance("room_walls", &path.room_walls, &[&tip[..3], scene, forces].concat()),
        instance("jacobian", &path.jacobian, &[sines, &pushed].concat()),
    ];
    for (joint, label) in ["scale1", "scale2", "scale3"].into_iter().enumerate() {
        let ports = [&[torques[joint]], valid, &[scaled[joint]]].concat();
        all.push(instance(label, &path.scale[joint], &ports));
    }
    all
}
