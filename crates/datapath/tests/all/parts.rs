//! Wirings against their own parts, put together as VHDL would: what proofs compare with the VHDL is what runs.

use hpu_datapath::{
    AnyBlock, AxisFront, Block, ConventionalLoop, Generic, HybridLoop, Instance, LoopConfig, Parts, PwmConfig, Wiring,
};
use hpu_signal::Format;
use proptest::prelude::*;

use crate::cases::cases;

/// A wiring put together of its instances, knowing nothing of how the model does it.
pub struct Netlist {
    instances: Vec<Instance>,
    words: Vec<i64>,
}

impl Netlist {
    pub fn new(block: &impl Block) -> Self {
        let Parts { nets, instances } = Block::parts(block).expect("it is made of blocks");
        Self { instances, words: vec![0; nets.len()] }
    }

    /// What an instance sees: its nets by the names of its ports, and the words that it is tied to.
    fn seen(instance: &Instance, words: &[i64]) -> Vec<i64> {
        let net = |name: &str| instance.connections.iter().find(|connection| connection.port.name == name);
        let tied = |name: &str| instance.tied.iter().find(|(tied, _)| *tied == name).expect("a net or a word").1;
        instance
            .model
            .inputs()
            .iter()
            .map(|port| net(port.name).map_or_else(|| tied(port.name), |found| words[found.net]))
            .collect()
    }

    /// Evaluates the clocked instances, or the others, and puts their outputs on the nets.
    fn evaluate(&mut self, clocked: bool) {
        let now = self.words.clone();
        for instance in &mut self.instances {
            // A limiter without registers has a clock too.
            let has_register = !instance.model.generics().contains(&("SETTLING", Generic::Integer(0)));
            if (instance.model.clocked() && has_register) != clocked {
                continue;
            }
            let seen = Self::seen(instance, if clocked { &now } else { &self.words });
            let words = instance.model.tick(&seen);
            for (port, word) in instance.model.outputs().iter().zip(words) {
                let net = instance.connections.iter().find(|connection| connection.port.name == port.name).unwrap();
                self.words[net.net] = word;
            }
        }
    }

    pub fn tick(&mut self, inputs: &[i64]) -> &[i64] {
        self.words[..inputs.len()].copy_from_slice(inputs);
        // The combinational instances come in the order of the signal's way.
        self.evaluate(false);
        self.evaluate(true);
        self.evaluate(false);
        &self.words
    }
}

/// Words of every input but the pins, and for how many edges: each time a place of the encoder, and the words.
type Motion = Vec<(i64, Vec<u32>, u64)>;

/// Moves of an encoder, at times impossible ones, with other words now and then.
fn motion() -> impl Strategy<Value = Motion> {
    let step = prop::sample::select(vec![1i64, 1, 1, 1, 3, 3, 0, 2]);
    let words = prop_oneof![3 => Just(Vec::new()), 1 => prop::collection::vec(any::<u32>(), 5)];
    prop::collection::vec((step, words, prop_oneof![1u64..9, 1u64..300]), 1..40)
}

/// The inputs of each edge.
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

/// Small widths, all different, so that everything wraps, saturates and rounds within a few edges.
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

proptest! {
    #![proptest_config(cases(256))]

    #[test]
    fn haptic_loops_are_their_parts(motion in motion(), settling in 0u32..4, latched in any::<bool>()) {
        let config = LoopConfig { settling, pwm: PwmConfig { latched, ..small().pwm }, ..small() };
        equals_its_parts(HybridLoop::new(config).unwrap(), &motion);
        equals_its_parts(ConventionalLoop::new(config).unwrap(), &motion);
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
