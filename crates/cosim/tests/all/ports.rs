//! Ports of a design, and their bits: each connection reaches its own bits and no others.

use std::sync::{Arc, Mutex};

use hpu_cosim::dut::{Asked, Change, Design, Designs, DutSimulation, Fault, Inside, Port, RunningDesign};
use hpu_cosim::{ANGLE, Control, Simulation, Summary};
use hpu_scene::{DutScene, Experiment, Layout};
use hpu_signal::Format;

/// A design whose outputs have constant bits, and which remembers the bits of its inputs.
#[derive(Clone)]
struct Fixed {
    ports: Vec<Port>,
    outputs: Vec<(usize, u64)>,
    seen: Arc<Mutex<Vec<u64>>>,
}

impl Designs for Fixed {
    fn build(&self, _: &DutScene, _: Inside) -> Result<Arc<dyn Design>, Fault> {
        Ok(Arc::new(self.clone()))
    }
}

impl Design for Fixed {
    fn ports(&self) -> &[Port] {
        &self.ports
    }
    fn ignores_case(&self) -> bool {
        true
    }
    fn engine(&self) -> &str {
        "none"
    }
    fn start(&self, words: &[u64], _: &[bool], changes: &mut Vec<Change>) -> Result<Box<dyn RunningDesign>, Fault> {
        *self.seen.lock().unwrap() = words.to_vec();
        changes.extend(self.outputs.iter().map(|&(port, bits)| Change { edge: 0, port, bits: Some(bits) }));
        Ok(Box::new(self.clone()))
    }
}

impl RunningDesign for Fixed {
    fn clock(&mut self, _: &[u64], edges: u64, _: Asked, _: &mut Vec<Change>) -> Result<u64, Fault> {
        Ok(edges)
    }
}

fn port(name: &str, is_input: bool, format: Format) -> Port {
    let layout = Layout::vector(format.width());
    Port {
        name: name.into(),
        is_input,
        format,
        is_inside: false,
        is_number: false,
        is_quantity: false,
        layout,
        default: None,
    }
}

/// Runs a design with the inputs `clk`, `ab` (2 bits) and `word` (16 bits, signed) and the output `io` (8 bits), whose
/// bits are `io`. Returns the bits of `ab` and `word` at the start, and the angle at the end.
fn run(ports: &str, io: u64) -> Result<([u64; 2], f64), String> {
    let (words, angle_rad, _) = run_at("wall = { position = '1.5 rad' }", ports, io)?;
    Ok((words, angle_rad))
}

/// Does the same with this wall, and returns the summary too.
fn run_at(wall: &str, ports: &str, io: u64) -> Result<([u64; 2], f64, Summary), String> {
    let text = format!(
        "about = 'A.'\ndevice = {{ kind = 'motor', motor = 'vasudevan_2007' }}\nclock = {{ frequency = '1 MHz' }}\n\
         {wall}\nhand = {{ kind = 'none' }}\nrun = {{ duration = '2 ms' }}\n\
         [dut]\nfiles = ['a.vhd']\ntop = 'a'\nclock = 'clk'\n[dut.ports]\n{ports}\n"
    );
    let scene = Experiment::parse("x.toml", &text, &[], &mut |_| Ok(Vec::new())).map_err(|error| error.to_string())?;
    let Experiment::Dut(scene) = scene else { panic!("a design") };
    let seen = Arc::default();
    let design = Fixed {
        ports: vec![
            port("clk", true, Format::BIT),
            port("ab", true, Format::unsigned(2)),
            port("word", true, Format::signed(16)),
            port("io", false, Format::unsigned(8)),
        ],
        outputs: vec![(2, io)],
        seen: Arc::clone(&seen),
    };
    let simulation = DutSimulation::new(&scene, &design, Inside::Nothing).map_err(|error| error.to_string())?;
    let mut trace = simulation.trace(&[]);
    let summary = simulation.run(false, &mut trace, &mut (), &Control::default()).map_err(|error| error.to_string())?;
    let words = seen.lock().unwrap().clone();
    Ok(([words[0], words[1]], trace.last(ANGLE).unwrap(), summary))
}

/// All inputs connected, and the output open but for what is given.
const INPUTS: &str = "ab = [1, 0]\nword = -2\n";

