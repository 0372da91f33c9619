//! The nets of the two haptic loops, and the ports that are connected to them.

use hpu_signal::Signal;

use crate::loop_config::Blocks;
use crate::{Block, Connection, Instance, flatten};

/// The index of every net; the indices of the four gates are consecutive.
#[derive(Clone, Copy)]
pub(crate) struct Nets {
    a_pin: usize,
    b_pin: usize,
    reference: usize,
    stiffness: usize,
    damping: usize,
    period: usize,
    scale: usize,
    pub(crate) gates: usize,
    pub(crate) a: usize,
    pub(crate) b: usize,
    pub(crate) step: usize,
    pub(crate) error: usize,
    pub(crate) position: usize,
    /// The position that the wall reads: the held one in the conventional loop, else the counter's.
    pub(crate) held: usize,
    pub(crate) delta: usize,
    pub(crate) contact: usize,
    pub(crate) penetration: usize,
    pub(crate) spring: usize,
    pub(crate) velocity: usize,
    pub(crate) drag: usize,
    pub(crate) torque: usize,
    pub(crate) command: usize,
}

impl Nets {
    /// The number of nets of the loop that has more of them, the conventional one.
    pub(crate) const MOST: usize = 25;

    pub(crate) const fn new(held: bool) -> Self {
        let after = if held { 16 } else { 15 };
        Self {
            a_pin: 0,
            b_pin: 1,
            reference: 2,
            stiffness: 3,
            damping: 4,
            period: 5,
            scale: 6,
            gates: 7,
            a: 11,
            b: 12,
            step: 13,
            error: 14,
            position: 15,
            held: after,
            delta: after + 1,
            contact: after + 2,
            penetration: after + 3,
            spring: after + 4,
            velocity: after + 5,
            drag: after + 6,
            torque: after + 7,
            command: after + 8,
        }
    }

    /// Returns the indices of the nets that can lose bits.
    pub(crate) const fn lossy(&self) -> [usize; 4] {
        [self.spring, self.velocity, self.drag, self.command]
    }
}

/// Returns the architecture signals, each as described by the block that drives it.
pub(crate) fn nets(blocks: &Blocks, held: bool) -> Vec<Signal> {
    let mut all = flatten(&blocks.decoder.inputs());
    all.extend(flatten(&blocks.decoder.outputs()));
    all.push(blocks.counter.outputs().position);
    if held {
        let doc = "Position of the latest sample edge";
        all.push(Signal { name: "held", doc, ..blocks.hold.outputs().q });
    }
    all.extend(flatten(&blocks.path.offset.outputs()));
    all.extend(flatten(&blocks.path.wall.outputs()));
    let torque = blocks.path.sum.inputs();
    all.push(torque.spring);
    all.push(blocks.velocity_reg.outputs().velocity);
    all.push(Signal { name: "drag", ..torque.damping });
    all.push(blocks.path.sum.outputs().torque);
    all.push(Signal { name: "command", ..blocks.limiter.outputs().limited });
    all
}

/// Returns the instances, in the order of the VHDL.
pub(crate) fn instances(blocks: &Blocks, net: &Nets, held: bool) -> Vec<Instance> {
    let mut all = vec![
        instance("sync", &blocks.sync, &[net.a_pin, net.b_pin, net.a, net.b]),
        instance("decoder", &blocks.decoder, &[net.a, net.b, net.step, net.error]),
        instance("counter", &blocks.counter, &[net.step, net.position]),
    ];
    if held {
        all.push(instance("hold", &blocks.hold, &[net.position, net.period, net.held]));
    }
    all.extend([
        instance("offset", &blocks.path.offset, &[net.held, net.reference, net.delta]),
        instance("wall", &blocks.path.wall, &[net.delta, net.contact, net.penetration]),
        instance("spring_mult", &blocks.path.spring_mult, &[net.penetration, net.stiffness, net.spring]),
        instance("velocity_reg", &blocks.velocity_reg, &[net.position, net.period, net.scale, net.velocity]),
        instance("damping_mult", &blocks.path.damping_mult, &[net.velocity, net.damping, net.drag]),
        instance("sum", &blocks.path.sum, &[net.spring, net.drag, net.contact, net.torque]),
        instance("limiter", &blocks.limiter, &[net.torque, net.command]),
        instance(
            "modulator",
            &blocks.modulator,
            &[net.command, net.gates, net.gates + 1, net.gates + 2, net.gates + 3],
        ),
    ]);
    all
}

/// Returns an instance whose ports, inputs first, are connected to these nets.
pub(crate) fn instance<B: Block + Clone + 'static>(label: &'static str, block: &B, nets: &[usize]) -> Instance {
    let mut ports = flatten(&block.inputs());
    ports.extend(flatten(&block.outputs()));
    debug_assert_eq!(ports.len(), nets.len());
    let connections = ports.into_iter().zip(nets).map(|(port, &net)| Connection { port, net }).collect();
    let mut model = Box::new(block.clone());
    Block::reset(&mut *model);
    Instance { label, model, connections, tied: Vec::new(), generics: Vec::new() }
}
