//! Compares wirings with their own parts, connected as VHDL would connect them: proofs compare these parts with the
//! VHDL.

use hpu_datapath::{
    AnyBlock, AxisFront, Block, ConventionalLoop, CouplingConfig, Generic, HybridLoop, Instance, LawWidths, LoopConfig,
    MethodLoop, MethodLoopConfig, PwmConfig, Shaping, VirtualCoupling, Wiring,
};
use hpu_signal::{Format, Signal};
use proptest::prelude::*;

use crate::cases::cases;

/// A wiring assembled from its instances, down to those that are not made of blocks. It does not use the model's own
/// code for the wiring.
pub struct Netlist {
    leaves: Vec<Leaf>,
    words: Vec<i64>,
    nets: usize,
}

struct Leaf {
    model: Box<dyn AnyBlock>,
    /// The net of each input, or the constant that it is tied to.
    inputs: Vec<Result<usize, i64>>,
    outputs: Vec<usize>,
}

impl Netlist {
    pub fn new(block: &impl Block) -> Self {
        let parts = Block::parts(block).expect("it is made of blocks");
        let nets = parts.nets.len();
        let mut netlist = Self { leaves: Vec::new(), words: vec![0; nets], nets };
        netlist.place(parts.instances, &(0..nets).collect::<Vec<_>>());
        netlist
    }

    /// Connects instances to these nets.
    fn place(&mut self, instances: Vec<Instance>, nets: &[usize]) {
        for Instance { model, connections, tied, .. } in instances {
            let net = |name: &str| connections.iter().find(|at| at.port.name == name).map(|at| nets[at.net]);
            let word = |name: &str| tied.iter().find(|(port, _)| *port == name).expect("a net or a word").1;
            let of = |port: Signal| net(port.name).ok_or_else(|| word(port.name));
            let inputs: Vec<_> = model.inputs().into_iter().map(of).collect();
            let outputs: Vec<_> = model.outputs().iter().map(|port| net(port.name).expect("a net")).collect();
            match model.parts() {
                Some(parts) => {
                    let mut inside: Vec<_> = inputs.into_iter().map(|input| input.expect("a net")).collect();
                    inside.extend(outputs);
                    let more = parts.nets.len() - inside.len();
                    inside.extend((0..more).map(|net| self.words.len() + net));
                    self.words.resize(self.words.len() + more, 0);
                    self.place(parts.instances, &inside);
                }
                None => self.leaves.push(Leaf { model, inputs, outputs }),
            }
        }
    }

    /// Evaluates the clocked instances, or the others, and puts their outputs on the nets.
    fn evaluate(&mut self, clocked: bool) {
        let now = self.words.clone();
        for Leaf { model, inputs, outputs } in &mut self.leaves {
            // A limiter or a shaper without registers is clocked too.
            let without = [("SETTLING", Generic::Integer(0)), ("ENABLED", Generic::Boolean(false))];
            let has_registers = model.clocked() && !model.generics().iter().any(|generic| without.contains(generic));
            if has_registers != clocked {
                continue;
            }
            let words = if clocked { &now } else { &self.words };
            let seen: Vec<_> = inputs.iter().map(|input| input.map_or_else(|word| word, |net| words[net])).collect();
            for (word, &net) in model.tick(&seen).into_iter().zip(outputs.iter()) {
                self.words[net] = word;
            }
        }
    }

    /// Returns the words of the wiring's own nets after an edge with these inputs.
    pub fn tick(&mut self, inputs: &[i64]) -> &[i64] {
        self.words[..inputs.len()].copy_from_slice(inputs);
        // The combinational instances stand in the order of the signal path.
        self.evaluate(false);
        self.evaluate(true);
        self.evaluate(false);
        &self.words[..self.nets]
    }
}

/// A list of steps: the position of the encoder, the words of all inputs but the pins, and the number of edges.
type Motion = Vec<(i64, Vec<u32>, u64)>;

