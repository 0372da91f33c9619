//! Drives designs alone, without their device, and tells how many clock edges `hpu` leaps over.
//!
//! Each argument is a scene with a `[dut]`. Its port connections do not count, except for constants: every other input
//! is given random words. They rest, and at every thousandth clock edge one input takes another word. With these inputs
//! the design is simulated as under `engine = "auto"`, which tells the share of edges leapt over, or why it does not
//! leap. As in a run, only outputs that drive a device end a jump: those of one bit, or all where none has one bit. The
//! design is then simulated again, by leaps beside Verilator; the words of all outputs are compared at each edge.
//!
//! A line a design: the name of the scene, the engine, the changes of outputs, and the changes with different words.
//!
//! Usage: `leaps SCENE...`
//! Exit codes: 0 no words differ, 1 some do, 2 a scene cannot be read.

use std::io::{self, Write as _};
use std::path::Path;
use std::process::ExitCode;

use hpu_cosim::dut::{Asked, Design, Designs as _, Fault, Inside, Port};
use hpu_cosim::scene::{Connection, DutScene, Experiment, SceneFile};
use hpu_rtl::dut::Simulators;
use hpu_rtl::{CacheFolder, Hdl, LeapsBeside, Setup};

/// Clock edges of a run, and those for which its inputs rest.
const EDGES: u64 = 2_000_000;
const REST: u64 = 1000;

fn simulators() -> Simulators {
    let cache = CacheFolder::new(Some(std::env::temp_dir().join("hpu-leaps")), "built models").with_programs();
    Simulators { cache, setup: Setup::new(Hdl::Carried) }
}

/// Returns the scene in a file, with the engine of its design.
fn scene(path: &str, engine: &str) -> Result<DutScene, Fault> {
    let set = [("dut.engine".to_string(), engine.to_string())];
    match SceneFile::find(path)?.parse(&set)? {
        Experiment::Dut(scene) => Ok(scene),
        _ => Err("the scene has no [dut]".into()),
    }
}

/// Returns random bits, by xorshift with a product.
fn random(state: &mut u64) -> u64 {
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    state.wrapping_mul(0x2545_f491_4f6c_dd1d)
}

/// Runs a design alone, and asks for these outputs. Returns its engine as told at the end.
fn driven(design: &dyn Design, scene: &DutScene, asked: Asked) -> Result<String, Fault> {
    let case = design.ignores_case();
    let same = |one: &str, other: &str| if case { one.eq_ignore_ascii_case(other) } else { one == other };
    let is_left_out = |port: &&Port| {
        let reset = scene.dut.reset.iter().map(|reset| &reset.port);
        let mut own = scene.dut.clocks.iter().map(|clock| &clock.port).chain(reset);
        port.is_inside || own.any(|name| same(name, &port.name))
    };
    let ports: Vec<_> = design.ports().iter().filter(|port| !is_left_out(port)).collect();
    let constant = |port: &Port| {
        let connected = scene.dut.ports.iter().find(|connected| same(&connected.port, &port.name))?;
        let Connection::Constant(word) = connected.connection else { return None };
        Some(word.cast_unsigned())
    };
    let of_width = |port: &Port, word: u64| word & u64::MAX >> (64 - port.format.width().min(64));
    let mut state = 0x9e37_79b9_7f4a_7c15;
    let first = |port: &&Port| of_width(port, constant(port).unwrap_or_else(|| random(&mut state)));
    let mut words: Vec<_> = ports.iter().map(first).collect();
    let free: Vec<_> = (0..ports.len()).filter(|at| ports[*at].is_input && constant(ports[*at]).is_none()).collect();
    let is_output = |port: &&Port, widest: u32| !port.is_input && port.format.width() <= widest;
    let widest = if ports.iter().any(|port| is_output(port, 1)) { 1 } else { 64 };
    let drives: Vec<_> = ports.iter().map(|port| asked == Asked::Driving && is_output(port, widest)).collect();
    let mut changes = Vec::new();
    let mut running = design.start(&words, &drives, &mut changes)?;
    let mut edge = 0;
    while edge < EDGES && !running.is_over() {
        edge += running.clock(&words, REST - edge % REST, asked, &mut changes)?;
        changes.clear();
        if edge % REST == 0 && !free.is_empty() {
            let at = free[(random(&mut state) >> 33) as usize % free.len()];
            words[at] = of_width(ports[at], random(&mut state) >> (state & 63));
        }
    }
    drop(running.heard());
    Ok(design.engine().to_string())
}

/// Returns what is told of a design, and whether words differ.
fn told(path: &str) -> Result<(String, bool), Fault> {
    let auto = scene(path, "auto")?;
    let engine = driven(&*simulators().build(&auto, Inside::Nothing)?, &auto, Asked::Driving)?;
    let beside = LeapsBeside::new(simulators());
    let leap = scene(path, "leap")?;
    // A design that cannot leap is not compared.
    let Ok(both) = beside.build(&leap, Inside::Nothing) else { return Ok((format!("{engine} | not compared"), false)) };
    driven(&*both, &leap, Asked::Outputs)?;
    let found = beside.found();
    let first = found.first.map_or_else(String::new, |first| format!(", the first: {first:?}"));
    let (changes, wrong) = (found.changes, found.mismatches);
    Ok((format!("{engine} | {changes} changes of outputs, {wrong} differ{first}"), wrong > 0))
}

fn main() -> ExitCode {
    let (mut is_wrong, mut is_unread) = (false, false);
    for path in std::env::args().skip(1) {
        let name = Path::new(&path).file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let line = match told(&path) {
            Ok((line, differs)) => {
                is_wrong |= differs;
                line
            }
            Err(fault) => {
                is_unread = true;
                format!("fails: {}", fault.to_string().replace('\n', " "))
            }
        };
        if writeln!(io::stdout(), "{name} | {line}").is_err() {
            break;
        }
    }
    ExitCode::from(if is_wrong { 1 } else { 2 * u8::from(is_unread) })
}
