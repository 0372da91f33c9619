//! A `[dut]` and the library: the same outputs move the same device to the bit.

use std::path::PathBuf;
use std::sync::Arc;

use hpu::{Block, Plant};
use hpu_cosim::dut::{Asked, Change, Design, Designs, DutSimulation, Fault, Inside, Port, RunningDesign};
use hpu_cosim::scene::{DutScene, Experiment, Layout};
use hpu_cosim::{Control, SceneFile, Simulation};
use hpu_signal::{Format, Signal};

use crate::common::{here, set, shipped};

/// The loop in words, in the place of a simulator of its VHDL.
struct InWords {
    ports: Vec<Port>,
}

fn block() -> Block {
    Block::new("hybrid_loop", &set(&["DAMPING_FRAC=4"])).expect("the loop")
}

impl InWords {
    fn new() -> Self {
        let block = block();
        let port = |signal: &Signal, is_input| Port {
            name: signal.name.to_string(),
            is_input,
            format: Format::unsigned(signal.format.width()),
            is_inside: false,
            is_number: false,
            is_quantity: false,
            layout: Layout::vector(signal.format.width()),
            default: None,
        };
        let timing = ["clk", "rst"].map(|name| port(&Signal::bit(name, ""), true));
        let inputs = block.inputs().iter().map(|signal| port(signal, true));
        let outputs = block.outputs().iter().map(|signal| port(signal, false));
        Self { ports: timing.into_iter().chain(inputs).chain(outputs).collect() }
    }
}

impl Design for InWords {
    fn ports(&self) -> &[Port] {
        &self.ports
    }
    fn ignores_case(&self) -> bool {
        true
    }
    fn engine(&self) -> &str {
        "words"
    }
    fn start(&self, _: &[u64], _: &[bool], changes: &mut Vec<Change>) -> Result<Box<dyn RunningDesign>, Fault> {
        let mut block = block();
        let outputs = block.reset();
        changes.extend((0..4).map(|gate| Change { edge: 0, port: 7 + gate, bits: Some(0) }));
        Ok(Box::new(RunningWords { block, outputs }))
    }
}

struct RunningWords {
    block: Block,
    outputs: Vec<i64>,
}

impl RunningDesign for RunningWords {
    fn clock(&mut self, words: &[u64], edges: u64, _: Asked, changes: &mut Vec<Change>) -> Result<u64, Fault> {
        let inputs: Vec<_> = words[..7].iter().map(|word| word.cast_signed()).collect();
        for edge in 1..=edges {
            let now = self.block.tick(&inputs)?;
            if now != self.outputs {
                let changed = (0..4).filter(|&gate| now[gate] != self.outputs[gate]);
                changes.extend(changed.map(|gate| Change { edge, port: 7 + gate, bits: Some(now[gate] as u64) }));
                self.outputs = now;
                return Ok(edge);
            }
        }
        Ok(edges)
    }
}

impl Designs for InWords {
    fn build(&self, _: &DutScene, _: Inside) -> Result<Arc<dyn Design>, Fault> {
        Ok(Arc::new(Self::new()))
    }
}

/// The scene `hybrid-wall` with `hdl/hybrid_loop.vhd` in a `[dut]`, with the words of the method as constants.
fn scene() -> SceneFile {
    let plant = Plant::open(&shipped("hybrid-wall"), &[]).expect("a plant");
    let constants = plant.inputs().iter().zip(plant.words()).skip(2).take(5);
    let constants: String = constants.map(|(signal, word)| format!("{} = {word}\n", signal.name)).collect();
    let text = format!(
        r#"
about = "The hybrid wall as a design."
device = {{ kind = "motor", motor = "vasudevan_2007", wheel_ratio = 7 }}
clock = {{ frequency = "50 MHz" }}
wall = {{ position = "0.05 rad" }}
run = {{ duration = "100 ms" }}
hand = {{ kind = "spring_damper", stiffness = "0.3 N.m/rad", damping = "0.1 mN.m.s/rad", path = [[0, 0], [0.1, 0.2]] }}
[dut]
files = ["hybrid_loop.vhd"]
top = "hybrid_loop"
clock = "clk"
reset = {{ port = "rst" }}
[dut.ports]
a_pin = "encoder.a"
b_pin = "encoder.b"
{constants}
a_high = "bridge.minus_high"
a_low = "bridge.minus_low"
b_high = "bridge.plus_high"
b_low = "bridge.plus_low"
"#
    );
    let text = text.replace("reference = 978", "reference = 33");
    SceneFile { name: "mine.toml".to_string(), text, data: here().join("../../hdl"), is_shipped: false }
}