/// Returns moves of an encoder, at times impossible ones, with new words now and then.
fn motion() -> impl Strategy<Value = Motion> {
    let step = prop::sample::select(vec![1i64, 1, 1, 1, 3, 3, 0, 2]);
    let words = prop_oneof![3 => Just(Vec::new()), 1 => prop::collection::vec(any::<u32>(), 5)];
    prop::collection::vec((step, words, prop_oneof![1u64..9, 1u64..300]), 1..40)
}

/// Returns the inputs of each edge.
fn edges(block: &dyn AnyBlock, motion: &Motion) -> Vec<Vec<i64>> {
    let signals = block.inputs();
    let (mut inputs, mut words, mut place) = (Vec::new(), vec![0; signals.len()], 0i64);
    for (step, scene, stay) in motion {
        place += step;
        words[..2].copy_from_slice(&[[0, 0], [0, 1], [1, 1], [1, 0]][place.rem_euclid(4) as usize]);
        for ((word, signal), bits) in words.iter_mut().zip(&signals).skip(2).zip(scene) {
            *word = signal.format.from_bits(u64::from(*bits));
        }
        inputs.extend((0..*stay).map(|_| words.clone()));
    }
    inputs
}

fn equals_its_parts<W: Wiring>(mut wiring: W, motion: &Motion) {
    let mut netlist = Netlist::new(&wiring);
    for (edge, words) in edges(&wiring, motion).iter().enumerate() {
        AnyBlock::tick(&mut wiring, words);
        assert_eq!(wiring.words(), netlist.tick(words), "edge {edge}");
    }
}

/// Returns small widths, all different, so that everything wraps, saturates and rounds within a few edges.
fn small() -> LoopConfig {
    LoopConfig {
        position_width: 6,
        stiffness: Format::new(false, 5, 2).unwrap(),
        damping: Format::new(false, 3, 2).unwrap(),
        period_width: 8,
        velocity_width: 4,
        rescaled: true,
        scale: Format::new(false, 2, 1).unwrap(),
        pwm: PwmConfig { width: 9, ..PwmConfig::default() },
        ..LoopConfig::default()
    }
}

/// Returns such widths for a law.
fn widths() -> LawWidths {
    LawWidths {
        width: 7,
        stiffness: Format::new(false, 3, 2).unwrap(),
        damping: Format::new(false, 2, 2).unwrap(),
        period_width: 8,
        scale: Format::new(false, 2, 1).unwrap(),
        torque_width: 6,
    }
}

proptest! {
    #![proptest_config(cases(256))]

    #[test]
    fn haptic_loops_are_their_parts(motion in motion(), settling in 0u32..4, latched in any::<bool>()) {
        let config = LoopConfig { settling, pwm: PwmConfig { latched, ..small().pwm }, ..small() };
        equals_its_parts(HybridLoop::new(config).unwrap(), &motion);
        equals_its_parts(ConventionalLoop::new(config).unwrap(), &motion);
    }

    #[test]
    fn a_method_loop_is_its_parts(motion in motion(), shaped in any::<bool>()) {
        let pwm = PwmConfig { width: 6, ..PwmConfig::default() };
        let shaping = Shaping { phase: 3, b: [1 << 29, -1 << 29, 0], a: [0, 0] };
        let config = MethodLoopConfig { pwm, shaping: shaped.then_some(shaping) };
        // This law's torque is a register. An instance with a path from input to output could not be assembled in this
        // way.
        let law = VirtualCoupling::new(CouplingConfig { widths: widths(), ..CouplingConfig::default() }).unwrap();
        equals_its_parts(MethodLoop::new(law, config).unwrap(), &motion);
    }

    #[test]
    fn the_front_is_its_parts(motion in motion()) {
        let mut front = AxisFront::new(5).unwrap();
        let mut netlist = Netlist::new(&front);
        for (edge, words) in edges(&front, &motion).iter().enumerate() {
            let outputs = AnyBlock::tick(&mut front, words);
            assert_eq!(outputs, netlist.tick(words)[words.len()..][..outputs.len()], "edge {edge}");
        }
    }
}