#[test]
fn each_bit_of_an_input_has_its_own_connection() {
    let words = |ports: &str| run(&format!("{ports}\n'io[0]' = 'bridge.pwm'\n'io[1]' = 'bridge.direction'"), 0);
    let of = |ports: &str| words(ports).map(|(words, _)| words).unwrap_or_else(|error| panic!("{ports}: {error}"));
    assert_eq!(of("ab = [1, 0]\nword = -2"), [0b10, 0xfffe]);
    assert_eq!(of("ab = [0, true]\nword = 2"), [0b01, 2]);
    assert_eq!(of("'ab(1)' = 1\n'AB(0)' = 0\n'word(15 downto 8)' = -1\n'word[7:0]' = 5"), [0b10, 0xff05]);
    // Both lines are 0 at the start. The wall is 978 counts of a 4096th turn away.
    assert_eq!(
        of("ab = ['not encoder.a', 'encoder.b']\n'word[15:11]' = 3\n'word[10:0]' = 'wall.count'"),
        [0b10, 3 << 11 | 978]
    );
    let refused = |ports: &str| words(ports).unwrap_err();
    for (ports, said) in [
        ("ab = [1, 0, 1]\nword = 0", "dut.ports.ab[0]: ab (in, 2 bits) has not the 3 bit(s) of the list"),
        ("'ab(2)' = 1\nword = 0", "dut.ports.ab(2): ab (in, 2 bits) has no such bits"),
        ("'ab(1)' = 1\nword = 0", "not all bits of the input ab (in, 2 bits) are connected"),
        ("ab = 1\n'ab(0)' = 1\nword = 0", "these bits of ab (in, 2 bits) are connected to 1 too"),
        ("ab = [1, 'encoder.count']\nword = 0", "dut.ports.ab[1]: encoder.count is not one bit"),
        ("'ab(1)' = [1]\n'ab(0)' = 1\nword = 0", "a list is for all bits of a port"),
        ("ab = 1\n'word[3:0]' = 16\n'word[15:4]' = 0", "16 does not fit word (in, 16 bits)"),
    ] {
        let error = refused(ports);
        assert!(error.contains(said), "{ports}: {error}");
    }
}

#[test]
fn bits_of_an_output_drive_the_device() {
    let angle = |ports: &str, io: u64| run(&format!("{INPUTS}{ports}"), io).map(|(_, angle)| angle);
    let separate = "'io[6]' = 'bridge.pwm'\n'io[2]' = 'bridge.direction'";
    let forward = angle(separate, 0b0100_0100).unwrap();
    let backward = angle(separate, 0b0100_0000).unwrap();
    assert!(forward > 0.0 && forward == -backward, "{forward} {backward}");
    assert_eq!(angle(separate, 0b1011_1111), Ok(0.0));
    let list = "io = ['open', 'bridge.pwm', 'open', 'open', 'open', 'bridge.direction', 'open', 'open']";
    assert_eq!(angle(list, 0b0100_0100), Ok(forward));
    let inverted = "io = ['open', 'not bridge.pwm', 'open', 'open', 'open', 'bridge.direction', 'open', 'open']";
    assert_eq!(angle(inverted, 0b1011_1111), Ok(forward));
    // A word of four bits in the middle: 7/8 of the supply, and as much the other way.
    let word = "'io(5 downto 2)' = { is = 'bridge.duty', format = '(1,0,3)' }";
    let (most, least) = (angle(word, 0b1101_1111).unwrap(), angle(word, 0b1110_0111).unwrap());
    assert!(most > 0.0 && most == -least, "{most} {least}");
    // A pulse without a direction drives in the positive one, and a design without outputs leaves the bridge open.
    assert_eq!(angle("'io[6]' = 'bridge.pwm'", 0b0100_0000), Ok(forward));
    assert_eq!(angle("", 0xff), Ok(0.0));
    let twice = angle("'io[6]' = 'bridge.pwm'\n'io[2]' = 'bridge.pwm'\n'io[1]' = 'bridge.direction'", 0).unwrap_err();
    assert!(twice.contains("two drivers: `io[6]` and `io[2]` are both connected to bridge.pwm"), "{twice}");
}

#[test]
fn a_design_without_a_wall_has_no_contact() {
    let (_, with, summary) = run_at("wall = { position = '1.5 rad' }", INPUTS, 0).unwrap();
    assert_eq!((summary.contact_share, summary.device_contact_share), (Some(0.0), Some(0.0)));
    let (_, without, summary) = run_at("", INPUTS, 0).unwrap();
    assert_eq!((summary.contact_share, summary.device_contact_share), (None, None));
    assert_eq!(with, without);
    let counted = run_at("", "ab = 0\nword = 'wall.count'", 0).unwrap_err();
    assert!(counted.contains("dut.ports.word: the scene has no wall; write [wall] with its position"), "{counted}");
}