#[test]
fn a_design_pin_by_pin_moves_as_in_a_dut_to_the_bit() {
    let file = scene();
    let experiment = file.parse(&[]).expect("a scene");
    let Experiment::Dut(scene) = &experiment else { panic!("a design") };
    let simulation = DutSimulation::new(scene, &InWords::new(), Inside::Nothing).expect("a simulation");
    let mut trace = simulation.brief_trace();
    let ran = simulation.run(false, &mut trace, &mut (), &Control::default()).expect("a run");

    let (mut plant, mut block) = (Plant::open(&file, &[]).expect("a plant"), block());
    let names: Vec<_> = plant.inputs().iter().map(|input| input.name).collect();
    let ports = ["a_pin", "b_pin", "reference", "stiffness", "damping", "period", "scale"];
    assert_eq!(names, [&ports[..], &["index", "count", "contact"]].concat());
    assert_eq!(plant.words()[2], 33);
    let (mut contact, mut touched) = (0, false);
    while plant.advance(1).is_ok() {
        plant.drive(&block.tick(&plant.words()[..7]).expect("words that fit")).expect("outputs that fit");
        contact += plant.words()[9];
        touched |= plant.words()[8] > 33;
    }
    let summary = plant.summary();
    assert_eq!(format!("{:?}", summary.energy), format!("{:?}", ran.energy));
    assert_eq!((plant.edge(), summary.encoder_edges), (ran.edges, ran.encoder_edges));
    assert!(contact > 0 && touched && ran.output_changes > 1000, "{contact} edges of contact");
}

#[test]
fn the_words_of_a_design_push_along_the_positive_direction() {
    let file = scene();
    let (before, gates) = file.text.split_once("a_high").expect("the gates");
    assert!(gates.contains("bridge"), "{gates}");
    let text = format!("{before}duty = {{ is = \"bridge.duty\", format = \"(1,0,11)\" }}\n");
    let file = SceneFile { text, data: PathBuf::from(&file.data), ..file };
    let mut plant = Plant::open(&file, &set(&["hand={ kind = \"none\" }"])).expect("a plant");
    let outputs: Vec<_> = plant.outputs().iter().map(|output| output.name).collect();
    assert_eq!(outputs, ["duty"]);
    plant.drive(&[100]).expect("a duty");
    plant.advance(100_000).expect("a run");
    assert!(plant.state(1).expect("a speed") > 0.0 && plant.words()[8] > 0);
}

/// The word of a design that pushes at the bridge's whole voltage is as good as its gates: pulse and direction of
/// `knee.toml` turn the motor, an inverted pair of gates would short the supply.
#[test]
fn outputs_of_a_design_are_its_ports() {
    let data = here().join("../../testbench/dut");
    let text = std::fs::read_to_string(data.join("knee.toml")).expect("a scene");
    let knee = SceneFile { name: "knee.toml".to_string(), text, data, is_shipped: false };
    let mut plant = Plant::open(&knee, &set(&["hand={ kind = \"none\" }"])).expect("a plant");
    let inputs: Vec<_> = plant.inputs().iter().map(|input| input.name).collect();
    assert_eq!(inputs, ["enc_a", "enc_b", "gain", "wall", "index", "count", "contact"]);
    let outputs: Vec<_> = plant.outputs().iter().map(|output| output.name).collect();
    assert_eq!(outputs, ["pwm", "dir"]);
    assert_eq!(plant.words()[2], 95);
    let turned = |plant: &mut Plant| {
        plant.advance(20_000).expect("a run");
        plant.state(1).expect("a speed")
    };
    plant.drive(&[1, 1]).expect("forward");
    assert!(turned(&mut plant) > 0.0);
    plant.set(1, 0).expect("backward");
    assert!(turned(&mut plant) < 0.0);
    let error = plant.set(2, 0).expect_err("two outputs").to_string();
    assert!(error.contains("no output 2; accepted: 0 to 1"), "{error}");

    let (before, _) = knee.text.split_once("pwm = ").expect("the pulse");
    let (_, after) = knee.text.split_once("dir = \"bridge.direction\"").expect("the direction");
    let gates = "ah = \"bridge.minus_high\"\nal = \"not bridge.minus_low\"\nbh = \"bridge.plus_high\"\n\
                 bl = \"bridge.plus_low\"\n";
    let file = SceneFile { text: format!("{before}{gates}{after}"), data: PathBuf::from(&knee.data), ..knee };
    let mut plant = Plant::open(&file, &[]).expect("a plant");
    let error = plant.drive(&[1, 0, 0, 1]).expect_err("a short").to_string();
    assert!(error.contains("both switches of the minus leg are closed at clock edge 0"), "{error}");
    plant.drive(&[1, 1, 0, 1]).expect("no short");
}
